"""ROS 2 messages by the names of their types, filled with plain values."""

from collections.abc import Mapping
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


def filled(message: Any, values: Mapping[str, Any]) -> Any:
    """Set fields of a message by nested dictionaries, and return it; those that are not named stay as they are."""
    for name, value in values.items():
        field = getattr(message, name)
        if isinstance(value, Mapping):
            filled(field, value)
        else:
            setattr(message, name, type(field)(value) if isinstance(field, (int, float)) else value)
    return message
