"""Wav2CLIP: the published layout to the letter, its numbers against a slow composition, and files that are not its."""

from pathlib import Path

import numpy as np
import pytest
import torch
from tiny.audioclip import layout
from tiny.clip import write_clip
from tiny.wav2clip import DIM, MODEL, WORDS, tiny_state, write_wav2clip
from torch.nn import functional

from avlmaps.core.errors import BackendError
from avlmaps.core.registry import Kind, load
from avlmaps.perception.conformance import check, example_sound
from avlmaps.recordings.audio import Sound
from avlmaps_models.paper.wav2clip import Wav2ClipNetwork, Wav2ClipSounds

RATE_HZ = 16_000


@pytest.fixture
def encoder(models: Path) -> Wav2ClipSounds:
    write_wav2clip(models)
    return load(Kind.SOUNDS, "wav2clip")


def test_the_real_size_has_the_published_names_and_shapes():
    with torch.device("meta"):
        network = Wav2ClipNetwork()
    assert {key: tuple(value.shape) for key, value in network.state_dict().items()} == layout("wav2clip")
    state = {key: torch.empty(shape, device="meta") for key, shape in layout("wav2clip").items()}
    read_off = Wav2ClipNetwork.like(state)
    assert {key: tuple(value.shape) for key, value in read_off.state_dict().items()} == layout("wav2clip")


def by_hand(samples: np.ndarray) -> np.ndarray:
    """Return the feature by the published steps, from the names of the checkpoint alone, in double precision."""
    state = {key: value.double() for key, value in tiny_state().items()}
    around = np.pad(samples.astype(np.float64), 256, mode="reflect")
    window = 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(512) / 512)
    starts = range(0, len(around) - 511, 353)
    power = np.stack([np.abs(np.fft.rfft(around[at : at + 512] * window)) ** 2 for at in starts], axis=1)
    log = np.log(power + 1e-7)
    x = torch.from_numpy((log - log.mean()) / (log.std(ddof=1) + 1e-9))[None, None]

    def norm(x: torch.Tensor, name: str) -> torch.Tensor:
        ends = ("running_mean", "running_var", "weight", "bias")
        return functional.batch_norm(x, *(state[f"audio_encoder.{name}.{end}"] for end in ends), eps=1e-5)

    def convolved(x: torch.Tensor, name: str, stride: int, padding: int) -> torch.Tensor:
        return functional.conv2d(x, state[f"audio_encoder.{name}.weight"], stride=stride, padding=padding)

    x = functional.max_pool2d(norm(convolved(x, "conv1", 2, 3), "bn1").relu(), 3, 2, 1)
    for stage in (1, 2, 3, 4):
        for i in (0, 1):
            name, stride = f"layer{stage}.{i}", 2 if stage > 1 and i == 0 else 1
            y = norm(convolved(x, f"{name}.conv1", stride, 1), f"{name}.bn1").relu()
            y = norm(convolved(y, f"{name}.conv2", 1, 1), f"{name}.bn2")
            if stride == 2:
                x = norm(convolved(x, f"{name}.downsample.0", 2, 0), f"{name}.downsample.1")
            x = (x + y).relu()
    x = x.mean((2, 3))
    for layer, last in ((0, False), (3, True)):
        weight, bias = (state[f"audio_transform.sequential.{layer}.{end}"] for end in ("weight", "bias"))
        x = x @ weight.T + bias
        x = x if last else x.relu()
    return (x / x.norm())[0].numpy()


@pytest.mark.parametrize("seconds", [257 / RATE_HZ, 300 / RATE_HZ, 511 / RATE_HZ, 0.3, 2.0, 10.0])
def test_a_sound_goes_through_the_published_steps(encoder, seconds):
    sound = example_sound(3, seconds)
    found = encoder.encode(sound)
    assert found.shape == (1, DIM)
    assert np.allclose(found[0], by_hand(sound.samples), atol=2e-5)


def test_it_conforms(encoder):
    check(Kind.SOUNDS, encoder)


def test_the_card_says_what_it_is(encoder):
    card = encoder.card
    assert (card.id, card.dim, card.licence, card.prompts) == (MODEL, DIM, "MIT", ("{}",))


def test_a_window_does_not_depend_on_those_beside_it(encoder):
    sound = example_sound(1, 25.0)
    found = encoder.encode(sound)
    parts = [sound.samples[at * RATE_HZ : (at + 10) * RATE_HZ] for at in (0, 10, 15)]
    alone = np.concatenate([encoder.encode(Sound(part, RATE_HZ)) for part in parts])
    np.testing.assert_allclose(found, alone, atol=1e-5)


@pytest.mark.parametrize("count", [1, 100, 256, 511, 512])
def test_the_shortest_sounds_have_a_feature(encoder, count):
    found = encoder.encode(Sound(np.full(count, 0.1, np.float32), RATE_HZ))
    assert np.linalg.norm(found, axis=1) == pytest.approx([1.0], abs=1e-5)


def test_words_are_those_of_clip(encoder, models):
    from transformers import CLIPModel, CLIPTokenizer

    whole = CLIPModel.from_pretrained(models / WORDS).eval()
    picture = torch.zeros(1, 3, 56, 56)
    tokenizer = CLIPTokenizer.from_pretrained(models / WORDS)
    for phrase in ("the kit", "dog bark"):
        with torch.no_grad():
            wanted = whole(pixel_values=picture, **tokenizer(phrase, return_tensors="pt")).text_embeds[0].numpy()
        assert np.allclose(encoder.encode_words([phrase])[0], wanted, atol=1e-5)
    assert encoder.encode_words([]).shape == (0, DIM)


def test_scores_use_the_scale_of_clip(encoder):
    from tiny.clip import SCALE

    assert encoder._contrast.scale == pytest.approx(SCALE, rel=1e-4)
    heard = [encoder.encode(example_sound(seed, 2.0)) for seed in range(2)]
    assert encoder.score_sounds(heard, heard[0])[0] > 0.99
    together = encoder.score_words(heard, ["rain", "dog"])
    assert np.allclose(together[:, 1:], encoder.score_words(heard, ["dog"]), atol=1e-4)


CHANGES = {
    "it lacks audio_encoder.layer3.1.bn2.running_var. Get": lambda state: state.pop(
        "audio_encoder.layer3.1.bn2.running_var"
    ),
    "nothing takes audio_transform.sequential.6.bias. Get": lambda state: state.update(
        {"audio_transform.sequential.6.bias": torch.zeros(3)}
    ),
    "of another size is audio_encoder.bn1.bias": lambda state: state.update({"audio_encoder.bn1.bias": torch.zeros(9)}),
    "KeyError: 'audio_encoder.spectrogram.window'": lambda state: state.clear(),
}


@pytest.mark.parametrize("told", CHANGES)
def test_a_checkpoint_of_another_model_is_refused_in_one_sentence(models, told):
    state = tiny_state()
    CHANGES[told](state)
    torch.save(state, models / MODEL)
    with pytest.raises(BackendError) as fault:
        Wav2ClipSounds()
    assert told in str(fault.value)
    assert "curl -LO https://github.com/descriptinc/lyrebird-wav2clip/releases/download/v0.1.0-alpha/" in str(
        fault.value
    )


def test_what_the_published_loader_does_not_look_at_may_be_there_or_not(models):
    """Training's own tensors, whatever they are called, and the classifier; so may counters that evaluation ignores."""
    write_clip(models, WORDS)
    torch.save(tiny_state(), models / MODEL)
    sound = example_sound(3, 1.0)
    wanted = Wav2ClipSounds().encode(sound)
    state = {key: value for key, value in tiny_state().items() if not key.endswith("num_batches_tracked")}
    others = ("image_encoder.conv1.weight", "logit_scale", "audio_encoder.fc.weight", "audio_encoder.fc.bias")
    torch.save({**state, **dict.fromkeys(others, torch.zeros(2))}, models / MODEL)
    np.testing.assert_allclose(Wav2ClipSounds().encode(sound), wanted, atol=1e-5)


def test_a_clip_of_another_length_is_refused(models):
    torch.save({**tiny_state(), **_narrower()}, models / MODEL)
    write_clip(models, WORDS)
    with pytest.raises(BackendError, match=f"features of {DIM} numbers, Wav2CLIP of 16"):
        Wav2ClipSounds()


def _narrower() -> dict[str, torch.Tensor]:
    """Return the tensors of a network with two channels behind its first convolution instead of three."""
    return {
        key: torch.zeros(tuple(size * 16 // 512 if size >= 64 else size for size in shape))
        for key, shape in layout("wav2clip").items()
        if not key.endswith("spectrogram.window")
    }


def test_a_clip_that_is_not_here_says_how_to_get_it(models):
    torch.save(tiny_state(), models / MODEL)
    with pytest.raises(BackendError, match="hf download openai/clip-vit-base-patch32"):
        Wav2ClipSounds()
