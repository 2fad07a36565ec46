"""Furnishing a room: tries places for a piece until one is free, puts it there, and puts things on it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from avlmaps_sim.furniture import Families, Piece, families, make
from avlmaps_sim.furniture.recipe_helpers import chance, draw, pick
from avlmaps_sim.homes.placing import Footprint, Ground, Place, Side
from avlmaps_sim.homes.plan import middle
from avlmaps_sim.mesh import Mesh
from avlmaps_sim.scene import Light, SceneBuilder

_UNDER_LAMPS = ("dining table", "kitchen island", "coffee table", "bed")
_TOUCH_M = 0.006  # distance of pieces from the wall behind them


# How high the lowest edge of what hangs on a wall is, metres.
HANGING_M = {"picture": (1.1, 1.6), "mirror": (0.9, 1.3), "clock": (1.5, 2.0), "air conditioner": (1.9, 2.3),
             "tv": (0.8, 1.3), "wall shelf": (1.1, 1.7), "lamp": (1.4, 1.8), "kitchen cabinet": (1.38, 1.55),
             "range hood": (1.45, 1.7), "water heater": (1.3, 1.7), "whiteboard": (0.8, 1.0), "towel": (0.9, 1.3),
             "radiator": (0.1, 0.15), "coat rack": (1.4, 1.6), "shower": (0.95, 1.1), "guitar": (0.9, 1.3),
             "microwave": (1.4, 1.5), "plant": (1.4, 1.9), "telephone": (1.1, 1.4)}  # fmt: skip


Among = Callable[[str], bool]  # says of the name of a family whether it will do


def floor_standing(family: str) -> bool:
    """Return whether a family stands on the floor: not on a worktop, not on a wall."""
    return not family.startswith(("wall", "counter", "table top"))


def wall_hung(family: str) -> bool:
    """Return whether a family is made to hang on a wall."""
    return family.startswith("wall")


def on_floor_or_wall(family: str) -> bool:
    """Return whether a family needs no worktop under it."""
    return not family.startswith(("counter", "table top"))


# Families that stand on the floor, of categories whose others stand on tops.
_ON_FLOOR = {"printer": ("office copier",), "clock": ("grandfather",), "loudspeaker": ("floor standing", "on a stand"),
             "towel": ("on a stand",), "tv": ("on a rolling stand", "rear projection"), "aquarium": ("tank",),
             "fan": ("standing", "tower", "box", "without blades"), "microwave": (), "telephone": (),
             "lamp": ("shade on pole", "tripod", "arc", "torchiere", "paper column", "many heads")}  # fmt: skip


def _fit_to_stand(category: str) -> Among:
    only = _ON_FLOOR.get(category)
    return lambda name: wall_hung(name) or (on_floor_or_wall(name) and (only is None or name in only))


def hangs(piece: Piece) -> bool:
    """Return whether a piece is made to hang on a wall."""
    return wall_hung(piece.family)


@dataclass(frozen=True, slots=True, eq=False)
class PlacedPiece:
    """A piece that has its place. ``number`` is that on the ground, -1 for what nothing can meet."""

    piece: Piece
    place: Place
    foot: Footprint
    floor_m: float
    number: int = -1

    @property
    def centre(self) -> Float[np.ndarray, "2"]:
        """Middle of its box, top-down."""
        return self.to_world(self.foot.middle)

    def to_world(self, xy: Float[np.ndarray, "*n 2"]) -> Float[np.ndarray, "*n 2"]:
        """Return places of its own frame in the room's."""
        c, s = np.cos(self.place.heading_rad), np.sin(self.place.heading_rad)
        return np.asarray(xy) @ np.array([[c, s], [-s, c]]) + (self.place.x, self.place.y)


def footprint(mesh: Mesh) -> Footprint:
    """Return the box of a mesh in its own frame."""
    low, high = mesh.low.astype(np.float64), mesh.high.astype(np.float64)
    return Footprint((low + high)[:2] / 2, (high - low)[:2] / 2, float(low[2]), float(high[2]))


@dataclass
class Furnisher:
    """Furnishes one room.

    ``fill`` is how much stands in it, 1 for a room that has what it needs; ``mess`` how much lies about, from 0 to 1.
    ``laid`` are rectangles taken on tops, by the piece's identity and the top's height in centimetres.
    """

    rng: np.random.Generator
    builder: SceneBuilder
    ground: Ground
    area: int
    kind: str
    floor_m: float
    height_m: float
    which: Families
    has_ceiling: bool = True
    fill: float = 1.0
    mess: float = 0.3
    stood: list[PlacedPiece] = field(default_factory=list)
    laid: dict[tuple[int, int], list[np.ndarray]] = field(default_factory=dict)

    def new(self, category: str, among: Among | None = None) -> Piece | None:
        """Make a piece of a category; where only some of its families will do, one of those, or None."""
        if among is None:
            return make(category, self.rng, self.which)
        names = [name for name in families(category, self.which) if among(name)]
        names = names or [name for name in families(category) if among(name)]
        return make(category, self.rng, self.which, pick(self.rng, names)) if names else None

    def put(self, piece: Piece, place: Place, front_m: float = 0.0, solid: bool = True) -> PlacedPiece:
        """Add a piece to the scene at a place, and keep its place and a zone before it from others."""
        foot = footprint(piece.mesh)
        stood = PlacedPiece(piece, place, foot, self.floor_m)
        if solid:
            number = self.ground.take(foot, stood.centre, place.heading_rad, place.z, front_m)
            stood = PlacedPiece(piece, place, foot, self.floor_m, number)
        mesh = piece.mesh.turned(place.heading_rad).moved(place.x, place.y, place.z + self.floor_m)
        self.builder.add(piece.category, mesh, place.heading_rad, piece.family, area=self.area)
        for x, y, z in piece.light:
            at = stood.to_world(np.array([x, y]))
            strength = draw(self.rng, 0.25, 0.6)
            warm = (strength, strength * draw(self.rng, 0.82, 1.0), strength * draw(self.rng, 0.6, 0.95))
            self.builder.lights.append(Light((float(at[0]), float(at[1]), float(z + place.z + self.floor_m)), warm))
        self.stood.append(stood)
        return stood

    def try_at(
        self, piece: Piece, centre: Float[np.ndarray, "n 2"], heading_rad: Float[np.ndarray, " n"], z: float = 0.0,
        front_m: float = 0.0, solid: bool = True, zones: bool = True, except_for: int = -1,
    ) -> PlacedPiece | None:  # fmt: skip
        """Put a piece at the first of several places that is free and leaves the passages free."""
        foot = footprint(piece.mesh)
        if z + foot.high_m > self.height_m - 0.02 and piece.category not in ("wall", "column"):
            return None
        good = self.ground.fits(foot, centre, heading_rad, z, zones, except_for)
        for index in np.flatnonzero(good)[:5].tolist():
            heading = float(heading_rad[index])
            if not solid or self.ground.keeps_ways(foot, centre[index], heading, z, front_m):
                return self.put(piece, foot.place(centre[index], heading, z), front_m, solid)
        return None

    def sides(self, least_m: float = 0.3) -> list[Side]:
        """Return the sides of the room in random order, longer ones rather earlier."""
        sides = [side for side in self.ground.sides if side.length_m >= least_m]
        weight = [side.length_m * self.rng.uniform(0.3, 1.0) for side in sides]
        return [sides[i] for i in np.argsort(weight)[::-1]]

    def along(
        self, piece: Piece, sides: Sequence[Side] | None = None, front_m: float = 0.5, gap_m: float = 0.0,
        z: float = 0.0, corner: float = 0.3, near: Float[np.ndarray, "2"] | None = None, tries: int = 14,
        at_middle: float = 0.0,
    ) -> PlacedPiece | None:  # fmt: skip
        """Stand a piece against a wall, looking into the room.

        A zone of ``front_m`` before it stays clear. A corner, or the middle of a wall, is tried first with a
        probability ``corner`` or ``at_middle``, and places close to ``near`` before others.
        """
        foot = footprint(piece.mesh)
        for side in self.sides(foot.width_m) if sides is None else sides:
            room = side.length_m - foot.width_m
            if room < 0:
                continue
            start = self.rng.uniform(0.0, room, tries)
            if self.rng.random() < corner:
                start[:2] = (0.004, room - 0.004) if self.rng.random() < 0.5 else (room - 0.004, 0.004)
            elif self.rng.random() < at_middle:
                start[0] = room / 2
            start = np.clip(start, min(0.004, room / 2), max(room - 0.004, room / 2))
            start = start[side.is_free(start, start + foot.width_m, z + foot.low_m, z + foot.high_m)]
            if not len(start):
                continue
            inward = _TOUCH_M + gap_m + foot.half[0]
            centre = side.a + (start + foot.half[1])[:, None] * side.along + inward * side.inward
            if near is not None:
                centre = centre[np.argsort(np.hypot(*(centre - near).T))]
            heading = np.full(len(centre), side.heading_rad)
            if (found := self.try_at(piece, centre, heading, z, front_m)) is not None:
                return found
        return None

    def beside(self, piece: Piece, anchor: PlacedPiece, gap_m: float = 0.05, back: bool = True) -> PlacedPiece | None:
        """Stand a piece to the left or right of another, backs in line (or fronts), looking the same way."""
        foot = footprint(piece.mesh)
        x = anchor.foot.middle[0] + (foot.half[0] - anchor.foot.half[0]) * (1 if back else -1)
        y = anchor.foot.half[1] + gap_m + foot.half[1]
        order = (1, -1) if self.rng.random() < 0.5 else (-1, 1)
        local = np.array([(x, anchor.foot.middle[1] + side * y) for side in order])
        return self.try_at(piece, anchor.to_world(local), np.full(2, anchor.place.heading_rad))

    def before(
        self, piece: Piece, anchor: PlacedPiece, gap_m: float, facing: bool = True, aside_m: float = 0.0,
        turn_rad: float = 0.0,
        front_m: float = 0.0, zones: bool = False, solid: bool = True,
    ) -> PlacedPiece | None:  # fmt: skip
        """Stand a piece before the front of another, looking at it or the same way."""
        foot = footprint(piece.mesh)
        x = anchor.foot.middle[0] + anchor.foot.half[0] + gap_m + foot.half[0]
        centre = anchor.to_world(np.array([[x, anchor.foot.middle[1] + aside_m]]))
        heading = anchor.place.heading_rad + (np.pi if facing else 0.0) + turn_rad
        return self.try_at(piece, centre, np.array([heading]), front_m=front_m, zones=zones, solid=solid)

    def somewhere(
        self, piece: Piece, *, tries: int = 24, square: float = 0.5, solid: bool = True
    ) -> PlacedPiece | None:
        """Stand a piece anywhere on the floor, turned at random or square to a wall."""
        low, high = self.ground.polygon.min(axis=0), self.ground.polygon.max(axis=0)
        centre = self.rng.uniform(low, high, (tries, 2))
        heading = self.rng.uniform(-np.pi, np.pi, tries)
        if self.rng.random() < square:
            base = self.ground.sides[0].heading_rad
            heading = base + np.pi / 2 * self.rng.integers(0, 4, tries)
        return self.try_at(piece, centre, heading, solid=solid)

    def in_middle(self, piece: Piece, spread: float = 0.15) -> PlacedPiece | None:
        """Stand a piece about the middle of the room, square to its longest wall."""
        span = np.ptp(self.ground.polygon, axis=0)
        centre = middle(self.ground.polygon) + self.rng.normal(0.0, spread, (16, 2)) * span
        side = max(self.ground.sides, key=lambda s: s.length_m)
        heading = side.heading_rad + np.pi / 2 * self.rng.integers(0, 4, 16)
        return self.try_at(piece, centre, heading)

    def hang(
        self, piece: Piece, low_m: tuple[float, float], sides: Sequence[Side] | None = None, tries: int = 10,
        near: Float[np.ndarray, "2"] | None = None,
    ) -> PlacedPiece | None:  # fmt: skip
        """Hang a piece on a wall, its lowest edge between two heights."""
        top = self.height_m - 0.08 - float(piece.mesh.high[2])
        z = min(draw(self.rng, *low_m), top)
        if z < 0.2:
            return None
        return self.along(piece, sides, front_m=0.0, gap_m=-_TOUCH_M + 0.001, z=z, near=near, tries=tries, corner=0.0)

    def from_ceiling(self, piece: Piece, centre: Float[np.ndarray, "2"]) -> PlacedPiece | None:
        """Hang a lamp from the ceiling over a place, where a head passes under it or a table stands below."""
        foot = footprint(piece.mesh)
        z = self.height_m - foot.high_m - 0.001
        over_table = any(
            stood.piece.category in _UNDER_LAMPS and np.all(np.abs(stood.centre - centre) < stood.foot.half.min())
            for stood in self.stood
        )
        if z + foot.low_m < (1.2 if over_table else 1.9):
            return None
        heading = float(self.rng.uniform(-np.pi, np.pi))
        if not self.ground.fits(foot, centre[None], np.array([heading]), z, zones=False)[0]:
            return None
        return self.put(piece, foot.place(centre, heading, z))

    def stand(self, category: str, share: float = 1.0, front_m: float = 0.45, corner: float = 0.3,
              near: Float[np.ndarray, "2"] | None = None, sides: Sequence[Side] | None = None,
              at_middle: float = 0.0, among: Among | None = None) -> PlacedPiece | None:  # fmt: skip
        """Stand a piece of a category against a wall in a share of the cases, or hang it if it is made to hang."""
        if self.rng.random() > share * self.fill:
            return None
        if (piece := self.new(category, among or _fit_to_stand(category))) is None:
            return None
        return self._stand(piece, front_m, corner, near, sides, at_middle)

    def insist(self, category: str, front_m: float = 0.45, corner: float = 0.3, at_middle: float = 0.0,
               tries: int = 3, among: Among | None = None) -> PlacedPiece | None:  # fmt: skip
        """Stand what a room cannot do without, trying several shapes until one finds a place."""
        for _ in range(tries if self.fill > 0.5 or self.rng.random() < 0.6 else 0):
            if (piece := self.new(category, among or _fit_to_stand(category))) is None:
                return None
            if (stood := self._stand(piece, front_m, corner, None, None, at_middle)) is not None:
                return stood
        return None

    def _stand(self, piece: Piece, front_m: float, corner: float, near: Float[np.ndarray, "2"] | None,
               sides: Sequence[Side] | None, at_middle: float) -> PlacedPiece | None:  # fmt: skip
        if hangs(piece):
            return self.hang(piece, HANGING_M.get(piece.category, (1.2, 1.7)), sides, near=near)
        return self.along(piece, sides, front_m, corner=corner, near=near, at_middle=at_middle)

    def row(self, wanted: Sequence[str], sides: Sequence[Side] | None = None, front_m: float = 0.6,
            deepest_m: float = 1.0) -> list[PlacedPiece]:  # fmt: skip
        """Stand pieces side by side along one wall, as in a fitted kitchen; what does not fit is left out."""
        pieces = [piece for name in wanted if (piece := self._shallow(name, deepest_m)) is not None]
        best: list[PlacedPiece] = []
        for side in (self.sides(1.2) if sides is None else sides)[:3]:
            reached = 0.004 if self.rng.random() < 0.7 else draw(self.rng, 0.0, side.length_m / 4)
            left = list(pieces)
            while left and reached < side.length_m - 0.4:
                stood = self._next_in_row(left, side, reached, front_m)
                if stood is None:
                    reached += 0.15
                    continue
                best.append(stood)
                left = [piece for piece in left if piece is not stood.piece]
                at = float((stood.centre - side.a) @ side.along)
                reached = at + stood.foot.half[1] + 0.004
            pieces = left
            if len(left) < 2:
                break
        return best

    def _shallow(self, category: str, deepest_m: float) -> Piece | None:
        for _ in range(4):
            piece = self.new(category, floor_standing)
            if piece is None or piece.mesh.size[0] < deepest_m:
                return piece
        return None

    def _next_in_row(self, left: Sequence[Piece], side: Side, reached: float, front_m: float) -> PlacedPiece | None:
        for piece in left[:3]:
            foot = footprint(piece.mesh)
            end = reached + foot.width_m
            if not side.is_free(np.array([reached]), np.array([end]), foot.low_m, foot.high_m)[0]:
                continue
            centre = side.a + (reached + foot.half[1]) * side.along + (_TOUCH_M + foot.half[0]) * side.inward
            stood = self.try_at(piece, centre[None], np.array([side.heading_rad]), front_m=front_m)
            if stood is not None:
                return stood
        return None


_LEGS_BELOW_M = 0.35


def push_in_m(chair: Mesh, table: Mesh) -> float:
    """Return how far a chair can go under a table before its back or its arms meet the top."""
    under = float(table.high[2]) - 0.09
    high = chair.vertex[chair.vertex[:, 2] > under - 0.02]
    reach = float(high[:, 0].max()) if len(high) else float(chair.low[0]) + 0.1
    return float(np.clip(chair.high[0] - reach - 0.03, 0.0, 0.45))


def meets_legs(table: PlacedPiece, foot: Footprint, centre: np.ndarray, heading_rad: float) -> bool:
    """Return whether a leg of the table would stand within the box of a chair."""
    mesh = table.piece.mesh
    legs = table.to_world(mesh.vertex[mesh.vertex[:, 2] < _LEGS_BELOW_M][:, :2].astype(np.float64))
    c, s = np.cos(heading_rad), np.sin(heading_rad)
    away = legs - centre
    x, y = c * away[:, 0] + s * away[:, 1], c * away[:, 1] - s * away[:, 0]
    return bool(np.any((np.abs(x) < foot.half[0] + 0.01) & (np.abs(y) < foot.half[1] + 0.01)))


def _seat_places(table: PlacedPiece, width_m: float) -> list[tuple[float, float, float]]:
    half_x, half_y = table.foot.half
    out = []
    for sign in (1.0, -1.0):
        for half_a, half_b, turned in ((half_y, half_x, False), (half_x, half_y, True)):
            number = int(2 * half_a / (width_m + 0.08))
            for k in range(max(number, 1 if half_a > 0.3 else 0)):
                at = (k + 0.5) / max(number, 1) * 2 * half_a - half_a
                place = (
                    (at, sign * half_b, -sign * np.pi / 2)
                    if turned
                    else (sign * half_b, at, np.pi if sign > 0 else 0.0)
                )
                out.append(place)
    return out


def seat_round(f: Furnisher, table: PlacedPiece, piece: Piece, number: int, all_sides: bool = True) -> int:
    """Stand chairs of one kind round a table; return how many found a place.

    They stand ``all_sides`` round it, or only at its front.
    """
    foot = footprint(piece.mesh)
    places = _seat_places(table, foot.width_m)
    if not all_sides:
        places = [place for place in places if place[2] == np.pi and place[0] > 0]
    f.rng.shuffle(places)
    done = 0
    tidy = chance(f.rng, 0.5)
    for x, y, heading in places:
        if done >= number:
            break
        deepest = push_in_m(piece.mesh, table.piece.mesh)
        outs = [draw(f.rng, -deepest, 0.02) if tidy or chance(f.rng, 0.6) else draw(f.rng, 0.02, 0.4), 0.02, 0.2]
        done += any(_sit(f, table, piece, foot, (x, y, heading), out, tidy) for out in outs)
    return done


def _sit(f: Furnisher, table: PlacedPiece, piece: Piece, foot: Footprint, place: tuple[float, float, float],
         out_m: float, tidy: bool) -> bool:  # fmt: skip
    x, y, heading = place
    turn = 0.0 if tidy and chance(f.rng, 0.7) else float(f.rng.normal(0.0, 0.05 if out_m < 0 else 0.3))
    toward = np.array([np.cos(heading), np.sin(heading)])
    centre = table.to_world(table.foot.middle + np.array([x, y]) - (out_m + foot.half[0] + 0.01) * toward)
    way = table.place.heading_rad + heading + turn
    if out_m < 0 and meets_legs(table, foot, centre, way):
        return False
    except_for = table.number if out_m < 0 else -1
    return f.try_at(piece, centre[None], np.array([way]), zones=False, except_for=except_for) is not None
