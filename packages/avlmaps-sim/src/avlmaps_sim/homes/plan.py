"""A floor plan: rooms, the walls between them, and the holes in the walls. Metres, top-down."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from jaxtyping import Float

OUTSIDE = -1  # the room beyond an outer wall
WELL = "stairwell"  # the room of the stairs; it is not an area, since nobody stays there
WELL_LENGTH_M = 3.4

HoleKind = Literal["door", "closed door", "doorless", "folding door", "gap", "window"]


@dataclass(frozen=True, slots=True)
class Hole:
    """An opening in a wall.

    Attributes:
        kind: what fills it; a ``gap`` is a wide opening of an open plan.
        at_m: its middle, along the wall from ``a``.
        width_m: how wide it is.
        sill_m: its lower edge above the floor.
        head_m: its upper edge above the floor.
        open_rad: how far a leaf stands open.
        to_left: a leaf opens (a window looks) into the room on the wall's left.
        hinge: the leaf hangs on the side towards the wall's end (1) or its beginning (-1).
    """

    kind: HoleKind
    at_m: float
    width_m: float
    sill_m: float = 0.0
    head_m: float = 2.1
    open_rad: float = 0.0
    to_left: bool = True
    hinge: int = 1


@dataclass(frozen=True, slots=True, eq=False)
class Wall:
    """A straight wall from a to b, with one room on either side.

    Attributes:
        a: where its middle line begins.
        b: where it ends.
        left: index of the room on the left of a → b.
        right: index of the room on the right, or ``OUTSIDE``.
        holes: openings.
        built: False where an open plan has no wall there at all.
    """

    a: Float[np.ndarray, "2"]
    b: Float[np.ndarray, "2"]
    left: int
    right: int
    holes: tuple[Hole, ...] = ()
    built: bool = True

    @property
    def length_m(self) -> float:
        """How long it is."""
        return float(np.linalg.norm(self.b - self.a))

    @property
    def along(self) -> Float[np.ndarray, "2"]:
        """Unit vector from a to b."""
        return (self.b - self.a) / self.length_m

    @property
    def to_left(self) -> Float[np.ndarray, "2"]:
        """Unit normal towards the room on its left."""
        x, y = self.along
        return np.array([-y, x])

    def at(self, along_m: float) -> Float[np.ndarray, "2"]:
        """Return the place on its middle line at this distance from a."""
        return self.a + along_m * self.along

    def with_hole(self, hole: Hole) -> "Wall":
        """Return it with one opening more."""
        return replace(self, holes=(*self.holes, hole))


@dataclass(frozen=True, slots=True, eq=False)
class Room:
    """One room, or one part of an open plan.

    Attributes:
        kind: ``kitchen``, ``bedroom`` ...
        polygon: (k, 2) its corners on the middle lines of its walls, convex, counter-clockwise.
        floor_m: height of its floor.
        height_m: of its ceiling above the floor.
    """

    kind: str
    polygon: Float[np.ndarray, "k 2"]
    floor_m: float = 0.0
    height_m: float = 2.6


@dataclass(frozen=True, slots=True, eq=False)
class Storey:
    """One floor of a building.

    Attributes:
        rooms: its rooms.
        walls: its walls.
        wall_m: thickness of the walls between rooms; outer walls reach as far inwards from their middle line.
        outer_m: thickness of the outer walls.
        ceiling: its rooms have ceilings.
        slab_m: what lies between its ceilings and the floor above; its walls reach up through it.
    """

    rooms: tuple[Room, ...]
    walls: tuple[Wall, ...]
    wall_m: float
    outer_m: float
    ceiling: bool = True
    slab_m: float = 0.0

    def walls_of(self, room: int) -> list[tuple[Wall, bool]]:
        """Return the walls of a room, each with whether the room lies on its left."""
        return [(wall, wall.left == room) for wall in self.walls if room in (wall.left, wall.right)]


def walls_between(polygons: list[Float[np.ndarray, "k 2"]]) -> list[Wall]:
    """Return the walls of a set of convex rooms that touch along their sides: shared ones once, the rest outer."""
    sides = [(i, p[k], p[(k + 1) % len(p)]) for i, p in enumerate(polygons) for k in range(len(p))]
    first = np.array([side[1] for side in sides])
    last = np.array([side[2] for side in sides])
    owner = np.array([side[0] for side in sides])
    walls: list[Wall] = []
    for i, a, b in sides:
        length = float(np.linalg.norm(b - a))
        along = (b - a) / length
        across = np.array([-along[1], along[0]])
        touching = (np.abs((first - a) @ across) < 1e-4) & (np.abs((last - a) @ across) < 1e-4) & (owner != i)
        start, end = (last[touching] - a) @ along, (first[touching] - a) @ along  # they run the other way
        covered: list[tuple[float, float]] = []
        for j, s, e in zip(owner[touching].tolist(), start.tolist(), end.tolist(), strict=True):
            s, e = max(s, 0.0), min(e, length)
            if e - s < 0.02:
                continue
            covered.append((s, e))
            if i < j:
                walls.append(Wall(a + s * along, a + e * along, i, j))
        reached = 0.0
        for s, e in [*sorted(covered), (length, length)]:
            if s - reached > 0.02:
                walls.append(Wall(a + reached * along, a + s * along, i, OUTSIDE))
            reached = max(reached, e)
    return walls
