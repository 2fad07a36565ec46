"""The work of each request, as ``operations`` lists it: from its values to its answer, in a thread of a lane.

What cannot be answered raises an ``AvlmapsError``; ``lanes.described`` gives it a status and takes paths out of it.
"""

import tempfile
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NotRequired, TypedDict, TypeVar

import msgspec
import numpy as np

from avlmaps.core.camera import Pinhole, intrinsics_of
from avlmaps.core.motion import GroundPose
from avlmaps.core.poses import FRAME
from avlmaps.core.printable import printable_json, shortened
from avlmaps.navigate.costmap import WALKER
from avlmaps.navigate.paths import PathAnswer, PathFinder, goals_near
from avlmaps.query import schema, selection
from avlmaps.query.answer import Answer
from avlmaps.query.editor import edit_text
from avlmaps.query.modalities import Photo
from avlmaps.query.places import PlaceAnswer, column_point, describe_place, last_seen, place_of
from avlmaps.query.selection import MapLists, Wanted
from avlmaps.query.words import unknown_note
from avlmaps.serve import requests
from avlmaps.serve.drawn import Pyramid, TilesAnswer, full_picture, map_picture, small_picture
from avlmaps.serve.lanes import Cancellation, RequestError, without_folders
from avlmaps.serve.requests import AskQuery, Files, NoQuery, RehearseQuery, ViewQuery
from avlmaps.serve.settings import Limits
from avlmaps.serve.shelf import ServedMap, Shelf


@dataclass(frozen=True, slots=True)
class WorkInput:
    """The map, the files and the limits of a request."""

    map: ServedMap
    limits: Limits
    files: Files = field(default_factory=dict[str, bytes])
    watch: Cancellation = field(default_factory=Cancellation)


@dataclass(frozen=True, slots=True)
class File:
    """An answer that is no JSON."""

    content: bytes
    media_type: str


class MapEntry(TypedDict):
    """One map of the server."""

    name: str
    voxels: int
    keyframes: int
    sounds: int
    profile: str
    voxel_size_m: float
    finished: str
    version: str
    stale: bool


class MapsAnswer(TypedDict):
    """The maps of the server."""

    maps: list[MapEntry]


class ListedThingsAnswer(selection.ThingsPage):
    """A page of the things that are meant, most confident or nearest first."""

    map: str
    frame: schema.Frame


class SoundsAnswer(TypedDict):
    """Sounds of a map in the order of their onset."""

    map: str
    frame: schema.Frame
    sounds: list[schema.SoundAnswer]
    notes: NotRequired[schema.Notes]


def list_maps(shelf: Shelf) -> MapsAnswer:
    return {"maps": [_entry(one, shelf.is_stale(one.name)) for one in map(shelf.get, shelf.names)]}


def _entry(one: ServedMap, stale: bool) -> MapEntry:
    info = one.avlmap.data.info
    return {
        "name": one.name,
        "voxels": info.counts.voxels,
        "keyframes": info.counts.keyframes,
        "sounds": info.counts.sounds,
        "profile": info.profile,
        "voxel_size_m": info.voxel_size_m,
        "finished": info.timings.finished,
        "version": one.version,
        "stale": stale,
    }


def describe_map(task: WorkInput, query: requests.NoQuery) -> dict[str, Any]:
    described = selection.map_answer(task.map.avlmap)
    notices = [without_folders(notice) for notice in described["notices"]]  # they name the recording's files
    return {**described, "path": task.map.name, "notices": notices}


def lists_of(task: WorkInput) -> MapLists:
    return MapLists(task.map.avlmap, task.map.once, task.watch.step)


def list_contents(task: WorkInput, query: requests.ThingsQuery) -> schema.ContentsAnswer:
    lists = lists_of(task)
    answer: schema.ContentsAnswer = {
        "map": task.map.name,
        "frame": FRAME,
        "things": lists.things(query.least, query.name, query.structure),
        "sounds": lists.sounds(),
        "rooms": lists.rooms(),
    }
    return _noted(task, answer)


Noted = TypeVar("Noted", schema.ContentsAnswer, ListedThingsAnswer, SoundsAnswer, schema.RoomsAnswer)


def _noted(task: WorkInput, answer: Noted) -> Noted:
    opened = task.map.avlmap
    if doubts := opened.doubts_of_things if "things" in answer else opened.data.info.doubts:
        answer["notes"] = [*answer.get("notes", ()), *map(without_folders, doubts)]
    return answer


def list_things(task: WorkInput, query: requests.ListedThingsQuery) -> ListedThingsAnswer:
    page = selection.page_of_things(lists_of(task), Wanted(**msgspec.structs.asdict(query)))
    return _noted(task, ListedThingsAnswer(map=task.map.name, frame=FRAME, **page))


def list_sounds(task: WorkInput, query: requests.NoQuery) -> SoundsAnswer:
    return _noted(task, SoundsAnswer(map=task.map.name, frame=FRAME, sounds=lists_of(task).sounds()))


def list_rooms(task: WorkInput, query: requests.RoomsQuery) -> schema.RoomsAnswer:
    return _noted(task, schema.RoomsAnswer(map=task.map.name, frame=FRAME, rooms=lists_of(task).rooms(query.least)))


def list_sources(task: WorkInput, query: requests.SourcesQuery) -> schema.SourcesAnswer:
    found = task.map.avlmap.sources(query.sound, prior=query.prior == "lexicon", least=query.least)
    return {"map": task.map.name, "frame": FRAME, "sources": [one.to_json() for one in found]}


def list_changes(task: WorkInput, query: requests.ChangesQuery) -> schema.ChangesAnswer:
    return {**task.map.avlmap.changes(query.since, first_seen=query.first_seen), "map": task.map.name}


def list_edits(task: WorkInput, query: requests.NoQuery) -> schema.EditsAnswer:
    return {**task.map.avlmap.edit.history(), "map": task.map.name}


def edit(task: WorkInput, query: requests.EditQuery) -> schema.EditsAnswer:
    editor = task.map.avlmap.as_edited_now().edit
    name = (query.edit if query.does == "undo" else query.name) or ""
    made = editor.make(
        query.does, name=name, to=query.to or "", at=query.at, places=query.places, box=query.box, room=query.room,
        by=query.by or "",
    )  # fmt: skip
    return {**editor.history(), "map": task.map.name, "text": edit_text(made)}


def sound_clip(task: WorkInput, query: requests.SoundQuery) -> File:
    sounds, number = task.map.avlmap.data.sounds, query.sound
    if not 0 <= number < len(sounds):
        raise RequestError(f"The map has {len(sounds)} sounds, counted from 0; there is no {number}.", 404)
    try:
        content = sounds.clips[number].read_bytes()
    except FileNotFoundError:
        raise RequestError("The map is being replaced, its old clips are gone; try again in a second.", 503) from None
    return File(content, "audio/flac")


def ask_map(task: WorkInput, query: requests.AskQuery) -> Answer:
    attachments = requests.attachments(task.files, task.limits)
    photo, clip = (name if name in attachments else None for name in (requests.PHOTO, requests.CLIP))
    camera = None if query.intrinsics is None else intrinsics_of(query.intrinsics)
    return task.map.avlmap.ask(
        query.sentence or "", min(query.top, task.limits.goals), camera, attachments, object=query.object,
        sound=query.sound, area=query.area, image=photo, clip=clip, primary=query.primary, at=query.at, near=query.near,
    )  # fmt: skip


def ask(task: WorkInput, query: requests.AskQuery) -> schema.QueryAnswer:
    return ask_map(task, query).to_dict()


def locate(task: WorkInput, query: requests.LocateQuery) -> schema.LocateAnswer:
    photo = requests.attachments(task.files, task.limits).get(requests.PHOTO)
    if not isinstance(photo, Photo):
        raise RequestError("There is no photo; send one as the file 'photo' of a form, or as the body.")
    size = {"width": photo.rgb.shape[1], "height": photo.rgb.shape[0]}
    camera = None if query.intrinsics is None else Pinhole(*intrinsics_of(query.intrinsics), **size)
    task.watch.step("locating")
    found = task.map.avlmap.locate(photo.rgb, camera, None if camera is not None else photo.focal_35mm)
    return schema.locate_answer(found, task.map.avlmap)


def place(task: WorkInput, query: requests.PlaceQuery) -> PlaceAnswer:
    avlmap = task.map.avlmap
    point = np.array([query.x, query.y, 0.0 if query.z is None else query.z])
    if query.z is None:
        above = column_point(avlmap, point[:2], query.radius_m)
        point = avlmap.space.world(point) if above is None else above
    return describe_place(avlmap, point, query.radius_m)


def path(task: WorkInput, query: requests.PathQuery) -> PathAnswer:
    avlmap = task.map.avlmap
    finder = task.map.once("stairs", lambda: PathFinder(avlmap, WALKER)) if query.stairs else task.map.paths
    return finder.answer(place_of(query.start), place_of(query.goal))


def picture(task: WorkInput, query: requests.PictureQuery) -> File:
    asks = query.object or query.sound or query.area or (query.sentence or "").strip() or task.files
    if not asks and query.intrinsics is None:
        content = map_picture(task.map) if query.size == "full" else small_picture(task.map)
        return File(content, "image/png")
    answer = ask_map(task, query)
    task.watch.step("drawing")
    draw = full_picture if query.size == "full" else small_picture
    return File(draw(task.map, answer), "image/png")


def _pyramid(task: WorkInput) -> Pyramid:
    avlmap, space = task.map.avlmap, task.map.avlmap.space
    return task.map.once("tiles", lambda: Pyramid(space.index, avlmap.colors, space.grid.voxel_size_m))


def tiles(task: WorkInput, query: requests.NoQuery) -> TilesAnswer:
    return _pyramid(task).index(task.map.version)


def tile(task: WorkInput, query: requests.TilesQuery) -> File:
    heat = None
    if query.heat is not None:
        shown = ask_map(task, requests.AskQuery(sentence=query.heat)).heat
        heat = None if shown is None else shown.shown
    content = _pyramid(task).tile(query.level, (query.i, query.j, query.k), heat)
    if content is None:
        raise RequestError("There is no such tile; /maps/{map}/tiles lists them.", 404, "tile")
    return File(content, "application/octet-stream")


_BYTES = "application/octet-stream"

# For agents.
_MOST_KINDS, _MOST_HEARD = 12, 2


def describe_building(task: WorkInput, query: NoQuery) -> dict[str, Any]:
    avlmap, lists = task.map.avlmap, lists_of(task)
    where, things = lists.avlmap.where, lists.things()
    floors = where.floors_of([room.position for room in where.rooms])
    thing_floors = where.floors_of([thing["position"] for thing in things])
    level = avlmap.space.level(avlmap.points) if len(avlmap.space) else np.zeros((1, 3))
    return {
        "map": task.map.name,
        "frame": FRAME,
        "size_m": [round(float(side), 1) for side in np.ptp(level, axis=0)],
        "floors": [
            {
                "floor": floor,
                "rooms": dict(Counter(where.rooms[k].name for k in np.flatnonzero(floors == floor)).most_common()),
                "things": int((thing_floors == floor).sum()),
            }
            for floor in range(where.floor_count)
        ],
        "things": len(things),
        "names": _kinds(thing["name"] for thing in things),
        "sounds": _kinds(map(_first_name, lists.sounds())),
    }


def tool_things(task: WorkInput, query: requests.ThingsToolQuery) -> dict[str, Any]:
    lists = lists_of(task)
    parts, names = lists.avlmap.where.parts, query.name
    known = [name for name in names if task.map.avlmap.knows(name)]
    unknown = [name for name in names if name not in known]
    wanted = Wanted(**{**msgspec.structs.asdict(query), "name": known})
    chosen, near = selection.selected(lists, wanted) if known or not names else ([], None)
    rows: list[dict[str, Any]] = [
        {
            **{key: one.thing[key] for key in ("name", "confidence", "position", "size")},
            "room": parts[one.part].name if one.part >= 0 else None,
            "distance_m": one.away_m,
            "heard": one.thing.get("heard", [])[:_MOST_HEARD] or None,
        }
        for one in chosen
    ]
    about: dict[str, Any] = {"near": near}
    if notes := [unknown_note(unknown[0])] if unknown else selection.beyond(lists, query.room, near):
        about["note"] = notes[0]
    if not names and len(rows) > query.top:
        about["names"] = _kinds([row["name"] for row in rows])
    return _paged(task, "things", rows, query.top, query.page) | about


def tool_rooms(task: WorkInput, query: requests.RoomsToolQuery) -> dict[str, Any]:
    lists = lists_of(task)
    where = lists.avlmap.where
    count = Counter(where.parts[one.part].room for one in selection.things_with_rooms(lists, Wanted()) if one.part >= 0)
    floors = where.floors_of([room.position for room in where.rooms])
    if query.floor is not None and not 0 <= query.floor < where.floor_count:
        raise RequestError(f"There is no floor {query.floor}; the map has {where.floor_count}, counted from 0.")
    wanted = range(len(where.rooms))
    if names := query.name:
        wanted = sorted({k for name in names if where.has(name) for k in where.numbers_of(name)})
    rows = [
        {
            "room": where.names[k],
            "name": where.rooms[k].name,
            "confidence": where.rooms[k].confidence,
            "area_m2": where.rooms[k].area_m2,
            "position": list(where.rooms[k].position),
            "things": count[k],
            **({"floor": int(floors[k])} if where.floor_count > 1 else {}),
        }
        for k in wanted
        if where.rooms[k].confidence >= query.least and query.floor in (None, int(floors[k]))
    ]
    return _paged(task, "rooms", rows, query.top, query.page)


def tool_sounds(task: WorkInput, query: requests.SoundsToolQuery) -> dict[str, Any]:
    lists, names = lists_of(task), {name.casefold() for name in query.name}
    where, sounds = lists.avlmap.where, lists.sounds()
    rooms = where.names_at([sound["position"] for sound in sounds])
    rows = [
        {
            "name": _first_name(sound),
            "confidence": sound["confidences"][0] if sound["confidences"] else None,
            "onset_s": sound["onset_s"],
            "offset_s": sound["offset_s"],
            "position": sound["position"],
            "room": room,
        }
        for sound, room in zip(sounds, rooms, strict=True)
        if not names or _first_name(sound).casefold() in names
    ]
    return _paged(task, "sounds", rows, query.top, query.page)


def _paged(task: WorkInput, key: str, rows: list[dict[str, Any]], top: int, page: int) -> dict[str, Any]:
    shown, pages = selection.page_of(rows, top, page, key)
    paging = {"page": page, "pages": pages} if pages > 1 else {}
    return {"map": task.map.name, "frame": FRAME, "total": len(rows), **paging, key: shown}


def _kinds(names: Iterable[str]) -> dict[str, int]:
    ordered = Counter(names).most_common()
    rest = sum(count for _, count in ordered[_MOST_KINDS:])
    return dict(ordered[:_MOST_KINDS]) | ({"other names": rest} if rest else {})


def _first_name(sound: schema.SoundAnswer) -> str:
    return sound["names"][0] if sound["names"] else "sound"


def seen_last(task: WorkInput, query: requests.LastSeenQuery) -> Any:
    return last_seen(task.map.avlmap, query.thing, query.top)


def goal_near(task: WorkInput, query: requests.GoalNearQuery) -> Any:
    reply = ask_map(task, AskQuery(sentence=query.sentence, top=20))
    return goals_near(task.map.paths, reply, place_of(query.near), query.top)


def encoded(answer: Any) -> bytes:
    # NumPy's numbers are floats that msgspec does not know
    return printable_json(msgspec.json.encode(shortened(answer), enc_hook=float).decode()).encode()


def viewer(task: WorkInput, query: ViewQuery) -> File:
    """Return the page; it learns from its address which maps it shows."""
    from avlmaps.view.page import live_page

    return File(live_page(), "text/html")


def drawn_map(task: WorkInput, query: NoQuery) -> dict[str, Any]:
    from avlmaps.view.labels import palettes

    told = {"map": task.map.page.layout.describe(), "palettes": palettes(), "robot": task.map.guide.has_robot}
    return told | {"version": task.map.voxels_version}


def drawn_voxels(task: WorkInput, query: NoQuery) -> File:
    return File(task.map.page.layout.records, _BYTES)


def drawn_labels(task: WorkInput, query: NoQuery) -> File:
    return File(task.map.page.labels.voxels.tobytes(), _BYTES)


def drawn_contents(task: WorkInput, query: NoQuery) -> dict[str, Any]:
    return task.map.page.describe_contents()


def drawn_voxel(task: WorkInput, query: requests.VoxelQuery) -> dict[str, Any]:
    page, number = task.map.page, query.voxel
    if not 0 <= number < len(page.layout):
        raise RequestError(f"There is no voxel {number}; the page draws {len(page.layout):,}.", 404)
    return page.describe_voxel(number)


def keyframe(task: WorkInput, query: requests.KeyframeQuery) -> File:
    number, keyframes = query.keyframe, task.map.avlmap.data.keyframes
    jpeg = task.map.page.layout.thumbnail(number)
    if jpeg is None:
        raise RequestError(
            f"The map has {len(keyframes)} keyframes, counted from 0; there is no picture of {number}.", 404
        )
    return File(jpeg, "image/jpeg")


def ask_in_view(task: WorkInput, query: AskQuery) -> File:
    """Return the length of the answer's JSON (4 bytes, little-endian), the JSON, and the heat of each drawn voxel."""
    answer = ask_map(task, query)
    told = msgspec.json.encode({"answer": answer.to_dict(), "version": task.map.voxels_version})
    return File(len(told).to_bytes(4, "little") + told + task.map.page.heat_of(answer), _BYTES)


def rehearse(task: WorkInput, query: RehearseQuery) -> dict[str, Any]:
    """Plan a command on the map; drive it where the server has the robot of a scene."""
    start = None if query.start is None else GroundPose(*(float(word) for word in query.start.split(",")))
    _ = requests.attachments(task.files, task.limits)  # what is no photo and no clip is refused here
    with tempfile.TemporaryDirectory(prefix="avlmaps-serve-") as name:
        folder = Path(name)
        told = task.map.guide.obey(query.command, start, folder=folder, **requests.written(task.files, folder))
        return _without(told, f"{folder}/")


def _without(told: Any, folder: str) -> Any:
    if isinstance(told, str):
        return told.replace(folder, "")
    if isinstance(told, dict):
        return {key: _without(value, folder) for key, value in told.items()}
    return [_without(value, folder) for value in told] if isinstance(told, list | tuple) else told
