"""A recording whose pictures a reader has to unpack: those of an archive, a database, a rare compression."""

import hashlib
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float, Float32, UInt8

from avlmaps.core.camera import Pinhole, Rig
from avlmaps.recordings.audio import AudioTrack
from avlmaps.recordings.content import add_files, stamp_of
from avlmaps.recordings.formats.file_recording import Shots, geometry_digest
from avlmaps.recordings.types import Frame, Recording


@runtime_checkable
class Pictures(Protocol):
    """Where the pictures lie; each is found by the name that the shots have for it."""

    def colour(self, name: str, camera: Pinhole) -> UInt8[np.ndarray, "h w 3"]:
        """Decode a colour picture, or raise ``RecordingError``."""
        ...

    def depth(self, name: str, camera: Pinhole) -> Float32[np.ndarray, "h w"]:
        """Decode a picture of z-depth in metres, 0 where there is none, or raise ``RecordingError``."""
        ...


@dataclass(eq=False, repr=False)
class StoredRecording(Recording):
    """Frames whose pictures are unpacked on demand.

    Attributes:
        path: the file or folder.
        format: the format's name on the command line.
        rig: the cameras.
        shots: the usable frames in the order of time; ``colour`` and ``depth`` are names that ``pictures`` knows.
        pictures: where the pictures lie.
        up_in_world: unit vector, or None where it is not known.
        audio: the sound track on the frames' clock, or None.
        notices: one sentence for each thing worth knowing.
        depth_unit_m: metres of one unit of the depth as stored; 1 for floats.
    """

    path: Path
    format: str
    rig: Rig
    shots: Shots
    pictures: Pictures
    up_in_world: Float[np.ndarray, "3"] | None = None
    audio: AudioTrack | None = None
    notices: tuple[str, ...] = ()
    depth_unit_m: float = 1.0
    stamps_s: Float[np.ndarray, " n"] = field(init=False)
    world_from_camera: Float[np.ndarray, "n 4 4"] = field(init=False)

    def __post_init__(self) -> None:
        self.stamps_s = self.shots.stamps_s
        self.world_from_camera = self.shots.world_from_camera

    def frame(self, index: int) -> Frame:
        """Read one frame; see ``Recording.frame``."""
        if not 0 <= index < len(self):
            raise IndexError(f"there is no frame {index}; the recording has {len(self)}")
        return Frame(
            index=index,
            name=self.name(index),
            stamp_s=float(self.stamps_s[index]),
            rgb=self.pictures.colour(self.shots.colour[index], self.rig.rgb),
            depth_m=self.pictures.depth(self.shots.depth[index], self.rig.depth),
            world_from_camera=self.world_from_camera[index],
            rig=self.rig,
        )

    @property
    def stored_depth_unit_m(self) -> float:
        """Metres of one unit of the depth as stored."""
        return self.depth_unit_m

    def name(self, index: int) -> str:
        """Return the recording's name of a frame."""
        return self.shots.names[index]

    @cached_property
    def fingerprint(self) -> str:
        """A hex SHA-256 over poses, stamps, cameras and the files' content; see ``Recording.fingerprint``."""
        digest = hashlib.sha256()
        geometry_digest(digest, self)
        for file in self._files():
            add_files(digest, file.parent, [file.name])
        return digest.hexdigest()

    def change_stamp(self) -> str:
        """Return a hash over the files' sizes and times of change; see ``Recording.change_stamp``."""
        return stamp_of(self.path.parent, (), self._files())

    def _files(self) -> list[Path]:
        own = sorted(f for f in self.path.rglob("*") if f.is_file()) if self.path.is_dir() else [self.path]
        return [*own, *([self.audio.path] if self.audio is not None else [])]
