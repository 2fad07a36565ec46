"""Homes and offices made by rule, with people in them, and the names that they are opened by; each is made once."""

from functools import cache

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy import ndimage

from avlmaps_sim import scenes
from avlmaps_sim.free_space import free_space
from avlmaps_sim.furniture import families, make
from avlmaps_sim.homes import lived_in, make_home, make_office
from avlmaps_sim.homes.doors import _opened  # pyright: ignore[reportPrivateUsage]
from avlmaps_sim.homes.layout import cut, floor_of, home_programme
from avlmaps_sim.homes.lived_in import with_curtains_apart
from avlmaps_sim.homes.plan import (
    OUTSIDE,
    Room,
    Wall,
    area_m2,
    corners_of,
    half,
    inside,
    overlapping,
    rectangle,
    shrunk,
    walls_between,
    widths_m,
)
from avlmaps_sim.scene import Scene, SceneBuilder
from avlmaps_sim.scenes import SceneError, open_scene

SEEDS = (0, 3, 63)
SEATS = {"chair", "office chair", "stool", "bench", "armchair", "sofa"}
TABLES = {"dining table", "desk", "kitchen island", "coffee table"}
LYING = {"carpet", "mat"}
ADDED = ("person", "clothing", "paper", "shower curtain")
ONCE = {"house": cache(make_home), "office": cache(make_office)}


def home(seed: int) -> Scene:
    return ONCE["house"](seed, "training")


@pytest.fixture(autouse=True)
def _buildings_are_opened_as_they_were_made(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let a name open the building that another test made of the same seed and families."""
    for kind, maker in ONCE.items():
        monkeypatch.setitem(scenes._MAKERS, kind, maker)  # pyright: ignore[reportPrivateUsage]


@pytest.fixture(
    params=["house:0", "office:1", *(pytest.param(f"house:{seed}", marks=pytest.mark.nightly) for seed in SEEDS[1:])],
    scope="module",
)
def scene(request: pytest.FixtureRequest) -> Scene:
    kind, _, seed = request.param.partition(":")
    return home(int(seed)) if kind == "house" else ONCE["office"](int(seed), "training")


def footprints(scene: Scene) -> dict[int, np.ndarray]:
    """Oriented rectangles round what stands on a floor, tightened to the piece's own heading."""
    out = {}
    corners = scene.mesh.corners()
    for index, thing in enumerate(scene.objects):
        if thing.category in {"wall", "floor", "ceiling", "door", "window", "folding door", *LYING} or thing.area < 0:
            continue
        c, s = np.cos(thing.heading_rad), np.sin(thing.heading_rad)
        flat = corners[scene.instance == index].reshape(-1, 3)[:, :2].astype(float) @ np.array([[c, -s], [s, c]])
        low, high = flat.min(axis=0), flat.max(axis=0)
        middle = np.array([[c, -s], [s, c]]) @ ((low + high) / 2)
        out[index] = corners_of(middle, (high - low) / 2, np.float64(thing.heading_rad))
    return out


def test_the_same_seed_makes_the_same_home() -> None:
    again = make_home(SEEDS[0], "training")
    first = home(SEEDS[0])
    np.testing.assert_array_equal(again.mesh.vertex, first.mesh.vertex)
    np.testing.assert_array_equal(again.instance, first.instance)
    assert again.objects == first.objects
    assert again.lights == first.lights


@pytest.mark.nightly
def test_other_seeds_make_other_homes() -> None:
    plans = {tuple((area.kind, round(float(area_m2(area.polygon)), 3)) for area in home(seed).areas) for seed in SEEDS}
    assert len(plans) == len(SEEDS)


def test_a_robot_reaches_every_area(scene: Scene) -> None:
    for number, floor_m in enumerate(sorted({area.floor_m for area in scene.areas})):
        space = free_space(scene, radius_m=0.25, floor=number)
        label, _ = ndimage.label(space.free, np.ones((3, 3)))
        parts, places = label[space.free], space.middles()
        common = set(parts.tolist())
        for area in scene.areas:
            if area.floor_m == floor_m:
                common &= set(parts[area.contains(places)].tolist())
        assert common, f"no part of the free floor at {floor_m} m reaches all of {[a.name for a in scene.areas]}"


def test_no_two_pieces_meet(scene: Scene) -> None:
    """Boxes of pieces keep apart, but for chairs pushed under tables and small things standing on tops."""
    boxes = footprints(scene)
    index = list(boxes)
    meet = overlapping(np.array([boxes[i] for i in index]), np.array([boxes[i] for i in index]), 0.006)
    for p, q in np.argwhere(np.triu(meet, 1)):
        a, b = scene.objects[index[p]], scene.objects[index[q]]
        if a.low[2] >= b.high[2] - 0.01 or b.low[2] >= a.high[2] - 0.01:
            continue
        if {a.category, b.category} & SEATS and {a.category, b.category} & TABLES:
            continue
        inner, outer = sorted((a, b), key=lambda thing: float(np.prod(thing.size)))
        stands_on = inner.low[2] > outer.low[2] + 0.02  # on a top or a shelf: inside the box of what carries it
        assert stands_on, f"{a.name} and {b.name} meet in {scene.name} at {a.centre} and {b.centre}"


def test_pieces_lie_in_their_areas(scene: Scene) -> None:
    for index, corners in footprints(scene).items():
        thing = scene.objects[index]
        area = scene.areas[thing.area]
        assert inside(area.polygon, corners, 0.01).all(), f"{thing.name} stands out of {area.name}"
        assert area.floor_m - 0.01 <= thing.low[2] and thing.high[2] <= area.ceiling_m + 0.01, thing.name


def test_what_hangs_on_walls_crosses_no_opening(scene: Scene) -> None:
    # The box of a door that stands open holds more than its doorway.
    openings = [o for o in scene.objects if o.category in {"door", "window"} and min(o.size[:2]) < 0.45]
    assert openings
    for thing in scene.objects:
        if thing.category not in {"picture", "mirror", "clock", "air conditioner"} or thing.low[2] < 0.5:
            continue
        for hole in openings:
            apart = any(thing.low[k] >= hole.high[k] - 0.02 or hole.low[k] >= thing.high[k] - 0.02 for k in range(3))
            assert apart or thing.category == hole.category, f"{thing.name} crosses {hole.name} in {scene.name}"


def test_every_area_is_lit_and_has_a_floor(scene: Scene) -> None:
    floors = {thing.area for thing in scene.objects if thing.category == "floor"}
    lit = {scene.area_at(light.position) for light in scene.lights}
    assert floors >= set(range(len(scene.areas)))
    assert lit >= set(range(len(scene.areas)))


@pytest.mark.nightly
def test_homes_have_what_people_need_and_the_same_things_in_several_rooms() -> None:
    kinds = {area.kind for seed in SEEDS for area in home(seed).areas}
    assert {"kitchen", "bathroom", "bedroom", "living room"} <= kinds
    for seed in SEEDS:
        where: dict[str, set[int]] = {}
        for thing in home(seed).objects:
            where.setdefault(thing.category, set()).add(thing.area)
        twice = [
            c for c, areas in where.items() if len(areas - {-1}) > 1 and c not in {"floor", "ceiling", "door", "window"}
        ]
        assert len(twice) >= 3


def test_training_homes_hold_no_shape_that_is_held_out() -> None:
    assert open_scene("house:0:training").objects == home(SEEDS[0]).objects
    for thing in home(SEEDS[0]).objects:
        if thing.family and thing.category not in {"wall", "floor", "ceiling"}:
            held_out = set(families(thing.category, "held-out")) - set(families(thing.category, "training"))
            assert thing.family not in held_out


@given(length_m=st.floats(1.7, 9.0), seed=st.integers(0, 999))
@example(length_m=4.169982735479752, seed=63)
def test_a_gap_of_an_open_plan_fits_into_its_wall(length_m: float, seed: int) -> None:
    wall = Wall(np.zeros(2), np.array([length_m, 0.0]), 0, 1)
    rooms = [Room("kitchen", rectangle(0, 0, 2, 2)), Room("living room", rectangle(0, 0, 2, 2))]
    for hole in _opened(np.random.default_rng(seed), wall, rooms).holes:
        assert hole.at_m - hole.width_m / 2 > 0.14
        assert hole.at_m + hole.width_m / 2 < length_m - 0.14


@given(st.integers(0, 10_000))
def test_rooms_tile_their_outline(seed: int) -> None:
    """The rooms cover the outline without overlap, and each stretch of a side has one wall."""
    rng = np.random.default_rng(seed)
    programme = home_programme(rng)
    polygons = [polygon for _, polygon in floor_of(rng, programme)]
    walls = walls_between(polygons)
    around = sum(float(np.linalg.norm(p - np.roll(p, 1, axis=0), axis=1).sum()) for p in polygons)
    covered = sum(wall.length_m * (1 if wall.right == OUTSIDE else 2) for wall in walls)
    assert covered == pytest.approx(around, abs=0.05 * len(polygons))
    places = np.random.default_rng(0).uniform(-30, 30, (4000, 2))
    assert np.max(np.sum([inside(p, places, -1e-6) for p in polygons], axis=0)) <= 1


@given(st.floats(0.1, 0.9), st.floats(-3.1, 3.1), st.integers(0, 99))
def test_a_cut_gives_each_part_its_share(share: float, heading_rad: float, seed: int) -> None:
    polygon = rectangle(0.0, 0.0, 6.0, 4.0)
    polygon = half(polygon, np.array([5.0, 3.0]), np.array([0.8, 0.6]) if seed % 2 else np.array([0.0, 1.0]))
    first, second = cut(polygon, share, np.array([np.cos(heading_rad), np.sin(heading_rad)]))
    assert area_m2(first) == pytest.approx(share * area_m2(polygon), rel=1e-3)
    assert area_m2(first) + area_m2(second) == pytest.approx(area_m2(polygon))


def test_shrinking_moves_every_side_inwards() -> None:
    np.testing.assert_allclose(widths_m(shrunk(rectangle(0.0, 0.0, 4.0, 3.0), 0.25)), (2.5, 3.5))


@given(st.floats(-2, 2), st.floats(-2, 2), st.floats(-3, 3))
def test_rectangles_overlap_as_their_points_do(x: float, y: float, heading_rad: float) -> None:
    a = corners_of(np.zeros((1, 2)), np.array([[1.0, 0.5]]), np.zeros(1))
    b = corners_of(np.array([[x, y]]), np.array([[0.6, 0.3]]), np.array([heading_rad]))
    grid = np.stack(np.meshgrid(np.linspace(-1, 1, 81), np.linspace(-0.5, 0.5, 41)), axis=-1).reshape(-1, 2)
    shared = inside(b[0], grid, -0.03).any()
    if shared:
        assert overlapping(a, b)[0, 0]
    if not inside(b[0], grid, 0.05).any():
        assert not overlapping(a, b)[0, 0]


@pytest.mark.few(2)
@pytest.mark.parametrize("name", ["house:0:training", "house:3:held-out", "house:0"])
def test_a_building_is_named_by_what_opens_it_again(name: str) -> None:
    scene = open_scene(name)
    assert scene.name == name
    assert open_scene(scene.name).objects == scene.objects


@pytest.mark.parametrize(
    ("spec", "said"),
    [
        *((spec, "a scene is a text such as house:12") for spec in (None, 5)),
        *((spec, "names no seed and families") for spec in ("house:", "house:x", "office:3:neither")),
        ("nowhere.glb", "there is no scene"),
    ],
)  # fmt: skip
def test_what_is_no_name_of_a_scene_is_refused(spec: object, said: str) -> None:
    with pytest.raises(SceneError, match=said):
        open_scene(spec)  # pyright: ignore[reportArgumentType]


# With people, clothes and papers: the home stays, and what is added is where it should be.


@pytest.fixture(scope="module")
def worlds() -> list[tuple[Scene, Scene]]:
    """Return homes and an office, each as it is made and with people in it."""
    made = [home(0), ONCE["office"](1, "training")]
    return [(scene, lived_in(scene, np.random.default_rng(n), "training")) for n, scene in enumerate(made, start=1)]


def test_the_home_stays_and_things_are_added_after_it(worlds: list[tuple[Scene, Scene]]) -> None:
    for before, after in worlds:
        assert after.objects[: len(before.objects)] == before.objects
        assert {thing.category for thing in after.objects[len(before.objects) :]} <= set(ADDED)
        count = len(before.mesh.triangle)
        np.testing.assert_array_equal(after.mesh.corners()[:count], before.mesh.corners())
        assert after.areas == before.areas and after.lights == before.lights
        names = [thing.name for thing in after.objects]
        assert all(names) and len(set(names)) == len(names)
    added = {thing.category for before, after in worlds for thing in after.objects[len(before.objects) :]}
    assert {"person", "clothing", "paper"} <= added


def test_what_is_added_lies_in_the_building(worlds: list[tuple[Scene, Scene]]) -> None:
    for before, after in worlds:
        low, high = before.mesh.low - 0.5, before.mesh.high + 0.5
        for number, thing in enumerate(after.objects[len(before.objects) :], start=len(before.objects)):
            assert (np.array(thing.low) >= low).all() and (np.array(thing.high) <= high).all()
            at = after.mesh.corners()[after.instance == number].reshape(-1, 3)
            np.testing.assert_allclose(at.min(axis=0), thing.low, atol=1e-5)
            np.testing.assert_allclose(at.max(axis=0), thing.high, atol=1e-5)


def test_people_stand_or_sit_on_a_floor_or_lie_on_a_bed(worlds: list[tuple[Scene, Scene]]) -> None:
    people = [(scene, thing) for _, scene in worlds for thing in scene.objects if thing.category == "person"]
    assert people
    for scene, thing in people:
        over_floor = min(abs(thing.low[2] - area.floor_m) for area in scene.areas)
        if over_floor > 0.3:
            assert max(thing.size[:2]) > 0.9 and thing.size[2] < 0.9, "who is not on a floor lies"
        else:
            assert 0.7 < thing.size[2] < 2.2


def test_the_generator_alone_decides(worlds: list[tuple[Scene, Scene]]) -> None:
    scene, one = worlds[0]
    two = lived_in(scene, np.random.default_rng(1), "training")
    assert one.objects == two.objects
    np.testing.assert_array_equal(one.mesh.vertex, two.mesh.vertex)


def test_the_cloth_of_a_tub_becomes_a_shower_curtain() -> None:
    builder = SceneBuilder("bath")
    piece = make("bathtub", np.random.default_rng(2), name="with shower curtain")
    builder.add("bathtub", piece.mesh, family=piece.family)
    builder.add("bathtub", make("bathtub", np.random.default_rng(2), name="built in").mesh.moved(x=3.0))
    scene = with_curtains_apart(builder.build())
    assert [thing.category for thing in scene.objects] == ["bathtub", "bathtub", "shower curtain"]
    cloth = scene.objects[2]
    assert cloth.size[2] > 1.4 and cloth.high[0] < 2.0
    assert (scene.instance == 0).any() and (scene.instance == 2).any()


@pytest.mark.nightly
def test_a_scene_of_that_name_holds_people_and_mirrors_that_reflect() -> None:
    bare, full = open_scene("house:3:training"), open_scene("house:3:training:lived-in")
    assert full.objects[: len(bare.objects)] == bare.objects and len(full.objects) > len(bare.objects)
    assert full.mirrors and not bare.mirrors
    assert open_scene("house:3:lived-in").objects == open_scene("house:3:all:lived-in").objects


@pytest.mark.parametrize("words", ["3:lived", "lived-in", "3:lived-in:lived-in", "3:all:training"])
def test_other_words_are_refused(words: str) -> None:
    with pytest.raises(SceneError, match="lived-in"):
        open_scene(f"house:{words}")
