"""Nothing behind a symbolic link in a map's folder is ever written or removed, whatever writes there."""

import os
import shutil
from collections.abc import Callable
from pathlib import Path
from threading import get_native_id

import numpy as np
import pytest
from build_fakes import SETTINGS, Walk, register_fakes

from avlmaps.core.errors import MapError
from avlmaps.core.files import linked_folder, write_bytes_atomically
from avlmaps.maps.build import build_map
from avlmaps.maps.store.folder import read
from avlmaps.maps.store.tables import lock_folder, write_arrays

PROFILE = register_fakes()
pytestmark = pytest.mark.skipif(os.name == "nt", reason="links need a privilege there")

WRITERS: dict[str, Callable[[Path], object]] = {
    "build": lambda path: build_map(Walk(6), path, PROFILE, SETTINGS, progress=False, overwrite=True),
    "the same build": lambda path: build_map(Walk(12), path, PROFILE, SETTINGS, progress=False),
    "fresh build": lambda path: build_map(Walk(6), path, PROFILE, SETTINGS, progress=False, resume=False),
}


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("maps") / "walk.avlmap"
    build_map(Walk(12), path, PROFILE, SETTINGS, progress=False)
    return path


@pytest.fixture
def copied(built: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(built, tmp_path / "walk.avlmap"))


@pytest.fixture
def elsewhere(tmp_path: Path) -> Path:
    """Somebody's photos."""
    (tmp_path / "photos" / "trip").mkdir(parents=True)
    for name in ("a.jpg", "done.json", "trip/b.npy", ".map.json.1.partial"):
        (tmp_path / "photos" / name).write_bytes(name.encode())
    return tmp_path / "photos"


def content(folder: Path) -> dict[str, bytes]:
    return {str(file.relative_to(folder)): file.read_bytes() for file in folder.rglob("*") if file.is_file()}


@pytest.mark.parametrize("writer", WRITERS)
@pytest.mark.parametrize("name", ["clips", "parts", "parts/fused-0123", "notes"])
def test_a_linked_folder_is_refused_and_what_is_behind_it_stays(
    copied: Path, elsewhere: Path, name: str, writer: str
) -> None:
    before, link = content(elsewhere), copied / name
    link.parent.mkdir(exist_ok=True)
    if link.exists():
        shutil.rmtree(link)
    link.symlink_to(elsewhere, target_is_directory=True)
    with pytest.raises(MapError, match=r"is a symbolic link to a folder; avlmaps neither writes nor removes"):
        WRITERS[writer](copied)
    assert content(elsewhere) == before


@pytest.mark.parametrize("name", [".lock", "map.json", "voxels.safetensors", "parts/x"])
def test_what_a_linked_file_points_to_stays(copied: Path, elsewhere: Path, name: str) -> None:
    before, link = content(elsewhere), copied / name
    link.parent.mkdir(exist_ok=True)
    link.unlink(missing_ok=True)
    link.symlink_to(elsewhere / "a.jpg")
    WRITERS["build"](copied)
    assert content(elsewhere) == before
    read(copied)


def test_a_map_may_itself_be_a_link(copied: Path, tmp_path: Path) -> None:
    (tmp_path / "link.avlmap").symlink_to(copied)
    WRITERS["build"](tmp_path / "link.avlmap")
    assert read(copied).info.counts.frames == 6


def test_a_link_that_waits_under_a_temporary_name_is_not_written_through(tmp_path: Path, elsewhere: Path) -> None:
    before = content(elsewhere)
    for name in ("voxels.safetensors", "map.json"):
        part = f".{name}.{os.getpid()}-{get_native_id()}.part{Path(name).suffix}"
        (tmp_path / part).symlink_to(elsewhere / "a.jpg")
    write_arrays(tmp_path / "voxels.safetensors", {"rgb": np.arange(3)})
    write_bytes_atomically(tmp_path / "map.json", b"{}")
    assert content(elsewhere) == before and (tmp_path / "map.json").read_bytes() == b"{}"


def test_a_lock_is_not_taken_through_a_link(tmp_path: Path, elsewhere: Path) -> None:
    (tmp_path / "m").mkdir()
    (tmp_path / "m" / ".lock").symlink_to(elsewhere / "a.jpg")
    with lock_folder(tmp_path / "m"):
        pass
    assert (elsewhere / "a.jpg").read_bytes() == b"a.jpg"


def test_links_are_found_at_any_depth_and_files_are_none(tmp_path: Path, elsewhere: Path) -> None:
    deep = tmp_path / "m" / "a" / "b"
    deep.mkdir(parents=True)
    (deep / "file").symlink_to(elsewhere / "a.jpg")
    (deep / "gone").symlink_to("nowhere")
    assert linked_folder(tmp_path / "m") is None and linked_folder(tmp_path / "nothing") is None
    (deep / "link").symlink_to(elsewhere)
    assert linked_folder(tmp_path / "m") == deep / "link"


@pytest.mark.parametrize("name", ["clips/dog.wav", "voxels.vox", "parts/bolt/m8.stl"])
def test_a_folder_of_somebody_is_no_place_for_a_map(tmp_path: Path, name: str) -> None:
    (tmp_path / "own" / name).parent.mkdir(parents=True)
    (tmp_path / "own" / name).write_text("mine")
    with pytest.raises(MapError, match=r"is there already and is not a map; give another path, nothing .* touched"):
        build_map(Walk(6), tmp_path / "own", PROFILE, SETTINGS, progress=False)
    assert content(tmp_path / "own") == {name: b"mine"}


@pytest.mark.parametrize("writer", ["build", "the same build"])
def test_a_file_that_somebody_put_into_a_map_stays(copied: Path, writer: str) -> None:
    own = ("clips/dog.wav", "keyframes.txt", "parts/bolt/m8.stl", "voxels/old-0123456789abcdeg.npy")
    for name in own:
        (copied / name).parent.mkdir(parents=True, exist_ok=True)
        (copied / name).write_text("mine")
    (copied / "clips").mkdir(exist_ok=True)
    (copied / "clips/000000-0123456789abcdef.flac").write_text("of a map before")
    WRITERS[writer](copied)
    assert all((copied / name).read_text() == "mine" for name in own)
    assert not (copied / "clips/000000-0123456789abcdef.flac").exists()
    read(copied)
