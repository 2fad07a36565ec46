"""Decompression of RVL, in which ROS (``compressedDepth``) and RTAB-Map store depth (Wilson, 2017).

Runs of zeros and of depths alternate; depths are differences from the one before, folded so that small ones of either
sign are small numbers, and written in groups of three bits with a fourth that says whether more follow.
"""

import numpy as np

from avlmaps.core.arrays import UInt16

_MOST_GROUPS = 11  # 33 bits


def decode_rvl(content: bytes, width: int, height: int) -> UInt16[np.ndarray, "h w"]:
    """Return a 16-bit picture; ``ValueError`` where the content ends before it is whole."""
    words = np.frombuffer(content[: len(content) // 4 * 4], "<u4")
    groups = (words[:, None] >> np.arange(28, -1, -4, dtype=np.uint32) & 15).ravel().astype(np.int64)
    last = np.flatnonzero(groups < 8)
    first = np.concatenate([[0], last[:-1] + 1]) if len(last) else last
    numbers = np.zeros(len(last), np.int64)
    for group in range(_MOST_GROUPS):
        there = first + group <= last
        numbers[there] |= (groups[first[there] + group] & 7) << 3 * group
    there, folded = np.zeros(width * height, bool), [np.zeros(0, np.int64)]
    at, read = 0, 0
    while at < len(there):
        zeros, depths = numbers[read : read + 2].tolist() if read + 2 <= len(numbers) else (len(there), 1)
        begin, at = at + zeros, at + zeros + depths
        if at > len(there) or read + 2 + depths > len(numbers):
            raise ValueError(f"{len(content)} bytes are too few for {width}x{height}")
        there[begin:at] = True
        folded.append(numbers[read + 2 : read + 2 + depths])
        read += 2 + depths
    steps = np.concatenate(folded)
    picture = np.zeros(len(there), np.uint16)
    picture[there] = np.cumsum(steps >> 1 ^ -(steps & 1)) & 0xFFFF
    return picture.reshape(height, width)
