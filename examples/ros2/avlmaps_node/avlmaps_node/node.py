"""The node: opens one map, publishes it, answers questions about it."""
# pyright: reportMissingImports=false

import signal
import threading
from pathlib import Path
from typing import Any

import numpy as np
import rclpy
from avlmaps_msgs.msg import Place, Thing
from avlmaps_msgs.srv import Ask, Locate, Things
from nav_msgs.msg import OccupancyGrid
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import PointCloud2
from visualization_msgs.msg import MarkerArray

from avlmaps.core.errors import AvlmapsError
from avlmaps.navigate.costmap import SHAPES, obstacles_for
from avlmaps.query.answer import Answer
from avlmaps.query.avlmap import AVLMap
from avlmaps.query.export import heat_colors
from avlmaps_node import messages
from avlmaps_ros import Frames

_MOST_BLOCKS = 10_000
_LEAST_HEAT = 0.05


def _latched(depth: int = 1) -> QoSProfile:
    """Return the quality of service of what late subscribers get as well."""
    return QoSProfile(depth=depth, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class MapNode(Node):
    """Publishes a map once, for late subscribers too, and the heat of the last question; answers three services."""

    def __init__(self, **settings: Any) -> None:
        """Open the map.

        Raises:
            AvlmapsError: a parameter names no map, or a file that cannot be read.
        """
        super().__init__("avlmaps", **settings)
        path = self.declare_parameter("map", "").value
        robot = self.declare_parameter("robot_file", "").value
        block_m = self.declare_parameter("block_m", 4.0).value
        most = self.declare_parameter("most_points", 100_000).value
        least = self.declare_parameter("least_confidence", 0.5).value
        body = self.declare_parameter("body", "base").value
        if not path:
            raise AvlmapsError("The parameter map is empty; give it the folder of a map: -p map:=office.avlmap.")
        if body not in SHAPES or not 0.1 <= block_m <= 1000.0 or most < 1:
            raise AvlmapsError(
                f"body is {body!r}, block_m {block_m:g} and most_points {most}; they are one of {', '.join(SHAPES)}, "
                "0.1 to 1000 m, and 1 or more."
            )
        self.avlmap = AVLMap.open(Path(path).expanduser())
        frames = Frames.read(Path(robot).expanduser()) if robot else Frames()
        self.placing = messages.Placing(frames.map_frame, frames.map_from_avlmap, self.avlmap.space.level_from_world)
        self._contents = self.avlmap.contents(least)
        self._publish_map(block_m, most)
        self._publish_floor(body)
        self._markers = self.create_publisher(MarkerArray, "~/contents", _latched())
        self._markers.publish(messages.contents_markers(self.placing, self._contents))
        self._heat = self.create_publisher(PointCloud2, "~/heat", _latched())
        self._goals = self.create_publisher(MarkerArray, "~/goals", _latched())
        self.create_service(Ask, "~/ask", self._ask)
        self.create_service(Locate, "~/locate", self._locate)
        self.create_service(Things, "~/things", self._things)
        counts = f"{len(self.avlmap.points):,} voxels, {len(self._contents.things)} things"
        self.get_logger().info(f"{path}: {counts}, in the frame {frames.map_frame}")

    def _publish_map(self, block_m: float, most: int) -> None:
        points, colors = self.placing.points(self.avlmap.points), self.avlmap.colors
        blocks = list(messages.blocks_of(points, block_m, most))
        if len(blocks) > _MOST_BLOCKS:
            raise AvlmapsError(f"The map falls into {len(blocks)} blocks of {block_m:g} m; make block_m larger.")
        self._points = self.create_publisher(PointCloud2, "~/points", _latched(max(1, len(blocks))))
        for rows in blocks:
            self._points.publish(messages.cloud(self.placing.header, points[rows], colors[rows]))

    def _publish_floor(self, body: str) -> None:
        self._grid = self.create_publisher(OccupancyGrid, "~/grid", _latched())
        try:
            self._grid.publish(messages.occupancy(self.placing, obstacles_for(self.avlmap, SHAPES[body])))
        except AvlmapsError as fault:  # a map without a floor is looked at and queried all the same
            self.get_logger().warning(f"no grid: {fault}")

    def _ask(self, request: Any, response: Any) -> Any:
        response.count, response.frame_id = -1, self.placing.header.frame_id
        try:
            answer = self.avlmap.ask(request.question, top=request.top or 3)
        except AvlmapsError as fault:
            response.error = str(fault)
            return response
        response.found, response.probability = answer.found, float(answer.probability)
        response.count = -1 if answer.count is None else answer.count
        response.places = [messages.place_message(Place, self.placing, goal) for goal in answer.goals]
        response.notes = [*answer.notes, *(part.note for part in answer.parts if part.note)]
        self._show(request.question, answer)
        return response

    def _show(self, question: str, answer: Answer) -> None:
        self._goals.publish(messages.goal_markers(self.placing, question, answer))
        if answer.heat is not None:
            rows = np.flatnonzero(answer.heat.values >= _LEAST_HEAT)
            values = answer.heat.values[rows]
            points = self.placing.points(self.avlmap.points[rows])
            self._heat.publish(messages.cloud(self.placing.header, points, heat_colors(values), values))

    def _locate(self, request: Any, response: Any) -> Any:
        response.pose.header = self.placing.header
        try:
            located = self.avlmap.locate(messages.picture_of(request.image), messages.camera_of(request.camera))
        except (AvlmapsError, ValueError) as fault:
            response.error = str(fault)
            return response
        response.confidence = float(located.score)
        if located.world_from_camera is not None:
            response.found = True
            response.pose = self.placing.camera_pose(located.world_from_camera)
        return response

    def _things(self, request: Any, response: Any) -> Any:
        response.frame_id = self.placing.header.frame_id
        try:
            things = self.avlmap.things(list(request.names) or None, request.least_confidence or 0.5)
        except AvlmapsError as fault:
            response.error = str(fault)
            return response
        response.things = [messages.thing_message(Thing, self.placing, thing) for thing in things]
        return response


def main() -> None:
    """Run the node until the process ends."""
    rclpy.init()
    ended = threading.Event()  # the handlers of rclpy end ROS beneath a step, which then raises or waits for ever
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: ended.set())
    try:
        node = MapNode()
    except AvlmapsError as fault:
        rclpy.try_shutdown()
        raise SystemExit(f"avlmaps_node: {fault}") from None
    try:
        while not ended.is_set():
            rclpy.spin_once(node, timeout_sec=0.5)
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
