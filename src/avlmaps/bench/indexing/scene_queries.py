"""One scene as it is asked: its map, its truth, and every source of heat that a configuration may join."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

import numpy as np
from jaxtyping import Float32, Int, UInt8

from avlmaps.bench.indexing.baselines import WeakHearing, alike_keyframe
from avlmaps.bench.indexing.factors import VoxelHeat, true_places, true_regions, true_things
from avlmaps.bench.indexing.tasks import Task
from avlmaps.core.errors import QueryError
from avlmaps.core.poses import apply
from avlmaps.core.question import Modality, Part, Role
from avlmaps.core.registry import Kind
from avlmaps.query.avlmap import AVLMap
from avlmaps.query.heatmap import Heatmap
from avlmaps.query.modalities.area import area_factor, area_scores
from avlmaps.query.voxel_space import Space
from avlmaps.recordings.types import Recording
from avlmaps.sim.truth import Truth

_STRIDE_PX = 3
_SEEN_TO_M = 6.0


@dataclass(eq=False)
class AskedScene:
    """A map and the truth of its scene; each source of heat is worked out once.

    Attributes:
        asked: the map.
        recording: what it was made of.
        truth: what is there.
        label: the true thing of each voxel, -1 for none.
        hearing: whether a sound's true place is the robot's (``overlay``) or its source's (``acoustic``).
        photo_of: draws the photo of a task.
        seed: of the weak ear's examples.
    """

    asked: AVLMap
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
        return self.asked.space

    @cached_property
    def largest_m(self) -> float:
        """The horizontal diagonal of the box round all things."""
        low = np.array([thing.low for thing in self.truth.objects])[:, :2].min(axis=0)
        high = np.array([thing.high for thing in self.truth.objects])[:, :2].max(axis=0)
        return float(np.linalg.norm(high - low))

    def has(self, kinds: Sequence[Kind]) -> bool:
        """Tell whether the map's profile has models for all of these."""
        return all(self.asked.stored.profile.backend_name(kind) for kind in kinds)

    def _once(self, key: tuple[object, ...], make: Callable[[], Heatmap | None]) -> Heatmap | None:
        if key not in self._kept:
            self._kept[key] = make()
        return self._kept[key]

    def _part(self, modality: Modality, query: str, role: Role) -> tuple[Part, float]:
        is_file = modality is Modality.IMAGE
        return Part(modality, query, role, is_file), self.asked.settings.heat.falloff_per_m(role)

    # What the map itself says.

    def map_object(self, task: Task, role: Role) -> Heatmap | None:
        """The category, as the map's pixel features tell it; raises ``QueryError`` where they know no such word."""
        primary = role is Role.PRIMARY
        return self._once(("object", task.category, role), lambda: self.asked.object(task.category, primary))

    def map_sound(self, task: Task, role: Role) -> Heatmap | None:
        """The sound, as the map's sound features tell it."""
        return self._once(("sound", task.context, role), lambda: self.asked.sound(task.context, role is Role.PRIMARY))

    def map_photo(self, task: Task, role: Role) -> Heatmap | None:
        """The photo, located in the map."""
        return self._once(
            ("photo", task.name, role), lambda: self.asked.image(self.photo_of(task), primary=role is Role.PRIMARY)
        )

    def map_area(self, task: Task, role: Role, anchor: Literal["camera", "centre"]) -> Heatmap | None:
        """The area, as the keyframes' view features tell it."""

        def make() -> Heatmap:
            part, _ = self._part(Modality.AREA, task.context, role)
            stored, settings = self.asked.stored, self.asked.settings
            encoder = stored.profile.view_encoder()
            alone = {"pool_m": 0.0} if anchor == "camera" else {}  # the paper's views speak each for itself
            areas = replace(settings.areas, anchor=anchor, **alone)
            return Heatmap.of(area_factor(self.space, stored.keyframes, encoder, part, areas, settings.heat))

        return self._once(("area", task.context, role, anchor), make)

    # What the paper's baselines make of the same recording.

    def weak_sound(self, task: Task, role: Role) -> Heatmap | None:
        """The sound, as a weaker ear tells it."""
        return self._once(("weak", task.context, role), lambda: self._weak_hearing.heat(task.context, role))

    @cached_property
    def _weak_hearing(self) -> WeakHearing:
        return WeakHearing(self.asked, self.seed)

    def alike_keyframe(self, task: Task, role: Role) -> Heatmap | None:
        """The photo, put where the most alike keyframe was taken; its pose is not worked out."""
        return self._once(
            ("alike", task.name, role), lambda: alike_keyframe(self.asked, self.photo_of(task), task.context, role)
        )

    def area_as_object(self, task: Task, role: Role) -> Heatmap | None:
        """The area's name, asked of the pixel features as if it were a thing; None where they know nothing of it."""

        def make() -> Heatmap | None:
            try:
                heat = self.asked.object(task.context, role is Role.PRIMARY)
            except QueryError:
                return None
            return heat if heat.peak > 0.0 else None

        return self._once(("area as object", task.context, role), make)

    def pixel_views(self, task: Task, role: Role) -> Heatmap | None:
        """The area, each voxel having the mean view feature of the keyframes that saw it (ConceptFusion's idea)."""

        def make() -> Heatmap:
            part, _ = self._part(Modality.AREA, task.context, role)
            encoder = self.asked.stored.profile.view_encoder()
            _, scores = area_scores(self._voxel_views, encoder, task.context, self.asked.settings.areas)
            heat = np.where(self._voxel_views.any(axis=1), scores, 0.0).astype(np.float32)
            return Heatmap.of(VoxelHeat(self.space, part, heat, bool((heat >= 0.5).any())))

        return self._once(("pixel views", task.context, role), make)

    @cached_property
    def _voxel_views(self) -> Float32[np.ndarray, "n d"]:
        return voxel_views(self.asked, self.recording)

    # What is truly there.

    def true_object(self, task: Task, role: Role) -> Heatmap | None:
        """The things of the category, their voxels truly known."""

        def make() -> Heatmap:
            part, falloff = self._part(Modality.OBJECT, task.category, role)
            own = [i for i, thing in enumerate(self.truth.objects) if thing.category == task.category]
            return Heatmap.of(true_things(self.space, part, falloff, self.label, own))

        return self._once(("true object", task.category, role), make)

    def true_sound(self, task: Task, role: Role) -> Heatmap | None:
        """Where the sound was truly heard (overlay) or came from (acoustic)."""

        def make() -> Heatmap:
            part, falloff = self._part(Modality.SOUND, task.context, role)
            events = [event for event in self.truth.events if event.category == task.context]
            tracks = [np.array([event.source if self.hearing == "acoustic" else event.robot]) for event in events]
            return Heatmap.of(true_places(self.space, part, falloff, tracks))

        return self._once(("true sound", task.context, role), make)

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


def voxel_views(asked: AVLMap, recording: Recording) -> Float32[np.ndarray, "n d"]:
    """Return for each voxel the mean view feature of the keyframes that saw it, unit length; zero where none did."""
    stored = asked.stored
    index = np.asarray(stored.voxels.index, np.int64)
    key = _packed(index)
    total = np.zeros((len(index), stored.keyframes.view.shape[1]), np.float32)
    frame_of = np.searchsorted(recording.stamps_s, np.asarray(stored.keyframes.stamp_s) - 1e-6)
    for number, view in zip(np.minimum(frame_of, len(recording) - 1), stored.keyframes.view, strict=True):
        frame = recording.frame(int(number))
        depth_m = frame.depth_m[::_STRIDE_PX, ::_STRIDE_PX].astype(np.float64)
        row, column = np.nonzero((depth_m > 0.0) & (depth_m < _SEEN_TO_M))
        z, camera = depth_m[row, column], frame.rig.depth
        x = (column * _STRIDE_PX + 0.5 - camera.cx) / camera.fx * z
        y = (row * _STRIDE_PX + 0.5 - camera.cy) / camera.fy * z
        points = apply(frame.world_from_camera, np.stack([x, y, z], axis=1))
        seen = np.unique(_packed(stored.grid.index_of(points)))
        at = np.minimum(np.searchsorted(key, seen), max(len(key) - 1, 0))
        total[at[key[at] == seen]] += np.asarray(view, np.float32)
    return total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-12)


def _packed(index: Int[np.ndarray, "n 3"]) -> Int[np.ndarray, " n"]:
    """Pack voxel indices into one number each, in the order of the map (x, then y, then z)."""
    shifted = np.asarray(index, np.int64) + (1 << 20)
    return (shifted[:, 0] << 42) | (shifted[:, 1] << 21) | shifted[:, 2]
