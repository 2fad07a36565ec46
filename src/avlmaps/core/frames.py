"""The names of the two frames that positions come in; see docs/conventions.md."""

from enum import StrEnum


class FrameName(StrEnum):
    """The frame of the positions of an answer or a file."""

    RECORDING = "recording"
    LEVEL = "level"
