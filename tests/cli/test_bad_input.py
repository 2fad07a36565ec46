"""What strangers hand in: each time one sentence, on a line of its own, and nothing on standard output."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import soundfile

from helpers.walked_room import RATE_HZ, beeps


def test_an_error_in_the_middle_of_a_loop_stands_on_its_own_last_line(walk: Path, run, tmp_path: Path) -> None:
    copy = tmp_path / "rec"
    shutil.copytree(walk, copy)
    for depth in sorted((copy / "depth").iterdir())[:12]:
        depth.write_bytes(depth.read_bytes()[:200])
    status, out, err = run("build", copy, "--out", tmp_path / "map")
    assert (status, out) == (1, "")
    last = err.rstrip("\n").replace("\r", "\n").split("\n")[-1]
    assert last.startswith("avlmaps: ")
    assert "frames cannot be read" in last


def test_a_name_that_the_system_refuses_is_told_without_its_number_for_it(built: Path, run) -> None:
    status, out, err = run("query", built, "--image", "x" * 300 + ".png")
    assert (status, out) == (1, "")
    assert err.count("\n") == 1
    assert "Errno" not in err
    assert "File name too long; check the path" in err


@pytest.mark.nightly
def test_a_truncated_photo_is_told_in_our_words_alone(built: Path, walk: Path, tmp_path: Path) -> None:
    photo = tmp_path / "photo.png"
    photo.write_bytes(next((walk / "rgb").iterdir()).read_bytes()[:1500])
    words = [sys.executable, "-m", "avlmaps", "locate", str(built), str(photo)]
    plain = {name: value for name, value in os.environ.items() if name != "OPENCV_LOG_LEVEL"}
    told = subprocess.run(words, capture_output=True, text=True, env=plain, check=False)
    assert (told.returncode, told.stdout) == (1, "")
    assert told.stderr == f"avlmaps: The picture {photo} cannot be read as an image; use a PNG or a JPEG.\n"


def test_a_broken_package_does_not_hide_the_other_backends(answer, run, monkeypatch: pytest.MonkeyPatch) -> None:
    from avlmaps.core import registry

    broken = registry.Backend(registry.Kind.VIEWS, "broken", "no_such_module_here:Model")
    monkeypatch.setitem(registry._registered, (broken.kind, broken.name), broken)
    told = answer("profiles")
    (other,) = [entry for entry in told["other_backends"] if entry["name"] == "broken"]
    assert other["state"] == "broken"
    assert "cannot be loaded from no_such_module_here:Model" in other["note"]
    assert told["profiles"][0]["name"] == "embedded"
    assert "broken" in run("profiles")[1].split("in no profile:")[1]


@pytest.mark.nightly
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_a_full_disk_under_standard_output_is_one_sentence(walk: Path) -> None:
    with Path("/dev/full").open("wb") as full:
        words = [sys.executable, "-m", "avlmaps", "info", str(walk), "--json"]
        told = subprocess.run(words, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    last = told.stderr.replace("\r", "\n").rstrip("\n").split("\n")[-1]
    assert last == "avlmaps: No space left on device; check the files and the space on the disk."
    assert told.returncode == 1


def clips_of(folder: Path, *contents: np.ndarray) -> Path:
    (folder / "beep").mkdir(parents=True)
    for k, samples in enumerate(contents):
        soundfile.write(folder / "beep" / f"{k}.wav", samples, RATE_HZ)
    return folder


def test_a_seed_below_zero_is_refused(walk: Path, run, tmp_path: Path) -> None:
    clips = clips_of(tmp_path / "clips", beeps())
    status, out, err = run("add-sounds", walk, "--clips", clips, "--out", tmp_path / "out", "--seed", -1)
    assert (status, out) == (1, "")
    assert err == "avlmaps: The seed is -1; choose 0 or more.\n"


def test_clips_of_which_none_can_be_heard_are_told_by_the_first(walk: Path, run, tmp_path: Path) -> None:
    clips = clips_of(tmp_path / "clips", np.zeros(RATE_HZ), np.zeros(RATE_HZ))
    status, _, err = run("add-sounds", walk, "--clips", clips, "--out", tmp_path / "out")
    assert status == 1
    assert "No clip that was tried in" in err and "is silent from end to end" in err


def test_an_index_of_clips_in_another_encoding_is_named(walk: Path, run, tmp_path: Path) -> None:
    clips = clips_of(tmp_path / "clips", beeps())
    (clips / "index.csv").write_bytes("path,category\nbeep/0.wav,T\xfcrklingel\n".encode("latin-1"))
    status, _, err = run("add-sounds", walk, "--clips", clips, "--out", tmp_path / "out")
    assert status == 1
    assert "index.csv is not a CSV table in UTF-8" in err


def test_a_track_of_one_sample_a_second_is_no_sound(built: Path, run, tmp_path: Path) -> None:
    soundfile.write(tmp_path / "slow.wav", np.zeros(20), 1)
    status, _, err = run("query", built, "--sound-clip", tmp_path / "slow.wav")
    assert status == 1
    assert "has 1 samples a second, too few for sounds" in err


def test_a_name_too_long_to_ask_for_is_not_taught(run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("AVLMAPS_HOME", str(tmp_path / "home"))
    soundfile.write(tmp_path / "a.wav", beeps(), RATE_HZ)
    status, _, err = run("teach-sound", "b" * 200, tmp_path / "a.wav")
    assert status == 1
    assert "The name has 200 characters; choose one of at most 80" in err


def test_a_full_disk_is_told_with_the_file(tmp_path: Path) -> None:
    code = (
        "import resource, signal, sys, numpy as np\n"
        "from pathlib import Path\n"
        "from avlmaps.recordings.audio import Sound, write_flac\n"
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))\n"
        "noise = np.random.default_rng(0).uniform(-0.5, 0.5, 200_000).astype(np.float32)\n"
        "try: write_flac(Path(sys.argv[1]), Sound(noise, 22050))\n"
        "except Exception as error: print(type(error).__name__, error)\n"
    )
    done = subprocess.run([sys.executable, "-c", code, str(tmp_path / "a.flac")], capture_output=True, text=True)
    assert done.stdout.startswith("AudioError")
    assert "a.flac could not be written" in done.stdout
    assert "Traceback" not in done.stderr
    assert list(tmp_path.iterdir()) == []
