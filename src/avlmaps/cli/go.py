"""`avlmaps go`: turn a command into a program, and run it on a simulated or a real robot."""

import sys
from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from math import radians
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from tyro.conf import OmitArgPrefixes, Positional, UseAppendAction, arg

from avlmaps.cli.output import AnsweredError, Column, UsageError, emit, error_answer, kind_of, table
from avlmaps.cli.verb import COUNT, Asking, MapVerb, idle
from avlmaps.core.errors import LanguageError, ProgramError, kind_named
from avlmaps.core.progress import say
from avlmaps.core.wording import place_text

if TYPE_CHECKING:
    from avlmaps.core.motion import GroundPose
    from avlmaps.language.translator import Translation, Translator
    from avlmaps.navigate.instruct import Outcome
    from avlmaps.navigate.robots import RobotDriver
    from avlmaps.navigate.skills import RobotSettings
    from avlmaps.query.avlmap import AVLMap
    from avlmaps.query.heatmap import Heatmap


@dataclass(frozen=True, kw_only=True)
class Chat:
    """Options of --language chat; defaults: AVLMAPS_CHAT_MODEL, AVLMAPS_CHAT_BASE_URL and AVLMAPS_CHAT_REPLAY."""

    chat_model: Annotated[str | None, arg(metavar="NAME")] = None
    """Name of the chat model. Default: the only one that the server has."""
    chat_url: Annotated[str | None, arg(metavar="URL")] = None
    """Address of the server, such as http://localhost:11434/v1. Default: OpenAI's own."""
    chat_replay: Annotated[Path | None, arg(metavar="FILE")] = None
    """A file of a chat model's answers: written where it is missing, else read instead of calling the model."""


@dataclass(frozen=True, kw_only=True)
class Go(Asking, MapVerb):
    """Drive the robot by a sentence: avlmaps writes a program, runs it, and reports how near each stop came.

    The map is all that the robot knows. Its body is simulated in --scene, which must be the scene that was recorded:
    recordings of `avlmaps record` and their maps lie in their scene's frame. A real robot drives with --robot.

    Example: avlmaps go MAP "first go to the sofa, then face the tv" --scene house:7 --plot way.png
    """

    sentence: Annotated[Positional[str], arg(metavar="SENTENCE")]
    """Command for the robot."""
    scene: Annotated[str | None, arg(metavar="SCENE")] = None
    """Scene in which the simulated body drives, as for `avlmaps record`: house:7, office:3:held-out or a file."""
    language: Literal["learned", "rules", "local", "chat"] = "learned"
    """Translator of the sentence: the reader that ships (also by its former name, rules), it and a language model of
    this machine together (local, with --llm), or a chat model."""
    llm: Annotated[str | None, arg(metavar="FILE|URL")] = None
    """Language model of --language local: a GGUF file ('avlmaps[llm]'), or the address of a llama.cpp server."""
    chat: Annotated[Chat, OmitArgPrefixes] = field(default_factory=Chat)
    """Chat model."""
    body: Literal["base", "drone"] = "base"
    """Body of the robot: a wheeled base and a drone have other obstacles."""
    robot: Literal["simulated", "nav2", "move_base"] = "simulated"
    """Robot: a simulated body, or a real robot over rosbridge (pip install avlmaps-ros) or, nav2, natively."""
    ros: Annotated[str, arg(metavar="URL")] = "ws://localhost:9090"
    """Address of rosbridge, for --robot nav2 and move_base; "native" joins the ROS 2 network of nav2 by rclpy."""
    ros_frames: Annotated[Path | None, arg(metavar="FILE")] = None
    """JSON file of the robot's frames and settings: namespace, radius, speed, timeouts (docs/robots.md)."""
    start: Annotated[str | None, arg(metavar="X,Y,HEADING")] = None
    """Start of the simulated robot: metres, degrees counter-clockwise from +x. Default: the start of the recording."""
    guess: bool = False
    """Go to the best guess where nothing is found, and to the nearest of several things that fit equally."""
    choose: Annotated[tuple[int, ...], COUNT, arg(metavar="NUMBER"), UseAppendAction] = ()
    """Which of several meanings, or of several things that fit equally: its number in the question, one for each."""
    image: Annotated[Path | None, arg(metavar="FILE")] = None
    """File that "this photo" in the sentence means."""
    sound_clip: Annotated[Path | None, arg(metavar="FILE")] = None
    """File that "this recording" in the sentence means."""
    explain: bool = False
    """Print the readings of the sentence with their probabilities; the likeliest one counts."""
    dry_run: bool = False
    """Print the program without driving, and what the map lacks for it; a map that is not there is not needed."""
    plot: Annotated[Path | None, arg(metavar="FILE")] = None
    """Draw the path over the map into this picture: start, goals, stops, contacts."""

    def run(self) -> None:
        from avlmaps.navigate.interrupts import UNCONFIRMED_STATUS, Interrupted

        try:
            answer = go(self)
        except Interrupted as stop:
            if self.json:
                emit({**stop.to_json(), "error": error_answer("interrupted", str(stop))}, (), as_json=True)
            raise
        except LanguageError as unread:
            if not self.json:
                raise
            error, choices = error_answer(kind_of(unread), str(unread)), list(getattr(unread, "choices", ()))
            emit({"ok": False, "error": error, "choices": choices}, (), as_json=True)
            raise AnsweredError(str(unread)) from None
        failed = failure(answer)
        emit({**answer, "error": failed}, go_lines(answer), self.json)
        if failed is not None:
            raise AnsweredError(failed["message"], UNCONFIRMED_STATUS if answer.get("robot_stopped") is False else 1)


def go(verb: "Go") -> dict[str, Any]:
    """Do what the sentence says, and return the report."""
    start = read_start(verb.start)
    if verb.robot == "simulated" and verb.scene is None and not verb.dry_run:
        raise UsageError(
            "go needs --scene, in which the simulated robot drives, or --robot nav2|move_base, or --dry-run."
        )
    if verb.robot != "simulated" and (verb.scene or start):
        raise UsageError(f"--scene and --start belong to a simulated robot; --robot {verb.robot} is where it is.")
    from avlmaps.navigate.interrupts import raised_signals
    from avlmaps.query.avlmap import AVLMap

    with nullcontext() if verb.dry_run else raised_signals():
        is_there = verb.map.exists() or not verb.dry_run
        avlmap = AVLMap.open(verb.map, verb.query_settings()) if is_there else None
        translator = translator_for(verb, avlmap)
        # A sentence that is not understood fails here, before a scene is made.
        translation = _read(verb, translator)
        if verb.dry_run or avlmap is None:
            return plan_answer(verb, translation, avlmap)
        return drive(verb, avlmap, robot_of(verb, avlmap, start), translator, translation)


def _read(verb: "Go", translator: "Translator") -> "Translation":
    if verb.explain:
        from avlmaps.language.translator import explanation

        for line in explanation(translator, verb.sentence):
            say(line)
    translation = translator.program_for(verb.sentence)
    return replace(translation, notes=(*translation.notes, *_idle(verb, translation.program)))


def _idle(verb: "Go", program: str) -> list[str]:
    rows = (
        (verb, ("at",), "sound=" in program, "no sound is named"),
        (verb, ("image",), "load_image(" in program, "the sentence speaks of no photo"),
        (verb, ("sound_clip",), "load_sound(" in program, "the sentence speaks of no recording"),
        (verb, ("ros", "ros_frames"), verb.robot != "simulated", "the robot is simulated"),
        (verb.chat, tuple(verb.chat.__dataclass_fields__), verb.language == "chat", f"--language is {verb.language}"),
        (verb, ("llm",), verb.language == "local", f"--language is {verb.language}"),
        (verb, ("plot",), not verb.dry_run, "nothing is driven"),
    )
    return [note for options, names, has_effect, why in rows if not has_effect for note in idle(options, names, why)]


def plan_answer(verb: "Go", translation: "Translation", avlmap: "AVLMap | None") -> dict[str, Any]:
    """Return the answer for a command that is read and not obeyed, with what a drive would report of its map."""
    from avlmaps.core.motion import GroundPose
    from avlmaps.navigate.instruct import MOVED_NOTHING, InstantDriver, Outcome, rehearse

    told = Outcome(verb.sentence, (translation.program,), translation.notes, (), (), None, None, 0.0)
    if avlmap is not None:
        driver, settings = InstantDriver(avlmap, GroundPose(0.0, 0.0)), robot_settings(verb, translation)
        told = rehearse(verb.sentence, translation, avlmap, driver, settings=settings, readable=None)
        told = replace(told, done=(), moves=(), elapsed_s=0.0)
    else:
        told = replace(told, notes=(*told.notes, f"There is no map at {verb.map}: the words alone are checked."))
    if told.error_type == ProgramError.__name__:  # it may depend on what a drive finds out
        told = replace(told, error=None, error_type=None)
    missing = None if told.error is None else error_answer(kind_named(told.error_type or ""), told.error)
    notes = [*told.notes, *([] if told.error is None else [told.error])]
    notes = [note for note in dict.fromkeys(notes) if note != MOVED_NOTHING]  # as it should be
    return {"plan": translation.plan, **told.to_json(), "notes": notes, "missing": missing}


def drive(
    verb: "Go", avlmap: "AVLMap", robot: "RobotDriver", translator: "Translator", translation: "Translation"
) -> dict[str, Any]:
    """Run the program of a command on a robot, and close its connection; ``Interrupted`` says how the robot stands."""
    from avlmaps.navigate.interrupts import Interrupted

    try:
        start = robot.pose
        outcome = _obeyed(verb, avlmap, robot, translator, translation)
        unconfirmed = {"robot_stopped": False} if robot.owes else {}
        answer = {**outcome.to_json(), **unconfirmed}
        if verb.plot is None:
            return answer
        from avlmaps.navigate.costmap import SHAPES, obstacles_for
        from avlmaps.navigate.trace_plot import plot_path

        obstacles = getattr(robot, "obstacles", None) or obstacles_for(avlmap, SHAPES[verb.body])
        touched = getattr(robot, "touched", None)
        plot_path(verb.plot, avlmap.space, start, outcome.moves, obstacles, touched, f"“{verb.sentence}”")
        return {**answer, "plot": str(verb.plot)}
    except Interrupted as stop:  # also after the program: goals were sent, and the robot is not watched any more
        stop.halt = stop.halt or robot.halt()
        raise


def _obeyed(
    verb: "Go", avlmap: "AVLMap", robot: "RobotDriver", translator: "Translator", translation: "Translation"
) -> "Outcome":
    from avlmaps.navigate.instruct import instruct, unfound
    from avlmaps.navigate.interrupts import Interrupted

    settings, heats = robot_settings(verb, translation), dict[tuple[object, ...], "Heatmap"]()
    try:
        if verb.language != "chat":  # a chat model's program may decide while it drives
            missing = unfound(verb.sentence, translation, avlmap, robot.pose, settings, heats)
            while missing is not None and missing.choices and (number := _choice(verb, missing)):
                settings = replace(settings, choose=(*settings.choose, number))
                missing = unfound(verb.sentence, translation, avlmap, robot.pose, settings, heats)
            if missing is not None:
                say(translation.plan)
                return missing
        return instruct(
            verb.sentence, avlmap, robot, translator, settings=settings, translation=translation, tell=say,
            heats=heats,
        )  # fmt: skip
    except Interrupted as stop:
        stop.halt = robot.halt()
        raise
    finally:
        robot.close()


def robot_settings(verb: "Go", translation: "Translation") -> "RobotSettings":
    """Return how the robot takes its skills."""
    from avlmaps.navigate.instruct import settings_after
    from avlmaps.navigate.skills import RobotSettings

    return settings_after(translation, RobotSettings(guess=verb.guess, choose=verb.choose))


def _choice(verb: "Go", asked: "Outcome") -> int:
    if verb.json or not sys.stdin.isatty():
        return 0
    say(asked.error or "")
    say(f"Which one, 1 to {len(asked.choices)}? Anything else ends the command.")
    typed = sys.stdin.readline().strip()
    return int(typed) if typed.isdecimal() and 1 <= int(typed) <= len(asked.choices) else 0


def translator_for(verb: "Go", avlmap: "AVLMap | None" = None) -> "Translator":
    """Return the translator of the command."""
    if verb.language == "chat":
        from avlmaps.language.chat import ChatSettings, ChatTranslator

        names = {"model": verb.chat.chat_model, "base_url": verb.chat.chat_url, "replay": verb.chat.chat_replay}
        return ChatTranslator(ChatSettings.from_environment(**names))
    from avlmaps.language.sentence import Attachments
    from avlmaps.language.translator import LearnedTranslator
    from avlmaps.navigate.instruct import given_by

    image, clip = (None if file is None else str(file) for file in (verb.image, verb.sound_clip))
    known = Attachments(image, clip, at=verb.at)
    if avlmap is not None:
        known = given_by(avlmap, image, clip, said=verb.sentence)
    number = next(iter(verb.choose), None)
    if verb.language != "local":
        return LearnedTranslator(known, number)
    if verb.llm is None:
        raise UsageError("--language local needs --llm, a GGUF file or the address of a llama.cpp server.")
    from avlmaps.language.local import LocalModel, LocalTranslator

    return LocalTranslator(LocalModel(verb.llm), known, number)


def read_start(words: str | None) -> "GroundPose | None":
    """Read ``x,y,heading``, the heading in degrees; None stays None."""
    from avlmaps.core.motion import GroundPose

    if words is None:
        return None
    try:
        x_m, y_m, heading_deg = (float(word) for word in words.split(","))
        return GroundPose(x_m, y_m, radians(heading_deg))
    except ValueError:
        raise UsageError(f"--start takes x,y,heading in metres and degrees, such as 1.5,2,90; not {words!r}.") from None


def robot_of(verb: "Go", avlmap: "AVLMap", start: "GroundPose | None") -> "RobotDriver":
    """Connect to a real robot, or put a simulated one into the scene that was mapped."""
    from avlmaps.navigate.costmap import SHAPES, obstacles_for
    from avlmaps.navigate.robots import find_robot, open_robot_scene

    if verb.robot == "simulated":
        return open_robot_scene(verb.scene or "").robot(avlmap, SHAPES[verb.body], start)
    return find_robot(verb.robot, verb.ros, verb.ros_frames)(obstacles_for(avlmap, SHAPES[verb.body]))


def failure(answer: dict[str, Any]) -> dict[str, Any] | None:
    """Return why a command was not obeyed to its end, as ``error`` in JSON has it; None where it was."""
    if answer.get("robot_stopped") is False:
        message = "The robot did not confirm that it gave up its goal, and may still be driving; use its own stop."
        return error_answer("navigation", message)
    if answer["ok"]:
        return None
    if answer["error"] is not None:
        return error_answer(kind_named(answer["error_type"]), answer["error"])
    missed = [goal["name"] or place_text(goal["goal"]) for goal in answer["subgoals"] if not goal["reached"]]
    message = (
        f"The robot did not reach {len(missed)} of {len(answer['subgoals'])} goals: {', '.join(missed)}."
        if missed
        else "The robot could not end a movement; the notes say why."
    )
    return error_answer("navigation", message)


def go_lines(answer: dict[str, Any]) -> list[str]:
    """Lay out the answer of `go`: the program where it was not driven, and the places."""
    told = bool(answer["steps"])  # while it drove
    lines = [] if told else [*filter(None, [answer.get("plan")]), *answer["program"].splitlines()]
    columns: dict[str, Column] = {
        "": "number",
        "went to": lambda goal: goal["name"] or ("a place" if goal["skill"] == "move_to" else "straight on"),
        "goal": "goal",
        "stopped at": "stop",
        "away": lambda goal: f"{goal['distance_m']:.2f} m" + ("" if goal["reached"] else ", not reached"),
    }
    goals = [{"number": number, **goal} for number, goal in enumerate(answer["subgoals"], 1)]
    lines += table(columns, goals) if goals else []
    lines += [] if told else [f"note: {note}" for note in answer["notes"] if note != answer["error"]]
    if told:
        done = "done" if answer["ok"] else "not done"
        lines.append(f"{done}: {answer['path_m']:.1f} m driven, {len(answer['actions'])} actions")
    return [*lines, f"wrote {answer['plot']}"] if "plot" in answer else lines
