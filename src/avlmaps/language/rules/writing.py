"""What a command asks for, written as a program of the robot's vocabulary."""

import json
from collections.abc import Sequence
from dataclasses import dataclass, field

from avlmaps.core.errors import LanguageError
from avlmaps.core.question import Modality
from avlmaps.language.rules.intents import (
    INSIDE,
    Again,
    Beside,
    Face,
    Following,
    Front,
    Go,
    Goal,
    Intent,
    Mention,
    Move,
    Named,
    Relation,
    Repeated,
    Shuttle,
    Target,
    Turn,
    TurnTo,
    Viewpoints,
)

_ARGUMENTS = {Modality.OBJECT: "obj", Modality.SOUND: "sound", Modality.AREA: "area", Modality.IMAGE: "img"}

_SAY_BETWEEN = "say it like: stop between the sofa and the TV"


def write_program(intents: Sequence[Intent]) -> tuple[str, list[str]]:
    """Return the program for what a command asks for in order, and notes on how it was taken.

    Raises:
        LanguageError: there is nothing to do, or "it" stands for nothing that was named.
    """
    writer = _Writer()
    for intent in _with_fronts_resolved(intents):
        writer.write(intent)
    if not writer.lines:
        raise LanguageError("The command asks for nothing to be done; say it like: go to the sofa, then turn left.")
    first = ["start = robot.current_pos()"] if writer.returns else []
    return "\n".join([*first, *writer.before, *writer.lines]) + "\n", writer.notes


def _with_fronts_resolved(intents: Sequence[Intent]) -> list[Intent]:
    """Return the intents with places that were said in front put where they belong.

    "In the kitchen, find the chair" tells where the chair is; any other place in front is one to go to, and "stop
    there" after it adds nothing.
    """
    resolved: list[Intent] = []
    held: Front | None = None
    for at, intent in enumerate(intents):
        if isinstance(intent, Following):
            return [*resolved, Repeated(tuple(_with_fronts_resolved(intents[at + 1 :])), intent.count)]
        if held is not None and isinstance(intent, Go) and any(_of_the_two(goal) for goal in intent.goals):
            if not held.near and len(held.goals) == 2 and len(intent.goals) == 1 and _plain_thing(Go(held.goals)):
                resolved.append(Go((Goal(Relation.BETWEEN, tuple(goal.targets[0] for goal in held.goals)),)))
                held = None
                continue
            raise LanguageError(f"'the two' could be meant otherwise; {_SAY_BETWEEN}.")
        if held is not None and held.near and _plain_thing(intent):
            resolved.append(_with_context(intent, held))
            held = None
            continue
        if held is not None:
            resolved.append(Go(held.goals))
        held = intent if isinstance(intent, Front) else None
        if held is None:
            resolved.append(intent)
    return resolved if held is None else [*resolved, Go(held.goals)]


def _is_it(goal: Goal) -> bool:
    """Return whether a goal is only "it", as in "the sofa, go to it": one way, not two."""
    return goal.relation is Relation.AT and goal.targets[0] == Target(None)


def _of_the_two(goal: Goal) -> bool:
    return goal.relation is Relation.BETWEEN and not goal.targets


def _plain_thing(intent: Intent) -> bool:
    return isinstance(intent, Go) and all(
        goal.relation is Relation.AT and goal.targets[0].sought is not None for goal in intent.goals
    )


def _with_context(intent: Intent, front: Front) -> Intent:
    assert isinstance(intent, Go)
    place = front.goals[0].targets[0]
    around = [*([place.sought] if place.sought else []), *place.context]
    return Go(
        tuple(
            Goal(Relation.AT, (Target(goal.targets[0].sought, (*goal.targets[0].context, *around)),))
            for goal in intent.goals
        )
    )


@dataclass
class _Writer:
    """Writes intents as lines, and remembers what "it" is.

    Attributes:
        lines: the program so far.
        before: lines that must stand before all others: maps and places that are used more than once.
        notes: how something was taken.
        returns: whether the program must remember where it started.
        last: the thing that was named last, which "it" is.
        last_two: the last two things that were named or gone to, which "the two" are.
        area: the area that was gone to last.
        last_goal: the lines of the last way to a place, while nothing else was done since.
    """

    lines: list[str] = field(default_factory=list)
    before: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    returns: bool = False
    last: Target | None = None
    last_two: tuple[Target, ...] = ()
    area: Named | None = None
    last_goal: list[str] | None = None
    names: dict[str, str] = field(default_factory=dict)
    loops: int = 0

    def write(self, intent: Intent) -> None:
        """Add what one intent asks for."""
        match intent:
            case Go():
                self._go(intent)
            case Move() | Turn() | TurnTo():
                self._motion(intent)
            case Face():
                self._face(intent)
            case Beside(side=side, target=target):
                self._do(f"with_object_on_{side}({self._target(target)})")
            case Viewpoints():
                self._viewpoints(intent)
            case Shuttle(ends=ends, count=count):
                self._shuttle(ends, count)
            case Repeated(body=body, count=count):
                self._loop(body, count)
            case Again(count=count):
                self._again(count)
            case _:
                for target in intent.targets if isinstance(intent, Mention) else ():
                    self._target(target)

    def _do(self, call: str) -> None:
        self.lines.append(f"robot.{call}")
        self.last_goal = None

    # Going.

    def _go(self, go: Go) -> None:
        for goal in go.goals:
            lines = self._lines_to(goal)
            if (go.arrival or _is_it(goal)) and (not lines or lines == self.last_goal):
                continue
            self.lines += lines
            self.last_goal = lines or self.last_goal

    def _lines_to(self, goal: Goal) -> list[str]:
        """Return the lines that lead to a goal; none to "there", where it already goes."""
        if goal.relation is Relation.START:
            self.returns = True
            return ["robot.move_to(start)"]
        if goal.relation is Relation.THERE:
            if self.last is None:
                raise LanguageError("'there' refers to no place that was named; name one, like: go to the sofa.")
            return [] if self.last_goal else self._lines_to(Goal(Relation.AT, (self.last,)))
        targets = self._written(goal)
        how_far = "" if goal.distance_m is None else f", {_number(goal.distance_m)}"
        match goal.relation:
            case Relation.AT:
                return [self._move_to(targets[0])]
            case Relation.BETWEEN:
                return [f"robot.move_in_between({targets[0]}, {targets[1]})"]
            case Relation.HALFWAY:
                return [f"robot.move_to((robot.current_pos() + {self._place(targets[0])}) / 2)"]
            case Relation.LEFT | Relation.RIGHT:
                return [f"robot.move_to_{goal.relation}({targets[0]}{how_far})"]
            case Relation.NORTH | Relation.SOUTH | Relation.EAST | Relation.WEST:
                return [f"robot.move_{goal.relation}({targets[0]}{how_far})"]
            case Relation.BEHIND:
                return self._behind(targets[0], goal.distance_m)
            case _:
                return self._before(goal, targets[0])

    def _move_to(self, written: str) -> str:
        """Return the way to what was named last."""
        if self.last is not None and self.last.sought is not None and self.last.sought.modality is Modality.AREA:
            self.area = self.last.sought
        if written.startswith('"'):
            return f"robot.move_to_object({written})"
        return f"robot.move_to(robot.get_max_pos_3d({written}))"

    def _before(self, goal: Goal, written: str) -> list[str]:
        """Return the way to the near side of a thing, and back from it if so far is asked for."""
        lines = [self._move_to(written)]
        if goal.relation is Relation.FRONT or goal.distance_m is not None:
            lines.append(f"robot.face({written})")
        if goal.distance_m is not None:
            lines.append(f"robot.move_forward({_number(-goal.distance_m)})")
            lines += [f"robot.face({written})"] if goal.relation is Relation.FRONT else []
        return lines

    def _behind(self, written: str, distance_m: float | None) -> list[str]:
        """Return the way to the far side: as far beyond the thing as the robot can come near it on this side."""
        place = self._place(written)
        lines = [f"robot.move_to({place})", f"robot.move_to(2 * {place} - robot.current_pos())"]
        if distance_m is not None:
            lines += [f"robot.face({place})", f"robot.move_forward({_number(-distance_m)})"]
        return lines

    # What is meant.

    def _target(self, target: Target) -> str:
        """Return how a target is written: a plain thing as its name, anything else as its map."""
        sought, *around = [named for part in (target.sought, *target.context) for named in self._meant(part)]
        self.last = Target(sought, tuple(around))
        self.last_two = (*(target for target in self.last_two[-2:] if target != self.last), self.last)[-2:]
        if sought.modality is Modality.OBJECT and not around:
            return _quoted(sought.words)
        maps = [self._map(sought, "get_major_map"), *(self._map(named, "get_map") for named in around)]
        return self._kept("heat", " * ".join(maps))

    def _written(self, goal: Goal) -> list[str]:
        return [self._target(target) for target in goal.targets or self._the_two()]

    def _the_two(self) -> tuple[Target, ...]:
        if len(self.last_two) < 2:
            raise LanguageError(f"'the two' refers to nothing that was named; {_SAY_BETWEEN}.")
        return self.last_two

    def _meant(self, part: Named | None) -> list[Named]:
        """Return what a part of a target stands for: itself, or for "it" all that was named last."""
        if part is INSIDE:
            return [] if self.area is None else [self.area]
        if part is not None:
            return [part]
        if self.last is None:
            raise LanguageError("'it' refers to nothing that was named; name the thing, like: face the sofa.")
        return [named for named in (self.last.sought, *self.last.context) if named is not None]

    def _map(self, named: Named, skill: str) -> str:
        value = _quoted(named.words)
        if named.is_file:
            value = f"robot.{'load_image' if named.modality is Modality.IMAGE else 'load_sound'}({value})"
        return f"robot.{skill}({_ARGUMENTS[named.modality]}={value})"

    def _place(self, written: str) -> str:
        skill = "get_pos" if written.startswith('"') else "get_max_pos_3d"
        return self._kept("place", f"robot.{skill}({written})")

    def _kept(self, kind: str, value: str) -> str:
        """Return the variable that holds a value, which is worked out once, before anything is done."""
        if value not in self.names:
            taken = sum(name.startswith(kind) for name in self.names.values())
            self.names[value] = f"{kind}{taken + 1}"
            self.before.append(f"{self.names[value]} = {value}")
        return self.names[value]

    # Motion.

    def _motion(self, intent: Move | Turn | TurnTo) -> None:
        match intent:
            case Turn(angle_deg=angle):
                self._do(f"turn({_number(angle)})")
            case TurnTo(compass_deg=compass):
                self._do(f"turn_absolute({_number(compass)})")
            case Move(distance_m=distance_m, turn_deg=turn, compass_deg=compass):
                if compass is not None:
                    self._do(f"turn_absolute({_number(compass)})")
                elif turn:
                    self._do(f"turn({_number(turn)})")
                self._do(f"move_forward({_number(distance_m)})")

    def _face(self, face: Face) -> None:
        self._do(f"face({self._target(face.target)})")
        if face.then_turn_deg:
            self._do(f"turn({_number(face.then_turn_deg)})")
        if face.then_forward_m is not None:
            self._do(f"move_forward({_number(face.then_forward_m)})")

    # Loops.

    def _shuttle(self, ends: tuple[Target, ...], count: int | None) -> None:
        if count is None:
            self.notes.append("Not said how often to go back and forth: once.")
        first, second = (self._place(self._target(end)) for end in ends or self._the_two())
        self._block(count or 1, [f"robot.move_to({first})", f"robot.move_to({second})"])

    def _viewpoints(self, intent: Viewpoints) -> None:
        written = self._target(intent.target)
        outline = self._kept("outline", f"robot.get_contour({written})")
        index = self._index()
        if intent.count is None:
            self.lines += [f"for {index} in {outline}:", f"    robot.move_to({index})"]
            self.last_goal = None
            return
        self.lines.append(f"for {index} in range({intent.count}):")
        self.lines.append(f"    robot.move_to({outline}[{index} * len({outline}) // {intent.count}])")
        if intent.face:
            self.lines.append(f"    robot.face({written})")
        self.last_goal = None

    def _loop(self, body: Sequence[Intent], count: int) -> None:
        outside, self.lines, self.last_goal = self.lines, [], None
        for intent in body:
            self.write(intent)
        inside, self.lines = self.lines, outside
        self._block(count, inside)

    def _again(self, count: int) -> None:
        inside, self.lines = self.lines, []
        if not inside:
            raise LanguageError(
                "Nothing was said before that could be done again; say it like: turn left, do this twice."
            )
        self._block(count, inside)

    def _block(self, count: int, inside: Sequence[str]) -> None:
        if count == 1:
            self.lines += inside
        elif inside:
            self.lines.append(f"for {self._index()} in range({count}):")
            self.lines += [f"    {line}" for line in inside]
            self.last_goal = None

    def _index(self) -> str:
        self.loops += 1
        return f"i{self.loops}" if self.loops > 1 else "i"


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


def _number(value: float) -> str:
    return f"{value:g}" if abs(value) < 1e5 else repr(value)
