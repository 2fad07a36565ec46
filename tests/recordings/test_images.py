"""Pictures are read whole or refused by name: a cut-off file never becomes half a picture."""

import re
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from recording_scenes import CAMERA, save_rgb, shot

from avlmaps.core.camera import Pinhole
from avlmaps.core.errors import RecordingError
from avlmaps.recordings.images import check_picture, check_whole, read_colour, read_depth

PNG = cv2.imencode(".png", shot(1).rgb)[1].tobytes()
JPEG = cv2.imencode(".jpg", shot(1).rgb)[1].tobytes()


def test_depth_in_metres_loses_nan_infinity_and_what_is_not_positive(tmp_path: Path):
    depth = np.full((48, 64, 1), 2.5, np.float32)
    depth[0, :4, 0] = (np.nan, np.inf, -1.0, 0.0)
    np.save(tmp_path / "d.npy", depth)
    depth_m = read_depth(tmp_path / "d.npy", CAMERA, 1000.0)
    assert depth_m.shape == (48, 64)
    assert np.array_equal(depth_m[0, :5], np.array([0, 0, 0, 0, 2.5], np.float32))


@given(st.sampled_from([PNG, JPEG]), st.floats(0.02, 0.999))
def test_a_picture_cut_anywhere_is_refused(content: bytes, share: float):
    with pytest.raises(RecordingError, match=r"^x is (truncated|empty|no picture)"):
        check_whole(Path("x"), content[: int(len(content) * share)])


@given(st.integers(16, len(PNG) - 1), st.integers(1, 255))
def test_a_png_with_a_wrong_byte_is_refused(at: int, change: int):
    broken = bytearray(PNG)
    broken[at] ^= change
    with pytest.raises(RecordingError, match=r"^x "):
        check_whole(Path("x"), bytes(broken))


def test_whole_pictures_pass_even_with_something_behind_them():
    for content in (PNG, JPEG, PNG + b"\0\0", JPEG + b"\0\0maker note"):
        check_whole(Path("x"), content)


def test_a_thumbnails_end_does_not_stand_for_the_pictures_end():
    thumbnail = cv2.imencode(".jpg", np.zeros((8, 8, 3), np.uint8))[1].tobytes()
    exif = b"\xff\xe1" + (len(thumbnail) + 2).to_bytes(2, "big") + thumbnail
    inside = JPEG[:2] + exif + JPEG[2:]
    check_whole(Path("x"), inside)
    with pytest.raises(RecordingError, match="truncated"):
        check_whole(Path("x"), inside[:-10])


@pytest.mark.parametrize(
    ("name", "content", "sentence"),
    [
        ("gone.png", None, "gone.png is missing; restore it, or leave that frame out of the recording."),
        ("empty.png", b"", "empty.png is empty"),
        ("text.png", b"hello there", "text.png is no picture that is known (11 bytes"),
        ("cut.png", PNG[:-20], f"({len(PNG) - 20} bytes); copy it again or leave that frame out."),
        ("cut.jpg", JPEG[:-20], f"cut.jpg is truncated ({len(JPEG) - 20} bytes)"),
    ],
)
def test_a_picture_that_cannot_be_used_is_named(tmp_path: Path, name: str, content: bytes | None, sentence: str):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(RecordingError, match=re.escape(sentence)):
        read_colour(tmp_path / name, CAMERA)
    with pytest.raises(RecordingError, match=re.escape(sentence)):
        check_picture(tmp_path / name, CAMERA)


def test_a_picture_of_another_size_is_refused(tmp_path: Path):
    save_rgb(tmp_path / "p.png", shot(0).rgb)
    camera = Pinhole(60.0, 60.0, 16.0, 12.0, 32, 24)
    sentence = "p.png is 64x48, but the recording's camera is 32x24; every picture of a recording must have one size."
    for read in (read_colour, check_picture):
        with pytest.raises(RecordingError, match=re.escape(sentence)):
            read(tmp_path / "p.png", camera)


def test_eight_bit_depth_is_refused(tmp_path: Path):
    save_rgb(tmp_path / "d.png", shot(0).rgb)
    with pytest.raises(RecordingError, match=r"d.png is 8-bit with 3 channel\(s\); depth must be a 16-bit PNG"):
        read_depth(tmp_path / "d.png", CAMERA, 1000.0)


def test_depth_arrays_that_cannot_be_used_are_named(tmp_path: Path):
    (tmp_path / "cut.npy").write_bytes(b"\x93NUMPY\x01")
    np.save(tmp_path / "objects.npy", np.array([{"a": 1}], dtype=object), allow_pickle=True)
    np.save(tmp_path / "flat.npy", np.zeros(7))
    with pytest.raises(RecordingError, match=r"cut.npy is not a whole NPY file"):
        read_depth(tmp_path / "cut.npy", CAMERA, 1000.0)
    with pytest.raises(RecordingError, match=r"objects.npy is not a whole NPY file"):
        read_depth(tmp_path / "objects.npy", CAMERA, 1000.0)
    with pytest.raises(RecordingError, match=r"flat.npy holds float64 of \(7,\); depth is numbers of"):
        read_depth(tmp_path / "flat.npy", CAMERA, 1000.0)
    with pytest.raises(RecordingError, match=r"gone.npy is missing"):
        read_depth(tmp_path / "gone.npy", CAMERA, 1000.0)
