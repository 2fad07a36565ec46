"""The tools of agents: each a type of request, a type of answer, and the work between; all of them only read."""

import base64
import binascii
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, Literal

import numpy as np
from jaxtyping import Float
from msgspec import Meta, Struct

from avlmaps.core.files import read_regular, user_path
from avlmaps.core.poses import FRAME
from avlmaps.core.question import HeardAt
from avlmaps.navigate.paths import goals_near
from avlmaps.query.places import last_seen, place_given
from avlmaps.query.schema import SoundAnswer
from avlmaps.query.selection import Selected, Wanted, page_of, selected, things_with_rooms
from avlmaps.query.whereabouts import Whereabouts
from avlmaps.query.words import unknown_note
from avlmaps.serve import work
from avlmaps.serve.lanes import RequestError
from avlmaps.serve.pictures import small_picture
from avlmaps.serve.requests import AskQuery, LocateQuery, PlaceQuery, Short, Uploads, Words
from avlmaps.serve.work import WorkInput, lists_of

Confidence = Annotated[float, Meta(ge=0.0, le=1.0)]
Top = Annotated[int, Meta(ge=1, le=50)]
Page = Annotated[int, Meta(ge=1)]
Place = Annotated[str | list[float], Meta(description="x,y,z")]
PlaceOrName = Annotated[str | list[float] | None, Meta(description="x,y,z or a thing's name: nearest first")]
Names = str | list[Words]
_MOST_KINDS = 12
_MOST_HEARD = 2


class ListThingsQuery(Struct, forbid_unknown_fields=True):
    """Which things are listed."""

    room: Annotated[Words | None, Meta(description="one, or all of a kind")] = None
    near: PlaceOrName = None
    name: Names = []
    least: Confidence = 0.5
    top: Top = 10
    page: Page = 1
    structure: Annotated[bool, Meta(description="walls and floors too")] = False
    picture: bool = False


class ListRoomsQuery(Struct, forbid_unknown_fields=True):
    """Which rooms are listed."""

    floor: Annotated[int | None, Meta(description="0 is the lowest")] = None
    name: Names = []
    least: Confidence = 0.0
    top: Top = 10
    page: Page = 1
    picture: bool = False


class ListSoundsQuery(Struct, forbid_unknown_fields=True):
    """Which sounds are listed."""

    name: Names = []
    top: Top = 10
    page: Page = 1
    picture: bool = False


class MapQuery(Struct, forbid_unknown_fields=True):
    """A whole map."""

    picture: bool = False


def describe_building(task: WorkInput, query: MapQuery) -> dict[str, Any]:
    """Return the floors with their rooms, and how many things of each name there are."""
    del query
    avlmap, lists = task.map.avlmap, lists_of(task)
    where, things = lists.where, lists.things()
    floors = where.floors_of(_places([room.position for room in where.rooms]))
    thing_floors = where.floors_of(_places([thing["position"] for thing in things]))
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
        "names": _kinds(things),
        "sounds": _kinds([{"name": _first_name(sound)} for sound in lists.sounds()]),
    }


def list_things(task: WorkInput, query: ListThingsQuery) -> dict[str, Any]:
    """Return the things of a room, or near a place, or of a name; a page of them.

    Raises:
        QueryError: there is no such room, or no such thing to be near to.
    """
    lists = lists_of(task)
    where, names = lists.where, _names(query.name)
    unknown = [name for name in names if not task.map.avlmap.knows(name)]
    known = [name for name in names if name not in unknown]
    wanted = Wanted(least=query.least, name=known, structure=query.structure, room=query.room, near=query.near)
    chosen, near = selected(lists, wanted) if known or not names else ([], None)
    about: dict[str, Any] = {"near": near}
    rows = [_thing_row(one, where) for one in chosen]
    if unknown:
        about["note"] = unknown_note(unknown[0])
    if not names and len(rows) > query.top:
        about["names"] = _kinds(rows)
    return _paged(task, "things", rows, query.top, query.page) | about


def list_rooms(task: WorkInput, query: ListRoomsQuery) -> dict[str, Any]:
    """Return the rooms of a floor, each with the number of things in it; a page of them."""
    lists = lists_of(task)
    where = lists.where
    count = Counter(one.room for one in things_with_rooms(lists, Wanted()))
    floors = where.floors_of(_places([room.position for room in where.rooms]))
    if query.floor is not None and not 0 <= query.floor < where.floor_count:
        raise RequestError(f"There is no floor {query.floor}; the map has {where.floor_count}, counted from 0.")
    wanted = range(len(where.rooms))
    if names := _names(query.name):
        known = {room.name.casefold() for room in where.rooms} | {name.casefold() for name in where.names}
        wanted = sorted({k for name in names if name.casefold() in known for k in where.numbers_of(name)})
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


def list_sounds(task: WorkInput, query: ListSoundsQuery) -> dict[str, Any]:
    """Return the sounds with their likeliest names, times and places; a page of them."""
    lists, names = lists_of(task), {name.casefold() for name in _names(query.name)}
    where, sounds = lists.where, lists.sounds()
    rooms = where.rooms_of(_places([sound["position"] for sound in sounds]))
    rows = [
        {
            "name": _first_name(sound),
            "confidence": sound["confidences"][0] if sound["confidences"] else None,
            "onset_s": sound["onset_s"],
            "offset_s": sound["offset_s"],
            "position": sound["position"],
            "room": where.names[room] if room >= 0 else None,
        }
        for sound, room in zip(sounds, rooms.tolist(), strict=True)
        if not names or _first_name(sound).casefold() in names
    ]
    return _paged(task, "sounds", rows, query.top, query.page)


def _thing_row(one: Selected, where: Whereabouts) -> dict[str, Any]:
    return {
        "name": one.thing["name"],
        "confidence": one.thing["confidence"],
        "position": one.thing["position"],
        "size": one.thing["size"],
        "room": where.names[one.room] if one.room >= 0 else None,
        "distance_m": one.away_m,
        "heard": one.thing.get("heard", [])[:_MOST_HEARD] or None,
    }


def _paged(task: WorkInput, key: str, rows: list[dict[str, Any]], top: int, page: int) -> dict[str, Any]:
    shown, pages = page_of(rows, top, page, key)
    paging = {"page": page, "pages": pages} if pages > 1 else {}
    return {"map": task.map.name, "frame": FRAME, "total": len(rows), **paging, key: shown}


def _kinds(rows: Sequence[Any]) -> dict[str, int]:
    """Return how often each name occurs, the most common first; ``other names`` counts the rest."""
    ordered = Counter(row["name"] for row in rows).most_common()
    rest = sum(count for _, count in ordered[_MOST_KINDS:])
    return dict(ordered[:_MOST_KINDS]) | ({"other names": rest} if rest else {})


def _names(name: str | list[str]) -> list[str]:
    return [name] if isinstance(name, str) and name.strip() else list(name) if isinstance(name, list) else []


def _first_name(sound: SoundAnswer) -> str:
    return sound["names"][0] if sound["names"] else "sound"


def _places(positions: Sequence[Sequence[float]]) -> Float[np.ndarray, "m 3"]:
    return np.array(positions, np.float64).reshape(-1, 3)


_Base64 = Annotated[str, Meta(max_length=1 << 26)]
Intrinsics = Annotated[Short | None, Meta(description="fx,fy,cx,cy of another camera than the map's")]
_MOST_MARKS = 20
_LONGEST_PATH = 1000


class AskToolQuery(AskQuery, forbid_unknown_fields=True):
    """A query in words, with a photo or a clip if it speaks of one."""

    sentence: Annotated[Words | None, Meta(description="such as 'a chair near a dog barking', 'how many cups'")] = None
    object: Words | None = None
    sound: Words | None = None
    area: Words | None = None
    primary: Annotated[
        Literal["object", "sound", "image", "area"] | None, Meta(description="the part that is sought")
    ] = None
    top: Annotated[int, Meta(ge=1, le=100)] = 3
    at: Annotated[HeardAt | None, Meta(description="source: where a sound came from, not where it was heard")] = None
    near: Annotated[Short | None, Meta(description="x,y: nearest first")] = None
    intrinsics: Intrinsics = None
    photo: Annotated[_Base64 | None, Meta(description="base64, for 'this photo'")] = None
    clip: Annotated[_Base64 | None, Meta(description="base64, for 'this recording'")] = None
    picture: bool = False


class LocatePhotoQuery(LocateQuery, forbid_unknown_fields=True, kw_only=True):
    """A photo to locate."""

    photo: Annotated[_Base64, Meta(description="base64 of a PNG or JPEG")]
    intrinsics: Intrinsics = None
    picture: bool = False


class DescribePlaceQuery(PlaceQuery, forbid_unknown_fields=True, kw_only=True):
    """A place."""

    x: float
    y: float
    z: Annotated[float | None, Meta(description="without it x, y are in the level frame")] = None
    radius_m: Annotated[float, Meta(gt=0.0, le=5.0)] = 0.15
    picture: bool = False


class LastSeenQuery(Struct, forbid_unknown_fields=True):
    """A thing by its name."""

    thing: Annotated[Words, Meta(description="such as 'red mug'")]
    top: Annotated[int, Meta(ge=1, le=20)] = 3
    picture: bool = False


class GoalNearQuery(Struct, forbid_unknown_fields=True):
    """A query, and a place to be near to."""

    sentence: Annotated[Words, Meta(description="such as 'a chair'")]
    near: Place
    top: Annotated[int, Meta(ge=1, le=20)] = 3
    picture: bool = False


@dataclass(frozen=True, slots=True)
class ToolResult:
    """The outcome of a tool.

    Attributes:
        answer: its JSON.
        picture: a small PNG, or None.
    """

    answer: Any
    picture: bytes | None = None


@dataclass(frozen=True, slots=True)
class AgentTool:
    """One tool.

    Attributes:
        name: as agents call it.
        about: what it does, for agents.
        query: type of its arguments; ``map`` is added.
        work: makes the outcome, in a thread.
        slow: whether it is work for the slow lane.
        read_only: whether it changes nothing, in the map or in the world.
        destructive: whether what it changes cannot be taken back.
    """

    name: str
    about: str
    query: type[Struct]
    work: Callable[[WorkInput, Any], ToolResult]
    slow: bool = False
    read_only: bool = True
    destructive: bool = False


def _bytes_of(task: WorkInput, text: str | None, what: str) -> bytes | None:
    """Return the bytes of a file: of base64, with line breaks or as a data URI too, or of a path where it may be one.

    Raises:
        RequestError: it is neither, or cannot be read.
    """
    if text is None:
        return None
    if task.reads_files and len(text) < _LONGEST_PATH and user_path(text).is_file():
        try:
            return read_regular(user_path(text), task.limits.body_bytes)
        except OSError as fault:
            raise RequestError(f"The {what} {text} cannot be read ({fault.strerror or fault}).", 415, what) from None
    plain = text.partition(",")[2] if text.lstrip().startswith("data:") else text
    try:
        return base64.b64decode("".join(plain.split()), validate=True)
    except (binascii.Error, ValueError):
        also = ", or give the path of a file" if task.reads_files else ""
        raise RequestError(f"The {what} is no base64; send the file's bytes in base64{also}.") from None


def _listed(lists: Callable[[WorkInput, Any], dict[str, Any]], key: str) -> Callable[[WorkInput, Any], ToolResult]:
    """Return the work of a tool that lists things, sounds or rooms, with their places in the picture."""

    def listing(task: WorkInput, query: Any) -> ToolResult:
        answer = lists(task, query)
        return ToolResult(answer, _marked(task, query, [one["position"] for one in answer.get(key, [])]))

    return listing


def _describe_map(task: WorkInput, query: MapQuery) -> ToolResult:
    return ToolResult(describe_building(task, query), _marked(task, query, []))


def _marked(task: WorkInput, query: Any, places: Sequence[Sequence[float]]) -> bytes | None:
    if not query.picture:
        return None
    return small_picture(task.map, places=[np.array(place) for place in places[:_MOST_MARKS]])


def _ask(task: WorkInput, query: AskToolQuery) -> ToolResult:
    task = replace(task, uploads=Uploads(_bytes_of(task, query.photo, "photo"), _bytes_of(task, query.clip, "clip")))
    answer = work.ask_map(task, query)
    return ToolResult(answer.to_dict(), small_picture(task.map, answer) if query.picture else None)


def _locate(task: WorkInput, query: LocatePhotoQuery) -> ToolResult:
    answer = work.locate(replace(task, uploads=Uploads(_bytes_of(task, query.photo, "photo"))), query)
    pose = answer["world_from_camera"]
    at = [] if pose is None else [[row[3] for row in pose[:3]]]
    return ToolResult(answer, _marked(task, query, at))


def _describe_place(task: WorkInput, query: DescribePlaceQuery) -> ToolResult:
    answer = work.place(task, query)
    return ToolResult(answer, _marked(task, query, [answer["position"]]))


def _last_seen(task: WorkInput, query: LastSeenQuery) -> ToolResult:
    answer = last_seen(task.map.avlmap, query.thing, query.top)
    return ToolResult(answer, _marked(task, query, [one["position"] for one in answer["places"]]))


def _goal_near(task: WorkInput, query: GoalNearQuery) -> ToolResult:
    reply = work.ask_map(task, AskQuery(sentence=query.sentence, top=20))
    answer = goals_near(task.map.paths, reply, place_given(query.near), query.top)
    return ToolResult(answer, _marked(task, query, [one["position"] for one in answer["goals"]]))


TOOLS = (
    AgentTool("describe_map", "Start here: floors, kinds of room, and how many things of each name.",
              MapQuery, _describe_map, slow=True),
    AgentTool("list_rooms", "List the rooms, each with the number of its things.",
              ListRoomsQuery, _listed(list_rooms, "rooms"), slow=True),
    AgentTool("list_things", "List the things of a room, near a place, or of a name; total counts them.",
              ListThingsQuery, _listed(list_things, "things"), slow=True),
    AgentTool("list_sounds", "List recorded sounds: name, time, the robot's position then.",
              ListSoundsQuery, _listed(list_sounds, "sounds"), slow=True),
    AgentTool("ask",
              "Find places by a sentence, or by parts (object, sound, area, photo, clip). With found=false goals are "
              "guesses.", AskToolQuery, _ask),
    AgentTool("locate_photo", "Return the pose of the camera that took a photo here.",
              LocatePhotoQuery, _locate, slow=True),
    AgentTool("describe_place", "Return what is at a place: names, kind of room, last seen.",
              DescribePlaceQuery, _describe_place),
    AgentTool("last_seen", "Return where a thing is and when the robot last saw it.",
              LastSeenQuery, _last_seen),
    AgentTool("goal_near", "Return goals by the length of the path from a place, and where to stop.",
              GoalNearQuery, _goal_near, slow=True),
)  # fmt: skip
