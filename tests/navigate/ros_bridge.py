"""A robot behind a rosbridge, in this process: a websocket server that speaks the protocol, after a script.

It runs on twisted's one reactor, as the client does; roslibpy brings autobahn, whose server this is.
"""

import json
import threading
from collections.abc import Callable
from math import cos, sin
from time import monotonic, sleep
from typing import Any

from autobahn.twisted.websocket import WebSocketServerFactory, WebSocketServerProtocol
from twisted.internet import reactor as _reactor
from twisted.internet.task import LoopingCall
from twisted.internet.threads import blockingCallFromThread

from avlmaps.core.motion import GroundPose
from avlmaps.navigate.ros.wire import start_reactor

reactor: Any = _reactor
_SPEED_M_S = 0.67


class _Client(WebSocketServerProtocol):
    robot: "FakeRobot"

    def onConnect(self, request):  # noqa: N802
        self.robot.headers = dict(request.headers)

    def onOpen(self):  # noqa: N802
        self.topics: dict[str, str] = {}
        self.robot.clients.append(self)

    def onMessage(self, payload, isBinary):  # noqa: N802, N803
        self.robot.take(self, json.loads(payload))

    def onClose(self, wasClean, code, reason):  # noqa: N802, N803
        if self in self.robot.clients:
            self.robot.clients.remove(self)

    def tell(self, message: dict[str, Any]) -> None:
        if self.state == self.STATE_OPEN:
            self.sendMessage(json.dumps(message).encode())


class FakeRobot:
    """What it does is the attribute ``does``: one word, or one for each action; see ``_begin``."""

    def __init__(self, ros: int = 2, does: str = "succeed", pose: GroundPose | None = None) -> None:
        self.ros = ros
        self.does: dict[str, str] = {"": does}
        self.pose = pose or GroundPose(0.0, 0.0, 0.0)
        self.frames = ("map", "odom", "base_link")
        self.tf_on = True
        self.spoiled: float | None = 0.0  # the x of a transform; None and NaN are not numbers
        self.received: list[dict[str, Any]] = []
        self.clients: list[_Client] = []
        self.goals: dict[str, dict[str, Any]] = {}  # id: goal with its status
        self.headers: dict[str, str] = {}
        self.moves_on = False

    # From the test's thread.

    def __enter__(self) -> "FakeRobot":
        start_reactor()
        blockingCallFromThread(reactor, self._listen)
        return self

    def __exit__(self, *_: object) -> None:
        blockingCallFromThread(reactor, self._leave)

    @property
    def url(self) -> str:
        return f"ws://127.0.0.1:{self.port}"

    def ops(self, *names: str) -> list[dict[str, Any]]:
        return [message for message in list(self.received) if message["op"] in names]

    def published(self, topic: str) -> list[dict[str, Any]]:
        return [message["msg"] for message in self.ops("publish") if message["topic"] == topic]

    def soon(self, holds: Callable[[], bool], within_s: float = 20.0) -> bool:
        until_s = monotonic() + within_s
        while not holds() and monotonic() < until_s:
            sleep(0.01)
        return holds()

    def say(self, payload: bytes, binary: bool = False) -> None:
        """Send raw bytes to every client."""
        for client in list(self.clients):
            reactor.callFromThread(client.sendMessage, payload, binary)

    def drop(self) -> None:
        """Break every connection off, as a robot that leaves the network."""
        for client in list(self.clients):
            reactor.callFromThread(client.transport.abortConnection)

    def publish(self, topic: str, message: dict[str, Any]) -> None:
        reactor.callFromThread(self._publish, topic, message)

    # In the reactor's thread.

    def _listen(self) -> None:
        factory = WebSocketServerFactory()
        factory.setProtocolOptions(closeHandshakeTimeout=0.2, maxMessagePayloadSize=10_000_000)
        factory.protocol = type("Client", (_Client,), {"robot": self})
        self._factory = factory
        self._listener = reactor.listenTCP(0, factory, interface="127.0.0.1")
        self.port = self._listener.getHost().port
        self._ticked_s = monotonic()
        self._ticks = LoopingCall(self._tick)
        self._ticks.start(0.03)

    def _leave(self) -> Any:
        self._ticks.stop()
        for client in list(self.clients):
            client.transport.abortConnection()
        return self._listener.stopListening()

    def _tick(self) -> None:
        now_s = monotonic()
        if self.moves_on:
            self.pose = self.pose.ahead(_SPEED_M_S * (now_s - self._ticked_s))  # by the clock: ticks may be late
        self._ticked_s = now_s
        if self.tf_on:
            self._tell_transforms()
        if self.ros == 1:
            states = [_state(name, goal["status"]) for name, goal in self.goals.items() if goal["listed"]]
            self._publish("/move_base/status", {"header": {}, "status_list": states})

    def _tell_transforms(self) -> None:
        fixed, middle, body = self.frames
        pose = self.pose
        # The robot's odometry began at (5, -3), turned by a quarter.
        odometry = GroundPose(5.0, -3.0, 1.5707963267948966)
        dx, dy = pose.x_m - odometry.x_m, pose.y_m - odometry.y_m
        c, s = cos(odometry.heading_rad), sin(odometry.heading_rad)
        within = GroundPose(c * dx + s * dy, -s * dx + c * dy, pose.heading_rad - odometry.heading_rad)
        told = [_transform(middle, body, within), _transform(body, "laser", GroundPose(0.2, 0.0))]
        if self.spoiled != 0.0:
            told[0]["transform"]["translation"]["x"] = self.spoiled
        self._publish("/tf", {"transforms": told})
        self._publish("/tf", {"transforms": [_transform(fixed, middle, odometry)]})

    def _publish(self, topic: str, message: dict[str, Any]) -> None:
        for client in list(self.clients):
            if topic in client.topics:
                client.tell({"op": "publish", "topic": topic, "msg": message})

    def take(self, client: _Client, message: dict[str, Any]) -> None:
        self.received.append(message)
        match message["op"]:
            case "subscribe":
                client.topics[message["topic"]] = message["type"]
            case "send_action_goal":
                self._begin(client, message["action"], message["id"], message["args"])
            case "cancel_action_goal":
                self._called_off(message["id"])
            case "call_service":
                self._serve(client, message)
            case "publish" if message["topic"] == "/move_base/goal":
                self._begin(client, "/move_base", message["msg"]["goal_id"]["id"], message["msg"]["goal"])
            case "publish" if message["topic"] == "/move_base/cancel":
                name = message["msg"]["id"]
                for goal in [name] if name else list(self.goals):
                    self._called_off(goal, everything=not name)

    def _begin(self, client: _Client, action: str, name: str, args: dict[str, Any]) -> None:
        if name in self.goals:
            return
        does = self.does.get(action, self.does[""])
        if does == "deaf":
            self.does[action] = "succeed"  # the first message of a new topic is lost
            return
        told = does not in ("silent", "mute")
        goal = {"client": client, "action": action, "args": args, "does": does, "status": 1, "listed": told}
        self.goals[name] = goal
        if does not in ("lie", "reject", "no server", "silent", "mute"):
            self._feed(name)
        later = {
            "succeed": (self._arrive, name),
            "lie": (self._end, name, 4 if self.ros == 2 else 3),
            "abort": (self._end, name, 6 if self.ros == 2 else 4),
            "reject": (self._refuse, name, "Action goal was rejected"),
            "no server": (self._refuse, name, "No action server available"),
            "cancelled elsewhere": (self._end, name, 5 if self.ros == 2 else 2),
            "disconnect": (client.transport.abortConnection,),
            "malformed": (self._arrive, name),
            "arrive unseen": (self._arrive, name),
        }
        if does == "arrive unseen":
            self.tf_on = False
        if does == "malformed":
            for payload in MALFORMED:
                client.sendMessage(payload)
            client.sendMessage(b"\x00\x01", True)
        if does in later:
            reactor.callLater(0.05, *later[does])

    def _feed(self, name: str) -> None:
        goal = self.goals[name]
        if self.ros == 2:
            values = {"distance_remaining": 1.0}
            goal["client"].tell({"op": "action_feedback", "action": goal["action"], "id": name, "values": values})

    def _arrive(self, name: str) -> None:
        goal = self.goals[name]
        if goal["status"] != 1:
            return
        args = goal["args"]
        action = goal["action"].rsplit("/", 1)[-1]
        if action == "spin":
            self.pose = self.pose.turned(args["target_yaw"])
        elif action == "drive_on_heading":
            assert args["target"]["x"] > 0.0
            assert args["speed"] > 0.0  # Nav2 refuses other signs
            self.pose = self.pose.ahead(args["target"]["x"])
        else:
            stamped = args["pose"] if self.ros == 2 else args["target_pose"]
            assert stamped["header"]["frame_id"] == self.frames[0]
            self.pose = _pose(stamped["pose"])
        self._end(name, 4 if self.ros == 2 else 3)

    def _refuse(self, name: str, why: str) -> None:
        goal = self.goals[name]
        if self.ros == 1:
            self._end(name, 5, why)
            return
        goal["status"] = 0
        told = {
            "op": "action_result",
            "id": name,
            "action": goal["action"],
            "values": why,
            "status": 0,
            "result": False,
        }
        goal["client"].tell(told)

    def _end(self, name: str, status: int, text: str = "") -> None:
        goal = self.goals[name]
        goal["status"] = status
        if self.ros == 1:
            goal["listed"] = True
            self._publish("/move_base/result", {"header": {}, "status": _state(name, status, text), "result": {}})
            return
        values = {"error_code": 208 if status == 6 else 0, "error_msg": ""}
        told = {"op": "action_result", "id": name, "action": goal["action"], "values": values, "status": status}
        if self.does.get("format") == "old":
            told = {**told, "values": {"status": status, "result": {"result": {}}}}
            del told["status"]
        goal["client"].tell({**told, "result": True})

    def _called_off(self, name: str, everything: bool = False) -> None:
        goal = self.goals.get(name)
        if goal is None or goal["status"] not in (0, 1) or goal["does"] in ("stubborn", "mute"):
            return
        if goal["does"] == "deaf to ids" and not everything:
            return
        if goal["does"] != "silent":
            self.moves_on = False
            reactor.callLater(0.05, self._end, name, 5 if self.ros == 2 else 2)

    def _serve(self, client: _Client, message: dict[str, Any]) -> None:
        agreed = self.does[""] not in ("stubborn", "mute") and message["service"].endswith("/_action/cancel_goal")
        action = message["service"].removesuffix("/_action/cancel_goal")
        for name, goal in list(self.goals.items()):
            if goal["action"] == action:
                self._called_off(name, everything=True)
        values: Any = {"return_code": 0, "goals_canceling": []} if agreed else "Service does not exist"
        told = {"op": "service_response", "id": message["id"], "service": message["service"]}
        client.tell({**told, "values": values, "result": agreed})


MALFORMED = (
    b"",
    b"{",
    b"[]",
    b"null",
    b'"op"',
    b'{"op": 3}',
    b'{"msg": {}}',
    b'{"op": "publish"}',
    b'{"op": "publish", "topic": "/tf", "msg": 3}',
    b'{"op": "publish", "topic": "/tf", "msg": {"transforms": [3, null, {}]}}',
    b'{"op": "publish", "topic": "close", "msg": {}}',
    b'{"op": "publish", "topic": "/unknown", "msg": {}}',
    b'{"op": "publish", "topic": "/tf", "msg": {"transforms": NaN}}',
    b'{"op": "action_result", "id": "another", "values": [1e999]}',
    b'{"op": "action_result", "id": {}}',
    b'{"op": "service_response", "id": "avlmaps-0", "values": null}',
    b'{"op": "status", "level": "error", "msg": {"no": "text"}}',
    b'{"op": "fragment", "data": "{}"}',
    b'{"op": "' + b"x" * 1000 + b'"}',
    b"[" * 5000,
    b'{"op": "publish", "topic": "/tf", "msg": ' + b'{"a":' * 3000 + b"1" + b"}" * 3000 + b"}",
)


def _state(name: str, status: int, text: str = "") -> dict[str, Any]:
    return {"goal_id": {"stamp": {"secs": 0, "nsecs": 0}, "id": name}, "status": status, "text": text}


def _transform(parent: str, child: str, pose: GroundPose) -> dict[str, Any]:
    half = pose.heading_rad / 2
    return {
        "header": {"stamp": {"sec": 1, "nanosec": 2}, "frame_id": parent},
        "child_frame_id": child,
        "transform": {
            "translation": {"x": pose.x_m, "y": pose.y_m, "z": 0.0},
            "rotation": {"x": 0.0, "y": 0.0, "z": sin(half), "w": cos(half)},
        },
    }


def _pose(message: dict[str, Any]) -> GroundPose:
    from math import atan2

    place, turn = message["position"], message["orientation"]
    return GroundPose(place["x"], place["y"], 2.0 * atan2(turn["z"], turn["w"]))


def in_thread(work: Callable[[], Any]) -> tuple[threading.Thread, list[Any]]:
    """Run something beside the test; its result comes into the list."""
    results: list[Any] = []
    thread = threading.Thread(target=lambda: results.append(work()), daemon=True)
    thread.start()
    return thread, results
