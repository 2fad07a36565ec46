"""Frames of a running robot: colour and depth of one moment, their cameras, and where it was.

Messages are those of rclpy or have the same fields. What cannot become a frame is left out, counted, and said once.
"""

from collections import deque
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from avlmaps.core.arrays import Float64
from avlmaps.core.camera import Rig
from avlmaps.core.errors import RecordingError
from avlmaps.live.growing_folder import Once
from avlmaps.recordings.formats.ros_messages import (
    PAIRING_TOLERANCE_S,
    camera_of,
    colour_of,
    depth_of,
    is_rectified,
    pose_of,
    stamp_of,
)
from avlmaps.recordings.formats.ros_transforms import TransformTree, body_of
from avlmaps.recordings.types import Frame

PARTNER_WITHIN_S = 1.0  # a depth picture waits this long for the colour picture of its moment
POSE_WITHIN_S = 0.5  # a pair of pictures waits this long for the pose of its moment, while no older pose comes
LATER_POSE_WITHIN_S = 0.1  # ... and this long for a pose after it, between which and the one before it lies
SETTLED_S = 2.0  # a calibration or a mount that has not come by then is taken to be missing
_HELD = 60  # pictures and pairs that wait, at most
_FORGET_EVERY = 500  # transforms
KEPT_S = 30.0  # transforms are kept this long: pictures may come late, since they are sent again where a part was lost
PAUSE_S, LEAST_GAPS = 3.0, 10  # a longer time without a picture is a pause; from fewer gaps no period is known


class _Picture(NamedTuple):
    stamp_s: float
    message: Any
    came_s: float


class _Pair(NamedTuple):
    colour: _Picture
    depth: _Picture
    came_s: float


class RosFrames:
    """Puts frames together.

    Attributes:
        unpaired: depth pictures without a colour picture of their moment.
        unplaced: pairs without a pose of their moment.
        unread: pairs that cannot be read.
    """

    def __init__(self, topics: Mapping[str, str], tell: Callable[[str], None]) -> None:
        """Take the topics' names as far as they are known, for sentences: ``rgb``, ``depth`` and ``pose``."""
        self.unpaired = self.unplaced = self.unread = 0
        self._topics, self._once = topics, Once(tell)
        self._tree, self._moved, self._world = TransformTree(), 0, ""
        self._infos: dict[str, Any] = {}
        self._rig: Rig | None = None
        self._camera_frame, self._last_s = "", dict[str, float]()  # stamp of the last picture of each kind
        self._pictures: dict[str, deque[_Picture]] = {"rgb": deque(maxlen=_HELD), "depth": deque(maxlen=_HELD)}
        self._pairs: deque[_Pair] = deque(maxlen=_HELD)
        self._first_s: float | None = None
        self._moved_s = float("-inf")  # when the last pose came
        self._gaps_s: list[float] = []  # from one stamp of a depth picture to the next

    @property
    def never_arrived(self) -> tuple[int, int]:
        """How many depth pictures are missing by the stamps of the others, and how many were sent with them.

        The camera's period is the time that few gaps are shorter than. A long gap is a pause, not a loss.
        """
        gaps_s = np.array([gap_s for gap_s in self._gaps_s if 0.0 < gap_s < PAUSE_S])
        if len(gaps_s) < LEAST_GAPS:
            return 0, len(self._gaps_s)
        lost = int((np.rint(gaps_s / np.quantile(gaps_s, 0.05)) - 1).clip(0).sum())
        return lost, len(self._gaps_s) + 1 + lost

    def take(self, kind: str, message: Any, now_s: float) -> None:
        """Take a message; ``now_s`` is when it came, by a clock that never goes back."""
        match kind:
            case "rgb" | "depth":
                self._take_picture(kind, message, now_s)
            case "rgb_info" | "depth_info":
                self._infos[kind] = message
            case "tf" | "tf_static":
                self._moved_s = now_s if kind == "tf" else self._moved_s
                for transform in message.transforms:
                    self._move(transform.header.frame_id, transform.child_frame_id, transform, kind == "tf_static")
            case "pose":
                self._moved_s = now_s
                self._take_pose(message)

    def ready(self, now_s: float) -> list[Frame]:
        """Return the frames that are whole now, in the order of time, by the clock of ``take``."""
        self._pair(now_s)
        found: list[Frame] = []
        while self._pairs:
            pair = self._pairs[0]
            rig = self._rig_of(pair, now_s)
            pose = None if rig is None else self._pose_of(pair, now_s)
            if pose is None and self._may_be_placed(pair, now_s):
                break
            self._pairs.popleft()
            if rig is None or pose is None:
                self.unplaced += 1
                self._once(f"Frames are left out: {self.missing()}.")
            elif (frame := self._read(pair, rig, pose)) is not None:
                found.append(frame)
        return found

    def _may_be_placed(self, pair: _Pair, now_s: float) -> bool:
        """Return whether the pose of a pair may come yet: those that came are older, and came a moment ago."""
        newest_s = self._tree.newest_s(pair.depth.message.header.frame_id)
        if newest_s is None:
            return now_s - pair.came_s <= POSE_WITHIN_S
        is_passed = newest_s > pair.depth.stamp_s + POSE_WITHIN_S
        return not is_passed and now_s - max(pair.came_s, self._moved_s) <= POSE_WITHIN_S

    def missing(self) -> str:
        """Return what there is too little of for a frame, as part of a sentence."""
        for kind, what in (("rgb", "colour picture"), ("depth", "depth picture")):
            if kind not in self._last_s:
                return f"no {what} has come on {self._topics[kind]}"
            if self._last_s[kind] <= 0.0:
                return f"the {what}s on {self._topics[kind]} have no stamps; let their driver set them"
        if "rgb_info" not in self._infos:
            return f"no CameraInfo has come beside {self._topics['rgb']}"
        if self._first_s is None:
            ahead_s = self._last_s["rgb"] - self._last_s["depth"]
            return (
                f"no pictures of {self._topics['rgb']} and {self._topics['depth']} are of one moment (within "
                f"{1000 * PAIRING_TOLERANCE_S:.0f} ms): the last of colour is {abs(ahead_s):.3f} s "
                f"{'after' if ahead_s > 0.0 else 'before'} the last of depth by their stamps; check that both have one "
                "clock"
            )
        if self._rig is None:
            if "depth_info" not in self._infos:
                return f"no CameraInfo has come beside {self._topics['depth']} yet"
            return "no static transform between the cameras of colour and of depth has come yet"
        if self.unread and not self.unplaced:
            return f"none of {self.unread} frames can be read"
        return self._unplaced()

    def _unplaced(self) -> str:
        frame = self._camera_frame
        if not self._tree.moves(frame):
            root = self._tree.root(frame)
            chain = f"; it hangs on {root!r}, and a transform to that is missing" if root != frame.lstrip("/") else ""
            return f"nothing moves the camera {frame!r}: no transform on /tf leads to it, and no odometry{chain}"
        if self._world and self._world not in self._tree.ancestors(frame):
            return f"the transforms of the camera {frame!r} do not lead to {self._world!r} any more"
        span, stamp_s = self._tree.span_s(frame), self._last_s["depth"]
        if span is None or span[0] <= stamp_s <= span[1]:
            return f"the camera {frame!r} has no pose at the pictures' stamps, between poses before and after them"
        off_s, which = max((stamp_s - span[1], "after the last"), (span[0] - stamp_s, "before the first"))
        return (
            f"the camera {frame!r} has no pose at the pictures' stamps: the last picture is {off_s:.3f} s {which} "
            f"pose; check that both have one clock, and that poses come within {POSE_WITHIN_S:g} s"
        )

    def _take_picture(self, kind: str, message: Any, now_s: float) -> None:
        stamp_s = stamp_of(message)
        if kind == "depth" and kind in self._last_s:
            self._gaps_s.append(stamp_s - self._last_s[kind])
        self._last_s[kind] = stamp_s
        if stamp_s <= 0.0:
            self._once(f"The pictures on {self._topics[kind]} have no stamps; let their driver set them.")
            return
        held = self._pictures[kind]
        if held and stamp_s <= held[-1].stamp_s:  # again, or overtaken
            if stamp_s > held[-1].stamp_s - PARTNER_WITHIN_S:
                return
            held.clear()  # the clock was set back, as where a simulation begins again
        held.append(_Picture(stamp_s, message, now_s))
        if kind == "depth":
            self._camera_frame = message.header.frame_id

    def _take_pose(self, message: Any) -> None:
        named, topic = getattr(message, "child_frame_id", ""), self._topics.get("pose", "")
        if not named:
            named, assumed = body_of(message, topic, self._camera_frame, self._tree.mounts())
            if assumed:
                self._once(assumed)
        self._move(message.header.frame_id or "world", named, message, static=False)

    def _move(self, parent: str, child: str, message: Any, static: bool) -> None:
        stamp_s = stamp_of(message)
        self._tree.add(parent, child, pose_of(message), stamp_s, static)
        self._moved += 1
        if self._moved % _FORGET_EVERY == 0 and not static:
            self._tree.forget(stamp_s - KEPT_S)

    def _pair(self, now_s: float) -> None:
        colours, depths = self._pictures["rgb"], self._pictures["depth"]
        while depths:
            depth = depths[0]
            near = [one for one in colours if abs(one.stamp_s - depth.stamp_s) <= PAIRING_TOLERANCE_S]
            newest_s = colours[-1].stamp_s if colours else -np.inf
            waited = now_s - depth.came_s > PARTNER_WITHIN_S
            if near and (newest_s >= depth.stamp_s or waited):
                nearest = min(near, key=lambda one: abs(one.stamp_s - depth.stamp_s))
                if len(self._pairs) == self._pairs.maxlen:
                    self.unplaced += 1
                self._pairs.append(_Pair(nearest, depth, now_s))
                self._first_s = now_s if self._first_s is None else self._first_s
            elif waited or newest_s > depth.stamp_s + PAIRING_TOLERANCE_S:
                self.unpaired += 1
            else:
                return
            depths.popleft()

    def _rig_of(self, pair: _Pair, now_s: float) -> Rig | None:
        if self._rig is not None or "rgb_info" not in self._infos:
            return self._rig
        settled = self._first_s is not None and now_s - self._first_s > SETTLED_S
        if "depth_info" not in self._infos and not settled:
            return None
        frames = [picture.message.header.frame_id for picture in (pair.colour, pair.depth)]
        rgb_from_depth = self._tree.mounts().fixed(*frames)
        if rgb_from_depth is None and not settled:
            return None
        rgb_topic, depth_topic = self._topics["rgb"], self._topics["depth"]
        if "depth_info" not in self._infos:
            self._once(f"{depth_topic} has no CameraInfo; that of {rgb_topic} is used, as for registered depth.")
        if rgb_from_depth is None:
            self._once(f"No static transform links {frames[0]!r} and {frames[1]!r}; they are taken for one place.")
        rgb = self._camera(self._infos["rgb_info"], rgb_topic)
        depth = self._camera(self._infos.get("depth_info", self._infos["rgb_info"]), depth_topic)
        self._rig = Rig(rgb, depth, np.eye(4) if rgb_from_depth is None else rgb_from_depth)
        return self._rig

    def _camera(self, info: Any, topic: str) -> Any:
        camera, distorted = camera_of(info, topic, is_rectified(topic))
        if distorted:
            self._once(f"{topic} has lens distortion, which a pinhole leaves out; use rectified pictures.")
        return camera

    def _pose_of(self, pair: _Pair, now_s: float) -> Float64[np.ndarray, "4 4"] | None:
        """Return world_from_camera at the depth picture, None while it is not known."""
        frame, stamp_s = pair.depth.message.header.frame_id, pair.depth.stamp_s
        newest_s = self._tree.newest_s(frame)
        if newest_s is None or self._tree.cycle(frame):
            return None
        if newest_s < stamp_s and now_s - pair.came_s < LATER_POSE_WITHIN_S:
            return None
        self._world = self._world or self._tree.root(frame)
        if self._world not in self._tree.ancestors(frame):
            return None
        # A map may come above odometry later: the world stays what it was.
        pose, known = self._tree.root_from(frame, np.array([stamp_s]), self._world)
        return pose[0] if known[0] else None

    def _read(self, pair: _Pair, rig: Rig, pose: Float64[np.ndarray, "4 4"]) -> Frame | None:
        rgb_topic, depth_topic = self._topics["rgb"], self._topics["depth"]
        try:
            rgb = colour_of(pair.colour.message, rgb_topic, rig.rgb)
            depth_m = depth_of(pair.depth.message, depth_topic, rig.depth)
            for picture, camera, topic in ((rgb, rig.rgb, rgb_topic), (depth_m, rig.depth, depth_topic)):
                if picture.shape[:2] != (camera.height, camera.width):
                    raise RecordingError(
                        f"The pictures on {topic} are {picture.shape[1]}x{picture.shape[0]}; their calibration says "
                        f"{camera.width}x{camera.height}."
                    )
        except RecordingError as fault:
            self.unread += 1
            self._once(str(fault))
            return None
        return Frame(len(self._gaps_s), "", pair.depth.stamp_s, rgb, depth_m, pose, rig)
