"""A watchdog on the robot: cancels a goal of avlmaps when its heartbeats end before it does.

Nav2 and move_base finish a goal on their own, also when the client that sent it is gone. While a goal is active
avlmaps publishes its id on ``avlmaps/heartbeat``. This node runs on the robot, where no network lies between it and the
action servers. It cancels the goal, and no other, after ``--silence`` seconds without that id.

This file needs ROS and the standard library, nothing else, and runs from Python 3.8 on: a robot with an older Python
than the rest of avlmaps needs runs a copy of it, ``python3 watchdog.py``.
"""

# pyright: reportMissingImports=false
from __future__ import annotations

import argparse
import signal
import sys
import threading
import time
from importlib.util import find_spec

ACTIONS = ("navigate_to_pose", "spin", "drive_on_heading")
PARTS = ("follow_path",)
"""Actions of Nav2 that do parts of the goals above: its controller drives on when its navigator is dead."""
LOOK_EVERY_S = 0.1
AGAIN_S = 1.0  # a cancel is sent again after this time, until the goal is over
BEFORE_S, AFTER_S = 1.0, 5.0
"""A goal of another name is ours where it was first seen between its first heartbeat and its last one, or so near."""
MOST = 200


class Watch:
    """Which goals are ours, and which of them nobody watches any more. Times are seconds of any one clock."""

    def __init__(self, silence_s: float) -> None:
        """Take how long a goal may go without a heartbeat."""
        self.silence_s = silence_s
        self._beats: dict[str, list[float]] = {}  # name of a goal: first and last heartbeat
        self._goals: dict[str, dict[str, float]] = {}  # server: goal: when it was first seen
        self._owner: dict[str, str] = {}  # goal: name under which its heartbeats come
        self._spent: set[str] = set()  # names that a goal has, or had
        self._asked_s: dict[str, float] = {}

    def beat(self, text: str, now_s: float) -> None:
        """Take in a heartbeat: the name of a goal, with another word when that is over: it names no further goal."""
        name, _, is_over = text.partition(" ")
        if is_over:
            self._spent.update({name} & set(self._beats))
            return
        self._beats.setdefault(name, [now_s, now_s])[1] = now_s
        while len(self._beats) > MOST:
            oldest = min(self._beats, key=lambda one: self._beats[one][1])
            del self._beats[oldest]
            self._spent.discard(oldest)

    def active(self, server: str, goals: list[str], now_s: float) -> None:
        """Take in all goals that a server is at."""
        before = self._goals.get(server, {})
        self._goals[server] = {goal: before.get(goal, now_s) for goal in goals}
        if server in PARTS:
            self._own_parts([goal for goal in goals if goal not in before])
        for goal in before:
            if goal not in goals:
                self._owner.pop(goal, None)
                self._asked_s.pop(goal, None)

    def due(self, now_s: float) -> list[tuple[str, str]]:
        """Return the goals to cancel now, each with its server."""
        self._own()
        found = []
        for server, goals in self._goals.items():
            for goal in goals:
                name = self._owner.get(goal)
                silent = name is not None and now_s - self._beats.get(name, [0.0, -1e9])[1] > self.silence_s
                if silent and now_s - self._asked_s.get(goal, -1e9) >= AGAIN_S:
                    self._asked_s[goal] = now_s
                    found.append((server, goal))
        return found

    def _own_parts(self, begun: list[str]) -> None:
        self._own()
        whole = {goal: at_s for name, goals in self._goals.items() if name not in PARTS for goal, at_s in goals.items()}
        if whole and all(goal in self._owner for goal in whole):
            self._owner.update(dict.fromkeys(begun, self._owner[max(whole, key=lambda goal: whole[goal])]))

    def _own(self) -> None:
        """Find out which goals are ours.

        A native driver and move_base give a goal our name. rosbridge gives a goal of Nav2 a name of its own; the goal
        that was first seen when heartbeats of a new name began is ours. A name is given once: a goal that ends ours is
        not ours.
        """
        seen = {goal: at_s for name, goals in self._goals.items() if name not in PARTS for goal, at_s in goals.items()}
        for goal in seen:
            for name in self._beats:
                if name == goal or name.endswith("-" + goal):
                    self._owner = {one: owner for one, owner in self._owner.items() if owner != name or one not in seen}
                    self._owner[goal] = name
                    self._spent.add(name)
        for goal, seen_s in sorted(seen.items(), key=lambda item: item[1]):
            for name, (first_s, last_s) in self._beats.items():
                near = first_s - BEFORE_S <= seen_s <= last_s + AFTER_S
                if near and goal not in self._owner and name not in self._spent:
                    self._owner[goal] = name
                    self._spent.add(name)


def run_ros2(watch: Watch, words: list[str]) -> None:
    """Watch Nav2's actions until the process ends."""
    import rclpy
    from action_msgs.msg import GoalStatusArray
    from action_msgs.srv import CancelGoal
    from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
    from std_msgs.msg import String

    watched = (*ACTIONS, *PARTS)
    rclpy.init(args=words)
    ended = threading.Event()  # the handlers of rclpy end ROS beneath a step, which then raises or waits for ever
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: ended.set())
    node = rclpy.create_node("avlmaps_watchdog")
    log = node.get_logger()
    cancels = {name: node.create_client(CancelGoal, f"{name}/_action/cancel_goal") for name in watched}

    def heard(message: String) -> None:
        watch.beat(message.data, time.monotonic())

    def status(name: str, message: GoalStatusArray) -> None:
        under_way = [bytes(one.goal_info.goal_id.uuid).hex() for one in message.status_list if one.status in (1, 2, 3)]
        watch.active(name, under_way, time.monotonic())

    def look() -> None:
        for name, goal in watch.due(time.monotonic()):
            log.warning(f"heartbeats of goal {goal} ended: {name} must cancel it")
            request = CancelGoal.Request()
            request.goal_info.goal_id.uuid = list(bytes.fromhex(goal))
            cancels[name].call_async(request)

    heartbeats = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)  # takes reliable ones as well
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    node.create_subscription(String, "avlmaps/heartbeat", heard, heartbeats)
    for name in watched:
        node.create_subscription(
            GoalStatusArray, f"{name}/_action/status", lambda message, name=name: status(name, message), latched
        )
    node.create_timer(LOOK_EVERY_S, look)
    log.info(f"watching {', '.join(ACTIONS)}: a goal without a heartbeat for {watch.silence_s:g} s is cancelled")
    try:
        while not ended.is_set():
            rclpy.spin_once(node, timeout_sec=LOOK_EVERY_S)
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


def run_ros1(watch: Watch, words: list[str]) -> None:
    """Watch move_base until the process ends."""
    import rospy
    from actionlib_msgs.msg import GoalID, GoalStatusArray
    from std_msgs.msg import String

    rospy.init_node("avlmaps_watchdog", argv=words)
    cancel = rospy.Publisher("move_base/cancel", GoalID, queue_size=10)

    def heard(message: String) -> None:
        watch.beat(message.data, time.monotonic())

    def status(message: GoalStatusArray) -> None:
        under_way = [one.goal_id.id for one in message.status_list if one.status in (0, 1, 6, 7)]
        watch.active("move_base", under_way, time.monotonic())

    rospy.Subscriber("avlmaps/heartbeat", String, heard)
    rospy.Subscriber("move_base/status", GoalStatusArray, status)
    rospy.loginfo("watching move_base: a goal without a heartbeat for %g s is cancelled", watch.silence_s)
    while not rospy.is_shutdown():
        for _, goal in watch.due(time.monotonic()):
            rospy.logwarn("heartbeats of goal %s ended: move_base must cancel it", goal)
            cancel.publish(GoalID(id=goal))
        time.sleep(LOOK_EVERY_S)


def main(words: list[str] | None = None) -> None:
    """Run the node of the ROS that this Python has; words that are not options here go to ROS."""
    words = sys.argv if words is None else words
    reader = argparse.ArgumentParser(
        prog="avlmaps-watchdog",
        description="A ROS node on the robot that cancels a goal of avlmaps when its heartbeats end before it does.",
        epilog="ROS's own arguments follow: --ros-args -r __ns:=/robot1 (ROS 2), __ns:=/robot1 (ROS 1).",
    )
    reader.add_argument(
        "--silence", type=float, default=2.0, metavar="S", help="longest time without a heartbeat, seconds (default 2)"
    )
    reader.add_argument("--ros", choices=("1", "2"), help="version of ROS; by default the one that this Python has")
    given, rest = reader.parse_known_args(words[1:])
    if not 0.2 <= given.silence <= 60.0:
        reader.error(f"--silence is {given.silence:g} s; it is from 0.2 to 60, several times the heartbeat's 0.5")
    version = given.ros or ("2" if find_spec("rclpy") else "1" if find_spec("rospy") else "")
    needed = {"2": "rclpy", "1": "rospy", "": "rclpy"}[version]
    if not find_spec(needed):
        reader.error(
            f"this Python ({sys.executable}) has no {needed}; source ROS's setup.bash and run it with the Python of ROS"
        )
    run = run_ros2 if version == "2" else run_ros1
    try:
        run(Watch(given.silence), [words[0], *rest])
    except ImportError as fault:
        reader.error(f"this Python ({sys.executable}) lacks a package of ROS ({fault}); install it beside {needed}")


if __name__ == "__main__":
    main()
