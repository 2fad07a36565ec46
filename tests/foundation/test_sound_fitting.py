"""How the sound encoder is fitted: what a batch holds, and that a fold's network learns nothing from its clips."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch")
from training.sounds.augmentation import PADDED, SMOOTHED, Augmentation, segmented  # noqa: E402
from training.sounds.clips import Examples  # noqa: E402
from training.sounds.fit import Batches, Settings, fit_folds, share_of_rate  # noqa: E402
from training.sounds.network import SoundNet  # noqa: E402

from avlmaps.maps.audio.segmentation import segment  # noqa: E402
from avlmaps.perception.embedded import logmel  # noqa: E402
from avlmaps.recordings.audio import AudioTrack, Sound, write_flac  # noqa: E402

KINDS, DIM = 4, 16
WORDS = torch.nn.functional.normalize(torch.randn(2, KINDS, DIM, generator=torch.Generator().manual_seed(0)), dim=2)
SETTINGS = Settings(steps=3, width=4, recorded=12, synthetic=4, spliced=0.5)


def examples(seed: int = 0) -> Examples:
    """Return twelve clips of three kinds in folds 2 to 5, and two synthetic ones of a fourth."""
    rng = np.random.default_rng(seed)
    power = (rng.random((14, logmel.WINDOW_FRAMES, logmel.BANDS)) + logmel.FLOOR).astype(np.float32)
    kinds, folds = np.repeat(np.arange(3), 4), np.tile([2, 3, 4, 5], 3)
    return Examples(power[:12], kinds, folds, power[12:], np.array([3, 3]))


def numbers(net: SoundNet) -> np.ndarray:
    return torch.cat([weight.flatten() for weight in net.parameters()]).detach().numpy()


@pytest.mark.parametrize("steps", [1, 7, 1000])
@pytest.mark.parametrize("falling", [0.0, 0.4, 1.0])
def test_the_rate_rises_stays_and_falls(steps: int, falling: float) -> None:
    shares = np.array([share_of_rate(step, steps, falling) for step in range(steps)])
    assert (shares > 0.0).all()
    assert (shares <= 1.0).all()
    top = int(shares.argmax())
    assert (np.diff(shares[: top + 1]) >= 0.0).all()
    assert (np.diff(shares[top:]) <= 0.0).all()


def test_every_sound_of_a_batch_is_accounted_for() -> None:
    batch = Batches(examples(), WORDS, SETTINGS).draw()
    np.testing.assert_allclose(batch.aim.sum(dim=1), 1.0, atol=1e-6)
    assert batch.folds.shape == (16, 4)
    assert not batch.folds[12:, :2].any()  # synthetic ones are of no fold
    assert set(batch.folds[:12, :2].flatten().tolist()) <= {2, 3, 4, 5}


def test_a_folds_network_learns_nothing_from_its_clips() -> None:
    given = examples()
    changed = replace(given, recorded=given.recorded.copy())
    changed.recorded[given.recorded_folds == 3] = examples(seed=1).recorded[given.recorded_folds == 3] ** 4
    torch.manual_seed(0)
    start = SoundNet(DIM, SETTINGS.width, dropout=0.0)
    without, every = fit_folds(given, WORDS, SETTINGS, {3: start, 0: start}).values()
    without_too, every_too = fit_folds(changed, WORDS, SETTINGS, {3: start, 0: start}).values()
    np.testing.assert_allclose(numbers(without), numbers(without_too), atol=1e-6)
    assert np.abs(numbers(every) - numbers(every_too)).max() > 1e-4


def test_the_first_layers_stay_and_the_others_are_fitted() -> None:
    torch.manual_seed(0)
    start = SoundNet(DIM, SETTINGS.width)
    net = fit_folds(examples(), WORDS, SETTINGS, {2: start})[2]
    for name, weight in net.named_parameters():
        stays = name.startswith(("stem", "blocks.0"))
        assert torch.equal(weight, dict(start.named_parameters())[name]) == stays, name


ALL_CUT = Augmentation(segmented=1.0)


def in_steady_noise(first: int, last: int, snr_db: float) -> tuple["torch.Tensor", "torch.Tensor"]:
    """Return power that stands out of even noise from frame ``first`` to before ``last``, and the noise's power."""
    power = torch.ones(1, logmel.WINDOW_FRAMES, logmel.BANDS)
    power[:, first:last] += 10.0 ** (snr_db / 10.0)
    return power, torch.ones(1, logmel.BANDS)


@pytest.mark.parametrize("snr_db", [6.0, 20.0, 40.0])
@pytest.mark.parametrize(("first", "last"), [(0, 20), (100, 112), (430, 448), (50, 400)])
def test_a_segment_is_the_sound_and_a_little_round_it(first: int, last: int, snr_db: float) -> None:
    power, noise = in_steady_noise(first, last, snr_db)
    kept = segmented(power, noise, ALL_CUT, torch.Generator().manual_seed(0))
    frames = np.flatnonzero(kept[0].sum(dim=1).numpy())
    most = PADDED + SMOOTHED // 2
    assert max(0, first - most) <= frames[0] <= first
    assert last - 1 <= frames[-1] <= last - 1 + most
    assert (np.diff(frames) == 1).all()
    np.testing.assert_array_equal(kept[0, frames], power[0, frames])


def test_without_background_and_below_it_a_sound_stays_whole() -> None:
    power, noise = in_steady_noise(100, 200, 20.0)
    quiet, _ = in_steady_noise(100, 200, -6.0)
    generator = torch.Generator().manual_seed(0)
    assert torch.equal(segmented(power, torch.zeros_like(noise), ALL_CUT, generator), power)
    assert torch.equal(segmented(quiet, noise, ALL_CUT, generator), quiet)


def test_training_cuts_where_the_map_does(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    rate = logmel.RATE_HZ
    noise = 0.003 * rng.standard_normal(5 * rate).astype(np.float32)
    tone = np.zeros_like(noise)
    place = slice(2 * rate, 2 * rate + rate // 4)
    tone[place] = 0.1 * rng.standard_normal(rate // 4)
    write_flac(tmp_path / "track.flac", Sound(noise + tone, rate))
    (found,) = segment(AudioTrack.open(tmp_path / "track.flac"))
    power = torch.from_numpy(logmel.mel_power(noise + tone))[None]
    background = torch.from_numpy(logmel.mel_power(noise)).mean(dim=0)[None]
    kept = segmented(power, background, ALL_CUT, torch.Generator().manual_seed(0))
    frames = np.flatnonzero(kept[0].sum(dim=1).numpy()) * logmel.HOP_SAMPLES / rate
    assert abs(frames[0] - found.onset_s) < 0.06
    assert abs(frames[-1] - found.offset_s) < 0.06
