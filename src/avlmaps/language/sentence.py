"""From a sentence to a question: what is sought, and what it is near or in.

Small on purpose: one thing and its surroundings. Commands of several steps and spatial relations are another matter.
"""

from functools import cache
from importlib.resources import files
from typing import Any

from avlmaps.core.errors import QueryError
from avlmaps.core.lexicon import Kind, lexicon, undescribed
from avlmaps.core.question import MOST_CHARACTERS, Modality, Part, Question

_EXAMPLE = "the chair near the sound of glass breaking, or: the table in the kitchen"


def is_area(phrase: str) -> bool:
    """Return whether a phrase names an area: "old kitchen" does, "kitchen table" names a thing.

    A toilet is a thing, as in VLMaps, and a room only where something is in it ("the mirror in the toilet") or as
    "toilet room".
    """
    known, plain = lexicon(), phrase.lower()
    bare = undescribed(plain).split()
    tails = [" ".join(words[start:]) for words in (plain.split(), bare) for start in range(len(bare))]
    for tail in tails:
        room, thing = known.find(tail, Kind.ROOM), known.find(tail, Kind.THING)
        if room is not None or thing is not None:
            return room is not None and (thing is None or (room.name == tail != thing.name))
    return False


# The single words that name areas.
AREA_WORDS = frozenset(
    word for entry in lexicon().entries(Kind.ROOM) for word in entry.spellings if " " not in word and is_area(word)
)


def parse_sentence(sentence: str) -> Question:
    """Return the question that a sentence asks; its first part is sought, the others say where it is.

    Raises:
        QueryError: the sentence is empty, too long, or of no form that is understood; it names the place.
    """
    from lark.exceptions import UnexpectedEOF, UnexpectedInput, UnexpectedToken

    if not sentence.strip(" \t\r\n.,?!"):
        raise QueryError(f"The sentence is empty; say what is sought, such as: {_EXAMPLE}.")
    if len(sentence) > MOST_CHARACTERS:
        raise QueryError(
            f"The sentence has {len(sentence)} characters, more than {MOST_CHARACTERS}; say it shorter, like: "
            f"{_EXAMPLE}."
        )
    try:
        tree = _parser().parse(sentence)
    except UnexpectedInput as fault:
        at_end = isinstance(fault, UnexpectedEOF) or (isinstance(fault, UnexpectedToken) and fault.token.type == "$END")
        raise QueryError(_not_understood(sentence, None if at_end else fault.pos_in_stream or 0)) from fault
    return Question.of(_parts(tree))


@cache
def _parser() -> Any:
    from lark import Lark

    grammar = files("avlmaps.language").joinpath("sentence.lark").read_text(encoding="utf-8")
    return Lark(grammar, parser="lalr", lexer="contextual", maybe_placeholders=False)


def _not_understood(sentence: str, at: int | None) -> str:
    if at is None:
        return f"The sentence {sentence!r} ends too early; say it like: {_EXAMPLE}."
    word, before = sentence[at:].split(maxsplit=1)[0], sentence[:at].strip()
    where = f"after {before!r}" if before else "at the start"
    return f"{word!r} is not understood {where} of the sentence; say it like: {_EXAMPLE}."


def _parts(tree: Any) -> list[Part]:
    """Return the parts of a parsed sentence in their order."""
    parts: list[Part] = []
    for node in tree.children:
        if isinstance(node, str):
            continue
        inner = _parts(node) if node.data in ("near", "within", "more") else [_part(node)]
        parts += [_as_room(part) for part in inner] if node.data == "within" else inner
    return parts


def _as_room(part: Part) -> Part:
    """Return what something is in: a toilet as the room."""
    is_toilet = part.modality is Modality.OBJECT and part.query.lower() == "toilet"
    return Part(Modality.AREA, part.query) if is_toilet else part


def _part(node: Any) -> Part:
    """Return the part that one sound, picture or thing of the sentence stands for."""
    inner = [child for child in node.children if not isinstance(child, str)]
    if node.data == "heard" or (node.data == "sound" and inner and inner[0].data in ("sound", "clip", "sound_verb")):
        return _part(inner[0])
    if node.data == "clip":
        return Part(Modality.SOUND, _file(node, "CLIP_FILE"), is_file=True)
    if node.data == "picture":
        return Part(Modality.IMAGE, _file(node, "IMAGE_FILE"), is_file=True)
    words = [word for phrase in inner for word in _words(phrase)]
    if node.data == "sound_verb":
        verb = next(str(token) for token in node.children if getattr(token, "type", "") == "SOUND_VERB")
        return Part(Modality.SOUND, f"{' '.join(words)} {verb.lower()}")
    if node.data == "sound":
        return Part(Modality.SOUND, " ".join(words))
    phrase = " ".join(words)
    return Part(Modality.AREA if is_area(phrase) else Modality.OBJECT, phrase)


def _words(phrase: Any) -> list[str]:
    words: list[str] = []
    for child in phrase.children:
        words += [str(child)] if isinstance(child, str) else _words(child)
    return words


def _file(node: Any, kind: str) -> str:
    return next(str(token) for token in node.children if getattr(token, "type", "") == kind).strip("\"'")
