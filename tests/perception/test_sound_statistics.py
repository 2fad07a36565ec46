"""Statistics of spectra: what leaves them as they are, closed forms, and how they stand beside a network's features."""

from pathlib import Path

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.perception.embedded import logmel
from avlmaps.perception.embedded.sound_calibration import SCORES_WEIGHT, evidence_for
from avlmaps.perception.embedded.sound_features import (
    SCORES_SHARE,
    comparable_features,
    joined_features,
    split_features,
)
from avlmaps.perception.embedded.sound_statistics import StatisticsModel, statistics

COUNT = 285
WINDOWS = st.integers(0, 2**32 - 1).map(lambda seed: random_windows(np.random.default_rng(seed)))


def random_windows(rng: np.random.Generator, count: int = 2) -> np.ndarray:
    level = rng.normal(0.0, 8.0, (count, logmel.WINDOW_FRAMES, 1)) + rng.normal(0.0, 8.0, (count, 1, logmel.BANDS))
    power = 10.0 ** (level / 10.0) * rng.exponential(size=(count, logmel.WINDOW_FRAMES, logmel.BANDS))
    return np.stack([logmel.normalised(window.astype(np.float32)) for window in power])


def model(rng: np.random.Generator, kinds: int = 4) -> StatisticsModel:
    mean, offset = rng.normal(size=COUNT), rng.normal(size=kinds)
    deviation, weights = rng.uniform(0.5, 2.0, COUNT), rng.normal(size=(COUNT, kinds))
    return StatisticsModel(*(np.asarray(part, np.float32) for part in (mean, deviation, weights, offset)))


@given(power=WINDOWS)
def test_windows_are_described_one_by_one_by_finite_numbers(power: np.ndarray) -> None:
    together = statistics(power)
    assert together.shape == (len(power), COUNT) and together.dtype == np.float32
    assert np.isfinite(together).all()
    alone = np.concatenate([statistics(window[None]) for window in power])
    np.testing.assert_allclose(together, alone, rtol=1e-4, atol=1e-3)


@given(power=WINDOWS, gain=st.floats(0.01, 100.0))
def test_how_loud_a_sound_is_makes_no_difference(power: np.ndarray, gain: float) -> None:
    np.testing.assert_allclose(statistics(power * np.float32(gain)), statistics(power), rtol=1e-3, atol=1e-2)


@given(power=WINDOWS)
def test_played_backwards_a_sound_has_the_same_colour(power: np.ndarray) -> None:
    """All but what counts rises and falls, the blocks of a fifth of a second, and which frames a beat starts at."""
    colour = slice(0, 5 * 20 + 3 * 32)
    forwards, backwards = statistics(power)[:, colour], statistics(power[:, ::-1])[:, colour]
    np.testing.assert_allclose(forwards, backwards, rtol=1e-3, atol=1e-2)


def test_a_steady_sound_neither_changes_nor_beats() -> None:
    colour = 10.0 ** (np.random.default_rng(0).normal(0.0, 5.0, logmel.BANDS) / 10.0)
    steady = np.tile(colour / colour.max(), (1, logmel.WINDOW_FRAMES, 1)).astype(np.float32)
    found = statistics(steady)[0]
    np.testing.assert_allclose(found[20:100], 0.0, atol=1e-2)  # spread of the cepstra, and their changes
    beats = found[5 * 20 + 3 * 32 :][:48]
    np.testing.assert_allclose(beats, np.log10(0.1), atol=1e-3)


def test_a_beat_is_found_at_its_rate() -> None:
    """A level that swings by 20 dB six times a second is strongest between 5.4 and 10.8 Hz."""
    seconds = np.arange(logmel.WINDOW_FRAMES) * logmel.HOP_SAMPLES / logmel.RATE_HZ
    level_db = -10.0 + 10.0 * np.sin(2.0 * np.pi * 6.0 * seconds)
    power = np.tile((10.0 ** (level_db / 10.0))[None, :, None], (1, 1, logmel.BANDS)).astype(np.float32)
    beats = statistics(power)[0, 5 * 20 + 3 * 32 :][:48].reshape(6, 8)
    assert (beats.argmax(axis=0) == 3).all()


def test_silence_has_statistics() -> None:
    assert np.isfinite(statistics(np.full((1, logmel.WINDOW_FRAMES, logmel.BANDS), logmel.FLOOR, np.float32))).all()


def test_a_stored_model_gives_the_same_scores(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    kept, power = model(rng), random_windows(rng, 5)
    kept.write(tmp_path / "model.npz")
    read = StatisticsModel.read((tmp_path / "model.npz").read_bytes())
    assert read.kinds == 4
    np.testing.assert_allclose(read.scores(power), kept.scores(power), rtol=0.02, atol=0.5)


@given(seed=st.integers(0, 2**32 - 1))
def test_features_hold_a_direction_and_scores_and_give_them_back(seed: int) -> None:
    rng = np.random.default_rng(seed)
    network, scores = rng.normal(size=(3, 8)), rng.normal(size=(3, 4))
    joined = joined_features(network, scores)
    np.testing.assert_allclose(np.linalg.norm(joined, axis=1), 1.0, atol=1e-5)
    unit, again = split_features(joined, 8)
    np.testing.assert_allclose(unit, network / np.linalg.norm(network, axis=1, keepdims=True), atol=1e-5)
    np.testing.assert_allclose(again, scores, atol=1e-4)


@given(seed=st.integers(0, 2**32 - 1), scale=st.floats(0.1, 10.0))
def test_the_product_of_comparable_features_weighs_both_parts_whatever_the_size_of_the_scores(
    seed: int, scale: float
) -> None:
    rng = np.random.default_rng(seed)
    network, scores = rng.normal(size=(3, 8)), rng.normal(size=(3, 4))
    alike = comparable_features(joined_features(network, scale * scores), 8)
    network /= np.linalg.norm(network, axis=1, keepdims=True)
    scores /= np.linalg.norm(scores, axis=1, keepdims=True)
    expected = (1.0 - SCORES_SHARE) * network @ network.T + SCORES_SHARE * scores @ scores.T
    np.testing.assert_allclose(alike @ alike.T, expected, atol=1e-4)


def test_scores_count_for_the_recorded_kinds_which_come_first() -> None:
    cosines, typical = np.array([[0.2, 0.4, 0.6]]), np.array([[0.4, 0.4, 0.2]])
    evidence = evidence_for(cosines, typical, np.array([[0.5, -0.1]]))
    np.testing.assert_allclose(evidence, [[0.3 + 0.5 * SCORES_WEIGHT, 0.4 - 0.1 * SCORES_WEIGHT, 0.4]])
    assert cosines[0, 0] == 0.2  # what was given stays as it is
