"""What was heard from each thing: the sounds whose source it may be."""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from avlmaps.query.contents import Thing
from avlmaps.query.sound_sources import Listening, list_joined, things_that_may_be

if TYPE_CHECKING:
    from avlmaps.maps.store.manifest import Visit
    from avlmaps.query.schema import DayAnswer, HeardFromAnswer

_MOST, _LEAST = 3, 0.1


def with_heard(avlmap: Listening, things: Sequence[Thing], *, are_all: bool = True) -> list[Thing]:
    """Return things with the sounds that may have come from them; as they are where the map does not know that.

    The probability is that of the name of the sound times that the thing is its source. Of several sounds of one source
    the last gives the time.

    Args:
        avlmap: the map.
        things: of it.
        are_all: whether these are all that it lists; else a sound may have come from the others as well.
    """
    if not things or avlmap.stored.sources() is None:
        return list(things)
    rivals = [] if are_all else _others(avlmap.things(), things)
    every = [*things, *rivals]
    heard: list[list[HeardFromAnswer]] = [[] for _ in every]
    sounds, visits = avlmap.sounds(), avlmap.stored.info.visits
    for kind, confidence, one in list_joined(avlmap):
        onset_s = max(sounds[event].onset_s for event in one.events)
        for number, share in things_that_may_be(avlmap.source_map, one, every):
            if kind and confidence * share >= _LEAST:
                row: HeardFromAnswer = {
                    "sound": kind, "probability": round(confidence * share, 3), "onset_s": onset_s
                }  # fmt: skip
                if visits:
                    row["when"] = _day_of(visits, onset_s)
                heard[number].append(row)
    ordered = [sorted(rows, key=lambda row: -row["probability"])[:_MOST] for rows in heard[: len(things)]]
    return [replace(thing, heard=tuple(rows)) for thing, rows in zip(things, ordered, strict=True)]


def _others(every: Sequence[Thing], listed: Sequence[Thing]) -> list[Thing]:
    """Return the things that share less than half of their voxels with those listed."""
    taken = np.concatenate([thing.rows for thing in listed])
    return [thing for thing in every if np.isin(thing.rows, taken).mean() < 0.5]


def _day_of(visits: "Sequence[Visit]", onset_s: float) -> "DayAnswer":
    """Return the visit in which a sound began."""
    number = max((n for n, visit in enumerate(visits) if visit.begin_s <= onset_s + 1e-6), default=0)
    return {"visit": number + 1, "day": visits[number].day or None}
