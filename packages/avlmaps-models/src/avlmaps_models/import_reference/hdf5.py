"""Opening HDF5 files of unknown origin: every fault one sentence, nothing read before it is needed.

h5py comes with the extra ``paper`` and is imported when a file is opened.
"""

import importlib
from collections.abc import Generator, Iterable
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from avlmaps.core.errors import BackendError, MapError
from avlmaps.core.extras import install_command

_MEND = "copy it again, or let the code that wrote it write it again"
# The errors that h5py raises where the bytes are not as they should be.
_FAULTS = (OSError, RuntimeError, LookupError, TypeError, ValueError, ArithmeticError, MemoryError)
Shape = tuple[int | None, ...]


def _h5py() -> Any:
    try:
        return importlib.import_module("h5py")
    except ImportError:
        get = install_command("paper", distribution="avlmaps-models")
        raise BackendError(f"Reading .h5df files needs h5py; get it with: {get}") from None


@contextmanager
def _explain_faults(path: Path) -> Generator[None]:
    try:
        yield
    except _FAULTS as fault:
        why = " ".join(str(fault).split()).rstrip(".")
        raise MapError(f"{path} cannot be read ({why}): it is truncated, damaged or no HDF5 file; {_MEND}.") from fault


@contextmanager
def open_hdf5(path: Path) -> Generator["Hdf5"]:
    """Open a file for reading.

    Raises:
        BackendError: h5py is not installed.
        MapError: the file is missing, truncated or no HDF5.
    """
    h5py = _h5py()
    if not path.is_file():
        raise MapError(f"{path} is not there, or is not a file.")
    with _explain_faults(path):
        file = h5py.File(path, "r")
    with file:
        yield Hdf5(path, file, h5py)


class Hdf5:
    """An open file.

    Attributes:
        path: where it lies.
    """

    def __init__(self, path: Path, file: Any, h5py: Any) -> None:
        self.path = path
        self._file = file
        self._h5py = h5py

    def __contains__(self, name: str) -> bool:
        return name in self._file

    def numbers(self, name: str, shape: Shape, kinds: str = "fiu") -> "Numbers":
        """Return a dataset, unread.

        Args:
            name: of the dataset.
            shape: what it must be; None for any size.
            kinds: letters of numpy's kinds of number that may be in it.

        Raises:
            MapError: it is missing, no plain array, or of another shape or kind.
        """
        with _explain_faults(self.path):
            link, has = self._file.get(name, getlink=True), _listed(str(key) for key in self._file)
            found = self._own_array(self._file[name]) if isinstance(link, self._h5py.HardLink) else None
        if link is None:
            raise MapError(f"{self.path} has no {name}, as a map of the reference code has (it holds: {has}).")
        if found is None:
            raise MapError(f"{self.path}: {name} is not an array stored in this file; the reference code writes one.")
        array, has_shape, dtype = found
        fits = len(has_shape) == len(shape) and all(
            wanted in (None, size) for wanted, size in zip(shape, has_shape, strict=True)
        )
        if not fits or dtype.kind not in kinds:
            wanted = " x ".join("n" if size is None else str(size) for size in shape) or "one number"
            raise MapError(
                f"{self.path}: {name} is {dtype} of {has_shape}, and a map of the reference code has "
                f"{'whole numbers' if kinds == 'iu' else 'numbers'} ({wanted}) there; this is another kind of map."
            )
        return Numbers(self.path, array, has_shape)

    def _own_array(self, found: Any) -> tuple[Any, tuple[int, ...], np.dtype[Any]] | None:
        """Return a dataset with its shape and type; None for what is none or would read other files of this machine."""
        if not isinstance(found, self._h5py.Dataset) or found.is_virtual or found.external:
            return None
        return found, tuple(int(size) for size in found.shape or ()), found.dtype


def _listed(names: Iterable[str]) -> str:
    shown = sorted(name if name.isprintable() else repr(name) for name in names)
    return ", ".join(shown[:12]) + (", ..." if len(shown) > 12 else "") or "nothing"


class Numbers:
    """A dataset whose shape and kind are checked; rows are read on demand.

    Attributes:
        shape: of the whole.
    """

    def __init__(self, path: Path, dataset: Any, shape: tuple[int, ...]) -> None:
        self._path = path
        self._dataset = dataset
        self.shape = shape

    def rows(self, part: slice, dtype: type[np.generic]) -> np.ndarray:
        """Read some rows, as numbers of that type."""
        with _explain_faults(self._path):
            return np.asarray(self._dataset[part]).astype(dtype, copy=False)

    def whole(self, dtype: type[np.generic]) -> np.ndarray:
        """Read all of it."""
        with _explain_faults(self._path):
            return np.asarray(self._dataset[()]).astype(dtype, copy=False)
