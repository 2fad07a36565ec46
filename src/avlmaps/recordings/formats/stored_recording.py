"""A recording whose pictures a reader has to unpack: those of an archive, a database, a rare compression."""

import hashlib
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float32, UInt8

from avlmaps.core.camera import Pinhole
from avlmaps.recordings.content import add_files, stamp_of
from avlmaps.recordings.formats.file_recording import ShotsRecording, geometry_digest


@runtime_checkable
class Pictures(Protocol):
    """Where the pictures lie; each is found by the name that the shots have for it."""

    def colour(self, name: str, camera: Pinhole) -> UInt8[np.ndarray, "h w 3"]:
        """Decode a colour picture, or raise ``RecordingError``."""
        ...

    def depth(self, name: str, camera: Pinhole) -> Float32[np.ndarray, "h w"]:
        """Decode a picture of z-depth in metres, 0 where there is none, or raise ``RecordingError``."""
        ...


@dataclass(eq=False, repr=False, kw_only=True)
class StoredRecording(ShotsRecording):
    """Frames whose pictures are unpacked on demand.

    Attributes:
        pictures: where they lie; ``colour`` and ``depth`` of the shots are names that it knows.
        depth_unit_m: metres of one unit of the depth as stored; 1 for floats.
    """

    pictures: Pictures
    depth_unit_m: float = 1.0

    def _colour(self, index: int) -> UInt8[np.ndarray, "h w 3"]:
        return self.pictures.colour(self.shots.colour[index], self.rig.rgb)

    def _depth_m(self, index: int) -> Float32[np.ndarray, "h w"]:
        return self.pictures.depth(self.shots.depth[index], self.rig.depth)

    @property
    def stored_depth_unit_m(self) -> float:
        """Metres of one unit of the depth as stored."""
        return self.depth_unit_m

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
