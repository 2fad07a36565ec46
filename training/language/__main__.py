"""`python -m training.language`: fit the learned reader, measure it on voices left out, write it into the package.

A network is fitted without the voices of the first fold, which are then read with it: that is what is measured, and
what the limits of the agreement are chosen on. With `--more` it is then fitted a little more, with all voices.
"""

import argparse
from dataclasses import asdict
from pathlib import Path
from tempfile import TemporaryDirectory

from training.language.export import write
from training.language.fit import fitted
from training.language.leave_out import FOLDS, Both, chosen, halves, read_voices, table
from training.language.network import Network
from training.language.pool import Pool, build, vocabulary, without

from avlmaps.language.learned.reader import LearnedReader

_HERE = Path(__file__).parent
_WEIGHTS = _HERE.parents[1] / "src/avlmaps/language/learned/weights"


def main() -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(prog="python -m training.language", description=__doc__)
    parser.add_argument("--minutes", type=float, default=5.0, help="processor time of a fit (default: %(default)s)")
    parser.add_argument("--more", type=float, default=0.0, help="more of it, with all voices (default: %(default)s)")
    parser.add_argument("--variants", type=int, default=5, help="variants of each row (default: %(default)s)")
    parser.add_argument("--made", type=int, default=0, help="sentences that the grammar makes (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="of every choice (default: %(default)s)")
    parser.add_argument(
        "--folds", type=int, default=1, help="measure on this many folds of voices (default: %(default)s)"
    )
    given = parser.parse_args()
    pool = build(given.variants, given.made, given.seed)
    fits = [_left_out(pool, voices, given.minutes, given.seed) for voices in FOLDS[: given.folds]]
    rows = [row for _, _, each in fits for row in each]
    limits = chosen(rows)
    for number, (_, _, own) in enumerate(fits):
        others = [row for at, (_, _, each) in enumerate(fits) if at != number for row in each]
        for half in halves(own) if not others else ((others, own),):
            print("\n".join(table(half[1], chosen(half[0]))), flush=True)
    network, words, _ = fits[0]
    if given.more > 0.0:
        network = fitted(pool, words, given.more, given.seed + 1, start=network, note="all")
    write(network, words, _WEIGHTS, {"limits": asdict(limits)})


def _left_out(
    pool: Pool, voices: frozenset[str], minutes: float, seed: int
) -> tuple[Network, dict[str, int], list[Both]]:
    """Return a network fitted without some voices, its vocabulary, and what it reads in those voices."""
    rest = without(pool, voices)
    words = vocabulary(rest)
    network = fitted(rest, words, minutes, seed, note=f"without {len(voices)} voices")
    with TemporaryDirectory() as folder:
        write(network, words, Path(folder), {})
        return network, words, read_voices(voices, LearnedReader(Path(folder)))


if __name__ == "__main__":
    main()
