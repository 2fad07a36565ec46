"""PE-A-Frame against transformers' own forward pass on a tiny random checkpoint, and what scores are made of it."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from safetensors.torch import load_file, save_file
from tiny.pe_a_frame import MODEL, write_pe_a_frame
from transformers import PeAudioFrameLevelModel, PeAudioProcessor

from avlmaps.core.errors import AudioError, BackendError
from avlmaps.core.registry import Kind
from avlmaps.maps.audio.segmentation import frames_of_track, split_at_changes
from avlmaps.perception.conformance import check
from avlmaps.perception.protocols import FrameSoundEncoder
from avlmaps.recordings.audio import AudioTrack, Sound, write_flac
from avlmaps_models.foundation.pe_a_frame import FrameSounds, _chunks, _Space

RATE_HZ, HOP = 48_000, 1920


@pytest.fixture
def framed(models: Path) -> FrameSounds:
    write_pe_a_frame(models)
    return FrameSounds()


def noise(samples: int, seed: int = 0) -> Sound:
    rng = np.random.default_rng(seed)
    level = np.repeat(rng.uniform(0.01, 0.5, samples // 9600 + 1), 9600)[:samples]
    return Sound((level * rng.standard_normal(samples)).astype(np.float32), RATE_HZ)


def by_transformers(folder: Path, sound: Sound, words: list[str]) -> tuple[np.ndarray, np.ndarray]:
    """Return the frames' embeddings and the logits (frames, words) of the published forward pass."""
    processor = PeAudioProcessor.from_pretrained(folder)
    inputs = processor(text=words, audio=sound.samples, sampling_rate=RATE_HZ, return_tensors="pt", padding=True)
    model = PeAudioFrameLevelModel.from_pretrained(folder)
    model.text_model.config.tie_last_hidden_states = False
    with torch.no_grad():
        out = model(**inputs)
    return out.audio_embeds[0].numpy(), out.logits_audio_text[0].numpy().T


def test_it_keeps_what_a_sound_encoder_promises(framed: FrameSounds) -> None:
    check(Kind.SOUNDS, framed)
    assert isinstance(framed, FrameSoundEncoder)
    assert framed.hop_s == pytest.approx(0.04)


@pytest.mark.parametrize("samples", [1000, HOP, 50 * HOP, 50 * HOP + 7])
def test_frames_and_their_probabilities_are_the_published_ones(framed: FrameSounds, models: Path, samples: int) -> None:
    sound, words = noise(samples), ["a person talking", "dog bark"]
    ours = framed.encode(sound)
    embeddings, logits = by_transformers(models / MODEL, sound, words)
    assert ours.shape == (-(-samples // HOP), framed.card.dim)
    lengths = np.linalg.norm(embeddings, axis=1, keepdims=True)
    directions = ours[:, :-1] / np.linalg.norm(ours[:, :-1], axis=1, keepdims=True)
    np.testing.assert_allclose(directions, embeddings / lengths, atol=1e-4)
    odds = odds_of_frames = logits - np.log(0.3 / 0.7)
    if len(odds) > 5:
        odds = np.stack([odds[i : i + 5].mean(axis=0) for i in range(len(odds) - 4)])
    expected = 1.0 / (1.0 + np.exp(-(odds.max(axis=0) if samples > 5 * HOP else odds.mean(axis=0))))
    np.testing.assert_allclose(framed.score_words([ours], words)[0], expected, atol=1e-4)
    yes = framed.encode_words(words) @ ours.T > 0.0
    clear = np.abs(odds_of_frames) > 1e-4
    np.testing.assert_array_equal(yes.T[clear], (odds_of_frames > 0.0)[clear])


def test_a_text_is_taken_before_the_last_normalisation_as_in_the_published_code(
    framed: FrameSounds, models: Path
) -> None:
    model = PeAudioFrameLevelModel.from_pretrained(models / MODEL)
    caught: list[torch.Tensor] = []
    model.text_model.final_norm.register_forward_pre_hook(lambda _, given: caught.append(given[0]))
    tokens = PeAudioProcessor.from_pretrained(models / MODEL).tokenizer(["glass breaking"], return_tensors="pt")
    with torch.no_grad():
        model.text_model(**tokens)
        before = model.text_audio_head(caught[0][:, 0]).numpy()
        after = model.text_audio_head(model.text_model.final_norm(caught[0])[:, 0]).numpy()
    ours = framed._texts(["glass breaking"])[:, :-1] / 0.7
    np.testing.assert_allclose(ours, before, atol=1e-4)
    assert np.abs(ours - after).max() > 1e-2
    assert framed.card.prompts == ("{}",)


def test_a_long_sound_is_encoded_in_chunks_that_know_their_neighbours(framed: FrameSounds) -> None:
    sound = noise(801 * HOP + 5)
    features = framed.encode(sound)
    assert features.shape == (802, framed.card.dim)
    np.testing.assert_allclose(np.linalg.norm(features, axis=1), 1.0, atol=1e-5)
    alone = framed.encode(Sound(sound.samples[: 700 * HOP], RATE_HZ))
    np.testing.assert_allclose(features[:650], alone[:650], atol=1e-5)


def test_a_track_is_mapped_whole_and_asked_by_its_stretches(framed: FrameSounds, tmp_path: Path) -> None:
    sound = noise(200 * HOP + 100)
    write_flac(tmp_path / "a.flac", sound)
    features = frames_of_track(AudioTrack.open(tmp_path / "a.flac"), framed)
    assert features.shape == (201, framed.card.dim)
    edges = split_at_changes(features, framed.hop_s)
    scores = framed.score_words([features[a:b] for a, b in pairwise(edges)], ["dog bark"])
    assert scores.shape == (len(edges) - 1, 1)
    assert len(edges) > 2


@given(frames=st.integers(1, 4000))
def test_chunks_give_every_frame_once_in_order_and_none_is_too_long(frames: int) -> None:
    given_ = [np.arange(begin, end)[kept] for begin, end, kept in _chunks(frames)]
    np.testing.assert_array_equal(np.concatenate(given_), np.arange(frames))
    assert all(0 < end - begin <= 750 for begin, end, _ in _chunks(frames))


@given(
    seed=st.integers(0, 1000),
    length=st.sampled_from([1e-3, 1.0, 30.0, 1e3]),
    r=st.sampled_from([1e-2, 1.0, 20.0]),
    bias=st.floats(-12.0, 3.0),
)
def test_homogeneous_coordinates_lose_nothing_that_the_model_says(
    seed: int, length: float, r: float, bias: float
) -> None:
    rng = np.random.default_rng(seed)
    frames, texts = (length * rng.standard_normal((4, 16)).astype(np.float32) for _ in range(2))
    space = _Space(r, 2.0 / length**2, bias)
    rows, asked = space.frames(frames), space.texts(texts)
    np.testing.assert_allclose(np.linalg.norm(rows, axis=1), 1.0, atol=1e-5)
    np.testing.assert_allclose(space.published(rows), frames, rtol=1e-4, atol=1e-4 * length)
    expected = 2.0 / length**2 * frames.astype(np.float64) @ texts.T.astype(np.float64) + bias + np.log(0.7 / 0.3)
    np.testing.assert_allclose(space.logits(rows, asked), expected, rtol=1e-4, atol=1e-3)


@pytest.fixture
def known(framed: FrameSounds, monkeypatch: pytest.MonkeyPatch) -> tuple[FrameSounds, dict[str, np.ndarray]]:
    """Return an encoder whose words are known directions: a frame along its word is a yes, any other a clear no."""
    space = _Space(1.0, 1.0, -8.0)
    rng = np.random.default_rng(0)
    texts: dict[str, np.ndarray] = {}

    def text(word: str) -> np.ndarray:
        if word not in texts:
            direction = rng.standard_normal(32).astype(np.float32)
            texts[word] = 4.0 * direction / np.linalg.norm(direction)
        return texts[word]

    monkeypatch.setattr(framed, "_space", space)
    monkeypatch.setattr(framed, "_texts", lambda words: space.texts(np.stack([text(word) for word in words])))
    framed.encode_words(["dog barking", "rain"])
    return framed, texts


def frames_of(known: tuple[FrameSounds, dict[str, np.ndarray]], *spans: tuple[str, int]) -> np.ndarray:
    framed, texts = known
    rng = np.random.default_rng(1)
    rows = [texts[word] + 0.2 * rng.standard_normal(32) if word else 0.2 * rng.standard_normal(32)
            for word, count in spans for _ in range(count)]  # fmt: skip
    return framed._space.frames(np.asarray(rows, np.float32))


def test_the_word_that_holds_is_a_yes_and_a_wrong_word_is_not(known: tuple[FrameSounds, dict[str, np.ndarray]]) -> None:
    sounds = [
        frames_of(known, ("", 40), ("dog barking", 8), ("", 40)),
        frames_of(known, ("rain", 100)),
        frames_of(known, ("", 100)),
        frames_of(known, ("rain", 2)),
    ]
    scores = known[0].score_words(sounds, ["dog barking", "rain"])
    np.testing.assert_array_equal(scores >= 0.5, [[True, False], [False, True], [False, False], [False, True]])
    assert np.isfinite(scores).all()
    assert ((scores >= 0.0) & (scores <= 1.0)).all()


def test_one_odd_frame_is_no_yes(known: tuple[FrameSounds, dict[str, np.ndarray]]) -> None:
    sound = frames_of(known, ("", 40), ("dog barking", 1), ("", 40))
    assert known[0].score_words([sound], ["dog barking"])[0, 0] < 0.5


def test_a_clip_finds_its_kind_though_it_begins_and_ends_in_silence(
    known: tuple[FrameSounds, dict[str, np.ndarray]],
) -> None:
    asked = frames_of(known, ("", 50), ("dog barking", 25), ("", 50))
    sounds = [
        frames_of(known, ("", 25), ("dog barking", 50)),
        frames_of(known, ("rain", 75)),
        frames_of(known, ("", 75)),
    ]
    scores = known[0].score_sounds(sounds, asked)
    assert scores[0] >= 0.5 > scores[1:].max()


@pytest.mark.parametrize("samples", [np.zeros(0), np.array([0.1, np.nan])])
def test_what_is_no_sound_is_refused(framed: FrameSounds, samples: np.ndarray) -> None:
    with pytest.raises(AudioError, match=r"has no samples|are not finite numbers"):
        framed.encode(Sound(samples.astype(np.float32), RATE_HZ))


@pytest.mark.parametrize("fault", ["lacks", "unknown"])
def test_another_checkpoint_is_refused_in_a_sentence(models: Path, fault: str) -> None:
    write_pe_a_frame(models)
    path = models / MODEL / "model.safetensors"
    weights = load_file(path)
    if fault == "lacks":
        del weights["audio_head.proj.weight"]
    else:
        weights["video_head.proj.weight"] = torch.zeros(2)
    save_file(weights, path, metadata={"format": "pt"})
    told = "it lacks audio_head.proj.weight" if fault == "lacks" else "nothing takes video_head.proj.weight"
    with pytest.raises(BackendError, match=f"{told}.*hf download {MODEL}"):
        FrameSounds()
