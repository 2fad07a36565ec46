"""Which chair is meant, where it is and what it covers, asked of a map; which files a program may read."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.errors import GoalNotFoundError, ProgramError, QueryError, SeveralFitError
from avlmaps.core.motion import GroundPose
from avlmaps.core.question import Modality, Part, Question
from avlmaps.language.program import parse_program, run_program
from avlmaps.language.program.vocabulary import Picture, Place
from avlmaps.maps.grid import GridSpec
from avlmaps.navigate.file_access import Readable, named_files, offered_by
from avlmaps.navigate.footprint import Outline, middle_between
from avlmaps.navigate.grounding import Destination, fit_equally, nearest
from avlmaps.navigate.skills import Robot, RobotSettings
from avlmaps.query.voxel_space import Space
from helpers.kinematic import KinematicDriver
from query.query_fakes import FakeViews, furnished_map, keyframes_at, sounds_of

BIG_CHAIR, SMALL_CHAIR = (0.6, 0.6), (5.1, 3.1)


def track(x: float, y: float) -> np.ndarray:
    return np.stack([np.linspace(x, x + 0.2, 5), np.full(5, y), np.full(5, 1.2)], axis=1)


def furnished_robot(x: float = 3.0, y: float = 2.0, settings: RobotSettings | None = None, **parts: object) -> Robot:
    return Robot(furnished_map(**parts), KinematicDriver(GroundPose(x, y)), settings)


def xy(place: Place) -> tuple[float, float]:
    return place.x, place.y


@pytest.mark.parametrize(
    ("settings", "best", "nearest"),
    [
        (RobotSettings(choose=(1,)), BIG_CHAIR, BIG_CHAIR),
        (RobotSettings(choose=(2,)), SMALL_CHAIR, SMALL_CHAIR),
        (RobotSettings(guess=True), BIG_CHAIR, SMALL_CHAIR),
        (RobotSettings(persist=True), BIG_CHAIR, SMALL_CHAIR),
    ],
)
def test_of_things_that_fit_equally_the_chosen_one_is_meant(
    settings: RobotSettings, best: tuple[float, float], nearest: tuple[float, float]
) -> None:
    robot = furnished_robot(4.8, 2.6, settings)
    assert xy(robot.get_pos("chair")) == pytest.approx(nearest, abs=0.06)
    robot.move_to("chair")
    assert robot.moves[-1].goal[:2] == pytest.approx(best, abs=0.06)
    robot = furnished_robot(4.8, 2.6, settings)
    robot.move_to_object("chair")
    assert np.allclose(robot.moves[-1].goal[:2], nearest, atol=0.6)


def test_of_things_that_fit_equally_none_is_driven_to_until_one_is_chosen() -> None:
    robot = furnished_robot(4.8, 2.6)
    for skill in (robot.get_pos, robot.move_to, robot.move_to_object, robot.move_north, robot.get_contour):
        with pytest.raises(SeveralFitError) as asked:
            skill("chair")
        assert len(asked.value.choices) == 2 and not robot.moves
    with pytest.raises(SeveralFitError):
        furnished_robot(settings=RobotSettings(choose=(3,))).move_to("chair")
    chair = robot.get_nearest_pos("chair")
    robot.move_east(chair, 0.5)
    assert robot.moves[-1].goal[:2] == pytest.approx((SMALL_CHAIR[0] + 0.6, SMALL_CHAIR[1]), abs=0.03)


def test_a_heatmap_of_two_parts_says_which_one_is_meant_wherever_the_robot_is() -> None:
    robot = furnished_robot(0.3, 0.3, sounds=sounds_of([track(5.0, 3.1)], [0.9]))
    heat = robot.get_major_map(obj="chair") * robot.get_map(sound="dog")
    assert xy(robot.get_max_pos_3d(heat)) == pytest.approx(SMALL_CHAIR, abs=0.15)
    robot.move_to_object(heat)
    assert robot.moves[-1].stop[:2] == pytest.approx((5.0, 3.0), abs=0.03)
    assert robot.moves[-1].name == "'chair' near 'dog'"


def test_the_outline_goes_round_the_thing_counter_clockwise_on_the_floor() -> None:
    contour = furnished_robot().get_contour("table")
    corners = np.array([xy(place) for place in contour])
    assert np.ptp(corners, axis=0) == pytest.approx((0.8, 0.8), abs=0.03)
    x, y = corners.T
    assert 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) == pytest.approx(0.64, abs=0.05)
    assert {round(place.z, 3) for place in contour} == {0.025}


def test_the_place_where_the_robot_stands_can_be_kept_and_come_back_to() -> None:
    robot = furnished_robot(3.0, 2.0)
    home = robot.current_pos()
    robot.move_to("table")
    robot.move_to(home)
    assert robot.moves[-1].stop == pytest.approx((3.0, 2.0, 0.025))
    with pytest.raises(GoalNotFoundError, match="no outline of that place to go round"):
        robot.get_contour(home)


def test_between_two_of_a_kind_takes_two_and_never_one_twice() -> None:
    robot = furnished_robot()
    robot.move_in_between("chair", "chair")
    assert robot.moves[-1].goal[:2] == pytest.approx((2.85, 1.85), abs=0.05)
    robot.move_in_between("table", Place(3.0, 0.9, 0.0))
    assert robot.moves[-1].goal[:2] == pytest.approx((2.4, 0.9), abs=0.03)
    with pytest.raises(GoalNotFoundError, match="There is only one 'table' in the map"):
        robot.move_in_between("table", "table")


def test_a_map_that_is_tilted_is_driven_on_its_level_ground() -> None:
    stored = furnished_map()
    stored.data.up_in_world = np.array([0.0, -1.0, 0.0])  # a camera's world: y down
    robot = Robot(stored, KinematicDriver(GroundPose(0.0, 0.0), stored.space.level_from_world))
    place = robot.get_pos("table")
    level = stored.space.level(np.array([place.x, place.y, place.z]))
    robot.move_to("table")
    assert (robot.driver.pose.x_m, robot.driver.pose.y_m) == pytest.approx(level[:2])
    assert robot.moves[-1].goal == pytest.approx((place.x, place.y, place.z))
    assert robot.moves[-1].distance_m == pytest.approx(0.0, abs=1e-6)
    robot.move_north("table", 0.5)
    level_goal = stored.space.level(np.array(robot.moves[-1].goal))
    assert level_goal[1] > level[1] + 0.5


def test_what_is_not_there_is_told_in_one_sentence_with_what_to_do() -> None:
    robot = furnished_robot(sounds=sounds_of([track(5.0, 3.1)], [0.2]))
    with pytest.raises(GoalNotFoundError, match=r"'dog' is not found in the map: sound 'dog': none of the 1 detected"):
        robot.move_to(robot.get_major_map(sound="dog"))
    said = r"probability 0\.[0-4]\d?; say it in other words, or .* best guess \(guess=True\)\.$"
    with pytest.raises(GoalNotFoundError, match=said):
        robot.move_to(robot.get_major_map(obj="chair") * robot.get_map(sound="dog"))
    assert robot.moves == []


HEEDFUL = (
    "move_to", "move_to_object", "move_in_between", "move_to_left", "move_behind", "move_north", "face",
    "with_object_on_left", "get_pos", "get_nearest_pos", "get_max_pos_3d", "get_contour",
)  # fmt: skip


@pytest.mark.few(12)
@pytest.mark.parametrize("skill", HEEDFUL)
@pytest.mark.parametrize("score", [0.05, 0.15, 0.95])
def test_no_skill_takes_what_the_answer_calls_not_found(skill: str, score: float) -> None:
    robot = furnished_robot(sounds=sounds_of([track(5.0, 3.1)], [score]))
    answer = robot.avlmap.ask(Question.of([Part(Modality.OBJECT, "chair"), Part(Modality.SOUND, "dog")]))
    heat = robot.get_major_map(obj="chair") * robot.get_map(sound="dog")
    given = (heat, "table") if skill == "move_in_between" else (heat,)
    if answer.found:
        getattr(robot, skill)(*given)
    else:
        with pytest.raises(GoalNotFoundError, match=rf"probability {answer.probability:.2f}; .* best guess"):
            getattr(robot, skill)(*given)
        assert robot.moves == []
    assert answer.found == (score > 0.9)


@pytest.mark.parametrize(("score", "there"), [(0.05, False), (0.95, True)])
def test_a_program_can_ask_whether_something_is_there(score: float, there: bool) -> None:
    robot = furnished_robot(sounds=sounds_of([track(5.0, 3.1)], [score]))
    heat = robot.get_major_map(obj="chair") * robot.get_map(sound="dog")
    assert robot.exists(heat) is there and bool(robot.get_all_pos(heat)) is there
    asks = "if robot.exists(h):\n    turn(90)\nelse:\n    turn(-90)\n"
    trace = run_program(parse_program(f"h = get_major_map(obj='chair') * get_map(sound='dog')\n{asks}"), robot)
    assert trace.ok and trace.steps[-1].arguments == {"angle_deg": 90 if there else -90}


@pytest.mark.parametrize("order", ["nearest", "farthest", "left", "right", "north", "south", "east", "west"])
def test_things_are_counted_in_an_order(order: str) -> None:
    robot = furnished_robot()
    every = [xy(place) for place in robot.get_all_pos("chair")]
    counted = [xy(robot.get_nth_pos("chair", number, order)) for number in range(1, len(every) + 1)]
    assert sorted(counted) == sorted(every) and len(every) > 1
    x, y = np.array(counted).T
    ahead = np.mean(counted, axis=0) - (3.0, 2.0)
    keys = {
        "left": ahead[1] * x - ahead[0] * y, "right": ahead[0] * y - ahead[1] * x, "north": -y, "south": y, "east": -x,
        "west": x,
    }  # fmt: skip
    wanted = {"nearest": every, "farthest": every[::-1]}
    assert counted == wanted[order] if order in wanted else (np.diff(keys[order]) >= 0.0).all()


def test_a_thing_that_there_are_too_few_of_is_not_found() -> None:
    with pytest.raises(GoalNotFoundError, match="number 9 is not found"):
        furnished_robot().get_nth_pos("chair", 9)
    with pytest.raises(ProgramError, match="counts from nearest"):
        furnished_robot().get_nth_pos("chair", 1, "prettiest")


def test_the_best_guess_is_gone_to_only_when_that_is_asked_for() -> None:
    sounds = sounds_of([track(5.0, 3.1)], [0.3])
    robot = furnished_robot(settings=RobotSettings(guess=True), sounds=sounds)
    robot.move_to(robot.get_major_map(sound="dog"))
    assert robot.moves[-1].goal[:2] == pytest.approx((5.1, 3.1), abs=0.15)
    assert any("probability of 'dog' is" in note for note in robot.seeker.notes)


def test_a_map_without_sources_has_the_robots_place_and_says_so() -> None:
    robot = furnished_robot(sounds=sounds_of([track(5.0, 3.1)], [0.9]))
    robot.move_to(robot.get_major_map(sound="dog", at="source"))
    assert robot.moves[-1].name == "'dog'" and robot.moves[-1].goal[:2] == pytest.approx((5.1, 3.1), abs=0.15)
    (note,) = robot.seeker.notes
    assert note.startswith("The place is where the robot was when it heard it: ") and "microphones" in note
    plain = furnished_robot(sounds=sounds_of([track(5.0, 3.1)], [0.9]))
    plain.move_to(plain.get_major_map(sound="dog"))
    assert plain.moves[-1].goal == robot.moves[-1].goal and plain.seeker.notes == []


def test_a_program_names_a_place_that_a_sound_has() -> None:
    robot = furnished_robot(sounds=sounds_of([track(5.0, 3.1)], [0.9]))
    with pytest.raises(ProgramError, match="'kitchen'"):
        robot.get_map(sound="dog", at="kitchen")
    with pytest.raises(ProgramError, match="with a sound"):
        robot.get_map(obj="chair", at="source")


def test_a_guess_leaves_out_what_is_nowhere_near() -> None:
    robot = furnished_robot(settings=RobotSettings(guess=True), sounds=sounds_of([track(60.0, 60.0)], [0.9]))
    robot.move_to(robot.get_major_map(obj="chair") * robot.get_map(sound="dog"))
    assert robot.moves[-1].goal[:2] == pytest.approx(BIG_CHAIR, abs=0.06)
    assert any("this is the best guess" in note for note in robot.seeker.notes)


def test_things_that_are_never_together_are_told_apart_from_things_that_are_missing() -> None:
    views = np.array([[1.0, 0.0]], np.float32)
    robot = furnished_robot(views=FakeViews(), keyframes=keyframes_at(np.array([[60.0, 60.0, 1.2]]), views))
    heat = robot.get_major_map(obj="chair") * robot.get_map(area="kitchen")
    for target in (heat, robot.get_major_map(obj="kitchen chair"), "kitchen chair"):
        with pytest.raises(GoalNotFoundError, match=r"'chair' near 'kitchen' .*do not come together anywhere"):
            robot.move_to(target)


def test_exactly_one_thing_is_asked_for_at_a_time() -> None:
    robot = furnished_robot()
    with pytest.raises(ProgramError, match="exactly one of obj, sound, img and area; it was given obj and sound"):
        robot.get_map(obj="chair", sound="dog")
    with pytest.raises(ProgramError, match="it was given none of them"):
        robot.get_major_map()
    with pytest.raises(ProgramError, match="takes as img what load_image returns, not a str"):
        robot.get_map(img="photo.png")  # pyright: ignore[reportArgumentType]


def test_a_program_reads_only_what_it_was_offered(tmp_path: Path) -> None:
    inside, outside = tmp_path / "work", tmp_path / "secret"
    for folder in (inside, outside):
        folder.mkdir()
        cv2.imwrite(str(folder / "photo.png"), np.zeros((4, 4, 3), np.uint8))
    (inside / "link.png").symlink_to(outside / "photo.png")
    (inside / "text.png").write_text("no picture")
    robot = furnished_robot()
    robot.seeker.readable = Readable((inside,), (str(outside / "photo.png"),))
    assert robot.load_image("photo.png") == Picture("photo.png")
    assert robot.load_image(str(outside / "photo.png")).path == str(outside / "photo.png")
    robot.seeker.readable = Readable((inside,))
    for name in (str(outside / "photo.png"), "../secret/photo.png", "link.png", "/etc/passwd"):
        with pytest.raises(QueryError, match=r"may not be read by a program: it lies outside of .*work"):
            robot.load_image(name)
        with pytest.raises(QueryError, match="may not be read by a program"):
            robot.get_map(img=Picture(name))  # one that no load_image gave
    for name, sentence in (
        ("nothing.png", "is not there"),
        ("text.png", "cannot be read as an image"),
        (" ", "no name"),
        ("a" * 300, r"a{100}\.\.\. is not there"),
        ("a" * 5000, r"a{100}\.\.\. is not there|may not be read"),
        ("../" + "a" * 5000, "may not be read"),
    ):
        with pytest.raises(QueryError, match=sentence):
            robot.load_image(name)


def test_the_files_that_a_command_names_are_offered_as_it_writes_them(tmp_path: Path) -> None:
    command = "go between ./a/006899.png and the chair, then to \"my holiday.jpg\" and where '/x/bark 2.wav' was heard."
    assert named_files(command) == ("my holiday.jpg", "/x/bark 2.wav", "./a/006899.png", *named_files(command)[3:])
    assert "/etc/passwd" not in named_files(command)
    assert offered_by(command, [tmp_path]).roots == (tmp_path,)
    assert named_files("go to the chair. Then stop.") == ()


voxels = st.lists(st.tuples(st.integers(-15, 15), st.integers(-15, 15)), min_size=1, max_size=40, unique=True)


@given(voxels)
def test_an_outline_holds_its_voxels_and_runs_counter_clockwise(cells: list[tuple[int, int]]) -> None:
    middles = (np.array(cells) + 0.5) * 0.05
    outline = Outline.round(middles, 0.05)
    for middle in middles:
        assert outline.distance_m(middle) < 0.03
    assert np.all(outline.corners >= middles.min(axis=0) - 0.15)
    assert np.all(outline.corners <= middles.max(axis=0) + 0.15)
    x, y = outline.corners.T
    assert x @ np.roll(y, -1) - y @ np.roll(x, -1) >= 0.0


def test_between_two_cupboards_that_face_is_the_middle_of_the_aisle() -> None:
    a = Outline(np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 0.5], [0.0, 0.5]]))
    b = Outline(np.array([[1.0, 2.0], [5.0, 2.0], [5.0, 2.5], [1.0, 2.5]]))
    assert middle_between(a, b) == pytest.approx((2.5, 1.25))
    assert middle_between(b, a) == pytest.approx((2.5, 1.25))


def test_between_a_thing_and_one_inside_its_u_is_never_inside_the_thing() -> None:
    u = Outline(np.array([[0, 0], [5, 0], [5, 4], [4, 4], [4, 1], [1, 1], [1, 4], [0, 4]], float))
    thing = Outline(np.array([[1.5, 2.0], [3.5, 2.0], [3.5, 3.0], [1.5, 3.0]]))
    middle = middle_between(u, thing)
    assert u.distance_m(middle) > 0.0 and thing.distance_m(middle) > 0.0


def test_the_floor_is_sought_among_the_voxels_that_count() -> None:
    robot = furnished_robot()
    voxels = robot.avlmap.data.voxels
    speckle = np.array([[x, y, -30] for x in range(120) for y in range(80)], np.int32)
    index = np.concatenate([voxels.index, speckle])
    hits = np.concatenate([np.full(len(voxels), 9), np.ones(len(speckle), int)])
    asked: Any = SimpleNamespace(
        space=Space(GridSpec(0.05), index, np.array([0.0, 0.0, 1.0])),
        data=SimpleNamespace(voxels=SimpleNamespace(hits=hits)),
        storeys=None,
    )
    assert Robot(asked, KinematicDriver(GroundPose(0.0, 0.0))).floor_m == pytest.approx(robot.floor_m)


@given(st.lists(st.tuples(st.floats(0.0, 9.0), st.floats(0.0, 1.0)), min_size=1, max_size=6), st.floats(0.0, 1.0))
def test_no_thing_is_nearest_that_is_less_than_half_as_likely_as_the_best(
    placed: list[tuple[float, float]], found_at: float
) -> None:
    things = [
        Destination("chair", Outline.at(np.array([x, 0.0])), np.array([x, 0.0, 0.5]), likely, found=likely >= found_at)
        for x, likely in sorted(placed, key=lambda one: -one[1])
    ]
    chosen = nearest(things, np.zeros(2))
    assert 2.0 * chosen.probability >= things[0].probability
    half = fit_equally([replace(one, half=True) for one in things])
    assert [one.place[0] for one in half] == [one.place[0] for one in things if one.found] or len(half) == 1
    near = [one for one in things if one.found and 2.0 * one.probability >= things[0].probability]
    assert all(chosen.place[0] <= one.place[0] for one in near)


def test_every_room_of_the_map_is_a_room(monkeypatch: pytest.MonkeyPatch) -> None:
    views = np.array([[1.0, 0.0]], np.float32)
    robot = furnished_robot(views=FakeViews(), keyframes=keyframes_at(np.array([[4.0, 2.0, 1.2]]), views))
    outline = np.array([[0.0, 0.0, 0.0], [6.0, 0.0, 0.0], [6.0, 4.0, 0.0], [0.0, 4.0, 0.0]])
    rooms = [
        SimpleNamespace(name=name, position=(x, 2.0, 1.2), outline=outline) for name, x in (("hall", 5.0), ("den", 2.5))
    ]
    where = SimpleNamespace(rooms=rooms, rooms_of=lambda points: [0] * len(points))
    monkeypatch.setattr(type(robot.seeker.avlmap), "where", where)
    assert [place.x for place in robot.get_all_pos(robot.get_major_map(area="room"))] == [2.5, 5.0]
    round_it = np.array([xy(place) for place in robot.get_contour(robot.get_major_map(area="kitchen"))])
    assert round_it.min(axis=0) == pytest.approx((0.5, 0.5), abs=0.15)
    assert round_it.max(axis=0) == pytest.approx((5.5, 3.5), abs=0.15)
