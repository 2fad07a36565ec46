"""Small things that lie about in homes, and cameras that look at them from near.

They are models by other hands (``models.py``), each kind as often as another, on tops, in sinks, on floors, on walls.
A place is found in the finished scene: flat surfaces of what stands there, and how high it is free above each.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
from numba import njit
from scipy import ndimage
from training.pixels.models import Thing, small_things

from avlmaps.core.camera import Pinhole
from avlmaps_sim.free_space import floor_heights, free_space
from avlmaps_sim.furniture.catalogue import Families
from avlmaps_sim.grid_kernels import mark_slab
from avlmaps_sim.mesh import Mesh
from avlmaps_sim.scene import Area, Scene, SceneBuilder, SceneObject
from avlmaps_sim.views import camera_poses

FAMILY = "thing"  # the family of what is placed here begins so
# Where things lie: the sort of each category that carries them.
_TOPS = {
    "kitchen counter": "counter", "kitchen island": "counter", "stove": "stove", "sink": "sink",
    "dining table": "table", "coffee table": "table", "side table": "table", "console table": "table",
    "desk": "desk", "nightstand": "shelf", "bookshelf": "shelf", "wall shelf": "shelf", "cabinet": "shelf",
    "tv cabinet": "shelf", "chest of drawers": "shelf", "filing cabinet": "shelf", "shoe rack": "shelf",
    "kitchen cabinet": "shelf", "piano": "shelf", "fireplace": "shelf", "locker": "shelf", "wardrobe": "shelf",
    "washing machine": "bath", "bathtub": "bath", "toilet": "bath", "radiator": "bath", "refrigerator": "shelf",
    "bed": "soft", "bunk bed": "soft", "sofa": "soft", "armchair": "soft", "ottoman": "soft", "bench": "soft",
    "chair": "soft", "stool": "soft", "office chair": "soft",
}  # fmt: skip
_SHARE = {"counter": 2.5, "table": 2.0, "desk": 2.0, "shelf": 0.7, "bath": 0.5, "soft": 0.4, "sink": 1.0, "stove": 0.5}
# Where each category lies, in thirds of its chance; the rest is anywhere but on stoves and in sinks.
_KITCHEN, _DESK = ("counter", "counter", "table"), ("desk", "table", "shelf")
_WHERE: dict[str, tuple[str, ...]] = {
    **dict.fromkeys(("cup", "bowl", "drinking glass", "tableware", "cutlery"), ("counter", "table", "sink")),
    "plate": ("counter", "table", "table", "sink"), "pan": ("stove", "counter", "sink"),
    "pot": ("stove", "counter", "counter"), "kettle": ("stove", "counter", "counter"),
    **dict.fromkeys(("can", "food", "fruit", "jug", "chopping board", "knife block", "blender", "toaster", "microwave",
                     "coffee machine", "bottle"), _KITCHEN),
    **dict.fromkeys(("mobile phone", "tablet", "camera", "pen", "stapler", "scissors", "laptop", "telephone",
                     "headphones", "paper"), _DESK),
    "computer mouse": ("desk",), "remote control": ("table", "soft", "shelf"), "games console": ("shelf", "table"),
    "key": ("table", "shelf", "counter"), "eyeglasses": ("table", "shelf", "desk"), "book": ("table", "shelf", "soft"),
    **dict.fromkeys(("soap", "medicine", "brush", "towel"), ("bath", "bath", "shelf", "counter")),
    "toilet paper": ("bath", "bath", "floor"), "hat": ("shelf", "soft", "table"), "clothing": ("soft", "soft", "floor"),
    "bag": ("floor", "soft", "table"), "backpack": ("floor", "floor", "soft"), "suitcase": ("floor",),
    "umbrella": ("floor", "floor", "shelf"), "shoes": ("floor",), "broom": ("floor",), "fire extinguisher": ("floor",),
    "trash can": ("floor",), "rocking horse": ("floor",), "basket": ("floor",), "racket": ("floor", "soft", "shelf"),
    "ball": ("floor", "floor", "soft"), "toy": ("floor", "soft", "table", "shelf"), "box": ("floor", "table", "shelf"),
    "tool": ("table", "floor", "shelf"), "flashlight": ("shelf", "table"), "fan": ("floor", "table", "desk"),
}  # fmt: skip
# What lies together where it is untidy.
_CLUMPS = {
    "counter": ("plate, cup, bowl, drinking glass, can, food, fruit, cutlery, pan, jug, chopping board, knife block, "
                "bottle, kettle, toaster, blender, coffee machine, pot, box, soap, tableware, microwave"),
    "table": ("plate, cup, bowl, drinking glass, can, food, fruit, cutlery, jug, bottle, key, eyeglasses, mobile "
              "phone, remote control, book, tablet, paper, medicine, candle, toy, bag, camera, scissors"),
    "desk": ("computer mouse, mobile phone, tablet, pen, stapler, scissors, headphones, camera, cup, can, book, "
             "eyeglasses, paper, drinking glass, games console, remote control, key, laptop, telephone, bottle, "
             "tool"),
    "shelf": ("book, vase, box, clock, camera, hat, headphones, flashlight, toy, plant, basket, games console, "
              "medicine, candle, loudspeaker, bag"),
    "bath": "soap, medicine, toilet paper, brush, bottle, towel, cup",
    "soft": ("clothing, bag, book, remote control, toy, hat, tablet, headphones, towel, mobile phone, games "
             "console, backpack"),
    "sink": "plate, cup, bowl, drinking glass, cutlery, pan, pot, jug",
    "floor": "box, bag, backpack, suitcase, shoes, toy, ball, basket, box, bag, clothing, tool, umbrella",
}  # fmt: skip
_RARE = frozenset({"rocking horse", "other", "trash can", "plant"})  # homes hold many already, or one model is all
# Families of the simulator's own shapes that are of a category which homes do not know, as training worlds call them.
_FAMILIES = {
    ("bag", "backpack"): "backpack", ("bag", "suitcase"): "suitcase", ("telephone", "mobile"): "mobile phone",
    ("pot", "frying pan"): "pan", ("cup", "wine glass"): "drinking glass", ("cup", "tumbler"): "drinking glass",
    ("tableware", "stack of plates"): "plate", ("tableware", "cutlery jar"): "cutlery",
}  # fmt: skip
_STACKED = frozenset({"plate", "book", "box", "bowl", "paper", "chopping board"})
_CELL_M, _FLOOR_CELL_M = 0.015, 0.03
_BANDS_M = (0.008, 0.05, 0.1, 0.18, 0.28, 0.4, 0.6, 0.9, 1.3)  # heights at which it may be free over a surface
_ROUGH_M = {"soft": 0.05, "floor": 0.03}
# Heights of the middle of what hangs on walls.
_HUNG_M = {"power socket": (0.3, 0.3, 0.3, 1.15), "light switch": (1.1,), "toilet paper": (0.7,),
           "fire extinguisher": (1.0,)}  # fmt: skip
_UP = np.array([0.0, 0.0, 1.0])
_PIXELS_ACROSS = 24  # how large a thing should be at least in a view of it
_FLAT, _SMALLEST_M2, _MOST_LEVELS = 0.93, 0.015, 6


@njit(cache=True)
def _tops(corners, origin, cell_m, grid):  # pragma: no cover - compiled
    """Raise every cell of a grid to the highest triangle over its middle."""
    nx, ny = grid.shape
    for t in range(corners.shape[0]):
        ax, ay, az = corners[t, 0, 0], corners[t, 0, 1], corners[t, 0, 2]
        bx, by, bz = corners[t, 1, 0] - ax, corners[t, 1, 1] - ay, corners[t, 1, 2] - az
        cx, cy, cz = corners[t, 2, 0] - ax, corners[t, 2, 1] - ay, corners[t, 2, 2] - az
        area = bx * cy - by * cx
        if abs(area) < 1e-12:
            continue
        i_low = max(int((ax + min(0.0, bx, cx) - origin[0]) / cell_m - 0.5), 0)
        i_high = min(int((ax + max(0.0, bx, cx) - origin[0]) / cell_m + 0.5), nx - 1)
        j_low = max(int((ay + min(0.0, by, cy) - origin[1]) / cell_m - 0.5), 0)
        j_high = min(int((ay + max(0.0, by, cy) - origin[1]) / cell_m + 0.5), ny - 1)
        for i in range(i_low, i_high + 1):
            for j in range(j_low, j_high + 1):
                x, y = origin[0] + (i + 0.5) * cell_m - ax, origin[1] + (j + 0.5) * cell_m - ay
                u, v = (x * cy - y * cx) / area, (bx * y - by * x) / area
                if u >= -1e-6 and v >= -1e-6 and u + v <= 1.000001:
                    grid[i, j] = max(grid[i, j], az + u * bz + v * cz)


@njit(cache=True)
def _reach(corners, instance, start, way, but):  # pragma: no cover - compiled
    """Return at which share of a way the first triangle lies, those of one instance left out; 2 where none does."""
    best = 2.0
    low, high = np.empty(3), np.empty(3)
    for k in range(3):
        low[k], high[k] = min(start[k], start[k] + way[k]), max(start[k], start[k] + way[k])
    for t in range(corners.shape[0]):
        if instance[t] == but:
            continue
        apart = False
        for k in range(3):
            p, q, r = corners[t, 0, k], corners[t, 1, k], corners[t, 2, k]
            if max(p, q, r) < low[k] or min(p, q, r) > high[k]:
                apart = True
                break
        if apart:
            continue
        a = corners[t, 0]
        e, f = corners[t, 1] - a, corners[t, 2] - a
        p0, p1, p2 = way[1] * f[2] - way[2] * f[1], way[2] * f[0] - way[0] * f[2], way[0] * f[1] - way[1] * f[0]
        d = e[0] * p0 + e[1] * p1 + e[2] * p2
        if abs(d) < 1e-15:
            continue
        s = start - a
        u = (s[0] * p0 + s[1] * p1 + s[2] * p2) / d
        q0, q1, q2 = s[1] * e[2] - s[2] * e[1], s[2] * e[0] - s[0] * e[2], s[0] * e[1] - s[1] * e[0]
        v = (way[0] * q0 + way[1] * q1 + way[2] * q2) / d
        share = (f[0] * q0 + f[1] * q1 + f[2] * q2) / d
        if u >= 0.0 and v >= 0.0 and u + v <= 1.0 and 0.0 <= share < best:
            best = share
    return best


@dataclass(eq=False)
class _Level:
    """One flat surface as a grid: how high it is, and how much is free above."""

    sort: str
    origin: np.ndarray
    cell_m: float
    height_m: np.ndarray  # (nx, ny), -inf where nothing carries
    free_m: np.ndarray  # (nx, ny), 0 where something stands
    rough_m: float

    def __post_init__(self) -> None:
        self.carries = np.isfinite(self.height_m)
        good = self.carries & (self.free_m > 0.08)
        apart = cv2.distanceTransform(np.pad(good, 1).astype(np.uint8), cv2.DIST_L2, 3)[1:-1, 1:-1] * self.cell_m
        # Things on a floor are rather beside walls and furniture.
        self.liked = np.exp(-np.maximum(apart - 0.1, 0.0) / 0.12) + 0.02 if self.sort == "floor" else good + 0.05

    @property
    def weight(self) -> float:
        """How often something is put on it, among those of its sort."""
        area = np.count_nonzero(self.carries & (self.free_m > 0.08)) * self.cell_m**2
        return _SHARE.get(self.sort, 1.0) * min(area, 1.5) ** 0.7 if area > 0.006 else 0.0

    def set_down(
        self, size: np.ndarray, rng: np.random.Generator, near: np.ndarray | None = None
    ) -> tuple[float, np.ndarray] | None:
        """Return a turn and a place where a thing of this size meets nothing; None where there is none."""
        good = self.carries & (self.free_m > size[2] + 0.005)
        i, j = np.nonzero(good)
        if not len(i):
            return None
        weight = self.liked[i, j]
        if near is not None:
            away = self.origin + (np.column_stack([i, j]) + 0.5) * self.cell_m - near[:2]
            weight = weight * (np.exp(-np.hypot(*away.T) / 0.2) + 1e-6)
        total = np.cumsum(weight)
        for pick in np.minimum(np.searchsorted(total, rng.uniform(0, total[-1], 14)), len(i) - 1):
            turn = rng.uniform(-np.pi, np.pi)
            xy = self.origin + (np.array([i[pick], j[pick]]) + rng.uniform(0, 1, 2)) * self.cell_m
            cells = self._under(xy, float(size[0]), float(size[1]), turn)
            if cells is None or not good[cells].all() or np.ptp(self.height_m[cells]) > self.rough_m:
                continue
            self.free_m[cells] = 0.0
            under = self.height_m[cells]
            z = float(under.max() if self.rough_m < 0.04 else np.quantile(under, 0.7))
            return turn, np.array([*xy, z + 0.001])
        return None

    def _under(self, xy: np.ndarray, wide: float, deep: float, turn: float) -> tuple[np.ndarray, np.ndarray] | None:
        steps = [np.linspace(-0.5, 0.5, int(np.ceil(s / self.cell_m * 1.3)) + 2) * s for s in (wide, deep)]
        x, y = (grid.ravel() for grid in np.meshgrid(*steps))
        c, s = np.cos(turn), np.sin(turn)
        at = (xy + np.column_stack([c * x - s * y, s * x + c * y]) - self.origin) / self.cell_m
        cell = np.floor(at).astype(int)
        if (cell < 0).any() or (cell >= self.free_m.shape).any():
            return None
        return cell[:, 0], cell[:, 1]


class _Placed:
    """A scene with things on it."""

    def __init__(self, scene: Scene, rng: np.random.Generator, things: dict[str, list[Thing]]) -> None:
        self.scene, self.rng, self.things = scene, rng, things
        self.builder = SceneBuilder.of(scene)
        self.builder.objects = [
            replace(t, category=_FAMILIES.get((t.category, t.family), t.category)) for t in scene.objects
        ]
        self.corners = scene.mesh.corners().astype(np.float64)
        self.lows, self.highs = self.corners.min(axis=1), self.corners.max(axis=1)
        flat = np.abs(scene.mesh.normals()[:, 2]) > _FLAT
        self.levels: dict[str, list[_Level]] = {}
        order = np.argsort(scene.instance, kind="stable")
        ends = np.searchsorted(scene.instance[order], np.arange(len(scene.objects) + 1))
        for number, thing in enumerate(scene.objects):
            if thing.category in _TOPS:
                its = order[ends[number] : ends[number + 1]]
                self._tops_of(thing, its[flat[its]], _TOPS[thing.category])
        grounds = np.isin([t.category for t in scene.objects], ("floor", "carpet", "mat"))[scene.instance] & flat
        for area in scene.areas:
            self._floor_of(area, grounds)

    def _near(self, low: np.ndarray, high: np.ndarray) -> np.ndarray:
        """Return the triangles that may have a point in a box."""
        return self.corners[((self.lows <= high) & (self.highs >= low)).all(axis=1)]

    def _tops_of(self, thing: SceneObject, triangles: np.ndarray, sort: str) -> None:
        corners = self.corners[triangles]
        z = corners[..., 2].mean(axis=1)
        edge = corners[:, 1:, :2] - corners[:, :1, :2]
        area = np.abs(edge[:, 0, 0] * edge[:, 1, 1] - edge[:, 0, 1] * edge[:, 1, 0]) / 2
        rough = _ROUGH_M.get(sort, 0.012)
        left = (z - thing.low[2] < 1.7) & ((sort != "sink") | (z < thing.high[2] - 0.05))
        for _ in range(_MOST_LEVELS):
            if area[left].sum() < _SMALLEST_M2:
                return
            # The window of heights with most surface.
            order = np.flatnonzero(left)[np.argsort(z[left])]
            total = np.concatenate([[0.0], np.cumsum(area[order])])
            end = np.searchsorted(z[order], z[order] + rough, side="right")
            begin = int(np.argmax(total[end] - total[:-1]))
            its = order[begin : end[begin]]
            left[its] = False
            if area[its].sum() >= _SMALLEST_M2:
                self._level(corners[its], sort, rough)

    def _level(self, corners: np.ndarray, sort: str, rough_m: float) -> None:
        pad = 0.12
        low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
        origin = low[:2] - pad
        shape = tuple(int(n) for n in np.ceil((high[:2] + pad - origin) / _CELL_M))
        if max(shape) > 600:
            return
        level = self._grid(corners, sort, origin, shape, _CELL_M, float(high[2]), rough_m)
        if sort != "sink":  # nothing lies inside what is closed
            open_at = np.pad(level.free_m >= 0.05, 1, constant_values=True)
            label, _ = ndimage.label(open_at)  # type: ignore[misc]
            level.free_m[label[1:-1, 1:-1] != label[0, 0]] = 0.0
        if level.weight > 0:
            self.levels.setdefault(sort, []).append(level)

    def _grid(
        self, corners: np.ndarray, sort: str, origin: np.ndarray, shape: tuple[int, ...], cell_m: float, top_m: float,
        rough_m: float,
    ) -> _Level:  # fmt: skip
        height = np.full(shape, -np.inf)
        _tops(corners, origin, cell_m, height)
        end = origin + np.array(shape) * cell_m
        around = self._near(np.array([*origin, top_m]), np.array([*end, top_m + _BANDS_M[-1]]))
        free = np.full(shape, _BANDS_M[-1])
        for below, above in reversed(list(pairwise(_BANDS_M))):
            taken = np.zeros(shape, np.bool_)
            mark_slab(around, top_m + below, top_m + above, origin, cell_m, taken)
            free[taken] = below if below > _BANDS_M[0] else 0.0
        return _Level(sort, origin, cell_m, height, free, rough_m)

    def _floor_of(self, area: Area, grounds: np.ndarray) -> None:
        low, high = area.polygon.min(axis=0), area.polygon.max(axis=0)
        shape = tuple(int(n) for n in np.ceil((high - low) / _FLOOR_CELL_M))
        at = np.flatnonzero(grounds)
        z = self.corners[at, :, 2].mean(axis=1)
        at = at[np.abs(z - area.floor_m) < 0.05]
        level = self._grid(self.corners[at], "floor", low, shape, _FLOOR_CELL_M, area.floor_m + 0.02, 0.03)
        middles = low + (np.moveaxis(np.indices(shape), 0, -1) + 0.5) * _FLOOR_CELL_M
        level.carries &= area.contains(middles)
        self.levels.setdefault("floor", []).append(level)

    def draw(self, category: str) -> tuple[Thing, Mesh]:
        choice = self.things[category]
        thing = choice[int(self.rng.integers(len(choice)))]
        return thing, thing.make(self.rng).standing()

    def add(self, thing: Thing, mesh: Mesh) -> None:
        self.builder.add(thing.category, mesh, family=f"{FAMILY} {thing.name}")

    def level(self, sort: str) -> _Level | None:
        levels = self.levels.get(sort, [])
        weight = np.array([level.weight for level in levels])
        return levels[int(self.rng.choice(len(levels), p=weight / weight.sum()))] if weight.sum() > 0 else None

    def any_level(self) -> _Level | None:
        sorts = [sort for sort in self.levels if sort not in ("sink", "stove")]
        weight = np.array([sum(each.weight for each in self.levels[s]) * (0.1 if s == "floor" else 1.0) for s in sorts])
        return self.level(sorts[int(self.rng.choice(len(sorts), p=weight / weight.sum()))]) if weight.sum() else None

    def one(self, category: str) -> None:
        """Put one thing of a category where such things are."""
        rng = self.rng
        if category in _RARE and rng.random() < 0.7:
            return
        thing, mesh = self.draw(category)
        if thing.on_wall or (category in ("fire extinguisher", "clock", "towel") and rng.random() < 0.25):
            self.fix(thing, mesh)
            return
        if category == "broom" and mesh.size[2] > 1.0:
            self.fix(thing, mesh, leaning=True)
            return
        where = _WHERE.get(category, ())
        for _ in range(3):
            sort = where[int(rng.integers(len(where)))] if where and rng.random() < 0.85 else ""
            if float(mesh.size[:2].max()) > 0.7 or float(mesh.size[2]) > 0.6:
                sort = "floor"
            level = self.level(sort) if sort else self.any_level()
            if level is not None and self.put(thing, mesh, level) is not None:
                return

    def put(self, thing: Thing, mesh: Mesh, level: _Level, near: np.ndarray | None = None) -> np.ndarray | None:
        """Set one thing or a pile of such down, and return where."""
        rng, pile, nests = self.rng, [mesh], thing.category in ("plate", "bowl")
        while thing.category in _STACKED and rng.random() < 0.35 and len(pile) < 6:
            below = pile[-1]
            other = self.draw(thing.category)[1] if thing.category in ("book", "box") else mesh
            if np.any(np.sort(other.size[:2]) > np.sort(below.size[:2]) * 1.05) or np.ptp(below.size) < 0.02:
                break
            z = float(below.low[2] + 0.35 * other.size[2] if nests else below.high[2])
            square = rng.choice([0.0, np.pi / 2, np.pi]) if other.size[0] < mesh.size[1] * 1.1 else rng.normal(0, 0.06)
            pile.append(other.turned(square).moved(z=z + 0.001))
        while True:
            half = np.max([np.maximum(-each.low, each.high) for each in pile], axis=0)
            if done := level.set_down(half * (2, 2, 1), rng, near):
                break
            if len(pile) == 1:
                return None
            pile = pile[:1]
        turn, at = done
        for each in pile:
            self.add(thing, each.turned(turn).moved(*map(float, at)))
        return at

    def clump(self, sort: str) -> None:
        """Put several things close together, as where it is untidy."""
        level = self.level(sort)
        if level is None:
            return
        names = [name for name in _CLUMPS[sort].split(", ") if name in self.things]
        near = None
        for _ in range(int(self.rng.integers(3, 8)) if sort in ("sink", "bath") else int(self.rng.integers(5, 14))):
            thing, mesh = self.draw(names[int(self.rng.integers(len(names)))])
            if not thing.on_wall:
                at = self.put(thing, mesh, level, near)
                near = at if near is None else near

    def fix(self, thing: Thing, mesh: Mesh, leaning: bool = False) -> None:
        """Fix a thing to a wall or a ceiling, or lean it on a wall."""
        rng, areas, on_ceiling = self.rng, self.scene.areas, thing.category == "smoke detector"
        doors = [each for each in self.scene.objects if each.category in ("door", "folding door")]
        if leaning:
            mesh = mesh.tilted("y", -rng.uniform(0.06, 0.22)).standing()
        elif on_ceiling:
            mesh = mesh.tilted("y", np.pi / 2)
        for attempt in range(12):
            area = areas[int(rng.integers(len(areas)))]
            edge = np.roll(area.polygon, -1, axis=0) - area.polygon
            length = np.linalg.norm(edge, axis=1)
            number = int(rng.choice(len(length), p=length / length.sum()))
            along = edge[number] / max(length[number], 1e-6)
            away, turned = np.array([-along[1], along[0], 0.0]), mesh
            if on_ceiling:
                xy, z, away = rng.uniform(area.polygon.min(axis=0), area.polygon.max(axis=0)), area.ceiling_m, -_UP
                if not area.contains(xy):
                    continue
            else:
                xy = area.polygon[number] + along * rng.uniform(0.0, length[number])
                turned = mesh.turned(float(np.arctan2(away[1], away[0])))
                z = area.floor_m + (mesh.size[2] / 2 if leaning else _hung_at(thing.category, mesh.size[2], rng))
            if thing.category == "light switch" and doors and attempt < 9:
                beside = [np.maximum(np.maximum(d.low[:2] - xy, xy - np.array(d.high[:2])), 0) for d in doors]
                if not 0.08 < min(float(np.hypot(*each)) for each in beside) < 0.4:
                    continue
            if self._fixed(thing, turned, np.array([*xy, z]), away, 0.04 if leaning else 0.004):
                return

    def _fixed(self, thing: Thing, mesh: Mesh, place: np.ndarray, away: np.ndarray, rough_m: float) -> bool:
        """Fix a mesh to the surface behind a place, where it lies flat against it and nothing is before it."""
        half = (mesh.high - mesh.low) / 2
        deep = float(np.abs(away) @ (2 * half))
        start = deep + 0.15
        near = self._near(place - 0.6 - half, place + 0.6 + half)
        across = np.eye(3)[:2] if abs(away[2]) > 0.7 else np.stack([np.array([-away[1], away[0], 0.0]), _UP])
        extent = np.abs(across) @ half
        nobody = np.zeros(len(near), np.int32)
        hits = [
            2
            * start
            * _reach(near, nobody, place + away * start + np.array(side) * extent @ across, -2 * start * away, -1)
            for side in ((0, 0), (1, 1), (1, -1), (-1, 1), (-1, -1))
        ]
        if np.ptp(hits) > rough_m or not deep + 0.005 < min(hits) < start + 0.15:
            return False
        at = place + away * (start - min(hits) + deep / 2 + 0.001) - (mesh.low + mesh.high) / 2
        placed = mesh.moved(*map(float, at))
        low, high = placed.low - 0.02, placed.high + 0.02
        if any(np.all((low <= it.high) & (high >= it.low)) for it in self.builder.objects[len(self.scene.objects) :]):
            return False
        self.add(thing, placed)
        return True


def _hung_at(category: str, high: float, rng: np.random.Generator) -> float:
    """Return the height of the middle over the floor."""
    if category in _HUNG_M:
        return float(rng.choice(_HUNG_M[category])) + rng.normal(0, 0.05)
    return max(rng.uniform(1.3, 1.8) - high / 4, 0.1 + high / 2)


def with_things(scene: Scene, folder: Path, rng: np.random.Generator, which: Families) -> Scene:
    """Return the scene with some 60 to 120 small things in it, each kind about as often as another.

    Args:
        scene: a finished home or office.
        folder: the models (``models.py``).
        rng: what is where.
        which: the models that the network learns from, those that it never sees, or all.
    """
    things = small_things(folder, which)
    placed = _Placed(scene, rng, things)
    for sort, mean in (("counter", 1.6), ("table", 1.0), ("desk", 0.8), ("floor", 0.6), ("sink", 0.7), ("shelf", 0.5),
                       ("soft", 0.3), ("bath", 0.4)):  # fmt: skip
        for _ in range(int(rng.poisson(mean)) if sort in placed.levels else 0):
            placed.clump(sort)
    names = sorted(things)
    for name in [*rng.permutation(names), *rng.permutation(names)][: int(rng.integers(55, 105))]:
        placed.one(str(name))
    return placed.builder.build()


def views_of_things(
    scene: Scene, rng: np.random.Generator, camera: Pinhole, heights_m: Sequence[tuple[float, float]]
) -> np.ndarray:
    """Return poses of cameras that look at a placed thing in sight, from 0.45 to 2.0 m.

    Args:
        scene: a home with things.
        rng: which of them, each kind as often as another, and from where.
        camera: one like those that will look.
        heights_m: for each pose the least and the greatest height over the floor.
    """
    kinds: dict[str, list[int]] = {}
    for number, thing in enumerate(scene.objects):
        if thing.family.startswith(FAMILY):
            kinds.setdefault(thing.category, []).append(number)
    floors = floor_heights(scene)
    spaces = [free_space(scene, 0.15, 1.9, floor=k).middles() for k in range(len(floors))]
    corners = scene.mesh.corners().astype(np.float64)
    names, half_field = sorted(kinds), np.arctan(0.5 * np.array([camera.width / camera.fx, camera.height / camera.fy]))
    poses: list[np.ndarray] = []
    for _ in range(25 * len(heights_m) if names else 0):
        if len(poses) == len(heights_m):
            break
        its = kinds[names[int(rng.integers(len(names)))]]
        number = its[int(rng.integers(len(its)))]
        target = np.array(scene.objects[number].centre)
        floor = int(np.argmin([abs(target[2] - f - 1.0) for f in floors]))
        eye_z = floors[floor] + rng.uniform(*heights_m[len(poses)])
        middles = spaces[floor]
        apart = np.linalg.norm(np.column_stack([middles, np.full(len(middles), eye_z)]) - target, axis=1)
        pitch = np.arcsin(np.clip((target[2] - eye_z) / np.maximum(apart, 0.1), -1, 1))
        # Small things from nearer, so that they fill enough pixels.
        across = np.sqrt(np.prod(np.sort(scene.objects[number].size)[1:]))
        far = float(np.clip(camera.fx * across / _PIXELS_ACROSS, 0.7, 2.0))
        near = 0.45 if far < 1.0 else 0.6
        good = np.flatnonzero((apart > near) & (apart < far) & (pitch > -1.1) & (pitch < 0.8))
        if not len(good):
            continue
        for pick in good[rng.integers(len(good), size=3)]:
            eye = np.array([*middles[pick], eye_z])
            if _reach(corners, scene.instance, eye, target - eye, number) > 1.0:
                heading = np.arctan2(*(target - eye)[1::-1]) + rng.uniform(-0.4, 0.4) * half_field[0]
                raised = pitch[pick] + rng.uniform(-0.4, 0.4) * half_field[1]
                roll = np.deg2rad(np.clip(rng.normal(0, 3.0), -9, 9))
                poses.append(camera_poses(eye[None], *(np.array([v]) for v in (heading, raised, roll)))[0])
                break
    return np.array(poses).reshape(-1, 4, 4)
