"""AudioCLIP as a sound encoder: what goes in, what is scored, and files that are not its."""

import pickle
import shutil
from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from tiny.audioclip import DIM, MODEL, tiny_state, write_audioclip

from avlmaps.core.errors import BackendError
from avlmaps.core.registry import Kind, load
from avlmaps.perception.conformance import check, example_sound
from avlmaps.recordings.audio import Sound
from avlmaps_models.common.sound_windows import windows
from avlmaps_models.paper.audioclip import AudioClipSounds
from avlmaps_models.paper.fbsp import FrontEnd

RATE_HZ = 44_100


@pytest.fixture
def encoder(models: Path) -> AudioClipSounds:
    write_audioclip(models)
    return load(Kind.SOUNDS, "audioclip")


def noise(seconds: float, seed: int = 0) -> Sound:
    rng = np.random.default_rng(seed)
    return Sound(rng.normal(0, 0.1, round(seconds * RATE_HZ)).astype(np.float32), RATE_HZ)


def test_it_conforms(encoder):
    check(Kind.SOUNDS, encoder)


def test_the_card_says_what_it_is(encoder):
    card = encoder.card
    assert (card.id, card.dim, card.licence, card.prompts) == (MODEL, DIM, "MIT", ("{}",))
    assert encoder.vocabulary == ()


def test_five_seconds_go_in_as_16_bit_samples_and_nothing_else_is_done_to_them(encoder):
    sound = noise(5.0)
    network = encoder._network
    with torch.no_grad():
        front_end = FrontEnd.of(network.audio.fbsp, network.audio.window, torch.device("cpu"))
        wanted = network.audio(front_end(torch.from_numpy(32768.0 * sound.samples)[None]))[0].numpy()
    assert np.allclose(encoder.encode(sound)[0], wanted / np.linalg.norm(wanted), atol=1e-6)


def test_a_short_sound_is_filled_up_with_silence_behind_it(encoder):
    short = noise(1.2)
    filled = np.concatenate([short.samples, np.zeros(5 * RATE_HZ - len(short.samples), np.float32)])
    np.testing.assert_allclose(encoder.encode(short), encoder.encode(Sound(filled, RATE_HZ)), atol=1e-5)


def test_a_long_sound_is_encoded_whole_and_begins_as_the_published_code_heard_it(encoder):
    sound = noise(12.0)
    found = encoder.encode(sound)
    parts = [sound.samples[at * RATE_HZ : (at + 5) * RATE_HZ] for at in (0, 5, 7)]
    alone = np.concatenate([encoder.encode(Sound(part, RATE_HZ)) for part in parts])
    assert np.allclose(found, alone, atol=1e-6)
    assert np.abs(alone[0] - alone[1]).max() > 1e-3


def test_another_rate_is_brought_to_its_own(encoder):
    from avlmaps.recordings.audio import resample

    sound = example_sound(seconds=2.0, rate_hz=16_000)
    np.testing.assert_allclose(encoder.encode(sound), encoder.encode(resample(sound, RATE_HZ)), atol=1e-5)


def test_loudness_counts(encoder):
    sound = noise(1.0)
    quieter = Sound(0.01 * sound.samples, RATE_HZ)
    assert np.abs(encoder.encode(sound) - encoder.encode(quieter)).max() > 1e-3


def test_silence_has_a_feature(encoder):
    found = encoder.encode(Sound(np.zeros(1000, np.float32), RATE_HZ))
    assert np.linalg.norm(found, axis=1) == pytest.approx([1.0])


@given(count=st.integers(1, 400), length=st.integers(1, 90))
def test_windows_cover_a_sound_without_a_gap(count, length):
    samples = np.arange(1, count + 1, dtype=np.float32)
    found = np.stack(windows(np.pad(samples, (0, max(0, length - count))), length, length))
    assert found.shape == (max(1, -(-count // length)), length)
    assert set(found[found > 0]) == set(samples)
    assert np.array_equal(found[0, : min(count, length)], samples[:length])
    if count > length:
        assert (np.diff(found, axis=1) == 1.0).all()
        assert found[-1, -1] == count


def test_words_go_into_the_text_tower_bare(encoder):
    tokens = torch.tensor([[49406, 1929, 49407]])  # "dog"
    with torch.no_grad():
        wanted = encoder._network(tokens)[0].numpy()
    assert np.allclose(encoder.encode_words(["Dog"])[0], wanted / np.linalg.norm(wanted), atol=1e-6)
    assert encoder.encode_words([]).shape == (0, DIM)


def test_a_brace_in_a_word_is_a_brace(encoder):
    words = encoder.encode_words(["a {} dog", "a {0} dog", "dog"])
    assert np.abs(words[0] - words[2]).max() > 1e-4
    assert np.isfinite(words).all()


def test_the_logits_are_the_published_ones(encoder):
    """A score's log-odds are the scaled cosine less the log-sum of those of what it competes with."""
    heard = encoder.encode(noise(1.0))
    word = encoder.encode_words(["rain"])
    against = encoder._contrast.others
    score = float(encoder.score_words([heard], ["rain"])[0, 0])
    logits = 70.0 * (heard @ against.T)[0].astype(np.float64)
    near = against @ word[0]
    kept = near <= np.sort(near)[-4]  # at most three of the list are left out as synonyms
    own = 70.0 * float(heard[0] @ word[0])
    odds = [own - np.log(np.exp(logits[which]).sum()) for which in (kept, np.ones(len(near), bool))]
    assert 1 / (1 + np.exp(-odds[1])) - 1e-6 <= score <= 1 / (1 + np.exp(-odds[0])) + 1e-6


def test_a_phrase_is_scored_alone_whatever_is_asked_beside_it(encoder):
    heard = [encoder.encode(noise(1.0)), encoder.encode(noise(11.0, 1))]
    together = encoder.score_words(heard, ["rain", "dog", "rain"])
    assert np.allclose(together[:, 1], encoder.score_words(heard, ["dog"])[:, 0], atol=1e-5)
    np.testing.assert_allclose(together[:, 0], together[:, 2], atol=1e-5)


def test_a_sound_is_of_its_own_kind(encoder):
    heard = [encoder.encode(noise(1.0)), encoder.encode(example_sound())]
    assert encoder.score_sounds(heard, heard[1])[1] > 0.99


def test_another_published_file_can_be_chosen_by_name_or_by_path(models, tmp_path):
    write_audioclip(models, "AudioCLIP-Full-Training.pt")
    by_name = load(Kind.SOUNDS, "audioclip@AudioCLIP-Full-Training.pt")
    shutil.copy(models / "AudioCLIP-Full-Training.pt", tmp_path / "mine.pt")
    by_path = AudioClipSounds(str(tmp_path / "mine.pt"))
    assert by_name.card.id == "AudioCLIP-Full-Training.pt"
    assert by_path.card.id == "mine.pt"
    assert by_path.card.checksum == by_name.card.checksum
    state = tiny_state()
    state["audio.fc.bias"] = state["audio.fc.bias"] + 0.1
    torch.save(state, tmp_path / "other.pt")
    assert AudioClipSounds(str(tmp_path / "other.pt")).card.checksum != by_path.card.checksum


def test_the_empty_bias_may_be_missing(models):
    state = tiny_state()
    del state["audio.fbsp.bias"]
    torch.save(state, models / MODEL)
    AudioClipSounds()


CHANGES = {
    "it lacks audio.att3.bn.bias. Get": lambda state: state.pop("audio.att3.bn.bias"),
    "it lacks visual.layer2.1.bn1.running_var. Get": lambda state: state.pop("visual.layer2.1.bn1.running_var"),
    "it lacks logit_scale_ai. Get": lambda state: state.pop("logit_scale_ai"),
    "nothing takes audio.att6.bn.bias. Get": lambda state: state.update({"audio.att6.bn.bias": torch.zeros(2)}),
    "nothing takes audio.fbsp.bias. Get": lambda state: state.update({"audio.fbsp.bias": torch.zeros(129, 2)}),
    "of another size is audio.att1.conv_depth.weight": lambda state: state.update(
        {"audio.att1.conv_depth.weight": torch.zeros(8, 1, 1, 3)}
    ),
    "KeyError": lambda state: state.pop("audio.fbsp.m"),
    "holds more than weights (epoch)": lambda state: state.update({"epoch": 3}),
    "made with 7 tokens": lambda state: state.update({"token_embedding.weight": torch.zeros(7, 32)}),
}


@pytest.mark.parametrize("told", CHANGES)
def test_a_checkpoint_that_is_not_whole_or_not_its_own_is_refused_in_one_sentence(models, told):
    state = tiny_state()
    CHANGES[told](state)
    torch.save(state, models / MODEL)
    with pytest.raises(BackendError) as fault:
        AudioClipSounds()
    assert told in str(fault.value)
    assert MODEL in str(fault.value)
    assert "curl -LO https://github.com/AndreyGuzhov/AudioCLIP/releases/download/v0.1/" in str(fault.value)


class Harmful:
    def __reduce__(self):
        return Path.touch, (Path("was-run"),)


@pytest.mark.parametrize("content", ["cut", "text", "code"])
def test_a_damaged_file_is_refused_and_code_in_it_is_not_run(models, content, monkeypatch):
    monkeypatch.chdir(models)
    write_audioclip(models)
    whole = (models / MODEL).read_bytes()
    held = {
        "cut": whole[: len(whole) // 2],
        "text": b"<html>not found</html>",
        "code": pickle.dumps(Harmful(), protocol=2),
    }
    (models / MODEL).write_bytes(held[content])
    with pytest.raises(BackendError, match="cannot be read as a file of weights"):
        AudioClipSounds()
    assert not (models / "was-run").exists()


def test_a_file_that_is_not_here_says_how_to_get_it(models):
    with pytest.raises(BackendError, match=r"AudioCLIP-Partial-Training\.pt is not here .* curl -LO https"):
        AudioClipSounds()
