"""Models of small things by other hands, and simple shapes for the kinds of which there are few.

A folder holds the models as ``KIND__MAKER_NAME.glb``; `_NAMES` and `_KINDS` say which of them are which category;
the shapes are the rows of ``shapes.csv``.
"""

import csv
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, partial
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
    "clamp": "tool", **dict.fromkeys((
        "ashtray", "book holder", "brick", "glue", "letter tray", "padlock", "pen holder", "plate holder", "soap dish",
        "sponge", "toothpaste", "watch", "wood block", "kitchen appliance"), "other"),
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
_FLAT = frozenset({"mobile phone", "tablet", "book", "remote control", "paper", "umbrella"})
_UPRIGHT = frozenset({"bottle"})
ON_WALL = frozenset({"power socket", "light switch", "smoke detector"})
_ON_WALLS = ("cuckooclock", "hanging_clothes", "blendswap_suit", "toiletpaperdispenser", "bathroom_tissue",
             "knifestandswap", "blendswap_towel")  # fmt: skip
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


@cache
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
            on_wall = any(name in path.name for name in _ON_WALLS) or category in ON_WALL
            things.setdefault(category, []).append(Thing(category, path.stem, _drawer(path, category), on_wall))
    if not things:
        raise FileNotFoundError(f"{folder} holds no models of things; give the folder of the .glb files")
    with (Path(__file__).parent / "shapes.csv").open(newline="", encoding="utf-8") as stream:
        for number, (category, spread, row) in enumerate(list(csv.reader(stream))[1:]):
            rule = partial(shaped, float(spread), row)
            things.setdefault(category, []).append(Thing(category, f"shape {number}", rule, category in ON_WALL))
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
        if category in (*_FLAT, *_UPRIGHT) and (category != "book" or rng.random() < 0.7):
            mesh = _laid(mesh, least=category in _FLAT)
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


# Colours of simple shapes beside what ``material`` draws.
_COLOURS = {"red": ("painted", (0.75, 0.06, 0.06)), "pale": ("paper", (0.95, 0.95, 0.94)),
            "grey": ("white", (0.75, 0.75, 0.74)), "steel": ("metal", (0.75, 0.75, 0.76))}  # fmt: skip


def shaped(spread: float, row: str, rng: np.random.Generator) -> Mesh:
    """Return a simple shape, its front along +x.

    Args:
        spread: how far its width, depth and height may differ, as a share.
        row: its parts, numbers in centimetres, each after what it may be made of; parts of one word for that look
            alike. With a 2 before its name a part comes with its mirror image in y. ``box`` and ``soft`` (a radius
            first) have two corners; ``ball`` a middle and radii, and is flat below 0; ``turn`` radius and height along
            a profile; ``can`` a foot, radius and height; ``rod`` a radius and places; ``ring`` a radius, a middle and
            radii; ``grid`` rows, columns, half sizes, a height, and the first and the last middle. ``tip`` turns all
            so far: axis, least and greatest angle, how often.
        rng: of all that is drawn.
    """
    looks: dict[str, Material] = {}
    made: list[Mesh] = []
    for part in row.split("; "):
        kind, of, *numbers = part.split()
        n = [float(each) / 100.0 for each in numbers]
        if kind == "tip":
            if rng.random() < 100.0 * n[2]:
                made = [joined(made).tilted(of, np.deg2rad(100.0 * rng.uniform(n[0], n[1]))).standing()]
            continue
        if of not in looks:
            of_kind, colour = _COLOURS.get(of, (str(rng.choice(of.split(","))), None))
            looks[of] = material(of_kind, rng, colour)
        made += _made(kind.removeprefix("2"), n, looks[of])
        if kind.startswith("2"):
            for k in {"2box": (1, 4), "2rod": range(2, len(n), 3)}.get(kind, (1,)):
                n[k] = -n[k]
            if kind == "2box":
                n[1], n[4] = n[4], n[1]
            made += _made(kind[1:], n, looks[of])
    x, y, z = (float(each) for each in 1.0 + spread * rng.uniform(-1.0, 1.0, 3))
    return joined(made).scaled(x, x if "turn " in row else y, z).standing()


def _made(kind: str, n: list[float], look: Material) -> list[Mesh]:
    a, b, c, *rest = n
    match kind:
        case "box":
            return [box((a, b, c), (rest[0], rest[1], rest[2]), look)]
        case "soft":
            return [rounded_box((b, c, rest[0]), (rest[1], rest[2], rest[3]), a, look)]
        case "ball":
            mesh = ellipsoid((a, b, c), (rest[0], rest[1], rest[2]), look, 12, 6)
            return [replace(mesh, vertex=np.maximum(mesh.vertex, np.array([-np.inf, -np.inf, 0.0], np.float32)))]
        case "can":
            return [cylinder(a, b, c, rest[0], rest[1], look, 12)]
        case "turn":
            return [lathe(list(zip(n[::2], n[1::2], strict=True)), look)]
        case "rod":
            return [tube(list(zip(n[1::3], n[2::3], n[3::3], strict=True)), a, look, 6)]
        case "ring":
            turn = np.linspace(0, 2 * np.pi, 17)[:-1]
            places = [(b + rest[1] * float(x), c + rest[2] * float(y), rest[0])
                      for x, y in zip(np.cos(turn), np.sin(turn), strict=True)]  # fmt: skip
            return [tube(places, a, look, 5, closed=True)]
        case _:
            dx, dy, high, x0, y0, z, x1, y1 = c, *rest
            return [box((x - dx, y - dy, z), (x + dx, y + dy, z + high), look)
                    for x in np.linspace(x0, x1, round(100 * a)).tolist()
                    for y in np.linspace(y0, y1, round(100 * b)).tolist()]  # fmt: skip
