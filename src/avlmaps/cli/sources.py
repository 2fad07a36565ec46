"""`avlmaps sources`: where the sounds of a map came from."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Literal

from tyro.conf import arg

from avlmaps.cli.output import emit, require_share, table_lines
from avlmaps.cli.verb import MapVerb
from avlmaps.core.wording import place_text

if TYPE_CHECKING:
    from collections.abc import Mapping


@dataclass(frozen=True, kw_only=True)
class Sources(MapVerb):
    """List where the sounds of a map came from: a region with a probability, rooms and things that it may be.

    The recording must say where its microphones are (docs/guides/where-sounds-come-from.md). Sounds of one kind from
    one place are one source.

    Example: avlmaps sources home.avlmap --sound "dog bark"
    """

    sound: Annotated[tuple[str, ...], arg(metavar="NAME ...")] = ()
    """List the sources of these sounds. Default: of every sound, by its likeliest name."""
    prior: Literal["lexicon", "none"] = "lexicon"
    """lexicon: things that usually make such a sound are likelier sources; none: by what the microphones say alone."""
    least: Annotated[float, arg(metavar="CONFIDENCE")] = 0.0
    """List sounds whose name has at least this confidence, 0 to 1."""
    frame: Annotated[Literal["recording", "level"], arg(metavar="recording|level")] = "recording"
    """Frame of the positions: the recording's own, or the level one (z up)."""

    def run(self) -> None:
        """List the sources."""
        answer = list_sources(self)
        emit(answer, source_lines(answer), self.json)


def list_sources(verb: Sources) -> dict[str, Any]:
    """Return the sources of a map's sounds."""
    from avlmaps.core.poses import FRAME, FrameName
    from avlmaps.query.avlmap import AVLMap
    from avlmaps.query.places import answer_in

    require_share(verb.least, "confidence")
    opened = AVLMap.open(verb.map)
    found = opened.sources(verb.sound, prior=verb.prior == "lexicon", least=verb.least)
    listed = {"map": str(verb.map), "frame": FRAME, "sources": [one.to_json() for one in found]}
    return answer_in(listed, FrameName(verb.frame), opened.space.level_from_recording)


def source_lines(answer: "Mapping[str, Any]") -> list[str]:
    """Lay out sources as a table."""
    if not answer["sources"]:
        return ["no sounds"]
    rows = [
        (
            one["name"] or "unnamed", f"{one['confidence']:.2f}", f"{one['probability']:.2f}",
            place_text(one["position"]), f"{one['within_50_m']:.2f} m", f"{one['within_90_m']:.2f} m",
            ", ".join(f"{room['name']} {room['probability']:.2f}" for room in one["rooms"][:2]),
            ", ".join(f"{thing['name']} {thing['probability']:.2f}" for thing in one["things"]),
            str(len(one["sounds"])) + (", moving" if one["moving"] else ""),
        )
        for one in answer["sources"]
    ]  # fmt: skip
    head = ("sound", "confidence", "probability", f"position ({answer['frame']} frame)", "50 % within", "90 % within",
            "room", "thing", "sounds")  # fmt: skip
    return table_lines(head, rows)
