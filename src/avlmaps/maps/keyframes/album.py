"""The keyframes of a map that is made: what is stored of each, and what its places are known by."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from avlmaps.core.arrays import Float, Float16, Float32, Int, UInt8
from avlmaps.core.columns import offsets_of
from avlmaps.core.numbers import unmasked
from avlmaps.core.poses import apply, inverse
from avlmaps.core.progress import progress
from avlmaps.core.registry import Kind
from avlmaps.maps.keyframes.choose import DEFAULT_KEYFRAMES, KeyframeSettings
from avlmaps.maps.perceived import as_row, perceiving
from avlmaps.maps.pose_correction import PoseCorrection
from avlmaps.maps.types import Keyframes
from avlmaps.perception.encoders import Encoders
from avlmaps.perception.protocols import LocalFeatures
from avlmaps.recordings.images import depth_in_colour
from avlmaps.recordings.types import Frame, Recording


@dataclass(frozen=True, slots=True)
class DescribedKeyframe:
    """All that the map stores of one keyframe.

    Attributes:
        stamp_s: when.
        world_from_camera: pose of the depth camera.
        centre: middle of what was seen, metres, world.
        view: area feature; empty without a view encoder.
        place: place descriptor; empty without a place encoder.
        local: keypoints of the colour picture.
        points_world: their 3D points, metres, NaN where there is no trustworthy depth.
        thumbnail: a JPEG file.
    """

    stamp_s: float
    world_from_camera: Float[np.ndarray, "4 4"]
    centre: Float32[np.ndarray, "3"]
    view: Float32[np.ndarray, " dv"]
    place: Float32[np.ndarray, " dp"]
    local: LocalFeatures
    points_world: Float32[np.ndarray, "n 3"]
    thumbnail: bytes


def describe_keyframe(
    frame: Frame, encoders: Encoders, settings: KeyframeSettings = DEFAULT_KEYFRAMES
) -> DescribedKeyframe:
    """Run encoders on one frame; its place is described later."""
    with perceiving("An encoder of keyframes", frame.name):
        local = encoders.local.encode(frame.rgb.copy()) if Kind.LOCAL in encoders else _no_features()
        local = replace(local, descriptors=local.descriptors.astype(np.float16).astype(np.float32))  # as it is stored
        view = np.zeros(0, np.float32)
        if Kind.VIEWS in encoders:
            (found,) = unmasked(encoders.views.encode([frame.copy()]))
            card = encoders.card(Kind.VIEWS)
            view = as_row(found, card.dim, f"The view encoder {card.id}", frame)
    return DescribedKeyframe(
        stamp_s=frame.stamp_s,
        world_from_camera=frame.world_from_camera,
        centre=middle_of_view(frame),
        view=view,
        place=np.zeros(0, np.float32),
        local=local,
        points_world=lift_keypoints(local.xy, frame, settings.max_depth_m),
        thumbnail=_thumbnail(frame.rgb, settings.thumbnail_width_px),
    )


def stack_keyframes(seen: Sequence[DescribedKeyframe]) -> Keyframes:
    """Put keyframes, in the order of time, into the map's arrays."""
    return Keyframes(
        stamp_s=np.array([one.stamp_s for one in seen], np.float64),
        world_from_camera=_stacked([one.world_from_camera for one in seen], (4, 4), np.float64),
        centre=_stacked([one.centre for one in seen], (3,), np.float32),
        view=_stacked([one.view for one in seen], (0,), np.float32),
        place=_stacked([one.place for one in seen], (0,), np.float32),
        offsets=offsets_of([len(one.local.xy) for one in seen]),
        xy=_joined([one.local.xy for one in seen], (2,), np.float32),
        descriptors=_joined([one.local.descriptors for one in seen], (0,), np.float16),
        points_world=_joined([one.points_world for one in seen], (3,), np.float32),
        thumbnail_offsets=offsets_of([len(one.thumbnail) for one in seen]),
        thumbnails=np.frombuffer(b"".join(one.thumbnail for one in seen), np.uint8),
        score=_scores([one.local for one in seen]),
    )


def unstack_keyframes(stacked: Keyframes, size: tuple[int, int]) -> list[DescribedKeyframe]:
    """Return the keyframes of a map's arrays, whose colour pictures have this width and height."""
    found: list[DescribedKeyframe] = []
    for row in range(len(stacked)):
        own = slice(*(int(edge) for edge in stacked.offsets[row : row + 2]))
        score = stacked.score[own].astype(np.float32) if len(stacked.score) else np.zeros(0, np.float32)
        local = LocalFeatures(stacked.xy[own], stacked.descriptors[own].astype(np.float32), size=size, score=score)
        found.append(
            DescribedKeyframe(
                float(stacked.stamp_s[row]), stacked.world_from_camera[row], stacked.centre[row], stacked.view[row],
                stacked.place[row], local, stacked.points_world[own], stacked.jpeg(row).tobytes(),
            )
        )  # fmt: skip
    return found


def _scores(local: Sequence[LocalFeatures]) -> Float16[np.ndarray, " m_or_0"]:
    if any(len(one.score) != len(one.xy) for one in local):
        return np.zeros(0, np.float16)
    return _joined([one.score for one in local], (), np.float16)


def _stacked(rows: Sequence[np.ndarray], shape: tuple[int, ...], dtype: type[np.generic]) -> np.ndarray:
    return np.stack(rows).astype(dtype) if len(rows) else np.zeros((0, *shape), dtype)


def _joined(pieces: Sequence[np.ndarray], shape: tuple[int, ...], dtype: type[np.generic]) -> np.ndarray:
    return np.concatenate(pieces).astype(dtype) if len(pieces) else np.zeros((0, *shape), dtype)


def _no_features() -> LocalFeatures:
    return LocalFeatures(np.zeros((0, 2), np.float32), np.zeros((0, 0), np.float32))


def _thumbnail(rgb: UInt8[np.ndarray, "h w 3"], width_px: int) -> bytes:
    if rgb.shape[1] > width_px:
        size = (width_px, max(1, round(rgb.shape[0] * width_px / rgb.shape[1])))
        rgb = cv2.resize(rgb, size, interpolation=cv2.INTER_AREA)
    _, encoded = cv2.imencode(".jpg", cv2.cvtColor(rgb, cv2.COLOR_RGB2BGR), [cv2.IMWRITE_JPEG_QUALITY, 80])
    return encoded.tobytes()


PATCH_PX = 5
MAX_SPREAD = 0.03
"""Depths in a keypoint's patch may differ by this part of the depth; at an edge it is unknown which side it is on."""


def lift_keypoints(xy: Float32[np.ndarray, "n 2"], frame: Frame, max_depth_m: float) -> Float32[np.ndarray, "n 3"]:
    """Return the world points that keypoints of the colour picture show.

    A keypoint's depth is the median of the patch around it; it has none where half of the patch has none, where the
    patch's depths differ too much, or beyond the limit.

    Args:
        xy: pixels of the colour picture.
        frame: its depth, cameras and pose.
        max_depth_m: the limit.

    Returns:
        Metres, world; NaN where there is no trustworthy depth.
    """
    camera, depth_m = depth_in_colour(frame.depth_m, frame.rig)
    scale = np.array([camera.width / frame.rig.rgb.width, camera.height / frame.rig.rgb.height])
    z_m = _patch_depth(xy * scale, depth_m)
    z_m = np.where(z_m <= max_depth_m, z_m, np.nan)
    colour = frame.rig.rgb
    points = np.empty((len(xy), 3))
    points[:, 0] = (xy[:, 0] - colour.cx) / colour.fx * z_m
    points[:, 1] = (xy[:, 1] - colour.cy) / colour.fy * z_m
    points[:, 2] = z_m
    world_from_colour = frame.world_from_camera @ inverse(frame.rig.rgb_from_depth)
    return apply(world_from_colour, points).astype(np.float32)


def middle_of_view(frame: Frame, stride_px: int = 8) -> Float32[np.ndarray, "3"]:
    """Return the median, per axis, of the world points that the depth camera saw; its own place where it saw none."""
    depth_m = frame.depth_m[stride_px // 2 :: stride_px, stride_px // 2 :: stride_px]
    row, column = np.nonzero(depth_m > 0.0)
    if not len(row):
        return frame.world_from_camera[:3, 3].astype(np.float32)
    z = depth_m[row, column].astype(np.float64)
    camera, first = frame.rig.depth, stride_px // 2 + 0.5
    x = (column * stride_px + first - camera.cx) / camera.fx * z
    y = (row * stride_px + first - camera.cy) / camera.fy * z
    world = apply(frame.world_from_camera, np.stack([x, y, z], axis=1))
    return np.median(world, axis=0).astype(np.float32)


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


LEARN_FROM_KEYFRAMES = 64
# What places are learnt from grows by this much before they are learnt again for a question.
_GROWN = 1.25


class KeyframeAlbum:
    """Takes frames that are keyframes, in the order of time, and looks at each once."""

    def __init__(self, encoders: Encoders, settings: KeyframeSettings) -> None:
        self._encoders, self._settings = encoders, settings
        self._seen: list[DescribedKeyframe] = []  # their places are in _places
        self._places: list[Float32[np.ndarray, " d"]] = []
        self._learns: bool | None = None  # whether the place encoder learns from the map's keyframes
        self._state: dict[str, np.ndarray] = {}
        self._learnt_from = 0
        self._stacked: Keyframes | None = None

    def __len__(self) -> int:
        return len(self._seen)

    def add(self, frame: Frame) -> None:
        """Describe a frame."""
        seen = describe_keyframe(frame, self._encoders, self._settings)
        if Kind.PLACE in self._encoders and Kind.LOCAL in self._encoders:
            with perceiving("The place encoder", frame.name):
                encoder = self._encoders.place
                if self._learns is None:
                    self._learns = bool(encoder.fit([seen.local], np.random.default_rng(0)))
                if not self._learns:
                    seen = replace(seen, place=np.asarray(unmasked(encoder.encode(frame.rgb.copy(), seen.local, {}))))
        self._seen.append(seen)
        self._stacked = None

    def add_stacked(self, keyframes: Keyframes, size: tuple[int, int]) -> None:
        """Add keyframes that were described before; ``size`` is the width and height of their pictures."""
        self._seen += unstack_keyframes(keyframes, size)
        self._stacked = None

    def move(self, step: PoseCorrection) -> None:
        """Move the keyframes by a correction of their poses."""
        self._seen = [_moved(one, step) for one in self._seen]
        self._stacked = None

    def plain(self) -> Keyframes:
        """Return the keyframes without places that are learnt."""
        return stack_keyframes(self._seen)

    def keyframes(self, rng: np.random.Generator, *, final: bool = True) -> tuple[Keyframes, dict[str, np.ndarray]]:
        """Return the keyframes, and what places are known by: the same objects as before where nothing came.

        Args:
            rng: for what the place encoder learns.
            final: learn places again; else only where enough has come since.
        """
        known = final and self._learnt_from != len(self._seen)
        if self._stacked is not None and not known:
            return self._stacked, self._state
        seen = self._seen
        if Kind.PLACE in self._encoders and Kind.LOCAL in self._encoders and not (seen and len(seen[0].place)):
            seen = [replace(one, place=place) for one, place in zip(seen, self._placed(rng, final), strict=True)]
        self._stacked = stack_keyframes(seen)
        return self._stacked, self._state

    def _placed(self, rng: np.random.Generator, final: bool) -> list[Float32[np.ndarray, " d"]]:
        encoder, count = self._encoders.place, len(self._seen)
        with perceiving(f"The place encoder {encoder.card.id}", "the keyframes"):
            few = not self._learnt_from or count >= _GROWN * self._learnt_from
            if few or (final and count != self._learnt_from):
                self._state = encoder.fit([self._seen[int(at)].local for at in learn_from(count)], rng)
                self._learnt_from, self._places = count, []
            for one in self._seen[len(self._places) :]:
                found = encoder.encode(_picture(one), one.local, self._state)
                self._places.append(np.asarray(unmasked(found), np.float32))
        return self._places


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


def learn_from(keyframes: int) -> Int[np.ndarray, " k"]:
    """Return the numbers of the keyframes that places are learnt from: up to 64, spread evenly."""
    return np.unique(np.linspace(0, keyframes - 1, min(keyframes, LEARN_FROM_KEYFRAMES)).round().astype(int))


def _picture(one: DescribedKeyframe) -> UInt8[np.ndarray, "h w 3"]:
    small = cv2.imdecode(np.frombuffer(one.thumbnail, np.uint8), cv2.IMREAD_COLOR_RGB)
    assert small is not None
    return small if one.local.size in ((0, 0), small.shape[1::-1]) else cv2.resize(small, one.local.size)


def _moved(one: DescribedKeyframe, step: PoseCorrection) -> DescribedKeyframe:
    motion = step.at(np.array([one.stamp_s]))[0]
    return replace(
        one,
        world_from_camera=motion @ one.world_from_camera,
        centre=apply(motion, one.centre.astype(np.float64)).astype(np.float32),
        points_world=apply(motion, one.points_world.astype(np.float64)).astype(np.float32),
    )
