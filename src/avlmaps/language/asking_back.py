"""Questions back that more than one reader asks."""

from avlmaps.language.intents import Clarify, Kind
from avlmaps.language.names import near_names

_FILES = {
    Kind.IMAGE: "Which picture? Attach it, or name its file in the sentence.",
    Kind.CLIP: "Which recording? Attach it, or name its file in the sentence.",
}


def missing_file(kind: Kind) -> Clarify:
    """Return the question for "this photo" or "this recording" where no file came along.

    Args:
        kind: ``IMAGE`` or ``CLIP``.
    """
    return Clarify(_FILES[kind])


def unknown(name: str) -> Clarify:
    """Return the question for a name whose head is not known."""
    near = tuple(word for word, _ in near_names(name.split()[-1]))[:3]
    hint = f" Did you mean {' or '.join(near)}?" if near else " Say it in another word."
    return Clarify(f"I do not know '{name}'.{hint}", near)
