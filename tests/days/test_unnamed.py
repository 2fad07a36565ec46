"""What changed though no list names it: which groups of voxels are things, in a stored office of boxes."""

import numpy as np
import pytest

from avlmaps.days.life import CONFIDENT_AT, LEAST_VOXELS, changed_things
from avlmaps.query.avlmap import AVLMap
from avlmaps.query.contents import Thing
from helpers.office import office_of


@pytest.fixture(scope="module")
def office(tmp_path_factory: pytest.TempPathFactory) -> tuple[AVLMap, np.ndarray]:
    """Return a map, and the rows of one of its chairs."""
    stored = AVLMap.open(office_of(tmp_path_factory))
    return stored, stored.things(["office chair"])[0].rows


def found(stored: AVLMap, loose: np.ndarray, through: np.ndarray, owned: list[np.ndarray]) -> list[Thing]:
    flags = np.zeros((2, len(stored.data.voxels)), bool)
    flags[0, loose], flags[1, through] = True, True
    return changed_things(stored, flags[0], flags[1], owned)


@pytest.mark.nightly
def test_what_rays_pass_through_in_part_is_one_thing_with_the_name_of_its_voxels(office: tuple) -> None:
    stored, chair = office
    (thing,) = found(stored, chair, chair[::3], [])
    assert np.array_equal(thing.rows, chair) and thing.name == "office chair"
    assert thing.confidence < CONFIDENT_AT, "no list was sure of it"


def test_of_a_group_that_was_hardly_looked_at_the_looked_at_part_is_the_thing(office: tuple) -> None:
    stored, chair = office
    high = np.asarray(stored.data.voxels.index)[chair, 2]
    top = chair[high >= np.sort(np.unique(high))[-3]]
    (whole,) = found(stored, chair, top, [])
    assert np.array_equal(whole.rows, chair)
    wide = np.arange(len(stored.data.voxels))
    (part,) = found(stored, wide, top, [])
    assert np.array_equal(np.sort(part.rows), np.sort(top)), "a whole office is no thing"


def test_no_ray_no_thing_and_no_sheet_and_no_part_of_what_changed_itself(office: tuple) -> None:
    stored, chair = office
    high = np.asarray(stored.data.voxels.index)[chair, 2]
    sheet = chair[high == high.max()]
    assert found(stored, chair, chair[:0], []) == []
    assert len(sheet) >= LEAST_VOXELS and found(stored, sheet, sheet, []) == []
    upper, lower = chair[high > np.median(high)], chair[high <= np.median(high)]
    assert len(found(stored, chair, upper, [])) == 1
    assert found(stored, chair, upper, [lower]) == [], "the lower half has a name, and changed as well"
    assert len(found(stored, upper, upper, [lower])) == 1, "what it stands on stayed"
