"""`avlmaps rooms`: list the rooms of a map."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from tyro.conf import arg

from avlmaps.cli.output import emit, require_share
from avlmaps.cli.things import room_lines
from avlmaps.cli.verb import MapVerb
from avlmaps.core.frames import FrameName

if TYPE_CHECKING:
    from avlmaps.query.avlmap import AVLMap


@dataclass(frozen=True, kw_only=True)
class Rooms(MapVerb):
    """List the rooms of a map: name, probability of the name, floor area and place of each.

    Example: avlmaps rooms home.avlmap --plot rooms.png
    """

    least: Annotated[float, arg(metavar="PROBABILITY")] = 0.0
    """List rooms whose name has at least this probability, 0 to 1."""
    frame: Annotated[Literal["recording", "level"], arg(metavar="recording|level")] = "recording"
    """Frame of the positions: the recording's own, or the level one (z up)."""
    plot: Annotated[Path | None, arg(metavar="FILE")] = None
    """Draw a top-down view with the outline, name and area of each room into this picture."""

    def run(self) -> None:
        """List the rooms."""
        answer = rooms(self)
        emit(answer, rooms_lines(answer), self.json)


def rooms(verb: Rooms, opened: "AVLMap | None" = None) -> dict[str, Any]:
    """List the rooms of a map."""
    from avlmaps.core.poses import FRAME
    from avlmaps.query.avlmap import AVLMap
    from avlmaps.query.frames import answer_in
    from avlmaps.query.selection import MapLists

    require_share(verb.least, "probability")
    opened = AVLMap.open(verb.map) if opened is None else opened
    listed: dict[str, Any] = {"map": str(verb.map), "frame": FRAME, "rooms": MapLists(opened).rooms(verb.least)}
    if doubts := opened.stored.info.doubts:
        listed["notes"] = list(doubts)
    answer = answer_in(listed, FrameName(verb.frame), opened.space.level_from_recording)
    if verb.plot is not None:
        from avlmaps.query.plots import plot_map

        held = opened.rooms(verb.least) if listed["rooms"] else []
        answer["plot"] = str(plot_map(opened.stored, verb.plot, rooms=held))
    return answer


def rooms_lines(answer: dict[str, Any]) -> list[str]:
    """Lay out what `rooms` reports."""
    notes = [f"note: {note}" for note in answer.get("notes", [])]
    drawn = [f"wrote {answer['plot']}"] if "plot" in answer else []
    return [*notes, *room_lines(answer["rooms"], answer["frame"]), *drawn]
