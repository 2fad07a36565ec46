"""The fingerprint of a recording: the content of its files, read whole where small and in samples where large.

A file is read whole up to a budget, else in evenly spread blocks that add up to it, its end among them. The budget of a
file is a share of ``RECORDING_BUDGET_BYTES``: a recording of 2,000 pictures is read wholly but for pictures over 0.5
MB, one of two million in 4 KB of each. The end of a PNG holds a checksum of all its pixels, so that a changed depth
picture is always another one. Of JPEG, NPY and bags larger than the budget, a change between the sampled blocks that
preserves the size is not seen. Times of change make no difference, so that a copy is the same recording.
"""

import hashlib
import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from avlmaps.core.files import sampled_digest

RECORDING_BUDGET_BYTES = 1 << 30
LEAST_BUDGET_BYTES = 4096
LARGEST_BUDGET_BYTES = 1 << 24


def budget_bytes(files: int) -> int:
    """Return how much of each of a recording's files is read."""
    return min(max(RECORDING_BUDGET_BYTES // max(files, 1), LEAST_BUDGET_BYTES), LARGEST_BUDGET_BYTES)


def add_files(digest: Any, folder: Path, names: Sequence[str]) -> None:
    """Add names and contents of files below a folder to a hash of ``hashlib``."""
    budget, prefix = budget_bytes(len(names)), f"{folder}{os.sep}"  # joining a million paths the long way takes seconds
    for name in names:
        digest.update(f"{name}\0".encode(errors="surrogateescape"))
        digest.update(sampled_digest(prefix + name, budget))


def stamp_of(folder: Path, names: Sequence[str], files: Iterable[Path]) -> str:
    """Return a hash over sizes and times of change of files, without opening them."""
    digest, prefix = hashlib.sha256(), f"{folder}{os.sep}"
    for path in (*(prefix + name for name in names), *map(str, files)):
        try:
            found = os.stat(path)  # noqa: PTH116
            digest.update(f"{found.st_size} {found.st_mtime_ns} {found.st_ino}\n".encode())
        except OSError:
            digest.update(b"missing\n")
    return digest.hexdigest()
