"""The work of each request: from a request's values to its answer, in a thread of a lane."""

import tempfile
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NotRequired, TypedDict, TypeVar

import msgspec
import numpy as np

from avlmaps.core.motion import GroundPose
from avlmaps.core.poses import FRAME
from avlmaps.navigate.paths import PathAnswer
from avlmaps.query.answer import Answer
from avlmaps.query.editor import edit_text
from avlmaps.query.places import PlaceAnswer, column_point, describe_place, place_of
from avlmaps.query.queryable import Photo
from avlmaps.query.schema import (
    ChangesAnswer,
    ContentsAnswer,
    EditsAnswer,
    Frame,
    LocateAnswer,
    Notes,
    QueryAnswer,
    RoomsAnswer,
    SoundAnswer,
    SourcesAnswer,
    locate_answer,
)
from avlmaps.query.selection import MapLists, ThingsPage, Wanted, map_answer, page_of_things
from avlmaps.serve import requests
from avlmaps.serve.lanes import Cancellation, RequestError, without_folders
from avlmaps.serve.requests import AskQuery, NoQuery, RehearseQuery, Uploads, ViewQuery, camera_of, numbers_of
from avlmaps.serve.settings import Limits
from avlmaps.serve.shelf import ServedMap, Shelf
from avlmaps.serve.tiles import TilesAnswer


@dataclass(frozen=True, slots=True)
class WorkInput:
    """What a piece of work is given.

    Attributes:
        map: the map that it is about.
        limits: of the server.
        uploads: files of the request.
        watch: reports progress; ends the work when nobody waits for it.
        path: the numbers and names in the address, beside the map's.
        reads_files: whether the client is a program of this machine that may name files.
    """

    map: ServedMap
    limits: Limits
    uploads: Uploads = field(default_factory=Uploads)
    watch: Cancellation = field(default_factory=Cancellation)
    path: dict[str, str] = field(default_factory=dict)
    reads_files: bool = False


@dataclass(frozen=True, slots=True)
class File:
    """An answer that is no JSON.

    Attributes:
        content: its bytes.
        media_type: what it is.
        headers: further headers.
    """

    content: bytes
    media_type: str
    headers: dict[str, str] = field(default_factory=dict)


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


class ListedThingsAnswer(ThingsPage):
    """A page of the things that are meant, most confident or nearest first."""

    map: str
    frame: Frame
    notes: NotRequired[Notes]


class SoundsAnswer(TypedDict):
    """Sounds of a map in the order of their onset."""

    map: str
    frame: Frame
    sounds: list[SoundAnswer]
    notes: NotRequired[Notes]


def list_maps(shelf: Shelf) -> MapsAnswer:
    """Return the server's maps."""
    entries: list[MapEntry] = []
    for one in shelf.all():
        info = one.avlmap.stored.info
        entries.append(
            {
                "name": one.name,
                "voxels": info.counts.voxels,
                "keyframes": info.counts.keyframes,
                "sounds": info.counts.sounds,
                "profile": info.profile,
                "voxel_size_m": info.voxel_size_m,
                "finished": info.timings.finished,
                "version": one.version,
                "stale": shelf.is_stale(one.name),
            }
        )
    return {"maps": entries}


def describe_map(task: WorkInput, query: requests.NoQuery) -> dict[str, Any]:
    """Return what ``avlmaps info --json`` prints, with the map's name for its path."""
    del query
    described = map_answer(task.map.avlmap)
    notices = [without_folders(notice) for notice in described["notices"]]  # they name the recording's files
    return {**described, "path": task.map.name, "notices": notices}


def lists_of(task: WorkInput) -> MapLists:
    """Return the lists of a task's map, which the server stores."""
    return MapLists(task.map.avlmap, task.map.once, task.watch.step)


def wanted(query: requests.ThingsQuery) -> Wanted:
    """Return which things a request means."""
    named = Wanted(least=query.least, name=query.name, structure=query.structure)
    if not isinstance(query, requests.ListedThingsQuery):
        return named
    return replace(named, room=query.room, near=query.near, top=query.top, page=query.page, at=query.at)


def list_contents(task: WorkInput, query: requests.ThingsQuery) -> ContentsAnswer:
    """Return what ``avlmaps things --json`` prints."""
    lists = lists_of(task)
    answer: ContentsAnswer = {
        "map": task.map.name,
        "frame": FRAME,
        "things": lists.things(query.least, query.name, query.structure),
        "sounds": lists.sounds(),
        "rooms": lists.rooms(),
    }
    return _noted(task, answer)


Noted = TypeVar("Noted", ContentsAnswer, ListedThingsAnswer, SoundsAnswer, RoomsAnswer)


def _noted(task: WorkInput, answer: Noted) -> Noted:
    opened = task.map.avlmap
    if doubts := opened.doubts_of_things if "things" in answer else opened.stored.info.doubts:
        answer["notes"] = [without_folders(doubt) for doubt in doubts]
    return answer


def list_things(task: WorkInput, query: requests.ListedThingsQuery) -> ListedThingsAnswer:
    """Return a page of the things that are meant."""
    page = page_of_things(lists_of(task), wanted(query))
    return _noted(task, ListedThingsAnswer(map=task.map.name, frame=FRAME, **page))


def list_sounds(task: WorkInput, query: requests.NoQuery) -> SoundsAnswer:
    """Return the sounds of a map."""
    del query
    return _noted(task, SoundsAnswer(map=task.map.name, frame=FRAME, sounds=lists_of(task).sounds()))


def list_rooms(task: WorkInput, query: requests.RoomsQuery) -> RoomsAnswer:
    """Return what ``avlmaps rooms --json`` prints."""
    return _noted(task, RoomsAnswer(map=task.map.name, frame=FRAME, rooms=lists_of(task).rooms(query.least)))


def list_sources(task: WorkInput, query: requests.SourcesQuery) -> SourcesAnswer:
    """Return what ``avlmaps sources --json`` prints."""
    found = task.map.avlmap.sources(query.sound, prior=query.prior == "lexicon", least=query.least)
    return {"map": task.map.name, "frame": FRAME, "sources": [one.to_json() for one in found]}


def list_changes(task: WorkInput, query: requests.ChangesQuery) -> ChangesAnswer:
    """Return what ``avlmaps changes --json`` prints."""
    return {**task.map.avlmap.changes(query.since, first_seen=query.first_seen), "map": task.map.name}


def list_edits(task: WorkInput, query: requests.NoQuery) -> EditsAnswer:
    """Return what ``avlmaps edit --list --json`` prints."""
    del query
    return {**task.map.avlmap.edit.history(), "map": task.map.name}


def edit(task: WorkInput, query: requests.EditQuery) -> EditsAnswer:
    """Correct the map, and return all edits; later queries know it.

    Raises:
        RequestError: a value is missing.
        QueryError: there is no such thing, room or edit.
    """
    editor, by = task.map.avlmap.as_edited_now().edit, query.by or ""

    def needed(name: str) -> str:
        value = getattr(query, name)
        if value is None:
            raise RequestError(f"{query.does} needs the value {name!r}; /openapi.json describes it.")
        return value

    match query.does:
        case "rename":
            made = editor.rename(query.name, needed("to"), at=query.at, by=by)
        case "rename-room":
            made = editor.rename_room(needed("name"), needed("to"), by=by)
        case "merge":
            made = editor.merge(*query.places, to=query.to or "", by=by)
        case "split":
            made = editor.split(query.name, at=query.at, plane=query.places, box=query.box, by=by)
        case "forbid":
            made = editor.forbid(needed("name"), box=query.box, room=query.room, by=by)
        case "pin":
            made = editor.pin(needed("name"), needed("at"), by=by)
        case "undo":
            made = editor.undo(query.edit or "", by=by)
    return {**editor.history(), "map": task.map.name, "text": edit_text(made)}


def sound_clip(task: WorkInput, query: requests.NoQuery) -> File:
    """Return the FLAC file of a sound."""
    del query
    stored, number = task.map.avlmap.stored, int(task.path["sound"])
    if number >= len(stored.sounds):
        raise RequestError(f"The map has {len(stored.sounds)} sounds, counted from 0; there is no {number}.", 404)
    try:
        content = stored.clip_path(number).read_bytes()
    except FileNotFoundError:
        raise RequestError(
            "The map is being replaced and its old clips are gone; try again in a second.", 503
        ) from None
    return File(content, "audio/flac", {"etag": f'"{task.map.version}"'})


def ask_map(task: WorkInput, query: requests.AskQuery) -> Answer:
    """Answer a sentence or parts, with the files of the request.

    Raises:
        AskError: what is given does not fit together.
        QueryError: the query cannot be answered.
    """
    attachments = task.uploads.attachments(task.limits)
    return task.map.avlmap.ask(
        query.sentence or "",
        min(query.top, task.limits.goals),
        None if query.intrinsics is None else numbers_of(query.intrinsics),
        attachments,
        object=query.object,
        sound=query.sound,
        area=query.area,
        image=requests.PHOTO if requests.PHOTO in attachments else None,
        clip=requests.CLIP if requests.CLIP in attachments else None,
        primary=query.primary,
        at=query.at,
        near=query.near,
    )


def ask(task: WorkInput, query: requests.AskQuery) -> QueryAnswer:
    """Return what ``avlmaps query --json`` prints."""
    return ask_map(task, query).to_dict()


def locate(task: WorkInput, query: requests.LocateQuery) -> LocateAnswer:
    """Return what ``avlmaps locate --json`` prints."""
    photo = task.uploads.attachments(task.limits).get(requests.PHOTO)
    if not isinstance(photo, Photo):
        raise RequestError("There is no photo; send one as the file 'photo' of a form, or as the body.")
    camera = camera_of(query.intrinsics, photo.rgb)
    task.watch.step("locating")
    found = task.map.avlmap.locate(photo.rgb, camera, None if camera is not None else photo.focal_35mm)
    return locate_answer(found, task.map.avlmap.stored.info.doubts)


def place(task: WorkInput, query: requests.PlaceQuery) -> PlaceAnswer:
    """Return what is at a place."""
    avlmap = task.map.avlmap
    point = np.array([query.x, query.y, 0.0 if query.z is None else query.z])
    if query.z is None:
        above = column_point(avlmap, point[:2], query.radius_m)
        point = avlmap.space.world(point) if above is None else above
    return describe_place(avlmap, point, query.radius_m)


def path(task: WorkInput, query: requests.PathQuery) -> PathAnswer:
    """Return the path between two places."""
    finder = task.map.paths_by_stairs if query.stairs else task.map.paths
    return finder.answer(place_of(query.start), place_of(query.goal))


def picture(task: WorkInput, query: requests.PictureQuery) -> File:
    """Return a PNG of an answer, or of the map."""
    from avlmaps.serve.pictures import full_picture, map_picture, small_picture

    values = {name: getattr(query, name) for name in requests.AskQuery.__struct_fields__}
    named = any(values[name] is not None for name in ("object", "sound", "area"))
    asks = named or bool((query.sentence or "").strip()) or task.uploads != Uploads()
    if not asks:
        camera_of(query.intrinsics, None)  # they belong to a photo
        content = map_picture(task.map) if query.size == "full" else small_picture(task.map)
        return File(content, "image/png")
    answer = ask_map(task, requests.AskQuery(**values))
    task.watch.step("drawing")
    draw = full_picture if query.size == "full" else small_picture
    return File(draw(task.map, answer), "image/png")


def tiles(task: WorkInput, query: requests.NoQuery) -> TilesAnswer:
    """Return the list of tiles."""
    del query
    return task.map.pyramid.index(task.map.version)


def tile(task: WorkInput, query: requests.TilesQuery) -> File:
    """Return one tile."""
    heat = None
    if query.heat is not None:
        shown = ask_map(task, requests.AskQuery(sentence=query.heat)).heat
        heat = None if shown is None else shown.shown
    level, i, j, k = (int(task.path[name]) for name in ("level", "i", "j", "k"))
    content = task.map.pyramid.tile(level, (i, j, k), heat)
    if content is None:
        raise RequestError("There is no such tile; /maps/{map}/tiles lists them.", 404, "tile")
    return File(content, "application/octet-stream", {"etag": f'"{task.map.version}"'})


def encoded(answer: Any) -> bytes:
    """Return an answer as JSON bytes."""
    from avlmaps.core.printable import printable_json, shortened

    return printable_json(msgspec.json.encode(shortened(answer)).decode()).encode()


_BYTES = "application/octet-stream"


def viewer(task: WorkInput, query: ViewQuery) -> File:
    """Return the page; it learns from its address which maps it shows."""
    from avlmaps.view.page import live_page

    del task, query
    return File(live_page(), "text/html")


def drawn_map(task: WorkInput, query: NoQuery) -> dict[str, Any]:
    """Return what the page needs before it draws the first voxel."""
    from avlmaps.view.labels import palettes

    del query
    told = {"map": task.map.page.layout.describe(), "palettes": palettes(), "robot": task.map.guide.has_robot}
    return told | {"version": task.map.voxels_version}


def drawn_voxels(task: WorkInput, query: NoQuery) -> File:
    """Return the voxels in the order of drawing (``layout.RECORD``)."""
    del query
    return File(task.map.page.layout.records, _BYTES)


def drawn_labels(task: WorkInput, query: NoQuery) -> File:
    """Return four bytes for each voxel: thing, room, name, confidence of the name."""
    del query
    return File(task.map.page.labels.voxels.tobytes(), _BYTES)


def drawn_contents(task: WorkInput, query: NoQuery) -> dict[str, Any]:
    """Return things, sounds and rooms with the colours of the page."""
    del query
    return task.map.page.describe_contents()


def drawn_voxel(task: WorkInput, query: NoQuery) -> dict[str, Any]:
    """Return what one voxel is taken for."""
    del query
    page, number = task.map.page, int(task.path["voxel"])
    if number >= len(page.layout):
        raise RequestError(f"There is no voxel {number}; the page draws {len(page.layout):,}.", 404)
    return page.describe_voxel(number)


def keyframe(task: WorkInput, query: NoQuery) -> File:
    """Return the picture of a keyframe."""
    del query
    number, keyframes = int(task.path["keyframe"]), task.map.avlmap.stored.keyframes
    jpeg = task.map.page.layout.thumbnail(number)
    if jpeg is None:
        raise RequestError(
            f"The map has {len(keyframes)} keyframes, counted from 0; there is no picture of {number}.", 404
        )
    return File(jpeg, "image/jpeg", {"etag": f'"{task.map.version}"'})


def ask_in_view(task: WorkInput, query: AskQuery) -> File:
    """Return the length of the answer's JSON (4 bytes, little-endian), the JSON, and the heat of each drawn voxel."""
    answer = ask_map(task, query)
    told = msgspec.json.encode({"answer": answer.to_dict(), "version": task.map.voxels_version})
    return File(len(told).to_bytes(4, "little") + told + task.map.page.heat_of(answer), _BYTES)


def rehearse(task: WorkInput, query: RehearseQuery) -> dict[str, Any]:
    """Plan a command on the map; drive it where the server has the robot of a scene."""
    start = None if query.start is None else GroundPose(*(float(word) for word in query.start.split(",")))
    _ = task.uploads.attachments(task.limits)  # what is no photo and no clip is refused here
    with tempfile.TemporaryDirectory(prefix="avlmaps-serve-") as name:
        folder = Path(name)
        photo, clip = task.uploads.written(folder)
        told = task.map.guide.obey(query.command, start, folder=folder, photo=photo, clip=clip)
        return _without(told, f"{folder}/")


def _without(told: Any, folder: str) -> Any:
    if isinstance(told, str):
        return told.replace(folder, "")
    if isinstance(told, dict):
        return {key: _without(value, folder) for key, value in told.items()}
    return [_without(value, folder) for value in told] if isinstance(told, list | tuple) else told
