"""Intents as a line of symbols: what the network writes, one symbol at a time.

A symbol is one of `SYMBOLS`, or points at a token: the words of a name are tokens of the sentence, one after the other,
and an amount is the token where the lexer finds it. No name holds a word that was not said; no number is made up.
A target is its kind, its words, a pick, and what it is near; an amount stands before the target::

    stop_at ^5 object ^9 ^10 near area ^13 end      "stop 2 m from the blue chair in the hall"
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from avlmaps.language import lexer
from avlmaps.language.intents import (
    Ask,
    Beside,
    Between,
    Circle,
    Clarify,
    Face,
    Go,
    Inquiry,
    Intent,
    Kind,
    Move,
    Pick,
    Reason,
    Refuse,
    Repeat,
    Return,
    Side,
    StopAt,
    Target,
    Turn,
    VisitEach,
    Wait,
)  # fmt: skip
from avlmaps.language.lexer import Token

_BESIDES = tuple(f"beside_{side}" for side in Side if side is not Side.AHEAD)
_FACES = ("face", "face_left", "face_right", "face_behind")
_REFUSALS = tuple(f"refuse_{reason}" for reason in Reason)
KINDS = tuple(str(kind) for kind in Kind)
PICKS = tuple(f"pick_{pick}" for pick in Pick if pick)
# Amounts that are said without a number: "around", "a quarter turn", "a bit", "twice".
DEGREES = {"d30": 30.0, "d45": 45.0, "d90": 90.0, "d135": 135.0, "d180": 180.0, "d270": 270.0, "d360": 360.0}
HEADINGS = {f"h{at}": float(at) for at in range(0, 360, 45)}
TIMES = {"twice": 2, "thrice": 3}
VIEWS = {"views_2": 2, "views_3": 3, "views_4": 4}
BIT_M = 0.5
_STARTS = (
    "go", *_FACES, "turn", "turn_to", "forward", "back", "between", *_BESIDES, "stop_at", "circle", "views", "each",
    "wait", "return", "repeat",
)  # fmt: skip
_ASKS = tuple(f"ask_{ask}" for ask in Ask)
SYMBOLS = (
    "start_command", "start_question", "end", *_STARTS, "close", *_REFUSALS, "clarify", "refuse", "purpose", *_ASKS,
    *KINDS, *PICKS, "near", "inside", "left", "right", *DEGREES, *HEADINGS, *TIMES, *VIEWS, "bit",
)  # fmt: skip
INDEX = {symbol: at for at, symbol in enumerate(SYMBOLS)}
MOST_SYMBOLS = 80
_MOST_WORDS = 6
_SIDES = {"face": Side.AHEAD, "face_left": Side.LEFT, "face_right": Side.RIGHT, "face_behind": Side.BEHIND}

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
    reads = (lexer.length_at, lexer.angle_at, lexer.clock_at, lexer.duration_at, lexer.number_at)
    return max((end for read in reads for end, _ in read(list(tokens), at)), default=at)


@dataclass(frozen=True, slots=True)
class Open:
    """What may follow a line of symbols.

    Attributes:
        symbols: which of `SYMBOLS`.
        tokens: which tokens may be pointed at.
    """

    symbols: frozenset[str] = frozenset()
    tokens: frozenset[int] = frozenset()


class Pointable:
    """Which tokens of a sentence each kind of pointer may point at."""

    def __init__(self, tokens: Sequence[Token]) -> None:
        """Take a sentence."""
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


def is_written_well(line: Sequence[Symbol], can: Pointable, *, is_question: bool) -> bool:
    """Return whether each symbol of a line may follow those before it."""
    state = State(can, is_question)
    for symbol in line:
        may = state.open()
        if symbol not in (may.tokens if isinstance(symbol, int) else may.symbols):
            return False
        state = state.after(symbol)
    return True


@dataclass(frozen=True, slots=True)
class State:
    """Where a line stands: what is being written, and how deep."""

    can: Pointable
    is_question: bool
    expect: str = "start"  # start, next, kind, name, turn, degrees, heading, amount, count, side, over
    of: str = ""
    targets: int = 0  # targets still to come
    words: tuple[int, ...] = ()
    kind: str = ""
    picked: bool = False
    near: bool = False
    in_near: bool = False
    depth: int = 0
    empty: bool = False  # the body of a repeat holds nothing yet

    def after(self, symbol: Symbol) -> "State":  # noqa: C901
        """Return where the line stands after one more symbol."""
        if isinstance(symbol, int):
            if self.expect == "name":
                return replace(self, words=(*self.words, symbol))
            if self.expect == "count_body":
                return replace(self, expect="body", depth=self.depth + 1)
            return replace(self, expect="kind" if self.targets else "next")
        if symbol in KINDS:
            return replace(self, expect="name", kind=symbol, words=(), picked=False, targets=max(0, self.targets - 1),
                           in_near=self.near, near=False)  # fmt: skip
        if symbol in PICKS:
            return replace(self, picked=True)
        if symbol in ("near", "inside"):
            return replace(self, expect="kind", near=True, targets=self.targets + 1)
        if symbol in ("left", "right"):
            return replace(self, expect="degrees")
        if symbol in TIMES:
            return replace(self, expect="body", depth=self.depth + 1)
        if symbol in DEGREES or symbol in HEADINGS:
            return replace(self, expect="next")
        if symbol in VIEWS or symbol == "bit":
            return replace(self, expect="kind" if self.targets else "next")
        if symbol in ("end", "clarify", "refuse", "purpose", *_REFUSALS):
            return replace(self, expect="end" if symbol != "end" else "over")
        if symbol == "close":
            return replace(self, expect="next", depth=self.depth - 1)
        return self._begun(symbol)

    def _begun(self, symbol: str) -> "State":
        fresh = replace(self, near=False, in_near=False, kind="", words=(), targets=0)
        if symbol in _ASKS:
            return replace(fresh, expect="kind", targets=1)
        if symbol in ("go", *_FACES, "circle", "each"):
            return replace(fresh, expect="kind", targets=1)
        if symbol == "between":
            return replace(fresh, expect="kind", targets=2)
        if symbol in _BESIDES:
            return replace(fresh, expect="metres?", targets=1)
        if symbol == "stop_at":
            return replace(fresh, expect="metres", targets=1)
        if symbol == "views":
            return replace(fresh, expect="views", targets=1)
        expect = {"turn": "turn", "turn_to": "heading", "forward": "metres", "back": "metres", "wait": "seconds?",
                  "return": "next", "repeat": "count_body"}[symbol]  # fmt: skip
        return replace(fresh, expect=expect)

    def open(self) -> Open:  # noqa: C901
        """Return what may come next."""
        can = self.can
        match self.expect:
            case "start" if self.is_question:
                return Open(frozenset({*_ASKS, "refuse", "purpose"}))
            case "start":
                return Open(frozenset({*_STARTS, *_REFUSALS, "clarify"}))
            case "end":
                return Open(frozenset({"end"}))
            case "body":
                return Open(frozenset(_STARTS) - {"repeat"})
            case "next":
                return self._next()
            case "kind":
                return Open(frozenset(KINDS) - ({"here"} if self.is_question else frozenset()))
            case "name":
                return self._named()
            case "turn":
                return Open(frozenset({"left", "right"}), can.amounts("clock"))
            case "degrees":
                return Open(frozenset(DEGREES), can.amounts("degrees"))
            case "heading":
                return Open(frozenset(HEADINGS), can.amounts("degrees"))
            case "metres":
                return Open(frozenset({"bit"}), can.amounts("metres"))
            case "metres?":
                return Open(frozenset({"bit", *KINDS}), can.amounts("metres"))
            case "seconds?":
                after = replace(self, expect="next")._next()
                return Open(after.symbols, can.amounts("seconds"))
            case "views":
                return Open(frozenset(VIEWS), can.amounts("count"))
            case "count_body":
                return Open(frozenset(TIMES), can.amounts("count"))
            case _:
                return Open()

    def _next(self) -> Open:
        if self.is_question:
            return Open(frozenset({"end", *KINDS}) - {"here"})
        if self.depth:
            return Open(frozenset({*_STARTS, "close"}) - {"repeat"})
        return Open(frozenset({*_STARTS, "end"}))

    def _named(self) -> Open:
        symbols: set[str] = set()
        tokens: frozenset[int] = frozenset()
        if self.kind in ("image", "clip"):
            tokens = self.can.files[self.kind] if not self.words else frozenset()
        elif self.kind != "here" and len(self.words) < _MOST_WORDS and not self.picked:
            tokens = self.can.words - frozenset(self.words)
        done = bool(self.words) or self.kind in ("image", "clip", "here")
        if done:
            if not self.picked and self.kind in ("object", "area") and not self.in_near:
                symbols |= set(PICKS)
            if self.kind != "here":
                symbols.add("near")
            if self.in_near:
                symbols.add("inside")
            if self.targets:  # the second of a pair
                symbols |= set(KINDS)
            else:
                symbols |= self._next().symbols
        return Open(frozenset(symbols), tokens)


def line_of(intents: Sequence[Intent], at: "Pointers") -> list[Symbol]:
    """Return intents as a line; ``at`` finds the tokens of names and amounts.

    Raises:
        MalformedError: a name or an amount stands nowhere in the sentence.
    """
    line = [symbol for intent in intents for symbol in _line(intent, at)]
    return [*line, "end"]


def line_of_question(inquiry: Inquiry | None, at: "Pointers") -> list[Symbol]:
    """Return a question as a line; None is one that cannot be answered.

    ``purpose`` is no part of it: it stands for a question whose target is not named, "where can I sit?".

    Raises:
        MalformedError: a name stands nowhere in the sentence.
    """
    if inquiry is None:
        return ["refuse", "end"]
    line: list[Symbol] = [f"ask_{inquiry.ask}"]
    for target in inquiry.of:
        line += _target(target, at)
    return [*line, "end"]


class Pointers:
    """Finds the tokens that a name or an amount is made of."""

    def words(self, name: str, kind: Kind) -> list[int]:
        """Return the tokens of a name."""
        raise NotImplementedError

    def amount(self, value: float, of: str) -> int | None:
        """Return the token where an amount begins; None where none has that value."""
        raise NotImplementedError


def _line(intent: Intent, at: Pointers) -> list[Symbol]:  # noqa: C901
    match intent:
        case Go(to=target):
            return ["go", *_target(target, at)]
        case Face(to=target, side=side):
            return [next(name for name, each in _SIDES.items() if each is side), *_target(target, at)]
        case Turn(degrees=None, heading=heading):
            return ["turn_to", _amount((heading or 0.0) % 360.0, "degrees", HEADINGS, at)]
        case Turn(degrees=degrees):
            degrees = degrees or 0.0
            clock = at.amount(degrees, "clock")
            if clock is not None:
                return ["turn", clock]
            return ["turn", "left" if degrees < 0 else "right", _amount(abs(degrees), "degrees", DEGREES, at)]
        case Move(metres=metres):
            return ["forward" if metres > 0 else "back", _amount(abs(metres), "metres", {"bit": BIT_M}, at)]
        case Between(of=(a, b)):
            return ["between", *_target(a, at), *_target(b, at)]
        case Beside(of=target, side=side, metres=metres):
            said = [] if metres is None else [_amount(metres, "metres", {"bit": BIT_M}, at)]
            return [f"beside_{side}", *said, *_target(target, at)]
        case StopAt(of=target, metres=metres):
            return ["stop_at", _amount(metres, "metres", {"bit": BIT_M}, at), *_target(target, at)]
        case Circle(of=target, views=None):
            return ["circle", *_target(target, at)]
        case Circle(of=target, views=views):
            return ["views", _amount(float(views or 0), "count", VIEWS, at), *_target(target, at)]
        case VisitEach(of=target):
            return ["each", *_target(target, at)]
        case Wait(seconds=None):
            return ["wait"]
        case Wait(seconds=seconds):
            return ["wait", _amount(seconds or 0.0, "seconds", {}, at)]
        case Return():
            return ["return"]
        case Repeat(times=times, body=body):
            inner = [symbol for each in body for symbol in _line(each, at)]
            return ["repeat", _amount(float(times), "count", TIMES, at), *inner, "close"]
        case Refuse(reason=reason):
            return [f"refuse_{reason}"]
        case Clarify():
            return ["clarify"]


def _amount(value: float, of: str, said: "dict[str, float] | dict[str, int]", at: Pointers) -> Symbol:
    found = at.amount(value, of)
    if found is not None:
        return found
    for symbol, each in said.items():
        if abs(each - value) < 0.01:
            return symbol
    raise MalformedError(f"no amount of {value:g} {of} is said")


def _target(target: Target, at: Pointers, *, joint: str = "near") -> list[Symbol]:
    line: list[Symbol] = [str(target.kind)]
    if target.kind is not Kind.HERE:
        line += at.words(target.name, target.kind)
    if target.pick and target.pick is not Pick.NEAREST:
        line.append(f"pick_{target.pick}")
    for near in target.near:
        line += [joint, *_target(near, at, joint="inside")]
    return line


def intents_of(line: Sequence[Symbol], tokens: Sequence[Token]) -> tuple[Intent, ...]:
    """Return the intents of a line that ends with ``end``.

    Raises:
        MalformedError: it means nothing.
    """
    intents, at = _Reader(line, tokens).intents(0)
    if not intents or at != len(line) - 1 or line[at] != "end":
        raise MalformedError("the line ends too early or too late")
    return tuple(intents)


def inquiry_of(line: Sequence[Symbol], tokens: Sequence[Token]) -> Inquiry | None:
    """Return the question of a line that ends with ``end``; None where it says that it cannot be answered.

    Raises:
        MalformedError: it means nothing.
    """
    if list(line) == ["refuse", "end"]:
        return None
    reader, targets, at = _Reader(line, tokens), [], 1
    while line[at : at + 1] and line[at] != "end":
        target, at = reader.target(at)
        targets.append(target)
    if not targets or line[-1] != "end" or not isinstance(line[0], str) or line[0] not in _ASKS:
        raise MalformedError("the line is no question")
    return Inquiry(Ask(line[0].removeprefix("ask_")), tuple(targets))


class _Reader:
    """Reads a line of symbols back."""

    def __init__(self, line: Sequence[Symbol], tokens: Sequence[Token]) -> None:
        self.line, self.tokens = line, tokens

    def intents(self, at: int) -> tuple[list[Intent], int]:
        found: list[Intent] = []
        while at < len(self.line) and self.line[at] not in ("end", "close"):
            intent, at = self.intent(at)
            found.append(intent)
        return found, at

    def intent(self, at: int) -> tuple[Intent, int]:  # noqa: C901
        symbol, at = self.line[at], at + 1
        if isinstance(symbol, int):
            raise MalformedError("an intent begins with a pointer")
        if symbol in _SIDES:
            target, at = self.target(at)
            return Face(target, _SIDES[symbol]), at
        if symbol in _BESIDES:
            metres, at = (None, at) if self._peek(at) in KINDS else self._metres(at)
            target, at = self.target(at)
            return Beside(target, Side(symbol.removeprefix("beside_")), metres), at
        if symbol in _REFUSALS:
            return Refuse(Reason(symbol.removeprefix("refuse_"))), at
        match symbol:
            case "go":
                target, at = self.target(at)
                return Go(target), at
            case "turn":
                return self._turn(at)
            case "turn_to":
                heading, at = self._said(at, "degrees", HEADINGS)
                return Turn(heading=heading % 360.0), at
            case "forward" | "back":
                metres, at = self._metres(at)
                return Move(metres if symbol == "forward" else -metres), at
            case "between":
                a, at = self.target(at)
                b, at = self.target(at)
                return Between((a, b)), at
            case "stop_at":
                metres, at = self._metres(at)
                target, at = self.target(at)
                return StopAt(target, metres), at
            case "circle" | "each":
                target, at = self.target(at)
                return Circle(target) if symbol == "circle" else VisitEach(target), at
            case "views":
                views, at = self._said(at, "count", VIEWS)
                target, at = self.target(at)
                return Circle(target, int(views)), at
            case "wait":
                if not isinstance(self._peek(at), int):
                    return Wait(), at
                seconds, at = self._said(at, "seconds", {})
                return Wait(seconds), at
            case "return":
                return Return(), at
            case "repeat":
                times, at = self._said(at, "count", TIMES)
                body, at = self.intents(at)
                if not body or self._peek(at) != "close":
                    raise MalformedError("a repeat without a body")
                return Repeat(int(times), tuple(body)), at + 1
            case "clarify":
                return Clarify(), at
            case _:
                raise MalformedError(f"no intent begins with {symbol}")

    def _turn(self, at: int) -> tuple[Intent, int]:
        side = self._peek(at)
        if isinstance(side, int):
            degrees, at = self._said(at, "clock", {})
            return Turn(degrees), at
        if side not in ("left", "right"):
            raise MalformedError("a turn without a side")
        degrees, at = self._said(at + 1, "degrees", DEGREES)
        return Turn(-degrees if side == "left" and degrees != 180.0 else degrees), at

    def _peek(self, at: int) -> Symbol:
        return self.line[at] if at < len(self.line) else "end"

    def _metres(self, at: int) -> tuple[float, int]:
        return self._said(at, "metres", {"bit": BIT_M})

    def _said(self, at: int, of: str, words: "dict[str, float] | dict[str, int]") -> tuple[float, int]:
        symbol = self._peek(at)
        if isinstance(symbol, str):
            if symbol not in words:
                raise MalformedError(f"{symbol} is no amount")
            return float(words[symbol]), at + 1
        value = amount(self.tokens, symbol, of) if symbol < len(self.tokens) else None
        if value is None:
            raise MalformedError("no amount begins there")
        return value, at + 1

    def target(self, at: int) -> tuple[Target, int]:
        """Return the target that begins at a symbol, and where it ends."""
        target, at = self._own(at)
        while self._peek(at) == "near":
            near, at = self._own(at + 1)
            while self._peek(at) == "inside":
                inner, at = self._own(at + 1)
                near = near.with_near(inner)
            target = target.with_near(near)
        return target, at

    def _own(self, at: int) -> tuple[Target, int]:
        kind = self._peek(at)
        if not isinstance(kind, str) or kind not in KINDS:
            raise MalformedError("a target without a kind")
        at += 1
        words: list[str] = []
        while isinstance(self._peek(at), int):
            token = self.tokens[int(self._peek(at))]
            words.append(token.text)
            at += 1
        pick = Pick.ANY
        symbol = self._peek(at)
        if isinstance(symbol, str) and symbol in PICKS:
            pick, at = Pick(symbol.removeprefix("pick_")), at + 1
        if not words and kind in ("object", "sound", "area"):
            raise MalformedError("a target without a name")
        return Target(Kind(kind), " ".join(words), (), pick), at
