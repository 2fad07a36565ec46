"""What a network said of pictures, remembered by their content.

A build encodes a keyframe's pixels first and its view later, by encoders of one network: the second finds what the
first run gave besides, a vector of some kilobytes, and runs nothing.
"""

import hashlib
import threading
from collections import OrderedDict
from typing import Any

import numpy as np

_MOST = 4096


class Remembered:
    """Vectors by the content of what they are of, the latest ``_MOST``; for several threads."""

    def __init__(self) -> None:
        self._found: OrderedDict[bytes, np.ndarray] = OrderedDict()
        self._lock = threading.Lock()

    def get(self, key: bytes) -> np.ndarray | None:
        """Return a vector, None where it is not known."""
        with self._lock:
            return self._found.get(key)

    def put(self, key: bytes, vector: np.ndarray) -> None:
        """Remember a vector; the oldest is forgotten where there are too many."""
        with self._lock:
            self._found[key] = vector
            while len(self._found) > _MOST:
                self._found.popitem(last=False)


def key_of(*content: Any) -> bytes:
    """Return a key of arrays, by their shapes and bytes, and of other values, by what they are written as."""
    digest = hashlib.blake2b(digest_size=16)
    for each in content:
        is_array = isinstance(each, np.ndarray)
        digest.update(repr((each.shape, each.dtype.str) if is_array else each).encode() + b"\0")
        if is_array:
            digest.update(np.ascontiguousarray(each).data)
    return digest.digest()
