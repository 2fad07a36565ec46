"""The distributions of this project: what the others add to ``avlmaps``, and the command that installs them.

What is installed is found by entry points. This table is for errors alone: it names what is not installed.
"""

from dataclasses import dataclass
from typing import Literal

from avlmaps.core.extras import install_command

What = Literal["verbs", "profiles", "backends", "robots", "sources"]


@dataclass(frozen=True, slots=True)
class Distribution:
    """One distribution beside ``avlmaps``.

    Attributes:
        name: as pip knows it.
        verbs: of the command line.
        profiles: their names.
        backends: ``kind:name``.
        robots: what drives them.
        sources: of live maps.
    """

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
    for one in OTHERS:
        if name in getattr(one, what):
            return install_command(distribution=one.name)
    return None
