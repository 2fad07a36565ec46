import csv
import hashlib
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import soundfile
from audio_fakes import FakeWalk, quiet, straight_walk, tone, track_of

from avlmaps.core.errors import AudioError, RecordingError
from avlmaps.maps.audio.segmentation import segment
from avlmaps.recordings.audio import AudioTrack, Sound
from avlmaps.recordings.open import open_recording
from avlmaps_sim.mixing.add_sounds import add_sounds
from avlmaps_sim.mixing.clips import audible, find_clips, loudness_db
from avlmaps_sim.mixing.spacing import Placer, Spacing, Walk, capacity, chosen_spacing

RATE_HZ = 16_000
NAMES = ("bell", "dog_bark", "tap", "whistle", "door")


@pytest.fixture
def clips(tmp_path: Path) -> Path:
    """Two clips each of five categories, padded with silence to three seconds as collections do."""
    for i, name in enumerate(NAMES):
        (tmp_path / "clips" / name).mkdir(parents=True)
        for j in range(2):
            sound = np.concatenate([quiet(0.5), tone(0.5 + 0.25 * j, hz=500.0 * (i + 1)), quiet(2.0)])
            soundfile.write(tmp_path / "clips" / name / f"{j}.wav", sound, RATE_HZ)
    return tmp_path / "clips"


def digest(folder: Path) -> str:
    return hashlib.sha256((folder / "audio.flac").read_bytes() + (folder / "events.csv").read_bytes()).hexdigest()


@pytest.mark.nightly
def test_the_same_seed_gives_the_same_bytes(tmp_path: Path, clips: Path) -> None:
    walk = straight_walk(60.0, 0.5)
    for name, seed in (("a", 1), ("b", 1), ("c", 2)):
        add_sounds(walk, clips, tmp_path / name, seed=seed, background="pink", snr_db=20.0, progress=False)
    assert digest(tmp_path / "a") == digest(tmp_path / "b")
    assert digest(tmp_path / "a") != digest(tmp_path / "c")


def test_events_are_apart_in_time_and_place_and_every_category_comes_before_one_repeats(
    tmp_path: Path, clips: Path
) -> None:
    events = add_sounds(straight_walk(60.0, 0.5), clips, tmp_path / "out", interval_s=1.5, progress=False)
    assert len(events) > 5
    assert len({event.category for event in events[:5]}) == 5
    assert {event.category for event in events} == {"bell", "dog bark", "tap", "whistle", "door"}
    for before, after in pairwise(events):
        assert after.onset_s - before.offset_s >= 1.5 - 1e-6
        assert 0.5 * (after.onset_s - before.offset_s) >= 2.0 - 0.06  # the robot walks at 0.5 m/s
    for event in events:
        assert event.position[0] == pytest.approx(0.25 * (event.onset_s + event.offset_s), abs=0.03)


def test_the_track_holds_what_the_events_say(tmp_path: Path, clips: Path) -> None:
    events = add_sounds(straight_walk(40.0, 0.5), clips, tmp_path / "out", loudness_db=-20.0, progress=False)
    recording = open_recording(tmp_path / "out")
    assert recording.audio is not None
    assert recording.audio.duration_s == pytest.approx(40.0, abs=0.01)
    with (tmp_path / "out" / "events.csv").open(newline="", encoding="utf-8") as stream:
        rows = [(float(row["onset_s"]), float(row["offset_s"]), row["category"]) for row in csv.DictReader(stream)]
    assert rows == [(event.onset_s, event.offset_s, event.category) for event in events]
    silence = recording.audio.read()
    for event in events:
        sound = recording.audio.read(event.onset_s, event.offset_s)
        assert loudness_db(sound) == pytest.approx(-20.0, abs=0.3)
        begin, end = (round(at * silence.rate_hz) for at in (event.onset_s, event.offset_s))
        silence.samples[begin:end] = 0.0
    assert np.abs(silence.samples).max() == 0.0


def test_what_is_segmented_is_what_was_put_in(tmp_path: Path, clips: Path) -> None:
    events = add_sounds(straight_walk(60.0, 0.5), clips, tmp_path / "out", progress=False)
    found = segment(AudioTrack.open(tmp_path / "out" / "audio.flac"))
    assert len(found) == len(events)
    for said, event in zip(found, events, strict=True):
        assert (said.onset_s, said.offset_s) == pytest.approx((event.onset_s, event.offset_s), abs=0.1)


@pytest.mark.few(1)
@pytest.mark.parametrize("kind", ["white", "pink", "room", "file"])
def test_the_background_lies_so_much_below_every_sound(tmp_path: Path, clips: Path, kind: str) -> None:
    path = tmp_path / "hum.wav"
    soundfile.write(path, np.random.default_rng(0).normal(0.0, 0.01, 3 * RATE_HZ), RATE_HZ)
    background = path if kind == "file" else kind
    walk = straight_walk(30.0, 0.5)
    events = add_sounds(walk, clips, tmp_path / "out", background=background, snr_db=10.0, progress=False)
    track = AudioTrack.open(tmp_path / "out" / "audio.flac")
    quiet_parts = track.read(events[0].offset_s + 0.1, events[1].onset_s - 0.1).samples
    background_db = 10.0 * np.log10(float((quiet_parts.astype(np.float64) ** 2).mean()))
    assert background_db == pytest.approx(-30.0, abs=1.5)


def test_a_track_that_is_there_already_is_kept(tmp_path: Path, clips: Path) -> None:
    there = track_of(tmp_path / "old.flac", tone(20.0, hz=200.0, level=0.05), start_s=5.0)
    events = add_sounds(straight_walk(30.0, 0.5, there), clips, tmp_path / "out", progress=False)
    track = AudioTrack.open(tmp_path / "out" / "audio.flac")
    assert track.rate_hz == RATE_HZ
    begin, end = events[1].offset_s + 0.1, events[2].onset_s - 0.1
    assert events[1].onset_s < 5.0 < begin < end < 25.0
    assert np.abs(track.read(events[0].offset_s, events[1].onset_s).samples).max() == 0.0
    np.testing.assert_allclose(track.read(begin, end).samples, there.read(begin, end).samples, atol=1e-4)


@pytest.mark.nightly
def test_sounds_on_a_long_way_are_two_metres_apart_in_a_straight_line(tmp_path: Path, clips: Path) -> None:
    angle = np.linspace(0.0, 6.0 * np.pi, 240)  # three rounds on a circle of 3 m
    walk = FakeWalk(np.arange(240) / 2.0, 3.0 * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1))
    events = add_sounds(walk, clips, tmp_path / "out", progress=False)
    places = np.array([event.position for event in events])
    apart = np.linalg.norm(places[:, None] - places[None], axis=-1)[np.triu_indices(len(places), 1)]
    assert len(events) >= 4
    assert apart.min() > 2.0


def test_in_a_small_room_the_distance_is_measured_along_the_walk() -> None:
    angle = np.linspace(0.0, 6.0 * np.pi, 600)
    place = 0.6 * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)  # 11.3 m within 1.2 m
    walk = Walk.along(np.arange(600) / 10.0, place)
    rule = chosen_spacing(walk, Spacing(1.0, 2.0), 3.0)
    assert rule.measure == "walked"
    placer = Placer(walk, rule)
    while placer.place(1.0) is not None:
        pass
    middles = np.array(placer.onsets_s) + 0.5
    assert len(middles) == 6
    assert (np.diff(np.interp(middles, walk.stamps_s, walk.walked_m)) >= 2.0 - 1e-9).all()


def test_a_camera_that_only_trembles_has_not_walked() -> None:
    place = np.random.default_rng(0).normal(0.0, 0.005, (3000, 3))
    assert Walk.along(np.arange(3000) / 30.0, place).walked_m[-1] == 0.0


def test_any_distance_leaves_room_for_as_many_as_the_time_allows() -> None:
    walk = Walk.along(np.arange(100) / 10.0, np.zeros((100, 3)))
    assert capacity(walk, Spacing(1.0, 0.0), 1.0, 99) == 5
    assert capacity(walk, Spacing(1.0, 2.0), 1.0, 99) == 1


def test_clips_come_from_an_index_or_from_subfolders(tmp_path: Path, clips: Path) -> None:
    assert [clip.name for clip in find_clips(clips, ["Dog_Bark", "tap"])] == [
        "dog_bark/0.wav",
        "dog_bark/1.wav",
        "tap/0.wav",
        "tap/1.wav",
    ]
    assert {clip.category for clip in find_clips(clips / "tap")} == {"tap"}
    (tmp_path / "index.csv").write_text("path,category,licence\nclips/tap/0.wav,dripping tap,CC0\n")
    [clip] = find_clips(tmp_path)
    assert (clip.category, clip.path) == ("dripping tap", tmp_path / "clips/tap/0.wav")


def test_folders_without_clips_are_told(tmp_path: Path, clips: Path) -> None:
    def refusal(folder: Path, categories: list[str] | None = None) -> str:
        with pytest.raises(AudioError) as caught:
            find_clips(folder, categories)
        return str(caught.value).replace(str(folder), "FOLDER")

    (tmp_path / "empty").mkdir()
    assert refusal(clips, ["cat"]) == "FOLDER has no clips of 'cat'; it has bell, dog bark, door, tap, whistle."
    assert (
        refusal(tmp_path / "no")
        == "There is no folder of clips at FOLDER; give one with a subfolder for each category."
    )
    assert refusal(tmp_path / "empty").startswith("FOLDER holds no sound files;")
    (tmp_path / "index.csv").write_text("file,category\na.wav,tap\n")
    assert refusal(tmp_path) == "FOLDER/index.csv lacks the column path; add it, or remove the file."
    (tmp_path / "index.csv").write_text("path,category\na.wav,tap\n")
    assert refusal(tmp_path) == "The index of FOLDER lists 1 files that do not exist, the first a.wav; fix the index."


def test_only_the_audible_part_of_a_clip_counts() -> None:
    padded = np.concatenate([quiet(1.0), tone(0.4), tone(0.5, level=0.001), quiet(2.0)])
    assert audible(Sound(padded, RATE_HZ)).duration_s == pytest.approx(0.4, abs=0.02)
    with pytest.raises(AudioError, match=r"The sound is silent from end to end; take another clip\."):
        audible(Sound(quiet(1.0), RATE_HZ))


def test_one_bad_clip_keeps_no_other_out(tmp_path: Path, clips: Path) -> None:
    (clips / "tap" / "0.wav").write_text("no sound")
    soundfile.write(clips / "bell" / "0.wav", quiet(1.0), RATE_HZ)
    events = add_sounds(straight_walk(60.0, 0.5), clips, tmp_path / "out", progress=False)
    assert len(events) > 5
    assert not {"tap/0.wav", "bell/0.wav"} & {event.clip for event in events}


def test_options_that_make_no_sense_are_told(tmp_path: Path, clips: Path) -> None:
    walk = straight_walk(60.0, 0.5)
    for options, sentence in (
        ({"interval_s": -1.0}, "The interval between sounds is -1.0; choose 0 or more."),
        ({"min_distance_m": np.nan}, "The least distance between sounds is nan; choose 0 or more."),
        ({"loudness_db": 3.0}, "The loudness is 3.0 dB; choose between -90 and 0, dB relative to full scale."),
        ({"background": "brown"}, "There is no background 'brown'; give white, pink, room or a sound file."),
    ):
        with pytest.raises(AudioError) as caught:
            add_sounds(walk, clips, tmp_path / "out", progress=False, **options)
        assert str(caught.value) == sentence
    with pytest.raises(AudioError, match="has no room for a single sound"):
        add_sounds(straight_walk(0.3, 0.5), clips, tmp_path / "out", progress=False)


def test_a_recording_is_never_overwritten(tmp_path: Path, clips: Path) -> None:
    walk = straight_walk(10.0, 0.5)
    add_sounds(walk, clips, tmp_path / "out", progress=False)
    before = digest(tmp_path / "out")
    with pytest.raises(RecordingError, match=r"out holds a recording already; choose another folder or remove it\."):
        add_sounds(walk, clips, tmp_path / "out", seed=1, progress=False)
    assert digest(tmp_path / "out") == before


@pytest.mark.nightly
@pytest.mark.shared
def test_the_kitchen_gets_four_sounds_without_options(shared_data: Path, tmp_path: Path) -> None:
    kitchen = open_recording(shared_data / "data" / "redkitchen")
    for seed in (0, 1):
        out = tmp_path / str(seed)
        events = add_sounds(kitchen, shared_data / "data" / "sounds" / "esc10", out, seed=seed, progress=False)
        assert len(events) == 4
        assert len({event.category for event in events}) == 4
        found = segment(AudioTrack.open(out / "audio.flac"))
        for event in events:
            assert any(one.onset_s < event.offset_s and one.offset_s > event.onset_s for one in found)
