"""``sounds=efficientat``, made from the published checkpoint: its own names, ours, and what the file must hold."""

from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

if find_spec("onnx") is None:
    pytest.skip("the export needs onnx (requirements/foundation.txt)", allow_module_level=True)

from training.light.efficientat import read_names, write
from training.sounds.efficientat import opinion, read_efficientat
from training.sounds.mixtures import read_audio

from avlmaps.core.registry import Kind, forget_loaded, load
from avlmaps.perception.conformance import check
from avlmaps.perception.models import ModelSettings, using_models
from avlmaps.recordings.audio import Sound
from avlmaps_models.light.efficientat import MODEL, RATE_HZ, EfficientATSounds

SHARED = Path(__file__).resolve().parents[5] / "shared"
TEACHER, NAMES = SHARED / "teachers" / "mn04_as_mAP_432.pt", SHARED / "teachers" / "class_labels_indices.csv"
HEARD = {
    "dog bark": "esc10/dog_bark",
    "rooster": "esc10/rooster",
    "helicopter": "esc10/helicopter",
    "crying baby": "esc10/crying_baby",
    "chainsaw": "esc10/chainsaw",
    "rain": "esc10/rain",
}
pytestmark = pytest.mark.shared


@pytest.fixture(scope="module")
def models(tmp_path_factory: pytest.TempPathFactory) -> Path:
    if not TEACHER.is_file():
        pytest.skip(f"needs {TEACHER}, a published checkpoint that is not part of this repository")
    folder = tmp_path_factory.mktemp("models")
    (folder / MODEL).parent.mkdir()
    write(read_efficientat(TEACHER), read_names(NAMES), np.zeros(527), folder / MODEL)
    return folder


@pytest.fixture
def encoder(models: Path):
    with using_models(ModelSettings(folder=models, device="cpu", offline=True)):
        yield load(Kind.SOUNDS, "efficientat")
    forget_loaded()


def _clips() -> dict[str, np.ndarray]:
    folder = SHARED / "data" / "sounds"
    return {name: read_audio(sorted((folder / place).iterdir())[0]) for name, place in HEARD.items()}


def test_the_backend_conforms_to_the_protocol(encoder: EfficientATSounds) -> None:
    check(Kind.SOUNDS, encoder)


def test_the_published_network_and_the_file_give_the_same_log_odds(encoder: EfficientATSounds) -> None:
    waves = [np.pad(wave, (0, 5 * RATE_HZ))[: 5 * RATE_HZ] for wave in _clips().values()]
    said = opinion(read_efficientat(TEACHER), waves)
    ours = np.stack([encoder.logits(encoder.encode_samples(wave)) for wave in waves])
    assert np.abs(ours - said.logits).max() < 1e-3


def test_recordings_get_their_audioset_names_and_ours(encoder: EfficientATSounds) -> None:
    clips = _clips()
    sounds = [encoder.encode(Sound(wave, RATE_HZ)) for wave in clips.values()]
    scores = encoder.score_words(sounds, list(clips))
    right = int((scores.argmax(axis=1) == np.arange(len(clips))).sum())
    assert right >= len(clips) - 1, scores.round(2)
    bark = encoder.logits(sounds[0])[0]
    assert encoder.vocabulary[int(bark.argmax())] in ("Dog", "Animal", "Bark", "Domestic animals, pets")


def test_a_phrase_that_names_no_sound_gets_no_yes(encoder: EfficientATSounds) -> None:
    sounds = [encoder.encode(Sound(wave, RATE_HZ)) for wave in _clips().values()]
    assert encoder.score_words(sounds, ["a sideboard of oak", "tax return"]).max() < 0.5


def test_a_sound_is_of_its_own_kind(encoder: EfficientATSounds) -> None:
    features = [encoder.encode(Sound(wave, RATE_HZ)) for wave in _clips().values()]
    for i, asked in enumerate(features):
        assert int(encoder.score_sounds(features, asked).argmax()) == i
