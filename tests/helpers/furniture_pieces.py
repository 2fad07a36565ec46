"""Pieces of furniture of every family, made once: what the laws of furniture are tried on."""

from collections.abc import Iterator
from functools import cache

import numpy as np

from avlmaps_sim.furniture import Piece, families, make

_SEEDS = 4


@cache
def pieces_of(category: str, name: str) -> tuple[Piece, ...]:
    """Return a few pieces of one family."""
    return tuple(make(category, np.random.default_rng(seed), name=name) for seed in range(_SEEDS))


def every_piece(category: str) -> Iterator[Piece]:
    """Yield the pieces of all families of a category."""
    for name in families(category):
        made = pieces_of(category, name)
        assert {piece.family for piece in made} == {name}
        yield from made
