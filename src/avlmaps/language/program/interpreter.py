"""Runs a parsed program over a vocabulary. Nothing but the skills of the table is ever called or looked up."""

from collections.abc import Callable
from enum import Enum, auto
from time import monotonic
from typing import Any

from avlmaps.core.errors import AvlmapsError, ProgramError
from avlmaps.language.program import syntax, value_types, values
from avlmaps.language.program.budget import Budget, refused
from avlmaps.language.program.calls import check_exactly_one, parameter_of
from avlmaps.language.program.check import check_argument, grown, misfit
from avlmaps.language.program.table import SKILLS
from avlmaps.language.program.trace import Step, Trace, told
from avlmaps.language.program.value_types import ValueType
from avlmaps.language.program.values import Value
from avlmaps.language.program.vocabulary import RobotSkills

# Between two skills the clock is read once in this many steps.
_STEPS_BETWEEN_LOOKS = 256


def run_program(
    program: syntax.Program,
    vocabulary: RobotSkills,
    budget: Budget | None = None,
    on_step: Callable[[Step], None] | None = None,
    *,
    clock: Callable[[], float] = monotonic,
) -> Trace:
    """Run a program to its end, or to its first error; the trace holds the error, and what was done.

    Errors of the project's family that a skill raises end the program and stand in the trace. Any other exception is a
    mistake of the vocabulary's programmer and comes through, as does the user's interrupt.

    Args:
        program: what to run.
        vocabulary: whose skills are called.
        budget: what the run may use up; the defaults where none is given.
        on_step: called with each step once it is over, a failed one too.
        clock: seconds; replaced in tests.

    Raises:
        TypeError: the vocabulary lacks a skill, or a skill returned what its signature does not promise.
    """
    if not isinstance(vocabulary, RobotSkills):
        raise TypeError(f"{type(vocabulary).__name__} does not have every skill of a Vocabulary")
    run = _Run(vocabulary, budget or Budget(), on_step or (lambda step: None), clock)
    error = error_type = None
    try:
        run.block(program.statements)
    except _SkillFailedError as failed:
        error, error_type = str(failed), type(failed.fault).__name__
    except ProgramError as fault:
        error, error_type = str(fault), ProgramError.__name__
    return Trace(tuple(run.steps), error, error_type, clock() - run.started)


class _SkillFailedError(Exception):
    """A skill raised an error that ends the program."""

    def __init__(self, line: int, what: str, fault: AvlmapsError) -> None:
        super().__init__(f"Line {line}, {what}: {fault}")
        self.fault = fault


class _Next(Enum):
    """Where a run continues after a statement."""

    STATEMENT = auto()
    ROUND = auto()
    AFTER_LOOP = auto()


_AFTER_WORD = {"pass": _Next.STATEMENT, "break": _Next.AFTER_LOOP, "continue": _Next.ROUND}


class _Run:
    """One run: the values of its names, and what is left of its budget."""

    def __init__(
        self, vocabulary: RobotSkills, budget: Budget, on_step: Callable[[Step], None], clock: Callable[[], float]
    ) -> None:
        self.vocabulary = vocabulary
        self.budget = budget
        self.on_step = on_step
        self.clock = clock
        self.started = clock()
        self.names: dict[str, Any] = {}
        self.steps: list[Step] = []
        self.worked_out = 0
        self.made = 0
        self.sizes = values.Sizes()

    # ---- the budget

    def step(self, line: int, count: int = 1) -> None:
        """Count computed parts; stop the program that has used them up."""
        before = self.worked_out
        self.worked_out += count
        if self.worked_out > self.budget.steps:
            raise refused(
                line, f"the program takes more than {self.budget.steps} steps; shorten its loops or raise the budget"
            )
        if before // _STEPS_BETWEEN_LOOKS != self.worked_out // _STEPS_BETWEEN_LOOKS:
            self.look_at_clock(line)

    def keep(self, line: int, elements: int) -> None:
        """Count elements made; stop the program that has used them up."""
        self.made += elements
        if self.made > self.budget.elements:
            raise refused(
                line,
                f"the program makes more than {self.budget.elements} elements of lists, texts and trace; make fewer or "
                "raise the budget",
            )

    def keep_value(self, line: int, value: Value) -> None:
        """Count the elements of a value that was made."""
        self.keep(line, self.sizes.of(line, value))

    def look_at_clock(self, line: int) -> None:
        """Stop the program whose time is over."""
        if self.clock() - self.started > self.budget.seconds:
            raise refused(line, f"the program takes longer than {self.budget.seconds:g} s; do less or raise the budget")

    # ---- statements

    def block(self, statements: tuple[syntax.Statement, ...]) -> _Next:
        for statement in statements:
            after = self.statement(statement)
            if after is not _Next.STATEMENT:
                return after
        return _Next.STATEMENT

    def statement(self, statement: syntax.Statement) -> _Next:
        self.step(statement.line)
        match statement:
            case syntax.Assign():
                self.give(statement.line, statement.target, self.value(statement.value))
            case syntax.Update():
                self.update(statement)
            case syntax.Perform():
                self.value(statement.call)
            case syntax.If():
                return self.block(self.chosen_block(statement))
            case syntax.For():
                return self.loop(statement)
            case syntax.Word():
                return _AFTER_WORD[statement.word]
        return _Next.STATEMENT

    def chosen_block(self, statement: syntax.If) -> tuple[syntax.Statement, ...]:
        for branch in statement.branches:
            if self.truth(branch.test):
                return branch.body
        return statement.otherwise

    def loop(self, statement: syntax.For) -> _Next:
        through = self.value(statement.through)
        value_types.check_walked(statement.line, values.kind_of(through))
        for element in through:
            self.step(statement.line)
            self.give(statement.line, statement.target, element)
            if self.block(statement.body) is _Next.AFTER_LOOP:
                break
        return _Next.STATEMENT

    def give(self, line: int, target: syntax.AssignmentTarget, value: Any) -> None:
        if not target.unpacks:
            self.names[target.names[0]] = value
            return
        value_types.check_unpacked(line, values.kind_of(value))
        if len(value) != len(target.names):
            raise misfit(line, target, len(value))
        self.names.update(zip(target.names, value, strict=True))

    def update(self, statement: syntax.Update) -> None:
        before = self.value(syntax.Name(statement.name, statement.line))
        value = self.value(statement.value)
        if statement.operator == "+" and values.kind_of(before) is values.kind_of(value) is ValueType.LIST:
            raise grown(statement)
        self.names[statement.name] = self.arithmetic(statement.line, statement.operator, before, value)

    # ---- expressions

    def value(self, part: syntax.Expression) -> Any:
        self.step(part.line)
        return _EVALUATE[type(part)](self, part)

    def truth(self, part: syntax.Expression) -> bool:
        value = self.value(part)
        value_types.check_truth(part.line, values.kind_of(value))
        return bool(value)

    def constant(self, part: syntax.Constant) -> Value:
        return part.value

    def name(self, part: syntax.Name) -> Value:
        try:
            return self.names[part.name]
        except KeyError:
            raise refused(
                part.line, f"`{part.name}` has no value yet; give it one before, on every way that leads here"
            ) from None

    def collection(self, part: syntax.Collection) -> Value:
        elements = [self.value(element) for element in part.elements]
        made = elements if part.is_list else tuple(elements)
        self.keep_value(part.line, made)
        return made

    def unary(self, part: syntax.Unary) -> Value:
        if part.operator == "not":
            return not self.truth(part.operand)
        return values.signed(part.line, part.operator, self.value(part.operand))

    def binary(self, part: syntax.Binary) -> Value:
        left = self.value(part.left)
        return self.arithmetic(part.line, part.operator, left, self.value(part.right))

    def arithmetic(self, line: int, operator: str, left: Any, right: Any) -> Value:
        try:
            made = values.combined(line, operator, left, right, self.budget.factors)
        except ProgramError:
            raise
        except AvlmapsError as fault:
            raise _SkillFailedError(line, f"`{operator}`", fault) from fault
        if isinstance(made, (str, list, tuple)):
            self.keep_value(line, made)
        elif isinstance(made, values.Made):
            self.keep(line, len(made.how))
            self.look_at_clock(line)
        return made

    def comparison(self, part: syntax.Comparison) -> bool:
        left = self.value(part.first)
        for operator, operand in zip(part.operators, part.rest, strict=True):
            right = self.value(operand)
            value_types.check_comparison(part.line, operator, values.kind_of(left), values.kind_of(right))
            for value in (left, right):
                self.step(part.line, self.sizes.of(part.line, value))
            if not _COMPARE[operator](left, right):
                return False
            left = right
        return True

    def logical(self, part: syntax.Logical) -> Value:
        stops_at = part.operator == "or"
        for operand in part.operands[:-1]:
            value = self.value(operand)
            value_types.check_truth(operand.line, values.kind_of(value))
            if bool(value) is stops_at:
                return value
        return self.value(part.operands[-1])

    def conditional(self, part: syntax.Conditional) -> Value:
        return self.value(part.chosen if self.truth(part.test) else part.otherwise)

    def element(self, part: syntax.Element) -> Value:
        of, index = self.value(part.of), self.value(part.index)
        value_types.check_indexed(part.line, values.kind_of(of), values.kind_of(index))
        return values.element_of(part.line, of, index)

    def builtin_call(self, part: syntax.BuiltinCall) -> Value:
        arguments = [self.value(argument) for argument in part.arguments]
        kinds = tuple(values.kind_of(argument) for argument in arguments)
        value_types.check_function(part.line, part.function, kinds)
        if part.function in ("min", "max") and kinds[0] in value_types.COLLECTIONS:
            self.step(part.line, len(arguments[0]))
        return values.call_function(part.line, part.function, arguments)

    # ---- skills

    def skill_call(self, part: syntax.SkillCall) -> Value:
        skill = SKILLS[part.skill]
        arguments = {argument.parameter: self.value(argument.value) for argument in part.arguments}
        for name, value in arguments.items():
            check_argument(part.line, skill, parameter_of(skill, name), values.kind_of(value))
        check_exactly_one(part.line, skill, sum(arguments.get(name) is not None for name in skill.alternatives))
        self.look_at_clock(part.line)
        if len(self.steps) == self.budget.skill_calls:
            raise refused(
                part.line,
                f"the program calls more than {self.budget.skill_calls} skills; shorten its loops or raise the budget",
            )
        seen = {name: values.shown(value) for name, value in arguments.items()}
        self.keep(part.line, values.size_of_shown(seen))
        return self.perform(part, arguments, seen)

    def perform(self, part: syntax.SkillCall, arguments: dict[str, Any], seen: dict[str, Any]) -> Value:
        """Call the skill, the one place where a program reaches anything."""
        skill, began = SKILLS[part.skill], self.clock()
        given = {name: values.handed_on(value) for name, value in arguments.items()}
        try:
            returned = getattr(self.vocabulary, skill.name)(**given)
        except AvlmapsError as fault:
            self.record(Step(skill.name, seen, None, part.line, self.clock() - began, str(fault)))
            raise _SkillFailedError(part.line, skill.name, fault) from fault
        how = f"{skill.name}({', '.join(f'{name}={told(value)}' for name, value in seen.items())})"
        result = values.adopted(skill, returned, how)
        content = values.shown(result)
        self.record(Step(skill.name, seen, content, part.line, self.clock() - began))
        self.keep_value(part.line, result)
        self.keep(part.line, values.size_of_shown(content))
        return result

    def record(self, step: Step) -> None:
        self.steps.append(step)
        self.on_step(step)


_EVALUATE: dict[type, Callable[[_Run, Any], Value]] = {
    syntax.Constant: _Run.constant,
    syntax.Name: _Run.name,
    syntax.Collection: _Run.collection,
    syntax.Unary: _Run.unary,
    syntax.Binary: _Run.binary,
    syntax.Comparison: _Run.comparison,
    syntax.Logical: _Run.logical,
    syntax.Conditional: _Run.conditional,
    syntax.Element: _Run.element,
    syntax.SkillCall: _Run.skill_call,
    syntax.BuiltinCall: _Run.builtin_call,
}
_COMPARE: dict[str, Callable[[Any, Any], bool]] = {
    "==": lambda left, right: left == right,
    "!=": lambda left, right: left != right,
    "<": lambda left, right: left < right,
    "<=": lambda left, right: left <= right,
    ">": lambda left, right: left > right,
    ">=": lambda left, right: left >= right,
    "in": values.is_among,
    "not in": lambda left, right: not values.is_among(left, right),
    "is": lambda left, right: left is right,
    "is not": lambda left, right: left is not right,
}
