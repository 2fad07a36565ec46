"""The description of a map that ``avlmaps info`` prints and the server returns."""

from collections.abc import Callable
from typing import Any

from avlmaps.core.errors import AvlmapsError
from avlmaps.query.avlmap import AVLMap


def map_answer(avlmap: AVLMap, note: Callable[[AvlmapsError], object] = lambda _: None) -> dict[str, Any]:
    """Return the description of a map that ``avlmaps info`` prints: counts, models, sounds with names, rules.

    Args:
        avlmap: the map.
        note: is given the error where the sounds have no names since their model is not here.
    """
    from avlmaps.maps.store.reader import describe
    from avlmaps.query.rules import rules_of

    described = describe(avlmap.stored)
    try:
        events = avlmap.sounds()
    except AvlmapsError as error:
        note(error)
    else:
        described["sounds"] = [
            {**sound, "names": list(event.names), "confidences": list(event.confidences)}
            for sound, event in zip(described["sounds"], events, strict=True)
        ]
    if avlmap.edited:
        described |= {"edits": len(avlmap.edited.edits), "notices": [*described["notices"], *_lost_edits(avlmap)]}
    return {**described, "rules": rules_of(avlmap.stored.info.settings)}


def _lost_edits(avlmap: AVLMap) -> list[str]:
    try:
        return [str(one) for one in avlmap.edited.lost]
    except AvlmapsError as error:
        return [f"The edits are not checked: {error}"]
