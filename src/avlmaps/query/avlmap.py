"""The map as a user meets it: four modalities, each a heatmap, whole questions, and lists of what it holds."""

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
from avlmaps.maps.store import map_data
from avlmaps.maps.store.edits import Edit, read_edits
from avlmaps.maps.store.folder import read
from avlmaps.maps.store.map_data import MapData
from avlmaps.perception.protocols import read_room_contents
from avlmaps.query import contents, modalities
from avlmaps.query.contents import Contents, Room, SoundEvent, Thing, Watch, Whereabouts, part_named
from avlmaps.query.edits import Edited, means
from avlmaps.query.findings import MapNames, MapRooms
from avlmaps.query.heatmap import HeatCache, Heatmap, product
from avlmaps.query.modalities import Attachment, Photo
from avlmaps.query.objects import Instances
from avlmaps.query.settings import QuerySettings
from avlmaps.query.voxel_space import Space
from avlmaps.query.words import ClosestWords, is_open
from avlmaps.recordings.audio import Sound

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from avlmaps.maps.storeys import Storeys
    from avlmaps.perception.encoders import Encoders
    from avlmaps.query.answer import Answer
    from avlmaps.query.editor import Editor
    from avlmaps.query.locate import Located
    from avlmaps.query.room_regions import RoomRegions
    from avlmaps.query.rooms import RoomField, Rooms, ThingsInRooms
    from avlmaps.query.schema import ChangesAnswer, LastSeenAnswer
    from avlmaps.query.sound_sources import SoundSource, SourceMap

# Keyframes that are matched one by one for a picture that cannot be located: more of them guess no better (measured).
_GUESS_FROM = 20
_LEAST_EDITED = 0.2  # a person may name what the map is not certain of
# What serves answers, lists and fronts, rather than a person.
_INSIDE = ("as_edited_now", "forget_edits", "things_to_edit", "unedited_things", "things_in_rooms", "require_model",
           "has", "room_votes", "room_field", "room_regions", "where", "source_map", "sees", "heat",
           "closest_words", "doubts_of_things")  # fmt: skip


class AVLMap:
    """A map that can be queried. Heatmaps of one map multiply: ``m.object("chair", primary=True) * m.sound("dog")``.

    ``primary``: whether a part (of a sound or a picture, its place) is what is sought rather than a mark near that; its
    heat reaches 0.5 m, that of a mark 5 m.
    ``QueryError``: a word is empty, or an encoder of any words does not understand it; one of names has no heat for it,
    and a ``note`` on why. ``BackendError``: the map was made without the model needed.
    """

    def __init__(
        self, data: MapData, encoders: "Encoders | None" = None, *, path: Path | None = None,
        settings: QuerySettings | None = None, edits: Sequence[Edit] | None = None, heats: HeatCache | None = None,
    ) -> None:  # fmt: skip
        """``encoders``: by default those that it names. ``edits``: None for those of the map's folder, () for none."""
        self.data, self.path = data, path or Path("a map in memory")
        self._encoders = encoders
        self.settings = settings or QuerySettings()
        self._given_edits = edits
        self._heats = heats
        self._to_edit: dict[str | None, Sequence[Thing]] = {}

    @classmethod
    def open(cls, path: str | Path, settings: QuerySettings | None = None) -> "AVLMap":
        """Open a map's folder. ``MapError``: it is not a map, damaged, or of another schema or profile."""
        path = lasting_path(path)
        return cls(read(path), path=path, settings=settings)

    @cached_property
    def encoders(self) -> "Encoders":
        """The models that it is asked with; those that it names need not be known here until they are used."""
        return self._encoders or map_data.encoders_of_map(self.data.info)

    def require_model(self, kind: Kind) -> None:
        """Raise ``MapError`` unless its encoder of a kind is the one that made its features."""
        map_data.require_model(self.data.info, self.encoders, kind, self.path)

    def has(self, kind: Kind) -> bool:
        """Return whether the map was made with a model of a kind: without one of pixels it names no things."""
        return kind in self.data.info.models

    # Arrays.

    @cached_property
    def space(self) -> Space:
        """The voxels' places, shared by all heatmaps of this map."""
        return Space(self.data.grid, self.data.voxels.index, self.data.up_in_world, self.data)

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

    # What people corrected.

    @cached_property
    def edited(self) -> Edited:
        """What people corrected, as it applies to this map."""
        return Edited(read_edits(self.path) if self._given_edits is None else self._given_edits, self)

    @property
    def edit(self) -> "Editor":
        """Corrects the map: ``m.edit.rename("chair", "stool")``; see ``editor.Editor``."""
        from avlmaps.query.editor import Editor

        return Editor(self)

    def forget_edits(self) -> None:
        """Read what people corrected again at the next question."""
        # What lists things weighs them by what they are called.
        self._heats = None if self._heats is None else self._heats.anew()
        for name in ("edited", "room_field", "source_map", "where"):
            self.__dict__.pop(name, None)

    def as_edited_now(self) -> Self:
        """Return the same map with the edits of now; what no edit changes is not computed again."""
        other = copy(self)
        other.forget_edits()
        return other

    # Heat.

    def heat(
        self, part: Part, intrinsics: Pinhole | None = None, attachments: Mapping[str, Attachment] | None = None
    ) -> Heatmap:
        """Return the heat of one part of a question; see ``ask``."""
        if self._heats is None:
            return self._found_heat(part, intrinsics, attachments)
        return self._heats.heat(part, lambda: self._found_heat(part, intrinsics, attachments or {}))

    def _found_heat(
        self, part: Part, intrinsics: Pinhole | None, attachments: Mapping[str, Attachment] | None
    ) -> Heatmap:
        primary, named = part.role is Role.PRIMARY, part.query
        if part.modality is Modality.OBJECT:
            return self._object_heat(named, primary)
        if part.modality is Modality.AREA:
            return self.area(named, primary)
        if part.modality is Modality.SOUND and not part.is_file:
            return self.sound(named, primary, at=part.at)
        file: Any = named if attachments is None else attachments.get(named)
        if part.modality is Modality.SOUND and (attachments is None or isinstance(file, Sound)):
            return self.sound_clip(file, primary, at=part.at)
        if part.modality is Modality.IMAGE and (attachments is None or isinstance(file, np.ndarray | Photo)):
            return self.image(file, intrinsics, primary)  # pyright: ignore[reportUnknownArgumentType]
        what = "photo" if part.modality is Modality.IMAGE else "clip"
        raise QueryError(f"The question speaks of a {what} that did not come with it; attach one.")

    @checked(QueryError)
    def object(self, word: str, primary: bool = False, vocabulary: Sequence[str] | None = None) -> Heatmap:
        """Return the heat of an object; ``vocabulary``: what its word competes with, instead of the encoder's list.

        ``QueryError``: neither the encoder nor a person knows the word.
        """
        thing, *rooms = contents.in_room(self, Part(Modality.OBJECT, word))
        heat = product([self._object_heat(thing.query, primary, vocabulary), *(self.area(one.query) for one in rooms)])
        contents.require_known(lambda _: bool(heat.factors[0].understood), [word])
        return heat

    def _object_heat(self, word: str, primary: bool, vocabulary: Sequence[str] | None = None) -> Heatmap:
        part, heat = Part(Modality.OBJECT, word, role_of(primary)), self.settings.heat
        if (factor := self.edited.pinned(part, heat)) is None and self.edited.is_room(word):
            return self.area(word, primary)
        factor = factor or self.edited.object_factor(part, heat, lambda: self._names.heat(part, vocabulary))
        return Heatmap.of(factor, self.settings.found_at)

    @checked(QueryError)
    def area(self, word: str, primary: bool = False) -> Heatmap:
        """Return the heat of an area, such as a kitchen; or of one room by its number, such as bathroom 2."""
        from avlmaps.query.rooms import area_factor

        part = Part(Modality.AREA, word, role_of(primary))
        encoder = self.encoders.views
        self.require_model(Kind.VIEWS)
        settings, own = self.settings, part_named(self, word)
        factor = area_factor(
            self.space, self.data.keyframes, encoder, part, settings.areas, settings.heat, self.room_votes,
            self._settled if own is None else partial(self._with_part, own),
        )  # fmt: skip
        return Heatmap.of(factor, settings.found_at)

    @checked(QueryError)
    def sound(self, text: str, primary: bool = False, *, at: HeardAt | None = None) -> Heatmap:
        """Return the heat of where the robot was when it heard a sound of that name, or of where that came from.

        ``at``: ``robot`` or ``source``; by default as ``settings.sounds.at`` says, else ``robot``. ``QueryError``: the
        text is empty, or the map does not know where its sounds came from.
        """
        return self._sound_heat(Part(Modality.SOUND, text, role_of(primary)), self.sound_scores(text), at)

    @checked(QueryError)
    def sound_clip(self, clip: str | Path | Sound, primary: bool = False, *, at: HeardAt | None = None) -> Heatmap:
        """Return the heat of sounds like a clip; see ``sound``.

        ``QueryError``: it is missing, unreadable or silent, or the map does not know where its sounds came from.
        """
        if not isinstance(clip, str | Path | Sound):  # pyright: ignore[reportUnnecessaryIsInstance]
            raise QueryError(
                f"A clip is the path of a file or an avlmaps.Sound(samples, rate_hz), not {type(clip).__name__}."
            )
        if isinstance(clip, Sound):
            name, sound = "a clip", modalities.require_audible(clip, "that was given")
        else:
            name, sound = str(clip), modalities.read_clip(user_path(clip))
        part = Part(Modality.SOUND, name, role_of(primary), is_file=True)
        heard, scores = self.data.sounds, np.zeros(0)
        if len(heard):
            self.require_model(Kind.SOUNDS)
            encoder = self.encoders.sounds
            scores = encoder.score_sounds(modalities.sound_features(heard), encoder.encode(sound))
        return self._sound_heat(part, scores, at)

    @checked(QueryError)
    def sound_scores(self, text: str) -> Float[np.ndarray, " sounds"]:
        """Return for each sound of the map the probability that it is called so, in [0, 1]."""
        heard = self.data.sounds
        if not len(heard):
            return np.zeros(0)
        self.require_model(Kind.SOUNDS)
        return self.encoders.sounds.score_words(modalities.sound_features(heard), [text])[:, 0]

    def _sound_heat(self, part: Part, scores: Float[np.ndarray, " sounds"], at: HeardAt | None) -> Heatmap:
        settings, heat = self.settings.sounds, self.settings.heat
        _require_place(at)
        if (at or settings.at) == "source" and len(scores):
            factor = modalities.source_factor(self.space, self.source_map, scores, part, settings, heat)
        else:
            factor = modalities.sound_factor(self.space, self.data.sounds, scores, part, settings, heat)
        return Heatmap.of(factor, self.settings.found_at)

    @checked(QueryError)
    def image(
        self, picture: str | Path | Photo | UInt8[np.ndarray, "h w 3"], intrinsics: Pinhole | None = None,
        primary: bool = False,
    ) -> Heatmap:  # fmt: skip
        """Return the heat of where a picture was taken; if it is not located, of the best guess.

        ``picture``: a file, or RGB uint8, or that with what its EXIF says. ``intrinsics``: by default by its EXIF, else
        the map's own. ``QueryError``: the picture is missing, no picture, or does not fit the camera.
        """
        called = str(picture) if isinstance(picture, str | Path) else "a picture"
        part = Part(Modality.IMAGE, called, role_of(primary), is_file=True)
        located = self._located(_photo(picture, intrinsics), intrinsics, _GUESS_FROM)
        factor = modalities.image_factor(self.space, located, part, self.settings.heat)
        return Heatmap.of(factor, self.settings.found_at)

    @checked(QueryError)
    def locate(
        self, picture: str | Path | UInt8[np.ndarray, "h w 3"], intrinsics: Pinhole | None = None,
        focal_35mm: float | None = None,
    ) -> "Located":  # fmt: skip
        """Return the pose of the camera that took a picture, or that it was not located; see ``locate.locate``.

        ``intrinsics``, ``focal_35mm`` (as if for 35 mm film): of the camera that took it; by default by a file's EXIF,
        else the map's own. ``QueryError``: the picture is missing, no picture, or does not fit the camera.
        """
        if focal_35mm is not None and not 0.0 < focal_35mm < np.inf:
            raise QueryError(f"focal_35mm is a length over 0 mm, not {focal_35mm:g}.")
        photo = _photo(picture, intrinsics)
        return self._located(photo if focal_35mm is None else Photo(photo.rgb, focal_35mm), intrinsics)

    def _located(self, photo: Photo, intrinsics: Pinhole | None, guess_references: int = 0) -> "Located":
        from avlmaps.query import locate

        modalities.require_fitting(photo.rgb, intrinsics)
        for kind in (Kind.LOCAL, Kind.PLACE):  # an imported map has neither
            self.require_model(kind)
        rng = np.random.default_rng(self.settings.seed)
        settings = locate.LocateSettings(guess_references=guess_references)
        return locate.locate(locate.LocatableMap.of(self), photo.rgb, intrinsics, rng, settings, photo.focal_35mm)

    # Questions.

    def ask(
        self, question: Question | str = "", top: int = 3, intrinsics: "Pinhole | Sequence[float] | None" = None,
        attachments: Mapping[str, Attachment] | None = None, *, object: str | None = None, sound: str | None = None,
        area: str | None = None, image: str | Path | None = None, clip: str | Path | None = None,
        primary: Modality | str | None = None, at: HeardAt | None = None, near: str | Sequence[float] | None = None,
    ) -> "Answer":  # fmt: skip
        """Answer a query with places, as the command line, the server and the viewer do.

        ``question``: a sentence, such as "the chair near the sound of glass breaking" or "how many chairs are there",
        or parts. Without it the parts are an ``object``, a ``sound`` and an ``area`` by name, and files: a photo
        (``image``) and a sound (``clip``); with a sentence they are what "this photo" and "this recording" in it mean.
        ``top``: number of goals at most. ``intrinsics``: of the photo's camera: a camera, or fx, fy, cx, cy in pixels;
        by default of its EXIF, else the map's own. ``attachments``: pictures and sounds by the name that the parts have
        for them; then no file is opened. ``primary``: which part is sought; the others say where it is. ``at``: the
        place of a sound: ``robot``, where it was heard, or ``source``, where it came from; by default as
        ``settings.sounds.at`` says, else as the words do. ``near``: x, y, z in metres of the recording frame, or x, y
        of the level one: of the goals that are found the nearest to it come first.

        ``AskError``: there is nothing to ask, both a sentence and parts, or a file that the sentence does not speak of.
        ``QueryError``: the sentence is not understood, or a part of the query cannot be used.
        """
        from avlmaps.query.asking import Asked, AskError, ask

        wanted = as_whole(top)
        if wanted is None:
            raise AskError(f"top must be a whole number of goals, not {top!r}.")
        _require_place(at)
        for name, file in (("image", image), ("clip", clip)):
            if file is not None and not isinstance(file, str | Path):  # pyright: ignore[reportUnnecessaryIsInstance]
                raise AskError(
                    f"{name} is the path of a file, not {type(file).__name__}; what is in memory comes as "
                    f"attachments={{'it': ...}} and {name}='it'."
                )
        if primary is not None and (not isinstance(primary, str) or primary not in list(Modality)):  # pyright: ignore[reportUnnecessaryIsInstance]
            raise AskError(f"primary is one of {', '.join(Modality)}, not {primary!r}.")
        is_question = isinstance(question, Question)
        asked = Asked(
            sentence="" if is_question else question, question=question if is_question else None,
            object=object, sound=sound, area=area, image=None if image is None else str(image),
            clip=None if clip is None else str(clip), primary=None if primary is None else Modality(primary),
            top=wanted, at=at, near=near, camera=intrinsics, attachments=attachments,
        )  # fmt: skip
        return ask(self, asked)

    @checked(QueryError)
    def knows(self, phrase: str) -> bool:
        """Return whether the map can be queried for a thing: the pixel encoder sees such, or a person named one so."""
        return self.edited.knows(phrase) or self.sees(phrase)

    @checked(QueryError)
    def sees(self, phrase: str) -> bool:
        """Return whether the pixel encoder can look for a phrase: any phrase for an open vocabulary, else its words."""
        encoder = self.encoders.pixels
        return is_open(encoder) or bool(encoder.understood(phrase))

    @checked(QueryError)
    def instances(self, word: str, alone: bool = False) -> Instances:
        """Return the instances of a word; ``alone`` leaves out its narrower names: then an armchair is no "chair"."""
        return self.edited.instances(self._names.search(word, alone), word)

    def closest_words(self) -> ClosestWords:
        """Return the two words of the encoder's vocabulary closest to each voxel; the first query works them out."""
        return self._names.closest_words()

    # Lists.

    @checked(QueryError)
    def things(
        self, names: Sequence[str] | None = None, least_confidence: float = 0.5, structure: bool = False,
        watch: Watch = lambda stage, done, total: None, *, at: str | int | None = None, room: str | Room | None = None,
    ) -> list[Thing]:  # fmt: skip
        """Return the things of the map, most confident first, with their rooms; see ``contents.find_things``.

        ``at``: those that were there on a day: a date, or the number of a visit from 1; their ``rows`` hold what is
        left of them. ``room``: those in a room or by its name, or in all rooms of a kind. ``QueryError``: there is no
        such room, or the map was not seen on such a day.
        """
        if at is not None:
            from avlmaps.query.changes import Days, things_at
            from avlmaps.query.sound_sources import with_heard

            days = Days.of(self)
            found = things_at(self.space, days, at, names, least_confidence)
            every = found if names is None else things_at(self.space, days, at, None, least_confidence)
            found = with_heard(self, found, are_all=names is None, visit=days.visit_of(at), every=every)
        else:
            seen = [name for name in names if self.sees(name)] if names is not None and self.edited else names
            found = self.unedited_things(seen, least_confidence, structure, watch)
            found = self.edited.things(found, names, least_confidence)
        with suppress(BackendError, MapError):  # rooms are not known without the model of views that the map has
            found = self.where.with_rooms(found)
        return found if room is None else self.where.those_in(room, found)

    @checked(QueryError)
    def unedited_things(
        self, names: Sequence[str] | None = None, least_confidence: float = 0.5, structure: bool = False,
        watch: Watch = lambda stage, done, total: None,
    ) -> list[Thing]:  # fmt: skip
        """Return ``things`` as the encoder sees them, without what people corrected."""
        return contents.find_things(self, self._names.search, names, least_confidence, structure, watch)

    def things_to_edit(self, name: str | None) -> Sequence[Thing]:
        """Return the things that an edit may be about, as the encoder sees them: of a name, or of its vocabulary."""
        if name not in self._to_edit:
            is_seen = self.has(Kind.PIXELS) and (name is None or self.sees(name))
            self._to_edit[name] = (
                self.unedited_things(None if name is None else [name], _LEAST_EDITED) if is_seen else ()
            )
        return self._to_edit[name]

    @checked(QueryError)
    def sounds(self, most_names: int = 3) -> list[SoundEvent]:
        """Return the sounds of the map in the order of their onset; see ``contents.find_sounds``."""
        return contents.find_sounds(self, most_names)

    @checked(QueryError)
    def rooms(self, least_confidence: float = 0.0) -> list[Room]:
        """Return the rooms of the map, those with most views first; see ``contents.find_rooms``."""
        return self.edited.listed_rooms(contents.find_rooms(self, least_confidence))

    @checked(QueryError)
    def contents(
        self, least_confidence: float = 0.5, names: Sequence[str] | None = None, structure: bool = False
    ) -> Contents:
        """Return the things, sounds and rooms of the map; none of a kind that the map has no model for.

        Things below ``least_confidence``, in [0, 1], are left out. ``QueryError``: it lies outside, or a name of
        ``names`` is not known.
        """
        from avlmaps.query.sound_sources import with_heard

        sees = self.has(Kind.PIXELS)
        contents.require_known(self.knows, (names or ()) if sees else ())
        things = self.things(names, least_confidence, structure) if sees else []
        things = with_heard(self, things, are_all=not names)
        rooms = self.rooms() if self.has(Kind.VIEWS) else []
        return Contents(things, self.sounds(), rooms, self.doubts_of_things, self.storeys)

    @checked(QueryError)
    def sources(self, names: Sequence[str] = (), *, prior: bool = True, least: float = 0.0) -> "list[SoundSource]":
        """Return where sounds came from; see ``sound_sources.list_sources``. ``QueryError``: the map does not know."""
        from avlmaps.query.sound_sources import list_sources

        return list_sources(self, names, prior, least=least)

    def changes(self, since: str | int = 1, *, first_seen: bool = False) -> "ChangesAnswer":
        """Return what is new, moved and gone after a day: a date, or the number of a visit from 1.

        ``first_seen``: also what was seen first where nobody had looked before. ``QueryError``: there is no such day.
        """
        from avlmaps.query.changes import Days, changes_answer

        days = Days.of(self)
        since_visit = days.visit_of(since)
        return changes_answer(days, self.path.name, since_visit, self.where.name_of, first_seen=first_seen)

    @checked(QueryError)
    def last_seen(self, name: str) -> "LastSeenAnswer":
        """Return where things of a name were last seen. ``QueryError``: the map was seen on one day alone."""
        from avlmaps.query.changes import Days, last_seen

        return last_seen(Days.of(self), name, means(name), self.where.name_of)

    @property
    def doubts_of_things(self) -> tuple[str, ...]:
        """Why a list of its things may be wrong, one sentence each."""
        why = "The map was made without a model for things, so that it names none."
        return self.data.info.doubts if self.has(Kind.PIXELS) else (*self.data.info.doubts, why)

    # What is computed once.

    @cached_property
    def _names(self) -> MapNames:
        return MapNames(self)

    @cached_property
    def _rooms(self) -> MapRooms:
        return MapRooms(self)

    def found(self) -> dict[str, np.ndarray]:
        """Return what a build stores of the names and rooms that the encoders here see; see ``findings``."""
        found = dict[str, np.ndarray]()
        for part in (lambda: self._names.found(), lambda: self._rooms.found()):
            with suppress(BackendError, MapError):  # no features of these, or those of another encoder
                found |= part()
        return found

    @cached_property
    def source_map(self) -> "SourceMap":
        """The evidence of where sounds came from. ``QueryError``: the map has none."""
        from avlmaps.query.sound_sources import SourceMap

        return SourceMap.of(self)

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
    def where(self) -> Whereabouts:
        """The floors and rooms as names. ``MapError``: the map was built with another view encoder than is here."""
        return Whereabouts(self)

    @cached_property
    def room_votes(self) -> "Rooms | None":
        """The votes on the kind of room of each place; None where the settings score keyframes instead."""
        return self._rooms.votes

    @cached_property
    def room_regions(self) -> "RoomRegions | None":
        """The rooms that walls and doorways bound; None where there is no floor plan."""
        return self._rooms.regions

    @cached_property
    def room_field(self) -> "RoomField | None":
        """How likely each place is each kind of room that the encoder knows or a person named; None without votes.

        ``BackendError``: there is no view encoder. ``MapError``: the map was built with another one.
        """
        seen = self._rooms.field
        return None if seen is None else self._settled(seen)

    def _settled(self, field: "RoomField") -> "RoomField":
        # A room is of one kind, and those that people named are so.
        assert self.room_regions is not None
        return self.edited.room_field(field.settled(self.room_regions, self._rooms.room_of_cells))

    def _with_part(self, own_name: str, field: "RoomField") -> "RoomField":
        # One room, or part of one, is a kind of its own behind all others.
        return self._settled(field).with_certain([("", self.where.cells_of(own_name))])

    @cached_property
    def things_in_rooms(self) -> "ThingsInRooms | None":
        """The evidence of rooms on the things in them; None for a map whose rooms are not known."""
        from avlmaps.query.rooms import ThingsInRooms

        field = self._rooms.known_field
        return None if field is None else ThingsInRooms(field, read_room_contents())

    # Pictures and other libraries.

    def plot(self, path: str | Path | None = None, *, names: bool = True, ax: "Axes | None" = None) -> "Path | Figure":
        """Draw the map from above with its walk and sounds, and by default the names of its things and rooms.

        ``ax``: axes of your own, which are drawn into. ``QueryError``: the picture cannot be written to the path.
        """
        from avlmaps.query.plots import draw_map, save

        things = self.things() if names and self.has(Kind.PIXELS) else ()
        rooms = self.rooms() if names and self.has(Kind.VIEWS) else ()
        figure = draw_map(self, things, rooms, ax=ax)
        return figure if path is None else save(figure, path)

    def _repr_png_(self) -> bytes:
        from avlmaps.query.plots import draw_map, png_of

        return png_of(draw_map(self))

    def __dir__(self) -> list[str]:
        return [name for name in super().__dir__() if not name.startswith("_") and name not in _INSIDE]

    def to_trimesh(self) -> Any:
        """Return the voxels as a ``trimesh.PointCloud`` with colours."""
        import trimesh

        return trimesh.PointCloud(np.asarray(self.points, np.float64), colors=np.asarray(self.colors))

    def __repr__(self) -> str:
        counts = self.data.info.counts
        return (
            f"AVLMap({self.path.name!r}: {counts.voxels:,} voxels of {self.data.info.voxel_size_m:g} m, "
            f"{counts.keyframes} keyframes, {counts.sounds} sounds, profile {self.data.info.profile})"
        )


def _require_place(at: Any) -> None:
    if at is not None and (not isinstance(at, str) or at not in ("robot", "source")):
        raise QueryError(f"at is robot, where a sound was heard, or source, where it came from; not {at!r}.")


def _photo(picture: "str | Path | Photo | UInt8[np.ndarray, 'h w 3']", intrinsics: Pinhole | None) -> Photo:
    # The focal length of a file's EXIF counts where no intrinsics are given.
    if isinstance(picture, Photo):
        return picture
    if not isinstance(picture, str | Path):
        return Photo(np.asarray(picture))
    from avlmaps.query.locate import focal_35mm_of

    path = user_path(picture)
    return Photo(modalities.read_picture(path), None if intrinsics is not None else focal_35mm_of(path))


def _read_only(array: np.ndarray) -> np.ndarray:
    view = np.asarray(array)[:]
    view.flags.writeable = False
    return view


def role_of(primary: bool) -> Role:
    """Return the role of a part of a query."""
    return Role.PRIMARY if primary else Role.CONTEXT


def with_findings(data: MapData, encoders: "Encoders") -> MapData:
    """Return a map with what encoders find in it by their names: the closest names of each voxel, things and rooms."""
    return replace(data, findings=AVLMap(data, encoders, edits=()).found())
