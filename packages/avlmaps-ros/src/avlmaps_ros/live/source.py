"""A live map of what a running robot publishes in ROS 2."""

from collections.abc import Callable, Mapping
from dataclasses import fields
from time import monotonic
from typing import TYPE_CHECKING, Any

from avlmaps.core.errors import AudioError, BackendError, RecordingError
from avlmaps.core.progress import say
from avlmaps.core.wording import option
from avlmaps.live.growing_folder import Once, Patience
from avlmaps.live.live_map import LiveMap
from avlmaps.live.replay import tell_doubts
from avlmaps.recordings.formats.ros_messages import RosTopics, stamp_of
from avlmaps.recordings.formats.ros_sound import Pcm
from avlmaps_ros.live.frames import RosFrame, RosFrames
from avlmaps_ros.live.sound import RosDirections, RosSound

if TYPE_CHECKING:
    from avlmaps_ros.live.inbox import Ros2Inbox

_LOOK_S = 0.05
_SAID = ("rgb", "depth", "pose", "audio", "directions")  # at the beginning, what is read


def ros_topics(named: Mapping[str, str]) -> RosTopics:
    """Return topics by what they are for. ``RecordingError``: one is for nothing that is known."""
    known = [one.name for one in fields(RosTopics)]
    for name in named:
        if name not in known:
            raise RecordingError(f"There is no {name!r} among the topics that can be named: {', '.join(known)}.")
    return RosTopics(**named)


def open_ros2(topics: RosTopics) -> "Ros2Inbox":
    """Join ROS 2. ``BackendError``: this Python has no rclpy, or a message package is missing."""
    try:
        from avlmaps_ros.live.inbox import Ros2Inbox
    except ImportError as fault:
        raise BackendError(
            f"{option('source', 'ros2')} needs ROS 2's rclpy in this Python ({fault}); source "
            "/opt/ros/$ROS_DISTRO/setup.bash and use the Python that ROS 2 was built for (Jazzy: 3.12), or record a "
            "bag and play that."
        ) from None
    return Ros2Inbox(topics)


def follow_ros2(
    live: LiveMap,
    topics: RosTopics,
    give_up_s: float = 60.0,
    tell: Callable[[str], None] = say,
    over: Callable[[], bool] = lambda: False,
    join: Callable[[RosTopics], "Ros2Inbox"] = open_ros2,
) -> None:
    """Give a live map the frames and the sound of a running robot, until ``over``, or no frame came for ``give_up_s``.

    Topics without a name are found by their types. ``tell`` is called with each doubt and what else is worth knowing.
    Raise `BackendError` where this Python has no rclpy, `RecordingError` where no frame came at all.
    """
    with join(topics) as inbox:
        source = _Source(live, topics, inbox, tell)
        patience = Patience("from ROS 2", give_up_s, tell, "the robot seems to have stopped")
        try:
            while not over():
                if inbox.fault:
                    raise RecordingError(
                        f"ROS 2 cannot be read any more ({inbox.fault}); start again with another map."
                    )
                if patience.is_over(source.step()):
                    break
        except KeyboardInterrupt:  # as a drive usually ends
            source.finish()
            raise
        if not source.frames_in and not over():
            raise RecordingError(
                f"No frame came from ROS 2 within {give_up_s:.0f} s: {source.missing()}. {inbox.described()}. Name the "
                f"topics ({option('topics', 'rgb=/camera/color/image_raw depth=/camera/depth/image_rect_raw')})."
            )
        source.finish()


class _Source:
    def __init__(self, live: LiveMap, topics: RosTopics, inbox: "Ros2Inbox", tell: Callable[[str], None]) -> None:
        self.frames_in = 0
        self._live, self._topics, self._inbox, self._tell = live, topics, inbox, tell
        self._frames: RosFrames | None = None
        self._pcm = Pcm.parse_rate(topics.audio_pcm) if topics.audio_pcm else None
        self._sound: RosSound | None = None
        self._said = RosDirections(topics.directions, tell)
        self._waiting: list[tuple[str, Any, float]] = []  # until the pictures' topics are known
        self._ahead_s: float | None = None
        self._doubts = set[str]()
        self._refused, self._once = "", Once(tell)

    def step(self) -> int:
        """Take what arrived, and return how many frames that gave."""
        arrived = self._inbox.take(_LOOK_S)
        if self._frames is None:
            self._waiting += arrived
            if not {"rgb", "depth"} <= set(self._inbox.chosen):
                return 0
            self._begin()
            arrived, self._waiting = self._waiting, []
        frames, came = self._frames, 0
        assert frames is not None
        for kind, message, came_s in arrived:
            self._take(kind, message, came_s)
            if kind == "depth":
                came += self._add(frames.ready(came_s))
        # What waits, waits by the time of arrival: more may be on its way here although it came in time.
        came += self._add(frames.ready(arrived[-1][2] if arrived else monotonic()))
        self.frames_in += came
        tell_doubts(self._live, self._doubts, self._tell)
        return came

    def _add(self, frames: list[RosFrame]) -> int:
        added = 0
        for frame in frames:
            try:
                self._live.add_frame(frame.rgb, frame.depth_m, frame.rig, frame.world_from_camera, frame.stamp_s)
                added += 1
            except RecordingError as fault:
                self._refused = str(fault)
                self._once(self._refused)
        return added

    def missing(self) -> str:
        if self._frames is None:
            named = " and ".join(topic for topic in (self._topics.rgb, self._topics.depth) if topic)
            return f"nobody publishes {named}" if named else "nobody publishes pictures of colour and of depth"
        if self._refused:
            return f"the frames that came are refused, the last because: {self._refused.rstrip('.')}"
        return self._frames.missing()

    def finish(self) -> None:
        frames = self._frames
        if frames is None:
            return
        self._say(self._said.rest())
        named = self._topics.directions
        if named and "directions" not in self._inbox.chosen:
            self._tell(
                f"note: No direction came on {named}: nobody published std_msgs numbers or geometry_msgs/PoseStamped "
                "there."
            )
        for count, what in (
            (frames.unpaired, "depth pictures had no colour picture of their moment"),
            (frames.unplaced, "frames had no pose of their moment"),
            (frames.unread, "frames could not be read"),
            (self._sound.unheard if self._sound else 0, "messages of sound could not be used"),
            (self._said.unread, "directions came before the first picture"),
        ):
            if count:
                self._tell(f"note: {count} {what} and are left out.")
        lost, sent = frames.never_arrived
        if lost:
            self._tell(
                f"note: {lost} of about {sent} frames never arrived, by the stamps of those that did; use compressed "
                "topics, publishers that are reliable, or a faster network."
            )

    def _begin(self) -> None:
        chosen = self._inbox.chosen
        said = ", ".join(f"{kind} {chosen[kind]}" for kind in _SAID if kind in chosen)
        self._tell(f"note: Mapping from ROS 2: {said}.")
        self._frames = RosFrames(chosen["rgb"], chosen["depth"], chosen.get("pose", ""), self._tell)

    def _take(self, kind: str, message: Any, now_s: float) -> None:
        assert self._frames is not None
        match kind:
            case "audio" | "audio_info":
                self._hear(kind, message, now_s)
            case "directions":
                self._say(self._said.take(message, self._ahead_s, now_s))
            case "rgb" | "depth" | "rgb_info" | "depth_info" | "tf" | "tf_static" | "pose":
                self._frames.take(kind, message, now_s)
                if kind == "depth":
                    ahead_s = stamp_of(message) - now_s
                    self._ahead_s = ahead_s if self._ahead_s is None else max(ahead_s, self._ahead_s)
            case _:
                raise ValueError(f"a message is for {kind!r}")

    def _hear(self, kind: str, message: Any, now_s: float) -> None:
        if self._sound is None:
            topic = self._inbox.chosen.get("audio", "sound")
            self._sound = RosSound(topic, self._tell, self._pcm, self._live.microphones)
        if kind == "audio_info":
            self._sound.inform(message)
        elif (heard := self._sound.take(message, self._ahead_s, now_s)) is not None:
            try:
                self._live.add_audio(*heard)
            except AudioError as fault:
                self._once(str(fault))

    def _say(self, directions: list[tuple[float, float]]) -> None:
        for stamp_s, azimuth_rad in directions:
            try:
                self._live.add_directions(stamp_s, azimuth_rad)
            except RecordingError as fault:
                self._once(str(fault))
