from pathlib import Path

import numpy as np
import pytest

from avlmaps.perception.encoders import Encoders
from avlmaps.recordings.open import open_recording
from avlmaps.recordings.types import Recording, Subset
from avlmaps_sim.bench.locate import COLUMNS, LocatableMap, errors_of, foreign_errors, map_of, run
from helpers.picture_room import RoomWalk


@pytest.mark.nightly
def test_the_table_has_a_row_for_the_place_and_one_for_others() -> None:
    table = run(RoomWalk(frames=12, turn=0.15), 0, steps=(2,), photos=3)
    assert table["columns"] == list(COLUMNS)
    assert [len(row) for row in table["rows"]] == [len(COLUMNS)] * 2
    place, other = table["rows"][:2]
    assert place[:4] == ["every other frame", 6, 3, "yes"]
    assert place[4:6] == [100.0, "43.9 to 100.0"]
    assert place[6] < 1.0
    assert place[10] == 100.0
    assert other[3:5] == ["no: mirrored", 0.0]
    assert other[6:12] == [""] * 6


@pytest.mark.nightly
def test_photos_of_other_places_can_be_given() -> None:
    other = RoomWalk(frames=3, seed=5)
    table = run(RoomWalk(frames=8, turn=0.1), 0, steps=(2,), photos=1, foreign=[other.frame(i).rgb for i in range(3)])
    assert table["rows"][1][2:5] == [3, "no", 0.0]


@pytest.fixture(scope="module")
def red_kitchen(shared_data: Path) -> tuple[Recording, LocatableMap]:
    """Return a walk, and the map of every other frame of its first part."""
    recording = open_recording(shared_data / "data" / "redkitchen")
    return recording, map_of(
        Subset(recording, np.arange(0, 60, 2)), Encoders.named("embedded"), np.random.default_rng(0)
    )


@pytest.mark.nightly
@pytest.mark.shared
def test_half_of_the_red_kitchen_locates_the_other_half(red_kitchen: tuple[Recording, LocatableMap]) -> None:
    """The issue's figures, in the first part of the walk; `avlmaps bench locate` asks everywhere."""
    recording, stored = red_kitchen
    asked = np.arange(1, 60, 12)
    errors = errors_of(stored, recording, asked, 0)
    assert np.median(errors.cm) <= 1.0
    assert np.median(errors.deg) <= 0.4
    assert ((errors.cm <= 5.0) & (errors.deg <= 5.0)).all()
    mirrored = (np.ascontiguousarray(recording.frame(int(i)).rgb[:, ::-1]) for i in asked[::2])
    assert np.isinf(foreign_errors(stored, mirrored, 0).cm).all()


@pytest.mark.nightly
@pytest.mark.shared
def test_the_depth_cameras_intrinsics_do_not_spoil_the_red_kitchen(
    red_kitchen: tuple[Recording, LocatableMap],
) -> None:
    recording, stored = red_kitchen
    errors = errors_of(stored, recording, np.arange(25, 60, 9), 0, camera=recording.rig.depth)
    assert np.median(errors.cm) <= 1.5
    assert (errors.cm <= 5.0).all()
