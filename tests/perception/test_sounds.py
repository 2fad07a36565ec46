"""The embedded sound encoder: its promises, and a smoke test on recordings (which its weights have heard)."""

import json
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.errors import AudioError
from avlmaps.perception.embedded import logmel
from avlmaps.perception.embedded.sounds import EmbeddedSounds
from avlmaps.perception.embedded.words import EmbeddedWords
from avlmaps.recordings.audio import AudioTrack, Sound

RATE_HZ = 44_100


@pytest.fixture(scope="module")
def encoder(tmp_path_factory: pytest.TempPathFactory) -> EmbeddedSounds:
    return EmbeddedSounds(folder=tmp_path_factory.mktemp("profile"))


def noise(seconds: float, rate_hz: int = RATE_HZ, seed: int = 0) -> Sound:
    samples = 0.1 * np.random.default_rng(seed).standard_normal(max(1, round(seconds * rate_hz)))
    return Sound(samples.astype(np.float32), rate_hz)


def beeps(hz: float, seconds: float = 3.0) -> Sound:
    t = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    return Sound((0.3 * np.sin(2 * np.pi * hz * t) * (t % 0.5 < 0.2)).astype(np.float32), RATE_HZ)


def test_weights_of_a_folder_are_heard_with(encoder: EmbeddedSounds, tmp_path: Path) -> None:
    weights = files("avlmaps.perception.embedded") / "weights"
    for name in ("sounds.onnx", "sounds.json", "sounds.npy"):
        (tmp_path / name).write_bytes((weights / name).read_bytes())
    assert EmbeddedSounds(weights=tmp_path).card == encoder.card


def test_weights_take_at_most_four_megabytes() -> None:
    weights = files("avlmaps.perception.embedded") / "weights"
    assert sum(len((weights / name).read_bytes()) for name in ("sounds.onnx", "sounds.json", "sounds.npy")) <= 4_000_000


def test_the_weights_live_in_the_space_of_the_shipped_words() -> None:
    notes = json.loads((files("avlmaps.perception.embedded") / "weights" / "sounds.json").read_text())
    assert notes["words"] == EmbeddedWords().card.checksum, "run python -m training.sounds to turn the features"


@given(seconds=st.floats(0.0, 20.0), rate_hz=st.sampled_from([8_000, 16_000, 22_050, 44_100, 48_000]))
def test_any_length_gives_unit_vectors(encoder: EmbeddedSounds, seconds: float, rate_hz: int) -> None:
    features = encoder.encode(noise(seconds, rate_hz))
    assert features.dtype == np.float32
    assert features.shape[1] == 128
    np.testing.assert_allclose(np.linalg.norm(features, axis=1), 1.0, atol=1e-5)


@given(frames=st.integers(1, 3000))
def test_windows_cover_every_frame(frames: int) -> None:
    mels = np.repeat(np.arange(1, frames + 1, dtype=np.float32)[:, None], logmel.BANDS, axis=1)
    windows = logmel.windows(mels)
    assert set(np.arange(1, frames + 1)) <= set(windows[:, :, 0].ravel().round().astype(int))
    if frames > logmel.WINDOW_FRAMES:
        assert windows.min() >= 1.0  # none is padded
        assert len(windows) == 1 + -(-(frames - logmel.WINDOW_FRAMES) // logmel.WINDOW_HOP_FRAMES)


def test_long_sounds_are_heard_to_their_end(encoder: EmbeddedSounds) -> None:
    quiet = noise(30.0)
    late = quiet.samples.copy() * 0.01
    late[-RATE_HZ * 3 :] += beeps(2000.0).samples
    features = encoder.encode(Sound(late, RATE_HZ))
    start = encoder.encode(Sound(late[: RATE_HZ * 5], RATE_HZ))
    assert len(features) > 8
    assert float(features[-1] @ start[0]) < 0.9


def test_loudness_does_not_matter(encoder: EmbeddedSounds) -> None:
    sound = beeps(1000.0)
    soft = Sound(sound.samples * np.float32(0.01), RATE_HZ)
    np.testing.assert_allclose(encoder.encode(sound), encoder.encode(soft), atol=1e-3)


def test_silence_and_noise_have_no_name(encoder: EmbeddedSounds) -> None:
    hum = np.sin(2 * np.pi * 50 * np.arange(6 * RATE_HZ) / RATE_HZ).astype(np.float32) ** 3
    features = [encoder.encode(Sound(samples, RATE_HZ)) for samples in (0.0 * hum, noise(6.0).samples, hum)]
    assert encoder.score_words(features, encoder.vocabulary).max() < 0.5


@pytest.mark.parametrize(
    ("samples", "said"),
    [
        ([], "The sound has no samples; give a sound of at least a few milliseconds."),
        ([0.0, np.nan], "The sound has 1 samples of 2 that are not finite numbers; convert it again from its source."),
    ],
)
def test_what_cannot_be_heard_is_refused(encoder: EmbeddedSounds, samples: list[float], said: str) -> None:
    with pytest.raises(AudioError, match=said):
        encoder.encode(Sound(np.array(samples, np.float32), RATE_HZ))


def test_without_sounds_or_words_there_are_no_scores(encoder: EmbeddedSounds) -> None:
    sounds = [encoder.encode(noise(1.0)), encoder.encode(beeps(900.0, 12.0))]
    assert encoder.score_words([], ["rain"]).shape == (0, 1)
    assert encoder.score_words(sounds, []).shape == (2, 0)
    assert encoder.score_sounds([], sounds[0]).shape == (0,)


def test_a_sound_is_of_its_own_kind(encoder: EmbeddedSounds) -> None:
    features = encoder.encode(noise(3.0))
    other = encoder.encode(beeps(3000.0))
    scores = encoder.score_sounds([features, other], features)
    assert scores[0] > scores[1]


def test_a_phrase_that_names_no_sound_finds_none(encoder: EmbeddedSounds) -> None:
    features = [encoder.encode(noise(3.0)), encoder.encode(beeps(2500.0))]
    assert encoder.score_words(features, ["cardboard box", "blue armchair"]).max() < 0.5


def test_every_kind_says_what_it_was_learnt_from(encoder: EmbeddedSounds) -> None:
    origins = {kind.name: kind.origin for kind in encoder.kinds}
    assert set(origins.values()) == {"recorded", "synthesised"}
    assert sum(origin == "recorded" for origin in origins.values()) == 50
    assert origins["dog bark"] == "recorded"
    assert origins["glass breaking"] == "recorded"
    assert origins["doorbell"] == "synthesised"
    assert len(encoder.sources) > 250
    assert len(origins) == len(encoder.kinds) >= 60


def test_recordings_are_recognised(encoder: EmbeddedSounds, shared_data: Path) -> None:
    folder = shared_data / "data" / "sounds" / "esc10"
    kinds = {"dog_bark": "a dog barking", "rain": "rainfall", "rooster": "rooster", "crying_baby": "infant crying"}
    clips = [sorted((folder / kind).glob("*.ogg"))[0] for kind in kinds]
    features = [encoder.encode(AudioTrack.open(clip).read()) for clip in clips]
    scores = encoder.score_words(features, list(kinds.values()))
    assert (scores.argmax(axis=0) == np.arange(4)).all()
    assert np.diag(scores).min() >= 0.5
    assert (scores - np.diag(np.diag(scores))).max() < 0.5


def test_recordings_of_another_collection_are_named(encoder: EmbeddedSounds, shared_data: Path) -> None:
    """Seven clips from elsewhere that no weights were fitted to; a network of random weights names none or one."""
    folder = shared_data / "data" / "sounds" / "other"
    clips = {
        "clapping": "applause/max_applause.wav",
        "birds chirping": "chirping_birds/max_birds1.wav",
        "car engine": "car_engine/max_car_engine.wav",
        "rain": "rain/max_rain.wav",
        "snoring": "snoring/max_snoring.wav",
        "keyboard typing": "keyboard_typing/max_typing.wav",
        "thunder": "thunder/max_thunder.wav",
    }
    recorded = [kind.called[0] for kind in encoder.kinds if kind.origin == "recorded"]
    features = [encoder.encode(AudioTrack.open(folder / clip).read()) for clip in clips.values()]
    scores = encoder.score_words(features, recorded)
    right = [recorded[best] == name for best, name in zip(scores.argmax(axis=1), clips, strict=True)]
    assert sum(right) >= 5
    own = [scores[i, recorded.index(name)] for i, name in enumerate(clips)]
    assert float(np.median(own)) >= 0.5
