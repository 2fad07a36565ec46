"""Where edges of colour lie beside those of depth: the two pictures of a frame against each other.

Most edges of depth are edges of colour as well. Over many frames the gradient of colour is largest where the depth
camera, its lens and its clock put the edges, so that a shift shows that no comparison of frames does: a colour camera
that is mounted elsewhere, colour that is late while the camera turns evenly, depth pictures that are shifted.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Float32

from avlmaps.recordings.consistency.sample import WIDTH, Sample

# Shifts that are tried, in columns of a picture of `WIDTH`, and how near to none is none: a Kinect that is not
# registered has its edges 2 beside those of colour.
_STEP, _MOST, _NONE = 2.0, 20.0, 3.0
_SHIFTS = np.arange(-_MOST, _MOST + 0.5 * _STEP, _STEP)
# A step of depth that is an edge, as a share of it.
_EDGE = 0.08
_FRAMES, _EDGES_EACH, _FEWEST_EACH = 40, 200, 20
_FEWEST_FRAMES, _FEWEST_EDGES = 5, 400
# Beyond none the gradient must be this many times that around none, by this share of its spread, and so large. Right
# recordings: up to 0.9 times, but for 1.2 times and 0.4 of the spread where a camera hardly moves (11 of a Kinect, 32
# times 25 frames of NYU, 18 drawn).
_LEAST_RATIO, _LEAST_GAIN, _LEAST_GRADIENT = 1.25, 0.7, 0.3
# Shifts that are tried beyond, of colour that is late while the camera turns: up to half of the picture, hardly up or
# down. There more may look alike by chance. Colour 0.6 s late or early: 2.0 to 5.5 times that around none, and 2.9 to
# 3.7 times the spread over the mean (7 of 8 walks that turn evenly). Right recordings: the most is around none, but for
# one of 11 of a Kinect, which hardly moves (1.6 times, 1.7).
_FAR_COLUMNS, _FAR_ROWS = np.arange(-64.0, 65.0, _STEP), np.arange(-6.0, 7.0, 3.0)
_LEAST_FAR_RATIO, _LEAST_FAR_SPREADS = 1.8, 2.5


@dataclass(frozen=True, slots=True, eq=False)
class DepthEdges:
    """The gradient of colour around edges of depth.

    Attributes:
        shifted: (k, k) its mean at each shift, rows by y; in standard deviations of a picture's gradient.
        parallax: (k, k) the same with shifts in inverse proportion to depth, as of a camera that is elsewhere.
        far: (r, c) the same with large shifts to the sides.
        frames: number of frames with edges.
        count: number of edges.
        depth_m: middle of their depths.
    """

    shifted: Float[np.ndarray, "k k"]
    parallax: Float[np.ndarray, "k k"]
    far: Float[np.ndarray, "r c"]
    frames: int
    count: int
    depth_m: float

    @property
    def enough(self) -> bool:
        """Whether there is enough to judge by."""
        return self.frames >= _FEWEST_FRAMES and self.count >= _FEWEST_EDGES

    @property
    def would_show(self) -> bool:
        """Whether colour that lies beside depth by a sixteenth would be noticed."""
        by = WIDTH / 16.0
        return self.enough and all(_stands_out(self.shifted, _near(by * x, by * y)) for x, y in _SIDES)


_SIDES = ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0))


@dataclass(frozen=True, slots=True)
class Shift:
    """Where edges of colour lie.

    Attributes:
        columns: to the right of those of depth, as a share of the width of colour pictures.
        rows: below them, as a share of the same width.
        gradient: of colour there, and ``here``: at the edges of depth; standard deviations of a picture's gradient.
        metres: by how much the colour camera seems to be elsewhere, x and y; None where the shift is that of a picture.
    """

    columns: float
    rows: float
    gradient: float
    here: float
    metres: tuple[float, float] | None


def _near(columns: float, rows: float) -> Bool[np.ndarray, "k k"]:
    return np.hypot(_SHIFTS[None, :] - columns, _SHIFTS[:, None] - rows) <= _NONE


def find_edges(sample: Sample) -> DepthEdges:
    """Measure the gradient of colour around the edges of depth."""
    import cv2

    rig, camera = sample.rig, sample.rig.rgb
    px = camera.width / WIDTH
    rows = np.unique(np.linspace(0, len(sample) - 1, min(_FRAMES, len(sample))).round().astype(int))
    found = [_edge_pixels(sample.depth_m[row]) for row in rows]
    depths = [sample.depth_m[row][v, u] for row, (v, u) in zip(rows, found, strict=True)]
    middle_m = float(np.median(np.concatenate(depths))) if any(map(len, depths)) else float("nan")
    sums = np.zeros((2, len(_SHIFTS), len(_SHIFTS)))
    far, inside_far = np.zeros((2, len(_FAR_ROWS), len(_FAR_COLUMNS)))
    frames = count = 0
    for row, (v, u), z in zip(rows, found, depths, strict=True):
        if len(z) < _FEWEST_EACH:
            continue
        points = np.stack([u + 0.5 - rig.depth.cx, v + 0.5 - rig.depth.cy, np.ones(len(z))], axis=1)
        points *= z[:, None] / np.array([rig.depth.fx, rig.depth.fy, 1.0])
        seen = points @ rig.rgb_from_depth[:3, :3].T + rig.rgb_from_depth[:3, 3]
        seen, near = seen[seen[:, 2] > 0.01], z[seen[:, 2] > 0.01]
        x, y = (camera.project(seen) if len(seen) else np.zeros((0, 2))).T
        gradient = cv2.GaussianBlur(_gradient(sample.grey[row]), (0, 0), 1.0)
        gradient = (gradient - gradient.mean()) / max(float(gradient.std()), 1e-6)
        for kind, by in enumerate((np.ones(len(near)), middle_m / near)):
            sums[kind] += _shifted(gradient, x, y, _SHIFTS * px * by[:, None], _SHIFTS * px * by[:, None])[0]
        one, inside = _shifted(gradient, x, y, _FAR_COLUMNS * px, _FAR_ROWS * px)
        far, inside_far = far + one, inside_far + inside
        frames, count = frames + 1, count + len(near)
    shifted, parallax = sums / max(count, 1)
    return DepthEdges(shifted, parallax, far / np.maximum(inside_far, 1), frames, count, middle_m)


def _shifted(
    gradient: Float32[np.ndarray, "h w"], x: np.ndarray, y: np.ndarray, columns: np.ndarray, rows: np.ndarray
) -> tuple[Float[np.ndarray, "r c"], Float[np.ndarray, "r c"]]:
    height, width = gradient.shape
    u, v = np.floor(x[:, None] + columns).astype(int), np.floor(y[:, None] + rows).astype(int)
    inside = ((v >= 0) & (v < height))[:, :, None] & ((u >= 0) & (u < width))[:, None, :]
    found = gradient[np.clip(v, 0, height - 1)[:, :, None], np.clip(u, 0, width - 1)[:, None, :]]
    return np.where(inside, found, 0.0).sum(axis=0), inside.sum(axis=0).astype(np.float64)


def shift_of(edges: DepthEdges, sample: Sample) -> Shift | None:
    """Return where edges of colour lie, None where they lie on those of depth or nothing shows it."""
    none = _near(0.0, 0.0)
    kinds = [one for one in (edges.shifted, edges.parallax) if _stands_out(one, none)]
    if not edges.enough:
        return None
    here = max(float(edges.shifted[none].max()), 0.0)
    most = float(edges.far.max())
    beyond = most - float(edges.far.mean()) >= _LEAST_FAR_SPREADS * float(edges.far.std())
    if beyond and most >= max(_LEAST_FAR_RATIO * here, _LEAST_GRADIENT):
        at_y, at_x = np.unravel_index(int(edges.far.argmax()), edges.far.shape)
        if abs(_FAR_COLUMNS[at_x]) > _MOST:
            return Shift(float(_FAR_COLUMNS[at_x]) / WIDTH, float(_FAR_ROWS[at_y]) / WIDTH, most, here, None)
    if not kinds:
        return None
    best = max(kinds, key=lambda one: float(one.max()))
    at_y, at_x = np.unravel_index(int(np.where(none, -np.inf, best).argmax()), best.shape)
    columns, rows = float(_SHIFTS[at_x]) / WIDTH, float(_SHIFTS[at_y]) / WIDTH
    camera = sample.rig.rgb
    to_m = edges.depth_m * camera.width / camera.fx
    metres = (columns * to_m, rows * to_m) if best is edges.parallax else None
    return Shift(columns, rows, float(best.max()), float(best[none].max()), metres)


def _stands_out(gradient: Float[np.ndarray, "k k"], around: Bool[np.ndarray, "k k"]) -> bool:
    here, most = max(float(gradient[around].max()), 0.0), float(gradient.max())
    return most >= max(_LEAST_RATIO * here, here + _LEAST_GAIN * float(gradient.std()), _LEAST_GRADIENT)


def _edge_pixels(depth_m: Float32[np.ndarray, "h w"]) -> tuple[np.ndarray, np.ndarray]:
    edge = np.zeros(depth_m.shape, bool)
    for axis in (0, 1):
        first, second = (np.moveaxis(depth_m, axis, 0)[part] for part in (slice(1, None), slice(None, -1)))
        nearer = np.minimum(first, second)
        step = (nearer > 0.0) & (np.abs(first - second) > _EDGE * nearer)
        turned = np.moveaxis(edge, axis, 0)
        turned[1:] |= step & (first < second)
        turned[:-1] |= step & (first >= second)
    v, u = np.nonzero(edge)
    chosen = np.unique(np.linspace(0, len(v) - 1, min(_EDGES_EACH, len(v))).round().astype(int))
    return v[chosen], u[chosen]


def _gradient(grey: Float32[np.ndarray, "h w"]) -> Float32[np.ndarray, "h w"]:
    import cv2

    smooth = cv2.GaussianBlur(grey, (0, 0), 1.0)
    steep = np.hypot(cv2.Sobel(smooth, cv2.CV_32F, 1, 0), cv2.Sobel(smooth, cv2.CV_32F, 0, 1))
    return np.minimum(steep / (np.quantile(steep, 0.9) + 8.0), 1.0).astype(np.float32)
