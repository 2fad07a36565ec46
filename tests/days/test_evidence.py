"""What a day says of a place: the law that "not seen" never becomes "gone", and views of a plain room."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.camera import Pinhole
from avlmaps.days.evidence import LEAST_COVERAGE, Day, DayVerdict, DayViews, VoxelEvidence, seen_again, seen_before
from avlmaps.days.surfaces import Occupied
from avlmaps.maps.grid import GridSpec

GRID = GridSpec(0.05)
CAMERA = Pinhole(80.0, 80.0, 80.0, 60.0, 160, 120)
SIZE = 2  # pixels of a block, of a picture 160 wide
COUNT = st.integers(0, 500)


@given(COUNT, COUNT)
def test_what_nobody_looked_at_is_unknown(voxels: int, rest: int) -> None:
    seen = VoxelEvidence(voxels + rest, 0, 0)
    assert seen.p_gone(0.05) == 0.5 and seen.verdict(0.05) is DayVerdict.UNKNOWN


@given(st.integers(1, 500), COUNT, COUNT)
def test_surface_speaks_for_a_thing_and_a_ray_against_it(voxels: int, surface: int, through: int) -> None:
    seen = VoxelEvidence(voxels + surface + through, surface, through)
    p_gone = seen.p_gone(0.05)
    assert 0.0 < p_gone < 1.0
    assert VoxelEvidence(seen.voxels + 1, surface + 1, through).p_gone(0.05) < p_gone
    assert VoxelEvidence(seen.voxels + 1, surface, through + 1).p_gone(0.05) > p_gone
    # Both sides change places: the equation favours neither.
    assert VoxelEvidence(seen.voxels, through, surface).p_gone(0.05) == pytest.approx(1.0 - p_gone)
    if seen.verdict(0.05) is DayVerdict.GONE:
        assert through > surface and seen.coverage() >= LEAST_COVERAGE


def test_the_equation_by_hand() -> None:
    # 90 voxels of 5 cm through patches of 15 cm: ten looks.
    assert VoxelEvidence(100, 0, 90).p_gone(0.05) == pytest.approx(11.0 / 12.0)
    assert VoxelEvidence(100, 90, 0).p_gone(0.05) == pytest.approx(1.0 / 12.0)


def look(at: np.ndarray, towards: np.ndarray) -> np.ndarray:
    """Return the pose of a camera that looks from one place to another."""
    forward = (towards - at) / np.linalg.norm(towards - at)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([right, np.cross(forward, right), forward], axis=1)
    pose[:3, 3] = at
    return pose


def views(places: list[tuple[float, float, float]], towards: tuple[float, float, float], free_m: float) -> DayViews:
    pose = np.stack([look(np.array(place), np.array(towards)) for place in places])
    clear = np.full((len(pose), CAMERA.height // SIZE, CAMERA.width // SIZE), round(1000 * free_m), np.uint16)
    return DayViews(clear, pose, CAMERA)


BOX = np.stack(np.meshgrid(*[np.arange(0, 6)] * 3, indexing="ij"), axis=-1).reshape(-1, 3).astype(np.int32)
MIDDLE = (0.15, 0.15, 0.15)
NOTHING = np.array([[200, 200, 200]], np.int32)
HERE = Occupied.of(BOX, GRID)
FRONT = [(2.0, 0.1, 0.3), (2.0, 0.2, 0.3), (2.1, 0.3, 0.3)]
BACK = [(-2.0, 0.1, 0.3), (-2.0, 0.2, 0.3), (-2.1, 0.3, 0.3)]


def day(seen: DayViews, index: np.ndarray = NOTHING) -> Day:
    return Day(seen, Occupied.of(index, GRID), np.eye(4), Occupied.of(index, GRID))


def test_rays_through_the_place_from_where_it_was_seen_are_evidence() -> None:
    before = [views(FRONT, MIDDLE, 1.9)]
    seen = seen_again(BOX, GRID, before, HERE, day(views(FRONT, MIDDLE, 4.0)))
    assert seen.through == len(BOX) and seen.verdict(GRID.voxel_size_m) is DayVerdict.GONE


@pytest.mark.parametrize(
    ("places", "free_m"), [(BACK, 4.0), (FRONT, 0.0), (FRONT, 1.0), (FRONT, 1.5), (FRONT[:1], 4.0)]
)
def test_rays_from_the_other_side_or_that_end_before_it_and_a_single_view_prove_nothing(
    places: list[tuple[float, float, float]], free_m: float
) -> None:
    seen = seen_again(BOX, GRID, [views(FRONT, MIDDLE, 1.9)], HERE, day(views(places, MIDDLE, free_m)))
    assert (seen.through, seen.surface) == (0, 0) and seen.verdict(GRID.voxel_size_m) is DayVerdict.UNKNOWN


def test_surface_in_its_place_keeps_it() -> None:
    before, now = [views(FRONT, MIDDLE, 1.9)], views(FRONT, MIDDLE, 4.0)
    seen = seen_again(BOX, GRID, before, HERE, day(now, BOX + np.array([1, 0, 0], np.int32)))
    assert seen.surface == len(BOX) and seen.verdict(GRID.voxel_size_m) is DayVerdict.THERE


def test_a_place_seen_before_only_where_somebody_looked() -> None:
    none, through, short = Occupied.of(NOTHING, GRID), views(FRONT, MIDDLE, 4.0), views(FRONT, MIDDLE, 1.0)
    now = day(through, BOX)
    assert seen_before(BOX, GRID, [through], none, now) is DayVerdict.GONE
    assert seen_before(BOX, GRID, [short], none, now) is DayVerdict.UNKNOWN
    assert seen_before(BOX, GRID, [through], HERE, now) is DayVerdict.THERE


def test_the_floor_under_a_box_is_no_box() -> None:
    """A flat box on a floor: most of its voxels lie beside the floor, which is there still."""
    flat = BOX[BOX[:, 2] < 3]
    floor = np.stack(np.meshgrid(np.arange(-9, 15), np.arange(-9, 15), [-1], indexing="ij"), axis=-1).reshape(-1, 3)
    both, before = np.concatenate([flat, floor]), [views(FRONT, MIDDLE, 1.9)]
    known = Occupied.of(both, GRID)
    empty = seen_again(flat, GRID, before, known, day(views(FRONT, MIDDLE, 4.0), floor))
    assert empty.surface == 0 and empty.verdict(GRID.voxel_size_m) is DayVerdict.GONE
    still = seen_again(flat, GRID, before, known, day(views(FRONT, MIDDLE, 1.8), both))
    assert still.through == 0 and still.verdict(GRID.voxel_size_m) is DayVerdict.THERE
