"""ROS 1 on this machine: roscore, an unmodified rosbridge, a body, a move_base, a proxy, each a process of its own.

It needs Debian's packages (ros-core, python3-actionlib, python3-move-base-msgs, python3-tf2-ros, python3-tornado,
python3-autobahn, python3-bson, python3-pil) and a checkout of rosbridge_suite with the branch of ROS 1, such as
0.11.17, whose folder the environment variable AVLMAPS_ROSBRIDGE names. Nothing is installed, and nothing outside a
folder is written.
"""

import json
import os
import shutil
import signal
import socket
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from time import monotonic, sleep, time
from typing import Any, Self

HERE = Path(__file__).resolve().parent
ROS_PYTHON = "/usr/bin/python3"
_AUTHENTICATION = (
    "string mac\nstring client\nstring dest\nstring rand\ntime t\nstring level\ntime end\n---\nbool authenticated\n"
)
MOVES_M_S, MOVES_RAD_S = 0.02, 0.05


def why_not() -> str:
    """Return why ROS 1 cannot be tested here; "" where it can."""
    checkout = os.environ.get("AVLMAPS_ROSBRIDGE", "")
    if not checkout:
        return "no checkout of rosbridge_suite is given; make test-ros1 ROSBRIDGE=DIR"
    if not (Path(checkout) / "rosbridge_server" / "scripts" / "rosbridge_websocket.py").is_file():
        return f"{checkout} is no checkout of rosbridge_suite for ROS 1"
    if shutil.which("roscore") is None:
        return "ROS 1 is not installed; see tests/ros1/ros1_field.py"
    needed = "import rospy, actionlib, tf2_ros, move_base_msgs, tornado, autobahn, bson"
    done = subprocess.run([ROS_PYTHON, "-c", needed], capture_output=True, text=True, check=False, env=_plain())
    return done.stderr.strip().splitlines()[-1] if done.returncode else ""


def _plain() -> dict[str, str]:
    return {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "VIRTUAL_ENV")}


def _ours() -> dict[str, str]:
    """Return the environment of a program of ours."""
    source = os.environ.get("AVLMAPS_SRC")
    return {**os.environ, **({"PYTHONPATH": source} if source else {})}


def free_port() -> int:
    """Return a port that nobody listens at."""
    with socket.socket() as unused:
        unused.bind(("127.0.0.1", 0))
        return unused.getsockname()[1]


def generate(checkout: Path, out: Path) -> None:
    """Make the messages that Debian does not have, by its own generators."""
    authentication = out / "defs" / "Authentication.srv"
    authentication.parent.mkdir(parents=True, exist_ok=True)
    authentication.write_text(_AUTHENTICATION)
    # Debian packs the messages of move_base for Python without their manifest, which rosbridge reads.
    manifest = out / "packages" / "move_base_msgs" / "package.xml"
    manifest.parent.mkdir(parents=True, exist_ok=True)
    about = "<version>1.0.0</version><description>messages</description><license>BSD</license>"
    person = '<maintainer email="nobody@example.org">nobody</maintainer>'
    manifest.write_text(f'<package format="2"><name>move_base_msgs</name>{about}{person}</package>')
    msgs = sorted((checkout / "rosbridge_msgs" / "msg").glob("*.msg"))
    for package, kind, files in (("rosbridge_msgs", "msg", msgs), ("rosauth", "srv", [authentication])):
        folder = out / package / kind
        folder.mkdir(parents=True, exist_ok=True)
        (out / package / "__init__.py").touch()
        tool = [ROS_PYTHON, f"/usr/lib/genpy/gen{kind}_py.py"]
        include = ["-Istd_msgs:/usr/share/std_msgs/msg", f"-I{package}:{checkout / package / 'msg'}"]
        for file in files:
            subprocess.run([*tool, "-p", package, *include, "-o", str(folder), str(file)], check=True, env=_plain())
        subprocess.run([*tool, "--initpy", "-p", package, "-o", str(folder)], check=True, env=_plain())


class Field:
    """One robot with ROS 1, on ports of its own."""

    def __init__(self, folder: Path, *, map_hz: float = 10.0, speed: float = 0.5, watchdog: bool = False) -> None:
        self.folder, self.map_hz, self.speed, self.watchdog = folder, map_hz, speed, watchdog
        self.checkout = Path(os.environ["AVLMAPS_ROSBRIDGE"])
        self.master, self.port, self.near = free_port(), free_port(), free_port()
        self.body_log, self.server_log = folder / "body.jsonl", folder / "server.jsonl"
        self.processes: dict[str, subprocess.Popen[str]] = {}
        self.clients: list[subprocess.Popen[str]] = []
        self._outs: list[Any] = []

    @property
    def url(self) -> str:
        """Address of the bridge, through the proxy."""
        return f"ws://127.0.0.1:{self.near}"

    def __enter__(self) -> Self:
        made = Path(os.environ.get("AVLMAPS_ROS1_GENERATED") or self.folder / "generated")
        if not made.is_dir():
            generate(self.checkout, made)
        library = [self.checkout / name / "src" for name in ("rosbridge_library", "rosbridge_server")]
        self._ros = {
            **_plain(),
            "PYTHONPATH": os.pathsep.join(map(str, [made, *library])),
            "ROS_MASTER_URI": f"http://127.0.0.1:{self.master}",
            "ROS_IP": "127.0.0.1",
            "ROS_ROOT": "/usr/share/ros",
            "ROS_PACKAGE_PATH": f"{made / 'packages'}:/usr/share",
            "ROS_DISTRO": "noetic",
            "ROS_LOG_DIR": str(self.folder / "log"),
            "HOME": str(self.folder),
        }
        self.start("core")
        self.until(lambda: _answers(self.master), "roscore")
        self.start("body")
        self.start("move_base")
        self.start("bridge")
        self.start("proxy")
        if self.watchdog:
            self.start("watchdog")
        self.until(lambda: _answers(self.port) and len(self.rows()) > 3, "rosbridge and the body")
        self.until(lambda: any(row["kind"] == "up" for row in self.rows(self.server_log)), "move_base")
        return self

    def __exit__(self, *_: object) -> None:
        for process in [*self.clients, *reversed(self.processes.values())]:
            _end(process)
        for out in self._outs:
            out.close()

    def start(self, name: str) -> None:
        """Start a process of the robot."""
        bridge = self.checkout / "rosbridge_server" / "scripts" / "rosbridge_websocket.py"
        stand_in = [ROS_PYTHON, str(HERE / "stand_in.py")]
        commands = {
            "core": ["roscore", "-p", str(self.master)],
            "bridge": [ROS_PYTHON, str(bridge), "--address", "127.0.0.1", "--port", str(self.port)],
            "body": [*stand_in, "body", "--log", str(self.body_log), "--map-hz", str(self.map_hz)],
            "move_base": [*stand_in, "move_base", "--log", str(self.server_log), "--speed", str(self.speed)],
            "proxy": [sys.executable, str(HERE / "proxy.py"), str(self.near), str(self.port)],
            "watchdog": [ROS_PYTHON, str(HERE.parents[1] / "src" / "avlmaps_ros" / "watchdog.py")],
        }
        out = (self.folder / f"{name}.out").open("a")
        self._outs.append(out)
        environment = dict(os.environ) if name == "proxy" else self._ros
        self.processes[name] = subprocess.Popen(
            commands[name], stdin=subprocess.PIPE, stdout=out, stderr=out, text=True, env=environment,
            start_new_session=True,
        )  # fmt: skip

    def kill(self, name: str, number: int = signal.SIGKILL) -> None:
        """Send a signal to a process of the robot, and to those it started."""
        os.killpg(self.processes[name].pid, number)
        if number in (signal.SIGKILL, signal.SIGTERM):
            self.processes[name].wait(20.0)

    def way(self, order: str) -> None:
        """Give the proxy an order."""
        pipe = self.processes["proxy"].stdin
        assert pipe is not None
        pipe.write(order + "\n")
        pipe.flush()

    def mode(self, node: str, word: str) -> None:
        """Tell the body or move_base how to behave."""
        topic = {"body": "/body/mode", "move_base": "/move_base/mode"}[node]
        self._ros_run("rostopic", "pub", "-1", topic, "std_msgs/String", word)

    def operate(self, x: float, y: float, name: str = "rviz") -> None:
        """Send a goal as an operator does."""
        goal = (
            f"{{goal_id: {{id: {name}}}, goal: {{target_pose: {{header: {{frame_id: map}}, "
            f"pose: {{position: {{x: {x}, y: {y}}}, orientation: {{w: 1.0}}}}}}}}}}"
        )
        self._ros_run("rostopic", "pub", "-1", "/move_base/goal", "move_base_msgs/MoveBaseActionGoal", goal)

    def operate_stop(self) -> None:
        """Cancel every goal, as an operator does."""
        self._ros_run("rostopic", "pub", "-1", "/move_base/cancel", "actionlib_msgs/GoalID", "{}")

    def _ros_run(self, *words: str) -> None:
        subprocess.run(words, env=self._ros, check=True, capture_output=True, timeout=30.0)

    def client(self, what: str, settings: dict[str, Any] | None = None) -> "Client":
        """Start a program of a user's; ``AVLMAPS_SRC`` names other sources than those of these tests."""
        words = [sys.executable, str(HERE / "client.py"), self.url, what]
        if settings is not None:
            file = self.folder / f"robot{len(self.clients)}.json"
            file.write_text(json.dumps({"settings": settings}))
            words.append(str(file))
        return self._client(words)

    def command(self, sentence: str) -> "Client":
        """Start `avlmaps go` on the map of a room, in the middle of which the body begins."""
        sys.path.insert(0, str(HERE.parent))
        from helpers.walked_room import write_walk

        program = [sys.executable, "-c", "from avlmaps.cli import main; main()"]
        walk, room, file = write_walk(self.folder / "walk"), self.folder / "room.avlmap", self.folder / "room.json"
        built = [*program, "build", str(walk), "--out", str(room), "--voxel-size-m", "0.1", "--profile", "colours"]
        subprocess.run(built, check=True, capture_output=True, env=_ours())
        file.write_text(json.dumps({"map_from_avlmap": {"x_m": -4.4, "y_m": -3.2}}))
        robot = ["--robot", "move_base", "--ros", self.url, "--ros-frames", str(file), "--json"]
        return self._client([*program, "go", str(room), sentence, *robot])

    def _client(self, words: list[str]) -> "Client":
        client = Client(words, _ours(), self.folder / f"client{len(self.clients)}.jsonl")
        self.clients.append(client.process)
        return client

    # What the body really did.

    def rows(self, log: Path | None = None) -> list[dict[str, Any]]:
        """Return the lines of a log, the body's by default."""
        return _rows(log or self.body_log)

    def moves(self, row: dict[str, Any] | None = None) -> bool:
        """Return whether the body moves, now by default."""
        row = row or next((row for row in reversed(self.rows()) if row["kind"] == "body"), None)
        return row is not None and (abs(row["v"]) > MOVES_M_S or abs(row["w"]) > MOVES_RAD_S)

    def stood_after(self, since: float) -> float | None:
        """Return how many seconds after a time the body moved last; None where it still does."""
        rows = [row for row in self.rows() if row["kind"] == "body"]
        if not rows or self.moves(rows[-1]):
            return None
        moving = [row["t"] for row in rows if self.moves(row)]
        return max(0.0, moving[-1] - since) if moving else 0.0

    def until_moving(self, within_s: float = 40.0) -> None:
        """Wait until the body drives ahead."""
        self.until(
            lambda: abs(next(r for r in reversed(self.rows()) if r["kind"] == "body")["v"]) > 0.2, "motion", within_s
        )

    def until_standing(self, within_s: float) -> bool:
        """Wait until the body stands; return whether it does."""
        until_s = monotonic() + within_s
        while self.moves() and monotonic() < until_s:
            sleep(0.05)
        return not self.moves()

    def until(self, holds: Callable[[], bool], what: str, within_s: float = 60.0) -> None:
        """Wait until something holds."""
        until_s = monotonic() + within_s
        while not holds():
            if monotonic() > until_s:
                raise TimeoutError(f"no {what} within {within_s:g} s; see {self.folder}")
            sleep(0.05)


class Client:
    """A program of a user's."""

    def __init__(self, words: list[str], environment: dict[str, str], out: Path) -> None:
        self.out = out
        self._file = out.open("w")
        self._errors = out.with_suffix(".err").open("w")
        self.process = subprocess.Popen(
            words, stdin=subprocess.PIPE, stdout=self._file, stderr=self._errors, text=True, env=environment
        )

    def rows(self) -> list[dict[str, Any]]:
        """Return what it claimed."""
        return _rows(self.out)

    def tell(self, line: str) -> None:
        """Give it an order."""
        assert self.process.stdin is not None
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()

    def said(self, kind: str, within_s: float, count: int = 1) -> dict[str, Any] | None:
        """Wait for a claim; None where it does not come."""
        until_s = monotonic() + within_s
        while monotonic() < until_s:
            rows = [row for row in self.rows() if row["kind"] == kind]
            if len(rows) >= count:
                return rows[count - 1]
            if self.process.poll() is not None and not any(row["kind"] == kind for row in self.rows()):
                return None
            sleep(0.05)
        return None


def _rows(path: Path) -> list[dict[str, Any]]:
    rows = []
    for line in path.read_text().splitlines() if path.exists() else []:
        try:
            rows.append(json.loads(line))
        except ValueError:
            continue
    return rows


def _answers(port: int) -> bool:
    with socket.socket() as tried:
        tried.settimeout(0.5)
        return tried.connect_ex(("127.0.0.1", port)) == 0


def _end(process: "subprocess.Popen[str]") -> None:
    """End a process that this field started, and those that it started."""
    for number in (signal.SIGCONT, signal.SIGTERM, signal.SIGKILL):
        if process.poll() is not None:
            return
        try:
            os.killpg(process.pid, number) if os.getpgid(process.pid) == process.pid else process.send_signal(number)
        except ProcessLookupError:
            return
        if number is not signal.SIGCONT:
            try:
                process.wait(3.0)
            except subprocess.TimeoutExpired:
                continue


now = time
