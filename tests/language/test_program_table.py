"""The table of skills is the vocabulary's, and the page about programs shows it as it is."""

import os
import re
from pathlib import Path

from avlmaps.language.program import parse_program, run_program, skills
from avlmaps.language.program.parser import BUILTINS
from avlmaps.language.program.vocabulary import ValueType
from helpers.recording_robot import RecordingRobot

PAGE = Path(__file__).parents[2] / "docs" / "programs.md"


def test_a_signature_reads_as_it_is_written() -> None:
    assert skills()["move_north"].signature == "move_north(target: str | Place | Heat, distance_m: float = 0.5) -> None"
    assert skills()["get_contour"].signature == "get_contour(target: str | Place | Heat) -> list[Place]"
    assert skills()["get_map"].kinds["sound"] == {ValueType.STRING, ValueType.CLIP, ValueType.NOTHING}


def test_only_alternatives_must_be_given_one_at_a_time() -> None:
    assert {name for name, skill in skills().items() if skill.alternatives} == {"get_map", "get_major_map"}


def test_the_page_shows_the_table_as_it_is() -> None:
    """After a change of the vocabulary: AVLMAPS_UPDATE_SNAPSHOTS=1 make test."""
    rows = [f"| `{skill.signature.replace('|', chr(92) + '|')}` | {skill.doc} |" for skill in skills().values()]
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


def test_programs_call_these_skills_and_no_other_method_of_the_robot() -> None:
    moving = """move_to move_to_object move_in_between move_to_left move_to_right move_behind move_north move_south
        move_east move_west face turn turn_absolute move_forward with_object_on_left with_object_on_right wait"""
    looking = """load_image load_sound get_major_map get_map get_max_pos_3d get_pos get_nearest_pos get_all_pos
        get_nth_pos exists get_distance get_contour current_pos"""
    assert {name for name, skill in skills().items() if skill.moves} == set(moving.split())
    assert set(skills()) == {*moving.split(), *looking.split()}
