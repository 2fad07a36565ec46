"""What some frames brought to a map: their sums, where they saw freely, their submap; and that in a folder."""

from dataclasses import dataclass, field
from operator import itemgetter
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from avlmaps.core.arrays import Float, Float64, Int32
from avlmaps.core.columns import concat
from avlmaps.core.errors import BackendError, MapError
from avlmaps.core.files import decode_json
from avlmaps.core.registry import Kind
from avlmaps.core.timeline import Trajectory
from avlmaps.maps.fusion.accumulator import VoxelAccumulator
from avlmaps.maps.fusion.free_space import FreeViews, free_views
from avlmaps.maps.fusion.sensor import SensorModel
from avlmaps.maps.fusion.submaps import submap_of
from avlmaps.maps.fusion.voxel_sums import VoxelSums, features_alone
from avlmaps.maps.grid import GridSpec
from avlmaps.maps.pose_correction import PoseCorrection, moved_frame
from avlmaps.maps.settings import BuildSettings
from avlmaps.maps.store.manifest import BadFrame
from avlmaps.maps.store.tables import as_kind, explain_write_errors, fields_of, read_arrays, write_arrays
from avlmaps.maps.types import Keyframes, Submaps
from avlmaps.perception.encoders import Encoders
from avlmaps.recordings.memory import MemoryRecording
from avlmaps.recordings.types import Frame, Recording


@dataclass(frozen=True, slots=True)
class MapState:
    """What some frames brought. Those of other frames of the same recording, made with the same ``Start``, add up."""

    sums: VoxelSums
    views: FreeViews  # where the frames saw freely
    keyframes: Keyframes  # those among the frames, without learnt places
    stamp_s: Float64[np.ndarray, " f"]
    pose: Float64[np.ndarray, "f 4 4"]
    bad: tuple[BadFrame, ...]  # frames that were left out


class _Note(msgspec.Struct):
    key: str
    bad: tuple[BadFrame, ...]


_KINDS = {"sums": VoxelSums, "views": FreeViews, "keyframes": Keyframes}


def save_state(file: Path, key: str, state: MapState) -> None:
    """Store a state; a kill at any instant leaves all of it or none. ``key`` is the hash of all it depends on."""
    arrays = {"stamp_s": state.stamp_s, "pose": state.pose}
    for name in _KINDS:
        arrays |= fields_of(getattr(state, name), f"{name}.")
    with explain_write_errors(file):
        file.parent.mkdir(parents=True, exist_ok=True)
        write_arrays(file, arrays, msgspec.json.encode(_Note(key, state.bad)).decode())


def load_state(file: Path) -> MapState:
    """Read a state; its large arrays stay on the disk until they are used."""
    arrays, note = read_arrays(file)
    parts: dict[str, Any] = {name: as_kind(kind, arrays, file, f"{name}.") for name, kind in _KINDS.items()}
    bad = decode_json(note.encode(), _Note).bad
    return MapState(**parts, stamp_s=arrays["stamp_s"], pose=arrays["pose"], bad=bad)


def bad_frames(file: Path, key: str) -> tuple[BadFrame, ...] | None:
    """Return the frames that a stored state leaves out; None where no whole state of this key is stored."""
    try:
        note: _Note = decode_json(read_arrays(file)[1].encode(), _Note)
    except (MapError, msgspec.DecodeError):
        return None
    return note.bad if note.key == key else None


class Walked:
    """Stamps and poses that become more; one thread may add some while another reads them."""

    def __init__(self) -> None:
        self._walk: list[tuple[float, np.ndarray]] = []

    @property
    def stamps_s(self) -> Float[np.ndarray, " n"]:
        """Those until now, in the order in which they came."""
        return np.array([stamp_s for stamp_s, _ in list(self._walk)])

    def append(self, stamp_s: float, pose: Float[np.ndarray, "4 4"]) -> None:
        """Take note of one; a frame that was dropped may come a little late."""
        self._walk.append((stamp_s, np.array(pose, np.float64)))

    def until_now(self) -> Trajectory:
        """Return those until now, at least one, in the order of time."""
        stamps_s, poses = zip(*sorted(self._walk, key=itemgetter(0)), strict=True)
        return Trajectory(np.array(stamps_s), np.stack(poses))

    def move(self, step: PoseCorrection) -> None:
        """Move all by a correction of the poses."""
        now = self.until_now()
        self._walk = list(zip(now.stamps_s.tolist(), step.moved(now.stamps_s, now.world_from_body), strict=True))


class HeldFrames:
    """Holds frames spread evenly over a walk, up to a number: every one, then every other, every fourth, ..."""

    def __init__(self, most: int) -> None:
        self._most, self._stride, self._came, self._held = most, 1, 0, list[Frame]()

    def __len__(self) -> int:
        return len(self._held)

    def add(self, frame: Frame) -> None:
        """Take the next frame."""
        if self._came % self._stride == 0 and len(self._held) >= self._most:
            self._stride, self._held = 2 * self._stride, self._held[::2]
        if self._came % self._stride == 0:
            self._held.append(frame)
        self._came += 1

    def recording(self, up_in_world: Float[np.ndarray, "3"] | None) -> Recording:
        """Return the frames as a recording; there is at least one."""
        return MemoryRecording(list(self._held), up_in_world)

    def move(self, step: PoseCorrection) -> None:
        """Move the frames by a correction of their poses."""
        self._held = [moved_frame(frame, step) for frame in self._held]


@dataclass(slots=True)
class Part:
    """Some frames, all of one submap."""

    number: int  # of the submap
    sums: VoxelAccumulator
    views: list[FreeViews] = field(default_factory=list[FreeViews])  # where the frames saw freely
    stamps_s: list[float] = field(default_factory=list[float])
    poses: list[np.ndarray] = field(default_factory=list[np.ndarray])

    def submap(self) -> Submaps:
        """Return the submap, without what its frames saw freely."""
        return submap_of(
            self.sums.sums(), np.array(self.stamps_s), np.stack(self.poses), np.zeros((0, 1, 1), np.uint16)
        )


class SubmapBook:
    """The submaps of a map that grows; the last one is open until frames of the next one come."""

    def __init__(self) -> None:
        self._whole: list[Submaps] = []
        self._open: Part | None = None

    def add(self, part: Part, empty: VoxelAccumulator) -> None:
        """Add frames to the open submap if that has their number; else close it, and begin theirs in ``empty`` sums."""
        if self._open is None or self._open.number != part.number:
            self.close()
            self._open = Part(part.number, empty)
        self._open.sums.merge(part.sums.sums())
        self._open.stamps_s += part.stamps_s
        self._open.poses += part.poses

    def add_whole(self, submap: Submaps) -> None:
        """Add a submap of a stored state, which is whole."""
        self._whole.append(submap)

    def close(self) -> None:
        """Close the open submap: frames that follow begin another one, even if their number is its number."""
        self._whole += [] if self._open is None else [self._open.submap()]
        self._open = None

    def submaps(self) -> Submaps | None:
        """Return all, the open one as it is now; None where there is none."""
        every = self._whole + ([] if self._open is None else [self._open.submap()])
        return concat(every) if every else None


class FrameSums:
    """Takes frames, and gives them away as parts; ``dim`` is the length of a feature, None until that is known."""

    def __init__(self, settings: BuildSettings, encoders: Encoders) -> None:
        self.dim: int | None = None
        self._settings, self._encoders = settings, encoders
        self._parts: list[Part] = []
        self._submap = -1, 0  # its number, and how many of its frames came

    def __len__(self) -> int:
        """Return how many frames there are."""
        return sum(len(part.stamps_s) for part in self._parts)

    def add(self, frame: Frame, features: np.ndarray | None, sensor: SensorModel) -> None:
        """Add a frame; see ``VoxelAccumulator.add``."""
        if features is not None and self._known_dim() == 0:
            raise BackendError(f"{frame.name} has features, and the frames before had none; give them with all frames.")
        self.dim = features.shape[2] if features is not None else self._known_dim()
        part = self._part_for(frame, sensor)
        part.sums.add(frame, features)
        part.views.append(free_views([frame], sensor))
        part.stamps_s.append(frame.stamp_s)
        part.poses.append(np.array(frame.world_from_camera, np.float64))
        self._submap = part.number, part.sums.frames

    def add_features(self, frame: Frame, features: np.ndarray, sensor: SensorModel) -> None:
        """Add the features of a frame that was added without."""
        looked = self.empty(sensor)
        looked.add(frame, features)
        self._part_for(frame, sensor).sums.merge(features_alone(looked.sums()))

    def take(self) -> list[Part]:
        """Return the parts, and begin others."""
        parts, self._parts = self._parts, []
        return parts

    def end_submap(self) -> None:
        """Let the next frame begin a submap."""
        self._submap = -1, 0

    def empty(self, sensor: SensorModel) -> VoxelAccumulator:
        """Return sums of no frame."""
        settings, with_spread = self._settings, self._settings.frames.per_submap > 0
        grid = GridSpec(settings.voxel_size_m)
        return VoxelAccumulator(grid, self._known_dim() or 0, settings.fusion, sensor, with_spread=with_spread)

    def views_at(self, index: Int32[np.ndarray, "n 3"]) -> Int32[np.ndarray, " n"]:
        """Return how many frames have a pixel in each of some voxels."""
        return sum((part.sums.views_at(index) for part in self._parts), np.zeros(len(index), np.int32))

    def _known_dim(self) -> int | None:
        if self.dim is None and Kind.PIXELS in self._encoders:
            self.dim = self._encoders.card(Kind.PIXELS).dim
        return self.dim

    def _part_for(self, frame: Frame, sensor: SensorModel) -> Part:
        per_submap = self._settings.frames.per_submap
        number = frame.index // per_submap if per_submap else 0
        if not self._parts or self._parts[-1].number != number:
            sums = self.empty(sensor)
            sums.frames = self._submap[1] if self._submap[0] == number else 0
            self._parts.append(Part(number, sums))
        return self._parts[-1]
