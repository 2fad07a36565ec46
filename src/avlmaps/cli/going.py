"""From the words of `avlmaps go` to a robot that drives, and back to plain values. Heavy imports stay inside."""

from dataclasses import dataclass
from math import isfinite, radians
from typing import TYPE_CHECKING, Any

from avlmaps.cli.output import UsageError
from avlmaps.core.progress import say

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np
    from jaxtyping import Float

    from avlmaps.cli.go import Go
    from avlmaps.core.motion import GroundPose
    from avlmaps.language.translator import Translator
    from avlmaps.maps.obstacles import Obstacles
    from avlmaps.navigate.driver import Driver
    from avlmaps.navigate.interrupts import Halt
    from avlmaps.query.avlmap import AVLMap


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
            "notes": list(translation.notes), "path_m": 0.0, "elapsed_s": 0.0,
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
