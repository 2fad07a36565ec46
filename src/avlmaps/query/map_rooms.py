"""The rooms of a map as its encoders see them: where they end, and how likely each is each kind."""

from collections.abc import Callable
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from avlmaps.core.arrays import Float, Int
from avlmaps.core.errors import BackendError, MapError
from avlmaps.core.registry import Kind
from avlmaps.perception.protocols import SurveyedEncoder, read_room_contents
from avlmaps.query import findings
from avlmaps.query.floor_plan import FloorPlan
from avlmaps.query.modalities.area import AreaSettings, area_anchors, area_names, name_shares
from avlmaps.query.room_regions import RoomRegions
from avlmaps.query.rooms import NamedVoxels, RoomField, Rooms, rooms_of_cells, seen_twice, voting_rows
from avlmaps.query.voxel_space import Space

if TYPE_CHECKING:
    from avlmaps.maps.store.reader import StoredMap
    from avlmaps.maps.storeys import Storeys


class MapRooms:
    """What the encoders see of the rooms of a map; computed when it is asked for, or as the build found it."""

    def __init__(
        self, stored: "StoredMap", space: Space, settings: AreaSettings, storeys: "Callable[[], Storeys | None]"
    ) -> None:
        self._stored, self._space, self._settings, self._storeys = stored, space, settings, storeys

    @cached_property
    def votes(self) -> Rooms | None:
        """The votes on the kind of room of each place; None where the settings score keyframes instead.

        A map that has no floor plan (no voxels, no keyframes, kilometres of extent) has none either.
        """
        from avlmaps.maps.storeys import one_storey

        settings, stored = self._settings, self._stored
        if not settings.by_room or not len(stored.keyframes):
            return None
        cameras = self._space.level(np.asarray(stored.keyframes.world_from_camera, np.float64)[:, :3, 3])[:, 2]
        ground = stored.info.ground
        known = [(floor.best.height_m, floor.cameras) for floor in ground.floors] if ground is not None else []
        places = area_anchors(stored.keyframes, settings)
        plan = FloorPlan.of(self._space, self._storeys() or one_storey(known, cameras), places)
        return None if plan is None else Rooms(plan, places, self._voting_voxels, settings.rooms)

    @cached_property
    def regions(self) -> RoomRegions | None:
        """The rooms that walls and doorways bound; None where there is no floor plan."""
        votes = self.votes
        if votes is None:
            return None
        known = findings.regions_from(self._stored.data.findings, votes.plan)
        regions = self._seen_regions(votes) if known is None else known
        field = self.known_field
        return regions if field is None else regions.joined(seen_twice(field, regions))

    def _seen_regions(self, votes: Rooms) -> RoomRegions:
        camera = self._stored.rig.depth
        width_rad = 2.0 * float(np.arctan2(camera.width, 2.0 * camera.fx))
        return RoomRegions.of(votes.plan, np.asarray(self._stored.keyframes.world_from_camera), width_rad)

    @cached_property
    def field(self) -> RoomField | None:
        """The same as the view encoder sees it."""
        votes = self.votes
        if votes is None:
            return None
        encoder = self._stored.encoders.views
        self._stored.require_model(Kind.VIEWS)
        kinds = area_names(encoder)
        known = findings.field_from(self._stored.data.findings, votes.plan, kinds, self._settings)
        if known is not None:
            return known
        return votes.field(kinds, name_shares(np.asarray(self._stored.keyframes.view), encoder, self._settings))

    @property
    def known_field(self) -> RoomField | None:
        """The field; None where the map has no features of views, or those of another encoder."""
        try:
            return self.field
        except (BackendError, MapError):
            return None

    def _voting_voxels(self) -> NamedVoxels | None:
        """Return the voxels whose names vote on kinds of room; None where the map holds no probabilities of names."""
        from avlmaps.query.naming import VoxelNamer

        try:
            namer = VoxelNamer(self._stored)
        except (BackendError, MapError):  # no features of things, or those of another encoder: views vote alone
            return None
        if not namer.calibrated or not namer.names:
            return None
        feature = self._stored.voxels.feature
        rows, every = voting_rows(np.asarray(self._stored.voxels.index), len(namer.names) * feature.shape[1])
        area_m2 = every * self._space.grid.voxel_size_m**2
        encoder = self._stored.encoders.pixels
        surveyed = encoder.room_contents if isinstance(encoder, SurveyedEncoder) else None
        contents = surveyed or read_room_contents()
        return NamedVoxels(rows, namer.names, namer.confidences(rows), area_m2, contents)

    def room_of_places(self, places: Float[np.ndarray, "k 3"]) -> Int[np.ndarray, " k"]:
        """Return the number of the room that each place is in."""
        assert self.votes is not None
        return self.room_of_cells[self.votes.plan.cells_of(places)]

    @cached_property
    def room_of_cells(self) -> Int[np.ndarray, " c"]:
        """The number of the room of each cell of the floor plan."""
        assert self.regions is not None
        return rooms_of_cells(self.regions, area_anchors(self._stored.keyframes, self._settings))

    def found(self) -> dict[str, np.ndarray]:
        """Return the rooms and their kinds, for ``findings``; none where there is no floor plan."""
        if self.votes is None:
            return {}
        found = findings.regions_to_arrays(self._seen_regions(self.votes))
        field = self.known_field
        return found if field is None else found | findings.field_to_arrays(field, self._settings)
