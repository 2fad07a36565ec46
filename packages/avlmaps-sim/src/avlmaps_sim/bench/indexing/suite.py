"""The suite as ``avlmaps bench indexing`` runs it: tables as JSON, Markdown and a picture, and every answer."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec

from avlmaps.core.files import write_bytes_atomically
from avlmaps_sim.bench.harness.paper import paper_source
from avlmaps_sim.bench.harness.provenance import in_words, provenance
from avlmaps_sim.bench.indexing.runs import IndexingSettings, Outcome, run
from avlmaps_sim.bench.indexing.tables import tables
from avlmaps_sim.bench.output import markdown, write_answer

if TYPE_CHECKING:
    pass


NOTE = (
    "An answer is the first goal. Its distance is horizontal, to the nearest point of the box round the right thing, "
    "or to where the robot was while the right sound was heard; "
    "no answer counts as the largest distance in the scene. Intervals are 95 %: Wilson's for recalls, bootstrapped for "
    "means, both over tasks as if each stood for itself."
)


def run_indexing(settings: IndexingSettings | None, out: Path) -> dict[str, Any]:
    """Run the benchmark; write its tables (JSON, Markdown, CSV), and ``indexing_answers.json``.

    Recordings, maps, tasks and answers stay in the folder ``work`` of ``out``.
    """
    settings = settings or IndexingSettings()
    outcome = run(settings, out / "work")
    answer = {
        "suite": "indexing",
        **provenance(settings, outcome.tasks.recorded, outcome.tasks.scenes, outcome.weights),
        "note": NOTE,
        "paper": paper_source("indexing"),
        "tables": tables(outcome),
    }
    page = f"# Cross-modal indexing\n\n{in_words(answer)}\n\n{NOTE}\n\nPaper: {answer['paper']}\n\n"
    written = write_answer(answer, out, page + markdown(answer["tables"]))
    write_bytes_atomically(out / "indexing_answers.json", _answers(outcome))
    return written


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
