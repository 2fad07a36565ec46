"""Pieces of one thing are one goal: a chair's legs and its back, however little was seen between."""

from itertools import pairwise

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.query.objects import joined_columns

CELL_M, JOIN_M, VOXEL_M = 0.1, 0.3, 0.05
Box = tuple[tuple[float, float, float], tuple[float, float, float]]


def pieces(*boxes: Box) -> tuple[np.ndarray, np.ndarray]:
    """Return the voxels' centres of each box, each box an instance."""
    filled = []
    for low, high in boxes:
        axes = [np.arange(a, b - 1e-9, VOXEL_M) + VOXEL_M / 2 for a, b in zip(low, high, strict=True)]
        filled.append(np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3))
    return np.concatenate(filled), np.repeat(np.arange(len(boxes)), [len(points) for points in filled])


def things(*boxes: Box) -> int:
    return len(set(joined_columns(*pieces(*boxes), CELL_M, JOIN_M)))


def brute_force(points: np.ndarray, instance: np.ndarray) -> np.ndarray:
    """The definition, column by column."""
    cell = np.floor(points[:, :2] / CELL_M)
    count = instance.max() + 1
    label, met, columns = np.arange(count), np.zeros((count, count), int), np.zeros(count, int)
    for column in np.unique(cell, axis=0):
        rows = np.flatnonzero((cell == column).all(axis=1))
        rows = rows[np.argsort(points[rows, 2], kind="stable")]
        columns[np.unique(instance[rows])] += 1
        pairs = {
            tuple(sorted((instance[a], instance[b])))
            for a, b in pairwise(rows)
            if instance[a] != instance[b] and points[b, 2] - points[a, 2] <= JOIN_M
        }
        for a, b in pairs:
            met[a, b] += 1
    for a, b in np.argwhere(met):
        if 2 * met[a, b] >= min(columns[a], columns[b]):
            label[label == label[b]] = label[a]
    return label


def test_legs_and_a_back_over_them_are_one_chair() -> None:
    legs = [((x, y, 0.0), (x + 0.05, y + 0.05, 0.2)) for x in (0.0, 0.35) for y in (0.0, 0.35)]
    seat = ((0.0, 0.0, 0.4), (0.4, 0.4, 0.45))
    assert things(*legs, seat) == 1


def test_a_cabinet_hung_high_over_another_stays_another() -> None:
    assert things(((0.0, 0.0, 0.0), (1.0, 0.4, 0.9)), ((0.0, 0.0, 1.4), (1.0, 0.4, 2.0))) == 2


def test_a_chair_before_a_row_of_cabinets_along_two_walls_is_none_of_them() -> None:
    long, side, chair = (
        ((0.0, 0.0, 0.0), (3.0, 0.5, 0.8)),
        ((0.0, 0.5, 0.0), (0.5, 3.0, 0.8)),
        ((1.5, 1.5, 0), (2, 2, 0.8)),
    )
    points, instance = pieces(long, side, chair)
    instance = np.where(instance == 2, 1, 0)  # the two rows are one instance, whose box holds the chair
    assert len(set(joined_columns(points, instance, CELL_M, JOIN_M))) == 2


def test_nothing_has_no_pieces() -> None:
    assert joined_columns(np.zeros((0, 3)), np.zeros(0, np.int64), CELL_M, JOIN_M).shape == (0,)


places = st.lists(
    st.tuples(*[st.integers(0, 7)] * 3, st.integers(0, 4)), min_size=1, max_size=40, unique_by=lambda v: v[:3]
)


@given(places)
def test_sorting_agrees_with_the_definition(voxels: list[tuple[int, int, int, int]]) -> None:
    array = np.array(voxels)
    points = (array[:, :3] + 0.5) * (0.05, 0.05, 0.2)
    instance = np.unique(array[:, 3], return_inverse=True)[1]
    sorted_, brute = joined_columns(points, instance, CELL_M, JOIN_M), brute_force(points, instance)
    assert ((sorted_[:, None] == sorted_) == (brute[:, None] == brute)).all()
