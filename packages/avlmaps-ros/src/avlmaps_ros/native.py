"""Driving with Nav2 (ROS 2) as a node in the robot's own network, by rclpy: no bridge between.

Importing this module imports rclpy; only `transports` does, and only when a robot is opened so.
"""

import os
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import partial
from itertools import count
from time import monotonic
from typing import Any
from uuid import UUID, uuid4

from action_msgs.msg import GoalStatusArray
from action_msgs.srv import CancelGoal
from rclpy.action import ActionClient
from rclpy.context import Context
from rclpy.executors import ExternalShutdownException, ShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from std_msgs.msg import String
from unique_identifier_msgs.msg import UUID as GoalUuid  # noqa: N811 - a class

from avlmaps.core.errors import AvlmapsError
from avlmaps.recordings.formats.ros_messages import stamp_of
from avlmaps_ros.goals import End, SentGoal
from avlmaps_ros.messages import interface, sanitize_line, transform_of
from avlmaps_ros.nav2 import ENDED, MOVING, REFUSED, RESULT_WITHIN_S, UNDER_WAY, UNKNOWN, end_listed, end_of
from avlmaps_ros.own_map import OwnGrid, grid_of
from avlmaps_ros.session import Ear, heartbeat
from avlmaps_ros.settings import RosSettings


def filled(message: Any, values: Mapping[str, Any]) -> Any:
    """Set fields of a message by nested dictionaries, and return it; those that are not named stay as they are."""
    for name, value in values.items():
        field = getattr(message, name)
        if isinstance(value, Mapping):
            filled(field, value)
        else:
            setattr(message, name, type(field)(value) if isinstance(field, (int, float)) else value)
    return message


# pyright: reportMissingImports=false
_LOOK_EVERY_S = 0.05
_DISCOVERY_S, _LEAST_DISCOVERY_S, _CANCEL_DISCOVERY_S = 6.0, 1.0, 20.0
"""Longest discovery of a server, seconds: since we joined, later, and where it has our goal."""
_NOBODY = GoalUuid()
# Best effort receives from reliable publishers as well, and a lost message does not hold up those after it.
_MOVING = QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT)
_LATCHED = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
_names = count(1)


class NativeSession:
    """A node in the robot's ROS 2 network; ``ROS_DOMAIN_ID`` and the like decide which.

    Everything of rclpy happens in one thread. The node has a context of its own, which leaves the signals of the
    process alone. A goal has our own id in ROS 2 as well, so that no other is ever cancelled in its place.
    """

    def __init__(self, settings: RosSettings, ear: Ear) -> None:
        """Join the network. A robot that is not there is noticed by the poses that do not come.

        Raise `BackendError` where a message package is not installed.
        """
        self.name = f"ROS 2, domain {os.environ.get('ROS_DOMAIN_ID') or '0'},"
        self.heard = threading.Condition()
        self.lost: str | None = None
        self.complaint = ""
        self.lists_every_s: float | None = None
        self._settings, self._ear = settings, ear
        self._ours: dict[str, SentGoal] = {}  # by their digits
        self._actions: dict[str, ActionClient] = {}
        self._clients: dict[str, Any] = {}
        self._writers: dict[str, frozenset[bytes]] = {}
        self._agreed_s: dict[str, tuple[float, bool]] = {}
        self._waiting: list[Callable[[], bool]] = []
        self._met: set[str] = set()  # servers that answered
        self._unsent: set[str] = set()  # goals whose server is not discovered yet
        self._joined_s = monotonic()
        transforms = interface("tf2_msgs/msg/TFMessage")
        self._context = Context()
        self._context.init(args=[])
        self._node = _node_in(self._context)
        node, prefix = self._node, settings.tf_namespace
        if ear.wants_poses:
            node.create_subscription(transforms, f"{prefix}/tf", partial(self._placed, static=False), _MOVING)
            node.create_subscription(transforms, f"{prefix}/tf_static", partial(self._placed, static=True), _LATCHED)
        for server in self._servers():
            node.create_subscription(
                GoalStatusArray, f"{server}/_action/status", partial(self._listed, server), _LATCHED
            )
        beats = f"{settings.namespace}/avlmaps/heartbeat"
        self._beats = node.create_publisher(String, beats, 10)
        if ear.wants_poses:
            node.create_subscription(String, beats, lambda message: ear.beats.hear(message.data[:256]), 100)
        self._cancels = {
            server: node.create_client(CancelGoal, f"{server}/_action/cancel_goal") for server in self._servers()
        }
        node.create_timer(_LOOK_EVERY_S, self._look)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(node)
        self._thread = threading.Thread(target=self._spin, name="avlmaps-ros2", daemon=True)
        self._thread.start()

    def _servers(self) -> list[str]:
        return [f"{self._settings.namespace}/{action}" for action in MOVING]

    # The session, from any thread.

    def ask(self, server: str) -> bool:
        # Cancels a goal that does not exist: the answer shows whether there is a server.
        self._do(self._ask, server)
        return True

    def send(self, goal: SentGoal) -> None:
        self._do(self._send, goal)

    def remind(self, goal: SentGoal) -> None:
        """Do nothing: services are reliable."""

    def cancel(self, goal: SentGoal) -> None:
        self._do(self._cancel, goal)

    def cancel_all(self) -> None:
        for server in self._servers():
            self._do(self._call_cancel, server, _NOBODY, None)

    def is_idle(self, since_s: float) -> bool | None:
        answers = [agreed for at_s, agreed in list(self._agreed_s.values()) if at_s >= since_s]
        if not answers:
            return None
        under_way = self._ear.servers.under_way()
        return all(answers) and not any(under_way.get(server) for server in self._servers())

    def beat(self, goal: SentGoal) -> None:
        with suppress(Exception):  # the network was left meanwhile
            self._beats.publish(String(data=heartbeat(goal)))

    def close(self) -> None:
        if self._context.ok():
            self._executor.shutdown(timeout_sec=2.0)
            with suppress(Exception):
                self._node.destroy_node()
            self._context.try_shutdown()
        if threading.current_thread() is not self._thread:
            self._thread.join(2.0)
        self._end("it was closed")

    def _do(self, work: Callable[..., None], *given: Any) -> None:
        if self.lost is None:
            with suppress(Exception):  # the network is being left
                self._executor.create_task(self._carefully, work, *given)

    # In the thread of rclpy.

    def _spin(self) -> None:
        why = "it was closed"
        try:
            self._executor.spin()
        except (ExternalShutdownException, ShutdownException):
            pass
        except Exception as fault:  # noqa: BLE001 - nobody listens any more, for any reason
            why = sanitize_line(f"rclpy ended: {fault}")
        self._end(why)

    def _end(self, why: str) -> None:
        self.lost = self.lost or why
        self._notify()

    def _notify(self) -> None:
        with self.heard:
            self.heard.notify_all()

    def _carefully(self, work: Callable[..., None], *given: Any) -> None:
        try:
            work(*given)
        except AvlmapsError as fault:
            self.complaint = str(fault)
            self._notify()

    def _patience_s(self) -> float:
        return max(_LEAST_DISCOVERY_S, _DISCOVERY_S - (monotonic() - self._joined_s))

    def _when(
        self, ready: Callable[[], bool], go: Callable[[], Any], absent: Callable[[], None], patient_s: float
    ) -> None:
        until_s = monotonic() + patient_s

        def done() -> bool:
            if ready():
                go()
                return True
            if monotonic() > until_s:
                absent()
                return True
            return False

        if not done():
            self._waiting.append(done)

    def _look(self) -> None:
        self._waiting = [done for done in self._waiting if not done()]

    def _placed(self, message: Any, static: bool) -> None:
        transforms = []
        for one in message.transforms[:2000]:
            try:
                transforms.append(transform_of(one, stamp_of(one)))
            except ValueError:
                self._ear.tree.refused += 1
        self._ear.tree.take(transforms, static)
        self._notify()

    def _listed(self, server: str, message: Any) -> None:
        states = {bytes(one.goal_info.goal_id.uuid).hex(): one.status for one in message.status_list}
        under_way = [digits for digits, status in states.items() if status in UNDER_WAY]
        self._writers[server] = self._writers_of(server)
        self._ear.servers.listed(server, under_way)
        for digits, goal in list(self._ours.items()):
            status = states.get(digits)
            if goal.task.action != server or status is None:
                continue
            if status in UNDER_WAY:
                goal.heard_s = self._ear.clock()  # a list comes at a change only: no sign of life that recurs
            else:
                self._later(partial(self._over, goal, *end_listed(status)))
        self._notify()

    def _writers_of(self, server: str) -> frozenset[bytes]:
        known = self._node.get_publishers_info_by_topic(f"{server}/_action/status")
        return frozenset(bytes(one.endpoint_gid) for one in known)

    def _later(self, act: Callable[[], None]) -> None:
        at_s = monotonic() + RESULT_WITHIN_S
        self._waiting.append(lambda: monotonic() > at_s and (act(), True)[1])

    def _over(self, goal: SentGoal, end: End, note: str = "") -> None:
        goal.over(end, note)
        self._ours.pop(_digits(goal), None)
        self._notify()

    def _unknown(self, goal: SentGoal | None, note: str) -> None:
        if goal is not None:
            goal.unknown(self._ear.clock(), note)
            if goal.end is not None:
                self._ours.pop(_digits(goal), None)

    def _send(self, goal: SentGoal) -> None:
        goal.alias = _digits(goal)  # so do servers list it
        self._ours[goal.alias] = goal
        name = goal.task.action
        try:
            kind = interface(goal.task.kind)
            message = filled(kind.Goal(), goal.task.arguments)
        except AvlmapsError as fault:
            self._over(goal, End.FAILED, str(fault))
            return
        client = self._actions.get(name)
        if client is None:
            client = self._actions[name] = ActionClient(self._node, kind, name)

        def fed(_: Any) -> None:
            goal.show(self._ear.clock())
            self._notify()

        def taken(future: Any) -> None:
            handle = future.result()
            if not handle.accepted:
                self._over(goal, End.FAILED, "Nav2 refused the goal (it does not say why)")
                return
            goal.heard_s = self._ear.clock()
            self._ear.servers.answered(name, serves=True)
            handle.get_result_async().add_done_callback(ended)
            if goal.called_off_s is not None:  # it was given up before it was taken
                self._cancel(goal)

        def ended(future: Any) -> None:
            self._over(goal, *_end_of(future.result()))

        def go() -> None:
            self._unsent.discard(goal.alias)
            if goal.end is None:  # it may have been called off meanwhile
                sent = client.send_goal_async(message, feedback_callback=fed, goal_uuid=_uuid(goal))
                sent.add_done_callback(taken)

        none = "No action server takes the goal; start Nav2, or name its namespace"
        self._unsent.add(goal.alias)
        self._when(client.server_is_ready, go, partial(self._over, goal, End.ABSENT, none), self._patience_s())

    def _cancel(self, goal: SentGoal) -> None:
        goal.call_off(self._ear.clock())
        if _digits(goal) in self._unsent:
            self._over(goal, End.CANCELLED, "It was called off before it was sent")
            return
        self._ours.setdefault(_digits(goal), goal)
        self._call_cancel(goal.task.action, _uuid(goal), goal)

    def _ask(self, server: str) -> None:
        known = self._writers.get(server)
        if known and known.isdisjoint(self._writers_of(server)):  # its list is that of a server that is gone
            self._ear.servers.listed(server, ())
        self._call_cancel(server, GoalUuid(uuid=list(uuid4().bytes)), None)
        for goal in list(self._ours.values()):
            if goal.task.action == server and goal.heard_s is not None and goal.task.kind:
                self._ask_result(goal)

    def _ask_result(self, goal: SentGoal) -> None:
        kind, service = interface(goal.task.kind), f"{goal.task.action}/_action/get_result"
        client = self._clients.get(service)
        if client is None:
            client = self._clients[service] = self._node.create_client(kind.Impl.GetResultService, service)

        def ended(future: Any) -> None:
            if future.result().status == 0:
                self._over(goal, End.FAILED, "Nav2 does not know the goal any more; it was restarted")
            else:
                self._over(goal, *_end_of(future.result()))

        if client.service_is_ready():
            request = kind.Impl.GetResultService.Request(goal_id=_uuid(goal))
            client.call_async(request).add_done_callback(ended)

    def _call_cancel(self, server: str, goal_id: Any, goal: SentGoal | None) -> None:
        client = self._cancels[server]
        request = CancelGoal.Request()
        request.goal_info.goal_id = goal_id

        def answered(future: Any) -> None:
            answer, now_s = future.result(), self._ear.clock()
            self._met.add(server)
            self._ear.servers.answered(server, serves=True)
            if goal_id == _NOBODY:
                self._agreed_s[server] = now_s, answer.return_code != REFUSED
            if answer.return_code in (UNKNOWN, ENDED):
                self._unknown(goal, "Nav2 is not at the goal any more")
            self._notify()

        def absent() -> None:
            self._met.discard(server)
            self._ear.servers.answered(server, serves=False)
            self._unknown(goal, "Its action server is gone")
            self._notify()

        def go() -> None:
            client.call_async(request).add_done_callback(answered)

        # A server that was never met may only be slow to discover, and must not keep a goal for that.
        patient_s = _CANCEL_DISCOVERY_S if goal is not None and server not in self._met else self._patience_s()
        self._when(client.service_is_ready, go, absent, patient_s)


def _node_in(context: Context) -> Node:
    return Node(
        f"avlmaps_{os.getpid()}_{next(_names)}", context=context, use_global_arguments=False,
        start_parameter_services=False, enable_rosout=False,
    )  # fmt: skip


def _digits(goal: SentGoal) -> str:
    return goal.id[-32:]


def _uuid(goal: SentGoal) -> GoalUuid:
    return GoalUuid(uuid=list(UUID(hex=_digits(goal)).bytes))


def _end_of(response: Any) -> tuple[End, str]:
    code, text = getattr(response.result, "error_code", 0), getattr(response.result, "error_msg", "")
    return end_of(response.status, code, sanitize_line(text))


def read_grid(topic: str, wait_s: float) -> OwnGrid | None:
    """Read a latched grid as a node of its own; None where none arrives."""
    context = Context()
    context.init(args=[])
    executor, found = SingleThreadedExecutor(context=context), []
    node = _node_in(context)
    try:
        executor.add_node(node)
        kind = interface("nav_msgs/msg/OccupancyGrid")
        node.create_subscription(kind, topic, found.append, QoSProfile(depth=1, durability=_LATCHED.durability))
        until_s = monotonic() + wait_s
        while not found and monotonic() < until_s:
            executor.spin_once(timeout_sec=0.1)
    finally:
        executor.shutdown(timeout_sec=1.0)
        node.destroy_node()
        context.try_shutdown()
    return grid_of(found[-1]) if found else None
