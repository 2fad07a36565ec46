"""Furniture of living rooms, bedrooms and studies: laws that every family keeps, whatever its seed."""

import zlib
from collections.abc import Iterator
from functools import cache

import numpy as np
import pytest

from avlmaps_sim.furniture import catalogue
from avlmaps_sim.furniture.catalogue import Piece

# The least and the greatest depth, width and height that a person would still take for one, metres.
SIZES = {
    "chair": ((0.36, 0.34, 0.66), (0.8, 0.76, 1.32)),
    "armchair": ((0.5, 0.5, 0.6), (1.9, 1.3, 1.3)),
    "office chair": ((0.5, 0.5, 0.8), (0.95, 0.95, 1.45)),
    "stool": ((0.22, 0.22, 0.36), (0.62, 0.62, 1.25)),
    "bench": ((0.25, 0.7, 0.38), (0.85, 1.9, 1.1)),
    "sofa": ((0.55, 0.9, 0.55), (2.8, 3.6, 1.25)),
    "ottoman": ((0.36, 0.36, 0.25), (1.15, 1.4, 0.75)),
    "dining table": ((0.65, 0.28, 0.68), (1.6, 2.6, 0.84)),
    "coffee table": ((0.4, 0.4, 0.28), (1.5, 1.8, 0.58)),
    "desk": ((0.38, 0.7, 0.66), (2.0, 1.95, 1.65)),
    "side table": ((0.26, 0.26, 0.4), (0.8, 0.9, 0.75)),
    "console table": ((0.24, 0.7, 0.7), (0.75, 1.75, 0.96)),
    "bed": ((1.85, 0.8, 0.35), (2.75, 2.7, 2.3)),
    "crib": ((0.7, 0.4, 0.5), (1.65, 0.95, 1.75)),
    "bunk bed": ((1.9, 0.85, 1.4), (2.4, 1.6, 2.1)),
    "nightstand": ((0.28, 0.3, 0.38), (0.95, 0.75, 0.8)),
    "wardrobe": ((0.36, 0.42, 1.35), (1.5, 3.1, 2.7)),
    "chest of drawers": ((0.34, 0.36, 0.4), (0.95, 2.1, 2.2)),
    "bookshelf": ((0.2, 0.3, 0.55), (1.2, 3.0, 2.5)),
    "cabinet": ((0.28, 0.33, 0.6), (1.35, 2.4, 2.4)),
    "tv cabinet": ((0.33, 0.75, 0.33), (1.1, 2.95, 2.25)),
    "shoe rack": ((0.15, 0.45, 0.35), (0.65, 1.2, 1.75)),
    "wall shelf": ((0.14, 0.25, 0.01), (0.36, 2.4, 1.9)),
    "filing cabinet": ((0.4, 0.34, 0.45), (1.05, 1.3, 1.55)),
    "coat rack": ((0.05, 0.35, 0.06), (0.9, 1.4, 2.15)),
}
COMMON = ("chair", "sofa", "armchair", "dining table", "desk", "coffee table", "bed", "wardrobe", "cabinet",
          "bookshelf", "nightstand", "chest of drawers", "tv cabinet")  # fmt: skip
TOPPED = ("dining table", "desk", "coffee table", "side table", "console table", "nightstand", "chest of drawers")
SEEDS = range(3)


def make(category: str, name: str, seed: int) -> Piece:
    return catalogue.make(category, np.random.default_rng([seed, zlib.crc32(name.encode())]), name=name)


@cache
def pieces(category: str, name: str) -> tuple[Piece, ...]:
    return tuple(make(category, name, seed) for seed in SEEDS)


def every(category: str) -> Iterator[Piece]:
    """Yield the pieces of all families of a category."""
    for name in catalogue.families(category):
        yield from pieces(category, name)


@pytest.mark.few(6)
@pytest.mark.parametrize("category", SIZES)
def test_a_piece_stands_on_the_floor_about_the_origin(category: str) -> None:
    for piece in every(category):
        mesh = piece.mesh
        assert np.isfinite(mesh.vertex).all() and np.isfinite(mesh.uv).all()
        assert abs(float(mesh.low[2])) < 1e-4
        assert np.abs((mesh.low + mesh.high)[:2]).max() < 1e-3


@pytest.mark.few(6)
@pytest.mark.parametrize("category", SIZES)
def test_a_piece_has_the_size_of_its_kind_and_few_triangles(category: str) -> None:
    least, greatest = SIZES[category]
    for piece in every(category):
        assert (piece.mesh.size >= least).all(), piece.mesh.size
        assert (piece.mesh.size <= greatest).all(), piece.mesh.size
        assert 20 <= len(piece.mesh.triangle) <= 2600
        assert float(piece.mesh.areas_m2().sum()) > 0.05


@pytest.mark.few(6)
@pytest.mark.parametrize("category", SIZES)
def test_things_may_stand_only_on_something(category: str) -> None:
    for piece in every(category):
        mesh = piece.mesh
        height = mesh.vertex[:, 2]
        for top in piece.supports:
            assert top.low[0] < top.high[0] and top.low[1] < top.high[1] and top.clearance_m > 0
            assert np.all(np.array(top.low) >= mesh.low[:2] - 1e-3)
            assert np.all(np.array(top.high) <= mesh.high[:2] + 1e-3)
            assert np.abs(height - top.z).min() < 0.012, "no surface at the height of the support"


@pytest.mark.few(6)
@pytest.mark.parametrize("category", SIZES)
def test_the_seed_decides_all(category: str) -> None:
    for name in catalogue.families(category):
        first, again = pieces(category, name)[0], make(category, name, SEEDS[0])
        np.testing.assert_array_equal(first.mesh.vertex, again.mesh.vertex)
        assert [m.colour for m in first.mesh.materials] == [m.colour for m in again.mesh.materials]
        assert first.supports == again.supports


@pytest.mark.few(6)
@pytest.mark.parametrize("category", SIZES)
def test_no_two_pieces_of_a_family_are_of_one_size(category: str) -> None:
    for name in catalogue.families(category):
        sizes = np.stack([piece.mesh.size for piece in pieces(category, name)])
        assert np.ptp(sizes, axis=0).max() > 0.01


@pytest.mark.few(6)
@pytest.mark.parametrize("category", SIZES)
def test_a_category_has_many_builds_and_keeps_some_back(category: str) -> None:
    names = catalogue.families(category)
    training, kept = catalogue.families(category, "training"), catalogue.families(category, "held-out")
    assert set(training) | set(kept) == set(names) and not set(training) & set(kept)
    assert len(names) >= (5 if category in COMMON else 2)
    if len(names) >= 4:
        assert kept


@pytest.mark.parametrize("category", TOPPED)
def test_every_table_offers_its_top(category: str) -> None:
    for name in catalogue.families(category):
        for piece in pieces(category, name):
            assert piece.supports, name
            reach = max((s.high[0] - s.low[0]) * (s.high[1] - s.low[1]) for s in piece.supports)
            assert reach > 0.04, (name, reach)


@pytest.mark.parametrize("category", ["chair", "armchair", "sofa", "office chair"])
def test_a_seat_looks_along_x_so_its_upper_part_lies_behind(category: str) -> None:
    for name in catalogue.families(category):
        for piece in pieces(category, name):
            mesh = piece.mesh
            upper = mesh.corners().mean(axis=1)[:, 2] > 0.75 * float(mesh.high[2])
            area = mesh.areas_m2()[upper]
            middle = float((mesh.corners().mean(axis=1)[upper, 0] * area).sum() / area.sum())
            assert middle < 0.02, (name, middle)


@pytest.mark.parametrize("name", ["bedstead", "metal", "upholstered", "sleigh"])
def test_a_bed_has_its_head_behind(name: str) -> None:
    for piece in pieces("bed", name):
        upper = piece.mesh.vertex[piece.mesh.vertex[:, 2] > 0.9 * piece.mesh.high[2]]
        assert float(upper[:, 0].max()) < 0
