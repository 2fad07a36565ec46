"""Files are replaced whole or not at all."""

import hashlib
from pathlib import Path
from threading import Thread

import pytest

from avlmaps.core.files import replace_atomically, sha256_of_file, sync_folder, user_path, write_bytes_atomically


def test_a_file_is_replaced_whole_and_nothing_is_left_beside_it(tmp_path: Path):
    target = tmp_path / "map.json"
    target.write_bytes(b"old")
    write_bytes_atomically(target, b"new")
    assert target.read_bytes() == b"new"
    assert [entry.name for entry in tmp_path.iterdir()] == ["map.json"]


def test_an_error_while_writing_leaves_the_old_file(tmp_path: Path):
    target = tmp_path / "map.json"
    target.write_bytes(b"old")
    with pytest.raises(RuntimeError, match="half way"), replace_atomically(target) as stream:
        stream.write(b"ne")
        raise RuntimeError("half way")
    assert target.read_bytes() == b"old"
    assert [entry.name for entry in tmp_path.iterdir()] == ["map.json"]


def test_until_the_end_readers_see_what_was_there_and_threads_do_not_mix(tmp_path: Path):
    target = tmp_path / "map.json"
    with replace_atomically(target) as stream:
        stream.write(b"first")
        other = Thread(target=write_bytes_atomically, args=(target, b"second"))
        other.start()
        other.join()
        assert target.read_bytes() == b"second"
    assert target.read_bytes() == b"first"
    assert [entry.name for entry in tmp_path.iterdir()] == ["map.json"]


def test_a_files_hash_does_not_depend_on_the_chunks_it_is_read_in(tmp_path: Path):
    target = tmp_path / "blob"
    target.write_bytes(bytes(range(256)) * 5)
    expected = hashlib.sha256(bytes(range(256)) * 5).hexdigest()
    assert sha256_of_file(target) == sha256_of_file(target, chunk_bytes=7) == expected


def test_a_folder_that_cannot_be_opened_is_left_alone(tmp_path: Path):
    sync_folder(tmp_path / "nowhere")


def test_a_path_of_a_user_has_the_home_as_in_a_shell(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("USERPROFILE", str(tmp_path))
    assert user_path("~/walk") == user_path(Path("~/walk")) == tmp_path / "walk"
    for same in ("walk", "/walk/~", "a~/b", "~nobody-of-this-name/walk"):
        assert user_path(same) == Path(same)
