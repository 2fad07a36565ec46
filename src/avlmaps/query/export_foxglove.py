"""A map as an MCAP file with Foxglove's schemas (protobuf), for Foxglove and everything else that reads MCAP.

Needs the extra ``foxglove``. Topics: ``/map``, ``/heat`` (PointCloud), ``/things``, ``/sounds`` (SceneUpdate),
``/path`` (PosesInFrame), ``/tf`` (FrameTransform), ``/camera`` (CompressedImage), ``/camera_info``
(CameraCalibration). What holds at any time is logged at the first instant; pictures, poses and sounds at theirs.
"""

from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from avlmaps.core.arrays import Float32, UInt8
from avlmaps.core.errors import BackendError
from avlmaps.core.extras import install_command
from avlmaps.core.files import replacing
from avlmaps.core.poses import to_quaternion
from avlmaps.query.export import explain_write_errors, heat_colors
from avlmaps.query.export_layers import ExportedSound, Layers

CAMERA_FRAME = "camera"
_SOUND_M = 0.3


def write_foxglove(path: Path, layers: Layers) -> Path:
    """Write a map's layers as MCAP.

    Raises:
        BackendError: foxglove-sdk is not installed.
        QueryError: the file cannot be written.
    """
    try:
        foxglove: Any = import_module("foxglove")
        channels, messages = (import_module(f"foxglove.{name}") for name in ("channels", "messages"))
    except ImportError as fault:
        raise BackendError(f"An .mcap file needs the package foxglove-sdk; {install_command('foxglove')}.") from fault
    context = foxglove.Context()
    with (
        explain_write_errors(path),
        replacing(path) as part,
        foxglove.open_mcap(part, allow_overwrite=True, context=context),
    ):
        _Writer(channels, messages, context, layers).write()
    return path


class _Writer:
    """Turns layers into messages of one file."""

    def __init__(self, channels: Any, messages: Any, context: Any, layers: Layers) -> None:
        self._channels, self._messages, self._context, self._layers = channels, messages, context, layers
        self._frame = str(layers.frame)
        self._open: dict[str, Any] = {}

    def write(self) -> None:
        layers, start_s = self._layers, self._layers.start_s
        self._log("/map", self._cloud(layers.colors, None), start_s)
        if layers.heat is not None:
            heat = layers.heat[1]
            self._log("/heat", self._cloud(heat_colors(heat), heat), start_s)
        self._log("/things", self._messages.SceneUpdate(entities=self._boxes()), start_s)
        self._log("/path", self._path(), start_s)
        self._write_pictures()
        for number, sound in enumerate(layers.sounds):
            self._log("/sounds", self._messages.SceneUpdate(entities=[self._sound(number, sound)]), sound.onset_s)

    def _log(self, topic: str, message: Any, stamp_s: float) -> None:
        channel = self._open.get(topic)
        if channel is None:
            kind = getattr(self._channels, f"{type(message).__name__}Channel")
            channel = self._open[topic] = kind(topic, context=self._context)
        channel.log(message, log_time=_nanoseconds(stamp_s))

    def _time(self, stamp_s: float) -> Any:
        seconds, nanoseconds = divmod(_nanoseconds(stamp_s), 1_000_000_000)
        return self._messages.Timestamp(seconds, nanoseconds)

    def _pose(self, place: Sequence[float], quaternion: Sequence[float] = (0.0, 0.0, 0.0, 1.0)) -> Any:
        m = self._messages
        return m.Pose(position=m.Vector3(**_named(place)), orientation=m.Quaternion(**_named(quaternion)))

    def _color(self, rgb: Sequence[int], alpha: float) -> Any:
        r, g, b = (value / 255.0 for value in rgb)
        return self._messages.Color(r=r, g=g, b=b, a=alpha)

    def _cloud(self, colors: UInt8[np.ndarray, "n 3"], heat: Float32[np.ndarray, " n"] | None) -> Any:
        """Return the voxels as points with a colour, and the heat where there is one."""
        types = self._messages.PackedElementFieldNumericType
        numbers = {"<f4": types.Float32, "u1": types.Uint8}
        kinds = [(axis, "<f4") for axis in "xyz"] + [("heat", "<f4")] * (heat is not None)
        kinds += [(name, "u1") for name in ("red", "green", "blue", "alpha")]
        rows = np.zeros(len(colors), np.dtype(kinds))
        for k, axis in enumerate("xyz"):
            rows[axis] = self._layers.points[:, k]
        for k, name in enumerate(("red", "green", "blue")):
            rows[name] = colors[:, k]
        rows["alpha"] = 255
        if heat is not None:
            rows["heat"] = heat
        offsets = np.cumsum([0, *(np.dtype(kind).itemsize for _, kind in kinds)])
        return self._messages.PointCloud(
            timestamp=self._time(self._layers.start_s),
            frame_id=self._frame,
            pose=self._pose((0.0, 0.0, 0.0)),
            point_stride=rows.dtype.itemsize,
            fields=[
                self._messages.PackedElementField(name=name, offset=int(offset), type=numbers[kind])
                for (name, kind), offset in zip(kinds, offsets, strict=False)
            ],
            data=rows.tobytes(),
        )

    def _boxes(self) -> list[Any]:
        m = self._messages
        return [
            m.SceneEntity(
                timestamp=self._time(self._layers.start_s),
                frame_id=self._frame,
                id=f"thing {number}",
                metadata=[
                    m.KeyValuePair(key="name", value=box.name),
                    m.KeyValuePair(key="confidence", value=f"{box.confidence:.3f}"),
                ],
                cubes=[
                    m.CubePrimitive(
                        pose=self._pose(box.centre, box.quaternion),
                        size=m.Vector3(**_named(box.size)),
                        color=self._color(box.color, 0.35),
                    )
                ],
                texts=[self._text(box.label, box.centre)],
            )
            for number, box in enumerate(self._layers.things)
        ]

    def _text(self, label: str, place: Sequence[float]) -> Any:
        dark = self._color((20, 20, 20), 1.0)
        pose = self._pose(place)
        return self._messages.TextPrimitive(
            pose=pose, billboard=True, font_size=14.0, scale_invariant=True, color=dark, text=label
        )

    def _sound(self, number: int, sound: ExportedSound) -> Any:
        m = self._messages
        ball = m.SpherePrimitive(
            pose=self._pose(sound.position),
            size=m.Vector3(x=_SOUND_M, y=_SOUND_M, z=_SOUND_M),
            color=self._color((230, 120, 30), 0.8),
        )
        known = sound.confidence is not None
        confidence = [m.KeyValuePair(key="confidence", value=f"{sound.confidence:.3f}")] if known else []
        return m.SceneEntity(
            timestamp=self._time(sound.onset_s),
            frame_id=self._frame,
            id=f"sound {number}",
            metadata=[
                m.KeyValuePair(key="name", value=sound.name),
                *confidence,
                m.KeyValuePair(key="ends_s", value=f"{sound.offset_s:.3f}"),
            ],
            spheres=[ball],
            texts=[self._text(sound.label, sound.position)],
        )

    def _path(self) -> Any:
        poses = self._layers.frame_from_camera
        return self._messages.PosesInFrame(
            timestamp=self._time(self._layers.start_s),
            frame_id=self._frame,
            poses=[self._pose(p[:3, 3].tolist(), to_quaternion(p).tolist()) for p in poses],
        )

    def _write_pictures(self) -> None:
        m, camera = self._messages, self._layers.camera
        k = [camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0]
        for stamp_s, pose, picture in self._layers.shots():
            at = self._time(stamp_s)
            transform = m.FrameTransform(
                timestamp=at,
                parent_frame_id=self._frame,
                child_frame_id=CAMERA_FRAME,
                translation=m.Vector3(**_named(pose[:3, 3].tolist())),
                rotation=m.Quaternion(**_named(to_quaternion(pose).tolist())),
            )
            self._log("/tf", transform, stamp_s)
            if not picture:
                continue
            calibration = m.CameraCalibration(
                timestamp=at,
                frame_id=CAMERA_FRAME,
                width=camera.width,
                height=camera.height,
                distortion_model="plumb_bob",
                D=[0.0] * 5,
                K=k,
                R=np.eye(3).ravel().tolist(),
                P=[*k[:3], 0.0, *k[3:6], 0.0, *k[6:], 0.0],
            )
            self._log("/camera_info", calibration, stamp_s)
            image = m.CompressedImage(timestamp=at, frame_id=CAMERA_FRAME, data=picture, format="jpeg")
            self._log("/camera", image, stamp_s)


def _named(values: Sequence[float]) -> dict[str, float]:
    return dict(zip("xyzw", map(float, values), strict=False))


def _nanoseconds(stamp_s: float) -> int:
    return max(0, round(stamp_s * 1e9))
