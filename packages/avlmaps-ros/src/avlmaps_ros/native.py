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
from uuid import UUID

from action_msgs.srv import CancelGoal
from rclpy.action import ActionClient
from rclpy.context import Context
from rclpy.executors import ExternalShutdownException, ShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from unique_identifier_msgs.msg import UUID as GoalUuid  # noqa: N811 - a class

from avlmaps.core.errors import AvlmapsError, NavigationError
from avlmaps_ros.goals import ActionGoal, End, SentGoal
from avlmaps_ros.link import Line
from avlmaps_ros.messages import interface, sanitize_line
from avlmaps_ros.nav2 import MOVING, NOBODY_TAKES_IT, Nav2Session, end_of
from avlmaps_ros.session import Ear
from avlmaps_ros.settings import RosSettings

# pyright: reportMissingImports=false
_LOOK_EVERY_S = 0.05
_DISCOVERY_S, _LEAST_DISCOVERY_S, _CANCEL_DISCOVERY_S = 6.0, 1.0, 20.0
"""Longest discovery of a server, seconds: since we joined, later, and where it has our goal."""
_RECURRING = ("/tf", "/avlmaps/heartbeat")
# Best effort receives from reliable publishers as well, and a lost message does not hold up those after it.
_MOVING = QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT)
_LATCHED = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
_names = count(1)


def filled(message: Any, values: Mapping[str, Any]) -> Any:
    """Set fields of a message by nested dictionaries, and return it; those that are not named stay as they are."""
    for name, value in values.items():
        field = getattr(message, name)
        if isinstance(value, Mapping):
            filled(field, value)
        else:
            setattr(message, name, type(field)(value) if isinstance(field, (int, float)) else value)
    return message


def joined(name: str) -> tuple[Context, Node, SingleThreadedExecutor]:
    """Join the network by a node in a context of its own, which leaves the signals of the process alone.

    ``NavigationError``: it cannot be joined.
    """
    context = Context()
    try:
        context.init(args=[])
        node = Node(
            f"{name}_{os.getpid()}_{next(_names)}", context=context, use_global_arguments=False,
            start_parameter_services=False, enable_rosout=False,
        )  # fmt: skip
    except RuntimeError as fault:  # RCLError is one
        raise NavigationError(f"ROS 2 cannot be joined ({sanitize_line(str(fault))}); check ROS_DOMAIN_ID.") from None
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    return context, node, executor


class Network(Line):
    """A node in the robot's ROS 2 network; ``ROS_DOMAIN_ID`` and the like decide which.

    What comes is handed on in one thread, from `start` on. A robot that is not there is noticed by what does not come.
    """

    def __init__(self) -> None:
        super().__init__(f"ROS 2, domain {os.environ.get('ROS_DOMAIN_ID') or '0'},")
        self.context, self.node, self._executor = joined("avlmaps")
        self._publishers: dict[str, tuple[Any, Any]] = {}
        self._waiting: list[Callable[[], bool]] = []
        self.node.create_timer(_LOOK_EVERY_S, self._look)
        self._thread = threading.Thread(target=self._spin, name="avlmaps-ros2", daemon=True)

    def start(self) -> None:
        self._thread.start()

    def subscribe(self, topic: str, kind: str, hand_on: Callable[[Any], None], every_s: float = 0.0) -> None:
        def received(message: Any) -> None:
            try:
                hand_on(message)
            except ValueError:
                self.unread += 1
            self.note()

        qos = _MOVING if topic.endswith(_RECURRING) else _LATCHED
        self.node.create_subscription(interface(kind), topic, received, qos)

    def advertise(self, topic: str, kind: str) -> None:
        self._publishers[topic] = self.node.create_publisher(interface(kind), topic, 10), interface(kind)

    def publish(self, topic: str, message: dict[str, Any]) -> None:
        publisher, kind = self._publishers[topic]
        with suppress(Exception):  # the network was left meanwhile
            publisher.publish(filled(kind(), message))

    def later(self, wait_s: float, work: Callable[[], None]) -> None:
        self.do(self.when, lambda: False, work, work, wait_s)

    def close(self) -> None:
        if self.context.ok():
            self._executor.shutdown(timeout_sec=2.0)
            with suppress(Exception):
                self.node.destroy_node()
            self.context.try_shutdown()
        if threading.current_thread() is not self._thread:
            self._thread.join(2.0)
        self.ended("it was closed")

    def do(self, work: Callable[..., None], *given: Any) -> None:
        """Do something in the thread of rclpy; nothing happens where the network was left."""
        if self.lost is None:
            with suppress(Exception):  # the network is being left
                self._executor.create_task(work, *given)

    # In the thread of rclpy.

    def when(self, ready: Callable[[], bool], go: Callable[[], Any], late: Callable[[], Any], wait_s: float) -> None:
        """Do something as soon as it can be done, or something else after some time."""
        until_s = monotonic() + wait_s

        def done() -> bool:
            act = go if ready() else late if monotonic() > until_s else None
            if act is not None:
                act()
                self.note()
            return act is not None

        if not done():
            self._waiting.append(done)

    def _look(self) -> None:
        self._waiting = [done for done in self._waiting if not done()]

    def _spin(self) -> None:
        why = "it was closed"
        try:
            self._executor.spin()
        except (ExternalShutdownException, ShutdownException):
            pass
        except Exception as fault:  # noqa: BLE001 - nobody listens any more, for any reason
            why = sanitize_line(f"rclpy ended: {fault}")
        self.ended(why)


class NativeNav2(Nav2Session):
    """Nav2 in our own network. A goal has our own id in ROS 2 as well, so that no other is ever cancelled for it."""

    def __init__(self, settings: RosSettings, ear: Ear) -> None:
        """Join the network. ``BackendError``: a message package is not installed."""
        interface("tf2_msgs/msg/TFMessage")
        self._network = network = Network()
        self._clients: dict[str, tuple[Any, ActionClient, Any]] = {}  # type, for goals and for results, by the server
        self._writers: dict[str, frozenset[bytes]] = {}
        self._unsent: set[str] = set()  # goals whose server is not discovered yet
        self._joined_s = monotonic()
        super().__init__(network, settings, ear)
        self._cancels = {
            server: network.node.create_client(CancelGoal, f"{server}/_action/cancel_goal")
            for server in map(self.settings.named, MOVING)
        }
        network.start()

    # From any thread.

    def ask(self, server: str) -> bool:
        self._network.do(self._ask_of_ours, server)
        return super().ask(server)

    def send(self, goal: SentGoal) -> None:
        goal.alias = goal.id[-32:]  # so do servers list it
        self._ours[goal.id] = goal
        self._network.do(self._send, goal)

    def cancel(self, goal: SentGoal) -> None:
        goal.alias = goal.id[-32:]
        self._network.do(self._cancel, goal)

    def _call(self, server: str, name: str, goal: SentGoal | None) -> bool:
        self._network.do(self._call_now, server, name, goal)
        return True

    # In the thread of rclpy.

    def _patience_s(self) -> float:
        return max(_LEAST_DISCOVERY_S, _DISCOVERY_S - (monotonic() - self._joined_s))

    def _listed(self, server: str, message: Any) -> None:
        self._writers[server] = self._writers_of(server)
        super()._listed(server, message)

    def _writers_of(self, server: str) -> frozenset[bytes]:
        known = self._network.node.get_publishers_info_by_topic(f"{server}/_action/status")
        return frozenset(bytes(one.endpoint_gid) for one in known)

    def _over(self, goal: SentGoal, end: End, note: str = "") -> None:
        goal.over(end, note)
        self._each()
        self._network.note()

    def _clients_of(self, task: ActionGoal) -> tuple[Any, ActionClient, Any]:
        if task.action not in self._clients:
            kind, node = interface(task.kind), self._network.node
            results = node.create_client(kind.Impl.GetResultService, f"{task.action}/_action/get_result")
            self._clients[task.action] = kind, ActionClient(node, kind, task.action), results
        return self._clients[task.action]

    def _send(self, goal: SentGoal) -> None:
        name = goal.task.action
        try:
            kind, client, _ = self._clients_of(goal.task)
        except AvlmapsError as fault:
            self._over(goal, End.FAILED, str(fault))
            return
        message = filled(kind.Goal(), goal.task.arguments)

        def fed(_: Any) -> None:
            goal.show(self.ear.clock())
            self._network.note()

        def taken(future: Any) -> None:
            handle = future.result()
            if not handle.accepted:
                self._over(goal, End.FAILED, "Nav2 refused the goal (it does not say why)")
                return
            goal.heard_s = self.ear.clock()
            self.ear.servers.answered(name, serves=True)
            handle.get_result_async().add_done_callback(lambda ended: self._over(goal, *_end_of(ended.result())))
            if goal.called_off_s is not None:  # it was given up before it was taken
                self._cancel(goal)

        def go() -> None:
            self._unsent.discard(goal.id)
            if goal.end is None:  # it may have been called off meanwhile
                sent = client.send_goal_async(message, feedback_callback=fed, goal_uuid=_uuid(goal.alias))
                sent.add_done_callback(taken)

        self._unsent.add(goal.id)
        absent = partial(self._over, goal, End.ABSENT, NOBODY_TAKES_IT)
        self._network.when(client.server_is_ready, go, absent, self._patience_s())

    def _cancel(self, goal: SentGoal) -> None:
        if goal.id in self._unsent:
            self._over(goal, End.CANCELLED, "It was called off before it was sent")
        else:
            super().cancel(goal)

    def _ask_of_ours(self, server: str) -> None:
        known = self._writers.get(server)
        if known and known.isdisjoint(self._writers_of(server)):  # its list is that of a server that is gone
            self.ear.servers.listed(server, ())
        for goal in list(self._ours.values()):
            if goal.task.action == server and goal.heard_s is not None and goal.task.kind:
                self._ask_result(goal)

    def _ask_result(self, goal: SentGoal) -> None:
        kind, _, client = self._clients_of(goal.task)

        def ended(future: Any) -> None:
            forgot = End.FAILED, "Nav2 does not know the goal any more; it was restarted"
            self._over(goal, *(_end_of(future.result()) if future.result().status else forgot))

        if client.service_is_ready():
            request = kind.Impl.GetResultService.Request(goal_id=_uuid(goal.alias))
            client.call_async(request).add_done_callback(ended)

    def _call_now(self, server: str, name: str, goal: SentGoal | None) -> None:
        client, (_, met) = self._cancels[server], self.ear.servers.serves(server)
        request = CancelGoal.Request()
        request.goal_info.goal_id = _uuid(name)

        def answered(future: Any) -> None:
            self._answered(server, name, goal, future.result().return_code)
            self._network.note()

        def go() -> None:
            client.call_async(request).add_done_callback(answered)

        # A server that was never met may only be slow to discover, and must not keep a goal for that.
        patient_s = self._patience_s() if goal is None or met else _CANCEL_DISCOVERY_S
        self._network.when(client.service_is_ready, go, lambda: self._answered(server, name, goal, None), patient_s)


def _uuid(digits: str) -> GoalUuid:
    return GoalUuid(uuid=list(UUID(hex=digits).bytes))


def _end_of(response: Any) -> tuple[End, str]:
    code, text = getattr(response.result, "error_code", 0), getattr(response.result, "error_msg", "")
    return end_of(response.status, code, sanitize_line(text))
