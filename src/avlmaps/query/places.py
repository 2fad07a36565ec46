"""Places: as people give them (x,y,z of the recording's frame or x,y of the level one), and what is at one."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any, TypedDict, cast

import numpy as np
from msgspec import Meta

from avlmaps.core.arrays import Bool, Float, Int
from avlmaps.core.errors import AskError, QueryError
from avlmaps.core.poses import FRAME, FrameName, apply
from avlmaps.core.question import Modality, Part, Role
from avlmaps.core.registry import Kind
from avlmaps.core.wording import coordinates
from avlmaps.query.factors import NearThings
from avlmaps.query.schema import Frame, Position
from avlmaps.query.words import VoxelNamer, keyframes_that_saw

if TYPE_CHECKING:
    from avlmaps.query.avlmap import AVLMap
    from avlmaps.query.voxel_space import Space


def place_of(text: str) -> Float[np.ndarray, " n"]:
    """Return the two or three numbers of a place. ``AskError``: they are not."""
    try:
        numbers = [float(word) for word in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in (2, 3) or not all(math.isfinite(one) and abs(one) <= 1e6 for one in numbers):
        raise AskError(f"A place is x,y or x,y,z in metres, such as 1.5,2.0; not {text[:80]!r}.")
    return np.array(numbers)


def place_given(place: str | Sequence[float]) -> Float[np.ndarray, " n"]:
    """Return the numbers of a place that comes as a text or as a list. ``AskError``: they are no two or three."""
    return place_of(",".join(map(str, place)) if not isinstance(place, str) and np.iterable(place) else str(place))


def distance_m(level: Callable[[Any], np.ndarray], point: Sequence[float], place: Float[np.ndarray, " n"]) -> float:
    """Return how far a point (recording frame) lies from a place: in space, or level where that has no height."""
    here = np.array(point)
    return math.dist(here, place) if len(place) == 3 else math.dist(level(here)[:2], place)


def is_place(near: str | Sequence[float]) -> bool:
    """Return whether what things are near to is meant as a place rather than as the name of a thing."""
    return not isinstance(near, str) or not any(letter.isalpha() for letter in near)


class Box:
    """The upright box of a thing, level frame, metres."""

    def __init__(self, space: "Space", position: Sequence[float], size: Sequence[float]) -> None:
        self.middle, self.size = space.level(np.array(position)), np.array(size)

    def gap_m(self, other: "Box") -> float:
        """Return how far another box is, top-down; 0 where they meet."""
        apart = np.abs(self.middle - other.middle)[:2] - (self.size + other.size)[:2] / 2.0
        return float(np.linalg.norm(np.maximum(apart, 0.0)))

    def overlaps(self, other: "Box") -> bool:
        """Return whether each holds the middle of the other: they are one thing."""
        return bool((np.abs(self.middle - other.middle) < np.minimum(self.size, other.size) / 2.0).all())


_ASIDE_M = 0.5  # how far from the line between two things what is between them may lie


def lies_between(
    at: Float[np.ndarray, "n 2"], one: Float[np.ndarray, "2"], other: Float[np.ndarray, "2"]
) -> Bool[np.ndarray, " n"]:
    """Return which places lie between two others, top-down: near the line from one to the other, level x and y."""
    along = other - one
    length_m = max(float(np.linalg.norm(along)), 1e-9)
    share = (at - one) @ along / length_m**2
    aside_m = np.abs((at - one) @ np.array([-along[1], along[0]])) / length_m
    return (share > 0.0) & (share < 1.0) & (aside_m <= max(length_m / 4.0, _ASIDE_M))


MOST_NAMES = 5
_MOST_VIEWS = 5
_BESIDE_M = 1.0  # how far outside of the map a place may lie that is in a room
FARTHEST_M = 2e6
"""A place farther away than this, metres, is a mistake; coordinates of requests reach half of it along each axis."""


class NameScore(TypedDict):
    """A name and its confidence."""

    name: str
    confidence: Annotated[float, Meta(ge=0.0, le=1.0)]


class ViewOfPlace(TypedDict):
    """A keyframe whose camera saw the place."""

    time_s: float
    camera: Position
    distance_m: float


class PlaceAnswer(TypedDict):
    """What is at a place."""

    position: Annotated[Position, Meta(description="the place that was queried, on the voxel nearest to it")]
    known: Annotated[bool, Meta(description="whether any voxel lies within the radius")]
    voxels: Annotated[int, Meta(description="voxels within the radius")]
    distance_m: Annotated[float | None, Meta(description="from the place to the nearest voxel")]
    names: Annotated[list[NameScore], Meta(description="what the voxels are taken for, best first")]
    color: Annotated[list[int] | None, Meta(description="mean RGB of the voxels, 0 to 255")]
    last_seen_s: Annotated[float | None, Meta(description="seconds from the start of the recording")]
    hits: Annotated[int, Meta(description="number of pixels that fell into the voxels")]
    rooms: Annotated[list[NameScore], Meta(description="kinds of room that the place is, best first")]
    views: Annotated[list[ViewOfPlace], Meta(description="keyframes that saw the voxel nearest to it, nearest first")]
    frame: Frame


def voxels_near(avlmap: "AVLMap", point: Float[np.ndarray, "3"], radius_m: float) -> Int[np.ndarray, " m"]:
    """Return the voxels whose middles lie within a radius of a point, nearest first."""
    centres = avlmap.space.centres
    if not len(centres):
        return np.zeros(0, np.int64)
    squared = np.square(centres - point).sum(axis=1)
    rows = np.flatnonzero(squared <= radius_m**2)
    return rows[np.argsort(squared[rows], kind="stable")]


def column_point(avlmap: "AVLMap", level_xy: Float[np.ndarray, "2"], radius_m: float) -> Float[np.ndarray, "3"] | None:
    """Return the place on the highest voxel under head height of a column, recording frame; None if empty."""
    space = avlmap.space
    level = space.level(space.centres)
    rows = np.flatnonzero(np.square(level[:, :2] - level_xy).sum(axis=1) <= radius_m**2)
    cameras = space.level(np.asarray(avlmap.data.keyframes.world_from_camera)[:, :3, 3])
    if len(cameras) and len(rows):
        below = rows[level[rows, 2] <= cameras[:, 2].max() + 0.3]
        rows = below if len(below) else rows
    return space.centres[rows[np.argmax(level[rows, 2])]] if len(rows) else None


def describe_place(avlmap: "AVLMap", point: Float[np.ndarray, "3"], radius_m: float = 0.15) -> PlaceAnswer:
    """Return the content of a map at a point, metres, recording frame. ``QueryError``: it is no point, or too wide."""
    if not (np.isfinite(point).all() and np.abs(point).max(initial=0.0) <= FARTHEST_M):
        raise QueryError("The place is not a point in metres; give finite numbers, such as 1.5,2.0,0.8.")
    if not 0.0 < radius_m <= 5.0:
        raise QueryError(f"The radius is {radius_m:g} m; it must be over 0 and at most 5.")
    rows = voxels_near(avlmap, point, radius_m)
    voxels, centres = avlmap.data.voxels, avlmap.space.centres
    away = float(np.linalg.norm(centres[rows[0]] - point)) if len(rows) else None
    at = centres[rows[0]] if len(rows) else point
    seen = float(np.asarray(voxels.last_seen_s)[rows].max()) if len(rows) else None
    color = np.asarray(voxels.rgb)[rows].mean(axis=0).round().astype(int).tolist() if len(rows) else None
    return {
        "position": [float(value) for value in at],
        "known": bool(len(rows)),
        "voxels": len(rows),
        "distance_m": away,
        "names": _names(avlmap, rows),
        "color": color,
        "last_seen_s": seen,
        "hits": int(np.asarray(voxels.hits)[rows].sum()),
        "rooms": _rooms(avlmap, point),
        "views": _views(avlmap, int(rows[0])) if len(rows) else [],
        "frame": FRAME,
    }


def _names(avlmap: "AVLMap", rows: Int[np.ndarray, " m"]) -> list[NameScore]:
    if not len(rows) or not avlmap.has(Kind.PIXELS):
        return []
    namer, said = VoxelNamer(avlmap), avlmap.edited.named_at(rows)
    own: list[NameScore] = [] if said is None else [{"name": said, "confidence": 1.0}]
    confidence = namer.confidences(rows)
    some = confidence[confidence.any(axis=1)]
    if not len(some):
        return own
    mean = some.mean(axis=0)
    order = [i for i in np.argsort(-mean, kind="stable") if namer.names[i] != "other"][:MOST_NAMES]
    seen: list[NameScore] = [{"name": namer.names[i], "confidence": round(float(mean[i]), 3)} for i in order]
    return [*own, *seen][:MOST_NAMES]


def _rooms(avlmap: "AVLMap", point: Float[np.ndarray, "3"]) -> list[NameScore]:
    field = avlmap.room_field if avlmap.has(Kind.VIEWS) else None
    if field is None:
        return []
    space = avlmap.space
    here, map_xy = space.level(point)[:2], space.level_centres()[:, :2]
    if (here < map_xy.min(axis=0) - _BESIDE_M).any() or (here > map_xy.max(axis=0) + _BESIDE_M).any():
        return []
    share = field.at(point[None])[0].astype(np.float64)
    order = np.argsort(-share, kind="stable")[:3]
    return [{"name": field.kinds[i], "confidence": round(float(np.clip(share[i], 0.0, 1.0)), 3)} for i in order]


def _views(avlmap: "AVLMap", row: int) -> list[ViewOfPlace]:
    keyframes = avlmap.data.keyframes
    point = avlmap.space.centres[row]
    cameras = np.asarray(keyframes.world_from_camera, np.float64)[:, :3, 3]
    return [
        {
            "time_s": float(keyframes.stamp_s[k]),
            "camera": [float(value) for value in cameras[k]],
            "distance_m": float(np.linalg.norm(point - cameras[k])),
        }
        for k in keyframes_that_saw(avlmap, avlmap.space, row)[:_MOST_VIEWS]
    ]


class SeenPlace(TypedDict):
    """One place of a thing, and when it was seen there."""

    position: Position
    score: Annotated[float, Meta(ge=0.0, le=1.0)]
    probability: Annotated[float, Meta(ge=0.0, le=1.0, description="that it is the thing")]
    last_seen_s: Annotated[float, Meta(description="seconds from the start of the recording")]
    before_end_s: Annotated[float, Meta(description="seconds before the end of the recording")]


class LastSeenAnswer(TypedDict):
    """Where a thing is and when it was last seen there, most confident first."""

    thing: str
    found: bool
    places: list[SeenPlace]
    note: Annotated[str, Meta(description="why it is not found, or empty")]
    frame: Frame


def last_seen(avlmap: "AVLMap", thing: str, top: int = 3) -> LastSeenAnswer:
    """Return when a thing was last seen: the latest time of any voxel of each of its instances."""
    heat = avlmap.heat(Part(Modality.OBJECT, thing, Role.PRIMARY))
    factor = heat.factors[0]
    stamps = np.asarray(avlmap.data.voxels.last_seen_s)
    end_s = avlmap.data.info.recording.duration_s
    places: list[SeenPlace] = []
    if isinstance(factor, NearThings) and len(factor.anchors):
        rows = np.flatnonzero(factor.mask)
        for goal in heat.goals(top):
            nearest = int(np.argmin(np.square(factor.anchors - np.array(goal.position)).sum(axis=1)))
            seen = float(stamps[rows[factor.instance == factor.instance[nearest]]].max())
            places.append({
                "position": list(goal.position), "score": goal.score, "probability": goal.probability,
                "last_seen_s": seen, "before_end_s": max(end_s - seen, 0.0),
            })  # fmt: skip
    return {"thing": thing, "found": heat.found, "places": places, "note": factor.note, "frame": FRAME}


def answer_in(answer: Mapping[str, Any], frame: FrameName, level_from_recording: Float[np.ndarray, "4 4"]) -> Any:
    """Return an answer of the recording's frame with all positions, poses and texts about them in a frame."""
    if frame is FrameName.RECORDING:
        return dict(answer)
    spoken: dict[str, str] = {}
    turned = _turned(answer, np.asarray(level_from_recording, np.float64), spoken)
    return _spoken(turned, spoken) | {"frame": str(frame)}


def _turned(value: Any, level_from_recording: Float[np.ndarray, "4 4"], spoken: dict[str, str]) -> Any:
    if isinstance(value, Mapping):
        entries = cast("Mapping[str, Any]", value)
        return {key: _moved(key, one, level_from_recording, spoken) for key, one in entries.items()}
    if isinstance(value, list):
        return [_turned(one, level_from_recording, spoken) for one in cast("list[Any]", value)]
    return value


def _moved(key: str, value: Any, level_from_recording: Float[np.ndarray, "4 4"], spoken: dict[str, str]) -> Any:
    if key == "position" and value is not None:
        point = apply(level_from_recording, np.array([value], np.float64))[0]
        spoken[_words(value)] = _words(point)
        return [float(number) for number in point]
    if key == "outline" and value:
        return apply(level_from_recording, np.array(value, np.float64)).round(3).tolist()
    if key == "world_from_camera" and value is not None:
        return (level_from_recording @ np.array(value, np.float64)).tolist()
    return _turned(value, level_from_recording, spoken)


def _spoken(answer: dict[str, Any], spoken: Mapping[str, str]) -> dict[str, Any]:
    def said(text: str) -> str:
        for before, now in spoken.items():
            text = text.replace(before, f"\0{now[1:]}")  # no place is replaced twice
        return text.replace("\0", "(")

    for key in {"text", "notes"} & answer.keys():
        answer[key] = said(answer[key]) if isinstance(answer[key], str) else list(map(said, answer[key]))
    return answer


def _words(position: Any) -> str:
    return f"({coordinates(position)})"
