"""The suite as ``avlmaps bench navigation`` runs it: tables as JSON, Markdown and a picture, and every stop."""

import json
from pathlib import Path
from typing import Any

import msgspec

from avlmaps.bench.navigation.episodes import Episode
from avlmaps.bench.navigation.picture import draw_rates
from avlmaps.bench.navigation.runs import Outcome, run
from avlmaps.bench.navigation.settings import NavigationSettings
from avlmaps.bench.navigation.tables import paper_figures, tables
from avlmaps.bench.suites import markdown
from avlmaps.core.files import write_bytes_atomically
from avlmaps.navigate.bodies import BASE

NOTE = (
    "A subgoal is reached where the robot stops within 1 m of a right thing: horizontally, to the nearest point of its "
    "box, to where the sound was heard (overlay) or came from (acoustic), or to where the photo was taken. SPL is "
    "success weighted by path length (Anderson et al. 2018) over subgoals. A contact is foretold where the map showed "
    "an obstacle within the body's radius of where it was about to be. Intervals are 95 %: Wilson's over sequences, "
    "bootstrapped by whole sequences for subgoals and SPL."
)


def run_navigation(settings: NavigationSettings | None, out: Path) -> dict[str, Any]:
    """Run the benchmark; write ``navigation.json``, ``.md``, ``.png`` and ``navigation_episodes.jsonl`` into a folder.

    Recordings and maps are kept in its folder ``work``, what robots did in ``episodes``.
    """
    settings = settings or NavigationSettings()
    outcome = run(settings, out)
    answer = {
        "suite": "navigation",
        "scenes": list(outcome.missions.scenes),
        "profile": settings.profile,
        "seed": outcome.missions.recorded.seed,
        "language": settings.language,
        "guess": settings.guess,
        "body": {"radius_m": BASE.radius_m, "height_m": BASE.height_m},
        "recorded": msgspec.to_builtins(outcome.missions.recorded),
        "note": NOTE,
        "paper": paper_figures()["source"] + ". " + paper_figures()["note"],
        "tables": tables(outcome),
    }
    out.mkdir(parents=True, exist_ok=True)
    write_bytes_atomically(out / "navigation.json", (json.dumps(answer, indent=1) + "\n").encode())
    write_bytes_atomically(out / "navigation_episodes.jsonl", _lines(outcome.episodes))
    write_bytes_atomically(out / "navigation.md", _markdown(outcome, answer).encode())
    draw_rates(outcome, out / "navigation.png")
    return answer


def _lines(episodes: list[Episode]) -> bytes:
    """Return every episode, in the order of the missions, to look into failures."""
    return b"".join(msgspec.json.encode(episode) + b"\n" for episode in episodes)


def _markdown(outcome: Outcome, answer: dict[str, Any]) -> str:
    recorded = answer["recorded"]
    sounds = f"clips of {recorded['sounds']}" if recorded["sounds"] else "sounds made by rule"
    told = "programs given directly" if answer["language"] == "none" else f"language by {answer['language']}"
    head = (
        f"# Navigation\n\nProfile {answer['profile']}, seed {answer['seed']}, {len(answer['scenes'])} scenes "
        f"({', '.join(answer['scenes'])}), at most {recorded['frames']} frames each, sensor {recorded['sensor']}, "
        f"hearing {recorded['hearing']}, {sounds}, {told}; {len(outcome.episodes)} episodes.\n\n"
        f"{answer['note']}\n\nPaper: {answer['paper']}\n\n"
    )
    return head + markdown(answer["tables"])
