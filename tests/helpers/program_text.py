"""A program written out again, in one way of writing."""

from collections.abc import Callable
from typing import Any

from avlmaps.language.program import syntax
from avlmaps.language.program.table import ROBOT

# How tightly each form binds; a part that binds less than its place needs is put in brackets.
_CHOICE, _OR, _AND, _NOT, _COMPARE, _SUM, _TERM, _SIGN, _WHOLE = range(9)


def program_text(program: syntax.Program) -> str:
    """Return the text of a program: it parses to an equal one, in Python as here."""
    return "\n".join(_lines(program.statements, "")) + "\n"


def expression_text(part: syntax.Expression) -> str:
    """Return the text of an expression, with no more brackets than it needs."""
    return _text(part, _CHOICE)


def _lines(block: tuple[syntax.Statement, ...], indent: str) -> list[str]:
    lines: list[str] = []
    for statement in block:
        match statement:
            case syntax.Assign():
                lines.append(f"{indent}{_target(statement.target)} = {expression_text(statement.value)}")
            case syntax.Update():
                lines.append(f"{indent}{statement.name} {statement.operator}= {expression_text(statement.value)}")
            case syntax.Perform():
                lines.append(indent + expression_text(statement.call))
            case syntax.Word():
                lines.append(indent + statement.word)
            case syntax.For():
                lines.append(f"{indent}for {_target(statement.target)} in {expression_text(statement.through)}:")
                lines += _lines(statement.body, indent + "    ")
            case syntax.If():
                for word, branch in zip(("if", *("elif",) * len(statement.branches)), statement.branches, strict=False):
                    lines.append(f"{indent}{word} {expression_text(branch.test)}:")
                    lines += _lines(branch.body, indent + "    ")
                if statement.otherwise:
                    lines += [f"{indent}else:", *_lines(statement.otherwise, indent + "    ")]
    return lines


def _target(target: syntax.AssignmentTarget) -> str:
    return ", ".join(target.names) + ("," if target.unpacks and len(target.names) == 1 else "")


def _text(part: syntax.Expression, needed: int) -> str:
    level, text = _WRITTEN[type(part)](part)
    return text if level >= needed else f"({text})"


def _unary(part: syntax.Unary) -> tuple[int, str]:
    if part.operator == "not":
        return _NOT, f"not {_text(part.operand, _NOT)}"
    return _SIGN, part.operator + _text(part.operand, _SIGN)


def _binary(part: syntax.Binary) -> tuple[int, str]:
    level = _SUM if part.operator in ("+", "-") else _TERM
    return level, f"{_text(part.left, level)} {part.operator} {_text(part.right, level + 1)}"


def _comparison(part: syntax.Comparison) -> tuple[int, str]:
    parts = [_text(part.first, _SUM)]
    for operator, operand in zip(part.operators, part.rest, strict=True):
        parts += [operator, _text(operand, _SUM)]
    return _COMPARE, " ".join(parts)


def _logical(part: syntax.Logical) -> tuple[int, str]:
    level = _OR if part.operator == "or" else _AND
    return level, f" {part.operator} ".join(_text(each, level + 1) for each in part.operands)


def _conditional(part: syntax.Conditional) -> tuple[int, str]:
    test, otherwise = _text(part.test, _OR), _text(part.otherwise, _CHOICE)
    return _CHOICE, f"{_text(part.chosen, _OR)} if {test} else {otherwise}"


def _element(part: syntax.Element) -> tuple[int, str]:
    return _WHOLE, f"{_text(part.of, _WHOLE)}[{expression_text(part.index)}]"


def _skill_call(part: syntax.SkillCall) -> tuple[int, str]:
    given = ((f"{each.parameter}=" if each.named else "") + expression_text(each.value) for each in part.arguments)
    return _WHOLE, f"{ROBOT}.{part.skill}({', '.join(given)})"


def _builtin_call(part: syntax.BuiltinCall) -> tuple[int, str]:
    return _WHOLE, f"{part.function}({', '.join(expression_text(each) for each in part.arguments)})"


def _collection(part: syntax.Collection) -> tuple[int, str]:
    inside = ", ".join(expression_text(each) for each in part.elements)
    if part.is_list:
        return _WHOLE, f"[{inside}]"
    return _WHOLE, f"({inside},)" if len(part.elements) == 1 else f"({inside})"


# Of each form, how tightly it binds and its text.
_WRITTEN: dict[type, Callable[[Any], tuple[int, str]]] = {
    syntax.Constant: lambda part: (_WHOLE, repr(part.value)),
    syntax.Name: lambda part: (_WHOLE, part.name),
    syntax.Collection: _collection,
    syntax.Unary: _unary,
    syntax.Binary: _binary,
    syntax.Comparison: _comparison,
    syntax.Logical: _logical,
    syntax.Conditional: _conditional,
    syntax.Element: _element,
    syntax.SkillCall: _skill_call,
    syntax.BuiltinCall: _builtin_call,
}
