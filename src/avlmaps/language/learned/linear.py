"""Intents as a line of symbols: what the network writes, one symbol at a time, and what it means.

A symbol is one of `SYMBOLS`, or points at a token: the words of a name are tokens of the sentence, one after the other,
and an amount is the token where the lexer finds it. No name holds a word that was not said; no number is made up.
A target is its kind, its words, a pick, and what it is near; an amount stands before the target::

    stop_at ^5 object ^9 ^10 near area ^13 end      "stop 2 m from the blue chair in the hall"

`ROWS` is the table of the intents: a row is one way to write an intent, the symbols that begin it and its fields in the
order in which they are written. Lines are read by it here, and written by it in `training.language.linearise`. A new
intent is a new row, its words (`verbalise`) and its program (`program.writing`). The networks know `SYMBOLS` by their
numbers, so another order needs other networks.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum, auto
from functools import cached_property
from typing import Any

from avlmaps.language import intents, lexer
from avlmaps.language.intents import Inquiry, Intent, Pick, Target, TargetKind
from avlmaps.language.lexer import Token


class Slot(Enum):
    """What is written in a place of a line that is no amount."""

    START = auto()
    HEAD = auto()  # the second symbol of an intent, or its first field
    TARGET = auto()
    BODY = auto()
    END = auto()
    OVER = auto()


@dataclass(frozen=True, slots=True)
class Amount:
    """An amount: a pointer to where it is said, or a symbol for one that is said without a number.

    Attributes:
        of: ``metres``, ``degrees``, ``clock``, ``seconds`` or ``count``.
        said: the symbols and what they stand for: "a bit", "around".
        optional: whether it may be missing.
        sign: −1 where the value is the negative amount; half a turn is 180 degrees either way.
        wraps: whether it is a heading, from 0 to 360 degrees.
    """

    of: str
    said: Mapping[str, float] = field(default_factory=dict)
    optional: bool = False
    sign: int = 1
    wraps: bool = False

    def value(self, amount: float) -> float:
        """Return the value of a field for an amount."""
        if self.of == "count":
            return int(amount)
        if self.wraps:
            return amount % 360.0
        return amount if self.sign > 0 or (self.of == "degrees" and amount == 180.0) else -amount

    def amount(self, value: float) -> float | None:
        """Return the amount to write for the value of a field; None where another row writes such values."""
        if self.of == "clock":
            return value
        if self.wraps:
            return value % 360.0
        return abs(value) if (value < 0.0) == (self.sign < 0) else None


@dataclass(frozen=True)
class Row:
    """One way to write an intent.

    Attributes:
        symbols: what begins it.
        intent: its class.
        fields: its fields, in the order in which they are written: an `Amount`, a `Slot`, a pair of those, or the
            constant that the symbols stand for.
    """

    symbols: tuple[str, ...]
    intent: type[intents.Intent]
    fields: Mapping[str, Any]

    @cached_property
    def slots(self) -> tuple[Slot | Amount, ...]:
        """What is written behind the symbols."""
        if issubclass(self.intent, intents.Refuse | intents.Clarify):
            return (Slot.END,)
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
_METRES = Amount("metres", BIT)
ROWS = (
    _row("go", intents.Go, to=Slot.TARGET),
    _row("face", intents.Face, to=Slot.TARGET, side=intents.Side.AHEAD),
    *(
        _row(f"face_{side}", intents.Face, to=Slot.TARGET, side=side)
        for side in (intents.Side.LEFT, intents.Side.RIGHT, intents.Side.BEHIND)
    ),
    _row("turn", intents.Turn, degrees=Amount("clock"), heading=None),
    _row("turn left", intents.Turn, degrees=Amount("degrees", DEGREES, sign=-1), heading=None),
    _row("turn right", intents.Turn, degrees=Amount("degrees", DEGREES), heading=None),
    _row("turn_to", intents.Turn, degrees=None, heading=Amount("degrees", HEADINGS, wraps=True)),
    _row("forward", intents.Move, metres=_METRES),
    _row("back", intents.Move, metres=Amount("metres", BIT, sign=-1)),
    _row("between", intents.Between, of=(Slot.TARGET, Slot.TARGET)),
    *(
        _row(f"beside_{side}", intents.Beside, metres=Amount("metres", BIT, optional=True), of=Slot.TARGET, side=side)
        for side in intents.Side
        if side is not intents.Side.AHEAD
    ),
    _row("stop_at", intents.StopAt, metres=_METRES, of=Slot.TARGET),
    _row("circle", intents.Circle, of=Slot.TARGET, views=None),
    _row("views", intents.Circle, views=Amount("count", VIEWS), of=Slot.TARGET),
    _row("each", intents.VisitEach, of=Slot.TARGET),
    _row("wait", intents.Wait, seconds=Amount("seconds", optional=True)),
    _row("return", intents.Return),
    _row("repeat", intents.Repeat, times=Amount("count", TIMES), body=Slot.BODY),
    *(_row(f"refuse_{reason}", intents.Refuse, reason=reason) for reason in intents.RefusalReason),
    _row("clarify", intents.Clarify),
)
ASKS = {f"ask_{ask}": ask for ask in intents.Ask}
KINDS = tuple(str(kind) for kind in intents.TargetKind)
PICKS = {f"pick_{pick}": pick for pick in (Pick.NEAREST, Pick.FARTHEST, Pick.OTHER)}
STOPS = tuple(row.symbols[0] for row in ROWS if row.slots == (Slot.END,))
STARTS = tuple(dict.fromkeys(row.symbols[0] for row in ROWS if row.slots != (Slot.END,)))
SYMBOLS = (
    "start_command", "start_question", "end", *STARTS, "close", *STOPS, "refuse", "purpose", *ASKS, *KINDS, *PICKS,
    "near", "inside", "left", "right", *DEGREES, *HEADINGS, *TIMES, *VIEWS, *BIT,
)  # fmt: skip
INDEX = {symbol: at for at, symbol in enumerate(SYMBOLS)}


def rows_of(symbols: tuple[str, ...]) -> list[Row]:
    """Return the rows that begin with some symbols."""
    return [row for row in ROWS if row.symbols[: len(symbols)] == symbols]


MOST_SYMBOLS = 80
_MOST_WORDS = 6

Symbol = str | int  # an entry of `SYMBOLS`, or the token that is pointed at


class MalformedError(ValueError):
    """A line of symbols that means nothing."""


def amount(tokens: Sequence[Token], at: int, of: str) -> float | None:
    """Return the amount that begins at a token, in metres, degrees, seconds, or a count; None where there is none.

    Args:
        tokens: the sentence.
        at: the token.
        of: ``metres``, ``degrees``, ``clock``, ``seconds`` or ``count``.
    """
    read = {
        "metres": (lexer.length_at, lexer.number_at), "degrees": (lexer.angle_at, lexer.number_at),
        "clock": (lexer.clock_at,), "seconds": (lexer.duration_at, lexer.number_at), "count": (lexer.number_at,),
    }[of]  # fmt: skip
    for each in read:
        found = each(list(tokens), at)
        if found:
            value = max(found, key=lambda one: one[0])[1]
            return value if of != "count" or value == int(value) else None
    return None


def amount_end(tokens: Sequence[Token], at: int) -> int:
    """Return where the longest amount that begins at a token ends; the token itself where none does."""
    if at >= len(tokens) or not lexer.begins_amount(tokens[at]):
        return at
    reads, words = (lexer.length_at, lexer.angle_at, lexer.clock_at, lexer.duration_at, lexer.number_at), list(tokens)
    return max((end for read in reads for end, _ in read(words, at)), default=at)


@dataclass(frozen=True, slots=True)
class Open:
    """What may follow a line of symbols.

    Attributes:
        symbols: which of `SYMBOLS`.
        tokens: which tokens may be pointed at.
    """

    symbols: frozenset[str] = frozenset()
    tokens: frozenset[int] = frozenset()

    def __or__(self, other: "Open") -> "Open":
        """Return what may follow either of two lines."""
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
            self._amounts[of] = frozenset(
                i for i in range(len(self.tokens)) if (amount(self.tokens, i, of) or 0.0) > 0.0 or
                (of == "clock" and amount(self.tokens, i, of) is not None)
            )  # fmt: skip
        return self._amounts[of]


@dataclass(frozen=True, slots=True)
class State:
    """Where a line stands.

    Attributes:
        can: what may be pointed at.
        is_question: which of the two forms the line has.
        pending: what is still to be written of the intent; empty where another one may begin.
        head: the symbols of an intent whose next one is not written yet.
        kind: of the target whose name is being written; "" where none is.
        words: of that name.
        picked: whether that target has its pick.
        near: whether the next target is what another one is near.
        in_near: whether this target is.
        depth: of repeats.
    """

    can: Pointable
    is_question: bool
    pending: tuple[Slot | Amount, ...] = (Slot.START,)
    head: tuple[str, ...] = ()
    kind: str = ""
    words: tuple[int, ...] = ()
    picked: bool = False
    near: bool = False
    in_near: bool = False
    depth: int = 0

    @property
    def is_over(self) -> bool:
        """Whether the line has ended."""
        return self.pending == (Slot.OVER,)

    def after(self, symbol: Symbol) -> "State":
        """Return where the line stands after one more symbol."""
        if self.kind:
            return self._after_name(symbol)
        slot, rest = (self.pending[0], self.pending[1:]) if self.pending else (None, ())
        if isinstance(slot, Amount):
            skipped = replace(self, pending=rest)
            return skipped if isinstance(symbol, int) or symbol in slot.said else skipped.after(symbol)
        if isinstance(symbol, int):  # the first field of an intent that has no second symbol
            return replace(self, pending=rows_of(self.head)[0].slots[1:], head=())
        if symbol in KINDS:
            return replace(self, kind=symbol, words=(), picked=False, in_near=self.near, near=False, pending=rest)
        if symbol == "end":
            return replace(self, pending=(Slot.OVER,))
        if symbol == "close":
            return replace(self, depth=self.depth - 1)
        if symbol in ("refuse", "purpose"):
            return replace(self, pending=(Slot.END,))
        return replace(self, pending=(Slot.TARGET,)) if symbol in ASKS else self._begun((*self.head, symbol))

    def _after_name(self, symbol: Symbol) -> "State":
        if isinstance(symbol, int):
            return replace(self, words=(*self.words, symbol))
        if symbol in PICKS:
            return replace(self, picked=True)
        if symbol in ("near", "inside"):
            return replace(self, kind="", near=True, pending=(Slot.TARGET, *self.pending))
        return replace(self, kind="").after(symbol)

    def _begun(self, head: tuple[str, ...]) -> "State":
        rows = rows_of(head)
        if any(row.symbols != head for row in rows):
            return replace(self, head=head, pending=(Slot.HEAD,))
        slots = rows[0].slots
        return replace(self, head=(), pending=slots, near=False, depth=self.depth + (Slot.BODY in slots))

    def open(self) -> Open:
        """Return what may come next."""
        if self.kind:
            return self._named()
        if not self.pending:
            return self._next()
        slot = self.pending[0]
        if isinstance(slot, Amount):
            found = Open(frozenset(slot.said), self.can.amounts(slot.of))
            return found | replace(self, pending=self.pending[1:]).open() if slot.optional else found
        match slot:
            case Slot.START:
                return Open(frozenset((*ASKS, "refuse", "purpose") if self.is_question else (*STARTS, *STOPS)))
            case Slot.HEAD:
                rows = rows_of(self.head)
                further = frozenset(row.symbols[len(self.head)] for row in rows if row.symbols != self.head)
                first = next(row.slots[:1] for row in rows if row.symbols == self.head)
                return Open(further) | replace(self, pending=first).open()
            case Slot.TARGET:
                return Open(frozenset(KINDS) - ({"here"} if self.is_question else frozenset()))
            case Slot.BODY:
                return Open(frozenset(STARTS) - {"repeat"})
            case Slot.END:
                return Open(frozenset({"end"}))
            case Slot.OVER:
                return Open()

    def _next(self) -> Open:
        if self.is_question:
            return Open(frozenset({"end", *KINDS}) - {"here"})
        if self.depth:
            return Open(frozenset({*STARTS, "close"}) - {"repeat"})
        return Open(frozenset({*STARTS, "end"}))

    def _named(self) -> Open:
        symbols: set[str] = set()
        tokens: frozenset[int] = frozenset()
        if self.kind in ("image", "clip"):
            tokens = self.can.files[self.kind] if not self.words else frozenset()
        elif self.kind != "here" and len(self.words) < _MOST_WORDS and not self.picked:
            tokens = self.can.words - frozenset(self.words)
        if self.words or self.kind in ("image", "clip", "here"):
            if not self.picked and self.kind in ("object", "area") and not self.in_near:
                symbols |= set(PICKS)
            if self.kind != "here":
                symbols.add("near")
            if self.in_near:
                symbols.add("inside")
            symbols |= set(KINDS) if self.pending else self._next().symbols  # the second of a pair
        return Open(frozenset(symbols), tokens)


def intents_of(
    line: Sequence[Symbol], tokens: Sequence[Token], at_source: Callable[[Sequence[int]], bool] = lambda _: False
) -> tuple[Intent, ...]:
    """Return the intents of a line that ends with ``end``.

    Raises:
        MalformedError: it means nothing.
    """
    written = _Line(line, tokens, at_source)
    found = written.intents()
    written.take("end")
    if not found or written.at != len(line):
        raise MalformedError("the line ends too early or too late")
    return found


def inquiry_of(
    line: Sequence[Symbol], tokens: Sequence[Token], at_source: Callable[[Sequence[int]], bool] = lambda _: False
) -> Inquiry | None:
    """Return the question of a line that ends with ``end``, see ``intents_of``; None where it cannot be answered.

    Raises:
        MalformedError: it means nothing.
    """
    if list(line) == ["refuse", "end"]:
        return None
    written = _Line(line, tokens, at_source)
    ask, targets = written.take(*ASKS), list[Target]()
    while written.next in KINDS:
        targets.append(written.target())
    written.take("end")
    if not targets or written.at != len(line):
        raise MalformedError("the line is no question")
    return Inquiry(ASKS[ask], tuple(targets))


@dataclass(slots=True)
class _Line:
    """A line of symbols that is read from its beginning; ``at`` is the next one."""

    symbols: Sequence[Symbol]
    tokens: Sequence[Token]
    at_source: Callable[[Sequence[int]], bool]
    at: int = 0

    @property
    def next(self) -> Symbol:
        return self.symbols[self.at] if self.at < len(self.symbols) else ""

    def take(self, *expected: str) -> str:
        symbol = self.next
        if isinstance(symbol, int) or symbol not in expected:
            raise MalformedError(f"{symbol} stands where {' or '.join(expected)} should")
        self.at += 1
        return symbol

    def intents(self) -> tuple[Intent, ...]:
        found: list[Intent] = []
        while self.next not in ("end", "close", ""):
            found.append(self.intent())
        return tuple(found)

    def intent(self) -> Intent:
        fits = [row for row in ROWS if tuple(self.symbols[self.at : self.at + len(row.symbols)]) == row.symbols]
        if not fits:
            raise MalformedError(f"no intent begins with {self.next}")
        row = max(fits, key=lambda each: len(each.symbols))
        self.at += len(row.symbols)
        return row.intent(**{name: self.field(of) for name, of in row.fields.items()})

    def field(self, of: Any) -> Any:
        match of:
            case Amount():
                return self.amount(of)
            case tuple():
                return tuple(map(self.field, of))
            case Slot.TARGET:
                return self.target()
            case Slot.BODY:
                body = self.intents()
                self.take("close")
                return body
            case _:
                return of

    def amount(self, of: Amount) -> float | None:
        symbol = self.next
        if isinstance(symbol, int):
            value = amount(self.tokens, symbol, of.of) if symbol < len(self.tokens) else None
            if value is None:
                raise MalformedError("no amount begins there")
            self.at += 1
            return of.value(value)
        if of.optional and symbol not in of.said:
            return None
        return of.value(float(of.said[self.take(*of.said)]))

    def target(self) -> Target:
        target = self.own()
        while self.next == "near":
            self.at += 1
            near = self.own()
            while self.next == "inside":
                self.at += 1
                near = near.with_near(self.own())
            target = target.with_near(near)
        return target

    def own(self) -> Target:
        """Return the target without what it is near."""
        kind, words = self.take(*KINDS), list[int]()
        while isinstance(symbol := self.next, int):
            words.append(symbol)
            self.at += 1
        if not words and kind in ("object", "sound", "area"):
            raise MalformedError("a target without a name")
        pick = PICKS[self.take(*PICKS)] if symbol in PICKS else Pick.ANY
        name = " ".join(self.tokens[word].text for word in words)
        place = "source" if kind in ("sound", "clip") and self.at_source(words) else None
        return Target(TargetKind(kind), name, (), pick, at=place)
