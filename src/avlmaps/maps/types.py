"""The content of a map, in memory or memory-mapped: voxels, keyframes, sounds; all in the recording's world."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar

import msgspec
import numpy as np

from avlmaps.core.arrays import Float16, Float32, Float64, Int, Int8, Int32, Int64, UInt8, UInt16
from avlmaps.core.columns import take


@dataclass(frozen=True, slots=True, repr=False)
class Voxels:
    """Occupied voxels, sorted by index (x, then y, then z).

    Attributes:
        index: which voxel.
        feature: mean feature, unit length; zero where no pixel with a feature fell.
        weight: sum of the fusion weights of the pixels with a feature.
        rgb: mean colour.
        last_seen_s: when a pixel last fell into it.
        hits: how many pixels fell into it.
    """

    index: Int32[np.ndarray, "n 3"]
    feature: Float16[np.ndarray, "n d"]
    weight: Float32[np.ndarray, " n"]
    rgb: UInt8[np.ndarray, "n 3"]
    last_seen_s: Float64[np.ndarray, " n"]
    hits: Int64[np.ndarray, " n"]

    def __len__(self) -> int:
        return len(self.index)

    def __repr__(self) -> str:
        return f"Voxels({len(self):,} with features of {self.feature.shape[1]} numbers)"


@dataclass(frozen=True, slots=True, repr=False)
class Keyframes:
    """Chosen frames, in the order of time. Ragged arrays: keyframe k has rows ``offsets[k]:offsets[k + 1]``.

    Attributes:
        stamp_s: when.
        world_from_camera: pose of the depth camera.
        centre: middle of what the camera saw, metres, world.
        view: area feature (k, 0 columns where the profile has no view encoder).
        place: place descriptor.
        offsets: (k + 1,) into the rows of the local features.
        xy: keypoints, pixels of the colour picture.
        descriptors: local descriptors, unit length, halved to float16.
        points_world: the keypoints' 3D points, NaN where there was no depth.
        thumbnail_offsets: (k + 1,) into ``thumbnails``.
        thumbnails: JPEG files one after the other.
        score: the detector's confidence in each keypoint, in [0, 1]; empty where it gives none, and in maps written
            before there was such an array.
        clear_mm: up to which depth each keyframe saw freely, block by block, as ``FreeViews``: by it a later day knows
            what of this one it looked at. Empty where depths are used as they are, and in maps written before.
    """

    RAGGED: ClassVar = (("offsets", "xy"), ("thumbnail_offsets", "thumbnails"))
    stamp_s: Float64[np.ndarray, " k"]
    world_from_camera: Float64[np.ndarray, "k 4 4"]
    centre: Float32[np.ndarray, "k 3"]
    view: Float32[np.ndarray, "k dv"]
    place: Float32[np.ndarray, "k dp"]
    offsets: Int64[np.ndarray, " k1"]
    xy: Float32[np.ndarray, "m 2"]
    descriptors: Float16[np.ndarray, "m dl"]
    points_world: Float32[np.ndarray, "m 3"]
    thumbnail_offsets: Int64[np.ndarray, " k1"]
    thumbnails: UInt8[np.ndarray, " bytes"]
    score: Float16[np.ndarray, " m_or_0"] = field(default_factory=lambda: np.zeros(0, np.float16))
    clear_mm: UInt16[np.ndarray, "k_or_0 rows columns"] = field(default_factory=lambda: np.zeros((0, 0, 0), np.uint16))

    def __len__(self) -> int:
        return len(self.stamp_s)

    def __repr__(self) -> str:
        return f"Keyframes({len(self)} with {len(self.xy):,} keypoints)"

    def jpeg(self, row: int) -> UInt8[np.ndarray, " n"]:
        """Return the file of a keyframe's picture; empty where it has none."""
        first, last = (int(edge) for edge in self.thumbnail_offsets[row : row + 2])
        return np.asarray(self.thumbnails[first:last])

    def take(self, rows: Int[np.ndarray, " r"]) -> "Keyframes":
        """Return some of them."""
        return take(self, rows)


@dataclass(frozen=True, slots=True, repr=False)
class HeardSounds:
    """Sounds in the order of their onset. Ragged: sound i has rows ``track_offsets[i]:track_offsets[i + 1]`` and so on.

    Attributes:
        onset_s: start, the recording's time.
        offset_s: end.
        track_offsets: (n + 1,) into ``track``.
        track: where the robot was while it heard the sound, metres, world; at least one place for each sound.
        feature_offsets: (n + 1,) into ``feature``.
        feature: unit vectors, one a window.
        clips: their files, FLAC.
    """

    RAGGED: ClassVar = (("track_offsets", "track"), ("feature_offsets", "feature"))
    onset_s: Float64[np.ndarray, " n"]
    offset_s: Float64[np.ndarray, " n"]
    track_offsets: Int64[np.ndarray, " n1"]
    track: Float32[np.ndarray, "t 3"]
    feature_offsets: Int64[np.ndarray, " n1"]
    feature: Float32[np.ndarray, "w d"]
    clips: tuple[Path, ...]

    def __len__(self) -> int:
        return len(self.onset_s)

    def __repr__(self) -> str:
        return f"HeardSounds({len(self)})"


@dataclass(frozen=True, slots=True, repr=False)
class Submaps:
    """A map's voxels before they were added up, some frames at a time, so that they can follow corrected poses.

    Ragged: submap b has voxels ``row_offsets[b]:row_offsets[b + 1]`` and frames ``frame_offsets[b]:...``. Of what is
    a sum, `maps.fusion.voxel_sums.VoxelSums` says which.

    Attributes:
        row_offsets: (b + 1,) into the voxels.
        index: which voxel, in the world of the poses that the frames were fused with.
        feature: mean feature, in steps of ``feature_scale``: a quarter of the bytes of the sums it came from.
        feature_scale: of each voxel; 0 where no pixel with a feature fell.
        weight: sum of the weights behind it.
        rgb_sum: sum of weight times colour.
        rgb_weight: sum of these weights.
        hits: how many pixels fell into it.
        views: how many frames have one in it.
        sharp: how exact their depths are.
        last_seen_s: when a pixel last fell into it.
        spread: how its points lie in it: mean (3), factor of the covariance (6), voxels; mean number of the frame.
        frame_offsets: (b + 1,) into the frames.
        stamp_s: when each frame was taken.
        fused_pose: world_from_camera that it was fused with.
        pose: world_from_camera now.
        clear_mm: how far it saw freely, as ``FreeViews``; empty where depths are used as they are.
    """

    RAGGED: ClassVar = (("row_offsets", "index"), ("frame_offsets", "stamp_s"))
    row_offsets: Int64[np.ndarray, " b1"]
    index: Int32[np.ndarray, "n 3"]
    feature: Int8[np.ndarray, "n d"]
    feature_scale: Float32[np.ndarray, " n"]
    weight: Float32[np.ndarray, " n"]
    rgb_sum: Float32[np.ndarray, "n 3"]
    rgb_weight: Float32[np.ndarray, " n"]
    hits: Int32[np.ndarray, " n"]
    views: Int32[np.ndarray, " n"]
    sharp: Int32[np.ndarray, " n"]
    last_seen_s: Float64[np.ndarray, " n"]
    spread: Float16[np.ndarray, "n 10"]
    frame_offsets: Int64[np.ndarray, " b1"]
    stamp_s: Float64[np.ndarray, " f"]
    fused_pose: Float64[np.ndarray, "f 4 4"]
    pose: Float64[np.ndarray, "f 4 4"]
    clear_mm: UInt16[np.ndarray, "f_or_0 rows columns"]

    def __len__(self) -> int:
        return len(self.row_offsets) - 1

    def __repr__(self) -> str:
        return f"Submaps({len(self)} of {len(self.stamp_s)} frames with {len(self.index):,} voxels)"


@dataclass(frozen=True, slots=True, repr=False)
class SourceEvidence:
    """What the microphones say of where each sound began, over candidates: cells of surface, and air over the floor.

    Attributes:
        place: the candidates, metres, world.
        prior: probability of each before anything was recorded; they sum up to 1.
        heard: log-likelihood of each candidate by what was heard of each sound; the greatest of a sound is 0.
        expected: log-likelihood without it: near the robot, in its sight.
        moving: 1 where the source moved while it sounded.
        channels: how many microphones listened, one number.
        device: what was found out about each device that said directions, as ``Device.row``.
    """

    place: Float32[np.ndarray, "c 3"]
    prior: Float32[np.ndarray, " c"]
    heard: Float16[np.ndarray, "n c"]
    expected: Float16[np.ndarray, "n c"]
    moving: UInt8[np.ndarray, " n"]
    channels: Int64[np.ndarray, " 1"]
    device: Float64[np.ndarray, "d 4"] = field(default_factory=lambda: np.zeros((0, 4)))

    def __len__(self) -> int:
        return len(self.heard)

    def __repr__(self) -> str:
        return f"SourceEvidence({len(self)} sounds over {len(self.place):,} candidates)"


class FloorGuess(msgspec.Struct, frozen=True, kw_only=True):
    """One hypothesis of where a floor is.

    Attributes:
        height_m: of the floor along up, in the recording's world.
        camera_height_m: of the cameras over it, their median.
        confidence: how likely the floor lies within 0.12 m of that height under all the evidence, in [0, 1].
        in_view: whether level surface was seen there; False says that no floor is in view, so that it was put at the
            bottom of what is in view or where cameras usually have it.
        level_m2: area of level surface seen there.
        below: share of the surface in view that lies below it, in [0, 1]; near 0 for a floor.
    """

    height_m: float
    camera_height_m: float
    confidence: float
    in_view: bool
    level_m2: float
    below: float


class FloorInfo(msgspec.Struct, frozen=True, kw_only=True):
    """A floor that cameras stood over.

    Attributes:
        best: the hypothesis that was taken.
        runner_up: the best one at another height, None where there is none.
        cameras: share of the cameras that stood over this floor, in [0, 1].
    """

    best: FloorGuess
    runner_up: FloorGuess | None
    cameras: float
