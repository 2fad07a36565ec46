"""The table of skills is the vocabulary's, and the page about programs shows it as it is."""

import inspect
import os
import re
from pathlib import Path

from avlmaps.language.program import SKILLS, parse_program, run_program, skill_lines
from avlmaps.language.program.parser import BUILTINS
from avlmaps.language.program.vocabulary import RobotSkills, ValueType
from helpers.recording_robot import RecordingRobot

PAGE = Path(__file__).parents[2] / "docs" / "programs.md"


def test_every_skill_of_the_vocabulary_is_in_the_table_and_nothing_else() -> None:
    declared = [name for name in vars(RobotSkills) if not name.startswith("_")]
    assert list(SKILLS) == declared
    for name, skill in SKILLS.items():
        method = getattr(RobotSkills, name)
        assert list(skill.parameters) == list(inspect.signature(method).parameters)[1:]
        assert skill.doc == " ".join(inspect.getdoc(method).split())  # type: ignore[union-attr]


def test_a_signature_reads_as_it_is_written() -> None:
    assert SKILLS["move_north"].signature == "move_north(target: str | Place | Heat, distance_m: float = 0.5) -> None"
    assert SKILLS["get_contour"].signature == "get_contour(target: str | Place | Heat) -> list[Place]"
    assert SKILLS["get_map"].parameters["sound"].kinds == {ValueType.STRING, ValueType.CLIP, ValueType.NOTHING}


def test_only_alternatives_must_be_given_one_at_a_time() -> None:
    assert {name for name, skill in SKILLS.items() if skill.alternatives} == {"get_map", "get_major_map"}


def test_lines_for_a_prompt_hold_every_signature_and_what_it_does() -> None:
    lines = skill_lines()
    assert len(lines) == len(SKILLS)
    assert lines[0] == "robot.load_image(path: str) -> Picture: Load a picture from a file, to ask where it was taken."
    assert skill_lines("", [SKILLS["turn"]])[0].startswith("turn(angle_deg: float) -> None: Turn on the spot")


def test_the_page_shows_the_table_as_it_is() -> None:
    """After a change of the vocabulary: AVLMAPS_UPDATE_SNAPSHOTS=1 make test."""
    rows = [f"| `{skill.signature.replace('|', chr(92) + '|')}` | {skill.doc} |" for skill in SKILLS.values()]
    table = "\n".join(["| skill | what it does |", "|---|---|", *rows])
    text = PAGE.read_text(encoding="utf-8")
    before, rest = text.split("<!-- skills -->\n")
    kept, after = rest.split("\n<!-- end of skills -->")
    if os.environ.get("AVLMAPS_UPDATE_SNAPSHOTS"):
        PAGE.write_text(f"{before}<!-- skills -->\n{table}\n<!-- end of skills -->{after}", encoding="utf-8")
        kept = table
    assert kept == table


def test_every_program_of_the_page_runs() -> None:
    text = PAGE.read_text(encoding="utf-8")
    programs = re.findall(r"```python\n# a program\n(.*?)```", text, re.DOTALL)
    assert programs
    for program in programs:
        assert run_program(parse_program(program), RecordingRobot()).error is None, program


def test_the_page_names_every_function() -> None:
    text = PAGE.read_text(encoding="utf-8")
    assert all(f"`{name}" in text for name in BUILTINS)


def test_which_skills_move_the_robot_is_told_from_what_they_return() -> None:
    moving = {name for name, skill in SKILLS.items() if skill.moves}
    words = ("move", "face", "turn", "with_object", "wait")
    assert moving == {name for name in SKILLS if name.startswith(words)}
