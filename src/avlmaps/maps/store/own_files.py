"""Which files in a map's folder avlmaps wrote: only these are ever removed.

People have folders called ``sounds`` and ``parts`` of their own, and choose the folder above them for a map.
"""

import re
import shutil
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

# What write_array and write_copy name a file: its name, sixteen digits of its checksum, its suffix.
_STORED = re.compile(r"[A-Za-z0-9_]+-[0-9a-f]{16}(\.[^./]+)?|\..+\.\d+\.partial")
# What a build names the folder of a stage: the stage and twelve digits of its key; clips wait for their stage.
_STAGE = re.compile(r"[a-z_]+-[0-9a-f]{12}|clips|clips\.unfinished")


def is_stored_file(path: Path) -> bool:
    """Return whether a file of a section has a name that avlmaps gives."""
    return _STORED.fullmatch(path.name) is not None and path.is_file()


def stage_folders(parts: Path) -> Iterator[Path]:
    """Yield the folders of stages that a build stores below ``parts/``; none where that is a link or is not there."""
    if parts.is_dir() and not parts.is_symlink():
        yield from (entry for entry in parts.iterdir() if _STAGE.fullmatch(entry.name) and entry.is_dir())


def remove_stages(parts: Path) -> None:
    """Remove what a build stored below ``parts/``, and that folder if nothing else is in it."""
    for folder in list(stage_folders(parts)):
        shutil.rmtree(folder, ignore_errors=True)
    with suppress(OSError):
        parts.rmdir()
