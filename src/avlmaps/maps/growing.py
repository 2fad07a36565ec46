"""A map that grows by one frame after the other, in memory: the steps of a build without a recording or a folder.

Up, the floor and the depth camera are found in the first frames, which wait for that, so that the map of a short walk
is that of a build. Of a longer one they are found again each time it has doubled; what was encoded by then stays.
"""

import hashlib
from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from avlmaps.core.arrays import Float
from avlmaps.core.camera import Rig
from avlmaps.core.errors import BackendError, MapError, RecordingError
from avlmaps.core.progress import silence_progress
from avlmaps.core.registry import Kind
from avlmaps.maps.fusion.accumulator import VoxelAccumulator
from avlmaps.maps.fusion.free_space import FreeViewCollector
from avlmaps.maps.grid import GridSpec
from avlmaps.maps.keyframes.growing import GrowingKeyframes, PicturedKeyframe
from avlmaps.maps.perceived import as_grid, encode_pixels, require_unit
from avlmaps.maps.pipeline.estimate import estimate_ground, estimate_sensor, estimate_up
from avlmaps.maps.pipeline.keyframes import RANDOMNESS
from avlmaps.maps.pipeline.plan import BUILD_VERSION, BuildPlan
from avlmaps.maps.pipeline.sounds import silence
from avlmaps.maps.pipeline.write import manifest_of, surfaces
from avlmaps.maps.settings import BuildSettings
from avlmaps.maps.store.checkpoints import key_of
from avlmaps.maps.store.integrity import IntegrityCheck
from avlmaps.maps.store.lock import lock_folder
from avlmaps.maps.store.manifest import BadFrame, GroundInfo, MapInfo, ModelInfo, SensorInfo, Timings, UpInfo
from avlmaps.maps.store.manifest_file import MANIFEST
from avlmaps.maps.store.reader import GIVEN_FEATURES, MapArrays, StoredMap, open_stored
from avlmaps.maps.store.writer import MapContent, is_map_or_free, write_map
from avlmaps.perception.encoders import Encoders
from avlmaps.perception.protocols import GroundReader
from avlmaps.recordings.memory import MemoryRecording, frame_digest, same_rig
from avlmaps.recordings.types import Frame, Ground, Recording

# Features of waiting frames take no more memory than this.
_MOST_WAITING_BYTES = 5e8
_HERE = Path("memory")
# Findings of the floor and up within these are one.
_SAME_FLOOR_M = 0.05
_SAME_UP = 0.9994  # cosine of 2 degrees
_Waiting = tuple[Frame, np.ndarray | None]


class GrowingMap:
    """Takes frames; ``stored`` is the map of those that came.

    Attributes:
        settings: of a build.
        encoders: the encoders; that of sounds is not called, as frames have none.
    """

    def __init__(
        self, settings: BuildSettings, encoders: Encoders, up_in_world: Float[np.ndarray, "3"] | None = None
    ) -> None:
        """Begin without frames.

        Args:
            settings: of a build; ``frames`` does not count.
            encoders: the encoders.
            up_in_world: unit vector; None finds it in the frames.
        """
        self.settings = settings.for_profile(encoders.weight_variance_m2)
        self.encoders = encoders
        self._given_up = up_in_world
        self._walk = _Walk(up_in_world)
        self._waiting: list[_Waiting] = []
        self._left_out: list[BadFrame] = []
        self._sensor: SensorInfo | None = None
        self._ground: Ground | None = None
        self._total: VoxelAccumulator | None = None
        self._free: FreeViewCollector | None = None
        self._keyframes = GrowingKeyframes(encoders, self.settings.keyframes)
        self._dim: int | None = None
        self._rehearsed: dict[int, tuple[Ground, np.ndarray]] | None = None
        self._rehearsal = _Rehearsal()
        self._begin_s = perf_counter()

    def __len__(self) -> int:
        """Return how many frames are in the map."""
        return len(self._walk) + len(self._waiting)

    @property
    def next_index(self) -> int:
        """The number of the next frame."""
        return len(self) + len(self._left_out)

    @property
    def last_stamp_s(self) -> float | None:
        """The stamp of the last frame, None before the first."""
        last = self._waiting[-1][0].stamp_s if self._waiting else None
        return last if last is not None else (self._walk.stamps[-1] if self._walk.stamps else None)

    def add(self, frame: Frame, features: Any = None) -> None:
        """Add a frame. What is wrong with it leaves the map as it was.

        Args:
            frame: later than the last one, of the same cameras.
            features: of its pixels, (rows, columns, d) covering the picture evenly, each of unit length or zero;
                instead of the encoder's.

        Raises:
            RecordingError: it is not later, or has other cameras.
            BackendError: the features, or the encoder's, are not what they must be. Where frames had waited, it may
                be one of those; it is left out.
        """
        frame = self._accepted(frame)
        if features is not None:
            features = self._checked(features, "The features that were given are", frame)
        elif self._encodes_at_once():
            features = self._encoded(frame)
        self._waiting.append((frame, features))
        self._walk.spread(frame, self.settings.gravity.frames)
        waiting_bytes = sum(grid.nbytes for _, grid in self._waiting if grid is not None)
        enough = len(self._waiting) >= self.settings.gravity.frames or waiting_bytes > _MOST_WAITING_BYTES
        if self._sensor is not None or enough:
            self._settle()

    def stored(self, *, final: bool = False) -> StoredMap:
        """Return the map of the frames that came, in memory.

        Args:
            final: learn places again, as a build does.

        Raises:
            MapError: no frame came, or none has a depth within the limits.
            BackendError: an encoder is missing, or broke its protocol; the frame is left out.
        """
        if not len(self):
            raise MapError("The map has no frame yet; add one.")
        if self._sensor is None:  # the frames wait on, so that a question changes nothing
            return self._rehearse().stored(final=final)
        self._settle()
        plan = self._plan()
        with silence_progress(True):
            up, ground = self._upright()
            content, info = self._content(plan, up, ground, final)
        rig, grid = self._walk.rig, GridSpec(self.settings.voxel_size_m)
        arrays = MapArrays(content.voxels, content.keyframes, content.place_state, content.sounds)
        return StoredMap(_HERE, info, grid, up.vector(), arrays, self.encoders, rig, IntegrityCheck(_HERE, {}))

    def save(self, path: Path, *, overwrite: bool = False) -> StoredMap:
        """Write the map and open it.

        Raises:
            MapError: there is nothing to write, the folder is something else, holds a map already (``overwrite``
                replaces it), or cannot be written.
        """
        if not is_map_or_free(path):
            raise MapError(f"{path} is there already and is not a map; give another path, nothing in it was touched.")
        if (path / MANIFEST).is_file() and not overwrite:
            raise MapError(f"{path} is a finished map already; give another path, or replace it with overwrite=True.")
        made = self.stored(final=True)
        content = MapContent(made.voxels, made.keyframes, made.place_state, made.sounds, path)
        with lock_folder(path):
            write_map(path, content, made.info)
        return replace(open_stored(path), encoders=self.encoders)

    def _accepted(self, frame: Frame) -> Frame:
        last_s = self.last_stamp_s
        if last_s is not None and not frame.stamp_s > last_s:
            raise RecordingError(
                f"stamp_s of {frame.name} is {frame.stamp_s:g} s, not after the last frame's {last_s:g} s; add frames "
                "in the order of time."
            )
        rig = self._walk.rig_or(frame.rig)
        if not same_rig(frame.rig, rig):
            raise RecordingError(
                f"{frame.name} has another camera than the frames before ({frame.rig.rgb} and depths of "
                f"{frame.rig.depth.width}x{frame.rig.depth.height}, before {rig.rgb} and {rig.depth.width}x"
                f"{rig.depth.height}); a map has one."
            )
        return replace(frame, rig=rig)

    def _encodes_at_once(self) -> bool:
        """Return whether a frame is encoded when it comes, and not when its floor or its fate is known."""
        if Kind.PIXELS not in self.encoders or self.encoders.keyframes_only:
            return False
        encoder = self.encoders.pixels
        return self._ground is not None or not (isinstance(encoder, GroundReader) and encoder.reads_ground)

    def _rehearse(self) -> "GrowingMap":
        """Return a map of the frames that wait, as if no other came; what encoders made of them is used again."""
        other = GrowingMap(self.settings, self.encoders, self._given_up)
        other._rehearsed, other._dim = self._rehearsal.features, self._dim
        other._keyframes.share(self._rehearsal.described)
        other._left_out = list(self._left_out)
        other._waiting = list(self._waiting)
        for frame, _ in self._waiting:
            other._walk.spread(frame, self.settings.gravity.frames)
        other._settle()
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
        if self._total is not None and self._total.dim != grid.shape[2]:
            raise BackendError(f"{frame.name} has features, and the frames before had none; give them with all frames.")
        self._dim = grid.shape[2]
        return np.array(grid)

    def _settle(self) -> None:
        """Fuse what waits; one whose features are wrong is left out, and the first of these is raised."""
        if not self._waiting:
            return
        with silence_progress(True):
            if self._sensor is None:
                held = self._walk.held()
                self._sensor, self._ground = estimate_sensor(held, self.settings), self._upright_of(held)[2]
                self._rehearsal = _Rehearsal()
            elif self._walk.has_doubled:
                self._ground = self._upright_of(self._walk.held())[2]
            faults: list[BackendError] = []
            waiting, self._waiting = self._waiting, []
            for frame, features in waiting:
                try:
                    self._fuse(replace(frame, ground=self._ground), features)
                except BackendError as fault:
                    faults.append(fault)
                    self._left_out.append(BadFrame(index=frame.index, why=str(fault)))
        if faults:
            raise faults[0]

    def _fuse(self, frame: Frame, features: np.ndarray | None) -> None:
        sensor = self._sensor
        assert sensor is not None
        by_encoder = features is None and Kind.PIXELS in self.encoders
        if by_encoder and not self.encoders.keyframes_only:
            features = self._encoded(frame)
        if self._total is None or self._free is None:
            self._total = self._empty(sensor)
            self._free = FreeViewCollector(frame.rig.depth, sensor.model)
        if not (by_encoder and self.encoders.keyframes_only):
            self._total.add(frame, features)
            self._free.add(frame)
            self._walk.append(frame)
            for _ in self._keyframes.add(frame):
                pass
            return
        self._walk.append(frame)
        undecided = self._keyframes.undecided
        for keyframe in self._keyframes.add(frame):
            decided = [one for one in (*undecided, frame) if one.index <= keyframe.index]
            undecided = [one for one in (*undecided, frame) if one.index > keyframe.index]
            self._add_to(self._total, decided, {keyframe.index})
            for one in decided:
                self._free.add(one)

    def _add_to(self, total: VoxelAccumulator, frames: Sequence[Frame], encoded: set[int]) -> None:
        for frame in frames:
            total.add(frame, self._encoded(frame) if frame.index in encoded else None)

    def _empty(self, sensor: SensorInfo) -> VoxelAccumulator:
        if self._dim is None and Kind.PIXELS in self.encoders:
            self._dim = self.encoders.card(Kind.PIXELS).dim
        return VoxelAccumulator(
            GridSpec(self.settings.voxel_size_m), self._dim or 0, self.settings.fusion, sensor.model
        )

    def _upright(self) -> tuple[UpInfo, GroundInfo]:
        return self._upright_of(self._walk.held())[:2]

    def _upright_of(self, held: Recording) -> tuple[UpInfo, GroundInfo, Ground]:
        up = estimate_up(held, self.settings)
        ground, info = estimate_ground(held, self.settings, up)
        return up, info, ground

    def _plan(self) -> BuildPlan:
        cards = self.encoders.cards()
        models = {kind.value: ModelInfo.of(self.encoders.sources[kind].chosen, card) for kind, card in cards.items()}
        if self._dim is not None and Kind.PIXELS.value not in models:
            models[Kind.PIXELS.value] = ModelInfo(
                backend=GIVEN_FEATURES, id="features", dim=self._dim, licence="unknown", checksum="", prompts=()
            )
        key = key_of("growing", BUILD_VERSION, self._walk.fingerprint, self.encoders.name, models, self.settings)
        return BuildPlan(self._walk, _HERE, self.encoders, self.settings, models, key, "")

    def _content(self, plan: BuildPlan, up: UpInfo, ground: GroundInfo, final: bool) -> tuple[MapContent, MapInfo]:
        total, free, sensor = self._total, self._free, self._sensor
        if total is None or free is None or sensor is None:
            raise MapError("Every frame of the map was left out; add one whose features are right.")
        begin, views = perf_counter(), [free.views()]
        if self.encoders.keyframes_only and (undecided := self._keyframes.undecided):
            decided, total = total, self._empty(sensor)
            total.merge(decided.sums())
            self._add_to(total, undecided, {frame.index for frame in self._keyframes.last()})
            more = FreeViewCollector(self._walk.rig.depth, sensor.model)
            for frame in undecided:
                more.add(frame)
            views.append(more.views())
        merged = surfaces(plan, total, views, sensor)
        keyframes, state = self._keyframes.keyframes(plan.rng(RANDOMNESS), final=final)
        content = MapContent(merged.voxels, keyframes, state, silence(plan), _HERE)
        finished = datetime.now(UTC).isoformat(timespec="seconds")
        stages_s = {"growing": begin - self._begin_s, "merging": perf_counter() - begin}
        timings = Timings(finished=finished, elapsed_s=sum(stages_s.values()), stages_s=stages_s)
        left_out = sorted(self._left_out, key=lambda frame: frame.index)
        return content, manifest_of(plan, up, ground, content, merged, timings, len(self._walk), left_out)


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


class _Walk(Recording):
    """The frames of a growing map as a recording: all stamps and poses, and some frames spread over them."""

    def __init__(self, up_in_world: Float[np.ndarray, "3"] | None) -> None:
        self.path, self.format, self.audio, self.notices = _HERE, "memory", None, ()
        self.up_in_world = up_in_world
        self.stamps: list[float] = []
        self.poses: list[np.ndarray] = []
        self._held: list[Frame] = []
        self._stride, self._came, self.has_doubled = 1, 0, False
        self._digest = hashlib.sha256()

    def rig_or(self, other: Rig) -> Rig:
        """Return the cameras of the first frame, or of the one that is to be it."""
        return self.rig if self._held else other

    def spread(self, frame: Frame, most: int) -> None:
        """Hold a frame if it is one of those spread over the walk, fewer than ``most`` of them."""
        self.has_doubled, self.rig = False, self.rig_or(frame.rig)
        if self._came % self._stride == 0:
            if len(self._held) >= most:
                self._stride, self._held, self.has_doubled = 2 * self._stride, self._held[::2], True
            if self._came % self._stride == 0:
                self._held.append(frame)
        self._came += 1

    def held(self) -> Recording:
        """Return the frames that are held."""
        return MemoryRecording(self._held, self.up_in_world)

    def append(self, frame: Frame) -> None:
        """Take note of a frame that was fused."""
        self.stamps.append(frame.stamp_s)
        self.poses.append(np.asarray(frame.world_from_camera, np.float64))
        self._digest.update(frame_digest(frame))

    @property
    def stamps_s(self) -> Float[np.ndarray, " n"]:  # pyright: ignore[reportIncompatibleVariableOverride]
        """When."""
        return np.array(self.stamps, np.float64)

    @property
    def world_from_camera(self) -> Float[np.ndarray, "n 4 4"]:  # pyright: ignore[reportIncompatibleVariableOverride]
        """From where."""
        return np.stack(self.poses)

    def frame(self, index: int) -> Frame:
        """Refuse: frames are not stored."""
        raise RecordingError(f"Frame {index} is not stored by a growing map.")

    @property
    def fingerprint(self) -> str:  # pyright: ignore[reportIncompatibleVariableOverride]
        """A hash of all frames."""
        return self._digest.hexdigest()

    def __len__(self) -> int:
        return len(self.stamps)
