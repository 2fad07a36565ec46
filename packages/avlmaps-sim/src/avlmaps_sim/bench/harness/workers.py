"""Work on several scenes, in processes of their own where there are several; ends at the first that fails."""

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from typing import TypeVar

from avlmaps.core.progress import progress, say, silence
from avlmaps_sim.processes import end_with_parent, fresh_processes

S = TypeVar("S")
T = TypeVar("T")
_LOOK_S = 2.0


def side_by_side(
    do: Callable[[S], T],
    todo: Sequence[S],
    jobs: int,
    label: str,
    done: Callable[[], int] | None = None,
    total: int | None = None,
) -> list[T]:
    """Return the result of every scene, in their order, and show the progress.

    ``do`` is a function of a module; ``jobs`` 0 is one a core; ``done`` counts the parts, where a scene has several.
    """
    workers = min(jobs or os.cpu_count() or 1, len(todo))
    unit = "scene" if done is None else "episode"
    if workers < 2:
        results: list[T] = []
        for one in todo:
            results.append(do(one))
            say(f"{label}: {len(results)} of {len(todo)} scenes are done")
        return results
    with fresh_processes(workers, _begin) as pool:
        futures = [pool.submit(do, one) for one in todo]
        for _ in progress(_ticks(futures, done), label, total=total or len(todo), unit=unit):
            pass
        return [future.result() for future in futures]


def _begin() -> None:
    end_with_parent()
    silence()


def _ticks(futures: Sequence[Future[T]], done: Callable[[], int] | None) -> Iterator[None]:
    shown, waiting = 0, set(futures)
    while waiting:
        over, waiting = wait(waiting, _LOOK_S, FIRST_COMPLETED)
        for future in over:
            if future.exception() is not None:
                for other in waiting:
                    other.cancel()
                future.result()
        count = len(futures) - len(waiting) if done is None else done()
        yield from [None] * max(count - shown, 0)
        shown = max(shown, count)
