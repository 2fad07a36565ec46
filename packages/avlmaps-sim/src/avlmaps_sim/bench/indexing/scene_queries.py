"""One scene under query: its map, its truth, and every source of heat that a configuration may join."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from jaxtyping import Float32, Int, UInt8

from avlmaps.core.errors import QueryError
from avlmaps.core.question import Modality, Part, Role
from avlmaps.query.avlmap import AVLMap
from avlmaps.query.heatmap import Heatmap
from avlmaps.query.modalities.area import area_factor, area_scores
from avlmaps.query.settings import PAPER_AREAS
from avlmaps.query.voxel_space import Space
from avlmaps.recordings.types import Recording
from avlmaps_sim.bench.harness.baselines import WeakHearing, alike_keyframe
from avlmaps_sim.bench.harness.factors import VoxelHeat, true_places, true_regions, true_things
from avlmaps_sim.bench.indexing.tasks import Task
from avlmaps_sim.bench.indexing.voxel_views import region_features, view_features
from avlmaps_sim.truth import Truth


@dataclass(eq=False)
class QueriedScene:
    """A map and the truth of its scene; each source of heat is computed once.

    ``label`` is the true thing of each voxel, -1 for none; a sound's true place is the robot's (``overlay``) or its
    source's (``acoustic``). The seed is that of the weak ear's examples.
    """

    avlmap: AVLMap
    recording: Recording
    truth: Truth
    label: Int[np.ndarray, " n"]
    hearing: str
    photo_of: Callable[[Task], UInt8[np.ndarray, "h w 3"]]
    seed: int = 0
    _kept: dict[tuple[object, ...], Heatmap | None] = field(default_factory=dict)

    @property
    def space(self) -> Space:
        """The voxels' places."""
        return self.avlmap.space

    @cached_property
    def largest_m(self) -> float:
        """The horizontal diagonal of the box round all things."""
        low = np.array([thing.low for thing in self.truth.objects])[:, :2].min(axis=0)
        high = np.array([thing.high for thing in self.truth.objects])[:, :2].max(axis=0)
        return float(np.linalg.norm(high - low))

    def _once(self, key: tuple[object, ...], make: Callable[[], Heatmap | None]) -> Heatmap | None:
        if key not in self._kept:
            self._kept[key] = make()
        return self._kept[key]

    def _part(self, modality: Modality, query: str, role: Role) -> tuple[Part, float]:
        is_file = modality is Modality.IMAGE
        return Part(modality, query, role, is_file), self.avlmap.settings.heat.falloff_per_m(role)

    # The map's own answers.

    def map_object(self, task: Task, role: Role) -> Heatmap | None:
        """The category, by the map's pixel features; raises ``QueryError`` where they know no such word."""
        primary = role is Role.PRIMARY
        return self._once(("object", task.object_name, role), lambda: self.avlmap.object(task.object_name, primary))

    def map_sound(self, task: Task, role: Role) -> Heatmap | None:
        """The sound, by the map's sound features."""
        primary = role is Role.PRIMARY
        return self._once(("sound", task.sound_name, role), lambda: self.avlmap.sound(task.sound_name, primary))

    def map_photo(self, task: Task, role: Role) -> Heatmap | None:
        """The photo, located in the map."""
        return self._once(
            ("photo", task.name, role), lambda: self.avlmap.image(self.photo_of(task), primary=role is Role.PRIMARY)
        )

    def map_area(self, task: Task, role: Role) -> Heatmap | None:
        """The area, by the keyframes' view features and the rules of the map."""
        return self._once(("area", task.context, role), lambda: self.avlmap.area(task.context, role is Role.PRIMARY))

    def paper_area(self, task: Task, role: Role) -> Heatmap | None:
        """The area by the paper's rules: from the camera's place, cosines stretched, every view for itself."""

        def make() -> Heatmap:
            part, _ = self._part(Modality.AREA, task.context, role)
            own = self.avlmap
            factor = area_factor(
                self.space, own.data.keyframes, own.encoders.views, part, PAPER_AREAS, own.settings.heat
            )
            return Heatmap.of(factor)

        return self._once(("paper area", task.context, role), make)

    # The paper's baselines on the same recording.

    def weak_sound(self, task: Task, role: Role) -> Heatmap | None:
        """The sound, by a weaker sound encoder."""
        return self._once(("weak", task.sound_name, role), lambda: self._weak_hearing.heat(task.sound_name, role))

    @cached_property
    def _weak_hearing(self) -> WeakHearing:
        return WeakHearing(self.avlmap, self.seed)

    def alike_keyframe(self, task: Task, role: Role) -> Heatmap | None:
        """The photo, put where the most alike keyframe was taken; its pose is not computed."""
        return self._once(
            ("alike", task.name, role), lambda: alike_keyframe(self.avlmap, self.photo_of(task), task.context, role)
        )

    def area_as_object(self, task: Task, role: Role) -> Heatmap | None:
        """The area's name, queried from the pixel features as if it were a thing; None where they do not know it."""

        def make() -> Heatmap | None:
            try:
                heat = self.avlmap.object(task.context, role is Role.PRIMARY)
            except QueryError:
                return None
            return heat if heat.peak > 0.0 else None

        return self._once(("area as object", task.context, role), make)

    def pixel_views(self, task: Task, role: Role) -> Heatmap | None:
        """The area, each voxel with the mean feature of the whole views that saw it."""
        return self._by_voxel("pixel views", task, role, lambda: self._voxel_views)

    def region_views(self, task: Task, role: Role) -> Heatmap | None:
        """The area by ConceptFusion's way: features of regions, mixed with their view's, averaged in each voxel."""
        return self._by_voxel("region views", task, role, lambda: self._region_views)

    def _by_voxel(
        self, name: str, task: Task, role: Role, features: Callable[[], Float32[np.ndarray, "n d"]]
    ) -> Heatmap | None:
        def make() -> Heatmap:
            part, _ = self._part(Modality.AREA, task.context, role)
            encoder, rows = self.avlmap.encoders.views, features()
            _, scores = area_scores(rows, encoder, task.context, self.avlmap.settings.areas)
            heat = np.where(rows.any(axis=1), scores, 0.0).astype(np.float32)
            return Heatmap.of(VoxelHeat(self.space, part, heat, bool((heat >= 0.5).any())))

        return self._once((name, task.context, role), make)

    @cached_property
    def _voxel_views(self) -> Float32[np.ndarray, "n d"]:
        return view_features(self.avlmap, self.recording)

    @cached_property
    def _region_views(self) -> Float32[np.ndarray, "n d"]:
        return region_features(self.avlmap, self.recording)

    # The truth.

    def true_object(self, task: Task, role: Role) -> Heatmap | None:
        """The things of the category, their voxels truly known."""

        def make() -> Heatmap:
            part, falloff = self._part(Modality.OBJECT, task.object_name, role)
            own = [i for i, thing in enumerate(self.truth.objects) if thing.category == task.object_name]
            return Heatmap.of(true_things(self.space, part, falloff, self.label, own))

        return self._once(("true object", task.object_name, role), make)

    def true_sound(self, task: Task, role: Role) -> Heatmap | None:
        """Where the sound was truly heard (overlay) or came from (acoustic)."""

        def make() -> Heatmap:
            part, falloff = self._part(Modality.SOUND, task.sound_name, role)
            events = [event for event in self.truth.events if event.category == task.sound_name]
            tracks = [np.array([event.source if self.hearing == "acoustic" else event.robot]) for event in events]
            return Heatmap.of(true_places(self.space, part, falloff, tracks))

        return self._once(("true sound", task.sound_name, role), make)

    def true_camera(self, task: Task, role: Role) -> Heatmap | None:
        """Where the photo was truly taken."""
        part, falloff = self._part(Modality.IMAGE, task.context, role)
        return Heatmap.of(true_places(self.space, part, falloff, [task.world_from_photo[None, :3, 3]]))

    def true_area(self, task: Task, role: Role) -> Heatmap | None:
        """The rooms of the kind, truly known."""

        def make() -> Heatmap:
            part, _ = self._part(Modality.AREA, task.context, role)
            return Heatmap.of(true_regions(self.space, part, self.truth.areas))

        return self._once(("true area", task.context, role), make)
