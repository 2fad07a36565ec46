"""The connection to one robot, made again when it was lost, and where the robot says that it is."""

import threading
from collections.abc import Callable
from contextlib import suppress
from time import monotonic, sleep
from typing import TypeGuard

from avlmaps.core.errors import NavigationError
from avlmaps.core.motion import GroundPose, wrap_angle
from avlmaps_ros.session import Ear, Opener, Session
from avlmaps_ros.settings import Frames, RosSettings
from avlmaps_ros.tree import Sighting

STILL_M, STILL_RAD, STILL_S = 0.015, 0.02, 0.5


def stillness(begun_s: float) -> Callable[[Sighting | None], bool]:
    """Return a function that takes what is seen, one sighting after the other, and says whether the body stands.

    Two poses are compared that were taken at least `STILL_S` apart, and every pose between them. When a pose was taken
    is known within bounds: the first no later than it was heard, the last no earlier than every moving transform in it
    was made. So neither a slow transform nor a queue makes a moving body stand. What is not seen does not stand.
    """
    first: Sighting | None = None

    def stands(seen: Sighting | None) -> bool:
        nonlocal first
        if seen is None or seen.taken_s <= begun_s:
            return False
        if first is None or _is_elsewhere(first.pose, seen.pose):
            first = seen
            return False
        return seen.taken_s - first.heard_s >= STILL_S

    return stands


def _is_elsewhere(before: GroundPose, now: GroundPose) -> bool:
    turned_rad = abs(wrap_angle(now.heading_rad - before.heading_rad))
    return now.distance_m(before) > STILL_M or turned_rad > STILL_RAD


_LOOK_EVERY_S = 0.02
_AGAIN_S = 0.25
_QUICK_S = 2.0


class Contact:
    """One robot, over one session after the other; the ear belongs to the session."""

    def __init__(
        self, opener: Opener, frames: Frames, settings: RosSettings, clock: Callable[[], float] = monotonic
    ) -> None:
        """Connect, and wait until the robot reports its pose.

        Raises:
            NavigationError: nobody answers there, or the robot does not report its pose.
            BackendError: what the transport needs is not installed.
        """
        self.frames, self.settings = frames, settings
        self._opener, self._clock = opener, clock
        self._last: GroundPose | None = None
        self._renewing = threading.Lock()
        self.ear = Ear(clock)
        self.session, self.ear = self._opened(settings.connect_timeout_s)
        if self._seen(settings.pose_timeout_s, self._is_fresh) is None:
            self.session.close()
            raise NavigationError(
                f"The robot at {self.session.link.name} does not report its pose: {self.unseen(closed=True)}; start "
                "its localisation, give it its initial pose, and name its frames as docs/robots.md shows."
            )

    def _opened(self, within_s: float) -> tuple[Session, Ear]:
        ear = Ear(self._clock)
        ear.tree.take(self.ear.tree.fixed(), static=True)
        return self._opener(ear, within_s), ear

    def renew(self, within_s: float | None = None) -> None:
        """Connect again where the connection was lost. ``NavigationError``: the robot is not there."""
        with self._renewing:
            if self.session.lost is not None:
                self.session.close()
                self.session, self.ear = self._opened(within_s or self.settings.connect_timeout_s)

    def renewed_within(self, wait_s: float) -> bool:
        """Connect again where the connection was lost, and try until some time is over; return whether it stands."""
        until_s = monotonic() + wait_s
        while self.session.lost is not None:
            with suppress(NavigationError):
                self.renew(min(_QUICK_S, self.settings.connect_timeout_s))
                continue
            if monotonic() >= until_s:
                return False
            sleep(_AGAIN_S)
        return True

    def replace(self) -> bool:
        """Connect a second time and leave the first connection, which may be stuck; return whether that succeeded."""
        with self._renewing:
            before = self.session
            with suppress(NavigationError):
                self.session, self.ear = self._opened(min(_QUICK_S, self.settings.connect_timeout_s))
                before.close()
            return self.session is not before

    @property
    def pose(self) -> GroundPose:
        """Where the robot is, level frame; where it was last, when that is not reported any more."""
        if self._is_fresh(seen := self.sighting()):
            self._last = self.frames.to_level(seen.pose)
        assert self._last is not None, "the constructor waits for it"
        return self._last

    def fresh_pose(self) -> GroundPose | None:
        """Return the pose as soon as it is young enough; None where it is not within that age."""
        return self._seen(self.settings.pose_max_age_s, self._is_fresh)

    def pose_from_now(self, wait_s: float) -> GroundPose | None:
        """Return a pose that was taken after this call; None where none is within that time."""
        now_s = self._clock()
        return self._seen(wait_s, lambda seen: seen is not None and seen.taken_s > now_s)

    def stands_still(self, wait_s: float) -> bool:
        """Return whether the robot is seen to come to stand within that time; see `stillness`."""
        return self._seen(wait_s, stillness(self._clock())) is not None

    def _seen(self, wait_s: float, is_wanted: Callable[[Sighting | None], bool]) -> GroundPose | None:
        """Look until what is seen is wanted, and return the pose; None where time or the connection ends before."""
        until_s = monotonic() + wait_s
        while not is_wanted(seen := self.sighting()):
            if self.session.lost is not None or monotonic() > until_s:
                return None
            sleep(_LOOK_EVERY_S)
        assert seen is not None, "nothing seen is never wanted"
        self._last = self.frames.to_level(seen.pose)
        return self._last

    def _is_fresh(self, seen: Sighting | None) -> TypeGuard[Sighting]:
        return seen is not None and seen.age_s <= self.settings.pose_max_age_s

    def is_unseen(self) -> bool:
        return not self._is_fresh(self.sighting())

    def unseen(self, closed: bool = False) -> str:
        """Return why the pose is not known, in part of a sentence."""
        if self.session.lost is not None and not closed:
            return self.loss()
        seen, tree = self.sighting(), self.ear.tree
        if seen is not None:
            late_s = seen.age_s - (self._clock() - seen.heard_s)
            queued = "; they arrive late, behind a bridge or a network that is too slow" if late_s > 1.0 else ""
            return f"its transforms are {seen.age_s:.1f} s old{queued}"
        refused = f"; {tree.refused} transforms were NaN or no rotation" if tree.refused else ""
        says = f"; {self.session.link.complaint}" if self.session.link.complaint else ""
        return tree.why_not(self.frames.map_frame, self.frames.base_frame) + refused + says

    def loss(self) -> str:
        return f"The connection to the robot was lost ({(self.session.lost or '').rstrip('.')})"

    def sighting(self) -> Sighting | None:
        """Return the pose by the transforms now, in the robot's frame."""
        return self.ear.tree.seen(self.frames.map_frame, self.frames.base_frame)
