"""`avlmaps demo`: simulate a home, map it, query it, and drive through it."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar

from tyro.conf import arg

from avlmaps.cli.output import emit
from avlmaps.cli.verb import Verb


@dataclass(frozen=True, kw_only=True)
class Demo(Verb):
    """Record a simulated home, map it and query the map: the whole system in one command, with a report.html.

    Example: avlmaps demo --out demo_out
    """

    compiles: ClassVar[bool] = True

    out: Annotated[Path, arg(metavar="DIR")] = Path("demo_out")
    """Folder for the recording, the map, the pictures and report.html."""
    seed: Annotated[int, arg(metavar="N")] = 0
    """Seed of the home, the drive, the sounds and the questions."""

    def run(self) -> None:
        """Run the demonstration."""
        from avlmaps_sim.demo import run_demo

        report = run_demo(self.out, seed=self.seed)
        emit(report.to_json(), report.lines(), self.json)
