"""Ways to break a file or a folder; each takes a seeded generator, so that a case can be repeated by its number."""

import json
import os
import shutil
import socket
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
from seeds import files_of, is_text, numbers_of

Rng = np.random.Generator


def _one(rng: Rng, files: list[Path]) -> Path:
    return files[int(rng.integers(len(files)))]


def _texts(seed: Path) -> list[Path]:
    return [file for file in files_of(seed) if is_text(file)] or files_of(seed)


def flip(rng: Rng, seed: Path) -> str:
    file = _one(rng, files_of(seed))
    content = bytearray(file.read_bytes())
    for _ in range(int(rng.integers(1, 4))):
        content[int(rng.integers(len(content)))] ^= 1 << int(rng.integers(8))
    file.write_bytes(content)
    return f"flip {file.name}"


def flip_header(rng: Rng, seed: Path) -> str:
    file = _one(rng, files_of(seed))
    content = bytearray(file.read_bytes())
    content[int(rng.integers(min(len(content), 200)))] ^= 1 << int(rng.integers(8))
    file.write_bytes(content)
    return f"flip header {file.name}"


def truncate(rng: Rng, seed: Path) -> str:
    file = _one(rng, files_of(seed))
    os.truncate(file, int(rng.integers(file.stat().st_size)))
    return f"truncate {file.name}"


def empty(rng: Rng, seed: Path) -> str:
    file = _one(rng, files_of(seed))
    file.write_bytes(b"")
    return f"empty {file.name}"


def remove(rng: Rng, seed: Path) -> str:
    file = _one(rng, files_of(seed))
    file.unlink()
    return f"remove {file.name}"


def swap(rng: Rng, seed: Path) -> str:
    a, b = _one(rng, files_of(seed)), _one(rng, files_of(seed))
    first, second = a.read_bytes(), b.read_bytes()
    a.write_bytes(second)
    b.write_bytes(first)
    return f"swap {a.name} {b.name}"


def odd_number(rng: Rng, seed: Path) -> str:
    file = _one(rng, _texts(seed))
    lines = file.read_bytes().decode("utf-8", "replace").split("\n")
    at = int(rng.integers(len(lines)))
    comma = "," if "," in lines[at] else " "
    fields = lines[at].split(comma)
    fields[int(rng.integers(len(fields)))] = numbers_of(rng)
    lines[at] = comma.join(fields)
    file.write_text("\n".join(lines), errors="replace")
    return f"odd number {file.name}:{at + 1}"


def unit(rng: Rng, seed: Path) -> str:
    """Write a column of numbers in another unit."""
    file = _one(rng, _texts(seed))
    factor, column = float(rng.choice([1e-3, 1e3, 1e6, 1e9])), int(rng.integers(4))
    lines = file.read_bytes().decode("utf-8", "replace").split("\n")
    for at, line in enumerate(lines):
        comma = "," if "," in line else " "
        fields = line.split(comma)
        try:
            fields[column] = repr(float(fields[column]) * factor)
        except (IndexError, ValueError):
            continue
        lines[at] = comma.join(fields)
    file.write_text("\n".join(lines), errors="replace")
    return f"unit {factor:g} of column {column} of {file.name}"


def shuffle_lines(rng: Rng, seed: Path) -> str:
    file = _one(rng, _texts(seed))
    lines = file.read_bytes().split(b"\n")
    rng.shuffle(lines)
    file.write_bytes(b"\n".join(lines))
    return f"shuffle lines {file.name}"


def nested(rng: Rng, seed: Path) -> str:
    described = [file for file in files_of(seed) if file.suffix == ".json"]
    file = _one(rng, described or files_of(seed))
    depth = int(rng.choice([100, 1_000, 100_000]))
    file.write_bytes(b'{"camera":' * depth + b"1" + b"}" * depth)
    return f"nested {depth} {file.name}"


def odd_json(rng: Rng, seed: Path) -> str:
    described = [file for file in files_of(seed) if file.suffix == ".json"]
    if not described:
        return odd_number(rng, seed)
    file = _one(rng, described)
    content = json.loads(file.read_bytes())
    told = _change(rng, content)
    file.write_text(json.dumps(content))
    return f"json {file.name}: {told}"


def _change(rng: Rng, node: object) -> str:
    """Replace one value, at any depth."""
    odd = [None, -1, 0, 1e308, "word", [], {}, True, 10**12, -(2**63), float("nan"), "../../etc/passwd", "\x00"]
    keys = list(node) if isinstance(node, dict) else list(range(len(node))) if isinstance(node, list) else []
    if not keys:
        return "nothing"
    key = keys[int(rng.integers(len(keys)))]
    if isinstance(node[key], dict | list) and node[key] and rng.random() < 0.8:  # pyright: ignore
        return f"{key}.{_change(rng, node[key])}"  # pyright: ignore
    node[key] = odd[int(rng.integers(len(odd)))]  # pyright: ignore
    return f"{key} = {node[key]!r}"  # pyright: ignore


def huge_png(rng: Rng, seed: Path) -> str:
    """Make a picture's header promise 32000x32000, with the right checksum."""
    import zlib

    pictures = [file for file in files_of(seed) if file.suffix == ".png"]
    if not pictures:
        return huge_npy(rng, seed)
    file = _one(rng, pictures)
    content = bytearray(file.read_bytes())
    width, height = ((32_000, 32_000), (0, 5), (2**31, 2**31), (64, 1))[int(rng.integers(4))]
    content[16:24] = struct.pack(">II", width % 2**32, height % 2**32)
    content[29:33] = struct.pack(">I", zlib.crc32(content[12:29]))
    file.write_bytes(content)
    return f"header {width}x{height} {file.name}"


def huge_npy(rng: Rng, seed: Path) -> str:
    arrays = [file for file in files_of(seed) if file.suffix == ".npy"]
    file = _one(rng, arrays or files_of(seed))
    shape = ("(1000000000, 1000000000)", "(-1, 5)", "((((((((((((((((5))))))))))))))))", "()", "(0,)", "(5, 'a')")
    header = f"{{'descr': '<f4', 'fortran_order': False, 'shape': {shape[int(rng.integers(len(shape)))]}, }}"
    header = header.ljust(117) + "\n"
    file.write_bytes(b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header.encode() + bytes(40))
    return f"npy header {file.name}"


def other_kind(rng: Rng, seed: Path) -> str:
    """Put something in a file's place that is not a file of its size."""
    file = _one(rng, files_of(seed))
    kind = str(rng.choice(["pipe", "folder", "dangling", "loop", "zero", "sparse", "socket"]))
    if kind == "sparse":
        os.truncate(file, 20_000_000_000)
        return f"sparse {file.name}"
    file.unlink()
    if kind == "pipe":
        os.mkfifo(file)
    elif kind == "folder":
        file.mkdir()
    elif kind == "dangling":
        file.symlink_to("nowhere")
    elif kind == "loop":
        file.symlink_to(file.name)
    elif kind == "zero":
        file.symlink_to("/dev/zero")
    else:
        here = Path.cwd()
        os.chdir(file.parent)  # a socket's name is short
        try:
            with socket.socket(socket.AF_UNIX) as made:
                made.bind(file.name[:90])
        finally:
            os.chdir(here)
    return f"{kind} {file.name}"


def garbage(rng: Rng, seed: Path) -> str:
    file = _one(rng, files_of(seed))
    file.write_bytes(rng.bytes(int(rng.integers(1, 3000))))
    return f"garbage {file.name}"


def insert(rng: Rng, seed: Path) -> str:
    file = _one(rng, files_of(seed))
    content = file.read_bytes()
    at = int(rng.integers(len(content) + 1))
    file.write_bytes(content[:at] + rng.bytes(int(rng.integers(1, 9))) + content[at:])
    return f"insert {file.name}"


def far_pose(rng: Rng, seed: Path) -> str:
    """Move one pose far away."""
    files = [f for f in _texts(seed) if any(word in f.name for word in ("pose", "traj", "groundtruth"))]
    files += [f for f in _texts(seed) if f.parent.name == "pose"]
    file = _one(rng, files or _texts(seed))
    lines = file.read_text(errors="replace").split("\n")
    at = int(rng.integers(len(lines)))
    comma = "," if "," in lines[at] else " "
    fields = lines[at].split(comma)
    if len(fields) > 2:
        fields[3 if len(fields) in (4, 16) else 1] = str(float(rng.choice([50.0, 1e4, 1e6, -1e5])))
    lines[at] = comma.join(fields)
    file.write_text("\n".join(lines))
    return f"far pose {file.name}:{at + 1}"


MUTATORS: tuple[Callable[[Rng, Path], str], ...] = (
    flip, flip_header, truncate, empty, remove, swap, odd_number, unit, shuffle_lines, nested, odd_json, huge_png,
    huge_npy, other_kind, garbage, insert, far_pose,
)  # fmt: skip


def copied(seed: Path, folder: Path) -> Path:
    """Copy a seed, so that a case may break it."""
    target = folder / seed.name
    return Path(shutil.copytree(seed, target) if seed.is_dir() else shutil.copy(seed, target))
