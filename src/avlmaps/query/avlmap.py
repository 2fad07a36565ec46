"""The map as a user meets it: four modalities, each a heatmap, and whole questions."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from copy import copy
from dataclasses import replace
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from avlmaps.core.arrays import Float, Float16, Int32, UInt8
from avlmaps.core.camera import Pinhole
from avlmaps.core.errors import BackendError, MapError, QueryError
from avlmaps.core.files import lasting_path, user_path
from avlmaps.core.numbers import as_whole, checked
from avlmaps.core.question import HeardAt, Modality, Part, Question, Role
from avlmaps.core.registry import Kind
from avlmaps.perception.protocols import read_room_contents
from avlmaps.query.findings import MapNames, MapRooms
from avlmaps.query.heatmap import Heatmap
from avlmaps.query.instances import Instances
from avlmaps.query.modalities.area import area_factor
from avlmaps.query.modalities.image import image_factor, read_picture, require_fitting
from avlmaps.query.modalities.sound import read_clip, require_audible, sound_factor, sound_features
from avlmaps.query.queryable import Attachment, Photo
from avlmaps.query.room_regions import RoomRegions
from avlmaps.query.rooms import RoomField, Rooms, ThingsInRooms
from avlmaps.query.settings import QuerySettings
from avlmaps.query.voxel_space import Space
from avlmaps.query.whereabouts import numbered_rooms, region_named
from avlmaps.query.words import ClosestWords
from avlmaps.recordings.audio import Sound

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from avlmaps.maps.store.edits import Edit
    from avlmaps.maps.store.map_data import MapData
    from avlmaps.maps.storeys import Storeys
    from avlmaps.perception.encoders import Encoders
    from avlmaps.query.answer import Answer
    from avlmaps.query.contents import Contents, Room, SoundEvent, Thing, Watch
    from avlmaps.query.editor import Editor
    from avlmaps.query.edits import Edited
    from avlmaps.query.heatmap import HeatCache
    from avlmaps.query.locate import Located
    from avlmaps.query.schema import ChangesAnswer, LastSeenAnswer
    from avlmaps.query.sound_sources import SoundSource, SourceMap

# Keyframes that are matched one by one for a picture that cannot be located: more of them guess no better (measured).
_GUESS_FROM = 20
_LEAST_EDITED = 0.2  # a person may name what the map is not certain of


class AVLMap:
    """A map that can be queried. Heatmaps of one map multiply: ``m.object("chair", primary=True) * m.sound("dog")``.

    The first query by word of an object scores all voxels against the vocabulary and stores that for later ones.

    Attributes:
        data: the map as a value.
        path: its folder; of a map in memory a name.
        settings: how to query.
    """

    def __init__(
        self,
        data: "MapData",
        encoders: "Encoders | None" = None,
        *,
        path: Path | None = None,
        settings: QuerySettings | None = None,
        edits: "Sequence[Edit] | None" = None,
        heats: "HeatCache | None" = None,
    ) -> None:
        """Take a map.

        Args:
            data: the map.
            encoders: the models to ask with; by default those that it names.
            path: its folder, where people's edits are; None of a map in memory.
            settings: how to query.
            edits: what people corrected; None for those in the map's folder, none for what the encoders say alone.
            heats: remembers the heat of words, for a map that many query; files then come as attachments alone.
        """
        self.data, self.path = data, path or Path("a map in memory")
        self._encoders = encoders
        self.settings = settings or QuerySettings()
        self._given_edits = edits
        self._heats = heats
        self._to_edit: dict[str | None, Sequence[Thing]] = {}

    @classmethod
    def open(cls, path: str | Path, settings: QuerySettings | None = None) -> "AVLMap":
        """Open a map's folder; the features stay on the disk until a query needs them.

        Raises:
            MapError: it is not a map, damaged, or of another schema or profile.
        """
        from avlmaps.maps.store.folder import read

        path = lasting_path(path)
        return cls(read(path), path=path, settings=settings)

    @cached_property
    def encoders(self) -> "Encoders":
        """The models that it is asked with; those that it names need not be known here until they are used."""
        from avlmaps.maps.store.reader import encoders_of_map

        return self._encoders or encoders_of_map(self.data.info)

    def require_model(self, kind: Kind) -> None:
        """Raise ``MapError`` unless its encoder of a kind is the one that made its features."""
        from avlmaps.maps.store.reader import require_model

        require_model(self.data.info, self.encoders, kind, self.path)

    def of_data(self, data: "MapData") -> Self:
        """Return this map with other content."""
        return type(self)(data, self.encoders, path=self.path, settings=self.settings, edits=self._given_edits)

    @cached_property
    def edited(self) -> "Edited":
        """What people corrected, as it applies to this map."""
        from avlmaps.maps.store.edits import read_edits
        from avlmaps.query.edits import apply

        return apply(read_edits(self.path) if self._given_edits is None else self._given_edits, self)

    @property
    def edit(self) -> "Editor":
        """Corrects the map: ``m.edit.rename("chair", "stool")``; see ``editor.Editor``."""
        from avlmaps.query.editor import Editor

        return Editor(self)

    def forget_edits(self) -> None:
        """Read what people corrected again at the next question."""
        # What lists things weighs them by what they are called.
        self._heats = None if self._heats is None else self._heats.anew()
        for name in ("edited", "room_field", "source_map", "numbered_rooms"):
            self.__dict__.pop(name, None)

    def as_edited_now(self) -> Self:
        """Return the same map with the edits of now; what no edit changes is not computed again."""
        other = copy(self)
        other.forget_edits()
        return other

    @cached_property
    def space(self) -> Space:
        """The voxels' places, shared by all heatmaps of this map."""
        return Space(self.data.grid, self.data.voxels.index, self.data.up_in_world, self.data)

    @checked(QueryError)
    def object(self, word: str, primary: bool = False, vocabulary: Sequence[str] | None = None) -> Heatmap:
        """Return the heat of an object.

        Args:
            word: what it is called.
            primary: whether it is what is sought (reaches 0.5 m) rather than a mark near it (5 m).
            vocabulary: what the word competes with, instead of the encoder's own list.

        Raises:
            QueryError: the word is empty, or the pixel encoder understands nothing of it.
            BackendError: the map's profile has no pixel encoder.
        """
        part = Part(Modality.OBJECT, word, _role(primary))
        pinned = self.edited.pinned(part, self.settings.heat)
        if pinned is not None:
            return Heatmap.of(pinned, self.settings.found_at)
        if self.edited.is_room(word):
            return self.area(word, primary)
        factor = self.edited.object_factor(part, self.settings.heat, lambda: self._names.heat(part, vocabulary))
        return Heatmap.of(factor, self.settings.found_at)

    @checked(QueryError)
    def instances(self, word: str, alone: bool = False) -> Instances:
        """Return the instances of a word: connected voxels that it wins against the vocabulary.

        Args:
            word: what it is called.
            alone: take one of the encoder's names for itself, without the narrower ones that it takes in: then an
                armchair is no "chair".
        """
        return self.edited.instances(self._names.search(word, alone).instances, word)

    def closest_words(self) -> ClosestWords:
        """Return the two words of the encoder's vocabulary closest to each voxel; the first query works them out."""
        return self._names.closest_words()

    @cached_property
    def _names(self) -> MapNames:
        return MapNames(self, self.space, self.settings, lambda: self.things_in_rooms)

    def found(self) -> dict[str, np.ndarray]:
        """Return what a build stores of the names and rooms that the encoders here see; see ``findings``."""
        found = dict[str, np.ndarray]()
        for part in (lambda: self._names.found(), lambda: self._rooms.found()):
            with suppress(BackendError, MapError):  # no features of these, or those of another encoder
                found |= part()
        return found

    @checked(QueryError)
    def things(
        self,
        names: Sequence[str] | None = None,
        least_confidence: float = 0.5,
        structure: bool = False,
        watch: "Watch" = lambda stage, done, total: None,
        *,
        at: str | int | None = None,
        room: str | None = None,
    ) -> list["Thing"]:
        """Return the things of the map, most confident first; see ``contents.find_things``.

        With ``room``, those in a room by its name, or in all rooms of a kind, as ``rooms`` lists them.

        With ``at``, of a map of several days, those that were there on that day: a date, or the number of a visit from
        1. What moved or went since is where it was; ``rows`` holds what is left of it, ``heard`` what was heard from
        it on that day, where the map knows where its sounds came from.

        Raises:
            QueryError: there is no such room, or the map was not seen on such a day, or on one day alone.
        """
        if room is not None:
            from avlmaps.query.whereabouts import Whereabouts

            return Whereabouts.of(self).things_in(room, self.things(names, least_confidence, structure, watch, at=at))
        if at is not None:
            from avlmaps.query.changes import Days, things_at
            from avlmaps.query.sound_sources import with_heard_then

            days = Days.of(self, self.edited.life)
            found = things_at(self.space, days, at, names, least_confidence)
            every = found if names is None else things_at(self.space, days, at, None, least_confidence)
            return with_heard_then(self, days.visit_of(at), found, every)
        seen = names
        if names is not None and self.edited:
            seen = [name for name in names if self.sees(name)]
        found = self.unedited_things(seen, least_confidence, structure, watch)
        return self.edited.things(found, names, least_confidence)

    @checked(QueryError)
    def unedited_things(
        self,
        names: Sequence[str] | None = None,
        least_confidence: float = 0.5,
        structure: bool = False,
        watch: "Watch" = lambda stage, done, total: None,
    ) -> list["Thing"]:
        """Return ``things`` as the encoder sees them, without what people corrected."""
        from avlmaps.query.contents import find_things

        def instances_of(name: str, alone: bool) -> Instances:
            return self._names.search(name, alone).instances

        return find_things(self, self.space, instances_of, names, least_confidence, structure, watch)

    def things_to_edit(self, name: str | None) -> "Sequence[Thing]":
        """Return the things that an edit may be about, as the encoder sees them: of a name, or of its vocabulary.

        A map without pixel features has none. They are looked for once, for the edits of now and of later.
        """
        if name not in self._to_edit:
            is_seen = "pixels" in self.data.info.models and (name is None or self.sees(name))
            names = None if name is None else [name]
            self._to_edit[name] = self.unedited_things(names, _LEAST_EDITED) if is_seen else ()
        return self._to_edit[name]

    def changes(self, since: str | int = 1, *, first_seen: bool = False) -> "ChangesAnswer":
        """Return what is new, moved and gone after a day: a date, or the number of a visit from 1.

        Args:
            since: the day.
            first_seen: list also what was seen first where nobody had looked before.

        Raises:
            QueryError: the map was not seen on such a day, or on one day alone.
        """
        from avlmaps.query.changes import Days, changes_answer, room_namer

        days = Days.of(self, self.edited.life)
        since_visit = days.visit_of(since)
        return changes_answer(days, self.path.name, since_visit, room_namer(self), first_seen=first_seen)

    @checked(QueryError)
    def last_seen(self, name: str) -> "LastSeenAnswer":
        """Return where things of a name were last seen, and when: those that are there still first, then the latest.

        Raises:
            QueryError: the map was seen on one day alone.
        """
        from avlmaps.query.changes import Days, is_meant, last_seen, room_namer

        return last_seen(Days.of(self, self.edited.life), name, is_meant(name), room_namer(self))

    @checked(QueryError)
    def contents(
        self, least_confidence: float = 0.5, names: Sequence[str] | None = None, structure: bool = False
    ) -> "Contents":
        """Return the things, sounds and rooms of the map; none of a kind that the map has no model for.

        Args:
            least_confidence: things below it are left out, in [0, 1].
            names: list these things only; by default the pixel encoder's vocabulary.
            structure: list walls, floors and the like as well.

        Raises:
            QueryError: ``least_confidence`` lies outside [0, 1], or the pixel encoder does not know a name.
        """
        from avlmaps.query.contents import Contents, require_known
        from avlmaps.query.sound_sources import with_heard

        models = self.data.info.models
        require_known(self.knows, (names or ()) if "pixels" in models else ())
        things = self.things(names, least_confidence, structure) if "pixels" in models else []
        rooms = self.rooms() if "views" in models else []
        things = with_heard(self, things, are_all=not names)
        if rooms:
            from avlmaps.query.whereabouts import Whereabouts

            things = Whereabouts.of(self).with_rooms(things)
        return Contents(things, self.sounds(), rooms, self.doubts_of_things, self.storeys)

    @property
    def doubts_of_drives(self) -> tuple[str, ...]:
        """What is doubtful about the map for a robot: why it may be wrong, and areas that it no longer forbids."""
        return (*self.data.info.doubts, *self.edited.unheeded)

    @property
    def doubts_of_things(self) -> tuple[str, ...]:
        """Why a list of its things may be wrong, one sentence each."""
        doubts = self.data.info.doubts
        if "pixels" in self.data.info.models:
            return doubts
        return (*doubts, "The map was made without a model for things, so that it names none.")

    @checked(QueryError)
    def sounds(self, most_names: int = 3) -> list["SoundEvent"]:
        """Return the sounds of the map in the order of their onset; see ``contents.find_sounds``."""
        from avlmaps.query.contents import find_sounds

        return find_sounds(self, most_names)

    @checked(QueryError)
    def rooms(self, least_confidence: float = 0.0) -> list["Room"]:
        """Return the rooms of the map, those with most views first; see ``contents.find_rooms``."""
        from avlmaps.query.contents import find_rooms

        field, regions = self.room_field, self.room_regions
        by_floor = None if field is None or regions is None else (field, regions)
        rooms = find_rooms(self, self.space, self.settings.areas, least_confidence, by_floor)
        return self.edited.listed_rooms(rooms)

    @cached_property
    def numbered_rooms(self) -> dict[str, int]:
        """The region of each room that shares its name with others, by the name with its number; see ``room_names``."""
        return numbered_rooms(self)

    @property
    def points(self) -> Float[np.ndarray, "n 3"]:
        """The middles of the voxels, metres, recording frame; computed once, read-only."""
        return _read_only(self.space.centres)

    @property
    def colors(self) -> UInt8[np.ndarray, "n 3"]:
        """RGB of the voxels; read-only, not copied from the disk."""
        return _read_only(self.data.voxels.rgb)

    @property
    def features(self) -> Float16[np.ndarray, "n d"]:
        """Features of the voxels, of unit length or zero; read-only, not copied from the disk."""
        return _read_only(self.data.voxels.feature)

    @property
    def voxel_index(self) -> Int32[np.ndarray, "n 3"]:
        """Which voxels: voxel i covers [i·s, (i+1)·s) along each axis; read-only, not copied from the disk."""
        return _read_only(self.data.voxels.index)

    def plot(self, path: str | Path | None = None, *, names: bool = True) -> "Path | Figure":
        """Draw the map from above with its walk and sounds, and by default the names of its things and rooms.

        Raises:
            QueryError: the picture cannot be written there.
        """
        from avlmaps.query.plots import draw_map, save

        models = self.data.info.models
        things = self.things() if names and "pixels" in models else ()
        figure = draw_map(self, things, self.rooms() if names and "views" in models else ())
        return figure if path is None else save(figure, path)

    def _repr_png_(self) -> bytes:
        """Return the picture that a notebook shows."""
        from avlmaps.query.plots import png_of

        figure = self.plot(names=False)
        assert not isinstance(figure, Path)
        return png_of(figure)

    def __dir__(self) -> list[str]:
        """Return the names that a person uses; the others serve answers, lists and fronts."""
        inside = ("as_edited_now", "forget_edits", "things_to_edit", "unedited_things", "things_in_rooms", "stored",
                  "room_votes", "room_field", "room_regions", "numbered_rooms", "source_map", "sees", "heat",
                  "closest_words", "doubts_of_drives", "doubts_of_things")  # fmt: skip
        return [name for name in super().__dir__() if not name.startswith("_") and name not in inside]

    def to_open3d(self) -> "Any":
        """Return the voxels as an ``open3d.geometry.PointCloud``.

        Raises:
            BackendError: open3d is not installed.
        """
        from avlmaps.query.export import to_open3d

        return to_open3d(self.points, self.colors)

    def to_trimesh(self) -> "Any":
        """Return the voxels as a ``trimesh.PointCloud`` with colours."""
        from avlmaps.query.export import to_trimesh

        return to_trimesh(self.points, self.colors)

    def __repr__(self) -> str:
        counts = self.data.info.counts
        return (
            f"AVLMap({self.path.name!r}: {counts.voxels:,} voxels of {self.data.info.voxel_size_m:g} m, "
            f"{counts.keyframes} keyframes, {counts.sounds} sounds, profile {self.data.info.profile})"
        )

    @checked(QueryError)
    def knows(self, phrase: str) -> bool:
        """Return whether the map can be queried for a thing: the pixel encoder sees such, or a person named one so."""
        return self.edited.knows(phrase) or self.sees(phrase)

    @checked(QueryError)
    def sees(self, phrase: str) -> bool:
        """Return whether the pixel encoder can look for a phrase: any phrase for an open vocabulary, else its words."""
        from avlmaps.query.words import is_open

        encoder = self.encoders.pixels
        return is_open(encoder) or bool(encoder.understood(phrase))

    @checked(QueryError)
    def sound(self, text: str, primary: bool = False, *, at: HeardAt | None = None) -> Heatmap:
        """Return the heat of a sound of that name: where the robot was when it heard it, or where it came from.

        Args:
            text: what it is called.
            primary: whether that place is what is sought.
            at: ``robot`` or ``source``; by default as ``settings.sounds.at`` says, else ``robot``.

        Raises:
            QueryError: the text is empty, or the map does not know where its sounds came from.
        """
        part = Part(Modality.SOUND, text, _role(primary))
        return self._sound_heat(part, self.sound_scores(text), at)

    @checked(QueryError)
    def sound_scores(self, text: str) -> Float[np.ndarray, " sounds"]:
        """Return for each sound of the map the probability that it is called so, in [0, 1]."""
        heard = self.data.sounds
        if not len(heard):
            return np.zeros(0)
        self.require_model(Kind.SOUNDS)
        return self.encoders.sounds.score_words(sound_features(heard), [text])[:, 0]

    @checked(QueryError)
    def sound_clip(self, clip: str | Path | Sound, primary: bool = False, *, at: HeardAt | None = None) -> Heatmap:
        """Return the heat of sounds of the same kind as a clip; see ``sound``.

        Raises:
            QueryError: the clip is missing, unreadable or silent, or the map does not know where sounds came from.
        """
        if not isinstance(clip, str | Path | Sound):  # pyright: ignore[reportUnnecessaryIsInstance]
            raise QueryError(
                f"A clip is the path of a file or an avlmaps.Sound(samples, rate_hz), not {type(clip).__name__}."
            )
        name = "a clip" if isinstance(clip, Sound) else str(clip)
        part = Part(Modality.SOUND, name, _role(primary), is_file=True)
        sound = require_audible(clip, "that was given") if isinstance(clip, Sound) else read_clip(user_path(clip))
        heard = self.data.sounds
        scores = np.zeros(0)
        if len(heard):
            self.require_model(Kind.SOUNDS)
            encoder = self.encoders.sounds
            scores = encoder.score_sounds(sound_features(heard), encoder.encode(sound))
        return self._sound_heat(part, scores, at)

    def _sound_heat(self, part: Part, scores: Float[np.ndarray, " sounds"], at: HeardAt | None) -> Heatmap:
        settings = self.settings.sounds
        _require_place(at)
        if (at or settings.at) == "source" and len(scores):
            from avlmaps.query.modalities.sound import source_factor

            factor = source_factor(self.space, self.source_map, scores, part, settings, self.settings.heat)
        else:
            factor = sound_factor(self.space, self.data.sounds, scores, part, settings, self.settings.heat)
        return Heatmap.of(factor, self.settings.found_at)

    @cached_property
    def source_map(self) -> "SourceMap":
        """The evidence of where sounds came from.

        Raises:
            QueryError: the map has none.
        """
        from avlmaps.query.sound_sources import SourceMap

        return SourceMap.of(self)

    @checked(QueryError)
    def sources(self, names: Sequence[str] = (), *, prior: bool = True, least: float = 0.0) -> "list[SoundSource]":
        """Return the places that sounds came from, as regions with probabilities; see ``sound_sources.list_sources``.

        Raises:
            QueryError: the map does not know where its sounds came from.
        """
        from avlmaps.query.sound_sources import list_sources

        return list_sources(self, names, prior, least=least)

    @checked(QueryError)
    def area(self, word: str, primary: bool = False) -> Heatmap:
        """Return the heat of an area, such as a kitchen; or of one room by its number, such as bathroom 2.

        Raises:
            QueryError: the word is empty.
            BackendError: the map's profile has no view encoder.
        """
        part = Part(Modality.AREA, word, _role(primary))
        encoder = self.encoders.views
        self.require_model(Kind.VIEWS)
        settings, number = self.settings, region_named(self, word)
        factor = area_factor(
            self.space, self.data.keyframes, encoder, part, settings.areas, settings.heat, self.room_votes,
            self._settled if number is None else partial(self._with_room, number), self._rooms.room_of_places,
        )  # fmt: skip
        return Heatmap.of(factor, settings.found_at)

    def _settled(self, field: RoomField) -> RoomField:
        """Return a field in which a room is of one kind, and those that people named are so."""
        assert self.room_regions is not None
        return self.edited.room_field(field.settled(self.room_regions, self._rooms.room_of_cells))

    def _with_room(self, number: int, field: RoomField) -> RoomField:
        """Return the field with one room as a kind of its own behind all others."""
        return self._settled(field).with_certain([("", self._rooms.room_of_cells == number)])

    @cached_property
    def storeys(self) -> "Storeys | None":
        """The storeys of the map and the stairs between them; None for a map of one storey."""
        from avlmaps.maps.storeys import find_storeys, stayed_on_one

        cameras = self.space.level(np.asarray(self.data.keyframes.world_from_camera, np.float64)[:, :3, 3])
        if stayed_on_one(cameras[:, 2]):
            return None
        from avlmaps.maps.obstacles import MIN_HITS  # slow to load, and most maps have one storey

        certain = np.asarray(self.data.voxels.hits) >= MIN_HITS
        level = self.space.level(self.space.centres[certain])
        found = find_storeys(level, self.space.grid.voxel_size_m, cameras)
        x, y, z = self.space.level_from_world[2].tolist()
        return None if found is None else replace(found, up=(x, y, z))

    @cached_property
    def _rooms(self) -> MapRooms:
        return MapRooms(self, self.space, self.settings.areas, lambda: self.storeys)

    @cached_property
    def room_votes(self) -> Rooms | None:
        """The votes on the kind of room of each place; None where the settings score keyframes instead."""
        return self._rooms.votes

    @cached_property
    def room_regions(self) -> RoomRegions | None:
        """The rooms that walls and doorways bound; None where there is no floor plan."""
        return self._rooms.regions

    @cached_property
    def room_field(self) -> RoomField | None:
        """How likely each place is each kind of room that the view encoder knows or a person named.

        None where there are no votes.

        Raises:
            BackendError: the map's profile has no view encoder.
            MapError: the map was built with another encoder than is installed.
        """
        seen = self._rooms.field
        return None if seen is None else self._settled(seen)

    @cached_property
    def things_in_rooms(self) -> ThingsInRooms | None:
        """The evidence of rooms on the things in them; None for a map whose rooms are not known."""
        field = self._rooms.known_field
        return None if field is None else ThingsInRooms(field, read_room_contents())

    @checked(QueryError)
    def image(
        self,
        picture: str | Path | Photo | UInt8[np.ndarray, "h w 3"],
        intrinsics: Pinhole | None = None,
        primary: bool = False,
    ) -> Heatmap:
        """Return the heat of where a picture was taken; if it is not located, of the best guess.

        Args:
            picture: a file, or RGB uint8, or that with what its EXIF says.
            intrinsics: of the camera that took it; by default by its EXIF, else the map's own.
            primary: whether that place is what is sought.

        Raises:
            QueryError: the picture is missing, no picture, or does not fit the camera.
        """
        called = str(picture) if isinstance(picture, str | Path) else "a picture"
        part, photo = Part(Modality.IMAGE, called, _role(primary), is_file=True), _photo(picture, intrinsics)
        rgb = photo.rgb
        located = self._located(rgb, intrinsics, _GUESS_FROM, photo.focal_35mm)
        return Heatmap.of(image_factor(self.space, located, part, self.settings.heat), self.settings.found_at)

    @checked(QueryError)
    def locate(
        self,
        picture: str | Path | UInt8[np.ndarray, "h w 3"],
        intrinsics: Pinhole | None = None,
        focal_35mm: float | None = None,
    ) -> "Located":
        """Return the pose of the camera that took a picture, or that it was not located; see ``locate.locate``.

        Args:
            picture: a file, or RGB uint8.
            intrinsics: of the camera that took it; by default by a file's EXIF, else the map's own.
            focal_35mm: of that camera, as if for 35 mm film; by default by a file's EXIF.

        Raises:
            QueryError: the picture is missing, no picture, or does not fit the camera.
        """
        if focal_35mm is not None and not 0.0 < focal_35mm < np.inf:
            raise QueryError(f"focal_35mm is a length over 0 mm, not {focal_35mm:g}.")
        photo = _photo(picture, intrinsics)
        focal_35mm = photo.focal_35mm if focal_35mm is None else focal_35mm
        return self._located(photo.rgb, intrinsics, focal_35mm=focal_35mm)

    def _located(
        self,
        rgb: UInt8[np.ndarray, "h w 3"],
        intrinsics: Pinhole | None,
        guess_references: int = 0,
        focal_35mm: float | None = None,
    ) -> "Located":
        from avlmaps.query.locate import LocatableMap, LocateSettings, locate

        require_fitting(rgb, intrinsics)
        for kind in (Kind.LOCAL, Kind.PLACE):  # an imported map has neither
            self.require_model(kind)
        rng = np.random.default_rng(self.settings.seed)
        settings = LocateSettings(guess_references=guess_references)
        return locate(LocatableMap.of(self), rgb, intrinsics, rng, settings, focal_35mm)

    def heat(
        self, part: Part, intrinsics: Pinhole | None = None, attachments: "Mapping[str, Attachment] | None" = None
    ) -> Heatmap:
        """Return the heat of one part of a question; see ``ask``."""
        if self._heats is None:
            return self._found_heat(part, intrinsics, attachments)
        return self._heats.heat(part, lambda: self._found_heat(part, intrinsics, attachments or {}))

    def _found_heat(
        self, part: Part, intrinsics: Pinhole | None, attachments: "Mapping[str, Attachment] | None"
    ) -> Heatmap:
        primary = part.role is Role.PRIMARY
        if part.is_file and attachments is not None:
            return self._heat_of_attachment(part, intrinsics, attachments)
        if part.modality is Modality.OBJECT:
            return self.object(part.query, primary)
        if part.modality is Modality.AREA:
            return self.area(part.query, primary)
        if part.modality is Modality.IMAGE:
            return self.image(part.query, intrinsics, primary)
        sound = self.sound_clip if part.is_file else self.sound
        return sound(part.query, primary, at=part.at)

    def _heat_of_attachment(
        self, part: Part, intrinsics: Pinhole | None, attachments: "Mapping[str, Attachment]"
    ) -> Heatmap:
        attached, primary = attachments.get(part.query), part.role is Role.PRIMARY
        if isinstance(attached, Sound) and part.modality is Modality.SOUND:
            return self.sound_clip(attached, primary, at=part.at)
        if isinstance(attached, np.ndarray | Photo) and part.modality is Modality.IMAGE:
            return self.image(attached, intrinsics, primary)
        what = "photo" if part.modality is Modality.IMAGE else "clip"
        raise QueryError(f"The question speaks of a {what} that did not come with it; attach one.")

    def ask(
        self,
        question: Question | str = "",
        top: int = 3,
        intrinsics: "Pinhole | Sequence[float] | None" = None,
        attachments: "Mapping[str, Attachment] | None" = None,
        *,
        object: str | None = None,
        sound: str | None = None,
        area: str | None = None,
        image: str | Path | None = None,
        clip: str | Path | None = None,
        primary: Modality | str | None = None,
        at: HeardAt | None = None,
        near: str | Sequence[float] | None = None,
    ) -> "Answer":
        """Answer a query with places, as the command line, the server and the viewer do.

        Args:
            question: a sentence, such as "the chair near the sound of glass breaking" or "how many chairs are there";
                or a question, whose parts are known. Without it the parts are those that are named below.
            top: number of goals at most.
            intrinsics: of the camera that took the question's pictures: a camera, or fx, fy, cx, cy in pixels; by
                default of its EXIF, else the map's own.
            attachments: pictures and sounds by the name that the parts have for them. Where given, no file is opened: a
                part of a file that is not among them is an error.
            object: instead of a sentence, the name of an object.
            sound: the name of a sound.
            area: the name of an area, such as a kitchen.
            image: a photo; with a sentence, what "this photo" in it means.
            clip: a sound clip; with a sentence, what "this recording" in it means.
            primary: which part is sought; the others say where it is.
            at: the place of a sound: ``robot``, where it was heard, or ``source``, where it came from; by default as
                ``settings.sounds.at`` says, else as the words do.
            near: x, y, z in metres of the recording frame, or x, y of the level one: the goals nearest to it come
                first, of those that are found.

        Raises:
            AskError: there is nothing to ask, both a sentence and parts, or a file that the sentence does not speak of.
            QueryError: the sentence is not understood, or a part of the query cannot be used.
        """
        from avlmaps.query.asking import (
            MOST_GOALS,
            Asked,
            AskError,
            Files,
            answer_question,
            ask,
            nearest_first,
            on_storey,
        )
        from avlmaps.query.places import place_given

        files, wanted = Files(intrinsics, attachments), as_whole(top)
        if wanted is None:
            raise AskError(f"top must be a whole number of goals, not {top!r}.")
        top = wanted
        _require_place(at)
        if isinstance(question, Question):
            if any(part is not None for part in (object, sound, area, image, clip, primary)):
                raise AskError("A question holds its parts already; give a sentence or parts instead.")
            place = None if near is None else place_given(near)
            answer = answer_question(self, question.heard_at(at), top if place is None else MOST_GOALS, files)
            return on_storey(answer if place is None else nearest_first(self, answer, place, top), self.storeys)
        for name, file in (("image", image), ("clip", clip)):
            if file is not None and not isinstance(file, str | Path):  # pyright: ignore[reportUnnecessaryIsInstance]
                raise AskError(
                    f"{name} is the path of a file, not {type(file).__name__}; what is in memory comes as "
                    f"attachments={{'it': ...}} and {name}='it'."
                )
        photo, recording = (None if file is None else str(file) for file in (image, clip))
        if primary is not None and (not isinstance(primary, str) or primary not in list(Modality)):  # pyright: ignore[reportUnnecessaryIsInstance]
            raise AskError(f"primary is one of {', '.join(Modality)}, not {primary!r}.")
        sought = None if primary is None else Modality(primary)
        asked = Asked(
            sentence=question, object=object, sound=sound, area=area, image=photo, clip=recording, primary=sought,
            top=top, at=at, near=near,
        )  # fmt: skip
        return ask(self, asked, files)


def _require_place(at: Any) -> None:
    if at is not None and (not isinstance(at, str) or at not in ("robot", "source")):
        raise QueryError(f"at is robot, where a sound was heard, or source, where it came from; not {at!r}.")


def _photo(picture: "str | Path | Photo | UInt8[np.ndarray, 'h w 3']", intrinsics: Pinhole | None) -> "Photo":
    """Return a picture, with the focal length of its file's EXIF where it counts."""
    if isinstance(picture, Photo):
        return picture
    if not isinstance(picture, str | Path):
        return Photo(np.asarray(picture))
    from avlmaps.query.locate import focal_35mm_of

    path = user_path(picture)
    return Photo(read_picture(path), None if intrinsics is not None else focal_35mm_of(path))


def _read_only(array: np.ndarray) -> np.ndarray:
    """Return a view of an array that cannot be written."""
    view = np.asarray(array)[:]
    view.flags.writeable = False
    return view


def _role(primary: bool) -> Role:
    return Role.PRIMARY if primary else Role.CONTEXT


def with_findings(data: "MapData", encoders: "Encoders") -> "MapData":
    """Return a map with what encoders find in it by their names: the closest names of each voxel, things and rooms."""
    return replace(data, findings=AVLMap(data, encoders, edits=()).found())
