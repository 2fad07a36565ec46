"""A map that grows by one frame after the other, in memory: the steps of a build without a recording or a folder.

Up, the floor and the depth camera are found in the first frames, which wait for that, so that the map of a short walk
is that of a build. Of a longer one they are found again each time it has doubled; what was encoded by then stays.
"""

from dataclasses import dataclass, replace
from math import isfinite
from pathlib import Path
from threading import RLock
from time import perf_counter
from typing import Any

import numpy as np
from msgspec import structs

from avlmaps.core.arrays import Float
from avlmaps.core.columns import concat
from avlmaps.core.errors import AudioError, BackendError, MapError
from avlmaps.core.numbers import as_number
from avlmaps.core.progress import silence_progress
from avlmaps.core.registry import Kind
from avlmaps.core.timeline import Trajectory
from avlmaps.core.wording import option
from avlmaps.maps.audio.growing import GrowingSounds
from avlmaps.maps.fusion.accumulator import VoxelAccumulator
from avlmaps.maps.fusion.free_space import FreeViewCollector, ThroughCounts, stack_views
from avlmaps.maps.fusion.submaps import submap_of
from avlmaps.maps.fusion.voxel_sums import VoxelSums, features_alone
from avlmaps.maps.grid import GridSpec
from avlmaps.maps.growing_walk import HERE, Walk
from avlmaps.maps.keyframes.growing import FrozenKeyframes, GrowingKeyframes, PicturedKeyframe
from avlmaps.maps.perceived import as_grid, encode_pixels, require_unit
from avlmaps.maps.pipeline.check import doubts_of_channels, judge
from avlmaps.maps.pipeline.estimate import estimate_ground, estimate_sensor, estimate_up
from avlmaps.maps.pipeline.keyframes import RANDOMNESS
from avlmaps.maps.pipeline.plan import BUILD_VERSION, BuildPlan
from avlmaps.maps.pipeline.sounds import silence
from avlmaps.maps.pipeline.write import feature_doubts, manifest_of, surfaces, with_clear_views
from avlmaps.maps.pose_correction import PoseCorrection, moved_frame
from avlmaps.maps.settings import SUBMAP_FRAMES, BuildSettings
from avlmaps.maps.sources.growing import AT_ONCE, GrowingSources, require_fit
from avlmaps.maps.store.checkpoints import key_of
from avlmaps.maps.store.folder import MANIFEST, is_map_or_free
from avlmaps.maps.store.folder import write as write_folder
from avlmaps.maps.store.lock import lock_folder
from avlmaps.maps.store.manifest import BadFrame, GroundInfo, MapInfo, ModelInfo, SensorInfo, Timings, UpInfo
from avlmaps.maps.store.map_data import MapData
from avlmaps.maps.store.reader import GIVEN_FEATURES, StoredMap, open_stored
from avlmaps.maps.types import HeardSounds, SourceEvidence, Submaps
from avlmaps.perception.encoders import Encoders
from avlmaps.perception.protocols import GroundReader
from avlmaps.recordings.audio import AudioTrack, Sound
from avlmaps.recordings.channels import ChannelSound, level_faults
from avlmaps.recordings.directions import DirectionTrack
from avlmaps.recordings.growing_track import LONGEST_GAP_S, GrowingTrack
from avlmaps.recordings.memory import next_of
from avlmaps.recordings.microphones import Microphones
from avlmaps.recordings.plausible import date_fault, pace_fault, plausible_walk
from avlmaps.recordings.types import Frame, Ground, Recording

# Features of waiting frames take no more memory than this.
_MOST_WAITING_BYTES = 5e8
_MOST_DOUBTS = 5
# Findings of the floor and up within these are one.
_SAME_FLOOR_M = 0.05
_SAME_UP = 0.9994  # cosine of 2 degrees


class GrowingMap:
    """Takes frames; ``stored`` is the map of those that came.

    Attributes:
        settings: of a build.
        encoders: the encoders; that of sounds is not called, as frames have none.
    """

    def __init__(
        self,
        settings: BuildSettings,
        encoders: Encoders,
        up_in_world: Float[np.ndarray, "3"] | None = None,
        *,
        wait: int | None = None,
        looks_later: bool = False,
        begins_s: float = 0.0,
    ) -> None:
        """Begin without frames.

        Args:
            settings: of a build; of ``frames`` only ``per_part`` counts.
            encoders: the encoders.
            up_in_world: unit vector; None finds it in the frames.
            wait: frames in which up, the floor and the sensor are found first; ``gravity.frames`` if None.
            looks_later: keyframes are looked at by ``finish``, and not when they are added; it also finds up and the
                floor of a walk that has doubled.
            begins_s: what the clock said at time 0, as of a recording.
        """
        self.settings = settings.for_profile(encoders.weight_variance_m2)
        self.encoders = encoders
        self._given_up = up_in_world
        self._walk = Walk(up_in_world, begins_s)
        self._wait = min(wait or self.settings.gravity.frames, self.settings.gravity.frames)
        self._waiting: list[_Waiting] = []
        self._left_out: list[BadFrame] = []
        self._sensor: SensorInfo | None = None
        self._ground: Ground | None = None
        self._upright: tuple[UpInfo, GroundInfo] | None = None
        # The sums of whole parts, which may be read elsewhere, and of the part that is not: a build adds up likewise.
        self._total: VoxelAccumulator | None = None
        self._total_is_read = False
        self._part: VoxelAccumulator | None = None
        self._part_number = 0
        self._part_walk: list[tuple[float, np.ndarray]] = []  # stamps and poses of its frames
        self._submaps: list[Submaps] = []
        self.finishing = RLock()  # held while a map is made, and while poses are corrected
        self._corrections = 0
        self._told: list[str] = []
        self._found: tuple[str, ...] = ()  # by the check of the frames that are held
        self._of_channels: tuple[str, ...] = ()  # what the end found of the sound's
        self._of_features: tuple[str, ...] = ()  # and of all features
        self._checked_frames = 0
        if self.settings.frames.per_submap and encoders.keyframes_only:
            raise MapError(
                f"The encoders {encoders.name} decide late which frames they look at, so that a growing map stores no "
                "submaps with them; leave per_submap at 0, or build the map of a recording."
            )
        self._free: FreeViewCollector | None = None
        self._through: ThroughCounts | None = None
        self._looks_later, self._is_outgrown = looks_later, False  # whether up and the floor are those of half the walk
        self._keyframes = GrowingKeyframes(encoders, self.settings.keyframes, looks_later=looks_later)
        self._sounds: GrowingSounds | None = None
        self._sources = GrowingSources(AT_ONCE if looks_later else None)
        self._finished_corrections = 0  # how often poses had been corrected when a map was last finished
        self._dim: int | None = None
        self._rehearsed: dict[int, tuple[Ground, np.ndarray]] | None = None
        self._rehearsal = _Rehearsal()
        self._begin_s = perf_counter()

    def __len__(self) -> int:
        """Return how many frames are in the map."""
        return len(self._walk) + len(self._waiting)

    @property
    def looks_again(self) -> bool:
        """Whether ``look_again`` brings something: the encoder takes every frame, and there is one."""
        return Kind.PIXELS in self.encoders and not self.encoders.keyframes_only

    @property
    def next_index(self) -> int:
        """The number of the next frame."""
        return len(self) + len(self._left_out)

    @property
    def last_stamp_s(self) -> float | None:
        """The stamp of the last frame, None before the first."""
        last = self._waiting[-1].frame.stamp_s if self._waiting else None
        return last if last is not None else (float(self._walk.stamps_s[-1]) if len(self._walk) else None)

    def add(self, frame: Frame, features: Any = None, *, encode: bool = True) -> None:
        """Add a frame. What is wrong with it leaves the map as it was.

        Args:
            frame: later than the last one, of the same cameras.
            features: of its pixels, (rows, columns, d) covering the picture evenly, each of unit length or zero;
                instead of the encoder's.
            encode: give it to the encoder; else it adds its surface and colours alone. Of an encoder of keyframes
                alone, they decide.

        Raises:
            RecordingError: it is not later, or has other cameras.
            BackendError: the features, or the encoder's, are not what they must be. Where frames had waited, it may
                be one of those, which is left out; then this frame has its number (``next_index``).
        """
        frame = next_of(frame, self.last_stamp_s, self._walk.rig_or(frame.rig))
        if features is not None:
            features = self._checked(features, "The features that were given are", frame)
        elif encode and self._encodes_at_once():
            features = self._encoded(frame)
        self._waiting.append(_Waiting(frame, features, encode))
        self._walk.spread(frame, self.settings.gravity.frames)
        self._walk.pass_by(frame.stamp_s, frame.world_from_camera)
        waiting_bytes = sum(one.features.nbytes for one in self._waiting if one.features is not None)
        enough = len(self._waiting) >= self._wait or waiting_bytes > _MOST_WAITING_BYTES
        if self._sensor is not None or enough:
            self.settle()

    def leave_out(self, why: str) -> None:
        """List a frame that an encoder failed on and that will not come again; it takes the next number."""
        self._left_out.append(BadFrame(index=self.next_index, why=why))

    def settle(self) -> None:
        """Fuse the first frames, which no longer wait for others: up, the floor and the sensor are what they show.

        Raises:
            BackendError: the features of a frame are wrong; it is left out.
        """
        if not self._waiting:
            return
        with silence_progress(True):
            if self._sensor is None:
                held = self._walk.held()
                self._sensor, self._ground = estimate_sensor(held, self.settings), self._find_upright(held)
                self._rehearsal = _Rehearsal()
            elif self._walk.has_doubled and self._looks_later:
                self._is_outgrown = True
            elif self._walk.has_doubled:
                self._ground = self._find_upright(self._walk.held())
            faults: list[BackendError] = []
            while self._waiting:  # what is interrupted loses no frame
                one = self._waiting[0]
                try:
                    self._fuse(replace(one, frame=replace(one.frame, ground=self._ground)))
                except BackendError as fault:
                    faults.append(fault)
                    self._left_out.append(BadFrame(index=one.frame.index, why=str(fault)))
                del self._waiting[0]
        if faults:
            raise faults[0]

    def look_again(self, frame: Frame, *, is_fused: bool) -> None:
        """Encode a frame of before, and add what that brings; no other frame need wait for it.

        Its pose must be that of now (a map with submaps takes none), and the first frames no longer wait.

        Args:
            frame: the frame.
            is_fused: it was added without features; else its surface and colours are new as well.

        Raises:
            BackendError: its features are not what they must be; the map is as it was.
        """
        assert self._sensor is not None and self._free is not None and not self.settings.frames.per_submap
        fused_s = self._walk.stamps_s  # nothing is seen before the first frame of the map or after its last
        stamp_s = float(np.clip(frame.stamp_s, fused_s[0], fused_s[-1]))
        with silence_progress(True):
            part = self._empty(self._sensor)
            part.add(replace(frame, stamp_s=stamp_s), self._encoded(replace(frame, ground=self._ground)))
        if not is_fused:
            self._free.add(frame)
        self._merge(features_alone(part.sums()) if is_fused else part.sums())

    @property
    def microphones(self) -> Microphones | None:
        """Where those of the channels are; None where that is not known."""
        return self._sources.microphones

    def place_microphones(self, microphones: Microphones) -> None:
        """Say where the microphones of the channels are, before the first piece of sound.

        Raises:
            AudioError: sound came before.
        """
        if self._sounds is not None:
            raise AudioError("Sound came before its microphones were described; describe them before the first piece.")
        self._sources.microphones = microphones

    def know_device(self, known_rad: tuple[float, float]) -> None:
        """Say what an earlier map shows of the device that says directions; see ``DirectionTrack.known_rad``."""
        self._sources.known_rad = known_rad

    def add_audio(self, chunk: Any, stamp_s: Any = None) -> None:
        """Add a piece of sound; see ``GrowingTrack.add``. Another thread may do it.

        Several channels become one, their mean, where nobody said where their microphones are, as in a build.

        Raises:
            AudioError: it is no sound, has another rate or other channels, repeats what came, or is of another clock.
        """
        if isinstance(chunk, ChannelSound):
            require_fit(self.microphones, len(chunk.samples))
            if self.microphones is None:
                chunk = Sound(chunk.samples.mean(axis=0), chunk.rate_hz)
        if self.sound_track is None or self.sound_track.end_s is None:
            self._require_clock_of_frames(stamp_s)
        if self._sounds is None:
            encoder = self.encoders.sounds if Kind.SOUNDS in self.encoders else None
            self._sounds = GrowingSounds(encoder, self.settings.hearing)
        self._sounds.add(chunk, stamp_s)

    def _require_clock_of_frames(self, stamp_s: Any) -> None:
        """Raise ``AudioError`` where the first piece of sound is of another clock than the frames before it."""
        came_s, at_s = self._walk.motion().stamps_s, as_number(stamp_s)
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

    def add_directions(self, said: DirectionTrack) -> None:
        """Add what a device said of where sounds come from, in the order of time. Another thread may do it.

        Raises:
            RecordingError: it is not later than what came.
        """
        self._sources.add_directions(said)

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
        with self.finishing, silence_progress(True):
            before = self._walk.motion()
            step = PoseCorrection.of(stamps_s, poses, before.stamps_s, before.world_from_camera)
            self._walk.move(step)
            self._corrections += 1
            self._checked_frames = 0
            self._waiting = [replace(one, frame=moved_frame(one.frame, step)) for one in self._waiting]
            self._rehearsal = _Rehearsal()
            self._keyframes.move(step)
            self._sources.forget()
            if self._part is not None:
                self._follow(step)
            if self._given_up is not None:
                self._given_up = step.turn @ self._given_up
            if self._ground is not None:
                self._ground = self._find_upright(self._walk.held())
            now = self._walk.motion().world_from_camera
        apart_m = np.linalg.norm(now[:, :3, 3] - before.world_from_camera[:, :3, 3], axis=1)
        return float(np.median(apart_m)), float(apart_m.max())

    def is_current(self, came: "FrozenSums") -> bool:
        """Return whether what was frozen has the poses of now; who asks holds ``finishing``."""
        return came.corrections == self._corrections

    def submaps(self) -> Submaps | None:
        """Return the submaps until now, with the part that is not a whole one; None where it stores none."""
        if self._part is None or self._free is None or not self.settings.frames.per_submap:
            return None
        last = [] if not self._part_walk else [self._as_submap(self._part.sums())]
        every = concat([*self._submaps, *last])
        clear = self._free.views().clear_mm
        return replace(every, pose=self._walk.pose_of(every.stamp_s), clear_mm=clear)

    def _follow(self, step: PoseCorrection) -> None:
        """Merge the submaps again; what is not a whole one becomes one."""
        assert self._sensor is not None and self._part is not None and self._free is not None
        if self._part_walk:
            self._keep_submap(self._part.sums())
        self._part, self._part_number = self._empty(self._sensor), -1
        submaps = concat(self._submaps)
        self._total = VoxelAccumulator.of_submaps(submaps, self._walk.pose_of(submaps.stamp_s), self._part.grid)
        self._total_is_read = False
        self._free.place(self._walk.pose_of(submaps.stamp_s))
        self._through = ThroughCounts(GridSpec(self.settings.voxel_size_m), self._walk.rig.depth)

    def _keep_submap(self, sums: VoxelSums) -> None:
        self._submaps.append(self._as_submap(sums))
        self._part_walk = []

    def _as_submap(self, sums: VoxelSums) -> Submaps:
        """Return the part that is summed now as a submap."""
        assert self._part is not None
        stamps_s, poses = zip(*self._part_walk, strict=True)
        return submap_of(sums, self._part.spread(), np.array(stamps_s), np.stack(poses), np.zeros((0, 1, 1), np.uint16))

    def pass_by(self, stamp_s: float, world_from_camera: Float[np.ndarray, "4 4"]) -> None:
        """Take note of where the robot was in a frame that is not added: sounds are placed by it."""
        self._walk.pass_by(stamp_s, world_from_camera)

    @property
    def sums(self) -> tuple[VoxelAccumulator, ...]:
        """The sums until now, of parts that add up to the map; they change with the next frame."""
        return tuple(part for part in (self._total, self._part) if part is not None)

    @property
    def sound_track(self) -> GrowingTrack | None:
        """The track until now, None without one."""
        return None if self._sounds is None else self._sounds.growing

    def heard(self) -> HeardSounds | None:
        """Return the sounds that are over; None without a track, an encoder of sounds or a pose. As of ``finish``.

        Raises:
            AudioError: the samples cannot be read.
            BackendError: the encoder's features are not what its card says.
        """
        motion = self._walk.motion()
        if self._sounds is None or Kind.SOUNDS not in self.encoders or not len(motion.stamps_s):
            return None
        return self._sounds.heard(motion, final=False)

    def with_sounds(self, made: StoredMap, sounds: HeardSounds) -> StoredMap:
        """Return a map of ``finish`` with the sounds of ``heard`` instead, and what is known of their sources.

        It locates none, so that a sound has its name at once. Where poses were corrected since it is the map itself:
        its surfaces are of other poses than the walk.
        """
        assert self._sounds is not None
        with self.finishing:
            if self._finished_corrections != self._corrections:
                return made
            sources, wait = self._known(sounds)
        counts = structs.replace(made.info.counts, sounds=len(sounds))
        info = structs.replace(made.info, counts=counts)
        data = replace(made.data, info=info, sounds=sounds, sources=sources, sources_wait=wait)
        return replace(made, path=self._sounds.clips_folder, data=data)

    def with_sources(self, made: StoredMap, *, final: bool = False) -> StoredMap:
        """Return a map with the next of its sounds located that wait for it, on its surfaces.

        Args:
            made: of ``finish`` or ``with_sounds``.
            final: locate all of them, as a build does.
        """
        with self.finishing, silence_progress(True):
            heard = self._heard_by(made.sounds)
            if heard is None or self._finished_corrections != self._corrections:
                return made
            track, spans_s = heard
            motion, voxels = self._walk.motion(), made.voxels
            walk = Trajectory(motion.stamps_s, motion.world_from_camera)
            voxel_m = GridSpec(self.settings.voxel_size_m).centre_of(np.asarray(voxels.index))
            find = self._sources.at_the_end if final else self._sources.until_now
            sources = find(track, walk, spans_s, voxel_m, made.up_in_world)
            if sources is made.data.sources:
                return made
            return replace(made, data=replace(made.data, sources=sources, sources_wait=self._sources.waiting))

    @property
    def doubts(self) -> tuple[str, ...]:
        """What is left out of the evidence of sources, and why; from the end on also of channels, features."""
        alone = self._sounds is not None and self._sounds.growing.channels == 1
        microphones = self.microphones
        few = (
            f"The sound has one channel, and {len(microphones)} microphones are described; where sounds came from is "
            "not known: give all channels (avlmaps.ChannelSound)."
            if alone and microphones is not None and len(microphones) > 1
            else ""
        )
        return tuple(one for one in (few, self._sources.doubt, *self._of_channels, *self._of_features) if one)

    def _doubts_of_channels(self) -> tuple[str, ...]:
        """Check the sound, and the channels of an array along the whole drive, as a build does."""
        grown, track, motion = self.sound_track, self._placed_track(), self._walk.motion()
        if track is None or track.microphones is None or len(track.microphones) < 2 or not len(motion.stamps_s):
            if grown is None or grown.track is None or grown.gaps:  # silence fills gaps
                return ()
            silent, _ = level_faults(grown.track, "The sound")
            return tuple(f"{one} Check the microphone: nothing that sounded then is in the map." for one in silent)
        return doubts_of_channels(track, Trajectory(motion.stamps_s, motion.world_from_camera), "the sound")

    def _placed_track(self) -> AudioTrack | None:
        """Return the track with its microphones and what a device said; None where neither is known."""
        raw = None if self._sounds is None else self._sounds.track
        return None if raw is None else self._sources.track(raw, raw.channels)

    def _heard_by(self, sounds: HeardSounds) -> tuple[AudioTrack, list[tuple[float, float]]] | None:
        """Return what shows where sounds came from, and when they were; None where nothing shows that."""
        track = self._placed_track()
        if track is None or not len(sounds) or not len(self._walk.motion().stamps_s):
            return None
        return track, list(zip(sounds.onset_s.tolist(), sounds.offset_s.tolist(), strict=True))

    def _known(self, sounds: HeardSounds) -> tuple[SourceEvidence | None, int]:
        """Return what is known by now of where sounds came from, and how many of them wait to be located."""
        heard = self._heard_by(sounds)
        return (None, 0) if heard is None else (self._sources.known(heard[1]), self._sources.waiting)

    def stored(self, *, final: bool = False) -> StoredMap:
        """Return the map of the frames that came, in memory.

        Args:
            final: find up, the floor, places and sounds again, as a build does.

        Raises:
            MapError: no frame came, or none has a depth within the limits.
            BackendError: an encoder is missing, or broke its protocol; the frame is left out.
        """
        if not len(self):
            raise MapError("The map has no frame yet; add one.")
        self._check_again(final)
        if final:
            self._of_channels = self._doubts_of_channels()
        if self._sensor is None:  # the frames wait on, so that a question changes nothing
            other = self._rehearse()
            made = other._settled(final)
            self._of_features = other._of_features
            return made
        return self._settled(final)

    def _settled(self, final: bool) -> StoredMap:
        """Do what ``stored`` does, by what the frames were last found to be."""
        self.settle()
        return self.with_sources(self.finish(self.freeze(), final=final), final=final)

    def doubt(self, sentence: str) -> None:
        """Store with the map why it may be wrong, the first few times; every answer repeats it."""
        if len(self._told) < _MOST_DOUBTS:
            self._told.append(sentence)

    def _check_again(self, final: bool) -> None:
        """Check the frames that are held, as a build does, where there are many more than the last time."""
        count = len(self)
        if count < 2 or self._checked_frames == count or (not final and count < 2 * self._checked_frames):
            return
        self._checked_frames, motion = count, self._walk.motion()
        names = [f"{stamp_s:.2f} s" for stamp_s in motion.stamps_s.tolist()]
        found = plausible_walk(motion.stamps_s, motion.world_from_camera[:, :3, 3], names, strays_are="check the poses")
        odd = *found.notices, found.fault, pace_fault(motion.stamps_s, "frames"), *judge(self._walk.held()).sentences()
        self._found = tuple(sentence for sentence in odd if sentence)

    def freeze(self) -> "FrozenSums":
        """Return what came until now, which frames to come do not change. It takes the time of a frame.

        Raises:
            MapError: no frame was added up yet.
        """
        if self._part is None or self._free is None or self._sensor is None:
            if len(self._left_out):
                raise MapError("Every frame of the map was left out; add one whose features are right.")
            raise MapError("The map has no frame yet; add one.")
        self._total_is_read = True
        clear, pose = self._free.collected()
        undecided = self._keyframes.undecided if self.encoders.keyframes_only else []
        encoded = {frame.index for frame in self._keyframes.last()} if undecided else set[int]()
        return FrozenSums(
            self._walk.frozen(), list(self._left_out), self._total, self._part.sums(), clear, pose,
            self._keyframes.freeze(), undecided, encoded, self._corrections,
        )  # fmt: skip

    def finish(self, came: "FrozenSums", *, final: bool = False, looks_s: float = np.inf) -> StoredMap:
        """Return the map of what came; another thread may add frames meanwhile, and only one may finish.

        Of the sources of sounds it has what is known; ``with_sources`` locates them.

        Args:
            came: from ``freeze``, later than the last time.
            final: as of ``stored``.
            looks_s: seconds for keyframes that were not looked at yet; the rest is left for the next time.

        Raises:
            MapError: none of the frames has a depth within the limits.
            BackendError: an encoder broke its protocol; the frame is left out.
        """
        plan = self._plan(came.walk)
        with self.finishing, silence_progress(True):
            self._finished_corrections = came.corrections
            if final or self._upright is None or self._is_outgrown:
                up, floor, ground = self._upright_of(came.walk.held())
                self._upright = up, floor
                if self._is_outgrown:
                    self._is_outgrown, self._ground = False, ground
            data = self._content(plan, came, *self._upright, final, looks_s)
        sources, wait = self._known(data.sounds)
        folder = HERE if self._sounds is None else self._sounds.clips_folder
        return StoredMap(folder, replace(data, sources=sources, sources_wait=wait), self.encoders)

    def save(self, path: Path, *, overwrite: bool = False) -> StoredMap:
        """Write the map and open it.

        Raises:
            MapError: there is nothing to write, the folder is something else, holds a map already (``overwrite``
                replaces it), or cannot be written.
        """
        require_place(path, overwrite)
        made = self.stored(final=True)
        with lock_folder(path):
            write_stored(path, made, submaps=self.submaps())
        return replace(open_stored(path), encoders=self.encoders)

    def _encodes_at_once(self) -> bool:
        """Return whether a frame is encoded when it comes, and not when its floor or its fate is known."""
        if Kind.PIXELS not in self.encoders or self.encoders.keyframes_only:
            return False
        encoder = self.encoders.pixels
        return self._ground is not None or not (isinstance(encoder, GroundReader) and encoder.reads_ground)

    def _rehearse(self) -> "GrowingMap":
        """Return a map of the frames that wait, as if no other came; what encoders made of them is used again."""
        other = GrowingMap(self.settings, self.encoders, self._given_up, begins_s=self._walk.begins_s)
        other._rehearsed, other._dim = self._rehearsal.features, self._dim
        other._keyframes.share(self._rehearsal.described)
        other._left_out = list(self._left_out)
        other._waiting = list(self._waiting)
        for one in self._waiting:
            other._walk.spread(one.frame, self.settings.gravity.frames)
            other._walk.pass_by(one.frame.stamp_s, one.frame.world_from_camera)
        other._sounds, other._sources = self._sounds, self._sources
        other._told, other._found = self._told, self._found
        other._of_channels, other._of_features = self._of_channels, self._of_features
        other.settle()
        return other

    def _encoded(self, frame: Frame) -> np.ndarray:
        encoder, ground = self.encoders.pixels, self._ground
        if self._rehearsed is not None and ground is not None and frame.index in self._rehearsed:
            then, known = self._rehearsed[frame.index]
            if _alike(then, ground, frame):
                return known
        (features,) = encode_pixels(encoder, [replace(frame, ground=ground)])
        grid = self._checked(features, f"The pixel encoder {encoder.card.id} gave", frame)
        if self._rehearsed is not None and ground is not None:
            self._rehearsed[frame.index] = ground, grid
        return grid

    def _checked(self, features: object, who: str, frame: Frame) -> np.ndarray:
        if self._dim is None:
            self._dim = self.encoders.card(Kind.PIXELS).dim if Kind.PIXELS in self.encoders else None
        grid = as_grid(features, self._dim, who, frame)
        require_unit(grid, who, frame)
        if self._part is not None and self._part.dim != grid.shape[2]:
            raise BackendError(f"{frame.name} has features, and the frames before had none; give them with all frames.")
        self._dim = grid.shape[2]
        return np.array(grid)

    def _fuse(self, came: "_Waiting") -> None:
        sensor, frame, features = self._sensor, came.frame, came.features
        assert sensor is not None
        by_encoder = features is None and Kind.PIXELS in self.encoders
        if by_encoder and came.encode and not self.encoders.keyframes_only:
            features = self._encoded(frame)
        if self._free is None:
            self._free = FreeViewCollector(frame.rig.depth, sensor.model)
            self._through = ThroughCounts(GridSpec(self.settings.voxel_size_m), frame.rig.depth)
        if not (by_encoder and self.encoders.keyframes_only):
            self._sum(frame, features)
            self._walk.append(frame)
            for _ in self._keyframes.add(frame):
                pass
            return
        self._walk.append(frame)
        undecided = self._keyframes.undecided
        for keyframe in self._keyframes.add(frame):
            for one in (*undecided, frame):
                if one.index <= keyframe.index:
                    self._sum(one, self._encoded(one) if one.index == keyframe.index else None)
            undecided = [one for one in (*undecided, frame) if one.index > keyframe.index]

    def _sum(self, frame: Frame, features: np.ndarray | None) -> None:
        """Add a frame to its part; the part before it is added to the total, as the parts of a build are."""
        assert self._sensor is not None and self._free is not None
        number = frame.index // self.settings.frames.summed
        if self._part is None or number != self._part_number:
            self._end_part()
            self._part, self._part_number = self._empty(self._sensor), number
        self._part.add(frame, features)
        self._free.add(frame)
        if self.settings.frames.per_submap:
            self._part_walk.append((frame.stamp_s, np.array(frame.world_from_camera, np.float64)))

    def _end_part(self) -> None:
        if self._part is None:
            return
        sums = self._part.sums()
        self._merge(sums)
        if self._part_walk:
            self._keep_submap(sums)

    def _merge(self, sums: VoxelSums) -> None:
        if self._total is None:
            self._total = VoxelAccumulator(GridSpec(self.settings.voxel_size_m), sums.feature_sum.shape[1])
        elif self._total_is_read:
            self._total = self._total.copy()
        self._total_is_read = False
        self._total.merge(sums)

    def _empty(self, sensor: SensorInfo) -> VoxelAccumulator:
        if self._dim is None and Kind.PIXELS in self.encoders:
            self._dim = self.encoders.card(Kind.PIXELS).dim
        return VoxelAccumulator(
            GridSpec(self.settings.voxel_size_m), self._dim or 0, self.settings.fusion, sensor.model,
            with_spread=self.settings.frames.per_submap > 0,
        )  # fmt: skip

    def _find_upright(self, held: Recording) -> Ground:
        up, floor, ground = self._upright_of(held)
        self._upright = up, floor
        return ground

    def _upright_of(self, held: Recording) -> tuple[UpInfo, GroundInfo, Ground]:
        up = estimate_up(held, self.settings)
        ground, info = estimate_ground(held, self.settings, up)
        return up, info, ground

    def _plan(self, walk: Walk) -> BuildPlan:
        cards = self.encoders.cards()
        models = {kind.value: ModelInfo.of(self.encoders.sources[kind].chosen, card) for kind, card in cards.items()}
        if self._dim is not None and Kind.PIXELS.value not in models:
            models[Kind.PIXELS.value] = ModelInfo(
                backend=GIVEN_FEATURES, id="features", dim=self._dim, licence="unknown", checksum="", prompts=()
            )
        if self._sounds is not None:
            walk.audio = self._sounds.track
        key = key_of("growing", BUILD_VERSION, walk.fingerprint, self.encoders.name, models, self.settings)
        doubts = tuple(dict.fromkeys((*self._told, *self._found, *self._of_channels)))
        return BuildPlan(walk, HERE, self.encoders, self.settings, models, key, "", doubts)

    def _content(
        self, plan: BuildPlan, came: "FrozenSums", up: UpInfo, ground: GroundInfo, final: bool, looks_s: float
    ) -> MapData:
        sensor, rig = self._sensor, came.walk.rig
        assert sensor is not None and self._free is not None
        begin = perf_counter()
        total = VoxelAccumulator(GridSpec(self.settings.voxel_size_m), came.part.feature_sum.shape[1])
        total = total if came.total is None else came.total.copy()
        total.merge(came.part)
        clear, pose = came.clear, came.pose
        if came.undecided:
            others = self._empty(sensor)
            more = FreeViewCollector(rig.depth, sensor.model)
            for frame in came.undecided:
                others.add(frame, self._encoded(frame) if frame.index in came.encoded else None)
                more.add(frame)
            total.merge(others.sums())
            clear, pose = (one + other for one, other in zip((clear, pose), more.collected(), strict=True))
        merged = surfaces(plan, total, [stack_views(clear, pose, self._free.shape)], sensor, self._through)
        keyframes, state = self._keyframes.keyframes(
            plan.rng(RANDOMNESS), came.keyframes, final=final, within_s=looks_s
        )
        sounds = silence(plan)
        if self._sounds is not None and Kind.SOUNDS in self.encoders:
            sounds = self._sounds.heard(came.walk.motion(), final=final)
        keyframes = with_clear_views(keyframes, [stack_views(clear, pose, self._free.shape)])
        if final:
            self._of_features = tuple(feature_doubts(merged.voxels, keyframes, sounds, plan.models))
        timings = Timings.now({"growing": begin - self._begin_s, "merging": perf_counter() - begin})
        left_out = sorted(came.left_out, key=lambda frame: frame.index)
        info = manifest_of(plan, up, ground, merged, keyframes, sounds, timings, len(came.walk), left_out)
        return MapData(info, merged.voxels, keyframes, sounds, state)


def require_place(path: Path, overwrite: bool) -> None:
    """Raise ``MapError`` where no map can go: on something else, or on a map that is not to be replaced."""
    if not is_map_or_free(path):
        raise MapError(f"{path} is there already and is not a map; give another path, nothing in it was touched.")
    if (path / MANIFEST).is_file() and not overwrite:
        raise MapError(
            f"{path} is a finished map already; give another path, or replace it with {option('overwrite')}."
        )


def write_stored(path: Path, made: StoredMap, submaps: Submaps | None = None) -> MapInfo:
    """Write a map of ``GrowingMap`` into its folder, whose lock the caller holds."""
    return write_folder(path, replace(made.data, submaps=submaps))


@dataclass(frozen=True, slots=True)
class FrozenSums:
    """What came to a growing map up to a moment.

    Attributes:
        walk: stamps and poses.
        left_out: frames whose features were wrong.
        total: sums of whole parts; not written to any more.
        part: sums of the part that is not whole.
        clear: up to which depth each frame saw freely; see ``FreeViews``.
        pose: of each of these.
        keyframes: those that were chosen, and the frames that would be if no other came.
        undecided: frames that may become keyframes, where only these are encoded.
        encoded: numbers of those that would.
        corrections: how often poses had been corrected.
    """

    walk: Walk
    left_out: list[BadFrame]
    total: VoxelAccumulator | None
    part: VoxelSums
    clear: list[np.ndarray]
    pose: list[np.ndarray]
    keyframes: FrozenKeyframes
    undecided: list[Frame]
    encoded: set[int]
    corrections: int


@dataclass(frozen=True, slots=True)
class _Waiting:
    """A frame that waits, its features if they are known, and whether they are to be made."""

    frame: Frame
    features: np.ndarray | None
    encode: bool


class _Rehearsal:
    """What encoders made of frames that wait, for questions before the map is settled."""

    def __init__(self) -> None:
        self.features: dict[int, tuple[Ground, np.ndarray]] = {}
        self.described: dict[int, PicturedKeyframe] = {}


def _alike(one: Ground, other: Ground, frame: Frame) -> bool:
    """Return whether two findings of up and the floor are so near that an encoder sees the same."""
    pose = frame.world_from_camera
    apart_m = abs(one.camera_height_m(pose) - other.camera_height_m(pose))
    return apart_m <= _SAME_FLOOR_M and float(one.up_in_world @ other.up_in_world) >= _SAME_UP
