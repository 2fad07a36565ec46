"""Flat surfaces within single frames: floors, walls, tables, and how far each is curved as behind a wide lens.

Where x and y are a pixel's place in focal lengths, a plane has 1/z = a·x + b·y + c, and (a, b, c) is its normal. Behind
a lens that draws things nearer to the middle, x and y are 1 + s·r² times what a pinhole's numbers say, r² = x² + y²: of
1/z is left s·r²·(a·x + b·y).
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
    """Return the plane of each square of each picture, and whether it is one."""
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
