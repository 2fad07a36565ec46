"""Parts that driving Nav2 and move_base share: seeing a goal to its end, calling it off, and the report."""

import threading
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from math import pi
from time import monotonic
from typing import ClassVar, Self

import numpy as np
from jaxtyping import Float

from avlmaps.core.errors import NavigationError
from avlmaps.core.motion import GroundPose
from avlmaps.navigate.driver import Arrival
from avlmaps.navigate.interrupts import Halt
from avlmaps.navigate.ros.contact import Contact
from avlmaps.navigate.ros.frames import Frames
from avlmaps.navigate.ros.goals import End, Goal, Plan, Task, Track, Watch
from avlmaps.navigate.ros.guard import Guard
from avlmaps.navigate.ros.link import Link
from avlmaps.navigate.ros.plans import LEAST_M, LONGEST_M, Standing, ahead_of, place_to_stand, plan_turn
from avlmaps.navigate.ros.settings import RosSettings

_LOOK_EVERY_S = 0.1
_CANCEL_AGAIN_S = 1.0
_IDLE = Halt(True, "no goal was active")


class RosDriver(ABC):
    """Drives a robot that plans and steers by itself. One movement at a time; ``stop`` may come from any thread.

    Attributes:
        frames: the robot's frames, and how they lie to the map.
        settings: names, patience, tolerances.
        guard: a second process that cancels when this one dies; None where nobody started one.
    """

    called: ClassVar[str]
    """The program that drives the robot, as notes name it."""
    tf_kind: ClassVar[str]
    """The type of /tf."""
    heartbeat_kind: ClassVar[str]
    """The type of the heartbeat: text, the id of the active goal."""

    def __init__(
        self,
        url: str,
        frames: Frames | None = None,
        settings: RosSettings | None = None,
        *,
        standing: Standing | None = None,
        level_from_world: Float[np.ndarray, "3 3"] | None = None,
        token: str | None = None,
        clock: Callable[[], float] = monotonic,
    ) -> None:
        """Connect, and wait until the robot reports its pose.

        Args:
            url: of rosbridge, ``ws://host:9090``.
            frames: the robot's frames; ``map`` and ``base_link``, lying as the map's level frame, by default.
            settings: names, patience, tolerances.
            standing: moves a goal to where a body can stand; goals are sent as they are without it.
            level_from_world: the map's rotation into its level frame; the identity by default.
            token: for a proxy before the bridge.
            clock: seconds, by which poses age and the loop's own stalls are measured; replaced in tests.

        Raises:
            NavigationError: there is no bridge, or the robot does not report its pose.
            BackendError: roslibpy is not installed.
        """
        self.frames = frames or Frames()
        self.settings = settings or RosSettings()
        self._standing = standing
        self._level_from_world = np.eye(3) if level_from_world is None else np.asarray(level_from_world, np.float64)
        self._busy, self._halted = threading.Lock(), threading.Event()
        self._goal: Goal | None = None
        self._halt = _IDLE
        self._clock = clock
        self.guard: Guard | None = None
        self._absent: set[str] = set()
        self._contact = Contact(url, token, self.frames, self.settings, self.tf_kind, self._greeted, clock)

    # The differences between the two.

    @abstractmethod
    def _greet(self, link: Link) -> None:
        """Subscribe and advertise what goals need."""

    @abstractmethod
    def _send(self, goal: Goal) -> None:
        """Send a goal."""

    @abstractmethod
    def _cancel(self, goal: Goal) -> None:
        """Request the cancel of one goal."""

    @abstractmethod
    def _cancel_all(self, link: Link, wait_s: float) -> bool:
        """Request that the robot's task, if any, be cancelled; return whether it agreed within that time."""

    @abstractmethod
    def _pose_task(self, pose: GroundPose) -> Task:
        """Return the task of standing at a pose, level frame."""

    def _turn_tasks(self, start: GroundPose, angle_rad: float) -> tuple[Task, ...]:
        return (self._pose_task(start.turned(angle_rad)),)

    def _forward_tasks(self, start: GroundPose, distance_m: float) -> tuple[Task, ...]:
        return (self._pose_task(start.ahead(distance_m)),)

    def _greeted(self, link: Link) -> None:
        link.advertise(self._heartbeat_topic, self.heartbeat_kind)
        self._greet(link)

    @property
    def _heartbeat_topic(self) -> str:
        return f"{self.settings.namespace}/avlmaps/heartbeat"

    def _remind(self, goal: Goal) -> None:  # noqa: B027 - most need none
        """Send a goal again where it may have been lost."""

    # The Driver protocol.

    @property
    def pose(self) -> GroundPose:
        """Where the robot is, level frame; where it was last known to be, when its pose is not reported any more."""
        return self._contact.pose

    def go_to(self, place: Float[np.ndarray, "3"], *, face: Float[np.ndarray, "3"] | None = None) -> Arrival:
        """Drive to a place, or as near to it as the robot can stand and see it; see `Driver`."""
        wanted = self._level(place)
        looked_at = None if face is None else self._level(face)
        return self._move(partial(self._plan_to, wanted=wanted, looked_at=looked_at))

    def turn(self, angle_rad: float) -> Arrival:
        """Turn on the spot, to the left by a positive angle."""
        return self._move(lambda start: plan_turn(start, angle_rad, self.settings, self._turn_tasks))

    def forward(self, distance_m: float) -> Arrival:
        """Drive straight ahead; for a negative distance it turns round first, so that it sees where it goes."""
        if not -LONGEST_M < distance_m <= -LEAST_M:
            return self._move(lambda start: ahead_of(start, distance_m, self.settings, self._forward_tasks))
        turned = self.turn(pi)
        if not turned.reached:
            return turned
        driven = self.forward(-distance_m)
        return replace(driven, path=np.concatenate([turned.path, driven.path]))

    def stop(self) -> Arrival:
        """Cancel the robot's task, from this client or another, and report whether it stands still."""
        self._halted.set()
        track, contact = Track(self.pose), self._contact
        if contact.link.lost is not None:
            return self._arrival(False, track, f"{contact.loss()}; use the robot's own stop")
        self._cancel_all(contact.link, 0.0)
        still = contact.stands_still(self.settings.cancel_timeout_s)
        return self._arrival(still, track, "" if still else "The robot was stopped, but its pose changes or is lost")

    def fault(self) -> str:
        """Return why the robot cannot be driven now, in part of a sentence; "" where it can.

        A lost connection is made again, and a guard that ended is started again.
        """
        try:
            self._contact.renew()
        except NavigationError as fault:
            return str(fault)
        if self._contact.pose_within(self.settings.pose_max_age_s) is None:
            return f"its pose is not known: {self._contact.unseen()}"
        if self.guard is not None and not self.guard.revived():
            return "the guard, which cancels its goals when this program dies, cannot be started"
        return ""

    def halt(self) -> Halt:
        """Return whether the robot stands after an interrupt, which has cancelled the goal that was active.

        Unlike ``stop`` it leaves goals of others alone. It waits at most ``cancel_timeout_s``.
        """
        halt = self._halt
        if not halt.stopped:
            return halt
        if self._contact.stands_still(self.settings.cancel_timeout_s):
            pose = self.pose
            return Halt(True, f"{halt.note}; the robot stands at ({pose.x_m:.2f}, {pose.y_m:.2f}) m")
        return Halt(False, f"{halt.note}, but the robot is not seen to stand")

    def close(self) -> None:
        """End the connection; a goal that is under way is called off first."""
        goal, link = self._goal, self._contact.link
        if goal is not None and link.lost is None:
            self._called_off(goal)
        link.close()
        if self.guard is not None:
            self.guard.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    # One movement.

    def _level(self, place: Float[np.ndarray, "3"]) -> Float[np.ndarray, "2"]:
        known = np.isfinite(place).all()  # NaN stays NaN, without a warning
        return (self._level_from_world @ np.asarray(place, np.float64))[:2] if known else np.full(2, np.nan)

    def _plan_to(
        self, start: GroundPose, wanted: Float[np.ndarray, "2"], looked_at: Float[np.ndarray, "2"] | None
    ) -> Plan | str:
        return place_to_stand(start, wanted, looked_at, self._standing, self.settings, self._pose_task)

    def _move(self, planned: Callable[[GroundPose], Plan | str]) -> Arrival:
        if not self._busy.acquire(blocking=False):
            return self._arrival(False, Track(self.pose), "The robot is still at another movement")
        try:
            self._halted.clear()
            self._halt = _IDLE
            self._contact.renew()
            start = self._contact.pose_within(self.settings.pose_max_age_s)
            if start is None:
                why = f"Where the robot is is not known: {self._contact.unseen()}"
                return self._arrival(False, Track(self.pose), why)
            plan = planned(start)
            return self._arrival(False, Track(start), plan) if isinstance(plan, str) else self._done(plan, Track(start))
        except NavigationError as fault:
            return self._arrival(False, Track(self.pose), str(fault))
        finally:
            self._busy.release()

    def _done(self, plan: Plan, track: Track) -> Arrival:
        """Do what was planned, and see whether it was done."""
        end, note = End.SUCCEEDED, ""
        for task in [task for task in plan.tasks if task.action not in self._absent] or plan.tasks[-1:]:
            goal = self._pursue(task, track)
            end, note = goal.end, goal.note
            if end is not End.ABSENT or self._halted.is_set():
                break
            self._absent.add(task.action)
        if end is not End.SUCCEEDED:
            return self._arrival(False, track, note or f"{self.called} did not do it")
        now = self._contact.pose_from_now(self.settings.pose_max_age_s)
        if now is None:
            why = f"{self.called} says that it arrived, but its pose is not reported any more: {self._contact.unseen()}"
            return self._arrival(False, track, why)
        track.passed(now)
        off = plan.off(now)
        if off:
            why = "its goal tolerance is loose, or the frames are wrong"
            return self._arrival(False, track, f"{self.called} says that it arrived, but {off}; {why}")
        return self._arrival(True, track, plan.note)

    def _pursue(self, task: Task, track: Track) -> Goal:
        """Send one goal and see it to its end, good or bad."""
        goal = self._goal = Goal(task)
        try:
            self._beat(goal)
            self._send(goal)
            why, absent = self._watch(goal, track)
            if goal.end is None:
                self._give_up(goal, why, absent)
        except BaseException:  # above all KeyboardInterrupt: nobody watches the robot any more
            agreed = (self._contact.link.lost is None and self._called_off(goal)) or self._call_off_anew()
            note = "the active goal was cancelled" if agreed else "the robot did not confirm that it gave up its goal"
            self._halt = Halt(agreed, note)
            raise
        finally:
            self._goal = None
            if self.guard is not None and goal.end is not None:
                self.guard.rest()
        return goal

    def _watch(self, goal: Goal, track: Track) -> tuple[str, bool]:
        """Wait for a goal's end; else return why it is to be given up, and whether nobody is there to take it."""
        watch, settings = Watch(), self.settings
        looked_s = beaten_s = self._clock()
        while not self._ended_within(goal, _LOOK_EVERY_S):
            now_s = self._clock()
            stood_s, looked_s = now_s - looked_s, now_s
            if stood_s > settings.stall_s:
                return f"The watch over the goal stood still for {stood_s:.1f} s", False
            if now_s - beaten_s >= settings.heartbeat_s:
                beaten_s = now_s
                self._beat(goal)
            track.passed(self.pose)
            if self._contact.link.lost is not None:
                return self._contact.loss(), False
            if self._halted.is_set():
                return "The robot was stopped", False
            if not goal.answered and watch.took_s > settings.answer_timeout_s:
                within = f"within {settings.answer_timeout_s:g} s; is {self.called} running?"
                return f"Nothing answers at {goal.task.action} {within}", True
            if watch.took_s > goal.task.limit_s:
                return f"{self.called} was not done within {goal.task.limit_s:g} s", False
            if self._contact.is_unseen_for(settings.pose_max_age_s):
                return f"Where the robot is is not known any more: {self._contact.unseen()}", False
            self._remind(goal)
        return "", False

    def _give_up(self, goal: Goal, why: str, absent: bool) -> None:
        """Call a goal off, by every way there is, and say how it went."""
        link = self._contact.link
        if link.lost is not None:
            goal.over(End.FAILED)  # before a message over the next connection ends it otherwise
            agreed = self._call_off_anew()
            outcome = "it was reached again and stopped" if agreed else "it may still be driving: use its own stop"
            goal.note = f"{why}; {outcome}"
            return
        wait_s = self.settings.cancel_timeout_s
        agreed = self._called_off(goal, min(wait_s, 1.0) if absent else wait_s)
        agreed = agreed or self._call_off_anew() or absent
        goal.end = End.ABSENT if absent else End.CANCELLED
        goal.note = why if agreed else f"{why}; it does not say that it gave up, and may still be driving"
        if absent and link.complaints:
            goal.note += f" ({link.complaints[-1]})"

    def _beat(self, goal: Goal) -> None:
        """Publish that this loop runs and wants the goal to continue."""
        if self.guard is not None:
            self.guard.beat()
        if self._contact.link.lost is None:
            self._contact.link.publish(self._heartbeat_topic, {"data": goal.id})

    def _called_off(self, goal: Goal, wait_s: float | None = None) -> bool:
        """Cancel a goal until the robot confirms it: a bridge that has only just received it may miss the first."""
        until_s = monotonic() + (self.settings.cancel_timeout_s if wait_s is None else wait_s)
        while goal.end is None and self._contact.link.lost is None and (left_s := until_s - monotonic()) > 0.0:
            self._cancel(goal)
            self._ended_within(goal, min(left_s, _CANCEL_AGAIN_S))
        return goal.end is not None

    def _call_off_anew(self) -> bool:
        """Cancel everything over a new connection: the old one is lost, or waits behind the goal itself."""
        with self._contact.anew() as link:
            return link is not None and self._cancel_all(link, self.settings.cancel_timeout_s)

    def _ended_within(self, goal: Goal, wait_s: float) -> bool:
        link = self._contact.link
        with link.heard:
            link.heard.wait_for(lambda: goal.end is not None or link.lost is not None, wait_s)
        return goal.end is not None

    def _arrival(self, reached: bool, track: Track, note: str) -> Arrival:
        pose = self.pose
        track.passed(pose)
        ended = note.endswith((".", "?", ")"))
        return Arrival(reached, pose, (), track.places, note if ended or not note else f"{note}.")
