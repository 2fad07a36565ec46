"""How the sound encoder is fitted: what a batch holds, and that a fold's network learns nothing from its clips."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

torch = pytest.importorskip("torch")
from training.sounds.augmentation import PADDED, SMOOTHED, Augmentation, segmented  # noqa: E402
from training.sounds.efficientat import Opinion  # noqa: E402
from training.sounds.fit import share_of_rate  # noqa: E402
from training.sounds.network import SoundNet, widened  # noqa: E402
from training.sounds.upper import Lessons, Mapped, Settings, fit_upper  # noqa: E402

from avlmaps.maps.audio.segmentation import segment  # noqa: E402
from avlmaps.perception.embedded import logmel  # noqa: E402
from avlmaps.recordings.audio import AudioTrack, Sound, write_flac  # noqa: E402

KINDS, DIM, WIDTH = 4, 16, 4
WORDS = torch.nn.functional.normalize(torch.randn(2, KINDS, DIM, generator=torch.Generator().manual_seed(0)), dim=2)
SETTINGS = Settings(steps=3, made=4)


def network() -> SoundNet:
    torch.manual_seed(0)
    return SoundNet(DIM, WIDTH)


def mapped(kinds: np.ndarray, folds: np.ndarray, seed: int = 0) -> Mapped:
    """Return random maps of sounds, each mixed with a quarter of another of its kind and fold."""
    rng, n = np.random.default_rng(seed), len(kinds)
    maps = rng.random((n, 4 * WIDTH, 8, 28)).astype(np.float16)
    both = np.arange(n)[:, None].repeat(2, axis=1)
    return Mapped(maps, both, kinds[both], folds[both], np.full(n, 0.25, np.float32), np.ones(n, bool))


def lessons() -> Lessons:
    """Return twelve clips of three kinds in folds 2 to 5, and four synthetic ones of a fourth kind."""
    clips = mapped(np.repeat(np.arange(3), 4), np.tile([2, 3, 4, 5], 3))
    made = mapped(np.full(4, 3), np.zeros(4, int), seed=1)
    return Lessons((clips, clips), (made, made))


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


@given(st.data())
def test_no_row_holds_what_is_left_out(data: st.DataObject) -> None:
    rows = st.lists(st.tuples(*[st.integers(0, 3)] * 2, *[st.sampled_from([0, 2, 3])] * 2, st.booleans()), min_size=1)
    drawn = data.draw(rows)
    fold, without = data.draw(st.sampled_from([0, 2, 3])), data.draw(st.lists(st.integers(0, 3), max_size=2))
    kinds, folds = np.array([row[:2] for row in drawn]), np.array([row[2:4] for row in drawn])
    may = np.array([row[4] for row in drawn])
    chosen = Mapped(np.zeros((len(drawn), 1, 1, 1)), kinds, kinds, folds, np.zeros(len(drawn)), may).rows(fold, without)
    for number, (first, second, one, other, allowed) in enumerate(drawn):
        left_out = {first, second} & set(without) or (fold > 0 and fold in (one, other))
        assert (number in chosen) == (allowed and not left_out)


def test_a_folds_network_learns_nothing_from_its_clips() -> None:
    net = network()
    given_lessons = lessons()
    clips = given_lessons.recorded[0]
    maps = clips.maps.copy()
    maps[clips.folds[:, 0] == 3] *= 4.0
    changed = replace(given_lessons, recorded=(replace(clips, maps=maps),) * 2)
    without, without_too = (numbers(fit_upper(net, each, WORDS, SETTINGS, fold=3)) for each in (given_lessons, changed))
    every, every_too = (numbers(fit_upper(net, each, WORDS, SETTINGS)) for each in (given_lessons, changed))
    np.testing.assert_allclose(without, without_too, atol=1e-6)
    assert np.abs(every - every_too).max() > 1e-4


def test_the_lower_blocks_stay_and_the_upper_part_is_fitted() -> None:
    start = network()
    net = fit_upper(start, lessons(), WORDS, SETTINGS)
    last = f"blocks.{len(start.blocks) - 1}."
    for name, weight in net.named_parameters():
        fitted = name.startswith((last, "head."))
        assert torch.equal(weight, dict(start.named_parameters())[name]) != fitted, name


def test_a_folds_network_learns_nothing_from_what_the_teacher_says_of_its_clips() -> None:
    given_lessons, rng = lessons(), np.random.default_rng(0)
    said = Opinion(rng.normal(size=(12, 5)).astype(np.float32), rng.normal(size=(12, 7)).astype(np.float32))
    own = (given_lessons.recorded[0].folds[:, 0] == 3)[:, None]
    other = Opinion(np.where(own, 9.0, said.features), np.where(own, -9.0, said.logits))
    other = Opinion(other.features.astype(np.float32), other.logits.astype(np.float32))

    def fitted(fold: int, teacher: Opinion | None) -> np.ndarray:
        return numbers(fit_upper(network(), given_lessons, WORDS, SETTINGS, fold, teacher=teacher))

    np.testing.assert_allclose(fitted(3, said), fitted(3, other), atol=1e-6)
    assert np.abs(fitted(0, said) - fitted(0, other)).max() > 1e-5
    assert np.abs(fitted(0, said) - fitted(0, None)).max() > 1e-5


def test_from_the_inputs_every_layer_is_fitted() -> None:
    start, given_lessons = network(), lessons()
    rng = np.random.default_rng(0)

    def heard(part: Mapped) -> Mapped:
        return replace(part, maps=rng.random((len(part.maps), 2, 64, 448)).astype(np.float16))

    pairs = ((heard(clean), heard(drawn)) for clean, drawn in (given_lessons.recorded, given_lessons.synthetic))
    net = fit_upper(start, Lessons(*pairs), WORDS, replace(SETTINGS, steps=1, whole=True))
    for name, weight in net.named_parameters():
        assert not torch.equal(weight, dict(start.named_parameters())[name]), name


@given(width=st.integers(WIDTH, 3 * WIDTH), seed=st.integers(0, 99))
def test_a_wider_network_answers_alike(width: int, seed: int) -> None:
    torch.manual_seed(seed)
    net = SoundNet(DIM, WIDTH).eval()
    x = torch.randn(2, 2, 64, 448)
    with torch.no_grad():
        torch.testing.assert_close(widened(net, width)(x), net(x), atol=1e-5, rtol=1e-4)


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
