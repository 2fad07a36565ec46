"""From intents to a line of symbols, by the table of `avlmaps.language.learned.linear`: what the networks learn."""

from collections.abc import Sequence
from typing import Any

from avlmaps.language.intents import Inquiry, Intent, Pick, Target, TargetKind
from avlmaps.language.learned.linear import LEAST, ROWS, Amount, Grammar, MalformedError, Pointable, Row, Slot, Symbol

_ALIKE = 0.01


class Pointers:
    """Finds the tokens that a name or an amount is made of."""

    def words(self, name: str, kind: TargetKind) -> list[int]:
        """Return the tokens of a name."""
        raise NotImplementedError

    def amount(self, value: float, of: str) -> int | None:
        """Return the token where an amount begins; None where none has that value."""
        raise NotImplementedError


def line_of(intents: Sequence[Intent], at: Pointers) -> list[Symbol]:
    """Return intents as a line; ``at`` finds the tokens of names and amounts.

    Raises:
        MalformedError: a name or an amount stands nowhere in the sentence.
    """
    return [*(symbol for intent in intents for symbol in _line(intent, at)), "end"]


def line_of_question(inquiry: Inquiry | None, at: Pointers) -> list[Symbol]:
    """Return a question as a line; None is one that cannot be answered.

    ``purpose`` is no part of it: it stands for a question whose target is not named, "where can I sit?".

    Raises:
        MalformedError: a name stands nowhere in the sentence.
    """
    if inquiry is None:
        return ["refuse", "end"]
    least = [_amount(float(inquiry.number), LEAST, at)] if inquiry.ask.is_numbered and inquiry.number > 1 else []
    return [f"ask_{inquiry.ask}", *least, *(symbol for target in inquiry.of for symbol in _target(target, at)), "end"]


def is_written_well(line: Sequence[Symbol], can: Pointable, *, is_question: bool) -> bool:
    """Return whether each symbol of a line may follow those before it."""
    try:
        Grammar(can, is_question=is_question).read(line)
    except MalformedError:
        return False
    return True


def _line(intent: Intent, at: Pointers) -> list[Symbol]:
    fault = MalformedError(f"no row writes {intent!r}")
    for row in (row for row in ROWS if _writes(row, intent)):
        try:
            # a body takes its amounts before "twice" takes one
            last = sorted(row.fields, key=lambda name: row.fields[name] not in (Slot.BODY, Slot.STEPS))
            written = {name: _field(row.fields[name], getattr(intent, name), at) for name in last}
            return [*row.symbols, *(symbol for name in row.fields for symbol in written[name])]
        except MalformedError as missing:  # "turn" by a clock direction that is not said
            fault = missing
    raise fault


def _writes(row: Row, intent: Intent) -> bool:
    """Return whether a row writes such an intent."""
    if not isinstance(intent, row.intent):
        return False
    for name, field in row.fields.items():
        value = getattr(intent, name)
        if isinstance(field, Amount):
            if value is None and not field.optional:
                return False
            if value is not None and _amount_of(field, value) is None:
                return False
        elif not isinstance(field, Slot | tuple) and value != field:
            return False
    return True


def _field(field: Any, value: Any, at: Pointers) -> list[Symbol]:
    if isinstance(field, Amount):
        amount = None if value is None else _amount_of(field, float(value))
        return [] if amount is None else [_amount(amount, field, at)]
    if isinstance(field, tuple):
        return [symbol for each in value for symbol in _target(each, at)]
    if field is Slot.TARGET:
        return _target(value, at)
    if isinstance(field, Slot):
        return [*(symbol for each in value for symbol in _line(each, at)), "close"]
    return []


def _amount_of(field: Amount, value: float) -> float | None:
    """Return the amount to write for the value of a field; None where another row writes such values."""
    if field.of == "clock":
        return value
    if field.wraps:
        return value % 360.0
    return abs(value) if (value < 0.0) == (field.sign < 0) else None


def _amount(amount: float, field: Amount, at: Pointers) -> Symbol:
    found = at.amount(amount, field.of)
    if found is not None:
        return found
    for symbol, each in field.said.items():
        if abs(each - amount) < _ALIKE:
            return symbol
    raise MalformedError(f"no amount of {amount:g} {field.of} is said")


def _target(target: Target, at: Pointers, *, joint: str = "near") -> list[Symbol]:
    line: list[Symbol] = [str(target.kind)]
    if target.kind is not TargetKind.HERE:
        line += at.words(target.name, target.kind)
    if target.pick and (target.pick is not Pick.NEAREST or target.number > 1):
        line.append(f"pick_{target.pick}")
        line += [] if target.number == 1 else [f"number_{target.number}"]
    for near in target.near:
        line += [joint, *_target(near, at, joint="inside")]
    return line
