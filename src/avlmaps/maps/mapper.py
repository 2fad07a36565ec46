"""The one maker of maps: frames and sound in, a map out at any time.

A build gives it the frames of a recording, a robot those that it takes, a program its own. What frames brought is a
``MapState``; the states of stretches of a recording, from other runs or machines, add up to the map of all of it.
"""

from collections.abc import Iterator
from dataclasses import replace
from threading import RLock
from time import perf_counter
from typing import Any

import numpy as np

from avlmaps.core.arrays import Float, Int32
from avlmaps.core.camera import Rig
from avlmaps.core.columns import concat
from avlmaps.core.errors import BackendError, MapError
from avlmaps.core.progress import silence_progress
from avlmaps.core.registry import Kind
from avlmaps.core.timeline import Trajectory
from avlmaps.core.version import __version__
from avlmaps.maps import finish
from avlmaps.maps.estimate import Start, doubts_of_walk, estimate_ground, estimate_up
from avlmaps.maps.frame_sums import FrameSums, HeldFrames, MapState, SubmapBook, Walked
from avlmaps.maps.fusion.accumulator import VoxelAccumulator
from avlmaps.maps.fusion.free_space import FreeViews, ThroughCounts
from avlmaps.maps.fusion.submaps import MovedSubmaps, submap_of
from avlmaps.maps.grid import GridSpec
from avlmaps.maps.hearing import Hearing
from avlmaps.maps.keyframes import KeyframeAlbum, KeyframeChooser
from avlmaps.maps.perceived import encode_pixels, require_unit
from avlmaps.maps.plan import BUILD_VERSION, models_of
from avlmaps.maps.pose_correction import PoseCorrection
from avlmaps.maps.settings import SUBMAP_FRAMES, BuildSettings
from avlmaps.maps.store.manifest import BadFrame, Counts, MapBounds, MapInfo, ModelInfo, Removed, RigInfo, Timings
from avlmaps.maps.store.map_data import GIVEN_FEATURES, MapData
from avlmaps.maps.store.tables import key_of
from avlmaps.maps.types import Submaps, Voxels
from avlmaps.perception.encoders import Encoders
from avlmaps.recordings.memory import next_of
from avlmaps.recordings.types import Frame, Recording

_PLACES = 2  # number of what learns places as a source of randomness (gravity has 1)
_MOST_DOUBTS = 5


class Mapper:
    """Takes frames and sound, in the order of time, and makes maps of what came.

    One thread may add frames and one sound while another makes snapshots. ``start`` is up, the floor and the depth
    camera: None until the first frames show them. ``began_s`` is ``perf_counter`` when the work began.
    """

    def __init__(
        self,
        settings: BuildSettings,
        encoders: Encoders,
        up_in_world: Float[np.ndarray, "3"] | None = None,
        *,
        first_frames: int | None = None,
        behind: bool = False,
        begins_s: float = 0.0,
    ) -> None:
        """Begin without frames.

        Up, where ``up_in_world`` is None, the floor and the sensor are found in ``first_frames`` (``gravity.frames`` if
        None). With ``behind``, another thread makes snapshots, and looks at keyframes. ``begins_s`` is what the clock
        said at time 0. Of ``settings.frames`` only ``per_submap`` counts.
        """
        self.settings, self.encoders = settings.for_profile(encoders.weight_variance_m2), encoders
        self.start: Start | None = None
        self._up, self._begins_s, self._behind = up_in_world, begins_s, behind
        self._wait = min(first_frames or settings.gravity.frames, settings.gravity.frames)
        self._recording: Recording | None = None
        self._key = ""
        self.began_s = perf_counter()
        # What the thread that adds frames writes, under ``_adding``.
        self._adding = RLock()
        self._rig: Rig | None = None
        self._last_s: float | None = None
        self._first: list[tuple[Frame, Any, bool]] = []
        self._held, self._walked = HeldFrames(settings.gravity.frames), Walked()
        self._sums = FrameSums(self.settings, encoders)
        self._chooser = KeyframeChooser[Frame](settings.keyframes)
        self._chosen: frozenset[int] | None = None
        self._is_due = False  # a frame that was to be a keyframe was left out
        self._undescribed: list[Frame] = []
        self._left_out: list[BadFrame] = []
        # What a snapshot writes, under ``_finishing``, which it holds for seconds; frames are added meanwhile.
        self._finishing = RLock()
        self._whole: VoxelAccumulator | None = None
        self._views: list[FreeViews] = []
        self._fused, self._stamps_s, self._poses = 0, list[float](), list[np.ndarray]()
        self._book = SubmapBook()
        self._album = KeyframeAlbum(encoders, self.settings.keyframes)
        self._surfaces: tuple[Voxels, Removed] | None = None
        self._through: ThroughCounts | None = None
        # How many frames had come when up and the floor were last found, and when contradictions were last looked for.
        self._looked_at = self._checked = 0
        self.hearing = Hearing(encoders, self.settings.hearing, None, name_first=behind)
        self._found: tuple[str, ...] = ()  # by the check of the frames that are held
        self._at_the_end: tuple[str, ...] = ()
        self._told: list[str] = []

    @classmethod
    def of_recording(
        cls, recording: Recording, settings: BuildSettings, encoders: Encoders, start: Start,
        keyframes: frozenset[int], key: str = "", doubts: tuple[str, ...] = (),
    ) -> "Mapper":  # fmt: skip
        """Return a mapper of frames of a recording, of which is known what all of it shows.

        Its frames will be added, or their states; the sound is the recording's. ``keyframes`` are numbers of frames,
        ``key`` is the hash of all that goes into the map, ``doubts`` says what is odd about it.
        """
        mapper = cls(settings, encoders, recording.up_in_world, begins_s=recording.begins_s)
        mapper._recording, mapper._rig, mapper.start = recording, recording.rig, start
        mapper._chosen, mapper._key, mapper._told = keyframes, key, list(doubts)
        mapper.hearing = Hearing(encoders, mapper.settings.hearing, recording.audio, name_first=False)
        return mapper

    def __len__(self) -> int:
        """Return how many frames are in the map."""
        with self._adding:
            return self._fused + len(self._sums) + len(self._first)

    @property
    def next_index(self) -> int:
        """The number of the next frame."""
        return len(self) + len(self._left_out)

    @property
    def dim(self) -> int | None:
        """Length of a feature; None where that is not known yet."""
        return self.encoders.card(Kind.PIXELS).dim if Kind.PIXELS in self.encoders else self._sums.dim or None

    @property
    def last_stamp_s(self) -> float | None:
        """The stamp of the last frame, None before the first."""
        return self._last_s

    # Frames

    def add(self, frame: Frame, features: Any = None, *, encode: bool = True) -> None:
        """Add a frame, later than the last one, of the same cameras. What is wrong with it leaves the map as it was.

        Args:
            frame: the frame.
            features: of its pixels, (rows, columns, d) covering the picture evenly, instead of the encoder's.
            encode: give it to the encoder; else it adds its surface and colours alone. Of an encoder of keyframes
                alone, they decide.

        Raises:
            RecordingError: it is not later, or has other cameras.
            MapError: the encoders cannot make submaps.
            BackendError: the features, or the encoder's, are not what they must be. Where frames had waited for one
                another, it may be one of those, which is left out.
        """
        with self._adding:
            frame = next_of(frame, self._last_s, self._rig or frame.rig)
            if self._chosen is None and self.settings.frames.per_submap and self.encoders.keyframes_only:
                raise MapError(
                    f"The encoders {self.encoders.name} decide late which frames they look at, so that a growing map "
                    "stores no submaps with them; leave per_submap at 0, or build the map of a recording."
                )
            if self.start is None:
                self._came(frame)
                self._first.append((frame, features, encode))
                if len(self._first) >= self._wait and (faults := self.settle()):
                    raise faults[0]
            else:
                self._fuse(frame, features, encode)
                self._came(frame)
        if not self._behind:
            self._describe()

    def pass_by(self, stamp_s: float, world_from_camera: Float[np.ndarray, "4 4"]) -> None:
        """Take note of where the robot was in a frame that is not added: sounds are placed by it."""
        self._walked.append(stamp_s, world_from_camera)

    def leave_out(self, index: int, why: str) -> None:
        """List a frame that cannot be read, or that an encoder failed on."""
        self._left_out.append(BadFrame(index=index, why=why))
        self._is_due |= self._chosen is not None and index in self._chosen

    def settle(self) -> list[BackendError]:
        """Find up, the floor and the depth camera in the frames that came, and fuse those that waited for that.

        Returned is why frames were left out: their features are wrong.
        """
        faults: list[BackendError] = []
        with self._adding, silence_progress(True):
            if self.start is None and self._first:
                self.start, self._looked_at = Start.of(self._held.recording(self._up), self.settings), len(self._first)
            while self._first:  # what is interrupted loses no frame
                frame, features, encode = self._first[0]
                try:
                    self._fuse(frame, features, encode)
                except BackendError as fault:
                    faults.append(fault)
                    self.leave_out(frame.index, str(fault))
                del self._first[0]
        return faults

    def views_at(self, index: Int32[np.ndarray, "n 3"]) -> Int32[np.ndarray, " n"]:
        """Return how many frames have a pixel in each of some voxels."""
        with self._adding:
            views = self._sums.views_at(index)
            return views if self._whole is None else views + self._whole.views_at(index)

    def _came(self, frame: Frame) -> None:
        self._rig, self._last_s = frame.rig, frame.stamp_s
        if self._recording is None:
            self._held.add(frame)
            self._walked.append(frame.stamp_s, frame.world_from_camera)

    def _fuse(self, frame: Frame, features: Any, encode: bool) -> None:
        assert self.start is not None
        frame = replace(frame, ground=self.start.ground)
        late = features is None and self._chosen is None and self.encoders.keyframes_only
        if features is None and encode and Kind.PIXELS in self.encoders and not self.encoders.keyframes_only:
            features = self._encoded(frame)
        self._sums.add(frame, features, self.start.sensor.model)
        for keyframe in self._keyframes_by(frame):
            self._see(keyframe, late=late)

    def _see(self, keyframe: Frame, *, late: bool) -> None:
        self._undescribed.append(keyframe)
        if late and Kind.PIXELS in self.encoders and self.start is not None:
            self._sums.add_features(keyframe, self._encoded(keyframe), self.start.sensor.model)

    def _keyframes_by(self, frame: Frame) -> Iterator[Frame]:
        if self._chosen is None:
            yield from self._chooser.add(frame, frame.stamp_s, frame.world_from_camera)
        elif frame.index in self._chosen or self._is_due:
            self._is_due = False
            yield frame

    def _encoded(self, frame: Frame) -> np.ndarray:
        encoder = self.encoders.pixels
        (features,) = encode_pixels(encoder, [frame])
        require_unit(features, f"The pixel encoder {encoder.card.id} gave", frame)
        return features

    # Sound

    def add_sound(self, chunk: Any, stamp_s: Any = None) -> None:
        """Add a piece of sound; see ``Hearing.add``. Another thread may do it."""
        self.hearing.add(chunk, stamp_s, self._walked)

    # States

    def state(self) -> MapState:
        """Return what the frames brought that came."""
        with self._finishing:
            self._absorb()
            assert self.start is not None
            whole = self._whole if self._whole is not None else self._sums.empty(self.start.sensor.model)
            stamps_s, poses = np.array(self._stamps_s), np.array(self._poses).reshape(-1, 4, 4)
            views, keyframes = self._all_views(), self._album.plain()
            return MapState(whole.sums(), views, keyframes, stamps_s, poses, tuple(self._left_out))

    def add_state(self, state: MapState) -> None:
        """Add what frames brought that come after those before; arrays may be memory-mapped."""
        assert self._rig is not None
        if self._whole is None:
            self._whole = VoxelAccumulator(GridSpec(self.settings.voxel_size_m), state.sums.feature_sum.shape[1])
        self._whole.merge(state.sums)
        self._views.append(state.views)
        self._album.add_stacked(state.keyframes, (self._rig.rgb.width, self._rig.rgb.height))
        self._left_out += state.bad
        self._fused += len(state.stamp_s)
        if self.settings.frames.per_submap and len(state.stamp_s):
            self._book.add_whole(submap_of(state.sums, state.stamp_s, state.pose, np.asarray(state.views.clear_mm)))

    def _describe(self) -> None:
        with self._finishing:
            for _ in range(len(self._undescribed)):
                assert self.start is not None
                self._album.add(self._undescribed.pop(0), self.start.sensor.model)

    def _absorb(self) -> None:
        with self._adding:
            for part in self._sums.take():
                assert self.start is not None
                self._surfaces = None
                self._views += part.views
                self._stamps_s += part.stamps_s
                self._poses += part.poses
                self._fused += len(part.stamps_s)
                if self._recording is None and self.settings.frames.per_submap:
                    self._book.add(part, self._sums.empty(self.start.sensor.model))
                if self._whole is None:
                    self._whole = part.sums
                else:
                    self._whole.merge(part.sums.sums())
        self._describe()

    def _all_views(self) -> FreeViews:
        self._views = [concat(self._views)]
        return self._views[0]

    # Submaps

    def submaps(self) -> Submaps | None:
        """Return the submaps until the last snapshot, with the one that is not whole; None where it stores none."""
        with self._finishing:
            every = self._book.submaps()
            if every is None or self._recording is not None:
                return every
            return replace(every, pose=self._pose_of(every.stamp_s), clear_mm=self._all_views().clear_mm)

    def _pose_of(self, stamps_s: Float[np.ndarray, " n"]) -> Float[np.ndarray, "n 4 4"]:
        known = self._walked.until_now()
        return known.world_from_body[np.searchsorted(known.stamps_s, stamps_s)]

    def correct_poses(self, stamps_s: Any, poses: Any) -> tuple[float, float]:
        """Move what came to corrected poses; return how far frames moved, the median and the most, metres.

        Frames to come have poses of the corrected world. Arguments and errors are those of ``corrected.correct_map``.
        """
        if not self.settings.frames.per_submap:
            raise MapError(
                "The map stores no submaps, so that it cannot follow corrected poses; begin it with "
                f"settings=BuildSettings(frames=FrameSettings(per_submap={SUBMAP_FRAMES}))."
            )
        if not len(self):
            raise MapError("The map has no frame yet, whose pose could be corrected; add one.")
        with self._finishing, self._adding, silence_progress(True):
            before = self._walked.until_now()
            step = PoseCorrection.of(stamps_s, poses, before.stamps_s, before.world_from_body)
            self.settle()
            self._absorb()
            for part in (self._walked, self._held, self._album):
                part.move(step)
            now = self._walked.until_now().world_from_body
            self._book.close()
            self._sums.end_submap()
            submaps = self._book.submaps()
            assert submaps is not None
            placed, grid = self._pose_of(submaps.stamp_s), GridSpec(self.settings.voxel_size_m)
            self._whole = VoxelAccumulator(grid, submaps.feature.shape[1])
            MovedSubmaps(submaps, placed, grid).add_to(self._whole)
            views = self._all_views()
            self._views = [FreeViews(views.clear_mm, placed[: len(views)])]
            self._through = self._surfaces = None
            self._chooser = KeyframeChooser[Frame](self.settings.keyframes)
            self.hearing.forget()
            self._up = None if self._up is None else step.turn @ self._up
            self._look_again()
        apart_m = np.linalg.norm(now[:, :3, 3] - before.world_from_body[:, :3, 3], axis=1)
        return float(np.median(apart_m)), float(apart_m.max())

    # Maps

    def snapshot(self, *, absorb: bool = True) -> MapData:
        """Return the map of what came. Frames that wait for others to show up and the floor wait no longer.

        The same arrays as before where nothing came. Each sound has a place as soon as it was looked for. Without
        ``absorb`` only sounds are taken since the last one, and no frames.

        Raises:
            MapError: no frame came, or none has a depth within the limits.
            BackendError: an encoder is missing, or broke its protocol; the frame is left out.
        """
        if not len(self):
            raise MapError("The map has no frame yet; add one.")
        with self._finishing, silence_progress(True):
            faults = self.settle()
            if faults and not len(self):
                raise faults[0]
            if absorb:
                self._absorb()
                if self._recording is None:
                    if len(self) >= 2 * self._looked_at:
                        self._look_again()
                    elif not self._behind and len(self) >= 2 * max(self._checked, 1):
                        self._check()
            return self._made(final=False)

    def finish(self) -> MapData:
        """Return the map of what came as a whole: up, the floor, places, sounds and their sources are found in all.

        Errors are those of ``snapshot``.
        """
        if not len(self) and self._recording is None:
            raise MapError("The map has no frame yet; add one.")
        with self._finishing, silence_progress(self._recording is None):
            if self._recording is None:
                faults = self.settle()
                if faults and not len(self):
                    raise faults[0]
                with self._adding:
                    for keyframe in self._chooser.end():
                        self._see(keyframe, late=self.encoders.keyframes_only)
                self._absorb()
                self._look_again()
                self._at_the_end = self.hearing.doubts_at_the_end(self._walked.until_now())
            return self._made(final=True)

    def _look_again(self) -> None:
        assert self.start is not None
        with self._adding:
            held, self._looked_at = self._held.recording(self._up), len(self)
        up = estimate_up(held, self.settings)
        ground, floors = estimate_ground(held, self.settings, up)
        self.start = replace(self.start, up=up, ground=ground, floors=floors)
        self._check()

    def _check(self) -> None:
        with self._adding:
            held, self._checked = self._held.recording(self._up), len(self)
        self._found = doubts_of_walk(self._walked.until_now(), held) if len(held) > 1 else ()

    def _made(self, *, final: bool) -> MapData:
        start, whole, rig, recording = self.start, self._whole, self._rig, self._recording
        if start is None or whole is None or rig is None:
            why = "Every frame of the map was left out; add one whose features are right."
            raise MapError(why if self._left_out else "The map has no frame yet; add one.")
        ends = {"frames": perf_counter()}
        if recording is not None:
            walk, walked = recording.walk, Trajectory(recording.stamps_s, recording.world_from_camera)
            of = finish.recording_info(recording)
        else:
            walk = walked = self._walked.until_now()
            of = finish.walked_info(walk, self._fused, self._begins_s)
        if self._surfaces is None:
            if recording is None:
                self._through = self._through or ThroughCounts(whole.grid, rig.depth)
            views = self._views if recording is not None else [self._all_views()]
            model = start.sensor.model
            self._surfaces = finish.surfaces(whole, views, rig.depth, self.settings.fusion, model, self._through)
        voxels, removed = self._surfaces
        ends["merging"] = perf_counter()
        rng = np.random.default_rng([self.settings.seed, _PLACES])
        keyframes, state = self._album.keyframes(rng, final=final)
        ends["keyframes"] = perf_counter()
        sounds = self.hearing.sounds(walked, final=final)
        ends["sounds"] = perf_counter()
        up, index = start.up.vector(), voxels.index
        sources = self.hearing.located(sounds, walk, lambda: whole.grid.centre_of(np.asarray(index)), up, final=final)
        ends["sources"] = perf_counter()
        took = Timings.now(dict(zip(ends, np.diff([self.began_s, *ends.values()]).tolist(), strict=True)))
        models, name, settings = models_of(self.encoders), self.encoders.name, self.settings
        if self._sums.dim and Kind.PIXELS.value not in models:
            models[Kind.PIXELS.value] = ModelInfo(
                backend=GIVEN_FEATURES, id="features", dim=self._sums.dim, licence="unknown", checksum="", prompts=()
            )
        odd = tuple(finish.feature_doubts(voxels, keyframes, sounds, models))
        known = *self._told, *self._found, *self._at_the_end, *finish.carving_doubts(removed, len(voxels)), *odd
        self._at_the_end += odd if final else ()
        doubts, bad = tuple(dict.fromkeys(known)), tuple(sorted(self._left_out, key=lambda one: one.index))
        worth_knowing = finish.notices(start, self._fused, len(bad), has_sound=self.hearing.track is not None)
        info = MapInfo(
            avlmaps_version=__version__,
            build_key=self._key or key_of("map", BUILD_VERSION, of.fingerprint, name, models, settings),
            voxel_size_m=settings.voxel_size_m,
            up=start.up,
            ground=start.floors,
            rig=RigInfo.of(rig),
            profile=name,
            models=models,
            settings=settings,
            sensor=start.sensor,
            removed=removed,
            seed=settings.seed,
            recording=of,
            counts=Counts.of(self._fused, keyframes, voxels, sounds),
            bounding_box_m=MapBounds.of(voxels.index, settings.voxel_size_m),
            bad_frames=bad,
            notices=(*doubts, *worth_knowing),
            doubts=doubts,
            timings=took,
        )
        submaps = self.submaps() if final else None
        return MapData(info, voxels, keyframes, sounds, state, sources, self.hearing.sources.waiting, submaps)

    # Doubts

    def doubt(self, sentence: str) -> None:
        """Store with the map why it may be wrong, the first few times; every answer repeats it."""
        if len(self._told) < _MOST_DOUBTS:
            self._told.append(sentence)

    @property
    def doubts(self) -> tuple[str, ...]:
        """What is odd about the sound, and from the end on also about channels and features."""
        return (*self.hearing.doubts, *self._at_the_end)
