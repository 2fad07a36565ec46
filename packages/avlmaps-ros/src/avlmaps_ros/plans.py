"""The request to a robot for each movement, from where it stands, and the test whether the movement was made."""

from collections.abc import Callable
from math import atan2, degrees, hypot

import numpy as np
from jaxtyping import Float

from avlmaps.core.motion import GroundPose, wrap_angle
from avlmaps_ros.goals import ActionGoal, MovementPlan
from avlmaps_ros.settings import RosSettings

# From where to where, level x and y: where a body stops for a place and a note, or why it cannot.
Standing = Callable[[Float[np.ndarray, "2"], Float[np.ndarray, "2"]], tuple[Float[np.ndarray, "2"], str] | str]
Tasks = Callable[[GroundPose, float], tuple[ActionGoal, ...]]

LEAST_M, LEAST_RAD = 0.01, 0.01  # a movement so small is none
_FAR_M = 1e6
LONGEST_M = 1000.0  # of a straight drive


def place_to_stand(
    start: GroundPose,
    wanted: Float[np.ndarray, "2"],
    looked_at: Float[np.ndarray, "2"] | None,
    standing: Standing | None,
    settings: RosSettings,
    task: Callable[[GroundPose], ActionGoal],
) -> MovementPlan | str:
    """Plan to stand at a place, or return why that cannot be.

    It looks at ``looked_at`` once there, else in the direction of its arrival.
    """
    if not np.abs(wanted).max() < _FAR_M or (looked_at is not None and not np.abs(looked_at).max() < _FAR_M):
        return "NaN or a place beyond the Earth cannot be driven to"
    note, xy = "", wanted
    if standing is not None:
        stop = standing(np.array([start.x_m, start.y_m]), wanted)
        if isinstance(stop, str):
            return stop
        xy, note = stop
    x_m, y_m = (float(value) for value in xy)
    asked = None if looked_at is None else _bearing_rad(x_m, y_m, *looked_at)
    travel = _bearing_rad(start.x_m, start.y_m, x_m, y_m)
    target = GroundPose(x_m, y_m, next((angle for angle in (asked, travel) if angle is not None), start.heading_rad))

    def off(now: GroundPose) -> str:
        away_m, turned = now.distance_m(target), abs(wrap_angle(now.heading_rad - target.heading_rad))
        if away_m > settings.reached_m:
            return f"it stands {away_m:.2f} m from where it was sent"
        if asked is not None and turned > settings.reached_rad:
            return f"it looks {degrees(turned):.0f} degrees past where it was to look"
        return ""

    return MovementPlan((task(target),), off, note)


def plan_turn(start: GroundPose, angle_rad: float, settings: RosSettings, tasks: Tasks) -> MovementPlan | str:
    """Plan a turn on the spot, or return why that cannot be."""
    if not abs(angle_rad) < 100.0:
        return f"{angle_rad} rad is not an angle to turn by"

    def off(now: GroundPose) -> str:
        wrong = abs(wrap_angle(now.heading_rad - start.heading_rad - angle_rad))
        allowed = min(settings.reached_rad, max(0.05, abs(angle_rad) / 2))
        return f"it is {degrees(wrong):.0f} degrees from where it was to turn" if wrong > allowed else ""

    return MovementPlan(() if abs(angle_rad) < LEAST_RAD else tasks(start, angle_rad), off)


def ahead_of(start: GroundPose, distance_m: float, settings: RosSettings, tasks: Tasks) -> MovementPlan | str:
    """Plan a straight drive, or return why that cannot be."""
    if not abs(distance_m) < LONGEST_M:
        return f"{distance_m} m is not a distance to drive"
    target = start.ahead(distance_m)

    def off(now: GroundPose) -> str:
        away_m = now.distance_m(target)
        allowed = min(settings.reached_m, max(0.05, abs(distance_m) / 2))
        return f"it is {away_m:.2f} m from where it was to drive" if away_m > allowed else ""

    return MovementPlan(() if abs(distance_m) < LEAST_M else tasks(start, distance_m), off)


def _bearing_rad(from_x: float, from_y: float, to_x: float, to_y: float) -> float | None:
    dx, dy = float(to_x - from_x), float(to_y - from_y)
    return atan2(dy, dx) if hypot(dx, dy) >= 0.05 else None
