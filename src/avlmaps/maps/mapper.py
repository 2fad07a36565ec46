"""The one maker of maps: frames and sound in, a map out at any time.

A build gives it the frames of a recording, a robot those that it takes, a program its own. What frames brought is a
``MapState``; the states of stretches of a recording, from other runs or machines, add up to the map of all of it.
"""

import hashlib
import tempfile
import weakref
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from math import isfinite
from pathlib import Path
from shutil import rmtree
from threading import RLock
from time import perf_counter
from typing import Any

import numpy as np

from avlmaps.core.arrays import Float, Float64, Int32
from avlmaps.core.camera import Rig
from avlmaps.core.columns import concat
from avlmaps.core.errors import AudioError, BackendError, MapError
from avlmaps.core.numbers import as_number
from avlmaps.core.progress import silence_progress
from avlmaps.core.registry import Kind
from avlmaps.core.timeline import Trajectory
from avlmaps.maps.audio.events import WalkedTrack, collect, detect_events
from avlmaps.maps.audio.growing import GrowingSounds
from avlmaps.maps.check import doubts_of_channels, judge
from avlmaps.maps.estimate import Start, estimate_ground, estimate_up
from avlmaps.maps.finish import About, Merged, feature_doubts, manifest_of, recording_info, surfaces, with_clear_views
from avlmaps.maps.fusion.accumulator import VoxelAccumulator
from avlmaps.maps.fusion.free_space import FreeViewCollector, FreeViews, ThroughCounts
from avlmaps.maps.fusion.submaps import MovedSubmaps, submap_of
from avlmaps.maps.fusion.voxel_sums import VoxelSums, features_alone
from avlmaps.maps.grid import GridSpec
from avlmaps.maps.keyframes.album import KeyframeAlbum
from avlmaps.maps.keyframes.choose import KeyframeChooser
from avlmaps.maps.perceived import as_grid, encode_pixels, require_unit
from avlmaps.maps.plan import BUILD_VERSION, models_of
from avlmaps.maps.pose_correction import PoseCorrection
from avlmaps.maps.settings import SUBMAP_FRAMES, BuildSettings
from avlmaps.maps.sources.growing import GrowingSources, require_fit
from avlmaps.maps.store.checkpoints import key_of
from avlmaps.maps.store.manifest import BadFrame, ModelInfo, RecordingInfo, Timings
from avlmaps.maps.store.map_data import MapData
from avlmaps.maps.store.reader import GIVEN_FEATURES
from avlmaps.maps.types import HeardSounds, Keyframes, SourceEvidence, Submaps
from avlmaps.maps.walked import HeldFrames, Walked
from avlmaps.perception.encoders import Encoders
from avlmaps.recordings.audio import AudioTrack, Sound
from avlmaps.recordings.channels import ChannelSound, level_faults
from avlmaps.recordings.directions import DirectionTrack
from avlmaps.recordings.growing_track import LONGEST_GAP_S, GrowingTrack
from avlmaps.recordings.memory import next_of
from avlmaps.recordings.microphones import Microphones
from avlmaps.recordings.plausible import date_fault, pace_fault, plausible_walk
from avlmaps.recordings.types import Frame, Recording

_PLACES = 2  # number of what learns places as a source of randomness (gravity has 1)
_MOST_DOUBTS = 5
_FRAMES = Path("the frames")  # as sentences name what came from no file


@dataclass(frozen=True, slots=True)
class MapState:
    """What some frames brought. Those of other frames of the same recording, made with the same ``Start``, add up.

    Attributes:
        sums: of voxels.
        views: where the frames saw freely.
        keyframes: those among the frames, without learnt places.
        stamp_s: of each frame.
        pose: of each.
        bad: frames that were left out.
    """

    sums: VoxelSums
    views: FreeViews
    keyframes: Keyframes
    stamp_s: Float64[np.ndarray, " f"]
    pose: Float64[np.ndarray, "f 4 4"]
    bad: tuple[BadFrame, ...]


@dataclass(slots=True)
class _Part:
    """Frames that were added up since a snapshot, of one submap."""

    sums: VoxelAccumulator
    views: FreeViewCollector
    submap: int
    stamps_s: list[float] = field(default_factory=list[float])
    poses: list[np.ndarray] = field(default_factory=list[np.ndarray])


class Mapper:
    """Takes frames and sound, in the order of time, and makes maps of what came.

    One thread may add frames and one sound while another makes snapshots.

    Attributes:
        settings: of a build; of ``frames`` only ``per_submap`` counts.
        encoders: the models that perceive.
        start: up, the floor and the depth camera; None until the first frames show them.
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

        Args:
            settings: of a build.
            encoders: the models that perceive.
            up_in_world: unit vector; None finds it in the frames.
            first_frames: in which up, the floor and the sensor are found; ``gravity.frames`` if None.
            behind: another thread makes snapshots, and looks at keyframes.
            begins_s: what the clock said at time 0.
        """
        self.settings, self.encoders = settings.for_profile(encoders.weight_variance_m2), encoders
        self.start: Start | None = None
        self._up, self._begins_s, self._behind = up_in_world, begins_s, behind
        self._wait = min(first_frames or settings.gravity.frames, settings.gravity.frames)
        self._recording: Recording | None = None
        self._key, self._doubts = "", tuple[str, ...]()
        self._begin_s = perf_counter()
        # What the thread that adds frames writes, under ``_adding``.
        self._adding = RLock()
        self._rig: Rig | None = None
        self._last_s: float | None = None
        self._first: list[tuple[Frame, Any, bool]] = []
        self._held, self._walked = HeldFrames(settings.gravity.frames), Walked()
        self._parts: list[_Part] = []
        self._dim: int | None = None
        self._in_submap = -1, 0  # its number, and how many of its frames came
        self._chooser = KeyframeChooser[Frame](settings.keyframes)
        self._chosen: frozenset[int] | None = None
        self._is_due = False  # a frame that was to be a keyframe was left out
        self._undescribed: list[Frame] = []
        self._left_out: list[BadFrame] = []
        # What a snapshot writes, under ``finishing``; a table is read by gates, under ``_merging``.
        self.finishing, self._merging = RLock(), RLock()
        self._whole: VoxelAccumulator | None = None
        self._views: list[FreeViews] = []
        self._fused, self._stamps_s, self._poses = 0, list[float](), list[np.ndarray]()
        self._open: _Part | None = None  # the submap that is not whole
        self._submaps: list[Submaps] = []
        self._album = KeyframeAlbum(encoders, self.settings.keyframes)
        self._surfaces: Merged | None = None
        self._through: ThroughCounts | None = None
        self._looked_at = 0  # how many frames had come when up and the floor were last found
        self._sounds: GrowingSounds | None = None
        self._heard: HeardSounds | None = None
        self.sources, self._placed = GrowingSources(1 if behind else None), 0
        self._found: tuple[str, ...] = ()  # by the check of the frames that are held
        self._at_the_end: tuple[str, ...] = ()
        self._told: list[str] = []

    @classmethod
    def of_recording(
        cls, recording: Recording, settings: BuildSettings, encoders: Encoders, start: Start,
        keyframes: frozenset[int], key: str = "", doubts: tuple[str, ...] = (),
    ) -> "Mapper":  # fmt: skip
        """Return a mapper of frames of a recording, of which is known what all of it shows.

        Args:
            recording: whose frames will be added, or their states; it also has the sound.
            settings: of the build.
            encoders: the models that perceive.
            start: up, the floor and the depth camera.
            keyframes: numbers of the frames that become keyframes.
            key: hash of all that goes into the map.
            doubts: what is odd about it.
        """
        mapper = cls(settings, encoders, recording.up_in_world, begins_s=recording.begins_s)
        mapper._recording, mapper._rig, mapper.start = recording, recording.rig, start
        mapper._chosen, mapper._key, mapper._doubts = keyframes, key, doubts
        return mapper

    def __len__(self) -> int:
        """Return how many frames are in the map."""
        with self._adding:
            return self._fused + sum(len(part.stamps_s) for part in self._parts) + len(self._first)

    @property
    def next_index(self) -> int:
        """The number of the next frame."""
        return len(self) + len(self._left_out)

    @property
    def last_stamp_s(self) -> float | None:
        """The stamp of the last frame, None before the first."""
        return self._last_s

    # Frames

    def add(self, frame: Frame, features: Any = None, *, encode: bool = True) -> None:
        """Add a frame. What is wrong with it leaves the map as it was.

        Args:
            frame: later than the last one, of the same cameras.
            features: of its pixels, (rows, columns, d) covering the picture evenly, instead of the encoder's.
            encode: give it to the encoder; else it adds its surface and colours alone. Of an encoder of keyframes
                alone, they decide.

        Raises:
            RecordingError: it is not later, or has other cameras.
            BackendError: the features, or the encoder's, are not what they must be. Where frames had waited for one
                another, it may be one of those, which is left out.
        """
        with self._adding:
            frame = next_of(frame, self._last_s, self._rig or frame.rig)
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

        Returns:
            Why frames were left out: their features are wrong.
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
        with self._merging:
            sums = [part.sums for part in self._parts] + ([] if self._whole is None else [self._whole])
            return sum((one.views_at(index) for one in sums), np.zeros(len(index), np.int32))

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
        part = self._part_for(frame, None if features is None else features.shape[2])
        part.sums.add(frame, features)
        part.views.add(frame)
        part.stamps_s.append(frame.stamp_s)
        part.poses.append(np.array(frame.world_from_camera, np.float64))
        for keyframe in self._keyframes_by(frame):
            self._see(keyframe, late=late)

    def _see(self, keyframe: Frame, *, late: bool) -> None:
        """Let a keyframe be described, and add its features where they were left out before."""
        self._undescribed.append(keyframe)
        if late and Kind.PIXELS in self.encoders:
            looked = self._accumulator()
            looked.add(keyframe, self._encoded(keyframe))
            if self._parts:
                self._parts[-1].sums.merge(features_alone(looked.sums()))
            elif self._whole is not None:  # a snapshot was made since
                with self._merging:
                    self._whole.merge(features_alone(looked.sums()))
                    self._surfaces = None

    def _keyframes_by(self, frame: Frame) -> Iterator[Frame]:
        """Yield the frames that are known to be keyframes by this one."""
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

    def checked(self, features: Any, frame: Frame) -> np.ndarray:
        """Return features that a program gives with a frame, checked.

        Raises:
            BackendError: they are not what they must be.
        """
        dim = self._dim_of(None) or None
        who = "The features that were given are"
        grid = as_grid(features, dim, who, frame)
        require_unit(grid, who, frame)
        if dim is None and (self._parts or self._whole is not None):
            raise BackendError(f"{frame.name} has features, and the frames before had none; give them with all frames.")
        self._dim = grid.shape[2]
        return np.array(grid)

    def _dim_of(self, given: int | None) -> int:
        """Return the length of a feature, 0 where there are none."""
        if self._dim is None and Kind.PIXELS in self.encoders:
            self._dim = self.encoders.card(Kind.PIXELS).dim
        if self._dim is None and given is not None:
            self._dim = given
        return self._dim or 0

    def _accumulator(self, given: int | None = None) -> VoxelAccumulator:
        assert self.start is not None
        frames, grid = self.settings.frames, GridSpec(self.settings.voxel_size_m)
        return VoxelAccumulator(
            grid, self._dim_of(given), self.settings.fusion, self.start.sensor.model, with_spread=frames.per_submap > 0
        )

    def _part_for(self, frame: Frame, dim: int | None) -> _Part:
        """Return the part that a frame belongs to."""
        assert self.start is not None
        per_submap = self.settings.frames.per_submap
        number = frame.index // per_submap if per_submap else 0
        known, count = self._in_submap
        count = count if number == known else 0
        if not self._parts or self._parts[-1].submap != number:
            sums = self._accumulator(dim)
            sums.frames = count
            self._parts.append(_Part(sums, FreeViewCollector(frame.rig.depth, self.start.sensor.model), number))
        self._in_submap = number, self._parts[-1].sums.frames + 1
        return self._parts[-1]

    # Sound

    @property
    def sound_track(self) -> GrowingTrack | None:
        """The track until now, None without one."""
        return None if self._sounds is None else self._sounds.growing

    def place_microphones(self, microphones: Microphones) -> None:
        """Say where the microphones of the channels are, before the first piece of sound.

        Raises:
            AudioError: sound came before.
        """
        if self._sounds is not None:
            raise AudioError("Sound came before its microphones were described; describe them before the first piece.")
        self.sources.microphones = microphones

    def add_sound(self, chunk: Any, stamp_s: Any = None) -> None:
        """Add a piece of sound; see ``GrowingTrack.add``. Another thread may do it.

        Several channels become one, their mean, where nobody said where their microphones are, as in a build.

        Raises:
            AudioError: it is no sound, has another rate or other channels, repeats what came, or is of another clock.
        """
        if isinstance(chunk, ChannelSound):
            require_fit(self.sources.microphones, len(chunk.samples))
            if self.sources.microphones is None:
                chunk = Sound(chunk.samples.mean(axis=0), chunk.rate_hz)
        if self.sound_track is None or self.sound_track.end_s is None:
            self._require_clock_of_frames(stamp_s)
        if self._sounds is None:
            encoder = self.encoders.sounds if Kind.SOUNDS in self.encoders else None
            self._sounds = GrowingSounds(encoder, self.settings.hearing)
        self._sounds.add(chunk, stamp_s)

    def add_directions(self, said: DirectionTrack) -> None:
        """Add what a device said of where sounds come from, in the order of time. Another thread may do it.

        Raises:
            RecordingError: it is not later than what came.
        """
        self.sources.add_directions(said)

    def _require_clock_of_frames(self, stamp_s: Any) -> None:
        """Raise ``AudioError`` where the first piece of sound is of another clock than the frames before it."""
        came_s, at_s = self._walked.until_now().stamps_s, as_number(stamp_s)
        if at_s is None or not isfinite(at_s):
            return  # None, or refused with what it is
        fault = date_fault(np.array([at_s]), "pieces of sound")
        if not fault and len(came_s) and not -LONGEST_GAP_S < at_s - came_s[0] < np.ptp(came_s) + LONGEST_GAP_S:
            fault = (
                f"The first piece of sound is of {at_s:.6g} s, more than {LONGEST_GAP_S:.0f} s from the frames "
                f"({came_s[0]:.6g} to {came_s[-1]:.6g} s); give stamps of the frames' clock."
            )
        if fault:
            raise AudioError(fault)

    # States

    def state(self) -> MapState:
        """Return what the frames brought that came."""
        with self.finishing:
            self._absorb()
            whole = self._whole if self._whole is not None else self._accumulator()
            stamps_s, poses = np.array(self._stamps_s), np.array(self._poses).reshape(-1, 4, 4)
            return MapState(
                whole.sums(), self._all_views(), self._album.plain(), stamps_s, poses, tuple(self._left_out)
            )  # fmt: skip

    def add_state(self, state: MapState) -> None:
        """Add what frames brought that come after those before; arrays may be memory-mapped.

        Raises:
            MapError: its features have another length.
        """
        assert self._rig is not None
        if self._whole is None:
            self._whole = VoxelAccumulator(GridSpec(self.settings.voxel_size_m), state.sums.feature_sum.shape[1])
        self._whole.merge(state.sums)
        self._views.append(state.views)
        self._album.add_stacked(state.keyframes, (self._rig.rgb.width, self._rig.rgb.height))
        self._left_out += state.bad
        self._fused += len(state.stamp_s)
        if self.settings.frames.per_submap and len(state.stamp_s):
            self._submaps.append(submap_of(state.sums, state.stamp_s, state.pose, np.asarray(state.views.clear_mm)))

    def _describe(self) -> None:
        """Look at the keyframes that nobody looked at yet; one that an encoder fails on is left out."""
        with self.finishing:
            while self._undescribed:
                self._album.add(self._undescribed.pop(0))

    def _absorb(self) -> None:
        """Add up what came since the last time."""
        with self._adding:
            parts, self._parts = self._parts, []
        for part in parts:
            self._surfaces = None
            self._views.append(part.views.views())
            self._stamps_s += part.stamps_s
            self._poses += part.poses
            self._fused += len(part.stamps_s)
            if self._recording is None and self.settings.frames.per_submap:
                self._add_to_submap(part)
            with self._merging:
                if self._whole is None:
                    self._whole = part.sums
                else:
                    self._whole.merge(part.sums.sums())
        self._describe()

    def _all_views(self) -> FreeViews:
        assert self._rig is not None and self.start is not None
        none = FreeViewCollector(self._rig.depth, self.start.sensor.model).views()
        self._views = [concat([none, *self._views])]
        return self._views[0]

    # Submaps

    def _add_to_submap(self, part: _Part) -> None:
        if self._open is not None and self._open.submap != part.submap:
            self._submaps.append(self._as_submap(self._open))
            self._open = None
        if self._open is None:
            self._open = _Part(self._accumulator(), part.views, part.submap)
        self._open.sums.merge(part.sums.sums())
        self._open.stamps_s += part.stamps_s
        self._open.poses += part.poses

    def _as_submap(self, part: _Part) -> Submaps:
        clear_mm = np.zeros((0, 1, 1), np.uint16)
        return submap_of(part.sums.sums(), np.array(part.stamps_s), np.stack(part.poses), clear_mm)

    def submaps(self) -> Submaps | None:
        """Return the submaps until the last snapshot, with the one that is not whole; None where it stores none."""
        with self.finishing:
            every = self._submaps + ([] if self._open is None else [self._as_submap(self._open)])
            if not every:
                return None
            if self._recording is not None:
                return concat(every)
            whole, views = concat(every), self._all_views()
            return replace(whole, pose=self._pose_of(whole.stamp_s), clear_mm=views.clear_mm)

    def _pose_of(self, stamps_s: Float[np.ndarray, " n"]) -> Float[np.ndarray, "n 4 4"]:
        known = self._walked.until_now()
        return known.world_from_camera[np.searchsorted(known.stamps_s, stamps_s)]

    def correct_poses(self, stamps_s: Any, poses: Any) -> tuple[float, float]:
        """Move what came to corrected poses of it; frames to come have poses of the corrected world.

        Args:
            stamps_s: (k,) of corrected poses, rising.
            poses: (k, 4, 4) world_from_camera of the depth camera then. Between them frames follow smoothly.

        Returns:
            How far frames moved: the median and the most, metres.

        Raises:
            MapError: it stores no submaps, no frame came, or the poses are not of its frames.
            RecordingError: a pose is no rigid motion.
        """
        if not self.settings.frames.per_submap:
            raise MapError(
                "The map stores no submaps, so that it cannot follow corrected poses; begin it with "
                f"settings=BuildSettings(frames=FrameSettings(per_submap={SUBMAP_FRAMES}))."
            )
        if not len(self):
            raise MapError("The map has no frame yet, whose pose could be corrected; add one.")
        with self.finishing, self._adding, silence_progress(True):
            before = self._walked.until_now()
            step = PoseCorrection.of(stamps_s, poses, before.stamps_s, before.world_from_camera)
            self.settle()
            self._absorb()
            for part in (self._walked, self._held, self._album):
                part.move(step)
            now = self._walked.until_now().world_from_camera
            if self._open is not None:
                self._submaps.append(self._as_submap(self._open))
                self._open, self._in_submap = None, (-1, 0)
            submaps = concat(self._submaps)
            placed, grid = self._pose_of(submaps.stamp_s), GridSpec(self.settings.voxel_size_m)
            with self._merging:
                self._whole = VoxelAccumulator.of_table(MovedSubmaps(submaps, placed, grid).table(), grid)
            views = self._all_views()
            self._views = [FreeViews(views.clear_mm, placed[: len(views)])]
            self._through = self._surfaces = None
            self._chooser = KeyframeChooser[Frame](self.settings.keyframes)
            self.sources.forget()
            self._heard = None
            self._up = None if self._up is None else step.turn @ self._up
            self._look_again()
        apart_m = np.linalg.norm(now[:, :3, 3] - before.world_from_camera[:, :3, 3], axis=1)
        return float(np.median(apart_m)), float(apart_m.max())

    # Maps

    def snapshot(self, *, absorb: bool = True) -> MapData:
        """Return the map of what came. Frames that wait for others to show up and the floor wait no longer.

        The same arrays as before where nothing came. Each sound has a place as soon as it was looked for.

        Args:
            absorb: take the frames since the last one as well, and not only sounds.

        Raises:
            MapError: no frame came, or none has a depth within the limits.
            BackendError: an encoder is missing, or broke its protocol; the frame is left out.
        """
        if not len(self):
            raise MapError("The map has no frame yet; add one.")
        with self.finishing, silence_progress(True):
            self._require_some(self.settle())
            if absorb:
                self._absorb()
                if len(self) >= 2 * self._looked_at and self._recording is None:
                    self._look_again()
            return self._made(final=False)

    def finish(self) -> MapData:
        """Return the map of what came as a whole: up, the floor, places, sounds and their sources are found in all.

        Raises:
            MapError: no frame came, or none has a depth within the limits.
            BackendError: an encoder is missing, or broke its protocol; the frame is left out.
        """
        if not len(self) and self._recording is None:
            raise MapError("The map has no frame yet; add one.")
        with self.finishing, silence_progress(self._recording is None):
            if self._recording is None:
                self._require_some(self.settle())
                with self._adding:
                    for keyframe in self._chooser.end():
                        self._see(keyframe, late=self.encoders.keyframes_only)
                self._absorb()
                self._look_again()
                self._at_the_end = self._doubts_of_sound()
            return self._made(final=True)

    def _require_some(self, faults: list[BackendError]) -> None:
        if faults and not len(self):
            raise faults[0]

    def _look_again(self) -> None:
        """Find up, the floor and what is odd once more, in the frames that are held."""
        assert self.start is not None
        with self._adding:
            held, self._looked_at = self._held.recording(self._up), len(self)
        up = estimate_up(held, self.settings)
        ground, floors = estimate_ground(held, self.settings, up)
        self.start = replace(self.start, up=up, ground=ground, floors=floors)
        if len(held) < 2:
            return
        walk = self._walked.until_now()
        names = [f"{stamp_s:.2f} s" for stamp_s in walk.stamps_s.tolist()]
        found = plausible_walk(walk.stamps_s, walk.world_from_camera[:, :3, 3], names, strays_are="check the poses")
        odd = *found.notices, found.fault, pace_fault(walk.stamps_s, "frames"), *judge(held).sentences()
        self._found = tuple(sentence for sentence in odd if sentence)

    def _made(self, *, final: bool) -> MapData:
        start, whole = self.start, self._whole
        if start is None or whole is None or self._rig is None:
            why = "Every frame of the map was left out; add one whose features are right."
            raise MapError(why if self._left_out else "The map has no frame yet; add one.")
        about, begin_s = self._about(), perf_counter()
        if self._surfaces is None:
            counted = None if self._recording is not None else self._counts()
            views = self._views if counted is None else [self._all_views()]
            self._surfaces = surfaces(whole, views, about, start.sensor, counted)
        merged, merged_s = self._surfaces, perf_counter()
        rng = np.random.default_rng([self.settings.seed, _PLACES])
        keyframes, state = self._album.keyframes(rng, final=final)
        keyframes = with_clear_views(keyframes, self._views)
        heard_s = perf_counter()
        sounds = self._sounds_until(final)
        sources_s = perf_counter()
        sources = self._sources_of(sounds, merged, final)
        if final:
            odd = feature_doubts(merged.voxels, keyframes, sounds, about.models)
            self._at_the_end = (*self._at_the_end, *odd)
        ends = {"frames": begin_s, "merging": merged_s, "keyframes": heard_s, "sounds": sources_s,
                "sources": perf_counter()}  # fmt: skip
        took = dict(zip(ends, np.diff([self._begin_s, *ends.values()]).tolist(), strict=True))
        info = manifest_of(about, start, merged, keyframes, sounds, Timings.now(took), self._fused, self._left_out)
        wait = 0 if final else self.sources.waiting
        submaps = self.submaps() if final else None
        return MapData(info, merged.voxels, keyframes, sounds, state, sources, wait, submaps)

    def _counts(self) -> ThroughCounts:
        assert self._rig is not None
        if self._through is None:
            self._through = ThroughCounts(GridSpec(self.settings.voxel_size_m), self._rig.depth)
        return self._through

    def _about(self) -> About:
        assert self._rig is not None
        models, walk, recording = models_of(self.encoders), self._walked.until_now(), self._recording
        if self._dim is not None and Kind.PIXELS.value not in models:
            models[Kind.PIXELS.value] = ModelInfo(
                backend=GIVEN_FEATURES, id="features", dim=self._dim, licence="unknown", checksum="", prompts=()
            )
        if recording is not None:
            said, doubts, has_sound = recording_info(recording), self._doubts, recording.audio is not None
        else:
            digest = hashlib.sha256(walk.stamps_s.tobytes() + walk.world_from_camera.tobytes()).hexdigest()
            duration_s = float(np.ptp(walk.stamps_s)) if len(walk.stamps_s) else 0.0
            said = RecordingInfo(
                name=_FRAMES.name, format="memory", fingerprint=digest, frames=self._fused, duration_s=duration_s,
                begins_s=self._begins_s,
            )  # fmt: skip
            doubts = tuple(dict.fromkeys((*self._told, *self._found, *self._at_the_end)))
            has_sound = self._sounds is not None and self._sounds.track is not None
        name, settings = self.encoders.name, self.settings
        key = self._key or key_of("map", BUILD_VERSION, said.fingerprint, name, models, settings)
        return About(said, self._rig, has_sound, name, models, settings, key, doubts)

    def _sounds_until(self, final: bool) -> HeardSounds:
        """Return the sounds that are over, or all of them."""
        recording = self._recording
        track = recording.audio if recording is not None else self._sounds and self._sounds.track
        card = self.encoders.card(Kind.SOUNDS) if Kind.SOUNDS in self.encoders else None
        if track is None or card is None:
            return collect([], 0 if card is None else card.dim)
        walk = self._walked.until_now()
        if final:
            folder = Path(tempfile.mkdtemp(prefix="avlmaps-sounds-"))
            weakref.finalize(self, rmtree, folder, ignore_errors=True)
            if recording is not None:
                walk = WalkedTrack(recording.stamps_s, recording.world_from_camera)
            return detect_events(track, walk, self.encoders.sounds, self.settings.hearing, folder)
        assert self._sounds is not None
        if len(walk.stamps_s):
            heard = self._sounds.heard(walk)
            if self._heard is None or not np.array_equal(heard.offset_s, self._heard.offset_s):
                self._heard = heard
        return self._heard or collect([], card.dim)

    def _track(self) -> AudioTrack | None:
        """Return the sound with what shows where it came from; None where nothing does."""
        if self._recording is not None:
            track = self._recording.audio
            return None if track is None or (track.microphones is None and track.directions is None) else track
        raw = None if self._sounds is None else self._sounds.track
        return None if raw is None else self.sources.track(raw, raw.channels)

    def _sources_of(self, sounds: HeardSounds, merged: Merged, final: bool) -> SourceEvidence | None:
        """Return where sounds came from, as far as that is known; a name need not wait for its place."""
        assert self.start is not None
        track, walked = self._track(), self._walked.until_now()
        if track is None or not len(sounds):
            return None
        spans_s = list(zip(sounds.onset_s.tolist(), sounds.offset_s.tolist(), strict=True))
        known = self.sources.known(spans_s)
        if not final and self._behind and self.sources.waiting and self._placed != len(sounds):
            self._placed = len(sounds)
            return known
        walk = (
            self._recording.walk
            if self._recording is not None
            else Trajectory(walked.stamps_s, walked.world_from_camera)
        )
        voxel_m = GridSpec(self.settings.voxel_size_m).centre_of(np.asarray(merged.voxels.index))
        find = self.sources.at_the_end if final else self.sources.until_now
        return find(track, walk, spans_s, voxel_m, self.start.up.vector())

    # Doubts

    def doubt(self, sentence: str) -> None:
        """Store with the map why it may be wrong, the first few times; every answer repeats it."""
        if len(self._told) < _MOST_DOUBTS:
            self._told.append(sentence)

    @property
    def doubts(self) -> tuple[str, ...]:
        """What is left out of the evidence of sources, and why; from the end on also of channels, features."""
        alone = self._sounds is not None and self._sounds.growing.channels == 1
        microphones = self.sources.microphones
        few = (
            f"The sound has one channel, and {len(microphones)} microphones are described; where sounds came from is "
            "not known: give all channels (avlmaps.ChannelSound)."
            if alone and microphones is not None and len(microphones) > 1
            else ""
        )
        return tuple(one for one in (few, self.sources.doubt, *self._at_the_end) if one)

    def _doubts_of_sound(self) -> tuple[str, ...]:
        """Check the sound, and the channels of an array along the whole drive, as a build does."""
        grown, track, walk = self.sound_track, self._track(), self._walked.until_now()
        if track is None or track.microphones is None or len(track.microphones) < 2 or not len(walk.stamps_s):
            if grown is None or grown.track is None or grown.gaps:  # silence fills gaps
                return ()
            silent, _ = level_faults(grown.track, "The sound")
            return tuple(f"{one} Check the microphone: nothing that sounded then is in the map." for one in silent)
        return doubts_of_channels(track, Trajectory(walk.stamps_s, walk.world_from_camera), "the sound")
