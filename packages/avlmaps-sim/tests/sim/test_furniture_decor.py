from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps_sim.furniture import Piece, families
from avlmaps_sim.furniture.decor import CARPET_SHAPES, carpet
from avlmaps_sim.furniture.drapes import CURTAIN_STYLES, curtain
from avlmaps_sim.furniture.openings import DOOR_STYLES, WINDOW_STYLES, door, folding_door, window
from avlmaps_sim.furniture.recipe_helpers import blade, cloth, rim, strut, turned_ring
from avlmaps_sim.mesh import Material
from helpers.furniture_pieces import pieces_of

_grey = Material()
_SHINING = [(kind, name) for kind in ("lamp", "chandelier", "candle") for name in families(kind)]


@pytest.mark.few(6)
@pytest.mark.parametrize(("category", "name"), _SHINING)
def test_what_shines_says_where_within_its_own_box(category: str, name: str) -> None:
    for piece in pieces_of(category, name):
        assert piece.light
        place = np.array(piece.light)
        assert (place >= piece.mesh.low - 0.06).all() and (place <= piece.mesh.high + 0.06).all()


@pytest.mark.parametrize("build", [door, folding_door])
@given(st.integers(0, 2**31), st.floats(0.65, 2.6), st.floats(1.9, 2.4), st.floats(0.08, 0.35))
def test_a_closed_door_fills_its_hole_and_keeps_within_its_trims(
    build: Callable[..., Piece], seed: int, width: float, height: float, wall: float
) -> None:
    mesh = build(np.random.default_rng(seed), width, height, wall).mesh
    assert width <= mesh.size[1] <= width + 0.21
    assert height <= mesh.high[2] <= height + 0.11
    assert mesh.low[2] >= 0.0
    assert abs(mesh.low[1] + mesh.high[1]) < 1e-5
    assert build is folding_door or mesh.size[0] <= wall + 0.35  # long bar handles and planks stick out a little


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
