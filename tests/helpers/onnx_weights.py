"""ONNX files with the numbers of each weight in another order: the same network, which has learnt nothing."""

from collections.abc import Iterator

import numpy as np

_GRAPH, _INITIALIZER, _DATA_TYPE, _RAW_DATA = 7, 5, 2, 9  # field numbers of onnx.proto
_ITEM_BYTES = {1: 4, 10: 2, 2: 1, 3: 1}  # float, float16, uint8, int8


def shuffled_weights(model: bytes, rng: np.random.Generator) -> bytes:
    """Return the model with the numbers of each weight permuted; shapes and everything else stay."""
    content, count = bytearray(model), 0
    for start, stop in _fields(model, 0, len(model), _GRAPH):
        for begin, end in _fields(model, start, stop, _INITIALIZER):
            kind = next(_numbers(model, begin, end, _DATA_TYPE), 0)
            for first, last in _fields(model, begin, end, _RAW_DATA):
                size = _ITEM_BYTES.get(kind, 0)
                if size and (last - first) // size > 8:
                    items = np.frombuffer(model[first:last], f"V{size}")
                    content[first:last] = items[rng.permutation(len(items))].tobytes()
                    count += 1
    assert count > 3, "the file holds no weights where they were expected"
    return bytes(content)


def _parts(model: bytes, at: int, stop: int) -> Iterator[tuple[int, int, int, int]]:
    """Yield field number, wire type, and the span of its value."""
    while at < stop:
        tag, at = _varint(model, at)
        number, wire = tag >> 3, tag & 7
        if wire == 2:
            length, at = _varint(model, at)
            end = at + length
        elif wire == 0:
            end = _varint(model, at)[1]
        else:
            end = at + (8 if wire == 1 else 4)
        yield number, wire, at, end
        at = end


def _fields(model: bytes, start: int, stop: int, wanted: int) -> Iterator[tuple[int, int]]:
    return ((a, b) for number, wire, a, b in _parts(model, start, stop) if number == wanted and wire == 2)


def _numbers(model: bytes, start: int, stop: int, wanted: int) -> Iterator[int]:
    return (_varint(model, a)[0] for number, wire, a, _ in _parts(model, start, stop) if number == wanted and wire == 0)


def _varint(model: bytes, at: int) -> tuple[int, int]:
    value = shift = 0
    while True:
        byte = model[at]
        value |= (byte & 0x7F) << shift
        at, shift = at + 1, shift + 7
        if not byte & 0x80:
            return value, at
