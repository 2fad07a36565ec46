"""Some frames of a recording, as a recording: every other one for a map, the good ones, a stretch of a long walk."""

import hashlib
from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path

import numpy as np
from jaxtyping import Int

from avlmaps.recordings.types import Frame, Recording


class Subset(Recording):
    """Chosen frames of another recording, in place; stamps, poses, names and the sound track stay what they are."""

    def __init__(self, whole: Recording, indices: Sequence[int] | range | Int[np.ndarray, " n"]) -> None:
        """Choose.

        Args:
            whole: the recording.
            indices: strictly rising frame numbers of it.

        Raises:
            ValueError: they do not rise, or are not all in the recording.
        """
        chosen = np.asarray(indices, np.int64).reshape(-1)
        if len(chosen) and (chosen[0] < 0 or chosen[-1] >= len(whole) or (np.diff(chosen) <= 0).any()):
            raise ValueError(f"indices must rise strictly within 0 ... {len(whole) - 1}")
        self.whole = whole
        self.indices = chosen
        self.path: Path = whole.path
        self.format: str = whole.format
        self.rig = whole.rig
        self.stamps_s = whole.stamps_s[chosen]
        self.world_from_camera = whole.world_from_camera[chosen]
        self.up_in_world = whole.up_in_world
        self.audio = whole.audio
        self.notices = whole.notices
        self.base_height = whole.base_height
        self.trajectory = whole.trajectory
        self.begins_s = whole.begins_s
        self.posed = whole.posed

    def frame(self, index: int) -> Frame:
        """Read one frame; its ``index`` is the one in the subset."""
        return replace(self.whole.frame(int(self.indices[index])), index=index)

    def name(self, index: int) -> str:
        """Return the whole recording's name of the frame."""
        return self.whole.name(int(self.indices[index]))

    def colour_file(self, index: int) -> Path | None:
        """Return the frame's colour file in the whole recording."""
        return self.whole.colour_file(int(self.indices[index]))

    def depth_file(self, index: int) -> Path | None:
        """Return the frame's depth file in the whole recording."""
        return self.whole.depth_file(int(self.indices[index]))

    @property
    def depth_units_per_m(self) -> float:
        """The whole recording's."""
        return self.whole.depth_units_per_m

    @property
    def stored_depth_unit_m(self) -> float:
        """The whole recording's."""
        return self.whole.stored_depth_unit_m

    def change_stamp(self) -> str:
        """Of the whole recording."""
        return self.whole.change_stamp()

    @cached_property
    def fingerprint(self) -> str:
        """Of the whole recording's and the choice."""
        return hashlib.sha256(self.whole.fingerprint.encode() + self.indices.astype("<i8").tobytes()).hexdigest()
