"""The rules by which sequences of goals are made of a scene: the paper's Tables I, II and VI.

Sounds come from three ranges, each wider than the one before, as in Table I.
"""

from collections.abc import Sequence

import numpy as np

from avlmaps_sim.bench.harness.evidence import Photo
from avlmaps_sim.bench.indexing.tasks import TaskKind
from avlmaps_sim.bench.navigation.evidence import Ground, camera_of, renumbered
from avlmaps_sim.bench.navigation.missions import Goal, Mission, Row, Series
from avlmaps_sim.bench.navigation.phrases import an_image
from avlmaps_sim.hearing.kinds import kind_of

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
