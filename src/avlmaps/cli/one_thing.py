"""One question about one thing in a process that answers no other: without the grammar and the compiled loops."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from avlmaps.core.question import Question
    from avlmaps.query.avlmap import AVLMap

_SMALL_MAP = 400_000  # voxels; plain NumPy takes 0.1 s for them


def named_thing(sentence: str, avlmap: "AVLMap") -> "Question | None":
    """Return the question for a thing where a sentence is one of the encoder's names and nothing else.

    Such a name is read as the grammar reads it. Stairs are a thing and an area; the grammar decides which is meant.
    """
    from avlmaps.core.lexicon import Kind, lexicon
    from avlmaps.core.question import Modality, Part, Question
    from avlmaps.perception.protocols import NamedPixelEncoder

    if "pixels" not in avlmap.stored.info.models:
        return None
    encoder = avlmap.stored.profile.pixel_encoder()
    is_name = isinstance(encoder, NamedPixelEncoder) and sentence in encoder.vocabulary
    is_name = is_name and {entry.kind for entry in lexicon().senses(sentence)} == {Kind.THING}
    return Question.of([Part(Modality.OBJECT, sentence)]) if is_name else None


def is_small(avlmap: "AVLMap") -> bool:
    """Return whether plain NumPy answers one question sooner than the compiled loops are loaded."""
    return len(avlmap.stored.voxels) <= _SMALL_MAP


def answer_thing(thing: "Question", avlmap: "AVLMap", top: int) -> dict[str, Any]:
    """Answer a question for one thing without loading compiled loops."""
    from avlmaps.query.loops import plain_loops

    with plain_loops():
        return {**avlmap.ask(thing, top=top).to_json()}
