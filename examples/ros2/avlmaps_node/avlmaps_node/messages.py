"""A map as messages of ROS 2, in the robot's frame."""
# pyright: reportMissingImports=false

from collections.abc import Iterator, Sequence
from math import cos, sin
from types import SimpleNamespace
from typing import Any

import numpy as np
from geometry_msgs.msg import Point, Pose, PoseStamped, Quaternion, Vector3
from jaxtyping import Float, Float32, UInt8
from nav_msgs.msg import OccupancyGrid
from sensor_msgs.msg import CameraInfo, Image, PointCloud2, PointField
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

from avlmaps.core.camera import Pinhole
from avlmaps.core.poses import to_quaternion
from avlmaps.maps.obstacles import CellState, Obstacles
from avlmaps.query.answer import Answer
from avlmaps.query.contents import Contents, Thing
from avlmaps.query.export import palette
from avlmaps.recordings.formats.ros_messages import camera_of as calibrated
from avlmaps.recordings.formats.ros_messages import colour_of
from avlmaps_ros import GroundTransform

_POINT = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("rgb", "<u4")])
_HOT = np.dtype([*_POINT.descr, ("intensity", "<f4")])
_GRID = {CellState.UNKNOWN: -1, CellState.FREE: 0, CellState.OCCUPIED: 100}


class Placing:
    """How the map's world lies in the robot's fixed frame.

    Attributes:
        header: names that frame.
        robot_from_world: 4x4.
    """

    def __init__(
        self, frame_id: str, map_from_avlmap: GroundTransform, level_from_world: Float[np.ndarray, "3 3"]
    ) -> None:
        self.header = Header(frame_id=frame_id)
        self._turn = map_from_avlmap
        c, s = cos(map_from_avlmap.yaw_rad), sin(map_from_avlmap.yaw_rad)
        self.robot_from_level = np.eye(4)
        self.robot_from_level[:2, :2] = [[c, -s], [s, c]]
        self.robot_from_level[:2, 3] = map_from_avlmap.x_m, map_from_avlmap.y_m
        level = np.eye(4)
        level[:3, :3] = level_from_world
        self.robot_from_world = self.robot_from_level @ level

    def points(self, world: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n 3"]:
        """Take points of the map's world to the robot's frame."""
        return np.asarray(world, np.float64) @ self.robot_from_world[:3, :3].T + self.robot_from_world[:3, 3]

    def point(self, world: Sequence[float]) -> Point:
        """Take one point there."""
        x, y, z = (float(value) for value in self.points(np.asarray(world, np.float64)))
        return Point(x=x, y=y, z=z)

    @property
    def turned(self) -> Quaternion:
        """The direction of the level frame's axes, along which sizes are measured."""
        half = 0.5 * self._turn.yaw_rad
        return Quaternion(z=sin(half), w=cos(half))

    def camera_pose(self, world_from_camera: Float[np.ndarray, "4 4"]) -> PoseStamped:
        """Take the pose of a camera there."""
        matrix = self.robot_from_world @ world_from_camera
        x, y, z, w = (float(value) for value in to_quaternion(matrix))
        place = Point(x=float(matrix[0, 3]), y=float(matrix[1, 3]), z=float(matrix[2, 3]))
        return PoseStamped(header=self.header, pose=Pose(position=place, orientation=Quaternion(x=x, y=y, z=z, w=w)))


def blocks_of(points: Float[np.ndarray, "n 3"], edge_m: float, most: int) -> Iterator[np.ndarray]:
    """Return the rows of the points that lie in one cube of space, cube after cube, at most so many at once."""
    cube = np.floor(points / edge_m).astype(np.int64)
    order = np.lexsort(cube.T)
    changes = np.flatnonzero((np.diff(cube[order], axis=0) != 0).any(axis=1)) + 1
    for rows in np.split(order, changes):
        for start in range(0, len(rows), most):
            yield rows[start : start + most]


def cloud(
    header: Header,
    points: Float[np.ndarray, "n 3"],
    colors: UInt8[np.ndarray, "n 3"],
    heat: Float32[np.ndarray, " n"] | None = None,
) -> PointCloud2:
    """Return points of the robot's frame as a cloud with colours, and heat as ``intensity`` where it is given."""
    content = np.zeros(len(points), _POINT if heat is None else _HOT)
    content["x"], content["y"], content["z"] = np.asarray(points, np.float32).T
    red, green, blue = np.asarray(colors, np.uint32).T
    content["rgb"] = red << 16 | green << 8 | blue
    if heat is not None:
        content["intensity"] = heat
    fields = [
        PointField(name=name, offset=int(content.dtype.fields[name][1]), datatype=PointField.FLOAT32, count=1)
        for name in content.dtype.names
    ]
    size = content.dtype.itemsize
    message = PointCloud2(
        header=header, height=1, width=len(points), fields=fields, point_step=size, row_step=size * len(points),
        is_dense=True,
    )  # fmt: skip
    message.data.frombytes(content.tobytes())
    return message


def occupancy(placing: Placing, obstacles: Obstacles) -> OccupancyGrid:
    """Return where a body can stand, as a grid whose cells lie along the axes of the map's level frame."""
    states = np.full(obstacles.states.shape, -1, np.int8)
    for state, value in _GRID.items():
        states[obstacles.states == state] = value
    message = OccupancyGrid(header=placing.header)
    info = message.info
    info.resolution = float(obstacles.cell_size_m)
    info.width, info.height = (int(count) for count in states.shape)
    corner = placing.robot_from_level @ np.array([*obstacles.origin_m, obstacles.floor_m, 1.0])
    info.origin.position = Point(x=float(corner[0]), y=float(corner[1]), z=float(corner[2]))
    info.origin.orientation = placing.turned
    message.data.frombytes(np.ascontiguousarray(states.T).tobytes())
    return message


def _marker(placing: Placing, kind: str, number: int, shape: int, at: Point, color: Sequence[float]) -> Marker:
    red, green, blue, alpha = (float(value) for value in color)
    return Marker(
        header=placing.header, ns=kind, id=number, type=shape, action=Marker.ADD,
        pose=Pose(position=at, orientation=placing.turned), color=ColorRGBA(r=red, g=green, b=blue, a=alpha),
    )  # fmt: skip


def _label(placing: Placing, kind: str, number: int, at: Point, text: str, size_m: float = 0.15) -> Marker:
    marker = _marker(placing, f"{kind} names", number, Marker.TEXT_VIEW_FACING, at, (1.0, 1.0, 1.0, 1.0))
    marker.text, marker.scale.z = text, size_m
    return marker


def contents_markers(placing: Placing, contents: Contents) -> MarkerArray:
    """Return boxes of things, names of rooms, and where sounds were recorded."""
    markers = [Marker(action=Marker.DELETEALL)]
    names = sorted({thing.name for thing in contents.things})
    shades = palette(len(names)) / 255.0
    level = placing.robot_from_level
    for number, thing in enumerate(contents.things):
        points = placing.points(thing.points) @ level[:3, :3] if len(thing.points) else np.zeros((1, 3))
        middle = level[:3, :3] @ (0.5 * (points.min(axis=0) + points.max(axis=0)))
        at = Point(x=float(middle[0]), y=float(middle[1]), z=float(middle[2]))
        box = _marker(placing, "things", number, Marker.CUBE, at, (*shades[names.index(thing.name)], 0.4))
        box.scale = _vector(thing.size)
        top = Point(x=at.x, y=at.y, z=at.z + 0.5 * thing.size[2] + 0.1)
        markers += [box, _label(placing, "things", number, top, f"{thing.name} {thing.confidence:.0%}")]
    for number, room in enumerate(contents.rooms):
        at = placing.point(room.position)
        markers.append(_label(placing, "rooms", number, Point(x=at.x, y=at.y, z=at.z + 1.5), room.name, 0.4))
    for number, sound in enumerate(contents.sounds):
        at = placing.point(sound.position)
        ball = _marker(placing, "sounds", number, Marker.SPHERE, at, (0.2, 0.6, 1.0, 0.7))
        ball.scale = Vector3(x=0.3, y=0.3, z=0.3)
        name = sound.names[0] if sound.names else "sound"
        markers += [ball, _label(placing, "sounds", number, Point(x=at.x, y=at.y, z=at.z + 0.3), name)]
    return MarkerArray(markers=markers)


def goal_markers(placing: Placing, question: str, answer: Answer) -> MarkerArray:
    """Return the places that answer a question, green where it was found, and the question over the first."""
    markers = [Marker(action=Marker.DELETEALL)]
    color = (0.1, 0.9, 0.2, 0.8) if answer.found else (0.9, 0.7, 0.1, 0.8)
    for number, goal in enumerate(answer.goals):
        at = placing.point(goal.position)
        ball = _marker(placing, "goals", number, Marker.SPHERE, at, color)
        ball.scale = Vector3(x=0.25, y=0.25, z=0.25)
        words = f"{number + 1}: {goal.score:.2f}" + (f" {question}" if number == 0 else "")
        markers += [ball, _label(placing, "goals", number, Point(x=at.x, y=at.y, z=at.z + 0.4), words)]
    return MarkerArray(markers=markers)


def _vector(values: Sequence[float]) -> Vector3:
    x, y, z = (float(value) for value in values)
    return Vector3(x=x, y=y, z=z)


def place_message(kind: Any, placing: Placing, goal: Any) -> Any:
    """Return a goal as a Place."""
    return kind(position=placing.point(goal.position), score=float(goal.score), size=_vector(goal.size))


def thing_message(kind: Any, placing: Placing, thing: Thing) -> Any:
    """Return a thing as a Thing."""
    return kind(
        name=thing.name, confidence=float(thing.confidence), position=placing.point(thing.position),
        size=_vector(thing.size),
    )  # fmt: skip


def picture_of(image: Image) -> UInt8[np.ndarray, "h w 3"]:
    """Return the colours of a picture.

    Raises:
        RecordingError: its encoding is not one of a colour picture, or its bytes are cut short.
    """
    seen = SimpleNamespace(
        __msgtype__="sensor_msgs/msg/Image", encoding=image.encoding, height=image.height, width=image.width,
        step=image.step, data=np.frombuffer(image.data, np.uint8), is_bigendian=image.is_bigendian,
    )  # fmt: skip
    return colour_of(seen, "of the request")


def camera_of(info: CameraInfo) -> Pinhole | None:
    """Return the camera of a calibration; None where there is none.

    Raises:
        RecordingError: it is of no camera.
    """
    return calibrated(info, "of the request")[0] if any(info.k) else None
