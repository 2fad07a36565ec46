"""Decompression of RVL, in which ROS (``compressedDepth``) and RTAB-Map store depth (Wilson, 2017).

Runs of zeros and of depths alternate; depths are differences from the one before, folded so that small ones of either
sign are small numbers, and written in groups of three bits with a fourth that says whether more follow.
"""

from typing import Any

import numpy as np
from jaxtyping import UInt16
from numba import njit


def decode_rvl(content: bytes, width: int, height: int) -> UInt16[np.ndarray, "h w"]:
    """Return a 16-bit picture.

    Raises:
        ValueError: the content ends before the picture is whole.
    """
    words = np.frombuffer(content[: len(content) // 4 * 4], "<u4")
    picture = np.zeros(width * height, np.uint16)
    if not _decode(words, picture):
        raise ValueError(f"{len(content)} bytes are too few for {width}x{height}")
    return picture.reshape(height, width)


@njit(cache=True)
def _number(words: Any, state: Any) -> Any:  # pragma: no cover - compiled
    """Return the next number; -1 at the end. ``state`` is the next word, the one at hand, and its groups left."""
    value, shift = np.int64(0), 0
    while True:
        if state[2] == 0:
            if state[0] >= len(words):
                return np.int64(-1)
            state[1], state[2] = np.int64(words[state[0]]), 8
            state[0] += 1
        group = state[1] >> 28 & 15
        state[1] = state[1] << 4 & 0xFFFFFFFF
        state[2] -= 1
        value |= (group & 7) << shift
        shift += 3
        if not group & 8 or shift > 60:
            return value


@njit(cache=True)
def _decode(words: Any, picture: Any) -> Any:  # pragma: no cover - compiled
    state = np.zeros(3, np.int64)
    at, before = 0, 0
    while at < len(picture):
        zeros = _number(words, state)
        depths = _number(words, state)
        if zeros < 0 or depths < 0 or at + zeros + depths > len(picture):
            return False
        at += zeros
        for _ in range(depths):
            folded = _number(words, state)
            if folded < 0:
                return False
            before += (folded >> 1) ^ -(folded & 1)
            picture[at] = before & 0xFFFF
            at += 1
    return True
