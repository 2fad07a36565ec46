"""`avlmaps go`: turn a command into a program, and run it on a simulated or a real robot."""

from dataclasses import dataclass, field
from math import isfinite, radians
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from tyro.conf import OmitArgPrefixes, Positional, arg

from avlmaps.cli.output import AnsweredError, UsageError, emit, error_answer, kind_named, place, table_lines
from avlmaps.cli.verb import ModelVerb
from avlmaps.core.progress import say

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np
    from jaxtyping import Float

    from avlmaps.core.motion import GroundPose
    from avlmaps.language.translator import Translator
    from avlmaps.maps.obstacles import Obstacles
    from avlmaps.navigate.driver import Driver
    from avlmaps.navigate.interrupts import Halt
    from avlmaps.query.avlmap import AVLMap


@dataclass(frozen=True, kw_only=True)
class Chat:
    """The chat model of --language chat; what is not given is read from AVLMAPS_CHAT_MODEL and its like."""

    chat_model: str | None = None
    """Name of the chat model. Default: the only one that the server has."""
    chat_url: str | None = None
    """Address of the server, such as http://localhost:11434/v1. Default: OpenAI's own."""
    chat_replay: Path | None = None
    """A file of what a chat model answered: made where it is missing, asked instead of the model where it is there."""


@dataclass(frozen=True, kw_only=True)
class Go(ModelVerb):
    """Tell the robot where to go, in a sentence; it writes its program, drives, and tells how near it came.

    The map is all that the robot knows. Its body is simulated in --scene, which must be the scene that was recorded:
    recordings of `avlmaps record` and their maps lie in their scene's frame. A real robot drives with --robot.

    Example: avlmaps go MAP "first go to the sofa, then face the tv" --scene house:7 --plot way.png
    """

    compiles: ClassVar[bool] = True

    map: Positional[Path]
    """The map."""
    sentence: Positional[str]
    """What the robot is to do."""
    scene: str | None = None
    """The scene in which the simulated body drives: house:SEED, office:SEED or a file, as for `avlmaps record`."""
    language: Literal["rules", "chat"] = "rules"
    """Who writes the program: a grammar that needs nothing, or a chat model (pip install 'avlmaps[chat]')."""
    chat: Annotated[Chat, OmitArgPrefixes] = field(default_factory=Chat)
    """Which chat model."""
    body: Literal["base", "drone"] = "base"
    """Whose body: what stands in the way of a wheeled base may not be in that of a drone."""
    robot: Literal["simulated", "nav2", "move_base"] = "simulated"
    """What moves: a simulated body, or a real robot over rosbridge (pip install 'avlmaps[ros]')."""
    ros: str = "ws://localhost:9090"
    """Address of rosbridge, for --robot nav2 and move_base."""
    ros_frames: Path | None = None
    """A JSON file of the robot's frames and settings: namespace, radius, speed, timeouts (docs/robots.md)."""
    start: Annotated[str | None, arg(metavar="X,Y,HEADING")] = None
    """Where the simulated robot starts: metres, degrees counter-clockwise from +x. Default: where the walk began."""
    guess: bool = False
    """Go to the best guess where the map is not sure that it holds what is named."""
    image: Path | None = None
    """The file that "this photo" in the sentence means."""
    sound_clip: Path | None = None
    """The file that "this recording" in the sentence means."""
    explain: bool = False
    """Print the readings of the sentence with their costs; the smallest is taken."""
    dry_run: bool = False
    """Print the program, and do not drive; neither the map nor a scene is opened."""
    plot: Path | None = None
    """Draw the way over the map into this picture: start, goals, stops, what was met."""

    def run(self) -> None:
        """Drive."""
        from avlmaps.navigate.interrupts import Interrupted

        try:
            answer = go(self)
        except Interrupted as stop:
            if self.json:
                emit({**stop.to_json(), "error": error_answer("interrupted", str(stop))}, (), as_json=True)
            raise
        failed = _failure(answer)
        emit({**answer, "error": failed}, go_lines(answer), self.json)
        if failed is not None:
            raise AnsweredError(failed["message"])


@dataclass(frozen=True, slots=True)
class _Ready:
    """A robot that can be told to go.

    Attributes:
        driver: moves it.
        start: where it stands.
        obstacles: what the map knows to stand in its way.
        met: tells where it met something that the map does not know.
        halt: returns how the robot stands after an interrupt.
        close: ends the connection; a real robot stops where it is.
    """

    driver: "Driver"
    start: "GroundPose"
    obstacles: "Obstacles"
    met: "Callable[[], Float[np.ndarray, 'm 2'] | None]"
    halt: "Callable[[], Halt]"
    close: "Callable[[], None]"


def go(verb: "Go") -> dict[str, Any]:
    """Do what the sentence says, and tell of it."""
    start = _start(verb.start)
    if verb.robot == "simulated" and verb.scene is None and not verb.dry_run:
        raise UsageError(
            "go needs --scene, in which the simulated robot drives, or --robot nav2|move_base, or --dry-run."
        )
    if verb.robot != "simulated" and (verb.scene or start):
        raise UsageError(f"--scene and --start belong to a simulated robot; --robot {verb.robot} is where it is.")
    translator = _translator(verb)
    if verb.explain and verb.dry_run:
        from avlmaps.language.rules import explanation

        for line in explanation(translator, verb.sentence):
            say(line)
    if verb.dry_run:
        translation = translator.program_for(verb.sentence)
        return {
            "plan": translation.plan,
            "program": translation.program, "steps": [], "actions": [], "subgoals": [], "ok": True, "error": None,
            "notes": list(translation.notes), "path_m": 0.0, "elapsed_s": 0.0, "frame": "recording",
        }  # fmt: skip
    from avlmaps.navigate.interrupts import raised_signals

    with raised_signals():
        return _driven(verb, start)


def _driven(verb: "Go", start: "GroundPose | None") -> dict[str, Any]:
    from avlmaps.navigate.instruct import instruct
    from avlmaps.navigate.interrupts import Interrupted
    from avlmaps.navigate.skills import RobotSettings
    from avlmaps.query.avlmap import AVLMap

    asked = AVLMap.open(verb.map)
    translator = _translator(verb, asked)
    if verb.explain:
        from avlmaps.language.rules import explanation

        for line in explanation(translator, verb.sentence):
            say(line)
    translation = translator.program_for(verb.sentence)  # what is not understood is told before a scene is made
    robot = _in_scene(verb, asked, start) if verb.robot == "simulated" else _real(verb, asked)
    settings = RobotSettings(guess=verb.guess)
    try:
        outcome = instruct(
            verb.sentence, asked, robot.driver, translator, settings=settings, translation=translation, tell=say
        )
    except Interrupted as stop:
        stop.halt = robot.halt()
        raise
    finally:
        robot.close()
    if verb.plot is not None:
        from avlmaps.navigate.trace_plot import plot_way

        title = f"“{verb.sentence}”"
        plot_way(verb.plot, asked.space, robot.start, outcome.moves, robot.obstacles, robot.met(), title)
        return {**outcome.to_json(), "plot": str(verb.plot)}
    return outcome.to_json()


def _translator(verb: "Go", asked: "AVLMap | None" = None) -> "Translator":
    from avlmaps.language.commands import Given

    came = Given(
        None if verb.image is None else str(verb.image), None if verb.sound_clip is None else str(verb.sound_clip),
        None if asked is None else asked.knows,
    )  # fmt: skip
    if verb.language == "rules":
        from avlmaps.language.rules import RulesTranslator

        return RulesTranslator(came)
    from avlmaps.language.chat import ChatSettings, ChatTranslator

    chat = verb.chat
    given = ChatSettings.from_environment(model=chat.chat_model, base_url=chat.chat_url, replay=chat.chat_replay)
    return ChatTranslator(given)


def _start(words: str | None) -> "GroundPose | None":
    """Read ``x,y,heading``, the heading in degrees; None stays None."""
    from avlmaps.core.motion import GroundPose

    if words is None:
        return None
    try:
        x_m, y_m, heading_deg = (float(word) for word in words.split(","))
        if not all(isfinite(value) for value in (x_m, y_m, heading_deg)):
            raise ValueError
        return GroundPose(x_m, y_m, radians(heading_deg))
    except ValueError:
        raise UsageError(f"--start takes x,y,heading in metres and degrees, such as 1.5,2,90; not {words!r}.") from None


def _in_scene(verb: "Go", asked: "AVLMap", start: "GroundPose | None") -> _Ready:
    from avlmaps.demo.driving import robot_in
    from avlmaps.navigate.bodies import SHAPES
    from avlmaps.navigate.interrupts import Halt
    from avlmaps.sim.scenes import open_scene

    robot = robot_in(asked, open_scene(verb.scene or ""), SHAPES[verb.body], start)
    halt = Halt(True, "the simulated robot moves only while the command runs")
    return _Ready(robot.driver, robot.start, robot.obstacles, lambda: robot.met, lambda: halt, lambda: None)


def _real(verb: "Go", asked: "AVLMap") -> _Ready:
    from avlmaps.navigate.bodies import SHAPES
    from avlmaps.navigate.costmap import obstacles_for
    from avlmaps.navigate.ros import Frames, RosSettings, open_ros_driver

    given = verb.ros_frames
    frames = None if given is None else Frames.read(given)
    settings = None if given is None else RosSettings.read(given)
    obstacles = obstacles_for(asked, SHAPES[verb.body])
    kind = "nav2" if verb.robot == "nav2" else "move_base"
    driver = open_ros_driver(kind, verb.ros, frames, obstacles, settings=settings, guarded=True)
    return _Ready(driver, driver.pose, obstacles, lambda: None, driver.halt, driver.close)


def _failure(answer: dict[str, Any]) -> dict[str, Any] | None:
    """Return why a command was not obeyed to its end, as ``error`` in JSON has it; None where it was."""
    if answer["ok"]:
        return None
    if answer["error"] is not None:
        return error_answer(kind_named(answer["error_type"]), answer["error"])
    missed = [goal["name"] or place(goal["goal"]) for goal in answer["subgoals"] if not goal["reached"]]
    message = (
        f"The robot did not reach {len(missed)} of {len(answer['subgoals'])} goals: {', '.join(missed)}."
        if missed
        else "The robot could not end a movement; the notes say why."
    )
    return error_answer("navigation", message)


def go_lines(answer: dict[str, Any]) -> list[str]:
    """Lay out what `go` tells: the program, and the places."""
    lines = [*([answer["plan"]] if answer.get("plan") else []), *answer["program"].splitlines()]
    rows = [
        (
            number, goal["name"] or goal["skill"].replace("_", " "), place(goal["goal"]), place(goal["stop"]),
            f"{goal['distance_m']:.2f} m" + ("" if goal["reached"] else ", not reached"),
        )
        for number, goal in enumerate(answer["subgoals"], 1)
    ]  # fmt: skip
    lines += table_lines(("", "went to", "goal", "stopped at", "away"), rows) if rows else []
    lines += [f"note: {note}" for note in answer["notes"]]
    if answer["steps"]:
        done = "done" if answer["ok"] else "not done"
        lines.append(f"{done}: {answer['path_m']:.1f} m driven, {len(answer['actions'])} actions")
    return [*lines, f"wrote {answer['plot']}"] if "plot" in answer else lines
