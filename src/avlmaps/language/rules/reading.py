"""A clause, read by the grammar, as what it asks for."""

import re
from collections.abc import Callable
from functools import cache
from importlib.resources import files
from typing import Any

from avlmaps.core.errors import LanguageError
from avlmaps.language.rules import words
from avlmaps.language.rules.intents import (
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
    Relation,
    Repeated,
    Shuttle,
    Stay,
    Target,
    Turn,
    TurnTo,
    Viewpoints,
)
from avlmaps.language.rules.names import Names, is_rule, is_token
from avlmaps.language.rules.sounds import SOUND_VERBS

# A little, a bit, slightly: how far a robot goes when told so, metres.
_LITTLE_M = 0.5
_MOST_TIMES = 100
_MOST_VIEWPOINTS = 36
_ROUND = 8
_RELATIONS = {
    "there": Relation.THERE, "start_place": Relation.START, "halfway": Relation.HALFWAY, "before": Relation.FRONT,
    "behind": Relation.BEHIND,
}  # fmt: skip
_SIDES = {"north": Relation.NORTH, "south": Relation.SOUTH, "east": Relation.EAST, "west": Relation.WEST}


@cache
def parser() -> Any:
    """Return the parser of clauses."""
    from lark import Lark

    grammar = files("avlmaps.language.rules").joinpath("command.lark").read_text(encoding="utf-8")
    listed = {name: value for name, value in vars(words).items() if name.isupper() and isinstance(value, str)}
    listed["SOUND_VERBS"] = "|".join(SOUND_VERBS)
    listed["STOPS"] = words.STOPS.replace("<SPELLED>", words.SPELLED)
    grammar = re.sub(r"<([A-Z_]+)>", lambda found: f"(?:{listed[found[1]]})".replace("/", r"\/"), grammar)
    return Lark(grammar, parser="lalr", lexer="contextual", maybe_placeholders=False)


def read_clause(tree: Any, names: Names) -> Intent:
    """Return what a parsed clause asks for."""
    action = next(child for child in tree.children if not is_token(child, "COUNT"))
    if is_rule(action, "action"):
        action = action.children[0]
    counts = [words.count_of(child) for child in [*tree.children, *action.children] if is_token(child, "COUNT")]
    count = counts[0] if counts else None
    if count is not None and not 1 <= count <= _MOST_TIMES:
        raise LanguageError(
            f"{count} times is not understood; say a number from 1 to {_MOST_TIMES}, like: three times."
        )
    return _Reader(names, count).read(action)


class _Reader:
    """Reads one clause; `count` is how often it is to be done, where that was said."""

    def __init__(self, names: Names, count: int | None) -> None:
        self.names = names
        self.count = count

    def read(self, node: Any) -> Intent:
        reader: Callable[[Any], Intent] = getattr(self, f"_{node.data}")
        intent = reader(node)
        if self.count is None or isinstance(intent, Shuttle | Again | Mention | Stay):
            return intent
        if self.count > 1 and isinstance(intent, Go) and intent.goals[0].relation is Relation.BETWEEN:
            return Shuttle(intent.goals[0].targets, self.count)
        return intent if self.count == 1 else Repeated((intent,), self.count)

    # Going.

    def _go(self, node: Any) -> Intent:
        goals = [child for child in node.children if hasattr(child, "data") and child.data != "list"]
        return Go(tuple(self._goal(goal) for goal in goals))

    def _go_heard(self, node: Any) -> Intent:
        parts = [child for child in node.children if is_rule(child, "heard", "place")]
        after = [child for child in node.children if is_rule(child, "target")]
        return Go(tuple(_at(target) for target in [self.names.target_of(parts), *map(self.names.target, after)]))

    def _go_start(self, _: Any) -> Intent:
        return Go((Goal(Relation.START),))

    def _go_from(self, node: Any) -> Intent:
        return Go(tuple(_at(target) for target in self._targets(node)))

    def _go_via(self, node: Any) -> Intent:
        first, *over = self._targets(node)
        return Go(tuple(_at(target) for target in [*over, first]))

    def _through(self, node: Any) -> Intent:
        return Go((Goal(Relation.BEHIND, tuple(self._targets(node))),))

    def _patrol(self, node: Any) -> Intent:
        return Go(tuple(_at(target) for target in self._targets(node)))

    def _stay(self, node: Any) -> Intent:
        verb = str(node.children[0]) if len(node.children) == 1 else ""
        if re.match(
            r"(?:go|mov|driv|walk|head|navigat|travel|com|roll|advanc|proceed|continu|run|get|take|put)",
            verb,
            re.IGNORECASE,
        ):
            raise LanguageError(
                f"{verb!r} does not say where to; say it like: {verb} to the sofa, or: {verb} forward 2 metres."
            )
        return Stay()

    def _leave(self, node: Any) -> Intent:
        self.names.notes.append(f"{str(node.children[0])!r} is left to the next way to go.")
        return Mention(tuple(self._targets(node)))

    def _front_goal(self, node: Any) -> Intent:
        inner = next(child for child in node.children if hasattr(child, "data"))
        return Front((self._goal(inner),))

    def _front_near(self, node: Any) -> Intent:
        return Front((_at(self._targets(node)[0]),), near=True)

    def _front_start(self, _: Any) -> Intent:
        return Front((Goal(Relation.START),))

    def _front_things(self, node: Any) -> Intent:
        first = [child for child in node.children if not is_token(child, "ARTICLE") and not is_rule(child, "list")]
        after = [child for child in first if is_rule(child, "target")]
        alone = [_as_core(child, node) for child in first if child not in after]
        return Front(tuple(_at(target) for target in [self.names.target_of(alone), *map(self.names.target, after)]))

    # Goals.

    def _goal(self, node: Any) -> Goal:
        if node.data == "goal":
            node = next(child for child in node.children if hasattr(child, "data"))
        if node.data == "target":
            return _at(self.names.target(node))
        targets = tuple(self._targets(node))
        distance_m = self._distance(node)
        if node.data == "middle":
            return Goal(Relation.BETWEEN)
        if node.data in ("between", "between_path"):
            return Goal(Relation.BETWEEN, self._pair(node if node.data == "between_path" else node.children[0]))
        if node.data == "sideways":
            return self._sideways(node, targets, distance_m)
        if node.data == "apart":
            return Goal(Relation.APART, targets, _LITTLE_M if distance_m is None else distance_m)
        return Goal(_RELATIONS.get(node.data, Relation.AT), targets, distance_m)

    def _sideways(self, node: Any, targets: tuple[Target, ...], distance_m: float | None) -> Goal:
        told = next(str(child) for child in node.children if is_token(child, "SIDE_OF", "POSS_SIDE", "ITS_SIDE"))
        return Goal(_side_relation(told), targets or (Target(None),), distance_m)

    def _pair(self, node: Any) -> tuple[Target, ...]:
        """Return the two targets of a pair, none for "the two", which were named before."""
        return tuple(self._targets(node))

    def _targets(self, node: Any) -> list[Target]:
        rules = ("target", "near_target", "item", "heard")
        return [self.names.target(child) for child in node.children if is_rule(child, *rules)]

    def _distance(self, node: Any) -> float | None:
        told = next((str(child) for child in node.children if is_token(child, "DISTANCE")), None)
        return None if told is None else words.metres_of(told)

    # Motion without a goal.

    def _move(self, node: Any) -> Intent:
        way = next((child.children[0] for child in node.children if is_rule(child, "direction")), None)
        told = [child for child in node.children if is_token(child, "DISTANCE")]
        if not told:
            verb, side = str(node.children[0]), str(way).strip()
            if is_token(way, "BACKWARD") and side.lower() == "back":
                return Go((Goal(Relation.START),))
            raise LanguageError(f"'{verb} {side}' does not say how far; say it like: {verb} {side} 2 metres.")
        distance_m = words.metres_of(told[0])
        distance_m = _LITTLE_M if distance_m is None else distance_m
        if way is None or way.type == "FORWARD":
            return Move(distance_m)
        if way.type == "BACKWARD":
            return Move(-distance_m)
        if way.type == "SIDE":
            return Move(distance_m, turn_deg=_quarter(str(way)))
        return Move(distance_m, compass_deg=_heading(str(way)))

    def _back_up(self, node: Any) -> Intent:
        told = [child for child in node.children if is_token(child, "DISTANCE")]
        if not told:
            verb = str(node.children[0])
            raise LanguageError(f"{verb!r} does not say how far; say it like: {verb} 2 metres.")
        return Move(-(words.metres_of(told[0]) or _LITTLE_M))

    def _towards(self, node: Any) -> Intent:
        target, distance_m = self._targets(node)[0], self._distance(node)
        told = any(is_token(child, "DISTANCE") for child in node.children)
        return Face(target, then_forward_m=distance_m or _LITTLE_M) if told else Go((_at(target),))

    def _away(self, node: Any) -> Intent:
        told = [str(child) for child in node.children if is_token(child, "DISTANCE")]
        if not told:
            raise LanguageError("'away from' does not say how far; say it like: move away from the sofa by 2 metres.")
        return Face(self._targets(node)[0], then_forward_m=-(words.metres_of(told[0]) or _LITTLE_M))

    # Turning.

    def _turn(self, node: Any) -> Intent:
        said = " ".join(str(child) for child in node.children if not hasattr(child, "data")).strip()
        turning = next((child for child in node.children if is_rule(child, "turning")), node)
        found = {child.type: str(child) for child in turning.children if not hasattr(child, "data")}
        if "COMPASS" in found:
            return TurnTo(_heading(found["COMPASS"]))
        around = found.get("AROUND", "") + found.get("U_TURN", "")
        if around and re.match("look", said, re.IGNORECASE) and around == "around":
            return Turn(360.0)
        if around:
            return Turn(360.0 if re.search(r"circle|all the way|complete|full|360", around, re.IGNORECASE) else 180.0)
        side = words.side_of(found.get("SIDE", "")) or (
            "left" if re.match("counter|anti", found.get("CLOCK", ""), re.IGNORECASE) else None
        )
        if "ANGLE" in found:
            angle = words.angle_of(found["ANGLE"])
            return self._turn_by(angle, side, said="CLOCK" in found or side is not None)
        if side is not None:
            return Turn(-90.0 if side == "left" else 90.0)
        if "CLOCK" in found or not re.match(r"spin|twirl|revolv|mak|do\b|perform", said, re.IGNORECASE):
            raise LanguageError(
                f"{said!r} does not say which way; say it like: turn left 30 degrees, or: turn towards the window."
            )
        return Turn(360.0)

    def _turn_by(self, angle: float, side: str | None, *, said: bool) -> Intent:
        if not 0 < angle <= 3600:
            raise LanguageError(f"{angle:g} degrees is not an angle to turn by; say it like: turn left 30 degrees.")
        if not said and angle % 180:
            self.names.notes.append(f"No side was said for {angle:g} degrees: the turn is to the right.")
        return Turn(-angle if side == "left" else angle)

    def _turn_at(self, node: Any) -> Intent:
        side = next(str(child) for child in node.children if is_token(child, "SIDE"))
        told = next((str(child) for child in node.children if is_token(child, "ANGLE")), None)
        angle = 90.0 if told is None else words.angle_of(told)
        turn = Turn(-angle if words.side_of(side) == "left" else angle)
        return Repeated((Go((_at(self._targets(node)[0]),)), turn), 1)

    def _heading(self, node: Any) -> Intent:
        return TurnTo(words.angle_of(next(str(child) for child in node.children if is_token(child, "ANGLE"))) % 360)

    def _face(self, node: Any) -> Intent:
        return Face(self._targets(node)[0])

    def _face_away(self, node: Any) -> Intent:
        return Face(self._targets(node)[0], then_turn_deg=180.0)

    def _beside(self, node: Any) -> Intent:
        told = next(str(child) for child in node.children if is_token(child, "YOURS"))
        target, side = self._targets(node)[0], words.side_of(told)
        if side is not None and not re.search(r"\bright\s+(?:behind|in front|ahead)", told, re.IGNORECASE):
            return Beside(side, target)
        behind = re.search(r"behind|back|rear", told, re.IGNORECASE) is not None
        return Face(target, then_turn_deg=180.0 if behind else 0.0)

    # Around things, and again.

    def _shuttle(self, node: Any) -> Intent:
        held = next(child for child in node.children if is_rule(child, "pair", "path", "ends"))
        return Shuttle(self._pair(held), self.count)

    def _circle(self, node: Any) -> Intent:
        told = next(str(child) for child in node.children if is_token(child, "CIRCLE")).lower()
        return Viewpoints(self._targets(node)[0], None if told.endswith("along") else _ROUND, face=False)

    def _viewpoints(self, node: Any) -> Intent:
        told = next(str(child) for child in node.children if is_token(child, "VIEWS")).lower()
        found = re.search(rf"from ({words.SPELLED}|\d+) ", told)
        count = int(words.number_of(found[1])) if found else 4
        if not 1 <= count <= _MOST_VIEWPOINTS:
            raise LanguageError(
                f"{count} points of view are not understood; say a number from 1 to {_MOST_VIEWPOINTS}."
            )
        return Viewpoints(self._targets(node)[0], count, face=True)

    def _inspect(self, node: Any) -> Intent:
        target = self._targets(node)[0]
        return Repeated((Go((_at(target),)), Face(target)), 1)

    def _again(self, _: Any) -> Intent:
        return Again(2 if self.count is None else self.count)

    def _following(self, _: Any) -> Intent:
        count, self.count = self.count or 1, None
        return Following(count)

    def _mention(self, node: Any) -> Intent:
        return Mention(tuple(self._targets(node)))


def _at(target: Target) -> Goal:
    return Goal(Relation.AT, (target,))


def _as_core(child: Any, node: Any) -> Any:
    """Return a file that stands at the start of a clause as the rule that it is elsewhere."""
    from lark import Tree

    if is_token(child, "IMAGE_FILE", "CLIP_FILE"):
        return Tree("picture" if child.type == "IMAGE_FILE" else "clip", [child])
    return child


def _quarter(side: str) -> float:
    return -90.0 if words.side_of(side) == "left" else 90.0


def _heading(text: str) -> float:
    heading = words.compass_of(text)
    assert heading is not None, text
    return float(heading)


def _side_relation(told: str) -> Relation:
    side = words.side_of(told)
    if side is not None:
        return Relation(side)
    compass = re.search(words.COMPASS, told, re.IGNORECASE)
    assert compass is not None, told
    name = next(
        (name for name in _SIDES if re.match(rf"{name}(?![- ]?(?:east|west))", compass[0], re.IGNORECASE)), None
    )
    if name is None:
        raise LanguageError(f"{compass[0]!r} of a thing is not understood; say north, south, east or west of it.")
    return _SIDES[name]
