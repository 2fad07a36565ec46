"""The JSON answers about a map: one schema for the command line, the server and agents.

Each ``TypedDict`` is one JSON object. The command line prints these objects under ``--json``; the server derives its
OpenAPI document and the schemas of its agent tools from the same types. Positions are metres in the frame that
``frame`` names.
"""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any, NotRequired, TypedDict, TypeVar, cast

from msgspec import Meta

from avlmaps.core.poses import FRAME

if TYPE_CHECKING:
    from avlmaps.query.avlmap import AVLMap
    from avlmaps.query.locate import Located

T = TypeVar("T")


_DECIMALS = 4


def row_of(value: object, schema: type[T], **given: Any) -> T:
    """Return a value's attributes as a JSON object of a schema; None and "" only where it requires the key."""
    row: dict[str, Any] = {}
    optional: frozenset[str] = cast(Any, schema).__optional_keys__
    for key in cast(Any, schema).__annotations__:
        one = given[key] if key in given else getattr(value, key, None)
        if key not in optional or not (one is None or (isinstance(one, str | tuple | list) and not one)):
            row[key] = _short(one)
    return cast(T, row)


def _short(value: Any) -> Any:
    if isinstance(value, float):
        return round(value, _DECIMALS)
    if isinstance(value, dict):
        return {key: _short(one) for key, one in cast("dict[Any, Any]", value).items()}
    if isinstance(value, list | tuple):  # the rows of a matrix stay as they are
        return [one if isinstance(one, list) else _short(one) for one in cast("Sequence[Any]", value)]
    return value


Position = Annotated[list[float], Meta(min_length=3, max_length=3, description="x, y, z in metres, recording frame")]
Size = Annotated[
    list[float],
    Meta(min_length=3, max_length=3, description="extent in metres along the level frame's x, y (horizontal) and z"),
]
Unit = Annotated[float, Meta(ge=0.0, le=1.0)]
Matrix = Annotated[
    list[Annotated[list[float], Meta(min_length=4, max_length=4)]],
    Meta(min_length=4, max_length=4, description="4x4 transform, row by row"),
]
Frame = Annotated[str, Meta(description="the frame of the positions: recording")]
Storey = Annotated[int, Meta(description="of a map of several: counted from 0, the lowest")]
Edited = Annotated[str, Meta(description="who corrected it and when, such as: named by a person on 2026-11-26")]
Notes = Annotated[list[str], Meta(description="why the map may be wrong, one sentence each")]


class DayAnswer(TypedDict):
    """A day on which a map was seen."""

    visit: Annotated[int, Meta(description="counted from 1, the first")]
    day: Annotated[str | None, Meta(description="such as 2026-11-25; null where nobody said")]
    stamp_s: NotRequired[Annotated[float, Meta(description="seconds, by the clock of that day's recording")]]


class UsualAnswer(TypedDict):
    """On how many days something was at a place."""

    there: Annotated[int, Meta(description="days on which it was seen there")]
    looked: Annotated[int, Meta(description="days on which the place was looked at")]


class GoalAnswer(TypedDict):
    """One distinct place that answers a query."""

    position: Position
    score: Annotated[float, Meta(ge=0.0, le=1.0, description="heat there times the confidence of the thing there")]
    size: Size
    parts: Annotated[dict[str, float], Meta(description="heat of each part there, by modality")]
    probability: Annotated[float, Meta(ge=0.0, le=1.0, description="that it is right, all parts together")]
    name: NotRequired[Annotated[str, Meta(description="what is there, in an answer from the lists of a map")]]
    within_50_m: NotRequired[
        Annotated[float, Meta(description="of the source of a sound: radius that holds it with probability 0.5")]
    ]
    within_90_m: NotRequired[Annotated[float, Meta(description="with 0.9")]]
    storey: NotRequired[Storey]
    when: NotRequired[
        Annotated[DayAnswer, Meta(description="of a map of several days: when it was last seen, or the change noticed")]
    ]
    usual: NotRequired[UsualAnswer]


class PartOutcome(TypedDict):
    """One part of a query and its outcome."""

    modality: Annotated[str, Meta(description="object, sound, area or image")]
    query: str
    role: Annotated[str, Meta(description="primary (sought) or context (says where it is)")]
    peak: Annotated[float, Meta(description="its highest heat anywhere, no probability")]
    found: bool
    understood: Annotated[str, Meta(description="the words that the encoder acts on")]
    note: Annotated[str, Meta(description="why it is not found, or empty")]
    probability: Annotated[float, Meta(ge=0.0, le=1.0, description="that the map holds it")]
    at: NotRequired[Annotated[str, Meta(description="source: of a sound the place where it came from is meant")]]


class AlternativeAnswer(TypedDict):
    """Another thing that a sentence may mean, and its outcome."""

    query: str
    probability: Unit
    found: bool
    goals: Annotated[list[GoalAnswer], Meta(description="the best one")]


class QueryAnswer(TypedDict):
    """Goals of a query, best first. With ``found`` false they are guesses."""

    goals: list[GoalAnswer]
    found: bool
    probability: Annotated[float, Meta(ge=0.0, le=1.0, description="that the first goal is right, all parts together")]
    text: Annotated[str, Meta(description="the answer in one sentence")]
    parts: list[PartOutcome]
    elapsed_ms: float
    frame: Frame
    level_from_recording: Matrix | None
    notes: NotRequired[Annotated[list[str], Meta(description="how words were read; why the map may be wrong")]]
    count: NotRequired[Annotated[int, Meta(description="how many things, sounds or rooms, where a sentence asks that")]]
    alike: NotRequired[Annotated[int, Meta(description="places that fit as well as the likeliest, if several do")]]
    alternatives: NotRequired[
        Annotated[list[AlternativeAnswer], Meta(description="the other things that the sentence may mean")]
    ]
    plot: NotRequired[str]


class HeardFromAnswer(TypedDict):
    """A sound that may have come from a thing."""

    sound: str
    probability: Annotated[float, Meta(ge=0.0, le=1.0, description="of the name, times that the thing is its source")]
    onset_s: Annotated[float, Meta(description="seconds from the start of the recording; the last of several")]
    when: NotRequired[Annotated[DayAnswer, Meta(description="of a map of several days")]]


class ThingAnswer(TypedDict):
    """One thing of a map."""

    name: str
    confidence: Unit
    position: Position
    size: Size
    color: Annotated[list[int], Meta(min_length=3, max_length=3, description="mean RGB, 0 to 255")]
    voxels: int
    storey: NotRequired[Storey]
    room: NotRequired[Annotated[str | None, Meta(description="the room that it is in")]]
    edited: NotRequired[Edited]
    heard: NotRequired[
        Annotated[list[HeardFromAnswer], Meta(description="sounds that may have come from it, likeliest first")]
    ]


# Functional, because one key is a word of Python.
ChangeAnswer = TypedDict(
    "ChangeAnswer",
    {
        "kind": Annotated[str, Meta(description="new, gone, moved, or first seen (nobody had looked there before)")],
        "name": str,
        "confidence": Unit,
        "position": Position,
        "from": Annotated[Position | None, Meta(description="where it was before it moved")],
        "room": str | None,
        "size": Size,
        "noticed": DayAnswer,
        "last_seen": DayAnswer,
        "first_seen": DayAnswer,
    },
)


class ChangesAnswer(TypedDict):
    """What changed in a map since a day."""

    map: str
    frame: Frame
    since: DayAnswer
    days: list[DayAnswer]
    changes: list[ChangeAnswer]
    unknown: Annotated[int, Meta(description="things whose place nobody has looked at since they were seen")]
    text: NotRequired[Annotated[str, Meta(description="the answer in one sentence")]]


class LastSeenPlace(TypedDict):
    """Where a thing was last seen, and when."""

    name: str
    position: Position
    room: str | None
    confidence: Unit
    last_seen: DayAnswer
    gone: Annotated[DayAnswer | None, Meta(description="the day on which its place was looked through")]
    looked: Annotated[DayAnswer, Meta(description="the last day on which its place was looked at")]


class LastSeenAnswer(TypedDict):
    """Where things of a name were last seen: those that are there still first, then the latest."""

    name: str
    frame: Frame
    last_day: Annotated[DayAnswer, Meta(description="the last day on which the map was seen at all")]
    seen: list[LastSeenPlace]
    text: NotRequired[Annotated[str, Meta(description="the answer in one sentence")]]


class EditAnswer(TypedDict):
    """One correction by a person."""

    id: Annotated[str, Meta(description="by which it is undone")]
    does: Annotated[str, Meta(description="rename, rename room, merge, split, forbid, pin or undo")]
    name: Annotated[str, Meta(description="the new name, or that of an area or place")]
    of: Annotated[list[str], Meta(description="what it is about was called; of an undo, the edit that is undone")]
    position: Annotated[Position | None, Meta(description="of what it is about, as it was then")]
    by: Annotated[str, Meta(description="who made it; empty where nobody said")]
    made: Annotated[str, Meta(description="when, ISO 8601, UTC")]
    state: Annotated[
        str,
        Meta(description="applied, moved (a pin by a later one), undone, undo, or lost: it finds nothing to apply to"),
    ]
    why: NotRequired[Annotated[str, Meta(description="it finds nothing to apply to")]]


class EditsAnswer(TypedDict):
    """All corrections of a map, the oldest first."""

    map: str
    edits: list[EditAnswer]
    text: NotRequired[Annotated[str, Meta(description="what the last edit did, in one sentence")]]


class ListedThing(ThingAnswer):
    """A thing, with its distance where that is queried."""

    distance_m: NotRequired[float]


class NearAnswer(TypedDict):
    """The thing that others are near to."""

    name: str
    confidence: Unit
    position: Position


class SoundAnswer(TypedDict):
    """One sound of a map; the position is that of the robot at the time."""

    names: Annotated[list[str], Meta(description="likeliest names, best first; empty without a list of names")]
    confidences: list[float]
    onset_s: Annotated[float, Meta(description="seconds from the start of the recording")]
    offset_s: float
    position: Position
    clip: Annotated[str, Meta(description="file name of the clip")]
    storey: NotRequired[Storey]


class ThingName(TypedDict):
    """A thing that a sound may come from."""

    name: str
    position: Position
    probability: Unit


class SourceAnswer(TypedDict):
    """A place that sounds came from."""

    name: Annotated[str, Meta(description="what it sounds like; empty without a list of names")]
    confidence: Annotated[float, Meta(ge=0.0, le=1.0, description="that a sound of it is one")]
    probability: Annotated[float, Meta(ge=0.0, le=1.0, description="that a goal at the position is right")]
    position: Annotated[Position, Meta(description="likeliest place")]
    within_50_m: Annotated[float, Meta(description="radius on the plan that holds it with a probability of 0.5")]
    within_90_m: Annotated[float, Meta(description="of 0.9")]
    area_50_m2: Annotated[float, Meta(description="of the smallest region that holds it with a probability of 0.5")]
    area_90_m2: Annotated[float, Meta(description="of 0.9")]
    rooms: Annotated[list["RoomName"], Meta(description="rooms that it may be in, likeliest first")]
    things: Annotated[list[ThingName], Meta(description="things that it may be, likeliest first")]
    sounds: Annotated[list[int], Meta(description="numbers of its sounds in the map, from 0")]
    moving: Annotated[bool, Meta(description="whether it moved while it sounded")]
    microphones: Annotated[int, Meta(description="how many listened")]


class SourcesAnswer(TypedDict):
    """Where the sounds of a map came from."""

    map: str
    frame: Frame
    sources: list[SourceAnswer]


class RoomName(TypedDict):
    """A kind of room that a room may be, or the room that something may be in."""

    name: str
    probability: Unit


class RoomAnswer(TypedDict):
    """One room of a map: what walls and doorways bound."""

    name: Annotated[str, Meta(description="kind of room")]
    room: Annotated[str, Meta(description="its own name: the kind, and a number where there are several of a kind")]
    parts: NotRequired[
        Annotated[list[str], Meta(description="of an open plan: the own names of its parts, as things have them")]
    ]
    confidence: Unit
    position: Position
    views: Annotated[int, Meta(description="number of keyframes that show it")]
    storey: NotRequired[Storey]
    probability: Annotated[float, Meta(ge=0.0, le=1.0, description="of the name")]
    names: Annotated[list[RoomName], Meta(description="kinds that it may be, best first; or those of its parts")]
    area_m2: Annotated[float, Meta(description="of its floor")]
    outline: Annotated[list[Position], Meta(description="corners on its floor, counter-clockwise from above")]
    edited: NotRequired[Edited]


class ContentsAnswer(TypedDict):
    """Things, sounds and rooms of a map."""

    map: str
    frame: Frame
    things: list[ThingAnswer]
    sounds: list[SoundAnswer]
    rooms: list[RoomAnswer]
    notes: NotRequired[Notes]


class RoomsAnswer(TypedDict):
    """Rooms of a map, those with most views first."""

    map: str
    frame: Frame
    rooms: list[RoomAnswer]
    notes: NotRequired[Notes]


class LocateAnswer(TypedDict):
    """The camera pose of a photo, or null where the photo cannot be located."""

    world_from_camera: Matrix | None
    heading_deg: Annotated[float | None, Meta(description="where it looks, from +x to the left in the level frame")]
    room: Annotated[str | None, Meta(description="name of the room that it stands in")]
    inliers: Annotated[int, Meta(description="keypoints that agree with the pose")]
    reference: Annotated[float | None, Meta(description="time of the keyframe with most of them, seconds")]
    frame: Frame
    score: Unit
    intrinsics: Annotated[
        list[float], Meta(min_length=4, max_length=4, description="fx, fy, cx, cy that the pose holds for, pixels")
    ]
    focal_from: Annotated[str, Meta(description="source of the focal length: map, given, exif, assumed or photo")]
    position_error_m: Annotated[
        float | None, Meta(description="three standard deviations of the place, if the focal length was found with it")
    ]
    elapsed_ms: float
    notes: NotRequired[Notes]


class ErrorDetail(TypedDict):
    """The kind of an error, for programs, and one sentence, for people."""

    kind: str
    message: str
    choices: NotRequired[Annotated[list[str], Meta(description="answers that would do, where a query is unclear")]]


class ErrorAnswer(TypedDict):
    """An error."""

    error: ErrorDetail


def locate_answer(located: "Located", avlmap: "AVLMap") -> LocateAnswer:
    """Return the answer about a photo, with what is doubtful about the map and the photo's focal length."""
    pose, camera, error = located.world_from_camera, located.camera, located.uncertainty
    place = None if pose is None else pose[:3, 3].tolist()
    ahead = None if pose is None else avlmap.space.level_from_recording[:2, :3] @ pose[:3, 2]
    answer: LocateAnswer = {
        "world_from_camera": None if pose is None else pose.tolist(),
        "heading_deg": None if ahead is None else round(math.degrees(math.atan2(ahead[1], ahead[0])), 1),
        "room": None if place is None else avlmap.where.name_of(place),
        "inliers": int(located.inliers),
        "reference": located.reference_stamp_s,
        "frame": FRAME,
        "score": located.score,
        "intrinsics": [camera.fx, camera.fy, camera.cx, camera.cy],
        "focal_from": located.focal_from,
        "position_error_m": None if error is None or not math.isfinite(error.place_m) else error.place_m,
        "elapsed_ms": located.elapsed_ms,
    }
    if notes := [*avlmap.data.info.doubts, *located.notes]:
        answer["notes"] = notes
    return answer
