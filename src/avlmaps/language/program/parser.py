"""From text to a program: Python's own parser reads it, and a whitelist of its nodes says what may stand in one.

What Python's parser must not see is refused before it: characters that hide what a line does, names that only look like
others, numbers and strings in unusual forms, brackets that nest without end. A program without a part on the whitelist
is refused by its line. What is left means what Python means by it.
"""

import ast
import keyword
import re

from avlmaps.core.errors import ProgramError
from avlmaps.core.printable import UNSAFE, printable
from avlmaps.language.program import syntax
from avlmaps.language.program.budget import bounded, refused
from avlmaps.language.program.calls import (
    BUILTINS,
    RESERVED,
    bind_builtin,
    bind_skill,
    check_assignable,
    skill_named,
    unknown_function,
)
from avlmaps.language.program.check import check
from avlmaps.language.program.table import ROBOT, SKILLS

MOST_CHARACTERS = 20_000
LONGEST_NAME = 64
DEEPEST_BLOCK = 10
DEEPEST = 50
"""How deep an expression may nest: far beyond what anyone writes, far within what recursion can take."""

_LONGEST_NUMBER = 40
_DIGITS = r"[0-9](?:_?[0-9])*"
_NUMBER = re.compile(
    rf"0(?:_?0)*|[1-9](?:_?[0-9])*|(?:{_DIGITS}\.(?:{_DIGITS})?|\.{_DIGITS})(?:[eE][+-]?{_DIGITS})?|{_DIGITS}[eE][+-]?{_DIGITS}"
)
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
_ESCAPE = re.compile(r"\\(?:x[0-9a-fA-F]{2}|u[0-9a-fA-F]{4}|U[0-9a-fA-F]{8}|.)")
_SIGNS: dict[type, str] = {
    ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.FloorDiv: "//", ast.Mod: "%", ast.USub: "-",
    ast.UAdd: "+", ast.Not: "not", ast.And: "and", ast.Or: "or", ast.Eq: "==", ast.NotEq: "!=", ast.Lt: "<",
    ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.In: "in", ast.NotIn: "not in", ast.Is: "is", ast.IsNot: "is not",
    ast.Pass: "pass", ast.Break: "break", ast.Continue: "continue",
}  # fmt: skip
# What is no part of a program, and what is to be written instead.
_INSTEAD: dict[str, str] = {
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


def parse_program(text: str) -> syntax.Program:
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
    statements = _Reader().block(_tree(plain).body)
    if not statements:
        raise ProgramError("The program is empty; write at least one line, such as `robot.move_to('chair')`.")
    check(statements)
    return syntax.Program(statements, text)


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
            case "number":
                _check_number(line, said)
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


def _check_number(line: int, text: str) -> None:
    if len(text) > _LONGEST_NUMBER:
        raise refused(line, f"the number `{text[:12]}...` has more than {_LONGEST_NUMBER} characters; round it")
    if not _NUMBER.fullmatch(text):
        raise refused(line, f"`{text}` is no number; write it in plain digits, such as 12 or 0.5")


def _check_string(line: int, text: str) -> None:
    prefix = text[: min(text.index(quote) for quote in "'\"" if quote in text)]
    if prefix in ("r", "R"):
        return
    if prefix:
        told = printable(prefix, 40)
        raise refused(line, f"a string has no `{told}` before its quote; write it plainly, or join with +")
    for found in _ESCAPE.finditer(text):
        escape = found.group()
        code = int(escape[2:], 16) if len(escape) > 2 else 0
        if escape[1] in "\\'\"nt":
            continue
        if not (0x20 <= code <= 0x10FFFF and not 0xD800 <= code <= 0xDFFF):
            raise refused(
                line, f"the string has a backslash before {escape[1:]!r}, which makes no character; write `\\\\` for a "
                "backslash",
            )  # fmt: skip
        if UNSAFE.match(chr(code)):
            raise refused(
                line, f"the string has `{escape}`, which is not seen or turns the direction of writing; leave it out"
            )


class _Reader:
    """Makes the parts of a program out of Python's nodes."""

    def __init__(self) -> None:
        self.loops = self.blocks = 0

    def block(self, nodes: list[ast.stmt]) -> tuple[syntax.Statement, ...]:
        if self.blocks > DEEPEST_BLOCK:
            raise refused(nodes[0].lineno, f"blocks nest more than {DEEPEST_BLOCK} deep; write a flatter program")
        self.blocks += 1
        found = tuple(map(self.statement, nodes))
        self.blocks -= 1
        return found

    def statement(self, node: ast.stmt) -> syntax.Statement:  # noqa: C901 - one case for each form
        line = node.lineno
        match node:
            case ast.Assign(targets=[target]):
                return syntax.Assign(_target(target), self.value(node.value), line)
            case ast.Assign():
                raise refused(line, "a line has one `=`; give each name its value on a line of its own")
            case ast.AugAssign(target=ast.Name(id=name)):
                return syntax.Update(check_assignable(line, name), _sign(line, node.op), self.value(node.value), line)
            case ast.AugAssign():
                raise refused(line, "an update such as `+=` is of one name; write it out with `=`")
            case ast.Expr():
                call = self.value(node.value)
                if isinstance(call, syntax.SkillCall):
                    return syntax.Perform(call, line)
                raise refused(line, "the line works out a value and does nothing with it; name it or call a skill")
            case ast.For(orelse=[]):
                return self.loop(node)
            case ast.For():
                raise refused(line, "`else` belongs to no `if`; put it right under its block")
            case ast.If():
                return self.choice(node)
            case ast.Pass() | ast.Break() | ast.Continue():
                word = _SIGNS[type(node)]
                if word != "pass" and not self.loops:
                    raise refused(line, f"`{word}` is in no loop; put it into the block of a `for`")
                return syntax.Word(word, line)
            case _:
                raise _no_part(line, node)

    def loop(self, node: ast.For) -> syntax.For:
        target, through = _target(node.target), self.value(node.iter)
        self.loops += 1
        body = self.block(node.body)
        self.loops -= 1
        return syntax.For(target, through, body, node.lineno)

    def choice(self, node: ast.If) -> syntax.If:
        line, branches = node.lineno, [syntax.Branch(self.value(node.test), self.block(node.body), node.lineno)]
        # Python nests each `elif` in the one before; an `if` in a block of `else` begins further right.
        while (
            len(node.orelse) == 1
            and isinstance(inner := node.orelse[0], ast.If)
            and inner.col_offset == node.col_offset
        ):
            node = inner
            branches.append(syntax.Branch(self.value(node.test), self.block(node.body), node.lineno))
        return syntax.If(tuple(branches), self.block(node.orelse) if node.orelse else (), line)

    def value(self, node: ast.expr, deep: int = 0) -> syntax.Expression:  # noqa: C901 - one case for each form
        """Return an expression.

        Raises:
            ProgramError: it has a part that is no part of a program, or nests too deep.
        """
        line, deep = node.lineno, deep + 1
        if deep > DEEPEST:
            raise _too_deep(line)
        match node:
            case ast.Constant(value=None | bool() | str()):
                return syntax.Constant(node.value, line)  # type: ignore[arg-type]
            case ast.Constant(value=int() | float() as number):
                return syntax.Constant(bounded(line, number), line)
            case ast.Name(id=name) if name == ROBOT:
                raise refused(line, f"`{ROBOT}` is no value; write `{ROBOT}.SKILL(...)`")
            case ast.Name(id=name) if name in RESERVED:
                raise refused(line, f"`{name}` is called, not handed on; write `{name}(...)`")
            case ast.Name(id=name):
                return syntax.Name(name, line)
            case ast.List() | ast.Tuple():
                elements = tuple(self.value(each, deep) for each in node.elts)
                return syntax.Collection(elements, isinstance(node, ast.List), line)
            case ast.UnaryOp():
                return syntax.Unary(_sign(line, node.op), self.value(node.operand, deep), line)
            case ast.BinOp():
                left, right = self.value(node.left, deep), self.value(node.right, deep)
                return syntax.Binary(_sign(line, node.op), left, right, line)
            case ast.Compare():
                first, rest = self.value(node.left, deep), tuple(self.value(each, deep) for each in node.comparators)
                signs = tuple(_sign(line, each) for each in node.ops)
                nothing = syntax.Constant(None, line)
                for sign, left, right in zip(signs, (first, *rest), rest, strict=False):
                    if sign.startswith("is") and nothing not in (left, right):
                        raise refused(line, f"`{sign}` compares with None alone; use `==` or `!=`")
                return syntax.Comparison(first, signs, rest, line)
            case ast.BoolOp():
                return syntax.Logical(_sign(line, node.op), tuple(self.value(each, deep) for each in node.values), line)
            case ast.IfExp():
                test, chosen = self.value(node.test, deep), self.value(node.body, deep)
                return syntax.Conditional(test, chosen, self.value(node.orelse, deep), line)
            case ast.Subscript():
                return syntax.Element(self.value(node.value, deep), self.value(node.slice, deep), line)
            case ast.Call():
                return self.call(node, deep)
            case ast.Attribute():
                raise _attribute(line, node)
            case _:
                raise _no_part(line, node)

    def call(self, node: ast.Call, deep: int) -> syntax.SkillCall | syntax.BuiltinCall:
        line = node.lineno
        match node.func:
            case ast.Attribute(value=ast.Name(id=robot), attr=name) if robot == ROBOT:
                skill_named(line, name)
            case ast.Name(id=name) if name in SKILLS or name in BUILTINS:
                pass
            case ast.Name(id=name):
                raise unknown_function(line, name)
            case ast.Attribute() as asked:
                raise _attribute(line, asked)
            case _:
                raise refused(line, f"only skills and functions are called; write `{ROBOT}.SKILL(...)`")
        positional = [self.value(each, deep) for each in node.args]
        named: list[tuple[str, syntax.Expression]] = []
        for each in node.keywords:
            if each.arg is None:
                raise refused(line, "`**` is not part of a program; write each argument")
            named.append((each.arg, self.value(each.value, deep)))
        if name in SKILLS:
            return bind_skill(line, SKILLS[name], positional, named)
        return bind_builtin(line, name, positional, named)


def _target(node: ast.expr) -> syntax.AssignmentTarget:
    """Return the left side of an assignment: one name, or several."""
    match node:
        case ast.Name(id=name):
            return syntax.AssignmentTarget((check_assignable(node.lineno, name),), unpacks=False)
        case ast.Tuple(elts=[_, *_]) if all(isinstance(each, ast.Name) for each in node.elts):
            names = tuple(check_assignable(node.lineno, each.id) for each in node.elts if isinstance(each, ast.Name))
            return syntax.AssignmentTarget(names, unpacks=True)
        case ast.Subscript():
            raise refused(node.lineno, "a list is not changed but made again, as in `a = a + [b]`")
        case _:
            raise refused(
                node.lineno, "only a name is given a value, or several as in `a, b = 1, 2`; put it left of the `=`"
            )


def _sign(line: int, node: ast.AST) -> str:
    if type(node) not in _SIGNS:
        raise _no_part(line, node)
    return _SIGNS[type(node)]


def _no_part(line: int, node: ast.AST) -> ProgramError:
    name = type(node).__name__
    word = name.removeprefix("Async").removesuffix("From").lower()
    written = word if keyword.iskeyword(word) else name
    return refused(
        line, f"`{written}` is not part of a program; {_REMEDIES.get(name, 'call skills and work out values')}"
    )


def _too_deep(line: int) -> ProgramError:
    return refused(line, f"an expression nests more than {DEEPEST} deep; give its parts names on lines before")


def _attribute(line: int, node: ast.Attribute) -> ProgramError:
    if node.attr in ("append", "extend", "insert"):
        return refused(line, f"`.{node.attr}` does not work on a value; write `name = name + [element]`")
    if isinstance(node.value, ast.Name) and node.value.id == ROBOT:
        skill_named(line, node.attr)
        return refused(line, f"`{ROBOT}.{node.attr}` is called, not handed on; write `{ROBOT}.{node.attr}(...)`")
    return refused(
        line,
        f"`.{node.attr}` does not work on a value; the only dot is that of `{ROBOT}.SKILL(...)`, and a Place is added, "
        "subtracted and scaled whole",
    )
