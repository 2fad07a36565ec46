"""The demonstration's last step: a spoken command is obeyed in the home, and judged by what truly stands there."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from avlmaps.core.errors import AvlmapsError
from avlmaps.core.motion import GroundPose
from avlmaps_sim.demo.questions import MAP, REACH_M, Ask
from avlmaps_sim.demo.svg import Sheet

if TYPE_CHECKING:
    from avlmaps.navigate.instruct import Outcome
    from avlmaps.query.avlmap import AVLMap
    from avlmaps_sim.scene import Scene

PICTURE = "drive.png"
# The robot is sent to the goals of these questions: together they need every modality, and nothing beside the command.
_KINDS = ("sound", "area", "words")
_MOST_LEGS = 2


@dataclass(frozen=True, slots=True)
class Drive:
    """A command, and what became of it.

    ``start`` and ``outcome`` are None where it could not begin; ``error`` says why not, or why it did not end.
    """

    command: str
    asks: tuple[Ask, ...]
    start: GroundPose | None
    outcome: "Outcome | None"
    error: str | None

    @property
    def off_m(self) -> tuple[float | None, ...]:
        """For each leg how far from the nearest true thing the robot stopped; None where it never stopped for it."""
        stops = [move.stop for move in self.outcome.subgoals] if self.outcome else []
        stops += [None] * (len(self.asks) - len(stops))
        return tuple(
            None if stop is None else min(box.distance_m(stop) for box in ask.truth)
            for ask, stop in zip(self.asks, stops, strict=False)
        )

    @property
    def right(self) -> tuple[bool, ...]:
        """For each leg whether the robot stopped at the right thing."""
        return tuple(off is not None and off <= REACH_M for off in self.off_m)

    def to_json(self) -> dict[str, Any]:
        """Return it as `avlmaps demo --json` prints it."""
        legs = [
            {"to": ask.title, "right": right, "off_m": None if off is None else round(off, 3)}
            for ask, right, off in zip(self.asks, self.right, self.off_m, strict=True)
        ]
        outcome = None if self.outcome is None else self.outcome.to_json()
        return {"command": self.command, "legs": legs, "error": self.error, "outcome": outcome}

    def lines(self) -> list[str]:
        """Return it as a person reads it."""
        lines = [f"command: {self.command}"]
        for ask, right, off in zip(self.asks, self.right, self.off_m, strict=True):
            where = "never stopped for it" if off is None else f"stopped {off:.2f} m from the true one"
            lines.append(f"{'right' if right else 'WRONG'}  {ask.title}  ->  {where}")
        return lines + ([f"it ended early: {self.error}"] if self.error else [])


def command_for(asks: Sequence[Ask]) -> tuple[str, tuple[Ask, ...]] | None:
    """Return a command and what its legs go to, chosen by the kinds of questions; None where there is nothing."""
    legs = [ask for kind in _KINDS for ask in asks if ask.kind == kind and ask.truth][:_MOST_LEGS]
    if not legs:
        return None
    first, *others = (f"go to {ask.title}" for ask in legs)
    return (f"first {first}, then {others[0]}" if others else first), tuple(legs)


def drive(
    asks: Sequence[Ask], avlmap: "AVLMap", scene: "Scene", out: Path, tell: Callable[[str], None]
) -> Drive | None:
    """Send a robot in the home to the goals with one command, and draw its path."""
    from avlmaps.language.translator import LearnedTranslator
    from avlmaps.navigate.instruct import instruct
    from avlmaps.navigate.skills import RobotSettings
    from avlmaps.navigate.trace_plot import plot_path
    from avlmaps_sim.robots import robot_in

    chosen = command_for(asks)
    if chosen is None:
        return None
    command, legs = chosen
    try:
        driver = robot_in(avlmap, scene)
        start = driver.pose
        # The goals are truly there, so the robot may go to a best guess; the report says whether that was right.
        outcome = instruct(command, avlmap, driver, LearnedTranslator(), settings=RobotSettings(guess=True), tell=tell)
    except AvlmapsError as fault:
        return Drive(command, legs, None, None, str(fault))
    plot_path(out / PICTURE, avlmap.space, start, outcome.moves, driver.obstacles, driver.touched, f"“{command}”")
    return Drive(command, legs, start, outcome, outcome.error)


def drive_card(drive: Drive, sheet: Sheet, scene: str) -> str:
    """Return the report's part on the drive."""
    right = sum(drive.right)
    head = (
        f"<h2>The drive: {right} of {len(drive.asks)} places right</h2><p>The sentence became a program, "
        "the program queried the map, and the robot drove there with nothing but the map to plan on: 10 cm ahead or "
        "5 degrees to a side at a time, in the home as it truly is. A stop is right when it lies within 1 m of the "
        "thing that was meant.</p>"
    )
    if drive.outcome is None or drive.start is None:
        return head + f'<div class="card"><p>“{escape(drive.command)}”: {escape(str(drive.error))}</p></div>'
    way = np.column_stack([drive.outcome.path, np.zeros(len(drive.outcome.path))])
    drawing = sheet.drawing(
        [
            '<use href="#ground"/>', sheet.rings([box for ask in drive.asks for box in ask.others], "other"),
            sheet.rings([box for ask in drive.asks for box in ask.truth], "truth"),
            sheet.walk(way) if len(way) else "", sheet.dot((drive.start.x_m, drive.start.y_m), "robot"),
            sheet.goals([move.stop for move in drive.outcome.subgoals]),
        ],
        "the robot's path, top-down",
    )  # fmt: skip
    verdict = "right" if right == len(drive.asks) else "wrong"
    legs = "".join(f"<li>{escape(line)}</li>" for line in drive.lines()[1:])
    summary = f"{drive.outcome.path_m:.1f} m driven, {len(drive.outcome.actions)} actions"
    return (
        f'{head}<article class="card question"><div class="head"><h3>“{escape(drive.command)}”</h3>'
        f'<span class="verdict {verdict}">{right} of {len(drive.asks)}</span></div>'
        f"<pre><code>{escape(drive.outcome.program.strip())}</code></pre>{drawing}"
        f'<ul>{legs}</ul><p class="note">{summary}. Yellow: where it began; numbers: where it stopped; green: what was '
        f"meant; dashed: others of the kind.</p><p><code>avlmaps go {MAP} &quot;{escape(drive.command)}&quot; --scene "
        f'{escape(scene)} --guess --plot {PICTURE}</code> <a href="{PICTURE}">its plot</a></p></article>'
    )
