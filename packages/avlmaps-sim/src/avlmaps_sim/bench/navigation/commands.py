"""The paper's list of commands for a real robot, as simulation: twenty commands, ten multimodal spatial goals.

Each is a form that is filled with what a scene holds, as often as scenes can fill it, and judged by rule.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import pi

import numpy as np
from jaxtyping import Float

from avlmaps_sim.bench.harness.evidence import Box, Photo
from avlmaps_sim.bench.indexing.tasks import Task, TaskKind
from avlmaps_sim.bench.navigation.evidence import Ground, camera_of, renumbered
from avlmaps_sim.bench.navigation.missions import (
    Goal,
    GoalKind,
    Mission,
    Row,
    Series,
    an_image,
    beside,
    between,
    heat_of,
    left_of,
)
from avlmaps_sim.hearing.sound_library import kind_of

SOUNDS_IN_A_ROW = 4
OBJECTS_AFTER_AN_IMAGE = 2
APART_M = 2.0  # from the start to the first goal, where the home is large enough
_RANGE = {Series.SOUNDS_1: 1, Series.SOUNDS_2: 2, Series.SOUNDS_3: 3}


def mission(
    ground: Ground,
    series: Series,
    goals: Sequence[Goal],
    rng: np.random.Generator,
    photos: Sequence[Photo] = (),
    command: str = "",
) -> Mission:
    """Return a mission without a name, its start drawn at random."""
    start = ground.floor.draw_start(rng, goals[0], APART_M)
    poses = tuple(rows_of(photo) for photo in photos)
    pose = (start.x_m, start.y_m, start.heading_rad)
    return Mission("", series, ground.evidence.scene, pose, tuple(goals), command, poses)


def rows_of(photo: Photo) -> tuple[Row, ...]:
    """Return a photo's pose, row by row."""
    return tuple(tuple(row) for row in photo.world_from_camera.tolist())  # pyright: ignore[reportReturnType]


def sound_missions(ground: Ground, series: Series, rng: np.random.Generator, most: int) -> list[Mission]:
    """Make sequences of four different sounds of a range; none where the scene has fewer of it."""
    goals = [goal for name, goal in ground.sounds if range_of(name) <= _RANGE[series]]
    if len(goals) < SOUNDS_IN_A_ROW:
        return []
    drawn = [[goals[i] for i in rng.permutation(len(goals))[:SOUNDS_IN_A_ROW]] for _ in range(most)]
    return [mission(ground, series, four, rng) for four in drawn]


def image_missions(ground: Ground, rng: np.random.Generator, most: int) -> list[Mission]:
    """Make sequences of a photo's place and two kinds of things; a photo serves again once all have served."""
    objects, photos = ground.objects, ground.good_photos
    if len(objects) < OBJECTS_AFTER_AN_IMAGE or not photos:
        return []
    order = rng.permutation(len(photos))
    made: list[Mission] = []
    for number in range(most):
        photo = ground.photos[photos[order[number % len(photos)]]]
        two = [objects[i] for i in rng.permutation(len(objects))[:OBJECTS_AFTER_AN_IMAGE]]
        made.append(mission(ground, Series.IMAGES, [an_image(0, camera_of(photo)), *two], rng, [photo]))
    return made


def pair_missions(ground: Ground, rng: np.random.Generator, most: int) -> list[Mission]:
    """Make pairs of an ambiguous sound and an ambiguous thing, none twice.

    The sound was heard in two places, and only one is near a thing of some kind, or near a photo. The thing is one of
    several, and only one is near another sound; where a scene has no such thing, near a photo.
    """
    sounds = ground.ambiguous_sounds()
    by_sound = ground.ambiguous_things(TaskKind.NEAR_SOUND)
    things = [(goal, None) for goal, _ in by_sound] or [
        (goal, Photo(task.world_from_photo, np.zeros(0))) for goal, task in ground.ambiguous_things(TaskKind.PHOTO)
    ]
    pairs = [(i, j) for i in range(len(sounds)) for j in range(len(things))]
    made: list[Mission] = []
    for index in _spread(pairs, rng, most):
        (sound, near), (thing, seen) = sounds[pairs[index][0]], things[pairs[index][1]]
        photos = [photo for photo in (near, seen) if photo is not None]
        goals = [sound, thing if near is None else renumbered(thing, 1)]
        made.append(mission(ground, Series.PAIRS, goals, rng, photos))
    return made


def _spread(pairs: Sequence[tuple[int, int]], rng: np.random.Generator, most: int) -> list[int]:
    """Draw pairs so that every goal serves about as often as any other."""
    order = [int(i) for i in rng.permutation(len(pairs))]
    used: dict[tuple[str, int], int] = {}
    taken: list[int] = []
    while order and len(taken) < most:
        best = min(order, key=lambda i: used.get(("a", pairs[i][0]), 0) + used.get(("b", pairs[i][1]), 0))
        order.remove(best)
        taken.append(best)
        for which, member in zip("ab", pairs[best], strict=True):
            used[which, member] = used.get((which, member), 0) + 1
    return taken


# Sounds of people and of animals, by the names of our rules and of ESC-50. All others are of the house itself.
HUMAN = frozenset({
    "breathing", "brushing teeth", "children playing", "clapping", "coughing", "crowd cheering", "crying baby",
    "drinking or sipping", "footsteps", "laughing", "sneezing", "snoring", "talking", "whistling",
})  # fmt: skip
ANIMAL = frozenset({"buzzing insects", "cat meowing", "dog bark", "mouse squeaking"})
WIDEST = 3


def range_of(sound: str) -> int:
    """Return the narrowest range with a sound: 1 domestic, 2 human as well, 3 animals and the outdoors as well."""
    kind = kind_of(sound)
    names = {sound, *kind.names}
    if names & HUMAN:
        return 2
    return WIDEST if names & ANIMAL or not kind.indoors else 1


BESIDE_M = 0.5  # the skills' own distance from an edge
_ROOM_M = 0.5  # a spot is a goal only where a robot can stand as near as this
_TRIES = 30

# Parts that a form is filled with.
OBJECT, SOUND, IMAGE, AREA, SINGLE = "object", "sound", "image", "area", "single"
BY_SOUND, BY_IMAGE, BY_AREA, SOUND_BY = "object by sound", "object by image", "object by area", "sound by object"


@dataclass(frozen=True, slots=True)
class Form:
    """One command to be filled."""

    command: str  # the sentence; ``{0}`` is what the first part is called
    parts: tuple[str, ...]  # what it is filled with
    # What becomes of the parts: ``""``: each is a goal; ``between``, ``left``, ``right``, ``north`` ...: one spot;
    # ``face``: the first is a goal, then the second is to be faced; ``turn``: only a heading.
    relation: str = ""
    distance_m: float = BESIDE_M  # from the edge, for a side


COMMANDS = (
    Form("Go to {0}.", (OBJECT,)),
    Form("Please navigate to {0}.", (SOUND,)),
    Form("Move to the place where {0} was taken.", (IMAGE,)),
    Form("Could you please drive to {0}?", (AREA,)),
    Form("Go to {0}.", (BY_SOUND,)),
    Form("Move to {0}.", (BY_IMAGE,)),
    Form("Navigate to {0}.", (BY_AREA,)),
    Form("Go to {0}.", (SOUND_BY,)),
    Form("Go to {0} and then go to {1}.", (OBJECT, OBJECT)),
    Form("First go to {0}, then move to {1}.", (SOUND, OBJECT)),
    Form("First go to {0}, and then go to {1}.", (IMAGE, SOUND)),
    Form("Move to {0}. Then go to {1}.", (AREA, OBJECT)),
    Form("First move to {0}, then go to {1}, and finally go to {2}.", (SOUND, IMAGE, OBJECT)),
    Form("Go to {0}, then to {1}.", (BY_SOUND, SOUND)),
    Form("Move to the north of {0}.", (SINGLE,), "north"),
    Form("Go to the left of {0}.", (SINGLE,), "left"),
    Form("Move in between {0} and {1}.", (SINGLE, SINGLE), "between"),
    Form("Go to {0} and face {1}.", (SOUND, SINGLE), "face"),
    Form("Turn left by 90 degrees.", (), "turn"),
    Form("Robot, please go one meter to the east of {0}.", (SINGLE,), "east", 1.0),
)
SPATIAL = (
    Form("Move in between {0} and {1}.", (IMAGE, BY_SOUND), "between"),
    Form("Go to the middle of {0} and {1}.", (SOUND, SINGLE), "between"),
    Form("Move in between {0} and {1}.", (SOUND, SOUND), "between"),
    Form("Go in between {0} and {1}.", (IMAGE, SINGLE), "between"),
    Form("Move to the left of {0}.", (BY_SOUND,), "left"),
    Form("Move to the right of {0}.", (BY_IMAGE,), "right"),
    Form("Go to the north of {0}.", (BY_SOUND,), "north"),
    Form("Go one meter to the south of {0}.", (BY_IMAGE,), "south", 1.0),
    Form("Move to the east of {0}.", (BY_AREA,), "east"),
    Form("Move to the west of {0}.", (BY_SOUND,), "west"),
)
_COMPASS = {"north": (0.0, 1.0), "south": (0.0, -1.0), "east": (1.0, 0.0), "west": (-1.0, 0.0)}


def command_missions(ground: Ground, series: Series, rng: np.random.Generator) -> list[Mission]:
    """Fill every form of a list once, where the scene holds what it takes."""
    forms = COMMANDS if series is Series.COMMANDS else SPATIAL
    filled = [_filled(ground, series, form, rng) for form in forms]
    return [one for one in filled if one is not None]


def _filled(ground: Ground, series: Series, form: Form, rng: np.random.Generator) -> Mission | None:
    for _ in range(_TRIES):
        parts, photos = _drawn(ground, form.parts, rng)
        if len(parts) < len(form.parts) or len({part.said for part in parts}) < len(parts):
            continue
        if not form.relation:
            made = mission(ground, series, parts, rng, photos, form.command)
            return replace(made, form=_shown(form))
        start = ground.floor.draw_start(rng, parts[0] if parts else None, APART_M)
        goals = _related(form, parts, (start.x_m, start.y_m, start.heading_rad))
        if any(goal.kind is GoalKind.SPOT and ground.floor.room_at(goal) > _ROOM_M for goal in goals):
            continue
        command = form.command
        for number, part in enumerate(parts):
            command = command.replace(f"{{{number}}}", part.said)
        pose = (start.x_m, start.y_m, start.heading_rad)
        poses = tuple(rows_of(photo) for photo in photos)
        return Mission("", series, ground.evidence.scene, pose, tuple(goals), command, poses, _shown(form))
    return None


def _shown(form: Form) -> str:
    text = form.command
    for number, part in enumerate(form.parts):
        text = text.replace(f"{{{number}}}", f"<{part}>")
    return text


def _drawn(ground: Ground, kinds: Sequence[str], rng: np.random.Generator) -> tuple[list[Goal], list[Photo]]:
    parts: list[Goal] = []
    photos: list[Photo] = []
    for kind in kinds:
        found = _SOURCES[kind](ground)
        if not found:
            continue
        goal, photo = found[int(rng.integers(len(found)))]
        if photo is not None:
            goal = renumbered(goal, len(photos))
            photos.append(photo)
        parts.append(goal)
    return parts, photos


_Found = list[tuple[Goal, Photo | None]]


def _tasks(ground: Ground, kind: TaskKind) -> _Found:
    return [(goal, _photo_of(task)) for goal, task in ground.ambiguous_things(kind) if len(goal.boxes) == 1]


def _photo_of(task: Task) -> Photo | None:
    return None if task.photo is None else Photo(task.world_from_photo, np.zeros(0))


def _alone(goals: Sequence[Goal]) -> _Found:
    return [(goal, None) for goal in goals]


_SOURCES: dict[str, Callable[[Ground], _Found]] = {
    OBJECT: lambda ground: _alone(ground.objects),
    SOUND: lambda ground: _alone([goal for _, goal in ground.sounds if len(goal.places) == 1]),
    IMAGE: lambda ground: [
        (an_image(0, camera_of(ground.photos[i])), ground.photos[i]) for i in ground.good_photos
    ],
    AREA: lambda ground: _alone(ground.areas),
    SINGLE: lambda ground: _alone(ground.single),
    BY_SOUND: lambda ground: _tasks(ground, TaskKind.NEAR_SOUND),
    BY_IMAGE: lambda ground: _tasks(ground, TaskKind.PHOTO),
    BY_AREA: lambda ground: _tasks(ground, TaskKind.AREA),
    SOUND_BY: lambda ground: [(goal, photo) for goal, photo in ground.ambiguous_sounds() if photo is None],
}  # fmt: skip


def _related(form: Form, parts: Sequence[Goal], start: tuple[float, float, float]) -> list[Goal]:
    if form.relation == "turn":
        return [Goal(GoalKind.LOOK, "a quarter to the left", "robot.turn(-90)", heading_rad=start[2] + pi / 2)]
    if form.relation == "face":
        look = replace(parts[1], kind=GoalKind.LOOK, program=f"robot.face({_argument(parts[1])})")
        return [parts[0], look]
    boxes = [_box_of(part) for part in parts]
    if form.relation == "between":
        program = f"robot.move_in_between({_argument(parts[0])}, {_argument(parts[1])})"
        return [_spot(form, parts, between(*boxes), program)]
    side = _direction(form.relation, boxes[0], start)
    skill = f"move_to_{form.relation}" if form.relation in ("left", "right") else f"move_{form.relation}"
    program = f"robot.{skill}({_argument(parts[0])}, {form.distance_m:g})"
    return [_spot(form, parts, beside(boxes[0], side, form.distance_m), program)]


def _spot(form: Form, parts: Sequence[Goal], place: tuple[float, float, float], program: str) -> Goal:
    said = f"{form.relation}: {' and '.join(part.said for part in parts)}"
    return Goal(GoalKind.SPOT, said, program, places=(place,))


def _argument(part: Goal) -> str:
    return heat_of(part)


def _box_of(part: Goal) -> Box:
    if part.boxes:
        return part.boxes[0]
    x, y, _ = part.places[0]
    return Box((x, y, 0.0), (x, y, 0.0))


def _direction(relation: str, box: Box, start: Sequence[float]) -> Float[np.ndarray, "2"]:
    if relation in _COMPASS:
        return np.array(_COMPASS[relation])
    left = left_of(box, start)
    return left if relation == "left" else -left
