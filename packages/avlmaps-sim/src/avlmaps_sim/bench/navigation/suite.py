"""The suite as ``avlmaps bench navigation`` runs it: tables as JSON, Markdown and a picture, and every stop."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec

from avlmaps.core.files import write_bytes_atomically
from avlmaps.navigate.bodies import BASE
from avlmaps_sim.bench.harness.paper import paper_source
from avlmaps_sim.bench.harness.provenance import in_words, provenance
from avlmaps_sim.bench.navigation.episodes import Episode
from avlmaps_sim.bench.navigation.runs import run
from avlmaps_sim.bench.navigation.settings import NavigationSettings
from avlmaps_sim.bench.navigation.tables import tables
from avlmaps_sim.bench.output import markdown, write_answer

if TYPE_CHECKING:
    pass


NOTE = (
    "A subgoal is reached where the robot stops within 1 m of a right thing: horizontally, to the nearest point of its "
    "box, to where the sound was heard (overlay) or came from (acoustic), or to where the photo was taken. SPL is "
    "success weighted by path length (Anderson et al. 2018) over subgoals. A contact is foretold where the map showed "
    "an obstacle within the body's radius of where it was about to be. Intervals are 95 %: Wilson's over sequences, "
    "bootstrapped by whole sequences for subgoals and SPL."
)


def run_navigation(settings: NavigationSettings | None, out: Path) -> dict[str, Any]:
    """Run the benchmark; write its tables (JSON, Markdown, CSV), and ``navigation_episodes.jsonl``.

    Recordings and maps stay in the folder ``work`` of ``out``, what robots did in ``episodes``.
    """
    settings = settings or NavigationSettings()
    outcome = run(settings, out)
    answer = {
        "suite": "navigation",
        **provenance(settings, outcome.missions.recorded, outcome.missions.scenes, outcome.weights),
        "language": settings.language,
        "guess": settings.guess,
        "body": {"radius_m": BASE.radius_m, "height_m": BASE.height_m},
        "note": NOTE,
        "paper": paper_source("navigation"),
        "tables": tables(outcome),
    }
    language = "Programs are given." if settings.language == "none" else f"Language by {settings.language}."
    head = f"{in_words(answer)} {language} {len(outcome.episodes)} episodes."
    page = f"# Navigation\n\n{head}\n\n{NOTE}\n\nPaper: {answer['paper']}\n\n"
    written = write_answer(answer, out, page + markdown(answer["tables"]))
    write_bytes_atomically(out / "navigation_episodes.jsonl", _lines(outcome.episodes))
    return written


def _lines(episodes: list[Episode]) -> bytes:
    return b"".join(msgspec.json.encode(episode) + b"\n" for episode in episodes)
