"""Where a robot can stand, and the walk through a building: it touches nothing, keeps its limits, sees everything."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.camera import Pinhole
from avlmaps_sim.files.labels import with_areas
from avlmaps_sim.free_space import floor_heights, free_space, reaching_part
from avlmaps_sim.mesh import Material, Mesh, joined
from avlmaps_sim.scene import Area, Scene, SceneBuilder
from avlmaps_sim.shapes import box
from avlmaps_sim.views import IN_HANDS, ON_A_ROBOT
from avlmaps_sim.walk import WalkSettings, random_views, walk_through

PLAIN = Material()
CAMERA = Pinhole(277.0, 277.0, 160.0, 120.0, 320, 240)
RADIUS_M = 0.22
# (category, lowest corner, highest corner): things in two rooms of 4 x 4 m with a door at x = 4, y = 1.5 to 2.5.
THINGS = (
    ("table", (0.6, 0.6, 0.0), (1.8, 1.4, 0.75)),
    ("sofa", (0.3, 3.0, 0.0), (2.2, 3.8, 0.8)),
    ("bed", (6.0, 2.2, 0.0), (7.8, 3.8, 0.5)),
    ("wardrobe", (6.5, 0.2, 0.0), (7.9, 0.8, 2.2)),
    ("chandelier", (1.8, 1.9, 2.0), (2.2, 2.3, 2.4)),
    ("carpet", (2.2, 1.5, 0.0), (3.4, 2.5, 0.01)),
    ("picture", (4.07, 3.0, 1.3), (4.09, 3.6, 1.8)),
)


def room(size_x: float, size_y: float, x: float = 0.0, z: float = 0.0, height: float = 2.6) -> list[tuple[str, Mesh]]:
    """A floor, a ceiling and four walls of 0.1 m that stand outside of it."""
    out, top = x + size_x, z + height
    return [
        ("floor", box((x, 0, z - 0.1), (out, size_y, z), PLAIN)),
        ("ceiling", box((x, 0, top), (out, size_y, top + 0.1), PLAIN)),
        ("wall", box((x - 0.1, -0.1, z), (x, size_y + 0.1, top), PLAIN)),
        ("wall", box((out, -0.1, z), (out + 0.1, size_y + 0.1, top), PLAIN)),
        ("wall", box((x, -0.1, z), (out, 0.0, top), PLAIN)),
        ("wall", box((x, size_y, z), (out, size_y + 0.1, top), PLAIN)),
    ]


def building(parts: list[tuple[str, Mesh]], areas: tuple[Area, ...] = ()) -> Scene:
    builder = SceneBuilder("test", areas=list(areas))
    for category, mesh in parts:
        builder.add(category, mesh)
    return builder.build()


def rectangle(x0: float, y0: float, x1: float, y1: float) -> np.ndarray:
    return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])


def two_rooms() -> Scene:
    parts = [part for part in room(8.0, 4.0)]
    for low, high in ((0.0, 1.5), (2.5, 4.0)):
        parts.append(("wall", box((3.95, low, 0.0), (4.05, high, 2.6), PLAIN)))
    parts.append(("wall", box((3.95, 1.5, 2.05), (4.05, 2.5, 2.6), PLAIN)))
    parts += [(category, box(low, high, PLAIN)) for category, low, high in THINGS]
    areas = (Area("living room", rectangle(0, 0, 4, 4), name="a"), Area("bedroom", rectangle(4, 0, 8, 4), name="b"))
    return with_areas(building(parts), areas)


SCENE = two_rooms()
POSES = walk_through(SCENE, np.random.default_rng(3))


def to_rectangle_m(xy: np.ndarray, low: tuple[float, ...], high: tuple[float, ...]) -> np.ndarray:
    apart = np.maximum(np.maximum(np.array(low[:2]) - xy, xy - np.array(high[:2])), 0.0)
    return np.linalg.norm(apart, axis=-1)


# --- free space


@given(
    boxes=st.lists(st.tuples(st.floats(0.2, 4.0), st.floats(0.2, 4.0), st.floats(0.05, 1.5), st.floats(0.05, 1.5),
                             st.floats(0.0, 1.2), st.floats(0.15, 1.2)), max_size=5),
    radius_m=st.floats(0.1, 0.4),
)  # fmt: skip
def test_free_places_are_exactly_those_that_far_from_every_obstacle(
    boxes: list[tuple[float, ...]], radius_m: float
) -> None:
    things = [((x, y, z), (x + dx, y + dy, z + dz)) for x, y, dx, dy, z, dz in boxes]
    scene = building([*room(6.0, 6.0), *(("box", box(low, high, PLAIN)) for low, high in things)])
    space = free_space(scene, radius_m, 1.5)
    cells = space.middle_of(np.argwhere(np.ones_like(space.free)))
    inside = np.all((cells > 0.02) & (cells < 5.98), axis=1)
    to_wall = np.minimum(cells, 6.0 - cells).min(axis=1)
    away = np.min([to_wall, *(to_rectangle_m(cells, low, high) for low, high in things)], axis=0)
    free = space.free.reshape(-1)
    assert (away[free & inside] >= radius_m - 1e-6).all()
    label_sure = inside & (away > radius_m + 3 * space.cell_m)
    # Pockets smaller than a room are left out on purpose; the part in the largest free region is not.
    whole = reaching_part(scene, space).free.reshape(-1)
    assert not free[~inside].any()
    if free.sum() == whole.sum() and not things:
        assert free[label_sure].all()


@given(x=st.floats(1.0, 5.0), y=st.floats(1.0, 5.0), side_m=st.floats(0.1, 1.2), radius_m=st.floats(0.1, 0.3))
def test_a_place_well_away_from_a_single_thing_is_free(x: float, y: float, side_m: float, radius_m: float) -> None:
    low, high = (x, y, 0.0), (x + side_m, y + side_m, 1.0)
    space = free_space(building([*room(8.0, 8.0), ("box", box(low, high, PLAIN))]), radius_m, 1.5)
    cells = space.middle_of(np.argwhere(np.ones_like(space.free)))
    to_wall = np.minimum(cells, 8.0 - cells).min(axis=1)
    sure = np.minimum(to_wall, to_rectangle_m(cells, low, high)) > radius_m + 3 * space.cell_m
    inside = np.all((cells > low[:2]) & (cells < high[:2]), axis=1)
    assert space.free.reshape(-1)[sure & ~inside].all()


def test_carpets_and_what_hangs_high_are_in_nobodys_way() -> None:
    space = free_space(SCENE, RADIUS_M, 1.6)
    assert space.is_free(np.array([[2.8, 2.0], [2.0, 2.1]])).all()
    assert not free_space(SCENE, RADIUS_M, 2.1).is_free(np.array([2.0, 2.1]))


def test_the_inside_of_a_closed_wardrobe_is_not_free() -> None:
    scene = building([*room(5.0, 5.0), ("wardrobe", box((0.5, 0.5, 0.0), (1.5, 1.3, 2.2), PLAIN))])
    assert not free_space(scene, 0.15, 1.6).is_free(np.array([1.0, 0.9]))


def round_the_jamb_m(radius_m: float) -> float:
    """The way from 0.75 m before and 0.9 m beside the jamb's corner, along its circles, to the same place behind."""
    away = float(np.hypot(0.75, 0.9))
    arc_rad = np.pi + np.arctan2(0.9, 0.75) - np.arccos(radius_m / away) - np.pi / 2
    return 2 * float(np.sqrt(away**2 - radius_m**2) + radius_m * arc_rad) + 0.1


def test_the_way_round_a_wall_is_as_long_as_geometry_says() -> None:
    space = free_space(SCENE, RADIUS_M, 1.6)
    a, b = np.array([3.2, 0.6]), np.array([4.8, 0.6])
    assert round_the_jamb_m(RADIUS_M) < space.distance_m(a, b) < 1.03 * round_the_jamb_m(RADIUS_M + 0.12)
    assert space.distance_m(a, a) == 0.0
    assert space.distance_m(a, b) == pytest.approx(space.distance_m(b, a))


@given(x=st.floats(-1, 9), y=st.floats(-1, 5))
def test_the_nearest_free_place_is_free_and_none_is_nearer(x: float, y: float) -> None:
    space = free_space(SCENE, RADIUS_M, 1.6)
    place = np.array([x, y])
    nearest = space.nearest(place)
    assert space.is_free(nearest)
    least = np.linalg.norm(space.middles() - place, axis=1).min()
    assert np.linalg.norm(nearest - place) <= least + 1e-9


def test_a_place_that_cannot_be_reached_is_infinitely_far() -> None:
    scene = building([*room(6.0, 4.0), ("wall", box((2.9, 0.0, 0.0), (3.1, 4.0, 2.6), PLAIN))])
    assert free_space(scene).distance_m(np.array([1.0, 1.0]), np.array([5.0, 1.0])) == np.inf


def test_without_names_the_lowest_large_level_surface_is_the_floor() -> None:
    parts = [("thing", mesh) for _, mesh in room(5.0, 4.0, z=1.0)] + [("thing", box((1, 1, 1), (2, 2, 1.7), PLAIN))]
    scene = building(parts)
    assert floor_heights(scene) == pytest.approx((1.0,))
    assert free_space(scene).is_free(np.array([3.5, 3.0]))
    assert not free_space(scene).is_free(np.array([1.5, 1.5]))


@pytest.mark.parametrize("named", [False, True])
@pytest.mark.parametrize("slab_m", [0.02, 0.3])
def test_two_storeys_without_areas_are_two_floors_and_the_roof_is_none(named: bool, slab_m: float) -> None:
    parts = [*room(5.0, 4.0, height=2.7 - slab_m), *room(5.0, 4.0, z=2.7)]
    parts += [("floor", box((0, 0, z - slab_m), (5, 4, z), PLAIN)) for z in (0.0, 2.7)]
    scene = building([(category if named else "thing", mesh) for category, mesh in parts])
    assert floor_heights(scene) == pytest.approx((0.0, 2.7), abs=0.03)


def test_the_floor_of_an_area_is_where_its_surface_is_not_where_its_box_begins() -> None:
    scene = building(room(5.0, 4.0), (Area("bedroom", rectangle(0, 0, 5, 4), floor_m=-0.17),))
    assert floor_heights(scene) == pytest.approx((0.0,), abs=1e-6)


# --- the walk


def test_the_walk_never_comes_nearer_to_anything_than_the_robots_radius() -> None:
    place = POSES[:, :2, 3]
    for thing in SCENE.objects:
        if thing.category not in ("floor", "ceiling", "carpet") and thing.low[2] < 1.3:
            assert to_rectangle_m(place, thing.low, thing.high).min() >= RADIUS_M, thing.name


def test_the_walk_keeps_to_its_speed_and_its_turning_speed() -> None:
    settings = WalkSettings()
    step = np.linalg.norm(np.diff(POSES[:, :2, 3], axis=0), axis=1)
    turn = np.diff(np.unwrap(np.arctan2(POSES[:, 1, 2], POSES[:, 0, 2])))
    assert step.max() <= settings.speed_m_s / settings.rate_hz * 1.001
    assert np.abs(turn).max() <= settings.turn_rad_s / settings.rate_hz * 1.001
    assert np.abs(np.diff(turn)).max() <= settings.turn_rad_s2 / settings.rate_hz**2 * 1.001


def test_the_walk_holds_its_camera_like_a_robot() -> None:
    rotation = POSES[:, :3, :3]
    assert rotation @ rotation.transpose(0, 2, 1) == pytest.approx(np.broadcast_to(np.eye(3), rotation.shape))
    assert np.linalg.det(rotation) == pytest.approx(np.ones(len(POSES)))
    assert POSES[:, 2, 3].min() > 1.19 and POSES[:, 2, 3].max() < 1.51 and np.ptp(POSES[:, 2, 3]) < 0.03
    pitch_deg = np.rad2deg(np.arcsin(POSES[:, 2, 2]))
    assert pitch_deg.min() > -14.1
    assert pitch_deg.max() < -5.9
    assert np.ptp(pitch_deg) > 4.0
    assert (POSES[:, 2, 1] < 0).all()  # the image's rows run down


def test_every_area_is_entered_and_every_thing_is_seen() -> None:
    place = POSES[:, :2, 3]
    for area in SCENE.areas:
        assert area.contains(place).sum() > 50
        assert np.linalg.norm(place - area.polygon.mean(axis=0), axis=1).min() < 1.0
    for category, low, high in THINGS:
        middle = (np.array(low) + high) / 2
        if category == "chandelier":
            continue
        same_room = (place[:, 0] < 4.0) == (middle[0] < 4.0)
        local = np.einsum("nij,ni->nj", POSES[:, :3, :3], middle - POSES[:, :3, 3])
        u, v = CAMERA.project(np.where(local[:, 2:] > 0.2, local, np.nan)).T
        shown = (u > 0) & (u < 320) & (v > -60) & (v < 300) & (local[:, 2] < 4.0) & same_room
        assert shown.sum() >= 5, category


def test_a_small_home_takes_a_sensible_time() -> None:
    assert 150 < len(POSES) < 900


def test_the_same_generator_gives_the_same_walk() -> None:
    assert np.array_equal(walk_through(SCENE, np.random.default_rng(3)), POSES)
    assert not np.array_equal(walk_through(SCENE, np.random.default_rng(4))[0], POSES[0])


def test_a_walk_that_is_too_long_is_thinned_evenly() -> None:
    thin = walk_through(SCENE, np.random.default_rng(3), WalkSettings(max_frames=100))
    assert len(thin) == 100
    assert np.array_equal(thin[[0, -1], :2, 3], POSES[[0, -1], :2, 3])
    step = np.linalg.norm(np.diff(thin[:, :2, 3], axis=0), axis=1)
    assert step.max() < 0.5 * 0.1 * len(POSES) / 99 + 0.06


def test_without_looking_around_the_robot_only_drives() -> None:
    brisk = walk_through(SCENE, np.random.default_rng(3), WalkSettings(look_around=False))
    assert len(brisk) < 0.8 * len(POSES)


def two_floors() -> Scene:
    areas = (
        Area("hallway", rectangle(0, 0, 4, 4), 0.0, 2.6), Area("bedroom", rectangle(0, 0, 7, 4), 3.0, 5.6),
    )  # fmt: skip
    return building([*room(4.0, 4.0), *room(7.0, 4.0, z=3.0)], areas)


def test_a_walk_keeps_to_one_floor_and_the_larger_one_is_the_default() -> None:
    scene = two_floors()
    assert floor_heights(scene) == (0.0, 3.0)
    above = walk_through(scene, np.random.default_rng(0))
    below = walk_through(scene, np.random.default_rng(0), WalkSettings(floor=0))
    assert (above[:, 2, 3] > 4.0).all() and (below[:, 2, 3] < 1.6).all()


def test_a_scene_without_a_free_place_is_refused() -> None:
    full = building([*room(3.0, 3.0), ("box", box((0, 0, 0), (3, 3, 1), PLAIN))])
    with pytest.raises(ValueError, match="no place on the floor of test is free"):
        walk_through(full, np.random.default_rng(0))


def test_a_room_with_nothing_in_it_is_walked_as_well() -> None:
    assert len(walk_through(building(room(4.0, 4.0)), np.random.default_rng(0))) > 10


# --- random views


def test_random_views_stand_free_and_hold_the_camera_as_asked() -> None:
    poses = random_views(SCENE, np.random.default_rng(0), 200, CAMERA)
    assert poses.shape == (200, 4, 4)
    for thing in SCENE.objects:
        if thing.category not in ("floor", "ceiling", "carpet") and thing.low[2] < 1.8:
            assert to_rectangle_m(poses[:, :2, 3], thing.low, thing.high).min() > 0.1, thing.name
    assert 0.5 <= poses[:, 2, 3].min() < 0.7 and 1.6 < poses[:, 2, 3].max() <= 1.8
    pitch_deg = np.rad2deg(np.arcsin(poses[:, 2, 2]))
    assert pitch_deg.min() >= -35.01 and pitch_deg.max() <= 15.01 and np.ptp(pitch_deg) > 30
    assert np.linalg.det(poses[:, :3, :3]) == pytest.approx(np.ones(200))


def test_cameras_in_hands_are_higher_and_nearer_to_things_and_look_down() -> None:
    on_robot, in_hands = (
        random_views(SCENE, np.random.default_rng(0), 200, CAMERA, stance) for stance in (ON_A_ROBOT, IN_HANDS)
    )
    np.testing.assert_array_equal(on_robot, random_views(SCENE, np.random.default_rng(0), 200, CAMERA))
    assert in_hands[:, 2, 3].min() >= 1.15 and in_hands[:, 2, 3].max() <= 1.7
    assert in_hands[:, 2, 2].mean() < on_robot[:, 2, 2].mean() - 0.05


def test_random_views_look_at_things_more_often_than_chance() -> None:
    scene = building([*room(12.0, 12.0), ("box", box((5.7, 5.7, 0.0), (6.3, 6.3, 0.8), PLAIN))])
    poses = random_views(scene, np.random.default_rng(0), 300, CAMERA)
    local = np.einsum("nij,ni->nj", poses[:, :3, :3], np.array([6.0, 6.0, 0.4]) - poses[:, :3, 3])
    u = CAMERA.project(np.where(local[:, 2:] > 0.2, local, np.nan))[:, 0]
    assert ((u > 0) & (u < 320)).mean() > 0.5


def test_random_views_are_spread_over_all_floors() -> None:
    height = random_views(two_floors(), np.random.default_rng(0), 60, CAMERA)[:, 2, 3]
    assert (height > 3.0).any() and (height < 2.0).any()


def test_a_part_of_a_mesh_that_is_joined_changes_nothing() -> None:
    """One object of many boxes stands in the way just as the boxes do."""
    boxes = [box((1, 1, 0), (1.4, 1.4, 1), PLAIN), box((3, 2, 0), (3.4, 2.4, 1), PLAIN)]
    one = free_space(building([*room(5.0, 4.0), ("thing", joined(boxes))]))
    two = free_space(building([*room(5.0, 4.0), ("thing", boxes[0]), ("thing", boxes[1])]))
    assert np.array_equal(one.free, two.free)
