"""Drafts in the formats of others: a right one passes in each, and what a format cannot hold is left out."""

from dataclasses import replace

import numpy as np
import pytest

from avlmaps.core.camera import Pinhole, Rig
from avlmaps_sim.bench.recordings.drafts import Draft, RoomWalk
from avlmaps_sim.bench.recordings.outcomes import FOLDER, FORMATS, TUM_CAMERA, Format, Judge, Outcome
from avlmaps_sim.bench.recordings.situations import situations


@pytest.fixture(scope="module")
def right() -> Draft:
    return RoomWalk("room", seed=61, frames=15).draft(TUM_CAMERA.resized(80, 60))


@pytest.mark.few(1)
@pytest.mark.parametrize("form", FORMATS, ids=lambda form: form.name)
def test_a_right_draft_passes_and_a_mistake_is_found_in_every_format(form: Format, right: Draft) -> None:
    assert form.holds(right)
    judge = Judge(right, form)
    assert not judge.verdict.sentences() and judge.verdict.agreeing > 0.95
    inverse = situations()[0]
    unchanged = judge.judge(replace(inverse, change=lambda d, o, g: d), right, 0)
    assert unchanged is not None and unchanged.outcome is Outcome.RIGHT and unchanged.format == form.name
    wrong = judge.judge(inverse, right, 0)
    assert wrong is not None and wrong.outcome is Outcome.REFUSED


def test_what_a_format_cannot_hold_is_left_out(right: Draft) -> None:
    rolled = replace(right, quaternion_roll=1)
    late = replace(right, pose_stamps_s=right.pose_stamps_s + 0.3)
    far = replace(right, depth=tuple(np.full_like(depth, 20_000) for depth in right.depth))
    other = replace(right, rig=Rig(right.rig.rgb, Pinhole(40.0, 40.0, 40.0, 30.0, 80, 60)))
    held = {
        name: {form.name for form in (FOLDER, *FORMATS) if form.holds(draft)}
        for name, draft in {"rolled": rolled, "late": late, "far": far, "two cameras": other}.items()
    }
    assert held == {
        "rolled": {"folder", "tum"},
        "late": {"folder", "tum"},
        "far": {"folder", "7scenes", "replica"},
        "two cameras": {"folder"},
    }
