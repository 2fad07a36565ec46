"""The content of ``map.json``: what is written about a map beside its arrays."""

from collections.abc import Sized
from datetime import UTC, datetime
from typing import Literal

import msgspec
import numpy as np

from avlmaps.core.arrays import Float, Int32
from avlmaps.core.camera import Pinhole, Rig
from avlmaps.maps.fusion.sensor import SensorModel
from avlmaps.maps.settings import BuildSettings
from avlmaps.maps.store.tables import FileInfo
from avlmaps.maps.types import FloorInfo
from avlmaps.perception.models import public_choice, public_name
from avlmaps.perception.protocols import ModelCard

SCHEMA_VERSION = 2

Vector = tuple[float, float, float]


class ModelInfo(msgspec.Struct, frozen=True, kw_only=True):
    """A model that made features of this map: its card, and the backend's name in the profile.

    Of a model that was given as a path only the name is stored; its folder is private.
    """

    backend: str  # ``name@model`` where a backend can run several
    id: str
    dim: int
    licence: str
    checksum: str
    prompts: tuple[str, ...]
    note: str = ""
    normalisation: str = "unit length"  # of the stored features; there is one as yet

    @classmethod
    def of(cls, backend: str, card: ModelCard) -> "ModelInfo":
        """Return the entry for a backend."""
        return cls(
            backend=public_choice(backend),
            id=public_name(card.id),
            dim=card.dim,
            licence=card.licence,
            checksum=card.checksum,
            prompts=tuple(card.prompts),
            note=card.note,
        )


class RigInfo(msgspec.Struct, frozen=True, kw_only=True):
    """The recording's two cameras, in pixels; ``rgb_from_depth`` row by row."""

    rgb: Pinhole
    depth: Pinhole
    rgb_from_depth: tuple[tuple[float, float, float, float], ...]

    @classmethod
    def of(cls, rig: Rig) -> "RigInfo":
        """Return the entry for a rig."""
        return cls(rgb=rig.rgb, depth=rig.depth, rgb_from_depth=tuple(map(tuple, rig.rgb_from_depth.tolist())))

    def rig(self) -> Rig:
        """Return the rig."""
        return Rig(self.rgb, self.depth, np.array(self.rgb_from_depth, np.float64).reshape(4, 4))


class RecordingInfo(msgspec.Struct, frozen=True, kw_only=True):
    """Which recording the map was built from. The folder's name only: where it lay is nobody's business."""

    name: str
    format: str
    fingerprint: str
    frames: int
    duration_s: float
    notices: tuple[str, ...] = ()
    begins_s: float = 0.0  # its time 0 on the clock of its files: since 1970, where their stamps are dates


class Visit(msgspec.Struct, frozen=True, kw_only=True):
    """One day that a map of several days was seen on, in the order of time."""

    day: str = ""  # as ``2026-11-25``; empty where nobody said
    recording: RecordingInfo
    begin_s: float  # first stamp, the map's time
    end_s: float  # last stamp, likewise
    shift_s: float  # the map's time less the recording's own
    map_from_recording: tuple[tuple[float, float, float, float], ...]  # row by row; the first day's is the identity
    rig: RigInfo
    frames: int  # how many were fused
    checks: dict[str, float] = {}  # by what it was recognised as the same place; empty of the first day


class UpInfo(msgspec.Struct, frozen=True, kw_only=True):
    """The up direction in the recording's world, and how that is known."""

    direction: Vector  # unit vector
    known_from: Literal["recording", "planes", "camera"]  # camera: a guess by how it was held
    support: float  # of planes the share of the surface that agrees; 1 for a known one, 0 for a guess

    @classmethod
    def of(
        cls, direction: Float[np.ndarray, "3"], known_from: Literal["recording", "planes", "camera"], support: float
    ) -> "UpInfo":
        """Return the entry for a direction of any length but zero."""
        x, y, z = (float(value) for value in direction / np.linalg.norm(direction))
        return cls(direction=(x, y, z), known_from=known_from, support=support)

    def vector(self) -> Float[np.ndarray, "3"]:
        """Return the direction as an array."""
        return np.array(self.direction, np.float64)


class GroundInfo(msgspec.Struct, frozen=True, kw_only=True):
    """The floors under the cameras, lowest first, and how they are known."""

    known_from: Literal["surfaces", "user", "recording"]  # recording: a robot's frames
    floors: tuple[FloorInfo, ...]  # every floor, step and landing that a camera stood over

    def main(self) -> FloorInfo:
        """Return the floor that most cameras stood over."""
        return max(self.floors, key=lambda floor: floor.cameras)


class SensorInfo(msgspec.Struct, frozen=True, kw_only=True):
    """Which depth camera was assumed."""

    name: str  # ``custom`` for one that was given
    known_from: Literal["settings", "frames"]
    noise_per_m: float | None  # measured growth of the error with the square of the depth, 1/m
    model: SensorModel


class Removed(msgspec.Struct, frozen=True, kw_only=True):
    """How many voxels were removed."""

    seen_through: int = 0  # frames see through them
    smeared: int = 0  # a much better seen voxel is within their error
    specks: int = 0  # in small groups that stand alone and that hardly a frame hit


class BadFrame(msgspec.Struct, frozen=True, kw_only=True):
    """A frame that was left out (it could not be read, or an encoder failed on it), and the sentence that says why."""

    index: int
    why: str


class Counts(msgspec.Struct, frozen=True, kw_only=True):
    """How much there is of everything."""

    frames: int  # fused frames
    keyframes: int  # stored pictures
    voxels: int  # occupied voxels
    sounds: int  # heard sounds

    @classmethod
    def of(cls, frames: int, keyframes: Sized, voxels: Sized, sounds: Sized) -> "Counts":
        """Return those of a number of fused frames and what a map holds."""
        return cls(frames=frames, keyframes=len(keyframes), voxels=len(voxels), sounds=len(sounds))


class MapBounds(msgspec.Struct, frozen=True, kw_only=True):
    """The smallest box along the world's axes that holds every occupied voxel, metres."""

    low: Vector
    high: Vector

    @classmethod
    def of(cls, index: Int32[np.ndarray, "n 3"], voxel_size_m: float) -> "MapBounds":
        """Return the box around voxels, of which there is at least one."""
        corners = np.stack([index.min(axis=0), index.max(axis=0) + 1]) * voxel_size_m
        low, high = (tuple(round(float(value), 6) for value in corner) for corner in corners)
        return cls(low=low, high=high)  # pyright: ignore[reportArgumentType]


class Timings(msgspec.Struct, frozen=True, kw_only=True):
    """When the map was finished (ISO 8601, UTC) and the seconds of work in each stage, over all runs that it took."""

    finished: str
    elapsed_s: float
    stages_s: dict[str, float]

    @classmethod
    def now(cls, stages_s: dict[str, float]) -> "Timings":
        """Return those of a map that is finished now."""
        finished = datetime.now(UTC).isoformat(timespec="seconds")
        return cls(finished=finished, elapsed_s=sum(stages_s.values()), stages_s=stages_s)


class MapInfo(msgspec.Struct, frozen=True, kw_only=True):
    """The whole of ``map.json``."""

    format: Literal["avlmap"] = "avlmap"
    schema_version: int = SCHEMA_VERSION  # of the folder's layout
    avlmaps_version: str  # which release built it
    build_key: str  # hash of recording, settings and models; another build has another one
    voxel_size_m: float
    up: UpInfo
    ground: GroundInfo | None = None  # where the floors are; None in maps of older releases and in imported ones
    rig: RigInfo  # the recording's cameras
    profile: str  # which models perceived
    models: dict[str, ModelInfo]  # their cards, by module
    settings: BuildSettings  # resolved, defaults included
    seed: int  # of everything that was drawn at random
    recording: RecordingInfo
    counts: Counts
    bounding_box_m: MapBounds  # where the voxels are
    bad_frames: tuple[BadFrame, ...] = ()
    notices: tuple[str, ...] = ()  # a sentence for each thing worth knowing
    doubts: tuple[str, ...] = ()  # those of them that say why the map may be wrong; every answer repeats them
    files: dict[str, FileInfo] = {}  # every file by its place in the folder; nothing else in it is part of the map
    bytes: int = 0  # size of all files
    timings: Timings  # the only part that differs when a build is repeated
    sensor: SensorInfo | None = None  # None in maps that use every depth as it is
    removed: Removed = Removed()  # voxels that were no surface
    visits: tuple[Visit, ...] = ()  # the days of a map that was merged; none of one that was seen once
