"""Processes of a test's robot, and what its log says that the body did."""
# pyright: reportMissingImports=false

import json
import os
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from queue import SimpleQueue
from typing import Any
from uuid import uuid4

import rclpy
from nav2_msgs.action import NavigateToPose
from rclpy.action import ActionClient
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import String
from unique_identifier_msgs.msg import UUID

HERE = Path(__file__).parent


class Robot:
    """A simulated robot: a process for its body and one for its Nav2, and the log of both."""

    def __init__(self, folder: Path, correction_hz: float = 10.0) -> None:
        self.log, self._hz = folder / "robot.jsonl", correction_hz
        self.processes: dict[str, subprocess.Popen] = {}
        rclpy.init(args=[])
        self.node = Node("test")
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._modes = self.node.create_publisher(String, "simulated/mode", latched)

    def __enter__(self) -> "Robot":
        ready = [self._begin(role) for role in ("body", "nav2")]
        if not self.soon(lambda: all(holds() for holds in ready)):
            self.__exit__()  # or no other test could join
            raise AssertionError("the robot did not start")
        return self

    def __exit__(self, *_: object) -> None:
        for role in list(self.processes):
            self.end(role)
        self.node.destroy_node()
        rclpy.try_shutdown()

    def start(self, role: str) -> None:
        assert self.soon(self._begin(role)), f"the {role} did not start"

    def _begin(self, role: str) -> Callable[[], bool]:
        """Start a process; return what says that it is ready."""
        ready = "up" if role == "body" else "localised"
        before = len(self.rows(ready))
        command = [
            sys.executable,
            HERE / "simulated_robot.py",
            role,
            "--log",
            self.log,
            "--correction-hz",
            str(self._hz),
        ]
        self.processes[role] = subprocess.Popen(list(map(str, command)))
        return lambda: len(self.rows(ready)) > before

    def end(self, role: str) -> None:
        """Kill a process, as `kill -9` does."""
        process = self.processes.pop(role)
        process.kill()
        process.wait()

    def mode(self, name: str) -> None:
        self._modes.publish(String(data=name))
        assert self.soon(lambda: any(row["mode"] == name for row in self.rows("mode"))), f"nobody heard {name}"

    def rows(self, *kinds: str) -> list[dict[str, Any]]:
        text = self.log.read_text() if self.log.exists() else ""
        return [row for row in lines_of(text) if row["kind"] in kinds]

    @property
    def moves(self) -> bool:
        """Whether the body moves, by its own log."""
        row = (self.rows("body") or [{"v": 0.0, "w": 0.0}])[-1]
        return abs(row["v"]) > 0.01 or abs(row["w"]) > 0.02

    def last_moved_s(self) -> float:
        """Return when the body last moved, by the wall's clock."""
        moved = [row["t"] for row in self.rows("body") if abs(row["v"]) > 0.01 or abs(row["w"]) > 0.02]
        return moved[-1] if moved else 0.0

    def soon(self, holds: Callable[[], bool], within_s: float = 60.0) -> bool:
        until_s = time.monotonic() + within_s
        while not holds() and time.monotonic() < until_s:
            time.sleep(0.02)
        return holds()


def lines_of(text: str) -> list[dict[str, Any]]:
    """Return the lines of JSON in a text; a line that is cut off, or says something else, is left out."""
    found = []
    for line in text.splitlines():
        with suppress(ValueError):
            found.append(json.loads(line))
    return [row for row in found if isinstance(row, dict) and "kind" in row]


def free_port() -> int:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        return taken.getsockname()[1]


class Bridge:
    """An unmodified rosbridge of a checkout, in this test's network."""

    def __init__(self, checkout: Path) -> None:
        self.port, self._checkout = free_port(), checkout

    def __enter__(self) -> "Bridge":
        self.start()
        return self

    def start(self) -> None:
        sources = [str(self._checkout / name / "src") for name in ("rosbridge_library", "rosbridge_server")]
        script = self._checkout / "rosbridge_server" / "scripts" / "rosbridge_websocket.py"
        words = ["--ros-args", "-p", f"port:={self.port}", "-p", "address:=127.0.0.1", "--log-level", "error"]
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sources)}
        self.process = subprocess.Popen([sys.executable, script, *words], env=environment)
        until_s = time.monotonic() + 30.0
        while time.monotonic() < until_s:
            with suppress(OSError), socket.create_connection(("127.0.0.1", self.port), 1.0):
                return
            time.sleep(0.1)
        raise AssertionError("the bridge did not start")

    @property
    def url(self) -> str:
        return f"ws://127.0.0.1:{self.port}"

    def __exit__(self, *_: object) -> None:
        self.process.kill()
        self.process.wait()


class LateLink:
    """A way to a bridge on which one connection is late: what the client sends on it arrives seconds later."""

    def __init__(self, port: int, late_s: float, which: int = 2) -> None:
        self.port, self._target, self._late_s, self._which = free_port(), port, late_s, which
        self._count = 0

    def __enter__(self) -> "LateLink":
        self._listener = socket.create_server(("127.0.0.1", self.port))
        threading.Thread(target=self._serve, daemon=True).start()
        return self

    @property
    def url(self) -> str:
        return f"ws://127.0.0.1:{self.port}"

    def __exit__(self, *_: object) -> None:
        self._listener.close()

    def _serve(self) -> None:
        with suppress(OSError):
            while True:
                client, _ = self._listener.accept()
                self._count += 1
                bridge = socket.create_connection(("127.0.0.1", self._target))
                late_s = self._late_s if self._count == self._which else 0.0
                for one, other, seconds in ((client, bridge, late_s), (bridge, client, 0.0)):
                    queue: SimpleQueue[tuple[float, bytes]] = SimpleQueue()
                    threading.Thread(target=_received, args=(one, queue, seconds), daemon=True).start()
                    threading.Thread(target=_forwarded, args=(queue, other), daemon=True).start()


def _received(one: socket.socket, queue: "SimpleQueue[tuple[float, bytes]]", late_s: float) -> None:
    content = b"."
    while content:
        try:
            content = one.recv(65536)
        except OSError:
            content = b""
        queue.put((time.monotonic() + late_s, content))


def _forwarded(queue: "SimpleQueue[tuple[float, bytes]]", other: socket.socket) -> None:
    with suppress(OSError):
        while True:
            at_s, content = queue.get()
            time.sleep(max(0.0, at_s - time.monotonic()))
            if not content:
                other.shutdown(socket.SHUT_WR)
                return
            other.sendall(content)


class Operator:
    """Somebody else, who sends goals in RViz."""

    def __init__(self, robot: Robot) -> None:
        self.robot, self.client = robot, ActionClient(robot.node, NavigateToPose, "navigate_to_pose")
        assert self.client.wait_for_server(30.0)
        time.sleep(0.5)  # the server must know the client as well, or its first answer is lost

    def send(self, x_m: float = -30.0) -> str:
        uuid, goal = uuid4(), NavigateToPose.Goal()
        goal.pose.pose.position.x = x_m
        future = self.client.send_goal_async(goal, goal_uuid=UUID(uuid=list(uuid.bytes)))
        rclpy.spin_until_future_complete(self.robot.node, future, timeout_sec=30.0)
        assert future.result().accepted
        return uuid.hex


def in_thread(work: Callable[[], Any]) -> tuple[threading.Thread, list[Any]]:
    """Run something beside the test; its result comes into the list."""
    results: list[Any] = []
    thread = threading.Thread(target=lambda: results.append(work()), daemon=True)
    thread.start()
    return thread, results
