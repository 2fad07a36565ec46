"""The learned reader: the network's few likeliest readings of a sentence, each with its probability.

A search over a few lines at once lets each symbol be only one that the line may continue with (`linear.Grammar`), so
every line that ends means something. Probabilities are the network's own, before that: where it would rather write
nonsense, its readings are unlikely.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache, lru_cache, partial
from importlib.resources.abc import Traversable
from typing import Any

import numpy as np

from avlmaps.core.arrays import Float32
from avlmaps.core.errors import BackendError
from avlmaps.language.learned import linear
from avlmaps.language.learned.english import WEIGHTS, loaded
from avlmaps.language.learned.features import columns, features
from avlmaps.language.lexer import Token
from avlmaps.language.said_places import seeks_source
from avlmaps.perception.embedded.words import words_checksum
from avlmaps.perception.networks import open_network

_BEAM = 4
_MOST_TOKENS = 100
_LEAST = -12.0  # lines less likely than e to this are not followed


@dataclass(frozen=True, slots=True)
class ReadingLimits:
    """How likely a reading must be; chosen on voices that the networks were not fitted to."""

    command: float = 0.7  # to drive
    doubtful: float = 0.85  # the same, of a doubtful reading (`decision.is_doubtful`)
    danger: float = 0.3  # a refusal for danger, to stop
    question: float = 0.4  # to answer a question
    question_doubtful: float = 0.6


@dataclass(frozen=True, slots=True)
class Line:
    """A line that the network wrote, and the logarithm of its probability."""

    symbols: tuple[linear.Symbol, ...]
    log: float


@dataclass(frozen=True, slots=True)
class Read:
    """One reading of a sentence."""

    meaning: linear.Meant
    probability: float  # of all lines that mean this
    used: frozenset[int]  # the tokens that it points at
    is_purpose: bool = False  # names no thing but what it is for: "where can I sit?"


@dataclass(slots=True)
class _Open:
    symbols: tuple[linear.Symbol, ...]
    log: float
    last: linear.Symbol  # what the line goes on from
    first: Float32[np.ndarray, " d"]
    second: Float32[np.ndarray, " d"]


class LearnedReader:
    """Reads sentences with the networks of a folder."""

    def __init__(self, folder: Traversable) -> None:
        """Load the networks; raises BackendError where a file is missing or was made for other inputs."""
        end = ", or make them with 'python -m training.language'"
        facts, graphs = loaded(folder, "The learned reader", "reader", ("words", "step"), end)
        wanted = {"symbols": list(linear.SYMBOLS), "columns": list(columns()), "word_table": words_checksum()}
        for name in (name for name, value in wanted.items() if facts.get(name) != value):
            raise BackendError(
                f"The learned reader was made for another {name.replace('_', ' ')}; make it again with "
                "'python -m training.language'."
            )
        self._vocabulary = {word: at for at, word in enumerate(facts["vocabulary"], start=1)}
        self.limits = ReadingLimits(**facts.get("limits", {}))
        self._words, self._step = map(open_network, graphs)
        # A front may ask for a sentence's lines twice: as a question to lists, then as another.
        self._kept = lru_cache(maxsize=256)(self._written)

    def command(self, tokens: Sequence[Token]) -> list[Read]:
        """Return the readings of a command, the likeliest first; none where it is empty or too long."""
        return self._reads(tokens, is_question=False)

    def question(self, tokens: Sequence[Token]) -> list[Read]:
        """Return the readings of a question, the likeliest first; none where it is empty or too long."""
        return self._reads(tokens, is_question=True)

    def _reads(self, tokens: Sequence[Token], *, is_question: bool) -> list[Read]:
        found: dict[Any, Read] = {}
        for line in self.lines(tokens, is_question=is_question):
            used = frozenset(symbol for symbol in line.symbols if isinstance(symbol, int))
            is_purpose = line.symbols == ("purpose", "end")
            # Where a sound is meant to be makes no other reading.
            key = linear.meaning_of(line.symbols, tokens, is_question=is_question), is_purpose
            if key not in found:
                at_source = partial(seeks_source, tokens, used=used)
                meaning = linear.meaning_of(line.symbols, tokens, is_question=is_question, at_source=at_source)
                found[key] = Read(meaning, 0.0, used, is_purpose)
            found[key] = replace(found[key], probability=found[key].probability + float(np.exp(line.log)))
        return sorted(found.values(), key=lambda read: -read.probability)

    def lines(self, tokens: Sequence[Token], *, is_question: bool) -> list[Line]:
        """Return the likeliest lines for a sentence, the likeliest first."""
        return self._kept(tuple(tokens), is_question) if 0 < len(tokens) <= _MOST_TOKENS else []

    def _written(self, tokens: Sequence[Token], is_question: bool) -> list[Line]:
        grammar = linear.Grammar(linear.Pointable(tokens), is_question=is_question)
        texts = [token.text for token in tokens]
        start = "start_question" if is_question else "start_command"
        seen = features(tokens, self._vocabulary)
        sentence: Any = self._words.run(None, {name: array[None] for name, array in seen._asdict().items()})
        states, begin = sentence
        beam = [_Open((), 0.0, start, begin[0, 0], begin[0, 0])]
        done: list[Line] = []
        for _ in range(linear.MOST_SYMBOLS):
            last = np.array([[_number(one.last)] for one in beam], np.int64)
            outputs: Any = self._step.run(
                None,
                {"last": last, "states": states, "first": np.stack([one.first for one in beam])[None],
                 "second": np.stack([one.second for one in beam])[None]},
            )  # fmt: skip
            said, first, second = outputs
            after: list[tuple[float, int, linear.Symbol, linear.Symbol]] = []
            for at, one in enumerate(beam):
                may = grammar.read(one.symbols)
                assert isinstance(may, linear.Open)
                follows = _following(may, said[at], texts, one)
                after += [(one.log + log, at, symbol, goes_on) for symbol, goes_on, log in follows]
            after.sort(key=lambda each: (-each[0], each[1], str(each[2])))
            opened: list[_Open] = []
            for log, at, symbol, goes_on in after[: _BEAM * 2]:
                if log < _LEAST or len(opened) == _BEAM:
                    break
                symbols = (*beam[at].symbols, symbol)
                if symbol == "end":
                    done.append(Line(symbols, log))
                else:
                    opened.append(_Open(symbols, log, goes_on, first[0, at], second[0, at]))
            done = sorted(done, key=lambda line: -line.log)[:_BEAM]
            best = done[0].log if done else -np.inf
            least = done[-1].log if len(done) == _BEAM else -np.inf  # a line only gets less likely
            beam = [one for one in opened if one.log > max(best - 4.0, least)]
            if not beam:
                break
        return done


def _following(
    may: linear.Open, said: Float32[np.ndarray, " k"], texts: Sequence[str], line: _Open
) -> list[tuple[linear.Symbol, linear.Symbol, float]]:
    """Return what may follow, likely enough to matter, each with what the line goes on from.

    A name's word may stand at any of its places. The line goes on from the place that training takes (`align.py`): the
    first, unless the line has pointed at it; of a further word the one closest behind the word before.
    """
    found: list[tuple[linear.Symbol, linear.Symbol, float]] = [
        (symbol, symbol, float(said[linear.INDEX[symbol]])) for symbol in may.symbols
    ]
    places: dict[str | int, list[int]] = {}
    for at in sorted(may.tokens):
        places.setdefault(texts[at] if may.names else at, []).append(at)
    for alike in places.values():
        logs = said[[_number(at) for at in alike]]
        likeliest = alike[int(logs.argmax())]
        if isinstance(line.last, int):
            goes_on = min(alike, key=lambda at, behind=line.last + 1: abs(at - behind))
        else:
            goes_on = next((at for at in alike if at not in line.symbols), likeliest)
        found.append((likeliest, goes_on, float(np.logaddexp.reduce(logs))))
    return [one for one in found if one[2] > _LEAST]


def _number(symbol: linear.Symbol) -> int:
    return linear.INDEX[symbol] if isinstance(symbol, str) else len(linear.SYMBOLS) + symbol


@cache
def learned_reader() -> LearnedReader:
    """Return the reader that ships; it is loaded at the first call."""
    return LearnedReader(WEIGHTS)
