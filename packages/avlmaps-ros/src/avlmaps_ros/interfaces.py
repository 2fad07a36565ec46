"""ROS 2 messages, services and actions by the names of their types."""

from importlib import import_module
from typing import Any

from avlmaps.core.errors import BackendError


def interface(kind: str) -> Any:
    """Return the class of a message, service or action: ``tf2_msgs/msg/TFMessage``.

    Raises:
        BackendError: its package is not installed.
    """
    package, part, name = kind.split("/")
    try:
        return getattr(import_module(f"{package}.{part}"), name)
    except (ImportError, AttributeError) as fault:
        raise BackendError(
            f"ROS 2 has no {kind} here ({fault}); install its package, `apt install ros-$ROS_DISTRO-"
            f"{package.replace('_', '-')}`, and source ROS 2's setup.bash."
        ) from None
