"""What an answer needs of a map: ``AVLMap`` gives it, and asking, lists and whereabouts know no more of it."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Protocol

import numpy as np

from avlmaps.core.arrays import UInt8
from avlmaps.core.camera import Pinhole
from avlmaps.core.question import Part
from avlmaps.query.edits import SeenMap
from avlmaps.query.heatmap import Heatmap
from avlmaps.recordings.audio import Sound

if TYPE_CHECKING:
    from avlmaps.maps.store.life import Life
    from avlmaps.query.contents import Room, SoundEvent, Thing
    from avlmaps.query.rooms import RoomField, Rooms
    from avlmaps.query.settings import SoundSettings


@dataclass(frozen=True, slots=True, eq=False)
class Photo:
    """A picture that came without a file of its own.

    Attributes:
        rgb: its pixels.
        focal_35mm: the focal length for 35 mm film in its EXIF, mm; None where it has none.
    """

    rgb: UInt8[np.ndarray, "h w 3"]
    focal_35mm: float | None = None


Attachment = UInt8[np.ndarray, "h w 3"] | Photo | Sound
"""A picture or a sound that comes with a question, instead of a file."""


class FoundSettings(Protocol):
    """The part of a map's settings that decides what is found, and where."""

    @property
    def found_at(self) -> float:
        """The least probability of a first goal that counts as found, in [0, 1]."""
        ...

    @property
    def sounds(self) -> "SoundSettings":
        """Among others, the place that every sound has."""
        ...


class EditedNames(Protocol):
    """What people corrected in a map, as far as an answer needs it; ``edits.Edited`` is it."""

    @property
    def own_names(self) -> tuple[tuple[str, bool], ...]:
        """The names that people gave, and whether each is that of a room."""
        ...

    def knows(self, phrase: str) -> bool:
        """Return whether a person named something so."""
        ...

    def said_of(
        self, places: Sequence[Sequence[float]], named: Iterable[str] = (), areas: Iterable[str] = ()
    ) -> tuple[str, ...]:
        """Return who corrected what an answer is about, and when, in a sentence each."""
        ...

    def life(self, life: "Life") -> "Life":
        """Return what became of things over days, under the names that people gave them."""
        ...


class Queryable(SeenMap, Protocol):
    """A map that gives heat for parts of a question, and lists of what it holds."""

    @property
    def settings(self) -> FoundSettings:
        """How to query."""
        ...

    @cached_property
    def edited(self) -> "EditedNames":
        """What people corrected, as it applies to this map."""
        ...

    @cached_property
    def room_votes(self) -> "Rooms | None":
        """The votes on the kind of room of each place."""
        ...

    @cached_property
    def room_field(self) -> "RoomField | None":
        """How likely each place is each kind of room."""
        ...

    @cached_property
    def numbered_rooms(self) -> "Mapping[str, int]":
        """The region of each room that shares its name with others, by the name with its number."""
        ...

    def heat(
        self, part: Part, intrinsics: Pinhole | None = None, attachments: Mapping[str, Attachment] | None = None
    ) -> Heatmap:
        """Return the heat of one part of a question."""
        ...

    def things(self, names: Sequence[str] | None = None, least_confidence: float = 0.5) -> "list[Thing]":
        """Return the things of the map, most confident first."""
        ...

    def sounds(self, most_names: int = 3) -> "list[SoundEvent]":
        """Return the sounds of the map in the order of their onset."""
        ...

    def rooms(self, least_confidence: float = 0.0) -> "list[Room]":
        """Return the rooms of the map, those with most views first."""
        ...
