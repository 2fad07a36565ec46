"""Polycam's raw export (an iPhone or iPad with LiDAR): ``keyframes/`` with images, depth and cameras.

Facts of the data (nerfstudio's converter; Polycam's page on raw data): ``cameras/N.json`` has ``fx fy cx cy width
height`` and ``t_00`` to ``t_23``, the rows of a camera-to-world matrix in ARKit's axes (camera: y up, looking along
-z; world: y up). ``corrected_cameras/`` and ``corrected_images/`` are what remains after Polycam's own bundle
adjustment, and go before. Depth is in 16-bit millimetres, and where ``confidence/`` is 0 it is left out.
"""

from pathlib import Path

import msgspec
import numpy as np
from jaxtyping import Float

from avlmaps.core.camera import Rig
from avlmaps.core.errors import RecordingError
from avlmaps.core.files import DESCRIPTION_BYTES
from avlmaps.recordings.camera_axes import UP_IN_WORLD, from_opengl
from avlmaps.recordings.faults import Fault, Report, stop_at_first
from avlmaps.recordings.formats.file_recording import FileRecording, Shots, list_names
from avlmaps.recordings.formats.intrinsics import fitted, median_camera, resized_notice
from avlmaps.recordings.formats.json_files import read_json, unread_notice
from avlmaps.recordings.formats.nerfstudio import INTERVAL_S
from avlmaps.recordings.images import first_picture_size

# What the app writes beside; it says nothing about how the pictures are read.
_IDLE = (
    "t_30", "t_31", "t_32", "t_33", "blur_score", "center_depth", "neighbors", "angular_velocity", "manual_keyframe",
)  # fmt: skip
_UNITS_S = (1.0, 1e-3, 1e-6, 1e-9)
# Keyframes of a scan follow one another at such a pace, by which the unit of their stamps is known.
_LEAST_INTERVAL_S, _MOST_INTERVAL_S = 0.02, 20.0


class _Camera(msgspec.Struct, frozen=True):
    fx: float
    fy: float
    cx: float
    cy: float
    width: int
    height: int
    t_00: float
    t_01: float
    t_02: float
    t_03: float
    t_10: float
    t_11: float
    t_12: float
    t_13: float
    t_20: float
    t_21: float
    t_22: float
    t_23: float
    timestamp: float | None = None


def keyframes_of(path: Path) -> Path:
    """Return the folder that holds the keyframes: the export's ``keyframes/``, or the folder itself."""
    return path / "keyframes" if (path / "keyframes").is_dir() else path


def is_polycam(path: Path) -> bool:
    """Return whether a folder is a raw export."""
    frames = keyframes_of(path)
    return (frames / "cameras").is_dir() and (frames / "images").is_dir()


def open_polycam(path: Path, report: Report = stop_at_first) -> FileRecording:
    """Open a raw export in place.

    Args:
        path: the export, or its ``keyframes/``.
        report: called with every fault.

    Raises:
        RecordingError: no frame is complete, or a camera is damaged.
    """
    frames = keyframes_of(path)
    below = "keyframes/" if frames != path else ""
    mended = all((frames / f"corrected_{kind}").is_dir() for kind in ("cameras", "images"))
    cameras, images = ("corrected_cameras", "corrected_images") if mended else ("cameras", "images")
    colour = _by_stem(frames / images, (".jpg", ".jpeg", ".png"))
    depth, described = _by_stem(frames / "depth", (".png",)), _by_stem(frames / cameras, (".json",))
    names = [stem for stem in described if stem in colour and stem in depth]
    if not names:
        raise RecordingError(f"{frames} holds no frame with all of {images}/N.jpg, depth/N.png and {cameras}/N.json.")
    partial = len((colour.keys() | depth.keys() | described.keys()) - set(names))
    notices = [f"{partial} frame(s) lack one of colour, depth and camera and are left out."] if partial else []
    for sentence in notices:
        report(Fault(f"{path}: {sentence}", path, fatal=False))
    files = [frames / cameras / described[stem] for stem in names]
    read = [read_json(file, _Camera, DESCRIPTION_BYTES) for file in files]
    found = [camera for camera, _ in read]
    present = {key: None for _, plain in read for key in plain}
    notices += unread_notice(files[0], present, (*_Camera.__struct_fields__, *_IDLE), strict=False)
    sure = _by_stem(frames / "confidence", (".png",)) if (frames / "confidence").is_dir() else {}
    shots = Shots(
        names=names,
        colour=[f"{below}{images}/{colour[stem]}" for stem in names],
        depth=[f"{below}depth/{depth[stem]}" for stem in names],
        stamps_s=_stamps(found, names, notices),
        world_from_camera=from_opengl(np.stack([_matrix(camera) for camera in found])),
        confidence=[f"{below}confidence/{sure[s]}" for s in names] if all(s in sure for s in names) else (),
    )
    numbers = np.array([(c.fx, c.fy, c.cx, c.cy) for c in found])
    camera, more = median_camera(files[0], numbers, found[0].width, found[0].height)
    rgb_size, depth_size = first_picture_size(path, shots.colour), first_picture_size(path, shots.depth)
    rig = Rig(fitted(camera, rgb_size, files[0], "colour"), fitted(camera, depth_size, files[0], "depth"))
    return FileRecording.settled(
        path, "polycam", rig, shots, (*notices, *more, *resized_notice(camera, rgb_size)), report, files.__getitem__,
        up_in_world=UP_IN_WORLD.copy(),
    )  # fmt: skip


def _by_stem(folder: Path, suffixes: tuple[str, ...]) -> dict[str, str]:
    return {name.split(".", 1)[0]: name for name in list_names(folder, suffixes)}


def _matrix(c: _Camera) -> Float[np.ndarray, "4 4"]:
    return np.array([
        [c.t_00, c.t_01, c.t_02, c.t_03],
        [c.t_10, c.t_11, c.t_12, c.t_13],
        [c.t_20, c.t_21, c.t_22, c.t_23],
        [0.0, 0.0, 0.0, 1.0],
    ])  # fmt: skip


def _stamps(cameras: list[_Camera], names: list[str], notices: list[str]) -> Float[np.ndarray, " n"]:
    """Return seconds from the first frame, by the cameras' timestamps, else by names that are such, else by count."""
    for stamps in ([c.timestamp for c in cameras], [float(n) if n.isascii() and n.isdigit() else None for n in names]):
        known = np.array([stamp for stamp in stamps if stamp is not None], np.float64)
        interval = float(np.median(np.diff(known))) if len(known) == len(cameras) > 1 else 0.0
        unit_s = next((u for u in _UNITS_S if _LEAST_INTERVAL_S <= interval * u <= _MOST_INTERVAL_S), None)
        if unit_s is not None and (
            unit_s < 1.0 or np.any(known % 1.0 != 0.0)
        ):  # whole numbers that only count are none
            return (known - known[0]) * unit_s
    notices.append("The scan has no clock; its frames are taken to be one second apart.")
    return np.arange(len(cameras)) * INTERVAL_S
