"""The paper's rules: what they are, that a map knows it was built by them, and that every one of them counts."""

from dataclasses import replace

import numpy as np
import pytest

from avlmaps.maps.audio.segmentation import segment
from avlmaps.maps.settings import DEFAULTS, FrameSettings
from avlmaps.query.settings import HeatSettings, QuerySettings, build_settings, query_settings, rules_of
from avlmaps.recordings.audio import AudioTrack, Sound, write_flac


def test_our_rules_change_nothing():
    assert build_settings("ours") == DEFAULTS
    assert query_settings("ours") == QuerySettings()


def test_a_map_built_by_the_papers_rules_is_known_by_its_settings():
    chosen = replace(DEFAULTS, voxel_size_m=0.1, frames=FrameSettings(step=3), seed=4)
    assert rules_of(build_settings("paper", chosen)) == "paper"
    assert rules_of(build_settings("paper", chosen).for_profile(50.0)) == "paper"
    assert rules_of(chosen.for_profile(0.6)) == "ours"


def test_the_papers_rules_leave_what_they_do_not_decide_and_a_profile_leaves_theirs():
    chosen = replace(DEFAULTS, voxel_size_m=0.1)
    assert build_settings("paper", chosen).voxel_size_m == 0.1
    assert build_settings("paper").for_profile(50.0).fusion.variance_m2 == 0.6
    asked = QuerySettings(heat=HeatSettings(context_falloff_per_m=0.5), seed=3)
    assert query_settings("paper", asked).heat == asked.heat
    assert query_settings("paper", asked).seed == 3


@pytest.mark.parametrize("pause_s", [0.5, 1.5])
def test_by_the_papers_rules_sounds_are_divided_by_a_second_of_silence_and_nothing_is_widened(tmp_path, pause_s):
    rate = 8000
    tone = np.full(rate // 2, 0.1, np.float32)
    samples = np.concatenate([np.zeros(rate), tone, np.zeros(int(pause_s * rate)), tone, np.zeros(rate)])
    samples += np.random.default_rng(0).uniform(-0.015, 0.015, len(samples))  # a room is never silent
    write_flac(tmp_path / "track.flac", Sound(samples.astype(np.float32), rate))
    found = segment(AudioTrack.open(tmp_path / "track.flac"), build_settings("paper").hearing.segmentation)
    assert len(found) == (1 if pause_s < 1.0 else 2)
    assert found[0].onset_s == pytest.approx(1.0, abs=1e-3)
    assert found[-1].offset_s == pytest.approx(2.0 + pause_s, abs=1e-3)
