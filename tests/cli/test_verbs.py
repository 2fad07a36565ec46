"""Each verb from end to end, held to the JSON contract that scripts depend on, and to its errors."""

import json
import shlex
import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest
import soundfile

from avlmaps.core.errors import BackendError
from avlmaps.core.poses import rotation_angle_rad
from helpers.raycast import render
from helpers.room import Room
from helpers.walked_room import CAMERA, RATE_HZ, beeps


def test_build_and_info_tell_the_contracts_keys(built: Path, answer) -> None:
    told = answer("info", built)
    assert {"frames", "keyframes", "voxels", "sounds", "profile", "bytes", "elapsed_s"} <= told.keys()
    assert told["frames"] == 24 and told["profile"] == "colours"
    assert told["bytes"] > 0
    (sound,) = told["sounds"]
    assert {"onset_s", "offset_s", "position"} <= sound.keys()
    assert sound["onset_s"] == pytest.approx(2.0, abs=0.15)
    assert sound["offset_s"] == pytest.approx(3.75, abs=0.3)


def test_another_map_is_not_built_over_a_finished_one(built: Path, walk: Path, run) -> None:
    status, out, err = run("build", walk, "--out", built, "--voxel-size-m", "0.2")
    assert status == 1 and out == ""
    assert "room.avlmap" in err and err.count("\n") == 1


def test_a_query_by_words_finds_the_cabinet(built: Path, answer) -> None:
    told = answer("query", built, "the red cabinet", "--top", 2)
    keys = {"goals", "found", "probability", "text", "parts", "elapsed_ms", "frame", "level_from_recording"}
    assert keys == told.keys() and told["frame"] == "recording"
    assert (told["found"], told["probability"]) == (False, 0.0), "of 'red cabinet' this encoder understands the colour"
    goal = told["goals"][0]
    assert {"position", "score", "size", "parts", "probability"} == goal.keys()
    cabinet = next(t for t in Room().things if t.category == "cabinet" and t.low[0] > 5)
    low, high = np.array(cabinet.low) - 0.15, np.array(cabinet.high) + 0.15
    assert (low < goal["position"]).all() and (goal["position"] < high).all()
    assert goal["parts"]["object"] == pytest.approx(1.0) and told["parts"][0]["modality"] == "object"
    assert told["parts"][0]["role"] == "primary" and "understood only 'red'" in told["parts"][0]["note"]


def test_goals_that_are_not_shown_are_counted(built: Path, run) -> None:
    assert "note: 5 more found; --top 6 lists them too." in run("query", built, "--object", "red", "--top", 1)[1]
    assert "more found" not in run("query", built, "--object", "red", "--top", 6)[1]


def test_a_query_by_clip_finds_where_it_was_heard(built: Path, answer, tmp_path: Path) -> None:
    clip = tmp_path / "beep.wav"
    soundfile.write(clip, beeps(1.5, 2050.0), RATE_HZ)
    told = answer("query", built, "--sound-clip", clip, "--top", 1)
    walked = Room().walk()[100:196:4][8:16, :3, 3]
    assert np.linalg.norm(walked - told["goals"][0]["position"], axis=1).min() < 0.5


def test_parts_are_fused_and_drawn(built: Path, answer, tmp_path: Path) -> None:
    clip, plot = tmp_path / "beep.wav", tmp_path / "heat.png"
    soundfile.write(clip, beeps(1.5, 2050.0), RATE_HZ)
    told = answer("query", built, "--object", "red", "--sound-clip", clip, "--primary", "object", "--plot", plot)
    assert [part["role"] for part in told["parts"]] == ["primary", "context"]
    assert all({"object", "sound"} <= goal["parts"].keys() for goal in told["goals"])
    picture = cv2.imread(str(plot))
    assert picture is not None and picture.std() > 10


def test_info_names_each_sound_by_what_fits_it_best(built: Path, answer, run) -> None:
    (sound,) = answer("info", built)["sounds"]
    scores = sound["confidences"]
    assert len(sound["names"]) == len(scores) == 3
    assert scores == sorted(scores, reverse=True) and all(0.0 <= score <= 1.0 for score in scores)
    assert f"m: {sound['names'][0]} {scores[0]:.2f}" in run("info", built, "--verbose")[1]


def test_a_map_whose_sound_model_is_not_here_is_described_without_names(
    built: Path, run, monkeypatch: pytest.MonkeyPatch
) -> None:
    def missing(*_: object) -> None:
        raise BackendError("The sound model is not installed.")

    monkeypatch.setattr("avlmaps.query.avlmap.AVLMap.sounds", missing)
    status, out, err = run("info", built, "--json")
    assert status == 0 and "names" not in json.loads(out)["sounds"][0]
    assert err == "note: the sounds have no names here. The sound model is not installed.\n"


def test_a_photo_is_located_to_the_contract(built: Path, answer, run, tmp_path: Path) -> None:
    truth = Room().walk()[146]  # between two frames of the map
    view = render(Room().scene, CAMERA, truth)
    photo = tmp_path / "photo.png"
    cv2.imwrite(str(photo), view.rgb[..., ::-1])
    told = answer("locate", built, photo)
    assert {"world_from_camera", "inliers", "reference", "frame", "elapsed_ms"} <= told.keys()
    pose = np.array(told["world_from_camera"])
    ahead = truth[:2, 2]
    assert abs(np.rad2deg(np.arctan2(ahead[1], ahead[0])) - told["heading_deg"]) % 360.0 < 1.5
    assert f"heading {told['heading_deg']:.0f}°" in run("locate", built, photo)[1]
    assert np.linalg.norm(pose[:3, 3] - truth[:3, 3]) < 0.05
    assert np.rad2deg(rotation_angle_rad(pose, truth)) < 1.0
    given = answer("locate", built, photo, "--intrinsics", f"{CAMERA.fx},{CAMERA.fy},{CAMERA.cx},{CAMERA.cy}")
    assert np.allclose(given["world_from_camera"], pose, atol=1e-6)


@pytest.mark.nightly
def test_a_photo_of_another_place_is_not_located(built: Path, answer, run, tmp_path: Path) -> None:
    photo = tmp_path / "elsewhere.png"
    noise = np.random.default_rng(3).integers(0, 256, (45, 60, 3), np.uint8)
    cv2.imwrite(str(photo), cv2.resize(noise, (240, 180), interpolation=cv2.INTER_CUBIC))
    told = answer("locate", built, photo)
    assert told["world_from_camera"] is None and told["inliers"] >= 0
    assert "not located" in run("locate", built, photo)[1]


def test_info_tells_a_recordings_faults(walk: Path, answer, tmp_path: Path) -> None:
    copy = tmp_path / "rec"
    shutil.copytree(walk, copy)
    depth = sorted((copy / "depth").iterdir())
    depth[3].write_bytes(depth[3].read_bytes()[:200])
    depth[5].unlink()
    told = answer("info", copy)
    assert told["frames"] == 24
    faults = " ".join(told["faults"])
    assert depth[3].name in faults and depth[5].name in faults


@pytest.mark.nightly
def test_add_sounds_writes_the_same_recording_for_the_same_seed(walk: Path, answer, tmp_path: Path) -> None:
    clips = tmp_path / "clips"
    for category, pitch in (("high beep", 3000.0), ("low beep", 500.0)):
        (clips / category).mkdir(parents=True)
        soundfile.write(clips / category / "a.wav", beeps(1.0, pitch), RATE_HZ)
    words = ("add-sounds", walk, "--clips", clips, "--min-distance-m", 0, "--seed", 3)
    told = answer(*words, "--out", tmp_path / "one")
    answer(*words, "--out", tmp_path / "two")
    one, two = ((tmp_path / name / "audio.flac").read_bytes() for name in ("one", "two"))
    assert one == two
    assert told["sounds"] == len((tmp_path / "one" / "events.csv").read_text().splitlines()) - 1 > 0


def test_a_sound_is_taught_and_forgotten(answer, run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("AVLMAPS_HOME", str(tmp_path / "home"))
    for k in range(3):
        soundfile.write(tmp_path / f"{k}.wav", beeps(1.5, 900.0 + 20 * k), RATE_HZ)
    told = answer("teach-sound", "robot beep", *(tmp_path / f"{k}.wav" for k in range(3)))
    assert told["taught"] == ["robot beep"]
    assert answer("teach-sound", "robot beep", "--forget")["taught"] == []
    assert run("teach-sound", "robot beep")[0] == 2


@pytest.mark.nightly
def test_info_and_build_end_with_what_to_do_next_in_three_lines(built: Path, walk: Path, run) -> None:
    for place, offered in ((built, "query"), (walk, "build")):
        lines = run("info", place)[1].splitlines()
        following = [line.removeprefix("next:").split() for line in lines[-3:]]
        assert lines[-3].startswith("next: ") and all(words[0] == "avlmaps" for words in following)
        assert following[0][1] == offered and following[-1][:4] == ["avlmaps", "info", str(place), "--verbose"]
        details = run("info", place, "--verbose")[1].splitlines()
        assert len(details) > len(lines) - 3 and not [line for line in details if line.startswith("next:")]
        for words in following:  # each can be run
            assert run(*words[1:3], "--help")[0] == 0


def test_info_takes_the_options_by_which_build_reads_a_recording(walk: Path, answer, run, tmp_path: Path) -> None:
    soundfile.write(tmp_path / "other.wav", np.full(16_000, 0.1), 16_000)
    array = tmp_path / "array.json"
    array.write_text('{"positions_m": [[0, 0, 0]]}')
    words = ["--audio", str(tmp_path / "other.wav"), "--microphones", str(array), "--depth-unit", "0.001"]
    found = answer("info", str(walk), *words)
    assert found["audio"]["file"] == "other.wav" and found["options"] == words
    _, printed, _ = run("info", str(walk), *words)
    assert f"avlmaps build {shlex.join([str(walk), *words])} --out" in printed
    code, _, told = run("info", str(walk), "--topics", "audio_pcm=16000,6")
    assert code == 1 and "has no topics" in told


def test_another_day_is_merged_and_its_changes_are_told(dated: Path, built: Path, tmp_path: Path, answer, run) -> None:
    today, home = tmp_path / "today.avlmap", tmp_path / "home.avlmap"
    answer("build", dated, "--out", today, "--voxel-size-m", "0.1", "--profile", "colours", "--frame-step", "2")
    made = answer("merge", built, today, "--out", home)
    assert made["path"] == str(home) and made["checks"]["agreeing"] >= 5
    np.testing.assert_allclose(made["map_from_recording"], np.eye(4), atol=0.05)
    told = answer("changes", home)
    assert [day["day"] for day in told["days"]] == [None, "2023-11-14"] and told["changes"] == []
    status, out, _ = run("changes", home)
    assert status == 0 and out.startswith("nothing is known to have changed")
    status, out, err = run("changes", home, "--since", "")
    assert status == 1 and out == "" and "day" in err


@pytest.mark.nightly
def test_a_map_built_by_the_papers_rules_says_so_and_is_queried(answer, walk: Path, built: Path, tmp_path: Path):
    path = tmp_path / "paper.avlmap"
    made = answer("build", walk, "--out", path, "--profile", "colours", "--rules", "paper")
    assert made["rules"] == "paper" and answer("info", path)["rules"] == "paper"
    assert answer("info", built)["rules"] == "ours"
    told = answer("query", path, "--object", "red", "--rules", "paper")
    assert told["goals"]
