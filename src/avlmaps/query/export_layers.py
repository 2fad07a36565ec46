"""What a map shows in another program: points, things, sounds, heat, the path and the pictures, in one frame."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from avlmaps.core.arrays import Float, Float32, Float64, UInt8
from avlmaps.core.camera import Pinhole
from avlmaps.core.frames import FrameName
from avlmaps.core.poses import inverse, to_quaternion

if TYPE_CHECKING:
    from avlmaps.query.avlmap import AVLMap
    from avlmaps.query.contents import SoundEvent


@dataclass(frozen=True, slots=True)
class ExportedBox:
    """A thing's box, upright in the room.

    Attributes:
        name: of the thing.
        confidence: that it is one, in [0, 1].
        centre: metres.
        size: extent along the axes of the level frame, metres.
        quaternion: x y z w, from the level frame's axes to those of the layers.
        color: RGB.
    """

    name: str
    confidence: float
    centre: tuple[float, float, float]
    size: tuple[float, float, float]
    quaternion: tuple[float, float, float, float]
    color: tuple[int, int, int]

    @property
    def label(self) -> str:
        """Name and confidence, for a person."""
        return f"{self.name} {self.confidence:.2f}"


@dataclass(frozen=True, slots=True)
class ExportedSound:
    """A sound, where the robot was when it heard it.

    Attributes:
        name: the likeliest one; ``sound`` where it has none.
        confidence: of the name, in [0, 1]; None where it has none.
        position: metres.
        onset_s: start, the recording's time.
        offset_s: end.
    """

    name: str
    confidence: float | None
    position: tuple[float, float, float]
    onset_s: float
    offset_s: float

    @property
    def label(self) -> str:
        """Name and confidence, for a person."""
        return self.name if self.confidence is None else f"{self.name} {self.confidence:.2f}"


@dataclass(frozen=True, slots=True, eq=False)
class Layers:
    """A map's layers, each in the same frame, metres; times are the recording's, seconds.

    Attributes:
        frame: its name.
        points: middles of the voxels.
        colors: RGB of each.
        voxel_size_m: their edge.
        things: boxes.
        sounds: in the order of their onset.
        heat: of each voxel in [0, 1], and the question that it answers; None without one.
        stamp_s: when each keyframe was taken.
        frame_from_camera: pose of the colour camera at each keyframe.
        camera: of the stored pictures, which may be smaller than those recorded.
        pictures: JPEG file of each keyframe.
    """

    frame: FrameName
    points: Float32[np.ndarray, "n 3"]
    colors: UInt8[np.ndarray, "n 3"]
    voxel_size_m: float
    things: tuple[ExportedBox, ...]
    sounds: tuple[ExportedSound, ...]
    heat: tuple[str, Float32[np.ndarray, " n"]] | None
    stamp_s: Float64[np.ndarray, " k"]
    frame_from_camera: Float64[np.ndarray, "k 4 4"]
    camera: Pinhole
    pictures: tuple[bytes, ...] = field(repr=False)

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
    """Gather what a map shows.

    Raises:
        QueryError: the question cannot be answered.
    """
    space, stored = opened.space, opened.stored
    level = space.level_from_recording
    turn = level if frame is FrameName.LEVEL else np.eye(4)
    axes = turn @ inverse(level)

    def placed(points: Float[np.ndarray, "*n 3"]) -> Float64[np.ndarray, "*n 3"]:
        return np.asarray(points, np.float64) @ turn[:3, :3].T + turn[:3, 3]

    qx, qy, qz, qw = (float(value) for value in to_quaternion(axes))
    boxes: list[ExportedBox] = []
    known = "pixels" in stored.info.models  # else it names none, and shows the rest
    for thing in opened.things(least_confidence=least_confidence) if known else []:
        corners = space.level(thing.points)
        middle = (corners.min(axis=0) + corners.max(axis=0)) / 2.0
        x, y, z = (float(value) for value in axes[:3, :3] @ middle + axes[:3, 3])
        boxes.append(ExportedBox(thing.name, thing.confidence, (x, y, z), thing.size, (qx, qy, qz, qw), thing.color))
    warm = None
    if heat is not None and (asked := opened.ask(heat).heat) is not None:
        warm = heat, np.asarray(asked.values, np.float32)
    keyframes, rig = stored.keyframes, stored.rig
    pictures = tuple(keyframes.jpeg(row).tobytes() for row in range(len(keyframes)))
    return Layers(
        frame=frame,
        points=placed(opened.points).astype(np.float32),
        colors=np.ascontiguousarray(opened.colors),
        voxel_size_m=float(space.grid.voxel_size_m),
        things=tuple(boxes),
        sounds=tuple(_heard(sound, placed) for sound in sorted(opened.sounds(), key=lambda one: one.onset_s)),
        heat=warm,
        stamp_s=np.array(keyframes.stamp_s, np.float64),
        frame_from_camera=turn @ keyframes.world_from_camera @ inverse(rig.rgb_from_depth),
        camera=_stored_camera(rig.rgb, pictures),
        pictures=pictures,
    )


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
