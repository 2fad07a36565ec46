"""`avlmaps demo`: simulate a home, map it, query it, and drive through it."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from avlmaps.cli.output import emit
from avlmaps.cli.verb import Verb

if TYPE_CHECKING:
    pass


@dataclass(frozen=True, kw_only=True)
class Demo(Verb):
    """Drive through a home, hear it, map it, ask it: the whole system in one command, with a report.html."""

    compiles: ClassVar[bool] = True

    out: Path = Path("demo_out")
    """Folder for the recording, the map, the pictures and report.html."""
    seed: int = 0
    """Another seed takes another home, another drive, other sounds and questions."""

    def run(self) -> None:
        """Run the demonstration."""
        from avlmaps.demo import run_demo

        report = run_demo(self.out, seed=self.seed)
        emit(report.to_json(), report.lines(), self.json)
