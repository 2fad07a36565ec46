"""The path up a building's stairs: from a place on one floor to one on the floor above. World frame, metres."""

import cv2
import numpy as np
from jaxtyping import Bool, Float, Int
from scipy import sparse
from scipy.sparse import csgraph

from avlmaps_sim.free_space import FreeSpace, floor_cells
from avlmaps_sim.grid_kernels import mark_slab
from avlmaps_sim.scene import Scene

_LAYER_M = 0.05  # surfaces of the stairs are sorted by height into layers of this
_RISE_M = 0.26  # a foot is lifted no higher
_KNEE_M = 0.5  # what is higher over a step stands beside the walker, not under the next foot
_AROUND_M = 1.0  # of each floor that belongs to the stairs
_RADIUS_M = 0.2  # of who climbs: stairs are narrower than rooms
_UP = 0.8  # the upward part of the normal of what can be stepped on
_SMOOTH = 9  # points of the path over which it is evened
_STEPS = np.array([(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1)])


def climb(scene: Scene, below: FreeSpace, above: FreeSpace, height_m: float) -> Float[np.ndarray, "n 3"] | None:
    """Return the path up the stairs of a scene, its first point on the lower floor and its last on the upper one.

    Only what is named stairs is climbed; both floors are on grids with the same cells.

    Returns:
        Points a few centimetres apart, the height of the feet as z; None where no stairs lead up.
    """
    mesh = scene.mesh
    named = np.array([thing.category == "stairs" for thing in scene.objects], bool)
    own = named[scene.instance] & (mesh.normals()[:, 2] > _UP)
    corners = mesh.corners().astype(np.float64)
    if not own.any():
        return None
    cell_m = below.cell_m
    low = np.floor((corners[own][..., :2].min(axis=(0, 1)) - _AROUND_M - below.origin) / cell_m).astype(np.int64)
    high = np.ceil((corners[own][..., :2].max(axis=(0, 1)) + _AROUND_M - below.origin) / cell_m).astype(np.int64)
    low, high = np.maximum(low, 0), np.minimum(high, below.free.shape)
    window = (slice(low[0], high[0]), slice(low[1], high[1]))
    origin = below.origin + low * cell_m
    outer = below.origin + high * cell_m
    near = ((corners[..., :2].max(axis=1) >= origin) & (corners[..., :2].min(axis=1) <= outer)).all(axis=1)
    around, treads = corners[near], corners[own]
    shape = below.free[window].shape

    def clear(top_m: float) -> Bool[np.ndarray, "nx ny"]:
        blocked = np.zeros(shape, np.bool_)
        mark_slab(around, top_m + _KNEE_M, top_m + height_m, origin, cell_m, blocked)
        away = cv2.distanceTransform((~blocked).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
        return away * cell_m >= _RADIUS_M

    def floor(space: FreeSpace) -> Bool[np.ndarray, "nx ny"]:
        """The floor where a robot stands, and up to the steps themselves: a foot comes nearer to them than a base."""
        return space.free[window] | (floor_cells(scene, space.floor_m, origin, shape, cell_m) & clear(space.floor_m))

    heights, layers = [below.floor_m], [floor(below)]
    for at in np.arange(below.floor_m + 0.5 * _LAYER_M, above.floor_m - 0.5 * _LAYER_M, _LAYER_M).tolist():
        tread = np.zeros(shape, np.bool_)
        mark_slab(treads, at, at + _LAYER_M, origin, cell_m, tread)
        if tread.any():
            heights.append(at + 0.5 * _LAYER_M)
            layers.append(tread & clear(heights[-1]))
    heights.append(above.floor_m)
    layers.append(floor(above))
    ends = below.free[window], above.free[window]
    nodes = _cheapest(np.array(heights), np.array(layers), ends, cell_m)
    if nodes is None:
        return None
    points = np.column_stack([origin + (nodes[:, 1:] + 0.5) * cell_m, np.array(heights)[nodes[:, 0]]])
    return _evened(points)


def _cheapest(
    heights: Float[np.ndarray, " k"],
    layers: Bool[np.ndarray, "k nx ny"],
    ends: tuple[Bool[np.ndarray, "nx ny"], Bool[np.ndarray, "nx ny"]],
    cell_m: float,
) -> Int[np.ndarray, "n 3"] | None:
    """Return the nodes (layer, i, j) of the shortest path from cells of the lowest layer to cells of the highest."""
    number = np.full(layers.shape, -1, np.int64)
    cells = np.argwhere(layers)
    number[layers] = np.arange(len(cells))
    room = [cv2.distanceTransform(np.pad(one, 1).astype(np.uint8), cv2.DIST_L2, 5)[1:-1, 1:-1] for one in layers]
    dear = 1.0 + np.exp(-np.stack(room)[layers] * cell_m / 0.15)  # the middle of a flight is cheaper than its edge
    rows, columns, weights = [], [], []
    nx, ny = layers.shape[1:]
    for step in _STEPS:
        i, j = (cells[:, 1:] + step).T
        inside = (i >= 0) & (j >= 0) & (i < nx) & (j < ny)
        for layer, height in enumerate(heights):
            at = np.flatnonzero(inside & (np.abs(heights[cells[:, 0]] - height) <= _RISE_M))
            other = number[layer, i[at], j[at]]
            at, other = at[other >= 0], other[other >= 0]
            length = np.hypot(cell_m * np.hypot(*step), heights[cells[at, 0]] - height)
            rows.append(at)
            columns.append(other)
            weights.append(length * 0.5 * (dear[at] + dear[other]) + 1e-9)
    count = len(cells)
    row, column, weight = np.concatenate(rows), np.concatenate(columns), np.concatenate(weights)
    first = np.flatnonzero((cells[:, 0] == 0) & ends[0][tuple(cells[:, 1:].T)])
    last = np.flatnonzero((cells[:, 0] == len(heights) - 1) & ends[1][tuple(cells[:, 1:].T)])
    if not len(first) or not len(last):
        return None
    # From one node more there is a step to every place of the lower floor.
    row, column = np.append(row, np.full(len(first), count)), np.append(column, first)
    values = np.append(weight, np.full(len(first), 1e-6))
    graph = sparse.csr_matrix((values, (row, column)), shape=(count + 1, count + 1))
    cost, before = csgraph.dijkstra(graph, indices=count, return_predecessors=True)
    if not np.isfinite(cost[last]).any():
        return None
    nodes = [int(last[np.argmin(cost[last])])]
    while before[nodes[-1]] != count:
        nodes.append(int(before[nodes[-1]]))
    return cells[nodes[::-1]]


def _evened(points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
    """Average a path over a few of its points, its ends excepted: steps become a slope, as a walker's head rises."""
    half = _SMOOTH // 2
    padded = np.concatenate([np.repeat(points[:1], half, axis=0), points, np.repeat(points[-1:], half, axis=0)])
    even = np.stack([np.convolve(column, np.ones(_SMOOTH) / _SMOOTH, "valid") for column in padded.T], axis=1)
    even[0], even[-1] = points[0], points[-1]
    return even
