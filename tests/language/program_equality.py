"""Whether two programs tell the robot the same, however they are written.

Both are run symbolically: what counts is the order of what the robot does and with which values, not the names of
variables, what is kept in one or written out, `robot.` or not, positional or named arguments, a loop of known length
or its steps one by one, the order of a product of heatmaps, the order of the two things of `move_in_between`, or
whether a skill that takes a heatmap gets it or its best place.
"""

import ast
from dataclasses import dataclass, field
from inspect import signature
from typing import Any

from avlmaps.navigate.skills import Robot

_PURE = {
    "load_image", "load_sound", "get_major_map", "get_map", "get_pos", "get_max_pos_3d", "get_contour",
    "get_nearest_pos", "get_all_pos", "get_nth_pos", "exists", "get_distance",
}  # fmt: skip
_WHERE_IT_STANDS = "current_pos"
_MOST_TURNS_OF_A_LOOP = 50


def same_program(a: str, b: str) -> bool:
    """Return whether two programs do the same; a text that is no program of the vocabulary raises ValueError."""
    return canonical(a) == canonical(b)


def canonical(program: str) -> tuple[Any, ...]:
    """Return what a program does, in order, in a form that can be compared and read."""
    return _Run().of(program)


@dataclass
class _Run:
    """One symbolic run: what has been done, and what the variables hold.

    Values are numbers, strings, lists, and tuples: ("sum", ((thing, factor), ...)), ("product", (heat, ...)),
    (skill, arguments), ("item", list, index), ("name", n) for the variable of an open loop.
    """

    done: list[Any] = field(default_factory=list)
    names: dict[str, Any] = field(default_factory=dict)
    opened: int = 0

    def of(self, program: str) -> tuple[Any, ...]:
        try:
            tree = ast.parse(program)
        except SyntaxError as fault:
            raise ValueError(f"no program: {fault}") from fault
        self.block(tree.body)
        return tuple(self.done)

    def block(self, body: list[ast.stmt]) -> None:
        for line in body:
            self.line(line)

    def line(self, line: ast.stmt) -> None:
        match line:
            case ast.Assign(targets=[ast.Name(id=name)], value=value):
                self.names[name] = self.value(value)
            case ast.Assign(targets=[ast.Tuple(elts=names)], value=ast.Tuple(elts=values)):
                found = [self.value(value) for value in values]
                for name, value in zip(names, found, strict=True):
                    assert isinstance(name, ast.Name)
                    self.names[name.id] = value
            case ast.Expr(value=ast.Call() as call):
                self.value(call)
            case ast.Pass() | ast.Expr(value=ast.Constant()):
                pass
            case ast.For(target=ast.Name(id=name), iter=among, body=body, orelse=[]):
                self.loop(name, self.value(among), body)
            case _:
                raise ValueError(f"not compared: {ast.unparse(line)!r}")

    def loop(self, name: str, among: Any, body: list[ast.stmt]) -> None:
        if isinstance(among, list) and len(among) <= _MOST_TURNS_OF_A_LOOP:
            for value in among:
                self.names[name] = value
                self.block(body)
            return
        outside, self.done, self.opened = self.done, [], self.opened + 1
        self.names[name] = ("name", self.opened)
        self.block(body)
        among = tuple(among) if isinstance(among, list) else among
        self.done = [*outside, ("for each", among, tuple(self.done))]

    def value(self, node: ast.expr) -> Any:
        match node:
            case ast.Constant(value=value):
                return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else value
            case ast.Name(id=name):
                if name not in self.names:
                    raise ValueError(f"{name!r} has no value")
                return self.names[name]
            case ast.List(elts=items) | ast.Tuple(elts=items):
                return [self.value(item) for item in items]
            case ast.UnaryOp(op=ast.USub(), operand=inner):
                return _scaled(self.value(inner), -1.0)
            case ast.BinOp(left=left, op=operator, right=right):
                return _arithmetic(operator, self.value(left), self.value(right))
            case ast.Subscript(value=inner, slice=index):
                return ("item", self.value(inner), self.value(index))
            case ast.Call(func=ast.Attribute(value=ast.Name(id="robot"), attr=name)) | ast.Call(func=ast.Name(id=name)):
                assert isinstance(node, ast.Call)
                return self.call(name, node)
            case _:
                raise ValueError(f"not compared: {ast.unparse(node)!r}")

    def call(self, name: str, node: ast.Call) -> Any:
        given = [self.value(value) for value in node.args]
        named = {word.arg: self.value(word.value) for word in node.keywords}
        if name == "range":
            return [float(i) for i in range(*(int(value) for value in given))]
        if name == "len":
            return float(len(given[0])) if isinstance(given[0], list) else ("len", given[0])
        arguments = _arguments(name, given, named)
        if name == "get_max_pos_3d":
            return arguments[0][1]
        if name == "get_pos" and not isinstance(arguments[0][1], str):
            return arguments[0][1]
        if name == _WHERE_IT_STANDS:
            return (_WHERE_IT_STANDS, self.opened, len(self.done))
        if name not in _PURE:
            self.done.append((name, *arguments))
            return None
        return (name, *arguments)


def _arguments(name: str, given: list[Any], named: dict[Any, Any]) -> tuple[Any, ...]:
    """Return the arguments of a call by name in the signature's order, those that equal their default left out."""
    skill = getattr(Robot, name, None)
    if skill is None or name.startswith("_"):
        raise ValueError(f"{name!r} is no skill")
    shape = signature(skill)
    try:
        bound = shape.bind(None, *given, **named)
    except TypeError as fault:
        raise ValueError(f"{name}: {fault}") from fault
    pairs = [
        (word, value)
        for word, value in bound.arguments.items()
        if word != "self" and value != shape.parameters[word].default
    ]
    if name == "turn_absolute":
        return (("compass_deg", pairs[0][1] % 360),)
    if name == "move_in_between":
        return tuple(sorted((value for _, value in pairs), key=repr))
    return tuple(pairs)


def _arithmetic(operator: ast.operator, left: Any, right: Any) -> Any:
    if isinstance(left, float) and isinstance(right, float):
        return _of_numbers(operator, left, right)
    match operator:
        case ast.Mult() if isinstance(left, float):
            return _scaled(right, left)
        case ast.Mult() if isinstance(right, float):
            return _scaled(left, right)
        case ast.Mult():
            return ("product", tuple(sorted([*_factors(left), *_factors(right)], key=repr)))
        case ast.Div() if isinstance(right, float):
            return _scaled(left, 1 / right)
        case ast.Add():
            return _sum(left, right)
        case ast.Sub():
            return _sum(left, _scaled(right, -1.0))
        case _:
            return (type(operator).__name__, left, right)


def _of_numbers(operator: ast.operator, left: float, right: float) -> float:
    match operator:
        case ast.Add():
            return left + right
        case ast.Sub():
            return left - right
        case ast.Mult():
            return left * right
        case ast.Div():
            return left / right
        case ast.FloorDiv():
            return left // right
        case ast.Mod():
            return left % right
        case _:
            raise ValueError(f"not compared: {type(operator).__name__}")


def _factors(heat: Any) -> tuple[Any, ...]:
    return heat[1] if isinstance(heat, tuple) and heat[0] == "product" else (heat,)


def _terms(place: Any) -> dict[Any, float]:
    return dict(place[1]) if isinstance(place, tuple) and place[0] == "sum" else {place: 1.0}


def _scaled(place: Any, factor: float) -> Any:
    if isinstance(place, float):
        return place * factor
    return _summed({thing: held * factor for thing, held in _terms(place).items()})


def _sum(left: Any, right: Any) -> Any:
    terms = _terms(left)
    for thing, factor in _terms(right).items():
        terms[thing] = terms.get(thing, 0.0) + factor
    return _summed(terms)


def _summed(terms: dict[Any, float]) -> Any:
    kept = {thing: round(factor, 9) for thing, factor in terms.items() if round(factor, 9)}
    if len(kept) == 1 and next(iter(kept.values())) == 1.0:
        return next(iter(kept))
    return ("sum", tuple(sorted(kept.items(), key=repr)))
