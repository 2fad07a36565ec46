"""What the reader makes of voices that its networks were not fitted to, and the limits that are chosen there.

Each fold leaves some voices out, fits networks to the others, and reads the voices left out with them. Limits are
chosen on the voices of the other folds.
"""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

from training.language.pool import HELD_OUT
from training.language.rows import lists

from avlmaps.core.errors import QueryError
from avlmaps.language.commands import weighed_readings
from avlmaps.language.intents import Clarify, Intent, to_json
from avlmaps.language.learned.decision import Weighed, decided, is_same
from avlmaps.language.learned.reader import LearnedReader, Read, ReadingLimits
from avlmaps.language.questions import asked, by_name
from avlmaps.language.sentence import Attachments, Sentence
from avlmaps_sim.bench.language import OUTCOMES, judge_intents, judge_question, read_list, told

FOLDS = (
    HELD_OUT,
    frozenset({"abroad", "guests", "v01", "v03", "v08", "v11"}),
    frozenset({"dictation", "warehouse", "v02", "v05", "v07", "v10", "v13", "v14", "v21"}),
    frozenset({"child", "nurse", "newcomer", "roboticist", "v04", "v06", "v09", "v12", "v15", "v23"}),
)
_REFUSED = {"ask": "refuse"}
_EACH_MISREAD = 4.0  # commands right that are worth one misread


@dataclass(frozen=True, slots=True)
class Heard:
    """A row with what the networks read in it.

    Attributes:
        row: the row.
        voice: its list.
        reader: the networks.
        sentence: its tokens.
        command: the readings of a command.
        question: the readings of a question.
    """

    row: Mapping[str, Any]
    voice: str
    reader: LearnedReader
    sentence: Sentence
    command: tuple[Weighed, ...] = ()
    question: tuple[Read, ...] = ()


def read_voices(voices: Iterable[str], reader: LearnedReader) -> list[Heard]:
    """Return the rows of some voices with what the networks read in them."""
    paths = {path.stem: path for group in ("blind", "voices") for path in lists()[group]}
    return [heard(row, voice, reader) for voice in sorted(voices) if voice in paths for row in read_list(paths[voice])]


def heard(row: Mapping[str, Any], voice: str, reader: LearnedReader) -> Heard:
    """Return a row with what the networks read in it."""
    given = Attachments(row.get("image"), row.get("clip"))
    if "question" in row:
        sentence = Sentence(row["say"], replace(given, knows=lambda _: True))
        return Heard(row, voice, reader, sentence, question=tuple(reader.question(sentence.tokens)))
    sentence = Sentence(row["say"], given)
    return Heard(row, voice, reader, sentence, weighed_readings(sentence, reader))


def outcome(one: Heard, limits: ReadingLimits) -> str:
    """Return what became of a row: right, harmless, a question back or misread."""
    if "question" in one.row:
        try:
            found = by_name(one.sentence) or asked(one.sentence, one.question, limits)
            got: Any = told(found.inquiry)
        except QueryError:
            got = _REFUSED
        return judge_question(got, one.row)
    if not one.command:
        return _judged(one, (Clarify(),))
    return _judged(one, decided(one.command, limits).intents)


_JUDGED: dict[tuple[int, Any], str] = {}


def _judged(one: Heard, intents: "tuple[Intent, ...]") -> str:
    key = (id(one.row), intents)
    if key not in _JUDGED:
        _JUDGED[key] = judge_intents([to_json(intent) for intent in intents], one.row)
    return _JUDGED[key]


def counted(rows: Sequence[Heard], limits: ReadingLimits, *, questions: bool) -> Counter[str]:
    """Return how many rows had each outcome."""
    return Counter(outcome(one, limits) for one in rows if ("question" in one.row) is questions)


def chosen(rows: Sequence[Heard]) -> ReadingLimits:
    """Return the limits that are worth most: a command misread costs several that are right."""
    levels = (0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.85, 0.9, 0.95)
    kept = ReadingLimits()
    best = -float("inf")
    for danger in (0.1, 0.3, 0.5):
        # What each row is worth where the robot may act on its reading, and where it may not; and how likely that is.
        told = [_worths(one, danger) for one in rows if "question" not in one.row and one.command]
        for command, doubtful in product(levels, levels):
            if doubtful >= command:
                worth = sum(acts if likely >= (doubtful if doubt else command) else asks
                            for likely, doubt, acts, asks in told)  # fmt: skip
                if worth > best:
                    best, kept = worth, ReadingLimits(command=command, doubtful=doubtful, danger=danger)
    scored: list[tuple[float, ReadingLimits]] = []
    levels = (0.1, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)
    for question, doubtful in product(levels, levels):
        if doubtful >= question:
            limits = replace(kept, question=question, question_doubtful=doubtful)
            found = counted(rows, limits, questions=True)
            scored.append((found["right"] - 1.0 * found["misread"], limits))
    return max(scored, key=lambda pair: pair[0])[1]


def _worths(one: Heard, danger: float) -> tuple[float, bool, float, float]:
    """Return the largest limit at which a row is acted on, whether it is doubtful, and its worths acting and asking."""
    acts, asks = (decided(one.command, ReadingLimits(limit, limit, danger)).intents for limit in (0.0, 2.0))
    best = one.command[0]
    likely = sum(each.probability for each in one.command if each.stops is None and is_same(each.intents, best.intents))
    worth = {"right": 1.0, "harmless": 1.0, "asked back": 0.0, "misread": -_EACH_MISREAD}
    return likely, best.doubtful, worth[_judged(one, acts)], worth[_judged(one, asks)]


def halves(rows: Sequence[Heard]) -> tuple[tuple[list[Heard], list[Heard]], tuple[list[Heard], list[Heard]]]:
    """Return two pairs of rows to choose limits on and rows to count, which share no voice."""
    voices = sorted({one.voice for one in rows})
    even = [one for one in rows if voices.index(one.voice) % 2 == 0]
    odd = [one for one in rows if voices.index(one.voice) % 2 == 1]
    return (even, odd), (odd, even)


def table(rows: Sequence[Heard], limits: ReadingLimits) -> list[str]:
    """Return lines: counts of some rows, acting on any reading and with limits."""
    lines: list[str] = []
    for questions in (False, True):
        for name, given in (("any reading", ReadingLimits(0.0, 0.0, 1.1, 0.0, 0.0)), ("with limits", limits)):
            found = counted(rows, given, questions=questions)
            total = max(1, sum(found.values()))
            shares = ", ".join(f"{name} {found[name]} ({100 * found[name] / total:.1f} %)" for name in OUTCOMES)
            lines.append(f"{'questions' if questions else 'commands'}, {name}: {shares} of {total}")
    return lines
