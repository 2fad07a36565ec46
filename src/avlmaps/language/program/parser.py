"""From text to a program: Python's own parser reads it, and a whitelist of its nodes says what may stand in one.

Characters that hide what a line does, letters that only look like others and odd escapes are refused before. A program
with a part that is not on the whitelist is refused by its line, and so are unknown skills, arguments that do not fit
and names without a value. What is left means what Python means by it; what values do not go together a run finds.
"""

import ast
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from avlmaps.core.errors import ProgramError
from avlmaps.core.printable import UNSAFE, printable
from avlmaps.core.words import nearest
from avlmaps.language.program.values import bounded, kind_of, refused
from avlmaps.language.program.vocabulary import ROBOT, Skill, ValueType, skills
from avlmaps.language.word_classes import table

MOST_CHARACTERS = 20_000
DEEPEST_BLOCK = 10
DEEPEST = 50
"""How deep an expression may nest: far beyond what anyone writes, far within what recursion can take."""
# How few and how many arguments each function takes.
BUILTINS: Mapping[str, tuple[int, int]] = {
    "len": (1, 1), "min": (1, MOST_CHARACTERS), "max": (1, MOST_CHARACTERS), "abs": (1, 1), "range": (1, 3),
    "round": (1, 2),
}  # fmt: skip
SIGNS: Mapping[type, str] = {
    ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.FloorDiv: "//", ast.Mod: "%", ast.USub: "-",
    ast.UAdd: "+", ast.Not: "not", ast.And: "and", ast.Or: "or", ast.Eq: "==", ast.NotEq: "!=", ast.Lt: "<",
    ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.In: "in", ast.NotIn: "not in", ast.Is: "is", ast.IsNot: "is not",
}  # fmt: skip
_QUOTED = re.compile(
    r"""#[^\n]*|\b[rR](?:'(?:[^'\\\n]|\\.)*'|"(?:[^"\\\n]|\\.)*")|'(?:[^'\\\n]|\\.)*'|"(?:[^"\\\n]|\\.)*\""""
)
_ESCAPE = re.compile(r"\\(?:x[0-9a-fA-F]{2}|u[0-9a-fA-F]{4}|U[0-9a-fA-F]{8}|[\\'\"nt])|(?P<odd>\\)")
_KINDS = {ast.List: ValueType.LIST, ast.Tuple: ValueType.TUPLE, ast.Compare: ValueType.TRUTH}
_REMEDIES = {name: said for names, said in table("program/refusals")["instead"].items() for name in names.split()}


@dataclass(frozen=True, slots=True, eq=False)
class Program:
    """A program that was parsed and checked: nodes of Python's own kind, all of them on the whitelist."""

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
        return tuple(dict.fromkeys(name for name in map(called, named) if name in skills()))


def parse_program(text: str) -> Program:
    """Return the program that a text is, with every check that can be made before it runs, see docs/programs.md.

    Raises a ProgramError that names the line.
    """
    if len(text) > MOST_CHARACTERS:
        raise ProgramError(
            f"The program has {len(text)} characters, more than {MOST_CHARACTERS}; use a loop, or split it in two."
        )
    plain = text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n")
    _check_text(plain)
    try:
        statements = ast.parse(plain, filename="").body  # a file without a name, so that no error can quote one
    except SyntaxError as fault:
        said = printable(fault.msg or "invalid syntax", 200).rstrip(".?!")
        raise refused(fault.lineno or 1, f"this is not written as Python ({said}); mend the line") from None
    except (RecursionError, MemoryError):
        raise _too_deep(1) from None
    if not statements:
        raise ProgramError("The program is empty; write at least one line, such as `robot.move_to('chair')`.")
    _Checker(statements).block(statements)
    return Program(statements, text)


def _check_text(text: str) -> None:
    unsafe = next((found for found in UNSAFE.finditer(text) if found.group() not in "\n\t"), None)
    if unsafe:
        raise _at(text, unsafe, f"the character U+{ord(unsafe.group()):04X} has no place in a program; remove it")
    for quoted in _QUOTED.finditer(text):
        odd = next((found for found in _ESCAPE.finditer(quoted.group()) if found["odd"]), None)
        if odd and quoted.group()[0] not in "#rR":
            raise _at(text, quoted, "a string has a backslash that makes no character; write `\\\\` for a backslash")
    bare = _QUOTED.sub("''", text)
    if found := re.search(r"[^\x00-\x7f]", bare):
        why = "has no meaning here; names are written in the letters a to z, phrases between quotes"
        raise _at(bare, found, f"the character {found.group()!r} (U+{ord(found.group()):04X}) {why}")
    if found := re.search(r"\w{65,}", bare):
        raise _at(bare, found, f"`{found.group():.20}...` has more than 64 characters; shorten it")


def _at(text: str, found: re.Match[str], why: str) -> ProgramError:
    return refused(text.count("\n", 0, found.start()) + 1, why)


def called(call: ast.Call) -> str:
    """Return the name of the skill or function that a call on the whitelist calls."""
    return call.func.attr if isinstance(call.func, ast.Attribute) else call.func.id  # type: ignore[attr-defined]


def given_to(skill: Skill, call: ast.Call) -> Mapping[str, ast.expr]:
    """Return the arguments of a call by the names of their parameters."""
    named = {each.arg or "**": each.value for each in call.keywords}
    try:
        if len(named) < len(call.keywords):
            raise TypeError("one argument is given twice")
        return skill.takes.bind(*call.args, **named).arguments
    except TypeError as fault:
        raise refused(call.lineno, f"`{skill.name}`: {fault}; it is {skill.signature}") from None


def branches_of(node: ast.If) -> tuple[list[ast.If], list[ast.stmt]]:
    """Return an `if` with its `elif`s, which Python nests in each other, and the block of its `else`."""
    found = [node]
    while len(node.orelse) == 1 and isinstance(inner := node.orelse[0], ast.If) and inner.col_offset == node.col_offset:
        node = inner
        found.append(node)
    return found, node.orelse


def check_arguments(line: int, skill: Skill, kinds: Mapping[str, "Guess"]) -> None:
    """Refuse arguments of kinds that a skill does not take, and none or several of what are alternatives."""
    for name, kind in kinds.items():
        if isinstance(kind, ValueType) and kind not in skill.kinds[name]:
            wanted = _listed([str(each) for each in ValueType if each in skill.kinds[name]])
            makers = [f"`{other.name}`" for other in skills().values() if {other.returns} == skill.kinds[name]]
            known = f"it is {skill.signature}" + (f"; {_listed(makers)} gives one" if makers else "")
            raise refused(line, f"`{skill.name}` takes {wanted} as its `{name}`, not {kind}; {known}")
    chosen = [kind for name, kind in kinds.items() if name in skill.alternatives]
    surely = sum(isinstance(kind, ValueType) and kind is not ValueType.NOTHING for kind in chosen)
    if skill.alternatives and (surely > 1 or all(kind is ValueType.NOTHING for kind in chosen)):
        names = _listed([f"`{name}`" for name in skill.alternatives])
        raise refused(line, f"`{skill.name}` takes exactly one of {names}, not {surely or 'none'}")


def target_names(target: ast.expr) -> list[str]:
    """Return the names on the left side of an assignment."""
    targets = target.elts if isinstance(target, ast.Tuple) else [target]
    return [each.id for each in targets if isinstance(each, ast.Name)]


Guess = ValueType | None  # the kind of a value; None where only a run can tell


class _Checker:
    """Refuses a program that has a part that is none, or that must fail wherever it gets to what is wrong."""

    def __init__(self, statements: Sequence[ast.stmt]) -> None:
        self.names = _names_given(statements)
        self.given: set[str] = set()  # the names that a line before gave a value

    def block(self, nodes: Sequence[ast.stmt], deep: int = 0, *, in_loop: bool = False) -> None:
        if deep > DEEPEST_BLOCK:
            raise refused(nodes[0].lineno, f"blocks nest more than {DEEPEST_BLOCK} deep; write a flatter program")
        for node in nodes:
            self.statement(node, deep + 1, in_loop)

    def statement(self, node: ast.stmt, deep: int, in_loop: bool) -> None:
        match node:
            case ast.Assign(targets=[target]):
                self.value(node.value)
                self.give(target)
            case ast.AugAssign(target=ast.Name(id=name)) if type(node.op) in SIGNS:
                self.name(node.lineno, name)
                self.value(node.value)
                self.give(node.target)
            case ast.Expr(value=ast.Call() as call):
                self.value(call)
                if called(call) not in skills():
                    raise _no_part(node)
            case ast.For(orelse=[]):
                self.value(node.iter)
                self.give(node.target)
                # Any round but the first may use what a later line of the body gave.
                self.given |= _names_given(node.body)
                self.block(node.body, deep, in_loop=True)
            case ast.If():
                chosen, otherwise = branches_of(node)
                for each in chosen:
                    self.value(each.test)
                    self.block(each.body, deep, in_loop=in_loop)
                self.block(otherwise, deep, in_loop=in_loop)
            case ast.Pass() | ast.Break() | ast.Continue() if in_loop or isinstance(node, ast.Pass):
                pass
            case _:
                raise _no_part(node)

    def give(self, target: ast.expr) -> None:
        names, line = target_names(target), target.lineno
        if len(names) != (len(target.elts) if isinstance(target, ast.Tuple) else 1) or not names:
            raise refused(line, "only names take a value, as in `a = 1` and `a, b = 1, 2`; a list is made again")
        taken = next((name for name in names if name == ROBOT or name in skills() or name in BUILTINS), None)
        if taken:
            raise refused(line, f"`{taken}` is the robot, a skill or a function; give the value another name")
        self.given.update(names)

    def value(self, node: ast.expr, deep: int = 0) -> Guess:
        """Return the kind of an expression; refuse what is no part of a program."""
        if deep > DEEPEST:
            raise _too_deep(node.lineno)
        match node:
            case ast.Constant(value=None | bool() | str() | int() | float() as value):
                return _constant(node.lineno, value)
            case ast.Name(id=name):
                return self.name(node.lineno, name)
            case ast.Call():
                return self.call(node, deep + 1)
            case ast.Compare() if any(isinstance(op, ast.Is | ast.IsNot) for op in node.ops) and not any(
                isinstance(part, ast.Constant) and part.value is None for part in (node.left, *node.comparators)
            ):
                raise refused(node.lineno, "`is` compares with None alone; use `==` or `!=`")
            case (
                ast.List() | ast.Tuple() | ast.UnaryOp() | ast.BinOp() | ast.Compare() | ast.BoolOp() | ast.IfExp()
                | ast.Subscript()
            ):  # fmt: skip
                for part in ast.iter_child_nodes(node):
                    if isinstance(part, ast.expr):
                        self.value(part, deep + 1)
                    elif type(part) not in SIGNS and not isinstance(part, ast.expr_context):
                        raise _no_part(node, part)
                return _KINDS.get(type(node))
            case _:
                raise _no_part(node)

    def name(self, line: int, name: str) -> None:
        if name == ROBOT or name in skills() or name in BUILTINS:
            raise refused(line, f"`{name}` is no value; write `{ROBOT}.SKILL(...)` or call the function")
        if name in self.given:
            return
        if name in self.names:
            raise refused(line, f"`{name}` is used before it has a value; give it one on a line above")
        close = nearest(name, sorted(self.given))
        advice = f"did you mean `{close}`?" if close else "give it one on a line above, or put a phrase in quotes."
        raise ProgramError(f"Line {line}: `{name}` has no value; {advice}")

    def call(self, node: ast.Call, deep: int) -> Guess:
        match node.func:
            case ast.Attribute(value=ast.Name(id=robot), attr=name) if robot == ROBOT:
                known: Sequence[str] = tuple(skills())
            case ast.Name(id=name):
                known = (*skills(), *BUILTINS)
            case _:
                raise _no_part(node.func)
        if name not in known:
            close = nearest(name, known)
            advice = f"did you mean `{close}`?" if close else f"there are {', '.join(known)}."
            raise ProgramError(f"Line {node.lineno}: there is no skill or function `{name}`; {advice}")
        if name in BUILTINS:
            fewest, most = BUILTINS[name]
            if node.keywords or not fewest <= len(node.args) <= most:
                raise refused(node.lineno, f"`{name}` takes {fewest} to {most} values, and nothing by name")
            for each in node.args:
                self.value(each, deep)
            return ValueType.RANGE if name == "range" else ValueType.NUMBER
        kinds = {name: self.value(each, deep) for name, each in given_to(skills()[name], node).items()}
        check_arguments(node.lineno, skills()[name], kinds)
        return skills()[name].returns


def _constant(line: int, value: bool | str | float | None) -> ValueType:
    if isinstance(value, str) and (found := UNSAFE.search(value.replace("\n", "").replace("\t", ""))):
        why = "which is not seen or turns the direction of writing; leave it out"
        raise refused(line, f"a string has the character U+{ord(found.group()):04X}, {why}")
    if type(value) in (int, float):
        bounded(line, value)  # type: ignore[arg-type]
    return kind_of(value)


def _names_given(statements: Sequence[ast.stmt]) -> set[str]:
    parts = (part for statement in statements for part in ast.walk(statement) if isinstance(part, ast.Name))
    return {part.id for part in parts if isinstance(part.ctx, ast.Store)}


def _no_part(node: ast.stmt | ast.expr, part: ast.AST | None = None) -> ProgramError:
    name = type(part or node).__name__
    remedy = _REMEDIES.get(name, "call skills and work out values")
    return refused(node.lineno, f"`{name.lower()}` is not part of a program in this form; {remedy}")


def _too_deep(line: int) -> ProgramError:
    return refused(line, f"an expression nests more than {DEEPEST} deep; give its parts names on lines before")


def _listed(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} or {names[-1]}"
