import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps_sim.furniture import families, make
from avlmaps_sim.furniture.decor import CARPET_SHAPES, carpet
from avlmaps_sim.furniture.drapes import CURTAIN_STYLES, curtain
from avlmaps_sim.furniture.openings import DOOR_STYLES, WINDOW_STYLES, door, folding_door, window
from avlmaps_sim.furniture.recipe_helpers import blade, cloth, rim, strut, turned_ring
from avlmaps_sim.mesh import Material
from helpers.furniture_pieces import every_piece, pieces_of

# Category: least and greatest largest extent, greatest height (metres), least number of families.
_RANGE = {
    "picture": (0.08, 3.0, 2.2, 7), "lamp": (0.1, 2.3, 2.3, 7), "chandelier": (0.2, 2.3, 1.9, 7),
    "curtain": (0.6, 3.9, 2.9, 5), "carpet": (0.4, 4.2, 0.02, 5), "plant": (0.08, 2.8, 2.8, 8),
    "vase": (0.08, 1.0, 1.0, 4), "cushion": (0.28, 1.0, 0.7, 3), "blinds": (0.3, 2.6, 2.6, 4),
    "candle": (0.07, 0.8, 0.8, 3), "door": (1.9, 2.7, 2.7, 7), "window": (0.5, 2.9, 2.7, 6),
    "folding door": (1.9, 3.2, 2.7, 4), "book": (0.1, 0.8, 0.4, 3), "bottle": (0.08, 0.5, 0.4, 2),
    "cup": (0.05, 0.3, 0.3, 4), "bowl": (0.1, 0.4, 0.3, 2), "pot": (0.1, 0.6, 0.4, 2),
    "box": (0.2, 1.6, 1.6, 4), "basket": (0.15, 0.8, 0.7, 3), "trash can": (0.2, 1.3, 1.2, 5),
    "bag": (0.2, 1.2, 1.2, 4), "toy": (0.08, 1.2, 1.1, 4), "shoes": (0.2, 0.5, 0.4, 3),
    "laundry basket": (0.35, 1.1, 1.0, 2), "tableware": (0.1, 0.7, 0.45, 4), "piano": (0.9, 2.4, 2.2, 3),
    "guitar": (0.4, 1.4, 1.4, 3), "fitness equipment": (1.0, 2.5, 2.5, 7), "dumbbell": (0.12, 2.3, 0.5, 3),
    "ball": (0.1, 1.1, 0.85, 3), "bicycle": (0.7, 2.0, 1.3, 3), "pool table": (1.8, 3.0, 1.0, 2),
    "rocking horse": (0.5, 1.3, 1.1, 2), "baby stroller": (0.5, 1.4, 1.3, 3), "mat": (0.5, 3.2, 0.2, 3),
    "play tent": (0.8, 2.0, 2.0, 3), "aquarium": (0.15, 1.6, 1.6, 2), "pet bed": (0.3, 1.8, 1.8, 3),
    "whiteboard": (0.6, 2.8, 2.1, 2), "partition": (0.9, 4.0, 2.5, 3), "locker": (0.6, 2.5, 2.4, 3),
    "water dispenser": (0.7, 1.6, 1.6, 3),
}  # fmt: skip
_SMALL = ("book", "bottle", "cup", "bowl", "pot", "shoes", "tableware", "ball", "dumbbell", "candle", "cushion")
_ALL = [(category, name) for category in _RANGE for name in families(category)]
_grey = Material()


@pytest.mark.few(8)
@pytest.mark.parametrize("category", _RANGE)
def test_a_piece_stands_centred_in_plausible_size_and_few_triangles(category: str) -> None:
    least, most, tallest, _ = _RANGE[category]
    for piece in every_piece(category):
        low, high = piece.mesh.low, piece.mesh.high
        assert np.isfinite(piece.mesh.vertex).all() and np.isfinite(piece.mesh.uv).all()
        np.testing.assert_allclose([low[2], *(low + high)[:2]], 0.0, atol=2e-3)
        assert least <= float(piece.mesh.size.max()) <= most
        assert float(piece.mesh.size[2]) <= tallest
        assert 4 <= len(piece.mesh.triangle) <= (1200 if category in _SMALL else 2000)
        assert piece.category == category


@pytest.mark.few(6)
@pytest.mark.parametrize(("category", "name"), [pair for pair in _ALL if pair[0] in ("lamp", "chandelier", "candle")])
def test_what_shines_says_where_within_its_own_box(category: str, name: str) -> None:
    for piece in pieces_of(category, name):
        assert piece.light
        place = np.array(piece.light)
        assert (place >= piece.mesh.low - 0.06).all() and (place <= piece.mesh.high + 0.06).all()


@pytest.mark.few(5)
@pytest.mark.parametrize("category", _RANGE)
def test_families_differ_and_some_are_held_out(category: str) -> None:
    names = families(category)
    assert len(set(names)) == len(names) >= _RANGE[category][3]
    assert set(families(category, "training")).isdisjoint(families(category, "held-out"))
    if len(names) >= 3:
        assert 1 <= len(families(category, "held-out")) <= 2
    shapes = {tuple(np.round(make(category, np.random.default_rng(0), name=name).mesh.areas_m2(), 7)) for name in names}
    assert len(shapes) == len(names)


@given(st.sampled_from(_ALL), st.integers(0, 2**31))
def test_the_seed_alone_decides_the_piece(pair: tuple[str, str], seed: int) -> None:
    first, second = (make(pair[0], np.random.default_rng(seed), name=pair[1]) for _ in range(2))
    np.testing.assert_array_equal(first.mesh.vertex, second.mesh.vertex)
    np.testing.assert_array_equal(first.mesh.uv, second.mesh.uv)
    assert first.light == second.light


@given(st.integers(0, 2**31), st.floats(0.65, 2.0), st.floats(1.9, 2.4), st.floats(0.08, 0.35))
def test_a_closed_door_fills_its_hole_and_keeps_within_its_trims(
    seed: int, width: float, height: float, wall: float
) -> None:
    mesh = door(np.random.default_rng(seed), width, height, wall).mesh
    assert width <= mesh.size[1] <= width + 0.21
    assert height <= mesh.high[2] <= height + 0.11
    assert mesh.low[2] >= 0.0
    assert abs(mesh.low[1] + mesh.high[1]) < 1e-5
    assert mesh.size[0] <= wall + 0.35  # long bar handles and planks stick out a little


def test_an_open_door_turns_into_the_room_and_leaves_the_hole_free() -> None:
    for seed in range(8):
        mesh = door(np.random.default_rng(seed), 0.9, 2.1, 0.12, open_rad=np.pi / 2).mesh
        assert mesh.high[0] > 0.7
        middle = mesh.corners().mean(axis=1)
        inside = (np.abs(middle[:, 1]) < 0.25) & (middle[:, 2] < 1.9) & (np.abs(middle[:, 0]) < 0.06)
        assert not inside.any()


@given(st.integers(0, 2**31), st.floats(0.5, 2.6), st.floats(0.5, 2.4), st.floats(0.08, 0.4))
def test_a_window_closes_its_hole(seed: int, width: float, height: float, wall: float) -> None:
    mesh = window(np.random.default_rng(seed), width, height, wall).mesh
    assert width - 1e-5 <= mesh.size[1] <= width + 0.26
    assert height - 1e-5 <= mesh.high[2] <= height + 0.11
    assert mesh.low[2] >= -0.11  # casing and sill only
    pane_m2 = 2 * mesh.areas_m2()[np.abs(mesh.normals()[:, 0]) > 0.999].max()
    assert 0.5 * width * height < pane_m2 < width * height
    assert mesh.low[0] >= -wall / 2 - 0.045


@given(st.integers(0, 2**31), st.floats(0.7, 2.6), st.floats(1.9, 2.4), st.floats(0.08, 0.3))
def test_a_folding_door_keeps_to_its_hole(seed: int, width: float, height: float, wall: float) -> None:
    mesh = folding_door(np.random.default_rng(seed), width, height, wall).mesh
    assert width <= mesh.size[1] <= width + 0.21
    assert height <= mesh.high[2] <= height + 0.11


@pytest.mark.parametrize("which", ["training", "held-out"])
def test_styles_come_from_the_asked_set(which: str) -> None:
    for seed in range(6):
        rng = np.random.default_rng(seed)
        assert door(rng, 0.8, 2.0, 0.1, which=which).family in DOOR_STYLES[which]  # type: ignore[arg-type, index]
        assert window(rng, 1.0, 1.0, 0.2, which=which).family in WINDOW_STYLES[which]  # type: ignore[arg-type, index]
        assert curtain(rng, 1.5, 2.2, which=which).family in CURTAIN_STYLES[which]  # type: ignore[arg-type, index]


@given(st.integers(0, 2**31), st.floats(0.6, 3.2), st.floats(0.6, 2.8))
def test_a_curtain_hangs_before_the_wall_between_hem_and_rod(seed: int, width: float, height: float) -> None:
    mesh = curtain(np.random.default_rng(seed), width, height).mesh
    assert mesh.low[0] >= -1e-6 and mesh.high[0] < 0.3
    assert mesh.low[2] == pytest.approx(0.0, abs=0.02)
    assert height <= mesh.high[2] + 0.02 <= height + 0.21
    assert width * 0.95 <= mesh.size[1] <= width * 1.2 + 0.15


@pytest.mark.parametrize("shape", CARPET_SHAPES["training"] + CARPET_SHAPES["held-out"])
def test_a_carpet_has_the_asked_measures_and_five_to_fifteen_millimetres(shape: str) -> None:
    for seed in range(4):
        size = carpet(np.random.default_rng(seed), 2.0, 1.2, shape).mesh.size
        fringe = 0.17 if shape == "fringed" else 1e-3
        assert 2.0 - 1e-3 <= size[0] <= 2.0 + fringe
        assert size[1] == pytest.approx(1.2, abs=1e-3)
        assert 0.005 <= size[2] <= 0.0175


def test_a_frame_has_the_area_of_its_bars() -> None:
    frame = rim((0.0, 0.0), (1.0, 2.0), 0.1, (0.0, 0.05), _grey)
    front = np.isclose(frame.corners()[..., 0], 0.05).all(axis=1)
    assert frame.areas_m2()[front].sum() == pytest.approx(1.0 * 2.0 - 0.8 * 1.8, rel=1e-5)


@given(st.tuples(*[st.floats(-1, 1)] * 6), st.floats(0.01, 0.1), st.floats(0.01, 0.1))
def test_a_strut_is_a_closed_bar_of_its_length(ends: tuple[float, ...], width: float, depth: float) -> None:
    start, end = ends[:3], ends[3:]
    long = float(np.linalg.norm(np.subtract(end, start)))
    if long < 0.05:
        return
    area = strut(start, end, width, depth, _grey).areas_m2().sum()  # type: ignore[arg-type]
    assert area == pytest.approx(2 * long * (width + depth) + 2 * width * depth, rel=1e-3)


def test_a_ring_is_open_at_both_ends() -> None:
    ring = turned_ring([(1.0, 0.0), (1.0, 0.5)], _grey, sides=64)
    assert ring.areas_m2().sum() == pytest.approx(2 * np.pi * 0.5, rel=1e-2)


def test_cloth_that_is_filled_shows_its_picture_once_and_upright() -> None:
    grid = np.array([[(0.0, y, z) for z in (0.0, 1.0, 2.0)] for y in (0.0, 3.0)])
    sheet = cloth(grid, _grey, fill=True)
    top = np.isclose(sheet.corners()[..., 2], 2.0)
    assert np.allclose(sheet.uv[top][:, 1], 0.0) and sheet.uv.max() == 1.0 and sheet.uv.min() == 0.0


def test_a_blade_is_as_wide_as_told() -> None:
    leaf = blade([(0.0, 0.0, 0.0), (0.0, 0.0, 1.0)], [0.2, 0.4], (1.0, 0.0, 0.0), _grey)
    assert leaf.areas_m2().sum() == pytest.approx(0.3, rel=1e-5)
