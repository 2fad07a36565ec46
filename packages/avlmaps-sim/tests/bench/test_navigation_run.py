"""Robots are sent through a small home: what is told again, what is judged, what a second run does not do again."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from avlmaps.core.errors import LanguageError, QueryError
from avlmaps.core.motion import Action, GroundPose
from avlmaps.language.translator import LearnedTranslator, Translation
from avlmaps.maps.grid import GridSpec
from avlmaps.navigate.driver import Arrival
from avlmaps.perception.encoders import Encoders
from avlmaps.query.avlmap import AVLMap
from avlmaps_sim.bench.harness.evidence import Box
from avlmaps_sim.bench.harness.workplace import TrueVoxels
from avlmaps_sim.bench.navigation.episode_runner import Pilot
from avlmaps_sim.bench.navigation.episodes import Episode
from avlmaps_sim.bench.navigation.evidence import Floor
from avlmaps_sim.bench.navigation.map_variants import (
    CEILING,
    Configuration,
    KnownScene,
    Perceived,
    Senses,
    configurations,
)
from avlmaps_sim.bench.navigation.missions import (
    Goal,
    GoalKind,
    Mission,
    NavigationSettings,
    Series,
    a_sound,
    an_object,
    near_sound,
)
from avlmaps_sim.bench.navigation.runs import run
from avlmaps_sim.bench.navigation.suite import run_navigation, tables
from avlmaps_sim.truth import HeardEvent, Truth
from helpers.small_home import HEARD, furnished

GRID = GridSpec(0.05)
TRUE = Configuration(CEILING, Senses("true", "true", "true", "true"), tuple(Series))
DEAF = Configuration("objects only", Senses("true", "none", "none", "none"), tuple(Series))


class _Leaping:
    """A driver that is at once at the free place nearest to where it is sent."""

    contacts = 1
    foretold = 0

    def __init__(self, floor: Floor, pose: GroundPose) -> None:
        self._floor, self.pose = floor, pose

    def go_to(self, place: np.ndarray, *, face: np.ndarray | None = None) -> Arrival:
        before = self.pose
        x, y = self._floor.space.nearest(np.asarray(place)[:2])
        self.pose = GroundPose(float(x), float(y), before.heading_rad)
        path = np.array([[before.x_m, before.y_m], [x, y]])
        return Arrival(True, self.pose, (Action.FORWARD, Action.STOP), path)

    def turn(self, angle_rad: float) -> Arrival:
        self.pose = self.pose.turned(angle_rad)
        return Arrival(True, self.pose, (Action.LEFT,), np.array([[self.pose.x_m, self.pose.y_m]]))

    def forward(self, distance_m: float) -> Arrival:
        return self.go_to(np.array([self.pose.ahead(distance_m).x_m, self.pose.ahead(distance_m).y_m, 0.0]))

    def stop(self) -> Arrival:
        return Arrival(True, self.pose, (Action.STOP,), np.array([[self.pose.x_m, self.pose.y_m]]))


@pytest.fixture(scope="module")
def known() -> KnownScene:
    """The small home, its map holding exactly the voxels of its surfaces."""
    scene = furnished()
    voxels = TrueVoxels.of(scene, GRID)
    index = np.stack([(voxels.key >> shift) & 0x1FFFFF for shift in (42, 21, 0)], axis=1) - (1 << 20)
    up = np.array([0.0, 0.0, 1.0])
    voxels_seen = SimpleNamespace(index=index, hits=np.full(len(index), 9))
    keyframes = SimpleNamespace(world_from_camera=np.eye(4)[None])
    data = SimpleNamespace(grid=GRID, voxels=voxels_seen, keyframes=keyframes, up_in_world=up)
    events = tuple(
        HeardEvent(float(i), i + 1.0, name, "", (x, y, 1.3), (x, y, 1.3), -1) for i, (name, x, y) in enumerate(HEARD)
    )
    truth = Truth({}, events, scene.objects, scene.areas)
    pose = np.eye(4)
    pose[:3, 3] = (6.0, 4.0, 1.3)
    asked = AVLMap(data, Encoders(), path=Path("home.avlmap"))  # pyright: ignore[reportArgumentType]
    return KnownScene(asked, truth, voxels.label(index), "overlay", {"one.png": pose}, _nobody)


def _nobody():
    raise AssertionError("no weaker ear is needed")


@pytest.fixture(scope="module")
def floor() -> Floor:
    return Floor.walked(furnished(), np.array([[2.0, 1.5, 1.3], [6.0, 1.5, 1.3]]))


def pilot(known: KnownScene, floor: Floor, translator: object = None) -> Pilot:
    def launch(pose: GroundPose):
        driver = _Leaping(floor, pose)
        return driver, driver

    return Pilot(known, floor, launch, translator, Path(), lambda mission: ())  # pyright: ignore[reportArgumentType]


def chair(x: float) -> Box:
    return Box((x - 0.25, 0.25, 0.0), (x + 0.25, 0.75, 0.9))


SNORING = a_sound("snoring", [(1.5, 1.0, 1.3)])
LAUGHING = a_sound("laughing", [(6.0, 5.0, 1.3)])
TABLE = an_object("table", [Box((1.75, 2.75, 0.0), (2.25, 3.25, 0.9))])
FAR_CHAIR = near_sound("chair", "toilet flush", [chair(7.5)])


def mission(*goals: Goal) -> Mission:
    return Mission("m", Series.SOUNDS_3, "made", (2.0, 1.5, 0.0), goals)


@pytest.mark.parametrize("translator", [None, LearnedTranslator()])
def test_with_true_senses_every_goal_of_one_command_is_reached(known: KnownScene, floor: Floor, translator: object):
    done = pilot(known, floor, translator).run(mission(SNORING, TABLE, FAR_CHAIR, LAUGHING), TRUE)
    assert done.reached == [True] * 4
    assert (len(done.commands), len(done.programs), done.understood) == (1, 1, True)
    assert [leg.actions for leg in done.legs] == [2] * 4
    first = done.legs[0]
    assert first.off_m == pytest.approx(0.0, abs=0.06)
    assert first.path_m == pytest.approx(np.hypot(0.5, 0.5), abs=0.1)
    assert first.shortest_m == pytest.approx(first.path_m, rel=0.1)
    assert done.contacts == 1


def test_a_goal_that_a_sense_lacks_is_failed_and_what_is_left_is_told_one_by_one(known: KnownScene, floor: Floor):
    done = pilot(known, floor, LearnedTranslator()).run(mission(TABLE, SNORING, TABLE, LAUGHING), DEAF)
    assert done.reached == [True, False, True, False], [leg.note for leg in done.legs]
    assert [leg.stop is None for leg in done.legs] == [False, True, False, True]
    assert done.commands[0].startswith("First go to the table, then go to the sound of snoring, then")
    assert "Go to the sound of snoring." in done.commands[1:]
    assert ["snoring" in leg.note or "laughing" in leg.note for leg in done.legs] == [False, True, False, True]


def test_a_command_that_is_not_understood_fails_all_its_goals(known: KnownScene, floor: Floor):
    class Deaf:
        name = "deaf"

        def program_for(self, command: str) -> Translation:
            raise LanguageError("Nothing was understood.")

    done = pilot(known, floor, Deaf()).run(mission(TABLE, SNORING), TRUE)
    assert done.reached == [False, False]
    assert not done.understood
    assert {leg.note for leg in done.legs} == {"Nothing was understood."}


def test_a_program_that_goes_to_too_few_places_fails_the_others(known: KnownScene, floor: Floor):
    class Short:
        name = "short"

        def program_for(self, command: str) -> Translation:
            return Translation(f"{TABLE.program}\nrobot.turn(90)")

    done = pilot(known, floor, Short()).run(mission(TABLE, SNORING), TRUE)
    assert done.reached == [True, False]
    assert done.legs[1].note == "The program ends before it."


def test_turns_are_judged_for_goals_to_look_and_places_for_places(known: KnownScene, floor: Floor):
    look = Goal(GoalKind.LOOK, "left", "robot.turn(-90)", heading_rad=np.pi / 2)
    done = pilot(known, floor).run(mission(TABLE, look, SNORING), TRUE)
    assert done.reached == [True, True, True]
    assert done.legs[1].off_m is None
    assert done.legs[1].weight == 1.0


# The senses.


def test_without_a_sense_all_places_are_as_near_to_a_mark_and_nothing_is_where_it_is_sought(known: KnownScene):
    deaf = Perceived(known, DEAF.senses)
    assert (deaf.sound("snoring").values == 1.0).all()
    with pytest.raises(QueryError, match="snoring"):
        deaf.sound("snoring", primary=True)
    alone = deaf.object("chair", primary=True)
    near = alone * deaf.sound("snoring")
    np.testing.assert_array_equal(near.values, alone.values)


def test_true_senses_put_sounds_photos_and_things_where_they_are(known: KnownScene):
    true = Perceived(known, TRUE.senses)
    places = sorted(goal.position[:2] for goal in true.sound("doorbell", primary=True).goals(5))
    assert places == [(1.2, 2.2), (6.5, 1.0)]
    assert true.image("some/where/one.png", primary=True).goals(1)[0].position == (6.0, 4.0, 1.3)
    (right,) = (true.object("chair", primary=True) * true.sound("toilet flush")).goals(1)
    assert chair(7.5).distance_m(right.position) < 0.06
    assert not true.object("piano", primary=True).found
    assert true.area("kitchen", primary=True).goals(1)
    assert not true.area("cellar", primary=True).found


# A whole run.


def small_settings(**changes: object) -> NavigationSettings:
    plain = NavigationSettings(
        scenes=("small",), series=(Series.IMAGES, Series.COMMANDS, Series.SPATIAL), profile="colours", frames=40,
        sources=3, ambiguous=0, sequences=1, jobs=1,
    )  # fmt: skip
    return replace(plain, **changes)  # pyright: ignore[reportArgumentType]


def opener(opened: list[str]) -> Callable[[str], object]:
    def open_spec(spec: str):
        opened.append(spec)
        return furnished()

    return open_spec


def shown(episodes: list[Episode]) -> list[tuple[object, ...]]:
    return [(e.mission, e.configuration, e.commands, e.legs) for e in episodes]


@pytest.mark.nightly
def test_a_run_that_was_broken_off_goes_on_and_ends_with_the_same_tables(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr("avlmaps_sim.bench.navigation.runs._PHOTOS", 30)  # enough for one sequence
    first = run(small_settings(), tmp_path, opener([]))  # pyright: ignore[reportArgumentType]
    true = [leg for e in first.episodes if e.configuration == CEILING for leg in e.legs if leg.reachable]
    assert len(true) >= 10
    lost = [(leg.said, leg.off_m, leg.note) for leg in true if not leg.reached]
    assert len(lost) <= 0.4 * len(true), lost  # a map of few frames does not know all of the floor
    assert all(episode.understood for episode in first.episodes)
    assert sum(episode.foretold for episode in first.episodes) == 0
    sequences = [one for one in first.missions.missions if one.series is Series.IMAGES]
    assert len(sequences) == 1
    asked = {one.name for one in configurations(Series.IMAGES)}
    assert {e.configuration for e in first.episodes if e.mission == sequences[0].name} == asked
    (journal,) = (tmp_path / "episodes").iterdir()
    lines = journal.read_bytes().splitlines(keepends=True)
    journal.write_bytes(b"".join(lines[:-3]) + lines[-3][:100])
    opened: list[str] = []
    answer = run_navigation_with(small_settings(), tmp_path, opener(opened))
    assert opened == ["small"]
    again = run(small_settings(), tmp_path, opener([]))  # pyright: ignore[reportArgumentType]
    assert shown(again.episodes) == shown(first.episodes)
    assert answer["tables"] == tables(first) == tables(again)
    assert {path.name for path in tmp_path.iterdir()} >= {"navigation.json", "navigation.md"}


def run_navigation_with(settings: NavigationSettings, out: Path, open_spec: Callable[[str], object]) -> dict:
    """Run the suite as the command line does, in a scene of ours."""
    from avlmaps_sim.bench.navigation import suite

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(suite, "run", lambda asked, where: run(asked, where, open_spec))  # pyright: ignore[reportArgumentType]
        return run_navigation(settings, out)
