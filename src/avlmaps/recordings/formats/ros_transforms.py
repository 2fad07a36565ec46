"""The tree of frames of a ROS recording: who is mounted on whom, and where it was when."""

from collections import Counter
from dataclasses import dataclass, field
from itertools import takewhile

import numpy as np
from jaxtyping import Bool, Float

from avlmaps.core.poses import inverse
from avlmaps.core.timeline import Trajectory, in_order

# A correction such as map -> odom may come seldom: past its ends it is held for this long, as tf holds the last one,
# and a pause of twice as long is bridged.
HOLD_S = 10.0
_SAME = 1e-9


@dataclass
class _Edge:
    parent: str
    static: bool
    stamps_s: list[float] = field(default_factory=list)
    parent_from_child: list[np.ndarray] = field(default_factory=list)
    constant: bool = True  # it never changes, as a mount that is published again and again

    def add(self, stamp_s: float, parent_from_child: np.ndarray) -> None:
        self.stamps_s.append(stamp_s)
        self.parent_from_child.append(parent_from_child)
        self.constant &= bool(np.abs(parent_from_child - self.parent_from_child[0]).max() <= _SAME)

    def forget(self, before_s: float) -> None:
        kept = [at for at, stamp_s in enumerate(self.stamps_s) if stamp_s >= before_s] or [len(self.stamps_s) - 1]
        self.stamps_s = [self.stamps_s[at] for at in kept]
        self.parent_from_child = [self.parent_from_child[at] for at in kept]

    def trajectory(self) -> Trajectory:
        stamps_s, poses = np.array(self.stamps_s), np.stack(self.parent_from_child)
        kept = in_order(stamps_s, "transforms").index
        return Trajectory(stamps_s[kept], poses[kept])


class TransformTree:
    """Frames by name. Filled from /tf and /tf_static, or from odometry.

    Of a frame with several parents the one that moves it most often counts: of a URDF's base_link and a visual
    odometry's odom, odom.
    """

    def __init__(self) -> None:
        self._edges: dict[str, dict[str, _Edge]] = {}
        self._broken: Counter[tuple[str, str]] = Counter()

    def add(
        self, parent: str, child: str, parent_from_child: Float[np.ndarray, "4 4"], stamp_s: float, static: bool
    ) -> None:
        """Add one transform; an invalid one (NaN, no rotation, a frame in itself) is left out and reported."""
        parent, child = parent.lstrip("/"), child.lstrip("/")
        if not np.isfinite(parent_from_child).all() or not child or parent == child:
            self._broken[parent, child] += 1
            return
        edge = self._edges.setdefault(child, {}).setdefault(parent, _Edge(parent, static))
        if static:
            edge.static, edge.constant, edge.stamps_s, edge.parent_from_child = True, True, [0.0], [parent_from_child]
        elif not edge.static:
            edge.add(stamp_s, parent_from_child)

    def mounts(self) -> "TransformTree":
        """Return the tree of what never moves, declared so or not."""
        tree = TransformTree()
        for child, parents in self._edges.items():
            for edge in parents.values():
                if edge.constant:
                    tree.add(edge.parent, child, edge.parent_from_child[0], 0.0, static=True)
        return tree

    def forget(self, before_s: float) -> None:
        """Leave out moving transforms from before a stamp, but for the last of each: a robot drives for days."""
        for parents in self._edges.values():
            for edge in parents.values():
                if not edge.static:
                    edge.forget(before_s)

    def newest_s(self, frame: str) -> float | None:
        """Return up to when what moves a frame most often is known, None where nothing moves it."""
        carrier = self._carrier(frame)
        return max(self._edge(carrier).stamps_s) if carrier else None

    @property
    def notices(self) -> tuple[str, ...]:
        """A sentence for each pair of frames with broken transforms, and for frames with two parents."""
        broken = (
            f"{count} transform(s) from {child!r} to {parent!r} are none (NaN, or no rotation) and left out."
            for (parent, child), count in sorted(self._broken.items())
        )
        several = (
            f"The frame {child!r} is in {' and in '.join(map(repr, parents))}; {self._edge(child).parent!r} is used."
            for child, parents in sorted(self._edges.items())
            if len(parents) > 1
        )
        return (*broken, *several)

    def seldom(self, frame: str, stamps_s: Float[np.ndarray, " k"]) -> tuple[str, ...]:
        """Return a sentence for each transform above a frame that was bridged or held at some of the stamps."""
        carrier = self._carrier(frame)
        told: list[str] = []
        for name in self._chain(frame):
            edge = self._edge(name)
            if name == carrier or edge.constant:
                continue
            trajectory = edge.trajectory()
            lenient = trajectory.covers(stamps_s, HOLD_S, 2.0 * HOLD_S) & ~trajectory.covers(stamps_s)
            if lenient.any():
                told.append(
                    f"The transform from {name!r} to {edge.parent!r} came {len(trajectory.stamps_s)} times; between "
                    f"them it is interpolated, and before the first and after the last held for up to {HOLD_S:g} s "
                    f"(for {lenient.sum()} frames)."
                )
        return tuple(told)

    def cycle(self, frame: str) -> str:
        """Return the frames that go round in a circle above a frame, in words, or nothing."""
        chain = self._chain(frame)
        if not chain or self._edge(chain[-1]).parent not in chain:
            return ""
        again = self._edge(chain[-1]).parent
        return " -> ".join([*chain[chain.index(again) :], again])

    def span_s(self, frame: str) -> tuple[float, float] | None:
        """Return from when to when all that moves a frame is known, None where nothing moves it."""
        moving = [self._edge(name).stamps_s for name in self._chain(frame) if not self._edge(name).static]
        return (max(map(min, moving)), min(map(max, moving))) if moving else None

    def moves(self, frame: str) -> bool:
        """Return whether the frame moves relative to its tree's root."""
        return self._carrier(frame) != ""

    def root(self, frame: str) -> str:
        """Return the last ancestor."""
        chain = self._chain(frame)
        return self._edge(chain[-1]).parent if chain else frame.lstrip("/")

    def ancestors(self, frame: str) -> list[str]:
        """Return the frames above a frame, nearest first."""
        return [self._edge(name).parent for name in self._chain(frame)]

    def fixed(self, a: str, b: str) -> Float[np.ndarray, "4 4"] | None:
        """Return ``a_from_b`` where only transforms that never change lie between the two frames, else None."""
        a, b = a.lstrip("/"), b.lstrip("/")
        if a == b:
            return np.eye(4)
        up_a, up_b = self._static_ancestors(a), self._static_ancestors(b)
        shared = [name for name in up_a if name in up_b]
        return inverse(up_a[shared[0]]) @ up_b[shared[0]] if shared else None

    def root_from(
        self, frame: str, stamps_s: Float[np.ndarray, " k"], world: str = ""
    ) -> tuple[Float[np.ndarray, "k 4 4"], Bool[np.ndarray, " k"]]:
        """Return the pose of a frame in its tree's root, or in a frame above it, at each stamp, and where it is known.

        The transform that moves the frame most often has to be known there; the others, which correct it, may come
        seldom (``HOLD_S``).
        """
        pose, known = np.broadcast_to(np.eye(4), (len(stamps_s), 4, 4)).copy(), np.ones(len(stamps_s), bool)
        carrier = self._carrier(frame)
        for name in takewhile(lambda name: name != world, self._chain(frame)):
            edge = self._edge(name)
            if edge.static or (name != carrier and edge.constant):
                pose = edge.parent_from_child[0] @ pose
                continue
            trajectory = edge.trajectory()
            leave = () if name == carrier else (HOLD_S, 2.0 * HOLD_S)
            covered = trajectory.covers(stamps_s, *leave)
            known &= covered
            pose[covered] = trajectory.at(stamps_s[covered], *leave[:1]) @ pose[covered]
        return pose, known

    def _edge(self, child: str) -> _Edge:
        """Return the edge to a frame's parent, of several that which moves it most often."""
        return max(self._edges[child].values(), key=lambda edge: (not edge.static, len(edge.stamps_s)))

    def _carrier(self, frame: str) -> str:
        """Return the frame above (or of) a frame that is moved most often; nothing where none is moved."""
        moving = [name for name in self._chain(frame) if not self._edge(name).static]
        changing = [name for name in moving if not self._edge(name).constant]
        return max(changing or moving, key=lambda name: len(self._edge(name).stamps_s), default="")

    def _chain(self, frame: str) -> list[str]:
        chain: list[str] = []
        name = frame.lstrip("/")
        while name in self._edges and name not in chain:
            chain.append(name)
            name = self._edge(name).parent
        return chain

    def _static_ancestors(self, frame: str) -> dict[str, np.ndarray]:
        """Return for each ancestor over transforms that never change, nearest first, ``ancestor_from_frame``."""
        reached = {frame: np.eye(4)}
        name = frame
        while name in self._edges:
            edge = next((e for e in self._edges[name].values() if e.constant), None)
            if edge is None or edge.parent in reached:
                break
            reached[edge.parent] = edge.parent_from_child[0] @ reached[name]
            name = edge.parent
        return reached
