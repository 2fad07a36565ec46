import numpy as np
import pytest
from audio_fakes import tone
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.recordings.audio import Sound, resample


@pytest.mark.parametrize(
    ("rate_hz", "wanted_hz"), [(44_100, 22_050), (16_000, 44_100), (48_000, 22_050), (8_000, 16_000)]
)
def test_a_tone_stays_the_same_tone(rate_hz: int, wanted_hz: int) -> None:
    inner = slice(wanted_hz // 10, -wanted_hz // 10)
    heard = resample(Sound(tone(1.0, rate_hz=rate_hz), rate_hz), wanted_hz)
    np.testing.assert_allclose(heard.samples[inner], tone(1.0, rate_hz=wanted_hz)[inner], atol=2e-3)


PAIRS = [(44_100, 16_000), (48_000, 16_000), (44_100, 22_050), (48_000, 44_100)]


def _level_db(hz: float, rate_hz: int, wanted_hz: int) -> float:
    """How loud a tone is after resampling, against before."""
    heard = resample(Sound(tone(1.0, hz=hz, level=1.0, rate_hz=rate_hz), rate_hz), wanted_hz).samples
    inner = heard[wanted_hz // 10 : -wanted_hz // 10].astype(np.float64)
    return float(10.0 * np.log10(2.0 * np.mean(inner**2) + 1e-30))


@pytest.mark.few(4)
@pytest.mark.parametrize(("rate_hz", "wanted_hz"), PAIRS)
@pytest.mark.parametrize("share", [1.025, 1.05, 1.08])
def test_what_the_new_rate_cannot_hold_is_gone(rate_hz: int, wanted_hz: int, share: float) -> None:
    """A tone just above the new Nyquist rate, such as 8.2 kHz for 16 kHz, must not come back below it."""
    assert _level_db(share * wanted_hz / 2.0, rate_hz, wanted_hz) < -110.0


@pytest.mark.few(6)
@pytest.mark.parametrize(("rate_hz", "wanted_hz"), [*PAIRS, (44_100, 48_000), (16_000, 44_100)])
@pytest.mark.parametrize("share", [0.01, 0.3, 0.85, 0.9])
def test_what_the_new_rate_can_hold_is_as_loud_as_before(rate_hz: int, wanted_hz: int, share: float) -> None:
    assert abs(_level_db(share * min(rate_hz, wanted_hz) / 2.0, rate_hz, wanted_hz)) < 0.1


def test_a_click_stays_where_it_was() -> None:
    samples = np.zeros(44_100, np.float32)
    samples[22_050] = 1.0
    assert np.argmax(resample(Sound(samples, 44_100), 16_000).samples) == 8000


@pytest.mark.parametrize("count", [1, 2, 3, 7])
def test_a_few_samples_are_enough(count: int) -> None:
    heard = resample(Sound(np.ones(count, np.float32), 8_000), 48_000)
    assert len(heard.samples) == 6 * count and np.isfinite(heard.samples).all()


@given(count=st.integers(0, 5000), pair=st.sampled_from([(44_100, 22_050), (22_050, 44_100), (48_000, 44_100)]))
def test_the_length_keeps_the_duration(count: int, pair: tuple[int, int]) -> None:
    heard = resample(Sound(np.zeros(count, np.float32), pair[0]), pair[1])
    assert heard.rate_hz == pair[1]
    assert len(heard.samples) == -(-count * pair[1] // pair[0])


def test_the_right_rate_changes_nothing() -> None:
    sound = Sound(tone(0.1), 16_000)
    assert resample(sound, 16_000) is sound
