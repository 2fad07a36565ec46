"""The queries of a scene by each source of heat, with the view features of every voxel.

ConceptFusion (Jatavallabhula et al., RSS 2023) gives each pixel the feature of its region's cut-out, mixed with that of
the whole picture, and fuses them into the map. With f_i of region i and f of the whole, all of unit length,

    w = softmax over i of <f_i, f> + (1/R) sum over j != i of <f_i, f_j>
    feature of region i = w_i f + (1 - w_i) f_i, scaled to unit length

The regions here are those of any profile, without a proposer on torch: connected surface without an edge of depth or
direction, so that they know no class. Pixels of no region take the feature of the whole view.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property

import cv2
import numpy as np
from jaxtyping import Float32, Int, UInt8

from avlmaps.core.camera import Rig
from avlmaps.core.errors import QueryError
from avlmaps.core.poses import apply
from avlmaps.core.progress import progress
from avlmaps.core.question import Modality, Part, Role
from avlmaps.days.surfaces import packed
from avlmaps.perception.protocols import ViewEncoder
from avlmaps.query.avlmap import AVLMap
from avlmaps.query.heatmap import Heatmap
from avlmaps.query.rooms import area_factor, area_scores
from avlmaps.query.settings import PAPER_AREAS
from avlmaps.query.voxel_space import Space
from avlmaps.recordings.types import Frame, Recording
from avlmaps_sim.bench.harness.factors import (
    VoxelHeat,
    WeakHearing,
    alike_keyframe,
    true_places,
    true_regions,
    true_things,
)
from avlmaps_sim.bench.indexing.tasks import Task
from avlmaps_sim.truth import Truth

_STRIDE_PX = 3
_SEEN_TO_M = 6.0
_DEPTH_EDGE = 0.04  # of the depth, from one pixel to the next
_TURN_EDGE = 0.9  # cosine between the normals of neighbours
_LEAST_SHARE = 0.01  # of the picture that a region covers
_MOST_REGIONS = 12  # of a picture, the largest
_Rows = Callable[[Frame, int], tuple[Float32[np.ndarray, "r d"], Int[np.ndarray, "h w"]]]


def view_features(avlmap: AVLMap, recording: Recording) -> Float32[np.ndarray, "n d"]:
    """Return for each voxel the mean view feature of the keyframes that saw it, unit length; zero where none did."""
    views = avlmap.data.keyframes.view

    def rows(frame: Frame, keyframe: int) -> tuple[Float32[np.ndarray, "r d"], Int[np.ndarray, "h w"]]:
        return np.asarray(views[keyframe], np.float32)[None], np.zeros(frame.depth_m.shape, np.int64)

    return _spread(avlmap, recording, rows)


def region_features(avlmap: AVLMap, recording: Recording) -> Float32[np.ndarray, "n d"]:
    """Return for each voxel the mean feature of the regions that showed it, unit length; zero for one never shown."""
    views, encoder = avlmap.data.keyframes.view, avlmap.encoders.views

    def rows(frame: Frame, keyframe: int) -> tuple[Float32[np.ndarray, "r d"], Int[np.ndarray, "h w"]]:
        whole = np.asarray(views[keyframe], np.float32)
        label = surface_regions(frame)
        cut = [cut_out(frame, label == number) for number in range(1, int(label.max()) + 1)]
        return np.concatenate([whole[None], mixed(whole, _encoded(encoder, cut, len(whole)))]), label

    return _spread(avlmap, recording, rows)


def _encoded(encoder: ViewEncoder, cut: list[Frame], dim: int) -> Float32[np.ndarray, "r d"]:
    return np.concatenate([np.zeros((0, dim), np.float32), *(np.asarray(encoder.encode([one])) for one in cut)])


def surface_regions(frame: Frame) -> Int[np.ndarray, "h w"]:
    """Return the number of each depth pixel's region, from 1, the largest first; 0 for no region."""
    depth_m, camera = np.asarray(frame.depth_m, np.float64), frame.rig.depth
    height, width = depth_m.shape
    rays = camera.resized(width, height).rays()
    points = rays / rays[..., 2:] * depth_m[..., None]
    normal = np.cross(np.gradient(points, axis=1), np.gradient(points, axis=0))
    normal /= np.maximum(np.linalg.norm(normal, axis=2, keepdims=True), 1e-12)
    edge = depth_m <= 0.0
    for axis in (0, 1):
        step = np.abs(np.diff(depth_m, axis=axis)) > _DEPTH_EDGE * np.minimum(*_neighbours(depth_m, axis))
        turn = (np.multiply(*_neighbours(normal, axis))).sum(axis=2) < _TURN_EDGE
        first = (slice(None, -1), slice(None)) if axis == 0 else (slice(None), slice(None, -1))
        edge[first] |= step | turn
    count, parts, facts, _ = cv2.connectedComponentsWithStats((~edge).astype(np.uint8), connectivity=4)
    area = facts[:, cv2.CC_STAT_AREA]
    large = [n for n in np.argsort(-area, kind="stable") if n > 0 and area[n] >= _LEAST_SHARE * edge.size]
    number = np.zeros(count, np.int64)
    number[large[:_MOST_REGIONS]] = np.arange(1, len(large[:_MOST_REGIONS]) + 1)
    return number[np.asarray(parts, np.int64)]


def _neighbours(values: np.ndarray, axis: int) -> tuple[np.ndarray, np.ndarray]:
    return (values[:-1], values[1:]) if axis == 0 else (values[:, :-1], values[:, 1:])


def cut_out(frame: Frame, mask: np.ndarray) -> Frame:
    """Return the part of a frame in the box round a mask over its depth picture, as a frame of a smaller camera."""
    row, column = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    y, x = slice(row[0], row[-1] + 1), slice(column[0], column[-1] + 1)
    height, width = mask.shape
    rgb = frame.rgb if frame.rgb.shape[:2] == mask.shape else cv2.resize(frame.rgb, (width, height))
    camera = frame.rig.depth
    size = {"width": x.stop - x.start, "height": y.stop - y.start}
    small = replace(camera, cx=camera.cx - x.start, cy=camera.cy - y.start, **size)
    depth_m = np.ascontiguousarray(frame.depth_m[y, x])
    return replace(frame, rgb=np.ascontiguousarray(rgb[y, x]), depth_m=depth_m, rig=Rig(small, small))


def mixed(whole: Float32[np.ndarray, " d"], regions: Float32[np.ndarray, "r d"]) -> Float32[np.ndarray, "r d"]:
    """Return unit features of regions with some of the whole view in each."""
    if not len(regions):
        return regions
    among = regions @ regions.T
    alike = regions @ whole + (among.sum(axis=1) - np.diagonal(among)) / len(regions)
    weight = np.exp(alike - alike.max())[:, None]
    weight /= weight.sum()
    both = weight * whole + (1.0 - weight) * regions
    return (both / np.maximum(np.linalg.norm(both, axis=1, keepdims=True), 1e-12)).astype(np.float32)


def _spread(avlmap: AVLMap, recording: Recording, rows_of: _Rows) -> Float32[np.ndarray, "n d"]:
    """Add up rows over the voxels that their pixels lie in: each row counts once a voxel and keyframe."""
    stored = avlmap.data
    key = packed(np.asarray(stored.voxels.index, np.int64))
    total = np.zeros((len(key), stored.keyframes.view.shape[1]), np.float32)
    frame_of = np.searchsorted(recording.stamps_s, np.asarray(stored.keyframes.stamp_s) - 1e-6)
    for keyframe in progress(range(len(frame_of)), "views by voxel", unit="keyframe"):
        frame = recording.frame(int(min(frame_of[keyframe], len(recording) - 1)))
        rows, label = rows_of(frame, keyframe)
        depth_m = frame.depth_m[::_STRIDE_PX, ::_STRIDE_PX].astype(np.float64)
        row, column = np.nonzero((depth_m > 0.0) & (depth_m < _SEEN_TO_M))
        z, camera = depth_m[row, column], frame.rig.depth
        x = (column * _STRIDE_PX + 0.5 - camera.cx) / camera.fx * z
        y = (row * _STRIDE_PX + 0.5 - camera.cy) / camera.fy * z
        points = apply(frame.world_from_camera, np.stack([x, y, z], axis=1))
        which = label[::_STRIDE_PX, ::_STRIDE_PX][row, column]
        seen, numbers = np.unique(np.stack([packed(stored.grid.index_of(points)), which], axis=1), axis=0).T
        at = np.minimum(np.searchsorted(key, seen), max(len(key) - 1, 0))
        known = key[at] == seen
        np.add.at(total, at[known], rows[numbers[known]])
    return total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-12)


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
