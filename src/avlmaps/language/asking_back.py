"""Questions back: what is not clear in a sentence, named as exactly as its words allow."""

from collections.abc import Sequence
from itertools import pairwise

from avlmaps.language.intents import Clarify, TargetKind
from avlmaps.language.lexer import Token, is_amount
from avlmaps.language.names import class_words, is_known, may_name, near_names
from avlmaps.language.word_classes import listed
from avlmaps.perception.embedded.words import is_word

_FILES = {
    TargetKind.IMAGE: "Which picture? Attach it, or name its file in the sentence.",
    TargetKind.CLIP: "Which recording? Attach it, or name its file in the sentence.",
}
_PICTURES = frozenset({"photo", "picture", "image", "photograph", "snapshot", "pic"})
_RECORDINGS = frozenset({"recording", "clip"})
_STRAIGHT = frozenset({
    "forward", "forwards", "ahead", "straight", "back", "backward", "backwards", "reverse", "onward", "onwards",
})  # fmt: skip
_TURNS = frozenset({"turn", "rotate", "spin", "pivot"})
_PRONOUNS = ("it", "there", "that", "them", "this")
_SHORT = 3  # letters; shorter words are spelt like too many others
_THESE = frozenset({"this", "that", "the", "my", "attached", "these"})


def is_strange(word: str) -> bool:
    """Return whether a word is none that is known."""
    known = is_word(word) or is_known(word) or may_name(word) or word in class_words()
    return len(word) > _SHORT and word.isalpha() and not known


def missing_file(kind: TargetKind) -> Clarify:
    """Return the question for "this photo" or "this recording" where no file came along."""
    return Clarify(_FILES[kind])


def unknown(name: str) -> Clarify:
    """Return the question for a name whose head is not known."""
    near = tuple(word for word, _ in near_names(name.split()[-1]))[:3]
    hint = f" Did you mean {' or '.join(near)}?" if near else " Say it in another word."
    return Clarify(f"I do not know '{name}'.{hint}", near)


def lacks_file(tokens: Sequence[Token]) -> Clarify | None:
    """Return the question for the file that a sentence speaks of and that did not come along; None where none lacks."""
    words = [token.text for token in tokens]
    for before, word in pairwise(words):
        if before in _THESE and word in _PICTURES | _RECORDINGS:
            kind = TargetKind.IMAGE if word in _PICTURES else TargetKind.CLIP
            return None if any(token.kind == str(kind) for token in tokens) else missing_file(kind)
    return None


def strange_word(tokens: Sequence[Token]) -> str | None:
    """Return the first word of a sentence that is none; None where all are words."""
    return next((token.text for token in tokens if token.kind == "word" and is_strange(token.text)), None)


def unclear(tokens: Sequence[Token]) -> Clarify:
    """Return the question for a command that lacks something: what it lacks, where its words show that."""
    file = lacks_file(tokens)
    if file is not None:
        return file
    words = [token.text for token in tokens]
    for at, word in enumerate(words):
        of_these = at > 0 and words[at - 1] in _THESE
        named = words[at + 1] if at + 1 < len(words) else ""
        if of_these and word in listed("choices") and (named == "one" or is_known(named) or may_name(named)):
            return Clarify(f"I cannot choose the {word} {named} from the map. Say what it is near.")
    strange = strange_word(tokens)
    if strange is not None:
        return unknown(strange)
    names = any(is_known(word) for word in words)
    if not names and not _STRAIGHT.isdisjoint(words) and not any(is_amount(tokens, at) for at in range(len(tokens))):
        return Clarify("How far? Say it like: go forward 2 metres.")
    if not names and not _TURNS.isdisjoint(words):
        choices = ("left", "right", "around")
        return Clarify("Turn which way? Say left, right, around, or an angle.", choices)
    pronoun = next((word for word in _PRONOUNS if word in words), None)
    if not names and pronoun is not None:
        return Clarify(f"What does '{pronoun}' refer to? Name the thing.")
    return Clarify("This is not clear enough to drive. Name each place, and say how far.")
