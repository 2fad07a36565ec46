"""A map for viewers, over its recording's time: Rerun (``.rrd``) and Foxglove (MCAP), each with its extra."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from avlmaps.core.arrays import Float, Float32, Float64, UInt8
from avlmaps.core.camera import Pinhole
from avlmaps.core.errors import BackendError
from avlmaps.core.extras import install_command
from avlmaps.core.files import replacing
from avlmaps.core.poses import FrameName, inverse, to_quaternion
from avlmaps.core.registry import Kind
from avlmaps.query.export import explain_write_errors, heat_colors

if TYPE_CHECKING:
    from avlmaps.query.avlmap import AVLMap
    from avlmaps.query.contents import SoundEvent


@dataclass(frozen=True, slots=True)
class _Exported:
    name: str
    confidence: float | None  # of the name, in [0, 1]; None where it has none

    @property
    def label(self) -> str:
        """Name and confidence, for a person."""
        return self.name if self.confidence is None else f"{self.name} {self.confidence:.2f}"


@dataclass(frozen=True, slots=True)
class ExportedBox(_Exported):
    """A thing's box, upright in the room."""

    centre: tuple[float, float, float]  # metres
    size: tuple[float, float, float]  # extent along the axes of the level frame, metres
    quaternion: tuple[float, float, float, float]  # x y z w, from the level frame's axes to those of the layers
    color: tuple[int, int, int]  # RGB


@dataclass(frozen=True, slots=True)
class ExportedSound(_Exported):
    """A sound, where the robot was when it heard it; ``sound`` where it has no name."""

    position: tuple[float, float, float]  # metres
    onset_s: float  # start, the recording's time
    offset_s: float  # end


@dataclass(frozen=True, slots=True, eq=False)
class Layers:
    """A map's layers, each in the same frame, metres; times are the recording's, seconds."""

    frame: FrameName  # its name
    points: Float32[np.ndarray, "n 3"]  # middles of the voxels
    colors: UInt8[np.ndarray, "n 3"]  # RGB of each
    voxel_size_m: float  # their edge
    things: tuple[ExportedBox, ...]  # boxes
    sounds: tuple[ExportedSound, ...]  # in the order of their onset
    # Of each voxel in [0, 1], and the question that it answers; None without one.
    heat: tuple[str, Float32[np.ndarray, " n"]] | None
    stamp_s: Float64[np.ndarray, " k"]  # when each keyframe was taken
    frame_from_camera: Float64[np.ndarray, "k 4 4"]  # pose of the colour camera at each keyframe
    camera: Pinhole  # of the stored pictures, which may be smaller than those recorded
    pictures: tuple[bytes, ...] = field(repr=False)  # JPEG file of each keyframe

    @property
    def start_s(self) -> float:
        """The earliest time of anything in it; 0 for a map without pictures and sounds."""
        times = [*self.stamp_s[:1].tolist(), *(sound.onset_s for sound in self.sounds[:1])]
        return min(times, default=0.0)

    def shots(self) -> Iterator[tuple[float, Float64[np.ndarray, "4 4"], bytes]]:
        """Yield time, pose and JPEG of each keyframe, in the order of time."""
        yield from zip(self.stamp_s.tolist(), self.frame_from_camera, self.pictures, strict=True)


def layers_of(
    opened: "AVLMap", frame: FrameName = FrameName.LEVEL, heat: str | None = None, least_confidence: float = 0.5
) -> Layers:
    """Gather what a map shows. ``QueryError``: the question cannot be answered."""
    space = opened.space
    level = space.level_from_recording
    turn = level if frame is FrameName.LEVEL else np.eye(4)
    axes = turn @ inverse(level)

    def placed(points: Float[np.ndarray, "*n 3"]) -> Float64[np.ndarray, "*n 3"]:
        return np.asarray(points, np.float64) @ turn[:3, :3].T + turn[:3, 3]

    qx, qy, qz, qw = (float(value) for value in to_quaternion(axes))
    boxes: list[ExportedBox] = []
    known = opened.has(Kind.PIXELS)  # else it names none, and shows the rest
    for thing in opened.things(least_confidence=least_confidence) if known else []:
        corners = space.level(thing.points)
        middle = (corners.min(axis=0) + corners.max(axis=0)) / 2.0
        x, y, z = (float(value) for value in axes[:3, :3] @ middle + axes[:3, 3])
        boxes.append(ExportedBox(thing.name, thing.confidence, (x, y, z), thing.size, (qx, qy, qz, qw), thing.color))
    warm = None
    if heat is not None and (asked := opened.ask(heat).heat) is not None:
        warm = heat, np.asarray(asked.values, np.float32)
    keyframes, rig = opened.data.keyframes, opened.data.rig
    pictures = tuple(keyframes.jpeg(row).tobytes() for row in range(len(keyframes)))
    sounds = sorted(opened.sounds(), key=lambda one: one.onset_s)
    return Layers(
        frame=frame, points=placed(opened.points).astype(np.float32), colors=np.ascontiguousarray(opened.colors),
        voxel_size_m=float(space.grid.voxel_size_m), things=tuple(boxes), heat=warm, pictures=pictures,
        sounds=tuple(_heard(sound, placed) for sound in sounds), stamp_s=np.array(keyframes.stamp_s, np.float64),
        frame_from_camera=turn @ keyframes.world_from_camera @ inverse(rig.rgb_from_depth),
        camera=_stored_camera(rig.rgb, pictures),
    )  # fmt: skip


def _heard(sound: "SoundEvent", placed: Callable[[np.ndarray], np.ndarray]) -> ExportedSound:
    name, confidence = (sound.names[0], sound.confidences[0]) if sound.names else ("sound", None)
    x, y, z = (float(value) for value in placed(np.array(sound.position)))
    return ExportedSound(name, confidence, (x, y, z), sound.onset_s, sound.offset_s)


def _stored_camera(rgb: Pinhole, pictures: tuple[bytes, ...]) -> Pinhole:
    import cv2

    for picture in pictures:
        decoded = cv2.imdecode(np.frombuffer(picture, np.uint8), cv2.IMREAD_COLOR)
        if decoded is not None:
            return rgb.resized(decoded.shape[1], decoded.shape[0])
    return rgb


TIMELINE = "recording"


def write_rerun(path: Path, layers: Layers) -> Path:
    """Write a map's layers for Rerun. ``BackendError``: rerun-sdk is not installed. ``QueryError``: of the disk."""
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
        things = layers.things
        boxes = rr.Boxes3D(
            centers=[box.centre for box in things], sizes=[box.size for box in things],
            quaternions=[box.quaternion for box in things], labels=[box.label for box in things],
            colors=[box.color for box in things],
        )  # fmt: skip
        stream.log("map/things", boxes, static=True)
    if len(layers.stamp_s):
        stream.log("map/path", rr.LineStrips3D([layers.frame_from_camera[:, :3, 3]]), static=True)


def _log_drive(rr: Any, stream: Any, layers: Layers) -> None:
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


CAMERA_FRAME = "camera"
_SOUND_M = 0.3


def write_foxglove(path: Path, layers: Layers) -> Path:
    """Write a map's layers as MCAP. ``BackendError``: foxglove-sdk is not installed. ``QueryError``: of the disk."""
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
    # Turns layers into messages of one file.

    def __init__(self, channels: Any, messages: Any, context: Any, layers: Layers) -> None:
        self._channels, self._messages, self._context, self._layers = channels, messages, context, layers
        self._frame = str(layers.frame)
        self._open: dict[str, Any] = {}

    def write(self) -> None:
        m, layers = self._messages, self._layers
        still = {"timestamp": self._time(layers.start_s), "frame_id": self._frame}
        self._log("/map", self._cloud(still, layers.colors, None), layers.start_s)
        if layers.heat is not None:
            heat = layers.heat[1]
            self._log("/heat", self._cloud(still, heat_colors(heat), heat), layers.start_s)
        boxes = [self._thing(number, box) for number, box in enumerate(layers.things)]
        self._log("/things", m.SceneUpdate(entities=boxes), layers.start_s)
        path = [self._pose(pose[:3, 3].tolist(), to_quaternion(pose).tolist()) for pose in layers.frame_from_camera]
        self._log("/path", m.PosesInFrame(**still, poses=path), layers.start_s)
        self._write_pictures()
        for number, sound in enumerate(layers.sounds):
            self._log("/sounds", m.SceneUpdate(entities=[self._sound(number, sound)]), sound.onset_s)

    def _log(self, topic: str, message: Any, stamp_s: float) -> None:
        if topic not in self._open:
            kind = getattr(self._channels, f"{type(message).__name__}Channel")
            self._open[topic] = kind(topic, context=self._context)
        self._open[topic].log(message, log_time=_nanoseconds(stamp_s))

    def _time(self, stamp_s: float) -> Any:
        return self._messages.Timestamp(*divmod(_nanoseconds(stamp_s), 1_000_000_000))

    def _pose(self, place: Sequence[float], quaternion: Sequence[float] = (0.0, 0.0, 0.0, 1.0)) -> Any:
        m = self._messages
        return m.Pose(position=m.Vector3(**_named(place)), orientation=m.Quaternion(**_named(quaternion)))

    def _color(self, rgb: Sequence[int], alpha: float) -> Any:
        r, g, b = (value / 255.0 for value in rgb)
        return self._messages.Color(r=r, g=g, b=b, a=alpha)

    def _cloud(
        self, still: dict[str, Any], colors: UInt8[np.ndarray, "n 3"], heat: Float32[np.ndarray, " n"] | None
    ) -> Any:
        m = self._messages
        types = {"<f4": m.PackedElementFieldNumericType.Float32, "u1": m.PackedElementFieldNumericType.Uint8}
        columns = {axis: ("<f4", self._layers.points[:, k]) for k, axis in enumerate("xyz")}
        columns |= {} if heat is None else {"heat": ("<f4", heat)}
        columns |= {name: ("u1", colors[:, k]) for k, name in enumerate(("red", "green", "blue"))}
        rows = np.zeros(
            len(colors), np.dtype([(name, kind) for name, (kind, _) in columns.items()] + [("alpha", "u1")])
        )
        for name, (_, values) in columns.items():
            rows[name] = values
        rows["alpha"] = 255
        fields: Any = rows.dtype.fields
        packed = [
            m.PackedElementField(name=name, offset=int(fields[name][1]), type=types["<f4" if size == 4 else "u1"])
            for name in rows.dtype.names or ()
            for size in (fields[name][0].itemsize,)
        ]
        return m.PointCloud(
            **still, pose=self._pose((0.0, 0.0, 0.0)), point_stride=rows.dtype.itemsize, fields=packed,
            data=rows.tobytes(),
        )  # fmt: skip

    def _entity(
        self, name: str, stamp_s: float, label: str, place: Sequence[float], said: dict[str, str], **shapes: Any
    ) -> Any:
        m, dark = self._messages, self._color((20, 20, 20), 1.0)
        text = m.TextPrimitive(
            pose=self._pose(place), billboard=True, font_size=14.0, scale_invariant=True, color=dark, text=label
        )
        metadata = [m.KeyValuePair(key=key, value=value) for key, value in said.items()]
        at = {"timestamp": self._time(stamp_s), "frame_id": self._frame}
        return m.SceneEntity(**at, id=name, metadata=metadata, texts=[text], **shapes)

    def _thing(self, number: int, box: ExportedBox) -> Any:
        m = self._messages
        cube = m.CubePrimitive(
            pose=self._pose(box.centre, box.quaternion),
            size=m.Vector3(**_named(box.size)),
            color=self._color(box.color, 0.35),
        )
        said = {"name": box.name, "confidence": f"{box.confidence:.3f}"}
        return self._entity(f"thing {number}", self._layers.start_s, box.label, box.centre, said, cubes=[cube])

    def _sound(self, number: int, sound: ExportedSound) -> Any:
        m = self._messages
        ball = m.SpherePrimitive(
            pose=self._pose(sound.position),
            size=m.Vector3(x=_SOUND_M, y=_SOUND_M, z=_SOUND_M),
            color=self._color((230, 120, 30), 0.8),
        )
        confidence = {} if sound.confidence is None else {"confidence": f"{sound.confidence:.3f}"}
        said = {"name": sound.name, **confidence, "ends_s": f"{sound.offset_s:.3f}"}
        return self._entity(f"sound {number}", sound.onset_s, sound.label, sound.position, said, spheres=[ball])

    def _write_pictures(self) -> None:
        m, camera = self._messages, self._layers.camera
        k = [camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0]
        calibrated = {"width": camera.width, "height": camera.height, "distortion_model": "plumb_bob", "D": [0.0] * 5,
                      "K": k, "R": np.eye(3).ravel().tolist(),
                      "P": [*k[:3], 0.0, *k[3:6], 0.0, *k[6:], 0.0]}  # fmt: skip
        for stamp_s, pose, picture in self._layers.shots():
            at = {"timestamp": self._time(stamp_s), "frame_id": CAMERA_FRAME}
            transform = m.FrameTransform(
                timestamp=self._time(stamp_s), parent_frame_id=self._frame, child_frame_id=CAMERA_FRAME,
                translation=m.Vector3(**_named(pose[:3, 3].tolist())),
                rotation=m.Quaternion(**_named(to_quaternion(pose).tolist())),
            )  # fmt: skip
            self._log("/tf", transform, stamp_s)
            if picture:
                self._log("/camera_info", m.CameraCalibration(**at, **calibrated), stamp_s)
                self._log("/camera", m.CompressedImage(**at, data=picture, format="jpeg"), stamp_s)


def _named(values: Sequence[float]) -> dict[str, float]:
    return dict(zip("xyzw", map(float, values), strict=False))


def _nanoseconds(stamp_s: float) -> int:
    return max(0, round(stamp_s * 1e9))
