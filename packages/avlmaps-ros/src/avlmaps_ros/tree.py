"""The robot's tree of frames by the current /tf and /tf_static, and the pose of its body in it."""

import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import atan2, hypot
from time import monotonic
from typing import Any

import numpy as np

from avlmaps.core.motion import GroundPose
from avlmaps_ros.messages import Transform, sanitize_line, transforms_in
from avlmaps_ros.settings import FAR_M

_MOST_FRAMES = 5000
_OVERTAKEN_S = 1.0


@dataclass(frozen=True, slots=True)
class _Edge:
    transform: Transform
    static: bool
    heard_s: float
    taken_s: float


@dataclass(slots=True)
class _Stamps:
    """How much later than at its fastest a transform comes, by its stamps; the robot's clock may be set otherwise."""

    first_s: float
    least_lag_s: float
    run: bool = False

    def late_s(self, stamp_s: float, now_s: float) -> float:
        self.run = self.run or stamp_s != self.first_s  # a stamp that never changes says nothing
        self.least_lag_s = min(self.least_lag_s, now_s - stamp_s)
        return now_s - stamp_s - self.least_lag_s if self.run else 0.0


@dataclass(frozen=True, slots=True)
class Sighting:
    """A pose by the tree.

    Each moving transform was made between ``taken_s`` and ``heard_s``, by this machine's clock. To order events,
    compare these: a process may stand still between two looks at a clock.
    """

    pose: GroundPose  # of the body on the ground, in the fixed frame
    taken_s: float  # a time after which every one of the moving transforms was made
    heard_s: float  # when the newest of them was heard
    age_s: float  # since ``taken_s``, at the moment of looking


class LiveTree:
    """Stores the newest transform of each frame, by this machine's clock: the robot's may be set otherwise.

    A transform is older than its arrival by the time that it spent in queues. Two signs show that time: the time from
    its stamp to its arrival grows beyond the least of them, and echoes come back late (`Echoes`). The greater counts.
    ``refused`` counts transforms that are NaN or no rotation.
    """

    def __init__(
        self, clock: Callable[[], float] = monotonic, sent_before: Callable[[float], float | None] = lambda _: None
    ) -> None:
        """Take a clock, and what says for a time of arrival after which time the robot had sent it; None if unknown."""
        self._clock, self._sent_before = clock, sent_before
        self._edges: dict[str, _Edge] = {}
        self._stamps: dict[str, _Stamps] = {}
        self._lock = threading.Lock()
        self._simulated_s: float | None = None
        self.refused = 0

    def hear(self, message: Any, static: bool) -> None:
        """Take in one message. ``ValueError``: it is none."""
        transforms, refused = transforms_in(message)
        self.refused += refused
        self.take(transforms, static)

    def take(self, transforms: Sequence[Transform], static: bool) -> None:
        now_s = self._clock()
        with self._lock:
            for transform in transforms:
                parent, child = transform.parent, transform.child
                before = self._edges.get(child)
                if not child or not parent or child == parent or (before is None and len(self._edges) >= _MOST_FRAMES):
                    continue
                stamp_s = transform.stamp_s
                late_s = self._late_s(child, stamp_s, now_s)
                is_soon = before is not None and now_s - before.heard_s < _OVERTAKEN_S
                if before is None or not (is_soon and 0.0 < stamp_s < before.transform.stamp_s):
                    self._edges[child] = _Edge(transform, static, now_s, now_s - late_s)

    def tick(self, simulated_s: float) -> None:
        """Take in the time of a simulation, by which its stamps run: slower than ours, as a rule, or not at all."""
        with self._lock:
            if self._simulated_s is None or simulated_s < self._simulated_s:
                self._stamps.clear()
            self._simulated_s = simulated_s

    def _late_s(self, child: str, stamp_s: float, now_s: float) -> float:
        if stamp_s == 0.0:
            return 0.0
        by_s = now_s if self._simulated_s is None else self._simulated_s
        stamps = self._stamps.setdefault(child, _Stamps(stamp_s, by_s - stamp_s))
        return stamps.late_s(stamp_s, by_s)

    def fixed(self) -> list[Transform]:
        """Return the static transforms; a bridge may hand them to its first client only."""
        with self._lock:
            return [edge.transform for edge in self._edges.values() if edge.static]

    def seen(self, fixed: str, body: str) -> Sighting | None:
        """Return where the body is in the fixed frame; None where no chain of transforms leads there."""
        with self._lock:
            chain, top = self._chain(fixed, body)
        fixed_from_body = np.eye(4)
        for edge in chain:
            fixed_from_body = edge.transform.parent_from_child @ fixed_from_body
        x_m, y_m = fixed_from_body[:2, 3].tolist()
        ahead_x, ahead_y = fixed_from_body[:2, 0]
        # A body on end heads nowhere.
        if top != fixed or hypot(ahead_x, ahead_y) < 0.1 or max(abs(x_m), abs(y_m)) > FAR_M:
            return None
        pose = GroundPose(x_m, y_m, atan2(ahead_y, ahead_x))
        moving = [edge for edge in chain if not edge.static]
        now_s = self._clock()
        taken_s = min((self._taken_s(edge) for edge in moving), default=now_s)
        heard_s = max((edge.heard_s for edge in moving), default=now_s)
        return Sighting(pose, taken_s, heard_s, now_s - taken_s)

    def _taken_s(self, edge: _Edge) -> float:
        sent_s = self._sent_before(edge.heard_s)
        return edge.taken_s if sent_s is None else min(edge.taken_s, sent_s)

    def why_not(self, fixed: str, body: str) -> str:
        """Return the missing link between two frames, as part of a sentence."""
        with self._lock:
            if not self._edges:
                return "nothing arrives on /tf"
            chain, top = self._chain(fixed, body)
            known = sorted({*self._edges, *(edge.transform.parent for edge in self._edges.values())})
        if not chain:
            return f"/tf has no frame {body!r}; it has {_listed(known)}"
        return f"/tf leads from {body!r} up to {top!r} and not to {fixed!r}; it has {_listed(known)}"

    def _chain(self, fixed: str, body: str) -> tuple[list[_Edge], str]:
        """Return the transforms from the body up as far as they lead, and where: a ring of them ends somewhere."""
        chain: list[_Edge] = []
        name = body
        while name != fixed and name in self._edges and len(chain) <= len(self._edges):
            chain.append(self._edges[name])
            name = chain[-1].transform.parent
        return chain, name


def _listed(names: list[str]) -> str:
    more = f" and {len(names) - 8} more" if len(names) > 8 else ""
    return ", ".join(sanitize_line(name, 40) for name in names[:8]) + more
