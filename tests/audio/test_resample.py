import numpy as np
import pytest
from audio_fakes import tone
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.recordings.audio import Sound
from avlmaps.recordings.resample import resampled


@pytest.mark.parametrize(
    ("rate_hz", "wanted_hz"), [(44_100, 22_050), (16_000, 44_100), (48_000, 22_050), (8_000, 16_000)]
)
def test_a_tone_stays_the_same_tone(rate_hz: int, wanted_hz: int) -> None:
    inner = slice(wanted_hz // 10, -wanted_hz // 10)
    heard = resampled(Sound(tone(1.0, rate_hz=rate_hz), rate_hz), wanted_hz)
    np.testing.assert_allclose(heard.samples[inner], tone(1.0, rate_hz=wanted_hz)[inner], atol=2e-3)


def test_what_the_new_rate_cannot_hold_is_gone() -> None:
    high = Sound(tone(1.0, hz=15_000.0, rate_hz=44_100), 44_100)
    assert np.abs(resampled(high, 16_000).samples[800:-800]).max() < 0.3 * 10 ** (-40 / 20)


@given(count=st.integers(0, 5000), pair=st.sampled_from([(44_100, 22_050), (22_050, 44_100), (48_000, 44_100)]))
def test_the_length_keeps_the_duration(count: int, pair: tuple[int, int]) -> None:
    heard = resampled(Sound(np.zeros(count, np.float32), pair[0]), pair[1])
    assert heard.rate_hz == pair[1]
    assert len(heard.samples) == -(-count * pair[1] // pair[0])


def test_the_right_rate_changes_nothing() -> None:
    sound = Sound(tone(0.1), 16_000)
    assert resampled(sound, 16_000) is sound
