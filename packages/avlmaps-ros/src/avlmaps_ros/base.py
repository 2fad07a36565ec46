"""The driver of a robot that plans and steers by itself: it sees each goal to its end, or calls it off.

These are the laws of safety, over any transport (`session`): what was sent is watched; what is not watched any more is
called off until the robot confirms it; only goals of ours are called off; and nothing new is sent before.
"""

import threading
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from math import inf, isfinite, pi
from time import monotonic
from typing import Self

import numpy as np
from jaxtyping import Float

from avlmaps.core.errors import NavigationError
from avlmaps.core.motion import GroundPose
from avlmaps.navigate.driver import Arrival
from avlmaps.navigate.interrupts import Halt
from avlmaps_ros.contact import Contact
from avlmaps_ros.goals import LEAST_M, LONGEST_M, ActionGoal, End, MovementPlan, SentGoal, Standing, Tasks, Track
from avlmaps_ros.guard import GoalGuard
from avlmaps_ros.session import AGAIN_S, Opener, Session, call_off, ended_within
from avlmaps_ros.tree import Sighting

_LOOK_EVERY_S = 0.1
_ASK_S = 1.5
_REGULAR = 3
_NEXT_LIST_S = 0.5
_BEATS = 2.5  # heartbeats without one, after which nobody watches a goal
_LEAP_M, _FASTEST_M_S = 0.5, 2.0  # a pose that moves by more than a robot drives has jumped
_ASK_AFTER = 0.4  # of the time for which a server may be silent
_IDLE = "no goal was active"


class RosDriver:
    """Drives a robot that plans and steers by itself. One movement at a time; ``stop`` may come from any thread.

    Attributes:
        guard: a second process that cancels when this one dies; None where nobody started one.
        elsewhere: returns why a place of another storey is not driven to, ``""`` for others.
        held: see `Holdable`.
    """

    def __init__(
        self,
        opener: Opener,
        tasks: Tasks,
        *,
        standing: Standing | None = None,
        level_from_world: Float[np.ndarray, "3 3"] | None = None,
        clock: Callable[[], float] = monotonic,
    ) -> None:
        self.frames, self.settings, self._tasks = tasks.frames, tasks.settings, tasks
        self._standing = standing
        self._level_from_world = np.eye(3) if level_from_world is None else np.asarray(level_from_world, np.float64)
        self._busy, self._halted, self._closing = threading.Lock(), threading.Event(), threading.Event()
        self._goal: SentGoal | None = None  # was sent, and its end is not confirmed
        self._ours: deque[SentGoal] = deque(maxlen=50)
        self._left = _IDLE  # what became of the last movement's goal
        self._clock = clock
        self.guard: GoalGuard | None = None
        self.elsewhere: Callable[[Float[np.ndarray, 3]], str] = lambda _: ""
        self.held: Callable[[], str] = lambda: ""
        self._absent: set[str] = set()
        self._mute: set[str] = set()
        self._contact = Contact(opener, self.frames, self.settings, clock)

    @property
    def pose(self) -> GroundPose:
        """Where the robot is, level frame; where it was last known to be, when its pose is not reported any more."""
        return self._contact.pose

    def go_to(self, place: Float[np.ndarray, "3"], *, face: Float[np.ndarray, "3"] | None = None) -> Arrival:
        if refused := self.elsewhere(place):
            return self._move(lambda _: refused)
        wanted = self._level(place)
        looked_at = None if face is None else self._level(face)
        return self._move(lambda start: self._tasks.plan_place(start, wanted, looked_at, self._standing))

    def turn(self, angle_rad: float) -> Arrival:
        return self._move(lambda start: self._tasks.plan_turn(start, angle_rad))

    def forward(self, distance_m: float) -> Arrival:
        """Drive straight ahead; for a negative distance it turns round first, so that it sees where it goes."""
        if not -LONGEST_M < distance_m <= -LEAST_M:
            return self._move(lambda start: self._tasks.plan_ahead(start, distance_m))
        turned = self.turn(pi)
        if not turned.reached:
            return turned
        driven = self._move(lambda start: self._tasks.plan_ahead(start, -distance_m), goes_on=True)
        return replace(driven, path=np.concatenate([turned.path, driven.path]))

    def stop(self) -> Arrival:
        """Cancel every goal of the robot, also those of others, and report whether it stands still.

        A lost connection is made again first. It takes at most four times ``cancel_timeout_s``.
        """
        self._halted.set()
        track, contact, wait_s = Track(self.pose), self._contact, self.settings.cancel_timeout_s
        if not contact.renewed_within(wait_s):
            return self._arrival(False, track, f"{contact.loss()}, and it cannot be reached; use the robot's own stop")
        owed = None if self._busy.locked() else self._goal
        idle = self._all_called_off(wait_s)
        still = contact.stands_still(wait_s)
        if idle and owed is not None:
            self._settle(owed)
        called = self._tasks.called
        if not still:
            return self._arrival(False, track, "The robot was stopped, but its pose changes or is lost")
        if idle:
            return self._arrival(True, track, "")
        if idle is False:
            return self._arrival(False, track, f"{called} does not give up its goal; the robot pauses")
        if self._unfinished is not None or any(contact.ear.servers.under_way().values()):
            return self._arrival(False, track, f"{called} does not answer, and was at a goal; the robot pauses")
        return self._arrival(True, track, f"The robot stands, but {called} does not say that it has no goal")

    def fault(self) -> str:
        """Return why the robot cannot be driven now, in part of a sentence; "" where it can.

        A lost connection is made again, and a guard that ended is started again.
        """
        try:
            if why := "it is still at a movement" if self._busy.locked() else self._unready():
                return why[:1].lower() + why[1:]
        except NavigationError as fault:
            return str(fault)
        if self.guard is not None and not self.guard.revived():
            return "the guard, which cancels its goals when this program dies, cannot be started"
        return ""

    def halt(self) -> Halt:
        """Return whether the robot stands after its last movement, whose goal was called off if it was interrupted.

        Unlike ``stop`` it leaves goals of others alone. It waits at most ``cancel_timeout_s``.
        """
        if self._goal is not None:
            return Halt(False, "the robot did not confirm that it gave up its goal")
        if self._contact.stands_still(self.settings.cancel_timeout_s):
            pose = self.pose
            return Halt(True, f"{self._left}; the robot stands at ({pose.x_m:.2f}, {pose.y_m:.2f}) m")
        moved = "a goal of another client drives the robot" if self._others() else "the robot is not seen to stand"
        return Halt(False, f"{self._left}, but {moved}")

    @property
    def owes(self) -> bool:
        """Whether a goal was sent whose end the robot has not confirmed, so that it may still be driving."""
        return self._unfinished is not None

    def close(self) -> None:
        """End the connection; a goal that is not over is called off first, and else left to the guard."""
        if (goal := self._unfinished) is not None:
            self._called_off(goal, self.settings.cancel_timeout_s)
        self._closing.set()
        self._contact.session.close()
        if self.guard is not None:
            self.guard.close(dismissed=goal is None or goal.end is not None)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def _unfinished(self) -> SentGoal | None:
        goal = self._goal
        return None if goal is None or goal.end is not None else goal

    def _level(self, place: Float[np.ndarray, "3"]) -> Float[np.ndarray, "2"]:
        known = np.isfinite(place).all()  # NaN stays NaN, without a warning
        return (self._level_from_world @ np.asarray(place, np.float64))[:2] if known else np.full(2, np.nan)

    def _move(self, planned: Callable[[GroundPose], MovementPlan | str], goes_on: bool = False) -> Arrival:
        if not self._busy.acquire(blocking=False):
            return self._arrival(False, Track(self.pose), "The robot is still at another movement")
        try:
            if not goes_on:  # a stop between two parts of a movement ends both
                self._halted.clear()
            self._left = _IDLE
            if why := self._unready():
                return self._arrival(False, Track(self.pose), why)
            start = self.pose
            plan = planned(start)
            return self._arrival(False, Track(start), plan) if isinstance(plan, str) else self._done(plan, Track(start))
        except NavigationError as fault:
            return self._arrival(False, Track(self.pose), str(fault))
        finally:
            self._busy.release()

    def _unready(self) -> str:
        """Return why nothing may be sent now; "" where it may. Connect again, and call off what is owed, first."""
        contact = self._contact
        contact.renew()
        if (owed := self._goal) is not None:
            if not self._called_off(owed, self.settings.cancel_timeout_s):
                return "An earlier goal may still be driving the robot: it does not confirm the cancel"
            self._settle(owed)
        if contact.fresh_pose() is None:
            late = contact.session.lost is None and contact.sighting() is not None
            # A new connection has no queue, and takes the robot's clock as it is now.
            if not (late and contact.replace() and contact.fresh_pose() is not None):
                return f"Where the robot is is not known: {contact.unseen()}"
        if self._others(_ASK_S):
            return f"{self._tasks.called} is at a goal of another client; wait for its end, or stop it"
        return ""

    def _others(self, wait_s: float = 0.0) -> bool:
        """Return whether a goal of others is under way, by lists and heartbeats, also after some time."""
        contact, until_s, asked = self._contact, monotonic() + wait_s, False
        while True:
            names = frozenset(name for goal in self._ours for name in (goal.id, goal.alias))
            lists = contact.ear.servers.under_way(10.0 * contact.session.lists_every_s)
            servers = [server for server, goals in lists.items() if goals - names]
            is_driven = bool(servers or contact.ear.beats.within(_BEATS * self.settings.heartbeat_s) - names)
            if not is_driven or monotonic() >= until_s:
                return is_driven
            if not asked:  # a list may be the last of a server that is gone
                asked = True
                for server in servers:
                    contact.session.ask(server)
            with contact.session.heard:
                contact.session.heard.wait(_LOOK_EVERY_S)

    def _done(self, plan: MovementPlan, track: Track) -> Arrival:
        end, note = End.SUCCEEDED, ""
        for task in [task for task in plan.tasks if task.action not in self._absent] or plan.tasks[-1:]:
            goal = self._pursue(task, track)
            end, note = goal.end, goal.note
            if end is not End.ABSENT or self._halted.is_set():
                break
            self._absent.add(task.action)
        called, session = self._tasks.called, self._contact.session
        if end is not End.SUCCEEDED:
            with session.heard:
                others = session.heard.wait_for(self._others, _NEXT_LIST_S)
            continues = ". A goal of another client continues" if others else ""
            return self._arrival(False, track, (note or f"{called} did not do it") + continues)
        if (now := self._contact.pose_from_now(self.settings.pose_max_age_s)) is None:
            why = f"{called} says that it arrived, but its pose is not reported any more: {self._contact.unseen()}"
            return self._arrival(False, track, why)
        track.passed(now)
        if off := plan.off(now):
            why = "its goal tolerance is loose, or the frames are wrong"
            return self._arrival(False, track, f"{called} says that it arrived, but {off}; {why}")
        return self._arrival(True, track, plan.note)

    def _pursue(self, task: ActionGoal, track: Track) -> SentGoal:
        _, before = self._contact.ear.servers.list_of(task.action)
        goal = SentGoal(task, self.settings.answer_timeout_s, before)
        if self._is_absent(task.action):
            goal.over(End.ABSENT, f"No action server takes the goal; start {self._tasks.called}, or name its namespace")
            return goal
        self._goal = goal
        self._ours.append(goal)
        try:
            if why := self._lost_sight(goal, 0.0):  # it was stopped while it was planned
                goal.over(End.CANCELLED, why)
                return goal
            self._beat(goal)
            self._contact.session.send(goal)
            why, absent = self._watch(goal, track)
            if goal.end is None:
                self._give_up(goal, why, absent)
        except BaseException:  # above all KeyboardInterrupt: nobody watches the robot any more
            self._called_off(goal, self._patience_s(goal))
            self._left = "the active goal was cancelled"
            raise
        finally:
            if goal.end is not None:
                self._settle(goal)
        return goal

    def _settle(self, goal: SentGoal) -> None:
        goal.over(End.CANCELLED)
        self._contact.session.beat(goal)
        if self._goal is goal:
            self._goal = None
        if self.guard is not None and self._goal is None:
            self.guard.beat(None)

    def _is_absent(self, server: str) -> bool:
        session, servers = self._contact.session, self._contact.ear.servers
        begun_s = self._clock()
        if server not in self._mute and not servers.serves(server)[1] and session.ask(server):
            with session.heard:
                session.heard.wait_for(lambda: servers.serves(server)[0] >= begun_s, _ASK_S)
            if servers.serves(server)[0] == -inf:  # the bridge may hand out no services
                self._mute.add(server)
        at_s, serves = servers.serves(server)
        return at_s > -inf and not serves

    def _watch(self, goal: SentGoal, track: Track) -> tuple[str, bool]:
        """Wait for a goal's end; else return why it is to be given up, and whether nobody is there to take it."""
        begun_s, settings, session = monotonic(), self.settings, self._contact.session
        sent_s = looked_s = beaten_s = asked_s = self._clock()
        before, jump = self._contact.sighting(), ""
        while not ended_within(goal, session, _LOOK_EVERY_S):
            now_s = self._clock()
            stood_s, looked_s = now_s - looked_s, now_s
            if stood_s > settings.stall_s:
                return f"The watch over the goal stood still for {stood_s:.1f} s", False
            if now_s - beaten_s >= settings.heartbeat_s:
                beaten_s = now_s
                self._beat(goal)
            track.passed(self.pose)
            if jump:  # and the goal did not end at that
                return jump, False
            now = self._contact.sighting()
            before, jump = now or before, _jump(before, now)
            silent_s = self._silent_s(goal, sent_s, now_s)
            if why := self._lost_sight(goal, silent_s):
                return why, False
            if goal.waits and monotonic() - begun_s > settings.answer_timeout_s:
                says = f" The bridge says: {session.link.complaint}" if session.link.complaint else ""
                within = f"within {settings.answer_timeout_s:g} s; is {self._tasks.called} running?{says}"
                return f"Nothing answers at {goal.task.action} {within}", True
            if monotonic() - begun_s > goal.task.limit_s:
                return f"{self._tasks.called} was not done within {goal.task.limit_s:g} s", False
            if silent_s > _ASK_AFTER * settings.server_max_age_s and now_s - asked_s > AGAIN_S:
                asked_s = now_s
                session.ask(goal.task.action)
            session.remind(goal)
        return "", False

    def _lost_sight(self, goal: SentGoal, silent_s: float) -> str:
        contact, settings = self._contact, self.settings
        if contact.session.lost is not None:
            return contact.loss()
        if self._halted.is_set():
            return "The robot was stopped"
        if why := self.held():
            return why
        if contact.is_unseen():
            return f"Where the robot is is not known any more: {contact.unseen()}"
        if silent_s > settings.server_max_age_s:
            since = f"for {silent_s:.1f} s" if isfinite(silent_s) else "and its action server is gone"
            return f"{self._tasks.called} has said nothing of {goal.task.action} {since}; it may have ended"
        return ""

    def _silent_s(self, goal: SentGoal, sent_s: float, now_s: float) -> float:
        if goal.heard_s is None:
            return 0.0
        at_s, serves = self._contact.ear.servers.serves(goal.task.action)
        if at_s <= max(sent_s, goal.heard_s):
            return now_s - goal.heard_s
        # A server that showed a goal regularly and does so no more has lost it, also where it runs.
        return inf if not serves else now_s - (goal.heard_s if goal.shown >= _REGULAR else at_s)

    def _give_up(self, goal: SentGoal, why: str, absent: bool) -> None:
        was_lost = self._contact.session.lost is not None
        agreed = self._called_off(goal, goal.answer_s + 2.0 * AGAIN_S if absent else goal.task.limit_s)
        servers, action = self._contact.ear.servers, goal.task.action
        if absent and servers.list_of(action)[0] == -inf and not servers.serves(action)[1]:
            goal.over(End.ABSENT)
        if absent := absent and goal.end is not None:
            goal.end = End.ABSENT
        if agreed or absent:
            goal.note = f"{why}; it was reached again and stopped" if was_lost and not absent else why
        elif was_lost:
            goal.note = f"{why}; it may still be driving: use its own stop"
        else:
            goal.note = f"{why}; it does not say that it gave up, and may still be driving"

    def _called_off(self, goal: SentGoal, wait_s: float) -> bool:
        """Cancel a goal until the robot confirms it; return whether it does.

        A lost connection is made again for as long as it takes. A connection that stands and brings no confirmation is
        replaced once: it may be stuck.
        """
        contact = self._contact
        until_s, tries = monotonic() + wait_s, 0
        while goal.end is None and tries < 2 and not self._closing.is_set() and (left_s := until_s - monotonic()) > 0.0:
            if not contact.renewed_within(min(left_s, AGAIN_S)):
                continue
            if tries and not contact.replace():
                continue
            session = contact.session
            call_off(goal, session, min(until_s, monotonic() + self._patience_s(goal) / 2.0), self._closing.is_set)
            tries += session.lost is None
        return goal.end is not None

    def _patience_s(self, goal: SentGoal) -> float:
        return 2.0 * self.settings.cancel_timeout_s + (goal.answer_s if goal.waits else 0.0)

    def _all_called_off(self, wait_s: float) -> bool | None:
        """Cancel every goal until the servers say that they are at none; return what they said last.

        A goal of ours that may still be accepted has to be over as well; it is waited for four times as long, on the
        connection that will bring its result.
        """
        contact, since_s, idle = self._contact, self._clock(), None

        def waits() -> bool:
            return (goal := self._goal) is not None and goal.waits

        def is_idle(session: Session) -> bool | None:
            return False if waits() else session.is_idle(since_s)

        for replaced in (False, True):
            if replaced and (waits() or not contact.replace()):
                break
            session, begun_s = contact.session, monotonic()
            while session.lost is None and monotonic() - begun_s < (2.0 * wait_s if waits() else 0.5 * wait_s):
                session.cancel_all()
                if (goal := self._unfinished) is not None:
                    session.cancel(goal)
                with session.heard:
                    session.heard.wait_for(lambda s=session: is_idle(s) or s.lost is not None, AGAIN_S)
                if idle := is_idle(session):
                    return True
        return idle

    def _beat(self, goal: SentGoal) -> None:
        if self.guard is not None:
            self.guard.beat(goal)
        self._contact.session.beat(goal)

    def _arrival(self, reached: bool, track: Track, note: str) -> Arrival:
        pose = self.pose
        track.passed(pose)
        ended = note.endswith((".", "?", ")"))
        return Arrival(reached, pose, (), track.places, note if ended or not note else f"{note}.")


def _jump(before: Sighting | None, now: Sighting | None) -> str:
    if before is None or now is None:
        return ""
    moved_m, took_s = now.pose.distance_m(before.pose), now.heard_s - before.taken_s
    if moved_m <= _LEAP_M + _FASTEST_M_S * took_s:
        return ""
    return f"Its pose jumped by {moved_m:.1f} m within {took_s:.1f} s; check its localisation"
