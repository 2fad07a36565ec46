"""Whether depth is off by the same length everywhere: then flat surfaces are curved within every frame.

On a plane 1/z changes evenly over the picture, 1/z = L(u, v). Where d is added to every depth, 1/z' is about L - d·L²:
what of 1/z' is left over beside an even change shows d wherever L² does not change evenly itself, on surfaces that are
seen at a grazing angle. Most windows of a picture are no plane; those that are agree on d.
"""

import numpy as np

from avlmaps.core.arrays import Bool, Float, Float32

_FRAMES = 24  # looked at, spread evenly
_ACROSS, _LEAST_SIDE = 6, 16  # windows of a sixth of the columns, at least 16 pixels
_FROM_M, _TO_M = 0.3, 6.0
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
    rows = np.unique(np.linspace(0, len(depth_m) - 1, min(_FRAMES, len(depth_m))).round().astype(int))
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
    """Return what each flat window shows of the offset, metres, and one over the variance of that."""
    windows = np.lib.stride_tricks.sliding_window_view(depth_m, (side, side))[:: side // 2, :: side // 2]
    z: Float[np.ndarray, "n m"] = windows.reshape(-1, side * side).astype(np.float64)
    known = (z > _FROM_M) & (z < _TO_M)
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
    """Return the even change over each square window that is nearest to its values where they are known; 0 elsewhere.

    Args:
        values: 0 where they are not known.
        known: most pixels, so that they determine the change.
        side: of the windows, pixels.
    """
    v, u = np.mgrid[:side, :side].reshape(2, -1) / side
    places = np.stack([np.ones_like(u), u, v], axis=1)
    squares = places[:, :, None] * places[:, None, :]
    of_places = (known.astype(np.float64) @ squares.reshape(-1, 9)).reshape(-1, 3, 3)
    even = np.linalg.solve(of_places, (values @ places)[:, :, None])[:, :, 0]
    return np.where(known, even @ places.T, 0.0)
