"""The suite that names the clips of any folder: what it reads, what it leaves out, and its rooms."""

from pathlib import Path

import numpy as np
import pytest
import soundfile

from avlmaps.core.errors import AudioError
from avlmaps.perception.embedded.sounds import EmbeddedSounds
from avlmaps_sim.bench import sound_clips
from avlmaps_sim.bench.harness.settings import unheard_rows
from avlmaps_sim.bench.sound_clips import ESC10, ESC50
from avlmaps_sim.mixing.clips import find_clips


@pytest.fixture(scope="module")
def encoder(tmp_path_factory: pytest.TempPathFactory) -> EmbeddedSounds:
    return EmbeddedSounds(folder=tmp_path_factory.mktemp("profile"))


def write_clips(folder: Path, rows: list[tuple[str, str]]) -> None:
    rng = np.random.default_rng(0)
    for path, _ in rows:
        soundfile.write(folder / path, 0.1 * rng.standard_normal(16_000), 16_000)
    lines = ["path,category,fold,licence", *(f"{path},{category},,CC0" for path, category in rows)]
    (folder / "index.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")


def test_every_category_of_esc50_is_a_kind(encoder: EmbeddedSounds) -> None:
    names = sound_clips.kind_names(encoder)
    assert {names[category] for category in ESC50} == set(ESC50.values())
    assert {names[category] for category in ESC10} == set(ESC10)
    assert len(set(ESC50.values()) | set(ESC10)) == 50


def test_clips_of_recordings_that_taught_the_weights_are_left_out(encoder: EmbeddedSounds, tmp_path: Path) -> None:
    source = min(encoder.sources)
    write_clips(tmp_path, [(f"4-{source}-B-1.wav", "rooster"), ("1-1-A-1.wav", "rooster"), ("x.wav", "guitar")])
    clips = sound_clips.read_clips(tmp_path, encoder)
    assert [clip.heard for clip in clips] == [True, False, False]
    assert [clip.kind for clip in clips] == ["rooster", "rooster", ""]


def test_esc50_as_it_is_downloaded_is_read_and_its_first_fold_is_unheard(
    encoder: EmbeddedSounds, tmp_path: Path
) -> None:
    (tmp_path / "meta").mkdir()
    (tmp_path / "audio").mkdir()
    rows = [("1-100032-A-0.wav", 1, "dog"), ("1-1791-A-26.wav", 1, "laughing"), ("5-9032-A-0.wav", 5, "dog")]
    for name, _, _ in rows:
        soundfile.write(tmp_path / "audio" / name, 0.1 * np.random.default_rng(0).standard_normal(16_000), 16_000)
    lines = ["filename,fold,target,category,esc10,src_file,take"]
    lines += [f"{name},{fold},0,{category},False,1,A" for name, fold, category in rows]
    (tmp_path / "meta" / "esc50.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    assert [clip.kind for clip in sound_clips.read_clips(tmp_path, encoder)] == ["dog bark", "laughing", "dog bark"]
    assert {clip.category for clip in find_clips(tmp_path)} == {"dog bark", "laughing"}
    assert [row["path"] for row in unheard_rows(tmp_path)] == ["audio/1-100032-A-0.wav", "audio/1-1791-A-26.wav"]


def test_a_folder_gives_every_table(tmp_path: Path) -> None:
    write_clips(tmp_path, [("1-1-A-1.wav", "rooster"), ("1-2-A-1.wav", "door_wood_knock"), ("x.wav", "guitar")])
    tables = sound_clips.run(tmp_path)
    assert set(tables) == {
        "clips", "by name", "by name, each kind", "in rooms, 4 m away", "sounds of no known kind"
    }  # fmt: skip
    questions = [row[:2] for row in tables["by name"]["rows"]]
    assert ["ESC-10", "right name first among 10 names"] in questions
    assert ["others", "right name first among 11 names"] in questions
    assert len(tables["in rooms, 4 m away"]["rows"]) == 2 * (1 + len(sound_clips.RT60_S))
    for table in tables.values():
        assert all(len(row) == len(table["columns"]) for row in table["rows"])


@pytest.mark.parametrize("rt60_s", sound_clips.RT60_S)
def test_rooms_decay_as_they_should(rt60_s: float) -> None:
    response = sound_clips.room_response(rt60_s, 16_000)
    left = np.cumsum(response[::-1] ** 2)[::-1]
    level_db = 10.0 * np.log10(left / left[0])
    at = [int(np.argmax(level_db <= db)) / 16_000 for db in (-5.0, -25.0)]
    assert 3.0 * (at[1] - at[0]) == pytest.approx(rt60_s, rel=0.3)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("path,kind\na.wav,rain\n", "/index.csv lacks the column category; add it, or remove the file."),
        ("path,category\n", " has no index.csv that names a clip, and is not ESC-50; add one."),
    ],
)
def test_a_bad_index_is_refused(encoder: EmbeddedSounds, tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "index.csv").write_text(text, encoding="utf-8")
    with pytest.raises(AudioError) as refused:
        sound_clips.read_clips(tmp_path, encoder)
    assert str(refused.value) == f"{tmp_path}{said}"


def test_a_folder_that_taught_the_weights_is_refused(encoder: EmbeddedSounds, tmp_path: Path) -> None:
    write_clips(tmp_path, [(f"4-{min(encoder.sources)}-B-1.wav", "rooster")])
    with pytest.raises(AudioError) as refused:
        sound_clips.run(tmp_path)
    assert "fitted to all 1 clips" in str(refused.value)
