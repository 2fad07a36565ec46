"""Clocks: putting streams of different rates on one time line.

Stamps are float64 seconds. Nothing here crashes on a bad clock: stamps that run backwards are sorted or cut, and a
sentence reports it.
"""

from dataclasses import dataclass
from time import time

import numpy as np

from avlmaps.core.arrays import Bool, Float, Int

DAY_S = 86_400.0
# Messages of one stream may arrive a little out of order; a step back by more is a clock that was reset.
MAX_DISORDER_S = 1.0
# A pause is worth a report when it lasts this long and this many times the usual interval.
MIN_GAP_S = 1.0
MIN_GAP_INTERVALS = 5.0
_ANOTHER_DRIVE_S = 3600.0  # a pause from which on it is another drive
# A pose may be held this long past the ends of its stream: a frame of a 30 Hz camera may stick out by one interval.
EDGE_TOLERANCE_S = 0.04


@dataclass(frozen=True, slots=True)
class InOrder:
    """Rows of a stream whose stamps rise strictly, and a sentence for each thing that was done to get there."""

    index: Int[np.ndarray, " k"]
    notices: tuple[str, ...] = ()


def in_order(stamps_s: Float[np.ndarray, " n"], what: str) -> InOrder:
    """Put a stream, named in the plural (``poses of groundtruth.txt``), in the order of time, for any clock.

    Stamps that are no number are left out. Where the clock steps back by at most ``MAX_DISORDER_S`` the samples are
    sorted; where it steps back further it was reset, and only the longest stretch before, between or after such jumps
    remains, since one time line cannot hold two of them. Of equal stamps the first remains.
    """
    notices: list[str] = []
    index = np.flatnonzero(np.isfinite(stamps_s))
    if len(index) < len(stamps_s):
        notices.append(f"{len(stamps_s) - len(index)} {what} have a stamp that is not a number and are left out.")
    back_s = -np.diff(stamps_s[index])
    jumps = np.flatnonzero(back_s > MAX_DISORDER_S)
    if len(jumps):
        edges = np.concatenate([[0], jumps + 1, [len(index)]])
        longest = int(np.argmax(np.diff(edges)))
        kept = index[edges[longest] : edges[longest + 1]]
        notices.append(
            f"The clock of the {what} jumps back {len(jumps)} time(s), by up to {back_s.max():.3g} s; the longest "
            f"stretch, {len(kept)} of {len(index)}, is used."
        )
        index = kept
    elif np.any(back_s > 0.0):
        notices.append(f"The stamps of the {what} run backwards {int((back_s > 0).sum())} time(s); they were sorted.")
    index = index[np.argsort(stamps_s[index], kind="stable")]
    new = np.diff(stamps_s[index], prepend=-np.inf) > 0.0
    if not new.all():
        notices.append(f"{int((~new).sum())} {what} repeat the stamp of the one before and are left out.")
    return InOrder(index[new], tuple(notices))


def is_in_future(at_s: float) -> bool:
    """Return whether a moment, seconds since 1970, is still to come wherever it is tomorrow already."""
    return at_s > time() + DAY_S


def gap_notices(stamps_s: Float[np.ndarray, " n"], what: str, show: int = 3) -> tuple[str, ...]:
    """Return a sentence about the pauses in a stream of rising stamps, or nothing."""
    if len(stamps_s) < 3:
        return ()
    interval_s = np.diff(stamps_s)
    gaps = np.flatnonzero(interval_s > max(MIN_GAP_S, MIN_GAP_INTERVALS * float(np.median(interval_s))))
    if len(gaps) == 0:
        return ()
    longest = np.sort(gaps[np.argsort(-interval_s[gaps], kind="stable")[:show]])
    pauses = ", ".join(f"{_plain(float(interval_s[g]))} s after {stamps_s[g] - stamps_s[0]:.2f} s" for g in longest)
    more = f" and {len(gaps) - show} more" if len(gaps) > show else ""
    told = (f"There are no {what} for {pauses}{more}.",)
    if interval_s[longest].max() < _ANOTHER_DRIVE_S:
        return told
    return (*told, "A pause of hours means several drives: build a map of each, then `avlmaps merge` them.")


def _plain(length_s: float) -> str:
    return f"{length_s:.3g}" if length_s < 1000.0 else f"{length_s:.0f}"


def associate(
    a_s: Float[np.ndarray, " n"], b_s: Float[np.ndarray, " m"], tolerance_s: float
) -> tuple[Int[np.ndarray, " k"], Int[np.ndarray, " k"]]:
    """Return rows of two streams of rising stamps that are each other's nearest and at most ``tolerance_s`` apart.

    Both rise; each row is in at most one pair.
    """
    if len(a_s) == 0 or len(b_s) == 0:
        none = np.zeros(0, np.int64)
        return none, none
    b_of_a, a_of_b = nearest(a_s, b_s), nearest(b_s, a_s)
    a = np.arange(len(a_s))
    paired = (a_of_b[b_of_a] == a) & (np.abs(a_s - b_s[b_of_a]) <= tolerance_s)
    return a[paired], b_of_a[paired]


def nearest(asked_s: Float[np.ndarray, " n"], stamps_s: Float[np.ndarray, " m"]) -> Int[np.ndarray, " n"]:
    """Return the row of the nearest of some rising stamps, one at least, for each that is asked for."""
    right = np.clip(np.searchsorted(stamps_s, asked_s), 0, len(stamps_s) - 1)
    left = np.maximum(right - 1, 0)
    return np.where(asked_s - stamps_s[left] <= stamps_s[right] - asked_s, left, right)


@dataclass(frozen=True, slots=True)
class Trajectory:
    """Where a body was, known at strictly rising stamps, one at least, and interpolated between them."""

    stamps_s: Float[np.ndarray, " n"]
    world_from_body: Float[np.ndarray, "n 4 4"]

    def __post_init__(self) -> None:
        n = len(self.stamps_s)
        if n == 0 or self.world_from_body.shape != (n, 4, 4):
            raise ValueError(f"{n} stamps do not fit poses of {self.world_from_body.shape}; both need n >= 1")
        if not np.all(np.diff(self.stamps_s) > 0.0):
            raise ValueError("the stamps of a trajectory must rise strictly")

    def covers(
        self, stamps_s: Float[np.ndarray, " k"], edge_s: float = EDGE_TOLERANCE_S, max_gap_s: float | None = None
    ) -> Bool[np.ndarray, " k"]:
        """Return for each stamp whether a pose can be interpolated there.

        A stamp may lie ``edge_s`` outside the trajectory. A pause is bridged up to ``max_gap_s``, by default one second
        or five times the usual interval, whichever is longer.
        """
        first, last = self.stamps_s[0], self.stamps_s[-1]
        inside = (stamps_s >= first - edge_s) & (stamps_s <= last + edge_s)
        if len(self.stamps_s) < 2:
            return inside
        interval_s = np.diff(self.stamps_s)
        if max_gap_s is None:
            max_gap_s = max(MIN_GAP_S, MIN_GAP_INTERVALS * float(np.median(interval_s)))
        left, _, share = self._between(stamps_s)
        at_a_pose = (share == 0.0) | (share == 1.0)
        return inside & (at_a_pose | (interval_s[np.minimum(left, len(interval_s) - 1)] <= max_gap_s))

    def at(self, stamps_s: Float[np.ndarray, " k"], edge_s: float = EDGE_TOLERANCE_S) -> Float[np.ndarray, "k 4 4"]:
        """Return the pose at each stamp: positions on the straight line, rotations on the shortest arc (slerp).

        At a known stamp the known pose is returned exactly. Past an end, by at most ``edge_s``, the end is held;
        further outside is a ``ValueError``: ask ``covers`` first.
        """
        from scipy.spatial.transform import Rotation

        outside_s = np.maximum(self.stamps_s[0] - stamps_s, stamps_s - self.stamps_s[-1])
        if np.any(~(outside_s <= edge_s)):
            raise ValueError(
                f"a stamp lies {np.max(outside_s):.3g} s outside the trajectory; at most {edge_s} s passes"
            )
        left, right, share = self._between(stamps_s)
        asked = self.world_from_body[np.where(share == 1.0, right, left)]
        inner = np.flatnonzero((share > 0.0) & (share < 1.0))
        if len(inner):
            a, b, t = self.world_from_body[left[inner]], self.world_from_body[right[inner]], share[inner][:, None]
            turn = Rotation.from_matrix(np.swapaxes(a[:, :3, :3], 1, 2) @ b[:, :3, :3]).as_rotvec()
            asked[inner, :3, :3] = a[:, :3, :3] @ Rotation.from_rotvec(t * turn).as_matrix()
            asked[inner, :3, 3] = (1.0 - t) * a[:, :3, 3] + t * b[:, :3, 3]
        return asked

    def _between(
        self, stamps_s: Float[np.ndarray, " k"]
    ) -> tuple[Int[np.ndarray, " k"], Int[np.ndarray, " k"], Float[np.ndarray, " k"]]:
        last = len(self.stamps_s) - 1
        left = np.clip(np.searchsorted(self.stamps_s, stamps_s, side="right") - 1, 0, last)
        right = np.minimum(left + 1, last)
        length_s = np.where(right > left, self.stamps_s[right] - self.stamps_s[left], 1.0)
        return left, right, np.clip((stamps_s - self.stamps_s[left]) / length_s, 0.0, 1.0) * (right > left)
