"""A program written out again, in one way of writing."""

from collections.abc import Callable
from typing import Any

from avlmaps.language.program.syntax import (
    Assign,
    Binary,
    BuiltinCall,
    Collection,
    Comparison,
    Conditional,
    Constant,
    Element,
    Expression,
    For,
    If,
    Logical,
    Name,
    Perform,
    Program,
    SkillCall,
    Statement,
    Target,
    Unary,
    Update,
    Word,
)
from avlmaps.language.program.table import ROBOT

# How tightly each form binds; a part that binds less than its place needs is put in brackets.
_CHOICE, _OR, _AND, _NOT, _COMPARE, _SUM, _TERM, _SIGN, _WHOLE = range(9)


def program_text(program: Program) -> str:
    """Return the text of a program: it parses to an equal one, in Python as here."""
    return "\n".join(_lines(program.statements, "")) + "\n"


def expression_text(part: Expression) -> str:
    """Return the text of an expression, with no more brackets than it needs."""
    return _text(part, _CHOICE)


def _lines(block: tuple[Statement, ...], indent: str) -> list[str]:
    lines: list[str] = []
    for statement in block:
        match statement:
            case Assign():
                lines.append(f"{indent}{_target(statement.target)} = {expression_text(statement.value)}")
            case Update():
                lines.append(f"{indent}{statement.name} {statement.operator}= {expression_text(statement.value)}")
            case Perform():
                lines.append(indent + expression_text(statement.call))
            case Word():
                lines.append(indent + statement.word)
            case For():
                lines.append(f"{indent}for {_target(statement.target)} in {expression_text(statement.through)}:")
                lines += _lines(statement.body, indent + "    ")
            case If():
                for word, branch in zip(("if", *("elif",) * len(statement.branches)), statement.branches, strict=False):
                    lines.append(f"{indent}{word} {expression_text(branch.test)}:")
                    lines += _lines(branch.body, indent + "    ")
                if statement.otherwise:
                    lines += [f"{indent}else:", *_lines(statement.otherwise, indent + "    ")]
    return lines


def _target(target: Target) -> str:
    return ", ".join(target.names) + ("," if target.unpacks and len(target.names) == 1 else "")


def _text(part: Expression, needed: int) -> str:
    level, text = _WRITTEN[type(part)](part)
    return text if level >= needed else f"({text})"


def _unary(part: Unary) -> tuple[int, str]:
    if part.operator == "not":
        return _NOT, f"not {_text(part.operand, _NOT)}"
    return _SIGN, part.operator + _text(part.operand, _SIGN)


def _binary(part: Binary) -> tuple[int, str]:
    level = _SUM if part.operator in ("+", "-") else _TERM
    return level, f"{_text(part.left, level)} {part.operator} {_text(part.right, level + 1)}"


def _comparison(part: Comparison) -> tuple[int, str]:
    parts = [_text(part.first, _SUM)]
    for operator, operand in zip(part.operators, part.rest, strict=True):
        parts += [operator, _text(operand, _SUM)]
    return _COMPARE, " ".join(parts)


def _logical(part: Logical) -> tuple[int, str]:
    level = _OR if part.operator == "or" else _AND
    return level, f" {part.operator} ".join(_text(each, level + 1) for each in part.operands)


def _conditional(part: Conditional) -> tuple[int, str]:
    test, otherwise = _text(part.test, _OR), _text(part.otherwise, _CHOICE)
    return _CHOICE, f"{_text(part.chosen, _OR)} if {test} else {otherwise}"


def _element(part: Element) -> tuple[int, str]:
    return _WHOLE, f"{_text(part.of, _WHOLE)}[{expression_text(part.index)}]"


def _skill_call(part: SkillCall) -> tuple[int, str]:
    given = ((f"{each.parameter}=" if each.named else "") + expression_text(each.value) for each in part.arguments)
    return _WHOLE, f"{ROBOT}.{part.skill}({', '.join(given)})"


def _builtin_call(part: BuiltinCall) -> tuple[int, str]:
    return _WHOLE, f"{part.function}({', '.join(expression_text(each) for each in part.arguments)})"


def _collection(part: Collection) -> tuple[int, str]:
    inside = ", ".join(expression_text(each) for each in part.elements)
    if part.is_list:
        return _WHOLE, f"[{inside}]"
    return _WHOLE, f"({inside},)" if len(part.elements) == 1 else f"({inside})"


# Of each form, how tightly it binds and its text.
_WRITTEN: dict[type, Callable[[Any], tuple[int, str]]] = {
    Constant: lambda part: (_WHOLE, repr(part.value)),
    Name: lambda part: (_WHOLE, part.name),
    Collection: _collection,
    Unary: _unary,
    Binary: _binary,
    Comparison: _comparison,
    Logical: _logical,
    Conditional: _conditional,
    Element: _element,
    SkillCall: _skill_call,
    BuiltinCall: _builtin_call,
}
