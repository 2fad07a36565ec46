"""How fast queries are, beside the plain way of doing the same in the same run; both give the same numbers.

python benchmarks/queries.py [--voxels 300000] [--features 1000000] [--dim 512] [--json]
"""

import argparse
import json
import sys
import time
from collections.abc import Callable
from typing import TypeVar

import numpy as np

from avlmaps.maps.grid import GridSpec
from avlmaps.query.factors import anchor_heat, object_heat
from avlmaps.query.voxel_space import Space
from avlmaps.query.words import ClosestWords, feature_scores, margins

T = TypeVar("T")
UP = np.array([0.0, 0.0, 1.0])
VOXEL_SIZE_M = 0.05


def building(voxels: int, rng: np.random.Generator) -> np.ndarray:
    """Return the surfaces of a storey of rooms and boxes, cut to a number of voxels."""
    side = int(np.sqrt(voxels / 2.2))
    axis, height = np.arange(side), np.arange(50)
    pieces = [np.stack(np.meshgrid(axis, axis, [0], indexing="ij"), -1).reshape(-1, 3)]
    for wall in range(0, side, 80):
        along = np.stack(np.meshgrid([wall], axis, height, indexing="ij"), -1).reshape(-1, 3)
        pieces += [along, along[:, [1, 0, 2]]]
    while sum(map(len, pieces)) < 1.3 * voxels:
        size = rng.integers(6, 24, 3)
        box = np.stack(np.meshgrid(*map(np.arange, size), indexing="ij"), -1).reshape(-1, 3)
        shell = ((box == 0) | (box == size - 1)).any(axis=1)
        pieces.append(box[shell] + rng.integers(0, [side - 24, side - 24, 8]))
    index = np.unique(np.concatenate(pieces), axis=0).astype(np.int32)
    return index[np.sort(rng.choice(len(index), min(voxels, len(index)), replace=False))]


def best_ms(work: Callable[[], object], repeats: int = 25) -> float:
    """Return the least time of several, in milliseconds, after one call that compiles."""
    work()
    times = []
    for _ in range(repeats):
        begin = time.process_time()
        work()
        times.append(time.process_time() - begin)
    return 1e3 * min(times)


def once_ms(work: Callable[[], T]) -> tuple[float, T]:
    """Return the time of one call and its result."""
    begin = time.process_time()
    result = work()
    return 1e3 * (time.process_time() - begin), result


def brute_force_object(space: Space, mask: np.ndarray, falloff_per_m: float, rows: np.ndarray) -> np.ndarray:
    """Return the heat of some voxels by comparing each with every voxel of the object."""
    things, heat = space.centres[mask], np.empty(len(rows))
    for k in range(0, len(rows), 256):
        away = space.centres[rows[k : k + 256], None] - things[None]
        distance = np.sqrt(np.einsum("ijk,ijk->ij", away, away).min(axis=1))
        heat[k : k + 256] = np.maximum(1.0 - falloff_per_m * distance, 0.0)
    return heat


def brute_force_anchors(space: Space, anchors: np.ndarray, scores: np.ndarray, falloff_per_m: float) -> np.ndarray:
    """Return the heat by going through all anchors."""
    heat = np.zeros(len(space))
    for anchor, score in zip(anchors, scores, strict=True):
        distance = np.hypot(space.centres[:, 0] - anchor[0], space.centres[:, 1] - anchor[1])
        np.maximum(heat, score - falloff_per_m * distance, out=heat)
    return heat


def heat_rows(voxels: int, rng: np.random.Generator) -> list[tuple[str, float, float, float]]:
    """Time object and area heatmaps; rows of (what, ms, ms of brute force, largest difference)."""
    space = Space(GridSpec(VOXEL_SIZE_M), building(voxels, rng), UP)
    begin = time.process_time()
    assert len(space.blocks) and len(space.horizontal)
    rows = [(f"blocks of {len(space):,} voxels (once a map)", 1e3 * (time.process_time() - begin), np.nan, 0.0)]
    mask = np.zeros(len(space), bool)
    for centre in space.index[rng.integers(0, len(space), 12)]:
        mask |= np.abs(space.index - centre).max(axis=1) <= 10
    side = float(space.centres[:, 0].max())
    walk = np.cumsum(rng.normal(0.0, 0.25, (2000, 2)), axis=0)
    anchors = np.column_stack([np.abs((walk + side / 2) % (2 * side) - side), np.full(2000, 1.4)])
    scores = np.clip(0.35 + 0.25 * np.sin(np.arange(2000) / 60) + rng.normal(0, 0.05, 2000), 0.0, 1.0)
    some = rng.choice(len(space), 4096, replace=False)
    for role, falloff in (("primary", 2.0), ("context", 0.2)):
        ours = best_ms(lambda e=falloff: object_heat(space, mask, e))
        brute, expected = once_ms(lambda e=falloff: brute_force_object(space, mask, e, some))
        fault = float(np.abs(object_heat(space, mask, falloff)[0][some] - expected).max())
        what = f"object heat, {role}, {len(space):,} voxels, {int(mask.sum()):,} of the object"
        rows.append((what, ours, brute * len(space) / len(some), fault))
        ours = best_ms(lambda e=falloff: anchor_heat(space, anchors, scores, e))
        brute, expected = once_ms(lambda e=falloff: brute_force_anchors(space, anchors, scores, e))
        fault = float(np.abs(anchor_heat(space, anchors, scores, falloff)[0] - expected).max())
        rows.append((f"area heat, {role}, {len(space):,} voxels, 2,000 anchors", ours, brute, fault))
    return rows


class _Words:
    """Random unit vectors for any words."""

    def __init__(self, dim: int, rng: np.random.Generator) -> None:
        self.table = rng.standard_normal((101, dim)).astype(np.float32)
        self.table /= np.linalg.norm(self.table, axis=1, keepdims=True)

    def understood(self, word: str) -> str:
        return word

    def encode_words(self, words: list[str]) -> np.ndarray:
        return self.table[[int(word) if word.isdigit() else 100 for word in words]]


def text_rows(count: int, dim: int, rng: np.random.Generator) -> list[tuple[str, float, float, float]]:
    """Time a query by word over many features."""
    feature = np.empty((count, dim), np.float16)
    for k in range(0, count, 50_000):
        part = rng.standard_normal((min(50_000, count - k), dim), np.float32)
        feature[k : k + len(part)] = part / np.linalg.norm(part, axis=1, keepdims=True)
    encoder = _Words(dim, rng)
    asked = encoder.table[3:4]
    ours = best_ms(lambda: feature_scores(feature, asked))
    some = slice(0, min(count, 100_000))
    plain, expected = once_ms(lambda: feature[some] @ asked[0].astype(np.float16))
    wide = feature[some].astype(np.float32) @ asked[0]
    fault = float(np.abs(feature_scores(feature[some], asked) - wide).max())
    rows = [(f"one word over {count:,} x {dim} float16", ours, plain * count / len(expected), fault)]
    words = [str(k) for k in range(100)]
    ClosestWords.of(feature[:20_000], encoder, words)  # pyright: ignore[reportArgumentType]
    first, rivals = once_ms(lambda: ClosestWords.of(feature, encoder, words))  # pyright: ignore[reportArgumentType]
    rows.append(("the vocabulary of 100 words and other (once a session)", first, np.nan, 0.0))
    silent = np.arange(102) == 3
    closest = rivals.best, rivals.best_word, rivals.second, rivals.second_word

    def query() -> np.ndarray:
        return margins(feature_scores(feature, asked), closest, silent, -np.inf)[0]

    ours = best_ms(query)
    everything = np.stack([encoder.table[k] for k in range(101)], axis=1)
    plain, scores = once_ms(lambda: feature[some].astype(np.float32) @ everything)
    plain *= count / len(scores)
    expected = scores[:, 3] - np.delete(scores, 3, axis=1).max(axis=1)
    rows.append(
        (
            "one word against the vocabulary, every later time",
            ours,
            plain,
            float(np.abs(query()[some] - expected).max()),
        )
    )
    return rows


def main() -> None:
    """Print the table, or one JSON object."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--voxels", type=int, default=300_000)
    parser.add_argument("--features", type=int, default=1_000_000)
    parser.add_argument("--dim", type=int, default=512)
    parser.add_argument("--json", action="store_true")
    asked = parser.parse_args()
    rng = np.random.default_rng(0)
    rows = heat_rows(asked.voxels, rng) + text_rows(asked.features, asked.dim, rng)
    if asked.json:
        keys = ("what", "ms", "brute_force_ms", "largest_difference")
        json.dump([dict(zip(keys, row, strict=True)) for row in rows], sys.stdout)
        return
    print(f"{'':76} {'ms':>8} {'brute ms':>10} {'ratio':>8}  largest difference")
    for what, ours, brute, fault in rows:
        ratio = f"{brute / ours:8.0f}" if np.isfinite(brute) else " " * 8
        slow = f"{brute:10.0f}" if np.isfinite(brute) else " " * 10
        print(f"{what:76} {ours:8.1f} {slow} {ratio}  {fault:.1e}")


if __name__ == "__main__":
    main()
