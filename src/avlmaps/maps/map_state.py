"""What some frames brought to a map, and that in a folder: a checkpoint, and the part of another machine."""

from dataclasses import dataclass, fields
from pathlib import Path

import msgspec
import numpy as np

from avlmaps.core.arrays import Float64
from avlmaps.maps.fusion.free_space import FreeViews
from avlmaps.maps.fusion.voxel_sums import VoxelSums
from avlmaps.maps.store.checkpoints import find_checkpoint, load_checkpoint, save_checkpoint
from avlmaps.maps.store.manifest import BadFrame
from avlmaps.maps.types import Keyframes


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


class _Facts(msgspec.Struct):
    bad: tuple[BadFrame, ...]


_KINDS = {"sums": VoxelSums, "views": FreeViews, "keyframes": Keyframes}


def save_state(folder: Path, key: str, state: MapState) -> None:
    """Store a state; a kill at any instant leaves all of it or none. ``key`` is the hash of all it depends on."""
    arrays = {"stamp_s": state.stamp_s, "pose": state.pose}
    for name, kind in _KINDS.items():
        arrays |= {f"{name}_{one.name}": getattr(getattr(state, name), one.name) for one in fields(kind)}
    save_checkpoint(folder, key, _Facts(state.bad), arrays)


def load_state(folder: Path, key: str) -> MapState:
    """Read a state; its large arrays stay on the disk until they are used.

    Raises:
        MapError: there is none, or it is damaged or of another key.
    """
    found = load_checkpoint(folder, _Facts, key)

    def part(name: str) -> dict[str, np.ndarray]:
        return {one.name: found.arrays[f"{name}_{one.name}"] for one in fields(_KINDS[name])}

    return MapState(
        VoxelSums(**part("sums")), FreeViews(**part("views")), Keyframes(**part("keyframes")),
        found.arrays["stamp_s"], found.arrays["pose"], found.facts.bad,
    )  # fmt: skip


def is_stored(folder: Path, key: str) -> bool:
    """Return whether there is a state of this key; what is left of a broken one is removed."""
    return find_checkpoint(folder, _Facts, key) is not None


def bad_frames(folder: Path, key: str) -> tuple[BadFrame, ...]:
    """Return the frames that a stored state leaves out."""
    return load_checkpoint(folder, _Facts, key).facts.bad
