"""Only regular files of limited size are opened, and arrays whose header is true to the file."""

import os
import socket
from pathlib import Path

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.files import checked_size, decode_json, open_regular, read_regular, sampled_digest

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
