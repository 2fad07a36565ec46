"""Which frames are keyframes: the first, the last, and enough between them to cover the walk."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import numpy as np

from avlmaps.core.arrays import Float, Int
from avlmaps.core.errors import MapError
from avlmaps.core.numbers import hold_numbers
from avlmaps.core.poses import rotation_angle_rad
from avlmaps.recordings.types import Recording

T = TypeVar("T")
_FAR_M = 2.0  # how far things are that a moving camera passes, for how fast the picture moves


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
        hold_numbers(
            self, MapError, positive="translation_m rotation_deg max_gap_s thumbnail_width_px max_depth_m"
        )  # fmt: skip


DEFAULT_KEYFRAMES = KeyframeSettings()


@dataclass(frozen=True, slots=True)
class _Seen(Generic[T]):
    item: T
    stamp_s: float
    pose: Float[np.ndarray, "4 4"]


class KeyframeChooser(Generic[T]):
    """Takes frames in the order of time, and holds one at most.

    Where the camera goes beyond the limits since the last keyframe, the frame beyond half of them that moved least
    becomes the next one, because a camera that moves less blurs less.
    """

    def __init__(self, settings: KeyframeSettings) -> None:
        self._limits = settings.translation_m, np.deg2rad(settings.rotation_deg), settings.max_gap_s
        self._last: _Seen[T] | None = None  # the last keyframe
        self._before: _Seen[T] | None = None  # the last frame
        self._best: tuple[float, _Seen[T]] | None = None  # its speed, and the frame that may become a keyframe
        self._after: list[_Seen[None]] = []  # frames since that one

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
        share = self._share(seen)
        if share > 0.5 and (self._best is None or speed < self._best[0]):
            self._best, self._after = (speed, seen), []
        if share <= 1.0 or self._best is None:
            self._after.append(_Seen(None, stamp_s, pose))
            return
        best, self._best = self._best[1], None
        turned_back = any(self._share(one, best) > 1.0 for one in self._after)
        self._last, self._after = seen if turned_back else best, []
        yield self._last.item
        share = self._share(seen)
        if share > 1.0:
            self._last = seen
            yield item
        elif share > 0.5:
            self._best = speed, seen

    def end(self) -> Iterator[T]:
        """Yield the last frame, unless it is a keyframe already."""
        if self._before is not None and self._before is not self._last:
            self._last, self._best = self._before, None
            yield self._before.item

    def _share(self, seen: "_Seen[Any]", since: "_Seen[Any] | None" = None) -> float:
        begin = since or self._last
        assert begin is not None
        return max(value / limit for value, limit in zip(_motion(begin, seen), self._limits, strict=True))


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


def select_keyframes(recording: Recording, settings: KeyframeSettings = DEFAULT_KEYFRAMES) -> Int[np.ndarray, " k"]:
    """Choose the keyframes of a recording; it reads no picture."""
    return keyframes_by_motion(recording.stamps_s, recording.world_from_camera, settings)
