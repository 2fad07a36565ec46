"""Walls with openings, floors and ceilings as meshes, with doors and windows in the openings."""

import contextlib
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps_sim.furniture import Families, Piece
from avlmaps_sim.furniture.openings import door, folding_door, window
from avlmaps_sim.furniture.recipe_helpers import chance, draw, pick
from avlmaps_sim.homes.plan import OUTSIDE, WELL, Hole, Room, Storey, Wall
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, Triple, joined
from avlmaps_sim.scene import SceneBuilder
from avlmaps_sim.shapes import polygon as flat_polygon

_FACES = np.array([[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]], np.int32)
_FACE_LOOK = (2, 2, 1, 0, 2, 2)  # of a wall's block: its left side, its right side, and the rest
_FALLBACK = {"plaster": "painted", "tile": "ceramic", "parquet": "wood", "wallpaper": "painted", "brick": "stone",
             "concrete": "stone", "marble": "stone", "carpet": "fabric"}  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False)
class Looks:
    """The looks of a room's surfaces."""

    wall: Material
    floor: Material
    ceiling: Material


def surface(kind: str, rng: np.random.Generator, colour: Triple | None = None) -> Material:
    """Draw a material, or a plain one like it where there is none of that kind."""
    with contextlib.suppress(KeyError):
        return material(kind, rng, colour)
    return material(_FALLBACK[kind], rng, colour)


def _pale(rng: np.random.Generator) -> Triple:
    if chance(rng, 0.12):
        red, green, blue = rng.uniform(0.15, 0.75, 3).tolist()
        return (red, green, blue)
    light = draw(rng, 0.72, 0.97)
    red, green, blue = np.clip(light + rng.normal(0.0, 0.05, 3), 0.2, 0.99).tolist()
    return (red, green, blue)


def looks_of(rng: np.random.Generator, room: Room, home: Looks | None) -> Looks:
    """Draw the looks of a room; most rooms share the home's own looks."""
    entry = lexicon().find(room.kind, EntryKind.ROOM)
    wet = entry is not None and entry.wet
    floor_kind = pick(rng, ("tile", "tile", "stone", "marble") if wet else
                      ("parquet", "parquet", "parquet", "wood", "carpet", "tile", "stone", "concrete"))  # fmt: skip
    wall_kind = pick(rng, ("plaster", "plaster", "painted", "painted", "wallpaper", "brick", "concrete"))
    if (wet and chance(rng, 0.6)) or (room.kind == "kitchen" and chance(rng, 0.15)):
        wall_kind = "tile"
    elif chance(rng, 0.6):
        wall_kind = "plaster"
    if home is None:
        wall_kind = pick(rng, ("plaster", "plaster", "painted", "wallpaper"))  # the wall of most rooms
    plain = wall_kind in ("plaster", "painted")
    wall = surface(wall_kind, rng, _pale(rng) if plain else None)
    floor = surface(floor_kind, rng)
    if home is not None and not wet:
        wall = home.wall if wall_kind == "plaster" and chance(rng, 0.6) else wall
        floor = home.floor if room.kind != "kitchen" and chance(rng, 0.75) else floor
    if home is not None:
        return Looks(wall, floor, home.ceiling)
    light = draw(rng, 0.85, 0.98)
    wooden = chance(rng, 0.07)
    ceiling = surface("wood" if wooden else "plaster", rng, None if wooden else (light, light, light * 0.98))
    return Looks(wall, floor, ceiling)


def blocks(
    lows: Float[np.ndarray, "n 3"], highs: Float[np.ndarray, "n 3"], looks: tuple[Material, Material, Material]
) -> Mesh:
    """Return boxes along a wall: looks of the side of greatest y, of the side of least y, and of the other faces."""
    n = len(lows)
    choice = np.array([[i & 1, (i >> 1) & 1, (i >> 2) & 1] for i in range(8)], bool)
    vertex = np.where(choice, np.asarray(highs)[:, None, :], np.asarray(lows)[:, None, :]).reshape(-1, 3)
    quads = (_FACES[None] + 8 * np.arange(n)[:, None, None]).reshape(-1, 4)
    triangle = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    axes = np.array([(0, 1), (0, 1), (0, 2), (0, 2), (1, 2), (1, 2)])[np.tile(np.arange(6), 2 * n)]
    uv = np.take_along_axis(vertex[triangle], axes[:, None, :].repeat(3, axis=1), axis=2)
    look = np.tile(np.array(_FACE_LOOK, np.int32), 2 * n)
    return Mesh(vertex.astype(np.float32), triangle.astype(np.int32), uv.astype(np.float32), look, looks)


def placed(mesh: Mesh, origin: Float[np.ndarray, "2"], heading_rad: float, z: float = 0.0) -> Mesh:
    """Return a mesh turned and moved to a place."""
    return mesh.turned(heading_rad).moved(float(origin[0]), float(origin[1]), z)


def heading_of(direction: Float[np.ndarray, "2"]) -> float:
    """Return the heading of a direction, counter-clockwise from +x, radians."""
    return float(np.arctan2(direction[1], direction[0]))


def _pieces_of(wall: Wall, height: float, start: float, end: float) -> list[tuple[float, float, float, float]]:
    """Return the solid rectangles (from, to, lower, upper) that the holes leave of a wall."""
    out, reached = [], start
    for hole in sorted(wall.holes, key=lambda h: h.at_m):
        a, b = hole.at_m - hole.width_m / 2, hole.at_m + hole.width_m / 2
        if a - reached > 1e-3:
            out.append((reached, a, 0.0, height))
        if hole.sill_m > 0.005:
            out.append((a, b, 0.0, hole.sill_m))
        if height - hole.head_m > 0.005:
            out.append((a, b, hole.head_m, height))
        reached = b
    if end - reached > 1e-3:
        out.append((reached, end, 0.0, height))
    return out


def _skirting(
    wall: Wall, y: tuple[float, float], start: float, end: float, height: float
) -> list[tuple[Triple, Triple]]:
    out, reached = [], start
    for hole in sorted(wall.holes, key=lambda h: h.at_m):
        if hole.sill_m > height:
            continue
        a, b = hole.at_m - hole.width_m / 2 - 0.1, hole.at_m + hole.width_m / 2 + 0.1
        if a > reached:
            out.append(((reached, y[0], 0.0), (a, y[1], height)))
        reached = max(reached, b)
    if end > reached:
        out.append(((reached, y[0], 0.0), (end, y[1], height)))
    return out


def wall_mesh(plan: Storey, wall: Wall, looks: list[Looks], edge: Material, outer: Material, skirting_m: float) -> Mesh:
    """Return a wall in the world, with its holes and its skirting."""
    inner = plan.wall_m / 2
    rooms = [plan.rooms[i] for i in (wall.left, wall.right) if i != OUTSIDE]
    height = max(room.height_m for room in rooms) + max(plan.slab_m, 0.02)
    floor = rooms[0].floor_m
    far = inner - plan.outer_m if wall.right == OUTSIDE else -inner
    ends = [_extension(plan, wall, end) for end in (wall.a, wall.b)]
    pieces = _pieces_of(wall, height, -ends[0], wall.length_m + ends[1])
    lows = np.array([(a, far, low) for a, _, low, _ in pieces]).reshape(-1, 3)
    highs = np.array([(b, inner, high) for _, b, _, high in pieces]).reshape(-1, 3)
    right = outer if wall.right == OUTSIDE else looks[wall.right].wall
    parts = [blocks(lows, highs, (looks[wall.left].wall, right, edge))]
    if skirting_m > 0:
        strips = _skirting(wall, (inner, inner + 0.012), inner, wall.length_m - inner, skirting_m)
        if wall.right != OUTSIDE:
            strips += _skirting(wall, (-inner - 0.012, -inner), inner, wall.length_m - inner, skirting_m)
        if strips:
            parts.append(blocks(np.array([s[0] for s in strips]), np.array([s[1] for s in strips]), (edge, edge, edge)))
    return placed(joined(parts), wall.a, heading_of(wall.along), floor)


def _extension(plan: Storey, wall: Wall, end: Float[np.ndarray, "2"]) -> float:
    for other in plan.walls:
        if other is wall or not other.built:
            continue
        for near in (other.a, other.b):
            if float(np.abs(near - end).max()) < 1e-3 and abs(float(other.along @ wall.to_left)) < 0.05:
                return 0.0
    return plan.wall_m / 2 - 0.002


def hole_filling(rng: np.random.Generator, hole: Hole, wall_m: float, which: Families) -> Piece | None:
    """Make the door or window that fills a hole; None where it stays open."""
    height = hole.head_m - hole.sill_m
    if hole.kind == "window":
        return window(rng, hole.width_m, height, wall_m, which)
    if hole.kind in ("door", "closed door"):
        return door(rng, hole.width_m, height, wall_m, hole.open_rad, which)
    if hole.kind == "folding door":
        return folding_door(rng, hole.width_m, height, wall_m, which)
    return None


@dataclass(frozen=True, slots=True, eq=False)
class Leaf:
    """The space that a door needs in a room: an oriented box round its leaf, top-down.

    Half extents are along its heading (from its hinge) and across.
    """

    centre: Float[np.ndarray, "2"]
    half_m: Float[np.ndarray, "2"]
    heading_rad: float
    room: int


def area_of(plan: Storey, room: int, first_area: int) -> int:
    """Return the index of a room's area in the scene, −1 for a stairwell."""
    return -1 if plan.rooms[room].kind == WELL else first_area + room


def build_shell(
    rng: np.random.Generator, builder: SceneBuilder, plan: Storey, looks: list[Looks], first_area: int, which: Families
) -> list[Leaf]:
    """Add walls, floors, ceilings, doors and windows of a floor to a scene; return the leaves that stand in rooms."""
    edge = surface(pick(rng, ("white", "white", "painted", "wood")), rng)
    outer = surface(pick(rng, ("brick", "plaster", "painted", "concrete")), rng)
    skirting = draw(rng, 0.05, 0.14) if chance(rng, 0.6) else 0.0
    style = int(rng.integers(2**31))
    leaves: list[Leaf] = []
    for wall in plan.walls:
        if not wall.built:
            continue
        builder.add("wall", wall_mesh(plan, wall, looks, edge, outer, skirting), heading_of(wall.to_left))
        for hole in wall.holes:
            leaves += _fill(rng, builder, plan, wall, hole, first_area, style, which)
    for index, room in enumerate(plan.rooms):
        for category, z, look in (("floor", 0.0, looks[index].floor), ("ceiling", room.height_m, looks[index].ceiling)):
            if room.kind == WELL and (category == "floor") == (room.floor_m > 0):
                continue  # open between the floors
            if category == "floor" or plan.ceiling:
                corners = np.column_stack([room.polygon, np.full(len(room.polygon), room.floor_m + z)])
                builder.add(category, flat_polygon(corners, look), area=area_of(plan, index, first_area))
    return leaves


def _fill(rng: np.random.Generator, builder: SceneBuilder, plan: Storey, wall: Wall, hole: Hole, first_area: int,
          style: int, which: Families) -> list[Leaf]:  # fmt: skip
    outer = wall.right == OUTSIDE
    thick = plan.outer_m if outer else plan.wall_m
    # Most doors and windows of a home are alike, some are not.
    own = np.random.default_rng([style, len(hole.kind)]) if chance(rng, 0.8) else rng
    piece = hole_filling(own, hole, thick, which)
    if piece is None:
        return []
    towards = wall.to_left if hole.to_left else -wall.to_left
    origin = wall.at(hole.at_m) + (wall.to_left * (plan.wall_m - plan.outer_m) / 2 if outer else 0.0)
    room = wall.left if hole.to_left else wall.right
    floor = plan.rooms[wall.left].floor_m
    heading = heading_of(towards)
    mesh = _hinged(piece.mesh, hole, thick) if hole.kind == "door" else piece.mesh
    builder.add(piece.category, placed(mesh, origin, heading, floor + hole.sill_m), heading, piece.family,
                area=area_of(plan, room, first_area))  # fmt: skip
    return _leaves(mesh, thick, hole, origin, heading, room)


def _hinged(mesh: Mesh, hole: Hole, thick: float) -> Mesh:
    out = mesh.vertex[mesh.vertex[:, 0] > thick / 2 + 0.1]
    if hole.width_m > 1.2 or not len(out):
        return mesh
    near = out[out[:, 0] < out[:, 0].min() + 0.15]
    wanted = -hole.hinge if hole.to_left else hole.hinge  # the hole's +y runs against the wall where it looks left
    return mesh if float(near[:, 1].mean()) * wanted > 0 else mesh.scaled(1.0, -1.0, 1.0)


def _leaves(mesh: Mesh, thick: float, hole: Hole, origin: np.ndarray, heading: float, room: int) -> list[Leaf]:
    """Return the boxes round what stands out of the wall: by halves, since a wide door has two leaves."""
    out = []
    stands_out = mesh.vertex[mesh.vertex[:, 0] > thick / 2 + 0.03][:, :2].astype(np.float64)
    for part in (stands_out[stands_out[:, 1] < 0], stands_out[stands_out[:, 1] >= 0]):
        if not len(part):
            continue
        tip = part[np.argmax(part[:, 0])]
        hinge = np.array([thick / 2, np.sign(part[np.argmin(part[:, 0]), 1]) * (hole.width_m / 2 - 0.03)])
        turn = float(np.arctan2(*(tip - hinge)[::-1]))
        c, s = np.cos(turn), np.sin(turn)
        box = part @ np.array([[c, -s], [s, c]])
        low, high = box.min(axis=0), box.max(axis=0)
        low[0] = c * hinge[0] + s * hinge[1]  # a plain leaf has no corners between its hinge and its edge
        middle = np.array([[c, -s], [s, c]]) @ ((low + high) / 2)
        c, s = np.cos(heading), np.sin(heading)
        out.append(Leaf(origin + np.array([[c, -s], [s, c]]) @ middle, (high - low) / 2, heading + turn, room))
    return out
