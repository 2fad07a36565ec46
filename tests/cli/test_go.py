"""`avlmaps go`: a sentence in, a drive out; what can go wrong is one sentence each."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from avlmaps.core.motion import Action, Moved
from avlmaps.core.question import Part
from avlmaps.query.factors import NearThings
from avlmaps.query.findings import MapNames
from avlmaps_sim.body import SimulatedBody
from avlmaps_sim.materials import material
from avlmaps_sim.scene import Scene, SceneBuilder
from avlmaps_sim.shapes import slab
from helpers.room import Room


def scene_of(room: Room) -> Scene:
    """Return the analytic room, whose map the fixtures build, as a scene of triangles."""
    width, depth, height = room.size
    plain = material("painted", np.random.default_rng(0))
    builder = SceneBuilder("room")
    builder.add("floor", slab(width / 2, depth / 2, -0.1, width, depth, 0.1, plain))
    for x, y, w, d in (
        (width / 2, -0.05, width, 0.1), (width / 2, depth + 0.05, width, 0.1),
        (-0.05, depth / 2, 0.1, depth), (width + 0.05, depth / 2, 0.1, depth),
    ):  # fmt: skip
        builder.add("wall", slab(x, y, 0.0, w, d, height, plain))
    for thing in room.things:
        for low, high in thing.parts:
            (x, y), (w, d, h) = np.add(low, high)[:2] / 2, np.subtract(high, low)
            builder.add(thing.category, slab(x, y, low[2], w, d, h, plain))
    return builder.build()


@pytest.fixture
def in_room(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let any scene be the room that the map was made of."""
    monkeypatch.setattr("avlmaps_sim.scenes.open_scene", lambda spec: scene_of(Room()))


def test_a_sentence_is_obeyed_and_told(answer, built: Path, tmp_path: Path, in_room: None) -> None:
    plot = tmp_path / "way.png"
    said = answer("go", built, "go to the nearest red thing, then turn left", "--scene", "room", "--plot", plot)
    assert {"program", "steps", "actions", "subgoals", "ok"} <= set(said) and said["ok"] is True
    assert said["error"] is None
    (subgoal,) = said["subgoals"]
    assert {"goal", "stop", "distance_m"} <= set(subgoal) and subgoal["distance_m"] < 1.5
    assert said["actions"].count("stop") == 1
    assert set(said["actions"]) <= {"move_forward", "turn_left", "turn_right", "stop"}
    assert plot.stat().st_size > 5000


def test_the_program_and_the_trace_are_told_as_it_drives(run, built: Path, in_room: None) -> None:
    status, out, err = run("go", built, "turn left", "--scene", "room", "--start", "4.4,3.2,90")
    assert status == 0, err
    assert "robot.turn" not in out and err.count("robot.turn(-90)") == 1  # told once
    assert "heading 180°" in err


def test_nothing_moves_where_a_later_goal_is_not_in_the_map(run, built: Path, in_room: None) -> None:
    status, out, err = run("go", built, "go to the nearest red thing, then to the piano", "--scene", "room", "--json")
    said = json.loads(out)
    assert status == 1 and "I will go to" in err
    assert said["error"]["kind"] in ("goal-not-found", "query")
    assert "The robot was not moved." in said["error"]["message"]
    assert (said["steps"], said["actions"], said["path_m"]) == ([], [], 0.0)


def test_a_drive_looks_up_each_goal_once(run, built: Path, in_room: None, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[str] = []
    seen = MapNames.heat

    def counted(self: MapNames, part: Part, vocabulary: None) -> NearThings:
        asked.append(part.query)
        return seen(self, part, vocabulary)

    monkeypatch.setattr(MapNames, "heat", counted)
    status, _, err = run("go", built, "go to the nearest red thing, then turn left", "--scene", "room")
    assert status == 0, err
    assert asked == ["red thing"]


@pytest.mark.parametrize(
    ("does", "stops"),
    [(("--forbid", "the wet floor", "--box", "1,1,1.5,1.5"), True), (("--pin", "my dock", "--at", "4.4,3.2"), False)],
)
def test_an_area_that_is_forbidden_while_it_drives_stops_the_robot(
    run, built: Path, tmp_path: Path, in_room: None, monkeypatch: pytest.MonkeyPatch, does: tuple[str, ...], stops: bool
) -> None:
    home = tmp_path / "home.avlmap"
    shutil.copytree(built, home)
    taken: list[Action] = []
    act = SimulatedBody.act

    def act_and_edit(body: SimulatedBody, action: Action) -> Moved:
        taken.append(action)
        if len(taken) == 5:
            assert run("edit", home, *does)[0] == 0
        return act(body, action)

    monkeypatch.setattr(SimulatedBody, "act", act_and_edit)
    status, out, err = run("go", home, "go to the nearest red thing", "--scene", "room", "--json")
    said = json.loads(out.splitlines()[-1])
    if not stops:
        assert status == 0 and len(taken) > 6, err
        return
    assert status == 1 and set(taken[5:]) <= {Action.STOP}
    assert "the wet floor was forbidden meanwhile" in err.splitlines()[-1]
    assert said["error"]["message"] in err and said["error"]["kind"] == "navigation"
    assert said["path_m"] > 0.0 or len(said["actions"]) >= 5


def test_what_cannot_be_obeyed_is_told_with_status_1_and_json_all_the_same(run, built: Path, in_room: None) -> None:
    status, out, err = run("go", built, "go to the purple elephant near the sound of thunder", "--scene", "x", "--json")
    assert status == 1 and err.splitlines()[-1].startswith("avlmaps: ")
    said = json.loads(out)
    assert said["ok"] is False and said["error"]["kind"] == "goal-not-found"
    assert said["error"]["message"] in err and said["steps"][-1]["error"]


@pytest.mark.parametrize(
    ("words", "status", "sentence"),
    [
        (("MAP", "go to the chair", "--scene", "house:seven"), 1, "names no seed"),
        (("MAP", "gabble gabble the", "--scene", "house:7"), 1, "I do not know 'gabble'"),
        (("MAP", "go to where this photo was taken", "--scene", "house:7"), 1, "Give it with --image FILE, or name"),
        (("MAP", "", "--scene", "house:7"), 1, "has no words"),
        (("MAP", "go to the chair", "--choose", "two"), 2, "--choose: no number: 'two'"),
        (("MAP", "go to the chair"), 2, "go needs --scene"),
        (("MAP", "go to the chair", "--scene", "house:7", "--start", "here"), 2, "--start takes x,y,heading"),
        (("MAP", "go to the chair", "--robot", "nav2", "--start", "1,2,3"), 2, "belong to a simulated robot"),
        (("MAP", "go to the chair", "--scene", "missing.glb"), 1, "there is no scene"),
        (("MAP", "go to the chair", "--dry-run", "--found-at", "2"), 2, "--found-at takes a number from 0 to 1"),
    ],
)
def test_each_mistake_is_one_sentence(run, built: Path, words: tuple[str, ...], status: int, sentence: str) -> None:
    got, out, err = run("go", *[str(built) if word == "MAP" else word for word in words])
    assert got == status and sentence in err
    assert "Traceback" not in err and out == ""


@pytest.mark.parametrize("start", ["1.2,0.35,0", "40,40,0"])
def test_a_start_in_a_thing_or_outside_is_refused(run, built: Path, in_room: None, start: str) -> None:
    status, out, err = run("go", built, "turn left", "--scene", "room", "--start", start)
    assert status == 1 and "cannot stand at" in err
    assert out == ""


@pytest.mark.parametrize(
    ("option", "value", "why"),
    [
        ("--at", "robot", "no sound is named"),
        ("--image", "x.png", "the sentence speaks of no photo"),
        ("--sound-clip", "x.wav", "the sentence speaks of no recording"),
        ("--ros", "ws://robot:9090", "the robot is simulated"),
        ("--ros-frames", "frames.json", "the robot is simulated"),
        ("--chat-model", "m", "--language is learned"),
        ("--plot", "way.png", "nothing is driven"),
    ],
)
def test_an_option_without_effect_is_said(answer, option: str, value: str, why: str) -> None:
    said, no_map = answer("go", "nowhere.avlmap", "go to the chair", "--dry-run", option, value), "There is no map at"
    assert said["notes"][0] == f"{option} has no effect: {why}." and said["notes"][1].startswith(no_map)
    (note,) = answer("go", "nowhere.avlmap", "go to the barking", "--dry-run", "--at", "source")["notes"]
    assert note.startswith(no_map)


def test_a_real_robot_is_driven_over_rosbridge_and_let_go_at_the_end(
    answer, built: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from avlmaps.core.motion import GroundPose
    from helpers.kinematic import KinematicDriver

    asked: list[tuple[object, ...]] = []

    class Far(KinematicDriver):
        owes = False

        def halt(self) -> None:
            asked.append(("halted",))

        def close(self) -> None:
            asked.append(("closed",))

    def connect(kind: str, url: str, frames: object, obstacles: object, *, settings: object, guarded: bool) -> Far:
        asked.append((kind, url, frames is not None, obstacles is not None and settings is not None and guarded))
        return Far(GroundPose(4.4, 3.2))

    monkeypatch.setattr("avlmaps_ros.open_ros_driver", connect)
    frames = tmp_path / "frames.json"
    frames.write_text('{"map_frame": "map"}')
    words = ("--robot", "nav2", "--ros", "ws://robot:9090", "--ros-frames", frames)
    said = answer("go", built, "turn left, then move forward 1 metre", *words)
    assert said["ok"] is True and asked == [("nav2", "ws://robot:9090", True, True), ("closed",)]
    assert said["subgoals"][0]["goal"][:2] == pytest.approx([4.4, 4.2])


@pytest.mark.parametrize(
    "sentence",
    [
        "go to the purple elephant",
        "go to where the beeping comes from",
        "go to the red thing near the sound of barking",
        "go to the kitchen",
        "go to the nearest red thing, then turn left",
    ],
)
def test_a_dry_run_says_of_the_map_what_the_drive_says(run, built: Path, in_room: None, sentence: str) -> None:
    dry, drive = (json.loads(run("go", built, sentence, *how)[1]) for how in (
        ("--dry-run", "--json"), ("--scene", "room", "--json"),
    ))  # fmt: skip
    assert dry["program"] == drive["program"] and dry["path_m"] == 0.0
    assert dry["missing"] == dry["error"] == drive["error"] and dry["ok"] is drive["ok"]
    told = [*drive["notes"], *([drive["error"]["message"]] if drive["error"] else [])]
    assert dry["notes"] == [one for one in told if "could stop" not in one and one != "the program moved nothing"]


def test_a_dry_run_does_not_say_that_it_moved_nothing(answer, built: Path) -> None:
    assert answer("go", built, "wait for 2 seconds", "--dry-run")["notes"] == []


def test_things_that_fit_equally_are_asked_about(run, built: Path, in_room: None) -> None:
    status, out, _ = run("go", built, "go to the red thing", "--scene", "room", "--json")
    said = json.loads(out)
    assert status == 1 and said["error"]["kind"] == "several-fit"
    assert len(said["choices"]) >= 2 and "The robot was not moved." in said["error"]["message"]
    goals = []
    for number in (1, 2):
        status, out, err = run("go", built, "go to the red thing", "--scene", "room", "--json", "--choose", number)
        assert status == 0, err
        goals.append(json.loads(out)["subgoals"][0]["goal"][:2])
    assert not np.allclose(*goals, atol=0.5)
    assert "There is no number 99. " in run("go", built, "go to the red thing", "--dry-run", "--choose", 99)[2]
    (note,) = json.loads(run("go", built, "turn left", "--dry-run", "--choose", 1, "--json")[1])["notes"]
    assert note == "--choose has no effect: nothing is left to choose."
