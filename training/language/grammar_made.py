"""Sentences that the grammar makes: its templates filled at random, with what the chart reads in them.

They carry the grammar's word lists over to the network, so that it has met each word of a class at least once.
"""

import random
from collections.abc import Iterator

from training.language.augment import lexicon_names
from training.language.rows import Example

from avlmaps.core.errors import LanguageError, QueryError
from avlmaps.language.commands import Given, read_command
from avlmaps.language.grammar import Grammar, Part, load_grammar
from avlmaps.language.intents import Refuse
from avlmaps.language.questions import read_question

_DEEPEST = 9
_LENGTHS = ("2 m", "half a metre", "one metre", "3 feet", "two steps", "1.5 metres", "50 cm", "a metre", "10 inches")
_ANGLES = ("30 degrees", "45 degrees", "ninety degrees", "120°", "a hundred degrees", "15 deg")
_DURATIONS = ("5 seconds", "a minute", "ten seconds", "30 s", "two minutes", "half a minute")
_MOST_COST = 0.75


def _text(grammar: Grammar, part: Part, draw: random.Random, deep: int) -> str | None:
    if deep > _DEEPEST:
        return None
    match part.kind:
        case "seq":
            inner = [_text(grammar, one, draw, deep) for one in part.parts]
            return None if None in inner else " ".join(one for one in inner if one)
        case "any":
            return _text(grammar, draw.choice(part.parts), draw, deep)
        case "maybe":
            return _text(grammar, part.parts[0], draw, deep) if draw.random() < 0.3 else ""
        case "many":
            return _text(grammar, part.parts[0], draw, deep) if draw.random() < 0.3 else ""
        case "word":
            return part.name
        case "class":
            return _word(grammar, part.name, draw)
        case _:
            return _text(grammar, draw.choice(grammar.rules[part.name]).body, draw, deep + 1)


def _word(grammar: Grammar, name: str, draw: random.Random) -> str | None:
    names = lexicon_names()
    made = {
        "NUMBER": ("2", "three", "4", "five"), "LENGTH": _LENGTHS, "ANGLE": _ANGLES, "DURATION": _DURATIONS,
        "CLOCK": ("3 o'clock", "nine o'clock", "6 o'clock"), "IMAGE": ("photo.png", "./a/b.jpg"),
        "CLIP": ("bark.wav", "clips/a.mp3"), "NAME": names.things, "NOISE": names.sounds, "ROOM": names.rooms,
    }  # fmt: skip
    if name in ("OPEN", "WORDS", "VERB"):
        return None
    return draw.choice(made[name] if name in made else sorted(grammar.words[name]))


def sentences(count: int, draw: random.Random) -> Iterator[Example]:
    """Yield up to that many sentences; a third of them are questions, a few are refused."""
    grammar = load_grammar()
    made = tries = 0
    while made < count and tries < count * 12:
        tries += 1
        question = tries % 3 == 0
        text = _text(grammar, draw.choice(grammar.rules["question" if question else "order"]).body, draw, 0)
        if not text or len(text.split()) > 22:
            continue
        example = _read_question(text) if question else _read_command(text)
        if example is not None:
            made += 1
            yield example


def _read_command(text: str) -> Example | None:
    try:
        read = read_command(text)
    except LanguageError:
        return None
    cost = read.readings[0].cost
    firm = read.stops is None or (isinstance(read.stops, Refuse) and len(text.split()) > 2)
    if not firm or cost > _MOST_COST or (len(read.readings) > 1 and read.readings[1].cost - cost < 0.3):
        return None
    return Example(text, read.intents, False, "grammar")


def _read_question(text: str) -> Example | None:
    try:
        read = read_question(text, Given(knows=lambda _: True))
    except (QueryError, LanguageError):
        return None
    return Example(text, read.inquiry, True, "grammar") if len(read.inquiry.of) == 1 else None
