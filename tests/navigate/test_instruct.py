"""A sentence becomes a program, the program a way; what goes wrong is told, repaired where it can be, never hidden."""

import json
from collections.abc import Sequence

import numpy as np
import pytest

from avlmaps.core.errors import LanguageError
from avlmaps.core.motion import GroundPose
from avlmaps.language.program import Budget
from avlmaps.language.sentence import Attachments
from avlmaps.language.translator import LearnedTranslator, Translation
from avlmaps.maps.store.edits import Edit, EditedSpot, World
from avlmaps.navigate.driver import Arrival
from avlmaps.navigate.instruct import InstantDriver, Outcome, instruct, rehearse
from helpers.kinematic import KinematicDriver
from query.query_fakes import asked, furnished_map, sounds_of

OTHER = World(name="other", fingerprint="another")


class Scripted:
    """A translator that gives the next of its programs each time, and keeps what it was told of the last."""

    name = "scripted"

    def __init__(self, *programs: str) -> None:
        self.programs = list(programs)
        self.errors: list[str] = []
        self.done: list[list[str]] = []

    def program_for(self, command: str) -> Translation:
        return Translation(self.programs.pop(0), ("taken as it stands",))

    def repair(self, command: str, program: str, error: str, done: Sequence[str] = ()) -> Translation | None:
        self.errors.append(error)
        self.done.append(list(done))
        if not self.programs:
            raise LanguageError("The model has nothing more to say; ask another.")
        return Translation(self.programs.pop(0))


def told(command: str, translator=None, driver: KinematicDriver | None = None, **more) -> tuple[Outcome, list[str]]:
    track = np.stack([np.linspace(5.0, 5.2, 5), np.full(5, 3.1), np.full(5, 1.2)], axis=1)
    asked = furnished_map(sounds=sounds_of([track], [0.9]))
    lines: list[str] = []
    driver = driver or KinematicDriver(GroundPose(3.0, 2.0))
    return instruct(command, asked, driver, translator or LearnedTranslator(), tell=lines.append, **more), lines


def test_a_sentence_is_obeyed_and_told_as_it_goes() -> None:
    outcome, lines = told("go to the chair near the sound of the dog, then turn left")
    assert outcome.ok and outcome.error is None
    (subgoal,) = outcome.subgoals
    assert subgoal.goal[:2] == pytest.approx((5.1, 3.1), abs=0.15)
    assert subgoal.name == "'chair' near 'dog'"
    assert lines[0] == "I will go to the chair nearest to where dog was heard, then turn left 90 degrees."
    assert lines[1].startswith("> ") and any("'chair' near 'dog': at (5.1" in line for line in lines)
    assert "turn(angle_deg=-90)" in lines[-1]


def test_a_translator_that_knows_no_map_is_given_this_one() -> None:
    said = "go to where the sound of the dog comes from"
    outcome, lines = told(said)
    assert outcome.ok and outcome.notes[0].startswith("The place is where the robot was when it heard it: ")
    assert "I will go to where dog was heard." in lines
    fixed, _ = told(said, LearnedTranslator(Attachments(at="robot")))
    assert fixed.ok and fixed.notes == () and fixed.program == outcome.program


def test_a_place_far_off_the_map_is_not_reached_in_a_rehearsal() -> None:
    program = "robot.move_to(robot.current_pos() * 1000000000000)\n"
    m = furnished_map()
    outcome = rehearse("go", Translation(program), m, InstantDriver(m, GroundPose(3.0, 2.0)))
    assert not outcome.ok and outcome.moves[0].note == "the place is off the map"


def test_a_forbidden_area_that_the_map_does_not_know_is_told_before_the_robot_moves() -> None:
    corners = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0))
    area = Edit.new("forbid", [EditedSpot(middle=corners[0], corners=corners)], name="the stairs", world=OTHER)
    m = asked(furnished_map(), edits=[area])
    outcome = instruct("turn left", m, KinematicDriver(GroundPose(3.0, 2.0)), LearnedTranslator())
    assert outcome.notes == (
        "The robot may enter the stairs, which was forbidden: it was made in a map of another recording, other.",
    )


def test_the_outcome_is_the_contract_of_the_command_line() -> None:
    outcome, _ = told("go to the table, then face the nearest chair")
    answer = json.loads(json.dumps(outcome.to_json(), allow_nan=False))
    keys = "program steps actions subgoals ok error error_type notes choices path_m elapsed_s frame"
    assert set(keys.split()) == set(answer)
    assert {"skill", "arguments", "result"} <= set(answer["steps"][0])
    assert {"goal", "stop", "distance_m"} <= set(answer["subgoals"][0])
    assert answer["steps"][-1]["result"]["heading_rad"] == pytest.approx(outcome.moves[-1].heading_rad, abs=1e-3)
    assert answer["actions"][-1] in ("turn_left", "turn_right") and answer["actions"].count("stop") == 1
    assert answer["path_m"] == pytest.approx(np.hypot(*np.subtract(outcome.subgoals[0].stop[:2], (3, 2))), abs=0.01)


def test_what_is_doubtful_about_the_map_is_told_once_before_anything_moves() -> None:
    asked = furnished_map()
    asked.data.info.doubts = ("The poses drift.",)
    lines: list[str] = []
    planned = Translation('robot.move_to_object("table")', ("The poses drift.", "a chair is meant"))
    driver = KinematicDriver(GroundPose(3.0, 2.0))
    outcome = instruct("x", asked, driver, Scripted(), translation=planned, tell=lines.append)
    assert outcome.ok and outcome.notes == ("The poses drift.", "a chair is meant")
    assert lines[0] == "note: The poses drift." and lines.count(lines[0]) == 1


def test_what_is_not_understood_is_an_error_before_anything_moves() -> None:
    driver = KinematicDriver(GroundPose(3.0, 2.0))
    with pytest.raises(LanguageError):
        told("gabble gabble the", driver=driver)
    assert driver.told == []


def test_what_is_not_in_the_map_ends_the_command_and_keeps_what_was_done() -> None:
    outcome, _ = told("go to the table, then go to the chair near the sound of a rooster")
    assert not outcome.ok and outcome.error_type == "GoalNotFoundError"
    assert "sound 'rooster'" in str(outcome.error)
    assert [move.skill for move in outcome.moves] == ["move_to_object"]
    assert outcome.done[-1].step.error is not None and outcome.to_json()["ok"] is False


def test_a_place_that_is_not_reached_makes_the_outcome_not_ok() -> None:
    outcome, _ = told("go to the table", driver=KinematicDriver(GroundPose(3.0, 2.0), reaches=False))
    assert not outcome.ok and "a wall is in the way" in str(outcome.error)
    assert outcome.subgoals[0].reached is False


def test_a_program_that_fails_is_repaired_and_told_what_was_done() -> None:
    translator = Scripted('robot.turn(90)\nrobot.move_to("piano")', "import os", 'robot.move_to_object("table")')
    outcome, lines = told("play the piano", translator)
    assert outcome.ok and len(outcome.programs) == 3
    assert outcome.programs[-1] in outcome.program and "'piano'" in translator.errors[0]
    assert "import" in translator.errors[1]
    assert translator.done == [["turn(angle_deg=90)"], ["turn(angle_deg=90)"]]
    assert [move.skill for move in outcome.moves] == ["turn", "move_to_object"]
    assert outcome.notes[0] == "taken as it stands"
    assert any(line.startswith("failed: ") for line in lines)


def test_repairing_ends_and_a_translator_that_gives_up_leaves_the_error_of_the_program() -> None:
    outcome, _ = told("x", Scripted(*["robot.move_to('piano')"] * 50))
    assert not outcome.ok and len(outcome.programs) < 10
    outcome, _ = told("play the piano", Scripted('robot.move_to("piano")'))
    assert "'piano'" in str(outcome.error)
    assert any("nothing more to say" in note for note in outcome.notes)


def test_a_budget_holds_for_the_robot_too() -> None:
    outcome, _ = told("spin", Scripted("for i in range(1000):\n    robot.turn(10)"), budget=Budget(skill_calls=5))
    assert outcome.error_type == "ProgramError" and len(outcome.moves) <= 5


def test_a_program_that_moves_nothing_says_so() -> None:
    outcome, lines = told("x", Scripted("x = 1"))
    assert outcome.ok and "the program moved nothing" in outcome.notes
    assert "note: the program moved nothing" in lines
    assert "the program moved nothing" not in told("x", Scripted("robot.turn(90)"))[0].notes


@pytest.mark.parametrize(("short_m", "told_of"), [(0.9, False), (1.3, True)])
def test_a_stop_farther_than_the_paper_counts_is_noted_though_no_nearer_one_is(short_m: float, told_of: bool) -> None:
    class Beside(KinematicDriver):
        def go_to(self, place: np.ndarray, *, face: np.ndarray | None = None) -> Arrival:
            return super().go_to(place + np.array([0.0, short_m, 0.0]), face=face)

    outcome, _ = told("go to the table", Scripted('robot.move_to("table")'), Beside(GroundPose(3.0, 2.0)))
    assert outcome.ok and outcome.subgoals[0].distance_m == pytest.approx(short_m)
    assert any(f"{short_m:.2f} m from it" in note for note in outcome.notes) == told_of
