"""ROS 2 messages filled with plain values."""

from collections.abc import Mapping
from typing import Any


def filled(message: Any, values: Mapping[str, Any]) -> Any:
    """Set fields of a message by nested dictionaries, and return it; those that are not named stay as they are."""
    for name, value in values.items():
        field = getattr(message, name)
        if isinstance(value, Mapping):
            filled(field, value)
        else:
            setattr(message, name, type(field)(value) if isinstance(field, (int, float)) else value)
    return message
