"""The promises of every reader of recordings, ours and others': call ``check`` and ``check_damage`` in a test.

    truth = example_truth()
    path = write_in_my_format(tmp_path / "walk", truth)
    check(lambda: open_my_format(path), truth)
    check_damage(path, open_my_format, scratch=tmp_path / "damaged")

Each raises ``NonConformanceError`` with one sentence that says which promise is broken. The truth is a walk through a
room that is all formula, 6 x 4 x 2.6 m with three boxes, z up. No two walls, boxes or corners look alike, so that a
picture that is mirrored, shuffled or of other channels differs from the right one.
"""

import shutil
import string
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np

from avlmaps.core import poses
from avlmaps.core.arrays import Float, UInt8
from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.errors import AvlmapsError, hold
from avlmaps.core.errors import NonConformanceError as NonConformanceError
from avlmaps.recordings.types import Recording

_ROOM = np.array([[0.0, 0.0, 0.0], [6.0, 4.0, 2.6]])
_BOXES = np.array([
    [[4.2, 1.2, 0.0], [5.2, 2.6, 0.75]],
    [[0.0, 3.4, 0.0], [2.0, 4.0, 0.9]],
    [[1.0, 0.0, 0.0], [1.6, 0.5, 1.8]],
])  # fmt: skip
_BOX_COLOURS = np.array([(150.0, 100.0, 60.0), (180.0, 40.0, 40.0), (60.0, 90.0, 170.0)])
_MORE_COLOUR = np.array([90.0, 70.0, 120.0])
# Walls across x, walls across y, floor, ceiling.
_ROOM_COLOURS = np.array([(205.0, 160.0, 150.0), (150.0, 200.0, 165.0), (120.0, 110.0, 100.0), (235.0, 235.0, 215.0)])
_TEXTURE = 30.0  # contrast, of 255
_PITCH_DOWN_RAD = 0.25


@dataclass(frozen=True, slots=True)
class Truth:
    """What goes into a format's files, and has to come out of its reader; all pictures are seen from one place."""

    rig: Rig
    stamps_s: Float[np.ndarray, " n"]
    world_from_camera: Float[np.ndarray, "n 4 4"]
    rgb: tuple[UInt8[np.ndarray, "h w 3"], ...]
    depth_m: tuple[Float[np.ndarray, "hd wd"], ...]

    def __len__(self) -> int:
        return len(self.stamps_s)


def example_truth(
    rgb: Pinhole | None = None, depth: Pinhole | None = None, frames: int = 6, rate_hz: float = 10.0
) -> Truth:
    """Walk through the room, 12 degrees and 6 cm a frame; colour is 64x48 by default, and depth has colour's camera."""
    rgb = rgb or Pinhole(52.0, 53.0, 31.0, 25.0, 64, 48)
    rig = Rig(rgb, depth or rgb)
    stamps_s = np.arange(frames) / rate_hz
    poses = np.stack([_pose(i) for i in range(frames)])
    depths = tuple(see(rig.depth, pose)[1] for pose in poses)
    for picture in depths:
        picture[:2, :3] = 0.0  # a corner where nothing was measured
    return Truth(rig, stamps_s, poses, tuple(see(rgb, pose)[0] for pose in poses), depths)


def _pose(index: int) -> Float[np.ndarray, "4 4"]:
    heading = np.deg2rad(20.0 + 12.0 * index)
    down = _PITCH_DOWN_RAD + 0.03 * index
    forward = np.array([np.cos(heading) * np.cos(down), np.sin(heading) * np.cos(down), -np.sin(down)])
    right = np.array([np.sin(heading), -np.cos(heading), 0.0])
    pose = np.eye(4)
    pose[:3, :3] = np.stack([right, np.cross(forward, right), forward], axis=1)
    pose[:3, 3] = (2.2 + 0.06 * index, 1.9 + 0.02 * np.sin(index), 1.2)
    return pose


def see(
    camera: Pinhole, pose: Float[np.ndarray, "4 4"], more: Sequence[Float[np.ndarray, "2 3"]] = ()
) -> tuple[Any, Any]:
    """Cast one ray a pixel; return colour (uint8) and z-depth (float32, metres)."""
    rays: Any = camera.rays() @ pose[:3, :3].T
    eye: Any = pose[:3, 3]
    with np.errstate(divide="ignore", invalid="ignore"):
        walls = np.maximum((_ROOM[0] - eye) / rays, (_ROOM[1] - eye) / rays)
    depth: Any = walls.min(axis=-1)
    axis: Any = walls.argmin(axis=-1)
    colour = _ROOM_COLOURS[np.where(axis < 2, axis, np.where(rays[..., 2] < 0.0, 2, 3))]
    colours = (*_BOX_COLOURS, *[_MORE_COLOUR] * len(more))
    for (low, high), own in zip((*_BOXES, *more), colours, strict=True):
        with np.errstate(divide="ignore", invalid="ignore"):
            a, b = (low - eye) / rays, (high - eye) / rays
        near: Any = np.minimum(a, b)
        enter, leave = near.max(axis=-1), np.maximum(a, b).min(axis=-1)
        hit: Any = (enter < leave) & (enter > 0.0) & (enter < depth)
        depth = cast("Any", np.where(hit, enter, depth))
        colour = np.where(hit[..., None], own * (1.0 - 0.12 * near.argmax(axis=-1))[..., None], colour)
    points: Any = eye + rays * depth[..., None]
    x, y, z = points[..., 0], points[..., 1], points[..., 2]
    wave = np.sin(5.1 * x + 1.3 * z) + np.sin(4.3 * y - 1.7 * x) + np.sin(5.7 * z + 0.9 * y)
    return (colour + _TEXTURE / 2.0 * wave[..., None]).clip(0.0, 255.0).astype(np.uint8), depth.astype(np.float32)


_HASH_DIGITS = frozenset(string.hexdigits.lower())
# JPEG, and video more so, changes colours a little; another order of channels or another picture changes much more.
MOST_COLOUR_ERROR = 12.0
_POSITION_M, _ANGLE_RAD, _STAMP_S = 2e-3, 2e-3, 2e-3
_FOCAL_SHARE, _CENTRE_PIXELS = 1e-3, 0.05
_UP_COSINE = 0.9999


def check(
    open_it: Callable[[], Recording],
    truth: Truth,
    *,
    depth_error_m: float = 2e-3,
    least_measured: float = 0.97,
    colour_error: float = MOST_COLOUR_ERROR,
    stamps: bool = True,
) -> Recording:
    """Hold a reader to the truth that was written in its format, and return the recording that it opened.

    The world may be another than the truth's (axes turned, origin moved): poses are compared up to one rigid motion,
    and the up direction with them. A reader that does not know up says None, and one without a clock has no ``stamps``
    but rising ones. ``depth_error_m`` is of the median of a picture, ``colour_error`` of the mean, of 255.
    """
    recording = open_it()
    files = _listing(recording.path)
    hold(len(recording) == len(truth), f"{len(recording)} frames come out where {len(truth)} went in")
    names = [recording.name(i) for i in range(len(recording))]
    hold(len(set(names)) == len(names), f"each frame needs a name of its own, not {names}")
    rises = bool((np.diff(recording.stamps_s) > 0.0).all()) and recording.stamps_s.dtype == np.float64
    hold(rises, f"stamps must be float64 that rise, not {recording.stamps_s.tolist()}")
    own = recording.stamps_s - recording.stamps_s[0]
    hold(not stamps or np.allclose(own, truth.stamps_s, atol=_STAMP_S), f"stamps are {own}, not {truth.stamps_s}")
    _check_camera(recording.rig.rgb, truth.rig.rgb, "colour")
    _check_camera(recording.rig.depth, truth.rig.depth, "depth")
    lies = np.allclose(recording.rig.rgb_from_depth, truth.rig.rgb_from_depth, atol=1e-6)
    hold(lies, f"colour and depth camera do not lie as they did: {recording.rig.rgb_from_depth.tolist()}")
    _check_poses(recording, truth)
    for index in reversed(range(len(truth))):
        _check_frame(recording, index, truth, depth_error_m, least_measured, colour_error)
    _check_access(recording)
    again, print_ = open_it(), recording.fingerprint
    hold(len(print_) == 64 and set(print_) <= _HASH_DIGITS, f"the fingerprint must be a hex SHA-256, not {print_!r}")
    hold(print_ == again.fingerprint, "the same recording must have the same fingerprint each time that it is opened")
    hold(recording.change_stamp() == again.change_stamp(), "change_stamp() must not change while the files do not")
    hold(_listing(recording.path) == files, "a recording is opened in place: its files must not change, nor grow more")
    return recording


def _check_camera(own: Pinhole, true: Pinhole, what: str) -> None:
    hold((own.width, own.height) == (true.width, true.height), f"the {what} camera is {own}, not {true}")
    focal = np.abs(np.array([own.fx / true.fx, own.fy / true.fy]) - 1.0).max() <= _FOCAL_SHARE
    centre = np.abs(np.array([own.cx - true.cx, own.cy - true.cy])).max() <= _CENTRE_PIXELS
    hold(focal, f"the {what} camera's focal length is {own.fx}, {own.fy}; it must be {true.fx}, {true.fy}")
    wanted = f"{true.cx}, {true.cy} (the centre of the first pixel lies at 0.5, 0.5)"
    hold(centre, f"the {what} camera's centre is {own.cx}, {own.cy}; it must be {wanted}")


def _check_poses(recording: Recording, truth: Truth) -> None:
    own = recording.world_from_camera
    hold(own.shape == (len(truth), 4, 4) and own.dtype == np.float64, "poses must be float64 of (n, 4, 4)")
    identity = np.swapaxes(own[:, :3, :3], 1, 2) @ own[:, :3, :3]
    hold(np.allclose(identity, np.eye(3), atol=1e-9), "rotations must be orthonormal (settle makes them so)")
    hold(np.allclose(np.linalg.det(own[:, :3, :3]), 1.0), "a rotation mirrors; turn axes by a rotation")
    own_from_true = own[0] @ poses.inverse(truth.world_from_camera[0])
    expected = own_from_true @ truth.world_from_camera
    off_m = float(np.abs(own[:, :3, 3] - expected[:, :3, 3]).max())
    hold(off_m <= _POSITION_M, f"the camera moves otherwise than it did from the first frame on, by {off_m:.3g} m")
    off_rad = float(poses.rotation_angle_rad(own, expected).max())
    hold(off_rad <= _ANGLE_RAD, f"the camera turns otherwise than it did, by up to {np.rad2deg(off_rad):.3g} degrees")
    up = recording.up_in_world
    if up is not None:
        true_up = own_from_true[:3, 2]  # z of the truth
        hold(abs(np.linalg.norm(up) - 1.0) < 1e-9, f"up_in_world must be a unit vector, not {up}")
        hold(up @ true_up > _UP_COSINE, f"up is {np.round(true_up, 3)} in this world, not {up}; say None if not known")


def _check_frame(
    recording: Recording, index: int, truth: Truth, depth_m: float, measured: float, colour: float
) -> None:
    frame, name = recording.frame(index), recording.name(index)
    own = f"frame {index} says that it is {frame.index}, {frame.name!r}; name({index}) says {name!r}"
    hold(frame.index == index and frame.name == name, own)
    hold(frame.stamp_s == recording.stamps_s[index], f"frame {name} has another stamp than the recording says")
    true = truth.depth_m[index]
    known = np.isfinite(frame.depth_m) & (frame.depth_m >= 0.0)
    hold(known.all(), "depth must be finite, and 0 where there is none")
    false = frame.valid & (true == 0.0)
    hold(not false.any(), f"frame {name} has a depth at {false.sum()} pixels where nothing was measured")
    both = frame.valid & (true > 0.0)
    share = both.sum() / (true > 0.0).sum()
    hold(share >= measured, f"frame {name} has a depth at {share:.0%} of the pixels where one was measured")
    off_m = float(np.median(np.abs(frame.depth_m - true)[both]))
    ratio = float(np.median(frame.depth_m[both] / true[both]))
    hold(off_m <= depth_m, f"the depths of frame {name} are {ratio:.4g} times the true ones (off by {off_m:.3g} m)")
    off = float(np.abs(frame.rgb.astype(float) - truth.rgb[index]).mean())
    swapped = float(np.abs(frame.rgb[..., ::-1].astype(float) - truth.rgb[index]).mean())
    why = "; red and blue are swapped" if swapped <= colour else ""
    hold(off <= colour, f"the colours of frame {name} are off by {off:.3g} of 255 in the mean{why}")


def _check_access(recording: Recording) -> None:
    with ThreadPoolExecutor(1) as other:
        theirs = other.submit(recording.frame, 1).result()
    ours = recording.frame(1)
    same = np.array_equal(theirs.rgb, ours.rgb) and np.array_equal(theirs.depth_m, ours.depth_m)
    hold(same, "another thread must read the same frame")
    try:
        recording.frame(len(recording))
    except IndexError:
        return
    hold(False, f"there is no frame {len(recording)}; frame() must raise IndexError")


def check_damage(path: Path, open_it: Callable[[Path], Recording], scratch: Path, most_files: int = 12) -> None:
    """Remove, cut and empty the files of a copy one by one; each time a plain sentence or fewer frames must come.

    At most ``most_files`` are damaged: the first of each folder and suffix, then others.
    """
    for name in _victims(path, most_files):
        for done in ("removed", "cut to half", "emptied"):
            copy = scratch / path.name
            _copy(path, copy)
            victim = copy / name if name else copy
            content = victim.read_bytes()
            victim.unlink()
            if done != "removed":
                victim.write_bytes(content[: len(content) // 2] if done == "cut to half" else b"")
            _check_told(copy, open_it, f"{name or path.name} was {done}")


def _check_told(copy: Path, open_it: Callable[[Path], Recording], what: str) -> None:
    try:
        recording = open_it(copy)
        for frame in recording.frames():
            hold(np.isfinite(frame.world_from_camera).all(), f"{what}: frame {frame.name} has a pose that is none")
    except AvlmapsError as error:
        sentence = str(error)
        is_named = copy.name in sentence or any(c.name in sentence for c in copy.rglob("*"))
        hold(is_named, f"{what}: {sentence!r} names no file")
    except NonConformanceError:
        raise
    except Exception as error:
        raise NonConformanceError(f"{what}: {type(error).__name__} ({error}) in place of a RecordingError") from error


def _victims(path: Path, most: int) -> list[str]:
    if path.is_file():
        return [""]
    names = [str(file.relative_to(path)) for file in sorted(path.rglob("*")) if file.is_file()]
    kinds = {(Path(name).parent, "".join(Path(name).suffixes)): name for name in reversed(names)}
    return list(dict.fromkeys([*sorted(kinds.values()), *names]))[:most]


def _copy(path: Path, copy: Path) -> None:
    if copy.is_dir():
        shutil.rmtree(copy)
    copy.parent.mkdir(parents=True, exist_ok=True)
    if path.is_dir():
        shutil.copytree(path, copy)
    else:
        shutil.copyfile(path, copy)


def _listing(path: Path) -> dict[str, tuple[int, int]]:
    files = [path] if path.is_file() else path.rglob("*")
    return {str(file): (file.stat().st_size, file.stat().st_mtime_ns) for file in files if file.is_file()}
