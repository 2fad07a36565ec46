"""A recording that contradicts itself is refused, or let through by the reason's name; doubts stay with the map."""

from dataclasses import replace
from pathlib import Path

import pytest
from build_fakes import SETTINGS, register_fakes

from avlmaps.core import poses
from avlmaps.core.camera import Pinhole
from avlmaps.core.errors import RecordingError
from avlmaps.maps.build import build_map
from avlmaps.maps.pipeline.write import carving_doubts
from avlmaps.maps.store.manifest import Removed
from avlmaps.query.contents import Contents
from avlmaps.recordings.open import open_recording
from avlmaps_sim.bench.recordings.drafts import Draft, RoomWalk

PROFILE = register_fakes()


@pytest.fixture(scope="module")
def right() -> Draft:
    return RoomWalk("room", seed=61, frames=12).draft(Pinhole(45.0, 45.0, 32.0, 24.0, 64, 48))


def test_it_is_refused_with_the_cause_and_the_name_that_lets_it_through(right: Draft, tmp_path: Path) -> None:
    walk = replace(right, poses=poses.inverse(right.poses)).write(tmp_path / "walk")
    said = r"walk cannot be right\. .*Corrections\.poses=camera-from-world.*allow=geometry\."
    with pytest.raises(RecordingError, match=said):
        build_map(open_recording(walk), tmp_path / "map", PROFILE, SETTINGS, progress=False)
    with pytest.raises(RecordingError, match="nothing called 'geometri' to allow"):
        build_map(open_recording(walk), tmp_path / "map", PROFILE, SETTINGS, progress=False, allow=["geometri"])
    stored = build_map(open_recording(walk), tmp_path / "map", PROFILE, SETTINGS, progress=False, allow=["geometry"])
    assert any("camera_from_world" in doubt for doubt in stored.info.doubts)
    assert set(stored.info.doubts) <= set(stored.info.notices)
    answer = Contents([], [], [], stored.info.doubts).to_json("map")
    assert answer.get("notes") == list(stored.info.doubts)


def test_a_right_one_has_no_doubts(right: Draft, tmp_path: Path) -> None:
    stored = build_map(
        open_recording(right.write(tmp_path / "walk")), tmp_path / "map", PROFILE, SETTINGS, progress=False
    )
    assert stored.info.doubts == ()
    assert "notes" not in Contents([], [], [], stored.info.doubts).to_json("map")


def test_much_that_is_seen_through_is_doubtful() -> None:
    assert not list(carving_doubts(Removed(seen_through=80), 920))
    assert "25%" in next(carving_doubts(Removed(seen_through=250), 750))
