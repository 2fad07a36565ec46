"""Only regular files of limited size are opened, and arrays whose header is true to the file."""

import os
import socket
import struct
from pathlib import Path

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from avlmaps.core.files import checked_size, decode_json, open_regular, read_regular, sampled_digest
from avlmaps.core.npy import load_npy, npy_header

needs_pipes = pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes here")


def refusal(path: Path, limit_bytes: int = 1000) -> str:
    with pytest.raises(OSError) as fault:
        read_regular(path, limit_bytes)
    return fault.value.strerror


@needs_pipes
def test_what_is_no_regular_file_is_refused_by_its_kind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "dangling").symlink_to("nowhere")
    (tmp_path / "loop").symlink_to("loop")
    (tmp_path / "zero").symlink_to("/dev/zero")
    monkeypatch.chdir(tmp_path)
    with socket.socket(socket.AF_UNIX) as made:
        made.bind("socket")
    assert refusal(tmp_path / "pipe") == "it is a pipe, not a regular file"
    assert refusal(tmp_path / "socket") == "it is a socket, not a regular file"
    assert refusal(tmp_path / "zero") == "it is a device, not a regular file"
    assert refusal(tmp_path) == "it is a folder, not a regular file"
    assert refusal(tmp_path / "dangling") == "it is a link to a file that does not exist"
    assert "symbolic links" in refusal(tmp_path / "loop")
    with pytest.raises(FileNotFoundError):
        read_regular(tmp_path / "nothing", 1000)


def test_a_sparse_file_is_refused_before_it_is_read(tmp_path: Path) -> None:
    (tmp_path / "sparse").touch()
    os.truncate(tmp_path / "sparse", 20_000_000_000)
    assert "20,000,000,000 bytes, more than the 1,000 of" in refusal(tmp_path / "sparse")


def test_a_link_to_a_regular_file_will_do(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"abc")
    (tmp_path / "link").symlink_to("file")
    assert read_regular(tmp_path / "link", 3) == b"abc" and checked_size(tmp_path / "link", 3) == 3
    with open_regular(tmp_path / "file", 3) as stream:
        assert stream.read() == b"abc"


def test_json_nested_too_deeply_is_a_decoding_error() -> None:
    with pytest.raises(msgspec.DecodeError, match="nested too deeply"):
        decode_json(b'{"a":' * 100_000 + b"1" + b"}" * 100_000)
    assert decode_json(b'{"a": [1]}') == {"a": [1]}


@given(st.binary(min_size=1, max_size=300), st.integers(0, 10_000), st.integers(0, 7))
def test_a_digest_of_a_small_file_sees_every_bit(
    tmp_path_factory: pytest.TempPathFactory, content: bytes, at: int, bit: int
) -> None:
    path = tmp_path_factory.mktemp("d") / "f"
    path.write_bytes(content)
    before = sampled_digest(path, 4096)
    changed = bytearray(content)
    changed[at % len(content)] ^= 1 << bit
    path.write_bytes(changed)
    assert sampled_digest(path, 4096) != before
    path.write_bytes(content)
    assert sampled_digest(path, 4096) == before


def test_a_digest_of_a_large_file_sees_its_end_its_size_and_a_change_all_over(tmp_path: Path) -> None:
    content = np.random.default_rng(0).integers(0, 255, 1_000_000).astype(np.uint8)
    path = tmp_path / "f"
    digests = set()
    for changed in (content, content // 2, np.append(content[:-1], content[-1] ^ 1), np.append(content, 0)):
        path.write_bytes(changed.astype(np.uint8).tobytes())
        digests.add(sampled_digest(path, 4096))
    path.unlink()
    assert len({*digests, sampled_digest(path, 4096)}) == 5


@given(hnp.arrays(st.sampled_from(["<f4", "<f2", "<i8", "u1"]), hnp.array_shapes(min_dims=0, max_dims=3, min_side=0)))
def test_arrays_come_back(tmp_path_factory: pytest.TempPathFactory, array: np.ndarray) -> None:
    path = tmp_path_factory.mktemp("npy") / "a.npy"
    for order in "CF":
        np.save(path, np.asarray(array, order=order))
        for mapped in (False, True):
            back = load_npy(path, 10_000, mapped=mapped)
            assert back.dtype == array.dtype and back.shape == array.shape
            assert np.ascontiguousarray(back).tobytes() == np.ascontiguousarray(array).tobytes()


@pytest.mark.parametrize(
    ("shape", "said"),
    [
        ("(1000000000, 1000000000)", "promises float32 of (1000000000, 1000000000)"),
        ("(-1, 5)", "its shape (-1, 5) is none"),
        ("(5, 'a')", ""),
        ("(" * 500 + "5" + ")" * 500, ""),
        ("(5,", ""),
    ],
)
def test_a_header_that_is_not_true_takes_no_memory(tmp_path: Path, shape: str, said: str) -> None:
    header = f"{{'descr': '<f4', 'fortran_order': False, 'shape': {shape}, }}\n".encode()
    (tmp_path / "a.npy").write_bytes(b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header + bytes(40))
    for mapped in (False, True):
        with pytest.raises(ValueError) as fault:
            load_npy(tmp_path / "a.npy", 10_000, mapped=mapped)
        assert said in str(fault.value)
    with pytest.raises(ValueError):
        npy_header(tmp_path / "a.npy", 10_000)


def test_objects_and_truncated_arrays_are_refused(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", np.array([{}], object), allow_pickle=True)
    with pytest.raises(ValueError, match="which are not numbers"):
        load_npy(tmp_path / "a.npy", 10_000)
    np.save(tmp_path / "b.npy", np.zeros(100))
    os.truncate(tmp_path / "b.npy", 500)
    with pytest.raises(ValueError, match="928 bytes in all, and the file has 500"):
        load_npy(tmp_path / "b.npy", 10_000)
    (tmp_path / "c.npy").touch()
    with pytest.raises(ValueError):
        load_npy(tmp_path / "c.npy", 10_000)
