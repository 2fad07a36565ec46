"""When a robot is seen to stand: a law of its sightings, over any transport."""

from avlmaps.core.motion import GroundPose, wrap_angle
from avlmaps.navigate.ros.tree import Sighting

STILL_M, STILL_RAD, STILL_S = 0.015, 0.02, 0.5


class Stillness:
    """Decides from sightings, one after the other, whether a body stands.

    Two poses are compared that were taken at least `STILL_S` apart, and every pose between them. When a pose was taken
    is known within bounds: the first no later than it was heard, the last no earlier than every moving transform in it
    was made. So neither a slow transform nor a queue makes a moving body stand.
    """

    def __init__(self, begun_s: float) -> None:
        """Begin.

        Args:
            begun_s: poses count that were taken after this time.
        """
        self._begun_s = begun_s
        self._first: Sighting | None = None

    def shown(self, seen: Sighting | None) -> bool:
        """Take in what is seen now; return whether the body stands. A robot that reports nothing does not."""
        if seen is None or seen.taken_s <= self._begun_s:
            return False
        if self._first is None or _is_elsewhere(self._first.pose, seen.pose):
            self._first = seen
            return False
        return seen.taken_s - self._first.heard_s >= STILL_S


def _is_elsewhere(before: GroundPose, now: GroundPose) -> bool:
    turned_rad = abs(wrap_angle(now.heading_rad - before.heading_rad))
    return now.distance_m(before) > STILL_M or turned_rad > STILL_RAD
