"""What a person is told: intents in plain words before the robot moves, and questions back."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

from avlmaps.core.lexicon import lexicon
from avlmaps.language import intents as act
from avlmaps.language.claims import claimed, claimed_words
from avlmaps.language.intents import Clarify, Intent, Pick, Refuse, Target, TargetKind
from avlmaps.language.lexer import Token
from avlmaps.language.names import class_words, is_known, may_name
from avlmaps.language.word_classes import listed, table
from avlmaps.perception.embedded.words import is_word

MISSING = {
    TargetKind.IMAGE: Clarify("Which picture? Attach it, or name its file in the sentence."),
    TargetKind.CLIP: Clarify("Which recording? Attach it, or name its file in the sentence."),
}
"""The questions for "this photo" and "this recording" where no file came along."""
_SHORT = 3  # letters; shorter words are spelt like too many others
_ORDINALS = {2: "second", 3: "third", 4: "fourth", 5: "fifth", 6: "sixth"}
_ALONE: dict[tuple[Intent, ...], str] = {
    (act.Wait(),): "I will stop and stay here.",
    (act.Return(),): "I will stay here, where this command begins; `avlmaps edit MAP --pin home` pins a home.",
}


def verbalise(intents: Sequence[Intent]) -> str:
    """Return one sentence that says what the robot will do, or why it does nothing."""
    for stop in intents[:1]:
        if isinstance(stop, Refuse | Clarify):
            return stop.said if isinstance(stop, Refuse) else stop.question
    return _ALONE.get(tuple(intents)) or f"I will {_steps(intents)}.".replace(" ,", ",")


class _Words(act.Filled):
    def format_field(self, value: Any, format_spec: str) -> str:
        if isinstance(value, Target):
            return phrase(value).removeprefix("the ") if format_spec == "bare" else phrase(value)
        if isinstance(value, tuple):
            return _steps(value)
        if isinstance(value, float):
            value = round(value, 2 if abs(value) < 10.0 else 1)
        names = table("intents")["names"].get(format_spec)
        if names is None:
            return super().format_field(value, format_spec)
        key = str(value) if isinstance(value, str) else str(round(value))
        return names.get(key, names.get("other")).format(super().format_field(value, ""))


def _steps(intents: Sequence[Intent]) -> str:
    steps = (_Words().vformat(act.row_of(intent).words, (), act.values_of(intent)).rstrip() for intent in intents)
    return ", then ".join(steps).replace(" ,", ",")


def phrase(target: Target) -> str:
    """Return a target in words: "the chair nearest to where breathing was heard"."""
    if target.kind in (TargetKind.OBJECT, TargetKind.AREA):
        own = f"the {_picked(target)}"
    else:
        kind = f"{target.kind} source" if target.at == "source" else target.kind
        own = table("intents")["names"]["targets"][kind].format(target.name)
    areas = [one for one in target.near if one.kind is TargetKind.AREA]
    others = [one for one in target.near if one.kind is not TargetKind.AREA]
    beside = "near" if target.pick is Pick.NEAREST else "nearest to"
    near = f" {beside} {' and '.join(phrase(one) for one in others)}" if others else ""
    return own + near + "".join(f" in {phrase(one)}" for one in areas)


def _picked(target: Target) -> str:
    """Return the name of a thing, and which one of that name: "second nearest chair", "chair furthest to the left"."""
    nth = f"{_ORDINALS[target.number]} " if target.number > 1 else ""
    match target.pick:
        case Pick.ANY:
            return target.name
        case Pick.NEAREST | Pick.FARTHEST | Pick.OTHER:
            return f"{nth}{target.pick} {target.name}"
        case _:
            return f"{nth}{target.name} from the {target.pick}" if nth else f"{target.name} furthest {target.pick}"


def unknown(name: str) -> Clarify:
    """Return the question for a name whose head is not known."""
    near = tuple(word for word, _ in lexicon().suggest(name.split()[-1]))
    hint = f" Did you mean {' or '.join(near)}?" if near else " Say it in another word."
    return Clarify(f"I do not know '{name}'.{hint}", near)


def lacks_file(tokens: Sequence[Token]) -> Clarify | None:
    """Return the question for the file that a sentence speaks of and that did not come along; None where none lacks."""
    words = [token.text for token in tokens]
    for before, word in pairwise(words):
        if before in claimed_words("these") and word in claimed_words("pictures") | claimed_words("recordings"):
            kind = TargetKind.IMAGE if word in claimed_words("pictures") else TargetKind.CLIP
            return None if any(token.kind == str(kind) for token in tokens) else MISSING[kind]
    return None


def strange_word(tokens: Sequence[Token]) -> str | None:
    """Return the first word of a sentence that is none that is known; None where all are known."""
    words = [token.text for token in tokens if token.kind == "word" and token.text.isalpha()]
    strange = (word for word in words if len(word) > _SHORT and word not in class_words() | listed("choices"))
    return next((word for word in strange if not (is_word(word) or is_known(word) or may_name(word))), None)


def unclear(tokens: Sequence[Token]) -> Clarify:
    """Return the question for a command that lacks something: what it lacks, where its words show that."""
    file, strange = lacks_file(tokens), strange_word(tokens)
    if file is None and strange is not None:
        return unknown(strange)
    found = file or claimed("unclear", tokens, frozenset(at for at, one in enumerate(tokens) if is_known(one.text)))
    assert isinstance(found, Clarify)  # the last row fits all
    return found
