"""What became of the things of a map over several days, and its files.

A ``Stay`` is one thing at one place for as long as it stays there. A thing that moves ends one stay and begins another,
and the two point at each other.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import msgspec
import numpy as np

from avlmaps.core.arrays import Int32, Int64
from avlmaps.core.errors import MapError

PEOPLE = ("person",)
"""Names of what comes and goes by itself: it is listed, and is never a wall."""


class Stay(msgspec.Struct, frozen=True, kw_only=True):
    """One thing at one place. Days are numbers of the map's visits, from 0."""

    name: str  # the word of the vocabulary
    confidence: float  # that it is one, in [0, 1], when it was seen first
    position: tuple[float, float, float]  # its voxel nearest to its middle, metres, the map's world
    size: tuple[float, float, float]  # along the axes of the level frame, metres
    color: tuple[int, int, int]  # mean RGB
    first: int  # the visit that saw it first
    last: int  # the visit that saw it last
    last_seen_s: float  # the last stamp of its surface, the map's time
    looked: int  # the last visit that looked at its place; later ones know nothing of it
    gone: int | None = None  # the first visit that looked through its place; None while nothing speaks against it
    # its place was looked through before it was there; False says only that it was seen first then
    appeared: bool = False
    moved_to: int | None = None  # the stay that follows where it was carried to
    moved_from: int | None = None  # the stay before
    there_on: tuple[int, ...] = ()  # visits that saw it, or its surface; none of a map of before
    absent_on: tuple[int, ...] = ()  # visits that looked through its place, before it came and after it went; likewise

    @property
    def days_there(self) -> frozenset[int]:
        """The visits that saw it there."""
        return frozenset(self.there_on or (self.first, self.last))

    @property
    def days_absent(self) -> frozenset[int]:
        """The visits that looked at its place and saw that it was not there."""
        if self.there_on:
            return frozenset(self.absent_on)
        before = {self.first - 1} if self.appeared else set[int]()
        return frozenset(before | ({self.gone} if self.gone is not None else set()))

    @property
    def is_person(self) -> bool:
        """Whether it comes and goes by itself."""
        return self.name in PEOPLE

    def is_there(self, visit: int) -> bool:
        """Return whether it was there on a visit, as far as anything that was seen says."""
        return self.first <= visit and (self.gone is None or visit < self.gone)


@dataclass(frozen=True, slots=True, eq=False)
class Life:
    """The stays of a map's things, and their voxels. Ragged: stay i has rows ``offsets[i]:offsets[i + 1]``."""

    stays: tuple[Stay, ...]  # in the order in which they began
    offsets: Int64[np.ndarray, " s1"]  # into ``index``
    index: Int32[np.ndarray, "m 3"]  # voxels of each stay, of the map's grid, whether anything is there still or not

    @classmethod
    def of(cls, stays: "tuple[Stay, ...] | list[Stay]", voxels: "list[np.ndarray]") -> "Life":
        """Return stays with the voxels of each."""
        offsets = np.concatenate([[0], np.cumsum([len(each) for each in voxels])]).astype(np.int64)
        index = np.concatenate([np.zeros((0, 3), np.int32), *voxels]).astype(np.int32)
        return cls(tuple(stays), offsets, index)

    def __len__(self) -> int:
        return len(self.stays)

    def voxels(self, stay: int) -> Int32[np.ndarray, "v 3"]:
        """Return the voxels of a stay."""
        return np.asarray(self.index[self.offsets[stay] : self.offsets[stay + 1]])


def life_arrays(life: Life) -> dict[str, np.ndarray]:
    """Return the arrays that a map stores; the stays as JSON in bytes."""
    said = np.frombuffer(msgspec.json.encode(life.stays), np.uint8)
    return {"stays": said, "offsets": life.offsets, "index": life.index}


def read_life(arrays: Mapping[str, np.ndarray], where: str) -> Life:
    """Return what ``life_arrays`` gave."""
    try:
        stays = msgspec.json.decode(np.asarray(arrays["stays"], np.uint8).tobytes(), type=tuple[Stay, ...])
        life = Life(stays, np.asarray(arrays["offsets"], np.int64), np.asarray(arrays["index"], np.int32))
    except (KeyError, ValueError, msgspec.DecodeError) as fault:
        raise MapError(f"{where} is damaged ({fault}); restore the map from a copy, or merge it again.") from fault
    if len(life.offsets) != len(stays) + 1 or life.offsets[-1] != len(life.index):
        raise MapError(
            f"{where} is damaged: {len(stays)} stays, {len(life.offsets)} offsets and {len(life.index)} voxels do not "
            "fit together; restore the map from a copy, or merge it again."
        )
    return life
