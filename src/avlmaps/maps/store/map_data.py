"""A map as a value: its arrays and what ``map.json`` says of them; it knows no folder and no encoders."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from avlmaps.core.arrays import Float
from avlmaps.core.camera import Rig
from avlmaps.maps.grid import GridSpec
from avlmaps.maps.store.life import Life
from avlmaps.maps.store.manifest import MapInfo
from avlmaps.maps.types import HeardSounds, Keyframes, SourceEvidence, Submaps, Voxels
from avlmaps.perception.encoders import Encoders


@dataclass(frozen=True, slots=True, repr=False, eq=False)
class MapData:
    """A map of one moment. Of a map on the disk, large arrays are read when they are used.

    Attributes:
        info: what ``map.json`` says.
        voxels: occupied voxels.
        keyframes: stored pictures.
        sounds: what was heard.
        place_state: what the place encoder learned from the keyframes.
        sources: what the microphones say of where each sound began; None where their places are not known.
        sources_wait: of how many sounds the source is looked for still, in a map that grows.
        submaps: by which it can follow corrected poses; None where it cannot.
        life: what became of its things over several days; None of one day.
        findings: what was found when it was built: the names closest to each voxel, things, rooms (``query.findings``).
    """

    info: MapInfo
    voxels: Voxels
    keyframes: Keyframes
    sounds: HeardSounds
    place_state: dict[str, np.ndarray] = field(default_factory=dict[str, np.ndarray])
    sources: SourceEvidence | None = None
    sources_wait: int = 0
    submaps: Submaps | None = None
    life: Life | None = None
    findings: dict[str, np.ndarray] = field(default_factory=dict[str, np.ndarray])

    def __repr__(self) -> str:
        return f"MapData({len(self.voxels):,} voxels, {len(self.keyframes)} keyframes, {len(self.sounds)} sounds)"

    @property
    def grid(self) -> GridSpec:
        """Turns metres into voxels."""
        return GridSpec(self.info.voxel_size_m)

    @property
    def up_in_world(self) -> Float[np.ndarray, "3"]:
        """Unit vector; the recording's world need not be level."""
        return self.info.up.vector()

    @property
    def rig(self) -> Rig:
        """The recording's cameras."""
        return self.info.rig.rig()


Finds = Callable[[MapData, Encoders], MapData]
"""Adds what encoders find in a map by their names, before it is written; the queries' room has one."""


def find_nothing(data: MapData, encoders: Encoders) -> MapData:
    """Return a map as it is."""
    del encoders
    return data
