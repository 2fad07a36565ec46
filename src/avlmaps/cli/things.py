"""`avlmaps things`: list what a map holds."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar

from tyro.conf import Positional, arg

from avlmaps.cli.output import UsageError, emit, place, table_lines
from avlmaps.cli.verb import ModelVerb
from avlmaps.core.progress import say


@dataclass(frozen=True, kw_only=True)
class Things(ModelVerb):
    """List the things, sounds and rooms of a map, each with its confidence.

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
    csv: Annotated[Path | None, arg(metavar="FILE")] = None
    """Write things and sounds to a CSV file as well."""

    def run(self) -> None:
        """List the map's contents."""
        answer = _contents(self)
        emit(answer, _lines(answer), self.json)


def _contents(verb: Things) -> dict[str, Any]:
    from avlmaps.query.avlmap import AVLMap
    from avlmaps.query.export import write_table

    if not 0.0 <= verb.least <= 1.0:
        raise UsageError(f"--least takes a confidence from 0 to 1, not {verb.least:g}.")
    opened = AVLMap.open(verb.map)
    models = opened.stored.info.models
    things = opened.things(verb.name or None, verb.least, verb.structure) if "pixels" in models else []
    sounds, rooms = opened.sounds(), opened.rooms() if "views" in models else []
    if verb.csv is not None:
        say(f"wrote {write_table(verb.csv, things, sounds)}")
    return {
        "map": str(verb.map),
        "frame": "recording",
        "things": [thing.to_json() for thing in things],
        "sounds": [sound.to_json() for sound in sounds],
        "rooms": [room.to_json() for room in rooms],
    }


def _lines(answer: dict[str, Any]) -> list[str]:
    lines: list[str] = []
    if answer["things"]:
        rows = [
            (t["name"], f"{t['confidence']:.2f}", place(t["position"]), " x ".join(f"{side:.2f}" for side in t["size"]))
            for t in answer["things"]
        ]
        lines += table_lines(("thing", "confidence", "position", "size in m"), rows)
    else:
        lines.append("no things with this confidence; lower --least to list less certain ones")
    if answer["sounds"]:
        rows = [
            (", ".join(f"{n} {c:.2f}" for n, c in zip(s["names"], s["confidences"], strict=True)) or "unnamed",
             f"{s['onset_s']:.1f} - {s['offset_s']:.1f} s", place(s["position"]))
            for s in answer["sounds"]
        ]  # fmt: skip
        lines += ["", *table_lines(("sound", "time", "position of the robot"), rows)]
    if answer["rooms"]:
        rows = [(r["name"], f"{r['confidence']:.2f}", place(r["position"]), str(r["views"])) for r in answer["rooms"]]
        lines += ["", *table_lines(("room", "confidence", "position", "views"), rows)]
    return lines
