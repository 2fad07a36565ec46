"""SHA-256 of a model's weights, remembered: gigabytes are read once, not at each start."""

import hashlib
import json
from collections.abc import Sequence
from pathlib import Path

from avlmaps.core.files import sha256_of_file, write_bytes_atomically
from avlmaps.perception.models import user_folder

_KEPT = "checksums.json"


def checksum_of(files: Sequence[Path], *constants: str) -> str:
    """Return the hex SHA-256 of some files' contents and of constants that matter as much (sizes, prompts).

    A file's own sum is stored in the user's folder with its size and time, and taken from there while they stay.

    Args:
        files: the weights; their order and names do not matter.
        constants: what else the features depend on.
    """
    sums = sorted(remembered_sha256(path) for path in files)
    return hashlib.sha256("\n".join([*sums, *constants]).encode()).hexdigest()


def weights_in(folder: Path) -> list[Path]:
    """Return the files of weights in a model's folder (safetensors where there are any)."""
    for pattern in ("*.safetensors", "*.bin", "*.pt", "*.pth", "*.ckpt"):
        if found := sorted(folder.glob(pattern)):
            return found
    return []


def remembered_sha256(path: Path) -> str:
    """Return the hex SHA-256 of a file, read again only where its size or time has changed."""
    path = path.resolve()
    state = path.stat()
    stamp = [state.st_size, state.st_mtime_ns]
    kept_in = user_folder() / _KEPT
    kept = _read(kept_in)
    entry = kept.get(str(path))
    if isinstance(entry, list) and entry[:2] == stamp:
        return str(entry[2])
    found = sha256_of_file(path)
    _remember(kept_in, {**kept, str(path): [*stamp, found]})
    return found


def _read(path: Path) -> dict[str, object]:
    try:
        kept = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return kept if isinstance(kept, dict) else {}


def _remember(path: Path, kept: dict[str, object]) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_bytes_atomically(path, json.dumps(kept).encode())
    except OSError:
        return  # it is read again next time, that is all
