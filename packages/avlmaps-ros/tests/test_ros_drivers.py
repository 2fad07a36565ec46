"""Nav2 and move_base, driven over a websocket: a robot of the test's own obeys, fails, hangs, lies and vanishes."""

import _thread
import os
import signal
from math import pi
from socket import create_server
from time import monotonic, sleep

import numpy as np
import pytest
from ros_bridge import FakeRobot, in_thread, reactor
from twisted.internet.threads import blockingCallFromThread

from avlmaps.core.errors import NavigationError
from avlmaps.core.motion import GroundPose, wrap_angle
from avlmaps.core.poses import rotation_to_level
from avlmaps.maps.obstacles import CellState, Obstacles
from avlmaps.navigate.driver import Driver
from avlmaps_ros import Frames, GroundTransform, RosSettings, open_ros_driver
from avlmaps_ros.goals import ActionGoal, End, SentGoal
from avlmaps_ros.guard import GoalGuard, Orders

pytestmark = pytest.mark.timeout(60)

KINDS = [(2, "nav2"), (1, "move_base")]
# Patience that no test uses up where all goes well, though the machine may stand still for seconds beneath it.
QUICK = RosSettings(
    goal_timeout_s=20.0,
    answer_timeout_s=20.0,
    cancel_timeout_s=10.0,
    connect_timeout_s=20.0,
    pose_timeout_s=20.0,
    pose_max_age_s=10.0,
    stall_s=30.0,
)
PLACE = np.array([2.0, 1.0, 0.4])


def quick(**changes: float) -> RosSettings:
    from msgspec.structs import replace

    return replace(QUICK, **changes)


def opened(robot: FakeRobot, **given):
    given.setdefault("settings", QUICK)
    return open_ros_driver("move_base" if robot.ros == 1 else "nav2", robot.url, given.pop("frames", None), **given)


@pytest.fixture(params=[ros for ros, _ in KINDS], ids=[kind for _, kind in KINDS])
def robot(request):
    with FakeRobot(request.param) as robot:
        yield robot


def goals(robot: FakeRobot) -> list[dict]:
    if robot.ros == 2:
        return [sent["args"] for sent in robot.ops("send_action_goal")]
    sent = {said["goal_id"]["id"]: said["goal"] for said in robot.published("/move_base/goal")}  # some are said twice
    return list(sent.values())


def cancels(robot: FakeRobot) -> int:
    return len(robot.ops("cancel_action_goal")) + len(robot.published("/move_base/cancel"))


def test_a_goal_is_reached_and_the_pose_comes_back_as_the_place_that_was_asked_for(robot):
    with opened(robot) as driver:
        assert isinstance(driver, Driver)
        arrival = driver.go_to(PLACE)
        assert arrival.reached, arrival.note
        assert arrival.note == ""
        assert arrival.pose.distance_m(GroundPose(2.0, 1.0)) < 1e-6
        assert arrival.pose.heading_rad == pytest.approx(np.arctan2(1.0, 2.0))  # the way it came
        np.testing.assert_allclose(arrival.path[0], [0.0, 0.0], atol=1e-6)
        np.testing.assert_allclose(arrival.path[-1], [2.0, 1.0], atol=0.06)
        assert arrival.actions == ()
        assert len(goals(robot)) == 1


@pytest.mark.few(1)
@pytest.mark.parametrize("seed", range(3))
def test_goals_and_poses_pass_through_the_frames_and_the_tilted_world(robot, seed):
    rng = np.random.default_rng(seed)
    lie = GroundTransform(*rng.uniform(-5, 5, 3))
    level_from_world = rotation_to_level(np.array([0.3, -0.2, 1.0]))
    robot.frames = ("world", "odom", "base_footprint")
    robot.pose = GroundPose(*rng.uniform(-3, 3, 3))
    frames = Frames("/world", "base_footprint", lie)
    level = np.array([*rng.uniform(-3, 3, 2), 0.1])
    faced = np.array([*rng.uniform(-3, 3, 2), 1.1])
    with opened(robot, frames=frames, level_from_world=level_from_world) as driver:
        begun = lie.inverse().pose(robot.pose)
        assert driver.pose.distance_m(begun) < 1e-6
        arrival = driver.go_to(level_from_world.T @ level, face=level_from_world.T @ faced)
    assert arrival.reached, arrival.note
    looked = np.arctan2(*(faced - level)[1::-1])
    assert arrival.pose.distance_m(GroundPose(*level[:2])) < 1e-6
    assert abs(wrap_angle(arrival.pose.heading_rad - looked)) < 1e-6
    expected = lie.pose(GroundPose(level[0], level[1], looked))  # what the robot itself was told
    assert robot.pose.distance_m(expected) < 1e-6
    assert abs(wrap_angle(robot.pose.heading_rad - expected.heading_rad)) < 1e-6


@pytest.mark.parametrize(
    ("does", "says"),
    [
        ("abort", "gave up"),
        ("reject", "refused the goal (Action goal was rejected)"),
        ("cancelled elsewhere", "was cancelled"),
        ("lie", "says that it arrived, but it stands 2.24 m from where it was sent"),
    ],
)
def test_failure_is_an_ordinary_result_that_says_why(robot, does, says):
    with opened(robot) as driver:
        robot.does[""] = does
        arrival = driver.go_to(PLACE)
        assert not arrival.reached
        assert says in arrival.note
        assert "\n" not in arrival.note
        assert arrival.pose.distance_m(GroundPose(0.0, 0.0)) < 1e-6
        robot.does[""] = "succeed"
        assert driver.go_to(PLACE).reached  # and the next goal is none the worse for it


def test_the_reason_that_nav2_gives_is_told_in_words():
    with FakeRobot(2, "abort") as robot, opened(robot) as driver:
        assert "no path leads there on its own map" in driver.go_to(PLACE).note


@pytest.mark.parametrize("does", ["succeed", "abort"])
def test_results_of_old_bridges_are_read_as_well(does):
    with FakeRobot(2, does) as robot, opened(robot) as driver:
        robot.does["format"] = "old"
        assert driver.go_to(PLACE).reached == (does == "succeed")


def test_an_action_server_that_is_not_there_is_told_at_once():
    with FakeRobot(2, "no server") as robot, opened(robot) as driver:
        arrival = driver.go_to(PLACE)
        assert not arrival.reached
        assert "start Nav2" in arrival.note


def test_silence_is_no_answer(robot):
    robot.does[""] = "silent"
    with opened(robot, settings=quick(answer_timeout_s=0.5, cancel_timeout_s=1.0)) as driver:
        arrival = driver.go_to(PLACE)
        assert not arrival.reached
        assert "Nothing answers" in arrival.note and "within 0.5 s" in arrival.note
        assert robot.soon(lambda: cancels(robot) > 0)


def test_a_goal_that_times_out_unanswered_is_not_taken_for_one_that_nobody_took():
    settings = quick(goal_timeout_s=0.3, cancel_timeout_s=0.5)
    with FakeRobot(2, "mute") as robot, opened(robot, settings=settings) as driver:
        arrival = driver.go_to(PLACE)
        assert not arrival.reached
        assert "may still be driving" in arrival.note
        assert not driver._absent


def test_a_goal_that_takes_too_long_is_cancelled(robot):
    robot.does[""] = "drive on"
    with opened(robot, settings=quick(goal_timeout_s=2.0)) as driver:
        robot.moves_on = True
        arrival = driver.go_to(np.array([50.0, 0.0, 0.0]))
        assert not arrival.reached
        assert "not done within 2 s" in arrival.note
        assert "may still be driving" not in arrival.note
        assert not robot.moves_on
        assert len(arrival.path) > 2  # it is told how far it came
        assert (np.diff(arrival.path[:, 0]) >= 0).all()


def test_a_goal_that_the_bridge_has_forgotten_is_cancelled_by_the_name_that_nav2_gave_it():
    settings = quick(goal_timeout_s=1.5, cancel_timeout_s=2.0)
    with FakeRobot(2, "deaf to ids") as robot, opened(robot, settings=settings) as driver:
        arrival = driver.go_to(PLACE)
        assert not arrival.reached
        assert "may still be driving" not in arrival.note
        assert all(goal["status"] in (2, 5) for goal in robot.goals.values()), robot.goals


def test_a_list_from_before_a_goal_does_not_say_that_it_is_over():
    settings = quick(goal_timeout_s=2.0, cancel_timeout_s=1.0)
    with FakeRobot(2) as robot, opened(robot, settings=settings) as driver:
        assert driver.go_to(PLACE).reached
        robot.does[""], robot.listing = "deaf to ids", False
        driver.go_to(2 * PLACE)
        assert driver.owes or all(goal["status"] != 1 for goal in robot.goals.values())


def test_a_robot_that_will_not_stop_is_told_of(robot):
    robot.does[""] = "stubborn"
    with opened(robot, settings=quick(goal_timeout_s=0.5, cancel_timeout_s=1.0)) as driver:
        robot.moves_on = True
        assert "may still be driving" in driver.go_to(PLACE).note
        stopped = driver.stop()
        assert not stopped.reached
        assert "pose changes or is lost" in stopped.note


def test_a_connection_lost_on_the_way_calls_the_goal_off_and_is_made_again_for_the_next(robot):
    with opened(robot) as driver:
        robot.does[""] = "disconnect"
        arrival = driver.go_to(PLACE)
        assert not arrival.reached
        assert "connection to the robot was lost" in arrival.note
        assert "stopped" in arrival.note
        assert robot.soon(lambda: all(goal["status"] in (2, 5) for goal in robot.goals.values()))
        robot.does[""] = "succeed"
        assert driver.go_to(PLACE).reached


def test_a_robot_that_is_gone_is_an_ordinary_result_and_its_last_pose_is_kept(robot):
    settings = quick(connect_timeout_s=1.0, goal_timeout_s=1.0, cancel_timeout_s=0.5)
    robot.pose = GroundPose(3.0, 4.0, 1.0)
    driver = opened(robot, settings=settings)
    robot.__exit__()
    try:
        assert robot.soon(lambda: driver._contact.session.lost is not None)
        for arrival in (driver.go_to(PLACE), driver.turn(1.0), driver.forward(1.0), driver.stop()):
            assert not arrival.reached
            assert arrival.note
            assert arrival.pose.distance_m(GroundPose(3.0, 4.0)) < 1e-6
        driver.close()
    finally:
        robot.__enter__()  # the fixture closes it


def test_nothing_malformed_stops_a_drive(robot):
    robot.does[""] = "malformed"
    with opened(robot) as driver:
        arrival = driver.go_to(PLACE)
        assert arrival.reached, arrival.note
        assert driver._contact.session.link.unread > 10


def test_a_message_too_large_ends_the_connection_and_not_the_process(robot):
    with opened(robot) as driver:
        robot.say(b'{"op": "publish", "topic": "/tf", "msg": "' + b"x" * 2_000_000 + b'"}')
        assert robot.soon(lambda: driver._contact.session.lost is not None)
        assert driver.go_to(PLACE).reached


@pytest.mark.parametrize("spoiled", [None, 1e300])
def test_a_robot_whose_pose_is_no_number_is_not_driven(robot, spoiled):
    with opened(robot, settings=quick(pose_max_age_s=0.3)) as driver:
        robot.spoiled = spoiled
        robot.soon(lambda: driver._contact.is_unseen())
        arrival = driver.go_to(PLACE)
        assert not arrival.reached
        assert "is not known" in arrival.note
        assert not goals(robot)


class Clock:
    """Seconds that pass when the test says so."""

    def __init__(self) -> None:
        self.now_s = 1000.0

    def __call__(self) -> float:
        return self.now_s


def driven_by(robot: FakeRobot, clock: Clock, **settings: float):
    """Open a driver of a robot by a test's clock."""
    kind = {1: "move_base", 2: "nav2"}[robot.ros]
    return open_ros_driver(kind, robot.url, settings=quick(**settings), clock=clock)


def test_a_lost_pose_cancels_after_the_age_that_is_set_and_not_before(robot):
    robot.does[""] = "drive on"
    clock = Clock()
    with driven_by(robot, clock, pose_max_age_s=RosSettings().pose_max_age_s, stall_s=60.0) as driver:
        thread, results = in_thread(lambda: driver.go_to(PLACE))
        assert robot.soon(lambda: bool(goals(robot)))
        robot.tf_on = False
        looks = len(robot.received)
        sleep(0.5)  # transforms on their way arrive
        clock.now_s += 2.9
        assert robot.soon(lambda: len(robot.received) > looks)  # the heartbeat: the loop has seen that time
        sleep(0.3)
        assert cancels(robot) == 0
        clock.now_s += 0.2
        thread.join(20.0)
        (arrival,) = results
    assert "is not known any more: its transforms are 3.1 s old" in arrival.note
    assert cancels(robot) > 0


def test_a_pose_that_jumps_ends_the_drive(robot):
    robot.does[""] = "drive on"
    with driven_by(robot, Clock(), stall_s=60.0) as driver:
        thread, results = in_thread(lambda: driver.go_to(PLACE))
        assert robot.soon(lambda: bool(goals(robot)))
        sleep(0.3)
        assert not results
        robot.pose = GroundPose(5.0, 3.0, 0.0)
        thread.join(20.0)
        (arrival,) = results
    assert not arrival.reached and "Its pose jumped by 5.8 m" in arrival.note
    assert cancels(robot) > 0


def test_a_loop_that_stood_still_cancels_its_goal(robot):
    robot.does[""] = "drive on"
    clock = Clock()
    with driven_by(robot, clock, stall_s=3.0, pose_max_age_s=60.0) as driver:
        thread, results = in_thread(lambda: driver.go_to(PLACE))
        assert robot.soon(lambda: bool(goals(robot)))
        clock.now_s += 3.5
        thread.join(20.0)
        (arrival,) = results
    assert "The watch over the goal stood still for 3.5 s" in arrival.note
    assert "may still be driving" not in arrival.note
    assert cancels(robot) > 0


def beats(robot: FakeRobot, namespace: str = "") -> list[str]:
    return [message["data"] for message in robot.published(f"{namespace}/avlmaps/heartbeat")]


def test_heartbeats_name_the_active_goal_and_end_with_it(robot):
    robot.does[""] = "drive on"
    clock = Clock()
    with driven_by(robot, clock, heartbeat_s=0.5, pose_max_age_s=60.0, stall_s=60.0) as driver:
        assert not beats(robot)
        thread, _ = in_thread(lambda: driver.go_to(PLACE))
        assert robot.soon(lambda: len(beats(robot)) == 1 and bool(goals(robot)))
        sleep(0.3)  # it is watched now
        for count in (2, 3):
            clock.now_s += 0.6
            assert robot.soon(lambda count=count: len(beats(robot)) == count)
        assert set(beats(robot)) == set(robot.goals)
        stopping, stopped = in_thread(driver.stop)
        while stopping.is_alive() or thread.is_alive():  # a body is seen to stand by the clock
            clock.now_s += 0.05
            sleep(0.05)
        assert stopped[0].reached, stopped[0].note
        count = len(beats(robot))
        clock.now_s += 10.0
        sleep(0.3)
        assert len(beats(robot)) == count
    kinds = {said["topic"]: said["type"] for said in robot.ops("advertise")}
    assert kinds["/avlmaps/heartbeat"] == ("std_msgs/String" if robot.ros == 1 else "std_msgs/msg/String")


def test_a_cancel_that_the_bridge_loses_is_sent_again():
    with FakeRobot(2, "drive on") as robot, opened(robot) as driver:
        take, lost = robot.take, []

        def loses_the_first(client, message):
            if len(lost) < 3 and message["op"] in ("cancel_action_goal", "call_service"):
                lost.append(message)
                return
            take(client, message)

        thread, results = in_thread(lambda: driver.go_to(PLACE))
        assert robot.soon(lambda: bool(goals(robot)))
        robot.take = loses_the_first
        driver._halted.set()
        thread.join(20.0)
        assert len(lost) == 3
        assert cancels(robot) >= 1
        assert "may still be driving" not in results[0].note


def test_nothing_waits_behind_a_goal_where_the_bridge_takes_one_message_after_the_other():
    with FakeRobot(2, "drive on") as robot, opened(robot) as driver:
        robot.blocks = True
        thread, results = in_thread(lambda: driver.go_to(PLACE))
        assert robot.soon(lambda: len(beats(robot)) >= 2)  # so that no watchdog ends the goal
        assert not driver._contact.is_unseen()
        stopped = driver.stop()
        assert stopped.reached, stopped.note
        thread.join(20.0)
        assert "may still be driving" not in results[0].note
        robot.does[""] = "succeed"
        assert driver.go_to(PLACE).reached


def test_a_behaviour_that_is_absent_blocks_nothing_and_is_not_blamed_on_nav2():
    with FakeRobot(2) as robot, opened(robot, settings=quick(answer_timeout_s=2.0)) as driver:
        robot.blocks = True
        robot.does["/spin"] = "silent"  # the bridge waits for ever for a server that is not there
        arrival = driver.turn(1.0)
        assert arrival.reached, arrival.note
        assert driver.go_to(PLACE).reached


def test_a_server_that_refuses_a_cancel_has_not_agreed():
    """The return code of CancelGoal counts, not that the call was answered."""
    with FakeRobot(2, "stubborn") as robot, opened(robot, settings=quick(cancel_timeout_s=3.0)) as driver:
        in_thread(lambda: driver.go_to(PLACE))
        assert robot.soon(lambda: bool(driver._contact.ear.servers.under_way().get("/navigate_to_pose")))
        stopped = driver.stop()
        assert not stopped.reached
        assert "does not give up its goal" in stopped.note


def test_nothing_is_sent_before_what_was_sent_is_known_to_be_over(robot):
    robot.does[""] = "stubborn"
    with opened(robot, settings=quick(goal_timeout_s=0.3, cancel_timeout_s=0.6)) as driver:
        assert "may still be driving" in driver.go_to(PLACE).note
        assert driver.owes
        count = len(goals(robot))
        assert "An earlier goal may still be driving" in driver.go_to(PLACE).note
        assert "an earlier goal may still" in driver.fault()
        assert not driver.halt().stopped
        assert len(goals(robot)) == count
        for goal in robot.goals.values():
            goal["does"] = "drive on"
        robot.does[""] = "succeed"
        assert driver.go_to(PLACE).reached
        assert not driver.owes


def test_a_robot_that_arrives_without_telling_where_has_not_arrived(robot):
    with opened(robot, settings=quick(pose_max_age_s=1.0)) as driver:
        robot.does[""] = "arrive unseen"
        arrival = driver.go_to(PLACE)
        assert not arrival.reached
        assert "says that it arrived, but its pose is not reported any more: its transforms are" in arrival.note


@pytest.mark.parametrize(
    ("frames", "says"),
    [
        (Frames("map", "base_footprint"), "no frame 'base_footprint'"),
        (Frames("earth"), "up to 'map' and not to 'earth'"),
    ],
)
def test_a_robot_that_never_tells_its_pose_cannot_be_opened(robot, frames, says):
    with pytest.raises(NavigationError, match=says) as error:
        opened(robot, frames=frames, settings=quick(pose_timeout_s=1.0))
    assert "base_link, laser, map, odom" in str(error.value)
    assert robot.soon(lambda: not robot.clients)  # and the connection is not left behind


@pytest.mark.few(3)
@pytest.mark.parametrize("angle", [pi / 2, -pi / 36, pi, -3.0, 5.0])
def test_a_turn_is_to_the_left_by_a_positive_angle(robot, angle):
    robot.pose = GroundPose(1.0, 2.0, 0.7)
    with opened(robot) as driver:
        arrival = driver.turn(angle)
    assert arrival.reached, arrival.note
    assert abs(wrap_angle(arrival.pose.heading_rad - 0.7 - angle)) < 1e-6
    assert arrival.pose.distance_m(GroundPose(1.0, 2.0)) < 1e-6


@pytest.mark.parametrize("distance_m", [0.1, 1.5])
def test_a_straight_drive_is_along_the_heading(robot, distance_m):
    robot.pose = GroundPose(1.0, 2.0, 0.7)
    with opened(robot, frames=Frames(map_from_avlmap=GroundTransform(4.0, 1.0, -2.0))) as driver:
        start = driver.pose
        arrival = driver.forward(distance_m)
    assert arrival.reached, arrival.note
    assert arrival.pose.distance_m(start.ahead(distance_m)) < 1e-6
    assert robot.pose.distance_m(GroundPose(1.0, 2.0, 0.7).ahead(distance_m)) < 1e-6


def test_a_drive_back_turns_round_first(robot):
    robot.pose = GroundPose(1.0, 2.0, 0.7)
    with opened(robot) as driver:
        arrival = driver.forward(-0.4)
        assert arrival.reached, arrival.note
        assert arrival.pose.distance_m(GroundPose(1.0, 2.0, 0.7).ahead(-0.4)) < 1e-6
        assert abs(wrap_angle(arrival.pose.heading_rad - 0.7 - pi)) < 1e-6
        robot.does[""] = "abort"
        count = len(goals(robot))
        assert not driver.forward(-0.4).reached
        assert len(goals(robot)) == count + 1  # it does not drive on where it could not turn


def test_nav2_turns_and_drives_by_its_behaviours():
    with FakeRobot(2) as robot, opened(robot) as driver:
        driver.turn(0.2)
        driver.forward(0.1)
        turn, straight = robot.ops("send_action_goal")
    assert (turn["action"], straight["action"]) == ("/spin", "/drive_on_heading")
    assert turn["args"]["target_yaw"] == pytest.approx(0.2)
    assert straight["args"]["target"] == {"x": pytest.approx(0.1), "y": 0.0, "z": 0.0}
    assert 0.0 < straight["args"]["speed"] < 0.3


@pytest.mark.parametrize("absent", ["no server", "silent"])
def test_nav2_without_its_behaviours_turns_by_goals_and_remembers(absent):
    with FakeRobot(2) as robot:
        robot.does["/spin"] = absent
        with opened(robot, settings=quick(answer_timeout_s=1.5)) as driver:
            assert driver.turn(1.0).reached
            assert driver.turn(1.0).reached
        actions = [message["action"] for message in robot.ops("send_action_goal")]
    sent = ["/spin"] if absent == "silent" else []  # a server that is known not to be there gets no goal
    assert actions == [*sent, "/navigate_to_pose", "/navigate_to_pose"]
    assert robot.pose.heading_rad == pytest.approx(2.0)


def test_a_robot_that_does_not_turn_as_far_as_told_has_not_turned(robot):
    with opened(robot) as driver:
        robot.does[""] = "lie"
        for movement in (lambda: driver.turn(0.2), lambda: driver.forward(0.2)):
            arrival = movement()
            assert not arrival.reached
            assert "tolerance" in arrival.note


@pytest.mark.parametrize("nothing", [0.0, 1e-6, -0.005])
def test_a_movement_of_nothing_is_made_without_the_robot(robot, nothing):
    with opened(robot) as driver:
        assert driver.turn(nothing).reached
        assert driver.forward(nothing).reached
        assert not goals(robot)


@pytest.mark.parametrize("bad", [float("nan"), float("inf"), 1e9])
def test_no_such_number_is_ever_sent(robot, bad):
    with opened(robot) as driver:
        arrivals = [
            driver.go_to(np.array([bad, 0.0, 0.0])),
            driver.go_to(PLACE, face=np.array([0.0, bad, 0.0])),
            driver.turn(bad),
            driver.forward(bad),
        ]
        assert not any(arrival.reached for arrival in arrivals)
        assert not goals(robot)


def test_stopping_cancels_what_others_sent_and_sees_that_it_stands(robot):
    with opened(robot) as driver:
        before = driver.stop()
        assert before.reached, before.note
        assert before.note == ""
        if robot.ros == 1:
            assert robot.published("/move_base/cancel")[-1]["id"] == ""
        else:
            services = {call["service"] for call in robot.ops("call_service")}
            assert "/navigate_to_pose/_action/cancel_goal" in services


def test_a_robot_that_tells_nothing_is_not_seen_to_stand(robot):
    with opened(robot, settings=quick(cancel_timeout_s=1.0)) as driver:
        robot.tf_on = False
        assert "pose changes or is lost" in driver.stop().note


def test_stopping_from_another_thread_ends_a_drive(robot):
    robot.does[""] = "drive on"
    with opened(robot) as driver:
        robot.moves_on = True
        thread, results = in_thread(lambda: driver.go_to(PLACE))
        assert robot.soon(lambda: bool(goals(robot)))
        busy = driver.forward(1.0)
        assert not busy.reached
        assert "another movement" in busy.note
        assert "still at a movement" in driver.fault()
        assert not cancels(robot)
        assert driver.stop().reached
        thread.join(20.0)
        (arrival,) = results
        assert not arrival.reached
        assert not robot.moves_on
        robot.does[""] = "succeed"
        assert driver.go_to(PLACE).reached


def test_a_stop_before_a_goal_goes_out_or_between_two_of_a_movement_keeps_it_back(robot):
    with opened(robot) as driver:
        for before, move, sent in (
            ("_unready", lambda: driver.go_to(PLACE), 0),
            ("turn", lambda: driver.forward(-1.0), 1),
        ):
            done = getattr(driver, before)
            setattr(driver, before, lambda *given, done=done: (done(*given), driver.stop())[0])
            assert "was stopped" in move().note
            delattr(driver, before)
            assert len(goals(robot)) == sent


def test_a_goal_that_is_stopped_while_its_connection_opens_is_not_sent():
    with FakeRobot(2) as robot, opened(robot) as driver:
        goal = SentGoal(ActionGoal("/navigate_to_pose", "", {}, 9.0), called_off_s=1.0)
        driver._contact.session.send(goal)
        assert driver.stop().reached and goal.end is End.FAILED
        assert not goals(robot)


def test_a_bridge_that_takes_no_more_connections_is_stopped_over_those_that_stand():
    with FakeRobot(2, "drive on") as robot, opened(robot, settings=quick(cancel_timeout_s=3.0)) as driver:
        thread, _ = in_thread(lambda: driver.go_to(PLACE))
        assert robot.soon(lambda: driver._goal is not None and not driver._goal.waits)
        blockingCallFromThread(reactor, robot._listener.stopListening)
        with create_server(("127.0.0.1", robot.port)):
            begun_s = monotonic()
            driver.stop()
            assert monotonic() - begun_s < 12.0
            assert all(goal["status"] == 5 for goal in robot.goals.values())
            thread.join(20.0)


def test_a_guard_that_hangs_does_not_hold_up_the_drive():
    guard = GoalGuard(Orders("nav2", "ws://127.0.0.1:9", None, QUICK))
    os.kill(guard._process.pid, signal.SIGSTOP)
    goal = SentGoal(ActionGoal("/navigate_to_pose", "", {"": 999 * "x"}, 9.0))
    thread, _ = in_thread(lambda: [guard.beat(goal) for _ in range(100)])
    thread.join(10.0)
    guard._process.kill()
    assert not thread.is_alive()


@pytest.fixture
def heeds_interrupts():
    """A process that a shell began in the background ignores SIGINT; this one heeds it meanwhile."""
    usual = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, usual)


@pytest.mark.usefixtures("heeds_interrupts")
def test_an_interrupt_cancels_the_goal_and_goes_on_up(robot):
    robot.does[""] = "drive on"
    with opened(robot) as driver:
        robot.moves_on = True

        def interrupt() -> None:
            if robot.soon(lambda: bool(goals(robot))):
                _thread.interrupt_main()

        thread, _ = in_thread(interrupt)
        with pytest.raises(KeyboardInterrupt):
            driver.go_to(np.array([50.0, 0.0, 0.0]))
        thread.join(20.0)
        assert robot.soon(lambda: cancels(robot) >= 1)
        assert not robot.moves_on


def test_closing_calls_off_what_is_under_way(robot):
    robot.does[""] = "drive on"
    driver = opened(robot)
    thread, _ = in_thread(lambda: driver.go_to(PLACE))
    assert robot.soon(lambda: bool(goals(robot)))
    driver.close()
    thread.join(20.0)
    assert not thread.is_alive()
    assert robot.soon(lambda: all(goal["status"] in (2, 5) for goal in robot.goals.values()))


def test_a_first_goal_that_a_new_topic_loses_is_sent_again_and_taken_once():
    with FakeRobot(1, "deaf") as robot, opened(robot) as driver:
        robot.does["/move_base"] = "deaf"
        assert driver.go_to(PLACE).reached
        sent = robot.published("/move_base/goal")
        assert len(sent) >= 2
        assert len({message["goal_id"]["id"] for message in sent}) == 1
        assert len(robot.goals) == 1


def test_names_in_a_namespace():
    with FakeRobot(2) as robot, opened(robot, settings=quick()) as _:
        settings = quick()
        named = RosSettings(namespace="robot1", pose_timeout_s=settings.pose_timeout_s)
        with opened(robot, settings=named) as driver:
            assert driver.go_to(PLACE).reached
            driver.turn(0.5)
        actions = [message["action"] for message in robot.ops("send_action_goal")]
    assert actions == ["/robot1/navigate_to_pose", "/robot1/spin"]


def floor_with_a_table() -> Obstacles:
    """A floor of 6 x 6 m about the origin with a table 1 m across at (2, 0), and a closed room at (0, 2.5)."""
    states = np.full((120, 120), CellState.FREE, np.uint8)
    at = (np.arange(120) + 0.5) * 0.05 - 3.0
    x, y = np.meshgrid(at, at, indexing="ij")
    states[(np.abs(x - 2.0) < 0.5) & (np.abs(y) < 0.5)] = CellState.OCCUPIED
    states[(np.abs(y - 1.5) < 0.1)] = CellState.OCCUPIED
    return Obstacles(np.eye(3), np.array([-3.0, -3.0]), 0.05, 0.0, states)


def test_a_goal_in_an_obstacle_becomes_a_place_beside_it(robot):
    with opened(robot, obstacles=floor_with_a_table()) as driver:
        arrival = driver.go_to(np.array([2.0, 0.0, 0.7]), face=np.array([2.0, 0.0, 0.7]))
        assert arrival.reached, arrival.note
        assert "not free on the map" in arrival.note
        x_m, y_m = arrival.pose.x_m, arrival.pose.y_m
        outside_m = np.hypot(max(abs(x_m - 2.0) - 0.5, 0.0), max(abs(y_m) - 0.5, 0.0))
        assert 0.2 <= outside_m < 0.5
        assert abs(wrap_angle(arrival.pose.heading_rad - np.arctan2(-y_m, 2.0 - x_m))) < 1e-6
        free = driver.go_to(np.array([-1.0, -1.0, 0.0]))
        assert free.note == ""
        assert free.pose.distance_m(GroundPose(-1.0, -1.0)) < 1e-6


def test_a_goal_that_no_way_leads_to_is_not_sent(robot):
    with opened(robot, obstacles=floor_with_a_table()) as driver:
        beyond = driver.go_to(np.array([20.0, 0.0, 0.0]))
        assert not beyond.reached
        assert "No path leads near (20.00, 0.00)" in beyond.note
        robot.pose = GroundPose(40.0, 0.0)
        robot.soon(lambda: driver.pose.x_m > 30.0)
        astray = driver.go_to(np.array([-1.0, 0.0, 0.0]))
        assert "set how its frames lie to the map" in astray.note
        assert not goals(robot)


def test_of_two_drivers_the_second_sends_nothing(robot):
    """Also before the server lists the goal of the first."""
    robot.does[""] = "silent"
    with opened(robot, settings=quick(answer_timeout_s=4.0)) as first, opened(robot) as second:
        thread, results = in_thread(lambda: first.go_to(PLACE))
        assert robot.soon(lambda: len(robot.published("/avlmaps/heartbeat")) > 1)
        refused = second.go_to(PLACE)
        assert "another client" in refused.note
        assert len(robot.goals) == 1
        robot.does[""] = "succeed"
        first.stop()
        thread.join(30.0)
        assert results


@pytest.mark.parametrize("accepted", [True, False])
def test_a_goal_that_its_server_does_not_know_is_over_only_where_it_was_accepted(accepted):
    goal = SentGoal(ActionGoal("/navigate_to_pose", "", {}, 60.0), answer_s=10.0)
    if accepted:
        goal.show(1.0)
    goal.called_off_s = 2.0
    for now_s in (2.5, 11.9):
        goal.unknown(now_s, "unknown")
        assert (goal.end is not None, goal.waits) == (accepted, not accepted)
    goal.unknown(12.1, "unknown")
    assert goal.end is End.CANCELLED
