"""A robot behind a rosbridge, in this process: a websocket server that speaks the protocol, after a script.

It runs on twisted's one reactor, as the client does.
"""

import json
import threading
from collections.abc import Callable
from hashlib import md5
from math import cos, sin
from time import monotonic, sleep
from typing import Any

from autobahn.twisted.websocket import WebSocketServerFactory, WebSocketServerProtocol
from twisted.internet import reactor as _reactor
from twisted.internet.task import LoopingCall
from twisted.internet.threads import blockingCallFromThread

from avlmaps.core.motion import GroundPose
from avlmaps_ros.wire import start_reactor

reactor: Any = _reactor
_SPEED_M_S = 0.67


class _Client(WebSocketServerProtocol):
    robot: "FakeRobot"

    def onConnect(self, request):  # noqa: N802
        self.robot.headers = dict(request.headers)

    def onOpen(self):  # noqa: N802
        self.topics: dict[str, str] = {}
        self.waiting: list[dict[str, Any]] = []  # behind a goal or a call, where the bridge takes one after the other
        self.at = ""
        self.robot.clients.append(self)

    def onMessage(self, payload, isBinary):  # noqa: N802, N803
        message = json.loads(payload)
        if self.at:
            self.waiting.append(message)
            return
        if self.robot.blocks and message["op"] in ("send_action_goal", "call_service"):
            self.at = message["id"]
        self.robot.take(self, message)

    def go_on(self) -> None:
        self.at = ""
        while self.waiting and not self.at:
            self.onMessage(json.dumps(self.waiting.pop(0)).encode(), False)

    def onClose(self, wasClean, code, reason):  # noqa: N802, N803
        if self in self.robot.clients:
            self.robot.clients.remove(self)

    def tell(self, message: dict[str, Any]) -> None:
        if self.at and message["op"] in ("action_result", "service_response") and message["id"] == self.at:
            reactor.callLater(0.0, self.go_on)
        payload = json.dumps(message).encode()
        if self.robot.late_s:
            reactor.callLater(self.robot.late_s, self._send, payload)
        else:
            self._send(payload)

    def _send(self, payload: bytes) -> None:
        if self.state == self.STATE_OPEN:
            self.sendMessage(payload)


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
        self.listing = True  # servers tell of the goals that they are at
        self.clock_s = monotonic  # by which transforms are stamped
        self.absent: set[str] = set()  # actions without a server
        self.drives = False  # a goal that does "drive on" moves the body
        self.late_s = 0.0  # what it says arrives later by that much
        self.map_every_s = 0.0  # the transform of the map is renewed no more often
        self.answers = True  # its servers answer
        self.blocks = False  # the bridge takes what a client sends after a goal when that goal is over
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

    def shut(self) -> None:
        """Break every connection off, and take none."""
        blockingCallFromThread(reactor, self._listener.stopListening)
        self.drop()

    def reopen(self) -> None:
        """Take connections again, at the same address."""
        blockingCallFromThread(reactor, self._open)

    def die(self) -> None:
        """End what takes goals; the body stands, and its pose is reported."""
        self.listing = self.answers = self.moves_on = False

    def forget(self) -> None:
        """Start what takes goals anew: it knows of none."""
        reactor.callFromThread(self._forget)

    def publish(self, topic: str, message: dict[str, Any]) -> None:
        reactor.callFromThread(self._publish, topic, message)

    # In the reactor's thread.

    def _listen(self) -> None:
        factory = WebSocketServerFactory()
        factory.setProtocolOptions(closeHandshakeTimeout=0.2, maxMessagePayloadSize=10_000_000)
        factory.protocol = type("Client", (_Client,), {"robot": self})
        self._factory = factory
        self.port = 0
        self._open()
        self._ticked_s = monotonic()
        self._told: dict[str, int] = {}
        self._mapped_s = 0.0
        self._ticks = LoopingCall(self._tick)
        self._ticks.start(0.03)

    def _open(self) -> None:
        self._listener = reactor.listenTCP(self.port, self._factory, interface="127.0.0.1")
        self.port = self._listener.getHost().port

    def _forget(self) -> None:
        self.moves_on = False
        for goal in self.goals.values():
            goal.update(status=6 if self.ros == 2 else 4, listed=False)
        if self.ros == 2:
            self._publish("/navigate_to_pose/_action/status", {"status_list": []})

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
        listed = {name: goal for name, goal in self.goals.items() if goal["listed"]}
        if self.ros == 1 and self.listing:
            states = [_state(name, goal["status"]) for name, goal in listed.items()]
            self._publish("/move_base/status", {"header": {}, "status_list": states})
        if self.ros == 2 and self.listing:
            for name, goal in listed.items():
                if goal["status"] == 1 and goal["client"] is not None:
                    self._feed(name)
            if (told := {name: goal["status"] for name, goal in listed.items()}) != self._told:
                self._told = told
                self._tell_states()

    def _tell_states(self) -> None:
        """Publish the goals of each action, as its server does at a change."""
        for action in {goal["action"] for goal in self.goals.values() if goal["listed"]}:
            states = [
                {
                    "goal_info": {"goal_id": {"uuid": list(uuid_of(name))}, "stamp": {"sec": 1, "nanosec": 0}},
                    "status": goal["status"] or 6,
                }
                for name, goal in self.goals.items()
                if goal["action"] == action and goal["listed"]
            ]
            self._publish(f"{action}/_action/status", {"status_list": states})

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
        now_s = self.clock_s()
        self._publish("/tf", {"transforms": [stamped(one, now_s, self.ros) for one in told]})
        if now_s - self._mapped_s < self.map_every_s:
            return
        self._mapped_s = now_s
        self._publish("/tf", {"transforms": [stamped(_transform(fixed, middle, odometry), now_s, self.ros)]})

    def _publish(self, topic: str, message: dict[str, Any]) -> None:
        for client in list(self.clients):
            if topic in client.topics:
                client.tell({"op": "publish", "topic": topic, "msg": message})

    def take(self, client: _Client, message: dict[str, Any]) -> None:
        topic = message["topic"] if message["op"] == "publish" else ""
        if not topic.endswith("/avlmaps/echo"):
            self.received.append(message)
        self._publish(topic, message.get("msg", {}))
        match message["op"]:
            case "subscribe":
                client.topics[message["topic"]] = message["type"]
                if message["topic"].endswith("/_action/status"):
                    self._tell_states()  # the last list is kept for those who come late
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
        told = does not in ("silent", "mute", "reject", "no server")
        goal = {"client": client, "action": action, "args": args, "does": does, "status": 1, "listed": told}
        self.goals[name] = goal
        if does not in ("lie", "reject", "no server", "silent", "mute"):
            self._feed(name)
        if does == "drive on" and self.drives:
            self.moves_on = True
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
            for each in self.clients:
                for payload in MALFORMED:
                    each.sendMessage(payload)
                each.sendMessage(b"\x00\x01", True)
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
        if goal["client"] is None:
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
        """Answer action_msgs/CancelGoal, as the library of action servers does."""
        action = message["service"].removesuffix("/_action/cancel_goal")
        does = self.does.get(action, self.does[""])
        wanted = bytes(message["args"]["goal_info"]["goal_id"]["uuid"])
        told = {"op": "service_response", "id": message["id"], "service": message["service"]}
        if does in ("silent", "mute") or not self.answers:
            return
        if does == "no server" or action in self.absent or not message["service"].endswith("/_action/cancel_goal"):
            client.tell({**told, "values": f"Service {message['service']} does not exist", "result": False})
            return
        named = {name: goal for name, goal in self.goals.items() if goal["action"] == action}
        meant = [name for name in named if not any(wanted) or uuid_of(name) == wanted]
        active = [name for name in meant if named[name]["status"] in (0, 1)]
        code = 2 if any(wanted) and not meant else 3 if any(wanted) and not active else 0
        if active and all(named[name]["does"] in ("stubborn", "mute") for name in active):
            code, active = 1, []
        for name in active:
            self._called_off(name, everything=True)
        cancelling = [{"goal_id": {"uuid": list(uuid_of(name))}, "stamp": {"sec": 0, "nanosec": 0}} for name in active]
        client.tell({**told, "values": {"return_code": code, "goals_canceling": cancelling}, "result": True})

    def operate(self, name: str = "rviz") -> None:
        """Take a goal of an operator, which ends those before it; it moves the robot until it is called off."""
        reactor.callFromThread(self._operated, name)

    def _operated(self, name: str) -> None:
        for other, goal in list(self.goals.items()):
            if goal["status"] in (0, 1):
                self._end(other, 6 if self.ros == 2 else 2)
        action = "/move_base" if self.ros == 1 else "/navigate_to_pose"
        self.goals[name] = {
            "client": None, "action": action, "args": {}, "does": "drive on", "status": 1, "listed": True,
        }  # fmt: skip
        self.moves_on = True


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
    b'{"op": "publish", "topic": "/clock", "msg": {"clock": {"sec": 1' + 400 * b"0" + b"}}}",
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


def stamped(transform: dict[str, Any], stamp_s: float, ros: int) -> dict[str, Any]:
    """Date a transform by the robot's clock."""
    names = ("secs", "nsecs") if ros == 1 else ("sec", "nanosec")
    whole = int(stamp_s)
    stamp = dict(zip(names, (whole, int((stamp_s - whole) * 1e9)), strict=True))
    return {**transform, "header": {**transform["header"], "stamp": stamp}}


def uuid_of(name: str) -> bytes:
    """Return an action server's own name for a goal."""
    return md5(name.encode(), usedforsecurity=False).digest()


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
