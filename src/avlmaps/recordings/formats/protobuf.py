"""Decoding protobuf messages by the description that travels with them: no generated code, no dependency.

An MCAP schema in protobuf is a ``FileDescriptorSet``, itself a protobuf message, whose few fields that matter here
are known by number: of a file its package (2) and messages (4); of a message its name (1), fields (2) and nested
messages (3); of a field its name (1), number (3), label (4), type (5) and the name of its type (6).
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any, cast

import numpy as np

_REPEATED = 3
_MESSAGE, _BYTES, _STRING = 11, 12, 9
# Types by number: how each lies on the wire (0 varint, 1 eight bytes, 5 four bytes), and as what it is unpacked.
_FIXED = {1: (1, "<f8"), 2: (5, "<f4"), 6: (1, "<u8"), 7: (5, "<u4"), 15: (5, "<i4"), 16: (1, "<i8")}
_SIGNED = (3, 5, 14)
_ZIGZAG = (17, 18)
_BOOL = 8
_DEEPEST = 8


@dataclass(frozen=True, slots=True)
class _Field:
    name: str
    kind: int
    repeated: bool
    type_name: str


@dataclass(slots=True)
class _Message:
    fields: dict[int, _Field] = field(default_factory=dict)


class Descriptions:
    """The messages that a ``FileDescriptorSet`` describes."""

    def __init__(self, content: bytes) -> None:
        """Read them.

        Raises:
            ValueError: the content is no such set.
        """
        self._messages: dict[str, _Message] = {}
        for number, file in _wire(content):
            if number == 1:
                parts = list(_wire(file))
                package = next((bytes(value).decode() for n, value in parts if n == 2), "")
                for n, value in parts:
                    if n == 4:
                        self._add(package, value)

    def _add(self, outer: str, content: Any) -> None:
        parts = list(_wire(content))
        own = next((bytes(value).decode() for n, value in parts if n == 1), "")
        name = f"{outer}.{own}" if outer else own
        message = self._messages[name] = _Message()
        for n, value in parts:
            if n == 2:
                said = dict(_wire(value))
                type_name = bytes(said.get(6, b"")).decode().lstrip(".")
                named = bytes(said.get(1, b"")).decode()
                message.fields[int(said.get(3, 0))] = _Field(
                    named, int(said.get(5, 0)), said.get(4) == _REPEATED, type_name
                )
            elif n == 3:
                self._add(name, value)

    def decode(self, name: str, content: Any, depth: int = 0) -> SimpleNamespace:
        """Return a message with a member for each field; what is not on the wire has its default.

        Raises:
            ValueError: the content is no such message, or there is no description of it.
        """
        if name not in self._messages:
            raise ValueError(f"there is no description of {name}")
        found: dict[str, Any] = {}
        for number, value in _wire(content):
            known = self._messages[name].fields.get(number)
            if known is None:
                continue
            if known.repeated:
                found.setdefault(known.name, []).extend(self._several(known, value, depth))
            else:
                found[known.name] = self._one(known, value, depth)
        for known in self._messages[name].fields.values():
            if known.name not in found:
                found[known.name] = [] if known.repeated else self._default(known, depth)
        return SimpleNamespace(**found)

    def _several(self, known: _Field, value: Any, depth: int) -> list[Any]:
        packed = isinstance(value, memoryview)
        if known.kind in _FIXED and packed:
            return np.frombuffer(cast("memoryview", value), _FIXED[known.kind][1]).tolist()
        if known.kind not in (_MESSAGE, _BYTES, _STRING) and packed:  # varints, one after another
            return [_number(known.kind, number) for number in _varints(cast("memoryview", value))]
        return [self._one(known, value, depth)]

    def _one(self, known: _Field, value: Any, depth: int) -> Any:
        if known.kind == _MESSAGE:
            return self.decode(known.type_name, value, depth + 1)
        if known.kind == _BYTES:
            return value
        if known.kind == _STRING:
            return bytes(value).decode()
        return _number(known.kind, value)

    def _default(self, known: _Field, depth: int) -> Any:
        if known.kind == _MESSAGE:
            return self.decode(known.type_name, b"", depth + 1) if depth < _DEEPEST else None
        return {_BYTES: b"", _STRING: ""}.get(known.kind, 0)


def _number(kind: int, value: Any) -> Any:
    if kind in _FIXED:
        return np.frombuffer(value, _FIXED[kind][1])[0].item() if isinstance(value, bytes) else value
    if kind in _SIGNED:
        return value - (1 << 64) if value >> 63 else value
    if kind in _ZIGZAG:
        return (value >> 1) ^ -(value & 1)
    return bool(value) if kind == _BOOL else value


def _wire(content: Any) -> Iterator[tuple[int, Any]]:
    """Yield (field's number, value): whole numbers, fixed ones as bytes, everything else as a view of the content."""
    view = memoryview(content)
    at = 0
    while at < len(view):
        tag, at = _varint(view, at)
        number, kind = tag >> 3, tag & 7
        if kind == 0:
            value, at = _varint(view, at)
        elif kind in (1, 5):
            size = 8 if kind == 1 else 4
            value, at = bytes(view[at : at + size]), at + size
        elif kind == 2:
            size, at = _varint(view, at)
            value, at = view[at : at + size], at + size
        else:
            raise ValueError(f"wire type {kind} of field {number}")
        if at > len(view):
            raise ValueError("it ends within a field")
        yield number, value


def _varints(view: memoryview) -> Iterator[int]:
    at = 0
    while at < len(view):
        value, at = _varint(view, at)
        yield value


def _varint(view: memoryview, at: int) -> tuple[int, int]:
    value, shift = 0, 0
    while at < len(view) and shift < 64:
        byte = view[at]
        value, at, shift = value | (byte & 127) << shift, at + 1, shift + 7
        if byte < 128:
            return value, at
    raise ValueError("it ends within a number")
