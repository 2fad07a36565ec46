"""The transports by which robots are reached, by the name of what drives them."""

from typing import Literal

from avlmaps.navigate.ros.frames import Frames
from avlmaps.navigate.ros.move_base import MoveBaseSession, MoveBaseTasks
from avlmaps.navigate.ros.nav2 import Nav2Session
from avlmaps.navigate.ros.nav2_tasks import Nav2Tasks
from avlmaps.navigate.ros.session import Opener
from avlmaps.navigate.ros.settings import RosSettings
from avlmaps.navigate.ros.tasks import Tasks

RosKind = Literal["nav2", "move_base"]


def session_opener(kind: RosKind, url: str, settings: RosSettings, token: str | None) -> Opener:
    """Return what opens sessions with a robot.

    Args:
        kind: what drives it.
        url: of rosbridge.
        settings: names.
        token: for a proxy before the bridge.
    """
    session = {"nav2": Nav2Session, "move_base": MoveBaseSession}[kind]
    return lambda ear, within_s: session(url, token, settings, ear, within_s)


def tasks_of(kind: RosKind, frames: Frames, settings: RosSettings) -> Tasks:
    """Return what makes the goals of a robot."""
    return {"nav2": Nav2Tasks, "move_base": MoveBaseTasks}[kind](frames, settings)
