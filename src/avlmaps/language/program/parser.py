"""From text to a program: Python's own parser reads it, and a whitelist of its nodes says what may stand in one.

What Python's parser must not see is refused before it: characters that hide what a line does, names that only look like
others, numbers and strings in unusual forms, brackets that nest without end. A program without a part on the whitelist
is refused by its line, and so is one that must fail wherever it gets to: a robot that has begun to move should not stop
half way for a slip that could be seen from the start. What is left means what Python means by it.
"""

import ast
import keyword
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from avlmaps.core.errors import ProgramError
from avlmaps.core.printable import UNSAFE, printable
from avlmaps.core.words import nearest
from avlmaps.language.program.values import (
    bounded,
    check_comparison,
    check_function,
    check_kind,
    kind_of,
    kind_of_result,
    refused,
)
from avlmaps.language.program.vocabulary import ROBOT, SKILLS, Parameter, Skill, ValueType

MOST_CHARACTERS = 20_000
LONGEST_NAME = 64
DEEPEST_BLOCK = 10
DEEPEST = 50
"""How deep an expression may nest: far beyond what anyone writes, far within what recursion can take."""
# How few and how many arguments each function takes; None is no limit.
BUILTINS: Mapping[str, tuple[int, int | None]] = {
    "len": (1, 1), "min": (1, None), "max": (1, None), "abs": (1, 1), "range": (1, 3), "round": (1, 2),
}  # fmt: skip
SIGNS: Mapping[type, str] = {
    ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.FloorDiv: "//", ast.Mod: "%", ast.USub: "-",
    ast.UAdd: "+", ast.Not: "not", ast.And: "and", ast.Or: "or", ast.Eq: "==", ast.NotEq: "!=", ast.Lt: "<",
    ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.In: "in", ast.NotIn: "not in", ast.Is: "is", ast.IsNot: "is not",
}  # fmt: skip
_LONGEST_NUMBER = 40
_NUMBER = re.compile(r"(?:[0-9][0-9_]*(?:\.[0-9_]*)?|\.[0-9_]+)(?:[eE][+-]?[0-9_]+)?")
_PIECE = re.compile(
    r"""
    (?P<comment>\#[^\n]*)
    | (?P<string>[A-Za-z_]*(?:'(?:[^'\\\n]|\\.)*'|"(?:[^"\\\n]|\\.)*")) | (?P<open>['"])
    | (?P<number>(?:[0-9]|\.[0-9])(?:(?<=[eE])[+-]|[A-Za-z0-9_.])*)
    | (?P<name>[A-Za-z_][A-Za-z0-9_]*) | (?P<bracket>[()\[\]{}]) | (?P<strange>[^\x00-\x7f])
    """,
    re.VERBOSE,
)
_PREFIXES = re.compile(rf"(?:[-+~][ \t]*){{{DEEPEST},}}|(?:not[ \t]+){{{DEEPEST},}}")
_ESCAPE = re.compile(r"\\(?:x[0-9a-fA-F]{2}|u[0-9a-fA-F]{4}|U[0-9a-fA-F]{8}|[\\'\"nt])|\\(?P<odd>.)")
# What is no part of a program, and what is to be written instead.
_INSTEAD = {
    "While": "count with a bounded loop, such as `for i in range(10):`",
    "Import ImportFrom": "the skills and `len, min, max, abs, range, round` are all there is",
    "With AsyncWith AsyncFor Await": "call skills one after the other",
    "Try TryStar Raise": "a skill that fails ends the program by itself",
    "Assert Match": "use `if`",
    "Delete": "let the name be, or give it another value",
    "Global Nonlocal": "every name is seen everywhere",
    "FunctionDef AsyncFunctionDef ClassDef Return Yield YieldFrom Lambda": "write the steps one after the other",
    "ListComp SetComp DictComp GeneratorExp": "write the loop on lines of its own",
    "Set Dict": "write a list, [...]",
    "Slice": "pick one element, or go through all with `for`",
    "Starred": "write each value",
    "NamedExpr AnnAssign TypeAlias": "a name is given a value on a line of its own, with `=` alone",
    "Pow MatMult LShift RShift BitAnd BitOr BitXor Invert": "use `+ - * / // %`, `and`, `or` and `not`",
}
_REMEDIES = {name: remedy for names, remedy in _INSTEAD.items() for name in names.split()}


@dataclass(frozen=True, slots=True, eq=False)
class Program:
    """A program that was parsed and checked.

    Attributes:
        statements: its lines and blocks, in their order: nodes of Python's own kind, all of them on the whitelist.
        text: what was parsed.
    """

    statements: Sequence[ast.stmt]
    text: str = field(repr=False)

    @property
    def calls(self) -> Iterator[ast.Call]:
        """All calls, in no order."""
        return (node for statement in self.statements for node in ast.walk(statement) if isinstance(node, ast.Call))

    @property
    def skills(self) -> tuple[str, ...]:
        """The skills that the program calls, each once, in the order of its text."""
        named = sorted(self.calls, key=lambda call: (call.lineno, call.col_offset))
        return tuple(dict.fromkeys(name for name in map(called, named) if name in SKILLS))


def parse_program(text: str) -> Program:
    """Return the program that a text is, with every check that can be made before it runs.

    Args:
        text: lines in a small subset of Python; see docs/programs.md.

    Raises:
        ProgramError: something in it is no part of a program, or is used as it cannot be; it names the line.
    """
    if len(text) > MOST_CHARACTERS:
        raise ProgramError(
            f"The program has {len(text)} characters, more than {MOST_CHARACTERS}; use a loop, or split it in two."
        )
    plain = text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n")
    _check_text(plain)
    statements = _tree(plain).body
    if not statements:
        raise ProgramError("The program is empty; write at least one line, such as `robot.move_to('chair')`.")
    _Checker(statements).block(statements)
    return Program(statements, text)


def _tree(text: str) -> ast.Module:
    """Return what Python's parser makes of a text. Its file has no name, so that no error can quote one."""
    try:
        return ast.parse(text, filename="")
    except SyntaxError as fault:
        said = printable(fault.msg or "invalid syntax", 200).rstrip(".?!")
        raise refused(fault.lineno or 1, f"this is not written as Python ({said}); mend the line") from None
    except (RecursionError, MemoryError):
        raise _too_deep(1) from None
    except ValueError:
        raise refused(1, "a character of the program is half of one; remove it") from None


def _check_text(text: str) -> None:  # noqa: C901 - one case for each kind of piece
    """Refuse what Python's parser must not see."""
    depth, line, seen = 0, 1, 0
    found = next((found for found in UNSAFE.finditer(text) if found.group() not in "\n\t"), None)
    if found:
        line = text.count("\n", 0, found.start()) + 1
        raise refused(line, f"the character U+{ord(found.group()):04X} has no place in a program; remove it")
    for piece in _PIECE.finditer(text):
        line, seen = line + text.count("\n", seen, piece.start()), piece.start()
        said = piece.group()
        match piece.lastgroup:
            case "string":
                _check_string(line, said)
                if len(said) == 2 and text.startswith(said[0], piece.end()):
                    raise refused(line, "strings have one quote on each side; write a comment with #")
            case "open":
                raise refused(line, f"the string that starts with {said} does not end on its line; close it")
            case "number" if len(said) > _LONGEST_NUMBER:
                raise refused(line, f"the number `{said[:12]}...` has more than {_LONGEST_NUMBER} characters; round it")
            case "number" if not _NUMBER.fullmatch(said):
                raise refused(line, f"`{said}` is no number; write it in plain digits, such as 12 or 0.5")
            case "name" if len(said) > LONGEST_NAME:
                raise refused(line, f"the name `{said[:20]}...` is longer than {LONGEST_NAME} letters; shorten it")
            case "name" if said.startswith("__"):
                raise refused(line, f"`{said}` starts with two underscores, as no name may; choose another name")
            case "strange":
                raise refused(
                    line, f"the character {said!r} (U+{ord(said):04X}) has no meaning here; names are written in the "
                    "letters a to z, phrases between quotes",
                )  # fmt: skip
            case "bracket":
                depth += 1 if said in "([{" else -1
                if depth > DEEPEST:
                    raise _too_deep(line)
            case _:
                pass
    found = _PREFIXES.search(text)
    if found:
        raise _too_deep(text.count("\n", 0, found.start()) + 1)


def _check_string(line: int, text: str) -> None:
    prefix = text[: min(text.index(quote) for quote in "'\"" if quote in text)]
    if prefix not in ("", "r", "R"):
        raise refused(
            line, f"a string has no `{printable(prefix, 40)}` before its quote; write it plainly, or join with +"
        )
    odd = next((found["odd"] for found in _ESCAPE.finditer(text) if found["odd"]), None) if not prefix else None
    if odd is not None:
        raise refused(
            line, f"the string has a backslash before {odd!r}, which makes no character; write `\\\\` for a backslash"
        )


def called(call: ast.Call) -> str:
    """Return the name of the skill or function that a call on the whitelist calls."""
    return call.func.attr if isinstance(call.func, ast.Attribute) else call.func.id  # type: ignore[attr-defined]


def given_to(skill: Skill, call: ast.Call) -> dict[str, ast.expr]:
    """Return the arguments of a call by the names of their parameters."""
    return dict(zip(skill.parameters, call.args, strict=False)) | {
        each.arg: each.value for each in call.keywords if each.arg
    }


def branches_of(node: ast.If) -> tuple[list[ast.If], list[ast.stmt]]:
    """Return an `if` with its `elif`s, which Python nests in each other, and the block of its `else`."""
    found = [node]
    while len(node.orelse) == 1 and isinstance(inner := node.orelse[0], ast.If) and inner.col_offset == node.col_offset:
        node = inner
        found.append(node)
    return found, node.orelse


def check_argument(line: int, skill: Skill, parameter: Parameter, kind: ValueType) -> None:
    """Refuse a skill an argument of a kind that its parameter does not take."""
    if kind in parameter.kinds:
        return
    takes = [str(each) for each in ValueType if each in parameter.kinds]
    wanted = takes[0] if len(takes) == 1 else f"{', '.join(takes[:-1])} or {takes[-1]}"
    makers = [f"`{other.name}`" for other in SKILLS.values() if {other.returns} == parameter.kinds]
    made = f"; {' or '.join(makers)} gives one" if makers else ""
    raise refused(
        line, f"`{skill.name}` takes {wanted} as its `{parameter.name}`, not {kind}; it is {skill.signature}{made}"
    )


def check_exactly_one(line: int, skill: Skill, given: int) -> None:
    """Refuse none, or several, of what are alternatives."""
    if skill.alternatives and given != 1:
        many = "none" if given == 0 else given
        raise refused(line, f"`{skill.name}` takes exactly one of {_listed(skill.alternatives, 'or')}, not {many}")


def grown(line: int, name: str) -> ProgramError:
    """Return the refusal of `+=` on a list, which in Python changes it under all of its names."""
    return refused(line, f"a list is not changed but made again; write `{name} = {name} + [...]`")


def misfit(line: int, names: int, values: int) -> ProgramError:
    """Return the refusal of an assignment of more or fewer values than names."""
    return refused(line, f"{names} names cannot take {values} values; give one value to each")


def target_names(target: ast.expr) -> list[str]:
    """Return the names on the left side of an assignment."""
    return [
        each.id for each in (target.elts if isinstance(target, ast.Tuple) else [target]) if isinstance(each, ast.Name)
    ]


Guess = ValueType | None  # the kind of a value; None where it may have several


class _Checker:
    """Refuses a program that has a part that is none, or that must fail wherever it gets to what is wrong.

    A name has a kind where one line alone gives it a value.
    """

    def __init__(self, statements: Sequence[ast.stmt]) -> None:
        self.lines = Counter(name for one in statements for node in ast.walk(one) for name in _names_given(node))
        self.kinds: dict[str, Guess] = {}
        self.given: set[str] = set()  # the names that a line before gave a value

    def block(self, nodes: Sequence[ast.stmt], deep: int = 0, *, in_loop: bool = False) -> None:
        if deep > DEEPEST_BLOCK:
            raise refused(nodes[0].lineno, f"blocks nest more than {DEEPEST_BLOCK} deep; write a flatter program")
        for node in nodes:
            self.statement(node, deep + 1, in_loop)

    def statement(self, node: ast.stmt, deep: int, in_loop: bool) -> None:  # noqa: C901 - one case for each form
        line = node.lineno
        match node:
            case ast.Assign(targets=[target]):
                self.assign(target, node.value)
            case ast.Assign():
                raise refused(line, "a line has one `=`; give each name its value on a line of its own")
            case ast.AugAssign(target=ast.Name(id=name)):
                _check_assignable(line, name)
                before, sign = self.name(line, name), _sign(line, node.op)
                made = self.arithmetic(line, sign, before, self.value(node.value))
                if sign == "+" and made is ValueType.LIST:
                    raise grown(line, name)
                self.give(name, made)
            case ast.AugAssign():
                raise refused(line, "an update such as `+=` is of one name; write it out with `=`")
            case ast.Expr():
                self.value(node.value)
                if not (isinstance(node.value, ast.Call) and called(node.value) in SKILLS):
                    raise refused(line, "the line works out a value and does nothing with it; name it or call a skill")
            case ast.For(orelse=[]):
                self.loop(node, deep)
            case ast.For():
                raise refused(line, "`else` belongs to no `if`; put it right under its block")
            case ast.If():
                chosen, otherwise = branches_of(node)
                for each in chosen:
                    self.needed(each.test, "truth")
                    self.block(each.body, deep, in_loop=in_loop)
                if otherwise:
                    self.block(otherwise, deep, in_loop=in_loop)
            case ast.Break() | ast.Continue() if not in_loop:
                word = type(node).__name__.lower()
                raise refused(line, f"`{word}` is in no loop; put it into the block of a `for`")
            case ast.Pass() | ast.Break() | ast.Continue():
                pass
            case _:
                raise _no_part(line, node)

    def loop(self, node: ast.For, deep: int) -> None:
        kind, names = self.needed(node.iter, "walk"), _checked_target(node.target)
        counts = kind is ValueType.RANGE and isinstance(node.target, ast.Name)
        for name in names:
            self.give(name, ValueType.NUMBER if counts else None)
        # Any round but the first may use what a later line of the body gave.
        self.given.update(*(_names_given(inner) for inner in ast.walk(node)))
        self.block(node.body, deep, in_loop=True)

    def assign(self, target: ast.expr, value: ast.expr) -> None:
        names, kind = _checked_target(target), self.value(value)
        kinds: list[Guess] = [kind]
        if isinstance(target, ast.Tuple) and isinstance(value, ast.List | ast.Tuple):
            kinds = [self.value(each) for each in value.elts]
            if len(kinds) != len(names):
                raise misfit(target.lineno, len(names), len(kinds))
        elif isinstance(target, ast.Tuple):
            if isinstance(kind, ValueType):
                check_kind(target.lineno, "unpack", kind)
            kinds = [None] * len(names)
        for name, one in zip(names, kinds, strict=True):
            self.give(name, one)

    def give(self, name: str, kind: Guess) -> None:
        self.kinds[name] = kind if self.lines[name] == 1 else None
        self.given.add(name)

    def needed(self, node: ast.expr, use: str, deep: int = 0) -> Guess:
        """Return the kind of an expression; refuse one that does not serve a use."""
        kind = self.value(node, deep)
        if isinstance(kind, ValueType):
            check_kind(node.lineno, use, kind)
        return kind

    def value(self, node: ast.expr, deep: int = 0) -> Guess:  # noqa: C901 - one case for each form
        """Return the kind of an expression; refuse what is no part of a program, or cannot be."""
        line, deep = node.lineno, deep + 1
        if deep > DEEPEST:
            raise _too_deep(line)
        match node:
            case ast.Constant(value=None | bool() | str() | int() | float() as value):
                return _constant(line, value)
            case ast.Name(id=name):
                return self.name(line, name)
            case ast.List() | ast.Tuple():
                for each in node.elts:
                    self.value(each, deep)
                return ValueType.LIST if isinstance(node, ast.List) else ValueType.TUPLE
            case ast.UnaryOp(op=ast.Not()):
                self.needed(node.operand, "truth", deep)
                return ValueType.TRUTH
            case ast.UnaryOp():
                _sign(line, node.op)
                self.needed(node.operand, "sign", deep)
                return ValueType.NUMBER
            case ast.BinOp():
                sign = _sign(line, node.op)
                return self.arithmetic(line, sign, self.value(node.left, deep), self.value(node.right, deep))
            case ast.Compare():
                return self.comparison(node, deep)
            case ast.BoolOp():
                kinds = [self.needed(each, "truth", deep) for each in node.values[:-1]]
                kinds.append(self.value(node.values[-1], deep))
                return kinds[0] if len(set(kinds)) == 1 else None
            case ast.IfExp():
                self.needed(node.test, "truth", deep)
                kind, otherwise = self.value(node.body, deep), self.value(node.orelse, deep)
                return kind if kind is otherwise else None
            case ast.Subscript():
                self.needed(node.value, "index of", deep)
                self.needed(node.slice, "index", deep)
                return None
            case ast.Call():
                return self.call(node, deep)
            case ast.Attribute():
                raise _attribute(line, node)
            case _:
                raise _no_part(line, node)

    def name(self, line: int, name: str) -> Guess:
        if name == ROBOT:
            raise refused(line, f"`{ROBOT}` is no value; write `{ROBOT}.SKILL(...)`")
        if name in SKILLS or name in BUILTINS:
            raise refused(line, f"`{name}` is called, not handed on; write `{name}(...)`")
        if name not in self.given:
            raise _without_value(line, name, self.given, later=name in self.lines)
        return self.kinds.get(name)

    def comparison(self, node: ast.Compare, deep: int) -> Guess:
        parts = [node.left, *node.comparators]
        kinds = [self.value(each, deep) for each in parts]
        for at, each in enumerate(node.ops):
            sign, left, right = _sign(node.lineno, each), kinds[at], kinds[at + 1]
            if sign.startswith("is") and not any(_is_none(part) for part in parts[at : at + 2]):
                raise refused(node.lineno, f"`{sign}` compares with None alone; use `==` or `!=`")
            if isinstance(left, ValueType) and isinstance(right, ValueType):
                check_comparison(node.lineno, sign, left, right)
        return ValueType.TRUTH

    def arithmetic(self, line: int, sign: str, left: Guess, right: Guess) -> Guess:
        if isinstance(left, ValueType) and isinstance(right, ValueType):
            return kind_of_result(line, sign, left, right)
        return None

    def call(self, node: ast.Call, deep: int) -> Guess:
        line = node.lineno
        match node.func:
            case ast.Attribute(value=ast.Name(id=robot), attr=name) if robot == ROBOT:
                return self.skill(node, _skill_named(line, name), deep)
            case ast.Name(id=name) if name in SKILLS:
                return self.skill(node, SKILLS[name], deep)
            case ast.Name(id=name) if name in BUILTINS:
                return self.function(node, name, deep)
            case ast.Name(id=name):
                close = nearest(name, [*SKILLS, *BUILTINS])
                other = f"call a skill of `{ROBOT}`, or one of {', '.join(BUILTINS)}."
                raise ProgramError(
                    f"Line {line}: there is no function `{name}`; {f'did you mean `{close}`?' if close else other}"
                )
            case ast.Attribute() as asked:
                raise _attribute(line, asked)
            case _:
                raise refused(line, f"only skills and functions are called; write `{ROBOT}.SKILL(...)`")

    def function(self, node: ast.Call, name: str, deep: int) -> Guess:
        line, (fewest, most) = node.lineno, BUILTINS[name]
        if node.keywords:
            raise refused(line, f"`{name}` takes nothing by name; give it values alone")
        if len(node.args) < fewest or (most is not None and len(node.args) > most):
            takes = "1 or more" if most is None else str(fewest) if fewest == most else f"{fewest} to {most}"
            raise refused(line, f"`{name}` takes {takes} arguments, not {len(node.args)}")
        kinds = [self.value(each, deep) for each in node.args]
        known = tuple(kind for kind in kinds if isinstance(kind, ValueType))
        if len(known) == len(kinds):
            check_function(line, name, known)
        return ValueType.RANGE if name == "range" else ValueType.NUMBER

    def skill(self, node: ast.Call, skill: Skill, deep: int) -> Guess:
        _check_bound(node.lineno, skill, node)
        kinds = {name: self.value(each, deep) for name, each in given_to(skill, node).items()}
        for name, kind in kinds.items():
            if isinstance(kind, ValueType):
                check_argument(node.lineno, skill, skill.parameters[name], kind)
        chosen = [kind for name, kind in kinds.items() if name in skill.alternatives]
        surely = sum(isinstance(kind, ValueType) and kind is not ValueType.NOTHING for kind in chosen)
        if surely > 1 or all(kind is ValueType.NOTHING for kind in chosen):
            check_exactly_one(node.lineno, skill, surely)
        return skill.returns


def _check_bound(line: int, skill: Skill, node: ast.Call) -> None:
    """Refuse a call with too many or too few arguments, twice the same, or a name that the skill does not have."""
    names = [*list(skill.parameters)[: len(node.args)], *(each.arg for each in node.keywords)]
    missing = [each.name for each in skill.parameters.values() if each.default is None and each.name not in names]
    strange = next((name for name in names if name not in skill.parameters), "")
    if any(each.arg is None for each in node.keywords):
        raise refused(line, "`**` is not part of a program; write each argument")
    if len(node.args) > len(skill.parameters):
        wrong = f"takes {len(skill.parameters)} arguments, not {len(node.args)}"
    elif strange:
        close = nearest(strange, skill.parameters)
        wrong = f"takes no `{strange}`" + (f", did you mean `{close}`" if close else "")
    elif len(set(names)) < len(names):
        wrong = f"is given its `{next(name for name in names if names.count(name) > 1)}` twice"
    elif missing:
        wrong = f"needs its {_listed(missing)}"
    else:
        return
    raise refused(line, f"`{skill.name}` {wrong}; it is {skill.signature}")


def _constant(line: int, value: object) -> ValueType:
    if isinstance(value, str) and (found := UNSAFE.search(value.replace("\n", "").replace("\t", ""))):
        raise refused(
            line, f"a string has the character U+{ord(found.group()):04X}, which is not seen or turns the direction of "
            "writing; leave it out"
        )  # fmt: skip
    kind = kind_of(value)  # type: ignore[arg-type]
    if kind is ValueType.NUMBER:
        bounded(line, value)  # type: ignore[arg-type]
    return kind


def _is_none(node: ast.expr) -> bool:
    return isinstance(node, ast.Constant) and node.value is None


def _names_given(node: ast.AST) -> list[str]:
    match node:
        case ast.Assign(targets=targets):
            return [name for target in targets for name in target_names(target)]
        case ast.For(target=target) | ast.AugAssign(target=target):
            return target_names(target)
        case _:
            return []


def _check_assignable(line: int, name: str) -> str:
    if name == ROBOT or name in SKILLS or name in BUILTINS:
        what = "the robot" if name == ROBOT else "the name of a skill" if name in SKILLS else "the name of a function"
        raise refused(line, f"`{name}` is {what} and cannot be given a value; choose another name")
    return name


def _checked_target(node: ast.expr) -> list[str]:
    line = node.lineno
    if isinstance(node, ast.Subscript):
        raise refused(line, "a list is not changed but made again, as in `a = a + [b]`")
    parts = node.elts if isinstance(node, ast.Tuple) else [node, node]
    if len(parts) < 2 or not all(isinstance(each, ast.Name) for each in parts):
        raise refused(line, "only a name is given a value, or several as in `a, b = 1, 2`; put it left of the `=`")
    return [_check_assignable(line, name) for name in target_names(node)]


def _without_value(line: int, name: str, given: set[str], *, later: bool) -> ProgramError:
    if later:
        return refused(line, f"`{name}` is used before it has a value; give it one on a line above")
    if name in ("true", "false", "none", "null"):
        return refused(line, f"`{name}` has no value; write True, False or None")
    close = nearest(name, sorted(given))
    if close:
        return ProgramError(f"Line {line}: `{name}` has no value; did you mean `{close}`?")
    return refused(line, f"`{name}` has no value; give it one on a line above, or put a phrase in quotes")


def _sign(line: int, node: ast.AST) -> str:
    if type(node) not in SIGNS:
        raise _no_part(line, node)
    return SIGNS[type(node)]


def _no_part(line: int, node: ast.AST) -> ProgramError:
    name = type(node).__name__
    word = name.removeprefix("Async").removesuffix("From").lower()
    written = word if keyword.iskeyword(word) else name
    return refused(
        line, f"`{written}` is not part of a program; {_REMEDIES.get(name, 'call skills and work out values')}"
    )


def _too_deep(line: int) -> ProgramError:
    return refused(line, f"an expression nests more than {DEEPEST} deep; give its parts names on lines before")


def _skill_named(line: int, name: str) -> Skill:
    if name in SKILLS:
        return SKILLS[name]
    close = nearest(name, SKILLS)
    advice = f"did you mean `{close}`?" if close else f"the skills are {', '.join(SKILLS)}."
    raise ProgramError(f"Line {line}: the robot has no skill `{name}`; {advice}")


def _attribute(line: int, node: ast.Attribute) -> ProgramError:
    if node.attr in ("append", "extend", "insert"):
        return refused(line, f"`.{node.attr}` does not work on a value; write `name = name + [element]`")
    if isinstance(node.value, ast.Name) and node.value.id == ROBOT:
        name = _skill_named(line, node.attr).name
        return refused(line, f"`{ROBOT}.{name}` is called, not handed on; write `{ROBOT}.{name}(...)`")
    return refused(
        line,
        f"`.{node.attr}` does not work on a value; the only dot is that of `{ROBOT}.SKILL(...)`, and a Place is added, "
        "subtracted and scaled whole",
    )


def _listed(names: Sequence[str], last: str = "and") -> str:
    quoted = [f"`{name}`" for name in names]
    return quoted[0] if len(quoted) == 1 else f"{', '.join(quoted[:-1])} {last} {quoted[-1]}"
