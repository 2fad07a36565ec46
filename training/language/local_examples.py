"""`python -m training.language.local_examples`: commands with programs, for the prompt of a local language model.

Chosen from the voices that the reader learns from (none that is held out): rows whose meaning the grammar of
`avlmaps.language.local` can say, each form of program a few times, in short and plain sentences first.
"""

import random
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from training.language.align import aligned
from training.language.pool import HELD_OUT
from training.language.rows import Example, examples_of, lists

from avlmaps.language.intents import (
    Beside,
    Between,
    Circle,
    Face,
    Go,
    Intent,
    Move,
    Pick,
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
from avlmaps.language.local import meaning
from avlmaps.language.names import is_place

OUT = Path(__file__).parents[2] / "src/avlmaps/language/local_examples.tsv"
_EACH, _MOST, _LONGEST, _STEPS = 3, 260, 110, 4
_FIRST = (  # the paper's own kinds of command, in every prompt
    ("go to the sofa, then face the tv", 'robot.move_to_object("sofa")\nrobot.face("tv")'),
    ("move 3 meters forward, then turn right 90 degrees and stop in the kitchen",
     'robot.move_forward(3)\nrobot.turn(90)\nrobot.move_to("kitchen")'),
    ("navigate to the chair near the sound of glass breaking",
     'robot.move_to(robot.get_max_pos_3d(robot.get_major_map(obj="chair") * robot.get_map(sound="glass breaking")))'),
    ("go in between the sink and the oven, turn around and come back",
     'start = robot.current_pos()\nrobot.move_in_between("sink", "oven")\nrobot.turn(180)\nrobot.move_to(start)'),
    ("move to the right side of the table in the dining room",
     'robot.move_to_right(robot.get_max_pos_3d(robot.get_major_map(obj="table") * robot.get_map(area="dining room")))'),
    ("visit all the windows twice",
     'for i in range(2):\n    for place in robot.get_all_pos("window"):\n        robot.move_to(place)'),
)  # fmt: skip
_KEYS = {TargetKind.OBJECT: "obj", TargetKind.SOUND: "sound", TargetKind.AREA: "area"}


def program(intents: Sequence[Intent]) -> str:
    """Return the program in the forms that the grammar allows.

    Raises:
        KeyError: no form says it.
    """
    start = "start = robot.current_pos()\n" if any(isinstance(one, Return) for one in intents) else ""
    return start + "\n".join(map(_lines, intents))


def _lines(intent: Intent) -> str:  # noqa: C901 - a case for each intent
    match intent:
        case Go(to=Target(kind=TargetKind.OBJECT, near=()) as to):
            return f"robot.move_to_object({_target(to)})"
        case Go(to=Target(kind=TargetKind.AREA, near=(), name=name)) if is_place(name):
            return f'robot.move_to("{name}")'
        case Go(to=to):
            return f"robot.move_to({_target(to)})"
        case Face(to=to, side=Side.AHEAD):
            return f"robot.face({_target(to)})"
        case Face(to=to, side=Side.BEHIND):
            return f"robot.face({_target(to)})\nrobot.turn(180)"
        case Face(to=to, side=side):
            return f"robot.with_object_on_{side}({_target(to)})"
        case Turn(degrees=None, heading=heading):
            return f"robot.turn_absolute({heading:g})"
        case Turn(degrees=degrees):
            return f"robot.turn({degrees:g})"
        case Move(metres=metres):
            return f"robot.move_forward({metres:g})"
        case Between(of=(a, b)):
            return f"robot.move_in_between({_target(a)}, {_target(b)})"
        case StopAt(of=of, metres=metres):
            return f"robot.move_to_object({_target(of)})\nrobot.face({_target(of)})\nrobot.move_forward({-metres:g})"
        case Beside(of=of, side=Side.FRONT, metres=None):
            return f"robot.move_to_object({_target(of)})\nrobot.face({_target(of)})"
        case Beside(of=of, side=side, metres=metres) if side is not Side.FRONT:
            name = f"to_{side}" if side in (Side.LEFT, Side.RIGHT) else side
            return f"robot.move_{name}({_target(of)}{'' if metres is None else f', {metres:g}'})"
        case Circle(of=Target(kind=TargetKind.OBJECT, near=(), name=name), views=None):
            corner = "outline[i * len(outline) // 8]"
            return f'outline = robot.get_contour("{name}")\nfor i in range(8):\n    robot.move_to({corner})'
        case VisitEach(of=of):
            return f"for place in robot.get_all_pos({_target(of)}):\n    robot.move_to(place)"
        case Wait(seconds=seconds):
            return f"robot.wait({3 if seconds is None else seconds:g})"
        case Return():
            return "robot.move_to(start)"
        case Repeat(times=times, body=body):
            inner = "\n".join(map(_lines, body)).replace("\n", "\n    ")
            return f"for i in range({times}):\n    {inner}"
        case _:
            raise KeyError(intent.do)


def _target(target: Target) -> str:
    if target.pick is Pick.FARTHEST and target.kind is TargetKind.OBJECT and not target.near:
        return f'robot.get_all_pos("{target.name}")[-1]'
    if target.pick not in (Pick.ANY, Pick.NEAREST):
        raise KeyError(target.pick)
    if target.kind is TargetKind.OBJECT and not target.near:
        return f'"{target.name}"'
    near = "".join(f' * robot.get_map({_KEYS[one.kind]}="{one.name}")' for one in target.near)
    return f'robot.get_max_pos_3d(robot.get_major_map({_KEYS[target.kind]}="{target.name}"){near})'


def chosen(rows: Sequence[Example]) -> list[tuple[str, str]]:
    """Return commands with programs: a few of each form, the shorter sentences first."""
    forms: Counter[str] = Counter()
    found: list[tuple[str, str]] = []
    for row in sorted(rows, key=lambda row: len(row.say)):
        said = " ".join(row.say.split())
        if row.is_question or not isinstance(row.meaning, tuple) or len(said) > _LONGEST or len(row.meaning) > _STEPS:
            continue
        if aligned(row) is None:
            continue
        try:
            text = program(row.meaning)
        except KeyError:
            continue
        form = "; ".join(f"{one.do} {_kinds(one)}" for one in row.meaning)
        if meaning(text) is None or forms[form] >= _EACH:
            continue
        forms[form] += 1
        found.append((said, text))
    random.Random(1).shuffle(found)
    return [*_FIRST, *sorted(found[:_MOST])]


def _kinds(intent: Intent) -> str:
    to = getattr(intent, "to", getattr(intent, "of", None))
    side = getattr(intent, "side", "")
    return f"{side} {to.kind} {' '.join(one.kind for one in to.near)}" if isinstance(to, Target) else side


if __name__ == "__main__":
    voices = [path for path in lists()["voices"] if path.stem not in HELD_OUT]
    every = [row for path in voices for row in examples_of(path) if row.row]
    OUT.write_text(
        "".join(f"{said}\t{text.replace(chr(10), ' | ')}\n" for said, text in chosen(every)), encoding="utf-8"
    )
