"""The tools of agents: each a type of request, a type of answer, and the work between; all of them only read."""

import base64
import binascii
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np
from msgspec import Meta, Struct

from avlmaps.navigate.paths import NearGoalsAnswer, goals_near
from avlmaps.query.places import LastSeenAnswer, PlaceAnswer, last_seen
from avlmaps.query.schema import LocateAnswer, QueryAnswer
from avlmaps.serve import work
from avlmaps.serve.errors import RequestError
from avlmaps.serve.pictures import small_picture
from avlmaps.serve.requests import AskQuery, LocateQuery, NoQuery, PlaceQuery, RoomsQuery, ThingsQuery, Words, place_of
from avlmaps.serve.uploads import Uploads
from avlmaps.serve.work import Task

_Base64 = Annotated[str, Meta(description="base64 of a file's bytes; paths are not read", max_length=1 << 26)]


class AskToolQuery(AskQuery, forbid_unknown_fields=True):
    """A query in words, with a photo or a clip if it speaks of one."""

    photo: Annotated[_Base64 | None, Meta(description="PNG or JPEG in base64, for 'this photo'.")] = None
    clip: Annotated[_Base64 | None, Meta(description="Sound file in base64, for 'this recording'.")] = None
    picture: Annotated[bool, Meta(description="Return a small top-down picture of the heat and the goals.")] = True


class LocatePhotoQuery(LocateQuery, forbid_unknown_fields=True, kw_only=True):
    """A photo to locate."""

    photo: Annotated[_Base64, Meta(description="PNG or JPEG in base64.")]


class LastSeenQuery(Struct, forbid_unknown_fields=True):
    """A thing by its name."""

    thing: Annotated[Words, Meta(description="Such as 'red mug'.")]
    top: Annotated[int, Meta(ge=1, le=20, description="Most places.")] = 3


class GoalNearQuery(Struct, forbid_unknown_fields=True):
    """A query, and a place to be near to."""

    sentence: Annotated[Words, Meta(description="The query in words, such as 'a chair' or 'the sound of water'.")]
    near: Annotated[str, Meta(max_length=100, description="x,y,z in the recording frame, or x,y of the floor plan.")]
    top: Annotated[int, Meta(ge=1, le=20, description="Most goals.")] = 3


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
        title: for people.
        about: what it does, for agents.
        query: type of its arguments; ``map`` is added.
        answer: type of its answer.
        work: makes the outcome, in a thread.
        slow: whether it is work for the slow lane.
        read_only: whether it changes nothing, in the map or in the world.
        destructive: whether what it changes cannot be taken back.
    """

    name: str
    title: str
    about: str
    query: type[Struct]
    answer: Any
    work: Callable[[Task, Any], ToolResult]
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


def _list_things(task: Task, query: ThingsQuery) -> ToolResult:
    answer = work.list_things(task, query)
    return ToolResult(
        answer, small_picture(task.map, places=[np.array(one["position"]) for one in answer["things"][:20]])
    )


def _list_sounds(task: Task, query: NoQuery) -> ToolResult:
    answer = work.list_sounds(task, query)
    return ToolResult(
        answer, small_picture(task.map, places=[np.array(one["position"]) for one in answer["sounds"][:20]])
    )


def _list_rooms(task: Task, query: RoomsQuery) -> ToolResult:
    answer = work.list_rooms(task, query)
    return ToolResult(
        answer, small_picture(task.map, places=[np.array(one["position"]) for one in answer["rooms"][:20]])
    )


def _ask(task: Task, query: AskToolQuery) -> ToolResult:
    task = replace(task, uploads=Uploads(_bytes_of(query.photo, "photo"), _bytes_of(query.clip, "clip")))
    answer = work.ask_map(task, query)
    return ToolResult(answer.to_dict(), small_picture(task.map, answer) if query.picture else None)


def _locate(task: Task, query: LocatePhotoQuery) -> ToolResult:
    answer = work.locate(replace(task, uploads=Uploads(_bytes_of(query.photo, "photo"))), query)
    pose = answer["world_from_camera"]
    at = [] if pose is None else [np.array([row[3] for row in pose[:3]])]
    return ToolResult(answer, small_picture(task.map, places=at))


def _describe_place(task: Task, query: PlaceQuery) -> ToolResult:
    answer = work.place(task, query)
    return ToolResult(answer, small_picture(task.map, places=[np.array(answer["position"])]))


def _last_seen(task: Task, query: LastSeenQuery) -> ToolResult:
    answer = last_seen(task.map.avlmap, query.thing, query.top)
    return ToolResult(answer, small_picture(task.map, places=[np.array(one["position"]) for one in answer["places"]]))


def _goal_near(task: Task, query: GoalNearQuery) -> ToolResult:
    reply = work.ask_map(task, AskQuery(sentence=query.sentence, top=20))
    answer = goals_near(task.map.paths, reply, place_of(query.near), query.top)
    return ToolResult(answer, small_picture(task.map, places=[np.array(one["position"]) for one in answer["goals"]]))


TOOLS = (
    AgentTool("list_things", "List things", "List the things of a map with confidence, position and size.",
              ThingsQuery, work.ThingsAnswer, _list_things, slow=True),
    AgentTool("list_sounds", "List sounds", "List the sounds that the robot recorded, with names, times and positions.",
              NoQuery, work.SoundsAnswer, _list_sounds, slow=True),
    AgentTool("list_rooms", "List rooms", "List the rooms of a map with confidence and position.",
              RoomsQuery, work.RoomsAnswer, _list_rooms, slow=True),
    AgentTool("ask", "Query the map",
              "Find places by a sentence ('the chair near the sound of a dog', 'how many chairs are in the kitchen') "
              "or by parts (object, sound, area, photo, clip). Goals are ranked; with found=false they are guesses.",
              AskToolQuery, QueryAnswer, _ask),
    AgentTool("locate_photo", "Locate a photo", "Return the pose of the camera that took a photo in this building.",
              LocatePhotoQuery, LocateAnswer, _locate, slow=True),
    AgentTool("describe_place", "What is here?",
              "Return the likeliest names of what is at a place, when it was last seen, and the kind of room.",
              PlaceQuery, PlaceAnswer, _describe_place),
    AgentTool("last_seen", "When was it last seen?", "Return where a thing is and when the robot last saw it.",
              LastSeenQuery, LastSeenAnswer, _last_seen),
    AgentTool("goal_near", "Nearest goal",
              "Return the goals of a query by the length of the path from a place, with the point where a robot stops.",
              GoalNearQuery, NearGoalsAnswer, _goal_near, slow=True),
)  # fmt: skip
