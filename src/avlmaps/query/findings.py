"""What the encoders of a map see in it: the names closest to each voxel, things, rooms and their kinds.

A build stores them (``MapData.findings``) with keys of its encoders and settings; for others they are found again.
"""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from functools import cached_property
from typing import TYPE_CHECKING, Any

import msgspec
import numpy as np

from avlmaps.core.arrays import Float16, Int, UInt8
from avlmaps.core.errors import BackendError, MapError
from avlmaps.core.question import Part
from avlmaps.core.registry import Kind
from avlmaps.core.version import __version__
from avlmaps.perception.protocols import NamedPixelEncoder, PixelEncoder, SurveyedEncoder, read_room_contents
from avlmaps.query.factors import NearThings
from avlmaps.query.objects import FeatureVoxels, Instances, confident_instances, object_factor
from avlmaps.query.words import ClosestWords, EncodedWord, Vocabulary, competes_whole

if TYPE_CHECKING:
    from avlmaps.query.avlmap import AVLMap
    from avlmaps.query.floor_plan import FloorPlan
    from avlmaps.query.room_regions import RoomRegions
    from avlmaps.query.rooms import NamedVoxels, RoomField, Rooms

Findings = Mapping[str, np.ndarray]
Search = tuple[str, bool]
"""A name, and whether it stands for itself alone, without narrower ones."""
_OF_INSTANCES = {
    "rows": np.int32, "instance": np.int32, "margin": np.float32, "score": np.float32, "confidence": np.float32,
}  # fmt: skip


_CLOSEST = ("best", "best_word", "second", "second_word")


def key_of(*ingredients: Any) -> np.ndarray:
    """Return a hash as bytes; another release of avlmaps finds its own."""
    said = msgspec.json.encode((__version__, ingredients), order="deterministic")
    return np.frombuffer(hashlib.sha256(said).digest(), np.uint8)


def _plan_key(plan: "FloorPlan") -> np.ndarray:
    return key_of(plan.wall.shape, plan.origin_m.tolist())


def _to_store(part: str, key: np.ndarray, arrays: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    return {f"{part}.key": key, **{f"{part}.{name}": array for name, array in arrays.items()}}


def _stored(findings: Findings, part: str, key: np.ndarray) -> dict[str, np.ndarray] | None:
    # The arrays of a part by their names; None where they were found with something else.
    if not np.array_equal(findings.get(f"{part}.key", ()), key):
        return None
    return {name.removeprefix(f"{part}."): findings[name] for name in findings if name.startswith(f"{part}.")}


def _searches_to_arrays(searches: Mapping[Search, Instances]) -> dict[str, np.ndarray]:
    # The instances of one name after those of another.
    found = [(len(one.rows), len(one)) for one in searches.values()]
    names = np.frombuffer(msgspec.json.encode(list(searches)), np.uint8)
    arrays: dict[str, np.ndarray] = {"names": names, "counts": np.array(found, np.int64).reshape(-1, 2)}
    for name, kind in _OF_INSTANCES.items():
        parts = [np.asarray(getattr(one, name), kind) for one in searches.values()]
        arrays[name] = np.concatenate([np.zeros(0, kind), *parts])
    return arrays


def _searches_from(stored: Mapping[str, np.ndarray]) -> dict[Search, Instances]:
    names = msgspec.json.decode(stored["names"].tobytes(), type=list[Search])
    columns, ends = [stored[name] for name in _OF_INSTANCES], np.cumsum(stored["counts"], axis=0)
    found = dict[Search, Instances]()
    for name, (row, first), (stop, last) in zip(names, ends - stored["counts"], ends, strict=True):
        rows, instance, margin, score = (column[row:stop] for column in columns[:-1])
        found[name] = Instances(rows, instance, margin, score, columns[-1][first:last])
    return found


def _regions_to_arrays(regions: "RoomRegions") -> dict[str, np.ndarray]:
    arrays = {"count": np.array([regions.count]), "beside": regions.beside}
    for number, (grid, label) in enumerate(zip(regions.grids, regions.labels, strict=True)):
        arrays[f"{number}.frame"] = np.array([grid.heading_rad, *grid.origin_m, grid.cell_m])
        arrays[f"{number}.cells"] = np.stack([grid.wall, grid.free, grid.stood])
        arrays[f"{number}.label"] = label
    return arrays


def _regions_from(stored: Mapping[str, np.ndarray], plan: "FloorPlan") -> "RoomRegions":
    from avlmaps.query.floor_plan import StoreyGrid
    from avlmaps.query.room_regions import RoomRegions

    storeys = range(len(plan.storeys))
    frames, cells, labels = ([stored[f"{n}.{name}"] for n in storeys] for name in ("frame", "cells", "label"))
    grids = tuple(StoreyGrid(float(f[0]), f[1:3], float(f[3]), *held) for f, held in zip(frames, cells, strict=True))
    return RoomRegions(plan, grids, tuple(labels), int(stored["count"][0]), stored["beside"])


class MapNames:
    """What the pixel encoder sees in a map, computed when it is used or as the build found it."""

    def __init__(self, avlmap: "AVLMap") -> None:
        self._map = avlmap
        self._rivals: tuple[tuple[str, ...], ClosestWords] | None = None

    def heat(self, part: Part, vocabulary: Sequence[str] | None) -> NearThings:
        """Return the heat of an object as the encoder sees it."""
        encoder = self._map.encoders.pixels
        rivals = self._own if vocabulary is None and self._is_closed else self.closest_words(vocabulary)
        voxels = self._feature_voxels(encoder, rivals, self._map.data.voxels.rgb)
        found = None
        if vocabulary is None:
            known = self._known_searches
            found = known.get((part.query, False), known.get((part.query, True)))
        return object_factor(voxels, part, self._map.settings.heat, found)

    def search(self, word: str, alone: bool) -> Instances:
        """Return the instances of a word; ``alone`` leaves out the narrower names that one of the encoder takes in."""
        known = self._known_searches.get((word, alone))
        if known is not None:
            return known
        encoder = self._map.encoders.pixels
        if alone and isinstance(encoder, NamedPixelEncoder) and word in encoder.names:
            encoded = EncodedWord.of_name(encoder, word)
        else:
            encoded = EncodedWord.of(encoder, word)
        return confident_instances(self._feature_voxels(encoder, self.closest_words()), encoded)

    def _feature_voxels(
        self, encoder: PixelEncoder, rivals: Vocabulary, rgb: UInt8[np.ndarray, "n 3"] | None = None
    ) -> FeatureVoxels:
        settings = self._map.settings.objects
        return FeatureVoxels(
            self._map.space, self._feature, encoder, rivals, settings, rgb, lambda: self._map.things_in_rooms
        )

    def closest_words(self, vocabulary: Sequence[str] | None = None) -> ClosestWords:
        """Return the two words of a vocabulary, by default the encoder's own, that are closest to each voxel."""
        if vocabulary is None:
            self._own = self._own if isinstance(self._own, ClosestWords) else self._own.closest(self._feature)
            return self._own
        self._map.require_model(Kind.PIXELS)
        if self._rivals is None or self._rivals[0] != tuple(vocabulary):
            closest = ClosestWords.of(self._feature, self._map.encoders.pixels, vocabulary)
            self._rivals = tuple(vocabulary), closest
        return self._rivals[1]

    @cached_property
    def _own(self) -> Vocabulary:
        # Of names, most voxels have too little of a word to be compared with all others: the two closest to each are
        # known where the build found them, or once all were asked for.
        encoder = self._map.encoders.pixels
        self._map.require_model(Kind.PIXELS)
        vocabulary = Vocabulary.encoded(encoder, encoder.vocabulary)
        closest = _stored(self._map.data.findings, "names", key_of(vocabulary.digest)) if self._is_closed else None
        if closest is None:
            return vocabulary
        return vocabulary.with_closest(tuple(closest[name] for name in _CLOSEST))  # pyright: ignore[reportArgumentType]

    @property
    def _feature(self) -> Float16[np.ndarray, "n d"]:
        return self._map.data.voxels.feature

    @property
    def _is_closed(self) -> bool:
        encoder = self._map.encoders.pixels
        return competes_whole(encoder, encoder.vocabulary)

    def found(self) -> dict[str, np.ndarray]:
        """Return the names closest to each voxel and the instances of all names; none of an encoder of any words."""
        from avlmaps.query.contents import STRUCTURE, searches_for

        encoder = self._map.encoders.pixels
        if not self._is_closed:
            return {}
        words = self.closest_words()
        closest = {name: getattr(words, name) for name in _CLOSEST}
        searches = searches_for([name for name in encoder.vocabulary if name not in STRUCTURE], encoder)
        things = {one: self.search(*one) for one in searches}
        found = _to_store("names", key_of(words.digest), closest)
        return found | _to_store("searches", self._key_of_searches, _searches_to_arrays(things))

    @property
    def _key_of_searches(self) -> np.ndarray:
        digest = self._own.digest if self._is_closed else None
        return key_of(digest, asdict(self._map.settings.objects), asdict(self._map.settings.areas))

    @cached_property
    def _known_searches(self) -> Mapping[tuple[str, bool], Instances]:
        findings = self._map.data.findings
        stored = _stored(findings, "searches", self._key_of_searches) if findings else None
        return {} if stored is None else _searches_from(stored)


class MapRooms:
    """What the encoders see of the rooms of a map, computed when it is used or as the build found it."""

    def __init__(self, avlmap: "AVLMap") -> None:
        self._map, self._settings = avlmap, avlmap.settings.areas

    @cached_property
    def votes(self) -> "Rooms | None":
        """The votes on the kind of room of each place; None of a map without keyframes, or of kilometres of extent."""
        from avlmaps.maps.storeys import one_storey
        from avlmaps.query.floor_plan import FloorPlan
        from avlmaps.query.rooms import Rooms, area_anchors

        settings, avlmap = self._settings, self._map
        if not len(avlmap.data.keyframes):
            return None
        cameras = self._map.space.level(np.asarray(avlmap.data.keyframes.world_from_camera, np.float64)[:, :3, 3])[:, 2]
        ground = avlmap.data.info.ground
        known = [(floor.best.height_m, floor.cameras) for floor in ground.floors] if ground is not None else []
        places = area_anchors(avlmap.data.keyframes, settings)
        plan = FloorPlan.of(self._map.space, self._map.storeys or one_storey(known, cameras), places)
        return None if plan is None else Rooms(plan, places, self._voting_voxels, settings.rooms)

    @cached_property
    def regions(self) -> "RoomRegions | None":
        """The rooms that walls and doorways bound; None where there is no floor plan."""
        votes = self.votes
        if votes is None:
            return None
        known = _stored(self._map.data.findings, "rooms", _plan_key(votes.plan))
        return self._seen_regions(votes) if known is None else _regions_from(known, votes.plan)

    def _seen_regions(self, votes: "Rooms") -> "RoomRegions":
        from avlmaps.query.room_regions import RoomRegions

        camera = self._map.data.rig.depth
        width_rad = 2.0 * float(np.arctan2(camera.width, 2.0 * camera.fx))
        return RoomRegions.of(votes.plan, np.asarray(self._map.data.keyframes.world_from_camera), width_rad)

    @cached_property
    def field(self) -> "RoomField | None":
        """How likely each cell of the floor plan is each kind of room, as the view encoder sees it."""
        from avlmaps.query.rooms import RoomField, area_names, name_shares

        votes = self.votes
        if votes is None:
            return None
        encoder = self._map.encoders.views
        self._map.require_model(Kind.VIEWS)
        kinds = area_names(encoder)
        known = _stored(self._map.data.findings, "kinds", self._key_of_kinds(votes, kinds))
        if known is not None:
            return RoomField(votes.plan, kinds, known["share"])
        return votes.field(kinds, name_shares(np.asarray(self._map.data.keyframes.view), encoder, self._settings))

    def _key_of_kinds(self, votes: "Rooms", kinds: tuple[str, ...]) -> np.ndarray:
        return key_of(_plan_key(votes.plan).tolist(), kinds, asdict(self._settings))

    @property
    def known_field(self) -> "RoomField | None":
        """The field; None where the map has no features of views, or those of another encoder."""
        try:
            return self.field
        except (BackendError, MapError):
            return None

    def _voting_voxels(self) -> "NamedVoxels | None":
        # The voxels whose names vote on kinds of room; None where the map holds no probabilities of names.
        from avlmaps.query.rooms import NamedVoxels, voting_rows
        from avlmaps.query.words import VoxelNamer

        try:
            namer = VoxelNamer(self._map)
        except (BackendError, MapError):  # no features of things, or those of another encoder: views vote alone
            return None
        if not namer.calibrated or not namer.names:
            return None
        feature = self._map.data.voxels.feature
        rows, every = voting_rows(np.asarray(self._map.data.voxels.index), len(namer.names) * feature.shape[1])
        area_m2 = every * self._map.space.grid.voxel_size_m**2
        encoder = self._map.encoders.pixels
        surveyed = encoder.room_contents if isinstance(encoder, SurveyedEncoder) else None
        contents = surveyed or read_room_contents()
        return NamedVoxels(rows, namer.names, namer.confidences(rows), area_m2, contents)

    @cached_property
    def room_of_cells(self) -> Int[np.ndarray, " c"]:
        """The number of the room of each cell of the floor plan."""
        from avlmaps.query.rooms import area_anchors, rooms_of_cells

        assert self.regions is not None
        return rooms_of_cells(self.regions, area_anchors(self._map.data.keyframes, self._settings))

    def found(self) -> dict[str, np.ndarray]:
        """Return the rooms and their kinds; none where there is no floor plan."""
        if self.votes is None:
            return {}
        plan, field = self.votes.plan, self.known_field
        found = _to_store("rooms", _plan_key(plan), _regions_to_arrays(self._seen_regions(self.votes)))
        if field is None:
            return found
        return found | _to_store("kinds", self._key_of_kinds(self.votes, field.kinds), {"share": field.share})
