"""Recordings of few frames far apart: cameras go round corners, which is no contradiction; mistakes still are."""

from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest

from avlmaps.recordings.consistency.check import Grade, check_recording
from avlmaps.recordings.corrections import Corrections
from avlmaps.recordings.open import open_recording
from avlmaps_sim.recorder import RecordSettings, record_scene
from avlmaps_sim.scenes import open_scene

pytestmark = pytest.mark.nightly


@pytest.fixture(scope="module")
def walked(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """Return what records 60 frames of a whole walk through a home, once, steps of a metre and more between them."""

    @cache
    def recorded(home: str) -> Path:
        path = tmp_path_factory.mktemp("sparse") / "walk"
        settings = RecordSettings(size=(160, 120), max_frames=60, hearing="none", workers=1)
        record_scene(open_scene(home), path, settings)
        return path

    return recorded


@pytest.mark.parametrize("home", ["house:1", "house:16"])
def test_a_right_one_is_not_doubted(walked: Callable[[str], Path], home: str) -> None:
    found = check_recording(open_recording(walked(home)))
    assert found.grade is Grade.FINE, found.sentences()


@pytest.mark.parametrize(
    ("home", "wrong"),
    [
        ("house:1", Corrections(pose_delay_s=0.4)),
        ("house:16", Corrections(depth_unit_m=0.0008)),
        ("house:16", Corrections(camera_axes="opengl")),
    ],
    ids=["late", "depth x0.8", "another camera"],
)
def test_a_wrong_one_is_refused(walked: Callable[[str], Path], home: str, wrong: Corrections) -> None:
    assert check_recording(open_recording(walked(home), corrections=wrong)).grade is Grade.IMPOSSIBLE
