"""Which frames are keyframes, what is stored of each, and what its places are known by."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Generic, TypeVar

import cv2
import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from avlmaps.core.arrays import Float, Float32, Int, UInt8
from avlmaps.core.columns import concat
from avlmaps.core.poses import apply, inverse, rotation_angle_rad
from avlmaps.core.progress import progress
from avlmaps.core.registry import Kind
from avlmaps.maps.fusion.free_space import free_views
from avlmaps.maps.fusion.sensor import NONE, SensorModel
from avlmaps.maps.perceived import as_row, perceiving
from avlmaps.maps.pose_correction import PoseCorrection
from avlmaps.maps.settings import DEFAULT_KEYFRAMES, KeyframeSettings
from avlmaps.maps.types import Keyframes
from avlmaps.perception.encoders import Encoders
from avlmaps.perception.protocols import LocalFeatures
from avlmaps.recordings.images import depth_in_colour
from avlmaps.recordings.types import Frame, Recording

T = TypeVar("T")
_FAR_M = 2.0  # how far things are that a moving camera passes, for how fast the picture moves


@dataclass(frozen=True, slots=True)
class _Seen(Generic[T]):
    item: T
    stamp_s: float
    pose: Float[np.ndarray, "4 4"]


class KeyframeChooser(Generic[T]):
    """Takes frames in the order of time, and holds one at most.

    Where the camera goes beyond the limits since the last keyframe, the frame beyond half of them that moved least
    becomes the next one, because a camera that moves less blurs less. So each frame lies within the limits of one of
    the two keyframes before it.
    """

    def __init__(self, settings: KeyframeSettings) -> None:
        self._limits = settings.translation_m, np.deg2rad(settings.rotation_deg), settings.max_gap_s
        self._last: _Seen[T] | None = None  # the last keyframe
        self._before: _Seen[T] | None = None  # the last frame
        self._best: tuple[float, _Seen[T]] | None = None  # its speed, and the frame that may become a keyframe

    def add(self, item: T, stamp_s: float, pose: Float[np.ndarray, "4 4"]) -> Iterator[T]:
        """Take a frame, and yield those that are now known to be keyframes."""
        seen, before = _Seen(item, stamp_s, pose), self._before
        self._before = seen
        if self._last is None or before is None:
            self._last = seen
            yield item
            return
        moved_m, turned_rad, gap_s = _motion(before, seen)
        speed = (turned_rad + moved_m / _FAR_M) / max(gap_s, 1e-9)
        while (share := self._share(self._last, seen)) > 0.5:
            if self._best is None or speed < self._best[0]:
                self._best = speed, seen
            if share <= 1.0:
                return
            self._last, self._best = self._best[1], None
            yield self._last.item

    def end(self) -> Iterator[T]:
        """Yield the last frame, unless it is a keyframe already."""
        if self._before is not None and self._before is not self._last:
            self._last, self._best = self._before, None
            yield self._before.item

    def _share(self, since: _Seen[T], seen: _Seen[T]) -> float:
        return max(value / limit for value, limit in zip(_motion(since, seen), self._limits, strict=True))


def _motion(one: _Seen[Any], other: _Seen[Any]) -> tuple[float, float, float]:
    moved_m = float(np.linalg.norm(other.pose[:3, 3] - one.pose[:3, 3]))
    return moved_m, float(rotation_angle_rad(other.pose[None], one.pose[None])[0]), other.stamp_s - one.stamp_s


def keyframes_by_motion(
    stamps_s: Float[np.ndarray, " n"],
    world_from_camera: Float[np.ndarray, "n 4 4"],
    settings: KeyframeSettings = DEFAULT_KEYFRAMES,
) -> Int[np.ndarray, " k"]:
    """Return the rising numbers of keyframes; see ``KeyframeChooser``."""
    chooser = KeyframeChooser[int](settings)
    chosen: list[int] = []
    for index, (stamp_s, pose) in enumerate(zip(stamps_s.tolist(), world_from_camera, strict=True)):
        chosen += chooser.add(index, stamp_s, pose)
    return np.array([*chosen, *chooser.end()], np.int64)


def select_keyframes(
    recording: Recording, settings: KeyframeSettings = DEFAULT_KEYFRAMES, step: int = 1
) -> Int[np.ndarray, " k"]:
    """Choose the keyframes of every ``step``-th frame of a recording; it reads no picture."""
    return keyframes_by_motion(recording.stamps_s[::step], recording.world_from_camera[::step], settings) * step


def describe_keyframe(
    frame: Frame, encoders: Encoders, settings: KeyframeSettings = DEFAULT_KEYFRAMES, sensor: SensorModel = NONE
) -> Keyframes:
    """Run encoders on one frame, and return it as the one keyframe of a map; its place is described later."""
    with perceiving("An encoder of keyframes", frame.name):
        local = encoders.local.encode(frame.rgb.copy()) if Kind.LOCAL in encoders else _NOTHING
        view = np.zeros(0, np.float32)
        if Kind.VIEWS in encoders:
            (found,) = encoders.views.encode([frame.copy()])
            card = encoders.card(Kind.VIEWS)
            view = as_row(found, card.dim, f"The view encoder {card.id}", frame)
    rgb, width_px = frame.rgb, settings.thumbnail_width_px
    if rgb.shape[1] > width_px:
        size = (width_px, max(1, round(rgb.shape[0] * width_px / rgb.shape[1])))
        rgb = cv2.resize(rgb, size, interpolation=cv2.INTER_AREA)
    _, encoded = cv2.imencode(".jpg", cv2.cvtColor(rgb, cv2.COLOR_RGB2BGR), [cv2.IMWRITE_JPEG_QUALITY, 80])
    thumbnail = encoded.reshape(-1)
    return replace(
        NO_KEYFRAMES,
        stamp_s=np.array([frame.stamp_s]),
        world_from_camera=np.array(frame.world_from_camera, np.float64)[None],
        centre=middle_of_view(frame)[None],
        view=view[None],
        place=np.zeros((1, 0), np.float32),
        offsets=np.array([0, len(local.xy)]),
        xy=local.xy.astype(np.float32),
        descriptors=local.descriptors.astype(np.float16),
        points_world=lift_keypoints(local.xy, frame, settings.max_depth_m),
        thumbnail_offsets=np.array([0, len(thumbnail)]),
        thumbnails=thumbnail,
        score=local.score.astype(np.float16),
        clear_mm=free_views([frame], sensor).clear_mm,
    )


NO_KEYFRAMES = Keyframes(
    stamp_s=np.zeros(0),
    world_from_camera=np.zeros((0, 4, 4)),
    centre=np.zeros((0, 3), np.float32),
    view=np.zeros((0, 0), np.float32),
    place=np.zeros((0, 0), np.float32),
    offsets=np.zeros(1, np.int64),
    xy=np.zeros((0, 2), np.float32),
    descriptors=np.zeros((0, 0), np.float16),
    points_world=np.zeros((0, 3), np.float32),
    thumbnail_offsets=np.zeros(1, np.int64),
    thumbnails=np.zeros(0, np.uint8),
)
"""Those of a map without pictures."""
_NOTHING = LocalFeatures(NO_KEYFRAMES.xy, np.zeros((0, 0), np.float32))


def local_features(keyframes: Keyframes, row: int, size: tuple[int, int]) -> LocalFeatures:
    """Return the keypoints of a keyframe as they are stored; ``size`` is the width and height of the picture."""
    rows = slice(int(keyframes.offsets[row]), int(keyframes.offsets[row + 1]))
    descriptors, score = (np.asarray(column[rows], np.float32) for column in (keyframes.descriptors, keyframes.score))
    return LocalFeatures(np.asarray(keyframes.xy[rows]), descriptors, size=size, score=score)


def moved_keyframes(keyframes: Keyframes, motion: Float[np.ndarray, "k 4 4"]) -> Keyframes:
    """Return keyframes after a motion of each, with what it saw."""
    of_point = np.repeat(np.arange(len(keyframes)), np.diff(keyframes.offsets))
    return replace(
        keyframes,
        world_from_camera=motion @ np.asarray(keyframes.world_from_camera),
        centre=_applied(motion, keyframes.centre),
        points_world=_applied(motion[of_point], keyframes.points_world),
    )


def _applied(motion: Float[np.ndarray, "n 4 4"], points: Float32[np.ndarray, "n 3"]) -> Float32[np.ndarray, "n 3"]:
    turned = np.einsum("nij,nj->ni", motion[:, :3, :3], np.asarray(points, np.float64))
    return (turned + motion[:, :3, 3]).astype(np.float32)


PATCH_PX = 5
MAX_SPREAD = 0.03
"""Depths in a keypoint's patch may differ by this part of the depth; at an edge it is unknown which side it is on."""


def lift_keypoints(xy: Float32[np.ndarray, "n 2"], frame: Frame, max_depth_m: float) -> Float32[np.ndarray, "n 3"]:
    """Return the world points that keypoints of the colour picture show, metres; NaN without a trustworthy depth.

    A keypoint's depth is the median of the patch around it; it has none where half of the patch has none, where the
    patch's depths differ too much, or beyond the limit.
    """
    camera, depth_m = depth_in_colour(frame.depth_m, frame.rig)
    scale = np.array([camera.width / frame.rig.rgb.width, camera.height / frame.rig.rgb.height])
    z_m = _patch_depth(xy * scale, depth_m)
    z_m = np.where(z_m <= max_depth_m, z_m, np.nan)
    colour = frame.rig.rgb
    rays = np.column_stack([(xy - (colour.cx, colour.cy)) / (colour.fx, colour.fy), np.ones(len(xy))])
    world_from_colour = frame.world_from_camera @ inverse(frame.rig.rgb_from_depth)
    return apply(world_from_colour, rays * z_m[:, None]).astype(np.float32)


def middle_of_view(frame: Frame, stride_px: int = 8) -> Float32[np.ndarray, "3"]:
    """Return the median, per axis, of the world points that the depth camera saw; its own place where it saw none."""
    points = frame.rig.depth.backproject(frame.depth_m)[stride_px // 2 :: stride_px, stride_px // 2 :: stride_px]
    seen = points[points[..., 2] > 0.0]
    if not len(seen):
        return frame.world_from_camera[:3, 3].astype(np.float32)
    return np.median(apply(frame.world_from_camera, seen), axis=0).astype(np.float32)


def _patch_depth(xy: Float[np.ndarray, "n 2"], depth_m: Float32[np.ndarray, "h w"]) -> Float[np.ndarray, " n"]:
    if not len(xy):
        return np.zeros(0)
    half = PATCH_PX // 2
    patches = sliding_window_view(np.pad(depth_m, half), (PATCH_PX, PATCH_PX))
    column = np.clip(np.floor(xy[:, 0]).astype(np.int64), 0, depth_m.shape[1] - 1)
    row = np.clip(np.floor(xy[:, 1]).astype(np.int64), 0, depth_m.shape[0] - 1)
    patch = np.sort(patches[row, column].reshape(len(xy), -1).astype(np.float64), axis=1)
    valid = (patch > 0.0).sum(axis=1)
    size, rows = patch.shape[1], np.arange(len(xy))
    # Sorted: the empty pixels come first, so quantiles of the valid ones are counted from there.
    low, middle, high = (
        patch[rows, np.minimum(size - valid + (valid * q).astype(int), size - 1)] for q in (0.1, 0.5, 0.9)
    )
    trusted = (valid * 2 > size) & (high - low <= MAX_SPREAD * middle)
    return np.where(trusted, middle, np.nan)


_LEARN_FROM = 64  # keyframes, spread evenly, that places are learnt from
_GROWN = 1.25  # times as many, before they are learnt again for a question


class KeyframeAlbum:
    """Takes frames that are keyframes, in the order of time, and looks at each once."""

    def __init__(self, encoders: Encoders, settings: KeyframeSettings) -> None:
        self._encoders, self._settings = encoders, settings
        self._parts: list[Keyframes] = []  # without places that are learnt
        self._size = 0, 0  # of their pictures
        self._places: list[Float32[np.ndarray, " d"]] = []
        self._has_places = Kind.PLACE in encoders and Kind.LOCAL in encoders
        self._learns: bool | None = None  # whether the place encoder learns from the map's keyframes
        self._state: dict[str, np.ndarray] = {}
        self._learnt_from = 0
        self._stacked: Keyframes | None = None

    def add(self, frame: Frame, sensor: SensorModel = NONE) -> None:
        """Describe a frame of a depth camera."""
        seen, self._size = describe_keyframe(frame, self._encoders, self._settings, sensor), frame.rgb.shape[1::-1]
        if self._has_places:
            with perceiving("The place encoder", frame.name):
                encoder, local = self._encoders.place, local_features(seen, 0, self._size)
                if self._learns is None:
                    self._learns = bool(encoder.fit([local], np.random.default_rng(0)))
                if not self._learns:
                    place = np.asarray(encoder.encode(frame.rgb.copy(), local, {}), np.float32)
                    seen = replace(seen, place=place[None])
        self._parts.append(seen)
        self._stacked = None

    def add_stacked(self, keyframes: Keyframes, size: tuple[int, int]) -> None:
        """Add keyframes that were described before; ``size`` is the width and height of their pictures."""
        self._parts += [keyframes] if len(keyframes) else []
        self._size, self._stacked = size, None

    def move(self, step: PoseCorrection) -> None:
        """Move the keyframes by a correction of their poses."""
        before = self.plain()
        self._parts = [moved_keyframes(before, step.at(before.stamp_s))] if len(before) else []
        self._stacked = None

    def plain(self) -> Keyframes:
        """Return the keyframes without places that are learnt."""
        if len(self._parts) > 1:
            self._parts = [concat(self._parts)]
        return self._parts[0] if self._parts else NO_KEYFRAMES

    def keyframes(self, rng: np.random.Generator, *, final: bool = True) -> tuple[Keyframes, dict[str, np.ndarray]]:
        """Return the keyframes, and what places are known by: the same objects as before where nothing came.

        ``rng`` is for what the place encoder learns. Places are learned again if ``final``, else only where enough has
        come since.
        """
        plain = self.plain()
        if self._stacked is None or (final and self._learnt_from != len(plain)):
            if self._has_places and not plain.place.shape[1]:
                self._learn(plain, rng, final)
                plain = replace(plain, place=np.stack(self._places)) if self._places else plain
            self._stacked = plain
        return self._stacked, self._state

    def _learn(self, plain: Keyframes, rng: np.random.Generator, final: bool) -> None:
        encoder, count, size = self._encoders.place, len(plain), self._size
        with perceiving(f"The place encoder {encoder.card.id}", "the keyframes"):
            few = not self._learnt_from or count >= _GROWN * self._learnt_from
            if few or (final and count != self._learnt_from):
                spread = np.unique(np.linspace(0, count - 1, min(count, _LEARN_FROM)).round().astype(int))
                some = [local_features(plain, at, size) for at in spread.tolist()]
                self._state, self._learnt_from, self._places = encoder.fit(some, rng), count, []
            for row in range(len(self._places), count):
                found = encoder.encode(_picture(plain.jpeg(row), size), local_features(plain, row, size), self._state)
                self._places.append(np.asarray(found, np.float32))


def perceive_keyframes(
    recording: Recording,
    indices: Sequence[int] | Int[np.ndarray, " k"],
    encoders: Encoders,
    rng: np.random.Generator,
    settings: KeyframeSettings = DEFAULT_KEYFRAMES,
) -> tuple[Keyframes, dict[str, np.ndarray]]:
    """Describe chosen frames of a recording; return them, and what the place encoder learned."""
    album = KeyframeAlbum(encoders, settings)
    for index in progress(indices, "seeing", total=len(indices), unit="keyframe"):
        album.add(recording.frame(int(index)))
    return album.keyframes(rng)


def _picture(jpeg: UInt8[np.ndarray, " bytes"], size: tuple[int, int]) -> UInt8[np.ndarray, "h w 3"]:
    small = cv2.imdecode(jpeg, cv2.IMREAD_COLOR_RGB)
    assert small is not None
    return small if size == small.shape[1::-1] else cv2.resize(small, size)
