"""Bombs, wrong kinds of file and changed content in recordings: a sentence before memory is taken, never a mixture."""

import json
import os
import shutil
import struct
import time
import zlib
from pathlib import Path

import numpy as np
import pytest
import soundfile
from recording_scenes import CAMERA, save_depth, shots, write_folder, write_seven_scenes

from avlmaps.core.errors import AudioError, RecordingError
from avlmaps.recordings import images
from avlmaps.recordings.open import open_recording


def promise(file: Path, width: int, height: int) -> None:
    """Let a PNG's header say another size, with the right checksum."""
    content = bytearray(file.read_bytes())
    content[16:24] = struct.pack(">II", width, height)
    content[29:33] = struct.pack(">I", zlib.crc32(content[12:29]))
    file.write_bytes(content)


@pytest.mark.parametrize("size", [(32_000, 32_000), (65, 48), (8192, 8192)])
def test_a_png_bomb_is_refused_by_its_header(
    tmp_path: Path, size: tuple[int, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write_folder(tmp_path / "walk")
    monkeypatch.setattr(images, "decode_picture", None)
    for file, read in (
        (path / "rgb/000002.png", lambda file: images.read_colour(file, CAMERA)),
        (path / "depth/000002.png", lambda file: images.read_depth(file, CAMERA, 1000.0)),
    ):
        promise(file, *size)
        with pytest.raises(RecordingError, match=f"{size[0]}x{size[1]}"):
            read(file)


def test_one_broken_header_does_not_decide_for_all(tmp_path: Path) -> None:
    path = write_seven_scenes(tmp_path / "walk")
    promise(path / "frame-000000.color.png", 32_000, 32_000)
    promise(path / "frame-000000.depth.png", 63, 48)
    recording = open_recording(path)
    assert (recording.rig.rgb.width, recording.rig.rgb.height) == (CAMERA.width, CAMERA.height)
    assert recording.frame(1).depth_m.shape == (48, 64)


@pytest.mark.nightly
def test_every_flipped_bit_of_a_png_header_is_a_sentence(tmp_path: Path) -> None:
    save_depth(tmp_path / "d.png", shots(1)[0].depth_mm)
    whole = (tmp_path / "d.png").read_bytes()
    for bit in range(8 * 33):
        content = bytearray(whole)
        content[bit // 8] ^= 1 << bit % 8
        (tmp_path / "d.png").write_bytes(content)
        with pytest.raises(RecordingError):
            images.picture_size(tmp_path / "d.png")
        with pytest.raises(RecordingError):
            images.check_picture(tmp_path / "d.png", CAMERA)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes here")
@pytest.mark.parametrize("name", ["rgb/000001.png", "depth/000001.png"])
@pytest.mark.parametrize("kind", ["pipe", "zero", "sparse", "folder", "dangling"])
def test_no_picture_but_a_regular_file_of_a_possible_size(tmp_path: Path, name: str, kind: str) -> None:
    path = write_folder(tmp_path / "walk")
    put(path / name, kind)
    with pytest.raises(RecordingError, match=r"cannot be read \(it "):
        open_recording(path).frame(1)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes here")
@pytest.mark.parametrize("name", ["recording.json", "poses.csv", "frames.csv"])
@pytest.mark.parametrize("kind", ["pipe", "zero", "sparse", "folder", "dangling"])
def test_no_text_but_a_regular_file_of_a_possible_size(tmp_path: Path, name: str, kind: str) -> None:
    path = write_folder(tmp_path / "walk")
    (path / "frames.csv").write_text("name,stamp_s\n" + "".join(f"{i:06d},{i / 10}\n" for i in range(5)))
    put(path / name, kind)
    with pytest.raises(RecordingError):
        open_recording(path)


def put(file: Path, kind: str) -> None:
    if kind == "sparse":
        os.truncate(file, 20_000_000_000)
        return
    file.unlink()
    if kind == "pipe":
        os.mkfifo(file)
    elif kind == "folder":
        file.mkdir()
    else:
        file.symlink_to("/dev/zero" if kind == "zero" else "nowhere")


def test_a_table_without_line_ends_is_not_read_into_one_line(tmp_path: Path) -> None:
    path = write_folder(tmp_path / "walk")
    os.truncate(path / "poses.csv", 1_000_000_000)  # zeros
    with pytest.raises(RecordingError, match=r"it has 16384 bytes or more; fix it"):
        open_recording(path)


def test_json_nested_deeply_is_a_sentence(tmp_path: Path) -> None:
    path = write_folder(tmp_path / "walk")
    for content in (
        b'{"x":' * 5000 + b"1" + b"}" * 5000,
        b'{"schema_version": 1, "x": ' + b"[" * 5000 + b"]" * 5000 + b"}",
    ):
        (path / "recording.json").write_bytes(content)
        with pytest.raises(RecordingError, match=r"recording\.json is not JSON \(it is nested too deeply\)"):
            open_recording(path)


@pytest.mark.parametrize("kind", ["dangling", "folder", "zero", "pipe"])
def test_a_broken_sound_file_is_an_error_and_not_silence(tmp_path: Path, kind: str) -> None:
    path = write_folder(tmp_path / "walk")
    (path / "audio.flac").touch()
    put(path / "audio.flac", kind)
    with pytest.raises(AudioError, match=r"audio\.flac (is a folder|cannot be read as sound \(it is a )"):
        open_recording(path)


def test_halved_depth_of_the_same_size_is_another_recording(tmp_path: Path) -> None:
    path = write_folder(tmp_path / "walk")
    first = open_recording(path).fingerprint
    file = path / "depth/000003.png"
    before, size = file.stat(), file.stat().st_size
    save_depth(file, np.where(shots()[3].depth_mm > 0, shots()[3].depth_mm // 2, 0))
    with file.open("ab") as stream:
        stream.write(b"\0" * max(0, size - file.stat().st_size))
    os.utime(file, ns=(before.st_atime_ns, before.st_mtime_ns))
    assert open_recording(path).fingerprint != first


def test_a_copy_with_other_times_is_the_same_recording(tmp_path: Path) -> None:
    path = write_folder(tmp_path / "walk")
    soundfile.write(path / "audio.wav", np.random.default_rng(0).uniform(-0.5, 0.5, 32_000), 16_000)
    first = open_recording(path).fingerprint
    copy = Path(shutil.copytree(path, tmp_path / "copy", copy_function=shutil.copy))
    for file in copy.rglob("*"):
        os.utime(file, (time.time() + 100, time.time() + 100))
    assert open_recording(copy).fingerprint == first
    assert open_recording(copy).change_stamp() != open_recording(path).change_stamp()
    content = bytearray((copy / "audio.wav").read_bytes())
    content[len(content) // 2] ^= 64
    (copy / "audio.wav").write_bytes(content)
    assert open_recording(copy).fingerprint != first


def test_settings_that_nest_or_lie_in_other_formats_are_sentences(tmp_path: Path) -> None:
    path = tmp_path / "scene"
    (path / "rgb").mkdir(parents=True)
    (path / "poses.txt").write_text("0 0 0 0 0 0 1\n")
    for content in ("[" * 100_000, json.dumps({"rate_hz": "fast"})):
        (path / "camera.json").write_text(content)
        with pytest.raises(RecordingError, match=r"camera\.json is not as it should be"):
            open_recording(path)


def test_a_sentence_does_not_quote_a_whole_file(tmp_path: Path) -> None:
    path = write_seven_scenes(tmp_path / "walk")
    (path / "frame-000002.pose.txt").write_text('{"camera":' * 10_000)
    with pytest.raises(RecordingError) as fault:
        open_recording(path)
    assert len(str(fault.value)) < 500 and "does not hold numbers only" in str(fault.value)
