"""The content of a map, in memory or memory-mapped: voxels, keyframes, sounds; all in the recording's world."""

from collections.abc import Sized
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar

import msgspec
import numpy as np

from avlmaps.core.arrays import Float16, Float32, Float64, Int8, Int32, Int64, UInt8, UInt16


class _Rows(Sized):
    __slots__ = ()

    def __repr__(self) -> str:  # of arrays, how many rows they have
        return f"{type(self).__name__}({len(self):,})"


@dataclass(frozen=True, slots=True, repr=False)
class Voxels(_Rows):
    """Occupied voxels, sorted by index (x, then y, then z)."""

    index: Int32[np.ndarray, "n 3"]
    feature: Float16[np.ndarray, "n d"]  # mean feature, unit length; zero where no pixel with a feature fell
    weight: Float32[np.ndarray, " n"]  # sum of the fusion weights of the pixels with a feature
    rgb: UInt8[np.ndarray, "n 3"]  # mean colour
    last_seen_s: Float64[np.ndarray, " n"]  # when a pixel last fell into it
    hits: Int64[np.ndarray, " n"]  # how many pixels fell into it

    def __len__(self) -> int:
        return len(self.index)


@dataclass(frozen=True, slots=True, repr=False)
class Keyframes(_Rows):
    """Chosen frames, in the order of time. Ragged arrays: keyframe k has rows ``offsets[k]:offsets[k + 1]``."""

    RAGGED: ClassVar = (("offsets", "xy"), ("thumbnail_offsets", "thumbnails"))
    stamp_s: Float64[np.ndarray, " k"]
    world_from_camera: Float64[np.ndarray, "k 4 4"]  # of the depth camera
    centre: Float32[np.ndarray, "k 3"]  # middle of what the camera saw, metres, world
    view: Float32[np.ndarray, "k dv"]  # area feature; 0 columns where the profile has no view encoder
    place: Float32[np.ndarray, "k dp"]  # place descriptor
    offsets: Int64[np.ndarray, " k1"]  # into the rows of the local features
    xy: Float32[np.ndarray, "m 2"]  # keypoints, pixels of the colour picture
    descriptors: Float16[np.ndarray, "m dl"]  # unit length
    points_world: Float32[np.ndarray, "m 3"]  # the keypoints' 3D points, NaN where there was no depth
    thumbnail_offsets: Int64[np.ndarray, " k1"]  # into ``thumbnails``
    thumbnails: UInt8[np.ndarray, " bytes"]  # JPEG files one after the other
    # the detector's confidence in each keypoint, in [0, 1]; empty where it gives none, and in maps of before
    score: Float16[np.ndarray, " m_or_0"] = field(default_factory=lambda: np.zeros(0, np.float16))
    # up to which depth each saw freely, as ``FreeViews``: what of this day a later one looked at. Empty where depths
    # are used as they are, and in maps of before
    clear_mm: UInt16[np.ndarray, "k_or_0 rows columns"] = field(default_factory=lambda: np.zeros((0, 0, 0), np.uint16))

    def __len__(self) -> int:
        return len(self.stamp_s)

    def jpeg(self, row: int) -> UInt8[np.ndarray, " n"]:
        """Return the file of a keyframe's picture; empty where it has none."""
        first, last = (int(edge) for edge in self.thumbnail_offsets[row : row + 2])
        return np.asarray(self.thumbnails[first:last])


@dataclass(frozen=True, slots=True, repr=False)
class HeardSounds(_Rows):
    """Sounds in the order of onset. Ragged: sound i has rows ``track_offsets[i]:track_offsets[i + 1]`` and so on."""

    RAGGED: ClassVar = (("track_offsets", "track"), ("feature_offsets", "feature"))
    onset_s: Float64[np.ndarray, " n"]  # start, the recording's time
    offset_s: Float64[np.ndarray, " n"]  # end
    track_offsets: Int64[np.ndarray, " n1"]  # into ``track``
    track: Float32[np.ndarray, "t 3"]  # where the robot heard it, metres, world; a place or more for each sound
    feature_offsets: Int64[np.ndarray, " n1"]  # into ``feature``
    feature: Float32[np.ndarray, "w d"]  # unit vectors, one a window
    clips: tuple[Path, ...]  # FLAC files

    def __len__(self) -> int:
        return len(self.onset_s)


@dataclass(frozen=True, slots=True, repr=False)
class Submaps(_Rows):
    """A map's voxels before they were added up, some frames at a time, so that they can follow corrected poses.

    Ragged: submap b has voxels ``row_offsets[b]:row_offsets[b + 1]`` and frames ``frame_offsets[b]:...``. Fields
    without a note are those of `maps.fusion.voxel_sums.VoxelSums`.
    """

    RAGGED: ClassVar = (("row_offsets", "index"), ("frame_offsets", "stamp_s"))
    row_offsets: Int64[np.ndarray, " b1"]  # into the voxels
    index: Int32[np.ndarray, "n 3"]  # in the world of the poses that the frames were fused with
    feature: Int8[np.ndarray, "n d"]  # mean feature, in steps of ``feature_scale``: a quarter of the bytes of the sums
    feature_scale: Float32[np.ndarray, " n"]  # of each voxel; 0 where no pixel with a feature fell
    weight: Float32[np.ndarray, " n"]
    rgb_sum: Float32[np.ndarray, "n 3"]
    rgb_weight: Float32[np.ndarray, " n"]
    hits: Int32[np.ndarray, " n"]
    views: Int32[np.ndarray, " n"]
    sharp: Int32[np.ndarray, " n"]
    last_seen_s: Float64[np.ndarray, " n"]
    # mean (3) and factor of the covariance (6) of its points, voxels; mean number of the frame
    spread: Float16[np.ndarray, "n 10"]
    frame_offsets: Int64[np.ndarray, " b1"]  # into the frames
    stamp_s: Float64[np.ndarray, " f"]  # when each frame was taken
    fused_pose: Float64[np.ndarray, "f 4 4"]  # world_from_camera that it was fused with
    pose: Float64[np.ndarray, "f 4 4"]  # world_from_camera now
    clear_mm: UInt16[np.ndarray, "f_or_0 rows columns"]  # see ``FreeViews``; empty where depths are used as they are

    def __len__(self) -> int:
        return len(self.row_offsets) - 1


@dataclass(frozen=True, slots=True, repr=False)
class SourceEvidence(_Rows):
    """What the microphones say of where each sound began, over candidates: cells of surface, and air over the floor."""

    place: Float32[np.ndarray, "c 3"]  # the candidates, metres, world
    prior: Float32[np.ndarray, " c"]  # probability of each before anything was recorded; they sum up to 1
    heard: Float16[np.ndarray, "n c"]  # log-likelihood by what was heard of each sound; the greatest of a sound is 0
    expected: Float16[np.ndarray, "n c"]  # log-likelihood without it: near the robot, in its sight
    moving: UInt8[np.ndarray, " n"]  # 1 where the source moved while it sounded
    channels: Int64[np.ndarray, " 1"]  # how many microphones listened, one number
    # of each device that said directions, ``Device.row``
    device: Float64[np.ndarray, "d 4"] = field(default_factory=lambda: np.zeros((0, 4)))

    def __len__(self) -> int:
        return len(self.heard)


class FloorGuess(msgspec.Struct, frozen=True, kw_only=True):
    """One hypothesis of where a floor is."""

    height_m: float  # of the floor along up, in the recording's world
    camera_height_m: float  # of the cameras over it, their median
    confidence: float  # that the floor lies within 0.12 m of that height, in [0, 1]
    in_view: bool  # level surface was seen there; else it is put below all that is, or where cameras usually have it
    level_m2: float  # of level surface seen there
    below: float  # share of the surface in view that lies below it; near 0 for a floor


class FloorInfo(msgspec.Struct, frozen=True, kw_only=True):
    """A floor that cameras stood over."""

    best: FloorGuess  # the hypothesis that was taken
    runner_up: FloorGuess | None  # the best one at another height
    cameras: float  # share of the cameras that stood over this floor
