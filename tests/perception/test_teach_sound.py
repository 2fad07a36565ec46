"""Teaching the encoder a sound of one's own, and forgetting it again."""

from pathlib import Path

import numpy as np
import pytest
import soundfile

from avlmaps.core.errors import AudioError, BackendError
from avlmaps.perception.embedded.sounds import EmbeddedSounds
from avlmaps.perception.enrolment import enrolled_sounds, forget_sound, sounds_folder, teach_sound
from avlmaps.perception.models import user_folder
from avlmaps.recordings.audio import AudioTrack, Sound

RATE_HZ = 22_050


@pytest.fixture(scope="module")
def encoder(tmp_path_factory: pytest.TempPathFactory) -> EmbeddedSounds:
    return EmbeddedSounds(folder=tmp_path_factory.mktemp("profile"))


@pytest.fixture
def knowing(encoder: EmbeddedSounds, tmp_path: Path) -> EmbeddedSounds:
    encoder._folder = tmp_path
    return encoder


def sparkle(seed: int) -> Sound:
    """A made-up toy: a fast arpeggio of glassy pings, different in every clip."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(0.25 * RATE_HZ)) / RATE_HZ
    samples = 0.002 * rng.standard_normal(3 * RATE_HZ)
    for k, onset in enumerate(np.arange(0.2, 2.6, 0.11 + 0.01 * rng.random())):
        hz = 700.0 * (1.0 + 0.03 * rng.standard_normal()) * 2 ** ((k % 6) / 3)
        ping = np.sin(2 * np.pi * hz * t) * np.exp(-t / 0.06)
        start = round(onset * RATE_HZ)
        samples[start : start + len(ping)] += 0.3 * ping[: len(samples) - start]
    return Sound(samples.astype(np.float32), RATE_HZ)


def hiss(seed: int) -> Sound:
    return Sound((0.1 * np.random.default_rng(seed).standard_normal(3 * RATE_HZ)).astype(np.float32), RATE_HZ)


def test_a_taught_sound_is_known_by_its_name_and_a_paraphrase(knowing: EmbeddedSounds, tmp_path: Path) -> None:
    sounds = [knowing.encode(sparkle(9)), knowing.encode(hiss(0))]
    before = knowing.score_words(sounds, ["toy robot"])
    teach_sound("toy robot", [sparkle(seed) for seed in range(3)], tmp_path, knowing)
    after = knowing.score_words(sounds, ["toy robot", "the robot toy", "rain"])
    assert before.max() < 0.5
    assert after[0, 0] >= 0.5
    assert after[0, 1] >= 0.5
    assert after[1, :2].max() < 0.5
    assert after[0, 2] < 0.5
    assert knowing.vocabulary[-1] == "toy robot"


def test_a_forgotten_sound_is_known_no_more(knowing: EmbeddedSounds, tmp_path: Path) -> None:
    teach_sound("toy robot", [sparkle(0)], tmp_path, knowing)
    forget_sound("Toy  robot", tmp_path)
    assert enrolled_sounds(tmp_path) == []
    assert "toy robot" not in knowing.vocabulary
    with pytest.raises(BackendError) as refused:
        forget_sound("toy robot", tmp_path)
    assert str(refused.value) == "No sound called 'toy robot' was taught; taught are: none."


def test_what_is_kept_is_what_was_taught(knowing: EmbeddedSounds, tmp_path: Path) -> None:
    file = tmp_path / "clip.wav"
    soundfile.write(file, sparkle(0).samples, RATE_HZ)
    taught = teach_sound("  our   kettle's whistle ", [file, sparkle(1)], tmp_path, knowing)
    (kept,) = enrolled_sounds(tmp_path)
    assert kept.name == taught.name == "our kettle's whistle"
    assert kept.clips == ("clip.wav", "the clip")
    assert kept.checksum == knowing.card.checksum
    np.testing.assert_array_equal(kept.features, taught.features)


def test_names_that_look_alike_as_files_stay_apart(knowing: EmbeddedSounds, tmp_path: Path) -> None:
    for name in ("Tür", "Tur", "门铃", "../../etc"):
        teach_sound(name, [sparkle(0)], tmp_path, knowing)
    assert {taught.name for taught in enrolled_sounds(tmp_path)} == {"Tür", "Tur", "门铃", "../../etc"}
    assert all(path.parent == sounds_folder(tmp_path) for path in sounds_folder(tmp_path).iterdir())


def test_teaching_again_replaces(knowing: EmbeddedSounds, tmp_path: Path) -> None:
    teach_sound("toy", [sparkle(0)], tmp_path, knowing)
    teach_sound("Toy", [sparkle(1), sparkle(2)], tmp_path, knowing)
    (kept,) = enrolled_sounds(tmp_path)
    assert kept.name == "Toy"
    assert len(kept.clips) == 2


def test_sounds_taught_to_other_weights_are_left_out(knowing: EmbeddedSounds, tmp_path: Path) -> None:
    teach_sound("toy", [sparkle(0)], tmp_path, knowing)
    (notes,) = sounds_folder(tmp_path).glob("*/sound.json")
    notes.write_text(notes.read_text().replace(knowing.card.checksum, "0" * 64))
    assert knowing.taught == ()
    assert [taught.name for taught in enrolled_sounds(tmp_path)] == ["toy"]


def test_what_teaches_nothing_is_refused(knowing: EmbeddedSounds, tmp_path: Path) -> None:
    soundfile.write(tmp_path / "silence.wav", np.zeros(RATE_HZ), RATE_HZ)
    (tmp_path / "broken.wav").write_bytes(b"no sound at all")
    for name, clips, kind, said in (
        ("toy", ["silence.wav"], AudioError, r"nothing to hear in silence\.wav \(peak 0\.000000 of 1\); give a clip"),
        ("toy", ["broken.wav"], AudioError, r"broken\.wav"),
        ("toy", ["missing.wav"], AudioError, r"missing\.wav"),
        ("toy", [], AudioError, "No clips were given to learn 'toy' from; give at least one sound file"),
        ("  ", ["silence.wav"], BackendError, "A taught sound needs a name; give one, as you would ask for it"),
    ):
        with pytest.raises(kind, match=said):
            teach_sound(name, [tmp_path / clip for clip in clips], tmp_path, knowing)
    assert enrolled_sounds(tmp_path) == []


def test_damaged_notes_are_named(knowing: EmbeddedSounds, tmp_path: Path) -> None:
    teach_sound("toy", [sparkle(0)], tmp_path, knowing)
    (notes,) = sounds_folder(tmp_path).glob("*/sound.json")
    notes.write_text("{")
    with pytest.raises(BackendError) as refused:
        enrolled_sounds(tmp_path)
    assert str(refused.value).startswith(f"The taught sound in {notes.parent} is damaged")
    assert str(refused.value).endswith("; delete it and teach it again.")


def test_the_profile_folder_can_be_moved(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("AVLMAPS_HOME", str(tmp_path))
    assert user_folder() == tmp_path
    monkeypatch.delenv("AVLMAPS_HOME")
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    monkeypatch.setattr("sys.platform", "linux")
    assert user_folder() == tmp_path / "avlmaps"
    monkeypatch.setattr("sys.platform", "win32")
    monkeypatch.setenv("APPDATA", str(tmp_path / "roaming"))
    assert user_folder() == tmp_path / "roaming" / "avlmaps"


def test_real_recordings_can_be_taught(knowing: EmbeddedSounds, tmp_path: Path, shared_data: Path) -> None:
    folder = shared_data / "data" / "sounds" / "other"
    guitars = sorted((folder / "guitar").glob("*"))
    teach_sound("guitar", guitars[:1], tmp_path, knowing)
    heard = [AudioTrack.open(path).read(4.0) for path in (guitars[0], folder / "thunder" / "max_thunder.wav")]
    scores = knowing.score_words([knowing.encode(sound) for sound in heard], ["guitar"])[:, 0]
    assert scores[0] >= 0.5 > scores[1]
