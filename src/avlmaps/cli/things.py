"""`avlmaps things`, `rooms` and `sources`: list what a map holds."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from tyro.conf import arg

from avlmaps.cli.output import Column, likely, size_text, table
from avlmaps.cli.verb import COUNT, SHARE, InFrame, MapVerb, shown_in
from avlmaps.core.progress import say

if TYPE_CHECKING:
    from avlmaps.query.avlmap import AVLMap
    from avlmaps.query.schema import ListedThing, RoomAnswer, SoundAnswer


_FRAME = "recording"


@dataclass(frozen=True, kw_only=True)
class Things(InFrame, MapVerb):
    """List the things, sounds and rooms of a map, each with its confidence; of rooms the area as well.

    With --room, --near, --at, --top or --page it lists things alone, each with its room.

    Example: avlmaps things home.avlmap --least 0.7 --csv things.csv

    Example: avlmaps things home.avlmap --room kitchen --name chair table

    Example: avlmaps things home.avlmap --near sofa --top 5
    """

    least: Annotated[float, SHARE, arg(metavar="CONFIDENCE")] = 0.5
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
    top: Annotated[int | None, COUNT, arg(metavar="N")] = None
    """Maximum number of things on a page. Default: all."""
    page: Annotated[int, COUNT, arg(metavar="N")] = 1
    """Page, counted from 1."""
    csv: Annotated[Path | None, arg(metavar="FILE")] = None
    """Write things and sounds to a CSV file as well."""

    def answer(self, avlmap: "AVLMap") -> dict[str, Any]:
        from avlmaps.query.export import write_table
        from avlmaps.query.selection import MapLists, Wanted, page_of_things

        wanted = Wanted(
            least=self.least, name=self.name, structure=self.structure, room=self.room, near=self._near(avlmap),
            top=self.top, page=self.page, at=self.at,
        )  # fmt: skip
        if wanted.is_whole:
            listed = avlmap.contents(self.least, self.name or None, self.structure).to_json(str(self.map))
        else:
            doubts = avlmap.doubts_of_things
            listed = {"map": str(self.map), "frame": _FRAME, **page_of_things(MapLists(avlmap), wanted)}
            notes = [*listed.get("notes", ()), *doubts]
            listed |= {"notes": notes} if notes else {}
        answer = shown_in(listed, self.frame, avlmap)
        if self.csv is not None:
            say(f"wrote {write_table(self.csv, answer['things'], answer.get('sounds', []), answer['frame'])}")
        return answer

    def _near(self, avlmap: "AVLMap") -> "str | list[float] | None":
        from avlmaps.query.places import is_place, place_of

        if self.near is None or not is_place(self.near):
            return self.near
        place = place_of(self.near)
        in_space = len(place) == 3 and self.frame == "level"
        return (avlmap.space.world(place) if in_space else place).tolist()

    def lines(self, answer: Mapping[str, Any]) -> list[str]:
        frame = answer["frame"]
        lines = [f"note: {note}" for note in answer.get("notes", [])] + thing_lines(answer["things"], frame)
        if "total" in answer:
            page, pages, total = (answer[key] for key in ("page", "pages", "total"))
            return [*lines, f"page {page} of {pages}, {total} things in all"] if pages > 1 else lines
        lines += ["", *sound_lines(answer["sounds"], frame)] if answer["sounds"] and not self.name else []
        return lines if self.name or not answer["rooms"] else [*lines, "", *room_lines(answer["rooms"], frame)]


@dataclass(frozen=True, kw_only=True)
class Rooms(InFrame, MapVerb):
    """List the rooms of a map: name, probability of the name, floor area and place of each.

    Example: avlmaps rooms home.avlmap --plot rooms.png
    """

    least: Annotated[float, SHARE, arg(metavar="PROBABILITY")] = 0.0
    """List rooms whose name has at least this probability, 0 to 1."""
    plot: Annotated[Path | None, arg(metavar="FILE")] = None
    """Draw a top-down view with the outline, name and area of each room into this picture."""

    def answer(self, avlmap: "AVLMap") -> dict[str, Any]:
        from avlmaps.query.plots import draw_map, save
        from avlmaps.query.selection import MapLists

        doubts, rooms = avlmap.data.info.doubts, MapLists(avlmap).rooms(self.least)
        listed = {"map": str(self.map), "frame": _FRAME, "rooms": rooms, **({"notes": list(doubts)} if doubts else {})}
        answer = shown_in(listed, self.frame, avlmap)
        if self.plot is not None:
            held = avlmap.rooms(self.least) if rooms else []
            answer["plot"] = str(save(draw_map(avlmap, rooms=held), self.plot))
        return answer

    def lines(self, answer: Mapping[str, Any]) -> list[str]:
        notes = [f"note: {note}" for note in answer.get("notes", [])]
        drawn = [f"wrote {answer['plot']}"] if "plot" in answer else []
        return [*notes, *room_lines(answer["rooms"], answer["frame"]), *drawn]


@dataclass(frozen=True, kw_only=True)
class Sources(InFrame, MapVerb):
    """List where the sounds of a map came from: a region with a probability, rooms and things that it may be.

    The recording must say where its microphones are (docs/guides/where-sounds-come-from.md). Sounds of one kind from
    one place are one source.

    Example: avlmaps sources home.avlmap --sound "dog bark"
    """

    sound: Annotated[tuple[str, ...], arg(metavar="NAME ...")] = ()
    """List the sources of these sounds. Default: of every sound, by its likeliest name."""
    prior: Literal["lexicon", "none"] = "lexicon"
    """lexicon: things that usually make such a sound are likelier sources; none: by what the microphones say alone."""
    least: Annotated[float, SHARE, arg(metavar="CONFIDENCE")] = 0.0
    """List sounds whose name has at least this confidence, 0 to 1."""

    def answer(self, avlmap: "AVLMap") -> dict[str, Any]:
        found = avlmap.sources(self.sound, prior=self.prior == "lexicon", least=self.least)
        listed = {"map": str(self.map), "frame": _FRAME, "sources": [one.to_json() for one in found]}
        return shown_in(listed, self.frame, avlmap)

    def lines(self, answer: Mapping[str, Any]) -> list[str]:
        if not answer["sources"]:
            return ["no sounds"]
        columns: dict[str, Column] = {
            "sound": lambda one: one["name"] or "unnamed",
            "confidence": "confidence",
            "probability": "probability",
            f"position ({answer['frame']} frame)": "position",
            "50 % within": lambda one: f"{one['within_50_m']:.2f} m",
            "90 % within": lambda one: f"{one['within_90_m']:.2f} m",
            "room": lambda one: likely(one["rooms"][:2]),
            "thing": lambda one: likely(one["things"]),
            "sounds": lambda one: f"{len(one['sounds'])}" + (", moving" if one["moving"] else ""),
        }
        return table(columns, answer["sources"])


def thing_lines(things: "Sequence[ListedThing]", frame: str = "recording") -> list[str]:
    """Lay out things as a table; with their rooms and distances where those are known."""
    if not things:
        return ["no things with this confidence; lower --least to list less certain ones"]
    columns: dict[str, Column] = {
        "thing": "name", "confidence": "confidence", f"position ({frame} frame)": "position",
        "size in m (level axes)": lambda thing: size_text(thing["size"]),
    }  # fmt: skip
    if "room" in things[0]:
        columns["room"] = "room"
    if any("heard" in thing for thing in things):
        columns["heard from it"] = lambda thing: likely(thing.get("heard", ()), "sound")
    if "distance_m" in things[0]:
        columns["distance"] = lambda thing: f"{thing['distance_m']:.2f} m"
    return table(columns | _storeys(things), things)


def sound_lines(sounds: "Sequence[SoundAnswer]", frame: str = "recording") -> list[str]:
    """Lay out sounds as a table, in the order of their onset."""
    columns: dict[str, Column] = {
        "sound": _names_of,
        "time": lambda sound: f"{max(sound['onset_s'], 0.0):.1f} - {sound['offset_s']:.1f} s",
        f"position of the robot ({frame} frame)": "position",
    }
    return table(columns | _storeys(sounds), sounds) if sounds else ["no sounds"]


def _names_of(sound: Mapping[str, Any]) -> str:
    named = zip(sound["names"], sound["confidences"], strict=True)
    return ", ".join(f"{name} {confidence:.2f}" for name, confidence in named) or "unnamed"


def room_lines(rooms: "Sequence[RoomAnswer]", frame: str = "recording") -> list[str]:
    """Lay out rooms as a table, those with most views first."""
    columns: dict[str, Column] = {
        "room": "room",
        "probability": "probability",
        "area": lambda room: f"{room['area_m2']:.1f} m²",
        f"position ({frame} frame)": "position",
        "views": "views",
        "or": lambda room: "" if "parts" in room else likely(room["names"][1:]),
    }
    return table(columns | _storeys(rooms), rooms) if rooms else ["no rooms"]


def _storeys(rows: Sequence[Mapping[str, Any]]) -> dict[str, Column]:
    return {"storey": "storey"} if all(row.get("storey") is not None for row in rows) else {}
