"""The votes of the things of a map on what kind of room a place is."""

from collections.abc import Iterable, Mapping, Sequence
from functools import cache

import numpy as np

from avlmaps.core.arrays import Float, Float64
from avlmaps.core.lexicon import Entry, EntryKind, lexicon
from avlmaps.perception.protocols import RoomContents

# A kind of room in which a thing was never counted holds it as often as this share of the mean of all kinds.
_ELSEWHERE = 0.1


@cache
def _log_ratios(contents: RoomContents) -> Float64[np.ndarray, "t r"]:
    return _nats_of(contents, contents.surface_m2)


def _nats_of(contents: RoomContents, surface_m2: Float64[np.ndarray, "t r"]) -> Float64[np.ndarray, "t r"]:
    share = surface_m2 / np.maximum(contents.surface_m2.sum(axis=0), 1e-9)
    usual = share.mean(axis=1, keepdims=True)
    return np.log((share + _ELSEWHERE * usual + 1e-9) / ((1.0 + _ELSEWHERE) * usual + 1e-9))


def votes(things: Sequence[str], kinds: Sequence[str], contents: RoomContents) -> Float[np.ndarray, "t n"]:
    """Return by how much, in nats, a square metre of each thing speaks for each kind of room.

    Args:
        things: names, as an encoder has them; one that the table does not hold speaks for none. A thing speaks against
            no kind of room that its entry of the lexicon lists.
        kinds: kinds of room. One that the table does not hold gets the mean vote of those that it holds, which for
            most things is against it; one that belongs to a kind of the table (a kitchenette) gets that kind's.
        contents: the table.
    """
    ratios, known = _log_ratios(contents), lexicon()
    row_of = {known.find(name, EntryKind.THING): number for number, name in enumerate(contents.things)}
    out = np.zeros((len(things), len(kinds)))
    for number, thing in enumerate(things):
        entry = known.find(thing, EntryKind.THING)
        row = row_of.get(entry)
        if entry is not None and row is not None:
            out[number] = _not_against(_for_kinds(ratios[row], kinds, contents), kinds, (entry,))
    return out


def commonness(things: Sequence[str], kinds: Sequence[str], contents: RoomContents) -> Float[np.ndarray, " n"] | None:
    """Return ln of how many times as common things of some names are in rooms of each kind as in rooms on average.

    Their narrower kinds count as well: a kitchen cabinet is a cabinet.

    Args:
        things: names, all of which are meant.
        kinds: kinds of room; see ``votes``.
        contents: the table.

    Returns:
        Nats; None where the table holds none of them.
    """
    is_a = lexicon().is_a
    rows = [
        number
        for number, name in enumerate(contents.things)
        if any(name == thing or is_a(name, thing, EntryKind.THING) for thing in things)
    ]
    surface_m2 = contents.surface_m2[rows].sum(axis=0, keepdims=True)
    if not surface_m2.any():
        return None
    entries = filter(None, (lexicon().find(thing, EntryKind.THING) for thing in things))
    return _not_against(_for_kinds(_nats_of(contents, surface_m2)[0], kinds, contents), kinds, entries)


def _not_against(
    nats: Float[np.ndarray, " n"], kinds: Sequence[str], entries: Iterable[Entry]
) -> Float[np.ndarray, " n"]:
    """Return nats that speak against no kind of room in which the lexicon says that such things stand.

    The homes that are counted have tables to dine at in dining rooms alone; many a kitchen has one.
    """
    usual = {room for entry in entries for room in entry.rooms}
    return np.where([kind in usual for kind in kinds], np.maximum(nats, 0.0), nats)


def _for_kinds(
    nats: Float64[np.ndarray, " r"], kinds: Sequence[str], contents: RoomContents
) -> Float[np.ndarray, " n"]:
    columns = _columns(tuple(kinds), contents)
    return np.array([nats.mean() if column is None else nats[column] for column in columns])


@cache
def _columns(kinds: tuple[str, ...], contents: RoomContents) -> tuple[int | None, ...]:
    column_of = {lexicon().find(name, EntryKind.ROOM): number for number, name in enumerate(contents.kinds)}
    return tuple(_column(kind, column_of) for kind in kinds)


def _column(kind: str, column_of: Mapping[Entry | None, int]) -> int | None:
    known = lexicon()
    entry = known.find(kind, EntryKind.ROOM) or known.head(kind, EntryKind.ROOM)
    if entry is None:
        return None
    family = (entry, *known.wider(entry.name, EntryKind.ROOM))
    return next((column_of[each] for each in family if each in column_of), None)
