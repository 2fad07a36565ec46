"""Settings of a query for an encoder of an open vocabulary: the scale of its cosines, and which words are rivals.

Such an encoder gives every word a vector, and words of one sense lie close but not at one place: queried for a couch,
a sofa would win half of its voxels. Words which name the wanted thing, or a kind of it, do not compete; the lexicon
lists them.
"""

from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps.perception.protocols import NamedPixelEncoder, PixelEncoder, ScaledEncoder


def is_a(other: str, wanted: str) -> bool:
    """Return whether what one phrase names is what another wants, by the lexicon.

    A name that an encoder carries a special thing under is one with it: a bag competes with no backpack.

    Args:
        other: ``office chair``.
        wanted: ``chair``, ``chairs`` or ``seat``; a chair is not an office chair.
    """
    known = lexicon()
    if known.is_a(other, wanted, EntryKind.THING):
        return True
    entry, special = known.find(other, EntryKind.THING), known.find(wanted, EntryKind.THING)
    return entry is not None and special is not None and not set(entry.learnt).isdisjoint(special.spellings)


def is_open(encoder: PixelEncoder) -> bool:
    """Return whether an encoder takes any word and has a scale for its cosines."""
    return isinstance(encoder, ScaledEncoder) and not isinstance(encoder, NamedPixelEncoder)
