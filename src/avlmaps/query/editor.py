"""Corrects a map: each method makes one ``Edit``, checks that it finds what it is about, and appends it to the log."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from avlmaps.core.arrays import Float
from avlmaps.core.errors import AskError, MapError, QueryError
from avlmaps.core.numbers import checked
from avlmaps.core.poses import plain_point
from avlmaps.core.wording import option, place_text
from avlmaps.maps.store.edits import LONGEST_NAME, Does, Edit, EditedSpot, World, append_edit, in_force, read_edits
from avlmaps.query.contents import plain_name
from avlmaps.query.edits import Edited, means, said
from avlmaps.query.places import is_place, place_given
from avlmaps.query.schema import EditAnswer, row_of

if TYPE_CHECKING:
    from avlmaps.query.avlmap import AVLMap
    from avlmaps.query.contents import Thing
    from avlmaps.query.schema import EditsAnswer

Place = Sequence[float] | str
"""x, y, z in metres of the recording frame, or x, y of the level frame; as numbers or as text."""
_NEAR_M = 1.0  # how far from a thing a place may lie that means it
_BESIDE_M = 5.0  # how far outside of the map a pinned place or a forbidden area may lie
_APART_M = 3.0  # how far apart things that are one may be
_MOST_NAMED = 8
_NEEDS = {"rename": ("to",), "rename-room": ("name", "to"), "forbid": ("name",), "pin": ("name", "at")}


class Editor:
    """Corrects a map in its folder, which another build of it keeps.

    ``by`` made the edit, ``thing`` is its name (None for what is at a place), ``at`` where it is. ``QueryError``: there
    is no such thing or room, or several, or a name or place is none. ``MapError``: the map cannot be written.
    """

    def __init__(self, avlmap: "AVLMap") -> None:
        self._map = avlmap

    @checked(QueryError)
    def rename(self, thing: str | None, to: str, *, at: Place | None = None, by: str = "") -> Edit:
        """Give a thing another name: "that is not a chair, it is a stool"."""
        found, to = self._thing(thing, at), _own_name(to)
        if found.name == to:
            raise QueryError(f"The {to} at {place_text(found.position)} is called so already.")
        return self._add("rename", [self._spot_of(found)], name=to, by=by)

    @checked(QueryError)
    def rename_room(self, room: str, to: str, *, by: str = "") -> Edit:
        """Give a room, by what ``rooms`` calls it or a place in it, another name: "this room is the studio"."""
        return self._add("rename room", [self._room(room)], name=_own_name(to), by=by)

    @checked(QueryError)
    def merge(self, *things: Place, to: str = "", by: str = "") -> Edit:
        """Make one thing of several, by a place on each. ``QueryError``: they are fewer than two, or far apart."""
        found = [self._thing(None, place) for place in things]
        if len({int(one.rows[0]) for one in found}) < 2:
            raise QueryError(f"{len(found)} place(s) mean fewer than two things; give a place on each that is merged.")
        joined, apart = found[:1], found[1:]
        while apart:  # two pairs, each near each other, are not one thing either
            gaps = [min(_gap_m(one, other) for other in joined) for one in apart]
            nearest_m, one = min(gaps), apart.pop(int(np.argmin(gaps)))
            if nearest_m > _APART_M:
                raise QueryError(
                    f"The {one.name} at {place_text(one.position)} is {nearest_m:.1f} m from the others, more than "
                    f"{_APART_M:g} m; things that are one touch or nearly do."
                )
            joined.append(one)
        return self._add("merge", [self._spot_of(one) for one in found], name=_own_name(to) if to else "", by=by)

    @checked(QueryError)
    def split(
        self, thing: str | None, *, at: Place | None = None, plane: Sequence[Place] = (), box: Sequence[float] = (),
        by: str = "",
    ) -> Edit:  # fmt: skip
        """Take a thing apart by its connected pieces, a plane through two places, or a box (level frame, metres)."""
        found = self._thing(thing, at)
        if len(plane) not in (0, 2) or (plane and box):
            raise QueryError("A thing is split by a plane through two places, or by a box, or by neither.")
        space = self._map.space
        floor_m = float(space.level(np.array(found.position))[2])
        cut = [self._level(place) for place in plane] if plane else _corners(box) if box else []
        points = [plain_point(space.world(np.array([xy[0], xy[1], floor_m]))) for xy in cut]
        edit = self._new("split", [self._spot_of(found)], cut=points, by=by)
        before, after = (
            sum(bool(np.isin(one.rows, found.rows).any()) for one in self._after(*more).claims)
            for more in ((), (edit,))
        )
        if after <= max(before, 1):
            how = "the cut does not meet it" if cut else "it is one connected piece; cut it by a plane or a box"
            raise QueryError(f"The {found.name} at {place_text(found.position)} stays whole: {how}.")
        return self._append(edit)

    @checked(QueryError)
    def forbid(self, name: str, *, box: Sequence[float] = (), room: str | None = None, by: str = "") -> Edit:
        """Forbid an area to robots: no path goes through it, and no goal in it is accepted.

        The box is x and y of two opposite corners, level frame, metres, on the storey where the map's walk began;
        ``room`` is instead what ``rooms`` calls a room, or a place in it. ``QueryError``: the box is none or far away.
        """
        if bool(box) == (room is not None):
            raise QueryError("An area is forbidden by a box x0,y0,x1,y1 or by a room; give one of them.")
        if room is not None:
            return self._add("forbid", [self._room(room)], name=_name(name), by=by)
        corners, floor_m = _corners(box), self._floor_m()
        self._require_here(np.array(corners), "The box")
        points = [self._map.space.world(np.append(corner, floor_m)) for corner in corners]
        spot = EditedSpot(middle=plain_point(np.mean(points, axis=0)), corners=tuple(map(plain_point, points)))
        return self._add("forbid", [spot.anchored(self._map.data.keyframes)], name=_name(name), by=by)

    @checked(QueryError)
    def pin(self, name: str, at: Place, *, by: str = "") -> Edit:
        """Give a place a name of one's own; without a height it is on the floor where the walk began."""
        self._require_here(self._level(at)[None], "The place")
        spot = EditedSpot(middle=plain_point(self._in_space(place_given(at))))
        return self._add("pin", [spot.anchored(self._map.data.keyframes)], name=_own_name(name), by=by)

    @checked(QueryError)
    def undo(self, which: str = "", *, by: str = "") -> Edit:
        """Undo an edit by its id; by default the last. ``QueryError``: there is no such edit in force."""
        known = in_force(self._log())
        wanted = [edit for edit in known if edit.id == which] if which else list(known[-1:])
        if not wanted:
            what = f"edit {which[:20]!r}" if which else "edit"
            raise QueryError(f"There is no {what} in force to undo; `avlmaps edit MAP --list` lists them.")
        return self._append(self._new("undo", of=wanted[0].id, by=by))

    def make(
        self, does: str, *, name: str = "", to: str = "", at: Place | None = None, places: Sequence[Place] = (),
        box: Sequence[float] = (), room: str | None = None, by: str = "",
    ) -> Edit:  # fmt: skip
        """Make an edit that a front names by a word; ``name`` is the thing or room, or the edit that is undone."""
        given = {"name": name, "to": to, "at": at}
        for need in _NEEDS.get(does, ()):
            if not given[need]:
                raise AskError(f"{does} needs {option(need)}.")
        makers = {
            "rename": lambda: self.rename(name or None, to, at=at, by=by),
            "rename-room": lambda: self.rename_room(name, to, by=by),
            "merge": lambda: self.merge(*places, to=to, by=by),
            "split": lambda: self.split(name or None, at=at, plane=places, box=box, by=by),
            "forbid": lambda: self.forbid(name, box=box, room=room, by=by),
            "pin": lambda: self.pin(name, at or "", by=by),
        }
        return makers.get(does, lambda: self.undo(name, by=by))()

    def history(self) -> "EditsAnswer":
        """Return all edits, the oldest first, and which of them find nothing to apply to."""
        log = {edit.id: edit for edit in self._log()}
        lost = {one.edit.id: one.why for one in self._after().lost}
        applied = {edit.id: edit for edit in in_force(tuple(log.values()))}
        pinned = {plain_name(edit.name): edit.id for edit in applied.values() if edit.does == "pin"}

        def state_of(edit: Edit) -> str:
            if edit.does == "undo":
                return "undo"
            if edit.id not in applied:
                return "undone"
            is_last = edit.does != "pin" or edit.id in pinned.values()
            return "lost" if edit.id in lost else "applied" if is_last else "moved"

        def row(edit: Edit) -> EditAnswer:
            of = [edit.of] if edit.does == "undo" else [one.name for one in edit.at]
            at = edit.at[0].middle if edit.at else None
            return row_of(edit, EditAnswer, of=of, position=at, state=state_of(edit), why=lost.get(edit.id))

        return {"map": self._map.path.name, "edits": list(map(row, log.values()))}

    def _thing(self, name: str | None, at: Place | None) -> "Thing":
        if name is None and at is None:
            raise QueryError("Which thing? Name it, or give its place as x,y,z.")
        things = [one for one in self._map.things(None, 0.5 if at is None else 0.2) if len(one.rows)]
        if name is not None:
            is_meant = means(name)
            things = [one for one in things if is_meant(one.name)]
        what = name or "thing"
        if at is not None:
            place = place_given(at)
            away = {id(one): self._away_m(one, place) for one in things}
            near = [one for one in things if away[id(one)] <= _NEAR_M]
            if not near:
                raise QueryError(
                    f"The map shows no {what} within {_NEAR_M:g} m of {place_text(place)}; list them with "
                    "`avlmaps things`."
                )
            return min(near, key=lambda one: (round(away[id(one)], 2), -one.confidence))
        if not things:
            raise QueryError(f"The map shows no {what}; list what it shows with `avlmaps things`.")
        if len(things) > 1:
            places = ", ".join(place_text(one.position) for one in things[:_MOST_NAMED])
            raise QueryError(f"There are {len(things)} things called {what}: say which by its place, one of {places}.")
        return things[0]

    def _spot_of(self, thing: "Thing") -> EditedSpot:
        return self._map.edited.spot_of(thing.name, thing.rows)

    def _away_m(self, thing: "Thing", place: Float[np.ndarray, " n"]) -> float:
        points = thing.points if len(place) == 3 else self._map.space.level(thing.points)[:, :2]
        return float(np.linalg.norm(points - place, axis=1).min())

    def _require_here(self, level: Float[np.ndarray, "n 2"], what: str) -> None:
        centres = self._map.space.level_centres()[:, :2]
        if not len(centres):
            return
        low, high = centres.min(axis=0), centres.max(axis=0)
        gap = np.maximum(np.maximum(level.min(axis=0) - high, low - level.max(axis=0)), 0.0)
        if (away_m := float(np.linalg.norm(gap))) > _BESIDE_M:
            raise QueryError(
                f"{what} lies {away_m:.1f} m outside of the map, which goes from {place_text(low)} to "
                f"{place_text(high)} on the plan (level frame); give x and y in metres."
            )

    def _room(self, room: str) -> EditedSpot:
        where = self._map.where
        if not where.rooms:
            raise QueryError("The map has no floor plan, so that its rooms are not known.")
        if is_place(room):
            numbers: list[int] = where.rooms_of(self._in_space(place_given(room))[None]).tolist()
        else:
            numbers = where.numbers_of(room)
        if len(numbers) > 1:
            names = ", ".join(where.names[number] for number in numbers[:_MOST_NAMED])
            raise QueryError(f"{len(numbers)} rooms are called {room}; say which: {names}.")
        if numbers[0] < 0:
            raise QueryError(f"There is no room at {room!r}; `avlmaps rooms` lists them.")
        found, name = where.rooms[numbers[0]], where.names[numbers[0]]
        if found.parts and not is_place(room) and plain_name(room) not in (name, found.name):
            raise QueryError(f"{room!r} is a part of {name!r}: an open plan is corrected as a whole, by that name.")
        spot = EditedSpot(name=found.name, middle=found.position, corners=tuple(map(plain_point, found.outline)))
        return spot.anchored(self._map.data.keyframes)

    def _floor_m(self) -> float:
        space, cameras = self._map.space, np.asarray(self._map.data.keyframes.world_from_camera)[:1, :3, 3]
        if self._map.storeys is not None and len(cameras):
            return float(self._map.storeys[int(self._map.storeys.of_places(cameras)[0])].floor_m)
        from avlmaps.maps.obstacles import floor_height

        return floor_height(space.level_centres()[:, 2], space.grid.voxel_size_m) if len(space) else 0.0

    def _in_space(self, place: Float[np.ndarray, " n"]) -> Float[np.ndarray, "3"]:
        return place if len(place) == 3 else self._map.space.world(np.append(place, self._floor_m()))

    def _level(self, place: Place) -> Float[np.ndarray, "2"]:
        numbers = place_given(place)
        return numbers if len(numbers) == 2 else self._map.space.level(numbers)[:2]

    def _new(self, does: Does, at: Sequence[EditedSpot] = (), *, by: str = "", **what: Any) -> Edit:
        world = World.of(self._map.data.info) if at else None
        return Edit.new(does, at, by=_name(by) if by else "", world=world, **what)

    def _add(self, does: Does, at: Sequence[EditedSpot], *, name: str, by: str) -> Edit:
        return self._append(self._new(does, at, name=name, by=by))

    def _append(self, edit: Edit) -> Edit:
        avlmap = self._map
        if not avlmap.data.info.files:
            raise MapError("The map lies in memory alone; save it, and edit what is saved.")
        if not avlmap.path.is_dir():  # to lock it would make it, and the map may come back
            raise MapError(f"{avlmap.path} is gone, so that the edit has no place; bring the map back first.")
        append_edit(avlmap.path, edit)
        avlmap.forget_edits()
        return edit

    def _log(self) -> tuple[Edit, ...]:
        return read_edits(self._map.path)

    def _after(self, *more: Edit) -> Edited:
        return Edited((*self._log(), *more), self._map)


def edit_text(edit: Edit) -> str:
    """Return what an edit did, in one sentence."""
    before = " and the ".join(f"{one.name} at {place_text(one.middle)}" for one in edit.at if one.name)
    named = f"({said(edit)}, edit {edit.id})" if edit.does != "undo" else ""
    match edit.does:
        case "undo":
            return f"Edit {edit.of} is undone."
        case "forbid":
            return f"No drive that begins from now on enters {edit.name} {named}; a robot that drives now is stopped."
        case "rename" | "rename room":
            what = f"The {before} is called {edit.name}"
        case "merge":
            what = f"The {before} are one thing" + (f", {edit.name}" if edit.name else "")
        case "split":
            what = f"The {before} is split"
        case _:
            what = f"{edit.name} is at {place_text(edit.at[0].middle)}"
    return f"{what} from now on {named}."


def _gap_m(one: "Thing", other: "Thing") -> float:
    from scipy.spatial import KDTree

    return float(np.min(KDTree(one.points).query(other.points)[0]))


def _name(name: str) -> str:
    word = " ".join(name.split())
    if not word or len(word) > LONGEST_NAME or not any(letter.isalnum() for letter in word) or not word.isprintable():
        raise QueryError(f"{name[:40]!r} is no name; give one to {LONGEST_NAME} characters, a letter among them.")
    return word


def _own_name(name: str) -> str:
    from avlmaps.language.sentence import is_reserved

    word = _name(name)
    if is_reserved(word):
        raise QueryError(f"{word!r} is a word of orders to a robot, and would be taken for a place; give another name.")
    return word


def _corners(box: Sequence[float]) -> list[Float[np.ndarray, "2"]]:
    numbers = list(box) if np.iterable(box) else []
    if len(numbers) != 4 or not all(math.isfinite(value) and abs(value) <= 1e5 for value in numbers):
        raise QueryError(f"A box is x0,y0,x1,y1 in metres of the level frame, two opposite corners; not {box!r}.")
    (x0, x1), (y0, y1) = sorted((numbers[0], numbers[2])), sorted((numbers[1], numbers[3]))
    if min(x1 - x0, y1 - y0) < 0.01:
        raise QueryError(f"The box {tuple(numbers)} has no area; give two opposite corners, x0,y0,x1,y1.")
    return [np.array(corner, np.float64) for corner in ((x0, y0), (x1, y0), (x1, y1), (x0, y1))]
