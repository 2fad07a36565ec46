"""What the encoders of a map see in it: the names closest to each voxel, things, rooms and their kinds.

The end of a build stores them with the map (``MapData.findings``), each with a key of what it was found with; a map
with other encoders or settings than those is looked through again.
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
from avlmaps.query.floor_plan import FloorPlan
from avlmaps.query.instances import FeatureVoxels, Instances, Segmentation, confident_instances
from avlmaps.query.modalities.area import area_anchors, area_names, name_shares
from avlmaps.query.modalities.object import object_factor
from avlmaps.query.room_regions import RoomRegions
from avlmaps.query.rooms import NamedVoxels, RoomField, Rooms, rooms_of_cells, voting_rows
from avlmaps.query.settings import AreaSettings
from avlmaps.query.storey_grid import StoreyGrid
from avlmaps.query.words import Closest, ClosestWords, EncodedWord, Vocabulary, competes_whole

if TYPE_CHECKING:
    from avlmaps.query.avlmap import AVLMap

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


def _plan_key(plan: FloorPlan) -> np.ndarray:
    return key_of(plan.wall.shape, plan.origin_m.tolist())


def _known(findings: Findings, name: str, key: np.ndarray) -> bool:
    return name in findings and np.array_equal(findings[name], key)


def names_to_arrays(closest: Closest, key: np.ndarray) -> dict[str, np.ndarray]:
    """Return the two words closest to each voxel as arrays."""
    return {"names.key": key, **{f"names.{name}": array for name, array in zip(_CLOSEST, closest, strict=True)}}


def names_from(findings: Findings, key: np.ndarray) -> Closest | None:
    """Return the two words closest to each voxel; None where other words were compared."""
    if not _known(findings, "names.key", key):
        return None
    best, best_word, second, second_word = (findings[f"names.{name}"] for name in _CLOSEST)
    return best, best_word, second, second_word


def searches_to_arrays(searches: Mapping[Search, Segmentation], key: np.ndarray) -> dict[str, np.ndarray]:
    """Return the instances of names as arrays, those of one name after those of another."""
    names = np.frombuffer(msgspec.json.encode(list(searches)), np.uint8)
    found = [(len(one.instances.rows), len(one.instances), one.won, one.best) for one in searches.values()]
    arrays = {"things.key": key, "things.names": names, "things.counts": np.array(found, np.float64).reshape(-1, 4)}
    for name, kind in _OF_INSTANCES.items():
        parts = [np.asarray(getattr(one.instances, name), kind) for one in searches.values()]
        arrays[f"things.{name}"] = np.concatenate([np.zeros(0, kind), *parts])
    return arrays


def searches_from(findings: Findings, key: np.ndarray) -> dict[Search, Segmentation]:
    """Return the instances of names; none where they were found otherwise."""
    if not _known(findings, "things.key", key):
        return {}
    names = msgspec.json.decode(findings["things.names"].tobytes(), type=list[Search])
    counts, columns = findings["things.counts"], [findings[f"things.{name}"] for name in _OF_INSTANCES]
    ends = np.cumsum(counts[:, :2].astype(np.int64), axis=0)
    begins = ends - counts[:, :2].astype(np.int64)
    found = dict[Search, Segmentation]()
    for name, (row, first), (stop, last), (_, _, won, best) in zip(names, begins, ends, counts.tolist(), strict=True):
        rows, instance, margin, score = (column[row:stop] for column in columns[:-1])
        instances = Instances(rows, instance, margin, score, columns[-1][first:last])
        found[name] = Segmentation(instances, int(won), best)
    return found


def regions_to_arrays(regions: RoomRegions) -> dict[str, np.ndarray]:
    """Return the rooms of all storeys as arrays."""
    arrays = {
        "rooms.key": _plan_key(regions.plan),
        "rooms.count": np.array([regions.count]),
        "rooms.beside": regions.beside,
    }
    for number, (grid, label) in enumerate(zip(regions.grids, regions.labels, strict=True)):
        arrays[f"rooms.{number}.frame"] = np.array([grid.heading_rad, *grid.origin_m, grid.cell_m])
        arrays[f"rooms.{number}.cells"] = np.stack([grid.wall, grid.free, grid.stood])
        arrays[f"rooms.{number}.label"] = label
    return arrays


def regions_from(findings: Findings, plan: FloorPlan) -> RoomRegions | None:
    """Return the rooms of all storeys; None where they were found otherwise."""
    if not _known(findings, "rooms.key", _plan_key(plan)):
        return None
    grids: list[StoreyGrid] = []
    labels: list[Int[np.ndarray, "nx ny"]] = []
    for number in range(len(plan.storeys)):
        frame, cells, label = (findings[f"rooms.{number}.{name}"] for name in ("frame", "cells", "label"))
        grids.append(StoreyGrid(float(frame[0]), frame[1:3], float(frame[3]), *cells))
        labels.append(label)
    return RoomRegions(plan, tuple(grids), tuple(labels), int(findings["rooms.count"][0]), findings["rooms.beside"])


def field_to_arrays(field: RoomField, settings: "AreaSettings") -> dict[str, np.ndarray]:
    """Return the kinds of rooms as arrays."""
    key = key_of(_plan_key(field.plan).tolist(), field.kinds, asdict(settings))
    return {"kinds.key": key, "kinds.share": field.share, "kinds.views": np.ascontiguousarray(field.views)}


def field_from(
    findings: Findings, plan: FloorPlan, kinds: tuple[str, ...], settings: "AreaSettings"
) -> RoomField | None:
    """Return how likely each cell is each kind of room; None where that was found otherwise."""
    if not _known(findings, "kinds.key", key_of(_plan_key(plan).tolist(), kinds, asdict(settings))):
        return None
    return RoomField(plan, kinds, findings["kinds.share"], findings["kinds.views"])


class MapNames:
    """What the pixel encoder sees in a map; computed when it is asked for, or as the build found it."""

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
            found = self._known_searches.get((part.query, False)) or self._known_searches.get((part.query, True))
        return object_factor(voxels, part, self._map.settings.heat, found)

    def search(self, word: str, alone: bool) -> Segmentation:
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
        closest = names_from(self._map.data.findings, key_of(vocabulary.digest)) if self._is_closed else None
        return vocabulary if closest is None else vocabulary.with_closest(closest)

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
        closest = words.best, words.best_word, words.second, words.second_word
        searches = searches_for([name for name in encoder.vocabulary if name not in STRUCTURE], encoder)
        things = {one: self.search(*one) for one in searches}
        return names_to_arrays(closest, key_of(words.digest)) | searches_to_arrays(things, self._key_of_searches)

    @property
    def _key_of_searches(self) -> np.ndarray:
        digest = self._own.digest if self._is_closed else None
        return key_of(digest, asdict(self._map.settings.objects), asdict(self._map.settings.areas))

    @cached_property
    def _known_searches(self) -> Mapping[tuple[str, bool], Segmentation]:
        stored = self._map.data.findings
        return searches_from(stored, self._key_of_searches) if stored else {}


class MapRooms:
    """What the encoders see of the rooms of a map; computed when it is asked for, or as the build found it."""

    def __init__(self, avlmap: "AVLMap") -> None:
        self._map, self._settings = avlmap, avlmap.settings.areas

    @cached_property
    def votes(self) -> Rooms | None:
        """The votes on the kind of room of each place.

        None where there is no floor plan: of a map without voxels or keyframes, or with kilometres of extent.
        """
        from avlmaps.maps.storeys import one_storey

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
    def regions(self) -> RoomRegions | None:
        """The rooms that walls and doorways bound; None where there is no floor plan."""
        votes = self.votes
        if votes is None:
            return None
        known = regions_from(self._map.data.findings, votes.plan)
        return self._seen_regions(votes) if known is None else known

    def _seen_regions(self, votes: Rooms) -> RoomRegions:
        camera = self._map.data.rig.depth
        width_rad = 2.0 * float(np.arctan2(camera.width, 2.0 * camera.fx))
        return RoomRegions.of(votes.plan, np.asarray(self._map.data.keyframes.world_from_camera), width_rad)

    @cached_property
    def field(self) -> RoomField | None:
        """The same as the view encoder sees it."""
        votes = self.votes
        if votes is None:
            return None
        encoder = self._map.encoders.views
        self._map.require_model(Kind.VIEWS)
        kinds = area_names(encoder)
        known = field_from(self._map.data.findings, votes.plan, kinds, self._settings)
        if known is not None:
            return known
        return votes.field(kinds, name_shares(np.asarray(self._map.data.keyframes.view), encoder, self._settings))

    @property
    def known_field(self) -> RoomField | None:
        """The field; None where the map has no features of views, or those of another encoder."""
        try:
            return self.field
        except (BackendError, MapError):
            return None

    def _voting_voxels(self) -> NamedVoxels | None:
        # The voxels whose names vote on kinds of room; None where the map holds no probabilities of names.
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
        assert self.regions is not None
        return rooms_of_cells(self.regions, area_anchors(self._map.data.keyframes, self._settings))

    def found(self) -> dict[str, np.ndarray]:
        """Return the rooms and their kinds, for ``findings``; none where there is no floor plan."""
        if self.votes is None:
            return {}
        found = regions_to_arrays(self._seen_regions(self.votes))
        field = self.known_field
        return found if field is None else found | field_to_arrays(field, self._settings)
