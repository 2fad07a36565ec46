"""The content of a map without a question: its things, sounds and rooms, each named with a confidence.

Several words may claim the same voxels ("desk", "dining table"); the most confident claim stands. What is certainly a
chair, and perhaps an armchair, is listed as a chair.
"""

import re
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import compress
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from avlmaps.core.arrays import Bool, Float, Int, UInt8
from avlmaps.core.errors import AvlmapsError, QueryError
from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps.core.poses import FRAME, plain_point
from avlmaps.core.question import Modality, Part
from avlmaps.core.registry import Kind
from avlmaps.perception.protocols import NamedPixelEncoder, PixelEncoder
from avlmaps.query.modalities import sound_features
from avlmaps.query.objects import Instances
from avlmaps.query.places import Box
from avlmaps.query.schema import ContentsAnswer, RoomAnswer, SoundAnswer, ThingAnswer, row_of
from avlmaps.query.settings import FEWEST_VIEWS, FOUND_AT
from avlmaps.query.voxel_space import middle_of
from avlmaps.query.words import unknown_note

if TYPE_CHECKING:
    from avlmaps.maps.storeys import Storeys
    from avlmaps.query.avlmap import AVLMap
    from avlmaps.query.floor_plan import FloorPlan
    from avlmaps.query.room_regions import RoomRegions
    from avlmaps.query.rooms import RoomField
    from avlmaps.query.schema import HeardFromAnswer

Row = TypeVar("Row", ThingAnswer, SoundAnswer, RoomAnswer)
Watch = Callable[[str, int, int], object]
"""Is given a stage of work, the number of steps done, and of all."""

# Surfaces that make up a building; they are everywhere, and listed only on request.
STRUCTURE = ("wall", "floor", "ceiling", "column", "stairs", "railing")
# A claim that shares this part of its voxels with a more confident thing names the same thing again.
_SAME_SHARE = 0.5
_FEWEST_VOXELS = 2  # a lone voxel is no thing
# Of a room as many names are listed as are at least so likely.
_MOST_ROOM_NAMES, _LEAST_ROOM_NAME = 3, 0.1
UNKNOWN = "room"
"""The name of a room that is of no kind with a probability of ``FOUND_AT``."""


@dataclass(frozen=True, slots=True, eq=False)
class Thing:
    """One thing of the map."""

    name: str  # the word of the vocabulary
    confidence: float  # that it is one, in [0, 1]
    position: tuple[float, float, float]  # its voxel nearest to its middle, metres, recording frame
    size: tuple[float, float, float]  # extent along the axes of the level frame (x and y horizontal, z up), metres
    color: tuple[int, int, int]  # mean RGB of its voxels
    rows: Int[np.ndarray, " m"] = field(repr=False)  # numbers of its voxels in the map
    points: Float[np.ndarray, "m 3"] = field(repr=False)  # middles of its voxels, metres, recording frame
    edited: str = ""  # who corrected it and when, in words; empty for what nobody corrected
    # Sounds that may have come from it; only lists of all that a map holds, or held on a day, know them.
    heard: "tuple[HeardFromAnswer, ...]" = ()
    room: str | None = None  # the name of its room; only lists of contents, and those of a room, know it

    def to_json(self) -> "ThingAnswer":
        """Return the thing as ``avlmaps things --json`` prints it."""
        return row_of(self, ThingAnswer, voxels=len(self.rows))


@dataclass(frozen=True, slots=True, eq=False)
class SoundEvent:
    """One sound of the map."""

    names: tuple[str, ...]  # the likeliest names, best first; empty for an encoder with an open vocabulary
    confidences: tuple[float, ...]  # of each name, in [0, 1]
    onset_s: float  # start, seconds from the start of the recording
    offset_s: float  # end, the same
    position: tuple[float, float, float]  # middle of the robot's positions during the sound, metres, recording frame
    # The robot's positions during the sound, metres, recording frame.
    track: Float[np.ndarray, "t 3"] = field(repr=False)
    clip: Path  # FLAC file of the sound

    def to_json(self) -> "SoundAnswer":
        """Return the sound as ``avlmaps things --json`` prints it."""
        return row_of(self, SoundAnswer, clip=self.clip.name)


@dataclass(frozen=True, slots=True, eq=False)
class Room:
    """One room: a region of the floor that walls and doorways bound, and the keyframes that looked into it."""

    name: str  # kind of room; ``UNKNOWN`` where none is likely enough
    confidence: float  # probability of the likeliest kind, in [0, 1]
    position: tuple[float, float, float]  # its view's place nearest to their middle, metres, recording frame
    views: int  # number of keyframes
    # Middle of what each of its keyframes saw, metres, recording frame.
    places: Float[np.ndarray, "k 3"] = field(repr=False)
    # Kinds that it may be and how likely it is each, best first; of an open plan those of its parts, the largest first.
    names: tuple[tuple[str, float], ...] = ()
    parts: tuple[str, ...] = ()  # kinds of the parts of an open plan; none for a room of one kind
    region: int = -1  # its number in ``AVLMap.room_regions``
    area_m2: float = 0.0  # of its floor
    # Corners on its floor, metres, recording frame.
    outline: Float[np.ndarray, "c 3"] = field(repr=False, default_factory=lambda: np.zeros((0, 3)))
    edited: str = ""  # who named it and when, in words; empty for what nobody corrected

    def to_json(self, own_names: Sequence[str]) -> "RoomAnswer":
        """Return the room as ``avlmaps rooms --json`` prints it, with names that no other part of the map has."""
        names = [{"name": name, "probability": likely} for name, likely in self.names]
        outline = [[round(value, 3) for value in corner] for corner in self.outline.tolist()]
        return row_of(
            self, RoomAnswer, room=joined(own_names), parts=list(own_names) if self.parts else None,
            probability=self.confidence, names=names, outline=outline,
        )  # fmt: skip

    @property
    def polygon(self) -> Float[np.ndarray, "c 2"]:
        """The corners of its outline, x and y, metres, recording frame."""
        return self.outline[:, :2]


@dataclass(frozen=True, slots=True)
class RoomPart:
    """A room of one kind, or a part of an open plan."""

    room: int  # number of the room in its list
    kind: str
    name: str  # that no other part has: the kind, and a number where there are several
    probability: float  # of the kind


@dataclass(frozen=True, slots=True, eq=False)
class Contents:
    """All that a map holds."""

    things: list[Thing]  # most confident first
    sounds: list[SoundEvent]  # in the order of their onset
    rooms: list[Room]  # those with most views first
    doubts: tuple[str, ...] = ()  # why the map may be wrong, one sentence each
    storeys: "Storeys | None" = None  # of a map of several

    def to_json(self, name: str) -> "ContentsAnswer":
        """Return the contents as ``avlmaps things --json`` prints them, under a name for the map."""
        return row_of(
            self, ContentsAnswer, map=name, frame=FRAME, notes=self.doubts,
            rooms=listed_rooms(self.rooms, self.storeys),
            things=put_storeys([thing.to_json() for thing in self.things], self.storeys),
            sounds=put_storeys([sound.to_json() for sound in self.sounds], self.storeys),
        )  # fmt: skip


def put_storeys(rows: list[Row], storeys: "Storeys | None") -> list[Row]:
    """Return rows of an answer, each with the number of its storey in a map of several."""
    if storeys is not None:
        for row in rows:
            row["storey"] = int(storeys.of_places(np.array(row["position"]))[0])
    return rows


def listed_rooms(rooms: Sequence[Room], storeys: "Storeys | None") -> "list[RoomAnswer]":
    """Return all rooms of a map as an answer lists them."""
    names = own_names_of(rooms)
    return put_storeys([room.to_json(own) for room, own in zip(rooms, names, strict=True)], storeys)


def parts_of(rooms: Sequence[Room]) -> tuple[RoomPart, ...]:
    """Return the rooms and the parts of open plans, in the order of their rooms."""
    every = [(number, room, kind) for number, room in enumerate(rooms) for kind in room.parts or (room.name,)]
    names = numbered([kind for _, _, kind in every])
    return tuple(
        RoomPart(number, kind, name, dict(room.names).get(kind, room.confidence))
        for (number, room, kind), name in zip(every, names, strict=True)
    )


def own_names_of(rooms: Sequence[Room]) -> list[tuple[str, ...]]:
    """Return the names of the parts of each room, all different."""
    parts = parts_of(rooms)
    return [tuple(part.name for part in parts if part.room == number) for number in range(len(rooms))]


def joined(names: Sequence[str]) -> str:
    """Return the name of a room with these parts: "living room and kitchen" of an open plan."""
    return " and ".join(names)


def numbered(names: Sequence[str]) -> tuple[str, ...]:
    """Return names that are all different: those that occur several times get a number each, from 1."""
    often, given = Counter(names), Counter[str]()
    out: list[str] = []
    for name in names:
        given[name] += 1
        out.append(f"{name} {given[name]}" if often[name] > 1 else name)
    return tuple(out)


def require_known(knows: Callable[[str], bool], names: Sequence[str]) -> None:
    """Raise ``QueryError`` where the pixel encoder does not know one of some names; it says what was probably meant."""
    for name in names:
        if not knows(name):
            note = unknown_note(name)
            raise QueryError(note if note.endswith("?") else f"{note}; name a thing that it knows.")


def find_things(
    avlmap: "AVLMap", search: Callable[[str, bool], Instances], names: Sequence[str] | None = None,
    least_confidence: float = 0.5, structure: bool = False, watch: Watch = lambda stage, done, total: None,
) -> list[Thing]:  # fmt: skip
    """Return the things of a map, most confident first; ``watch`` is given "things", names done, and of all."""
    if not 0.0 <= least_confidence <= 1.0:
        raise QueryError(f"The least confidence is {least_confidence:g}; it must lie between 0 and 1.")
    encoder = avlmap.encoders.pixels
    wanted = [name for name in (encoder.vocabulary if names is None else names) if structure or name not in STRUCTURE]
    searches = searches_for(wanted, encoder)
    claims: list[tuple[bool, float, int, str, Int[np.ndarray, " m"]]] = []
    for number, (name, alone) in enumerate(searches):
        watch("things", number, len(searches))
        for confidence, rows in _confident(search(name, alone), least_confidence):
            claims.append((not alone or confidence < FOUND_AT, -confidence, -len(rows), name, rows))
    owned, things, boxes = np.zeros(len(avlmap.space), bool), list[Thing](), list[tuple[str, Box]]()
    # A confident "armchair" stays one, though "chair" is surer still. Two searches for a name may find one thing.
    for _, doubt, _, name, rows in sorted(claims, key=lambda claim: claim[:4]):
        if owned[rows].mean() >= _SAME_SHARE or len(rows) < _FEWEST_VOXELS:
            continue
        owned[rows], thing = True, thing_of(avlmap, name, -doubt, rows)
        box = Box(avlmap.space, thing.position, thing.size)
        things += [] if any(other == name and box.overlaps(one) for other, one in boxes) else [thing]
        boxes.append((name, box))
    return sorted(things, key=lambda thing: -thing.confidence)


def searches_for(names: Sequence[str], encoder: PixelEncoder) -> list[tuple[str, bool]]:
    """Return the searches that list things of some names: each for itself alone, and with the narrower names it has."""
    return [*((name, True) for name in names), *((name, False) for name in names if _is_wide(name, encoder))]


def _is_wide(name: str, encoder: PixelEncoder) -> bool:
    if not isinstance(encoder, NamedPixelEncoder) or name not in encoder.names:
        return False
    return bool(np.count_nonzero(encoder.name_weights(name)) > 1)


def _confident(found: Instances, least: float) -> Iterator[tuple[float, Int[np.ndarray, " m"]]]:
    order = np.argsort(found.instance, kind="stable")
    bounds = np.searchsorted(found.instance[order], np.arange(len(found) + 1))
    for number in np.flatnonzero(found.confidence >= least):
        yield float(found.confidence[number]), found.rows[order[bounds[number] : bounds[number + 1]]]


def thing_of(avlmap: "AVLMap", name: str, confidence: float, rows: Int[np.ndarray, " m"]) -> Thing:
    """Return some voxels of a map as a thing of a name."""
    space = avlmap.space
    points = space.centres_of(rows)
    extent = np.ptp(space.level(points), axis=0) + space.grid.voxel_size_m
    colors: UInt8[np.ndarray, "m 3"] = np.asarray(avlmap.data.voxels.rgb)[rows]
    r, g, b = (int(value) for value in colors.mean(axis=0).round())
    return Thing(
        name, round(confidence, 3), plain_point(middle_of(points)), plain_point(extent), (r, g, b), rows, points
    )


def find_sounds(avlmap: "AVLMap", most_names: int = 3) -> list[SoundEvent]:
    """Return the sounds of a map in the order of their onset, each with its likeliest names."""
    heard = avlmap.data.sounds
    if not len(heard):
        return []
    avlmap.require_model(Kind.SOUNDS)
    encoder = avlmap.encoders.sounds
    words = list(encoder.vocabulary)
    scores = encoder.score_words(sound_features(heard), words) if words else np.zeros((len(heard), 0))
    events: list[SoundEvent] = []
    for k in range(len(heard)):
        best: list[int] = np.argsort(-scores[k], kind="stable")[:most_names].tolist()
        track = np.asarray(heard.track[heard.track_offsets[k] : heard.track_offsets[k + 1]], np.float64)
        events.append(SoundEvent(
            names=tuple(words[i] for i in best), confidences=tuple(round(float(scores[k, i]), 3) for i in best),
            onset_s=float(heard.onset_s[k]), offset_s=float(heard.offset_s[k]), clip=heard.clips[k],
            position=plain_point(track.mean(axis=0)), track=track,
        ))  # fmt: skip
    return events


def find_rooms(avlmap: "AVLMap", least_confidence: float = 0.0) -> list[Room]:
    """Return the rooms of a map, those with most views first; a map without a floor plan has none."""
    keyframes = avlmap.data.keyframes
    if not len(keyframes):
        return []
    field, regions = avlmap.room_field, avlmap.room_regions
    avlmap.require_model(Kind.VIEWS)
    if field is None or regions is None:
        return []
    rooms = _rooms_by_floor(field, regions, np.asarray(keyframes.centre, np.float64).reshape(-1, 3))
    listed = [room for room in rooms if room.views >= FEWEST_VIEWS and room.confidence >= least_confidence]
    return sorted(listed, key=lambda room: (-room.views, room.name))


def _rooms_by_floor(field: "RoomField", regions: "RoomRegions", places: Float[np.ndarray, "k 3"]) -> Iterator[Room]:
    own, share, surest = regions.at(places), field.of_rooms(regions), field.surest_of_rooms(regions)
    in_parts = field.parts_of_rooms(regions)
    for number in np.unique(own[own >= 0]).tolist():
        seen = places[own == number]
        best: list[int] = np.argsort(-share[number], kind="stable").tolist()
        parts = [k for k in best if in_parts[number, k]]
        likely = [(field.kinds[k], round(float(surest[number, k]), 3)) for k in parts or best[:_MOST_ROOM_NAMES]]
        several = tuple(field.kinds[k] for k in parts)
        name = joined(several) or (likely[0][0] if likely[0][1] >= FOUND_AT else UNKNOWN)
        confidence = min(one[1] for one in likely) if parts else likely[0][1]
        yield Room(
            name, confidence, plain_point(middle_of(seen)), len(seen), seen,
            tuple(one for one in likely if one[1] >= _LEAST_ROOM_NAME) or (likely[0],), several,
            number, round(float(regions.areas_m2[number]), 2), regions.outline(number),
        )  # fmt: skip


NOWHERE = -1
"""The room of a point in no room."""
_MOST_NAMED = 30
_UNITS = "m|cm|metres?|meters?|feet|steps?|times|degrees?|seconds?|minutes?"
# A word and a number behind it, which counts nothing ("the kitchen 2 m ahead"): most sentences hold none.
_NUMBERED = re.compile(rf"[^\W\d_] [1-9]\d{{0,2}}\b(?!\.\d| ?({_UNITS})\b)", re.IGNORECASE)


class Whereabouts:
    """The rooms of one map, those with most views first; none where it has no model of views."""

    def __init__(self, avlmap: "AVLMap") -> None:
        self._map, has_rooms = avlmap, avlmap.has(Kind.VIEWS)
        self.rooms: tuple[Room, ...] = tuple(avlmap.rooms()) if has_rooms else ()
        self.parts = parts_of(self.rooms)  # with the names that things in them have
        self.names = tuple(map(joined, own_names_of(self.rooms)))  # of the rooms, all different
        self.regions = avlmap.room_regions if has_rooms else None  # their floors; None without a floor plan

    @cached_property
    def _plan(self) -> "FloorPlan | None":
        return None if (votes := self._map.room_votes) is None else votes.plan

    @property
    def floor_count(self) -> int:
        """Number of storeys; 1 where they are not known."""
        return 1 if self._plan is None else len(self._plan.storeys)

    def floors_of(self, points: Sequence[Sequence[float]] | np.ndarray) -> Int[np.ndarray, " m"]:
        """Return the storey of each point (metres, recording frame), counted from 0, the lowest."""
        points = np.asarray(points, np.float64).reshape(-1, 3)
        return np.zeros(len(points), np.int64) if self._plan is None else self._plan.storeys_of(points)

    def rooms_of(self, points: Float[np.ndarray, "m 3"]) -> Int[np.ndarray, " m"]:
        """Return the number of each point's room, by its region, else of the nearest view; or ``NOWHERE``."""
        points = np.asarray(points, np.float64).reshape(-1, 3)
        field = self._map.room_field if self.rooms and len(points) else None
        return np.full(len(points), NOWHERE, np.int64) if field is None else self._listed[field.room_of(points)]

    @cached_property
    def _listed(self) -> Int[np.ndarray, " r"]:
        # The number of the room of each region; the last is that of no region.
        listed = np.full((0 if self.regions is None else len(self.regions)) + 1, NOWHERE, np.int64)
        listed[[room.region for room in self.rooms]] = np.arange(len(self.rooms))
        return listed

    def parts_at(self, points: Float[np.ndarray, "m 3"]) -> Int[np.ndarray, " m"]:
        """Return the number of the part that each point lies in, of the room that it lies in; or ``NOWHERE``."""
        points = np.asarray(points, np.float64).reshape(-1, 3)
        return self._parts(self.rooms_of(points), lambda rows, field: field.at(points[rows]))

    def _parts(
        self, room: Int[np.ndarray, " m"], likely: "Callable[[Int[np.ndarray, ' k'], RoomField], np.ndarray]"
    ) -> Int[np.ndarray, " m"]:
        # ``likely``: how likely some places, by their numbers, are each kind.
        own, field = [part.room for part in self.parts], self._map.room_field if self.parts else None
        first = np.array([own.index(number) for number in range(len(self.rooms))] + [NOWHERE])
        part = first[room]
        for number, one in enumerate(self.rooms):
            rows = np.flatnonzero(room == number)
            if one.parts and field is not None and len(rows):
                part[rows] += likely(rows, field)[:, [field.kinds.index(kind) for kind in one.parts]].argmax(axis=1)
        return part

    def cells_of(self, name: str) -> Bool[np.ndarray, " c"]:
        """Return the cells of the floor plan that a part covers, by its own name."""
        field = self._map.room_field
        assert field is not None and field.rooms is not None
        part = self._parts(self._listed[field.rooms[1]], lambda rows, field: field.share[rows])
        return part == [one.name for one in self.parts].index(name)

    def names_at(self, points: Sequence[Sequence[float]] | np.ndarray) -> list[str | None]:
        """Return the name of the part that each point lies in; None in no room."""
        numbers: list[int] = self.parts_at(np.array(points, np.float64)).tolist()
        return [None if number == NOWHERE else self.parts[number].name for number in numbers]

    def name_of(self, place: Sequence[float]) -> str | None:
        """Return the name of the part that a place lies in; None in a map without rooms."""
        return self.names_at([place])[0]

    def with_rooms(self, things: "Sequence[Thing]") -> "list[Thing]":
        """Return things that know their rooms."""
        named = self.names_at([thing.position for thing in things])
        return [replace(thing, room=name) for thing, name in zip(things, named, strict=True)]

    def inside(self, asked: str, points: Sequence[Sequence[float]] | np.ndarray) -> Bool[np.ndarray, " m"]:
        """Return which points lie in one room or part by its own name, or in all of a kind."""
        return np.array([*self._meant(asked), False])[self.parts_at(np.array(points, np.float64))]

    def those_in(self, room: "str | Room", things: "Sequence[Thing]") -> "list[Thing]":
        """Return the things in a room, or in those that a word names. ``QueryError``: it names none."""
        named = {one.region: name for name, one in zip(self.names, self.rooms, strict=True)}
        asked = room if isinstance(room, str) else named.get(room.region, room.name)
        self.require(asked)
        return list(compress(things, self.inside(asked, [thing.position for thing in things])))

    def has(self, asked: str) -> bool:
        """Return whether a word names a room of the map, or a part of one."""
        return any(self._meant(asked))

    def _meant(self, asked: str) -> list[bool]:
        # Which parts a word means: one by its own name, those of a room by its, or all of a kind.
        word, kinds = _plain(asked), [part.kind for part in self.parts]
        called = ((part, {part.name, self.names[part.room], self.rooms[part.room].name}) for part in self.parts)
        named = [word in {name.casefold() for name in names - {part.kind}} for part, names in called]
        if any(named):
            return named
        if word == UNKNOWN and word in kinds:  # else "the room" is any room
            return [kind == word for kind in kinds]
        return [kind.casefold() == word or lexicon().is_a(kind, word, EntryKind.ROOM) for kind in kinds]

    def require(self, asked: str) -> None:
        """Raise ``QueryError`` where a word names no room; the sentence lists those that there are."""
        if self.has(asked):
            return
        if not self.names:
            raise QueryError("The map has no rooms: it was built without a model of views; leave out the room.")
        more = f" and {len(self.names) - _MOST_NAMED} more" if len(self.names) > _MOST_NAMED else ""
        raise QueryError(
            f"There is no room {asked[:60]!r}; the rooms are: {', '.join(self.names[:_MOST_NAMED])}{more}."
        )

    def numbers_of(self, asked: str) -> list[int]:
        """Return the numbers of the rooms that a word names, or parts of which it names. ``QueryError``: see above."""
        self.require(asked)
        meant = [part for part, is_meant in zip(self.parts, self._meant(asked), strict=True) if is_meant]
        called = [part for part in meant if part.name.casefold() == _plain(asked)]
        return sorted({part.room for part in called or meant})

    @cached_property
    def numbered(self) -> dict[str, str]:
        """The own name of each part that shares its kind with others, by that name as questions have it."""
        return {plain_name(part.name): part.name for part in self.parts if part.name != part.kind}


_POSSESSIVES = ("the ", "a ", "an ", "my ", "your ", "our ")


def plain_name(name: str) -> str:
    """Return a name in lower case without the words before it: "My charging dock" is "charging dock"."""
    word = " ".join(name.casefold().split())
    return next((word.removeprefix(one) for one in _POSSESSIVES if word.startswith(one)), word)


def _plain(asked: str) -> str:
    return " ".join(asked.casefold().split()).removeprefix("the ")


def _numbered(avlmap: "AVLMap") -> dict[str, str]:
    try:
        return avlmap.where.numbered
    except AvlmapsError:  # its encoder is not here: a question of something else needs none
        return {}


def part_named(avlmap: "AVLMap", phrase: str) -> str | None:
    """Return the own name of the part that a phrase names by its number; None where a person called something so."""
    if not _NUMBERED.search(phrase) or avlmap.edited.knows(phrase):
        return None
    return _numbered(avlmap).get(plain_name(phrase))


def in_room(avlmap: "AVLMap", part: Part) -> list[Part]:
    """Return "kitchen chair" as a chair in the kitchen, unless a person called something so; other parts alone."""
    is_thing = part.modality is Modality.OBJECT and not avlmap.edited.knows(part.query)
    placed = lexicon().in_room(part.query) if is_thing else None
    return [part] if placed is None else [replace(part, query=placed[0]), Part(Modality.AREA, placed[1])]


def own_names(avlmap: "AVLMap", sentence: str) -> tuple[tuple[str, bool], ...]:
    """Return the names that are this map's own, and whether each is that of a room."""
    rooms = _numbered(avlmap) if _NUMBERED.search(sentence) else ()
    return (*avlmap.edited.own_names, *((name, True) for name in rooms))
