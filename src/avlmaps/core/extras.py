"""The command that installs a group of further packages (an extra) for the avlmaps that runs here."""

import shlex
from functools import cache
from pathlib import Path
from urllib.parse import unquote, urlsplit

import msgspec


class _Source(msgspec.Struct):
    """Where pip had a package from."""

    url: str = ""


def install_command(extra: str = "", *more: str, distribution: str = "avlmaps") -> str:
    """Return the command that installs an extra: from the clone that avlmaps runs or was installed from, else by name.

    Args:
        extra: such as ``serve``; without one the distribution is installed alone.
        more: further packages.
        distribution: which of this project's (see ``distributions``).
    """
    clone = _clone()
    if clone is None:
        source = distribution
    else:
        within = "." if clone == Path.cwd() else str(clone)
        source = within if distribution == "avlmaps" else f"{within}/packages/{distribution}"
    what = f"'{source}[{extra}]'" if extra else shlex.quote(source)
    return " ".join(["pip install", what, *more])


@cache
def _clone() -> Path | None:
    """Return the folder of the project that this package came from; None where it came as a package."""
    from importlib.metadata import PackageNotFoundError, distribution  # slow to load, and errors alone need it

    beside = Path(__file__).resolve().parents[3]  # src/avlmaps/core/extras.py
    if _is_project(beside):
        return beside
    try:
        text = distribution("avlmaps").read_text("direct_url.json")  # pip writes it for what is no plain package
        url = urlsplit(msgspec.json.decode(text or "{}", type=_Source).url)
    except (PackageNotFoundError, msgspec.DecodeError, ValueError):
        return None
    folder = Path(unquote(url.path))
    return folder if url.scheme == "file" and _is_project(folder) else None


def _is_project(folder: Path) -> bool:
    try:
        return 'name = "avlmaps"' in (folder / "pyproject.toml").read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        return False
