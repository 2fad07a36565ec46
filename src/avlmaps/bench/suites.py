"""The suites behind `avlmaps bench`: run one, write its tables as JSON, Markdown and a picture."""

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from avlmaps.core.errors import AvlmapsError, RecordingError
from avlmaps.core.files import write_bytes_atomically

Table = Mapping[str, Any]  # {"columns": [...], "rows": [[...]]}


class BenchError(AvlmapsError):
    """A suite cannot be run: what it measures on was not given."""


def run_suite(
    suite: str, *, sounds: Path | None = None, recording: Path | None = None, out: Path, seed: int = 0
) -> dict[str, Any]:
    """Run a suite and write SUITE.json, SUITE.md and SUITE.png into ``out``.

    Args:
        suite: ``words``, ``sounds``, ``segmentation`` or ``locate``.
        sounds: folder of clips with an index.csv, for the suites of sound.
        recording: recording with poses, for ``locate``.
        out: folder to write into.
        seed: of what is drawn at random.

    Raises:
        BenchError: the folder or recording that the suite needs was not given.
    """
    tables = _SUITES[suite](sounds, recording, seed)
    scenes = [str(source.name) for source in (sounds, recording) if source is not None]
    answer = {"suite": suite, "scenes": scenes, "seed": seed, "tables": {k: dict(v) for k, v in tables.items()}}
    out.mkdir(parents=True, exist_ok=True)
    write_bytes_atomically(out / f"{suite}.json", (json.dumps(answer, indent=1) + "\n").encode())
    write_bytes_atomically(out / f"{suite}.md", markdown(tables).encode())
    draw(tables, out / f"{suite}.png")
    return answer


def _words(sounds: Path | None, recording: Path | None, seed: int) -> dict[str, Table]:
    from avlmaps.bench import words

    return {"words kept out of training": words.run()}


def _sounds(sounds: Path | None, recording: Path | None, seed: int) -> dict[str, Table]:
    from avlmaps.bench import sounds as suite

    return suite.run(_given(sounds, "--sounds", "a folder of clips with an index.csv"))


def _segmentation(sounds: Path | None, recording: Path | None, seed: int) -> dict[str, Table]:
    from avlmaps.bench import segmentation

    return {"segmentation": segmentation.run(_given(sounds, "--sounds", "a folder of clips with an index.csv"), seed)}


def _locate(sounds: Path | None, recording: Path | None, seed: int) -> dict[str, Table]:
    from avlmaps.bench import locate
    from avlmaps.recordings.open import open_recording

    path = _given(recording, "--recording", "a recording with poses")
    opened = open_recording(path)
    if len(opened) < 20:
        raise RecordingError(f"{path} has {len(opened)} frames; half of them as map and half as photos takes 20.")
    return {"locating photos": locate.run(opened, seed)}


_SUITES: dict[str, Callable[[Path | None, Path | None, int], dict[str, Table]]] = {
    "words": _words,
    "sounds": _sounds,
    "segmentation": _segmentation,
    "locate": _locate,
}


def _given(path: Path | None, flag: str, what: str) -> Path:
    if path is None:
        raise BenchError(f"This suite measures on {what}; name it with {flag}.")
    return path


def markdown(tables: Mapping[str, Table]) -> str:
    """Write tables as Markdown."""
    blocks: list[str] = []
    for name, table in tables.items():
        lines = [_row(table["columns"]), _row(["---"] * len(table["columns"])), *[_row(row) for row in table["rows"]]]
        blocks.append(f"### {name}\n\n" + "\n".join(lines) + "\n")
    return "\n".join(blocks)


def _row(cells: Sequence[object]) -> str:
    return "| " + " | ".join(str(cell).replace("|", "\\|") for cell in cells) + " |"


def draw(tables: Mapping[str, Table], path: Path) -> None:
    """Draw tables as a picture, to be pasted where Markdown is not shown."""
    from matplotlib.figure import Figure

    heights = [0.35 * (len(table["rows"]) + 1) + 0.6 for table in tables.values()]
    figure = Figure(figsize=(12, sum(heights)), layout="constrained")
    panes = figure.subplots(len(tables), 1, height_ratios=heights, squeeze=False)[:, 0]
    for axes, (name, table) in zip(panes, tables.items(), strict=True):
        axes.axis("off")
        axes.set_title(name, loc="left", fontsize=11, fontweight="bold")
        if not table["rows"]:
            continue
        cells = [[str(cell) for cell in row] for row in table["rows"]]
        drawn = axes.table(cells, colLabels=[str(column) for column in table["columns"]], loc="center", cellLoc="left")
        drawn.auto_set_font_size(False)
        drawn.set_fontsize(9)
        drawn.auto_set_column_width(list(range(len(table["columns"]))))
        for (row, _), cell in drawn.get_celld().items():
            cell.set_edgecolor("#dddddd")
            if row == 0:
                cell.set_text_props(fontweight="bold")
    figure.savefig(path, dpi=110)
