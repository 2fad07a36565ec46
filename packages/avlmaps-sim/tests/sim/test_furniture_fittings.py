"""Kitchens, bathrooms, appliances and electronics: worktops, and a few parts by themselves."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps_sim.furniture import families
from avlmaps_sim.furniture.electronics import key_field
from avlmaps_sim.furniture.fittings import face, front, front_style, open_bowl, outline, shell, spindle, tap
from avlmaps_sim.mesh import Material, joined
from helpers.furniture_pieces import pieces_of

_grey = Material()


@pytest.mark.parametrize("name", families("kitchen counter"))
def test_worktops_lie_at_the_height_of_a_kitchen(name: str) -> None:
    for piece in pieces_of("kitchen counter", name):
        assert any(0.8 <= top.z <= 1.0 for top in piece.supports)


@given(st.floats(0.05, 2.0), st.floats(0.05, 2.0), st.floats(2.0, 30.0))
def test_an_outline_fills_more_of_its_rectangle_the_squarer_it_is(length: float, width: float, power: float) -> None:
    def area(flat: np.ndarray) -> float:
        x, y = flat.T
        return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))

    flat = outline(length, width, power, 64)
    assert (np.abs(flat) <= np.array([length, width]) / 2 + 1e-9).all()
    share = area(flat) / (length * width)
    assert area(outline(length, width, 2.0, 64)) / (length * width) - 1e-9 <= share <= 1.0
    assert share >= np.pi / 4 * 0.99


def test_a_round_shell_has_the_surface_of_a_cylinder() -> None:
    flat = outline(0.4, 0.4, 2.0, 200)
    skin = shell([(flat, 0.0), (flat, 1.0)], _grey)
    assert skin.areas_m2().sum() == pytest.approx(np.pi * 0.4 + 2 * np.pi * 0.04, rel=1e-3)


def test_a_bowl_is_open_above() -> None:
    levels = [(outline(0.4, 0.4), 0.5), (outline(0.2, 0.2), 0.3)]
    bowl = joined(open_bowl(levels, _grey))
    flat_up = np.abs(bowl.normals()[:, 2]) > 0.999
    assert (bowl.corners()[flat_up][..., 2] < 0.31).all()


def test_a_face_shows_its_picture_upright_and_unmirrored_to_who_looks_at_the_front() -> None:
    mesh = face(0.1, (-1.0, 0.0), (1.0, 1.0), _grey, fill=True)
    corners, uv = mesh.corners().reshape(-1, 3), mesh.uv.reshape(-1, 2)
    for y, z, u, v in ((-1.0, 0.0, 0.0, 1.0), (1.0, 1.0, 1.0, 0.0)):  # +y is on the right of who looks along -x
        at = np.isclose(corners[:, 1], y) & np.isclose(corners[:, 2], z)
        np.testing.assert_allclose(uv[at], np.tile([u, v], (at.sum(), 1)), atol=1e-6)


def test_a_spindle_turns_about_the_axis_along_x() -> None:
    mesh = spindle([(0.1, 0.0), (0.05, 0.2)], _grey, 0.3, 0.7, sides=12)
    radius = np.hypot(mesh.vertex[:, 1] - 0.3, mesh.vertex[:, 2] - 0.7)
    rim = mesh.vertex[:, 0] == np.float32(0.2)
    assert radius[rim].max() == pytest.approx(0.05, abs=1e-5)
    assert radius.max() == pytest.approx(0.1, abs=1e-5)


@pytest.mark.few(7)
@pytest.mark.parametrize("opens", ["left", "right", "drawer"])
@pytest.mark.parametrize("profile", ["flat", "shaker", "panel", "planks", "glass"])
@pytest.mark.parametrize("handle", ["bar", "knob", "cup", "strip", "none"])
def test_a_front_stays_within_its_opening_and_only_its_handle_stands_out(profile: str, handle: str, opens: str) -> None:
    style = front_style(np.random.default_rng(1), profile, handle)
    mesh = joined(front(style, 0.5, (-0.3, 0.1), (0.3, 0.8), opens))
    assert (mesh.low >= np.array([0.5 - 1e-6, -0.3, 0.1])).all()
    assert (mesh.high[1:] <= np.array([0.3, 0.8])).all()
    assert (mesh.high[0] > 0.5 + style.thick_m + 0.004) == (handle != "none")


@pytest.mark.parametrize("seed", range(8))
def test_a_tap_pours_in_front_of_its_foot_and_below_its_highest_point(seed: int) -> None:
    mesh = joined(tap(np.random.default_rng(seed), (0.0, 0.0, 0.0), 0.15, 0.25, _grey))
    assert 0.12 < mesh.high[0] < 0.19
    assert mesh.low[2] + 1e-6 >= 0.0 and mesh.high[2] < 0.3
    pour = mesh.vertex[mesh.vertex[:, 0] > 0.13]
    assert pour[:, 2].min() > 0.05


@pytest.mark.parametrize("rise", [0.002, 0.008])
def test_keys_stay_in_their_field_and_the_nearest_row_holds_a_space_bar(rise: float) -> None:
    low, high = (-0.06, -0.2), (0.06, 0.2)
    keys = joined(key_field(np.random.default_rng(0), low, high, 0.01, 5, 15, _grey, rise))
    assert (keys.low[:2] >= np.array(low)).all() and (keys.high[:2] <= np.array(high)).all()
    top = keys.corners()[np.isclose(keys.corners()[..., 2], 0.01 + rise, atol=1e-6).all(axis=1)]
    length = np.ptp(top[..., 1], axis=1)
    bar = top[length > 0.15]
    assert len(bar) == 2
    assert (bar[..., 0] > 0.03).all()
