"""The watchdog's laws: a goal of ours without heartbeats is cancelled, in time, and nobody else's ever is."""

import ast
import subprocess
import sys
import types
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps_ros import watchdog
from avlmaps_ros.watchdog import AGAIN_S, LOOK_EVERY_S, Watch, main

OURS, THEIRS = "avlmaps-" + "0a" * 16, "0b" * 16
# The name under which a server lists our goal: ours, its digits, or a name of the bridge's own.
NAMES = {"move_base": OURS, "native": "0a" * 16, "rosbridge": "0c" * 16}


class Robot:
    """A server with goals, a client that beats, and a watchdog that looks; time passes in steps of a look."""

    def __init__(self, silence_s: float = 2.0) -> None:
        self.watch, self.now_s = Watch(silence_s), 100.0
        self.goals: list[str] = []
        self.cancelled: list[tuple[float, str]] = []

    def run(self, seconds: float, beats: str = "", every_s: float = 0.5) -> None:
        for step in range(round(seconds / LOOK_EVERY_S)):
            if beats and step % round(every_s / LOOK_EVERY_S) == 0:
                self.watch.beat(beats, self.now_s)
            self.watch.active("server", self.goals, self.now_s)
            for _, goal in self.watch.due(self.now_s):
                self.cancelled.append((self.now_s, goal))
            self.now_s += LOOK_EVERY_S


@pytest.mark.parametrize("name", NAMES.values(), ids=NAMES)
@given(beaten_s=st.floats(0.5, 20.0), silence_s=st.floats(1.0, 10.0))
def test_a_goal_of_ours_is_cancelled_soon_after_its_last_heartbeat_and_again_until_it_is_over(
    name, beaten_s, silence_s
):
    robot = Robot(silence_s)
    robot.goals = [name]
    robot.run(beaten_s, OURS)
    assert not robot.cancelled
    last_s = robot.watch._beats[OURS][1]
    robot.run(silence_s + 3.0)
    times = [at_s for at_s, goal in robot.cancelled if goal == name]
    assert silence_s < times[0] - last_s <= silence_s + 2 * LOOK_EVERY_S
    assert 3 <= len(times) <= 5
    assert min(after - before for before, after in pairwise(times)) >= AGAIN_S - 1e-6
    robot.goals = []
    count = len(robot.cancelled)
    robot.run(5.0)
    assert len(robot.cancelled) == count


@given(started_s=st.floats(0.0, 10.0), beaten_s=st.floats(0.0, 10.0))
@pytest.mark.parametrize("name", NAMES.values(), ids=NAMES)
def test_a_goal_of_an_operator_is_never_cancelled(name, started_s, beaten_s):
    robot = Robot()
    robot.goals = [name]
    robot.run(0.5 + started_s, OURS)
    robot.goals = [THEIRS]  # sent in RViz: it ends ours, and the driver stops beating
    robot.run(beaten_s, OURS)
    robot.run(8.0)
    assert THEIRS not in {goal for _, goal in robot.cancelled}


def test_a_goal_that_was_there_long_before_our_heartbeats_is_not_ours():
    robot = Robot()
    robot.goals = [THEIRS]
    robot.run(10.0)
    robot.run(1.0, OURS)
    robot.run(10.0)
    assert not robot.cancelled


@pytest.mark.parametrize("name", NAMES.values(), ids=NAMES)
def test_a_watchdog_that_starts_in_mid_drive_finds_our_goal(name):
    robot = Robot()
    robot.goals = [name]
    robot.run(1.0, OURS)
    robot.run(4.0)
    assert {goal for _, goal in robot.cancelled} == {name}


def test_the_exact_name_of_a_goal_outweighs_when_it_was_seen():
    robot = Robot()
    robot.goals = [THEIRS]
    robot.run(0.3, OURS)
    robot.goals = [THEIRS, NAMES["native"]]
    robot.run(0.5, OURS)
    robot.run(5.0)
    assert {goal for _, goal in robot.cancelled} == {NAMES["native"]}


@given(
    st.lists(
        st.one_of(
            st.tuples(st.just("beat"), st.text(max_size=3)),
            st.tuples(st.just("goals"), st.lists(st.text(max_size=3), max_size=4, unique=True)),
            st.tuples(st.just("wait"), st.floats(0, 100)),
        ),
        max_size=40,
    )
)
def test_only_goals_that_are_under_way_are_cancelled_whatever_arrives(events):
    watch, now_s, goals = Watch(2.0), 0.0, []
    for kind, what in events:
        if kind == "beat":
            watch.beat(what, now_s)
        elif kind == "goals":
            goals = what
            watch.active("server", goals, now_s)
        else:
            now_s += what
        assert {goal for _, goal in watch.due(now_s)} <= set(goals)


def test_names_of_thousands_of_goals_do_not_pile_up():
    watch = Watch(2.0)
    for number in range(2000):
        watch.beat(str(number), float(number))
        watch.active("server", [str(number)], float(number))
        watch.due(float(number))
    assert max(len(watch._beats), len(watch._spent), len(watch._owner), len(watch._asked_s)) <= watchdog.MOST


def test_the_file_runs_alone_on_an_older_python():
    source = Path(watchdog.__file__).read_text()
    tree = ast.parse(source, feature_version=(3, 8))
    imported = {
        (node.module or "").split(".")[0] if isinstance(node, ast.ImportFrom) else node.names[0].name
        for node in tree.body
        if isinstance(node, (ast.Import, ast.ImportFrom))
    }
    assert imported <= {"__future__", *sys.stdlib_module_names}
    done = subprocess.run(
        [sys.executable, "-S", watchdog.__file__, "--help"], capture_output=True, text=True, check=True
    )
    assert "--silence" in done.stdout


def test_without_ros_one_sentence_says_what_to_source(monkeypatch, capsys):
    monkeypatch.setattr(watchdog, "find_spec", lambda name: None)
    with pytest.raises(SystemExit) as ended:
        main(["avlmaps-watchdog"])
    assert ended.value.code == 2
    assert "has no rclpy; source ROS's setup.bash" in capsys.readouterr().err


@pytest.mark.parametrize("silence", ["0", "nan", "-1", "1000"])
def test_a_silence_that_is_a_slip_of_the_unit_is_refused(silence, capsys):
    with pytest.raises(SystemExit):
        main(["avlmaps-watchdog", f"--silence={silence}"])
    assert "from 0.2 to 60" in capsys.readouterr().err


def test_in_ros1_the_goal_is_cancelled_by_its_id(monkeypatch):
    """Hold the wiring to rospy's interface; the laws are tested above."""
    heard, sent, rounds = {}, [], iter(range(40))
    rospy = types.SimpleNamespace(
        init_node=lambda name, argv: None,
        Subscriber=lambda topic, kind, hear: heard.__setitem__(topic, hear),
        Publisher=lambda topic, kind, queue_size: types.SimpleNamespace(
            publish=lambda said: sent.append((topic, said))
        ),
        loginfo=lambda *words: None,
        logwarn=lambda *words: None,
        is_shutdown=lambda: next(rounds, None) is None,
    )
    listed = types.SimpleNamespace(goal_id=types.SimpleNamespace(id=OURS), status=1)
    clock = iter(range(1000))

    def passes(_seconds: float) -> None:
        round_ = next(clock)
        if round_ < 3:
            heard["avlmaps/heartbeat"](types.SimpleNamespace(data=OURS))
        heard["move_base/status"](types.SimpleNamespace(status_list=[listed]))

    monkeypatch.setitem(sys.modules, "rospy", rospy)
    messages = types.SimpleNamespace(GoalID=lambda id: {"id": id}, GoalStatusArray=None)
    monkeypatch.setitem(sys.modules, "actionlib_msgs", types.SimpleNamespace(msg=messages))
    monkeypatch.setitem(sys.modules, "actionlib_msgs.msg", messages)
    monkeypatch.setitem(sys.modules, "std_msgs", types.SimpleNamespace())
    monkeypatch.setitem(sys.modules, "std_msgs.msg", types.SimpleNamespace(String=None))
    monkeypatch.setattr(watchdog.time, "sleep", passes)
    ticks = iter(range(10_000))
    monkeypatch.setattr(watchdog.time, "monotonic", lambda: 0.05 * next(ticks))
    watchdog.run_ros1(Watch(2.0), ["avlmaps-watchdog"])
    assert sent and set(map(str, sent)) == {str(("move_base/cancel", {"id": OURS}))}


def test_the_part_of_a_dead_navigator_is_cancelled_and_that_of_an_operator_is_not():
    watch = Watch(2.0)
    watch.beat("avlmaps-0a", 0.0)
    watch.active("navigate_to_pose", ["0a"], 0.1)
    watch.active("follow_path", ["0b"], 0.2)
    watch.beat("avlmaps-0a over", 3.0)
    assert ("follow_path", "0b") in watch.due(3.0)
    watch.active("navigate_to_pose", ["0c"], 4.0)
    watch.active("follow_path", ["0d"], 4.1)
    assert not {("navigate_to_pose", "0c"), ("follow_path", "0d")} & set(watch.due(9.0))


def test_a_goal_after_the_end_of_ours_is_not_taken_for_it():
    watch = Watch(2.0)
    watch.beat("avlmaps-0a", 0.0)
    watch.beat("avlmaps-0a over", 1.0)
    watch.active("navigate_to_pose", ["ff"], 1.5)
    assert not watch.due(9.0)


def test_the_watchdog_of_the_package_needs_nothing_but_ros():
    """As ``pip install --no-deps`` puts it on a robot."""
    hidden = "import sys; sys.modules.update(dict.fromkeys(['numpy', 'msgspec', 'jaxtyping', 'twisted', 'avlmaps']))"
    done = subprocess.run([sys.executable, "-c", f"{hidden}; import avlmaps_ros.watchdog"], check=False)
    assert done.returncode == 0


def test_a_ros_that_lacks_a_package_is_told_in_one_sentence(monkeypatch, capsys):
    def lacks(*_: object) -> None:
        raise ImportError("No module named 'std_msgs'")

    monkeypatch.setattr(watchdog, "find_spec", lambda _: object())
    monkeypatch.setattr(watchdog, "run_ros2", lacks)
    with pytest.raises(SystemExit) as ended:
        main(["avlmaps-watchdog"])
    assert ended.value.code == 2
    assert "lacks a package of ROS (No module named 'std_msgs')" in capsys.readouterr().err
