"""Kitchens, bathrooms, appliances and electronics: what holds for every family, and a few parts by themselves."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps_sim.furniture import families, make
from avlmaps_sim.furniture.electronics import key_field
from avlmaps_sim.furniture.fittings import face, front, front_style, open_bowl, outline, shell, spindle, tap
from avlmaps_sim.mesh import Material, joined
from helpers.furniture_pieces import every_piece, pieces_of

# Category: least and greatest largest extent, greatest height (metres), least number of families.
_RANGE = {
    "kitchen counter": (0.8, 3.8, 1.7, 7), "kitchen cabinet": (0.35, 3.1, 2.4, 5), "kitchen island": (0.8, 3.0, 1.0, 3),
    "refrigerator": (0.45, 2.3, 2.3, 8), "stove": (0.3, 2.4, 2.4, 7), "microwave": (0.4, 0.8, 0.5, 3),
    "dishwasher": (0.4, 1.5, 0.95, 4), "range hood": (0.5, 1.5, 1.4, 6), "kettle": (0.15, 0.35, 0.32, 3),
    "toaster": (0.2, 0.6, 0.35, 3), "coffee machine": (0.16, 0.55, 0.5, 5), "sink": (0.3, 1.95, 1.4, 8),
    "toilet": (0.55, 2.2, 2.2, 6), "bathtub": (0.8, 2.2, 2.2, 7), "shower": (0.8, 2.2, 2.2, 5),
    "mirror": (0.15, 2.3, 2.1, 8), "towel": (0.1, 1.3, 1.2, 5), "washing machine": (0.75, 2.0, 2.0, 5),
    "radiator": (0.4, 2.2, 2.2, 6), "air conditioner": (0.4, 2.0, 2.0, 5), "fan": (0.25, 1.7, 1.7, 5),
    "vacuum cleaner": (0.28, 1.3, 1.3, 5), "fireplace": (0.6, 2.5, 2.5, 4), "ironing board": (0.65, 1.8, 1.5, 3),
    "water heater": (0.5, 2.1, 2.1, 4), "tv": (0.3, 2.0, 2.1, 7), "monitor": (0.3, 1.5, 0.85, 6),
    "laptop": (0.22, 0.5, 0.45, 4), "computer": (0.1, 1.7, 1.7, 5), "printer": (0.35, 1.3, 1.3, 4),
    "loudspeaker": (0.08, 1.7, 1.7, 7), "keyboard": (0.26, 0.5, 0.08, 3), "telephone": (0.12, 0.35, 0.3, 4),
    "clock": (0.06, 2.5, 2.5, 7),
}  # fmt: skip
_ALL = [(category, name) for category in _RANGE for name in families(category)]
_grey = Material()


@pytest.mark.few(7)
@pytest.mark.parametrize("category", _RANGE)
def test_a_piece_stands_on_the_floor_about_its_middle_within_plausible_sizes(category: str) -> None:
    least, greatest, tallest, _ = _RANGE[category]
    for piece in every_piece(category):
        mesh = piece.mesh
        assert piece.category == category
        assert np.isfinite(mesh.vertex).all() and np.isfinite(mesh.uv).all()
        assert abs(float(mesh.low[2])) < 1e-4
        np.testing.assert_allclose((mesh.low + mesh.high)[:2], 0.0, atol=1e-3)
        assert least <= mesh.size.max() <= greatest
        assert mesh.size[2] <= tallest
        assert 10 <= len(mesh.triangle) <= 2000


@pytest.mark.few(7)
@pytest.mark.parametrize("category", _RANGE)
def test_things_can_stand_on_the_supports_of_a_piece(category: str) -> None:
    for piece in every_piece(category):
        for top in piece.supports:
            assert top.high[0] > top.low[0] and top.high[1] > top.low[1] and top.clearance_m > 0
            assert (np.array(top.low) >= piece.mesh.low[:2] - 0.006).all()
            assert (np.array(top.high) <= piece.mesh.high[:2] + 0.006).all()
            near = np.abs(piece.mesh.vertex[:, 2] - top.z) < 0.03
            assert near.any(), f"nothing of the piece lies at the support's height of {top.z:.3f} m"


@pytest.mark.few(7)
@pytest.mark.parametrize("category", _RANGE)
def test_a_seed_gives_the_same_piece_again_and_another_seed_another(category: str) -> None:
    first, again, other = (make(category, np.random.default_rng(seed)).mesh for seed in (3, 3, 4))
    np.testing.assert_array_equal(first.vertex, again.vertex)
    np.testing.assert_array_equal(first.triangle, again.triangle)
    assert first.vertex.shape != other.vertex.shape or not np.allclose(first.vertex, other.vertex)


@pytest.mark.few(7)
@pytest.mark.parametrize("category", _RANGE)
def test_training_never_sees_the_held_out_families(category: str) -> None:
    every, shown, kept = (set(families(category, which)) for which in ("all", "training", "held-out"))
    assert len(every) >= _RANGE[category][3]
    assert shown | kept == every and not shown & kept
    assert len(kept) >= 1 and len(shown) >= 2


@pytest.mark.few(7)
@pytest.mark.parametrize("category", _RANGE)
def test_the_families_of_a_category_are_built_differently(category: str) -> None:
    made = {name: pieces_of(category, name) for name in families(category)}
    areas = {tuple(np.round(pieces[0].mesh.areas_m2(), 6).tolist()) for pieces in made.values()}
    assert len(areas) == len(made)
    for name, pieces in made.items():
        sizes = np.array([p.mesh.size for p in pieces])
        assert np.ptp(sizes, axis=0).max() > 0.005, f"every {name} has the same size"


@pytest.mark.few(7)
@pytest.mark.parametrize(("category", "name"), [(c, n) for c, n in _ALL if n.startswith("wall ")])
def test_what_hangs_touches_the_wall_with_a_surface(category: str, name: str) -> None:
    for piece in pieces_of(category, name):
        at_wall = piece.mesh.vertex[:, 0] < piece.mesh.low[0] + 0.012
        assert at_wall.sum() >= 3


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
