"""Furniture of living rooms, bedrooms and studies: tops to stand on, and fronts that look along x."""

import pytest

from helpers.furniture_pieces import every_piece, pieces_of

TOPPED = ("dining table", "desk", "coffee table", "side table", "console table", "nightstand", "chest of drawers")


@pytest.mark.parametrize("category", TOPPED)
def test_every_table_offers_its_top(category: str) -> None:
    for piece in every_piece(category):
        assert piece.supports, piece.family
        reach = max((s.high[0] - s.low[0]) * (s.high[1] - s.low[1]) for s in piece.supports)
        assert reach > 0.04, (piece.family, reach)


@pytest.mark.parametrize("category", ["chair", "armchair", "sofa", "office chair"])
def test_a_seat_looks_along_x_so_its_upper_part_lies_behind(category: str) -> None:
    for piece in every_piece(category):
        mesh = piece.mesh
        upper = mesh.corners().mean(axis=1)[:, 2] > 0.75 * float(mesh.high[2])
        area = mesh.areas_m2()[upper]
        middle = float((mesh.corners().mean(axis=1)[upper, 0] * area).sum() / area.sum())
        assert middle < 0.02, (piece.family, middle)


@pytest.mark.parametrize("name", ["bedstead", "metal", "upholstered", "sleigh"])
def test_a_bed_has_its_head_behind(name: str) -> None:
    for piece in pieces_of("bed", name):
        before = piece.mesh.vertex[:, 0] > 0
        assert piece.mesh.vertex[before, 2].max() < 0.98 * piece.mesh.high[2]
