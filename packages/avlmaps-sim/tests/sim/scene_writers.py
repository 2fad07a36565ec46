"""Tiny buildings written in the layouts that data sets publish, byte by byte."""

import json
import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np

Box = tuple[tuple[float, float, float], tuple[float, float, float]]
_FACES = np.array(
    [[0, 2, 3], [0, 3, 1], [4, 5, 7], [4, 7, 6], [0, 1, 5], [0, 5, 4], [2, 6, 7], [2, 7, 3], [0, 4, 6], [0, 6, 2],
     [1, 3, 7], [1, 7, 5]]
)  # fmt: skip


def box_mesh(low: Sequence[float], high: Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
    """Corners and triangles of a box."""
    (a, b, c), (d, e, f) = low, high
    return np.array([(x, y, z) for z in (c, f) for y in (b, e) for x in (a, d)], np.float64), _FACES


def y_up(vertex: np.ndarray) -> np.ndarray:
    """Turn places with z up into glTF's axes."""
    return np.stack([vertex[:, 0], vertex[:, 2], -vertex[:, 1]], axis=1)


def png(picture: np.ndarray) -> bytes:
    return cv2.imencode(".png", picture[..., ::-1])[1].tobytes()


class Gltf:
    """Gathers a glTF file."""

    def __init__(self) -> None:
        self.blob = b""
        self.tree: dict[str, Any] = {
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}], "nodes": [], "meshes": [],
            "accessors": [], "bufferViews": [], "materials": [], "images": [], "textures": [],
        }  # fmt: skip

    def view(self, content: bytes) -> int:
        self.blob += b"\0" * (-len(self.blob) % 4)
        self.tree["bufferViews"].append({"buffer": 0, "byteOffset": len(self.blob), "byteLength": len(content)})
        self.blob += content
        return len(self.tree["bufferViews"]) - 1

    def accessor(self, values: np.ndarray, shape: str, **more: Any) -> int:
        kind = {"f4": 5126, "u4": 5125, "u1": 5121, "u2": 5123}[values.dtype.str[1:]]
        entry = {"bufferView": self.view(values.tobytes()), "componentType": kind, "count": len(values), "type": shape}
        if shape == "VEC3" and kind == 5126:
            entry |= {"min": values.min(axis=0).tolist(), "max": values.max(axis=0).tolist()}
        self.tree["accessors"].append(entry | more)
        return len(self.tree["accessors"]) - 1

    def material(self, picture: np.ndarray | None = None, uri: str | None = None, **pbr: Any) -> int:
        if picture is not None or uri is not None:
            image = {"uri": uri} if uri else {"bufferView": self.view(png(picture)), "mimeType": "image/png"}
            self.tree["images"].append(image)
            self.tree["textures"].append({"source": len(self.tree["images"]) - 1})
            pbr["baseColorTexture"] = {"index": len(self.tree["textures"]) - 1}
        self.tree["materials"].append({"pbrMetallicRoughness": pbr})
        return len(self.tree["materials"]) - 1

    def mesh(
        self, vertex: np.ndarray, triangle: np.ndarray, material: int | None = None, uv: np.ndarray | None = None,
        colour: np.ndarray | None = None, extras: dict | None = None,
    ) -> int:  # fmt: skip
        attributes = {"POSITION": self.accessor(vertex.astype("<f4"), "VEC3")}
        if uv is not None:
            attributes["TEXCOORD_0"] = self.accessor(uv.astype("<f4"), "VEC2")
        if colour is not None:
            rgba = np.column_stack([colour, np.full(len(colour), 255)]).astype("u1")
            attributes["COLOR_0"] = self.accessor(rgba, "VEC4", normalized=True)
        primitive = {"attributes": attributes, "indices": self.accessor(triangle.reshape(-1).astype("<u4"), "SCALAR")}
        if material is not None:
            primitive["material"] = material
        self.tree["meshes"].append({"primitives": [primitive]} | ({"extras": extras} if extras else {}))
        return len(self.tree["meshes"]) - 1

    def node(self, parent: int | None = None, **fields: Any) -> int:
        self.tree["nodes"].append(fields)
        number = len(self.tree["nodes"]) - 1
        if parent is None:
            self.tree["scenes"][0]["nodes"].append(number)
        else:
            self.tree["nodes"][parent].setdefault("children", []).append(number)
        return number

    def _tree(self, **buffer: Any) -> bytes:
        tree = {key: value for key, value in self.tree.items() if value != []}
        return json.dumps(tree | {"buffers": [{"byteLength": len(self.blob)} | buffer]}).encode()

    def write(self, path: Path) -> Path:
        """Write ``.glb``, or ``.gltf`` with a ``.bin`` beside it."""
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.suffix == ".gltf":
            path.with_suffix(".bin").write_bytes(self.blob)
            path.write_bytes(self._tree(uri=path.with_suffix(".bin").name))
            return path
        text = self._tree()
        text += b" " * (-len(text) % 4)
        blob = self.blob + b"\0" * (-len(self.blob) % 4)
        chunks = struct.pack("<2I", len(text), 0x4E4F534A) + text + struct.pack("<2I", len(blob), 0x004E4942) + blob
        path.write_bytes(struct.pack("<4s2I", b"glTF", 2, 12 + len(chunks)) + chunks)
        return path


def boxes_glb(path: Path, boxes: Sequence[tuple[str, Box]], z_up: bool = False) -> Path:
    """Write boxes, each a named node, given with z up."""
    gltf = Gltf()
    for name, (low, high) in boxes:
        vertex, triangle = box_mesh(low, high)
        gltf.node(name=name, mesh=gltf.mesh(vertex if z_up else y_up(vertex), triangle))
    return gltf.write(path)


def write_ply(
    path: Path,
    vertex: np.ndarray,
    faces: Sequence[Sequence[int]],
    colour: np.ndarray | None = None,
    order: str = "binary_little_endian",
    **properties: np.ndarray,
) -> Path:
    """Write a PLY file with polygons and integer properties of them."""
    head = ["ply", f"format {order} 1.0", "comment made for a test", f"element vertex {len(vertex)}"]
    head += [f"property float {axis}" for axis in "xyz"]
    if colour is not None:
        head += [f"property uchar {name}" for name in ("red", "green", "blue")]
    head += [f"element face {len(faces)}", "property list uchar int vertex_indices"]
    head += [f"property int {name}" for name in properties]
    sign = {"binary_little_endian": "<", "binary_big_endian": ">", "ascii": ""}[order]
    rows: list[bytes] = []
    for k, place in enumerate(vertex):
        tint = [] if colour is None else [int(c) for c in colour[k]]
        if sign:
            rows.append(struct.pack(f"{sign}3f{len(tint)}B", *map(float, place), *tint))
        else:
            rows.append((" ".join(f"{v:.7g}" for v in place) + "".join(f" {c}" for c in tint) + "\n").encode())
    for k, corners in enumerate(faces):
        own = [int(values[k]) for values in properties.values()]
        if sign:
            rows.append(struct.pack(f"{sign}B{len(corners)}i{len(own)}i", len(corners), *map(int, corners), *own))
        else:
            rows.append((" ".join(map(str, [len(corners), *corners, *own])) + "\n").encode())
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes("\n".join([*head, "end_header", ""]).encode() + b"".join(rows))
    return path


def labelled_boxes(boxes: Sequence[Box]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return vertices, quads and the number of the box of each quad."""
    vertices, quads, owner = [], [], []
    sides = np.array([[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]])
    for number, (low, high) in enumerate(boxes):
        vertex, _ = box_mesh(low, high)
        quads.append(sides + 8 * number)
        vertices.append(vertex)
        owner.append(np.full(6, number))
    return np.concatenate(vertices), np.concatenate(quads), np.concatenate(owner)
