"""`avlmaps edit`: a person corrects a map."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

from tyro.conf import arg

from avlmaps.cli.output import UsageError, table_lines
from avlmaps.cli.verb import MapVerb, OptionalText
from avlmaps.core.wording import place_text

if TYPE_CHECKING:
    from collections.abc import Mapping

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
        """Make the edit that the options say, and return all of the map; what it did, where one was made."""
        from avlmaps.query.editor import edit_text

        made = _made(self, avlmap.edit)
        answer = avlmap.edit.history()
        if made is not None:
            answer["text"] = edit_text(made)
        return answer

    def lines(self, answer: "Mapping[str, Any]") -> "list[str]":
        """Lay out edits as a table, and what the last one did."""
        if "text" in answer:
            lost = [one for one in answer["edits"] if one["state"] == "lost"]
            more = [f"note: {len(lost)} edits find nothing to apply to; list them with --list"] if lost else []
            return [answer["text"], *more]
        if not answer["edits"]:
            return ["nobody has edited this map"]
        rows = [
            (
                one["id"], one["does"], ", ".join(one["of"]), one["name"],
                place_text(one["position"]) if one["position"] else "", one["by"] or "a person", one["made"][:10],
                one["state"] + (f": {one['why']}" if "why" in one else ""),
            )
            for one in answer["edits"]
        ]  # fmt: skip
        return table_lines(("id", "edit", "of", "name", "position", "by", "day", "state"), rows)


def _made(verb: Edit, editor: "Editor") -> "EditMade | None":
    asked = [
        name for name in ("rename", "rename_room", "merge", "split", "forbid", "pin", "undo") if getattr(verb, name)
    ]
    if len(asked) > 1 or (asked and verb.list):
        named = " and ".join(f"--{name.replace('_', '-')}" for name in (*asked, *(("list",) if verb.list else ())))
        raise UsageError(f"{named} do not go together; make one edit at a time.")
    does = asked[0] if asked else ""
    _require(verb, does)
    by = verb.by or ""
    match does:
        case "rename":
            what = None if verb.rename in ("thing", "it") else verb.rename
            return editor.rename(what, verb.to or "", at=verb.at, by=by)
        case "rename_room":
            return editor.rename_room(verb.rename_room or "", verb.to or "", by=by)
        case "merge":
            return editor.merge(*verb.merge, to=verb.to or "", by=by)
        case "split":
            what = None if verb.split in ("thing", "it") else verb.split
            return editor.split(what, at=verb.at, plane=verb.plane, box=_box(verb.box), by=by)
        case "forbid":
            return editor.forbid(verb.forbid or "", box=_box(verb.box), room=verb.room, by=by)
        case "pin":
            return editor.pin(verb.pin or "", verb.at or "", by=by)
        case "undo":
            return editor.undo("" if verb.undo == "last" else verb.undo or "", by=by)
        case _:
            return None


_TAKES = {
    "rename": ("to", "at"), "rename_room": ("to",), "merge": ("to",), "split": ("at", "plane", "box"),
    "forbid": ("box", "room"), "pin": ("at",), "undo": (), "": (),
}  # fmt: skip
_NEEDS = {"rename": ("to",), "rename_room": ("to",), "pin": ("at",)}


def _require(verb: Edit, does: str) -> None:
    """Refuse options that say nothing to an edit, and an edit that lacks one.

    Raises:
        UsageError: there are such.
    """
    flag = f"--{does.replace('_', '-')}" if does else "a list of edits"
    idle = [name for name in ("to", "at", "room", "box", "plane") if getattr(verb, name) and name not in _TAKES[does]]
    if idle:
        raise UsageError(f"--{idle[0]} says nothing to {flag}; see `avlmaps edit --help`.")
    for name in _NEEDS.get(does, ()):
        if not getattr(verb, name):
            raise UsageError(f"{flag} needs --{name}; see `avlmaps edit --help`.")


def _box(text: str | None) -> tuple[float, ...]:
    if text is None:
        return ()
    try:
        return tuple(float(word) for word in text.split(","))
    except ValueError:
        raise UsageError(f"--box takes x0,y0,x1,y1 in metres, such as 1.0,2.0,2.5,4.0; not {text[:60]!r}.") from None
