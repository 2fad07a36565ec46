"""`avlmaps things`: list what a map holds."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from tyro.conf import arg

from avlmaps.cli.output import UsageError, emit, require_share, table_lines
from avlmaps.cli.verb import MapVerb
from avlmaps.core.frames import FrameName
from avlmaps.core.progress import say
from avlmaps.core.wording import place_text

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from avlmaps.query.avlmap import AVLMap
    from avlmaps.query.schema import ListedThing, RoomAnswer, SoundAnswer


@dataclass(frozen=True, kw_only=True)
class Things(MapVerb):
    """List the things, sounds and rooms of a map, each with its confidence; of rooms the area as well.

    With --room, --near, --at, --top or --page it lists things alone, each with its room.

    Example: avlmaps things home.avlmap --least 0.7 --csv things.csv

    Example: avlmaps things home.avlmap --room kitchen --name chair table

    Example: avlmaps things home.avlmap --near sofa --top 5
    """

    least: Annotated[float, arg(metavar="CONFIDENCE")] = 0.5
    """List things with at least this confidence, 0 to 1."""
    name: Annotated[tuple[str, ...], arg(metavar="NAME ...")] = ()
    """List these things only, such as: --name chair table."""
    structure: bool = False
    """List walls, floors and ceilings as well."""
    room: Annotated[str | None, arg(metavar="ROOM")] = None
    """List the things of this room, or of all rooms of a kind, as `avlmaps rooms` names them."""
    near: Annotated[str | None, arg(metavar="NAME|X,Y,Z")] = None
    """List the things nearest to a thing or to a place first: x,y,z in the frame of --frame, or level x,y."""
    at: Annotated[str | None, arg(metavar="DAY")] = None
    """Of a map of several days: list what was there on this day, a date such as 2026-11-24, or the number of a visit,
    from 1. What moved or went since is where it was."""
    top: Annotated[int | None, arg(metavar="N")] = None
    """Maximum number of things on a page. Default: all."""
    page: Annotated[int, arg(metavar="N")] = 1
    """Page, counted from 1."""
    frame: Annotated[Literal["recording", "level"], arg(metavar="recording|level")] = "recording"
    """Frame of the positions: the recording's own, or the level one (z up)."""
    csv: Annotated[Path | None, arg(metavar="FILE")] = None
    """Write things and sounds to a CSV file as well."""

    def run(self) -> None:
        """List the map's contents."""
        answer = contents(self)
        emit(answer, contents_lines(answer), self.json)


def contents(verb: Things, opened: "AVLMap | None" = None) -> dict[str, Any]:
    """List the things, sounds and rooms of a map, or a page of some of its things."""
    from avlmaps.core.poses import FRAME
    from avlmaps.query.avlmap import AVLMap
    from avlmaps.query.export import write_table
    from avlmaps.query.frames import answer_in
    from avlmaps.query.selection import MapLists, Wanted, page_of_things

    require_share(verb.least, "confidence")
    if min(verb.page, 1 if verb.top is None else verb.top) < 1:
        raise UsageError("--top and --page take a number from 1 on.")
    opened = AVLMap.open(verb.map) if opened is None else opened
    wanted = Wanted(
        least=verb.least, name=verb.name, structure=verb.structure, room=verb.room, near=_near(verb, opened),
        top=verb.top, page=verb.page, at=verb.at,
    )  # fmt: skip
    if wanted.is_whole:
        listed: Mapping[str, Any] = opened.contents(verb.least, verb.name or None, verb.structure).to_json(
            str(verb.map)
        )
    else:
        doubts = opened.doubts_of_things
        listed = {"map": str(verb.map), "frame": FRAME, **page_of_things(MapLists(opened), wanted)}
        listed |= {"notes": list(doubts)} if doubts else {}
    answer = answer_in(listed, FrameName(verb.frame), opened.space.level_from_recording)
    if verb.csv is not None:
        say(f"wrote {write_table(verb.csv, answer['things'], answer.get('sounds', []), answer['frame'])}")
    return answer


def _near(verb: Things, opened: "AVLMap") -> "str | list[float] | None":
    """Return what things are to be near to; a place in space in the recording's frame."""
    from avlmaps.query.given_places import is_place, place_of

    if verb.near is None or not is_place(verb.near):
        return verb.near
    place = place_of(verb.near)
    in_space = len(place) == 3 and verb.frame == FrameName.LEVEL
    return (opened.space.world(place) if in_space else place).tolist()


def contents_lines(answer: "Mapping[str, Any]") -> list[str]:
    """Lay out what `things` reports: three tables with an empty line between them, or a page of things."""
    frame = answer["frame"]
    lines = [f"note: {note}" for note in answer.get("notes", [])] + thing_lines(answer["things"], frame)
    if "total" in answer:
        page, pages, total = (answer[key] for key in ("page", "pages", "total"))
        return [*lines, f"page {page} of {pages}, {total} things in all"] if pages > 1 else lines
    lines += ["", *sound_lines(answer["sounds"], frame)] if answer["sounds"] else []
    return [*lines, "", *room_lines(answer["rooms"], frame)] if answer["rooms"] else lines


def thing_lines(things: "Sequence[ListedThing]", frame: str = FrameName.RECORDING) -> list[str]:
    """Lay out things as a table; with their rooms and distances where those are known."""
    if not things:
        return ["no things with this confidence; lower --least to list less certain ones"]
    rows = [
        (t["name"], f"{t['confidence']:.2f}", place_text(t["position"]), " x ".join(f"{s:.2f}" for s in t["size"]))
        for t in things
    ]
    head = ("thing", "confidence", f"position ({frame} frame)", "size in m (level axes)")
    if "room" in things[0]:
        head, rows = (*head, "room"), [(*row, t.get("room") or "") for row, t in zip(rows, things, strict=True)]
    if any("heard" in thing for thing in things):
        said = [", ".join(f"{h['sound']} {h['probability']:.2f}" for h in t.get("heard", ())) for t in things]
        head, rows = (*head, "heard from it"), [(*row, one) for row, one in zip(rows, said, strict=True)]
    if "distance_m" in things[0]:
        head = (*head, "distance")
        rows = [(*row, f"{t.get('distance_m', 0.0):.2f} m") for row, t in zip(rows, things, strict=True)]
    return _with_storeys(head, rows, [t.get("storey") for t in things])


def sound_lines(sounds: "list[SoundAnswer]", frame: str = FrameName.RECORDING) -> list[str]:
    """Lay out sounds as a table, in the order of their onset."""
    if not sounds:
        return ["no sounds"]
    rows = [
        (", ".join(f"{n} {c:.2f}" for n, c in zip(s["names"], s["confidences"], strict=True)) or "unnamed",
         f"{s['onset_s']:.1f} - {s['offset_s']:.1f} s", place_text(s["position"]))
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
            r["room"],
            f"{r['probability']:.2f}",
            "" if r["area_m2"] is None else f"{r['area_m2']:.1f} m²",
            place_text(r["position"]),
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
