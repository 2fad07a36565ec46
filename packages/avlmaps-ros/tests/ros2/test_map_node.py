"""The package avlmaps_node as a process: what real subscribers and clients of rclpy get, held to the map itself."""
# pyright: reportMissingImports=false

import subprocess
import sys
import time
from math import pi
from pathlib import Path

import numpy as np
import pytest
import rclpy
import yaml
from avlmaps_msgs.srv import Ask, Locate, Things
from nav_msgs.msg import OccupancyGrid
from rcl_interfaces.srv import ListParameters
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import Image, PointCloud2
from visualization_msgs.msg import Marker, MarkerArray

from avlmaps.maps.build import build_map
from avlmaps.maps.obstacles import CellState
from avlmaps.maps.settings import BuildSettings
from avlmaps.navigate.costmap import obstacles_for
from avlmaps.query.avlmap import AVLMap
from avlmaps.recordings.open import open_recording
from avlmaps_ros import Frames, GroundTransform
from helpers.walked_room import write_walk

pytestmark = [pytest.mark.timeout(240), pytest.mark.xdist_group("one map")]

PACKAGE = Path(__file__).parents[4] / "examples/ros2/avlmaps_node"
LIE = GroundTransform(2.0, -1.0, pi / 2)


@pytest.fixture(scope="module")
def room(tmp_path_factory) -> AVLMap:
    folder = tmp_path_factory.mktemp("room")
    build_map(
        open_recording(write_walk(folder / "rec")), folder / "room.avlmap", "colours", BuildSettings(voxel_size_m=0.1),
        progress=False,
    )  # fmt: skip
    return AVLMap.open(folder / "room.avlmap")


class Client:
    """A node beside the map's, which subscribes late and calls."""

    def __init__(self) -> None:
        rclpy.init(args=[])
        self.node = Node("looker")

    def latest(self, kind, topic: str, count: int = 1, depth: int = 1000):
        got: list = []
        latched = QoSProfile(depth=depth, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        subscription = self.node.create_subscription(kind, topic, got.append, latched)
        until_s = time.monotonic() + 30.0
        while len(got) < count and time.monotonic() < until_s:
            rclpy.spin_once(self.node, timeout_sec=0.1)
        for _ in range(5):  # and no more than that
            rclpy.spin_once(self.node, timeout_sec=0.05)
        self.node.destroy_subscription(subscription)
        return got

    def call(self, kind, service: str, **request):
        client = self.node.create_client(kind, service)
        assert client.wait_for_service(30.0), service
        future = client.call_async(kind.Request(**request))
        rclpy.spin_until_future_complete(self.node, future, timeout_sec=30.0)
        assert future.done()
        return future.result()


@pytest.fixture(scope="module")
def client(room, tmp_path_factory):
    robot = tmp_path_factory.mktemp("robot") / "robot.json"
    Frames("earth", "base_link", LIE).write(robot)
    words = [
        "--ros-args", "-p", f"map:={room.path}", "-p", f"robot_file:={robot}", "-p", "block_m:=1.0",
        "-p", "most_points:=200",
    ]  # fmt: skip
    process = subprocess.Popen([sys.executable, "-m", "avlmaps_node.node", *words], cwd=PACKAGE)
    looker = Client()
    yield looker
    looker.node.destroy_node()
    rclpy.try_shutdown()
    process.terminate()
    try:
        process.wait(60.0)
    finally:
        process.kill()


def read(message: PointCloud2) -> np.ndarray:
    kinds = {field.name: ("<f4" if field.name != "rgb" else "<u4", field.offset) for field in message.fields}
    names, formats, offsets = list(kinds), [kind for kind, _ in kinds.values()], [at for _, at in kinds.values()]
    layout = np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": message.point_step})
    return np.frombuffer(bytes(message.data), layout)


def in_robot(room: AVLMap, points: np.ndarray) -> np.ndarray:
    """The same by a way of its own: level, then turned by a quarter and shifted."""
    level = points @ room.space.level_from_world.T
    return np.stack([2.0 - level[:, 1], -1.0 + level[:, 0], level[:, 2]], axis=1)


def sorted_rows(points: np.ndarray) -> np.ndarray:
    rounded = np.round(np.asarray(points, np.float64), 3)
    return rounded[np.lexsort(rounded.T)]


def test_a_late_subscriber_gets_every_voxel_once_in_blocks_and_in_the_robots_frame(client, room):
    expected = in_robot(room, room.points)
    blocks = client.latest(PointCloud2, "/avlmaps/points", count=2)
    until_s = time.monotonic() + 20.0
    while sum(block.width for block in blocks) < len(expected) and time.monotonic() < until_s:
        blocks = client.latest(PointCloud2, "/avlmaps/points", count=len(blocks) + 1)
    assert len(blocks) > 5
    assert all(block.header.frame_id == "earth" and block.width <= 200 for block in blocks)
    content = np.concatenate([read(block) for block in blocks])
    points = np.stack([content[axis] for axis in "xyz"], axis=1)
    np.testing.assert_allclose(sorted_rows(points), sorted_rows(expected), atol=2e-3)
    for block in blocks:
        assert np.ptp(np.floor(np.stack([read(block)[axis] for axis in "xyz"], axis=1) + 1e-6), axis=0).max() <= 1
    colors = np.stack([content["rgb"] >> shift & 255 for shift in (16, 8, 0)], axis=1)
    np.testing.assert_array_equal(colors.sum(axis=0), room.colors.astype(np.int64).sum(axis=0))


def test_the_grid_says_of_each_place_of_the_floor_what_the_map_says(client, room):
    (grid,) = client.latest(OccupancyGrid, "/avlmaps/grid")
    obstacles = obstacles_for(room)
    info = grid.info
    cells = np.array(grid.data, np.int8).reshape(info.height, info.width)
    yaw = 2 * np.arctan2(info.origin.orientation.z, info.origin.orientation.w)
    rng = np.random.default_rng(0)
    column, row = rng.integers(0, info.width, 300), rng.integers(0, info.height, 300)
    along, across = (column + 0.5) * info.resolution, (row + 0.5) * info.resolution
    x = info.origin.position.x + np.cos(yaw) * along - np.sin(yaw) * across
    y = info.origin.position.y + np.sin(yaw) * along + np.cos(yaw) * across
    level = np.stack([y + 1.0, 2.0 - x, np.full(300, obstacles.floor_m)], axis=1)
    states = obstacles.state_at(level @ room.space.level_from_world)
    said = {int(CellState.UNKNOWN): -1, int(CellState.FREE): 0, int(CellState.OCCUPIED): 100}
    np.testing.assert_array_equal(cells[row, column], [said[int(state)] for state in states])
    assert {0, 100} <= set(cells.ravel().tolist())


def test_a_question_is_answered_as_the_map_answers_and_its_heat_is_shown(client, room):
    things = room.things()
    name = things[0].name
    answer, expected = client.call(Ask, "/avlmaps/ask", question=name, top=2), room.ask(name, top=2)
    assert (answer.error, answer.found, answer.frame_id) == ("", expected.found, "earth")
    assert answer.probability == pytest.approx(expected.probability, abs=1e-4)
    assert len(answer.places) == len(expected.goals)
    for place, goal in zip(answer.places, expected.goals, strict=True):
        at = (place.position.x, place.position.y, place.position.z)
        np.testing.assert_allclose(at, in_robot(room, np.array([goal.position]))[0], atol=1e-6)
        assert place.score == pytest.approx(goal.score, abs=1e-4)
    assert expected.heat is not None
    (heat,) = client.latest(PointCloud2, "/avlmaps/heat")
    content = read(heat)
    hot = expected.heat.values >= 0.05
    assert len(content) == hot.sum()
    assert content["intensity"].max() == pytest.approx(float(expected.heat.values.max()), abs=1e-5)
    hottest = np.array([content[axis][content["intensity"].argmax()] for axis in "xyz"])
    near = in_robot(room, room.points[expected.heat.values >= expected.heat.values.max() - 1e-6])
    assert np.linalg.norm(near - hottest, axis=1).min() < 1e-3
    (goals,) = client.latest(MarkerArray, "/avlmaps/goals")
    assert sum(marker.ns == "goals" for marker in goals.markers) == len(expected.goals)


def test_things_rooms_and_sounds_are_markers_and_things_are_listed(client, room):
    (markers,) = client.latest(MarkerArray, "/avlmaps/contents")
    contents = room.contents()
    kinds = [marker.ns for marker in markers.markers]
    assert kinds.count("things") == len(contents.things) > 0
    assert kinds.count("sounds") == len(contents.sounds) > 0
    assert kinds.count("rooms names") == len(contents.rooms)
    listed = client.call(Things, "/avlmaps/things")
    assert [thing.name for thing in listed.things] == [thing.name for thing in room.things()]
    thing, box = room.things()[0], next(one for one in markers.markers if one.ns == "things")
    assert box.type == Marker.CUBE
    points = in_robot(room, thing.points)
    at = np.array([box.pose.position.x, box.pose.position.y, box.pose.position.z])
    np.testing.assert_allclose(at, 0.5 * (points.min(axis=0) + points.max(axis=0)), atol=1e-6)
    np.testing.assert_allclose((box.scale.y, box.scale.x), np.ptp(points, axis=0)[:2] + 0.1, atol=0.02)


def test_the_configuration_of_rviz_names_what_is_published_with_its_durability(client):
    declared = client.call(ListParameters, "/avlmaps/list_parameters").result.names
    shown = yaml.safe_load((PACKAGE / "rviz/avlmaps.rviz").read_text())["Visualization Manager"]["Displays"]
    topics = [display["Topic"] for display in shown if "Topic" in display]
    until_s, published = time.monotonic() + 30.0, set()
    while not published >= {topic["Value"] for topic in topics} and time.monotonic() < until_s:
        rclpy.spin_once(client.node, timeout_sec=0.1)
        known = [name for name, _ in client.node.get_topic_names_and_types()]
        published = {name for name in known if client.node.get_publishers_info_by_topic(name)}
    assert {topic["Value"] for topic in topics} == {name for name in published if name.startswith("/avlmaps/")}
    assert {topic["Durability Policy"] for topic in topics} == {"Transient Local"}
    parameters = yaml.safe_load((PACKAGE / "config/avlmaps.yaml").read_text())["avlmaps"]["ros__parameters"]
    assert set(parameters) < set(declared)


def test_what_cannot_be_answered_says_so_in_one_sentence(client):
    nothing = client.call(Ask, "/avlmaps/ask", question="")
    assert nothing.error and not nothing.found
    wrong = client.call(Locate, "/avlmaps/locate", image=Image(encoding="32FC1", width=4, height=4, step=16))
    assert "32FC1" in wrong.error
    unknown = client.call(Things, "/avlmaps/things", least_confidence=3.0)
    assert unknown.error


def test_a_picture_of_the_recording_is_located_where_it_was_taken(client, room):
    frame = next(iter(open_recording(room.path.parent / "rec").frames()))
    image = Image(encoding="rgb8", width=frame.rgb.shape[1], height=frame.rgb.shape[0], step=3 * frame.rgb.shape[1])
    image.data.frombytes(frame.rgb.tobytes())
    answer, expected = client.call(Locate, "/avlmaps/locate", image=image), room.locate(frame.rgb)
    assert (answer.error, answer.found) == ("", expected.world_from_camera is not None)
    assert answer.confidence == pytest.approx(expected.score, abs=0.05)
    if expected.world_from_camera is not None:
        at = np.array([answer.pose.pose.position.x, answer.pose.pose.position.y, answer.pose.pose.position.z])
        np.testing.assert_allclose(at, in_robot(room, expected.world_from_camera[:3, 3][None])[0], atol=0.05)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ([], "The parameter map is empty"),
        (["-p", "map:=/nowhere.avlmap"], "/nowhere.avlmap"),
        (["-p", "map:=/nowhere.avlmap", "-p", "block_m:=0.0"], "block_m 0"),
    ],
)
def test_a_node_without_a_map_ends_with_one_sentence(words, says):
    command = [sys.executable, "-m", "avlmaps_node.node", "--ros-args", *words]
    done = subprocess.run(command, cwd=PACKAGE, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert says in done.stderr
    assert "Traceback" not in done.stderr
