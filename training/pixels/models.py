"""Models of small things by other hands, and simple shapes for the kinds of which there are few.

A folder holds the models as ``KIND__MAKER_NAME.glb``; `_NAMES` and `_KINDS` say which of them are which category.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from zlib import crc32

import numpy as np

from avlmaps_sim.files.gltf import read_parts
from avlmaps_sim.furniture.catalogue import Families
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, joined
from avlmaps_sim.shapes import box, cylinder, ellipsoid, lathe, rounded_box, tube

# Models of 0.25 m keep about this many triangles, smaller ones fewer.
_TRIANGLES = 350
_Z_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
# A kind of the folder, and what it is called here where that differs; "" leaves it out.
_KINDS = {
    "clothes": "clothing", "coffee maker": "coffee machine", "food box": "box", "food can": "can", "fork": "cutlery",
    "spoon": "cutlery", "knife": "cutlery", "utensils": "cutlery", "game console": "games console",
    "glasses": "eyeglasses", "keys": "key", "paper roll": "toilet paper", "phone": "mobile phone",
    "plug": "power socket", "speaker": "loudspeaker", "table setting": "tableware", "toilet brush": "brush",
    "clamp": "tool", "ashtray": "other", "book holder": "other", "brick": "other", "glue": "other",
    "letter tray": "other", "padlock": "other", "pen holder": "other", "plate holder": "other", "soap dish": "other",
    "sponge": "other", "toothpaste": "other", "watch": "other", "wood block": "other", "kitchen appliance": "other",
}  # fmt: skip
# Models that are not what their kind says, by a part of their name.
_NAMES = {
    "kitchenaid": "blender", "kitchenblender": "blender", "blendswap_microwave": "microwave",
    "scopia_toaster": "toaster", "scopia_candle": "candle", "complements2": "candle", "wirelessoffice": "telephone",
    "scopia_phone": "telephone", "ruler": "other", "papertowelholder": "other", "largepan": "pot",
    "skillet_lid": "other", "scopia_shovel": "other", "scopia_pelle": "other", "newspaper": "paper",
    "kalender": "other", "esponja": "other", "caballito": "rocking horse", "scopia_creamer": "jug",
    "scopia_sugar": "bowl", "box_room": "", "office_box": "", "utensilspot": "other", "kitchentools": "",
    "062_dice": "", "umbrella__sh3d_blendswap_umbrella.": "",
}  # fmt: skip
# Sizes that fit no home, put right.
_SCALES = {"ficustree": 0.3, "suitcase__": 0.65, "basin": 0.5, "yucca": 0.8, "ammobox": 0.5, "blendswap_box.": 0.6}
# What lies flat, what stands on its end, and what stays as it is but for those.
_FLAT = frozenset({"mobile phone", "tablet", "book", "remote control", "paper"})
_UPRIGHT = frozenset({"bottle"})
_WALL_CLOCKS = ("cuckooclock",)
_ON_WALLS = ("hanging_clothes", "blendswap_suit", "toiletpaperdispenser", "bathroom_tissue", "knifestandswap",
             "blendswap_towel")  # fmt: skip
# What comes in any colour.
_COLOURFUL = frozenset({
    "cup", "bottle", "bowl", "plate", "vase", "toy", "ball", "book", "box", "basket", "bag", "shoes", "clothing",
    "towel", "trash can", "mobile phone", "backpack", "suitcase", "umbrella", "hat", "jug", "headphones", "tool",
    "flashlight", "brush", "broom", "stapler", "pen", "racket", "candle", "soap", "blender", "kettle", "toaster",
})  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False)
class Thing:
    """One small thing: a model of a file, or a shape by rule."""

    category: str
    name: str  # of its file or its rule
    make: Callable[[np.random.Generator], Mesh]  # standing, its front along +x
    on_wall: bool = False  # it hangs on a wall


def category_of(file: str) -> str:
    """Return what a file of the folder shows, "" where it is left out."""
    for part, category in _NAMES.items():
        if part in file:
            return category
    kind = file.split("__")[0].replace("_", " ")
    return _KINDS.get(kind, kind)


def small_things(folder: Path, which: Families) -> dict[str, list[Thing]]:
    """Return the things of each category.

    Args:
        folder: the models.
        which: a fifth of the models of a category with four or more are held out, chosen by a hash of their names;
            of a category with fewer all are in both parts.

    Raises:
        FileNotFoundError: the folder holds no model.
    """
    things: dict[str, list[Thing]] = {}
    for path in sorted(folder.glob("*__*.glb")):
        category = category_of(path.name)
        if category:
            on_wall = any(name in path.name for name in (*_ON_WALLS, *_WALL_CLOCKS)) or category in ON_WALL
            things.setdefault(category, []).append(Thing(category, path.stem, _drawer(path, category), on_wall))
    if not things:
        raise FileNotFoundError(f"{folder} holds no models of things; give the folder of the .glb files")
    for category, rules in _RULES.items():
        things.setdefault(category, []).extend(
            Thing(category, rule.__name__, rule, category in ON_WALL) for rule in rules
        )
    return {category: _part(all_of, which) for category, all_of in things.items()}


def _part(things: list[Thing], which: Families) -> list[Thing]:
    if which == "all" or len(things) < 4:
        return things
    order = sorted(things, key=lambda thing: crc32(thing.name.encode()))
    held = max(1, round(len(order) / 5))
    return order[:held] if which == "held-out" else order[held:]


def _drawer(path: Path, category: str) -> Callable[[np.random.Generator], Mesh]:
    scale = next((factor for name, factor in _SCALES.items() if name in path.name), 1.0)

    def draw(rng: np.random.Generator) -> Mesh:
        mesh = _model(path)
        if category in _FLAT and (category != "book" or rng.random() < 0.7):
            mesh = _laid(mesh, least=True)
        elif category in _UPRIGHT:
            mesh = _laid(mesh, least=False)
        size = scale * rng.uniform(0.88, 1.12, 3) ** np.array([1.0, 0.3, 0.3])
        x, y, z = (float(size[0] * s) for s in (1.0, size[1], size[2]))
        return recoloured(mesh.scaled(x, y, z), rng, category in _COLOURFUL)

    return draw


def _laid(mesh: Mesh, least: bool) -> Mesh:
    """Return it turned so that its least extent, or else its greatest, is upright."""
    size = mesh.size
    axis = int(np.argmin(size) if least else np.argmax(size))
    if axis == 2 or (not least and size[axis] < 1.3 * size[2]):
        return mesh
    return mesh.tilted("y" if axis == 0 else "x", np.pi / 2).standing()


def recoloured(mesh: Mesh, rng: np.random.Generator, any_colour: bool) -> Mesh:
    """Return it in other colours: a little lighter, darker and tinted, and some in another colour altogether."""
    tint = rng.uniform(0.6, 1.15) * rng.uniform(0.85, 1.1, 3)
    if any_colour and rng.random() < 0.5:
        tint = rng.uniform(0.15, 1.0, 3)
    changed = bool(any_colour and rng.random() < 0.4)
    area = np.bincount(mesh.material, mesh.areas_m2(), len(mesh.materials))
    most = int(area.argmax())

    def colour(number: int, look: Material) -> Material:
        old = rng.uniform(0.05, 0.95, 3) if changed and number == most and look.texture is None else look.colour
        red, green, blue = (float(np.clip(c, 0.0, 1.0)) for c in np.asarray(old) * tint)
        return replace(look, colour=(red, green, blue))

    return replace(mesh, materials=tuple(colour(*each) for each in enumerate(mesh.materials)))


@cache
def _model(path: Path) -> Mesh:
    """Return a model of few triangles, its front along +x."""
    mesh = joined([part.mesh.mapped(_Z_UP) for part in read_parts(path)]).turned(np.pi / 2)
    return simplified(mesh, round(_TRIANGLES * float(np.clip(mesh.size.max() / 0.25, 0.5, 1.6)))).standing()


def simplified(mesh: Mesh, triangles: int) -> Mesh:
    """Return a mesh of at most about so many triangles: edges shrink to points where that moves its surfaces least."""
    if len(mesh.triangle) <= triangles:
        return mesh
    size = float(mesh.size.max())
    _, first, number = np.unique(np.round(mesh.vertex / (size * 1e-4)), axis=0, return_index=True, return_inverse=True)
    vertex = mesh.vertex[first].astype(np.float64)
    triangle = number.reshape(-1)[mesh.triangle]
    _, rows = np.unique(np.sort(triangle, axis=1), axis=0, return_index=True)  # sheets are seen from both sides
    rows = rows[[len(set(corners)) == 3 for corners in triangle[rows].tolist()]]
    triangle = triangle[rows]
    quadric = _quadrics(vertex, triangle)
    for _ in range(100):
        if len(triangle) <= triangles:
            break
        ends = np.sort(triangle[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        a, b = np.divmod(np.unique(ends[:, 0] * len(vertex) + ends[:, 1]), len(vertex))
        both = quadric[a] + quadric[b]
        # The best of the two ends and the middle.
        choice = np.stack([vertex[a], vertex[b], (vertex[a] + vertex[b]) / 2], axis=1)
        point = np.concatenate([choice, np.ones((*choice.shape[:2], 1))], axis=2)
        cost = np.sum((point @ both) * point, axis=2)
        best = cost.argmin(axis=1)
        pick = np.arange(len(a))
        at, cost = choice[pick, best], cost[pick, best] + 1e-9 * size**2 * np.sum((vertex[a] - vertex[b]) ** 2, axis=1)
        # Of the cheaper edges those that are cheapest at both ends shrink together; each takes two triangles.
        rank = np.empty(len(a), np.int64)
        rank[np.argsort(cost, kind="stable")] = pick
        least = np.full(len(vertex), len(a))
        np.minimum.at(least, a, rank)
        np.minimum.at(least, b, rank)
        ringed = least.copy()
        np.minimum.at(ringed, a, least[b])
        np.minimum.at(ringed, b, least[a])
        chosen = np.flatnonzero((ringed[a] == rank) & (ringed[b] == rank) & (rank < max(0.12 * len(a), 8)))
        chosen = chosen[np.argsort(rank[chosen])][: max(1, (len(triangle) - triangles + 1) // 2)]
        vertex[a[chosen]], quadric[a[chosen]] = at[chosen], both[chosen]
        to = np.arange(len(vertex))
        to[b[chosen]] = a[chosen]
        triangle = to[triangle]
        p, q, r = triangle.T
        keep = (p != q) & (q != r) & (p != r)
        triangle, rows = triangle[keep], rows[keep]
    return Mesh(
        vertex.astype(np.float32), triangle.astype(np.int32), mesh.uv[rows], mesh.material[rows], mesh.materials
    )


def _quadrics(vertex: np.ndarray, triangle: np.ndarray) -> np.ndarray:
    """Return for each vertex the form whose value at a place is its squared distance to the planes round the vertex."""
    a, b, c = (vertex[triangle[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    area = np.linalg.norm(normal, axis=1, keepdims=True)
    normal /= np.maximum(area, 1e-15)
    plane = np.column_stack([normal, -np.sum(normal * a, axis=1)])
    form = plane[:, :, None] * plane[:, None, :] * area[:, None]
    quadric = np.zeros((len(vertex), 4, 4))
    for k in range(3):
        np.add.at(quadric, triangle[:, k], form)
    # Rims of open sheets have planes across them, or flat sheets would shrink for nothing.
    edge = np.concatenate([triangle[:, [0, 1]], triangle[:, [1, 2]], triangle[:, [2, 0]]])
    _, first, count = np.unique(np.sort(edge, axis=1), axis=0, return_index=True, return_counts=True)
    rim = first[count == 1]
    start, way = vertex[edge[rim, 0]], vertex[edge[rim, 1]] - vertex[edge[rim, 0]]
    across = np.cross(way, normal[rim % len(triangle)])
    length = np.linalg.norm(way, axis=1, keepdims=True)
    across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-15)
    plane = np.column_stack([across, -np.sum(across * start, axis=1)])
    form = 3.0 * plane[:, :, None] * plane[:, None, :] * (length * length)[:, None]
    for k in range(2):
        np.add.at(quadric, edge[rim, k], form)
    return quadric


# Simple shapes, for kinds of which the folder has few or none. Each stands round the origin, its front along +x.


def _look(rng: np.random.Generator, *kinds: str) -> Material:
    return material(str(rng.choice(kinds)), rng)


def _mouse_round(rng: np.random.Generator) -> Mesh:
    body = ellipsoid((0, 0, 0), (rng.uniform(0.05, 0.06), rng.uniform(0.028, 0.034), 0.035), _look(rng, "plastic"))
    low = body.vertex.copy()
    low[:, 2] = np.maximum(low[:, 2], 0.0)
    return joined([replace(body, vertex=low), cylinder(0.025, 0, 0.02, 0.006, 0.016, _look(rng, "black"))])


def _mouse_flat(rng: np.random.Generator) -> Mesh:
    look = _look(rng, "white", "black", "plastic", "metal")
    return rounded_box((-0.055, -0.03, 0.0), (0.055, 0.03, rng.uniform(0.018, 0.03)), 0.02, look, 4)


def _mouse_wired(rng: np.random.Generator) -> Mesh:
    look = _look(rng, "black", "plastic", "white")
    body = rounded_box((-0.055, -0.03, 0.0), (0.055, 0.03, 0.035), 0.03, look, 4)
    bend = rng.uniform(-0.1, 0.1)
    wire = tube([(0.055, 0, 0.004), (0.12, bend / 2, 0.004), (0.2, bend, 0.004)], 0.002, look, 4)
    return joined([body, wire])


def _buttons(rng: np.random.Generator, length: float, width: float, top: float) -> list[Mesh]:
    look, red = _look(rng, "plastic", "white", "black"), _look(rng, "plastic")
    rows, columns = int(rng.integers(4, 9)), int(rng.integers(2, 4))
    made = []
    for row in range(rows):
        x = length * (0.42 - 0.75 * row / rows)
        for column in range(columns):
            y = width * 0.6 * (column / (columns - 1) - 0.5)
            size = 0.5 * min(length * 0.6 / rows, width * 0.5 / columns)
            made.append(box((x - size, y - size, top), (x + size, y + size, top + 0.002), red if row == 0 else look))
    return made


def _remote_flat(rng: np.random.Generator) -> Mesh:
    length, width, high = rng.uniform(0.14, 0.23), rng.uniform(0.04, 0.055), rng.uniform(0.014, 0.024)
    look = _look(rng, "black", "black", "plastic", "white")
    body = box((-length / 2, -width / 2, 0), (length / 2, width / 2, high), look)
    return joined([body, *_buttons(rng, length, width, high)])


def _remote_round(rng: np.random.Generator) -> Mesh:
    length, width, high = rng.uniform(0.12, 0.2), rng.uniform(0.035, 0.05), rng.uniform(0.018, 0.028)
    look = _look(rng, "black", "metal", "plastic", "white")
    body = rounded_box((-length / 2, -width / 2, 0), (length / 2, width / 2, high), high / 2, look)
    return joined([body, *_buttons(rng, length, width, high)])


def _slate(rng: np.random.Generator, length: float, width: float) -> Mesh:
    high, edge = rng.uniform(0.007, 0.012), rng.uniform(0.003, 0.012)
    case = _look(rng, "black", "black", "metal", "white", "plastic")
    shown = _look(rng, "screen") if rng.random() < 0.4 else _look(rng, "black")
    face = box((edge - length / 2, edge - width / 2, high - 0.001), (length / 2 - edge, width / 2 - edge, high + 0.001),
               shown)  # fmt: skip
    return joined([rounded_box((-length / 2, -width / 2, 0), (length / 2, width / 2, high), 0.004, case), face])


def _phone_plain(rng: np.random.Generator) -> Mesh:
    return _slate(rng, rng.uniform(0.135, 0.165), rng.uniform(0.065, 0.078))


def _phone_old(rng: np.random.Generator) -> Mesh:
    length, width, high = rng.uniform(0.1, 0.13), rng.uniform(0.045, 0.055), rng.uniform(0.014, 0.022)
    body = rounded_box((-length / 2, -width / 2, 0), (length / 2, width / 2, high), 0.008, _look(rng, "plastic"))
    face = box((0.0, -0.4 * width, high), (0.42 * length, 0.4 * width, high + 0.001), _look(rng, "screen", "black"))
    keys = [part.scaled(0.5, 1.0, 1.0).moved(-length / 5) for part in _buttons(rng, length, width, high)]
    return joined([body, face, *keys])


def _phone_on_its_face(rng: np.random.Generator) -> Mesh:
    length, width, high = rng.uniform(0.135, 0.165), rng.uniform(0.065, 0.078), rng.uniform(0.008, 0.012)
    look = _look(rng, "plastic", "leather", "metal", "black", "painted")
    body = rounded_box((-length / 2, -width / 2, 0), (length / 2, width / 2, high), 0.004, look)
    lens = cylinder(0.4 * length, 0.25 * width, high, 0.009, 0.002, _look(rng, "black"), 10)
    return joined([body, lens])


def _tablet_plain(rng: np.random.Generator) -> Mesh:
    return _slate(rng, rng.uniform(0.2, 0.28), rng.uniform(0.14, 0.2))


def _tablet_propped(rng: np.random.Generator) -> Mesh:
    slate = _slate(rng, rng.uniform(0.15, 0.19), rng.uniform(0.22, 0.27)).tilted("y", rng.uniform(0.9, 1.25))
    return joined([slate.standing(), box((-0.06, -0.08, 0.0), (0.06, 0.08, 0.004), _look(rng, "leather", "plastic"))])


def _tablet_cased(rng: np.random.Generator) -> Mesh:
    slate = _tablet_plain(rng)
    x, y = (float(s) for s in slate.size[:2])
    return joined([slate.moved(z=0.004), box((-0.52 * x, -0.53 * y, 0), (0.52 * x, 0.53 * y, 0.006),
                                            _look(rng, "leather", "fabric", "plastic"))])  # fmt: skip


def _one_key(rng: np.random.Generator, turn: float) -> Mesh:
    look = _look(rng, "metal")
    length = rng.uniform(0.035, 0.05)
    head = cylinder(0.022, 0, 0, 0.012, 0.003, look, 8)
    blade = box((0.03, -0.004, 0), (0.03 + length, 0.004, 0.003), look)
    return joined([head, blade]).turned(turn)


def _key_ring(rng: np.random.Generator) -> Mesh:
    keys = [_one_key(rng, a).moved(z=0.002 * k) for k, a in enumerate(rng.uniform(-1.5, 1.5, rng.integers(2, 5)))]
    ring = tube([(0.014 * np.cos(a), 0.014 * np.sin(a), 0.004) for a in np.linspace(0, 5.6, 8)], 0.0015,
                _look(rng, "metal"), 4, closed=True)  # fmt: skip
    fob = rounded_box((-0.07, -0.016, 0), (-0.014, 0.016, 0.008), 0.004, _look(rng, "leather", "plastic", "fabric"))
    return joined([*keys, ring, fob])


def _car_key(rng: np.random.Generator) -> Mesh:
    body = rounded_box((-0.035, -0.018, 0), (0.035, 0.018, 0.014), 0.01, _look(rng, "black", "plastic"), 4)
    return joined([body, _one_key(rng, rng.uniform(-0.6, 0.6)).moved(0.025)])


def _pan(rng: np.random.Generator) -> Mesh:
    radius, high = rng.uniform(0.1, 0.16), rng.uniform(0.035, 0.07)
    look = _look(rng, "black", "metal", "black")
    body = lathe([(0.75 * radius, 0), (radius, high), (radius - 0.004, high), (0.73 * radius, 0.006), (0, 0.006)], look,
                 sides=20)  # fmt: skip
    path = [(radius - 0.01, 0, 0.8 * high), (radius + 0.09, 0, high + 0.015), (radius + rng.uniform(0.15, 0.22), 0,
            high + 0.02)]  # fmt: skip
    return joined([body, tube(path, 0.01, _look(rng, "black", "wood", "plastic"), 6)])


def _wok(rng: np.random.Generator) -> Mesh:
    radius, high = rng.uniform(0.14, 0.18), rng.uniform(0.07, 0.1)
    look = _look(rng, "black", "metal")
    body = lathe([(0.35 * radius, 0), (0.8 * radius, 0.5 * high), (radius, high), (radius - 0.004, high),
                  (0.78 * radius, 0.5 * high + 0.004), (0, 0.006)], look, sides=20)  # fmt: skip
    handle = tube([(radius - 0.01, 0, 0.9 * high), (radius + 0.18, 0, high + 0.03)], 0.012, _look(rng, "wood", "black"))
    return joined([body, handle])


def _saucepan(rng: np.random.Generator) -> Mesh:
    radius, high = rng.uniform(0.07, 0.1), rng.uniform(0.08, 0.12)
    look = _look(rng, "metal", "painted", "metal")
    body = lathe([(radius, 0), (radius, high), (radius - 0.004, high), (radius - 0.004, 0.005), (0, 0.005)], look)
    handle = tube(
        [(radius - 0.005, 0, 0.85 * high), (radius + 0.16, 0, 0.9 * high)], 0.009, _look(rng, "black", "metal")
    )
    return joined([body, handle])


def _board(rng: np.random.Generator) -> Mesh:
    length, width = rng.uniform(0.28, 0.42), rng.uniform(0.18, 0.28)
    look = _look(rng, "wood", "wood", "plastic", "white")
    return rounded_box((-length / 2, -width / 2, 0), (length / 2, width / 2, rng.uniform(0.01, 0.03)), 0.02, look)


def _board_with_grip(rng: np.random.Generator) -> Mesh:
    look = _look(rng, "wood")
    body = _board(rng)
    body = replace(body, materials=(look,))
    end = float(body.high[0])
    return joined([body, box((end - 0.01, -0.025, 0), (end + 0.1, 0.025, float(body.high[2])), look)])


def _jug(rng: np.random.Generator) -> Mesh:
    radius, high = rng.uniform(0.05, 0.08), rng.uniform(0.16, 0.28)
    look = _look(rng, "ceramic", "glass", "plastic", "metal")
    neck = rng.uniform(0.6, 0.95)
    body = lathe([(0.8 * radius, 0), (radius, 0.35 * high), (neck * radius, 0.8 * high), (1.1 * neck * radius, high),
                  (neck * radius, high - 0.005), (0.9 * radius, 0.35 * high), (0, 0.01)], look)  # fmt: skip
    grip = tube([(-0.9 * neck * radius, 0, 0.85 * high), (-radius - 0.05, 0, 0.75 * high),
                 (-radius - 0.03, 0, 0.35 * high), (-0.95 * radius, 0, 0.3 * high)], 0.007, look, 6)  # fmt: skip
    return joined([body, grip])


def _tumbler(rng: np.random.Generator) -> Mesh:
    radius, high = rng.uniform(0.03, 0.042), rng.uniform(0.08, 0.15)
    inner = radius - 0.003
    foot = rng.uniform(0.75, 1.0) * radius
    return lathe([(foot, 0), (radius, high), (inner, high), (0.8 * inner, 0.012), (0, 0.012)],
                 material("glass", rng))  # fmt: skip


def _wine_glass(rng: np.random.Generator) -> Mesh:
    radius, high = rng.uniform(0.03, 0.045), rng.uniform(0.16, 0.24)
    foot = [(0.9 * radius, 0), (0.85 * radius, 0.004), (0.005, 0.012), (0.005, 0.45 * high)]
    bowl = [(radius, 0.65 * high), (0.8 * radius, high), (0.77 * radius, high), (0.95 * radius, 0.65 * high)]
    return lathe([*foot, *bowl, (0, 0.48 * high)], material("glass", rng))


def _can(rng: np.random.Generator) -> Mesh:
    radius, high = rng.uniform(0.03, 0.05), rng.uniform(0.08, 0.14)
    steel = material("metal", rng, (0.75, 0.75, 0.76))
    paint = _look(rng, "plastic", "painted", "poster")
    label = lathe([(radius, 0.006), (radius, high - 0.006)], paint)
    return joined([lathe([(0.9 * radius, 0), (0.98 * radius, 0.006), (0.98 * radius, high - 0.006),
                          (0.88 * radius, high)], steel), label])  # fmt: skip


def _soap_bar(rng: np.random.Generator) -> Mesh:
    look = _look(rng, "ceramic", "plastic", "white")
    return rounded_box((-0.045, -0.028, 0), (0.045, 0.028, rng.uniform(0.018, 0.03)), 0.012, look)


def _paper_roll(rng: np.random.Generator) -> Mesh:
    outer, inner, high = rng.uniform(0.045, 0.06), 0.02, rng.uniform(0.09, 0.105)
    rings = [(inner, 0), (outer, 0), (outer, high), (inner, high), (inner, 0.02)]
    mesh = lathe(rings, material("paper", rng, (0.95, 0.95, 0.94)))
    return mesh.tilted("y", np.pi / 2).standing() if rng.random() < 0.3 else mesh


def _extinguisher(rng: np.random.Generator) -> Mesh:
    radius, high = rng.uniform(0.05, 0.09), rng.uniform(0.3, 0.55)
    red = material("painted", rng, (float(rng.uniform(0.6, 0.9)), 0.06, 0.06))
    black = _look(rng, "black")
    body = lathe([(0.9 * radius, 0), (radius, 0.02), (radius, 0.8 * high), (0.3 * radius, 0.9 * high)], red)
    head = cylinder(0, 0, 0.9 * high, 0.3 * radius, 0.05, black, 10)
    grip = box((0, -0.012, 0.9 * high + 0.05), (1.2 * radius, 0.012, 0.9 * high + 0.065), black)
    hose = tube([(0.02, 0, 0.93 * high), (0.03, radius + 0.03, 0.85 * high), (0.02, radius + 0.015, 0.4 * high)], 0.01,
                black, 6)  # fmt: skip
    return joined([body, head, grip, hose])


def _plate_on_wall(rng: np.random.Generator, side: float) -> tuple[Mesh, float]:
    deep = rng.uniform(0.008, 0.014)
    look = material("white", rng) if rng.random() < 0.8 else _look(rng, "metal", "black")
    return box((-deep / 2, -side / 2, 0), (deep / 2, side / 2, side), look), deep / 2


def _socket(rng: np.random.Generator) -> Mesh:
    plate, front = _plate_on_wall(rng, 0.08)
    dark = _look(rng, "black")
    round_one = lathe([(0.02, 0), (0.02, 0.001)], material("white", rng, (0.75, 0.75, 0.74))).tilted("y", np.pi / 2)
    holes = [box((front, y - 0.003, 0.037), (front + 0.002, y + 0.003, 0.043), dark) for y in (-0.01, 0.01)]
    one = joined([plate, round_one.moved(front, 0, 0.04), *holes])
    return joined([one, one.moved(y=0.08)]) if rng.random() < 0.4 else one


def _switch(rng: np.random.Generator) -> Mesh:
    plate, front = _plate_on_wall(rng, 0.08)
    rocker = box((front, -0.025, 0.014), (front + 0.006, 0.025, 0.066), material("white", rng))
    return joined([plate, rocker.tilted("y", 0.0)])


def _switch_with_lever(rng: np.random.Generator) -> Mesh:
    plate, front = _plate_on_wall(rng, 0.075)
    plate = plate.scaled(1.0, 1.0, 1.5)
    return joined([plate, box((front, -0.005, 0.05), (front + 0.015, 0.005, 0.07), material("white", rng))])


def _detector(rng: np.random.Generator) -> Mesh:
    radius, deep = rng.uniform(0.045, 0.065), rng.uniform(0.025, 0.05)
    look = material("white", rng)
    mesh = lathe([(radius, 0), (radius, 0.6 * deep), (0.7 * radius, deep), (0, deep)], look)
    light = cylinder(0.4 * radius, 0, deep - 0.002, 0.004, 0.004, material("plastic", rng, (0.8, 0.1, 0.1)), 6)
    return joined([mesh, light]).tilted("y", np.pi / 2).standing()


def _trolley(rng: np.random.Generator) -> Mesh:
    width, deep, high = rng.uniform(0.34, 0.5), rng.uniform(0.2, 0.3), rng.uniform(0.5, 0.72)
    look = _look(rng, "plastic", "fabric", "painted", "metal")
    body = rounded_box((-deep / 2, -width / 2, 0.04), (deep / 2, width / 2, high), 0.05, look)
    black = _look(rng, "black")
    wheels = [ellipsoid((x, y, 0.025), (0.03, 0.02, 0.025), black, 8, 4)
              for x in (-0.35 * deep, 0.35 * deep) for y in (-0.4 * width, 0.4 * width)]  # fmt: skip
    out = high + rng.choice([0.03, 0.35])
    bar = tube([(-0.4 * deep, -0.1, high - 0.02), (-0.4 * deep, -0.1, out), (-0.4 * deep, 0.1, out),
                (-0.4 * deep, 0.1, high - 0.02)], 0.008, _look(rng, "black", "metal"), 6)  # fmt: skip
    ribs = [box((deep / 2 - 0.005, y - 0.012, 0.1), (deep / 2 + 0.006, y + 0.012, high - 0.07), look)
            for y in np.linspace(-0.3, 0.3, 4) * width]  # fmt: skip
    return joined([body, *wheels, bar, *ribs])


def _lying_case(rng: np.random.Generator) -> Mesh:
    return _trolley(rng).tilted("y", np.pi / 2 if rng.random() < 0.5 else -np.pi / 2).standing()


def _rucksack(rng: np.random.Generator) -> Mesh:
    width, deep, high = rng.uniform(0.26, 0.34), rng.uniform(0.14, 0.2), rng.uniform(0.38, 0.52)
    look, other = _look(rng, "fabric", "fabric", "leather", "plastic"), _look(rng, "fabric", "leather")
    body = rounded_box((-deep / 2, -width / 2, 0), (deep / 2, width / 2, high), 0.09, look, 4)
    pocket = rounded_box((deep / 2 - 0.03, -0.35 * width, 0.04), (deep / 2 + 0.05, 0.35 * width, 0.45 * high), 0.03,
                         other)  # fmt: skip
    straps = [tube([(-deep / 2 + 0.01, y, 0.93 * high), (-deep / 2 - 0.05, y, 0.7 * high),
                    (-deep / 2 - 0.04, y, 0.3 * high), (-deep / 2 + 0.01, y, 0.08)], 0.014, other, 6)
              for y in (-0.25 * width, 0.25 * width)]  # fmt: skip
    grip = tube([(0, -0.04, high - 0.02), (0, -0.03, high + 0.04), (0, 0.03, high + 0.04), (0, 0.04, high - 0.02)],
                0.01, other, 6)  # fmt: skip
    return joined([body, pocket, *straps, grip])


def _cap(rng: np.random.Generator) -> Mesh:
    look = _look(rng, "fabric", "fabric", "leather")
    crown = lathe([(0.09, 0), (0.09, 0.05), (0.07, 0.1), (0.02, 0.12)], look, squash=0.85)
    peak = ellipsoid((0.11, 0, 0.008), (0.08, 0.07, 0.006), look, 12, 4)
    return joined([crown, peak])


def _brimmed_hat(rng: np.random.Generator) -> Mesh:
    look, brim = _look(rng, "fabric", "wicker", "leather"), rng.uniform(0.13, 0.2)
    high = rng.uniform(0.1, 0.14)
    return lathe([(brim, 0.01), (brim, 0.015), (0.09, 0.01), (0.085, 0.8 * high), (0.06, high), (0.01, 0.95 * high)],
                 look, sides=20, squash=0.88)  # fmt: skip


def _closed_umbrella(rng: np.random.Generator) -> Mesh:
    look, high = _look(rng, "fabric", "fabric", "black"), rng.uniform(0.7, 0.9)
    cloth = lathe(
        [(0.008, 0.06), (0.02, 0.1), (rng.uniform(0.03, 0.055), 0.6 * high), (0.012, 0.75 * high)], look, sides=8
    )
    crook = [(0.03, 0, high + 0.05), (0.07, 0, high + 0.03), (0.08, 0, high - 0.02)]
    stick = tube([(0, 0, 0), (0, 0, high), *crook], 0.008,
                 _look(rng, "wood", "black", "metal"), 6)  # fmt: skip
    return joined([cloth, stick])


def _small_umbrella(rng: np.random.Generator) -> Mesh:
    cloth = lathe([(0.02, 0), (0.028, 0.05), (0.022, 0.2), (0.008, 0.21)], _look(rng, "fabric", "black"), sides=10)
    grip = cylinder(0, 0, 0.2, 0.014, 0.07, _look(rng, "black", "plastic", "wood"), 8)
    return joined([cloth, grip]).tilted("y", np.pi / 2).standing()


def _headset(rng: np.random.Generator) -> Mesh:
    look, pad = _look(rng, "black", "plastic", "white", "metal"), _look(rng, "leather", "black", "fabric")
    arc = [(0.095 * np.sin(a), 0.085 * np.cos(a), 0.03) for a in np.linspace(-1.7, 1.7, 9)]
    band = tube([(x, y, z) for y, x, z in arc], 0.009, look, 6)
    cups = [ellipsoid((-0.015, y, 0.035), (0.045, 0.02, 0.035), pad, 12, 6) for y in (-0.09, 0.09)]
    mesh = joined([band, *cups])
    return (mesh.tilted("y", np.pi / 2) if rng.random() < 0.3 else mesh).standing()


def _torch(rng: np.random.Generator) -> Mesh:
    look, long = _look(rng, "black", "metal", "plastic"), rng.uniform(0.1, 0.24)
    body = lathe([(0.014, 0), (0.014, 0.7 * long), (0.024, 0.85 * long), (0.024, long)], look, sides=12)
    glass = lathe([(0.02, long), (0.02, long + 0.001)], material("white", rng), sides=12)
    return joined([body, glass]).tilted("y", np.pi / 2 if rng.random() < 0.85 else 0.0).standing()


def _pad(rng: np.random.Generator) -> Mesh:
    look = _look(rng, "black", "white", "plastic")
    body = rounded_box((-0.03, -0.05, 0.01), (0.03, 0.05, 0.045), 0.02, look)
    grips = [ellipsoid((-0.03, y, 0.024), (0.055, 0.024, 0.024), look, 10, 6) for y in (-0.055, 0.055)]
    sticks = [cylinder(-0.005, y, 0.045, 0.009, 0.012, _look(rng, "black", "plastic"), 8) for y in (-0.025, 0.025)]
    return joined([body, *grips, *sticks])


def _console(rng: np.random.Generator) -> Mesh:
    look = _look(rng, "black", "white", "black")
    size = rng.uniform(0.85, 1.1)
    body = rounded_box((-0.13, -0.15, 0), (0.13, 0.15, 0.06), 0.01, look).scaled(size, size, 1.0)
    slot = box((0.12 * size, -0.1, 0.03), (0.132 * size, 0.03, 0.034), _look(rng, "metal", "plastic"))
    mesh = joined([body, slot])
    return mesh.tilted("x", np.pi / 2).standing() if rng.random() < 0.3 else mesh


def _compact(rng: np.random.Generator) -> Mesh:
    look = _look(rng, "black", "metal", "plastic", "leather")
    body = rounded_box((-0.015, -0.055, 0), (0.018, 0.055, 0.065), 0.008, look)
    long = rng.uniform(0.012, 0.07)
    lens = lathe([(0.026, 0), (0.024, long), (0.018, long), (0.01, long - 0.005)], _look(rng, "black")).tilted(
        "y", np.pi / 2
    )
    button = cylinder(0, -0.035, 0.065, 0.007, 0.006, _look(rng, "metal"), 8)
    return joined([body, lens.moved(0.018, 0, 0.033), button])


def _broom(rng: np.random.Generator) -> Mesh:
    high, wide = rng.uniform(1.2, 1.5), rng.uniform(0.14, 0.22)
    stick = tube([(0, 0, 0.1), (0, 0, high)], 0.012, _look(rng, "wood", "plastic", "metal"), 6)
    head = box((-0.025, -wide, 0.08), (0.025, wide, 0.12), _look(rng, "wood", "plastic"))
    hair = box((-0.035, -1.05 * wide, 0), (0.035, 1.05 * wide, 0.08), _look(rng, "fabric", "black", "plastic"))
    return joined([stick, head, hair])


def _knives(rng: np.random.Generator) -> Mesh:
    look, black = _look(rng, "wood", "wood", "plastic", "black", "metal"), _look(rng, "black", "metal", "wood")
    body = box((-0.05, -0.06, 0), (0.05, 0.06, 0.2), look)
    grips = [box((x - 0.012, y - 0.008, 0.2), (x + 0.012, y + 0.008, 0.2 + rng.uniform(0.08, 0.12)), black)
             for x in (-0.025, 0.02) for y in (-0.04, 0.0, 0.04) if rng.random() < 0.85]  # fmt: skip
    return joined([body, *grips]).tilted("y", rng.uniform(-0.4, 0.0)).standing()


def _pills(rng: np.random.Generator) -> Mesh:
    wide, deep = rng.uniform(0.09, 0.14), rng.uniform(0.02, 0.035)
    body = box((-deep, -wide / 2, 0), (deep, wide / 2, rng.uniform(0.015, 0.06)), _look(rng, "white", "paper"))
    top = float(body.high[2])
    strip = box(
        (-deep - 0.001, -wide / 2 - 0.001, 0.3 * top), (deep + 0.001, 0.1 * wide, 0.6 * top), _look(rng, "plastic")
    )
    return joined([body, strip])


def _stick_blender(rng: np.random.Generator) -> Mesh:
    grey, look = _look(rng, "black", "metal", "plastic", "white"), _look(rng, "glass", "plastic")
    base = lathe([(0.09, 0), (0.085, 0.06), (0.06, 0.16)], grey)
    glass = lathe([(0.055, 0.16), (0.075, 0.36), (0.07, 0.36), (0.05, 0.17)], look)
    lid = cylinder(0, 0, 0.36, 0.072, 0.03, _look(rng, "black", "plastic"))
    return joined([base, glass, lid])


def _bat(rng: np.random.Generator) -> Mesh:
    deep, long = 0.012, rng.uniform(0.1, 0.14)
    ring = [(0.17 * np.cos(a) + 0.3, 0.125 * np.sin(a), deep) for a in np.linspace(0, 2 * np.pi, 17)[:-1]]
    frame = tube(ring, 0.01, _look(rng, "plastic", "metal", "painted"), 6, closed=True)
    net = lathe([(0.12, deep - 0.001), (0.12, deep + 0.001)], _look(rng, "white", "fabric"), squash=1.0)
    grip = tube([(-long - 0.1, 0, deep), (0.13, 0, deep)], 0.014, _look(rng, "black", "leather", "plastic"), 6)
    return joined([frame, net.scaled(1.4, 1.02, 1.0).moved(0.3), grip]).standing()


_RULES: dict[str, tuple[Callable[[np.random.Generator], Mesh], ...]] = {
    "computer mouse": (_mouse_round, _mouse_flat, _mouse_wired),
    "remote control": (_remote_flat, _remote_round),
    "mobile phone": (_phone_plain, _phone_old, _phone_on_its_face),
    "tablet": (_tablet_plain, _tablet_propped, _tablet_cased), "key": (_key_ring, _car_key),
    "pan": (_pan, _wok, _saucepan), "chopping board": (_board, _board_with_grip), "jug": (_jug,),
    "drinking glass": (_tumbler, _wine_glass), "can": (_can,), "soap": (_soap_bar,), "toilet paper": (_paper_roll,),
    "fire extinguisher": (_extinguisher,), "power socket": (_socket,), "light switch": (_switch, _switch_with_lever),
    "smoke detector": (_detector,), "suitcase": (_trolley, _lying_case), "backpack": (_rucksack,),
    "hat": (_cap, _brimmed_hat), "umbrella": (_closed_umbrella, _small_umbrella), "headphones": (_headset,),
    "flashlight": (_torch,), "games console": (_pad, _console), "camera": (_compact,), "broom": (_broom,),
    "knife block": (_knives,), "medicine": (_pills,), "blender": (_stick_blender,), "racket": (_bat,),
}  # fmt: skip
ON_WALL = frozenset({"power socket", "light switch", "smoke detector"})
