"""What follows from a map and is stored beside it: it comes back whole, or not at all."""

import json
import shutil
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from avlmaps.core import files as core_files
from avlmaps.maps.store import derived
from avlmaps.maps.store.array_files import SMALL_BYTES
from avlmaps.maps.store.derived import DERIVED, Derivation, remove_derived

ARRAYS = st.dictionaries(
    st.sampled_from(["best", "word", "frame_0"]),
    hnp.arrays(st.sampled_from([np.float32, np.int16, np.bool_]), hnp.array_shapes(max_dims=2, max_side=5)),
    min_size=1,
)


class Killed(BaseException):
    """Ends a process where it stands."""


def same(one: Mapping[str, np.ndarray] | None, other: Mapping[str, np.ndarray]) -> bool:
    return one is not None and {k: (v.dtype, v.shape, v.tobytes()) for k, v in one.items()} == {
        k: (v.dtype, v.shape, v.tobytes()) for k, v in other.items()
    }


@given(ARRAYS, ARRAYS)
def test_what_was_written_last_comes_back_bit_by_bit(
    tmp_path_factory: pytest.TempPathFactory, first: dict[str, np.ndarray], second: dict[str, np.ndarray]
) -> None:
    folder = tmp_path_factory.mktemp("map")
    one, other, third = (Derivation(folder, "names", key) for key in ("a", "b", "c"))
    assert one.read() is None
    assert one.write(first) and same(one.read(), first)
    assert other.write(second) and same(other.read(), second)
    assert one.read() is None and third.read() is None
    arrays = [path for path in (folder / DERIVED).iterdir() if path.suffix == ".npy"]
    assert len(arrays) == len(second), "older files are gone"


@given(st.integers(0, 12), ARRAYS, ARRAYS)
def test_a_kill_leaves_the_old_arrays_or_the_new_ones(
    tmp_path_factory: pytest.TempPathFactory, when: int, first: dict[str, np.ndarray], second: dict[str, np.ndarray]
) -> None:
    folder = tmp_path_factory.mktemp("map")
    old, new = Derivation(folder, "names", "old"), Derivation(folder, "names", "new")
    assert old.write(first)
    calls = 0
    rename, remove = Path.replace, Path.unlink

    def step(of, *words, **named):
        nonlocal calls
        calls += 1
        if calls > when:
            raise Killed
        return of(*words, **named)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Path, "replace", lambda *words: step(rename, *words))
        patch.setattr(Path, "unlink", lambda *words, **named: step(remove, *words, **named))
        with suppress(Killed):
            new.write(second)
    left, come = old.read(), new.read()
    assert (left is None) != (come is None)
    assert same(left, first) if come is None else same(come, second)
    assert new.write(second) and same(new.read(), second)
    assert not list((folder / DERIVED).glob("*.partial")), "what a kill left is swept"


@pytest.mark.parametrize("size", [10, SMALL_BYTES])
def test_a_damaged_file_is_not_read(tmp_path: Path, size: int) -> None:
    place = Derivation(tmp_path, "names", "a")
    assert place.write({"best": np.zeros(size, np.float32)})
    (file,) = (tmp_path / DERIVED).glob("*.npy")
    content = bytearray(file.read_bytes())
    content[-1] ^= 1
    file.write_bytes(content)
    assert place.read() is None
    file.unlink()
    assert place.read() is None
    (tmp_path / DERIVED / "names.json").write_text("{")
    assert place.read() is None


def test_a_copied_map_is_checked_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    one, other = tmp_path / "one", tmp_path / "two"
    arrays = {"best": np.arange(SMALL_BYTES, dtype=np.float32)}
    assert Derivation(one, "names", "a").write(arrays)
    shutil.copytree(one, other)
    hashed: list[Path] = []
    from avlmaps.maps.store import array_files

    compute = core_files.sha256_of_file
    monkeypatch.setattr(array_files, "sha256_of_file", lambda path: hashed.append(path) or compute(path))
    for _ in range(3):
        assert same(Derivation(other, "names", "a").read(), arrays)
    assert len(hashed) == 1


def test_where_nothing_can_be_written_nothing_is_stored_and_nothing_fails(tmp_path: Path) -> None:
    (tmp_path / DERIVED).write_text("somebody's file")
    place = Derivation(tmp_path, "names", "a")
    assert not place.write({"best": np.zeros(3)})
    assert place.read() is None
    remove_derived(tmp_path)
    assert (tmp_path / DERIVED).read_text() == "somebody's file"


def test_nothing_is_written_or_removed_behind_a_link(tmp_path: Path) -> None:
    theirs, folder = tmp_path / "theirs", tmp_path / "map"
    theirs.mkdir()
    folder.mkdir()
    (theirs / "names.json").write_text("{}")
    (folder / DERIVED).symlink_to(theirs)
    assert not Derivation(folder, "names", "a").write({"best": np.zeros(3)})
    remove_derived(folder)
    assert [path.name for path in theirs.iterdir()] == ["names.json"]


def test_only_what_avlmaps_named_is_removed(tmp_path: Path) -> None:
    assert Derivation(tmp_path, "names", "a").write({"best": np.zeros(3)})
    (tmp_path / DERIVED / "notes.json").write_text(json.dumps({"mine": 1}))
    remove_derived(tmp_path)
    assert [path.name for path in (tmp_path / DERIVED).iterdir()] == ["notes.json"]


def test_the_key_covers_the_source_text(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    module = tmp_path / "computing.py"
    monkeypatch.syspath_prepend(tmp_path)
    digests = []
    for text in ("A = 1\n", "A = 2\n"):
        module.write_text(text)
        derived._source_digest.cache_clear()
        digests.append(derived._source_digest("computing"))
    assert digests[0] != digests[1]
