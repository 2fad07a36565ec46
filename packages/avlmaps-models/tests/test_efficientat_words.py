"""The ear of ``sounds=efficientat``, by closed forms, and what it says where its file is missing or another."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.errors import BackendError
from avlmaps.perception.models import ModelSettings, using_models
from avlmaps_models.light.efficientat import (
    BANDS,
    FFT_SAMPLES,
    HIGHEST_HZ,
    MODEL,
    RATE_HZ,
    EfficientATSounds,
    log_mel,
    mel_triangles,
)


def test_the_triangles_share_every_bin_between_two_bands() -> None:
    total = mel_triangles().sum(axis=1)
    hz = np.arange(FFT_SAMPLES // 2 + 1) * RATE_HZ / FFT_SAMPLES
    inside = (hz > 60.0) & (hz < HIGHEST_HZ - 600.0)
    np.testing.assert_allclose(total[inside], 1.0, atol=1e-4)
    assert not total[hz >= HIGHEST_HZ].any()


@given(st.floats(200.0, 14_000.0))
def test_a_tone_is_loudest_in_the_band_of_its_pitch(hz: float) -> None:
    t = np.arange(RATE_HZ // 2) / RATE_HZ
    loudest = log_mel(np.sin(2 * np.pi * hz * t).astype(np.float32)).mean(axis=1).argmax()
    top = 1127.0 * np.log1p(HIGHEST_HZ / 700.0)
    assert abs(1127.0 * np.log1p(hz / 700.0) / top * (BANDS + 1) - (loudest + 1)) < 1.5


def test_a_frame_every_ten_milliseconds() -> None:
    assert log_mel(np.zeros(RATE_HZ, np.float32)).shape == (BANDS, 100)


def test_a_missing_file_is_named_with_what_makes_it(tmp_path: Path) -> None:
    with (
        using_models(ModelSettings(folder=tmp_path)),
        pytest.raises(BackendError, match=r"training\.light\.efficientat"),
    ):
        EfficientATSounds()


def test_another_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / MODEL).parent.mkdir()
    (tmp_path / MODEL).write_bytes(b"no network")
    with using_models(ModelSettings(folder=tmp_path)), pytest.raises(BackendError, match="mn04_as"):
        EfficientATSounds()
