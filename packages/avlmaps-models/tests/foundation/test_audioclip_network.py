"""AudioCLIP's network: the published layout to the letter, its numbers against slow formulas."""

import math

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from tiny.audioclip import layout, tiny_state
from torch.nn import functional

from avlmaps_models.paper.audioclip_network import NOT_NEEDED, AudioClipNetwork, SoundSizes, _Attention
from avlmaps_models.paper.clip_text import ClipTextSizes
from avlmaps_models.paper.fbsp import Fbsp, FrontEnd, frames

PUBLISHED_BYTES = 537_302_068  # of either file in the release
EMPTY = "audio.fbsp.bias"


def shapes(network: torch.nn.Module) -> dict[str, tuple[int, ...]]:
    return {key: tuple(value.shape) for key, value in network.state_dict().items()}


def loaded(state: dict[str, torch.Tensor]) -> AudioClipNetwork:
    network = AudioClipNetwork(ClipTextSizes.of(state), SoundSizes.of(state))
    network.load_state_dict({key: value for key, value in state.items() if key not in NOT_NEEDED | {EMPTY}})
    return network.eval()


def test_the_real_size_has_the_published_names_and_shapes():
    with torch.device("meta"):
        network = AudioClipNetwork(ClipTextSizes(), SoundSizes())
    published = layout()
    assert published.keys() >= NOT_NEEDED
    assert shapes(network) == {k: v for k, v in published.items() if k not in NOT_NEEDED and k != EMPTY}


def test_what_is_not_needed_is_the_picture_tower_and_its_two_scales():
    others = {key for key in layout() if key.startswith("visual.")} | {"logit_scale", "logit_scale_ai"}
    assert others == NOT_NEEDED


def test_the_sizes_are_read_off_the_published_shapes():
    state = {key: torch.empty(shape, device="meta") for key, shape in layout().items()}
    assert SoundSizes.of(state) == SoundSizes()
    assert ClipTextSizes.of(state) == ClipTextSizes()


def test_the_published_layout_accounts_for_the_size_of_the_published_file():
    held = sum(math.prod(shape) * (8 if key.endswith("tracked") else 4) for key, shape in layout().items())
    overhead = PUBLISHED_BYTES - held
    assert 250 * len(layout()) < overhead < 450 * len(layout())  # names, padding and directory of a zip of 861 tensors


def wavelets_by_formula(m: np.ndarray, fb: np.ndarray, fc: np.ndarray) -> np.ndarray:
    """Return sqrt(fb) sinc(fb t / m)^m exp(-i fc t) / sqrt(n), the power a complex one."""
    length = 2 * (len(m) - 1)
    t = math.pi * np.linspace(-1, 1, length)
    rows = []
    for order, band, centre in zip(m, fb, fc, strict=True):
        x = band * t / order
        power = (np.sin(x) / x).astype(np.complex128) ** order
        rows.append(math.sqrt(band) * power * np.exp(-1j * centre * t) / math.sqrt(length))
    return np.stack(rows)


def random_fbsp(bins: int, seed: int = 0) -> Fbsp:
    rng = np.random.default_rng(seed)
    fbsp = Fbsp(bins)
    with torch.no_grad():
        fbsp.m.copy_(torch.from_numpy(rng.uniform(0.3, 3.0, bins)))
        fbsp.fb.copy_(torch.from_numpy(rng.uniform(0.5, 4.0, bins)))
        fbsp.fc.add_(torch.from_numpy(rng.normal(0.0, 0.5, bins)))
    return fbsp


def numbers(values: torch.Tensor) -> np.ndarray:
    return values.detach().double().numpy()


def test_wavelets_are_those_of_the_formula():
    fbsp = random_fbsp(65)
    real, imaginary = fbsp.kernels().double().numpy()
    wanted = wavelets_by_formula(numbers(fbsp.m), numbers(fbsp.fb), numbers(fbsp.fc))
    assert np.abs(real + 1j * imaginary - wanted).max() < 2e-5
    assert np.abs(wanted.imag).max() > 0.05


def test_wavelets_as_they_are_before_training_are_a_fourier_transform():
    real, imaginary = Fbsp(33).kernels().double().numpy()
    t = math.pi * np.linspace(-1, 1, 64)
    assert np.allclose(real + 1j * imaginary, np.exp(-1j * np.arange(33)[:, None] * t) / 8, atol=1e-5)


@given(count=st.integers(1, 5000), length=st.integers(1, 700), hop=st.integers(1, 600))
def test_frames_are_slices_of_the_sound_with_silence_at_both_ends(count, length, hop):
    signal = torch.arange(1.0, count + 1.0)[None]
    found = frames(signal, length, hop)[0].numpy()
    number = 1 if count <= length else 1 + math.ceil((count - length) / hop)
    lacking = (number - 1) * hop + length - count
    assert found.shape == (number, length)
    around = np.concatenate([np.zeros(lacking // 2), signal[0].numpy(), np.zeros(lacking - lacking // 2)])
    assert all(np.array_equal(found[i], around[i * hop : i * hop + length]) for i in range(number))
    assert 0 <= lacking < max(hop, length)


def decibels_by_formula(wavelets: np.ndarray, window: np.ndarray, samples: np.ndarray) -> np.ndarray:
    level = (samples + 32768.0) * 2.0 / 65535.0 - 1.0
    number = 1 + max(0, math.ceil((len(level) - len(window)) / 561))
    lacking = (number - 1) * 561 + len(window) - len(level)
    level = np.concatenate([np.zeros(lacking // 2), level, np.zeros(lacking - lacking // 2)])
    before = (wavelets.shape[1] - len(window)) // 2
    height = len(wavelets) // 3
    found = np.zeros((3, height, number))
    for band in range(3):
        for row in range(height):
            wavelet = wavelets[band * height + row, before : before + len(window)]
            for i in range(number):
                part = level[i * 561 : i * 561 + len(window)] * window
                found[band, row, i] = 10 * np.log10(abs(np.sum(part * wavelet)) ** 2)
    return found


def test_the_front_end_gives_decibels_of_three_bands():
    rng = np.random.default_rng(1)
    fbsp, window = random_fbsp(302), rng.uniform(0.1, 1.0, 590)
    samples = rng.normal(0, 3000, 4000).astype(np.float32)
    found = FrontEnd.of(fbsp, torch.from_numpy(window), torch.device("cpu"))(torch.from_numpy(samples)[None])
    wavelets = wavelets_by_formula(numbers(fbsp.m), numbers(fbsp.fb), numbers(fbsp.fc))
    wanted = decibels_by_formula(wavelets, window, samples.astype(np.float64))
    assert found.shape == (1, 3, 100, 8)  # of 302 bins two are left over
    assert np.median(np.abs(found[0].numpy() - wanted)) < 1e-3
    assert np.abs(found[0].numpy() - wanted).max() < 0.2  # where a frame and a wavelet nearly cancel


def test_no_power_at_all_is_180_decibels_down():
    fbsp = Fbsp(16)
    with torch.no_grad():
        fbsp.fb.zero_()
    found = FrontEnd.of(fbsp, torch.ones(20), torch.device("cpu"))(torch.ones(2, 3000))
    assert torch.equal(found, torch.full_like(found, -180.0))


def test_attention_weighs_each_place_by_what_was_near_it_before():
    torch.manual_seed(0)
    attention = _Attention(3, 4, (3, 1)).eval().double()
    attention.requires_grad_(False).bn.running_mean.normal_()
    before, after = torch.randn(1, 3, 5, 7).double(), torch.randn(1, 4, 2, 3).double()
    pooled = np.zeros((3, 2, 3))
    for c, i, j in np.ndindex(pooled.shape):
        rows, columns = slice(5 * i // 2, -(-5 * (i + 1) // 2)), slice(7 * j // 3, -(-7 * (j + 1) // 3))
        pooled[c, i, j] = before[0, c, rows, columns].max()
    depth, point, bn = attention.conv_depth, attention.conv_point, attention.bn
    wanted = np.zeros((4, 2, 3))
    for out, i, j in np.ndindex(wanted.shape):
        total = float(point.bias[out])
        for c in range(3):
            near = [float(depth.weight[c, 0, k, 0]) * pooled[c, i + k - 1, j] for k in range(3) if 0 <= i + k - 1 < 2]
            total += float(point.weight[out, c, 0, 0]) * (sum(near) + float(depth.bias[c]))
        total = (total - float(bn.running_mean[out])) / math.sqrt(float(bn.running_var[out]) + bn.eps)
        wanted[out, i, j] = float(after[0, out, i, j]) / (1 + math.exp(-total))
    with torch.no_grad():
        assert np.allclose(attention(before, after)[0].numpy(), wanted, atol=1e-12)


class ByHand:
    """The published composition, written from the names of the checkpoint alone, in double precision."""

    def __init__(self, state: dict[str, torch.Tensor]) -> None:
        self.state = {key: value.detach().double() for key, value in state.items()}

    def of(self, name: str) -> torch.Tensor:
        return self.state[f"audio.{name}"]

    def norm(self, x: torch.Tensor, name: str) -> torch.Tensor:
        mean, var = self.of(f"{name}.running_mean"), self.of(f"{name}.running_var")
        return functional.batch_norm(x, mean, var, self.of(f"{name}.weight"), self.of(f"{name}.bias"), eps=1e-5)

    def block(self, x: torch.Tensor, name: str, stride: int) -> torch.Tensor:
        grouped = self.of(f"{name}.conv2.weight")
        y = self.norm(functional.conv2d(x, self.of(f"{name}.conv1.weight")), f"{name}.bn1").relu()
        groups = len(grouped) // grouped.shape[1]
        y = functional.conv2d(y, grouped, stride=stride, padding=1, groups=groups)
        y = functional.conv2d(self.norm(y, f"{name}.bn2").relu(), self.of(f"{name}.conv3.weight"))
        if f"audio.{name}.downsample.0.weight" in self.state:
            down = functional.conv2d(x, self.of(f"{name}.downsample.0.weight"), stride=stride)
            x = self.norm(down, f"{name}.downsample.1")
        return (self.norm(y, f"{name}.bn3") + x).relu()

    def attention(self, x: torch.Tensor, name: str, size: tuple[int, int]) -> torch.Tensor:
        depth = self.of(f"{name}.conv_depth.weight")
        middle = (depth.shape[2] // 2, depth.shape[3] // 2)
        x = functional.adaptive_max_pool2d(x, size)
        x = functional.conv2d(x, depth, self.of(f"{name}.conv_depth.bias"), padding=middle, groups=len(depth))
        x = functional.conv2d(x, self.of(f"{name}.conv_point.weight"), self.of(f"{name}.conv_point.bias"))
        return self.norm(x, f"{name}.bn").sigmoid()

    def hear(self, decibels: np.ndarray) -> np.ndarray:
        x = torch.from_numpy(decibels)[None]
        x = self.norm(functional.conv2d(x, self.of("conv1.weight"), stride=2, padding=3), "bn1").relu()
        x = functional.max_pool2d(x, 3, 2, 1)
        for stage, count in enumerate((3, 4, 6, 3), 1):
            before = x
            for i in range(count):
                x = self.block(x, f"layer{stage}.{i}", 2 if stage > 1 and i == 0 else 1)
            x = x * self.attention(before, f"att{stage}", (x.shape[2], x.shape[3]))
        x = x.mean((2, 3), keepdim=True) * self.attention(x, "att5", (1, 1))
        return (x.flatten(1) @ self.of("fc.weight").T + self.of("fc.bias"))[0].numpy()


def test_the_sound_tower_is_the_published_composition():
    state = tiny_state()
    network = loaded(state)
    decibels = np.random.default_rng(2).normal(-20, 20, (3, 43, 70))
    with torch.no_grad():
        found = network.audio(torch.from_numpy(decibels).float()[None])[0].numpy()
    wanted = ByHand(state).hear(decibels)
    assert np.abs(wanted).max() > 0.1
    assert np.allclose(found, wanted, atol=1e-5 * np.abs(wanted).max())


def test_every_weight_of_the_sound_tower_matters():
    state = tiny_state()
    heard = torch.from_numpy(np.random.default_rng(3).normal(0, 3000, (1, 40_000)).astype(np.float32))

    def feature(changed: dict[str, torch.Tensor]) -> torch.Tensor:
        network = loaded(changed)
        with torch.no_grad():
            return network.audio(FrontEnd.of(network.audio.fbsp, network.audio.window, torch.device("cpu"))(heard))

    reference = feature(state)
    used = [k for k in state if k.startswith("audio.") and not k.endswith("tracked") and k != EMPTY]
    for key in [*np.random.default_rng(4).choice(used, 12, replace=False).tolist(), "audio.window", "audio.fbsp.m"]:
        changed = {**state, key: 1.5 * state[key].detach() + 0.1}
        assert not torch.allclose(feature(changed), reference, rtol=1e-6), key


@pytest.mark.parametrize(("learnt", "scale"), [(math.log(70), 70.0), (9.0, 100.0), (-2.0, 1.0)])
def test_the_scale_stays_between_1_and_100(learnt, scale):
    network = AudioClipNetwork(ClipTextSizes(8, 4, 8, 1, 4), SoundSizes(8, 6, 4, 2, (1, 1, 1, 1), 4))
    with torch.no_grad():
        network.logit_scale_at.fill_(learnt)
    assert network.scale == pytest.approx(scale)
