"""Which files a program may name. A program may come from a language model, so it reads nothing that nobody offered."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from avlmaps.core.errors import QueryError

MOST_BYTES = 200_000_000
_MOST_SHOWN = 100  # letters of a name in a sentence
# A word of a command that is a file: quoted, or without spaces; pictures and sounds both end in a suffix.
_QUOTED = re.compile(r"\"([^\"\n]+\.\w{2,5})\"|'([^'\n]+\.\w{2,5})'|“([^”\n]+\.\w{2,5})”")
_PLAIN = re.compile(r"[^\s\"'“”,;()]+\.\w{2,5}(?!\w)")


@dataclass(frozen=True, slots=True)
class Readable:
    """The files that a program may load: those in or below a root, and those that a person named, wherever they are.

    A relative name is sought in each root in turn.
    """

    roots: tuple[Path, ...] = field(default_factory=lambda: (Path.cwd(),))
    named: tuple[str, ...] = ()

    def find(self, name: str, what: str) -> Path:
        """Return the file of that name.

        Raises:
            QueryError: it is not there, not offered to the program, or far too large.
        """
        if not name.strip() or "\0" in name:
            raise QueryError(f"The {what} has no name; give the name of a file.")
        offered = name in self.named
        paths = [root / name for root in self.roots] or [Path(name)]
        inside = [path for path in paths if any(_is_within(path, root) for root in self.roots)]
        for path in paths if offered else inside:
            if (size := _size_of(path)) is not None and size > MOST_BYTES:
                raise QueryError(f"The {what} {path} has {size:,} bytes, more than {MOST_BYTES:,}; give a smaller one.")
            if size is not None:
                return path
        if offered or inside:
            raise QueryError(f"The {what} {_short(name)} is not there; check the name.")
        folders = ", ".join(str(root) for root in self.roots) or "every folder"
        raise QueryError(
            f"The {what} {_short(name)} may not be read by a program: it lies outside of {folders} and the command "
            "does not name it; name it in the command, word for word."
        )


def named_files(command: str) -> tuple[str, ...]:
    """Return the files that a command names, as it writes them."""
    quoted = [next(filter(None, groups)) for groups in _QUOTED.findall(command)]
    return tuple(dict.fromkeys([*quoted, *_PLAIN.findall(command)]))


def offered_by(command: str, roots: Sequence[Path] | None = None) -> Readable:
    """Return the files that a command's program may read: in the roots (or here), and those that the command names."""
    return Readable((Path.cwd(),) if roots is None else tuple(roots), named_files(command))


def _is_within(path: Path, root: Path) -> bool:
    try:
        return path.resolve().is_relative_to(root.resolve())
    except (OSError, ValueError, RuntimeError):  # a name too long or that no file can have, a loop of links
        return False


def _size_of(path: Path) -> int | None:
    try:
        return path.stat().st_size if path.is_file() else None
    except (OSError, ValueError):  # a name that is too long, or that no file can have
        return None


def _short(name: str) -> str:
    return name if len(name) <= _MOST_SHOWN else f"{name[:_MOST_SHOWN]}..."
