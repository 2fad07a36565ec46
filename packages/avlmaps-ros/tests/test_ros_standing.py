"""Laws of standing and of age: bodies whose motion is known, over ways that delay, reorder and queue."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from avlmaps_ros.contact import STILL_M, STILL_S, stillness
from avlmaps_ros.messages import Transform
from avlmaps_ros.session import Echoes
from avlmaps_ros.tree import LiveTree

LOOK_S = 0.02


class Clock:
    def __init__(self) -> None:
        self.now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


def moved(x_m: float) -> np.ndarray:
    place = np.eye(4)
    place[0, 3] = x_m
    return place


class Robot:
    """A body that drives at a speed until it stops, and whose transforms arrive late."""

    def __init__(self, speed: float, stops_s: float, odom_s: float, map_s: float, late_s: list[float], offset_s: float):
        self.clock, self.speed, self.stops_s = Clock(), speed, stops_s
        self.echoes = Echoes(self.clock)
        self.tree = LiveTree(self.clock, self.echoes.sent_before)
        rng = np.random.default_rng(0)
        self.arriving: list[tuple[float, Transform]] = []
        for parent, child, every_s in (("odom", "base", odom_s), ("map", "odom", map_s)):
            before_s = 0.0
            for made_s in np.arange(0.0, 6.0, every_s):
                delay_s = late_s[int(made_s / 6.0 * len(late_s))]
                before_s = max(before_s, made_s + delay_s + 0.01 * rng.random())  # a queue keeps the order
                place = moved(self.true_m(made_s)) if child == "base" else moved(0.0)
                told = Transform(parent, child, place, 0.0 if offset_s == 0.0 else made_s + offset_s)
                self.arriving.append((before_s, told))
        self.arriving.sort(key=lambda one: one[0])

    def true_m(self, at_s: float) -> float:
        return self.speed * min(at_s, self.stops_s)

    def until(self, now_s: float) -> None:
        while self.arriving and self.arriving[0][0] <= now_s:
            at_s, told = self.arriving.pop(0)
            self.clock.now_s = 100.0 + at_s
            self.tree.take([told], static=False)
        self.clock.now_s = 100.0 + now_s


@given(
    st.floats(0.06, 2.0), st.floats(0.5, 3.0), st.floats(0.02, 0.2), st.sampled_from([0.1, 0.3, 0.5, 0.9]),
    st.lists(st.sampled_from([0.0, 0.05, 0.3]), min_size=1, max_size=4), st.floats(-50.0, 50.0).filter(bool),
)  # fmt: skip
def test_a_body_that_moves_is_never_seen_to_stand_and_one_that_stopped_soon_is(
    speed: float, stops_s: float, odom_s: float, map_s: float, late_s: list[float], offset_s: float
) -> None:
    robot, begun_s = Robot(speed, stops_s, odom_s, map_s, late_s, offset_s), 0.3
    robot.until(begun_s)
    stands, stood_s = stillness(robot.clock()), None
    for now_s in np.arange(begun_s, 6.0, LOOK_S):
        robot.until(now_s)
        if stands(robot.tree.seen("map", "base")):
            stood_s = now_s
            break
    assert stood_s is not None, "it never stood"
    # What it showed as one place for half a second was one place: at most STILL_M of its motion lies in it.
    assert stood_s >= stops_s - STILL_M / speed + STILL_S - 0.02
    assert stood_s <= stops_s + STILL_S + 2.0 * map_s + 2.0 * odom_s + max(late_s) * 2.0 + 0.2


@given(st.floats(0.2, 2.0), st.floats(0.5, 4.0))
def test_a_queue_that_grows_makes_a_pose_as_old_as_it_is(speed: float, growth_s: float) -> None:
    """Transforms come later and later; by their stamps the age is right, though each has just arrived."""
    clock = Clock()
    tree = LiveTree(clock)
    for step in range(100):
        made_s = 0.05 * step
        late_s = growth_s * step / 100
        clock.now_s = 100.0 + made_s + late_s
        tree.take([Transform("map", "base", moved(speed * made_s), made_s + 7.0)], static=False)
        seen = tree.seen("map", "base")
        assert seen is not None
        assert abs(seen.age_s - late_s) < 1e-6
        assert abs(seen.pose.x_m - speed * (clock.now_s - 100.0 - seen.age_s)) < 1e-6


@given(st.lists(st.floats(0.01, 3.0), min_size=2, max_size=30))
def test_an_echo_bounds_the_age_where_nothing_is_stamped(late_s: list[float]) -> None:
    clock = Clock()
    echoes = Echoes(clock)
    tree = LiveTree(clock, echoes.sent_before)
    for seconds in late_s:
        made_s = clock.now_s
        text = echoes.next()
        clock.now_s += seconds
        echoes.back(text)
        tree.take([Transform("map", "base", moved(0.0))], static=False)
        seen = tree.seen("map", "base")
        assert seen is not None
        assert seen.taken_s <= made_s + 1e-9
        assert abs(seen.age_s - seconds) < 1e-6


def test_echoes_of_others_and_nonsense_are_left_out() -> None:
    clock = Clock()
    echoes, others = Echoes(clock), Echoes(clock)
    for text in (others.next(), "", "x 1", echoes.next() + "x", echoes.next() + "0", "  ", "\u0661"):
        echoes.back(text)
    assert echoes.sent_before(clock() + 1.0) is None
    text = echoes.next()
    echoes.back(text)
    echoes.back(text)
    assert echoes.sent_before(clock()) == clock()
    assert echoes.sent_before(clock() - 1.0) is None


def test_transforms_that_overtake_each_other_end_at_the_newest() -> None:
    clock = Clock()
    tree = LiveTree(clock)
    for made_s in (1.0, 3.0, 2.0):
        clock.now_s += 0.01
        tree.take([Transform("map", "base", moved(made_s), made_s)], static=False)
    seen = tree.seen("map", "base")
    assert seen is not None
    assert seen.pose.x_m == 3.0
    clock.now_s += 2.0  # the robot's clock was set back: the old stamps are the new time
    tree.take([Transform("map", "base", moved(0.5), 0.5)], static=False)
    later = tree.seen("map", "base")
    assert later is not None
    assert later.pose.x_m == 0.5


def test_a_stamp_that_never_changes_says_nothing() -> None:
    clock = Clock()
    tree = LiveTree(clock)
    for _ in range(5):
        clock.now_s += 1.0
        tree.take([Transform("map", "base", moved(0.0), 12.5)], static=False)
    seen = tree.seen("map", "base")
    assert seen is not None
    assert seen.age_s == 0.0


@given(st.floats(0.05, 3.0), st.floats(0.0, 2.0))
def test_the_stamps_of_a_simulation_run_by_its_own_clock(rate: float, late_s: float) -> None:
    """A simulator that is slower or faster than the time of day is not a way that is late; a queue before it is."""
    clock = Clock()
    tree = LiveTree(clock)
    for step in range(200):
        clock.now_s = 100.0 + 0.05 * step
        simulated_s = 5.0 + rate * 0.05 * step
        tree.tick(simulated_s)
        stamp_s = simulated_s - (late_s if step >= 150 else 0.0)
        tree.take([Transform("map", "base", moved(0.0), stamp_s)], static=False)
        seen = tree.seen("map", "base")
        assert seen is not None
        if step < 150 or (step > 150 and stamp_s > 5.0 + rate * 0.05 * 149):
            assert abs(seen.age_s - (late_s if step >= 150 else 0.0)) < 1e-6
