"""Plants in pots: leaves are flat strips, stems are thin bars."""

import numpy as np

from avlmaps_sim.furniture.catalogue import Parts, family
from avlmaps_sim.furniture.decor import flowers
from avlmaps_sim.furniture.recipe_helpers import blade, chance, count, draw, made_of, pick
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, Meshes
from avlmaps_sim.shapes import box, circle, cylinder, ellipsoid, lathe, loft, rounded_rectangle, shell, slab, tube


def pot(rng: np.random.Generator, radius: float, tall: float) -> list[Mesh]:
    """Return a planter of a drawn form with earth in it, standing at the origin."""
    clay = (draw(rng, 0.6, 0.8), draw(rng, 0.3, 0.45), draw(rng, 0.18, 0.3))
    plain = made_of(rng, "ceramic", "ceramic", "painted", "metal", "stone", "black")
    look = material("ceramic", rng, clay) if chance(rng, 0.3) else plain
    earth = material("painted", rng, (0.14, 0.09, 0.06))
    kind = pick(rng, ("tapered", "tapered", "tube", "bowl", "square", "legs", "basket"))
    soil = cylinder(0.0, 0.0, tall * 0.86, radius * 0.88, tall * 0.04, earth, 12)
    if kind == "square":
        sizes = ((draw(rng, 0.7, 1.0), 0.0), (1.0, tall), (0.88, tall), (0.86, tall * 0.85))
        body = shell([(rounded_rectangle(2 * radius * s, 2 * radius * s, 0.01, 2), z) for s, z in sizes], look)
        return [body, slab(0.0, 0.0, tall * 0.85, 1.7 * radius, 1.7 * radius, 0.01, earth)]
    rows = {
        "tapered": [(0.68, 0.0), (0.95, 0.8), (1.03, 0.8), (1.03, 1.0), (0.9, 1.0), (0.88, 0.86)],
        "tube": [(0.98, 0.0), (1.0, 0.02), (1.0, 1.0), (0.92, 1.0), (0.9, 0.86)],
        "bowl": [(0.4, 0.0), (0.75, 0.2), (1.0, 0.6), (0.98, 1.0), (0.9, 1.0), (0.88, 0.86)],
        "legs": [(0.9, 0.35), (1.0, 0.4), (1.0, 1.0), (0.92, 1.0), (0.9, 0.86)],
        "basket": [(0.75, 0.0), (1.0, 0.3), (1.02, 0.7), (0.9, 1.0), (0.85, 1.0), (0.88, 0.86)],
    }[kind]
    if kind == "basket":
        look = material("wicker", rng)
    parts = [lathe([(r * radius, h * tall) for r, h in rows], look, sides=14), soil]
    if kind == "legs":
        wood, feet = material("wood", rng), circle(radius * 0.95, 4).tolist()
        parts += [tube([(x * 1.05, y * 1.05, 0.0), (x, y, tall * 0.6)], radius * 0.07, wood, 5) for x, y in feet]
    return parts


def frond(rng: np.random.Generator, base: tuple[float, float, float], turn: float, out: float, rise: float,
          droop: float, wide: float, look: Material, steps: int = 4) -> Mesh:  # fmt: skip
    """Return an arching leaf that leaves ``base`` in a direction, rises and falls; widest in its middle."""
    s = np.linspace(0.0, 1.0, steps + 1)
    c, d = float(np.cos(turn)), float(np.sin(turn))
    path = [
        (base[0] + c * out * float(t), base[1] + d * out * float(t), base[2] + rise * float(t) - droop * float(t * t))
        for t in s
    ]
    widths = (wide * np.sin(np.pi * np.clip(0.08 + 0.9 * s, 0, 1)) ** 0.7).tolist()
    roll = draw(rng, -0.5, 0.5)
    return blade(path, widths, (-d * float(np.cos(roll)), c * float(np.cos(roll)), float(np.sin(roll))), look)


def _greens(rng: np.random.Generator) -> list[Material]:
    return [material("plant", rng) for _ in range(2)]


def _pot_for(rng: np.random.Generator, height: float) -> tuple[list[Mesh], float, float]:
    radius = min(max(height * draw(rng, 0.11, 0.2), 0.05), 0.24)
    tall = radius * draw(rng, 1.1, 2.2)
    return pot(rng, radius, tall), radius, tall * 0.9


@family("plant", "palm")
def _palm(rng: np.random.Generator) -> Parts:
    height = draw(rng, 0.8, 2.2)
    parts, radius, earth = _pot_for(rng, height)
    green, bark, trunks = _greens(rng), material("wood", rng), count(rng, 1, 4)
    for _ in range(trunks):
        x, y = (radius * 0.5 * rng.uniform(-1, 1, 2)).tolist()
        top = earth + height * draw(rng, 0.2, 0.5)
        parts.append(tube([(x, y, earth), (x * 1.4, y * 1.4, top)], draw(rng, 0.01, 0.03), bark, 6))
        fronds, start = count(rng, 5, 10) if trunks > 1 else count(rng, 9, 16), draw(rng, 0, 6.28)
        for number in range(fronds):
            turn, out = start + number * 2.4, height * draw(rng, 0.2, 0.42)
            rise = height * draw(rng, 0.2, 0.5)
            droop = rise * draw(rng, 0.5, 1.3)
            wide = draw(rng, 0.03, 0.06) if trunks > 1 else draw(rng, 0.05, 0.12)
            parts.append(frond(rng, (x * 1.4, y * 1.4, top), turn, out, rise, droop, wide, pick(rng, green), 5))
    return parts


@family("plant", "feather palm")
def _feather_palm(rng: np.random.Generator) -> Parts:
    height = draw(rng, 0.9, 2.0)
    parts, _, earth = _pot_for(rng, height)
    green, stems = _greens(rng), count(rng, 5, 8)
    for number in range(stems):
        turn, out = number * 2.4, height * draw(rng, 0.15, 0.35)
        rise = height * draw(rng, 0.7, 1.0)
        c, d = out * float(np.cos(turn)), out * float(np.sin(turn))
        path = [(c * s * s, d * s * s, earth + rise * (1 - 0.25 * s) * s) for s in (0.0, 0.3, 0.55, 0.75, 0.9, 1.0)]
        look = pick(rng, green)
        parts.append(tube(path, 0.006, look, 3))
        for s in np.linspace(0.4, 1.0, 7).tolist():
            at = tuple(float(np.interp(s, (0.0, 0.3, 0.55, 0.75, 0.9, 1.0), [p[k] for p in path])) for k in range(3))
            for side in (-1, 1):
                long = height * 0.16 * (1.3 - s)
                parts.append(frond(rng, at, turn + side * 1.0, long + 0.05, 0.02, 0.09, 0.02, look, 2))  # type: ignore[arg-type]
    return parts


@family("plant", "bush")
def _bush(rng: np.random.Generator) -> Parts:
    height = draw(rng, 0.25, 0.9)
    parts, _, earth = _pot_for(rng, height * 1.4)
    green, leaves = _greens(rng), count(rng, 55, 90)
    size = height * draw(rng, 0.16, 0.27)
    spread = height * draw(rng, 0.35, 0.55)
    for _ in range(leaves):
        turn, up = draw(rng, 0, 6.28), draw(rng, 0.05, 1.0)
        out = spread * float(np.sin(np.pi * min(up, 0.95) * 0.8 + 0.4)) * draw(rng, 0.4, 1.0)
        at = (out * float(np.cos(turn)), out * float(np.sin(turn)), earth + up * height * 0.85)
        parts.append(
            frond(rng, at, turn + draw(rng, -0.6, 0.6), size, size * 0.6, size * 0.7, size * 0.5, pick(rng, green), 2)
        )
    for x, y in circle(spread * 0.3, 5).tolist():
        parts.append(tube([(0.0, 0.0, earth), (x, y, earth + height * 0.7)], 0.006, green[0], 3))
    return parts


@family("plant", "fern")
def _fern(rng: np.random.Generator) -> Parts:
    height = draw(rng, 0.2, 0.7)
    parts, _, earth = _pot_for(rng, height * 1.3)
    green, fronds, wide = _greens(rng), count(rng, 18, 34), draw(rng, 0.012, 0.06)
    for number in range(fronds):
        out, rise = height * draw(rng, 0.4, 0.95), height * draw(rng, 0.7, 1.9)
        droop = rise * draw(rng, 0.7, 1.25)
        droop = min(droop, rise + earth * 0.7)
        parts.append(frond(rng, (0.0, 0.0, earth), number * 2.4, out, rise, droop, wide, pick(rng, green), 6))
    return parts


@family("plant", "cactus")
def _cactus(rng: np.random.Generator) -> Parts:
    height = draw(rng, 0.12, 1.3)
    parts, radius, earth = _pot_for(rng, height)
    look, ribs = material("plant", rng), count(rng, 7, 11)
    wide = min(radius * draw(rng, 0.35, 0.75), 0.11)

    def column(x: float, y: float, low: float, top: float, thick: float) -> Mesh:
        fold = 1.0 - 0.18 * (np.arange(2 * ribs) % 2)
        rows = [
            (0.85, low),
            (1.0, low + 0.2 * (top - low)),
            (0.95, top - thick),
            (0.6, top - thick * 0.25),
            (0.05, top),
        ]
        rings = [
            np.column_stack([circle(r * thick, 2 * ribs) * fold[:, None] + (x, y), np.full(2 * ribs, z)])
            for r, z in rows
        ]
        return loft(rings, look)

    parts.append(column(0.0, 0.0, earth - 0.01, earth + height, wide))
    for _ in range(count(rng, 0, 3) if height > 0.35 else 0):
        turn, start = draw(rng, 0, 6.28), earth + height * draw(rng, 0.25, 0.55)
        x, y = 2.1 * wide * float(np.cos(turn)), 2.1 * wide * float(np.sin(turn))
        parts.append(tube([(0.0, 0.0, start), (x * 0.8, y * 0.8, start), (x, y, start + wide)], wide * 0.5, look, 7))
        parts.append(column(x, y, start + wide * 0.4, start + height * draw(rng, 0.2, 0.4) + wide, wide * 0.6))
    return parts


@family("plant", "snake plant")
def _snake_plant(rng: np.random.Generator) -> Parts:
    height = draw(rng, 0.25, 1.1)
    parts, radius, earth = _pot_for(rng, height * 1.1)
    green, wide = [*_greens(rng), material("plant", rng, (0.55, 0.6, 0.3))], min(height * draw(rng, 0.07, 0.13), 0.09)
    for _ in range(count(rng, 8, 18)):
        turn, out = draw(rng, 0, 6.28), radius * draw(rng, 0.0, 0.7)
        x, y, tall = out * float(np.cos(turn)), out * float(np.sin(turn)), height * draw(rng, 0.55, 1.0)
        lean = draw(rng, 0.0, 0.25) * tall
        path = [(x + lean * s * s * float(np.cos(turn)), y + lean * s * s * float(np.sin(turn)), earth + tall * s)
                for s in (0.0, 0.35, 0.7, 1.0)]  # fmt: skip
        side = draw(rng, 0, 6.28)
        aside = (float(np.cos(side)), float(np.sin(side)), 0.0)
        parts.append(blade(path, [wide * 0.7, wide, wide * 0.8, 0.004], aside, pick(rng, green)))
    return parts


@family("plant", "small pot")
def _small_pot(rng: np.random.Generator) -> Parts:
    radius = draw(rng, 0.035, 0.08)
    tall = radius * draw(rng, 1.0, 1.9)
    parts, green, earth = pot(rng, radius, tall), _greens(rng), tall * 0.88
    kind = pick(rng, ("rosette", "rosette", "herb", "grass"))
    if kind == "rosette":
        for number in range(18):
            out = radius * (0.4 + number * 0.05)
            rise = radius * (1.3 - number * 0.06)
            parts.append(
                frond(rng, (0.0, 0.0, earth), number * 2.4, out, rise, rise * 0.25, radius * 0.5, pick(rng, green), 2)
            )
    else:
        high = radius * draw(rng, 1.5, 3.5)
        for _ in range(26):
            turn, out = draw(rng, 0, 6.28), radius * draw(rng, 0.3, 1.3)
            wide = radius * (0.35 if kind == "herb" else 0.08)
            lift = earth + (high * draw(rng, 0.2, 0.8) if kind == "herb" else 0.0)
            at = (out * 0.5 * float(np.cos(turn)), out * 0.5 * float(np.sin(turn)), lift)
            parts.append(frond(rng, at, turn, out, high * draw(rng, 0.3, 1.0), high * 0.25, wide, pick(rng, green), 2))
    return parts


@family("plant", "tree")
def _tree(rng: np.random.Generator) -> Parts:
    height = draw(rng, 0.9, 1.9)
    parts, _, earth = _pot_for(rng, height * 0.9)
    green, bark = _greens(rng), material("wood", rng, (draw(rng, 0.25, 0.5), draw(rng, 0.2, 0.35), 0.18))
    fork, thick = earth + height * draw(rng, 0.35, 0.6), draw(rng, 0.01, 0.025)
    bend = rng.uniform(-0.05, 0.05, 2).tolist()
    parts.append(tube([(0.0, 0.0, earth), (*bend, (earth + fork) / 2), (0.0, 0.0, fork)], thick, bark, 6))
    crown, size = height - fork + earth, draw(rng, 0.09, 0.18)
    for number in range(count(rng, 4, 7)):
        turn, out = number * 2.4, crown * draw(rng, 0.25, 0.6)
        tip = np.array([out * np.cos(turn), out * np.sin(turn), fork + crown * draw(rng, 0.35, 1.0)])
        start = np.array([0.0, 0.0, fork])
        parts.append(tube([tuple(start), tuple((start + tip) / 2 + (0, 0, 0.03)), tuple(tip)], thick * 0.4, bark, 4))
        for _ in range(count(rng, 16, 24)):
            at = start + (tip - start) * draw(rng, 0.35, 1.05) + rng.uniform(-0.09, 0.09, 3) * crown
            place = (float(at[0]), float(at[1]), float(at[2]))
            leaf = frond(rng, place, draw(rng, 0, 6.28), size, size * 0.2, size * 0.6, size * 0.5, pick(rng, green), 2)
            parts.append(leaf)
    return parts


@family("plant", "big leaves", held_out=True)
def _big_leaves(rng: np.random.Generator) -> Parts:
    height = draw(rng, 0.5, 1.7)
    parts, _, earth = _pot_for(rng, height)
    green, size = _greens(rng), height * draw(rng, 0.22, 0.36)
    for number in range(count(rng, 7, 15)):
        turn, out = number * 2.4, height * draw(rng, 0.08, 0.3)
        high = earth + height * draw(rng, 0.35, 0.9)
        x, y = out * float(np.cos(turn)), out * float(np.sin(turn))
        look = pick(rng, green)
        parts.append(tube([(0.0, 0.0, earth), (x * 0.4, y * 0.4, (earth + high) / 2), (x, y, high)], 0.007, look, 4))
        parts.append(
            frond(rng, (x, y, high), turn, size, size * 0.15, size * draw(rng, 0.4, 0.9), size * 0.75, look, 5)
        )
    return parts


@family("plant", "trailing")
def _trailing(rng: np.random.Generator) -> Parts:
    stand, radius = draw(rng, 0.35, 1.0), draw(rng, 0.08, 0.16)
    look, tall = made_of(rng, "wood", "metal", "black"), radius * draw(rng, 1.0, 1.5)
    yield from [part.moved(z=stand) for part in pot(rng, radius, tall)]
    if chance(rng, 0.7):
        for x, y in circle(radius, count(rng, 3, 4)).tolist():
            yield tube([(x * 1.2, y * 1.2, 0.0), (x * 0.9, y * 0.9, stand)], 0.012, look, 5)
        yield cylinder(0.0, 0.0, stand - 0.02, radius * 1.05, 0.02, look, 14)
    else:
        yield box((-radius, -radius, 0.0), (radius, radius, stand), look)
    yield from _vines(rng, radius, stand + tall * 0.95, stand)


def _vines(rng: np.random.Generator, radius: float, top: float, room: float) -> Meshes:
    """Return stems with leaves that hang over a pot's edge, at most ``room`` below its foot."""
    green, size = _greens(rng), draw(rng, 0.04, 0.09)
    for number in range(count(rng, 6, 11)):
        turn, long = number * 2.4, draw(rng, 0.15, 0.75)
        low, out = max(top - long * 1.2, top - room * 0.95), radius * draw(rng, 1.1, 1.5)
        c, d = float(np.cos(turn)), float(np.sin(turn))
        path = [
            (c * radius * 0.5, d * radius * 0.5, top),
            (c * out, d * out, top + 0.03),
            (c * out * 1.1, d * out * 1.1, low),
        ]
        yield tube(path, 0.003, green[0], 3)
        for s in np.linspace(0.0, 1.0, 7).tolist():
            at = (c * out * (1 + 0.1 * s), d * out * (1 + 0.1 * s), top + (low - top) * s)
            yield frond(
                rng, at, turn + draw(rng, -1.2, 1.2), size, size * 0.3, size * 0.9, size * 0.7, pick(rng, green), 2
            )


@family("plant", "wall trailing")
def _wall_trailing(rng: np.random.Generator) -> Parts:
    radius = draw(rng, 0.06, 0.11)
    room, look, x = draw(rng, 0.3, 0.8), made_of(rng, "metal", "wood", "black"), radius * 2.4
    tall = radius * 1.3
    parts = [*pot(rng, radius, tall), *_vines(rng, radius, tall * 0.95, room)]
    inside = [part.moved(x=x) for part in parts]
    reach = x + radius
    return [*(m for m in inside if float(m.low[0]) > 0.0), box((0.0, -0.012, -0.02), (reach, 0.012, 0.0), look),
            box((0.0, -0.015, -0.12), (0.01, 0.015, 0.04), look)]  # fmt: skip


@family("plant", "flowering")
def _flowering(rng: np.random.Generator) -> Parts:
    radius = draw(rng, 0.06, 0.14)
    tall = radius * draw(rng, 1.1, 1.7)
    parts, green, size = pot(rng, radius, tall), _greens(rng), radius * draw(rng, 1.0, 1.8)
    for number in range(count(rng, 10, 18)):
        leaf = frond(
            rng, (0.0, 0.0, tall * 0.88), number * 2.4, size, size * 0.7, size * 0.8, size * 0.35, pick(rng, green), 3
        )
        parts.append(leaf)
    return [*parts, *flowers(rng, tall * 0.9, radius * draw(rng, 0.8, 1.5), radius * draw(rng, 1.5, 4.0))]


@family("plant", "clipped", held_out=True)
def _clipped(rng: np.random.Generator) -> Parts:
    height, look, bark = draw(rng, 0.4, 1.5), material("plant", rng), material("wood", rng)
    parts, radius, earth = _pot_for(rng, height)
    kind, wide = pick(rng, ("ball", "cone", "balls")), max(radius * draw(rng, 1.1, 1.6), 0.1)
    top = earth + height
    if kind == "cone":
        parts.append(
            lathe([(wide * 0.6, earth), (wide, earth + 0.1), (wide * 0.5, earth + height * 0.6), (0.01, top)], look)
        )
        return parts
    levels = (
        [(top - wide, wide)]
        if kind == "ball"
        else [(top - wide * 0.5, wide * 0.5), (earth + height * 0.45, wide * 0.8)]
    )
    parts.append(cylinder(0.0, 0.0, earth, 0.013, height * 0.9, bark, 6))
    for z, size in levels:
        ball = ellipsoid((0.0, 0.0, z), (size, size, size), look, 12, 8)
        rough = 1 + rng.uniform(-0.06, 0.06, (len(ball.vertex), 1))
        vertex = ((ball.vertex - (0.0, 0.0, z)) * rough + (0.0, 0.0, z)).astype(np.float32)
        parts.append(type(ball)(vertex, ball.triangle, ball.uv, ball.material, ball.materials))
    return parts
