"""Whether depth is off by the same length everywhere: then flat surfaces are curved within every frame.

On a plane 1/z changes evenly over the picture, 1/z = L(u, v). Where d is added to every depth, 1/z' is about L - d·L²:
what of 1/z' is left over beside an even change shows d wherever L² does not change evenly itself, on surfaces that are
seen at a grazing angle. Most windows of a picture are no plane; those that are agree on d.
"""

from collections.abc import Iterator
from itertools import product

import numpy as np

from avlmaps.core.arrays import Float, Float32

_FRAMES = 24  # looked at, spread evenly
_ACROSS, _LEAST_SIDE = 6, 16  # windows of a sixth of the columns, at least 16 pixels
_FROM_M, _TO_M = 0.3, 6.0
_MEASURED = 0.9  # of a window's pixels
_FLAT = 0.02  # a plane is off by less, in 95 of 100 pixels, as a share of the depth
_BENT = 1e-4  # how uneven L² is at least, as a share of it
_FEWEST, _EQUAL = 20, 10.0  # windows, and as many that would count equally: one alone decides nothing
_ALIKE_M = 0.09  # the middle half of the windows lies within this, or within the offset


def offset_in_planes(depth_m: Float32[np.ndarray, "f h w"]) -> float:
    """Return by how much depths are too large on flat surfaces, metres; NaN where few are in view or they disagree.

    Args:
        depth_m: pictures of any pinhole camera, 0 where there is none.
    """
    rows = np.unique(np.linspace(0, len(depth_m) - 1, min(_FRAMES, len(depth_m))).round().astype(int))
    found = np.array([one for row in rows for one in _of_frame(depth_m[row])]).reshape(-1, 2)
    if len(found) < _FEWEST or found[:, 1].sum() ** 2 < _EQUAL * (found[:, 1] ** 2).sum():
        return float("nan")
    order = np.argsort(found[:, 0])
    weight = np.cumsum(found[order, 1])
    low, middle, high = found[order[np.searchsorted(weight, np.array([0.25, 0.5, 0.75]) * weight[-1])], 0].tolist()
    return middle if high - low <= max(abs(middle), _ALIKE_M) else float("nan")


def _of_frame(depth_m: Float32[np.ndarray, "h w"]) -> Iterator[tuple[float, float]]:
    """Yield what each flat window shows of the offset, metres, and one over the variance of that."""
    height, width = depth_m.shape
    side = max(_LEAST_SIDE, width // _ACROSS)
    v, u = np.mgrid[:side, :side] / side
    places = np.stack([np.ones_like(u), u, v], axis=-1)
    for top, left in product(range(0, height - side + 1, side // 2), range(0, width - side + 1, side // 2)):
        z = depth_m[top : top + side, left : left + side].astype(np.float64)
        known = (z > _FROM_M) & (z < _TO_M)
        if known.mean() >= _MEASURED and (shown := _of_window(1.0 / z[known], places[known])) is not None:
            yield shown


def _of_window(inverse: Float[np.ndarray, " n"], places: Float[np.ndarray, "n 3"]) -> tuple[float, float] | None:
    even, *_ = np.linalg.lstsq(places, inverse, rcond=None)
    flat = places @ even
    left = inverse - flat
    if np.quantile(np.abs(left) / inverse, 0.95) > _FLAT:
        return None
    of_square, *_ = np.linalg.lstsq(places, flat**2, rcond=None)
    bent = flat**2 - places @ of_square
    sure = float(bent @ bent)
    if sure <= (_BENT * float(np.mean(flat**2))) ** 2 * len(bent):  # seen face on
        return None
    return -float(bent @ left) / sure, sure / max(float(np.mean(left**2)), 1e-12)
