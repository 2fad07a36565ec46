"""What is not installed: extras and the other distributions of this project, each with the command that installs it."""

import shlex
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Literal
from urllib.parse import unquote, urlsplit

import msgspec


class _Source(msgspec.Struct):
    url: str = ""


def install_command(extra: str = "", *more: str, distribution: str = "avlmaps") -> str:
    """Return the command that installs a distribution, with an extra such as ``serve`` and ``more`` packages.

    It installs from the clone that avlmaps runs or was installed from, else by name.
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


What = Literal["verbs", "profiles", "backends", "robots", "sources"]


@dataclass(frozen=True, slots=True)
class Distribution:
    """A distribution beside ``avlmaps``, as pip knows it, and the names of what it brings (backends: ``kind:name``)."""

    name: str
    verbs: tuple[str, ...] = ()
    profiles: tuple[str, ...] = ()
    backends: tuple[str, ...] = ()
    robots: tuple[str, ...] = ()
    sources: tuple[str, ...] = ()


SIMULATOR = Distribution("avlmaps-sim", verbs=("demo", "record", "add-sounds", "bench"))
MODELS = Distribution(
    "avlmaps-models",
    verbs=("import-map",),
    profiles=("light", "foundation", "paper"),
    backends=(
        "pixels:light", "views:light", "sounds:light", "sounds:efficientat",
        "pixels:tipsv2", "pixels:clip-patches", "pixels:regions", "pixels:lseg",
        "views:siglip2", "views:clip", "views:clip-paper",
        "sounds:clap", "sounds:pe-a-frame", "sounds:audioclip",
        "local:disk", "local:aliked", "local:superpoint",
        "place:megaloc", "place:netvlad",
        "matcher:lightglue-disk", "matcher:lightglue-aliked", "matcher:superglue",
    ),
)  # fmt: skip
ROS = Distribution("avlmaps-ros", robots=("nav2", "move_base"), sources=("ros2",))
OTHERS = (SIMULATOR, MODELS, ROS)


def how_to_get(what: What, name: str) -> str | None:
    """Return the command that installs what brings a verb, a profile or a backend; None where no distribution does."""
    return next((install_command(distribution=one.name) for one in OTHERS if name in getattr(one, what)), None)
