"""Furniture of every category: laws that every family keeps, whatever its seed."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps_sim.furniture import families, make
from helpers.furniture_pieces import every_piece, pieces_of

# Category: least and greatest largest extent, greatest height (metres), least number of families.
RANGE = {
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
    "person": (0.5, 2.2, 2.0, 5), "clothing": (0.15, 1.5, 1.4, 6), "paper": (0.03, 1.6, 1.5, 6),
    "shower curtain": (1.0, 2.1, 2.1, 3),
}  # fmt: skip
# The least and the greatest depth, width and height that a person would still take for one, metres.
SIZES = {
    "chair": ((0.36, 0.34, 0.66), (0.8, 0.76, 1.32)), "armchair": ((0.5, 0.5, 0.6), (1.9, 1.3, 1.3)),
    "office chair": ((0.5, 0.5, 0.8), (0.95, 0.95, 1.45)), "stool": ((0.22, 0.22, 0.36), (0.62, 0.62, 1.25)),
    "bench": ((0.25, 0.7, 0.38), (0.85, 1.9, 1.1)), "sofa": ((0.55, 0.9, 0.55), (2.8, 3.6, 1.25)),
    "ottoman": ((0.36, 0.36, 0.25), (1.15, 1.4, 0.75)), "dining table": ((0.65, 0.28, 0.68), (1.6, 2.6, 0.84)),
    "coffee table": ((0.4, 0.4, 0.28), (1.5, 1.8, 0.58)), "desk": ((0.38, 0.7, 0.66), (2.0, 1.95, 1.65)),
    "side table": ((0.26, 0.26, 0.4), (0.8, 0.9, 0.75)), "console table": ((0.24, 0.7, 0.7), (0.75, 1.75, 0.96)),
    "bed": ((1.85, 0.8, 0.35), (2.75, 2.7, 2.3)), "crib": ((0.7, 0.4, 0.5), (1.65, 0.95, 1.75)),
    "bunk bed": ((1.9, 0.85, 1.4), (2.4, 1.6, 2.1)), "nightstand": ((0.28, 0.3, 0.38), (0.95, 0.75, 0.8)),
    "wardrobe": ((0.36, 0.42, 1.35), (1.5, 3.1, 2.7)), "chest of drawers": ((0.34, 0.36, 0.4), (0.95, 2.1, 2.2)),
    "bookshelf": ((0.2, 0.3, 0.55), (1.2, 3.0, 2.5)), "cabinet": ((0.28, 0.33, 0.6), (1.35, 2.4, 2.4)),
    "tv cabinet": ((0.33, 0.75, 0.33), (1.1, 2.95, 2.25)), "shoe rack": ((0.15, 0.45, 0.35), (0.65, 1.2, 1.75)),
    "wall shelf": ((0.14, 0.25, 0.01), (0.36, 2.4, 1.9)), "filing cabinet": ((0.4, 0.34, 0.45), (1.05, 1.3, 1.55)),
    "coat rack": ((0.05, 0.35, 0.06), (0.9, 1.4, 2.15)),
}  # fmt: skip
COMMON = ("chair", "sofa", "armchair", "dining table", "desk", "coffee table", "bed", "wardrobe", "cabinet",
          "bookshelf", "nightstand", "chest of drawers", "tv cabinet")  # fmt: skip
SMALL = ("book", "bottle", "cup", "bowl", "pot", "shoes", "tableware", "ball", "dumbbell", "candle", "cushion")
PEOPLE = ("person", "clothing", "paper", "shower curtain")
EVERY = (*RANGE, *SIZES)
FAMILIES = [(category, name) for category in EVERY for name in families(category)]


@pytest.mark.few(18)
@pytest.mark.parametrize("category", EVERY)
def test_a_piece_stands_centred_in_the_size_of_its_kind_and_few_triangles(category: str) -> None:
    shortest, longest, tallest, _ = RANGE.get(category, (0.0, np.inf, np.inf, 0))
    least, greatest = SIZES.get(category, ((0.0,) * 3, (np.inf,) * 3))
    most = 1200 if category in SMALL else 3500 if category in PEOPLE else 2600 if category in SIZES else 2000
    for piece in every_piece(category):
        mesh = piece.mesh
        assert piece.category == category
        assert np.isfinite(mesh.vertex).all() and np.isfinite(mesh.uv).all()
        assert abs(float(mesh.low[2])) < 1e-4
        np.testing.assert_allclose((mesh.low + mesh.high)[:2], 0.0, atol=1e-3)
        assert shortest <= mesh.size.max() <= longest and mesh.size[2] <= tallest, mesh.size
        assert (mesh.size >= least).all() and (mesh.size <= greatest).all(), mesh.size
        assert 4 <= len(mesh.triangle) <= most
        assert float(mesh.areas_m2().sum()) > (0.05 if category in SIZES else 0.0)


@pytest.mark.few(12)
@pytest.mark.parametrize("category", EVERY)
def test_things_can_stand_on_the_supports_of_a_piece(category: str) -> None:
    for piece in every_piece(category):
        for top in piece.supports:
            assert top.high[0] > top.low[0] and top.high[1] > top.low[1] and top.clearance_m > 0
            assert (np.array(top.low) >= piece.mesh.low[:2] - 1e-3).all()
            assert (np.array(top.high) <= piece.mesh.high[:2] + 1e-3).all()
            near = np.abs(piece.mesh.vertex[:, 2] - top.z) < 0.012
            assert near.any(), f"nothing of the piece lies at the support's height of {top.z:.3f} m"


@given(st.sampled_from(FAMILIES), st.integers(0, 2**31))
def test_the_seed_alone_decides_the_piece(pair: tuple[str, str], seed: int) -> None:
    first, again = (make(pair[0], np.random.default_rng(seed), name=pair[1]) for _ in range(2))
    for part in ("vertex", "uv", "triangle"):
        np.testing.assert_array_equal(getattr(first.mesh, part), getattr(again.mesh, part))
    assert [one.colour for one in first.mesh.materials] == [one.colour for one in again.mesh.materials]
    assert (first.light, first.supports) == (again.light, again.supports)


@pytest.mark.few(18)
@pytest.mark.parametrize("category", EVERY)
def test_families_are_built_differently_and_some_are_held_out(category: str) -> None:
    names, shown, kept = (families(category, which) for which in ("all", "training", "held-out"))
    assert (
        len(set(names)) == len(names) >= (RANGE[category][3] if category in RANGE else 5 if category in COMMON else 2)
    )
    assert {*shown, *kept} == {*names} and not {*shown} & {*kept}
    if len(names) >= (4 if category in SIZES else 3):
        assert 1 <= len(kept) <= 2 <= len(shown)
    made = {name: pieces_of(category, name) for name in names}
    assert len({tuple(np.round(pieces[0].mesh.areas_m2(), 6)) for pieces in made.values()}) == len(made)
    for name, pieces in made.items():
        spread_m = np.ptp([piece.mesh.size for piece in pieces], axis=0).max()
        assert spread_m > (0.01 if category in SIZES else 0.005), f"every {name} has the same size"


@pytest.mark.few(7)
@pytest.mark.parametrize(("category", "name"), [(c, n) for c, n in FAMILIES if n.startswith("wall ")])
def test_what_hangs_touches_the_wall_with_a_surface(category: str, name: str) -> None:
    for piece in pieces_of(category, name):
        at_wall = piece.mesh.vertex[:, 0] < piece.mesh.low[0] + 0.012
        assert at_wall.sum() >= 3
