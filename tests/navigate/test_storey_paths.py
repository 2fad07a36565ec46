"""Paths in a home of two floors: on one floor as ever, to the other by stairs, or refused with the reason."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from avlmaps.core.errors import GoalNotFoundError, MapError, NavigationError
from avlmaps.core.motion import GroundPose
from avlmaps.core.question import Modality, Part, Role
from avlmaps.language.program.vocabulary import Place
from avlmaps.maps.grid import GridSpec
from avlmaps.maps.obstacles import CellState
from avlmaps.maps.storeys import find_storeys
from avlmaps.maps.types import Voxels
from avlmaps.navigate.costmap import BASE, WALKER, obstacles_for, storey_of_walk
from avlmaps.navigate.driver import MapDriver
from avlmaps.navigate.file_access import Readable
from avlmaps.navigate.footprint import Outline
from avlmaps.navigate.grounding import Destination, Seeker
from avlmaps.navigate.instruct import FreeBody
from avlmaps.navigate.paths import PathFinder
from avlmaps.navigate.skills import Robot
from avlmaps.query.factors import NearThings
from avlmaps.query.heatmap import Heatmap
from avlmaps.query.voxel_space import Space
from helpers.two_floors import SIZE_M, UPPER_M, VOXEL_M, WELL, two_floors

DOWN, UP = (3.0, 3.0, 0.0), (6.5, 2.0, UPPER_M)
Z = np.array([0.0, 0.0, 1.0])


def home(stairs: bool = True) -> Any:
    """A map of the home: what planning needs of one."""
    drawn, grid = two_floors(stairs=stairs), GridSpec(VOXEL_M)
    index = grid.index_of(drawn.points)
    count = len(index)
    voxels = Voxels(index, np.zeros((count, 0), np.float16), np.ones(count, np.float32),
                    np.zeros((count, 3), np.uint8), np.zeros(count), np.full(count, 9))  # fmt: skip
    poses = np.tile(np.eye(4), (len(drawn.cameras), 1, 1))
    poses[:, :3, 3] = drawn.cameras
    data = SimpleNamespace(voxels=voxels, grid=grid, up_in_world=Z, keyframes=SimpleNamespace(world_from_camera=poses))
    storeys = find_storeys(grid.centre_of(index), VOXEL_M, drawn.cameras)
    unedited = SimpleNamespace(forbidden=())
    return SimpleNamespace(data=data, space=Space(grid, index, Z), storeys=storeys, edited=unedited)


HOME, BARE = home(), home(stairs=False)


def state(storey: int, x: float, y: float) -> CellState:
    obstacles = obstacles_for(HOME, BASE, storey)
    return CellState(int(obstacles.state_at(np.array([x, y, 0.0]))))


def test_each_storey_has_its_own_grid() -> None:
    grids = [obstacles_for(HOME, BASE, storey) for storey in (0, 1)]
    assert grids[0].states.shape == grids[1].states.shape
    assert state(0, 4.02, 1.0) is CellState.OCCUPIED and state(1, 4.02, 1.0) is CellState.FREE  # the wall downstairs
    assert state(0, 1.0, 2.3) is CellState.OCCUPIED and state(1, 1.0, 2.3) is CellState.FREE  # the bed is longer there
    assert storey_of_walk(HOME) == 0 and obstacles_for(HOME).storey == 0


def test_the_well_of_the_stairs_is_no_floor_of_the_upper_storey() -> None:
    (x0, y0), (x1, y1) = WELL
    upper = obstacles_for(HOME, BASE, 1)
    cells = upper.cell_of(np.array([[x0 + 0.3, y0 + 0.2, 0.0], [x1 - 0.6, y1 - 0.2, 0.0]]))
    inside = upper.states[cells[0, 0] : cells[1, 0], cells[0, 1] : cells[1, 1]]
    assert not (inside == CellState.FREE).any()


def test_a_storey_that_the_map_lacks_is_refused_with_those_it_has() -> None:
    with pytest.raises(MapError, match=r"no storey 2; it holds 2 storeys: ground floor \(0\.\d+ m\), first floor"):
        obstacles_for(HOME, BASE, 2)


def test_a_wheeled_robot_is_refused_upstairs_with_both_heights() -> None:
    answer = PathFinder(HOME).answer(np.array(DOWN), np.array(UP))
    assert not answer["found"] and answer["points"] == []
    assert answer["note"].endswith("does not climb stairs: name a place on the ground floor")
    assert "first floor" in answer["note"] and "2.8" in answer["note"] and "0.0" in answer["note"]


@pytest.mark.parametrize("shape", [BASE, WALKER])
def test_without_stairs_in_the_map_nobody_is_led_upstairs(shape) -> None:
    answer = PathFinder(BARE, shape).answer(np.array(DOWN), np.array(UP))
    assert not answer["found"] and "the map holds no stairs between them: map them too" in answer["note"]


@pytest.mark.parametrize("down", [False, True])
def test_a_walker_takes_the_stairs_and_changes_height_on_them_alone(down: bool) -> None:
    ends = (UP, DOWN) if down else (DOWN, UP)
    finder = PathFinder(HOME, WALKER)
    answer = finder.answer(np.array(ends[0]), np.array(ends[1]))
    assert answer["found"] and answer["note"] == ""
    assert answer.get("storeys") == (["first floor", "ground floor"] if down else ["ground floor", "first floor"])
    points = np.array(answer["points"])
    legs = np.diff(points, axis=0)
    assert answer["length_m"] == pytest.approx(np.linalg.norm(legs, axis=1).sum())
    assert points[0, :2] == pytest.approx(ends[0][:2], abs=0.1) and points[-1, 2] == pytest.approx(ends[1][2], abs=0.1)
    changes = np.flatnonzero(np.abs(legs[:, 2]) > 0.02)
    on_stairs = (
        (points[:, 1] > WELL[0][1] - 0.4) & (points[:, 0] > WELL[0][0] - 0.6) & (points[:, 0] < WELL[1][0] + 0.6)
    )
    assert on_stairs[changes].all() and on_stairs[changes + 1].all()
    for storey in (0, 1):  # off the stairs the middle of the body stays where it may be
        own = ~on_stairs & (np.abs(points[:, 2] - HOME.storeys[storey].floor_m) < 0.05)
        assert own.any() and finder.planner(storey).costmap.is_passable(points[own, :2]).all()


def test_on_one_storey_a_path_is_as_ever() -> None:
    for z, other in ((0.0, (5.0, 3.0, 0.0)), (UPPER_M, (5.0, 3.0, UPPER_M))):
        answer = PathFinder(HOME).answer(np.array([3.0, 3.0, z]), np.array(other))
        assert answer["found"] and answer["length_m"] == pytest.approx(2.0, abs=0.2)
        assert np.array(answer["points"])[:, 2] == pytest.approx(z, abs=0.05)


def test_what_lies_outside_is_named_in_one_number_or_the_other() -> None:
    inside, outside = np.array([3.0, 3.0, 0.0]), np.array([90.0, 3.0, 0.0])
    finder = PathFinder(HOME)
    assert finder.answer(inside, outside)["note"] == "the goal lies outside of the map"
    assert finder.answer(outside, outside)["note"] == "the start and the goal lie outside of the map"


def test_a_driver_on_the_ground_floor_goes_nowhere_for_a_place_upstairs() -> None:
    driver = MapDriver(obstacles_for(HOME, BASE, 0), FreeBody(GroundPose(3.0, 3.0, 0.0)))
    refused = driver.go_to(np.array(UP))
    assert not refused.reached and "does not climb stairs" in refused.note and driver.pose == GroundPose(3.0, 3.0, 0.0)
    assert driver.go_to(np.array([5.0, 3.0, 0.7])).reached and SIZE_M[0] > driver.pose.x_m > 4.5


def test_a_skill_beside_a_thing_upstairs_is_refused_and_not_driven_on_the_floor_below() -> None:
    driver = MapDriver(obstacles_for(HOME, BASE, 0), FreeBody(GroundPose(3.0, 3.0, 0.0)))
    robot = Robot(HOME, driver)
    with pytest.raises(NavigationError, match="does not climb stairs"):
        robot.move_north(Place(5.0, 2.0, UPPER_M + 0.5))
    assert driver.pose == GroundPose(3.0, 3.0, 0.0)
    assert robot.floor_m == pytest.approx(HOME.storeys[0].floor_m)


def test_of_things_on_two_storeys_those_of_the_robots_own_count_where_one_is_found() -> None:
    robot = Robot(HOME, MapDriver(obstacles_for(HOME, BASE, 0), FreeBody(GroundPose(3.0, 3.0, 0.0))))
    up, down, unlikely = (
        Destination("bed", Outline.at(np.array([x, 2.0])), np.array([x, 2.0, z]), likely)
        for x, z, likely in ((3.0, UPPER_M + 0.5, 0.9), (5.0, 0.5, 0.8), (5.0, 0.5, 0.3))
    )
    assert robot.seeker._near_first([up, down], 0.5) == [down]
    assert robot.seeker._near_first([up, unlikely], 0.5) == [up, unlikely]
    assert robot.seeker.notes == ["1 of 2 places for bed are on other storeys; those of the ground floor count"]


def seeker(on: tuple[float, ...] = (0.9, 0.8)) -> Seeker:
    """Return who finds beds: the first upstairs, the second on the ground floor, with these confidences."""
    centres, (_, high) = HOME.space.centres, HOME.storeys.all
    rows = [int(np.argmin(np.linalg.norm(centres - place, axis=1))) for place in (UP, DOWN)][: len(on)]
    order = np.argsort(rows)
    mask = np.zeros(len(centres), bool)
    mask[rows] = True
    part = Part(Modality.OBJECT, "bed", Role.PRIMARY)
    confidence = np.array(on, np.float32)
    factor = NearThings(HOME.space, part, 2.0, mask, order, confidence, bool((confidence >= 0.5).any()))
    assert high.floor_m > 1.0
    avlmap: Any = SimpleNamespace(
        storeys=HOME.storeys, space=HOME.space, object=lambda name, primary=False: Heatmap.of(factor)
    )
    return Seeker(avlmap, False, Readable(), lambda _: None)


@pytest.mark.parametrize(
    ("name", "upstairs"),
    [("bed upstairs", True), ("bed on the first floor", True), ("bed downstairs", False),
     ("bed on the ground floor", False), ("bed on the top floor", True)],
)  # fmt: skip
def test_a_name_with_a_storey_means_what_is_there(name: str, upstairs: bool) -> None:
    found = seeker()
    assert (found.best(name).place[2] > 1.0) == upstairs
    assert {thing.place[2] > 1.0 for thing in found.every(name, np.zeros(2))} == {upstairs}
    heat = found.heat("get_major_map", name, None, None, None, "robot", primary=True)
    for several in (heat, heat * heat, heat.include_uncertain()):
        assert {goal.position[2] > 1.0 for goal in several.goals(9)} == {upstairs}


def test_what_is_on_another_storey_or_on_none_is_told() -> None:
    with pytest.raises(GoalNotFoundError, match=r"No bed is found downstairs; one is on the first floor\."):
        seeker((0.9,)).best("bed downstairs")
    with pytest.raises(GoalNotFoundError, match=r"not found: the map holds 2 storeys: ground floor"):
        seeker().best("bed on the fifth floor")
