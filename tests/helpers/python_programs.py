"""What a program calls and leaves behind when Python itself runs it."""

import warnings
from typing import Any

from avlmaps.core.errors import AvlmapsError
from avlmaps.language.program import ROBOT, skills
from helpers.recording_robot import PlainPlace, RecordingRobot


def python_run(text: str) -> tuple[list[Any], dict[str, Any], str | None]:
    """Return the calls, the names and the project's error of a program that Python itself runs."""
    robot = RecordingRobot(PlainPlace)
    names: dict[str, Any] = {ROBOT: robot} | {name: getattr(robot, name) for name in skills()}
    known = set(names)
    error = None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SyntaxWarning)
            exec(compile(text, "program", "exec"), names)
    except AvlmapsError as fault:
        error = str(fault)
    return robot.calls, {name: value for name, value in names.items() if name not in known | {"__builtins__"}}, error
