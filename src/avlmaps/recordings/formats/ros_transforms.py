"""The tree of frames of a ROS recording: who is mounted on whom, and where it was when."""

from collections import Counter
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool, Float

from avlmaps.core.poses import inverse
from avlmaps.core.timeline import Trajectory, in_order


@dataclass
class _Edge:
    parent: str
    static: bool
    stamps_s: list[float] = field(default_factory=list)
    parent_from_child: list[np.ndarray] = field(default_factory=list)

    def trajectory(self) -> Trajectory:
        stamps_s, poses = np.array(self.stamps_s), np.stack(self.parent_from_child)
        kept = in_order(stamps_s, "transforms").index
        return Trajectory(stamps_s[kept], poses[kept])


class TransformTree:
    """Frames by name; each has one parent. Filled from /tf and /tf_static, or from odometry."""

    def __init__(self) -> None:
        self._edges: dict[str, _Edge] = {}
        self._broken: Counter[tuple[str, str]] = Counter()
        self._moved: set[str] = set()

    def add(
        self, parent: str, child: str, parent_from_child: Float[np.ndarray, "4 4"], stamp_s: float, static: bool
    ) -> None:
        """Add one transform; an invalid one (NaN, no rotation, a frame in itself) is left out and reported."""
        parent, child = parent.lstrip("/"), child.lstrip("/")
        if not np.isfinite(parent_from_child).all() or not child or parent == child:
            self._broken[parent, child] += 1
            return
        edge = self._edges.setdefault(child, _Edge(parent, static))
        if edge.parent != parent:
            self._moved.add(f"{child!r} is in {edge.parent!r} and in {parent!r}")
        edge.parent = parent
        if static:
            edge.static, edge.stamps_s, edge.parent_from_child = True, [0.0], [parent_from_child]
        else:
            edge.stamps_s.append(stamp_s)
            edge.parent_from_child.append(parent_from_child)

    @property
    def notices(self) -> tuple[str, ...]:
        """A sentence for each pair of frames with broken transforms, and for frames with two parents."""
        broken = (
            f"{count} transform(s) from {child!r} to {parent!r} are none (NaN, or no rotation) and left out."
            for (parent, child), count in sorted(self._broken.items())
        )
        return (*broken, *(f"The frame {words}; only one of them is used." for words in sorted(self._moved)))

    def cycle(self, frame: str) -> str:
        """Return the frames that go round in a circle above a frame, in words, or nothing."""
        chain = self._chain(frame)
        if not chain or self._edges[chain[-1]].parent not in chain:
            return ""
        again = self._edges[chain[-1]].parent
        return " -> ".join([*chain[chain.index(again) :], again])

    def span_s(self, frame: str) -> tuple[float, float] | None:
        """Return from when to when all that moves a frame is known, None where nothing moves it."""
        moving = [self._edges[name].stamps_s for name in self._chain(frame) if not self._edges[name].static]
        return (max(map(min, moving)), min(map(max, moving))) if moving else None

    def moves(self, frame: str) -> bool:
        """Return whether the frame moves relative to its tree's root."""
        return any(not self._edges[name].static for name in self._chain(frame))

    def root(self, frame: str) -> str:
        """Return the last ancestor."""
        chain = self._chain(frame)
        return self._edges[chain[-1]].parent if chain else frame.lstrip("/")

    def fixed(self, a: str, b: str) -> Float[np.ndarray, "4 4"] | None:
        """Return ``a_from_b`` where only static transforms lie between the two frames, else None."""
        a, b = a.lstrip("/"), b.lstrip("/")
        if a == b:
            return np.eye(4)
        up_a, up_b = self._static_ancestors(a), self._static_ancestors(b)
        shared = [name for name in up_a if name in up_b]
        return inverse(up_a[shared[0]]) @ up_b[shared[0]] if shared else None

    def root_from(
        self, frame: str, stamps_s: Float[np.ndarray, " k"]
    ) -> tuple[Float[np.ndarray, "k 4 4"], Bool[np.ndarray, " k"]]:
        """Return the pose of a frame in its tree's root at each stamp, and where it is known."""
        pose, known = np.broadcast_to(np.eye(4), (len(stamps_s), 4, 4)).copy(), np.ones(len(stamps_s), bool)
        for name in self._chain(frame):
            edge = self._edges[name]
            if edge.static:
                pose = edge.parent_from_child[0] @ pose
                continue
            trajectory = edge.trajectory()
            covered = trajectory.covers(stamps_s)
            known &= covered
            pose[covered] = trajectory.at(stamps_s[covered]) @ pose[covered]
        return pose, known

    def _chain(self, frame: str) -> list[str]:
        chain: list[str] = []
        name = frame.lstrip("/")
        while name in self._edges and name not in chain:
            chain.append(name)
            name = self._edges[name].parent
        return chain

    def _static_ancestors(self, frame: str) -> dict[str, np.ndarray]:
        """Return for each ancestor over static transforms, nearest first, ``ancestor_from_frame``."""
        reached = {frame: np.eye(4)}
        name = frame
        while name in self._edges and self._edges[name].static and self._edges[name].parent not in reached:
            edge = self._edges[name]
            reached[edge.parent] = edge.parent_from_child[0] @ reached[name]
            name = edge.parent
        return reached
