"""What the readers make of voices that the network was not fitted to: grammar alone, network alone, and both.

Each fold leaves some voices out, fits a network to the others, and reads the voices left out with it. Limits are chosen
on the voices of the other folds.
"""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

from training.language.pool import HELD_OUT
from training.language.rows import lists

from avlmaps.bench.language import OUTCOMES, judge_intents, judge_question, read_list
from avlmaps.core.errors import LanguageError, QueryError
from avlmaps.language.commands import Given, is_plain, read_by_grammar
from avlmaps.language.intents import Clarify, Inquiry, Intent, Reason, Refuse, to_json
from avlmaps.language.learned.agreement import Limits, Weighed, agreed, agreed_question
from avlmaps.language.learned.guard import Guard, weighed
from avlmaps.language.learned.reader import LearnedReader, Read
from avlmaps.language.questions import read_question_by_grammar
from avlmaps.language.readings import Sentence

FOLDS = (
    HELD_OUT,
    frozenset({"dictation", "warehouse", "v02", "v05", "v07", "v10"}),
    frozenset({"child", "nurse", "newcomer", "roboticist", "v04", "v06", "v09", "v12"}),
)
_REFUSED = {"ask": "refuse"}


@dataclass(frozen=True, slots=True)
class Both:
    """A row with what each reader makes of it.

    Attributes:
        row: the row.
        voice: its list.
        sentence: its tokens.
        grammar: the grammar's intents or inquiry; None for a question that it does not read.
        plain: whether the grammar reads each order without doubt.
        command: the network's readings of a command.
        question: the network's readings of a question.
    """

    row: Mapping[str, Any]
    voice: str
    sentence: Sentence
    grammar: "tuple[Intent, ...] | Inquiry | None"
    plain: bool = False
    command: tuple[Weighed, ...] = ()
    question: tuple[Read, ...] = ()


def read_voices(voices: Iterable[str], reader: LearnedReader) -> list[Both]:
    """Return the rows of some voices with what both readers make of them."""
    paths = {path.stem: path for group in ("blind", "voices") for path in lists()[group]}
    return [both(row, voice, reader) for voice in sorted(voices) if voice in paths for row in read_list(paths[voice])]


def by_grammar(row: Mapping[str, Any]) -> "tuple[tuple[Intent, ...] | Inquiry | None, bool]":
    """Return what the grammar makes of a row, and whether that is without doubt."""
    given = Given(row.get("image"), row.get("clip"))
    try:
        if "question" in row:
            return read_question_by_grammar(row["say"], replace(given, knows=lambda _: True)).inquiry, False
        read = read_by_grammar(row["say"], given)
        return read.intents, is_plain(read)
    except QueryError:
        return None, False
    except LanguageError:
        return (Refuse(Reason.UNKNOWN),), False


def both(row: Mapping[str, Any], voice: str, reader: LearnedReader) -> Both:
    """Return a row with what both readers make of it."""
    sentence = Sentence(row["say"], (lambda _: True) if "question" in row else None)
    own, plain = by_grammar(row)
    if "question" in row:
        return Both(row, voice, sentence, own, question=tuple(reader.question(sentence.tokens)))
    reads = reader.command(sentence.tokens)
    checked = tuple(weighed(read, Guard(sentence.names, row.get("image"), row.get("clip"))) for read in reads)
    return Both(row, voice, sentence, own, plain, checked)


def outcome(one: Both, limits: Limits | None, *, who: str = "both") -> str:
    """Return what became of a row: right, harmless, a question back or misread.

    Args:
        one: the row.
        limits: of the agreement.
        who: ``grammar``, ``network`` or ``both``.
    """
    if "question" in one.row:
        return judge_question(_question(one, limits, who), one.row)
    if who == "grammar":
        intents = one.grammar
    elif who == "network":
        intents = one.command[0].intents if one.command else (Clarify(),)
    else:
        assert limits is not None
        assert isinstance(one.grammar, tuple)
        intents = agreed(one.grammar, one.command, limits, plain=one.plain).intents
    assert isinstance(intents, tuple)
    return _judged(one, intents)


_JUDGED: dict[tuple[int, Any], str] = {}


def _judged(one: Both, intents: "tuple[Intent, ...]") -> str:
    key = (id(one.row), intents)
    if key not in _JUDGED:
        _JUDGED[key] = judge_intents([to_json(intent) for intent in intents], one.row)
    return _JUDGED[key]


def _question(one: Both, limits: Limits | None, who: str) -> Any:
    ours = one.grammar if isinstance(one.grammar, Inquiry) else None
    if who == "grammar":
        found = ours
    elif who == "network":
        found = one.question[0].meaning if one.question else None
    else:
        assert limits is not None
        found = agreed_question(ours, one.question, one.sentence.tokens, limits).inquiry
    if not isinstance(found, Inquiry):
        return _REFUSED
    key = (id(one.row), found)
    if key not in _ASKED:
        _ASKED[key] = _checked(one, found)
    return _ASKED[key]


_ASKED: dict[tuple[int, Inquiry], Any] = {}


def _checked(one: Both, found: Inquiry) -> Any:
    """Return a question with its names put right, as JSON."""
    guard = Guard(one.sentence.names, one.row.get("image"), one.row.get("clip"))
    found = Inquiry(found.ask, tuple(guard.put_right(target) for target in found.of))
    if guard.problem is not None or any(target.pick in ("farthest", "other") for target in found.of):
        return _REFUSED
    return found.to_json()


def counted(rows: Sequence[Both], limits: Limits | None, *, who: str, questions: bool) -> Counter[str]:
    """Return how many rows had each outcome."""
    return Counter(outcome(one, limits, who=who) for one in rows if ("question" in one.row) is questions)


def chosen(rows: Sequence[Both], *, most_misread: float = 0.02) -> Limits:
    """Return the limits that read most commands right among those that misread few, and the best for questions."""
    best: tuple[float, Limits] | None = None
    levels = (0.5, 0.7, 0.8, 0.9, 0.95, 0.98)
    for alone, doubtful, over, stop in product(levels, levels, (0.8, 0.9, 0.95, 0.98, 1.1), (0.0, 0.4, 0.6)):
        if doubtful < alone:
            continue
        limits = Limits(alone=alone, doubtful=doubtful, over=over, stop=stop)
        found = counted(rows, limits, who="both", questions=False)
        total = max(1, sum(found.values()))
        worth = found["right"] / total - 6.0 * max(0.0, found["misread"] / total - most_misread)
        if best is None or worth > best[0]:
            best = (worth, limits)
    assert best is not None
    kept = best[1]
    scored: list[tuple[float, Limits]] = []
    for alone, over in product((0.1, 0.2, 0.35, 0.5, 0.7), (0.3, 0.5, 0.7, 0.85, 0.95, 1.1)):
        limits = replace(kept, question_alone=alone, question_over=over)
        found = counted(rows, limits, who="both", questions=True)
        scored.append((found["right"] - 0.5 * found["misread"], limits))
    return max(scored, key=lambda pair: pair[0])[1]


def halves(rows: Sequence[Both]) -> tuple[tuple[list[Both], list[Both]], tuple[list[Both], list[Both]]]:
    """Return two pairs of rows to choose limits on and rows to count, which share no voice."""
    voices = sorted({one.voice for one in rows})
    even = [one for one in rows if voices.index(one.voice) % 2 == 0]
    odd = [one for one in rows if voices.index(one.voice) % 2 == 1]
    return (even, odd), (odd, even)


def table(rows: Sequence[Both], limits: Limits | None) -> list[str]:
    """Return lines: counts of the readers on some rows."""
    lines: list[str] = []
    for questions in (False, True):
        for who in ("grammar", "network", "both"):
            if who == "both" and limits is None:
                continue
            found = counted(rows, limits, who=who, questions=questions)
            total = max(1, sum(found.values()))
            shares = ", ".join(f"{name} {found[name]} ({100 * found[name] / total:.1f} %)" for name in OUTCOMES)
            lines.append(f"{'questions' if questions else 'commands'}, {who}: {shares} of {total}")
    return lines
