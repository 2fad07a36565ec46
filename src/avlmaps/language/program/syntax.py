"""The parts of a program: a few frozen types, and nothing that reaches outside them."""

from collections.abc import Iterator
from dataclasses import dataclass, field, fields
from typing import cast


class _Part:
    """An expression; those right inside are among its fields."""

    __slots__ = ()

    @property
    def children(self) -> "tuple[Expression, ...]":
        """The expressions right inside, in the order of the text."""
        held = (getattr(self, each.name) for each in fields(self))  # pyright: ignore[reportArgumentType] - a dataclass
        every = (one for value in held for one in (value if isinstance(value, tuple) else (value,)))
        return tuple(cast("Expression", one) for one in every if isinstance(one, _Part))


@dataclass(frozen=True, slots=True)
class Constant(_Part):
    """None, True, False, a number or a string, as written."""

    value: bool | int | float | str | None
    line: int = field(compare=False)


@dataclass(frozen=True, slots=True)
class Name(_Part):
    """A value that was given a name before."""

    name: str
    line: int = field(compare=False)


@dataclass(frozen=True, slots=True)
class Collection(_Part):
    """A list or a tuple, written out."""

    elements: "tuple[Expression, ...]"
    is_list: bool
    line: int = field(compare=False)


@dataclass(frozen=True, slots=True)
class Unary(_Part):
    """`-x`, `+x` or `not x`."""

    operator: str
    operand: "Expression"
    line: int = field(compare=False)


@dataclass(frozen=True, slots=True)
class Binary(_Part):
    """Arithmetic on two values."""

    operator: str
    left: "Expression"
    right: "Expression"
    line: int = field(compare=False)


@dataclass(frozen=True, slots=True)
class Comparison(_Part):
    """`a < b`, or a chain such as `a < b <= c`."""

    first: "Expression"
    operators: tuple[str, ...]
    rest: "tuple[Expression, ...]"
    line: int = field(compare=False)


@dataclass(frozen=True, slots=True)
class Logical(_Part):
    """`a and b and c`, or the same with `or`."""

    operator: str
    operands: "tuple[Expression, ...]"
    line: int = field(compare=False)


@dataclass(frozen=True, slots=True)
class Conditional(_Part):
    """`a if test else b`."""

    test: "Expression"
    chosen: "Expression"
    otherwise: "Expression"
    line: int = field(compare=False)


@dataclass(frozen=True, slots=True)
class Element(_Part):
    """One element of a list or a tuple."""

    of: "Expression"
    index: "Expression"
    line: int = field(compare=False)


@dataclass(frozen=True, slots=True)
class Argument:
    """The argument of one parameter of a skill.

    Attributes:
        parameter: the name in the skill's signature.
        value: what it is given.
        named: whether the program wrote the name.
    """

    parameter: str
    value: "Expression"
    named: bool


@dataclass(frozen=True, slots=True)
class SkillCall(_Part):
    """A call of a skill, its arguments in the order in which they are computed."""

    skill: str
    arguments: tuple[Argument, ...]
    line: int = field(compare=False)

    @property
    def children(self) -> "tuple[Expression, ...]":
        """The expressions right inside."""
        return tuple(argument.value for argument in self.arguments)


@dataclass(frozen=True, slots=True)
class BuiltinCall(_Part):
    """A call of `len`, `min`, `max`, `abs`, `range` or `round`."""

    function: str
    arguments: "tuple[Expression, ...]"
    line: int = field(compare=False)


Expression = (
    Constant
    | Name
    | Collection
    | Unary
    | Binary
    | Comparison
    | Logical
    | Conditional
    | Element
    | SkillCall
    | BuiltinCall
)


@dataclass(frozen=True, slots=True)
class AssignmentTarget:
    """The left side of an assignment: one name, or several that a collection is taken apart into."""

    names: tuple[str, ...]
    unpacks: bool


@dataclass(frozen=True, slots=True)
class Assign:
    """`name = value` or `a, b = value`."""

    target: AssignmentTarget
    value: Expression
    line: int = field(compare=False)


@dataclass(frozen=True, slots=True)
class Update:
    """`name += value` and its like."""

    name: str
    operator: str
    value: Expression
    line: int = field(compare=False)


@dataclass(frozen=True, slots=True)
class Perform:
    """A skill's call that stands on a line of its own."""

    call: SkillCall
    line: int = field(compare=False)


@dataclass(frozen=True, slots=True)
class Branch:
    """One `if` or `elif` with its block."""

    test: Expression
    body: "tuple[Statement, ...]"
    line: int = field(compare=False)


@dataclass(frozen=True, slots=True)
class If:
    """The branches of an `if` in their order, and the block of its `else`."""

    branches: tuple[Branch, ...]
    otherwise: "tuple[Statement, ...]"
    line: int = field(compare=False)


@dataclass(frozen=True, slots=True)
class For:
    """A block that is run once for each element of a collection."""

    target: AssignmentTarget
    through: Expression
    body: "tuple[Statement, ...]"
    line: int = field(compare=False)


@dataclass(frozen=True, slots=True)
class Word:
    """`pass`, `break` or `continue`."""

    word: str
    line: int = field(compare=False)


Statement = Assign | Update | Perform | If | For | Word


@dataclass(frozen=True, slots=True)
class Program:
    """A program that was parsed and checked; two are equal if they do the same on the face of it.

    Attributes:
        statements: its lines and blocks, in their order.
        text: what was parsed.
    """

    statements: tuple[Statement, ...]
    text: str = field(compare=False, repr=False)

    @property
    def skills(self) -> tuple[str, ...]:
        """The skills that the program calls, each once, in the order of its text."""
        parts = (part for top in expressions_of(self.statements) for part in parts_of(top))
        return tuple(dict.fromkeys(part.skill for part in parts if isinstance(part, SkillCall)))


def parts_of(top: Expression) -> Iterator[Expression]:
    """Yield an expression and everything inside it, in the order of the text."""
    waiting = [top]
    while waiting:
        part = waiting.pop()
        yield part
        waiting.extend(reversed(part.children))


def statements_of(block: tuple[Statement, ...]) -> Iterator[Statement]:
    """Yield the statements of a block and of the blocks inside it, in the order of the text."""
    for statement in block:
        yield statement
        if isinstance(statement, For):
            yield from statements_of(statement.body)
        elif isinstance(statement, If):
            for branch in statement.branches:
                yield from statements_of(branch.body)
            yield from statements_of(statement.otherwise)


def expressions_of(block: tuple[Statement, ...]) -> Iterator[Expression]:
    """Yield the outermost expressions of a block and of the blocks inside it."""
    for statement in statements_of(block):
        match statement:
            case Assign() | Update():
                yield statement.value
            case Perform():
                yield statement.call
            case For():
                yield statement.through
            case If():
                yield from (branch.test for branch in statement.branches)
            case Word():
                pass
