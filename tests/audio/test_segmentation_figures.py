from pathlib import Path

import numpy as np
import pytest

from avlmaps.maps.audio.segmentation import Segment
from avlmaps.maps.settings import SegmentationSettings
from avlmaps_sim.bench.harness.figures import poisson, wilson
from avlmaps_sim.bench.segmentation import COLUMNS, Tally, clips_to_test, measure


def test_a_segment_over_two_sounds_finds_one_of_them() -> None:
    tally = Tally()
    truth = [Segment(1.0, 2.0), Segment(3.0, 4.0), Segment(6.0, 7.0)]
    tally.add(truth, [Segment(0.9, 4.1), Segment(5.0, 5.5), Segment(6.0, 6.4), Segment(6.5, 7.1)], 60.0)
    assert (tally.sounds, tally.found, tally.pieces, tally.false_alarms) == (3, 2, 3, 1)
    np.testing.assert_allclose(tally.onset_s, [-0.1, 0.0])
    np.testing.assert_allclose(tally.offset_s, [2.1, 0.1])
    assert len(tally.row("test", "none", None)) == len(COLUMNS)


def test_intervals_are_the_textbooks() -> None:
    np.testing.assert_allclose(100.0 * np.array(wilson(0, 10)), (0.0, 27.75), atol=0.01)
    np.testing.assert_allclose(100.0 * np.array(wilson(95, 100)), (88.82, 97.85), atol=0.01)
    np.testing.assert_allclose(poisson(0), (0.0, 3.689), atol=0.001)
    np.testing.assert_allclose(poisson(10), (4.795, 18.390), atol=0.001)


@pytest.mark.nightly
@pytest.mark.shared
def test_real_sounds_are_found_where_they_are(shared_data: Path) -> None:
    chosen = clips_to_test(shared_data / "data" / "sounds")["folds 4 and 5"]
    clips = [clip for clip in chosen if clip.name.startswith("esc10/")][::4]
    clean = measure(clips, "none", None, np.random.default_rng(0), SegmentationSettings())
    assert (clean.sounds, clean.found, clean.false_alarms) == (40, 40, 0)
    assert (np.abs([clean.onset_s, clean.offset_s]) < 0.1).mean() > 0.95
    noisy = measure(clips, "pink", 10.0, np.random.default_rng(0), SegmentationSettings())
    assert noisy.found >= 38
    assert noisy.false_alarms <= noisy.seconds / 60.0
