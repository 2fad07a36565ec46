"""Checks of a program before it runs: names without a value, and kinds that do not fit.

A robot that has begun to move should not stop half way for a slip that could be seen from the start.
"""

from collections.abc import Callable
from contextlib import suppress
from enum import Enum, auto
from functools import reduce
from typing import Any

from avlmaps.core.errors import ProgramError
from avlmaps.language.program import syntax, value_types
from avlmaps.language.program.budget import refused
from avlmaps.language.program.calls import check_exactly_one, nearest, parameter_of
from avlmaps.language.program.table import SKILLS, Parameter, Skill
from avlmaps.language.program.value_types import ValueType

# Passes over the program in which the kinds of its names settle; a program that needs more is left to the run.
_MOST_PASSES = 6


class Unsure(Enum):
    """The possible kinds of a value where that is no one kind."""

    ANYTHING = auto()
    NOT_YET = auto()


Guess = ValueType | Unsure


def check(statements: tuple[syntax.Statement, ...]) -> None:
    """Refuse a program that must fail wherever it gets to what is wrong with it.

    Raises:
        ProgramError: a name never has a value where it is used, or a value is of no kind that fits.
    """
    every = {name for statement in syntax.statements_of(statements) for name in _names_given(statement)}
    _check_names(statements, set(), every)
    kinds = _Kinds()
    if kinds.settle(statements):
        for statement in syntax.statements_of(statements):
            kinds.see(statement)


def check_argument(line: int, skill: Skill, parameter: Parameter, kind: ValueType) -> None:
    """Refuse a skill an argument of a kind that its parameter does not take."""
    if kind in parameter.kinds:
        return
    takes = [str(each) for each in ValueType if each in parameter.kinds]
    wanted = takes[0] if len(takes) == 1 else f"{', '.join(takes[:-1])} or {takes[-1]}"
    makers = [f"`{other.name}`" for other in SKILLS.values() if other.returns in parameter.kinds - {ValueType.NOTHING}]
    made = f"; {' or '.join(makers)} gives one" if makers and len(parameter.kinds) == 1 else ""
    raise refused(
        line, f"`{skill.name}` takes {wanted} as its `{parameter.name}`, not {kind}; it is {skill.signature}{made}"
    )


def kind_of_constant(value: object) -> ValueType:
    """Return the kind of a literal."""
    if value is None:
        return ValueType.NOTHING
    if isinstance(value, bool):
        return ValueType.TRUTH
    return ValueType.STRING if isinstance(value, str) else ValueType.NUMBER


def _names_given(statement: syntax.Statement) -> tuple[str, ...]:
    match statement:
        case syntax.Assign() | syntax.For():
            return statement.target.names
        case syntax.Update():
            return (statement.name,)
    return ()


def _check_names(block: tuple[syntax.Statement, ...], given: set[str], every: set[str]) -> None:
    """Go through a block in its order; what is given a value in it is added to ``given``."""
    for statement in block:
        match statement:
            case syntax.If():
                for branch in statement.branches:
                    _check_used(branch.test, given, every)
                    _check_names(branch.body, given, every)
                _check_names(statement.otherwise, given, every)
            case syntax.For():
                _check_used(statement.through, given, every)
                # Any round but the first may use what a later line of the body gave.
                given.update(statement.target.names)
                given.update(name for inner in syntax.statements_of(statement.body) for name in _names_given(inner))
                _check_names(statement.body, given, every)
            case syntax.Assign():
                _check_used(statement.value, given, every)
                given.update(statement.target.names)
            case syntax.Update():
                _check_used(syntax.Name(statement.name, statement.line), given, every)
                _check_used(statement.value, given, every)
            case syntax.Perform():
                _check_used(statement.call, given, every)


def _check_used(top: syntax.Expression, given: set[str], every: set[str]) -> None:
    for part in syntax.parts_of(top):
        if isinstance(part, syntax.Name) and part.name not in given:
            raise _without_value(part, given, every)


def _without_value(name: syntax.Name, given: set[str], every: set[str]) -> ProgramError:
    if name.name in every:
        return refused(name.line, f"`{name.name}` is used before it has a value; give it one on a line above")
    if name.name in ("true", "false", "none", "null"):
        return refused(name.line, f"`{name.name}` has no value; write True, False or None")
    close = nearest(name.name, sorted(given))
    if close:
        return ProgramError(f"Line {name.line}: `{name.name}` has no value; did you mean `{close}`?")
    return refused(name.line, f"`{name.name}` has no value; give it one on a line above, or put a phrase in quotes")


def _joined(first: Guess, second: Guess) -> Guess:
    if Unsure.NOT_YET in (first, second):
        return second if first is Unsure.NOT_YET else first
    return first if first is second else Unsure.ANYTHING


class _Kinds:
    """The kind of each name, where every line that gives it a value gives it one of the same kind."""

    def __init__(self) -> None:
        self.names: dict[str, Guess] = {}
        self.settled = False

    def settle(self, statements: tuple[syntax.Statement, ...]) -> bool:
        """Find the kinds of all names; return whether they came to rest."""
        for _ in range(_MOST_PASSES):
            before = dict(self.names)
            for statement in syntax.statements_of(statements):
                # With kinds that are not settled a fault may be none; what is one still is when all are seen again.
                with suppress(ProgramError):
                    self.see(statement)
            if self.names == before:
                self.settled = True
                break
        return self.settled

    def see(self, statement: syntax.Statement) -> None:
        """Add what one statement shows of its names' kinds; refuse what cannot be."""
        match statement:
            case syntax.Assign():
                self._give(statement)
            case syntax.Update():
                made = self.arithmetic(
                    statement.line, statement.operator, self.names.get(statement.name, Unsure.NOT_YET),
                    self.of(statement.value),
                )  # fmt: skip
                if self.settled and statement.operator == "+" and made is ValueType.LIST:
                    raise grown(statement)
                self._join(statement.name, made)
            case syntax.Perform():
                self.of(statement.call)
            case syntax.If():
                for branch in statement.branches:
                    self._truth(branch.test)
            case syntax.For():
                kind = self.of(statement.through)
                if isinstance(kind, ValueType):
                    value_types.check_walked(statement.line, kind)
                counts = kind is ValueType.RANGE and not statement.target.unpacks
                for name in statement.target.names:
                    self._join(name, ValueType.NUMBER if counts else Unsure.ANYTHING)

    def _give(self, statement: syntax.Assign) -> None:
        target, value = statement.target, statement.value
        if not target.unpacks:
            self._join(target.names[0], self.of(value))
            return
        if isinstance(value, syntax.Collection):
            kinds = [self.of(element) for element in value.elements]
            if len(kinds) != len(target.names):
                raise misfit(statement.line, target, len(kinds))
        else:
            kind = self.of(value)
            if isinstance(kind, ValueType):
                value_types.check_unpacked(statement.line, kind)
            kinds = [Unsure.ANYTHING] * len(target.names)
        for name, kind in zip(target.names, kinds, strict=True):
            self._join(name, kind)

    def _join(self, name: str, kind: Guess) -> None:
        self.names[name] = _joined(self.names.get(name, Unsure.NOT_YET), kind)

    def _truth(self, test: syntax.Expression) -> None:
        kind = self.of(test)
        if isinstance(kind, ValueType):
            value_types.check_truth(test.line, kind)

    def of(self, part: syntax.Expression) -> Guess:
        """Return the kind of an expression; refuse what cannot be."""
        return _GUESS[type(part)](self, part)

    def constant(self, part: syntax.Constant) -> Guess:
        return kind_of_constant(part.value)

    def name(self, part: syntax.Name) -> Guess:
        return self.names.get(part.name, Unsure.NOT_YET)

    def collection(self, part: syntax.Collection) -> Guess:
        for element in part.elements:
            self.of(element)
        return ValueType.LIST if part.is_list else ValueType.TUPLE

    def unary(self, part: syntax.Unary) -> Guess:
        if part.operator == "not":
            self._truth(part.operand)
            return ValueType.TRUTH
        kind = self.of(part.operand)
        if isinstance(kind, ValueType):
            value_types.check_sign(part.line, part.operator, kind)
        return ValueType.NUMBER

    def binary(self, part: syntax.Binary) -> Guess:
        return self.arithmetic(part.line, part.operator, self.of(part.left), self.of(part.right))

    def comparison(self, part: syntax.Comparison) -> Guess:
        kinds = [self.of(each) for each in (part.first, *part.rest)]
        for operator, left, right in zip(part.operators, kinds, kinds[1:], strict=False):
            if isinstance(left, ValueType) and isinstance(right, ValueType):
                value_types.check_comparison(part.line, operator, left, right)
        return ValueType.TRUTH

    def logical(self, part: syntax.Logical) -> Guess:
        # Each operand is computed once: twice at each level would double the work with every level of nesting.
        kinds = [self.of(operand) for operand in part.operands]
        for operand, kind in zip(part.operands[:-1], kinds, strict=False):
            if isinstance(kind, ValueType):
                value_types.check_truth(operand.line, kind)
        return reduce(_joined, kinds)

    def conditional(self, part: syntax.Conditional) -> Guess:
        self._truth(part.test)
        return _joined(self.of(part.chosen), self.of(part.otherwise))

    def element(self, part: syntax.Element) -> Guess:
        of, index = self.of(part.of), self.of(part.index)
        if isinstance(of, ValueType) and isinstance(index, ValueType):
            value_types.check_indexed(part.line, of, index)
        return Unsure.ANYTHING

    def function(self, call: syntax.BuiltinCall) -> Guess:
        kinds = tuple(self.of(argument) for argument in call.arguments)
        known = tuple(kind for kind in kinds if isinstance(kind, ValueType))
        if len(known) == len(kinds):
            value_types.check_function(call.line, call.function, known)
        return ValueType.RANGE if call.function == "range" else ValueType.NUMBER

    def skill(self, call: syntax.SkillCall) -> Guess:
        skill = SKILLS[call.skill]
        kinds = [self.of(argument.value) for argument in call.arguments]
        for argument, kind in zip(call.arguments, kinds, strict=True):
            if isinstance(kind, ValueType):
                check_argument(argument.value.line, skill, parameter_of(skill, argument.parameter), kind)
        both = zip(call.arguments, kinds, strict=True)
        chosen = [kind for argument, kind in both if argument.parameter in skill.alternatives]
        surely = sum(isinstance(kind, ValueType) and kind is not ValueType.NOTHING for kind in chosen)
        if surely > 1 or all(kind is ValueType.NOTHING for kind in chosen):
            check_exactly_one(call.line, skill, surely)
        return skill.returns

    def arithmetic(self, line: int, operator: str, left: Guess, right: Guess) -> Guess:
        """Return the kind that an operator makes of two, as far as they are known."""
        if isinstance(left, ValueType) and isinstance(right, ValueType):
            return value_types.kind_of_result(line, operator, left, right)
        return Unsure.NOT_YET if Unsure.NOT_YET in (left, right) else Unsure.ANYTHING


_GUESS: dict[type, Callable[[_Kinds, Any], Guess]] = {
    syntax.Constant: _Kinds.constant,
    syntax.Name: _Kinds.name,
    syntax.Collection: _Kinds.collection,
    syntax.Unary: _Kinds.unary,
    syntax.Binary: _Kinds.binary,
    syntax.Comparison: _Kinds.comparison,
    syntax.Logical: _Kinds.logical,
    syntax.Conditional: _Kinds.conditional,
    syntax.Element: _Kinds.element,
    syntax.BuiltinCall: _Kinds.function,
    syntax.SkillCall: _Kinds.skill,
}


def grown(statement: syntax.Update) -> ProgramError:
    """Return the refusal of `+=` on a list, which in Python changes it under all of its names."""
    name = statement.name
    return refused(statement.line, f"a list is not changed but made again; write `{name} = {name} + [...]`")


def misfit(line: int, target: syntax.AssignmentTarget, values: int) -> ProgramError:
    """Return the refusal of an assignment of more or fewer values than names."""
    return refused(line, f"{len(target.names)} names cannot take {values} values; give one value to each")
