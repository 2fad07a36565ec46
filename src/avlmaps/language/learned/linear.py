"""Intents as a line of symbols: what the network writes, one symbol at a time, and what it means.

A symbol is one of `SYMBOLS`, or points at a token: the words of a name are tokens of the sentence, one after the other,
and an amount is the token where the lexer finds it. No name holds a word that was not said; no number is made up.
A target is its kind, its words, a pick, and what it is near; an amount stands before the target::

    stop_at ^5 object ^9 ^10 near area ^13 end      "stop 2 m from the blue chair in the hall"

`ROWS` is the table of the intents: a row is one way to write an intent, the symbols that begin it and its fields in the
order in which they are written. Lines are read by it here, and written by it in `training.language.linearise`. A new
intent is a new row here, and rows of `intents.toml`. The networks know `SYMBOLS` by their numbers, so another order
needs other networks.
"""

from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum, auto
from functools import cached_property
from typing import Any, TypeVar

from avlmaps.language import intents, lexer
from avlmaps.language.intents import Inquiry, Intent, Pick, Target, TargetKind
from avlmaps.language.lexer import Token


class Slot(Enum):
    """What is written in a place of a line that is no amount."""

    TARGET = auto()
    BODY = auto()  # intents, one or more
    STEPS = auto()  # intents, or none


@dataclass(frozen=True, slots=True)
class Amount:
    """An amount: a pointer to where it is said, or a symbol for one that is said without a number."""

    of: str  # of `lexer.READS`
    said: Mapping[str, float] = field(default_factory=dict)  # the symbols and what they stand for: "a bit", "around"
    optional: bool = False
    sign: int = 1  # −1 where the value is the negative amount; half a turn is 180 degrees either way
    wraps: bool = False  # whether it is a heading, from 0 to 360 degrees

    def value(self, amount: float) -> float:
        """Return the value of a field for an amount."""
        if self.of == "n":
            return int(amount)
        if self.wraps:
            return amount % 360.0
        return amount if self.sign > 0 or (self.of == "deg" and amount == 180.0) else -amount


@dataclass(frozen=True)
class Row:
    """One way to write an intent."""

    symbols: tuple[str, ...]  # what begins it
    intent: type[intents.Intent]
    # In the order in which they are written: an `Amount`, a `Slot`, a pair of those, or what the symbols stand for.
    fields: Mapping[str, Any]

    @cached_property
    def slots(self) -> tuple[Slot | Amount, ...]:
        """What is written behind the symbols."""
        every = [one for each in self.fields.values() for one in (each if isinstance(each, tuple) else (each,))]
        return tuple(one for one in every if isinstance(one, Amount | Slot))


def _row(symbols: str, intent: type[intents.Intent], **fields: Any) -> Row:
    return Row(tuple(symbols.split()), intent, fields)


# Amounts that are said without a number: "around", "a quarter turn", "a bit", "twice".
DEGREES = {"d30": 30.0, "d45": 45.0, "d90": 90.0, "d135": 135.0, "d180": 180.0, "d270": 270.0, "d360": 360.0}
HEADINGS = {f"h{at}": float(at) for at in range(0, 360, 45)}
TIMES = {"twice": 2.0, "thrice": 3.0}
VIEWS = {"views_2": 2.0, "views_3": 3.0, "views_4": 4.0}
BIT = {"bit": 0.5}
_METRES = Amount("m", BIT)
ROWS = (
    _row("go", intents.Go, to=Slot.TARGET),
    _row("face", intents.Face, to=Slot.TARGET, side=intents.Side.AHEAD),
    *(
        _row(f"face_{side}", intents.Face, to=Slot.TARGET, side=side)
        for side in (intents.Side.LEFT, intents.Side.RIGHT, intents.Side.BEHIND)
    ),
    _row("turn", intents.Turn, degrees=Amount("clock"), heading=None),
    _row("turn left", intents.Turn, degrees=Amount("deg", DEGREES, sign=-1), heading=None),
    _row("turn right", intents.Turn, degrees=Amount("deg", DEGREES), heading=None),
    _row("turn_to", intents.Turn, degrees=None, heading=Amount("deg", HEADINGS, wraps=True)),
    _row("forward", intents.Move, metres=_METRES),
    _row("back", intents.Move, metres=Amount("m", BIT, sign=-1)),
    _row("between", intents.Between, of=(Slot.TARGET, Slot.TARGET)),
    *(
        _row(f"beside_{side}", intents.Beside, metres=Amount("m", BIT, optional=True), of=Slot.TARGET, side=side)
        for side in intents.Side
        if side is not intents.Side.AHEAD
    ),
    _row("stop_at", intents.StopAt, metres=_METRES, of=Slot.TARGET),
    _row("circle", intents.Circle, of=Slot.TARGET, views=None),
    _row("views", intents.Circle, views=Amount("n", VIEWS), of=Slot.TARGET),
    _row("each", intents.VisitEach, of=Slot.TARGET),
    _row("wait", intents.Wait, seconds=Amount("s", optional=True)),
    _row("return", intents.Return),
    _row("repeat", intents.Repeat, times=Amount("n", TIMES), body=Slot.BODY),
    _row("if", intents.If, of=Slot.TARGET, body=Slot.STEPS, otherwise=Slot.STEPS),
    *(_row(f"refuse_{reason}", intents.Refuse, reason=reason) for reason in intents.RefusalReason),
    _row("clarify", intents.Clarify),
)
ASKS = {f"ask_{ask}": ask for ask in intents.Ask}
KINDS = tuple(str(kind) for kind in intents.TargetKind)
PICKS = {f"pick_{pick}": pick for pick in Pick if pick}
NUMBERS = {f"number_{number}": number for number in range(2, 7)}  # "the second nearest", "third from the left"
LEAST = Amount("n", {symbol: float(number) for symbol, number in zip(NUMBERS, range(2, 7), strict=True)}, optional=True)
"""At least so many: "more than one" is two."""
STOPS = tuple(row.symbols[0] for row in ROWS if row.intent in (intents.Refuse, intents.Clarify))  # they end a line
STARTS = tuple(dict.fromkeys(row.symbols[0] for row in ROWS if row.symbols[0] not in STOPS))
SYMBOLS = (
    "start_command", "start_question", "end", *STARTS, "close", *STOPS, "refuse", "purpose", *ASKS, *KINDS, *PICKS,
    *NUMBERS, "near", "inside", "left", "right", *DEGREES, *HEADINGS, *TIMES, *VIEWS, *BIT,
)  # fmt: skip
INDEX = {symbol: at for at, symbol in enumerate(SYMBOLS)}


MOST_SYMBOLS = 80
_MOST_WORDS = 6

T = TypeVar("T")
Symbol = str | int  # an entry of `SYMBOLS`, or the token that is pointed at


class MalformedError(ValueError):
    """A line of symbols that means nothing."""


def amount(tokens: Sequence[Token], at: int, of: str) -> float | None:
    """Return the amount of a kind that begins at a token, in metres, degrees, seconds, or a count; None without one."""
    words = list(tokens)
    found = lexer.READS[of](words, at) or (lexer.number_at(words, at) if of != "clock" else [])
    value = max(found, key=lambda one: one[0])[1] if found else None
    return None if value is None or (of == "n" and value != int(value)) else value


def amount_end(tokens: Sequence[Token], at: int) -> int:
    """Return where the longest amount that begins at a token ends; the token itself where none does."""
    if at >= len(tokens) or not lexer.begins_amount(tokens[at]):
        return at
    words = list(tokens)
    return max((end for read in lexer.READS.values() for end, _ in read(words, at)), default=at)


@dataclass(frozen=True, slots=True)
class Open:
    """What may follow a line: symbols, and tokens to point at; with ``names`` these are words of a name."""

    symbols: frozenset[str] = frozenset()
    tokens: frozenset[int] = frozenset()
    names: bool = False

    def __contains__(self, symbol: Symbol) -> bool:
        return symbol in (self.tokens if isinstance(symbol, int) else self.symbols)

    def __or__(self, other: "Open") -> "Open":
        return Open(self.symbols | other.symbols, self.tokens | other.tokens)


class Pointable:
    """Which tokens of a sentence each kind of pointer may point at."""

    def __init__(self, tokens: Sequence[Token]) -> None:
        self.tokens = tokens
        self.words = frozenset(i for i, t in enumerate(tokens) if t.kind in ("word", "number") or t.text == "&")
        self.files = {kind: frozenset(i for i, t in enumerate(tokens) if t.kind == kind) for kind in ("image", "clip")}
        self._amounts: dict[str, frozenset[int]] = {}

    def amounts(self, of: str) -> frozenset[int]:
        """Return the tokens where an amount of a kind begins."""
        if of not in self._amounts:
            found = {i: amount(self.tokens, i, of) for i in range(len(self.tokens))}
            said = (i for i, value in found.items() if value is not None and (value > 0.0 or of == "clock"))
            self._amounts[of] = frozenset(said)
        return self._amounts[of]


Meant = tuple[Intent, ...] | Inquiry | None  # of a line; None of a question without an answer
AtSource = Callable[[Sequence[int]], bool]  # whether the words of a sound mean the place where it came from
Reading = Generator[Open, Symbol, T]  # says what may follow, takes a symbol, and returns what was read
_STARTS = Open(frozenset(STARTS))
_CLOSE = Open(frozenset({"close"}))
_INSIDE = {  # what is repeated holds nothing that holds others
    Slot.BODY: Open(frozenset(STARTS) - {"repeat", "if"}), Slot.STEPS: Open(frozenset(STARTS) - {"repeat"}),
}  # fmt: skip
_END = Open(frozenset({"end"}))


class Grammar:
    """The grammar of lines for one sentence: it says what may follow a line, and what a line means."""

    def __init__(self, can: Pointable, *, is_question: bool, at_source: AtSource = lambda _: False) -> None:
        self.can, self.is_question, self.at_source = can, is_question, at_source
        self.next: Symbol = ""
        self.kinds = Open(frozenset(KINDS) - ({"here"} if is_question else frozenset()))

    def read(self, line: Iterable[Symbol]) -> Open | Meant:
        """Return what may follow a line; of one that has ended its meaning.

        Raises MalformedError where a symbol stands where it may not.
        """
        reading = self._question() if self.is_question else self._command()
        may = next(reading)
        symbols = iter(line)
        for symbol in symbols:
            if symbol not in may:
                raise MalformedError(f"{symbol} stands where one of {sorted(may.symbols)} should")
            try:
                may = reading.send(symbol)
            except StopIteration as ended:
                if next(symbols, None) is not None:
                    raise MalformedError("the line ends too late") from None
                return ended.value
        return may

    def _see(self, may: Open) -> Reading[Symbol]:
        self.next = yield may
        return self.next

    def _command(self) -> Reading[tuple[Intent, ...]]:
        yield from self._see(Open(frozenset((*STARTS, *STOPS))))
        found: list[Intent] = []
        while self.next != "end":
            found.append((yield from self._intent(_END if self.next in STOPS else _STARTS | _END)))
        return tuple(found)

    def _question(self) -> Reading[Inquiry | None]:
        symbol = yield from self._see(Open(frozenset((*ASKS, "refuse", "purpose"))))
        targets, number = list[Target](), None
        asks = ASKS.get(str(symbol))
        if asks is not None and asks.is_numbered:
            yield from self._see(self._begin((LEAST, Slot.TARGET), _END))
            number = yield from self._field(LEAST, self.kinds, is_last=False)
        else:
            yield from self._see(_END if asks is None or asks.of_map else self.kinds)
        while self.next != "end":
            further = asks is not None and (not asks.is_listed or (asks.of_two and not targets))
            last = asks is None or not asks.of_two or bool(targets)
            after = (self.kinds if further else Open()) | (_END if last else Open())
            targets.append((yield from self._target(after)))
        return None if asks is None else Inquiry(asks, tuple(targets), number or 1)

    def _intent(self, after: Open) -> Reading[Intent]:
        """Read an intent that begins with the next symbol; ``after`` is what may follow it."""
        row, *others = sorted((row for row in ROWS if row.symbols[0] == self.next), key=lambda row: len(row.symbols))
        further = {other.symbols[1]: other for other in others}
        yield from self._see(Open(frozenset(further)) | self._begin(row.slots, after))
        if self.next in further:
            row = further[str(self.next)]
            yield from self._see(self._begin(row.slots, after))
        left, values = list(row.slots), dict[str, Any]()
        for name, of in row.fields.items():
            parts: list[Any] = []
            for each in of if isinstance(of, tuple) else (of,):
                if isinstance(each, Amount | Slot):
                    del left[0]
                    each = yield from self._field(each, self._begin(left, after), is_last=not left)
                parts.append(each)
            values[name] = tuple(parts) if isinstance(of, tuple) else parts[0]
        return row.intent(**values)

    def _begin(self, slots: Sequence[Slot | Amount], after: Open) -> Open:
        if not slots:
            return after
        slot = slots[0]
        if isinstance(slot, Amount):
            found = Open(frozenset(slot.said), self.can.amounts(slot.of))
            return found | self._begin(slots[1:], after) if slot.optional else found
        if slot is Slot.TARGET:
            return self.kinds
        return _INSIDE[slot] | (_CLOSE if slot is Slot.STEPS else Open())

    def _field(self, of: Slot | Amount, after: Open, *, is_last: bool) -> Reading[Any]:
        if of is Slot.TARGET:
            return (yield from self._target(after))
        if isinstance(of, Slot):
            body: list[Intent] = []
            while self.next != "close":
                body.append((yield from self._intent(_INSIDE[of] | _CLOSE)))
            # of two blocks one has steps
            yield from self._see(after if body or is_last else Open(after.symbols - {"close"}, after.tokens))
            return tuple(body)
        assert isinstance(of, Amount)
        symbol, tokens = self.next, self.can.tokens
        value = amount(tokens, symbol, of.of) if isinstance(symbol, int) else of.said.get(symbol)
        if value is None:
            return None
        yield from self._see(after)
        return of.value(value)

    def _target(self, after: Open, *, in_near: bool = False) -> Reading[Target]:
        kind, words = str(self.next), list[int]()
        may = self._named(kind, words, after, in_near=in_near)
        while isinstance((yield from self._see(may)), int):
            words.append(int(self.next))
            may = self._named(kind, words, after, in_near=in_near)
        pick, number = PICKS.get(str(self.next), Pick.ANY), 1
        if pick:
            rest = Open(may.symbols - frozenset(PICKS))
            yield from self._see(rest | Open(frozenset(NUMBERS if pick is not Pick.OTHER else ())))
            if self.next in NUMBERS:
                number = NUMBERS[str(self.next)]
                yield from self._see(rest)
        name = " ".join(self.can.tokens[word].text for word in words)
        place = "source" if kind in ("sound", "clip") and self.at_source(words) else None
        target = Target(TargetKind(kind), name, (), pick, number, at=place)
        while self.next == ("inside" if in_near else "near"):
            yield from self._see(self.kinds)
            target = target.with_near((yield from self._target(after, in_near=True)))
        return target

    def _named(self, kind: str, words: Sequence[int], after: Open, *, in_near: bool) -> Open:
        is_file, is_here = kind in ("image", "clip"), kind == "here"
        tokens, symbols = frozenset[int](), frozenset[str]()
        if is_file and not words:
            tokens = self.can.files[kind]
        elif not is_file and not is_here and len(words) < _MOST_WORDS:
            tokens = self.can.words - frozenset(words)
        if words or is_file or is_here:
            chosen = {"inside"} if in_near else PICKS.keys() if kind in ("object", "area") else ()
            symbols = after.symbols.union(chosen, () if is_here else {"near"})
        return Open(symbols, tokens, names=not is_file and not is_here)


def meaning_of(
    line: Sequence[Symbol], tokens: Sequence[Token], *, is_question: bool, at_source: AtSource = lambda _: False
) -> Meant:
    """Return what a line means, see `Grammar.read`; raises MalformedError where it means nothing."""
    found = Grammar(Pointable(tokens), is_question=is_question, at_source=at_source).read(line)
    if isinstance(found, Open):
        raise MalformedError("the line ends too early")
    return found
