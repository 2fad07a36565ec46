"""Keyframes: which frames stand for the walk, and what the map stores of them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from avlmaps.core.arrays import Float, Float16, Float32, Int, UInt8
from avlmaps.core.columns import offsets_of
from avlmaps.core.numbers import hold_numbers, unmasked
from avlmaps.core.poses import apply, inverse, rotation_angle_rad
from avlmaps.core.progress import progress
from avlmaps.core.registry import Kind
from avlmaps.maps.types import Keyframes
from avlmaps.perception.encoders import Encoders
from avlmaps.perception.protocols import LocalFeatures
from avlmaps.recordings.images import depth_in_colour
from avlmaps.recordings.types import Frame, Recording

LEARN_FROM_KEYFRAMES = 64
_BLOCK = 256


@dataclass(frozen=True, slots=True)
class KeyframeSettings:
    """When a frame becomes a keyframe."""

    translation_m: float = 0.1
    """Distance that the camera moved since the last keyframe, metres."""

    rotation_deg: float = 7.0
    """Or angle that it turned, degrees."""

    max_gap_s: float = 5.0
    """Or time that went by, seconds; a robot that stands still adds a keyframe now and then."""

    thumbnail_width_px: int = 320
    """Width of the thumbnails that the map stores."""

    max_depth_m: float = 6.0
    """Keypoints farther away get no 3D point: the depth of most sensors is poor out there."""

    def __post_init__(self) -> None:
        hold_numbers(self, ValueError)
        for name in ("translation_m", "rotation_deg", "max_gap_s", "thumbnail_width_px", "max_depth_m"):
            if not getattr(self, name) > 0:
                raise ValueError(f"{name} is {getattr(self, name):g}; it must be positive")


def select_keyframes(recording: Recording, settings: KeyframeSettings = KeyframeSettings()) -> Int[np.ndarray, " k"]:
    """Choose keyframes by motion: see ``keyframes_by_motion``. Reads no picture."""
    return keyframes_by_motion(recording.stamps_s, recording.world_from_camera, settings)


def keyframes_by_motion(
    stamps_s: Float[np.ndarray, " n"],
    world_from_camera: Float[np.ndarray, "n 4 4"],
    settings: KeyframeSettings = KeyframeSettings(),
) -> Int[np.ndarray, " k"]:
    """Return rising frame numbers: the first, the last, and enough between them to cover the walk.

    Every frame lies within the settings' distance, angle and time of the last keyframe before it. Where the camera
    goes beyond them, the frame in the second half of the stretch that moved least becomes the keyframe, because a
    camera that moves less blurs less.
    """
    count = len(stamps_s)
    if count == 0:
        return np.zeros(0, np.int64)
    speed = _apparent_motion(stamps_s, world_from_camera)
    chosen = [0]
    while chosen[-1] < count - 1:
        last = chosen[-1]
        beyond = _first_beyond(last, stamps_s, world_from_camera, settings)
        if beyond is None:
            chosen.append(count - 1)
            break
        chosen.append(_least_moved(last, beyond, speed))
    return np.array(chosen, np.int64)


def next_keyframe(
    stamps_s: Float[np.ndarray, " n"], world_from_camera: Float[np.ndarray, "n 4 4"], settings: KeyframeSettings
) -> int | None:
    """Return the keyframe that follows frame 0 as soon as no later frame can change it; None until then."""
    beyond = _first_beyond(0, stamps_s, world_from_camera, settings)
    if beyond is None or beyond + 1 >= len(stamps_s):  # how fast a frame moves is known with the one after it
        return None
    return _least_moved(0, beyond, _apparent_motion(stamps_s, world_from_camera))


def _least_moved(last: int, beyond: int, speed: Float[np.ndarray, " n"]) -> int:
    """Return the frame that moved least in the second half of the stretch from a keyframe to one beyond its limits."""
    start = max(last + 1, (last + beyond + 1) // 2)
    return start + int(np.argmin(speed[start : beyond + 1]))


def _first_beyond(
    last: int,
    stamps_s: Float[np.ndarray, " n"],
    world_from_camera: Float[np.ndarray, "n 4 4"],
    settings: KeyframeSettings,
) -> int | None:
    """Return the first frame after ``last`` that breaks a limit; looks ahead block by block."""
    for start in range(last + 1, len(stamps_s), _BLOCK):
        poses = world_from_camera[start : start + _BLOCK]
        moved_m = np.linalg.norm(poses[:, :3, 3] - world_from_camera[last, :3, 3], axis=1)
        turned_rad = rotation_angle_rad(poses, np.broadcast_to(world_from_camera[last], poses.shape))
        beyond = (moved_m > settings.translation_m) | (turned_rad > np.deg2rad(settings.rotation_deg))
        beyond |= stamps_s[start : start + _BLOCK] - stamps_s[last] > settings.max_gap_s
        if beyond.any():
            return start + int(np.argmax(beyond))
    return None


def _apparent_motion(
    stamps_s: Float[np.ndarray, " n"], world_from_camera: Float[np.ndarray, "n 4 4"]
) -> Float[np.ndarray, " n"]:
    """Return about how fast the picture moves, rad/s: turning, and going past things that are 2 m away."""
    speed = np.zeros(len(stamps_s))
    if len(stamps_s) > 1:
        turned_rad = rotation_angle_rad(world_from_camera[1:], world_from_camera[:-1])
        moved_m = np.linalg.norm(np.diff(world_from_camera[:, :3, 3], axis=0), axis=1)
        between = (turned_rad + moved_m / 2.0) / np.maximum(np.diff(stamps_s), 1e-9)
        speed[:-1] += between
        speed[1:] += between
        speed[1:-1] /= 2.0
    return speed


def perceive_keyframes(
    recording: Recording,
    indices: Sequence[int] | Int[np.ndarray, " k"],
    encoders: Encoders,
    rng: "np.random.Generator",
    settings: KeyframeSettings = KeyframeSettings(),
) -> tuple[Keyframes, dict[str, np.ndarray]]:
    """Encode the chosen frames: local, place and view features, 3D points, thumbnails.

    Returns:
        The keyframes, and the arrays that the place encoder learned; the map must keep them.
    """
    place_state, known = learn_places(recording, indices, encoders, rng)
    seen = [
        describe_keyframe(recording.frame(int(index)), encoders, place_state, settings, known.get(int(index)))
        for index in progress(indices, "seeing", total=len(indices), unit="keyframe")
    ]
    return stack_keyframes(seen), place_state


def learn_places(
    recording: Recording, indices: Sequence[int] | Int[np.ndarray, " k"], encoders: Encoders, rng: "np.random.Generator"
) -> tuple[dict[str, np.ndarray], dict[int, LocalFeatures]]:
    """Let the place encoder learn from keyframes spread over the walk.

    Returns:
        What it learned, and the local features of those frames by their number, to save doing them twice.
    """
    if Kind.LOCAL not in encoders or Kind.PLACE not in encoders:
        return {}, {}
    encoder = encoders.local
    chosen = [int(indices[int(i)]) for i in learn_from(len(indices))]
    local = {i: encoder.encode(recording.frame(i).rgb.copy()) for i in chosen}
    return encoders.place.fit(list(local.values()), rng), local


def learn_from(keyframes: int) -> Int[np.ndarray, " k"]:
    """Return the numbers of the keyframes that places are learnt from: up to 64, spread evenly."""
    return np.unique(np.linspace(0, keyframes - 1, min(keyframes, LEARN_FROM_KEYFRAMES)).round().astype(int))


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
    frame: Frame,
    encoders: Encoders,
    place_state: dict[str, np.ndarray],
    settings: KeyframeSettings = KeyframeSettings(),
    local: LocalFeatures | None = None,
) -> DescribedKeyframe:
    """Run encoders on one frame."""
    if local is None:
        local = encoders.local.encode(frame.rgb.copy()) if Kind.LOCAL in encoders else _no_features()
    place = np.zeros(0, np.float32)
    if Kind.LOCAL in encoders and Kind.PLACE in encoders:
        place = unmasked(encoders.place.encode(frame.rgb.copy(), local, place_state))
    return DescribedKeyframe(
        stamp_s=frame.stamp_s,
        world_from_camera=frame.world_from_camera,
        centre=middle_of_view(frame),
        view=unmasked(encoders.views.encode([frame.copy()]))[0] if Kind.VIEWS in encoders else np.zeros(0, np.float32),
        place=place,
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


def _scores(local: Sequence[LocalFeatures]) -> Float16[np.ndarray, " m_or_0"]:
    """Return the scores of all keypoints, none unless every keypoint has one."""
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
    """Return a JPEG file at most ``width_px`` wide."""
    import cv2

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
    """Return the median depth of the patch around each point, NaN where it cannot be trusted."""
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
