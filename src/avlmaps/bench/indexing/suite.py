"""The suite as ``avlmaps bench indexing`` runs it: tables as JSON, Markdown and a picture, and every answer."""

import json
from pathlib import Path
from typing import Any

import msgspec

from avlmaps.bench.indexing.picture import draw_recalls
from avlmaps.bench.indexing.runs import IndexingSettings, Outcome, run
from avlmaps.bench.indexing.tables import paper_figures, tables
from avlmaps.bench.suites import markdown
from avlmaps.core.files import write_bytes_atomically

NOTE = (
    "An answer is the first goal. Its distance is horizontal, to the nearest point of the box round the right thing; "
    "no answer counts as the largest distance in the scene. Intervals are 95 %: Wilson's for recalls, bootstrapped for "
    "means, both over tasks as if each stood for itself."
)


def run_indexing(settings: IndexingSettings | None, out: Path) -> dict[str, Any]:
    """Run the benchmark and write ``indexing.json``, ``.md``, ``.png`` and ``indexing_answers.json`` into a folder.

    Recordings and maps are kept in its folder ``work``.
    """
    settings = settings or IndexingSettings()
    outcome = run(settings, out / "work")
    made = tables(outcome)
    answer = {
        "suite": "indexing",
        "scenes": list(outcome.tasks.scenes),
        "profile": settings.profile,
        "seed": outcome.tasks.recorded.seed,
        "recorded": msgspec.to_builtins(outcome.tasks.recorded),
        "note": NOTE,
        "paper": paper_figures()["source"] + ". " + paper_figures()["note"],
        "tables": made,
    }
    out.mkdir(parents=True, exist_ok=True)
    write_bytes_atomically(out / "indexing.json", (json.dumps(answer, indent=1) + "\n").encode())
    write_bytes_atomically(out / "indexing_answers.json", _answers(outcome))
    write_bytes_atomically(out / "indexing.md", _markdown(answer).encode())
    draw_recalls(outcome, out / "indexing.png")
    return answer


def _answers(outcome: Outcome) -> bytes:
    """Return every answer beside its task, to look into failures."""
    by_task: dict[str, list[Any]] = {}
    for scene in outcome.scenes:
        for given in scene.answers:
            by_task.setdefault(given.task, []).append(
                {
                    "configuration": given.configuration,
                    "position": given.position,
                    "off_m": round(given.off_m, 3),
                    "centre_off_m": round(given.centre_m, 3),
                }
            )
    listed = [
        {"task": task.name, "asked": task.sentence, "rivals": task.rivals, "answers": by_task.get(task.name, [])}
        for task in outcome.tasks.tasks
    ]
    return msgspec.json.format(msgspec.json.encode(listed), indent=1) + b"\n"


def _markdown(answer: dict[str, Any]) -> str:
    recorded = answer["recorded"]
    sounds = f"clips of {recorded['sounds']}" if recorded["sounds"] else "sounds made by rule"
    head = (
        f"# Cross-modal indexing\n\nProfile {answer['profile']}, seed {answer['seed']}, {len(answer['scenes'])} scenes "
        f"({', '.join(answer['scenes'])}), at most {recorded['frames']} frames each, sensor {recorded['sensor']}, "
        f"hearing {recorded['hearing']}, {sounds}.\n\n{answer['note']}\n\nPaper: {answer['paper']}\n\n"
    )
    return head + markdown(answer["tables"])
