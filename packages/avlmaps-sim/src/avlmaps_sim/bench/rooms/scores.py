"""What a list of rooms is worth: matched with the true rooms, its overlaps, names, count and areas."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool

from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps_sim.bench.rooms.truth import CELL_M, Floor


@dataclass(frozen=True, slots=True, eq=False)
class Listed:
    """A room that a map lists, on a storey.

    Attributes:
        name: kind of room.
        mask: its cells.
        area_m2: as it is reported.
    """

    name: str
    mask: Bool[np.ndarray, "nx ny"]
    area_m2: float


@dataclass(frozen=True, slots=True)
class Matched:
    """A true room and the listed one that it is matched with.

    Attributes:
        kinds: names that are right.
        name: of the listed one; "" without one.
        overlap: intersection over union, in [0, 1].
        area_error: of the listed area, as a share of the true one; NaN without one.
    """

    kinds: tuple[str, ...]
    name: str = ""
    overlap: float = 0.0
    area_error: float = float("nan")

    @property
    def is_named(self) -> bool:
        """Whether the name is right."""
        return bool(self.name) and any(_same(self.name, kind) for kind in self.kinds)


@dataclass(frozen=True, slots=True)
class Judged:
    """The rooms of a scene.

    Attributes:
        scene: its name.
        rooms: true rooms that the map shows.
        listed: number of listed rooms, without those of true rooms that it does not show.
    """

    scene: str
    rooms: tuple[Matched, ...]
    listed: int


def judged(scene: str, floors: Sequence[Floor], listed: Sequence[Sequence[Listed]]) -> Judged:
    """Match the listed rooms of each storey with the true ones, so that their overlaps add up to most."""
    rooms: list[Matched] = []
    count = 0
    for floor, own in zip(floors, listed, strict=True):
        shown = [one for one in own if one.mask.any() and not _mostly_unseen(floor, one.mask)]
        count += len(shown)
        rooms += _matched(floor, shown)
    return Judged(scene, tuple(rooms), count)


def _mostly_unseen(floor: Floor, mask: Bool[np.ndarray, "nx ny"]) -> bool:
    unseen = np.append(~floor.seen, False)[floor.label]
    return bool(unseen[mask].mean() > 0.5)


def _matched(floor: Floor, listed: Sequence[Listed]) -> list[Matched]:
    from scipy.optimize import linear_sum_assignment

    true = np.flatnonzero(floor.seen)
    overlap = np.zeros((len(true), len(listed)))
    for row, number in enumerate(true):
        for column, one in enumerate(listed):
            own = floor.label == number
            overlap[row, column] = (own & one.mask).sum() / (own | one.mask).sum()
    matches = dict(zip(*(side.tolist() for side in linear_sum_assignment(-overlap)), strict=True))
    out: list[Matched] = []
    for row, number in enumerate(true):
        column = matches.get(row, -1)
        if column < 0 or overlap[row, column] <= 0.0:
            out.append(Matched(floor.kinds[number]))
            continue
        area_m2 = float((floor.label == number).sum()) * CELL_M**2
        error = abs(listed[column].area_m2 - area_m2) / area_m2
        out.append(Matched(floor.kinds[number], listed[column].name, float(overlap[row, column]), error))
    return out


def _same(name: str, kind: str) -> bool:
    known = lexicon()
    a, b = known.find(name, EntryKind.ROOM), known.find(kind, EntryKind.ROOM)
    return name == kind or (a is not None and a == b) or known.is_a(name, kind, EntryKind.ROOM)
