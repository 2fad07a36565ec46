"""Planning over a grid of 1000 x 1000 cells: from raw states to a path, stage by stage, beside one exact search.

    python benchmarks/planning.py [--cells 1000] [--repeats 5] [--json]

The floors are drawn at random (walls with doors, boxes) or made to be hard: an open hall, where everything can be
reached, and a serpent, whose path leads through nearly all of it. `exact` is the same search over all cells at once,
its graph made again as well.
"""

from timing import parser, seconds, show, use_one_thread

use_one_thread()

import numpy as np  # noqa: E402

from avlmaps.maps.obstacles import CellState, Obstacles  # noqa: E402
from avlmaps.navigate.costmap import Costmap, costmap_of  # noqa: E402
from avlmaps.navigate.planner import PlannedPath, Planner, PlanSettings  # noqa: E402

CELL_M, RADIUS_M = 0.05, 0.2


def hall(n: int) -> np.ndarray:
    return np.full((n, n), CellState.FREE, np.uint8)


def rooms(n: int) -> np.ndarray:
    """Return rooms of some 5 m with doors and boxes in them, and unseen spots."""
    rng, states = np.random.default_rng(0), hall(n)
    for at in range(100, n, 100):
        for start in range(0, n, 100):
            door = start + int(rng.integers(10, 70))
            for grid in (states, states.T):
                grid[at : at + 3, start : start + 100] = CellState.OCCUPIED
                grid[at : at + 3, door : door + 20] = CellState.FREE
    for kind, count in ((CellState.OCCUPIED, 6), (CellState.UNKNOWN, 2)):
        for _ in range(count * n * n // 10_000):
            i, j = rng.integers(0, n, 2)
            w, d = rng.integers(4, 24, 2)
            states[i : i + w, j : j + d] = kind
    return states


def serpent(n: int) -> np.ndarray:
    states = hall(n)
    for number, at in enumerate(range(40, n - 20, 40)):
        if number % 2:
            states[at : at + 3, 30:] = CellState.OCCUPIED
        else:
            states[at : at + 3, : n - 30] = CellState.OCCUPIED
    return states


def ends(costmap: Costmap) -> tuple[np.ndarray, np.ndarray]:
    """Return the first and the last place of the largest connected part."""
    part = Planner(costmap)._part
    cells = np.argwhere(part == 1 + np.argmax(np.bincount(part.ravel())[1:]))
    return costmap.middle_of(cells[0]), costmap.middle_of(cells[-1])


def way(costmap: Costmap, places: tuple[np.ndarray, np.ndarray], settings: PlanSettings) -> PlannedPath:
    planner = Planner(costmap, settings)
    stop = planner.stop_for(*places)
    found = planner.way(places[0], stop.xy) if stop else None
    if found is None:
        raise SystemExit("no way")
    return found


def main() -> int:
    arguments = parser((__doc__ or "").splitlines()[0])
    arguments.add_argument("--cells", type=int, default=1000)
    arguments.add_argument("--repeats", type=int, default=5)
    chosen = arguments.parse_args()
    exact, rows = PlanSettings(exact_cells=10**9), []
    for make in (rooms, hall, serpent):
        states = make(chosen.cells)
        obstacles = Obstacles(np.eye(3), np.zeros(2), CELL_M, 0.0, states)
        places = ends(costmap_of(obstacles, RADIUS_M))
        inflate_s, plan_s, exact_s = [], [], []
        found = best = None
        for repeat in range(chosen.repeats + 1):
            one, costmap = seconds(costmap_of, obstacles, RADIUS_M)
            two, found = seconds(way, costmap, places, PlanSettings())
            three, best = seconds(way, costmap, places, exact)
            if repeat:  # the first compiles
                inflate_s.append(one)
                plan_s.append(two)
                exact_s.append(three)
        assert found is not None
        assert best is not None
        inflate_ms, plan_ms, exact_ms = (1e3 * float(np.median(times)) for times in (inflate_s, plan_s, exact_s))
        rows.append(
            {
                "floor": make.__name__,
                "inflate_ms": inflate_ms,
                "plan_ms": plan_ms,
                "both_ms": inflate_ms + plan_ms,
                "exact_ms": exact_ms,
                "times_exact": exact_ms / plan_ms,
                "way_m": found.length_m,
                "cost_to_exact": f"{found.cost / best.cost:.3f}",
            }
        )
    title = f"Planning over {chosen.cells} x {chosen.cells} cells of {CELL_M} m"
    facts = {"time": f"processor time of one thread, median of {chosen.repeats} repeats"}
    show(title, rows, facts, chosen.json)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
