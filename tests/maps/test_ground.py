"""The floor under a walk: laws, simulated walks that film tables, steps and storeys, and real Kinect frames."""

import csv
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from avlmaps.core.camera import Pinhole, Rig
from avlmaps.maps.gravity import USUAL_HEIGHT_M, Expected, FoundGround, Sight, find_ground, ground_of_sights, sight_of
from avlmaps.recordings.types import Frame
from helpers.filmed_rooms import UP, Look, climb, desk_walk, film, moved, office, room, stairs, table


def errors_m(frames: Sequence[Frame], true_m: float | Sequence[float], found: FoundGround | None = None) -> np.ndarray:
    """Return by how much each camera's height over the floor is off, metres."""
    ground = (found or find_ground(frames, UP)).ground
    return np.array([ground.camera_height_m(frame.world_from_camera) for frame in frames]) - np.array(true_m)


def round_the_office(height_m: float, count: int = 20) -> list[Look]:
    """Return a walk round the office's desks with looks about, 10 degrees down."""
    angle = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    return [
        (3.6 + 2.6 * np.cos(a), 2.9 + 1.9 * np.sin(a), height_m, np.rad2deg(a) + 100.0 + 40.0 * np.sin(7 * a), 10.0)
        for a in angle
    ]


def over_the_desks(height_m: float, down_deg: float, count: int = 20) -> list[Look]:
    """Return looks from over the desks straight down at them, as one films an object."""
    angle = np.linspace(0.0, 6.0, count)
    return [(3.6 + 0.3 * np.cos(a), 2.6 + 0.2 * np.sin(a), height_m, 170.0 * a, down_deg) for a in angle]


@cache
def walked(height_m: float) -> tuple[Frame, ...]:
    return tuple(film(office(), round_the_office(height_m)))


@cache
def filmed_desks(on_floor: int) -> tuple[Frame, ...]:
    return tuple(film(office(), desk_walk(60, on_floor)))


@cache
def filmed_tops() -> tuple[Frame, ...]:
    """Return frames that hold no floor."""
    return tuple(film(office(), over_the_desks(1.15, 88.0)))


@cache
def _sights_of_the_desks() -> tuple[Sight, ...]:
    return tuple(sight_of(frame, UP) for frame in filmed_desks(6))


@cache
def _ground_of_half_the_desks() -> FoundGround:
    return find_ground(filmed_desks(3)[::2], UP)


@pytest.mark.few(2)
@pytest.mark.slow
@pytest.mark.parametrize("height_m", [0.15, 0.3, 0.6, 1.0, 1.35, 1.8])
def test_the_floor_is_found_and_not_the_table_tops(height_m: float) -> None:
    found = find_ground(walked(height_m), UP)
    assert np.abs(errors_m(walked(height_m), height_m, found)).max() < 0.03
    assert found.floors[0].best.confidence > 0.9


@pytest.mark.few(1)
@pytest.mark.parametrize("on_floor", [3, 6, 1])
def test_a_walk_that_films_tables_for_nine_tenths_has_its_floor(on_floor: int) -> None:
    frames = filmed_desks(on_floor)
    assert np.abs(errors_m(frames, [frame.world_from_camera[2, 3] for frame in frames])).max() < 0.05


def test_a_walk_without_any_floor_in_view_says_so() -> None:
    found = find_ground(filmed_tops(), UP)
    assert found.floors[0].best.confidence < 0.7
    wall = find_ground(film(office(), [(0.6, 3.0 + 0.01 * i, 1.3, 180.0, 0.0) for i in range(8)]), UP)
    assert not wall.floors[0].best.in_view and wall.floors[0].best.confidence <= 0.5


def test_without_any_depth_the_camera_is_taken_to_be_held_as_usual() -> None:
    blind = [replace(frame, depth_m=np.zeros_like(frame.depth_m)) for frame in walked(1.0)[:2]]
    found = find_ground(blind, UP)
    assert found.ground.camera_height_m(blind[0].world_from_camera) == pytest.approx(USUAL_HEIGHT_M)
    assert found.floors[0].best.confidence <= 0.5
    assert find_ground([], UP).floors[0].best.confidence <= 0.5


def test_depth_that_is_not_finite_is_no_surface() -> None:
    spoilt = [replace(frame, depth_m=frame.depth_m.copy()) for frame in walked(1.35)]
    for frame in spoilt:
        frame.depth_m[:5], frame.depth_m[5:10], frame.depth_m[10:15] = np.nan, np.inf, -1.0
    assert np.abs(errors_m(spoilt, 1.35)).max() < 0.03


@pytest.mark.nightly
def test_each_camera_stands_over_the_floor_of_its_own_storey() -> None:
    lift = np.eye(4)
    lift[2, 3] = 2.9
    both = [*walked(1.35), *moved(filmed_desks(6), lift)]
    true_m = [1.35] * len(walked(1.35)) + [frame.world_from_camera[2, 3] for frame in filmed_desks(6)]
    found = find_ground(both, UP)
    assert np.abs(errors_m(both, true_m, found)).max() < 0.05
    assert [round(floor.best.height_m, 1) for floor in found.floors] == [0.0, 2.9]


@pytest.mark.few(1)
@pytest.mark.slow
@pytest.mark.parametrize("height_m", [0.3, 1.35])
@pytest.mark.parametrize("steps", [3, 14])
def test_stairs_lift_the_floor_with_the_camera(height_m: float, steps: int) -> None:
    frames = film(stairs(steps=steps), climb(height_m, steps))
    found = find_ground(frames, UP)
    off_m = np.abs(errors_m(frames, height_m, found))
    assert np.mean(off_m < 0.05) > 0.85  # a step that few frames show may be taken for its neighbours
    assert off_m.max() < 0.6
    assert found.floors[0].best.height_m == pytest.approx(0.0, abs=0.03)
    assert found.floors[-1].best.height_m == pytest.approx(0.18 * steps, abs=0.03)


@pytest.mark.few(1)
@pytest.mark.parametrize("height_m", [0.3, 1.35])
@pytest.mark.parametrize("podium_m", [0.2, 0.4, 0.6])
def test_a_robot_on_a_podium_stands_on_the_podium(podium_m: float, height_m: float) -> None:
    hall = room([(0.0, 0.0, 0.0, 8.0, 3.0, podium_m)])
    places = [(1 + 6 * t, 1.5 if i % 2 else 5.0, 360 * t + 90 * (i % 3)) for i, t in enumerate(np.linspace(0, 1, 30))]
    frames = film(hall, [(x, y, height_m + podium_m * (y < 3.0), heading, 15.0) for x, y, heading in places])
    assert np.abs(errors_m(frames, height_m)).max() < 0.05


@pytest.mark.nightly
def test_a_table_that_cameras_hover_over_is_no_podium() -> None:
    frames = [*walked(1.35), *film(office(), over_the_desks(1.5, 60.0))]
    assert np.abs(errors_m(frames, [frame.world_from_camera[2, 3] for frame in frames])).max() < 0.05


def test_a_given_height_holds_where_no_floor_is_in_view() -> None:
    frames = filmed_tops()
    found = find_ground(frames, UP, Expected(0.0, 1.15))
    assert found.ground.camera_height_m(frames[0].world_from_camera) == pytest.approx(1.15, abs=0.05)
    assert found.floors[0].best.confidence > 0.9


def test_a_given_height_yields_to_the_floor_in_view_within_a_decimetre() -> None:
    found = find_ground(walked(1.35), UP, Expected(-0.05, 1.4))
    assert found.ground.camera_height_m(walked(1.35)[0].world_from_camera) == pytest.approx(1.35, abs=0.02)


def test_the_floor_does_not_lie_above_the_robots_base() -> None:
    found = find_ground(filmed_tops(), UP, Expected(0.1, 1.05, exact=False))
    assert found.floors[0].best.height_m < 0.2


@pytest.mark.slow
@settings(max_examples=5)
@given(st.floats(-np.pi, np.pi), st.tuples(*[st.floats(-40.0, 40.0)] * 3), st.sampled_from([0, 1, 2]))
def test_the_floor_is_the_same_in_every_world(yaw_rad: float, shift_m: tuple[float, float, float], axis: int) -> None:
    """Turning the world, moving it, and naming another axis up change nothing but the grid that evidence lies in."""
    frames, before = filmed_desks(3)[::2], _ground_of_half_the_desks()
    turn = np.eye(4)
    turn[:2, :2] = [[np.cos(yaw_rad), -np.sin(yaw_rad)], [np.sin(yaw_rad), np.cos(yaw_rad)]]
    turn[:3, 3] = shift_m
    permuted = np.eye(4)
    permuted[:3, :3] = np.roll(np.eye(3), axis + 1, axis=0)
    world = permuted @ turn
    after = find_ground(moved(frames, world), world[:3, :3] @ UP)
    for frame, there in zip(frames, moved(frames, world), strict=True):
        old, new = (
            before.ground.camera_height_m(frame.world_from_camera),
            after.ground.camera_height_m(there.world_from_camera),
        )
        assert new == pytest.approx(old, abs=0.03)
    assert after.floors[0].best.confidence == pytest.approx(before.floors[0].best.confidence, abs=0.1)


@pytest.mark.nightly
@settings(max_examples=5)
@given(st.integers(0, 1000), st.integers(2, 10))
def test_more_samples_do_not_flip_a_confident_answer(seed: int, few: int) -> None:
    sights = _sights_of_the_desks()
    order = np.random.default_rng(seed).permutation(len(sights))
    some = ground_of_sights([sights[i] for i in order[:few]], UP).floors
    every = ground_of_sights([sights[i] for i in order], UP).floors
    if len(some) == 1 and some[0].best.confidence > 0.9:
        assert every[0].best.height_m == pytest.approx(some[0].best.height_m, abs=0.05)
    assert len(every) == 1 and every[0].best.confidence > 0.9


@pytest.mark.nightly
@settings(max_examples=6)
@given(
    st.lists(st.tuples(st.floats(0.8, 5.0), st.floats(1.0, 4.5), st.floats(0.45, 1.05)), min_size=1, max_size=5),
    st.floats(0.25, 1.7),
    st.integers(0, 99),
)
def test_the_floor_is_never_above_a_level_that_is_seen_through(
    tables: list[tuple[float, float, float]], height_m: float, seed: int
) -> None:
    boxes = [box for x, y, h in tables for box in table(x, y, 1.4, 0.8, h)]
    heading = np.random.default_rng(seed).uniform(0.0, 360.0, 12)
    looks: list[Look] = [(0.5 + 0.6 * i, 0.5, height_m, float(h), 20.0) for i, h in enumerate(heading)]
    found = find_ground(film(room(boxes), looks, seed), UP)
    for floor in found.floors:
        assert floor.best.below < 0.1
        assert floor.best.height_m < 0.1 or floor.best.confidence < 0.9


# Real frames -----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def kitchen(shared_data: Path) -> tuple[list[Sight], np.ndarray]:
    """Every fourth frame of the red kitchen as evidence, and up."""
    from avlmaps.maps.estimate import estimate_up
    from avlmaps.maps.settings import DEFAULTS
    from avlmaps.recordings.open import open_recording

    recording = open_recording(shared_data / "data" / "redkitchen")
    up = estimate_up(recording, DEFAULTS).vector()
    return [sight_of(recording.frame(index), up) for index in range(0, len(recording), 4)], up


@pytest.mark.nightly
@pytest.mark.shared
@pytest.mark.parametrize("count", [40, 8])
def test_every_sample_of_the_red_kitchen_has_its_floor_and_not_its_table(
    count: int, kitchen: tuple[list[Sight], np.ndarray]
) -> None:
    """The table's top lies 0.70 m under the camera and holds 80 % of what is level; the floor 1.41 m."""
    sights, up = kitchen
    for seed in range(4):
        chosen = np.random.default_rng(seed).choice(len(sights), count, replace=False)
        found = ground_of_sights([sights[i] for i in chosen], up)
        camera_m = np.median(found.ground.camera_m - found.ground.floor_m)
        assert camera_m == pytest.approx(1.41, abs=0.12), f"sample {seed}"
        assert np.ptp(found.ground.floor_m) < 0.05 and found.floors[0].best.confidence > 0.7


def nyu_frames(folder: Path, every: int) -> list[tuple[str, Frame, np.ndarray, float]]:
    """Return (name, frame, up, true camera height) of NYUv2 frames that show a floor of one height."""
    made = []
    with (folder / "frames.csv").open(newline="") as lines:
        rows = list(csv.DictReader(lines))[::every]
    for row in rows:
        depth8, label = (
            cv2.imread(str(folder / f"{row['frame']}.{name}.png"), cv2.IMREAD_UNCHANGED) for name in ("depth8", "label")
        )
        assert depth8 is not None and label is not None
        depth_m = depth8.astype(np.float32) / 25.5
        for _ in range(2):  # it has steps of 39 mm
            depth_m = cv2.bilateralFilter(depth_m, 9, 0.12, 4.0)
        depth_m[:12], depth_m[-12:], depth_m[:, :12], depth_m[:, -12:] = 0.0, 0.0, 0.0, 0.0
        depth_m = np.ascontiguousarray(depth_m[::2, ::2])
        camera = Pinhole(518.86 / 2, 519.47 / 2, 325.58 / 2, 253.74 / 2, 320, 240)
        up = np.array([float(row[f"up_{axis}"]) for axis in "xyz"])
        floor = (label[::2, ::2] == 2) & (depth_m > 0.0)
        if (label == 2).sum() < 800 or not floor.any():
            continue
        low_m, true_m, high_m = np.quantile(
            -camera.backproject(depth_m.astype(np.float64))[floor] @ up, (0.25, 0.5, 0.75)
        )
        if high_m - low_m > 0.2:
            continue  # labelled floor of several heights: stairs, walls and windows that are labelled floor
        rgb = np.zeros((240, 320, 3), np.uint8)
        frame = Frame(0, row["frame"], 0.0, rgb, depth_m, np.eye(4), Rig(camera, camera))
        made.append((row["frame"], frame, up, float(true_m)))
    return made


@pytest.mark.nightly
@pytest.mark.shared
def test_single_kinect_frames_of_homes_have_their_floor(shared_data: Path) -> None:
    frames = nyu_frames(shared_data / "data" / "nyuv2", every=18)
    assert len(frames) > 33
    wrong = []
    for name, frame, up, true_m in frames:
        found = find_ground([frame], up).floors[0].best
        if abs(found.camera_height_m - true_m) > 0.15:
            wrong.append((name, round(true_m, 2), round(found.camera_height_m, 2), round(found.confidence, 2)))
    assert len(wrong) <= 1, wrong
