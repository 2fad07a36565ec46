"""`avlmaps things`: list what a map holds."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from tyro.conf import Positional, arg

from avlmaps.cli.output import UsageError, emit, place, table_lines
from avlmaps.cli.verb import ModelVerb
from avlmaps.core.frames import FrameName
from avlmaps.core.progress import say

if TYPE_CHECKING:
    from collections.abc import Sequence

    from avlmaps.query.avlmap import AVLMap
    from avlmaps.query.schema import ContentsAnswer, RoomAnswer, SoundAnswer, ThingAnswer


@dataclass(frozen=True, kw_only=True)
class Things(ModelVerb):
    """List the things, sounds and rooms of a map, each with its confidence; of rooms the area as well.

    Example: avlmaps things home.avlmap --least 0.7 --csv things.csv
    """

    compiles: ClassVar[bool] = True

    map: Annotated[Positional[Path], arg(metavar="MAP")]
    """Map folder (NAME.avlmap)."""
    least: Annotated[float, arg(metavar="CONFIDENCE")] = 0.5
    """List things with at least this confidence, 0 to 1."""
    name: Annotated[tuple[str, ...], arg(metavar="NAME ...")] = ()
    """List these things only, such as: --name chair table."""
    structure: bool = False
    """List walls, floors and ceilings as well."""
    frame: Annotated[Literal["recording", "level"], arg(metavar="recording|level")] = "recording"
    """Frame of the positions: the recording's own, or the level one (z up)."""
    csv: Annotated[Path | None, arg(metavar="FILE")] = None
    """Write things and sounds to a CSV file as well."""

    def run(self) -> None:
        """List the map's contents."""
        answer = contents(self)
        emit(answer, contents_lines(answer), self.json)


def contents(verb: Things, opened: "AVLMap | None" = None) -> "ContentsAnswer":
    """List the things, sounds and rooms of a map.

    Args:
        verb: what to list.
        opened: the map, where it is open already.
    """
    from avlmaps.query.avlmap import AVLMap
    from avlmaps.query.export import write_table
    from avlmaps.query.frames import answer_in

    if not 0.0 <= verb.least <= 1.0:
        raise UsageError(f"--least takes a confidence from 0 to 1, not {verb.least:g}.")
    opened = AVLMap.open(verb.map) if opened is None else opened
    held = opened.contents(verb.least, verb.name or None, verb.structure)
    if verb.csv is not None:
        frame = FrameName(verb.frame)
        say(f"wrote {write_table(verb.csv, held.things, held.sounds, opened.space, frame, opened.storeys)}")
    return answer_in(held.to_json(str(verb.map)), FrameName(verb.frame), opened.space.level_from_recording)


def contents_lines(answer: "ContentsAnswer") -> list[str]:
    """Lay out what `things` reports: three tables with an empty line between them."""
    frame = answer["frame"]
    lines = [f"note: {note}" for note in answer.get("notes", [])] + thing_lines(answer["things"], frame)
    lines += ["", *sound_lines(answer["sounds"], frame)] if answer["sounds"] else []
    return [*lines, "", *room_lines(answer["rooms"], frame)] if answer["rooms"] else lines


def thing_lines(things: "list[ThingAnswer]", frame: str = FrameName.RECORDING) -> list[str]:
    """Lay out things as a table."""
    if not things:
        return ["no things with this confidence; lower --least to list less certain ones"]
    rows = [
        (t["name"], f"{t['confidence']:.2f}", place(t["position"]), " x ".join(f"{side:.2f}" for side in t["size"]))
        for t in things
    ]
    head = ("thing", "confidence", f"position ({frame} frame)", "size in m (level axes)")
    return _with_storeys(head, rows, [t.get("storey") for t in things])


def sound_lines(sounds: "list[SoundAnswer]", frame: str = FrameName.RECORDING) -> list[str]:
    """Lay out sounds as a table, in the order of their onset."""
    if not sounds:
        return ["no sounds"]
    rows = [
        (", ".join(f"{n} {c:.2f}" for n, c in zip(s["names"], s["confidences"], strict=True)) or "unnamed",
         f"{s['onset_s']:.1f} - {s['offset_s']:.1f} s", place(s["position"]))
        for s in sounds
    ]  # fmt: skip
    head = ("sound", "time", f"position of the robot ({frame} frame)")
    return _with_storeys(head, rows, [s.get("storey") for s in sounds])


def room_lines(rooms: "list[RoomAnswer]", frame: str = FrameName.RECORDING) -> list[str]:
    """Lay out rooms as a table, those with most views first."""
    if not rooms:
        return ["no rooms"]
    rows = [
        (
            r["name"],
            f"{r['probability']:.2f}",
            "" if r["area_m2"] is None else f"{r['area_m2']:.1f} m²",
            place(r["position"]),
            str(r["views"]),
            ", ".join(f"{other['name']} {other['probability']:.2f}" for other in r["names"][1:]),
        )
        for r in rooms
    ]
    head = ("room", "probability", "area", f"position ({frame} frame)", "views", "or")
    return _with_storeys(head, rows, [r.get("storey") for r in rooms])


def _with_storeys(head: "Sequence[str]", rows: "Sequence[Sequence[str]]", storeys: "Sequence[int | None]") -> list[str]:
    """Lay out a table; in a map of several storeys with that of each row, counted from 0, the lowest."""
    if None in storeys:
        return table_lines(head, rows)
    numbered = [(*row, str(storey)) for row, storey in zip(rows, storeys, strict=True)]
    return table_lines((*head, "storey"), numbered)
