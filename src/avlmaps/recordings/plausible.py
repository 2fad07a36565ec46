"""Whether clocks fit one another and poses can be those of one walk, before a map is made of them."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float, Int

# Faster than any robot, or anybody who carries a camera through a building.
MAX_SPEED_M_S = 20.0
# A correction of drift or a relocalisation may move a pose by as much at once.
MAX_JUMP_M = 3.0
# Further, what follows the jump is in another world.
MAX_SHIFT_M = 100.0
# The frames of one map lie within it; larger maps ask for more memory than there is.
MAX_EXTENT_M = 2_000.0
# Beyond it, places stored in single precision are off by more than a millimetre.
MAX_FROM_ORIGIN_M = 20_000.0
# A pose that is one of few that are out of place is left out; of more, none is to be trusted.
MAX_STRAY_SHARE = 0.05
MAX_STRAYS = 5
# Seconds since 1970 stay below it until the year 2286.
_LATEST_DATE_S = 1e10
# Dates of recordings, 2001 to 2096: in milliseconds, microseconds or nanoseconds they are other numbers.
_DATES_S = 1e9, 4e9
# Frames further apart than this, at an even pace, are no walk.
SLOWEST_PACE_S = 10.0
_USUAL_PACE_S = 0.1  # cameras take 1 to 120 pictures a second
_UNITS = ((1e3, "milliseconds"), (1e6, "microseconds"), (1e9, "nanoseconds"))
_SHOWN = 3
_FEWEST_STAMPS = 4
_SINGLE_S = float(1 << 24)  # beyond it single precision has no whole seconds


def date_fault(stamps_s: Float[np.ndarray, " n"], what: str) -> str:
    """Return a sentence where stamps can only be a date in another unit than seconds, else nothing."""
    finite = stamps_s[np.isfinite(stamps_s)]
    latest = float(finite.max(initial=0.0))
    if latest <= _LATEST_DATE_S:
        return ""
    date = next((name for factor, name in _UNITS if _DATES_S[0] <= latest / factor <= _DATES_S[1]), "")
    apart = float(np.median(np.diff(finite))) if len(finite) > 2 else 0.0
    unit = f"{date} since 1970" if date else _unit_of(apart) if apart > 0.0 else "another unit"
    return f"The stamps of {what} reach {latest:.6g}, which are {unit}, not seconds; write them in seconds."


def _unit_of(apart: float, usual_s: float = _USUAL_PACE_S) -> str:
    return min(_UNITS, key=lambda unit: abs(np.log(apart / unit[0] / usual_s)))[1]


def repeat_fault(stamps_s: Float[np.ndarray, " n"], what: str) -> str:
    """Return a sentence where most stamps are those of others because their fractions were lost, else nothing."""
    finite = stamps_s[np.isfinite(stamps_s)]
    repeated = len(finite) - len(np.unique(finite))
    if len(finite) < _FEWEST_STAMPS or repeated <= 0.5 * len(finite):
        return ""
    whole, single = bool((finite % 1.0 == 0.0).all()), bool((finite.astype(np.float32) == finite).all())
    if not (whole or single):
        return ""
    lost = "whole seconds" if whole and float(np.abs(finite).max()) < _SINGLE_S else "stored in single precision"
    return (
        f"{repeated} of the {len(finite)} {what} have the stamp of another, and all look {lost}; write them in double "
        "precision, with fractions of a second."
    )


def pace_fault(stamps_s: Float[np.ndarray, " n"], what: str, expected_s: float | None = None) -> str:
    """Return a sentence where stamps are dates in another unit, or follow at an even pace too slow for a walk.

    Stamps rise; ``what`` says of what, in the plural, and ``expected_s`` the interval that the recording promises.
    """
    if (fault := date_fault(stamps_s, what)) or len(stamps_s) < 3:
        return fault
    interval_s = np.diff(stamps_s)
    pace_s = float(np.median(interval_s))
    if expected_s is not None:
        if 1 / 300 < pace_s / expected_s < 300:
            return ""
        looks = "are the stamps in seconds?"
        if pace_s > expected_s:
            looks = f"their stamps look like {_unit_of(pace_s, expected_s)}; write them in seconds."
        return f"The {what} are {pace_s:.3g} s apart, the recording says {expected_s:.3g} s; {looks}"
    if pace_s < SLOWEST_PACE_S or float(np.median(np.abs(interval_s - pace_s))) > 0.2 * pace_s:
        return ""
    return (
        f"The {what} are {pace_s:.4g} s apart, so their stamps look like {_unit_of(pace_s)}; write them in seconds, "
        "or confirm the pace where the format has a rate."
    )


@dataclass(frozen=True, slots=True)
class Plausible:
    """The frames of a walk that are used, rising; what is odd; why the recording cannot be used, or nothing."""

    index: Int[np.ndarray, " k"]
    notices: tuple[str, ...] = ()
    fault: str = ""


def plausible_walk(
    stamps_s: Float[np.ndarray, " n"],
    positions_m: Float[np.ndarray, "n 3"],
    names: Sequence[str],
    *,
    strays_are: str = "left out",
) -> Plausible:
    """Leave out poses that are out of place, and find out whether the rest can be one walk.

    A stretch ends where the camera moves by more than ``MAX_JUMP_M`` and ``MAX_SPEED_M_S``. The longest is accepted,
    and each other that can be reached from an accepted one. A few frames that cannot are left out; a long stretch at
    most ``MAX_SHIFT_M`` away is used, and reported (tracking began again).
    """
    every = np.arange(len(stamps_s))
    if not len(every):
        return Plausible(every)
    edges = _edges(stamps_s, positions_m)
    if len(edges) > 2 and (fault := _speed_fault(stamps_s, positions_m)):
        return Plausible(every, fault=fault)
    kept, shifts, fault = _reachable(stamps_s, positions_m, edges, names)
    strays = np.setdiff1d(every, kept)
    notices: list[str] = []
    if len(strays):
        away_m = np.linalg.norm(positions_m[strays] - np.median(positions_m[kept], axis=0), axis=1)
        first: list[int] = strays[:_SHOWN].tolist()
        shown = ", ".join(names[i] for i in first) + (" ..." if len(strays) > _SHOWN else "")
        notices.append(
            f"{len(strays)} frame(s) are up to {away_m.max():,.0f} m from the others, too far to be reached; "
            f"{strays_are}: {shown}."
        )
    rows: list[int] = kept.tolist()
    return Plausible(kept, (*notices, *shifts), fault or _extent_fault(positions_m[kept], [names[i] for i in rows]))


def _edges(stamps_s: Float[np.ndarray, " n"], positions_m: Float[np.ndarray, "n 3"]) -> Int[np.ndarray, " e"]:
    moved_m = np.linalg.norm(np.diff(positions_m, axis=0), axis=1)
    jumps = np.flatnonzero(moved_m > np.maximum(MAX_JUMP_M, MAX_SPEED_M_S * np.diff(stamps_s)))
    return np.concatenate([[0], jumps + 1, [len(stamps_s)]])


def _speed_fault(stamps_s: Float[np.ndarray, " n"], positions_m: Float[np.ndarray, "n 3"]) -> str:
    speed = np.linalg.norm(np.diff(positions_m, axis=0), axis=1) / np.maximum(np.diff(stamps_s), 1e-9)
    median = float(np.median(speed))
    if len(speed) < 3 or float((speed > MAX_SPEED_M_S).mean()) <= 0.5:  # one far pose of five is half of the steps
        return ""
    return (
        f"The camera would move at {median:,.0f} m/s, half of the time faster; positions must be in metres (not "
        "millimetres) and stamps in seconds."
    )


def _reachable(
    stamps_s: Float[np.ndarray, " n"],
    positions_m: Float[np.ndarray, "n 3"],
    edges: Int[np.ndarray, " e"],
    names: Sequence[str],
) -> tuple[Int[np.ndarray, " k"], list[str], str]:
    stretches = [np.arange(int(a), int(b)) for a, b in pairwise(edges)]
    longest = int(np.argmax(np.diff(edges)))
    kept, shifts, fault = [stretches[longest]], list[str](), ""
    few, left = max(MAX_STRAYS, int(MAX_STRAY_SHARE * len(stamps_s))), 0
    for order, step in ((stretches[longest + 1 :], 1), (stretches[:longest][::-1], -1)):
        last = int(stretches[longest][::step][-1])
        for stretch in order:
            first, end = (int(stretch[::step][at]) for at in (0, -1))
            away_m = float(np.linalg.norm(positions_m[first] - positions_m[last]))
            apart_s = abs(float(stamps_s[first] - stamps_s[last]))
            if away_m > max(MAX_JUMP_M, MAX_SPEED_M_S * apart_s):
                if left + len(stretch) <= few and 2 * len(stretch) < len(stamps_s):
                    left += len(stretch)
                    continue
                between = f"within {apart_s:.3g} s between frames {names[last]} and {names[first]}"
                jump = f"The camera jumps by {away_m:,.4g} m {between}"
                if away_m > MAX_SHIFT_M:
                    fault = fault or f"{jump}; fix those poses, or cut the recording there."
                else:
                    shifts.append(f"{jump}; if tracking began again there, the map shows the place twice.")
            kept.append(stretch)
            last = end
    return np.sort(np.concatenate(kept)), shifts[:_SHOWN], fault


def _extent_fault(positions_m: Float[np.ndarray, "n 3"], names: Sequence[str]) -> str:
    low, high = positions_m.min(axis=0), positions_m.max(axis=0)
    extent_m = float((high - low).max())
    if extent_m > MAX_EXTENT_M:
        furthest = int(np.argmax(np.linalg.norm(positions_m - np.median(positions_m, axis=0), axis=1)))
        return (
            f"The poses extend over {extent_m:,.0f} m, the furthest of frame {names[furthest]}; a map has at most "
            f"{MAX_EXTENT_M:,.0f} m, so fix the poses or cut the recording."
        )
    away_m = float(np.abs(positions_m).max())
    if away_m > MAX_FROM_ORIGIN_M:
        return (
            f"The poses lie {away_m:,.0f} m from the origin, where places are no longer exact to a millimetre; "
            "subtract the first position from all of them."
        )
    return ""
