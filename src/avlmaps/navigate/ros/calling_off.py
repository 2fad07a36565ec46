"""Calling one goal off until the robot confirms that it is over; the driver and its guard do it in the same way."""

from collections.abc import Callable
from time import monotonic

from avlmaps.navigate.ros.goals import Goal
from avlmaps.navigate.ros.session import Session

AGAIN_S = 0.5


def ended_within(goal: Goal, session: Session, wait_s: float) -> bool:
    """Wait until a goal is over, or the session; return whether the goal is."""
    with session.heard:
        session.heard.wait_for(lambda: goal.end is not None or session.lost is not None, wait_s)
    return goal.end is not None


def call_off(goal: Goal, session: Session, until_s: float, given_up: Callable[[], bool] = lambda: False) -> bool:
    """Cancel a goal again and again until it is over, the session is lost or a time has come.

    Args:
        goal: ours; no other goal is cancelled.
        session: stands.
        until_s: by `time.monotonic`.
        given_up: returns whether to stop sooner.
    """
    while goal.end is None and session.lost is None and not given_up() and (left_s := until_s - monotonic()) > 0.0:
        session.cancel(goal)
        ended_within(goal, session, min(left_s, AGAIN_S))
    return goal.end is not None
