"""What Python itself makes of a program: its syntax tree in our parts, and what it calls and leaves behind when run."""

import ast
import warnings
from typing import Any

from avlmaps.core.errors import AvlmapsError
from avlmaps.language.program import ROBOT, SKILLS
from avlmaps.language.program import syntax as own
from helpers.recording_robot import PlainPlace, RecordingRobot

_SIGNS: dict[type, str] = {
    ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.FloorDiv: "//", ast.Mod: "%", ast.USub: "-",
    ast.UAdd: "+", ast.Not: "not", ast.And: "and", ast.Or: "or", ast.Eq: "==", ast.NotEq: "!=", ast.Lt: "<",
    ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.In: "in", ast.NotIn: "not in", ast.Is: "is", ast.IsNot: "is not",
    ast.Pass: "pass", ast.Break: "break", ast.Continue: "continue",
}  # fmt: skip


def python_tree(text: str) -> tuple[own.Statement, ...]:
    """Return the program as Python's own parser reads it, in our parts."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SyntaxWarning)
        return _block(ast.parse(text).body)


def python_run(text: str) -> tuple[list[Any], dict[str, Any], str | None]:
    """Return the calls, the names and the project's error of a program that Python itself runs."""
    robot = RecordingRobot(PlainPlace)
    names: dict[str, Any] = {ROBOT: robot} | {name: getattr(robot, name) for name in SKILLS}
    known = set(names)
    error = None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SyntaxWarning)
            exec(compile(text, "program", "exec"), names)
    except AvlmapsError as fault:
        error = str(fault)
    return robot.calls, {name: value for name, value in names.items() if name not in known | {"__builtins__"}}, error


def _block(body: list[ast.stmt]) -> tuple[own.Statement, ...]:
    return tuple(_statement(each) for each in body)


def _statement(node: ast.stmt) -> own.Statement:
    match node:
        case ast.Assign(targets=[target]):
            return own.Assign(_target(target), _part(node.value), 0)
        case ast.AugAssign(target=ast.Name()):
            return own.Update(node.target.id, _SIGNS[type(node.op)], _part(node.value), 0)  # type: ignore[union-attr]
        case ast.Expr():
            call = _part(node.value)
            assert isinstance(call, own.SkillCall)
            return own.Perform(call, 0)
        case ast.For(orelse=[]):
            return own.For(_target(node.target), _part(node.iter), _block(node.body), 0)
        case ast.If():
            return _if(node)
    return own.Word(_SIGNS[type(node)], 0)


def _if(node: ast.If) -> own.If:
    """Return an `if`; Python nests its `elif`s, which start at the column of the first word."""
    branches = [own.Branch(_part(node.test), _block(node.body), 0)]
    while len(node.orelse) == 1 and isinstance(node.orelse[0], ast.If) and node.orelse[0].col_offset == node.col_offset:
        node = node.orelse[0]
        branches.append(own.Branch(_part(node.test), _block(node.body), 0))
    return own.If(tuple(branches), _block(node.orelse), 0)


def _target(node: ast.expr) -> own.AssignmentTarget:
    if isinstance(node, ast.Name):
        return own.AssignmentTarget((node.id,), unpacks=False)
    assert isinstance(node, ast.Tuple)
    return own.AssignmentTarget(tuple(each.id for each in node.elts if isinstance(each, ast.Name)), unpacks=True)


def _part(node: ast.expr) -> own.Expression:  # noqa: C901 -- one case for each form
    match node:
        case ast.Constant(value=None | bool() | int() | float() | str()):
            return own.Constant(node.value, 0)  # type: ignore[arg-type]
        case ast.Name():
            return own.Name(node.id, 0)
        case ast.List() | ast.Tuple():
            return own.Collection(tuple(map(_part, node.elts)), isinstance(node, ast.List), 0)
        case ast.UnaryOp():
            return own.Unary(_SIGNS[type(node.op)], _part(node.operand), 0)
        case ast.BinOp():
            return own.Binary(_SIGNS[type(node.op)], _part(node.left), _part(node.right), 0)
        case ast.Compare():
            signs = tuple(_SIGNS[type(each)] for each in node.ops)
            return own.Comparison(_part(node.left), signs, tuple(map(_part, node.comparators)), 0)
        case ast.BoolOp():
            return own.Logical(_SIGNS[type(node.op)], tuple(map(_part, node.values)), 0)
        case ast.IfExp():
            return own.Conditional(_part(node.test), _part(node.body), _part(node.orelse), 0)
        case ast.Subscript():
            return own.Element(_part(node.value), _part(node.slice), 0)
        case ast.Call():
            return _call(node)
    raise AssertionError(f"no part of a program: {ast.dump(node)}")


def _call(node: ast.Call) -> own.SkillCall | own.BuiltinCall:
    match node.func:
        case ast.Name(id=name) if name not in SKILLS:
            assert not node.keywords
            return own.BuiltinCall(name, tuple(map(_part, node.args)), 0)
        case ast.Name(id=name) | ast.Attribute(value=ast.Name(id="robot"), attr=name):
            names = [parameter.name for parameter in SKILLS[name].parameters]
            given = [own.Argument(at, _part(each), named=False) for at, each in zip(names, node.args, strict=False)]
            given += [own.Argument(str(each.arg), _part(each.value), named=True) for each in node.keywords]
            return own.SkillCall(name, tuple(given), 0)
    raise AssertionError(f"no call of a program: {ast.dump(node)}")
