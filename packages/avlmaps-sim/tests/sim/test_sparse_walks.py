"""Recordings of few frames far apart: cameras go round corners, which is no contradiction; mistakes still are."""

from pathlib import Path

import pytest

from avlmaps.recordings.consistency.check import check_recording
from avlmaps.recordings.consistency.verdict import Grade
from avlmaps.recordings.corrections import Corrections
from avlmaps.recordings.open import open_recording
from avlmaps_sim.recorder import RecordSettings, record_scene
from avlmaps_sim.scenes import open_scene

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module", params=["house:1", "house:16"])
def sparse(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return 60 frames of a whole walk, steps of a metre and more between them."""
    path = tmp_path_factory.mktemp("sparse") / "walk"
    settings = RecordSettings(size=(160, 120), max_frames=60, hearing="none", workers=1)
    record_scene(open_scene(request.param), path, settings)
    return path


def test_a_right_one_is_not_doubted(sparse: Path) -> None:
    found = check_recording(open_recording(sparse))
    assert found.grade is Grade.FINE, found.sentences()


@pytest.mark.parametrize(
    "wrong",
    [
        Corrections(depth_unit_m=0.002),
        Corrections(depth_unit_m=0.0008),
        Corrections(camera_axes="opengl"),
        Corrections(pose_delay_s=0.4),
    ],
    ids=["depth x2", "depth x0.8", "another camera", "late"],
)
def test_a_wrong_one_is_refused(sparse: Path, wrong: Corrections) -> None:
    assert check_recording(open_recording(sparse, corrections=wrong)).grade is Grade.IMPOSSIBLE
