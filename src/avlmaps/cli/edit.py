"""`avlmaps edit`, `merge` and `changes`: a person corrects a map, another day becomes part of it, what changed."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from tyro.conf import Positional, arg

from avlmaps.cli.output import Column, UsageError, emit, table
from avlmaps.cli.verb import MapVerb, ModelVerb, OptionalText

if TYPE_CHECKING:
    from avlmaps.maps.store.edits import Edit as EditMade
    from avlmaps.query.avlmap import AVLMap
    from avlmaps.query.editor import Editor
    from avlmaps.query.schema import EditsAnswer


@dataclass(frozen=True, kw_only=True)
class Edit(MapVerb):
    """Correct a map: name things, rooms and places, merge and split things, forbid areas, undo.

    Edits are a list beside the map. They hold for every question, list and path, and survive another build of the map,
    another day and corrected poses. Without an option the edits are listed.

    Example: avlmaps edit home.avlmap --rename chair --to stool --at 1.2,3.4

    Example: avlmaps edit home.avlmap --rename-room "bedroom 2" --to studio

    Example: avlmaps edit home.avlmap --pin "my charging dock" --at 0.5,2.0

    Example: avlmaps edit home.avlmap --forbid "the stairs" --box 1.0,2.0,2.5,4.0
    """

    list: bool = False
    """List all edits with their day and who made them, and which find nothing to apply to any more."""
    rename: Annotated[OptionalText, arg(metavar="NAME")] = None
    """Give the thing of this name another one, which --to says; "thing" is what lies at --at."""
    rename_room: Annotated[OptionalText, arg(metavar="ROOM|X,Y")] = None
    """Give a room another name, which --to says: as `avlmaps rooms` calls it, or a place in it."""
    merge: Annotated[tuple[str, ...], arg(metavar="X,Y[,Z] ...")] = ()
    """Make one thing of those at these places, perhaps called --to."""
    split: Annotated[OptionalText, arg(metavar="NAME")] = None
    """Take the thing of this name apart: by --plane, by --box, else by its connected pieces."""
    forbid: Annotated[OptionalText, arg(metavar="NAME")] = None
    """Forbid an area to robots, under this name: --box, or --room."""
    pin: Annotated[OptionalText, arg(metavar="NAME")] = None
    """Give the place --at a name of your own; the same name again moves it."""
    undo: Annotated[OptionalText, arg(metavar="ID")] = None
    """Undo the edit of this id, or the last one: --undo last."""
    to: Annotated[OptionalText, arg(metavar="NAME")] = None
    """New name."""
    at: Annotated[OptionalText, arg(metavar="X,Y[,Z]")] = None
    """Place of the thing: x,y,z in metres of the recording frame, or level x,y."""
    room: Annotated[OptionalText, arg(metavar="ROOM|X,Y")] = None
    """Room of --forbid."""
    box: Annotated[OptionalText, arg(metavar="X0,Y0,X1,Y1")] = None
    """Box of --forbid or --split: level x and y of two opposite corners, metres."""
    plane: Annotated[tuple[str, ...], arg(metavar="X,Y X,Y")] = ()
    """Two places on the upright plane of --split."""
    by: Annotated[OptionalText, arg(metavar="NAME")] = None
    """Who makes the edit."""

    def answer(self, avlmap: "AVLMap") -> "EditsAnswer":
        from avlmaps.query.editor import edit_text

        made = _made(self, avlmap.edit)
        answer = avlmap.edit.history()
        if made is not None:
            answer["text"] = edit_text(made)
        return answer

    def lines(self, answer: "Mapping[str, Any]") -> "list[str]":
        if "text" in answer:
            lost = [one for one in answer["edits"] if one["state"] == "lost"]
            more = [f"note: {len(lost)} edits find nothing to apply to; list them with --list"] if lost else []
            return [answer["text"], *more]
        if not answer["edits"]:
            return ["nobody has edited this map"]
        columns: dict[str, Column] = {
            "id": "id",
            "edit": "does",
            "of": lambda one: ", ".join(one["of"]),
            "name": "name",
            "position": lambda one: one["position"] or None,
            "by": lambda one: one["by"] or "a person",
            "day": lambda one: one["made"][:10],
            "state": lambda one: one["state"] + (f": {one['why']}" if "why" in one else ""),
        }
        return table(columns, answer["edits"])


def _made(verb: Edit, editor: "Editor") -> "EditMade | None":
    asked = [name for name in (*_TAKES, "list") if getattr(verb, name)]
    flags = [f"--{name.replace('_', '-')}" for name in asked]
    if len(asked) > 1:
        raise UsageError(f"{' and '.join(flags)} do not go together; make one edit at a time.")
    does = asked[0] if asked else "list"
    idle = [name for name in ("to", "at", "room", "box", "plane") if getattr(verb, name)]
    idle = [name for name in idle if name not in _TAKES.get(does, ())]
    if idle:
        flag = "a list of edits" if does == "list" else flags[0]
        raise UsageError(f"--{idle[0]} says nothing to {flag}; see `avlmaps edit --help`.")
    if does == "list":
        return None
    name = "" if does == "merge" or getattr(verb, does) in ("thing", "it", "last") else getattr(verb, does)
    return editor.make(
        does.replace("_", "-"), name=name, to=verb.to or "", at=verb.at, places=verb.merge or verb.plane,
        box=_box(verb.box), room=verb.room, by=verb.by or "",
    )  # fmt: skip


_TAKES = {
    "rename": ("to", "at"), "rename_room": ("to",), "merge": ("to",), "split": ("at", "plane", "box"),
    "forbid": ("box", "room"), "pin": ("at",), "undo": (),
}  # fmt: skip


def _box(text: str | None) -> tuple[float, ...]:
    if text is None:
        return ()
    try:
        return tuple(float(word) for word in text.split(","))
    except ValueError:
        raise UsageError(f"--box takes x0,y0,x1,y1 in metres, such as 1.0,2.0,2.5,4.0; not {text[:60]!r}.") from None


@dataclass(frozen=True, kw_only=True)
class Changes(MapVerb):
    """List what is new, moved and gone in a map of several days, each with the day on which it was noticed.

    Gone means that a later day looked through its place from where it had been seen. Things whose place nobody looked
    at again are counted as unknown, and stay where they were. `avlmaps merge` adds a day.

    Example: avlmaps changes home.avlmap --since 2026-11-24
    """

    since: Annotated[str | None, arg(metavar="DAY")] = None
    """List what changed after this day: a date such as 2026-11-24, or the number of a visit, from 1. Default: the
    first."""
    first_seen: bool = False
    """List also what was seen first on a later day where nobody had looked before."""

    def answer(self, avlmap: "AVLMap") -> Mapping[str, Any]:
        return avlmap.changes(1 if self.since is None else self.since, first_seen=self.first_seen)

    def lines(self, answer: Mapping[str, Any]) -> list[str]:
        return change_lines(answer)


def change_lines(answer: Mapping[str, Any]) -> list[str]:
    """Lay out changes as a table, and what is not known."""
    from avlmaps.query.changes import said

    unknown = answer["unknown"]
    not_known = [f"{unknown} things are unknown: nobody looked at their place again"] if unknown else []
    if not answer["changes"]:
        return [f"nothing is known to have changed since {said(answer['since'])}", *not_known]
    columns: dict[str, Column] = {
        "change": "kind",
        "thing": "name",
        "confidence": "confidence",
        "position": "position",
        "from": "from",
        "room": "room",
        "noticed on": lambda one: said(one["noticed"]),
        "last seen on": lambda one: said(one["last_seen"]),
    }
    return [*table(columns, answer["changes"]), *not_known]


@dataclass(frozen=True, kw_only=True)
class Merge(ModelVerb):
    """Make one map of a map and of another day's: it is found in the first by its pictures, and updates it.

    The other map needs no guess of where it is; it may be of another robot with other cameras. It is refused, with the
    numbers, where its pictures or its surfaces do not say that it is the same place. Things of the first map are gone
    only where the other day looked through their place; where it did not look, nothing is known of them.

    Example: avlmaps merge monday.avlmap tuesday.avlmap --out home.avlmap --first-day 2026-11-23 --day 2026-11-24

    Example: avlmaps changes home.avlmap
    """

    compiles: ClassVar[bool] = True

    map: Annotated[Positional[Path], arg(metavar="MAP")]
    """Map folder, of one day or of several."""
    other: Annotated[Positional[Path], arg(metavar="OTHER")]
    """Map folder of a later day, built with the same profile and voxels."""
    out: Annotated[Path, arg(metavar="MAP")]
    """Map folder to write; both others stay as they are."""
    day: Annotated[str | None, arg(metavar="DAY")] = None
    """Day of OTHER, such as 2026-11-24. Default: by its stamps, if those are of a clock."""
    first_day: Annotated[str | None, arg(metavar="DAY")] = None
    """Day of MAP, if it is of one day, likewise."""
    overwrite: bool = False
    """Replace a map at --out."""

    def run(self) -> None:
        answer = merge(self)
        emit(answer, merge_lines(answer), self.json)


def merge(verb: Merge) -> dict[str, Any]:
    """Merge two maps, and return by what the place was found, and what changed."""
    from avlmaps.days.merge import merge_maps
    from avlmaps.query.avlmap import AVLMap

    begin_s = perf_counter()
    made = merge_maps(
        AVLMap.open(verb.map), AVLMap.open(verb.other), verb.out, day=verb.day or "",
        first_day=verb.first_day or "",
        overwrite=verb.overwrite,
    )  # fmt: skip
    return {**merged_answer(made), "elapsed_s": round(perf_counter() - begin_s, 3)}


def merged_answer(made: "AVLMap") -> dict[str, Any]:
    """Return what is known of a merged map's last day."""
    from avlmaps.days.merge import NO_SOURCES
    from avlmaps.query.changes import Days, changes_answer

    days = Days.of(made)
    visit = made.data.info.visits[-1]
    notes = [notice for notice in made.data.info.notices if notice.startswith(NO_SOURCES)]
    return {
        **({"notes": notes} if notes else {}),
        "path": str(made.path),
        "voxels": made.data.info.counts.voxels,
        "keyframes": made.data.info.counts.keyframes,
        "map_from_recording": [list(row) for row in visit.map_from_recording],
        "checks": visit.checks,
        **{key: value for key, value in changes_answer(days, str(made.path), days.last - 1).items() if key != "map"},
    }


def merge_lines(answer: dict[str, Any]) -> list[str]:
    """Lay out what `merge` reports."""
    checks = answer["checks"]
    found = (
        f"found: {checks['agreeing']:.0f} of {checks['located']:.0f} located keyframes agree "
        f"({checks['keyframes_tried']:.0f} tried), over {checks['spread_m']:g} m; {checks['agreement']:.1%} of "
        f"{checks['looked']:.0f} voxels lie on the map's surface"
    )
    notes = [f"note: {note}" for note in answer.get("notes", ())]
    return [found, *notes, *change_lines(answer), f"wrote {answer['path']}: {answer['voxels']} voxels"]
