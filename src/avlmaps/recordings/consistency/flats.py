"""Flat surfaces within single frames: floors, walls, tables, and how far each is curved as behind a wide lens.

Where x and y are a pixel's place in focal lengths, a plane has 1/z = a·x + b·y + c, and (a, b, c) is its normal. Behind
a lens that draws things nearer to the middle, x and y are 1 + s·r² times what a pinhole's numbers say, r² = x² + y²: of
1/z is left s·r²·(a·x + b·y).

Whether depth is off by the same length everywhere: then flat surfaces are curved within every frame.

On a plane 1/z changes evenly over the picture, 1/z = L(u, v). Where d is added to every depth, 1/z' is about L - d·L²:
what of 1/z' is left over beside an even change shows d wherever L² does not change evenly itself, on surfaces that are
seen at a grazing angle. Most windows of a picture are no plane; those that are agree on d.

Whether floors stay level while the camera turns: they do not where the camera sits otherwise in its mount than said.

Seen by a camera that is said to look level and looks down, the floor rises ahead of it, whichever way it looks. In the
world such a floor is a cone, though neighbouring frames agree; one small rotation of the camera makes it level in all.
A slope or a wrong up direction lies one way in the world and turns in the camera's axes.

What flat surfaces show of a camera and a drive: a lens, squeezed pictures, a heading that drifts.

Each frame alone shows whether surfaces are flat and meet at right angles, as most of floors, walls and tables do; all
frames show whether walls keep their directions.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from avlmaps.core.arrays import Bool, Float, Float32, Int
from avlmaps.core.camera import Pinhole
from avlmaps.core.wording import option
from avlmaps.recordings.consistency.sample import Sample
from avlmaps.recordings.consistency.verdict import Finding, Grade, Reason
from avlmaps.recordings.memory import is_of_program
from avlmaps.recordings.types import Recording

_FRAMES = 28  # looked at, spread evenly
_STEP, _TILE = 2, 8  # every second pixel; surfaces grow from squares of 8 of them
_FROM_M, _TO_M = 0.3, 6.0
_NEAR = 0.02  # of its depth, by which a pixel is off the surface that it belongs to
_LEAST_SHARE, _MOST = 0.04, 5  # of a picture, surfaces of a frame
_ROUNDS = 4


@dataclass(frozen=True, slots=True, eq=False)
class Flats:
    """Flat surfaces of a sample.

    Attributes:
        frame: (n,) row of the frame in the sample that shows each.
        normal: (n, 3) unit normal in the camera's axes, away from the camera.
        share: (n,) of the picture that it fills.
        bend: (n,) s: how much farther out than a pinhole's numbers say things are, one focal length beside the middle.
        sure: (n,) one over the variance of that.
    """

    frame: Int[np.ndarray, " n"]
    normal: Float[np.ndarray, "n 3"]
    share: Float[np.ndarray, " n"]
    bend: Float[np.ndarray, " n"]
    sure: Float[np.ndarray, " n"]


def find_flats(sample: Sample) -> Flats:
    """Find the largest flat surfaces of some frames."""
    count, camera = len(sample), sample.rig.depth
    rows = np.unique(np.linspace(0, count - 1, min(_FRAMES, count)).round().astype(int))
    x, y = np.moveaxis(camera.rays()[1::_STEP, 1::_STEP, :2], 2, 0)
    depth_m = sample.depth_m[rows, 1::_STEP, 1::_STEP].astype(np.float64)
    known = (depth_m > _FROM_M) & (depth_m < _TO_M)
    inverse = np.divide(1.0, depth_m, out=np.zeros_like(depth_m), where=known)
    places = np.stack([x, y, np.ones_like(x)], axis=-1)
    seeds, flat = _seeds(inverse, known, places)
    of_all = places.reshape(-1, 3)
    found = [
        (row, *surface)
        for row, some, it, there, one in zip(rows.tolist(), seeds, flat, known, inverse, strict=True)
        if it.any()
        for surface in _grown(some[it], one.reshape(-1), there.reshape(-1), of_all)
    ]
    table = np.array(found, np.float64).reshape(-1, 7)
    normal = table[:, 1:4] / np.maximum(np.linalg.norm(table[:, 1:4], axis=1, keepdims=True), 1e-12)
    return Flats(table[:, 0].astype(np.int64), normal, table[:, 4], table[:, 5], table[:, 6])


def _seeds(
    inverse: Float[np.ndarray, "f h w"], known: Bool[np.ndarray, "f h w"], places: Float[np.ndarray, "h w 3"]
) -> tuple[Float[np.ndarray, "f t 3"], Bool[np.ndarray, "f t"]]:
    down, across = (size // _TILE for size in places.shape[:2])

    def tiles(of: np.ndarray) -> np.ndarray:
        whole = of[..., : down * _TILE, : across * _TILE]
        apart = whole.reshape(*of.shape[:-2], down, _TILE, across, _TILE).swapaxes(-3, -2)
        return apart.reshape(*of.shape[:-2], down * across, _TILE * _TILE)

    at, values = np.moveaxis(tiles(np.moveaxis(places, 2, 0)), 0, -1), tiles(inverse)
    planes = np.einsum("tin,ftn->fti", np.linalg.pinv(at), values)
    off = np.abs(np.einsum("tni,fti->ftn", at, planes) - values).max(axis=-1, initial=0.0)
    return planes, tiles(known).all(axis=-1) & (off < _NEAR * values.mean(axis=-1))


def _grown(
    seeds: Float[np.ndarray, "t 3"],
    inverse: Float[np.ndarray, " p"],
    known: Bool[np.ndarray, " p"],
    places: Float[np.ndarray, "p 3"],
) -> Iterator[tuple[float, float, float, float, float, float]]:
    """Yield the largest surfaces of a picture, each from the square whose plane most pixels are near that are left."""
    near = (np.abs(seeds @ places.T - inverse) < _NEAR * inverse) & known
    r2, free, least = (places[:, :2] ** 2).sum(axis=1), known.copy(), _LEAST_SHARE * len(known)
    for _ in range(_MOST):
        most = int((near & free).sum(axis=1).argmax())
        plane, mine = seeds[most], near[most] & free
        near[most] = False
        of_lens, left, bend, matrix = inverse, inverse, 0.0, np.eye(4)
        for _ in range(_ROUNDS):
            if mine.sum() < least:
                break
            of_lens = r2 * (places[:, :2] @ plane[:2])
            terms = np.column_stack([places[mine], of_lens[mine]])
            matrix = terms.T @ terms + np.diag([0.0, 0.0, 0.0, 1e-6 * len(terms)])  # seen face on: no bend
            *even, bend = np.linalg.solve(matrix, terms.T @ inverse[mine]).tolist()
            plane = np.array(even)
            left = inverse - places @ plane - bend * of_lens
            before, mine = mine, (np.abs(left) < _NEAR * inverse) & free
            if (before == mine).all():
                break
        count = int(mine.sum())
        if count < least:
            if not (near & free).any():
                return
            continue
        sure = 1.0 / (np.linalg.inv(matrix)[3, 3] * max(float(left[mine] @ left[mine]) / count, 1e-12))
        yield (*plane.tolist(), count / len(known), bend, sure)
        free &= np.abs(left) >= 2.0 * _NEAR * inverse


_PLANE_FRAMES = 24  # looked at, spread evenly
_ACROSS, _LEAST_SIDE = 6, 16  # windows of a sixth of the columns, at least 16 pixels
_PLANE_FROM_M, _PLANE_TO_M = 0.3, 6.0
_MEASURED = 0.9  # of a window's pixels
_FLAT, _ALL = 0.02, 0.95  # a plane is off by less, as a share of the depth, in this share of the pixels
_BENT = 1e-4  # how uneven L² is at least, as a share of it
_FEWEST, _EQUAL = 20, 10.0  # windows, and as many that would count equally: one alone decides nothing
_ALIKE_M = 0.09  # the middle half of the windows lies within this, or within the offset


def offset_in_planes(depth_m: Float32[np.ndarray, "f h w"]) -> float:
    """Return by how much depths are too large on flat surfaces, metres; NaN where few are in view or they disagree.

    Args:
        depth_m: pictures of any pinhole camera, 0 where there is none.
    """
    rows = np.unique(np.linspace(0, len(depth_m) - 1, min(_PLANE_FRAMES, len(depth_m))).round().astype(int))
    side = max(_LEAST_SIDE, depth_m.shape[2] // _ACROSS)
    if side > depth_m.shape[1]:
        return float("nan")
    found = np.concatenate([_of_frame(depth_m[row], side) for row in rows])
    if len(found) < _FEWEST or found[:, 1].sum() ** 2 < _EQUAL * (found[:, 1] ** 2).sum():
        return float("nan")
    order = np.argsort(found[:, 0])
    weight = np.cumsum(found[order, 1])
    low, middle, high = found[order[np.searchsorted(weight, np.array([0.25, 0.5, 0.75]) * weight[-1])], 0].tolist()
    return middle if high - low <= max(abs(middle), _ALIKE_M) else float("nan")


def _of_frame(depth_m: Float32[np.ndarray, "h w"], side: int) -> Float[np.ndarray, "n 2"]:
    windows = np.lib.stride_tricks.sliding_window_view(depth_m, (side, side))[:: side // 2, :: side // 2]
    z: Float[np.ndarray, "n m"] = windows.reshape(-1, side * side).astype(np.float64)
    known = (z > _PLANE_FROM_M) & (z < _PLANE_TO_M)
    most = known.mean(axis=1) >= _MEASURED
    known, z = known[most], z[most]
    inverse = np.divide(1.0, z, out=np.zeros_like(z), where=known)
    flat = _even(inverse, known, side)
    left = inverse - flat
    planes = ((np.abs(left) > _FLAT * inverse) & known).sum(axis=1) <= (1.0 - _ALL) * known.sum(axis=1)
    known, flat, left = known[planes], flat[planes], left[planes]
    count, square = known.sum(axis=1), flat**2
    bent = square - _even(square, known, side)
    sure = (bent**2).sum(axis=1)
    seen = sure > (_BENT * square.sum(axis=1) / count) ** 2 * count  # others are seen face on
    sure, noise = sure[seen], (left[seen] ** 2).sum(axis=1) / count[seen]
    return np.stack([-(bent * left)[seen].sum(axis=1) / sure, sure / np.maximum(noise, 1e-12)], axis=1)


def _even(values: Float[np.ndarray, "n m"], known: Bool[np.ndarray, "n m"], side: int) -> Float[np.ndarray, "n m"]:
    """Return the even change over each square window that is nearest to its known values; 0 where none is known."""
    v, u = np.mgrid[:side, :side].reshape(2, -1) / side
    places = np.stack([np.ones_like(u), u, v], axis=1)
    squares = places[:, :, None] * places[:, None, :]
    of_places = (known.astype(np.float64) @ squares.reshape(-1, 9)).reshape(-1, 3, 3)
    even = np.linalg.solve(of_places, (values @ places)[:, :, None])[:, :, 0]
    return np.where(known, even @ places.T, 0.0)


# Normals are measured over this many pixels to each side, on surface that bends by less than this share of its depth.
_SIDE, _LEVEL_BENT, _LEVEL_ALL = 3, 0.06, 0.99
_FARTHEST_M = 5.0
# Level surface: normals within this angle of up, then of their own mean; at least 60 of a frame, in 8 frames.
_LEVEL_RAD, _ALIKE_RAD, _FEWEST_NORMALS, _FEWEST_FRAMES = np.radians(25.0), np.radians(12.0), 60, 8
_LEVEL_ROUNDS = 4
# Turns that change how floors lie by less, as a share of those that change it most, are not separated from a slope.
_WEAKEST = 0.1
# Least tilt, and least angle by which floors are off, that is a doubt; the share of it that the tilt leaves at most.
# In right recordings (9 of rendered homes, 12 of a Kinect, 38 drawn walks) floors are off by up to 1.8 degrees. Where a
# mount is off by 4 degrees, on a walk that turns right round, they are off by 4.6, and by 0.2 without it.
_LEAST_TILT_DEG, _LEAST_OFF_DEG, _MOST_LEFT = 4.0, 2.5, 0.5
_SHOWN_DEG = 6.0


@dataclass(frozen=True, slots=True)
class Tilt:
    """How a camera sits in its mount, by the floors that it sees.

    Attributes:
        off_deg: how far floors are off level, the middle of the frames, with the best up direction.
        left_deg: the same if the camera is turned as follows.
        down_deg: how much farther down the camera looks than its poses say; negative: farther up.
        right_deg: by how much its right side hangs lower than its poses say; negative: higher.
    """

    off_deg: float
    left_deg: float
    down_deg: float
    right_deg: float

    @property
    def is_sure(self) -> bool:
        """Whether it explains how floors lie, and nothing else does."""
        tilted = np.hypot(self.down_deg, self.right_deg) >= _LEAST_TILT_DEG
        return bool(tilted and self.off_deg >= _LEAST_OFF_DEG and self.left_deg <= _MOST_LEFT * self.off_deg)


@dataclass(frozen=True, slots=True, eq=False)
class Levels:
    """Level surface in the frames of a sample.

    Attributes:
        world_from_camera: (f, 3, 3) rotations of the frames in which there is enough.
        up: (f, 3) its normal there, in the camera's axes.
    """

    world_from_camera: Float[np.ndarray, "f 3 3"]
    up: Float[np.ndarray, "f 3"]

    @property
    def tilt(self) -> Tilt | None:
        """How the camera sits otherwise in its mount than its poses say; None where floors show nothing of it."""
        if len(self.up) < _FEWEST_FRAMES:
            return None
        tilt = np.zeros(3, np.float64)
        for _ in range(_LEVEL_ROUNDS):
            tilt = tilt + self._further(_turned(self.up, tilt))
        down, right = np.degrees(-tilt[0]), np.degrees(tilt[2])
        found = Tilt(self._off_deg(np.zeros(3)), self._off_deg(tilt), float(down), float(right))
        return found if found.is_sure else None

    @property
    def would_show(self) -> bool:
        """Whether a camera that is tilted by 6 degrees to any side would be noticed."""
        return all(
            Levels(self.world_from_camera @ _rotation(axis, side * _SHOWN_DEG), self.up).tilt is not None
            for axis in (0, 2)
            for side in (-1.0, 1.0)
        )

    def _further(self, seen: Float[np.ndarray, "f 3"]) -> Float[np.ndarray, "3"]:
        world = np.einsum("fij,fj->fi", self.world_from_camera, seen)
        across = -np.einsum("fij,fjk->fik", self.world_from_camera, _cross_matrices(seen))
        others = np.broadcast_to(-np.eye(3), across.shape)  # the up direction changes as well
        unknown: Float[np.ndarray, "m 6"] = np.concatenate([across, others], axis=2).reshape(-1, 6)
        off: Float[np.ndarray, " m"] = (_unit(world.mean(axis=0)) - world).reshape(-1)
        found, *_ = np.linalg.lstsq(unknown, off, rcond=_WEAKEST)
        return found[:3]

    def _off_deg(self, tilt: Float[np.ndarray, "3"]) -> float:
        world = np.einsum("fij,fj->fi", self.world_from_camera, _turned(self.up, tilt))
        return float(np.degrees(np.median(np.arccos(np.clip(world @ _unit(world.mean(axis=0)), -1.0, 1.0)))))


def find_levels(sample: Sample) -> Levels:
    """Find level surface in each frame."""
    rotation = sample.world_from_camera[:, :3, :3]
    normals = [_normals(depth_m, sample.rig.depth) for depth_m in sample.depth_m]
    up = _unit(-rotation[:, :, 1].mean(axis=0))
    rows: list[int] = []
    found: list[np.ndarray] = []
    for _ in range(2):  # the second time from the up direction that the first one found
        levels = [_level(some, turn.T @ up) for some, turn in zip(normals, rotation, strict=True)]
        rows = [row for row, level in enumerate(levels) if level is not None]
        found = [level for level in levels if level is not None]
        if found:
            up = _unit(np.einsum("fij,fj->fi", rotation[rows], np.stack(found)).mean(axis=0))
    return Levels(rotation[rows], np.array(found).reshape(-1, 3))


def _normals(depth_m: Float32[np.ndarray, "h w"], camera: Pinhole) -> Float[np.ndarray, "n 3"]:
    """Return unit normals of smooth surface in the camera's axes, which point away from the camera.

    The inverse of a plane's depth is linear in pixels, and so even the noise of a depth camera tilts none to one side.
    """
    import cv2

    height, width = depth_m.shape
    if min(height, width) <= 2 * _SIDE:
        return np.zeros((0, 3))
    known = (depth_m > 0.0).astype(np.float32)
    inverse = np.divide(1.0, depth_m, out=np.zeros_like(depth_m), where=depth_m > 0.0)
    whole = cv2.blur(known, (3, 3)) > _LEVEL_ALL
    inverse = np.where(whole, cv2.blur(inverse, (3, 3)), np.nan).astype(np.float64)
    s = _SIDE
    middle, left, right = inverse[s:-s, s:-s], inverse[s:-s, : -2 * s], inverse[s:-s, 2 * s :]
    above, below = inverse[: -2 * s, s:-s], inverse[2 * s :, s:-s]
    x, y = np.moveaxis(camera.rays()[s:-s, s:-s, :2], 2, 0)
    along_x, along_y = (right - left) * camera.fx / (2.0 * s), (below - above) * camera.fy / (2.0 * s)
    bent = np.maximum(np.abs(left + right - 2.0 * middle), np.abs(above + below - 2.0 * middle))
    smooth = (middle * _FARTHEST_M > 1.0) & (bent < _LEVEL_BENT * middle)
    normal = np.stack([along_x, along_y, middle - along_x * x - along_y * y], axis=-1)[smooth]
    return normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)


def _level(normals: Float[np.ndarray, "n 3"], up: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"] | None:
    upwards = normals * np.sign(normals @ up)[:, None]
    mean, least = up, np.cos(_LEVEL_RAD)
    for _ in range(_LEVEL_ROUNDS):
        near = upwards[upwards @ mean > least]
        if len(near) < _FEWEST_NORMALS:
            return None
        mean, least = _unit(near.mean(axis=0)), np.cos(_ALIKE_RAD)
    return mean


def _turned(vectors: Float[np.ndarray, "n 3"], by_rad: Float[np.ndarray, "3"]) -> Float[np.ndarray, "n 3"]:
    turned = vectors + np.cross(by_rad, vectors)
    return turned / np.linalg.norm(turned, axis=1, keepdims=True)


def _rotation(axis: int, degrees: float) -> Float[np.ndarray, "3 3"]:
    import cv2

    return np.asarray(cv2.Rodrigues(np.radians(degrees) * np.eye(3)[axis])[0], np.float64)


def _unit(vector: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
    return vector / max(float(np.linalg.norm(vector)), 1e-12)


def _cross_matrices(vectors: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3 3"]:
    return -np.cross(vectors[:, None, :], np.eye(3)[None])


# Normals in the camera's axes, and of lenses the camera's place and direction, that round to the same steps of this are
# one view. Surfaces of one view may be curved, or need not be at right angles.
_VIEW, _FEWEST_VIEWS = 0.3, 2.5
# Bends, in the middle and in the nearer quartile, and of how many surfaces that would count equally. In right
# recordings (20 rendered homes, 18 drawn walks, 19 stretches of a Kinect's walk, 33 times 24 real frames) -0.06 to 0.12
# in the middle; with k1 = -0.2 from 0.20 on in all walks.
_LEAST_BEND, _LEAST_QUARTER, _FEWEST_BENT, _MOST_SURE = 0.17, 0.06, 8.0, 0.75
# Of the square of the radius of a corner: there both conventions of a lens are compared.
_WITHIN = 0.67
# Pairs of surfaces of a frame: nearly at right angles, large, and turned by a change of the focal lengths; logarithms
# of that, and of how many pairs that would count equally. In the same recordings up to 0.04, and 0.15 in depth in steps
# of 4 cm; 0.27 and more where one focal length is wrong by 4/3.
_CROSS, _LARGE, _TURNED, _FEWEST_PAIRS = 0.5, 0.08, 0.15, 6.0
_LEAST_FACTOR, _LEAST_FACTOR_QUARTER, _ANGLE_MOST_LEFT = 0.2, 0.12, 0.35
# Walls: how far off upright, their share of a picture, their number, and how many of six parts of the drive show some.
_UPRIGHT, _WALL, _FEWEST_WALLS, _PARTS, _FEWEST_PARTS = 0.2, 0.06, 24, 6, 5
# Degrees that the heading drifts in the drive, how alike directions are then, and what share of that they are without.
# Simulated odometry drifts by up to 21.
_LEAST_DRIFT_DEG, _MOST_DRIFT_DEG, _ALIKE, _WITHOUT = 25.0, 90, 0.85, 0.9
_AXES = {"fx": (1.0, 0.0, 0.0), "fy": (0.0, 1.0, 0.0), "fx and fy": (1.0, 1.0, 0.0)}


@dataclass(frozen=True, slots=True)
class _Spread:
    """Quartiles of what surfaces or pairs say, each by its weight, and how many would count equally."""

    low: float
    middle: float
    high: float
    count: float
    views: float

    @staticmethod
    def of(
        values: Float[np.ndarray, " n"], weight: Float[np.ndarray, " n"], seen: Float[np.ndarray, "n k"]
    ) -> "_Spread":
        """Return those of values; nearly the same rows of ``seen`` are one view."""
        if not len(values) or not weight.sum() > 0.0:
            return _Spread(0.0, 0.0, 0.0, 0.0, 0.0)
        order = np.argsort(values)
        sums = np.cumsum(weight[order])
        rows = order[np.searchsorted(sums, np.array([0.25, 0.5, 0.75]) * sums[-1])]
        low, middle, high = values[rows].tolist()
        _, view = np.unique((seen / _VIEW).round(), axis=0, return_inverse=True)
        count, views = (float(w.sum() ** 2 / (w @ w)) for w in (weight, np.bincount(view.reshape(-1), weight)))
        return _Spread(low, middle, high, count, views)

    def is_enough(self, fewest: float) -> bool:
        """Return whether there are enough values, not all of one view."""
        return self.count >= fewest and self.views >= _FEWEST_VIEWS

    def beyond(self, least: float, quarter: float) -> bool:
        """Return whether the middle is as far from 0, and its nearer quartile."""
        return (self.middle >= least and self.low >= quarter) or (-self.middle >= least and -self.high >= quarter)


@dataclass(frozen=True, slots=True, eq=False)
class RightAngles:
    """Flat surfaces of a sample, and what they show."""

    sample: Sample
    flats: Flats

    @staticmethod
    def of(sample: Sample) -> "RightAngles":
        """Find them."""
        return RightAngles(sample, find_flats(sample))

    @property
    def lens_would_show(self) -> bool:
        """Whether there are enough surfaces to show a lens."""
        return self._bend().is_enough(_FEWEST_BENT)

    @property
    def squeeze_would_show(self) -> bool:
        """Whether there are enough surfaces at right angles to distinguish fx from fy."""
        return self._factors()["fy"][0].is_enough(_FEWEST_PAIRS)

    def finding(self, recording: Recording, levels: Levels) -> Finding | None:
        """Return what cannot be right, one thing at most."""
        return self.lens() or self._squeezed(recording) or self._drift(levels)

    def _bend(self) -> _Spread:
        sure = self.flats.sure
        most = np.quantile(sure, _MOST_SURE) if len(sure) else 0.0
        camera = self.sample.world_from_camera[self.flats.frame]
        seen = np.hstack([self.flats.normal, camera[:, :3, 2], camera[:, :3, 3]])
        return _Spread.of(self.flats.bend, np.minimum(sure, most), seen)

    def lens(self) -> Finding | None:
        """Return that the distortion of a wide lens was not taken out."""
        bend = self._bend()
        if not bend.is_enough(_FEWEST_BENT) or bend.middle < 0.0 or not bend.beyond(_LEAST_BEND, _LEAST_QUARTER):
            return None
        camera = self.sample.rig.depth
        corner = bend.middle * ((camera.width / 2.0 / camera.fx) ** 2 + (camera.height / 2.0 / camera.fy) ** 2)
        within = 1.0 + corner * _WITHIN
        k1 = (1.0 / within - 1.0) * bend.middle / (within**2 * corner * _WITHIN)
        sentence = (
            f"Flat surfaces are curved in the depth of single frames as behind a wide lens: things lie about "
            f"{corner:.0%} farther out at the corners of the pictures than a pinhole's numbers say, by "
            f"{len(self.flats.bend)} surfaces (k1 about {k1:.2g})."
        )
        remedy = (
            "Take the distortion of the lens out of the colour and the depth pictures, and give the intrinsics of the "
            "new pictures; else walls are bent in the map."
        )
        return Finding(Reason.INTRINSICS, Grade.SUSPICIOUS, sentence, remedy)

    def _pairs(self) -> tuple[Float[np.ndarray, "p 3"], Float[np.ndarray, "p 3"], Float[np.ndarray, " p"]]:
        flats = self.flats
        large = flats.share > _LARGE
        pairs = (flats.frame[:, None] == flats.frame) & (large[:, None] & large) & np.tri(len(large), k=-1, dtype=bool)
        one, other = np.nonzero(pairs & (np.abs(flats.normal @ flats.normal.T) < _CROSS))
        return flats.normal[one], flats.normal[other], np.minimum(flats.share[one], flats.share[other])

    def _factors(self) -> dict[str, tuple[_Spread, float, float]]:
        """Return the logarithms of a factor of focal lengths, and by how many degrees pairs are off without and with.

        An angle is that of normals whose x and y grow with the focal lengths.
        """
        one, other, share = self._pairs()
        cross, both = (one * other).sum(axis=1), np.hstack([one, other])
        slopes = {name: 2.0 * (one * other) @ of - cross * ((one**2 + other**2) @ of) for name, of in _AXES.items()}
        by_any = np.stack([np.abs(slope) > _TURNED for slope in slopes.values()]).any(axis=0)
        found: dict[str, tuple[_Spread, float, float]] = {}
        for name, slope in slopes.items():
            turned = np.abs(slope) > _TURNED
            values, weight = -cross[turned] / slope[turned], slope[turned] ** 2 * share[turned]
            spread = _Spread.of(values, weight, both[turned])
            found[name] = spread, _mean_deg(cross[by_any]), _mean_deg((cross + slope * spread.middle)[by_any])
        return found

    def _squeezed(self, recording: Recording) -> Finding | None:
        tried = self._factors()
        sure = [
            (left_deg, axes)
            for axes, (found, off_deg, left_deg) in tried.items()
            if found.is_enough(_FEWEST_PAIRS) and left_deg <= _ANGLE_MOST_LEFT * off_deg
            if found.beyond(_LEAST_FACTOR, _LEAST_FACTOR_QUARTER)
        ]
        if not sure:
            return None
        _, axes = min(sure)
        found, off_deg, left_deg = tried[axes]
        factor, camera = float(np.exp(found.middle)), recording.rig.depth
        fx, fy = (old * factor if name in axes else old for name, old in (("fx", camera.fx), ("fy", camera.fy)))
        sentence = (
            f"Floors, walls and tables do not meet at right angles in single frames: pairs of flat surfaces are off by "
            f"{off_deg:.0f} degrees (their mean), and by {left_deg:.0f} if {axes} were {factor:.2f} times as large."
        )
        size = f"{camera.width}x{camera.height}"
        given = "as the camera" if is_of_program(recording) else f"with {option('intrinsics', 'fx,fy,cx,cy')}"
        what = (
            "The intrinsics are those of other pictures" if " " in axes else "The pictures look squeezed along one axis"
        )
        remedy = f"{what}: give those of the {size} pictures as they are (about fx {fx:.4g}, fy {fy:.4g}) {given}."
        return Finding(Reason.INTRINSICS, Grade.SUSPICIOUS, sentence, remedy)

    def _drift(self, levels: Levels) -> Finding | None:
        stamps_s, turned = self._walls(levels)
        lasted_s = float(np.ptp(self.sample.stamps_s))
        if len(turned) < _FEWEST_WALLS or lasted_s <= 0.0:
            return None
        share = (stamps_s - self.sample.stamps_s.min()) / lasted_s
        if len(np.unique(np.minimum(share * _PARTS, _PARTS - 1).astype(int))) < _FEWEST_PARTS:
            return None
        tried = np.radians(np.arange(-_MOST_DRIFT_DEG, _MOST_DRIFT_DEG + 1))
        alike = np.abs(np.exp(4j * (turned - tried[:, None] * share)).mean(axis=1))
        best = int(alike.argmax())
        drift_deg, without = float(np.degrees(tried[best])), float(alike[_MOST_DRIFT_DEG])
        order = np.exp(4j * turned[np.argsort(share)])
        two = (np.abs(np.cumsum(order)) + np.abs(np.append(np.cumsum(order[::-1])[-2::-1], 0.0))) / len(order)
        if abs(drift_deg) < _LEAST_DRIFT_DEG or alike[best] < max(_ALIKE, float(two.max())):
            return None  # or a part of the building is turned against the other
        if without > _WITHOUT * alike[best]:
            return None
        sentence = (
            f"Walls turn evenly during the drive: those seen last lie {abs(drift_deg):.0f} degrees off those seen "
            f"first ({len(turned)} walls), {abs(drift_deg) / lasted_s:.2g} degrees a second."
        )
        remedy = (
            "The heading of the poses drifts, as of a gyro whose bias was not taken out: calibrate it, or use poses in "
            "which a SLAM closed loops."
        )
        return Finding(Reason.GEOMETRY, Grade.SUSPICIOUS, sentence, remedy)

    def _walls(self, levels: Levels) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, " n"]]:
        if not len(levels.up):
            return np.zeros(0), np.zeros(0)
        up = np.einsum("fij,fj->fi", levels.world_from_camera, levels.up).mean(axis=0)
        up /= max(float(np.linalg.norm(up)), 1e-12)
        flats, rotation = self.flats, self.sample.world_from_camera[:, :3, :3]
        world = np.einsum("nij,nj->ni", rotation[flats.frame], flats.normal)
        kept = (np.abs(world @ up) < _UPRIGHT) & (flats.share > _WALL)
        across = np.cross(up, np.eye(3)[int(np.argmin(np.abs(up)))])
        world, across = world[kept], across / np.linalg.norm(across)
        return self.sample.stamps_s[flats.frame[kept]], np.arctan2(world @ np.cross(up, across), world @ across)


def _mean_deg(cross: Float[np.ndarray, " p"]) -> float:
    return float(np.degrees(np.abs(cross).mean())) if len(cross) else 0.0
