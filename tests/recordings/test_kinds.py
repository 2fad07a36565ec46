"""Every suffix and coding that the readers name is opened: small files of each, by the readers' own tables."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest
import soundfile
from PIL import Image
from recording_scenes import CAMERA

from avlmaps.recordings.conformance import check, example_truth
from avlmaps.recordings.containers import self_contained_suffix
from avlmaps.recordings.formats import file_recording, ros_messages, ros_sound
from avlmaps.recordings.images import (
    COLOUR_SUFFIXES,
    DEPTH_SUFFIXES,
    VideoFrames,
    check_picture,
    picture_size,
    read_colour,
    read_depth,
)
from avlmaps.recordings.layout import VIDEO_SUFFIXES
from avlmaps.recordings.open import open_recording
from helpers.bag_writers import Messages, walk, write_ros1, write_ros2
from helpers.format_writers import write_folder

# pyright: reportPrivateUsage=false
SHADE = np.full((48, 64, 3), (200, 120, 40), np.uint8)


@pytest.mark.parametrize("suffix", COLOUR_SUFFIXES)
def test_each_format_of_pictures_is_read(tmp_path: Path, suffix: str) -> None:
    file = tmp_path / f"p{suffix}"
    if suffix in (".heic", ".heif"):
        heif = pytest.importorskip("pillow_heif", reason="HEIC needs avlmaps[heic]")
        heif.from_bytes("RGB", (64, 48), SHADE.tobytes()).save(str(file), quality=95)
    else:
        Image.fromarray(SHADE).save(file)
    assert picture_size(file) == (64, 48)
    check_picture(file, CAMERA)
    assert np.abs(read_colour(file, CAMERA).astype(int) - SHADE).max() <= 6


@pytest.mark.parametrize(
    ("suffix", "kind"),
    [(suffix, "float32" if suffix == ".npy" else "uint16") for suffix in DEPTH_SUFFIXES]
    + [(suffix, "float32") for suffix in DEPTH_SUFFIXES if suffix.startswith(".tif")],
)
def test_each_format_of_depth_is_read(tmp_path: Path, suffix: str, kind: str) -> None:
    file, depth = tmp_path / f"d{suffix}", np.full((48, 64), 2500 if kind == "uint16" else 2.5, kind)
    depth[0, :2] = 0
    if suffix == ".npy":
        np.save(file, depth)
    else:
        cv2.imwrite(str(file), depth)
    check_picture(file, CAMERA)
    found = read_depth(file, CAMERA, 1000.0)
    assert not found[0, :2].any() and np.allclose(found[1:], 2.5)


def write_tone(file: Path, seconds: float = 1.0) -> None:
    """Write a tone of 440 Hz in the container of a suffix."""
    import av

    kind = file.suffix
    rate_hz = {".amr": 8_000, ".opus": 48_000, ".webm": 48_000}.get(kind, 16_000)
    tone = (0.5 * np.sin(2 * np.pi * 440 * np.arange(round(seconds * rate_hz)) / rate_hz)).astype(np.float32)
    plain = {".oga": "OGG", ".opus": "OGG", ".aif": "AIFF", ".wave": "WAV", ".bwf": "WAV", ".snd": "AU"}
    plain = plain.get(kind, kind[1:].upper())
    if plain in soundfile.available_formats():
        soundfile.write(file, tone, rate_hz, "OPUS" if kind == ".opus" else None, format=plain)
        return
    containers = {".m4a": "ipod", ".aac": "adts", ".wma": "asf", ".mka": "matroska", ".mkv": "matroska"}
    containers[".m4v"] = "mp4"
    codecs = {".mp3": "libmp3lame", ".wma": "wmav2", ".amr": "libopencore_amrnb", ".webm": "libopus", ".mp2": "mp2"}
    codecs |= {".wv": "wavpack", ".avi": "mp3"}
    with av.open(str(file), "w", format=containers.get(kind, kind[1:])) as container:
        stream: Any = container.add_stream(codecs.get(kind, "aac"), rate=rate_hz)
        stream.layout = "mono"
        stream.bit_rate = 12_200 if kind == ".amr" else 64_000
        piece = av.AudioFrame.from_ndarray(tone[None], format="fltp", layout="mono")
        piece.sample_rate = rate_hz
        for frame in (piece, None):
            container.mux(stream.encode(frame))


@pytest.mark.parametrize("suffix", (*file_recording._SOUNDS, *file_recording._FILMS))
def test_a_sound_in_each_container_is_the_sound_of_its_folder(tmp_path: Path, suffix: str) -> None:
    folder = write_folder(tmp_path / "walk", example_truth())
    write_tone(folder / f"Audio{suffix}")
    track = open_recording(folder).audio
    assert track is not None and track.duration_s == pytest.approx(1.0, abs=0.2)
    samples = track.read().samples
    spectrum = np.abs(np.fft.rfft(samples))
    assert np.argmax(spectrum) * track.rate_hz / len(samples) == pytest.approx(440, abs=5)
    content = track.path.read_bytes()[:64]
    alone = (".aac", ".aif", ".aiff", ".caf", ".w64", ".wma", ".amr", ".au", ".snd", ".rf64", ".mp2", ".wv")
    assert self_contained_suffix(content) or suffix in alone


@pytest.mark.parametrize(
    ("file", "heard", "said"),
    [
        ("track.au", True, "track.au is taken for the sound track"),
        ("wav/mic.wav", True, "mic.wav is taken for the sound track"),
        ("video_with_sound.mp4", True, "video_with_sound.mp4 is taken for the sound track"),
        ("audio.pcm", False, "audio.pcm is not heard"),
        ("audio.npy", False, "audio.npy is not heard"),
        ("sound/voice.s16le", False, "voice.s16le is not heard"),
        ("audio.txt", False, ""),
    ],
)
def test_sound_that_is_there_is_heard_or_named(tmp_path: Path, file: str, heard: bool, said: str) -> None:
    path = write_folder(tmp_path / "walk", example_truth()) / file
    path.parent.mkdir(exist_ok=True)
    if heard:
        write_tone(path)
    else:
        path.write_bytes(bytes(64))
    recording = open_recording(tmp_path / "walk")
    assert (recording.audio is not None) == heard
    assert (said in " ".join(recording.notices)) if said else not recording.notices


@pytest.mark.parametrize("suffix", VIDEO_SUFFIXES)
def test_a_video_in_each_container_gives_its_pictures(tmp_path: Path, suffix: str) -> None:
    import av

    with av.open(str(tmp_path / f"rgb{suffix}"), "w") as container:
        stream: Any = container.add_stream("libvpx" if suffix == ".webm" else "libx264", rate=10)
        stream.width, stream.height, stream.pix_fmt = 64, 48, "yuv420p"
        for rgb in (SHADE, SHADE // 2, None):
            container.mux(stream.encode(None if rgb is None else av.VideoFrame.from_ndarray(rgb, format="rgb24")))
    video = VideoFrames(tmp_path / f"rgb{suffix}")
    assert len(video) == 2 and video.stamps_s == pytest.approx([0.0, 0.1])
    for index, rgb in enumerate((SHADE, SHADE // 2)):
        assert np.abs(video.picture(index).astype(int) - rgb).max() <= 8


# Messages of ROS


def as_message(encoding: str, pixels: np.ndarray, big: bool = False) -> SimpleNamespace:
    data = np.ascontiguousarray(pixels.astype(pixels.dtype.newbyteorder(">")) if big else pixels)
    step = data.nbytes // len(data)
    raw = data.reshape(-1).view(np.uint8)
    return SimpleNamespace(encoding=encoding, height=48, width=64, step=step, data=raw, is_bigendian=int(big))


def colour_pixels(encoding: str) -> np.ndarray:
    """Return a picture of one shade in a coding of colour messages."""
    kind, bits = np.uint16 if encoding.endswith("16") else np.uint8, 8 if encoding.endswith("16") else 0
    if encoding.startswith("bayer"):
        mosaic = np.zeros((48, 64), kind)
        for at, letter in enumerate(encoding[6:10]):
            mosaic[at // 2 :: 2, at % 2 :: 2] = int(SHADE[0, 0]["rgb".index(letter)]) << bits
        return mosaic
    if "yuv" in encoding or "yuy" in encoding or "uyv" in encoding:
        r, g, b = SHADE[0, 0] / 255.0
        y = 0.299 * r + 0.587 * g + 0.114 * b  # BT.601, as cameras send it: 16 to 235, and 16 to 240
        level = {"y": 16 + 219 * y, "u": 128 + 224 * (b - y) / 1.772, "v": 128 + 224 * (r - y) / 1.402}
        order = "yuyv" if "yuy" in encoding else "uyvy"
        return np.tile(np.array([level[letter] for letter in order]).round().astype(np.uint8), (48, 32))
    if encoding.startswith("mono") or encoding == "8UC1":
        return np.full((48, 64), 90 << bits, kind)
    letters = "bgr" if encoding == "8UC3" else encoding.rstrip("168")
    levels = [9 if letter == "a" else SHADE[0, 0]["rgb".index(letter)] for letter in letters]
    return np.tile(np.array(levels, kind) << bits, (48, 64, 1))


@pytest.mark.parametrize("encoding", ros_messages._COLOUR_ENCODINGS)
def test_colour_messages_of_each_encoding_have_their_colours(encoding: str) -> None:
    pixels = colour_pixels(encoding)
    right = np.full_like(SHADE, 90) if encoding.startswith("mono") or encoding == "8UC1" else SHADE
    for big in (False, True) if pixels.dtype == np.uint16 else (False,):
        found = ros_messages.colour_of(as_message(encoding, pixels, big), "x").astype(int)
        assert found.shape == (48, 64, 3) and np.abs(found - right)[2:-2, 2:-2].max() <= 4


@pytest.mark.parametrize("encoding", ros_messages._DEPTH_ENCODINGS)
@pytest.mark.parametrize("big", [False, True])
def test_depth_messages_of_each_encoding_are_in_metres(encoding: str, big: bool) -> None:
    depth = np.full((48, 64), 2.5 if encoding == "32FC1" else 2500, np.float32 if encoding == "32FC1" else np.uint16)
    assert np.allclose(ros_messages.depth_of(as_message(encoding, depth, big), "x"), 2.5)


@pytest.mark.parametrize("number", ros_messages._POINT_KINDS)
def test_points_of_each_type_of_field_are_read(number: int) -> None:
    kind = np.dtype(ros_messages._POINT_KINDS[number])
    points = np.array([[1, 2, 3], [4, 5, 6]], kind)
    fields = [SimpleNamespace(name=n, offset=i * kind.itemsize, datatype=number) for i, n in enumerate("xyz")]
    cloud = SimpleNamespace(
        fields=fields, point_step=3 * kind.itemsize, width=2, height=1, data=points.view(np.uint8).ravel(),
        is_bigendian=False,
    )  # fmt: skip
    assert np.array_equal(ros_messages.points_of(cloud, "x"), points)


@pytest.mark.parametrize("number", ros_sound._SAMPLES)
def test_samples_of_each_of_portaudios_formats_are_read(number: int) -> None:
    name, kind, scale = ros_sound._SAMPLES[number]
    middle = 128 if kind == "u1" else 0
    data = SimpleNamespace(**{name: (np.array([0.5, -0.5, 0.25, 0.0]) * scale + middle).astype(kind)})
    info = SimpleNamespace(format=number, rate=16_000, channels=2)
    message = SimpleNamespace(audio=SimpleNamespace(audio_data=data, info=info))
    ((pcm, samples),) = ros_sound.sampled_pieces([message], "/audio")
    assert pcm.channels == 2 and np.allclose(samples, [[0.5, -0.5], [0.25, 0.0]], atol=0.01)


@pytest.mark.parametrize("how", ["bz2", "lz4", "file", "message", "message, alone"])
def test_a_bag_of_each_compression_gives_back_the_truth(tmp_path: Path, how: str) -> None:
    truth = example_truth(frames=4)
    ros = Messages(1 if how in ("bz2", "lz4") else 2)
    if ros.ros == 1:
        path = write_ros1(tmp_path / "walk", walk(truth, ros), ros, how)
    else:
        path = write_ros2(tmp_path / "walk", walk(truth, ros), ros, compression=how.partition(",")[0])
    if how.endswith("alone"):
        (path / "metadata.yaml").unlink()
    check(lambda: open_recording(path), truth)
