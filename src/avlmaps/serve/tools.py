"""The tools of agents: each a type of request, a type of answer, and the work between; all of them only read."""

import base64
import binascii
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, Literal

import numpy as np
from msgspec import Meta, Struct

from avlmaps.core.question import HeardAt
from avlmaps.navigate.paths import goals_near
from avlmaps.query.given_places import place_given
from avlmaps.query.places import last_seen
from avlmaps.serve import agent_lists, work
from avlmaps.serve.agent_lists import ListRoomsQuery, ListSoundsQuery, ListThingsQuery, MapQuery, Place
from avlmaps.serve.errors import RequestError
from avlmaps.serve.pictures import small_picture
from avlmaps.serve.requests import AskQuery, LocateQuery, PlaceQuery, Short, Words
from avlmaps.serve.uploads import Uploads
from avlmaps.serve.work import WorkInput

_Base64 = Annotated[str, Meta(max_length=1 << 26)]
Intrinsics = Annotated[Short | None, Meta(description="fx,fy,cx,cy of another camera than the map's")]
_MOST_MARKS = 20


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


def _bytes_of(text: str | None, what: str) -> bytes | None:
    if text is None:
        return None
    try:
        return base64.b64decode(text, validate=True)
    except (binascii.Error, ValueError):
        raise RequestError(f"The {what} is no base64; send the file's bytes in base64.") from None


def _listed(lists: Callable[[WorkInput, Any], dict[str, Any]], key: str) -> Callable[[WorkInput, Any], ToolResult]:
    """Return the work of a tool that lists things, sounds or rooms, with their places in the picture."""

    def listing(task: WorkInput, query: Any) -> ToolResult:
        answer = lists(task, query)
        return ToolResult(answer, _marked(task, query, [one["position"] for one in answer.get(key, [])]))

    return listing


def _describe_map(task: WorkInput, query: MapQuery) -> ToolResult:
    return ToolResult(agent_lists.describe_building(task, query), _marked(task, query, []))


def _marked(task: WorkInput, query: Any, places: Sequence[Sequence[float]]) -> bytes | None:
    """Return a picture of some places where the query wants one."""
    if not query.picture:
        return None
    return small_picture(task.map, places=[np.array(place) for place in places[:_MOST_MARKS]])


def _ask(task: WorkInput, query: AskToolQuery) -> ToolResult:
    task = replace(task, uploads=Uploads(_bytes_of(query.photo, "photo"), _bytes_of(query.clip, "clip")))
    answer = work.ask_map(task, query)
    return ToolResult(answer.to_dict(), small_picture(task.map, answer) if query.picture else None)


def _locate(task: WorkInput, query: LocatePhotoQuery) -> ToolResult:
    answer = work.locate(replace(task, uploads=Uploads(_bytes_of(query.photo, "photo"))), query)
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
              ListRoomsQuery, _listed(agent_lists.list_rooms, "rooms"), slow=True),
    AgentTool("list_things", "List the things of a room, near a place, or of a name; total counts them.",
              ListThingsQuery, _listed(agent_lists.list_things, "things"), slow=True),
    AgentTool("list_sounds", "List recorded sounds: name, time, the robot's position then.",
              ListSoundsQuery, _listed(agent_lists.list_sounds, "sounds"), slow=True),
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
