"""From the tree of one order to its intents."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from avlmaps.core.inflection import singulars_of
from avlmaps.language.chart import Tree
from avlmaps.language.intents import (
    Beside,
    Between,
    Circle,
    Clarify,
    Face,
    Go,
    Intent,
    Kind,
    Move,
    Reason,
    Refuse,
    Repeat,
    Return,
    Side,
    StopAt,
    Target,
    Turn,
    VisitEach,
    Wait,
)  # fmt: skip
from avlmaps.language.targets import Memory, UnresolvedError, resolve

MOST_TIMES, _MOST_METRES = 100, 100.0
_EXAMPLE = "go to the chair near the sound of glass breaking, then turn left"
REFUSALS = {
    Reason.MANIPULATION: "The robot has no hands and no voice; it can only drive, turn and look.",
    Reason.ENDLESS: "The robot does not drive without an end; say how often.",
    Reason.HARM: "The robot does not do what could hurt someone or break something.",
    Reason.FLYING: "The robot stays on its floor; it cannot fly, jump or climb stairs.",
    Reason.CONDITION: "The robot cannot wait for a condition; say what to do now.",
    Reason.NEGATION: "Say only what to do, not what to avoid.",
    Reason.CHAT: "The robot does not talk; say where it should go.",
    Reason.QUESTION: 'This is a question; ask the map: avlmaps query MAP "QUESTION".',
    Reason.UNKNOWN: f"This is not understood; say it like: {_EXAMPLE}.",
}
Result = tuple[Sequence[Intent], list[str]]


def refuse(reason: str) -> Refuse:
    """Return a refusal with its sentence."""
    return Refuse(Reason(reason), REFUSALS[Reason(reason)])


def intents_of(tree: Any, memory: Memory) -> Result:
    """Return the intents of one order, and notes on how it was taken; what it names is remembered.

    Raises:
        UnresolvedError: a reference or an amount is missing.
    """
    assert isinstance(tree, Tree)
    intents, notes = _READ[tree.rule](tree, memory)
    return intents, notes


def _target(value: Any, memory: Memory) -> Target:
    target = resolve(value, memory)
    memory.add(target)
    return target


def _go(tree: Tree, memory: Memory) -> Result:
    if tree.get("to") is None:
        return [Go(memory.last("there"))], []
    return [Go(_target(tree.get("to"), memory))], []


def _face(tree: Tree, memory: Memory) -> Result:
    target = memory.last("there") if tree.get("to") is None else _target(tree.get("to"), memory)
    side = Side(tree.get("side", "ahead"))
    first: list[Intent] = [Turn(180.0)] if tree.get("around") else []
    return [*first, Face(target, side)], []


def _turn(tree: Tree, memory: Memory) -> Result:
    if tree.get("where") is not None:
        first = Go(_target(tree.get("where"), memory))
        turned, notes = _turned(tree)
        return [first, *turned], notes
    return _turned(tree)


def _turned(tree: Tree) -> Result:
    notes: list[str] = []
    if tree.get("which") == "none":
        raise UnresolvedError(
            Clarify("Turn which way? Say left, right, around, or an angle.", ("left", "right", "around"))
        )
    if tree.get("heading") is not None or tree.get("heading_at") is not None:
        heading = tree.get("heading") if tree.get("heading") is not None else tree.get("heading_at")
        return [Turn(heading=float(heading) % 360.0)], notes
    degrees = tree.get("degrees", tree.get("number"))
    degrees = 90.0 if degrees is None else float(degrees)
    side = tree.get("side")
    if tree.get("open") and side is None and degrees not in (180.0, 360.0):
        notes.append(f"No side was said for {degrees:g} degrees: the turn is to the right.")
    if abs(degrees) > 3600.0:
        raise UnresolvedError(Clarify(f"{degrees:g} degrees are too many to turn; say at most 3600."))
    if side == "left" and degrees not in (180.0, 360.0):
        degrees = -degrees
    return [Turn(round(degrees, 3))], notes


def _move(tree: Tree, memory: Memory) -> Result:
    if tree.get("which") == "none":
        raise UnresolvedError(Clarify("How far? Say it like: go forward 2 metres."))
    metres = float(tree.get("metres"))
    if not 0.0 < metres <= _MOST_METRES:
        raise UnresolvedError(
            Clarify(f"{metres:g} m is not a distance that the robot drives; say at most {_MOST_METRES:g} m.")
        )
    if tree.get("to") is not None:
        away = tree.get("dir") == "away"
        return [Face(_target(tree.get("to"), memory)), Move(-metres if away else metres)], []
    if tree.get("heading") is not None:
        return [Turn(heading=float(tree.get("heading"))), Move(metres)], []
    if tree.get("side") is not None:
        return [Turn(-90.0 if tree.get("side") == "left" else 90.0), Move(metres)], []
    if tree.get("degrees") is not None:
        return ([Turn(float(tree.get("degrees")))] if tree.get("degrees") else []) + [Move(metres)], []
    return [Move(-metres if tree.get("dir") == "back" else metres)], []


def _pair(tree: Tree, memory: Memory) -> tuple[Target, Target]:
    if tree.get("two") is not None and tree.get("a") is None:
        if tree.get("several") is not None:
            raise UnresolvedError(Clarify("Between which two things? Name both."))
        return memory.two()
    if tree.get("ahere"):
        return Target(Kind.HERE), _target(tree.get("b"), memory)
    if tree.get("ita"):
        a = memory.last("it")
        return a, _target(tree.get("b"), memory)
    a = _target(tree.get("a"), memory)
    return a, _target(tree.get("b"), memory)


def _between(tree: Tree, memory: Memory) -> Result:
    of = tree.get("of") if tree.get("of") is not None else tree
    a, b = _pair(of, memory)
    if a == b:
        raise UnresolvedError(Clarify("Between which two things? Name two different ones."))
    return [Between((a, b))], []


def _side_of(tree: Tree) -> Tree:
    return next((inner for name, inner in tree.slots if name == "_" and isinstance(inner, Tree)), tree)


def _beside(tree: Tree, memory: Memory) -> Result:
    inner = tree.get("at_side") if tree.get("at_side") is not None else tree
    of, side = inner.get("of"), inner.get("side")
    target = memory.last("it") if of is None else _target(of, memory)
    if tree.get("of") is not None and of is None:
        target = _target(tree.get("of"), memory)
    metres = tree.get("metres")
    return [Beside(target, Side(side), None if metres is None else float(metres))], []


def _standoff(tree: Tree, memory: Memory) -> Result:
    target = memory.last("it") if tree.get("there") else _target(tree.get("of"), memory)
    return [StopAt(target, float(tree.get("metres")))], []


def _circle(tree: Tree, memory: Memory) -> Result:
    views = tree.get("views")
    if views is not None and not 1 <= float(views) <= 36:
        raise UnresolvedError(Clarify("From how many points? Say a number from 1 to 36."))
    circle = Circle(_target(tree.get("of"), memory), None if views is None else int(float(views)))
    return ([circle] if tree.get("laps") is None else _times(float(tree.get("laps")), circle)), []


def _times(times: float, *body: Intent) -> list[Intent]:
    if times != int(times) or not 1 <= times <= MOST_TIMES:
        raise UnresolvedError(Clarify(f"How many times? Say a number from 1 to {MOST_TIMES}."))
    return [Repeat(int(times), body)] if times > 1 else list(body)


def _each(tree: Tree, memory: Memory) -> Result:
    target = _target(tree.get("of"), memory)
    one = tree.get("plural") == "yes" and not any(single != target.name for single in singulars_of(target.name))
    return [Go(target) if one else VisitEach(target)], []


def _wait(tree: Tree, memory: Memory) -> Result:
    seconds = tree.get("seconds")
    if seconds is not None and float(seconds) > 600.0:
        raise UnresolvedError(Clarify("The robot waits for at most 10 minutes; say a shorter time."))
    return [Wait(None if seconds is None else float(seconds))], []


def _shuttle(tree: Tree, memory: Memory) -> Result:
    of = tree.get("of") if tree.get("of") is not None else tree
    a, b = _pair(of, memory)
    times = None if tree.get("times") is None else count_of(tree.get("times"))
    body: list[Intent] = [Go(a), Go(b)]
    if times and times > 1:
        return [Repeat(int(times), tuple(body))], []
    return body, [] if times else ["Not said how often to go back and forth: once."]


def _return(tree: Tree, memory: Memory) -> Result:
    return [Return()], []


def _roundtrip(tree: Tree, memory: Memory) -> Result:
    return [Go(_target(tree.get("to"), memory)), Return()], []


def _fromto(tree: Tree, memory: Memory) -> Result:
    a, b = _pair(tree, memory)
    return [Go(a), Go(b)], []


def count_of(tree: Any) -> float | None:
    """Return how many times a count says."""
    if isinstance(tree, Tree):
        if tree.get("n") is not None:
            return float(tree.get("n"))
        if tree.get("times") is not None:
            return count_of(tree.get("times"))
        return tree.get("word") and {"once": 1.0, "twice": 2.0, "thrice": 3.0}.get(tree.get("word"))
    return None


def on_targets(intent: Intent, change: Callable[[Target], Target]) -> Intent:
    """Return an intent with each of its targets changed."""
    match intent:
        case Go(to=target) | Face(to=target):
            return replace(intent, to=change(target))
        case Beside(of=target) | StopAt(of=target) | Circle(of=target) | VisitEach(of=target):
            return replace(intent, of=change(target))
        case Between(of=(a, b)):
            return Between((change(a), change(b)))
        case Repeat(body=body):
            return replace(intent, body=tuple(on_targets(one, change) for one in body))
        case _:
            return intent


_READ = {
    "go": _go, "face": _face, "turn": _turn, "move": _move, "between": _between, "beside": _beside,
    "standoff": _standoff,
    "arrive": _go, "on_way": _go, "fromto": _fromto, "lead": _go, "circle": _circle, "each": _each,
    "wait": _wait, "shuttle": _shuttle, "return": _return, "roundtrip": _roundtrip,
}  # fmt: skip
