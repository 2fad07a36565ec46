"""What someone knows better than a recording's files: depth unit, intrinsics, poses, camera axes, pose clock, up.

Axes are a name or three letters for x, y and z: right or left, up or down, forward or back, as seen by the camera.
OpenCV is RDF, OpenGL and ARKit RUB, bodies of ROS FLU, a picture turned by 90 degrees DLF or URF.
"""

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from enum import StrEnum
from functools import cache, cached_property
from itertools import product
from pathlib import Path

import numpy as np
from jaxtyping import Float

from avlmaps.core import poses
from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.errors import RecordingError
from avlmaps.core.timeline import Trajectory
from avlmaps.core.wording import flag, option
from avlmaps.recordings.types import Frame, Recording, Subset

OPENCV = "opencv"
NAMED = {OPENCV: "RDF", "opengl": "RUB", "ros": "FLU"}
_DIRECTIONS = {
    "R": (1.0, 0.0, 0.0),
    "L": (-1.0, 0.0, 0.0),
    "D": (0.0, 1.0, 0.0),
    "U": (0.0, -1.0, 0.0),
    "F": (0.0, 0.0, 1.0),
    "B": (0.0, 0.0, -1.0),
}


def opencv_from_axes(name: str) -> Float[np.ndarray, "3 3"]:
    """Return the rotation from these axes to OpenCV's; RecordingError where they are no right-handed axes."""
    letters = NAMED.get(name.lower(), name.upper())
    if len(letters) != 3 or not set(letters) <= set(_DIRECTIONS):
        raise RecordingError(
            f"There are no camera axes called {name!r}; give {', '.join(NAMED)}, or where x, y and z point by three "
            "letters of R L U D F B (RDF is opencv)."
        )
    rotation = np.array([_DIRECTIONS[letter] for letter in letters]).T
    if not np.isclose(np.linalg.det(rotation), 1.0):
        raise RecordingError(f"The camera axes {name!r} are no right-handed axes; RDF, RUB and FLU are.")
    return rotation


@cache
def all_axes() -> tuple[str, ...]:
    """Return every right-handed convention by its letters, the named ones first."""
    every = map("".join, product(_DIRECTIONS, repeat=3))
    right = [letters for letters in every if np.linalg.det([_DIRECTIONS[letter] for letter in letters]) > 0.5]
    return tuple(sorted(right, key=lambda letters: letters not in NAMED.values()))


UP_IN_WORLD = np.array([0.0, 1.0, 0.0])  # of phones: ARKit's world has y up, against gravity


def from_opengl(world_from_camera: Float[np.ndarray, "*n 4 4"]) -> Float[np.ndarray, "*n 4 4"]:
    """Return poses of cameras with y down and z forward, given those with y up and z backward."""
    opengl_from_opencv = np.eye(4)
    opengl_from_opencv[:3, :3] = opencv_from_axes("opengl").T
    return world_from_camera @ opengl_from_opencv


_LARGEST_UNIT_M = 1000.0
_SMALLEST_UNIT_M = 1e-6
# A pose belongs to its picture within seconds; more is another clock, which a shift does not repair.
MOST_POSE_DELAY_S = 3600.0


class PoseKind(StrEnum):
    """How the poses of the files are to be read."""

    WORLD_FROM_CAMERA = "world-from-camera"
    CAMERA_FROM_WORLD = "camera-from-world"
    WXYZ = "wxyz"  # the quaternions were written w first and read x first


@dataclass(frozen=True, slots=True)
class GivenCamera:
    """Intrinsics of one camera, pixels, and the size of the picture that they belong to; None: the recording's own."""

    fx: float
    fy: float
    cx: float
    cy: float
    size: tuple[int, int] | None = None

    def camera(self, width: int, height: int) -> Pinhole:
        """Return the camera of a recording's pictures; RecordingError where no camera has these numbers."""
        try:
            given = Pinhole(self.fx, self.fy, self.cx, self.cy, *(self.size or (width, height)))
        except ValueError as error:
            raise RecordingError(f"The given intrinsics hold no camera: {error}.") from None
        if given.shaped(width, height):
            return given.resized(width, height)
        raise RecordingError(
            f"The given intrinsics are of {given.width}x{given.height}, not of the pictures' shape ({width}x{height})."
        )

    @staticmethod
    def parse(words: str) -> "GivenCamera":
        """Read ``fx,fy,cx,cy`` or ``fx,fy,cx,cy@WIDTHxHEIGHT``; ValueError where it is something else."""
        numbers, _, size = words.partition("@")
        fx, fy, cx, cy = (float(number) for number in numbers.split(","))
        if not size:
            return GivenCamera(fx, fy, cx, cy)
        width, height = (int(number) for number in size.split("x"))
        return GivenCamera(fx, fy, cx, cy, (width, height))


@dataclass(frozen=True, slots=True)
class Corrections:
    """What is known better than the files; None or empty leaves a thing as the files have it.

    Attributes:
        depth_unit_m: metres of one unit of the depth as stored (0.001: millimetres; 1 for depth in floats).
        intrinsics: of colour and depth; one for both where depth is registered to colour.
        poses: how the poses are to be read; quaternions are put right before poses are inverted.
        camera_axes: where the x, y and z axis of the poses' camera point.
        pose_delay_s: a pose with stamp t + delay belongs to the picture with stamp t.
        up_in_world: direction against gravity in the poses' world.
    """

    depth_unit_m: float | None = None
    intrinsics: tuple[GivenCamera, ...] = ()
    poses: tuple[PoseKind, ...] = ()
    camera_axes: str | None = None
    pose_delay_s: float | None = None
    up_in_world: tuple[float, float, float] | None = None

    def __post_init__(self) -> None:
        if fault := self._fault():
            raise RecordingError(fault)

    def __bool__(self) -> bool:
        return self != Corrections()

    def _fault(self) -> str:
        unit, delay, up = self.depth_unit_m, self.pose_delay_s, self.up_in_world
        if unit is not None and not _SMALLEST_UNIT_M <= unit <= _LARGEST_UNIT_M:
            return f"The depth unit is {unit:g} m; give the metres of one unit, 0.001 for millimetres."
        if len(self.intrinsics) > 2:
            return f"There are intrinsics of {len(self.intrinsics)} cameras; give colour's, or colour's and depth's."
        if len(set(self.poses)) != len(self.poses) or {*self.poses} >= {
            PoseKind.WORLD_FROM_CAMERA,
            PoseKind.CAMERA_FROM_WORLD,
        }:
            return f"The poses cannot be {' and '.join(self.poses)} at once; give each word once."
        if self.camera_axes is not None:
            opencv_from_axes(self.camera_axes)
        if delay is not None and not abs(delay) <= MOST_POSE_DELAY_S:
            return f"The delay of the poses is {delay:g} s; it is at most {MOST_POSE_DELAY_S:g} s either way."
        if up is not None and not 1e-6 < float(np.linalg.norm(up)) < 1e6:
            return f"The up direction is {list(up)}; give a direction such as 0,0,1."
        return ""

    def over(self, declared: "Corrections") -> "Corrections":
        """Return these, and the declared ones of all things that these leave open."""
        ours = {f.name: getattr(self, f.name) for f in fields(self) if getattr(self, f.name) not in (None, ())}
        return replace(declared, **ours)

    def words(self, spelled: Callable[[str, str], str] = option) -> str:
        unit, delay = self.depth_unit_m, self.pose_delay_s
        rows = (
            ("depth-unit", "" if unit is None else f"{unit:g}"),
            ("intrinsics", " ".join(map(_camera_words, self.intrinsics))),
            ("poses", " ".join(self.poses)),
            ("camera-axes", self.camera_axes or ""),
            ("pose-delay", "" if delay is None else f"{delay:g}"),
            ("up", ",".join(f"{value:g}" for value in self.up_in_world or ())),
        )
        return " ".join(spelled(name, value) for name, value in rows if value)


NONE = Corrections()


def _camera_words(camera: GivenCamera) -> str:
    size = f"@{camera.size[0]}x{camera.size[1]}" if camera.size else ""
    return ",".join(f"{number:.6g}" for number in (camera.fx, camera.fy, camera.cx, camera.cy)) + size


def corrected(recording: Recording, given: Corrections) -> Recording:
    """Return a recording with what someone knows better; what ``given`` leaves open stays corrected as it was.

    RecordingError says that something does not fit it (one camera for two, a delay longer than the walk).
    """
    if isinstance(recording, CorrectedRecording):
        again = CorrectedRecording(recording.whole, given.over(recording.given))
        again.audio = recording.audio
        known = {*again.notices, *recording.lost}
        again.notices = (*again.notices, *(notice for notice in recording.notices if notice not in known))
        return again
    return CorrectedRecording(recording, given) if given else recording


class CorrectedRecording(Subset):
    """A recording in place, with corrected unit, cameras, poses and up direction."""

    def __init__(self, whole: Recording, given: Corrections) -> None:
        at, world_from_camera, self.lost = _delayed(whole, given.pose_delay_s)
        super().__init__(whole, at)
        self.given, self.topics = given, whole.topics
        self.rig = corrected_rig(whole.rig, given.intrinsics, whole.path)
        self._scale = 1.0 if given.depth_unit_m is None else given.depth_unit_m / whole.stored_depth_unit_m
        self.stored_depth_unit_m = whole.stored_depth_unit_m * self._scale
        self.notices = (*whole.notices, *self.lost)
        self.posed = whole.posed * len(at) / max(len(whole), 1)
        self.world_from_camera = reread_poses(world_from_camera, given)
        known = whole.trajectory
        if known is not None:
            own_s = known.stamps_s - (given.pose_delay_s or 0.0)
            self.trajectory = Trajectory(own_s, reread_poses(known.world_from_body, given))
        untouched = not given.poses and given.camera_axes is None
        self.base_height = whole.base_height if untouched else None
        if given.up_in_world is not None:
            self.up_in_world = np.array(given.up_in_world) / np.linalg.norm(given.up_in_world)

    def frame(self, index: int) -> Frame:
        frame = super().frame(index)
        depth_m = frame.depth_m if self._scale == 1.0 else frame.depth_m * np.float32(self._scale)
        pose = self.world_from_camera[index]
        return replace(frame, depth_m=depth_m, world_from_camera=pose, rig=self.rig)

    @cached_property
    def fingerprint(self) -> str:
        return hashlib.sha256(f"{self.whole.fingerprint} {self.given.words(flag)}".encode()).hexdigest()


def _delayed(whole: Recording, delay_s: float | None) -> tuple[np.ndarray, Float[np.ndarray, "n 4 4"], tuple[str, ...]]:
    if not delay_s or len(whole) == 0:
        return np.arange(len(whole)), whole.world_from_camera, ()
    known = whole.walk
    stamps_s = whole.stamps_s + delay_s
    there = np.flatnonzero(known.covers(stamps_s))
    if len(there) == 0:
        raise RecordingError(
            f"{whole.path}: poses that are {delay_s:g} s late leave no frame with a pose; the frames go from "
            f"{whole.stamps_s[0]:.2f} to {whole.stamps_s[-1]:.2f} s, the poses from {known.stamps_s[0]:.2f} to "
            f"{known.stamps_s[-1]:.2f} s. Give a smaller {option('pose-delay')}."
        )
    lost = len(whole) - len(there)
    notice = f"{lost} frame(s) have no pose {delay_s:g} s later and are left out."
    return there, known.at(stamps_s[there]), (notice,) if lost else ()


def uncorrected(recording: Recording) -> Recording:
    """Return the recording as its files have it."""
    return recording.whole if isinstance(recording, CorrectedRecording) else recording


def corrected_rig(rig: Rig, given: Sequence[GivenCamera], path: Path) -> Rig:
    """Return the cameras with given intrinsics; RecordingError where one is given for two."""
    if not given:
        return rig
    if len(given) == 1 and not (rig.registered and rig.rgb.shaped(rig.depth.width, rig.depth.height)):
        raise RecordingError(
            f"{path} has a depth camera of its own; give the intrinsics of both cameras, colour first: "
            f"{option('intrinsics', 'fx,fy,cx,cy fx,fy,cx,cy')}."
        )
    rgb = given[0].camera(rig.rgb.width, rig.rgb.height)
    if len(given) == 1:
        return Rig(rgb, rgb.resized(rig.depth.width, rig.depth.height))
    return Rig(rgb, given[1].camera(rig.depth.width, rig.depth.height), rig.rgb_from_depth)


def reread_poses(world_from_camera: Float[np.ndarray, "n 4 4"], given: Corrections) -> Float[np.ndarray, "n 4 4"]:
    """Return poses of files as they are meant: quaternions, then the direction, then the camera's axes."""
    pose = world_from_camera
    if PoseKind.WXYZ in given.poses:
        pose = poses.from_quaternion(pose[:, :3, 3], np.roll(poses.to_quaternion(pose), -1, axis=1))
    if PoseKind.CAMERA_FROM_WORLD in given.poses:
        pose = poses.inverse(pose)
    if given.camera_axes not in (None, OPENCV):
        camera_from_opencv = np.eye(4)
        camera_from_opencv[:3, :3] = opencv_from_axes(given.camera_axes).T
        pose = pose @ camera_from_opencv
    return pose
