"""`avlmaps go`: a sentence becomes a program, and the robot drives."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

from tyro.conf import OmitArgPrefixes, Positional, arg

from avlmaps.cli.output import AnsweredError, emit, error_answer, kind_named, place, table_lines
from avlmaps.cli.verb import ModelVerb


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
        from avlmaps.cli.going import go
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
