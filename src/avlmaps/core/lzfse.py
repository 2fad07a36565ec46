"""Decompression of LZFSE, in which Record3D stores depth; the format is Apple's, published with its reference code.

A stream is a row of blocks: plain (``bvx-``), LZVN (``bvxn``), or LZFSE (``bvx2``), whose literals and matches are
coded by finite state entropy and read from the back. ``bvx$`` ends it.
"""

import struct
from typing import Any

import numpy as np
from numba import njit

_END, _PLAIN, _LZVN, _LZFSE = b"bvx$", b"bvx-", b"bvxn", b"bvx2"
# Symbols, states, extra bits and base values of the literal lengths (L), match lengths (M) and distances (D).
_L_BITS = np.array([0] * 16 + [2, 3, 5, 8], np.int64)
_M_BITS = np.array([0] * 16 + [3, 5, 8, 11], np.int64)
_D_BITS = np.repeat(np.arange(16), 4).astype(np.int64)
_STATES = (64, 64, 256, 1024)
_SYMBOLS = (20, 20, 64, 256)
# How a frequency is coded, by its five lowest bits: how many bits it takes, and its value where these suffice.
_FREQUENCY_BITS = (2, 3, 2, 5, 2, 3, 2, 8, 2, 3, 2, 5, 2, 3, 2, 14, 2, 3, 2, 5, 2, 3, 2, 8, 2, 3, 2, 5, 2, 3, 2, 14)
_FREQUENCIES = (0, 2, 1, 4, 0, 3, 1, -1, 0, 2, 1, 5, 0, 3, 1, -1, 0, 2, 1, 6, 0, 3, 1, -1, 0, 2, 1, 7, 0, 3, 1, -1)
_HEADER_BYTES = 32


def decompress(content: bytes, most_bytes: int) -> bytes:
    """Return what was compressed.

    Raises:
        ValueError: it is no such stream, is cut off or damaged, or unfolds to more.
    """
    out = np.zeros(most_bytes, np.uint8)  # a match may reach back into the blocks before
    source = np.frombuffer(content, np.uint8)
    at, total = 0, 0
    while content[at : at + 4] != _END:
        magic = content[at : at + 4]
        if magic not in (_PLAIN, _LZVN, _LZFSE) or at + 12 > len(content):
            raise ValueError("it is cut off, or no LZFSE stream")
        until = total + int.from_bytes(content[at + 4 : at + 8], "little")
        if until > most_bytes:
            raise ValueError(f"it unfolds to {until:,} bytes or more, and {most_bytes:,} belong there")
        if magic == _PLAIN:
            piece, at = source[at + 8 : at + 8 + until - total], at + 8 + until - total
            out[total : total + len(piece)] = piece
            written = total + len(piece)
        elif magic == _LZVN:
            size = int.from_bytes(content[at + 8 : at + 12], "little")
            written, at = _lzvn(source[at + 12 : at + 12 + size], out[:until], total), at + 12 + size
        else:
            written, at = _lzfse(content, source, at, out[:until], total)
        if written != until:
            raise ValueError(f"a block of {until - total} bytes is damaged or cut off")
        total = until
    return out[:total].tobytes()


def _lzfse(content: bytes, source: np.ndarray, at: int, out: np.ndarray, total: int) -> tuple[int, int]:
    """Unfold a block behind the ``total`` bytes before; return how many there are then, and where the next begins."""
    if at + _HEADER_BYTES > len(content):
        raise ValueError("it is cut off")
    first, second, third = struct.unpack_from("<3Q", content, at + 8)
    literals, literal_bytes, matches = first & 0xFFFFF, first >> 20 & 0xFFFFF, first >> 40 & 0xFFFFF
    literal_bits, states = (first >> 60 & 7) - 7, [second >> 10 * i & 0x3FF for i in range(4)]
    lmd_bytes, lmd_bits = second >> 40 & 0xFFFFF, (second >> 60 & 7) - 7
    header_bytes = third & 0xFFFFFFFF
    starts = np.array([third >> 32 & 0x3FF, third >> 42 & 0x3FF, third >> 52 & 0x3FF, *states], np.int64)
    begin = at + header_bytes
    end = begin + literal_bytes + lmd_bytes
    if header_bytes < _HEADER_BYTES or end > len(content):
        raise ValueError("it is cut off")
    l_table, m_table, d_table, of_literals = _tables(content[at + _HEADER_BYTES : begin])
    found = np.zeros(literals + 4, np.uint8)
    if not _literals(source, begin, begin + literal_bytes, literal_bits, starts[3:], of_literals, found, literals):
        raise ValueError("the literals of a block are damaged")
    middle = begin + literal_bytes
    written = _matches(
        source, middle, end, lmd_bits, starts[:3], l_table, m_table, d_table, found[:literals], matches, out, total
    )
    return written, end


def _tables(packed: bytes) -> list[np.ndarray]:
    """Return the decoding tables of L, M, D and the literals, by the frequencies in a block's header."""
    bits, have, at = 0, 0, 0
    frequencies = np.zeros(sum(_SYMBOLS), np.int64)
    for i in range(len(frequencies) if packed else 0):
        while have < 14 and at < len(packed):
            bits |= packed[at] << have
            have, at = have + 8, at + 1
        length = _FREQUENCY_BITS[bits & 31]
        value = {8: 8 + (bits >> 4 & 0xF), 14: 24 + (bits >> 4 & 0x3FF)}.get(length, _FREQUENCIES[bits & 31])
        if length > have:
            raise ValueError("the frequencies of a block are cut off")
        frequencies[i] = value
        bits, have = bits >> length, have - length
    tables: list[np.ndarray] = []
    first = 0
    for symbols, states, extra in zip(
        _SYMBOLS, _STATES, (_L_BITS, _M_BITS, _D_BITS, np.zeros(256, np.int64)), strict=True
    ):
        own, first = frequencies[first : first + symbols], first + symbols
        if own.sum() > states:
            raise ValueError("the frequencies of a block add up to more than there are states")
        base = np.concatenate([[0], np.cumsum(1 << extra)[:-1]]) if symbols < 256 else np.arange(256)
        tables.append(_table(own, states, extra, base))
    return tables


def _table(frequencies: np.ndarray, states: int, extra: np.ndarray, base: np.ndarray) -> np.ndarray:
    """Return for each state: bits to the next state, what is added to them, extra bits of the value, and its base."""
    rows: list[tuple[int, int, int, int]] = []
    for symbol, f in enumerate(frequencies.tolist()):
        if f == 0:
            continue
        k = states.bit_length() - int(f).bit_length()
        short = (2 * states >> k) - f
        for j in range(f):
            if j < short:
                rows.append((k, (f + j << k) - states, int(extra[symbol]), int(base[symbol])))
            else:
                rows.append((k - 1, j - short << k - 1, int(extra[symbol]), int(base[symbol])))
    return np.array(rows, np.int64).reshape(-1, 4)


@njit(cache=True)
def _pull(source: Any, start: Any, stream: Any, bits: Any) -> Any:  # pragma: no cover - compiled
    """Take bits from the back of a stream of (position, bits at hand, how many); -1 where there are no more."""
    while stream[2] < bits:
        stream[0] -= 1
        if stream[0] < start:
            return -1
        stream[1] = stream[1] << 8 | source[stream[0]]
        stream[2] += 8
    stream[2] -= bits
    value = stream[1] >> stream[2]
    stream[1] &= (1 << stream[2]) - 1
    return value


@njit(cache=True)
def _begin(source: Any, start: Any, end: Any, spare: Any) -> Any:  # pragma: no cover - compiled
    """Open a stream; of its last byte ``-spare`` bits at the top are none."""
    stream = np.zeros(3, np.int64)
    stream[0] = end
    if spare:
        stream[0] = end - 1
        stream[1] = source[end - 1]
        stream[2] = 8 + spare
    return stream


@njit(cache=True)
def _literals(
    source: Any, start: Any, end: Any, spare: Any, states: Any, table: Any, out: Any, count: Any
) -> Any:  # pragma: no cover - compiled
    stream = _begin(source, start, end, spare)
    for i in range(0, count, 4):
        for lane in range(4):
            state = states[lane]
            if state >= len(table):
                return False
            out[i + lane] = table[state, 3]
            bits = _pull(source, start, stream, table[state, 0])
            if bits < 0:
                return False
            states[lane] = table[state, 1] + bits
    return True


@njit(cache=True)
def _matches(
    source: Any,
    start: Any,
    end: Any,
    spare: Any,
    states: Any,
    l_table: Any,
    m_table: Any,
    d_table: Any,
    literals: Any,
    count: Any,
    out: Any,
    at: Any,
) -> Any:  # pragma: no cover
    """Unfold the matches of a block; return how many bytes there are then, -1 where the block is damaged."""
    stream = _begin(source, start, end, spare)
    literal, distance = 0, 0
    value = np.zeros(3, np.int64)
    for _ in range(count):
        for kind in range(3):
            table = l_table if kind == 0 else (m_table if kind == 1 else d_table)
            state = states[kind]
            if state >= len(table):
                return -1
            bits = _pull(source, start, stream, table[state, 0] + table[state, 2])
            if bits < 0:
                return -1
            states[kind] = table[state, 1] + (bits >> table[state, 2])
            value[kind] = table[state, 3] + (bits & ((1 << table[state, 2]) - 1))
        if value[2]:
            distance = value[2]
        if literal + value[0] > len(literals) or at + value[0] + value[1] > len(out) or distance > at + value[0]:
            return -1
        for _i in range(value[0]):
            out[at] = literals[literal]
            at, literal = at + 1, literal + 1
        if value[1] and not distance:
            return -1
        for _i in range(value[1]):
            out[at] = out[at - distance]
            at += 1
    return at


@njit(cache=True)
def _lzvn_step(source: Any, read: Any, distance: Any) -> Any:  # pragma: no cover - compiled
    """Return literals, length and distance of the match after them, and where to read on; all -1 for damage."""
    op, one, two = np.int64(source[read]), np.int64(source[read + 1]), np.int64(source[read + 2])
    if op == 0x0E or op == 0x16:  # nothing
        return 0, 0, distance, read + 1
    if op >= 0xE0:
        count = op & 15 if op & 15 else one + 16
        read += 1 if op & 15 else 2
        return (0, count, distance, read) if op >= 0xF0 else (count, 0, distance, read)
    if 0x70 <= op < 0x80 or op >= 0xD0 or (op < 0x40 and op & 7 == 6):
        return -1, -1, -1, -1
    if op & 0xE0 == 0xA0:
        return op >> 3 & 3, ((op & 7) << 2 | one & 3) + 3, one >> 2 | two << 6, read + 3
    literals, match = op >> 6, (op >> 3 & 7) + 3
    if op & 7 == 7:
        return literals, match, one | two << 8, read + 3
    if op & 7 == 6:
        return literals, match, distance, read + 1
    return literals, match, (op & 7) << 8 | one, read + 2


@njit(cache=True)
def _lzvn(source: Any, out: Any, at: Any) -> Any:  # pragma: no cover - compiled
    """Unfold an LZVN block; return how many bytes there are then, -1 where it is damaged."""
    read, distance = 0, 0
    while read + 3 <= len(source):
        if source[read] == 0x06:  # the end
            return at
        literals, match, distance, read = _lzvn_step(source, read, distance)
        if literals < 0 or read + literals > len(source) or at + literals + match > len(out):
            return -1
        for _ in range(literals):
            out[at] = source[read]
            at, read = at + 1, read + 1
        if match and (distance == 0 or distance > at):
            return -1
        for _ in range(match):
            out[at] = out[at - distance]
            at += 1
    return -1
