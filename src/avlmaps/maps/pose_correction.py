"""Corrected poses held against those that a map was made with: what they move, and why some are refused.

A corrected pose at a stamp moves the frame of that stamp by ``corrected @ inverse(known)``. Frames between two stamps
move by what lies between their motions, and frames before the first and after the last stamp as that one does.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from avlmaps.core.arrays import Float
from avlmaps.core.errors import MapError
from avlmaps.core.poses import inverse, mean_rotation, orthonormalize_all, rotation_angle_rad
from avlmaps.core.timeline import Trajectory, nearest
from avlmaps.recordings.types import Frame

AWAY_S = 0.5
"""A corrected pose is of a frame when one was taken within this many seconds."""
_APART_S = 2.0  # motions over this long are compared
_MOST_OFF_M, _MOST_OFF_SHARE = 0.1, 0.5


@dataclass(frozen=True, slots=True)
class PoseCorrection:
    """The motion of a walk's frames: new world from the world of now, at some stamps."""

    motions: Trajectory

    @classmethod
    def of(
        cls, stamps_s: Any, poses: Any, known_s: Float[np.ndarray, " f"], known: Float[np.ndarray, "f 4 4"]
    ) -> "PoseCorrection":
        """Return what corrected poses mean for the frames of a map.

        Both are world_from_camera of the depth camera; ``stamps_s`` rise, on the clock of the frames, which have the
        poses ``known`` at ``known_s`` now.
        """
        stamps, given = _checked(stamps_s, poses)
        there = Trajectory(known_s, known)
        near = (stamps > known_s[0] - AWAY_S) & (stamps < known_s[-1] + AWAY_S)
        if 2 * near.sum() > len(stamps):  # a tracker that began before the frames, or ran on after them
            stamps, given = stamps[near], given[near]
        away_s = np.abs(stamps - known_s[nearest(stamps, known_s)])
        far = away_s > AWAY_S
        if far.any():
            raise MapError(
                f"{int(far.sum())} of {len(stamps)} corrected poses are of no frame: the first at {stamps[far][0]:.3f} "
                f"s, where the nearest frame is {away_s[far][0]:.3g} s away (frames are from {known_s[0]:.3f} to "
                f"{known_s[-1]:.3f} s). Give poses on the clock of the frames, of this recording alone."
            )
        before = there.at(np.clip(stamps, known_s[0], known_s[-1]))
        _require_walk(stamps, given, before)
        same = np.abs(given - before).max(axis=(1, 2)) < 1e-12
        moved = np.where(same[:, None, None], np.eye(4), given @ inverse(before))
        return cls(Trajectory(stamps, moved))

    def moved(self, stamps_s: Float[np.ndarray, " n"], poses: Float[np.ndarray, "n 4 4"]) -> Float[np.ndarray, "n 4 4"]:
        """Return the new poses of frames."""
        return self.at(stamps_s) @ poses

    @property
    def turn(self) -> Float[np.ndarray, "3 3"]:
        """The rotation of the whole, as far as the motions have one: their mean."""
        return mean_rotation(self.motions.world_from_body)

    def at(self, stamps_s: Float[np.ndarray, " n"]) -> Float[np.ndarray, "n 4 4"]:
        """Return the motion at each stamp, metres."""
        first, last = self.motions.stamps_s[0], self.motions.stamps_s[-1]
        return self.motions.at(np.clip(stamps_s, first, last))


def moved_frame(frame: Frame, step: PoseCorrection) -> Frame:
    """Return a frame at its new pose."""
    return replace(frame, world_from_camera=step.at(np.array([frame.stamp_s]))[0] @ frame.world_from_camera)


def _checked(stamps_s: Any, poses: Any) -> tuple[Float[np.ndarray, " k"], Float[np.ndarray, "k 4 4"]]:
    try:
        came = np.asarray(stamps_s), np.asarray(poses)
    except (TypeError, ValueError, RuntimeError):  # rows of several lengths, or a tensor of a GPU
        came = ()
    if not came or any(array.dtype.kind not in "fiu" for array in came):
        raise MapError("The corrected poses are no numbers; give stamps (k,) in seconds and poses (k, 4, 4) in metres.")
    stamps, given = (array.astype(np.float64) for array in came)
    if stamps.ndim != 1 or given.shape != (len(stamps), 4, 4):
        raise MapError(
            f"There are stamps of {stamps.shape} and corrected poses of {given.shape}; give (k,) and (k, 4, 4)."
        )
    if not len(stamps):
        raise MapError("There is no corrected pose; give at least one, with the stamp of a frame.")
    if not np.isfinite(stamps).all():
        raise MapError(f"{int((~np.isfinite(stamps)).sum())} stamps of corrected poses are no finite seconds.")
    if not (np.diff(stamps) > 0.0).all():
        at = int(np.flatnonzero(~(np.diff(stamps) > 0.0))[0])
        raise MapError(
            f"The stamps of corrected poses must rise; {stamps[at + 1]:.3f} s is after {stamps[at]:.3f} s; sort them."
        )
    return stamps, orthonormalize_all(given, [f"{stamp:.3f} s" for stamp in stamps])


def _require_walk(
    stamps: Float[np.ndarray, " k"], given: Float[np.ndarray, "k 4 4"], before: Float[np.ndarray, "k 4 4"]
) -> None:
    later = np.searchsorted(stamps, stamps + _APART_S)
    first = np.flatnonzero(later < len(stamps))
    if not len(first):
        return
    steps = [inverse(of[first]) @ of[later[first]] for of in (before, given)]
    off_m = np.linalg.norm(steps[0][:, :3, 3] - steps[1][:, :3, 3], axis=1)
    way_m = np.linalg.norm(steps[0][:, :3, 3], axis=1)
    most_m = _MOST_OFF_M + _MOST_OFF_SHARE * float(np.median(way_m))
    turned = float(np.median(rotation_angle_rad(steps[0], steps[1])))
    if float(np.median(off_m)) > most_m or turned > np.radians(30.0):
        raise MapError(
            f"The corrected poses are of another walk, or another camera: over {_APART_S:g} s they differ from those "
            f"of the map by {np.median(off_m):.2f} m and {np.degrees(turned):.0f} degrees (median), where the camera "
            f"went {np.median(way_m):.2f} m. Give the poses of the depth camera in this recording (OpenCV axes)."
        )
