"""Writes the student as the file that the package ships: the table in int8, one step size a row."""

from pathlib import Path

import numpy as np
from training.words.student import Student

MEGABYTES_AT_MOST = 8.0


def quantise(table: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the int8 table and its float16 step sizes, the largest number of each row at 127 steps."""
    scale = np.maximum(np.abs(table).max(axis=1) / 127, 1e-6).astype(np.float16)
    steps = np.round(table / scale.astype(np.float32)[:, None])
    return np.clip(steps, -127, 127).astype(np.int8), scale


def export(student: Student, entries: list[str], path: Path) -> float:
    """Write the weights and return the file's size in megabytes."""
    arrays = {name: value.detach().numpy() for name, value in student.state_dict().items()}
    table, scale = quantise(arrays["table.weight"])
    dim = table.shape[1]
    hidden = student.inner is not None
    np.savez_compressed(
        path,
        entries=np.frombuffer("\n".join(entries).encode("utf-8"), np.uint8),
        table=table,
        scale=scale,
        roles=arrays["roles"].astype(np.float32),
        inner=arrays["inner.weight"].T if hidden else np.zeros((dim, 0), np.float32),
        inner_bias=arrays["inner.bias"] if hidden else np.zeros(0, np.float32),
        outer=arrays["outer.weight"].T if hidden else np.zeros((0, dim), np.float32),
        outer_bias=arrays["outer.bias"] if hidden else np.zeros(dim, np.float32),
    )
    megabytes = path.stat().st_size / 1e6
    if megabytes > MEGABYTES_AT_MOST:
        raise SystemExit(f"{path} has {megabytes:.1f} MB, at most {MEGABYTES_AT_MOST} are allowed; use fewer entries.")
    return megabytes
