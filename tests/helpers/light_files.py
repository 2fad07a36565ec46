"""Files of the profile ``light`` with networks of a few numbers, written by hand: no onnx, no torch, no checkpoint.

A patch's feature is a product of its pixels, a text's the mean over its letters' rows, a sound's the mean of its mel
bands; each of unit length. That is enough to hold all round the networks to what it promises.
"""

import gzip
from pathlib import Path

import msgspec
import numpy as np

from avlmaps.core.files import sha256_of_file
from avlmaps_models.light import bundle as files
from avlmaps_models.light.tokens import TokenList

DIM, PATCH, BANDS = 8, 14, 8
KNOWN = ("chair", "sofa", "other", "office chair")
ROOMS = ("kitchen", "office")
HEARD = ("dog", "silence")
_FLOAT, _INT64 = 1, 7
LETTERS = ["<unk>", "<s>", "</s>", "▁", *"abcdefghijklmnopqrstuvwxyz.'"]

Attributes = dict[str, int | list[int]]


def write_light(folder: Path, seed: int = 0) -> Path:
    """Write the files into ``folder/avlmaps/light-1`` and return that folder."""
    out = folder / files.MODEL
    out.mkdir(parents=True)
    rng = np.random.default_rng(seed)
    (out / files.PICTURES).write_bytes(_pictures(rng))
    table = rng.standard_normal((len(LETTERS), DIM)).astype(np.float32)
    for name in (files.PICTURE_WORDS, files.SOUND_WORDS):
        (out / name).write_bytes(_texts(table))
    (out / files.SOUNDS).write_bytes(_sounds())
    words = TokenList("words", LETTERS, [], unknown=0)
    (out / files.PICTURE_TOKENS).write_bytes(gzip.compress(msgspec.json.encode(words)))
    pieces = TokenList("bytes", [*LETTERS, "Ġ", "T"], [], start=1, end=2, unknown=0)
    (out / files.SOUND_TOKENS).write_bytes(gzip.compress(msgspec.json.encode(pieces)))
    tables = {"pixels": KNOWN, "views": ROOMS, "sounds": HEARD}
    arrays: dict[str, np.ndarray] = {}
    for name, phrases in tables.items():
        rows = rng.standard_normal((len(phrases), DIM))
        arrays[f"{name}_names"] = np.frombuffer("\n".join(phrases).encode(), np.uint8)
        arrays[f"{name}_rows"] = np.round(127.0 * rows / np.abs(rows).max(axis=1, keepdims=True)).astype(np.int8)
    np.savez(out / files.KNOWN_WORDS, **arrays)  # pyright: ignore[reportArgumentType]
    write_manifest(out)
    return out


def write_manifest(out: Path) -> None:
    """Write a manifest of the files as they are."""
    notes = {name: files.FileNote((out / name).stat().st_size, sha256_of_file(out / name)) for name in files.FILES}
    pictures = files.PictureNote(
        source="made/by-hand", revision="", source_sha256="0" * 64, licence="MIT", dim=DIM, patch=PATCH, grid=4,
        short_side=56, logit_scale=100.0, prompts=("a {}.", "the {}."), view_prompts=("in a {}.",), most_tokens=64,
    )  # fmt: skip
    mel = files.MelNote(rate_hz=8000, window=16_000, fft=256, hop=160, bands=BANDS, lowest_hz=50.0, highest_hz=3800.0)
    sounds = files.SoundNote(
        source="made/by-hand", revision="", source_sha256="0" * 64, licence="MIT", dim=DIM, logit_scale=20.0,
        prompts=("the sound of {}",), most_tokens=77, mel=mel,
    )  # fmt: skip
    made = files.Manifest(files.FORMAT, files.MODEL, notes, pictures, sounds)
    (out / files.MANIFEST).write_bytes(msgspec.json.encode(made))


def _pictures(rng: np.random.Generator) -> bytes:
    kernel = rng.standard_normal((DIM, 3, PATCH, PATCH)).astype(np.float32)
    nodes = [
        _node("Conv", ["pixels", "kernel"], "grid", strides=[PATCH, PATCH], kernel_shape=[PATCH, PATCH]),
        _node("Reshape", ["grid", "flat"], "columns_of"),
        _node("Transpose", ["columns_of"], "rows_of", perm=[1, 0]),
        _node("LpNormalization", ["rows_of"], "patches", axis=1, p=2),
        _node("ReduceMean", ["rows_of"], "mean", axes=[0], keepdims=1),
        _node("LpNormalization", ["mean"], "mean_unit", axis=1, p=2),
        _node("Reshape", ["mean_unit", "all"], "view"),
    ]
    constants = {"kernel": kernel, "flat": np.array([DIM, -1]), "all": np.array([-1])}
    inputs = {"pixels": (_FLOAT, 4), "rows": (_FLOAT, 2), "columns": (_FLOAT, 2)}
    return _model(nodes, constants, inputs, {"patches": (_FLOAT, 2), "view": (_FLOAT, 1)})


def _texts(table: np.ndarray) -> bytes:
    table = np.concatenate([table, table[:2]])  # of the two tokens more that sounds have
    nodes = [
        _node("Gather", ["table", "ids"], "found", axis=0),
        _node("ReduceMean", ["found"], "mean", axes=[1], keepdims=0),
        _node("LpNormalization", ["mean"], "unit", axis=1, p=2),
        _node("Reshape", ["unit", "all"], "feature"),
    ]
    return _model(nodes, {"table": table, "all": np.array([-1])}, {"ids": (_INT64, 2)}, {"feature": (_FLOAT, 1)})


def _sounds() -> bytes:
    nodes = [
        _node("ReduceMean", ["mels"], "mean", axes=[0, 1, 2], keepdims=0),
        _node("Reshape", ["mean", "row"], "bands"),
        _node("LpNormalization", ["bands"], "unit", axis=1, p=2),
        _node("Reshape", ["unit", "all"], "feature"),
    ]
    constants = {"row": np.array([1, -1]), "all": np.array([-1])}
    return _model(nodes, constants, {"mels": (_FLOAT, 4)}, {"feature": (_FLOAT, 1)})


def _model(
    nodes: list[bytes],
    constants: dict[str, np.ndarray],
    inputs: dict[str, tuple[int, int]],
    outputs: dict[str, tuple[int, int]],
) -> bytes:
    """Return a network in ONNX's format (onnx.proto), a message of protobuf."""
    graph = b"".join(_field(1, node) for node in nodes) + _field(2, b"by hand")
    graph += b"".join(_field(5, _tensor(name, values)) for name, values in constants.items())
    graph += b"".join(_field(11, _value(name, *sort)) for name, sort in inputs.items())
    graph += b"".join(_field(12, _value(name, *sort)) for name, sort in outputs.items())
    return _field(1, 8) + _field(7, graph) + _field(8, _field(1, b"") + _field(2, 13))


def _node(kind: str, inputs: list[str], output: str, **settings: int | list[int]) -> bytes:
    said = b"".join(_field(1, name.encode()) for name in inputs) + _field(2, output.encode())
    said += _field(3, output.encode()) + _field(4, kind.encode())
    return said + b"".join(_field(5, _attribute(name, value)) for name, value in settings.items())


def _attribute(name: str, value: int | list[int]) -> bytes:
    if isinstance(value, int):
        return _field(1, name.encode()) + _field(3, value) + _field(20, 2)
    return _field(1, name.encode()) + b"".join(_field(8, one) for one in value) + _field(20, 7)


def _tensor(name: str, values: np.ndarray) -> bytes:
    whole = values.dtype.kind == "i"
    raw = values.astype("<i8" if whole else "<f4").tobytes()
    said = b"".join(_field(1, size) for size in values.shape) + _field(2, _INT64 if whole else _FLOAT)
    return said + _field(8, name.encode()) + _field(9, raw)


def _value(name: str, kind: int, axes: int) -> bytes:
    shape = b"".join(_field(1, _field(2, f"{name}_{axis}".encode())) for axis in range(axes))
    return _field(1, name.encode()) + _field(2, _field(1, _field(1, kind) + _field(2, shape)))


def _field(number: int, value: int | bytes) -> bytes:
    if isinstance(value, int):
        return _varint(number << 3) + _varint(value)
    return _varint(number << 3 | 2) + _varint(len(value)) + value


def _varint(value: int) -> bytes:
    value &= (1 << 64) - 1
    out = bytearray()
    while value > 127:
        out.append(value & 127 | 128)
        value >>= 7
    return bytes([*out, value])
