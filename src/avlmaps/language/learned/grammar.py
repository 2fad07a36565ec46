"""The intents as one table: how each is written in symbols, and what the symbols make.

A row is one way to write an intent: the symbols that begin it, and its fields in the order in which they are written. A
field is a constant, an amount, a target, two targets, or a body of other intents. `linear` reads lines of symbols by
this table and says what may follow; `training.language.linearise` writes lines by it. A new intent is a new row, its
words (`verbalise`) and its program (`program.writing`).

The networks know `SYMBOLS` by their numbers, so another order needs other networks.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum, auto
from functools import cached_property
from typing import Any

from avlmaps.language import intents


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
PICKS = {f"pick_{pick}": pick for pick in intents.Pick if pick}
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
