"""CLAP against transformers' own pipeline on a tiny random checkpoint, and against what a map needs of it."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import torch
from safetensors.torch import load_file, save_file
from tiny.clap import MODEL, write_clap
from transformers import AutoTokenizer, ClapFeatureExtractor, ClapModel

from avlmaps.core.errors import AudioError, BackendError
from avlmaps.core.registry import Kind
from avlmaps.perception.conformance import check, example_sound
from avlmaps.recordings.audio import Sound
from avlmaps_models.foundation.clap import ClapSounds

FUSED = "laion/clap-htsat-fused"
RATE_HZ = 48_000


@pytest.fixture
def clap(models: Path) -> ClapSounds:
    write_clap(models)
    return ClapSounds()


def noise(seconds: float, seed: int = 0) -> Sound:
    rng = np.random.default_rng(seed)
    level = np.repeat(rng.uniform(0.01, 0.3, int(np.ceil(seconds))), RATE_HZ)[: round(seconds * RATE_HZ)]
    return Sound((level * rng.standard_normal(len(level))).astype(np.float32), RATE_HZ)


def by_transformers(folder: Path, samples: np.ndarray) -> np.ndarray:
    """Return what the published pipeline makes of at most ten seconds."""
    heard = ClapFeatureExtractor.from_pretrained(folder)(samples, sampling_rate=RATE_HZ, return_tensors="pt")
    with torch.no_grad():
        model = ClapModel.from_pretrained(folder)
        return model.get_audio_features(heard["input_features"], torch.zeros(1, 1)).pooler_output.numpy()


@pytest.mark.parametrize("fused", [False, True])
def test_it_keeps_what_a_sound_encoder_promises(models: Path, fused: bool) -> None:
    write_clap(models, FUSED if fused else MODEL, fused)
    check(Kind.SOUNDS, ClapSounds(FUSED if fused else MODEL))


@pytest.mark.parametrize(("fused", "seconds"), [(False, 0.2), (False, 10.0), (True, 3.7)])
def test_ten_seconds_are_encoded_as_published(models: Path, fused: bool, seconds: float) -> None:
    write_clap(models, MODEL, fused)
    sound = noise(seconds)
    ours = ClapSounds().encode(sound)
    np.testing.assert_allclose(ours, by_transformers(models / MODEL, sound.samples), atol=1e-5)


def test_a_long_sound_has_a_window_every_five_seconds_and_one_at_its_end(clap: ClapSounds, models: Path) -> None:
    sound = noise(23.2)
    ours = clap.encode(sound)
    assert len(ours) == 4
    for row, start_s in zip(ours, (0.0, 5.0, 10.0, 13.2), strict=True):
        at = round(start_s * RATE_HZ)
        expected = by_transformers(models / MODEL, sound.samples[at : at + 10 * RATE_HZ])[0]
        np.testing.assert_allclose(row, expected, atol=1e-5)


@pytest.mark.parametrize("fused", [False, True])
def test_a_long_sound_has_one_feature_whatever_was_drawn_before(models: Path, fused: bool) -> None:
    write_clap(models, MODEL, fused)
    clap, sound = ClapSounds(), noise(12.0)
    np.random.seed(1)  # noqa: NPY002 - the generator that published code draws from
    first = clap.encode(sound)
    np.random.seed(2)  # noqa: NPY002
    np.testing.assert_allclose(first, clap.encode(sound), atol=1e-5)


def test_no_second_of_a_long_sound_is_lost(clap: ClapSounds) -> None:
    sound = noise(12.0)
    before = clap.encode(sound)
    for second in (0, 6, 11):
        changed = sound.samples.copy()
        changed[second * RATE_HZ : (second + 1) * RATE_HZ] *= 3.0
        assert np.abs(before - clap.encode(Sound(changed, RATE_HZ))).max() > 1e-4


def test_phrases_are_put_into_the_published_sentence(clap: ClapSounds, models: Path) -> None:
    assert clap.card.prompts == ("This is a sound of {}",)
    tokens = AutoTokenizer.from_pretrained(models / MODEL)(["This is a sound of dog bark"], return_tensors="pt")
    with torch.no_grad():
        expected = ClapModel.from_pretrained(models / MODEL).get_text_features(**tokens).pooler_output.numpy()
    words = clap.encode_words(["dog bark", "a very much longer name of a sound"])
    np.testing.assert_allclose(words[:1], expected, atol=1e-5)
    assert words[0] @ words[1] < 0.999


def test_a_word_competes_at_the_temperature_that_the_model_learnt(clap: ClapSounds, models: Path) -> None:
    with torch.no_grad():
        scale = float(ClapModel.from_pretrained(models / MODEL).logit_scale_a.exp())
    assert clap._contrast.scale == pytest.approx(scale)  # the score itself is tested with known vectors
    assert clap._contrast.others.shape[1] == clap.card.dim


def test_a_sound_of_another_rate_is_resampled(clap: ClapSounds) -> None:
    low, high = (clap.encode(example_sound(seconds=2.0, rate_hz=rate)) for rate in (24_000, 48_000))
    tone = np.sin(2 * np.pi * 440.0 * np.arange(96_000) / 48_000).astype(np.float32)
    assert low.shape == high.shape == (1, clap.card.dim)
    same = clap.encode(Sound(tone[::2].copy(), 24_000)) @ clap.encode(Sound(tone, 48_000)).T
    assert same[0, 0] > 0.99


@pytest.mark.parametrize("samples", [np.zeros(0), np.array([0.1, np.nan]), np.array([np.inf])])
def test_what_is_no_sound_is_refused(clap: ClapSounds, samples: np.ndarray) -> None:
    with pytest.raises(AudioError, match=r"has no samples|are not finite numbers"):
        clap.encode(Sound(samples.astype(np.float32), RATE_HZ))


def test_silence_has_a_feature(clap: ClapSounds) -> None:
    assert np.linalg.norm(clap.encode(Sound(np.zeros(RATE_HZ, np.float32), RATE_HZ))[0]) == pytest.approx(1.0, abs=1e-5)


@pytest.mark.parametrize("fault", ["lacks", "unknown", "size", "damaged", "none"])
def test_another_checkpoint_is_refused_in_a_sentence(models: Path, fault: str) -> None:
    write_clap(models)
    path = models / MODEL / "model.safetensors"
    weights = load_file(path)
    name = "audio_projection.linear1.weight"
    if fault == "lacks":
        del weights[name]
    elif fault == "unknown":
        weights["audio_projection.linear3.weight"] = torch.zeros(2)
    elif fault == "size":
        weights[name] = weights[name][:3].clone()
    save_file(weights, path, metadata={"format": "pt"})
    if fault == "damaged":
        path.write_bytes(path.read_bytes()[:5000])
    elif fault == "none":
        path.unlink()
    told = {
        "lacks": "it lacks audio_projection.linear1.weight",
        "unknown": "nothing takes audio_projection.linear3.weight",
        "size": "linear1|size|mismatch",
        "damaged": "cannot be loaded as ClapModel",
        "none": "holds no weights",
    }[fault]
    with pytest.raises(BackendError, match=told) as raised:
        ClapSounds()
    assert "hf download laion/larger_clap_general" in str(raised.value)


def test_weights_are_read_from_the_published_bin_too_but_no_code_is_run(models: Path, tmp_path: Path) -> None:
    write_clap(models)
    path = models / MODEL / "model.safetensors"
    expected = ClapSounds().encode(noise(1.0))
    weights = load_file(path)
    path.unlink()
    torch.save(weights, models / MODEL / "pytorch_model.bin")
    np.testing.assert_allclose(ClapSounds().encode(noise(1.0)), expected, atol=1e-5)
    torch.save({**weights, "trap": _Trap(tmp_path / "sprung")}, models / MODEL / "pytorch_model.bin")
    with pytest.raises(BackendError, match="cannot be loaded as ClapModel"):
        ClapSounds()
    assert not (tmp_path / "sprung").exists()


class _Trap:
    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self) -> tuple[object, tuple[object, ...]]:
        return Path.touch, (self.path,)


def test_a_missing_tokenizer_is_told(models: Path) -> None:
    write_clap(models)
    for path in (models / MODEL).glob("tokenizer*"):
        path.unlink()
    with pytest.raises(BackendError, match=r"has no AutoTokenizer that can be loaded .*hf download"):
        ClapSounds()


def test_the_card_tells_weights_apart_and_no_folder(models: Path, tmp_path: Path) -> None:
    write_clap(models)
    here = ClapSounds().card
    shutil.copytree(models / MODEL, tmp_path / "elsewhere" / "larger_clap_general")
    moved = ClapSounds(str(tmp_path / "elsewhere" / "larger_clap_general")).card
    assert (here.id, here.licence, here.dim) == (MODEL, "Apache-2.0", 32)
    assert moved.id == "larger_clap_general"
    assert moved.checksum == here.checksum
    settings = models / MODEL / "preprocessor_config.json"
    settings.write_text(json.dumps({**json.loads(settings.read_text()), "frequency_min": 0}))
    assert ClapSounds().card.checksum != here.checksum
