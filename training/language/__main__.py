"""`python -m training.language`: fit the learned reader, measure it on voices left out, write it into the package.

A few networks that differ in their first weights are fitted without the voices of the first fold; those voices are then
read with the mean of the networks. That is what is measured, and what the limits of the decision are chosen on. With
`--more` each network is then fitted a little more, with all voices. With `--start` the networks that ship are fitted.
"""

import argparse
import multiprocessing
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

from training.language.export import write
from training.language.fit import fitted
from training.language.leave_out import FOLDS, Heard, chosen, halves, read_voices, table
from training.language.network import Network
from training.language.pool import Pool, build, vocabulary, without
from training.language.unfold import unfolded

from avlmaps.language.learned.reader import LearnedReader

_HERE = Path(__file__).parent
_WEIGHTS = _HERE.parents[1] / "src/avlmaps/language/learned/weights"


def main() -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(prog="python -m training.language", description=__doc__)
    parser.add_argument("--minutes", type=float, default=20.0, help="processor time of a fit (default: %(default)s)")
    parser.add_argument("--more", type=float, default=0.0, help="more of it, with all voices (default: %(default)s)")
    parser.add_argument("--networks", type=int, default=3, help="networks that read together (default: %(default)s)")
    parser.add_argument("--processes", type=int, default=2, help="fitted at once (default: %(default)s)")
    parser.add_argument("--variants", type=int, default=5, help="variants of each row (default: %(default)s)")
    parser.add_argument("--made", type=int, default=8000, help="plain sentences besides (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="of every choice (default: %(default)s)")
    parser.add_argument(
        "--folds", type=int, default=1, help="measure on this many folds of voices (default: %(default)s)"
    )
    parser.add_argument("--start", action="store_true", help="fit the networks that ship further, more gently")
    given = parser.parse_args()
    pool = build(given.variants, given.made, given.seed)
    seeds = range(given.seed, given.seed + given.networks)
    begun = unfolded(_WEIGHTS) if given.start else None
    fits = [_left_out(pool, voices, given.minutes, seeds, given.processes, begun) for voices in FOLDS[: given.folds]]
    rows = [row for _, _, each in fits for row in each]
    limits = chosen(rows)
    for number, (_, _, own) in enumerate(fits):
        others = [row for at, (_, _, each) in enumerate(fits) if at != number for row in each]
        for half in halves(own) if not others else ((others, own),):
            print("\n".join(table(half[1], chosen(half[0]))), flush=True)
    networks, words, _ = fits[0]
    if given.more > 0.0:
        goes_on = [
            partial(fitted, pool, words, given.more, seed + 1000, start=network, note=f"all, {seed}")
            for seed, network in zip(seeds, networks, strict=True)
        ]
        networks = _at_once(goes_on, given.processes)
    write(networks, words, _WEIGHTS, {"limits": asdict(limits)})


def _left_out(
    pool: Pool,
    voices: frozenset[str],
    minutes: float,
    seeds: Sequence[int],
    processes: int,
    begun: tuple[list[Network], dict[str, int]] | None = None,
) -> tuple[list[Network], dict[str, int], list[Heard]]:
    """Return networks fitted without some voices, their vocabulary, and what they read in those voices."""
    rest = without(pool, voices)
    starts, words = begun or ([None] * len(seeds), vocabulary(rest))
    note = f"without {len(voices)} voices"
    networks = _at_once(
        [
            partial(fitted, rest, words, minutes, seed, start=start, note=f"{note}, {seed}")
            for seed, start in zip(seeds, starts, strict=True)
        ],
        processes,
    )
    with TemporaryDirectory() as folder:
        write(networks, words, Path(folder), {})
        return networks, words, read_voices(voices, LearnedReader(Path(folder)))


_TASKS: list[Callable[[], Network]] = []  # a fork finds them here: a pool of examples is not sent


def _at_once(tasks: Sequence[Callable[[], Network]], processes: int) -> list[Network]:
    """Return the networks that some tasks fit, a few at a time, each in a process of its own."""
    _TASKS[:] = tasks
    with ProcessPoolExecutor(processes, mp_context=multiprocessing.get_context("fork")) as workers:
        return list(workers.map(_task, range(len(tasks))))


def _task(number: int) -> Network:
    return _TASKS[number]()


if __name__ == "__main__":
    main()
