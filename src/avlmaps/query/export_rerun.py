"""A map as a file of Rerun (``.rrd``), which its viewer shows over the recording's time.

Needs the extra ``rerun``. Entities: ``map/points``, ``map/heat``, ``map/things``, ``map/path``, ``map/sounds``, and
``map/camera`` with its picture; the timeline ``recording`` counts seconds of the recording.
"""

from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from avlmaps.core.errors import BackendError
from avlmaps.core.extras import install_command
from avlmaps.core.files import replacing
from avlmaps.core.frames import FrameName
from avlmaps.core.poses import to_quaternion
from avlmaps.query.export import explain_write_errors, heat_colors
from avlmaps.query.export_layers import Layers

TIMELINE = "recording"


def write_rerun(path: Path, layers: Layers) -> Path:
    """Write a map's layers for Rerun.

    Raises:
        BackendError: rerun-sdk is not installed.
        QueryError: the file cannot be written.
    """
    try:
        rr: Any = import_module("rerun")
    except ImportError as fault:
        raise BackendError(f"A .rrd file needs the package rerun-sdk; {install_command('rerun')}.") from fault
    with explain_write_errors(path), replacing(path) as part, rr.RecordingStream("avlmaps") as stream:
        stream.save(part)
        _log_still(rr, stream, layers)
        _log_drive(rr, stream, layers)
        stream.flush()
        stream.disconnect()
    return path


def _log_still(rr: Any, stream: Any, layers: Layers) -> None:
    """Log what holds at any time."""
    if layers.frame is FrameName.LEVEL:
        stream.log("map", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    radius = layers.voxel_size_m / 2.0
    stream.log("map/points", rr.Points3D(layers.points, colors=layers.colors, radii=radius), static=True)
    if layers.heat is not None:
        question, heat = layers.heat
        shown = heat > 0.0
        points = rr.Points3D(layers.points[shown], colors=heat_colors(heat[shown]), radii=1.2 * radius)
        stream.log("map/heat", points, rr.AnyValues(question=question, heat=heat[shown]), static=True)
    if layers.things:
        stream.log(
            "map/things",
            rr.Boxes3D(
                centers=[box.centre for box in layers.things],
                sizes=[box.size for box in layers.things],
                quaternions=[box.quaternion for box in layers.things],
                labels=[box.label for box in layers.things],
                colors=[box.color for box in layers.things],
            ),
            static=True,
        )
    if len(layers.stamp_s):
        stream.log("map/path", rr.LineStrips3D([layers.frame_from_camera[:, :3, 3]]), static=True)


def _log_drive(rr: Any, stream: Any, layers: Layers) -> None:
    """Log what happened, at its time."""
    camera = layers.camera
    pinhole = rr.Pinhole(
        focal_length=(camera.fx, camera.fy),
        principal_point=(camera.cx, camera.cy),
        resolution=(camera.width, camera.height),
    )
    if layers.pictures:
        stream.log("map/camera", pinhole, static=True)
    for stamp_s, pose, picture in layers.shots():
        stream.set_time(TIMELINE, duration=stamp_s)
        stream.log("map/camera", rr.Transform3D(translation=pose[:3, 3], quaternion=to_quaternion(pose)))
        if picture:
            stream.log("map/camera/picture", rr.EncodedImage(contents=picture, media_type="image/jpeg"))
    for sound in layers.sounds:
        stream.set_time(TIMELINE, duration=sound.onset_s)
        place = rr.Points3D(np.array([sound.position]), radii=0.15, colors=[(230, 120, 30)], labels=[sound.label])
        stream.log("map/sounds", place, rr.AnyValues(ends_s=sound.offset_s))
