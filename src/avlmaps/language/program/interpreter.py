"""Runs a parsed program over a vocabulary, and its trace. Nothing but the skills of the table is ever called."""

import ast
import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from time import monotonic
from typing import Any

from avlmaps.core.errors import AvlmapsError, ProgramError, SeveralFitError
from avlmaps.language.program import parser, values
from avlmaps.language.program.parser import SIGNS, Program, called
from avlmaps.language.program.values import Budget, Value, refused
from avlmaps.language.program.vocabulary import ValueType, skills

# Between two skills the clock is read once in this many steps.
_STEPS_BETWEEN_LOOKS = 256


@dataclass(frozen=True, slots=True)
class Step:
    """One call of a skill, with values as JSON has them: {"place": [x, y, z]} in metres, {"heat": "get_map(...)"}."""

    skill: str
    arguments: Mapping[str, Any]
    result: Any  # None where it failed
    line: int  # of the program, from 1
    elapsed_s: float
    error: str | None = None

    @property
    def text(self) -> str:
        """The call as a person reads it."""
        return f"{self.skill}({', '.join(f'{name}={told(given)}' for name, given in self.arguments.items())})"

    def to_json(self) -> dict[str, Any]:
        """Return the step as JSON has it."""
        return asdict(self) | {"elapsed_s": round(self.elapsed_s, 3)}


@dataclass(frozen=True, slots=True)
class Trace:
    """The trace of one run of a program."""

    steps: tuple[Step, ...]  # a failed one last
    error: str | None  # one sentence that names the line; None where it ran to its end
    error_type: str | None  # such as "GoalNotFoundError"
    elapsed_s: float

    @property
    def ok(self) -> bool:
        """Whether the program ran to its end."""
        return self.error is None

    def to_json(self) -> dict[str, Any]:
        """Return the trace as JSON has it."""
        steps, elapsed_s = [step.to_json() for step in self.steps], round(self.elapsed_s, 3)
        return {
            "ok": self.ok,
            "error": self.error,
            "error_type": self.error_type,
            "steps": steps,
            "elapsed_s": elapsed_s,
        }

    def lines(self) -> list[str]:
        """Return the trace as lines for people: every call, what it returned, and the error at the end."""
        lines = []
        for step in self.steps:
            is_heat = isinstance(step.result, dict) and "heat" in step.result
            came = "" if step.result is None else " -> a Heat" if is_heat else f" -> {told(step.result)}"
            lines.append(f"line {step.line}: {step.text}{came}" + (" failed" if step.error else ""))
        return lines + ([self.error] if self.error else [])


def told(content: Any) -> str:
    """Return a value of a trace as a person reads it."""
    match content:
        case {"place": coordinates}:
            return f"({', '.join(f'{value:.2f}' for value in coordinates)})"
        case {"heat": how}:
            return how
        case {"picture": _} | {"clip": _}:
            return " ".join(f"{kind} {path!r}" for kind, path in content.items())
        case list():
            few = ", ".join(told(each) for each in content[:3])
            return f"[{few}, ... {len(content)} in all]" if len(content) > 3 else f"[{few}]"
        case float():  # NumPy's are floats, too, and write their type into their repr
            return repr(float(content))
    return repr(content)


def run_program(
    program: Program,
    vocabulary: object,
    budget: Budget | None = None,
    on_step: Callable[[Step], None] | None = None,
    *,
    clock: Callable[[], float] = monotonic,
) -> Trace:
    """Run a program to its end, or to its first error; the trace holds the error, and what was done.

    Errors of the project's family that a skill raises end the program and stand in the trace. Any other exception is a
    mistake of the vocabulary's programmer and comes through, as does the user's interrupt. ``on_step`` is called with
    each step once it is over, a failed one too.
    """
    run = _Run(vocabulary, budget or Budget(), on_step or (lambda step: None), clock)
    error = error_type = None
    try:
        run.block(program.statements)
    except _SkillFailedError as failed:
        error, error_type = str(failed), type(failed.fault).__name__
    except ProgramError as fault:
        error, error_type = str(fault), ProgramError.__name__
    return Trace(tuple(run.steps), error, error_type, clock() - run.started)


def _over(line: int, what: str, remedy: str = "shorten its loops") -> ProgramError:
    return refused(line, f"the program {what}; {remedy} or raise the budget")


class _SkillFailedError(Exception):
    def __init__(self, line: int, what: str, fault: AvlmapsError) -> None:
        asks = isinstance(fault, SeveralFitError)  # a question to the person, who sees no line
        super().__init__(str(fault) if asks else f"Line {line}, {what}: {fault}")
        self.fault = fault


class _Run:
    def __init__(
        self, vocabulary: object, budget: Budget, on_step: Callable[[Step], None], clock: Callable[[], float]
    ) -> None:
        self.vocabulary, self.budget, self.on_step, self.clock = vocabulary, budget, on_step, clock
        self.started = clock()
        self.names: dict[str, Any] = {}
        self.steps: list[Step] = []
        self.computed = self.made = 0

    def step(self, line: int, count: int = 1) -> None:
        before = self.computed
        self.computed += count
        if self.computed > self.budget.steps:
            raise _over(line, f"takes more than {self.budget.steps} steps")
        if before // _STEPS_BETWEEN_LOOKS != self.computed // _STEPS_BETWEEN_LOOKS:
            self.look_at_clock(line)

    def keep(self, line: int, elements: int) -> None:
        self.made, most = self.made + elements, self.budget.elements
        if self.made > most:
            raise _over(line, f"makes more than {most} elements of lists, texts and trace", "make fewer")

    def look_at_clock(self, line: int) -> None:
        if self.clock() - self.started > self.budget.seconds:
            raise _over(line, f"takes longer than {self.budget.seconds:g} s", "do less")

    def block(self, statements: Sequence[ast.stmt]) -> ast.stmt | None:
        """Run statements; return the ``break`` or ``continue`` that ended them."""
        return next(filter(None, map(self.statement, statements)), None)

    def statement(self, node: ast.stmt) -> ast.stmt | None:
        self.step(node.lineno)
        match node:
            case ast.Assign(targets=[target]):
                self.give(target, self.value(node.value))
            case ast.AugAssign(target=ast.Name(id=name)):
                before, value = self.name(node.lineno, name), self.value(node.value)
                sign = SIGNS[type(node.op)]
                if sign == "+" and values.kind_of(before) is values.kind_of(value) is ValueType.LIST:
                    # In Python it changes under all of its names.
                    raise refused(node.lineno, f"a list is not changed but made again; write `{name} = {name} + [...]`")
                self.names[name] = self.arithmetic(node.lineno, sign, before, value)
            case ast.Expr():
                self.value(node.value)
            case ast.If():
                chosen, otherwise = parser.branches_of(node)
                return self.block(next((each.body for each in chosen if self.truth(each.test)), otherwise))
            case ast.For():
                for element in self.needed(node.iter, "walk"):
                    self.step(node.lineno)
                    self.give(node.target, element)
                    if isinstance(self.block(node.body), ast.Break):
                        break
            case ast.Break() | ast.Continue():
                return node
        return None

    def give(self, target: ast.expr, value: Any) -> None:
        names = parser.target_names(target)
        if isinstance(target, ast.Name):
            value = [value]
        else:
            values.needed(target.lineno, "unpack", value)
        if len(value) != len(names):
            raise refused(target.lineno, f"{len(names)} names cannot take {len(value)} values; give one value to each")
        self.names.update(zip(names, value, strict=True))

    def value(self, node: ast.expr) -> Any:  # noqa: C901 - one case for each form
        line = node.lineno
        self.step(line)
        match node:
            case ast.Constant():
                return node.value
            case ast.Name(id=name):
                return self.name(line, name)
            case ast.List() | ast.Tuple():
                elements = [self.value(each) for each in node.elts]
                self.keep(line, 1 + len(elements))
                return elements if isinstance(node, ast.List) else tuple(elements)
            case ast.UnaryOp(op=ast.Not()):
                return not self.truth(node.operand)
            case ast.UnaryOp():
                number = self.needed(node.operand, "sign")
                return -number if isinstance(node.op, ast.USub) else number
            case ast.BinOp():
                left, right = self.value(node.left), self.value(node.right)
                return self.arithmetic(line, SIGNS[type(node.op)], left, right)
            case ast.Compare():
                return self.comparison(node)
            case ast.BoolOp():
                for operand in node.values[:-1]:
                    value = self.needed(operand, "truth")
                    if bool(value) is isinstance(node.op, ast.Or):
                        return value
                return self.value(node.values[-1])
            case ast.IfExp():
                return self.value(node.body if self.truth(node.test) else node.orelse)
            case ast.Subscript():
                return values.element_of(line, self.needed(node.value, "index of"), self.needed(node.slice, "index"))
            case ast.Call() if called(node) in skills():
                return self.skill_call(node)
            case ast.Call():
                name, arguments = called(node), [self.value(each) for each in node.args]
                if name in ("min", "max"):
                    self.step(line, sum(len(each) for each in arguments if isinstance(each, (list, tuple, range))))
                return values.call_function(line, name, arguments)

    def name(self, line: int, name: str) -> Value:
        if name not in self.names:
            raise refused(line, f"`{name}` has no value yet; give it one before, on every way that leads here")
        return self.names[name]

    def needed(self, node: ast.expr, use: str) -> Any:
        return values.needed(node.lineno, use, self.value(node))

    def truth(self, node: ast.expr) -> bool:
        return bool(self.needed(node, "truth"))

    def arithmetic(self, line: int, sign: str, left: Any, right: Any) -> Value:
        try:
            made = values.combined(line, sign, left, right, self.budget.factors)
        except ProgramError:
            raise
        except AvlmapsError as fault:
            raise _SkillFailedError(line, f"`{sign}`", fault) from fault
        if isinstance(made, (str, list, tuple)):
            self.keep(line, 1 + len(made))
        elif isinstance(made, values.Made):
            self.keep(line, len(made.how))
            self.look_at_clock(line)
        return made

    def comparison(self, node: ast.Compare) -> bool:
        left = self.value(node.left)
        for op, operand in zip(node.ops, node.comparators, strict=True):
            right, sign = self.value(operand), SIGNS[type(op)]
            self.step(node.lineno, values.compared(node.lineno, sign, left, right))
            if not _COMPARE[sign](left, right):
                return False
            left = right
        return True

    def skill_call(self, node: ast.Call) -> Value:
        """Call a skill, the one place where a program reaches anything."""
        line, skill = node.lineno, skills()[called(node)]
        arguments = {name: self.value(each) for name, each in parser.given_to(skill, node).items()}
        parser.check_arguments(line, skill, {name: values.kind_of(value) for name, value in arguments.items()})
        self.look_at_clock(line)
        if len(self.steps) == self.budget.skill_calls:
            raise _over(line, f"calls more than {self.budget.skill_calls} skills")
        seen = {name: values.shown(value) for name, value in arguments.items()}
        self.keep(line, values.size_of_shown(seen))
        began = self.clock()
        try:
            given = {name: values.handed_on(value) for name, value in arguments.items()}
            returned = getattr(self.vocabulary, skill.name)(**given)
        except AvlmapsError as fault:
            self.record(Step(skill.name, seen, None, line, self.clock() - began, str(fault)))
            raise _SkillFailedError(line, skill.name, fault) from fault
        done = Step(skill.name, seen, None, line, self.clock() - began)
        result = values.adopted(skill, returned, done.text)
        content = values.shown(result)
        self.record(replace(done, result=content))
        self.keep(line, values.size_of_shown(content))
        return result

    def record(self, step: Step) -> None:
        self.steps.append(step)
        self.on_step(step)


_COMPARE: dict[str, Callable[[Any, Any], bool]] = {
    "==": operator.eq, "!=": operator.ne, "<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge,
    "is": operator.is_, "is not": operator.is_not, "in": values.is_among,
    "not in": lambda left, right: not values.is_among(left, right),
}  # fmt: skip
