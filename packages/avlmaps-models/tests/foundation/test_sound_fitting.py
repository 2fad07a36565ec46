"""How the sound encoder is fitted: what a batch holds, and that a fold's network learns nothing from its clips."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

torch = pytest.importorskip("torch")
from training.sounds.augmentation import PADDED, SMOOTHED, Augmentation, in_circumstances, segmented  # noqa: E402
from training.sounds.distil import Settings, fit  # noqa: E402
from training.sounds.export import write_onnx  # noqa: E402
from training.sounds.fit import share_of_rate  # noqa: E402
from training.sounds.kinds import NAMES  # noqa: E402
from training.sounds.mixtures import Mixtures  # noqa: E402
from training.sounds.network import SoundNet, read_network  # noqa: E402

from avlmaps.maps.audio.segmentation import segment  # noqa: E402
from avlmaps.perception.embedded import logmel  # noqa: E402
from avlmaps.recordings.audio import AudioTrack, Sound, write_flac  # noqa: E402

DIM, WIDTH = 16, 4
WORDS = torch.nn.functional.normalize(
    torch.randn(2, len(NAMES), DIM, generator=torch.Generator().manual_seed(0)), dim=2
)
SETTINGS = Settings(steps=2, batch=4)


def network() -> SoundNet:
    torch.manual_seed(0)
    return SoundNet(DIM, WIDTH)


def mixtures(kinds: np.ndarray, folds: np.ndarray, seed: int = 0) -> Mixtures:
    """Return random mixtures of two sounds each, of given kinds and folds (n, 2)."""
    rng, n = np.random.default_rng(seed), len(kinds)
    mels = rng.random((n, logmel.WINDOW_FRAMES, logmel.BANDS)).astype(np.float16)
    said = (rng.normal(size=(n, size)).astype(np.float32) for size in (5, 7))
    return Mixtures(mels, *said, kinds, folds, np.full(n, 0.25, np.float32))


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
def test_no_mixture_holds_what_is_left_out(data: st.DataObject) -> None:
    rows = st.lists(st.tuples(*[st.integers(0, 3)] * 2, *[st.sampled_from([0, 2, 3])] * 2), min_size=1, max_size=8)
    drawn = np.array(data.draw(rows))
    fold, without = data.draw(st.sampled_from([0, 2, 3])), data.draw(st.lists(st.integers(0, 3), max_size=2))
    given_rows = mixtures(drawn[:, :2], drawn[:, 2:])
    left = given_rows.without(fold, without)
    kept = [
        not ({first, second} & set(without) or (fold > 0 and fold in (one, other)))
        for first, second, one, other in drawn.tolist()
    ]
    np.testing.assert_array_equal(left.mels, given_rows.mels[kept])
    np.testing.assert_array_equal(left.kinds, given_rows.kinds[kept])


@pytest.mark.parametrize("name", ["mels", "features", "logits", "kinds"])
def test_every_layer_learns_and_from_everything(name: str) -> None:
    rng = np.random.default_rng(1)
    given_rows = mixtures(rng.integers(0, len(NAMES), (6, 2)), rng.integers(2, 6, (6, 2)))
    start = network()
    net = fit(start, given_rows, WORDS, SETTINGS)
    for layer, weight in start.named_parameters():
        assert not torch.equal(net.state_dict()[layer], weight), layer
    values = getattr(given_rows, name)
    other = fit(start, replace(given_rows, **{name: values[::-1].copy()}), WORDS, SETTINGS)
    assert (net.head.weight - other.head.weight).abs().max() > 1e-5


def test_a_fit_that_was_interrupted_continues(tmp_path: Path) -> None:
    given_rows = mixtures(np.zeros((4, 2), int), np.full((4, 2), 2))
    fit(network(), given_rows, WORDS, replace(SETTINGS, steps=1), tmp_path / "check.pt")
    fit(network(), given_rows, WORDS, SETTINGS, tmp_path / "check.pt")
    assert [line.split(",")[0] for line in (tmp_path / "check.csv").read_text().splitlines()] == ["1", "2"]


def test_a_network_is_read_back_and_ships_as_bytes(tmp_path: Path) -> None:
    import onnxruntime

    net = network()
    torch.save({name: value.half() for name, value in net.state_dict().items()}, tmp_path / "all.pt")
    held = read_network(tmp_path / "all.pt")
    write_onnx(held, tmp_path / "sounds.onnx")
    x = torch.randn(3, 2, logmel.BANDS, logmel.WINDOW_FRAMES)
    (found,) = onnxruntime.InferenceSession(tmp_path / "sounds.onnx").run(None, {"heard": x.numpy()})
    with torch.no_grad():
        said = net.eval()(x).numpy()
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1.0, atol=1e-5)
    assert (said * found).sum(axis=1).min() > 0.999
    with pytest.raises(SystemExit, match=r"stranger\.pt is missing; python -m training\.sounds\.distil fits it\."):
        read_network(tmp_path / "stranger.pt")


@given(seed=st.integers(0, 99))
def test_rooms_and_noise_keep_the_peak_and_draw_anew(seed: int) -> None:
    power = torch.rand(2, logmel.WINDOW_FRAMES, logmel.BANDS, generator=torch.Generator().manual_seed(seed)) + 0.1
    how = Augmentation(reverberation=1.0, noisy=1.0)
    one, same, other = (in_circumstances(power, how, torch.Generator().manual_seed(s)) for s in (seed, seed, seed + 1))
    torch.testing.assert_close(one.amax(dim=(1, 2)), torch.ones(2))
    torch.testing.assert_close(one, same)
    assert (one - other).abs().max() > 1e-3


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
