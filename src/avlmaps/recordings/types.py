"""A recording: frames with poses, an audio track, and how to get at them without reading it whole; parts of one."""

import hashlib
import os
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from avlmaps.core.arrays import Bool, Float, Int, UInt8
from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.files import sampled_digest
from avlmaps.core.timeline import Trajectory
from avlmaps.recordings.audio import AudioTrack

# Small files are read whole for a fingerprint, of large ones evenly spread blocks and the end, up to a share of this.
# The end of a PNG holds a checksum of all its pixels; of larger JPEG, NPY and bags a change between the blocks is not
# seen.
RECORDING_BUDGET_BYTES = 1 << 30
_LEAST_BUDGET_BYTES, LARGEST_BUDGET_BYTES = 4096, 1 << 24


@dataclass(frozen=True, slots=True)
class Ground:
    """The up direction (unit vector), and the floor's height along it under cameras of rising heights."""

    up_in_world: Float[np.ndarray, "3"]
    camera_m: Float[np.ndarray, " k"]
    floor_m: Float[np.ndarray, " k"]

    def camera_height_m(self, world_from_camera: Float[np.ndarray, "4 4"]) -> float:
        height = float(world_from_camera[:3, 3] @ self.up_in_world)
        nearest = int(np.argmin(np.abs(self.camera_m - height)))
        return height - float(self.floor_m[nearest])


@dataclass(frozen=True, slots=True)
class BaseHeight:
    """How far a robot's base is below its depth camera, metres; on the floor it is ROS's ``base_footprint``."""

    below_camera_m: float
    on_floor: bool


@dataclass(frozen=True, slots=True, repr=False)
class Frame:
    """One moment of the camera.

    Attributes:
        index: position in the recording, from 0.
        name: what the recording calls it (``000012``).
        stamp_s: seconds from the recording's start.
        depth_m: z-depth in metres; 0 where there is none (never NaN).
        world_from_camera: 4x4 pose of the depth camera.
        ground: the up direction and where the floor is, once a build knows it.
    """

    index: int
    name: str
    stamp_s: float
    rgb: UInt8[np.ndarray, "h w 3"]
    depth_m: Float[np.ndarray, "hd wd"]
    world_from_camera: Float[np.ndarray, "4 4"]
    rig: Rig
    ground: Ground | None = None

    def __post_init__(self) -> None:
        rgb, depth = self.rig.rgb, self.rig.depth
        wanted = (rgb.height, rgb.width, 3), (depth.height, depth.width), (4, 4)
        given = self.rgb.shape, self.depth_m.shape, self.world_from_camera.shape
        if given != wanted or (self.rgb.dtype, self.depth_m.dtype) != (np.uint8, np.float32):
            raise ValueError(
                f"rgb, depth_m and world_from_camera are {self.rgb.dtype} and {self.depth_m.dtype} of {given}; the rig "
                f"says uint8 and float32 of {wanted}"
            )

    def copy(self) -> "Frame":
        own = self.rgb.copy(), self.depth_m.copy(), self.world_from_camera.copy()
        return replace(self, rgb=own[0], depth_m=own[1], world_from_camera=own[2])

    @property
    def camera(self) -> Pinhole | Rig:
        """The camera of the colour picture where depth is registered to it, else both cameras."""
        return self.rig.rgb if self.rig.registered else self.rig

    def __repr__(self) -> str:
        height, width = self.rgb.shape[:2]
        return f"Frame({self.name!r} at {self.stamp_s:.2f} s: {width}x{height}, depth {np.mean(self.valid):.0%})"

    @property
    def valid(self) -> Bool[np.ndarray, "hd wd"]:
        return self.depth_m > 0.0


class Recording(ABC):
    """Frames in the order of time, with poses, and perhaps an audio track. Readers subclass it.

    Opening one reads the poses and the list of names, never a picture. Frames without a usable pose are not among them.

    Attributes:
        format: the format's name on the command line, such as ``7scenes``.
        stamps_s: (n,) float64, strictly rising, seconds from the start of the recording.
        world_from_camera: (n, 4, 4) float64, orthonormal. The world's z axis need not be up.
        up_in_world: unit vector, or None where the recording does not know the up direction.
        audio: the sound track on the frames' clock, or None.
        notices: one sentence for each thing worth knowing (gaps, clock jumps, frames left out).
        topics: of a bag, which topic was chosen for what (rgb, depth, pose, audio).
        base_height: where the robot's base is under the camera in the first frame.
        trajectory: the poses at their own rate on the frames' clock, where the frames' were interpolated from them.
        begins_s: what the clock of its files said at time 0, seconds: since 1970 where their stamps are dates.
        posed: share of the frames that are used: with a pose, on one clock; the others are left out.
        stored_depth_unit_m: metres of one unit of the depth as it is stored; 1 where that is floats in metres.
    """

    path: Path
    format: str
    rig: Rig
    stamps_s: Float[np.ndarray, " n"]
    world_from_camera: Float[np.ndarray, "n 4 4"]
    up_in_world: Float[np.ndarray, "3"] | None
    audio: AudioTrack | None
    notices: tuple[str, ...]
    topics: Mapping[str, str] = MappingProxyType({})
    base_height: "BaseHeight | None" = None
    trajectory: Trajectory | None = None
    begins_s: float = 0.0
    posed: float = 1.0
    stored_depth_unit_m: float = 1e-3

    @property
    def depth_units_per_m(self) -> float:
        """Units of depth PNGs in a metre; 1000 where depth is stored otherwise."""
        return 1000.0 if self.stored_depth_unit_m == 1.0 else round(1.0 / self.stored_depth_unit_m, 6)

    @property
    def walk(self) -> Trajectory:
        """The camera's poses all along: at their own rate where that is known, else those of the frames."""
        return self.trajectory or Trajectory(self.stamps_s, self.world_from_camera)

    @abstractmethod
    def frame(self, index: int) -> Frame:
        """Read one frame; RecordingError names the file that is missing, truncated or of another size."""

    def file_groups(self) -> list[tuple[Path, Sequence[str]]]:
        """Return the files that it is read from, but for its sound: folders, and the names in or below each."""
        if not self.path.is_dir():
            return [(self.path.parent, [self.path.name])]
        return [(self.path, sorted(str(f.relative_to(self.path)) for f in self.path.rglob("*") if f.is_file()))]

    @cached_property
    def fingerprint(self) -> str:
        """A hex SHA-256 of poses, stamps, cameras and every file's name and content; a copy has the same."""
        digest, up = hashlib.sha256(), np.zeros(3) if self.up_in_world is None else self.up_in_world
        digest.update(f"{self.format} {_numbers(self.rig)} {self.depth_units_per_m}".encode())
        for numbers in (up, self.stamps_s, self.world_from_camera):
            # Rounded, so that another machine's last bit makes no other recording; + 0.0 turns -0.0 into 0.0.
            digest.update(np.ascontiguousarray(np.round(numbers, 9) + 0.0, "<f8").tobytes())
        for folder, names in self._every_file():
            add_files(digest, folder, names)
        if self.audio is not None:
            digest.update(f"{self.audio.start_s}".encode())
        return digest.hexdigest()

    def change_stamp(self) -> str:
        """Return a word that changes when a file of the recording is written, so that no map is made of two states."""
        digest = hashlib.sha256()
        for folder, names in self._every_file():
            for name in names:
                try:
                    found = os.stat(f"{folder}{os.sep}{name}")  # noqa: PTH116 - of a million files
                    digest.update(f"{found.st_size} {found.st_mtime_ns} {found.st_ino}\n".encode())
                except OSError:
                    digest.update(b"missing\n")
        return digest.hexdigest()

    def _every_file(self) -> list[tuple[Path, Sequence[str]]]:
        own = self.audio is None or self.audio.label  # what was unpacked from a file is part of that
        sound = () if own or self.audio is None else self.audio.files or (self.audio.path,)
        return [*self.file_groups(), *((file.parent, [file.name]) for file in sound)]

    def name(self, index: int) -> str:
        return f"{index:06d}"

    def colour_file(self, index: int) -> Path | None:
        """Return the JPEG or PNG file of a frame's colour picture, where it is one, so that a copy need not encode."""
        return None

    def depth_file(self, index: int) -> Path | None:
        """Return the 16-bit PNG file of a frame's depth (0 and 65535 say none), where it is one."""
        return None

    def __len__(self) -> int:
        return len(self.stamps_s)

    def __iter__(self) -> Iterator[Frame]:
        return self.frames()

    def __repr__(self) -> str:
        size = f"{self.rig.rgb.width}x{self.rig.rgb.height}"
        sound = "" if self.audio is None else ", with sound"
        name = f"{type(self).__name__}({self.path.name!r}"
        return f"{name}: {len(self)} frames of {size}, {self.duration_s:.1f} s, format {self.format}{sound})"

    def frames(self, start: int = 0, stop: int | None = None, step: int = 1) -> Iterator[Frame]:
        for index in range(start, len(self) if stop is None else min(stop, len(self)), step):
            yield self.frame(index)

    @property
    def duration_s(self) -> float:
        return float(self.stamps_s[-1] - self.stamps_s[0]) if len(self) > 1 else 0.0


def budget_bytes(files: int) -> int:
    """Return how much of each of a recording's files is read for its fingerprint."""
    return min(max(RECORDING_BUDGET_BYTES // max(files, 1), _LEAST_BUDGET_BYTES), LARGEST_BUDGET_BYTES)


def add_files(digest: Any, folder: Path, names: Sequence[str]) -> None:
    """Add names and contents of files below a folder to a hash of ``hashlib``."""
    budget, prefix = budget_bytes(len(names)), f"{folder}{os.sep}"  # joining a million paths the long way takes seconds
    for name in names:
        digest.update(f"{name}\0".encode(errors="surrogateescape"))
        digest.update(sampled_digest(prefix + name, budget))


def _numbers(rig: Rig) -> list[float]:
    cameras = [[c.fx, c.fy, c.cx, c.cy, float(c.width), float(c.height)] for c in (rig.rgb, rig.depth)]
    return [*cameras[0], *cameras[1], *map(float, rig.rgb_from_depth.ravel())]


_AS_WHOLE = (
    "path", "format", "rig", "up_in_world", "audio", "notices", "base_height", "trajectory", "begins_s", "posed",
    "stored_depth_unit_m",
)  # fmt: skip


class Subset(Recording):
    """Chosen frames of another recording, in place; stamps, poses, names and the sound track stay what they are."""

    def __init__(self, whole: Recording, indices: Sequence[int] | range | Int[np.ndarray, " n"]) -> None:
        chosen = np.asarray(indices, np.int64).reshape(-1)
        if len(chosen) and (chosen[0] < 0 or chosen[-1] >= len(whole) or (np.diff(chosen) <= 0).any()):
            raise ValueError(f"indices must rise strictly within 0 ... {len(whole) - 1}")
        self.whole = whole
        self.indices = chosen
        for name in _AS_WHOLE:
            setattr(self, name, getattr(whole, name))
        self.stamps_s = whole.stamps_s[chosen]
        self.world_from_camera = whole.world_from_camera[chosen]

    def frame(self, index: int) -> Frame:
        return replace(self.whole.frame(int(self.indices[index])), index=index)

    def name(self, index: int) -> str:
        return self.whole.name(int(self.indices[index]))

    def colour_file(self, index: int) -> Path | None:
        return self.whole.colour_file(int(self.indices[index]))

    def depth_file(self, index: int) -> Path | None:
        return self.whole.depth_file(int(self.indices[index]))

    def change_stamp(self) -> str:
        return self.whole.change_stamp()

    @cached_property
    def fingerprint(self) -> str:
        return hashlib.sha256(self.whole.fingerprint.encode() + self.indices.astype("<i8").tobytes()).hexdigest()
