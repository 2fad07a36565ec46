"""A live map of what a running robot publishes in ROS 2."""

from collections.abc import Callable, Mapping
from dataclasses import fields
from time import monotonic
from typing import TYPE_CHECKING, Any

from avlmaps.core.errors import AudioError, RecordingError
from avlmaps.core.progress import say
from avlmaps.core.wording import option
from avlmaps.live.growing_folder import Once, Patience
from avlmaps.live.live_map import LiveMap
from avlmaps.live.replay import tell_doubts
from avlmaps.recordings.formats.ros_messages import RosTopics, stamp_of
from avlmaps.recordings.formats.ros_sound import Pcm
from avlmaps_ros.live.frames import RosFrames
from avlmaps_ros.live.sound import RosDirections, RosSound
from avlmaps_ros.messages import with_rclpy

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
    inbox = with_rclpy("avlmaps_ros.live.inbox", option("source", "ros2"), "record a bag and play that")
    return inbox.Ros2Inbox(topics)


def follow_ros2(
    live: LiveMap,
    topics: RosTopics,
    inbox: "Ros2Inbox",
    give_up_s: float = 60.0,
    tell: Callable[[str], None] = say,
    over: Callable[[], bool] = lambda: False,
) -> None:
    """Give a live map the frames and the sound of a running robot, until ``over``, or no frame came for ``give_up_s``.

    Topics without a name are found by their types. ``tell`` is called with each doubt and what else is worth knowing.
    Raise `RecordingError` where no frame came at all.
    """
    with inbox:
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
                f"No frame came from ROS 2 within {give_up_s:.0f} s: {source.missing()}. {inbox.described}. Name the "
                f"topics ({option('topics', 'rgb=/camera/color/image_raw depth=/camera/depth/image_rect_raw')})."
            )
        source.finish()


class _Source:
    def __init__(self, live: LiveMap, topics: RosTopics, inbox: "Ros2Inbox", tell: Callable[[str], None]) -> None:
        self.frames_in = 0
        self._live, self._topics, self._inbox, self._tell = live, topics, inbox, tell
        self._frames, self._named = RosFrames(inbox.chosen, tell), False
        self._pcm = Pcm.parse_rate(topics.audio_pcm) if topics.audio_pcm else None
        self._sound: RosSound | None = None
        self._said = RosDirections(topics.directions, tell)
        self._ahead_s: float | None = None
        self._doubts = set[str]()
        self._refused, self._once = "", Once(tell)

    def step(self) -> int:
        """Take what arrived, and return how many frames that gave."""
        arrived, came, chosen = self._inbox.take(_LOOK_S), 0, self._inbox.chosen
        if not self._named and {"rgb", "depth"} <= set(chosen):
            self._named = True
            said = ", ".join(f"{kind} {chosen[kind]}" for kind in _SAID if kind in chosen)
            self._tell(f"note: Mapping from ROS 2: {said}.")
        for kind, message, came_s in arrived:
            self._take(kind, message, came_s)
            if kind == "depth":
                came += self._add(came_s)
        # What waits, waits by the time of arrival: more may be on its way here although it came in time.
        came += self._add(arrived[-1][2] if arrived else monotonic())
        self.frames_in += came
        tell_doubts(self._live, self._doubts, self._tell)
        return came

    def _add(self, now_s: float) -> int:
        added = 0
        for frame in self._frames.ready(now_s):
            what = frame.rgb, frame.depth_m, frame.rig, frame.world_from_camera, frame.stamp_s
            self._refused = self._given(self._live.add_frame, *what)
            added += not self._refused
        return added

    def _given(self, give: Callable[..., object], *what: Any) -> str:
        """Give the map something; return why it refuses that, which is said once, or ""."""
        try:
            give(*what)
        except (AudioError, RecordingError) as fault:
            self._once(str(fault))
            return str(fault)
        return ""

    def missing(self) -> str:
        if not self._named:
            named = " and ".join(topic for topic in (self._topics.rgb, self._topics.depth) if topic)
            return f"nobody publishes {named or 'pictures of colour and of depth'}"
        if self._refused:
            return f"the frames that came are refused, the last because: {self._refused.rstrip('.')}"
        return self._frames.missing()

    def finish(self) -> None:
        if not self._named:
            return
        self._say(self._said.rest())
        named, frames = self._topics.directions, self._frames
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

    def _take(self, kind: str, message: Any, now_s: float) -> None:
        if kind in ("audio", "audio_info"):
            self._hear(kind, message, now_s)
        elif kind == "directions":
            self._say(self._said.take(message, self._ahead_s, now_s))
        else:
            self._frames.take(kind, message, now_s)
            if kind == "depth":
                ahead_s = stamp_of(message) - now_s
                self._ahead_s = ahead_s if self._ahead_s is None else max(ahead_s, self._ahead_s)

    def _hear(self, kind: str, message: Any, now_s: float) -> None:
        if self._sound is None:
            topic = self._inbox.chosen.get("audio", "sound")
            self._sound = RosSound(topic, self._tell, self._pcm, self._live.microphones)
        if kind == "audio_info":
            self._sound.inform(message)
        elif (heard := self._sound.take(message, self._ahead_s, now_s)) is not None:
            self._given(self._live.add_audio, *heard)

    def _say(self, directions: list[tuple[float, float]]) -> None:
        for direction in directions:
            self._given(self._live.add_directions, *direction)
