"""What a wrong program is told is kept as a snapshot: a change of any sentence is seen, and meant.

After a change that is meant: AVLMAPS_UPDATE_SNAPSHOTS=1 make test
"""

import os
from pathlib import Path

from avlmaps.core.errors import ProgramError
from avlmaps.language.program import Budget, parse_program, run_program
from helpers.hostile_programs import ESCAPES
from helpers.recording_robot import RecordingRobot

KEPT = Path(__file__).parent / "snapshots" / "program_errors.txt"
BUDGET = Budget(steps=1000, skill_calls=10, elements=1000, factors=4)


def test_what_every_wrong_program_is_told_is_as_it_was() -> None:
    said = "".join(f"{text!r}\n    {_told(text)}\n" for text in ESCAPES)
    if os.environ.get("AVLMAPS_UPDATE_SNAPSHOTS"):
        KEPT.parent.mkdir(exist_ok=True)
        KEPT.write_text(said, encoding="utf-8")
    assert said == KEPT.read_text(encoding="utf-8")


def _told(text: str) -> str:
    try:
        program = parse_program(text)
    except ProgramError as fault:
        return f"refused: {fault}"
    trace = run_program(program, RecordingRobot(), BUDGET)
    return f"stopped: {trace.error}" if trace.error else "runs to its end"
