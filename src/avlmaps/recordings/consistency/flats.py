"""Flat surfaces within single frames: floors, walls, tables; what they show of a lens and of a mount.

Where x and y are a pixel's place in focal lengths, a plane has 1/z = a·x + b·y + c, and (a, b, c) is its normal. Behind
a lens that draws things nearer to the middle, x and y are 1 + s·r² times what a pinhole's numbers say, r² = x² + y²: of
1/z is left s·r²·(a·x + b·y).

Seen by a camera that is said to look level and looks down, the floor rises ahead of it, whichever way it looks. In the
world such a floor is a cone, though neighbouring frames agree; one small rotation of the camera makes it level in all.
A slope or a wrong up direction lies one way in the world and turns in the camera's axes.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from avlmaps.core.arrays import Bool, Float, Int
from avlmaps.recordings.consistency.sample import Sample

_FRAMES = 28  # looked at, spread evenly
_STEP, _TILE = 2, 8  # every second pixel; surfaces grow from squares of 8 of them
_FROM_M, _TO_M = 0.3, 6.0
_NEAR = 0.02  # of its depth, by which a pixel is off the surface that it belongs to
_LEAST_SHARE, _MOST = 0.04, 5  # of a picture, surfaces of a frame
_ROUNDS = 4
# Surfaces whose normals, cameras' places and directions round to the same steps are one view: they may be curved.
_VIEW, _FEWEST_VIEWS = 0.3, 2.5
# Bends, in the middle and in the nearer quartile, and of how many surfaces that would count equally. In right
# recordings (20 rendered homes, 18 drawn walks, 19 stretches of a Kinect's walk, 33 times 24 real frames) -0.06 to 0.12
# in the middle; with k1 = -0.2 from 0.20 on in all walks.
_LEAST_BEND, _LEAST_QUARTER, _FEWEST_BENT, _MOST_SURE = 0.17, 0.06, 8.0, 0.75
# Level surface: within this angle of up, in 8 frames. Turns that change how floors lie by less, as a share of those
# that change it most, are not separated from a slope.
_LEVEL, _FEWEST_LEVEL, _WEAKEST = np.cos(np.radians(25.0)), 8, 0.1
# Least tilt, and least angle by which floors are off, that is a doubt; the share of it that the tilt leaves at most.
# In right recordings (9 of rendered homes, 12 of a Kinect, 38 drawn walks) floors are off by up to 1.8 degrees. Where a
# mount is off by 4 degrees, on a walk that turns right round, they are off by 4.6, and by 0.2 without it.
_LEAST_TILT_DEG, _LEAST_OFF_DEG, _MOST_LEFT = 4.0, 2.5, 0.5


@dataclass(frozen=True, slots=True, eq=False)
class Flats:
    """Flat surfaces of a sample.

    Attributes:
        sample: the frames.
        frame: (n,) row of the frame in the sample that shows each.
        normal: (n, 3) unit normal in the camera's axes, away from the camera.
        share: (n,) of the picture that it fills.
        bend: (n,) s: how much farther out than a pinhole's numbers say things are, one focal length beside the middle.
        sure: (n,) one over the variance of that.
    """

    sample: Sample
    frame: Int[np.ndarray, " n"]
    normal: Float[np.ndarray, "n 3"]
    share: Float[np.ndarray, " n"]
    bend: Float[np.ndarray, " n"]
    sure: Float[np.ndarray, " n"]

    @staticmethod
    def of(sample: Sample) -> "Flats":
        """Find the largest flat surfaces of some frames."""
        count, camera = len(sample), sample.rig.depth
        rows = np.unique(np.linspace(0, count - 1, min(_FRAMES, count)).round().astype(int))
        x, y = np.moveaxis(camera.rays()[1::_STEP, 1::_STEP, :2], 2, 0)
        depth_m = sample.depth_m[rows, 1::_STEP, 1::_STEP].astype(np.float64)
        known = (depth_m > _FROM_M) & (depth_m < _TO_M)
        inverse = np.divide(1.0, depth_m, out=np.zeros_like(depth_m), where=known)
        places = np.stack([x, y, np.ones_like(x)], axis=-1)
        seeds, flat = _seeds(inverse, known, places)
        found = [
            (row, *surface)
            for row, some, it, there, one in zip(rows.tolist(), seeds, flat, known, inverse, strict=True)
            if it.any()
            for surface in _grown(some[it], one.reshape(-1), there.reshape(-1), places.reshape(-1, 3))
        ]
        table = np.array(found, np.float64).reshape(-1, 7)
        normal = table[:, 1:4] / np.maximum(np.linalg.norm(table[:, 1:4], axis=1, keepdims=True), 1e-12)
        return Flats(sample, table[:, 0].astype(np.int64), normal, table[:, 4], table[:, 5], table[:, 6])

    def lens(self) -> tuple[float, float] | None:
        """Return k1 of a wide lens whose distortion was not taken out, and the bend at the corners; None without."""
        quarter, middle, enough = self._bend()
        if not enough or middle < _LEAST_BEND or quarter < _LEAST_QUARTER:
            return None
        camera = self.sample.rig.depth
        corner = middle * ((camera.width / 2.0 / camera.fx) ** 2 + (camera.height / 2.0 / camera.fy) ** 2)
        within = corner * 0.67  # there both conventions of a lens are compared
        return (1.0 / (1.0 + within) - 1.0) * middle / ((1.0 + within) ** 2 * within), corner

    @property
    def lens_would_show(self) -> bool:
        """Whether there are enough surfaces to show a lens."""
        return self._bend()[2]

    def _bend(self) -> tuple[float, float, bool]:
        """Return the first quartile and the middle of the bends, and whether there are enough, not all of one view."""
        weight = np.minimum(self.sure, np.quantile(self.sure, _MOST_SURE)) if len(self.sure) else self.sure
        if not weight.sum() > 0.0:
            return 0.0, 0.0, False
        order = np.argsort(self.bend)
        sums = np.cumsum(weight[order])
        quarter, middle = self.bend[order[np.searchsorted(sums, np.array([0.25, 0.5]) * sums[-1])]].tolist()
        camera = self.sample.world_from_camera[self.frame]
        seen = np.hstack([self.normal, camera[:, :3, 2], camera[:, :3, 3]])  # nearly the same rows are one view
        _, view = np.unique((seen / _VIEW).round(), axis=0, return_inverse=True)
        count, views = (float(w.sum() ** 2 / (w @ w)) for w in (weight, np.bincount(view.reshape(-1), weight)))
        return quarter, middle, count >= _FEWEST_BENT and views >= _FEWEST_VIEWS

    def levels(self) -> "Levels":
        """Return the largest level surface of each frame."""
        rotation = self.sample.world_from_camera[:, :3, :3]
        world, up = np.einsum("nij,nj->ni", rotation[self.frame], self.normal), _unit(-rotation[:, :, 1].mean(axis=0))
        rows: list[int] = []
        for _ in range(2):  # the second time from the up direction that the first one found
            level = np.flatnonzero(np.abs(world @ up) > _LEVEL)
            order = level[np.argsort(-self.share[level], kind="stable")]
            rows = order[np.unique(self.frame[order], return_index=True)[1]].tolist()
            if rows:
                up = _unit((world[rows] * np.sign(world[rows] @ up)[:, None]).mean(axis=0))
        upwards = self.normal[rows] * np.sign(world[rows] @ up)[:, None]
        return Levels(rotation[self.frame[rows]], upwards.reshape(-1, 3))


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


@dataclass(frozen=True, slots=True, eq=False)
class Levels:
    """Level surface in the frames of a sample.

    Attributes:
        world_from_camera: (f, 3, 3) rotations of the frames in which there is some.
        up: (f, 3) its normal there, in the camera's axes.
    """

    world_from_camera: Float[np.ndarray, "f 3 3"]
    up: Float[np.ndarray, "f 3"]

    @property
    def tilt(self) -> Tilt | None:
        """How the camera sits otherwise in its mount than its poses say; None where floors show nothing of it."""
        if len(self.up) < _FEWEST_LEVEL:
            return None
        tilt = np.zeros(3, np.float64)
        for _ in range(_ROUNDS):
            tilt = tilt + self._further(_leaning(self.up, tilt))
        off_deg, left_deg = self._off_deg(np.zeros(3)), self._off_deg(tilt)
        down_deg, right_deg = np.degrees([-tilt[0], tilt[2]]).tolist()
        is_sure = np.hypot(down_deg, right_deg) >= _LEAST_TILT_DEG and off_deg >= _LEAST_OFF_DEG
        return Tilt(off_deg, left_deg, down_deg, right_deg) if is_sure and left_deg <= _MOST_LEFT * off_deg else None

    def _further(self, seen: Float[np.ndarray, "f 3"]) -> Float[np.ndarray, "3"]:
        world = np.einsum("fij,fj->fi", self.world_from_camera, seen)
        across = np.einsum("fij,fjk->fik", self.world_from_camera, np.cross(seen[:, None, :], np.eye(3)[None]))
        others = np.broadcast_to(-np.eye(3), across.shape)  # the up direction changes as well
        unknown: Float[np.ndarray, "m 6"] = np.concatenate([across, others], axis=2).reshape(-1, 6)
        off: Float[np.ndarray, " m"] = (_unit(world.mean(axis=0)) - world).reshape(-1)
        found, *_ = np.linalg.lstsq(unknown, off, rcond=_WEAKEST)
        return found[:3]

    def _off_deg(self, tilt: Float[np.ndarray, "3"]) -> float:
        world = np.einsum("fij,fj->fi", self.world_from_camera, _leaning(self.up, tilt))
        return float(np.degrees(np.median(np.arccos(np.clip(world @ _unit(world.mean(axis=0)), -1.0, 1.0)))))


def _leaning(vectors: Float[np.ndarray, "n 3"], by_rad: Float[np.ndarray, "3"]) -> Float[np.ndarray, "n 3"]:
    turned = vectors + np.cross(by_rad, vectors)
    return turned / np.linalg.norm(turned, axis=1, keepdims=True)


def _unit(vector: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
    return vector / max(float(np.linalg.norm(vector)), 1e-12)
