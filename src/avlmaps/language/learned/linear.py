"""Intents as a line of symbols: what the network writes, one symbol at a time, and what it means.

A symbol is one of `SYMBOLS`, or points at a token: the words of a name are tokens of the sentence, one after the other,
and an amount is the token where the lexer finds it. No name holds a word that was not said; no number is made up.
A target is its kind, its words, a pick, and what it is near; an amount stands before the target::

    stop_at ^5 object ^9 ^10 near area ^13 end      "stop 2 m from the blue chair in the hall"

`grammar` has the table of the intents.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from avlmaps.language import lexer
from avlmaps.language.intents import Inquiry, Intent, Pick, Target, TargetKind
from avlmaps.language.learned.grammar import ASKS, KINDS, PICKS, STARTS, STOPS, Amount, Slot, rows_of
from avlmaps.language.lexer import Token

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
    intents, at = _Line(line, tokens, at_source).intents(0)
    if not intents or at != len(line) - 1 or line[at] != "end":
        raise MalformedError("the line ends too early or too late")
    return tuple(intents)


def inquiry_of(
    line: Sequence[Symbol], tokens: Sequence[Token], at_source: Callable[[Sequence[int]], bool] = lambda _: False
) -> Inquiry | None:
    """Return the question of a line that ends with ``end``, see ``intents_of``; None where it cannot be answered.

    Raises:
        MalformedError: it means nothing.
    """
    if list(line) == ["refuse", "end"]:
        return None
    written, targets, at = _Line(line, tokens, at_source), [], 1
    while line[at : at + 1] and line[at] != "end":
        target, at = written.target(at)
        targets.append(target)
    if not targets or line[-1] != "end" or not isinstance(line[0], str) or line[0] not in ASKS:
        raise MalformedError("the line is no question")
    return Inquiry(ASKS[line[0]], tuple(targets))


@dataclass(frozen=True, slots=True)
class _Line:
    """A line of symbols that is read back; each method returns what begins at a symbol, and where it ends."""

    symbols: Sequence[Symbol]
    tokens: Sequence[Token]
    at_source: Callable[[Sequence[int]], bool] = lambda _: False

    def intents(self, at: int) -> tuple[list[Intent], int]:
        found: list[Intent] = []
        while at < len(self.symbols) and self.symbols[at] not in ("end", "close"):
            intent, at = self.intent(at)
            found.append(intent)
        return found, at

    def intent(self, at: int) -> tuple[Intent, int]:
        symbol = self.symbols[at]
        rows = [] if isinstance(symbol, int) else rows_of((symbol,))
        fits = [row for row in rows if tuple(self.symbols[at : at + len(row.symbols)]) == row.symbols]
        if not fits:
            raise MalformedError(f"no intent begins with {symbol}")
        row = max(fits, key=lambda each: len(each.symbols))
        at += len(row.symbols)
        values: dict[str, Any] = {}
        for name, field in row.fields.items():
            values[name], at = self.field(field, at)
        return row.intent(**values), at

    def field(self, field: Any, at: int) -> tuple[Any, int]:
        if isinstance(field, Amount):
            return self.amount(field, at)
        if isinstance(field, tuple):
            values: list[Any] = []
            for each in field:
                value, at = self.field(each, at)
                values.append(value)
            return tuple(values), at
        if field is Slot.TARGET:
            return self.target(at)
        if field is Slot.BODY:
            body, at = self.intents(at)
            if not body or self.peek(at) != "close":
                raise MalformedError("a repeat without a body")
            return tuple(body), at + 1
        return field, at

    def amount(self, field: Amount, at: int) -> tuple[float | None, int]:
        symbol = self.peek(at)
        if isinstance(symbol, str):
            if symbol in field.said:
                return field.value(float(field.said[symbol])), at + 1
            if field.optional:
                return None, at
            raise MalformedError(f"{symbol} is no amount")
        value = amount(self.tokens, symbol, field.of) if symbol < len(self.tokens) else None
        if value is None:
            raise MalformedError("no amount begins there")
        return field.value(value), at + 1

    def peek(self, at: int) -> Symbol:
        return self.symbols[at] if at < len(self.symbols) else "end"

    def target(self, at: int) -> tuple[Target, int]:
        target, at = self.own(at)
        while self.peek(at) == "near":
            near, at = self.own(at + 1)
            while self.peek(at) == "inside":
                inner, at = self.own(at + 1)
                near = near.with_near(inner)
            target = target.with_near(near)
        return target, at

    def own(self, at: int) -> tuple[Target, int]:
        """Return the target without what it is near."""
        kind = self.peek(at)
        if not isinstance(kind, str) or kind not in KINDS:
            raise MalformedError("a target without a kind")
        at += 1
        words: list[int] = []
        while isinstance(symbol := self.peek(at), int):
            words.append(symbol)
            at += 1
        pick = PICKS.get(symbol, Pick.ANY)
        if not words and kind in ("object", "sound", "area"):
            raise MalformedError("a target without a name")
        name = " ".join(self.tokens[word].text for word in words)
        place = "source" if kind in ("sound", "clip") and self.at_source(words) else None
        return Target(TargetKind(kind), name, (), pick, place), at + (pick is not Pick.ANY)
