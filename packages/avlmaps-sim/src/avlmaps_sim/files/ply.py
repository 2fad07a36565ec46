"""PLY files with properties of their faces, as scanned buildings are shipped: ASCII or binary, of any polygons."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float32, Int, Int32, UInt8

from avlmaps.core.errors import SceneError

_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
    "double": "f8", "float64": "f8",
}  # fmt: skip
_ORDER = {"binary_little_endian": "<", "binary_big_endian": ">", "ascii": "="}
_LONGEST_HEADER = 1 << 16


@dataclass(frozen=True, slots=True, eq=False)
class PlyMesh:
    """The content of a PLY file."""

    vertex: Float32[np.ndarray, "v 3"]  # (v, 3) places
    triangle: Int32[np.ndarray, "t 3"]  # (t, 3) rows of ``vertex``; polygons are cut into fans
    colour: UInt8[np.ndarray, "v 3"] | None  # (v, 3) sRGB, None where vertices have none
    face: dict[str, Int[np.ndarray, " t"]]  # properties of the faces by name, one value for each triangle


@dataclass(frozen=True, slots=True)
class _Property:
    name: str
    kind: str
    count_kind: str = ""  # of the length before a list


@dataclass(frozen=True, slots=True)
class _Element:
    name: str
    count: int
    properties: tuple[_Property, ...]


def read_ply(path: Path) -> PlyMesh:
    """Read a PLY file. ``SceneError``: it is missing, truncated or no PLY of triangles or polygons."""
    try:
        content = path.read_bytes()
    except OSError as error:
        raise SceneError(f"cannot read {path}: {error.strerror or error}") from error
    order, elements, start = _header(path, content)
    tables: dict[str, dict[str, np.ndarray | list[np.ndarray]]] = {}
    try:
        if order == "=":
            words = content[start:].split()
            for element in elements:
                tables[element.name], words = _from_words(element, words)
        else:
            for element in elements:
                tables[element.name], start = _from_bytes(element, content, start, order)
        return _mesh(tables)
    except (ValueError, IndexError, KeyError) as error:
        raise SceneError(f"{path} is truncated or damaged ({error}); fetch it again") from error


def _header(path: Path, content: bytes) -> tuple[str, list[_Element], int]:
    end = content.find(b"end_header", 0, _LONGEST_HEADER)
    if not content.startswith(b"ply") or end < 0:
        raise SceneError(f"{path} is not a PLY file: it has no PLY header")
    start = content.index(b"\n", end) + 1 if b"\n" in content[end : end + 13] else len(content)
    order, elements = "", []
    for line in content[:end].decode("ascii", "replace").splitlines()[1:]:
        words = line.split()
        if not words or words[0] in ("comment", "obj_info"):
            continue
        try:
            if words[0] == "format":
                order = _ORDER[words[1]]
            elif words[0] == "element":
                elements.append(_Element(words[1], int(words[2]), ()))
            elif words[0] == "property":
                last = elements.pop()
                elements.append(_Element(last.name, last.count, (*last.properties, _property(words[1:]))))
        except (KeyError, IndexError, ValueError) as error:
            raise SceneError(f"the header of {path} says {line.strip()!r}, which no PLY file says") from error
    if not order:
        raise SceneError(f"the header of {path} does not say its format")
    return order, elements, start


def _property(words: list[str]) -> _Property:
    if words[0] == "list":
        return _Property(words[3], _TYPES[words[2]], _TYPES[words[1]])
    return _Property(words[1], _TYPES[words[0]])


def _from_bytes(
    element: _Element, content: bytes, start: int, order: str
) -> tuple[dict[str, np.ndarray | list[np.ndarray]], int]:
    """Read the values of one element; lists that are all as long as the first are read at once."""
    lengths = {}
    at = start
    if element.count:
        for item in element.properties:
            size = np.dtype(item.kind).itemsize
            if item.count_kind:
                lengths[item.name] = int(np.frombuffer(content, order + item.count_kind, 1, at)[0])
                at += np.dtype(item.count_kind).itemsize + size * lengths[item.name]
            else:
                at += size
    fields = []
    for item in element.properties:
        if item.count_kind:
            fields.append((f"{item.name} count", order + item.count_kind))
            fields.append((item.name, order + item.kind, (lengths.get(item.name, 0),)))
        else:
            fields.append((item.name, order + item.kind))
    record = np.dtype(fields)
    if start + element.count * record.itemsize <= len(content):
        rows = np.frombuffer(content, record, element.count, start)
        if all((rows[f"{name} count"] == length).all() for name, length in lengths.items()):
            table = {item.name: rows[item.name] for item in element.properties}
            return table, start + element.count * record.itemsize  # pyright: ignore[reportReturnType]
    elif not lengths:
        raise ValueError(f"{element.count} rows of {element.name} do not fit in it")
    return _row_by_row(element, content, start, order)


def _row_by_row(
    element: _Element, content: bytes, start: int, order: str
) -> tuple[dict[str, np.ndarray | list[np.ndarray]], int]:
    values: dict[str, list] = {item.name: [] for item in element.properties}
    at = start
    for _ in range(element.count):
        for item in element.properties:
            count = 1
            if item.count_kind:
                count = int(np.frombuffer(content, order + item.count_kind, 1, at)[0])
                at += np.dtype(item.count_kind).itemsize
            row = np.frombuffer(content, order + item.kind, count, at)
            at += row.nbytes
            values[item.name].append(row if item.count_kind else row[0])
    return {i.name: values[i.name] if i.count_kind else np.array(values[i.name]) for i in element.properties}, at


def _from_words(element: _Element, words: list[bytes]) -> tuple[dict[str, np.ndarray | list[np.ndarray]], list[bytes]]:
    values: dict[str, list] = {item.name: [] for item in element.properties}
    at = 0
    for _ in range(element.count):
        for item in element.properties:
            if item.count_kind:
                count = int(words[at])
                if at + 1 + count > len(words):
                    raise ValueError(f"it ends within the {element.name}s")
                values[item.name].append(np.array(words[at + 1 : at + 1 + count]).astype(item.kind))
                at += 1 + count
            else:
                values[item.name].append(words[at])
                at += 1
    table = {
        item.name: values[item.name] if item.count_kind else np.array(values[item.name]).astype(item.kind)
        for item in element.properties
    }
    return table, words[at:]


def _mesh(tables: dict[str, dict[str, np.ndarray | list[np.ndarray]]]) -> PlyMesh:
    """Put vertices and faces together."""
    points, faces = tables["vertex"], tables.get("face", {})
    vertex = np.stack([np.asarray(points[axis], np.float32) for axis in "xyz"], axis=1)
    colour = None
    if "red" in points:
        channels = [np.asarray(points[name]) for name in ("red", "green", "blue")]
        scale = 255.0 if channels[0].dtype.kind == "f" else 1.0
        colour = np.stack([np.clip(channel * scale, 0, 255) for channel in channels], axis=1).astype(np.uint8)
    lists = faces["vertex_indices" if "vertex_indices" in faces else "vertex_index"]
    triangle, owner = _fans(lists)
    if len(triangle) and not (triangle.min() >= 0 and triangle.max() < len(vertex)):
        raise ValueError(f"a face names a vertex that is not among its {len(vertex)}")
    face = {
        name: values[owner].astype(np.int64)
        for name, values in faces.items()
        if isinstance(values, np.ndarray) and values.ndim == 1
    }
    return PlyMesh(vertex, triangle.astype(np.int32), colour, face)


def _fans(lists: np.ndarray | list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    if isinstance(lists, np.ndarray):
        groups = [(np.arange(len(lists)), lists.astype(np.int64))]
    else:
        length = np.array([len(corners) for corners in lists])
        groups = []
        for sides in np.unique(length):
            which = np.flatnonzero(length == sides)
            groups.append((which, np.array([lists[k] for k in which], np.int64)))
    triangles, owners = [np.zeros((0, 3), np.int64)], [np.zeros(0, np.int64)]
    for which, corners in groups:
        for k in range(1, corners.shape[1] - 1):
            triangles.append(corners[:, [0, k, k + 1]])
            owners.append(which)
    owner = np.concatenate(owners)
    order = np.argsort(owner, kind="stable")
    return np.concatenate(triangles)[order], owner[order]
