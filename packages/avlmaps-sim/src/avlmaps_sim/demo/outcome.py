"""The outcome of the demonstration: each question with its answer, and its distance from the truth."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from avlmaps.query.schema import QueryAnswer
from avlmaps_sim.demo.drive import Drive
from avlmaps_sim.demo.questions import MAP, REACH_M, Ask


@dataclass(frozen=True, slots=True)
class Step:
    """One question of the demonstration and what became of it.

    ``answer`` is what `avlmaps query --json` prints.
    """

    ask: Ask
    answer: QueryAnswer
    picture: str

    @property
    def off_m(self) -> float | None:
        """Horizontal distance from the first goal to the nearest true place; None where there is none."""
        if not self.ask.truth or not self.answer["goals"]:
            return None
        goal = self.answer["goals"][0]["position"]
        return min(box.distance_m(goal) for box in self.ask.truth)

    @property
    def right(self) -> bool:
        """Whether the answer is right: the place, or that there is none."""
        if not self.ask.truth:
            return not self.answer["found"]
        return bool(self.answer["found"]) and self._near

    @property
    def _near(self) -> bool:
        return self.off_m is not None and self.off_m <= REACH_M

    @property
    def verdict(self) -> str:
        """``right``, ``WRONG``, or ``unsure``: not found, and yet the best guess is right."""
        if self.right:
            return "right"
        return "unsure" if self._near and not self.answer["found"] else "WRONG"

    @property
    def said(self) -> str:
        """The answer in words, and how far off it is."""
        if not self.answer["found"]:
            guess = "" if self.off_m is None else f"; its best guess is {self.off_m:.2f} m from the true one"
            return f"not here, it thinks{guess}"
        place = ", ".join(f"{value:.2f}" for value in self.answer["goals"][0]["position"])
        return f"({place})" + ("" if self.off_m is None else f", {self.off_m:.2f} m from the true one")


@dataclass(frozen=True, slots=True)
class DemoReport:
    """The products of the demonstration.

    ``built`` is what `avlmaps build --json` prints; ``located`` is the photo's pose error in cm and degrees, None where
    it was not located.
    """

    out: Path
    scene: str
    steps: tuple[Step, ...]
    built: dict[str, Any]
    located: tuple[float, float] | None
    seconds: dict[str, float] = field(default_factory=dict)
    drive: Drive | None = None

    def to_json(self) -> dict[str, Any]:
        """Return it as `avlmaps demo --json` prints it."""
        return {
            "out": str(self.out),
            "report": str(self.out / "report.html"),
            "recording": str(self.out / "recording"),
            "map": str(self.out / MAP),
            "voxels": self.built["voxels"],
            "sounds": len(self.built["sounds"]),
            "photo_error": None if self.located is None else {"cm": self.located[0], "deg": self.located[1]},
            "questions": [
                {"question": s.ask.title, "found": s.answer["found"], "right": s.right, "off_m": s.off_m}
                for s in self.steps
            ],
            "drive": None if self.drive is None else self.drive.to_json(),
            "seconds": self.seconds,
        }

    def lines(self) -> list[str]:
        """Return it as a person reads it."""
        lines = [f"{step.verdict:6} {step.ask.title}  ->  {step.said}" for step in self.steps]
        if self.located is not None:
            lines.append(f"photo located within {self.located[0]:.1f} cm and {self.located[1]:.2f} degrees")
        lines += [] if self.drive is None else self.drive.lines()
        return [*lines, f"look at {self.out / 'report.html'}"]
