"""A suspect in words: what the recording looks like, and how to read it instead."""

from avlmaps.core.camera import Rig
from avlmaps.recordings.camera_axes import NAMED, opencv_from_axes
from avlmaps.recordings.consistency.suspects import UNITS, PictureTurn, Suspect, suspected_rig
from avlmaps.recordings.corrections import Corrections, GivenCamera, PoseKind

# A camera in a building looks at this much, in the middle of what it sees.
USUAL_DEPTH_M = (0.4, 7.0)
_CLOSE = 0.06
# Depth cameras that are not calibrated are off by this factor; more is another unit, or positions without a scale.
_SLIGHT = 1.2
_KINDS = {
    PoseKind.WXYZ: "the quaternions look written w first (wxyz)",
    PoseKind.CAMERA_FROM_WORLD: "the poses look like camera_from_world",
    PoseKind.WORLD_FROM_CAMERA: "the poses look like world_from_camera",
}

_GIVEN = {
    PoseKind.WXYZ: "poses of quaternions x, y, z, w",
    PoseKind.CAMERA_FROM_WORLD: "the inverse of each pose",
    PoseKind.WORLD_FROM_CAMERA: "each pose as it is",
}


def cause_of(
    suspect: Suspect, rig: Rig, stored_unit_m: float, median_m: float, gain: str, *, of_program: bool = False
) -> str:
    """Return what a recording looks like and what to do about it.

    Args:
        suspect: with which it agrees.
        rig: its cameras.
        stored_unit_m: metres of one unit of its depth as it is read.
        median_m: middle of its depths, as they are read.
        gain: how much better the recording agrees, in parentheses, or nothing.
        of_program: a program gives the frames, so that it has to give others.
    """
    looks = " and ".join(_looks(suspect, rig, median_m))
    options, hands = _options(suspect, rig, stored_unit_m, median_m), _by_hand(suspect, median_m)
    todo: list[str] = []
    if options and of_program:
        todo.append(f"give frames with {' and '.join(_in_arrays(options, suspect.scale))}")
    elif options:
        todo.append(f"build again with {options.words()}")
    if hands:
        todo.append(hands)
    gain = f" {gain}" if gain else ""
    return f"{looks[:1].upper()}{looks[1:]}{gain}: {', '.join(todo)}."


def _looks(suspect: Suspect, rig: Rig, median_m: float) -> list[str]:
    given = suspect.given
    said = [_KINDS[kind] for kind in given.poses]
    if given.camera_axes is not None:
        said.append(f"the poses look like those of {_camera(given.camera_axes)}")
    if given.pose_delay_s:
        late = "late" if given.pose_delay_s > 0.0 else "early"
        said.append(f"the poses look {abs(given.pose_delay_s):.2g} s {late}")
    if suspect.scale != 1.0:
        said.append(_scale(suspect.scale, median_m))
    if suspect.centred:
        size = f"{2 * rig.depth.cx:.0f}x{2 * rig.depth.cy:.0f}"
        said.append(f"the intrinsics look like those of a {size} picture, not {rig.depth.width}x{rig.depth.height}")
    if suspect.swapped:
        said.append("the numbers of columns and rows in the intrinsics look exchanged")
    if suspect.focal is not None:
        said.append(f"the focal length looks like {suspect.focal:.2f} of what is given")
    if any(suspect.off_centre):
        parts = zip(suspect.off_centre, (rig.rgb.width, rig.rgb.height), "xy", strict=True)
        by = " and ".join(f"{share * size:+.0f} pixels in {axis}" for share, size, axis in parts if share)
        said.append(f"the principal point looks {by} off, or the camera turned by as many in its mount")
    if suspect.rolled_deg:
        said.append(f"the camera looks turned by {suspect.rolled_deg:+.0f} degrees about its own axis in its mount")
    return (
        said + _measured_otherwise(suspect) + _of_two_worlds(suspect) + _turned(suspect.turn_colour, suspect.turn_depth)
    )


def _measured_otherwise(suspect: Suspect) -> list[str]:
    said: list[str] = []
    if suspect.farther_m:
        large = "large" if suspect.farther_m < 0.0 else "small"
        said.append(f"the depth looks {abs(suspect.farther_m):.2g} m too {large} everywhere")
    if suspect.along_ray:
        said.append("the depth looks like the distance along the ray, not along the camera's axis")
    return said


def _of_two_worlds(suspect: Suspect) -> list[str]:
    said: list[str] = []
    if suspect.turned_back:
        said.append("the rotations look like those of camera_from_world, the positions like those of the camera")
    if suspect.places is not None:
        axes = ", ".join(f"{'-' if axis < 0 else ''}{'xyz'[abs(axis) - 1]}" for axis in suspect.places)
        said.append(f"the positions look written in other axes than the rotations, whose x, y, z they call {axes}")
    return said


def _camera(axes: str) -> str:
    names = {"opengl": "an OpenGL camera (y up, z back)", "ros": "a body (x forward)", "opencv": "an OpenCV camera"}
    return names.get(axes, f"a camera with the axes {axes} (turned pictures, or another convention)")


def _turned(colour: PictureTurn | None, depth: PictureTurn | None) -> list[str]:
    if colour is not None and colour == depth:
        return [f"the pictures look {colour.words()}"]
    said = [(f"the {what} pictures look", turn) for what, turn in (("colour", colour), ("depth", depth))]
    return [f"{what} {turn.words()}" for what, turn in said if turn is not None]


def _scale(scale: float, median_m: float) -> str:
    """Return whether depth or positions are out of scale, as far as usual depths say it."""
    times = f"{max(scale, 1.0 / scale):.3g} times too {'small' if scale > 1.0 else 'large'}"
    if _is_depth(scale, median_m):
        return f"the depth looks {times}"
    other = f"{max(scale, 1.0 / scale):.3g} times too {'large' if scale > 1.0 else 'small'}"
    if _is_positions(scale, median_m):
        return f"the positions look {other} (poses of one camera alone have no scale)"
    return f"the depth looks {times}, or the positions {other}"


def _usual(median_m: float) -> bool:
    return USUAL_DEPTH_M[0] <= median_m <= USUAL_DEPTH_M[1]


def _is_unit(scale: float) -> bool:
    return any(abs(scale / unit - 1.0) < _CLOSE for unit in UNITS)


def _is_depth(scale: float, median_m: float) -> bool:
    return _is_unit(scale) and _usual(scale * median_m) and not _usual(median_m)


def _is_positions(scale: float, median_m: float) -> bool:
    return (not _is_unit(scale) and max(scale, 1.0 / scale) > _SLIGHT) or (
        _usual(median_m) and not _usual(scale * median_m)
    )


def _options(suspect: Suspect, rig: Rig, stored_unit_m: float, median_m: float) -> Corrections:
    cameras: tuple[GivenCamera, ...] = ()
    if suspect.centred and rig.registered:
        size = (round(2 * rig.rgb.cx), round(2 * rig.rgb.cy))
        cameras = (GivenCamera(rig.rgb.fx, rig.rgb.fy, rig.rgb.cx, rig.rgb.cy, size),)
    elif suspect.centred or suspect.swapped or suspect.focal is not None or any(suspect.off_centre):
        other = suspected_rig(rig, suspect) or rig
        both = (other.rgb,) if rig.registered else (other.rgb, other.depth)
        cameras = tuple(GivenCamera(camera.fx, camera.fy, camera.cx, camera.cy) for camera in both)
    depth = suspect.scale != 1.0 and not _is_positions(suspect.scale, median_m)
    return Corrections(
        depth_unit_m=stored_unit_m * suspect.scale if depth else None,
        intrinsics=cameras,
        poses=suspect.given.poses,
        camera_axes=_named(suspect.given.camera_axes),
        pose_delay_s=suspect.given.pose_delay_s,
    )


def _in_arrays(options: Corrections, scale: float) -> list[str]:
    """Return what a program gives instead, where a recording is read with options."""
    said = [_GIVEN[kind] for kind in options.poses]
    if options.depth_unit_m is not None:
        said.append(f"depth_m times {scale:.3g}")
    if options.intrinsics:
        words = Corrections(intrinsics=options.intrinsics).words(lambda _, value: value)
        said.append(f"a camera of fx, fy, cx, cy {words}")
    if options.camera_axes is not None:
        turn = opencv_from_axes(options.camera_axes).T.astype(int).tolist()
        said.append(f"poses of OpenCV's axes, world_from_camera[:3, :3] @ {turn}")
    if options.pose_delay_s:
        when = "later" if options.pose_delay_s > 0.0 else "earlier"
        said.append(f"the pose of {abs(options.pose_delay_s):.2g} s {when}")
    return said


def _named(axes: str | None) -> str | None:
    return next((name for name, letters in NAMED.items() if letters == axes), axes)


def _by_hand(suspect: Suspect, median_m: float) -> str:
    """Return what no option does."""
    todo: list[str] = []
    if suspect.scale != 1.0 and not _is_depth(suspect.scale, median_m):
        alone = _is_positions(suspect.scale, median_m)
        todo.append(f"{'' if alone else 'or '}multiply the positions by {1.0 / suspect.scale:.3g}")
    if suspect.turn_colour is not None and suspect.turn_depth is not None:
        todo.append("turn the pictures as the poses have them")
    elif suspect.turn_colour is not None:
        todo.append("turn the colour pictures as the depth is")
    elif suspect.turn_depth is not None:
        todo.append("turn the depth pictures as the colour is")
    if suspect.rolled_deg:
        todo.append("correct the transform from what the poses are of to the camera")
    if suspect.farther_m:
        todo.append(f"write the depth from the camera's centre ({suspect.farther_m:+.2g} m)")
    if suspect.along_ray:
        todo.append("write the depth along the camera's axis (z)")
    if suspect.turned_back:
        todo.append("write the inverse of each rotation")
    if suspect.places is not None:
        todo.append("write rotations and positions in the axes of one world")
    return ", ".join(todo)
