"""Small buildings with exact measures, for what is heard and recorded in them."""

import numpy as np

from avlmaps_sim.mesh import Material, Triple
from avlmaps_sim.scene import Area, Light, Scene, SceneBuilder
from avlmaps_sim.shapes import box, sheet

HEIGHT_M = 2.6
_PAINT = Material((0.8, 0.8, 0.75))


def area(kind: str, low: tuple[float, float], high: tuple[float, float]) -> Area:
    """Return a rectangular room."""
    (a, b), (c, d) = low, high
    return Area(kind, np.array([[a, b], [c, b], [c, d], [a, d]], float), 0.0, HEIGHT_M, f"{kind}#1")


def _wall(builder: SceneBuilder, low: tuple[float, float], high: tuple[float, float], z: float = 0.0) -> None:
    builder.add("wall", box((*low, z), (*high, HEIGHT_M), _PAINT))


def _shell(builder: SceneBuilder, x: float, y: float) -> None:
    builder.add("floor", sheet((0.0, 0.0, 0.0), (x, 0.0, 0.0), (0.0, y, 0.0), Material((0.5, 0.4, 0.3))))
    builder.add("ceiling", sheet((0.0, 0.0, HEIGHT_M), (x, 0.0, 0.0), (0.0, y, 0.0), _PAINT))
    _wall(builder, (-0.1, -0.1), (x + 0.1, 0.0))
    _wall(builder, (-0.1, y), (x + 0.1, y + 0.1))
    _wall(builder, (-0.1, 0.0), (0.0, y))
    _wall(builder, (x, 0.0), (x + 0.1, y))
    builder.lights.append(Light((x / 2, y / 2, 2.3)))


def open_air() -> Scene:
    """Return a lawn of 26 m with nothing on it."""
    builder = SceneBuilder("lawn")
    builder.add("floor", sheet((-13.0, -13.0, 0.0), (26.0, 0.0, 0.0), (0.0, 26.0, 0.0), _PAINT))
    return builder.build()


def shoebox(x: float = 6.0, y: float = 5.0) -> Scene:
    """Return one bare bedroom."""
    builder = SceneBuilder("shoebox", areas=[area("bedroom", (0.0, 0.0), (x, y))])
    _shell(builder, x, y)
    return builder.build()


def two_rooms(door: bool = True) -> Scene:
    """Return two bedrooms of 4 m by 4 m side by side, with a doorway from y = 3 to 3.9 in the wall between, or none."""
    rooms = [area("bedroom", (0.0, 0.0), (4.0, 4.0)), area("bedroom", (4.1, 0.0), (8.1, 4.0))]
    builder = SceneBuilder("two rooms", areas=rooms)
    _shell(builder, 8.1, 4.0)
    _wall(builder, (4.0, 0.0), (4.1, 3.0 if door else 4.0))
    if door:
        _wall(builder, (4.0, 3.9), (4.1, 4.0))
        _wall(builder, (4.0, 3.0), (4.1, 3.9), z=2.05)
    return builder.build()


def flat() -> Scene:
    """Return a furnished kitchen, bathroom and bedroom, each with things that make sounds."""
    rooms = [area("kitchen", (0, 0), (5, 4)), area("bathroom", (5.1, 0), (9, 4)), area("bedroom", (0, 4.1), (9, 8))]
    builder = SceneBuilder("flat", areas=rooms)
    _shell(builder, 9.0, 8.0)
    for low, high, z in (
        ((5.0, 0.0), (5.1, 1.5), 0.0), ((5.0, 2.4), (5.1, 4.1), 0.0), ((5.0, 1.5), (5.1, 2.4), 2.05),
        ((0.0, 4.0), (1.0, 4.1), 0.0), ((1.9, 4.0), (9.0, 4.1), 0.0), ((1.0, 4.0), (1.9, 4.1), 2.05),
    ):  # fmt: skip
        _wall(builder, low, high, z)
    things: tuple[tuple[str, Triple, Triple, int], ...] = (
        ("microwave", (4.4, 0.2, 0.9), (4.9, 0.6, 1.2), 0),
        ("sink", (2.0, 0.05, 0.8), (2.6, 0.5, 0.95), 0),
        ("dining table", (1.5, 2.0, 0.7), (2.8, 2.9, 0.75), 0),
        ("sink", (8.4, 1.0, 0.8), (8.9, 1.6, 0.9), 1),
        ("toilet", (8.2, 3.3, 0.0), (8.8, 3.7, 0.45), 1),
        ("washing machine", (5.2, 3.4, 0.0), (5.8, 3.9, 0.85), 1),
        ("bed", (6.0, 6.0, 0.0), (8.0, 7.8, 0.5), 2),
        ("clock", (4.0, 7.9, 1.5), (4.3, 7.99, 1.8), 2),
    )
    for index, (category, low, high, room) in enumerate(things):
        look = Material((0.2 + 0.09 * index, 0.5, 0.9 - 0.09 * index))
        builder.add(category, box(low, high, look), area=room)
    return builder.build()
