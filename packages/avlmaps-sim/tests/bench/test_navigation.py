"""The navigation benchmark: figures by closed forms, goals judged rightly, missions that can be done."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.motion import Action, GroundPose, Moved
from avlmaps.language.program import parse_program
from avlmaps.language.translator import command_to_program
from avlmaps.maps.obstacles import CellState, Obstacles
from avlmaps_sim.bench.harness.evidence import Box, Event, Evidence, Photo, room_distance_m
from avlmaps_sim.bench.harness.settings import Recorded
from avlmaps_sim.bench.indexing.tasks import near_sound_tasks, photo_tasks
from avlmaps_sim.bench.navigation.commands import (
    COMMANDS,
    SPATIAL,
    command_missions,
    image_missions,
    pair_missions,
    range_of,
    sound_missions,
)
from avlmaps_sim.bench.navigation.episode_runner import Foreknowledge, WatchedBody
from avlmaps_sim.bench.navigation.episodes import (
    Episode,
    Leg,
    grouped_interval,
    in_a_row,
    independent,
    path_weight,
)
from avlmaps_sim.bench.navigation.evidence import Floor, Ground
from avlmaps_sim.bench.navigation.map_variants import CEILING, CONFIGURATIONS, OURS, configurations
from avlmaps_sim.bench.navigation.missions import (
    Goal,
    GoalKind,
    Mission,
    MissionSet,
    NavigationSettings,
    Series,
    an_object,
    beside,
    between,
    joined,
    left_of,
)
from avlmaps_sim.bench.navigation.runs import Outcome, SceneFacts
from avlmaps_sim.bench.navigation.suite import TITLE, tables
from helpers.small_home import HEARD, furnished

BOX = Box((1.0, 1.0, 0.0), (2.0, 3.0, 1.0))
metres = st.floats(-9.0, 9.0)

# Subgoals in a row, by themselves, and their paths.

reached = st.lists(st.lists(st.booleans(), min_size=4, max_size=4), min_size=1, max_size=30)


@given(reached)
def test_more_in_a_row_is_never_reached_more_often_and_never_more_often_than_by_itself(own: list[list[bool]]):
    rows = in_a_row(own, 4)
    assert rows == sorted(rows, reverse=True)
    assert rows[0] == sum(one[0] for one in own)
    for k in range(4):
        assert rows[k] <= sum(one[k] for one in own)
    hits, count = independent(own)
    assert sum(rows) <= hits
    assert count == 4 * len(own)


@given(st.floats(0.2, 50.0), st.floats(0.0, 100.0))
def test_a_perfect_way_weighs_one_and_twice_the_way_a_half(shortest_m: float, more_m: float):
    assert path_weight(True, shortest_m, shortest_m) == 1.0
    assert path_weight(True, shortest_m, 2 * shortest_m) == pytest.approx(0.5)
    assert path_weight(True, shortest_m, shortest_m + more_m) == pytest.approx(shortest_m / (shortest_m + more_m))
    assert path_weight(True, shortest_m, 0.5 * shortest_m) == 1.0  # it stopped as soon as it counts
    assert path_weight(False, shortest_m, shortest_m) == 0.0


def test_an_interval_is_wider_where_subgoals_hang_together():
    rng = np.random.default_rng(0)
    alone = [[float(v)] for v in rng.random(400) < 0.5]
    together = [[own[0]] * 4 for own in alone[:100]]
    wide, narrow = (np.ptp(grouped_interval(groups)) for groups in (together, alone))
    assert wide == pytest.approx(2 * narrow, rel=0.2)
    assert grouped_interval([]) == (0.0, 0.0)


# Whether a stop is right.


def test_a_stop_within_a_metre_counts_and_one_farther_does_not():
    goal = an_object("chair", [BOX])
    assert goal.reached(GroundPose(2.99, 2.0))
    assert not goal.reached(GroundPose(3.01, 2.0))


@given(metres, metres)
def test_a_room_is_no_distance_away_for_who_is_in_it(x: float, y: float):
    corners = np.array([[0, 0], [4, 0], [4, 2], [2, 2], [2, 4], [0, 4]], np.float64)  # an L
    inside = (0 < x < 4 and 0 < y < 2) or (0 < x < 2 and 0 < y < 4)
    rectangles = ((0, 4, 0, 2), (0, 2, 0, 4))
    away = min(np.hypot(max(a - x, x - b, 0), max(c - y, y - d, 0)) for a, b, c, d in rectangles)
    off = room_distance_m(corners, np.array([[x, y]]))[0]
    assert off == pytest.approx(0.0 if inside else away, abs=1e-9)


def test_looking_is_judged_by_the_angle_to_any_part_of_the_thing():
    look = Goal(GoalKind.LOOK, "the chair", "", (BOX,))
    assert look.reached(GroundPose(0.0, 2.0, 0.0))
    assert look.reached(GroundPose(0.0, 0.0, pi / 4))  # the box spans 27 to 72 degrees from here
    assert not look.reached(GroundPose(0.0, 0.0, np.deg2rad(5.0)))
    assert not look.reached(GroundPose(5.0, 2.0, 0.0))
    assert look.reached(GroundPose(5.0, 2.0, pi))
    turned = Goal(GoalKind.LOOK, "left", "", heading_rad=pi / 2)
    assert turned.reached(GroundPose(0, 0, pi / 2 + 0.2))
    assert not turned.reached(GroundPose(0, 0, -pi / 2))


# Spots that relations mean.


def test_between_is_the_middle_of_the_gap_and_of_what_faces():
    assert between(BOX, Box((4, 2, 0), (5, 6, 1)))[:2] == (3.0, 2.5)
    assert between(Box((0, 0, 0), (0, 0, 0)), Box((4, 2, 0), (4, 2, 0)))[:2] == (2.0, 1.0)


def test_sides_are_those_of_the_compass_and_of_the_beholder():
    assert beside(BOX, np.array([0.0, 1.0]), 0.5)[:2] == pytest.approx((1.5, 3.5))
    assert beside(BOX, np.array([-1.0, 0.0]), 0.5)[:2] == pytest.approx((0.5, 2.0))
    np.testing.assert_allclose(left_of(BOX, (1.5, -4.0)), (-1.0, 0.0), atol=1e-12)  # seen from the south, left is west
    np.testing.assert_allclose(left_of(BOX, (-4.0, 2.0)), (0.0, 1.0), atol=1e-12)  # from the west, north


# Missions.


@pytest.fixture(scope="module")
def ground() -> Ground:
    scene = furnished()
    camera = np.array([[2.0, 1.5, 1.3], [6.0, 1.5, 1.3]])
    floor = Floor.walked(scene, camera)
    events = tuple(Event(name, (x, y, 1.3)) for name, x, y in HEARD)
    seen = np.full(len(scene.objects), 100)
    evidence = Evidence("made", scene.objects, seen, scene.areas, events, (-0.4, 2.6))
    photos = tuple(photo(x, y, len(scene.objects)) for x, y in ((2.0, 1.5), (6.0, 1.5), (6.0, 4.0), (1.5, 4.2)))
    rng = np.random.default_rng(0)
    tasks = (*near_sound_tasks(evidence, rng, 20), *photo_tasks(evidence, photos, rng, 20))
    return Ground(evidence, floor, photos, tasks)


def photo(x: float, y: float, things: int) -> Photo:
    pose = np.eye(4)
    pose[:3, 3] = (x, y, 1.3)
    return Photo(pose, np.full(things, 0.1))


def test_the_shortest_way_goes_through_the_door_and_ends_beside_the_thing(ground: Ground):
    goal = an_object("tv", [Box((7.25, 2.75, 0), (7.75, 3.25, 0.9))])
    # From (2, 1.5) round the end of the wall at (4, 5), the robot 0.2 m clear of it, to 0.2 m before the television.
    corner = np.array([4.0, 5.25])
    best = np.linalg.norm(corner - (2.0, 1.5)) + np.linalg.norm(corner - (7.0, 3.1))
    shortest = ground.floor.shortest_m(goal, np.array([2.0, 1.5]))
    assert best - 0.4 < shortest < 1.12 * best
    assert ground.floor.reachable(goal)


def test_what_lies_behind_walls_is_not_reachable_and_has_no_way(ground: Ground):
    outside = Goal(GoalKind.SOUND, "", "", places=((12.0, 3.0, 1.0),))
    assert not ground.floor.reachable(outside)
    assert ground.floor.room_at(outside) > 3.9
    assert ground.floor.reachable(Goal(GoalKind.LOOK, "", "", heading_rad=0.0))


def test_sounds_come_by_range_four_different_ones_in_a_row(ground: Ground):
    for series, allowed in ((Series.SOUNDS_1, 1), (Series.SOUNDS_2, 2), (Series.SOUNDS_3, 3)):
        made = sound_missions(ground, series, np.random.default_rng(1), 30)
        assert len(made) == 30
        asked = {goal.said for one in made for goal in one.goals}
        assert asked == {f"the sound of {name}" for name, _, _ in HEARD if range_of(name) <= allowed}
        assert all(len({goal.said for goal in one.goals}) == 4 for one in made)
    (twice,) = [goal for name, goal in ground.sounds if name == "doorbell"]
    assert len(twice.places) == 2


def test_every_mission_starts_where_a_robot_can_stand_away_from_its_first_goal(ground: Ground):
    rng = np.random.default_rng(2)
    made = [*sound_missions(ground, Series.SOUNDS_3, rng, 20), *image_missions(ground, rng, 20)]
    for one in made:
        xy = np.array([one.start[:2]])
        assert ground.floor.space.is_free(xy)[0]
        assert one.goals[0].off_m(xy)[0] >= 2.0
        assert all(ground.floor.reachable(goal) for goal in one.goals)


def test_images_come_before_two_different_things(ground: Ground):
    made = image_missions(ground, np.random.default_rng(0), 12)
    for one in made:
        assert [goal.kind for goal in one.goals] == [GoalKind.IMAGE, GoalKind.OBJECT, GoalKind.OBJECT]
        assert one.goals[1].said != one.goals[2].said
        np.testing.assert_allclose(one.goals[0].places[0], one.world_from_photos[0][:3, 3])


def test_pairs_are_ambiguous_in_both_and_none_comes_twice(ground: Ground):
    made = pair_missions(ground, np.random.default_rng(0), 40)
    assert made
    assert len({(one.goals, one.photos) for one in made}) == len(made)
    for one in made:
        sound, thing = one.goals
        name = sound.said.removeprefix("the sound of ").split(" near ")[0]
        assert len([event for event in HEARD if event[0] == name]) == 2
        assert len(sound.places) == len(thing.boxes) == 1
        assert sound.context in ("object", "image")
        assert thing.context == "sound"
        assert len(one.photos) == (sound.context == "image")


def test_the_same_seed_makes_the_same_missions_and_another_draws_others(ground: Ground):
    drawn = [sound_missions(ground, Series.SOUNDS_3, np.random.default_rng(seed), 5) for seed in (0, 0, 1)]
    assert drawn[0] == drawn[1] != drawn[2]


def test_the_lists_have_twenty_commands_and_ten_spatial_goals_that_scenes_can_fill(ground: Ground):
    assert (len(COMMANDS), len(SPATIAL)) == (20, 10)
    commands = command_missions(ground, Series.COMMANDS, np.random.default_rng(0))
    assert len(commands) >= 15
    for one in (*commands, *command_missions(ground, Series.SPATIAL, np.random.default_rng(0))):
        for goal in one.goals:
            assert ground.floor.reachable(goal)
            assert goal.kind is not GoalKind.SPOT or ground.floor.room_at(goal) <= 0.5


# Language: what is said is what is meant.


def names_of(program: str) -> str:
    """A program with its heatmaps written where they are used, one movement a line."""
    values: dict[str, str] = {}
    lines: list[str] = []
    for line in program.strip().splitlines():
        name, is_value, value = line.partition(" = ")
        for known, text in values.items():
            value, line = value.replace(known, text), line.replace(known, text)
        if is_value and name.isidentifier():
            values[name] = value
        else:
            lines.append(line.replace(" ", "").replace(",0.5)", ")").replace("move_to(robot.get_max_pos_3d", "go"))
    return "\n".join(lines)


def test_every_sentence_is_translated_into_the_program_that_is_meant(ground: Ground):
    rng = np.random.default_rng(3)
    made = [
        *sound_missions(ground, Series.SOUNDS_3, rng, 10),
        *image_missions(ground, rng, 10),
        *pair_missions(ground, rng, 10),
        *command_missions(ground, Series.COMMANDS, rng),
        *command_missions(ground, Series.SPATIAL, rng),
    ]
    files = ("./0123456789ab.png", "./ba9876543210.png")
    for one in made:
        parse_program(one.program(files))
        assert names_of(command_to_program(one.sentence(files))) == names_of(one.program(files)), one.sentence()


def test_a_command_names_all_goals_in_order_or_one_alone():
    said = ["the chair", "the table", "the tv"]
    goals = tuple(an_object(name.removeprefix("the "), [BOX]) for name in said)
    one = Mission("m", Series.COMMANDS, "made", (0, 0, 0), goals, "First {0}, then {1}, last {2}.")
    assert one.sentence() == "First the chair, then the table, last the tv."
    assert one.sentence(only=2) == "Go to the tv."
    assert replace(one, command="").sentence() == joined(said)
    assert joined(said) == "First go to the chair, then go to the table, and then go to the tv."
    assert one.program(only=1) == 'robot.move_to_object("table")'


# Files.


def leg(reached: bool, kind: GoalKind = GoalKind.SOUND, path_m: float = 4.0, reachable: bool = True) -> Leg:
    return Leg("x", kind, (0, 0, 0), 0.5, reached, reachable, 4.0, path_m, 40, 0)


def episode(name: str, series: Series, configuration: str, legs: list[Leg], foretold: int = 0) -> Episode:
    return Episode(name, series, "made", configuration, 0, ("go",), ("p",), tuple(legs), 2, foretold, True, name)


# Tables.


def outcome(episodes: list[Episode], series: tuple[Series, ...]) -> Outcome:
    goal = an_object("chair", [BOX])
    missions = tuple(
        Mission(name, kind, "made", (0, 0, 0), (goal,), form="Go to <x>.")
        for name, kind in dict.fromkeys((one.mission, one.series) for one in episodes)
    )
    recorded = Recorded("overlay", 40, 4, 1, "clean", "", 0)
    settings = NavigationSettings(scenes=("made",), series=series, sequences=2)
    facts = SceneFacts("made", 40, 1000, (3, 4), tuple(episodes))
    return Outcome(settings, MissionSet(recorded, ("made",), 0.2, missions), (facts,))


def test_a_table_of_hand_made_runs_holds_their_figures():
    first = [leg(True), leg(True), leg(False), leg(True, path_m=8.0)]
    episodes = [
        episode("a", Series.SOUNDS_3, OURS, first, foretold=1),
        episode("b", Series.SOUNDS_3, OURS, [leg(True)] * 4),
        episode("a", Series.SOUNDS_3, CEILING, [leg(True)] * 4),
        episode("b", Series.SOUNDS_3, CEILING, [leg(True)] * 3 + [leg(False, reachable=False)]),
    ]
    made = tables(outcome(episodes, (Series.SOUNDS_3,)))
    table = made[TITLE[Series.SOUNDS_3]]
    rows = {row[0]: dict(zip(table["columns"], row, strict=True)) for row in table["rows"]}
    ours = rows[OURS]
    assert [ours[f"{k} in a row %"] for k in (1, 2, 3, 4)] == [100.0, 100.0, 50.0, 50.0]
    assert (ours["sequences"], ours["subgoals %"], ours["SPL"]) == (2, 87.5, round(6.5 / 8, 3))
    assert (ours["path m"], ours["actions"], ours["contacts"], ours["foretold"]) == (4.5, 40.0, 4, 1)
    assert rows["weaker sound encoder"]["sequences"] == 0
    (paper,) = [row for name, row in rows.items() if "paper" in name]
    assert [paper["4 in a row %"], paper["subgoals %"]] == [33.0, 77.5]
    figures = {row[0]: row for row in made["All experiments"]["rows"]}
    assert figures["true perception: reachable subgoals that were reached, %"][1:] == [100.0, "100.0 to 100.0", 7]
    assert figures["contacts that the map could have foretold"][1] == 1


def test_the_pairs_table_holds_every_row_of_the_papers():
    made = tables(outcome([], (Series.PAIRS,)))[TITLE[Series.PAIRS]]
    rows = {row[0]: dict(zip(made["columns"], row, strict=True)) for row in made["rows"]}
    paper = {name.partition(", paper")[0]: row for name, row in rows.items() if "paper" in name}
    assert paper["AudioCLIP"]["sound %"] == 16.9
    assert paper["VLMaps"]["object %"] == 27.1
    assert paper["VLMaps + wav2clip"]["2 in a row %"] == 12.7
    assert paper["VLMaps + AudioCLIP (AVLMaps)"]["1 in a row %"] == 46.2
    assert {"objects only", "sounds only", "weaker sound encoder", OURS, CEILING} <= rows.keys()


def test_every_series_has_ours_and_a_ceiling_and_the_experiments_of_the_paper_a_baseline():
    for series in Series:
        names = [one.name for one in configurations(series)]
        assert {OURS, CEILING} <= set(names)
        assert len(names) == len(set(names))
    weaker = {series for one in CONFIGURATIONS if one.name == "weaker sound encoder" for series in one.series}
    assert weaker >= {Series.PAIRS}


# What was touched, and whether the map had told.


class _Wall:
    """A body that cannot pass x = 1.85, whatever the map says."""

    def __init__(self, x_m: float) -> None:
        self.pose = GroundPose(x_m, 1.0, 0.0)

    def act(self, action: Action) -> Moved:
        ahead = self.pose.ahead(0.1)
        if action is Action.FORWARD and ahead.x_m > 1.85:
            return Moved(self.pose, True)
        self.pose = ahead if action is Action.FORWARD else self.pose
        return Moved(self.pose)


@pytest.mark.parametrize(("wall_x_m", "told"), [(2.05, 1), (2.5, 0), (None, 0)])
def test_a_touch_is_foretold_where_the_map_shows_something_within_the_radius(wall_x_m: float | None, told: int):
    states = np.full((60, 40), CellState.FREE, np.uint8)
    if wall_x_m is not None:
        states[int(wall_x_m / 0.05), :] = CellState.OCCUPIED
    obstacles = Obstacles(np.eye(3), np.zeros(2), 0.05, 0.0, states)
    body = WatchedBody(_Wall(1.6), Foreknowledge(obstacles, 0.2))
    for _ in range(3):
        body.act(Action.FORWARD)
    assert body.pose.x_m == pytest.approx(1.8)
    assert (body.contacts, body.foretold) == (1, told)
    body.act(Action.LEFT)
    assert body.contacts == 1


@given(st.floats(-0.5, 2.5), st.floats(-0.5, 2.5), st.integers(0, 1_000))
def test_room_is_the_distance_to_the_nearest_occupied_cell(x: float, y: float, seed: int):
    rng = np.random.default_rng(seed)
    states = np.where(rng.random((20, 16)) < 0.05, CellState.OCCUPIED, CellState.FREE).astype(np.uint8)
    obstacles = Obstacles(np.eye(3), np.array([0.3, -0.1]), 0.1, 0.0, states)
    low = np.argwhere(states == CellState.OCCUPIED) * 0.1 + (0.3, -0.1)
    at = np.array([x, y])
    apart = np.linalg.norm(np.maximum(np.maximum(low - at, at - low - 0.1), 0.0), axis=1).min(initial=np.inf)
    room = Foreknowledge(obstacles, 0.25).room_m((x, y))
    assert room == pytest.approx(apart, abs=1e-9) if apart < 0.25 - 1e-9 else room >= 0.25 - 1e-9
