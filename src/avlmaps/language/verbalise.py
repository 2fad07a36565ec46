"""Intents in plain words, for the person to read before the robot moves."""

from collections.abc import Sequence

from avlmaps.language.intents import (
    Beside,
    Between,
    Circle,
    Clarify,
    Face,
    Go,
    Intent,
    Move,
    Pick,
    Refuse,
    Repeat,
    Return,
    Side,
    StopAt,
    Target,
    TargetKind,
    Turn,
    VisitEach,
    Wait,
)  # fmt: skip

_COMPASS = {0: "north", 45: "north-east", 90: "east", 135: "south-east", 180: "south", 225: "south-west", 270: "west",
            315: "north-west"}  # fmt: skip
_TIMES = {1: "once", 2: "twice"}
_SIDES = {
    Side.LEFT: "to the left of", Side.RIGHT: "to the right of", Side.FRONT: "in front of", Side.BEHIND: "behind",
    Side.NORTH: "to the north of", Side.SOUTH: "to the south of", Side.EAST: "to the east of",
    Side.WEST: "to the west of",
}  # fmt: skip


def verbalise(intents: Sequence[Intent]) -> str:
    """Return one sentence that says what the robot will do, or why it does nothing."""
    if intents and isinstance(intents[0], Refuse):
        return intents[0].said
    if intents and isinstance(intents[0], Clarify):
        return intents[0].question
    if tuple(intents) == (Wait(),):
        return "I will stop and stay here."
    return f"I will {_steps(intents)}."


def _steps(intents: Sequence[Intent]) -> str:
    return ", then ".join(map(_step, intents))


def _step(intent: Intent) -> str:
    match intent:
        case Go(to=target):
            return f"go to {phrase(target)}"
        case Face(to=target, side=Side.AHEAD):
            return f"face {phrase(target)}"
        case Face(to=target, side=side):
            where = "behind me" if side is Side.BEHIND else f"on my {side}"
            return f"turn until {phrase(target)} is {where}"
        case Turn(degrees=None, heading=heading):
            return f"turn to {_COMPASS.get(round(heading or 0), f'{heading:g} degrees on the compass')}"
        case Turn(degrees=degrees):
            return _turn(degrees or 0.0)
        case Move(metres=metres):
            return f"move {'forward' if metres > 0 else 'back'} {abs(metres):g} m"
        case Between(of=(a, b)):
            return f"stop between {phrase(a)} and {phrase(b)}"
        case Beside(of=target, side=side, metres=metres):
            return f"stop {'' if metres is None else f'{metres:g} m '}{_SIDES[side]} {phrase(target)}"
        case StopAt(of=target, metres=metres):
            return f"stop {metres:g} m from {phrase(target)}"
        case _:
            return _other(intent)


def _other(intent: Intent) -> str:
    match intent:
        case Circle(of=target, views=None, way=way):
            return f"drive around {phrase(target)} {way}".rstrip()
        case Circle(of=target, views=views, way=way):
            return f"look at {phrase(target)} from {views} points around it {way}".rstrip()
        case VisitEach(of=target):
            return f"go to each of these, the nearest first: {phrase(target)}"
        case Wait(seconds=seconds):
            return "stay there" if seconds is None else f"wait {seconds:g} seconds"
        case Return():
            return "come back here"
        case Repeat(times=times, body=body):
            return f"{_TIMES.get(times, f'{times} times')}: {_steps(body)}"
        case _:
            return str(intent)


def _turn(degrees: float) -> str:
    if abs(degrees) == 180.0:
        return "turn around"
    return f"turn {'right' if degrees > 0 else 'left'} {abs(degrees):g} degrees"


def phrase(target: Target) -> str:
    """Return a target in words: "the chair nearest to where breathing was heard"."""
    pick = f"{target.pick} " if target.pick is not Pick.ANY else ""
    match target.kind:
        case TargetKind.OBJECT | TargetKind.AREA:
            own = f"the {pick}{target.name}"
        case TargetKind.SOUND:
            at_source = target.at == "source"
            own = f"where the sound of {target.name} comes from" if at_source else f"where {target.name} was heard"
        case TargetKind.IMAGE:
            own = f"where the picture {target.name} was taken"
        case TargetKind.CLIP:
            own = f"where a sound like {target.name} {'comes from' if target.at == 'source' else 'was heard'}"
        case TargetKind.HERE:
            return "here"
    areas = [one for one in target.near if one.kind is TargetKind.AREA]
    others = [one for one in target.near if one.kind is not TargetKind.AREA]
    beside = "near" if target.pick is Pick.NEAREST else "nearest to"
    near = f" {beside} {' and '.join(phrase(one) for one in others)}" if others else ""
    return own + near + "".join(f" in {phrase(one)}" for one in areas)
