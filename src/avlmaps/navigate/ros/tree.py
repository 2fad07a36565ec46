"""The robot's tree of frames by the current /tf and /tf_static, and the pose of its body in it."""

import threading
from collections.abc import Callable
from dataclasses import dataclass
from math import atan2, hypot
from time import monotonic

import msgspec
import numpy as np
from jaxtyping import Float

from avlmaps.core.motion import GroundPose
from avlmaps.navigate.ros.messages import sanitize_line, transforms_in

_MOST_FRAMES = 5000
_FAR_M = 1e6


@dataclass(frozen=True, slots=True)
class _Edge:
    parent: str
    parent_from_child: Float[np.ndarray, "4 4"]
    static: bool
    heard_s: float


@dataclass(frozen=True, slots=True)
class Sighting:
    """A pose by the tree.

    Attributes:
        pose: of the body on the ground, in the fixed frame.
        heard_s: when the oldest of the moving transforms that it is made of was heard, by the tree's clock.
        age_s: since then, at the moment of looking. To order events, compare ``heard_s``: a process may
            stand still between two looks at a clock.
    """

    pose: GroundPose
    heard_s: float
    age_s: float


class LiveTree:
    """Stores the newest transform of each frame, by this machine's clock: the robot's may be set otherwise.

    Attributes:
        refused: how many transforms were left out, being NaN or no rotation.
    """

    def __init__(self, clock: Callable[[], float] = monotonic) -> None:
        """Begin with no frames."""
        self._clock = clock
        self._edges: dict[str, _Edge] = {}
        self._lock = threading.Lock()
        self.refused = 0

    def hear(self, message: msgspec.Raw, static: bool) -> None:
        """Take in one message.

        Raises:
            ValueError: it is none.
        """
        transforms, refused = transforms_in(message)
        now_s = self._clock()
        with self._lock:
            self.refused += refused
            for parent, child, parent_from_child in transforms:
                known = child in self._edges or len(self._edges) < _MOST_FRAMES
                if known and child and parent and child != parent:
                    self._edges[child] = _Edge(parent, parent_from_child, static, now_s)

    def seen(self, fixed: str, body: str) -> Sighting | None:
        """Return where the body is in the fixed frame; None where no chain of transforms leads there."""
        with self._lock:
            chain = self._chain(fixed, body)
        if chain is None:
            return None
        fixed_from_body, heard_s = np.eye(4), [edge.heard_s for edge in chain if not edge.static]
        for edge in chain:
            fixed_from_body = edge.parent_from_child @ fixed_from_body
        ahead_x, ahead_y = fixed_from_body[:2, 0]
        if hypot(ahead_x, ahead_y) < 0.1:  # it stands on end, and heads nowhere
            return None
        x_m, y_m = float(fixed_from_body[0, 3]), float(fixed_from_body[1, 3])
        if max(abs(x_m), abs(y_m)) > _FAR_M:
            return None
        pose = GroundPose(x_m, y_m, atan2(ahead_y, ahead_x))
        now_s = self._clock()
        oldest_s = min(heard_s, default=now_s)
        return Sighting(pose, oldest_s, now_s - oldest_s)

    def why_not(self, fixed: str, body: str) -> str:
        """Return the missing link between two frames, as part of a sentence."""
        with self._lock:
            if not self._edges:
                return "nothing arrives on /tf"
            name, passed = body, set()
            while name in self._edges and name not in passed and name != fixed:
                passed.add(name)
                name = self._edges[name].parent
            known = sorted({*self._edges, *(edge.parent for edge in self._edges.values())})
        if not passed:
            return f"/tf has no frame {body!r}; it has {_listed(known)}"
        return f"/tf leads from {body!r} up to {name!r} and not to {fixed!r}; it has {_listed(known)}"

    def _chain(self, fixed: str, body: str) -> list[_Edge] | None:
        """Return the transforms from the body up to the fixed frame."""
        chain: list[_Edge] = []
        name = body
        while name != fixed:
            edge = self._edges.get(name)
            if edge is None or len(chain) > len(self._edges):
                return None
            chain.append(edge)
            name = edge.parent
        return chain


def _listed(names: list[str], most: int = 8) -> str:
    return ", ".join(sanitize_line(name, 40) for name in names[:most]) + (
        f" and {len(names) - most} more" if len(names) > most else ""
    )
