"""NPY files, opened by their header first: what it promises must be what the file holds, before memory is taken."""

import errno
import math
import tokenize
from dataclasses import dataclass
from functools import lru_cache
from io import BufferedIOBase, BytesIO
from pathlib import Path
from typing import BinaryIO, cast

import numpy as np

from avlmaps.core.files import open_regular

_MOST_DIMENSIONS = 8
_USUAL, _HEAD = b"\x93NUMPY\x01\x00", 10  # of version 1.0, and it with the length of the header
_CANNOT_MAP = {errno.ENODEV, errno.EINVAL, errno.ENOTSUP, errno.EACCES, errno.EPERM, errno.ENOSYS}
# The header is a Python literal; what its parser raises is numpy's and Python's own affair.
_UNREADABLE = (
    ValueError,
    TypeError,
    SyntaxError,
    KeyError,
    tokenize.TokenError,
    RecursionError,
    MemoryError,
    OverflowError,
)


@dataclass(frozen=True, slots=True)
class NpyHeader:
    """The header of an NPY file.

    Attributes:
        shape: of the array.
        dtype: of its elements.
        fortran: whether columns come first.
        offset: where the elements begin, bytes.
    """

    shape: tuple[int, ...]
    dtype: np.dtype
    fortran: bool
    offset: int

    @property
    def bytes(self) -> int:
        """Size of the whole file."""
        return self.offset + math.prod(self.shape) * self.dtype.itemsize


def read_npy_header(stream: BinaryIO, size: int) -> NpyHeader:
    """Read the header of an NPY file and compare it with the file's size.

    Raises:
        ValueError: it is not an NPY header, holds objects, or promises more or fewer bytes than there are.
    """
    begin = stream.tell()
    head = stream.read(_HEAD)
    try:
        if head[:-2] == _USUAL:  # many files of a map begin alike
            header = head + stream.read(int.from_bytes(head[-2:], "little"))
            shape, fortran, dtype = _described(header)
        else:
            stream.seek(begin)
            shape, fortran, dtype = _read_header(stream)
    except _UNREADABLE as fault:
        reason = str(fault).splitlines()[0].rstrip(".") if str(fault) and size else "it is empty"
        raise ValueError(reason) from None
    if dtype.hasobject or dtype.itemsize == 0:
        raise ValueError(f"it holds {dtype}, which are not numbers")
    if len(shape) > _MOST_DIMENSIONS or any(length < 0 for length in shape):
        raise ValueError(f"its shape {str(shape)[:60]} is none")
    header = NpyHeader(tuple(shape), dtype, bool(fortran), stream.tell())
    if header.bytes != size:
        raise ValueError(
            f"its header promises {dtype} of {shape}, {header.bytes:,} bytes in all, and the file has {size:,}"
        )
    return header


def _read_header(stream: BinaryIO) -> tuple[tuple[int, ...], bool, np.dtype]:
    version = np.lib.format.read_magic(stream)  # pyright: ignore[reportArgumentType]
    read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    return read(stream)  # pyright: ignore[reportArgumentType]


@lru_cache(maxsize=1000)
def _described(header: bytes) -> tuple[tuple[int, ...], bool, np.dtype]:
    return _read_header(BytesIO(header))


def load_npy(path: Path, limit_bytes: int, *, mapped: bool = False) -> np.ndarray:
    """Return the array of an NPY file, read or memory-mapped (read only).

    Raises:
        OSError: as of ``open_regular``.
        ValueError: as of ``read_npy_header``.
    """
    with open_regular(path, limit_bytes) as stream:
        size = stream.seek(0, 2)
        stream.seek(0)
        header = read_npy_header(stream, size)
        order = "F" if header.fortran else "C"
        if mapped and math.prod(header.shape):
            try:
                return np.memmap(stream, header.dtype, "r", header.offset, header.shape, order)
            except OSError as error:  # some network drives cannot map files; what is read whole is the same
                if error.errno not in _CANNOT_MAP:
                    raise
                stream.seek(header.offset)
        flat = np.empty(math.prod(header.shape), header.dtype)
        into = cast(BufferedIOBase, stream)
        read = into.readinto(flat.view(np.uint8).data) if flat.size else 0
    if read != flat.nbytes:
        raise ValueError(f"it ends after {header.offset + (read or 0):,} of {size:,} bytes")
    return flat.reshape(header.shape, order=order)


def npy_header(path: Path, limit_bytes: int) -> NpyHeader:
    """Return the header of an NPY file; errors as of ``load_npy``."""
    with open_regular(path, limit_bytes) as stream:
        size = stream.seek(0, 2)
        stream.seek(0)
        return read_npy_header(stream, size)
