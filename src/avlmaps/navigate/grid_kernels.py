"""Compiled loops over the floor grid: graphs of cells and of blocks of cells, lines over cells, room for a disc.

Grids are indexed (i, j) for x and y; places are in cells, so that cell (i, j) covers [i, i + 1) x [j, j + 1).
"""

import numpy as np
from numba import njit

BLOCK = 4  # cells a side of a block, of the coarse graph
# Half of the sixteen neighbours; the others are the reverse steps.
STEPS = np.array([(1, 0), (0, 1), (1, 1), (1, -1), (2, 1), (1, 2), (2, -1), (1, -2)])


@njit(cache=True)
def _open_step(number, i, j, di, dj):  # pragma: no cover - compiled
    """Return whether a step leads over nothing but cells of the graph, including those whose corner it touches."""
    nx, ny = number.shape
    if i + di >= nx or j + dj < 0 or j + dj >= ny or number[i + di, j + dj] < 0:
        return False
    side = 1 if dj > 0 else -1
    if di == 1 and (dj == 1 or dj == -1):
        return number[i + 1, j] >= 0 and number[i, j + dj] >= 0
    if di == 2:
        return number[i + 1, j] >= 0 and number[i + 1, j + side] >= 0
    if dj == 2 or dj == -2:
        return number[i, j + side] >= 0 and number[i + 1, j + side] >= 0
    return True


@njit(cache=True)
def _mean_cost(cost, i, j, di, dj):  # pragma: no cover - compiled
    """Return the mean cost of a metre along a step between the middles of two cells, by the cells it passes."""
    ends = 0.5 * (cost[i, j] + cost[i + di, j + dj])
    side = 1 if dj > 0 else -1
    if di == 2:
        return 0.5 * ends + 0.25 * (cost[i + 1, j] + cost[i + 1, j + side])
    if dj == 2 or dj == -2:
        return 0.5 * ends + 0.25 * (cost[i, j + side] + cost[i + 1, j + side])
    return ends


@njit(cache=True)
def number_cells(mask):  # pragma: no cover - compiled
    """Return the number of each true cell, −1 elsewhere, and the rows and columns of the true cells."""
    nx, ny = mask.shape
    number = np.full((nx, ny), -1, np.int32)
    count = 0
    for i in range(nx):
        for j in range(ny):
            if mask[i, j]:
                number[i, j] = count
                count += 1
    cells = np.empty((count, 2), np.int32)
    for i in range(nx):
        for j in range(ny):
            if mask[i, j]:
                cells[number[i, j], 0] = i
                cells[number[i, j], 1] = j
    return number, cells


@njit(cache=True)
def cell_graph(number, cells, cost):  # pragma: no cover - compiled
    """Return the rows' starts, the columns and the weights (in cells) of the graph of sixteen neighbours."""
    count = cells.shape[0]
    degree = np.zeros(count + 1, np.int32)
    open_steps = np.zeros(count, np.uint8)
    for n in range(count):
        i, j = cells[n, 0], cells[n, 1]
        for k in range(8):
            if _open_step(number, i, j, STEPS[k, 0], STEPS[k, 1]):
                open_steps[n] |= np.uint8(1 << k)
                degree[n + 1] += 1
                degree[number[i + STEPS[k, 0], j + STEPS[k, 1]] + 1] += 1
    starts = np.cumsum(degree).astype(np.int32)
    filled = starts[:-1].copy()
    columns = np.empty(starts[-1], np.int32)
    weights = np.empty(starts[-1], np.float64)
    for n in range(count):
        i, j = cells[n, 0], cells[n, 1]
        for k in range(8):
            if open_steps[n] & np.uint8(1 << k):
                di, dj = STEPS[k, 0], STEPS[k, 1]
                m = number[i + di, j + dj]
                weight = np.sqrt(float(di * di + dj * dj)) * _mean_cost(cost, i, j, di, dj)
                columns[filled[n]], weights[filled[n]] = m, weight
                columns[filled[m]], weights[filled[m]] = n, weight
                filled[n] += 1
                filled[m] += 1
    return starts, columns, weights


@njit(cache=True)
def block_parts(passable, cost):  # pragma: no cover - compiled
    """Number the connected parts (side by side) within each block of cells.

    Returns:
        node: (nx, ny) number of the part that a cell belongs to, −1 where it is not passable.
        middle: (parts, 2) mean of its cells' middles.
        mean: (parts,) mean cost of its cells.
    """
    nx, ny = passable.shape
    node = np.full((nx, ny), -1, np.int32)
    most = nx * ny
    middle = np.zeros((most // 2 + nx + ny + 1, 2))
    mean = np.zeros(most // 2 + nx + ny + 1)
    stack = np.empty((BLOCK * BLOCK, 2), np.int64)
    count = 0
    for bi in range(0, nx, BLOCK):
        for bj in range(0, ny, BLOCK):
            end_i, end_j = min(bi + BLOCK, nx), min(bj + BLOCK, ny)
            if passable[bi:end_i, bj:end_j].all():  # most blocks are one part
                node[bi:end_i, bj:end_j] = count
                middle[count, 0], middle[count, 1] = 0.5 * (bi + end_i), 0.5 * (bj + end_j)
                mean[count] = cost[bi:end_i, bj:end_j].mean()
                count += 1
                continue
            for i in range(bi, end_i):
                for j in range(bj, end_j):
                    if not passable[i, j] or node[i, j] >= 0:
                        continue
                    node[i, j] = count
                    stack[0, 0], stack[0, 1] = i, j
                    top, size = 1, 0
                    while top > 0:
                        top -= 1
                        a, b = stack[top, 0], stack[top, 1]
                        size += 1
                        middle[count, 0] += a + 0.5
                        middle[count, 1] += b + 0.5
                        mean[count] += cost[a, b]
                        for da, db in ((1, 0), (-1, 0), (0, 1), (0, -1)):
                            c, d = a + da, b + db
                            inside = bi <= c < end_i and bj <= d < end_j
                            if inside and passable[c, d] and node[c, d] < 0:
                                node[c, d] = count
                                stack[top, 0], stack[top, 1] = c, d
                                top += 1
                    middle[count] /= size
                    mean[count] /= size
                    count += 1
    return node, middle[:count].copy(), mean[:count].copy()


@njit(cache=True)
def _meets(node, i, j, di, dj):  # pragma: no cover - compiled
    """Return whether a step leads into another block's part, and is not just the next one along the same border."""
    crosses_i = di == 1 and i % BLOCK == BLOCK - 1
    crosses_j = (dj == 1 and j % BLOCK == BLOCK - 1) or (dj == -1 and j % BLOCK == 0)
    if (di != 0 and not crosses_i) or (dj != 0 and not crosses_j) or not _open_step(node, i, j, di, dj):
        return False
    if di != 0 and dj != 0:
        return True
    back_i, back_j = i - dj, j - di
    if back_i < 0 or back_j < 0:
        return True
    return node[back_i, back_j] != node[i, j] or node[back_i + di, back_j + dj] != node[i + di, j + dj]


@njit(cache=True)
def block_graph(node, middle, mean):  # pragma: no cover - compiled
    """Return the rows' starts, the columns and the weights (in cells) of the graph of parts that touch each other.

    Parts touch side by side, or at a corner that can be crossed. Some pairs are there twice.
    """
    nx, ny = node.shape
    most = 4 * (nx // BLOCK + 1) * (ny + 1) + 4 * (ny // BLOCK + 1) * (nx + 1)
    pairs = np.empty((most, 2), np.int32)
    count = 0
    degree = np.zeros(middle.shape[0] + 1, np.int32)
    for i in range(nx):
        for j in range(ny):
            if node[i, j] < 0 or (i % BLOCK != BLOCK - 1 and j % BLOCK != BLOCK - 1):
                continue
            for k in range(4):
                di, dj = STEPS[k, 0], STEPS[k, 1]
                if _meets(node, i, j, di, dj):
                    a, b = node[i, j], node[i + di, j + dj]
                    pairs[count, 0], pairs[count, 1] = a, b
                    degree[a + 1] += 1
                    degree[b + 1] += 1
                    count += 1
    starts = np.cumsum(degree).astype(np.int32)
    filled = starts[:-1].copy()
    columns = np.empty(starts[-1], np.int32)
    weights = np.empty(starts[-1], np.float64)
    for n in range(count):
        a, b = pairs[n, 0], pairs[n, 1]
        apart = np.sqrt((middle[a, 0] - middle[b, 0]) ** 2 + (middle[a, 1] - middle[b, 1]) ** 2)
        weight = 0.5 * (mean[a] + mean[b]) * apart
        columns[filled[a]], weights[filled[a]] = b, weight
        columns[filled[b]], weights[filled[b]] = a, weight
        filled[a] += 1
        filled[b] += 1
    return starts, columns, weights


@njit(cache=True)
def _onward(at, end, step):  # pragma: no cover - compiled
    """Return the parts of a line at which it crosses into the next cell along an axis, and between two crossings."""
    if end == at:
        return np.inf, np.inf
    apart = abs(end - at)
    cell = np.floor(at)
    return ((cell + 1 - at) if step > 0 else (at - cell)) / apart, 1.0 / apart


@njit(cache=True)
def _blocked(passable, i, j):  # pragma: no cover - compiled
    return not (0 <= i < passable.shape[0] and 0 <= j < passable.shape[1]) or not passable[i, j]


@njit(cache=True)
def line_cost(ax, ay, bx, by, passable, cost, most):  # pragma: no cover - compiled
    """Return the cost of a straight line (cost of a cell times the length within it).

    It is inf where the line touches a cell that is not passable, a corner included, and where it exceeds ``most``.
    """
    length = np.sqrt((bx - ax) ** 2 + (by - ay) ** 2)
    i, j = int(np.floor(ax)), int(np.floor(ay))
    if _blocked(passable, i, j) or _blocked(passable, int(np.floor(bx)), int(np.floor(by))):
        return np.inf
    step_i, step_j = (1 if bx > ax else -1), (1 if by > ay else -1)
    next_i, delta_i = _onward(ax, bx, step_i)
    next_j, delta_j = _onward(ay, by, step_j)
    at, total = 0.0, 0.0
    while True:
        to = min(next_i, next_j, 1.0)
        total += (to - at) * length * cost[i, j]
        if total > most:
            return np.inf
        if to >= 1.0 - 1e-12:
            return total
        at = to
        if abs(next_i - next_j) < 1e-9 and (
            _blocked(passable, i + step_i, j) or _blocked(passable, i, j + step_j)
        ):  # through a corner: the cells beside it are touched
            return np.inf
        if next_i <= to + 1e-9:
            i += step_i
            next_i += delta_i
        if next_j <= to + 1e-9:
            j += step_j
            next_j += delta_j
        if _blocked(passable, i, j):
            return np.inf


@njit(cache=True)
def path_cost(points, passable, cost):  # pragma: no cover - compiled
    """Return the cost of a path of straight lines; inf where one is blocked."""
    total = 0.0
    for n in range(points.shape[0] - 1):
        a, b = points[n], points[n + 1]
        total += line_cost(a[0], a[1], b[0], b[1], passable, cost, np.inf)
    return total


@njit(cache=True)
def shortcuts(points, passable, cost, window):  # pragma: no cover - compiled
    """Return which points of a path to keep, so that straight lines between them cost least.

    Args:
        points: (n, 2) in cells; neighbours are joined by free straight lines.
        passable: cells that a line may touch.
        cost: of a cell's length within a cell.
        window: limit of the points that a line leaps over.
    """
    count = points.shape[0]
    best = np.full(count, np.inf)
    before = np.zeros(count, np.int64)
    best[0] = 0.0
    for b in range(1, count):
        for back in range(1, min(window, b) + 1):
            a = b - back
            most = best[b] - best[a]
            if np.hypot(points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]) >= most - 1e-9:
                continue  # a cell costs at least 1, so this line costs at least its length
            piece = line_cost(points[a, 0], points[a, 1], points[b, 0], points[b, 1], passable, cost, most)
            if back == 1 and not np.isfinite(piece) and not np.isfinite(best[b]):
                piece = 1e6 + np.hypot(points[a, 0] - points[b, 0], points[a, 1] - points[b, 1])
            if best[a] + piece < best[b]:
                best[b] = best[a] + piece
                before[b] = a
    kept = np.zeros(count, np.bool_)
    at = count - 1
    while at > 0:
        kept[at] = True
        at = before[at]
    kept[0] = True
    return kept


@njit(cache=True)
def room_at(x, y, occupied, reach):  # pragma: no cover - compiled
    """Return the distance from a place to the nearest occupied cell's square, at most ``reach``; all in cells."""
    nx, ny = occupied.shape
    best = reach * reach
    for i in range(max(0, int(np.floor(x - reach))), min(nx, int(np.floor(x + reach)) + 1)):
        dx = max(i - x, x - (i + 1), 0.0)
        if dx * dx >= best:
            continue
        for j in range(max(0, int(np.floor(y - reach))), min(ny, int(np.floor(y + reach)) + 1)):
            if occupied[i, j]:
                dy = max(j - y, y - (j + 1), 0.0)
                if dx * dx + dy * dy < best:
                    best = dx * dx + dy * dy
    return np.sqrt(best)


@njit(cache=True)
def room_along(points, occupied, reach):  # pragma: no cover - compiled
    """Return `room_at` for each of several places."""
    room = np.empty(points.shape[0])
    for n in range(points.shape[0]):
        room[n] = room_at(points[n, 0], points[n, 1], occupied, reach)
    return room


@njit(cache=True)
def mark_visible(x, y, cells, opaque, own):  # pragma: no cover - compiled
    """Return for each cell whether a thing at a place is seen from its middle.

    Args:
        x: of the thing, in cells.
        y: of the thing.
        cells: (n, 2) the cells to look from.
        opaque: what blocks the view.
        own: an opaque cell within this many cells of the thing is the thing itself.
    """
    seen = np.zeros(cells.shape[0], np.bool_)
    nx, ny = opaque.shape
    for n in range(cells.shape[0]):
        dx, dy = cells[n, 0] + 0.5 - x, cells[n, 1] + 0.5 - y
        length = np.hypot(dx, dy)
        steps = int(length / 0.2) + 1
        free = True
        for s in range(int(own / length * steps) if length > 0.0 else steps, steps):
            part = s / steps
            i, j = int(np.floor(x + part * dx)), int(np.floor(y + part * dy))
            if part * length > own and 0 <= i < nx and 0 <= j < ny and opaque[i, j]:
                free = False
                break
        seen[n] = free
    return seen
