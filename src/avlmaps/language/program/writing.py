"""From intents to a program in the robot's vocabulary.

A target that is needed more than once, or in a loop, is looked up once, so that all steps mean the same instance.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from keyword import kwlist

from avlmaps.language import intents as act
from avlmaps.language.intents import Intent, Pick, Side, Target, TargetKind, TurnSense, blocks_of, targets_of
from avlmaps.language.program.parser import BUILTINS
from avlmaps.language.program.vocabulary import skills

_CORNERS = 8
_WAIT_S = 3.0
_SKILLS = {
    Side.LEFT: "move_to_left", Side.RIGHT: "move_to_right", Side.NORTH: "move_north", Side.SOUTH: "move_south",
    Side.EAST: "move_east", Side.WEST: "move_west",
}  # fmt: skip
_RESERVED = frozenset({*map(str.lower, kwlist), *BUILTINS, "robot", "start", "place", "print"})
_FACING = {Side.AHEAD: "face", Side.LEFT: "with_object_on_left", Side.RIGHT: "with_object_on_right"}


def write_program(intents: Sequence[Intent]) -> str:
    """Return the program for some intents; none of them is a refusal or a question."""
    writer = _Writer(intents)
    writer.block(intents)
    return "\n".join([*writer.head, *writer.lines]) + "\n"


@dataclass(slots=True)
class _Writer:
    intents: Sequence[Intent]
    head: list[str] = field(default_factory=list)
    lines: list[str] = field(default_factory=list)
    names: dict[Target, str] = field(default_factory=dict)
    taken: Counter[str] = field(default_factory=Counter)
    indent: str = ""
    repeats: Counter[Target] = field(default_factory=Counter)

    def __post_init__(self) -> None:
        self.repeats = _counted(self.intents)
        for intent in self.intents:
            self.repeats.update(_counted(blocks_of(intent)))
        for intent in _flat(self.intents):
            twice = isinstance(intent, act.StopAt) or (isinstance(intent, act.Beside) and intent.side is Side.FRONT)
            if isinstance(intent, act.StopAt | act.Beside | act.Circle) and (twice or getattr(intent, "views", None)):
                self.repeats[intent.of] += 1
        if any(isinstance(one, act.Return) for one in _flat(self.intents)):
            self.head.append("start = robot.current_pos()")

    def add(self, line: str) -> None:
        self.lines.append(self.indent + line)

    def variable(self, stem: str) -> str:
        plain = "".join(mark if mark.isascii() and mark.isalnum() else "_" for mark in stem.lower()).strip("_")
        is_free = plain[:1].isalpha() and plain not in _RESERVED and plain not in skills()
        plain = plain if is_free else f"place_{plain}".rstrip("_")
        self.taken[plain] += 1
        return plain if self.taken[plain] == 1 else f"{plain}{self.taken[plain]}"

    def block(self, intents: Sequence[Intent]) -> None:
        for intent in intents:
            self.write(intent)

    def write(self, intent: Intent) -> None:  # noqa: C901
        match intent:
            case act.Go(to=target):
                self.go(target)
            case act.Face(to=target, side=side):
                self.face(target, side)
            case act.Turn(degrees=degrees, heading=None):
                self.add(f"robot.turn({degrees or 0:g})")
            case act.Turn(heading=heading):
                self.add(f"robot.turn_absolute({heading:g})")
            case act.Move(metres=metres):
                self.add(f"robot.move_forward({metres:g})")
            case act.Between(of=(a, b)):
                self.between(a, b)
            case act.Beside():
                self.beside(intent)
            case act.StopAt(of=target, metres=metres):
                self.go(target)
                self.add(f"robot.face({self.value(target)})")
                self.add(f"robot.move_forward({-metres:g})")
            case act.Circle():
                self.circle(intent)
            case act.VisitEach(of=target):
                self.add(f"robot.get_nearest_pos({self.query(target)})")  # where there is none, that is told
                self.add(f"for place in robot.get_all_pos({self.query(target)}):")
                self.add("    robot.move_to(place)")
            case act.Wait(seconds=seconds):
                self.add(f"robot.wait({_WAIT_S if seconds is None else seconds:g})")
            case act.Return():
                self.add("robot.move_to(start)")
            case act.Repeat():
                self.repeat(intent)
            case act.If():
                self.branch(intent)
            case _:
                raise ValueError(f"{intent!r} has no program")

    def go(self, target: Target) -> None:
        value = self.value(target)
        plain = target.kind is TargetKind.OBJECT and not target.near
        if not plain and target not in self.names:
            value = f"robot.get_max_pos_3d({value})"
        self.add(f"robot.move_to_object({value})" if plain else f"robot.move_to({value})")

    def face(self, target: Target, side: Side) -> None:
        value = self.value(target)
        self.add(f"robot.{_FACING.get(side, 'face')}({value})")
        if side is Side.BEHIND:
            self.add("robot.turn(180)")

    def between(self, a: Target, b: Target) -> None:
        if TargetKind.HERE in (a.kind, b.kind):
            other = b if a.kind is TargetKind.HERE else a
            self.add(f"robot.move_to((robot.current_pos() + robot.get_pos({self.value(other)})) / 2)")
            return
        pair = (replace(one, pick=Pick.ANY) if one.pick is Pick.NEAREST else one for one in (a, b))
        self.add(f"robot.move_in_between({', '.join(map(self.value, pair))})")  # it takes those nearest to each other

    def beside(self, intent: act.Beside) -> None:
        target, side, metres = intent.of, intent.side, intent.metres
        if side in _SKILLS:
            away = "" if metres is None else f", {metres:g}"
            self.add(f"robot.{_SKILLS[side]}({self.value(target)}{away})")
        elif side is Side.FRONT:
            self.go(target)
            self.add(f"robot.face({self.value(target)})")
            if metres is not None:
                self.add(f"robot.move_forward({-metres:g})")
                self.add(f"robot.face({self.value(target)})")
        elif metres is None:
            place = self.bound(target)
            self.add(f"robot.move_to({place})")
            self.add(f"robot.move_to(2 * {place} - robot.current_pos())")
        else:
            self.add(f"robot.move_behind({self.value(target)}, {metres:g})")

    def circle(self, intent: act.Circle) -> None:
        count = intent.views or _CORNERS
        contour = self.variable("outline")
        self.add(f"{contour} = robot.get_contour({self.value(intent.of)})")
        self.add(f"for i in range({count}):")
        back = "" if intent.way is not TurnSense.CLOCKWISE else "-"  # an outline runs counterclockwise
        corner = f"i * len({contour}) // {count}"
        self.add(f"    robot.move_to({contour}[{f'-({corner})' if back else corner}])")
        if intent.views:
            self.add(f"    robot.face({self.value(intent.of)})")

    def repeat(self, intent: act.Repeat) -> None:
        for target in _counted(intent.body):
            visited = {one.of for one in _flat(intent.body) if isinstance(one, act.VisitEach)}
            if target.kind is not TargetKind.HERE and target not in visited:
                self.value(target)
        self.add(f"for {self.variable('i')} in range({intent.times}):")
        self.indented(intent.body)

    def branch(self, intent: act.If) -> None:
        """Write both branches; what one of them looks up has no name behind it."""
        named, thing = dict(self.names), self.query(intent.of)
        self.add(f"if {'' if intent.body else 'not '}robot.exists({thing}):")
        for block in filter(None, (intent.body, intent.otherwise)):
            if intent.body and block is intent.otherwise:
                self.add("else:")
            self.indented(block)
            self.names = dict(named)

    def indented(self, block: Sequence[Intent]) -> None:
        self.indent += "    "
        self.block(block)
        self.indent = self.indent[:-4]

    def bound(self, target: Target) -> str:
        """Return the variable that holds the place of a target, written where it is first needed."""
        if target not in self.names:
            query = self.query(target)
            name = self.variable(target.name.split()[-1] if not target.is_file else "place")
            number = 2 if target.pick is Pick.OTHER else target.number
            if target.pick is Pick.ANY:
                one = "get_pos" if target.kind is TargetKind.OBJECT else "get_max_pos_3d"
            elif target.pick is Pick.NEAREST and number == 1:
                one = "get_nearest_pos"
            else:
                one = "get_nth_pos"
                query += f", {number}" if target.pick in (Pick.OTHER, Pick.NEAREST) else f', {number}, "{target.pick}"'
            self.add(f"{name} = robot.{one}({query})")
            self.names[target] = name
        return self.names[target]

    def value(self, target: Target) -> str:
        """Return a skill's argument for a target: a phrase, a heatmap's best place, or its variable."""
        if target.kind is TargetKind.HERE:
            return "robot.current_pos()"
        if target in self.names or self.repeats[target] > 1 or target.pick is not Pick.ANY:
            return self.bound(target)
        if target.kind is TargetKind.OBJECT and not target.near:
            return _quoted(target.name)
        return self.query(target)

    def query(self, target: Target) -> str:
        """Return the phrase of a thing, or the variable or expression of a heatmap."""
        if target.kind is TargetKind.OBJECT and not target.near:
            return _quoted(target.name)
        factors = [
            f"robot.get_major_map({_argument(target)})",
            *(f"robot.get_map({_argument(n)})" for n in target.near),
        ]
        if len(factors) == 1:
            return factors[0]
        self.taken["heat"] += 1
        heat = f"heat{self.taken['heat']}"
        self.add(f"{heat} = {' * '.join(factors)}")
        return heat


def _counted(intents: Sequence[Intent]) -> Counter[Target]:
    return Counter(target for intent in intents for target in targets_of(intent))


def _flat(intents: Sequence[Intent]) -> Iterator[Intent]:
    for intent in intents:
        yield intent
        yield from _flat(blocks_of(intent))


def _quoted(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'


def _argument(target: Target) -> str:
    match target.kind:
        case TargetKind.OBJECT:
            return f"obj={_quoted(target.name)}"
        case TargetKind.SOUND:
            return f"sound={_quoted(target.name)}{_at(target)}"
        case TargetKind.AREA:
            return f"area={_quoted(target.name)}"
        case TargetKind.IMAGE:
            return f"img=robot.load_image({_quoted(target.name)})"
        case _:
            return f"sound=robot.load_sound({_quoted(target.name)}){_at(target)}"


def _at(target: Target) -> str:
    return "" if target.at is None else f', at="{target.at}"'
