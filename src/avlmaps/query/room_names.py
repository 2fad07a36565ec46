"""Rooms by their numbers: of two bathrooms the lists of a map call one "bathroom 1", and a question may say so too."""

import re
from typing import TYPE_CHECKING

from avlmaps.core.errors import AvlmapsError

if TYPE_CHECKING:
    from avlmaps.query.queryable import Queryable

_UNITS = "m|cm|metres?|meters?|feet|steps?|times|degrees?|seconds?|minutes?"
# A word and a number behind it, which counts nothing ("the kitchen 2 m ahead"): most sentences hold none.
_NUMBERED = re.compile(rf"[^\W\d_] [1-9]\d{{0,2}}\b(?!\.\d| ?({_UNITS})\b)", re.IGNORECASE)


def numbered_rooms(avlmap: "Queryable") -> dict[str, int]:
    """Return the region of each room that shares its name with others, by the name that the lists of the map give it.

    A map whose rooms are not known, or are groups of views without walls, has none.
    """
    from avlmaps.query.contents import numbered  # most questions need neither
    from avlmaps.query.found_edits import plain_name

    try:
        rooms = avlmap.rooms() if "views" in avlmap.stored.info.models else []
    except AvlmapsError:  # its encoder is not here: a question of something else needs none
        return {}
    names = numbered([room.name for room in rooms])
    return {
        plain_name(name): room.region
        for name, room in zip(names, rooms, strict=True)
        if name != room.name and room.region >= 0
    }


def region_named(avlmap: "Queryable", phrase: str) -> int | None:
    """Return the region of the room that a phrase names with its number; None where it names none so.

    What a person called so goes before what the lists number.
    """
    if not _NUMBERED.search(phrase) or avlmap.edited.knows(phrase):
        return None
    from avlmaps.query.found_edits import plain_name

    return avlmap.numbered_rooms.get(plain_name(phrase))


def own_names(avlmap: "Queryable", sentence: str) -> tuple[tuple[str, bool], ...]:
    """Return the names that are this map's own, and whether each is that of a room.

    Args:
        avlmap: the map.
        sentence: the rooms are looked for only where it holds a word with a number behind.
    """
    rooms = avlmap.numbered_rooms if _NUMBERED.search(sentence) else ()
    return (*avlmap.edited.own_names, *((name, True) for name in rooms))
