"""Maps on drives that cannot map files into memory: read whole, and never called damaged for it."""

import errno
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from build_fakes import SETTINGS, Walk, register_fakes

from avlmaps.core.errors import MapError
from avlmaps.core.npy import load_npy
from avlmaps.maps.build import build_map
from avlmaps.maps.store.reader import open_stored

PROFILE = register_fakes()


def refusing(code: int) -> Callable[..., None]:
    def refuse(*_: object, **__: object) -> None:
        raise OSError(code, "No such device")

    return refuse


def test_a_drive_that_cannot_map_files_is_read_as_it_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    array = np.arange(24.0).reshape(4, 6)
    np.save(tmp_path / "a.npy", array)
    monkeypatch.setattr(np, "memmap", refusing(errno.ENODEV))
    assert np.array_equal(load_npy(tmp_path / "a.npy", 10_000, mapped=True), array)
    monkeypatch.setattr(np, "memmap", refusing(errno.ENOMEM))
    with pytest.raises(OSError):
        load_npy(tmp_path / "a.npy", 10_000, mapped=True)


def test_a_map_that_the_system_cannot_read_is_not_called_damaged(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    build_map(Walk(6), tmp_path / "walk.avlmap", PROFILE, SETTINGS, progress=False)
    monkeypatch.setattr("avlmaps.maps.store.array_files.load_npy", refusing(errno.EIO))
    with pytest.raises(MapError, match=r"cannot be read \(No such device\); check the drive") as fault:
        open_stored(tmp_path / "walk.avlmap")
    assert "damaged" not in str(fault.value)
