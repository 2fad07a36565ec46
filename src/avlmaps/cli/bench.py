"""`avlmaps bench`: the quality figures, as JSON, Markdown and a picture."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from tyro.conf import Positional

from avlmaps.cli.output import emit, table_lines
from avlmaps.cli.verbs import Verb

Suite = Literal["words", "sounds", "segmentation", "locate"]


@dataclass(frozen=True, kw_only=True)
class Bench(Verb):
    """Measure how good the parts are, with counts and 95 % intervals.

    words: household phrases kept out of training; needs nothing.
    sounds, segmentation: need --sounds, a folder of clips with an index.csv.
    locate: needs --scenes, recordings with poses; half of the frames become the map, the others are asked.
    """

    suite: Positional[Suite]
    """What to measure."""
    sounds: Path | None = None
    """Folder of sound clips with an index.csv (path, category, fold)."""
    scenes: tuple[Path, ...] = ()
    """Recordings with poses."""
    profile: str = "embedded"
    """Which models are measured."""
    out: Path = Path("bench_out")
    """Folder for SUITE.json, SUITE.md and SUITE.png."""
    seed: int = 0
    """Seed of what is drawn at random."""

    def run(self) -> None:
        """Measure, write the tables, print them."""
        from avlmaps.bench.suites import Asked, run_suite

        asked = Asked(sounds=self.sounds, scenes=self.scenes, profile=self.profile, seed=self.seed)
        answer = run_suite(self.suite, asked, self.out)
        lines: list[str] = []
        for name, table in answer["tables"].items():
            lines += [name, *["  " + line for line in table_lines(table["columns"], table["rows"])]]
        emit(answer, [*lines, f"wrote {self.out}"], self.json)
