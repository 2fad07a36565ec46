"""Answers in the frame that a person wants: the recording's own, or the level one, whose z is up.

Both have one origin; the level frame is turned so that up is +z (docs/conventions.md). Sizes are along the level axes
in either.
"""

from collections.abc import Mapping
from typing import Any, cast

import numpy as np

from avlmaps.core.arrays import Float
from avlmaps.core.frames import FrameName
from avlmaps.core.poses import apply
from avlmaps.core.wording import coordinates


def answer_in(answer: Mapping[str, Any], frame: FrameName, level_from_recording: Float[np.ndarray, "4 4"]) -> Any:
    """Return an answer of the command line with all its positions, poses and texts about them in a frame.

    Args:
        answer: in the recording's frame: with ``position``, ``outline`` and ``world_from_camera`` at any depth.
        frame: that is wanted.
        level_from_recording: 4x4, metres.
    """
    if frame is FrameName.RECORDING:
        return dict(answer)
    spoken: dict[str, str] = {}
    turned = _turned(answer, np.asarray(level_from_recording, np.float64), spoken)
    return _spoken(turned, spoken) | {"frame": str(frame)}


def _turned(value: Any, level_from_recording: Float[np.ndarray, "4 4"], spoken: dict[str, str]) -> Any:
    if isinstance(value, Mapping):
        entries = cast("Mapping[str, Any]", value)
        return {key: _moved(key, one, level_from_recording, spoken) for key, one in entries.items()}
    if isinstance(value, list):
        return [_turned(one, level_from_recording, spoken) for one in cast("list[Any]", value)]
    return value


def _moved(key: str, value: Any, level_from_recording: Float[np.ndarray, "4 4"], spoken: dict[str, str]) -> Any:
    if key == "position" and value is not None:
        point = apply(level_from_recording, np.array([value], np.float64))[0]
        spoken[_words(value)] = _words(point)
        return [float(number) for number in point]
    if key == "outline" and value:
        return apply(level_from_recording, np.array(value, np.float64)).round(3).tolist()
    if key == "world_from_camera" and value is not None:
        return (level_from_recording @ np.array(value, np.float64)).tolist()
    return _turned(value, level_from_recording, spoken)


def _spoken(answer: dict[str, Any], spoken: Mapping[str, str]) -> dict[str, Any]:
    texts = {key: value for key, value in answer.items() if key in ("text", "notes")}
    for key, value in texts.items():
        parts = [value] if isinstance(value, str) else value
        for before, now in spoken.items():
            parts = [part.replace(before, f"\0{now[1:]}") for part in parts]  # no place is replaced twice
        parts = [part.replace("\0", "(") for part in parts]
        answer[key] = parts[0] if isinstance(value, str) else parts
    return answer


def _words(position: Any) -> str:
    return f"({coordinates(position)})"
