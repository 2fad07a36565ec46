"""What this package brings to avlmaps: its entry points."""

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from avlmaps_ros.settings import RosKind

if TYPE_CHECKING:
    from avlmaps.live.live_map import LiveMap
    from avlmaps.maps.obstacles import Obstacles
    from avlmaps_ros.base import RosDriver


def _robot(kind: RosKind, address: str, file: Path | None) -> "Callable[[Obstacles], RosDriver]":
    import avlmaps_ros
    from avlmaps_ros import Frames, RosSettings

    frames = None if file is None else Frames.read(file)
    settings = None if file is None else RosSettings.read(file)
    return lambda obstacles: avlmaps_ros.open_ros_driver(
        kind, address, frames, obstacles, settings=settings, guarded=True
    )


nav2 = partial(_robot, "nav2")
move_base = partial(_robot, "move_base")


class Ros2Source:
    """A robot that publishes in ROS 2."""

    def __init__(self, topics: Mapping[str, str]) -> None:
        from avlmaps_ros.live.source import open_ros2, ros_topics

        self._topics = ros_topics(topics)
        self._inbox = open_ros2(self._topics)

    def play(self, live: "LiveMap", give_up_s: float, over: Callable[[], bool]) -> None:
        from avlmaps_ros.live.source import follow_ros2

        follow_ros2(live, self._topics, self._inbox, give_up_s, over=over)
