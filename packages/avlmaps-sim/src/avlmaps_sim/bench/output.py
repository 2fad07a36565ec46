"""The output of a suite: its tables as JSON, Markdown, CSV and a picture, with everything needed to judge them."""

import csv
import io
import json
import re
import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from avlmaps.core.errors import AvlmapsError
from avlmaps.core.files import write_bytes_atomically
from avlmaps.core.version import __version__

Table = Mapping[str, Any]  # {"columns": [...], "rows": [[...]]}, and "chosen on": a sentence


class BenchError(AvlmapsError):
    """A suite cannot be run: what it measures on was not given."""


def write_answer(answer: Mapping[str, Any], out: Path, markdown_text: str | None = None) -> dict[str, Any]:
    """Write ``SUITE.json``, ``SUITE.md`` and ``SUITE-TABLE.csv`` for each table; return what the JSON file holds.

    Without a text the page holds the tables alone.
    """
    suite, tables = answer["suite"], answer["tables"]
    whole = {"avlmaps": __version__, **answer, "tables": {name: dict(table) for name, table in tables.items()}}
    out.mkdir(parents=True, exist_ok=True)
    for name, table in tables.items():
        write_bytes_atomically(out / f"{suite}-{slug(name)}.csv", as_csv(table).encode())
    write_bytes_atomically(out / f"{suite}.md", (markdown_text or markdown(tables)).encode())
    write_bytes_atomically(out / f"{suite}.json", (json.dumps(whole, indent=1) + "\n").encode())
    return whole


def slug(name: str) -> str:
    """Return a table's name as part of a file name."""
    return re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-")


def as_csv(table: Table) -> str:
    """Write one table as CSV."""
    stream = io.StringIO(newline="")
    csv.writer(stream, lineterminator="\n").writerows([table["columns"], *table["rows"]])
    return stream.getvalue()


def markdown(tables: Mapping[str, Table]) -> str:
    """Write tables as Markdown."""
    return "\n".join(f"### {name}\n\n{table_markdown(table)}" for name, table in tables.items())


def table_markdown(table: Table) -> str:
    """Write one table as Markdown, and below it which choices were made on the same data."""
    lines = [_row(table["columns"]), _row(["---"] * len(table["columns"])), *[_row(row) for row in table["rows"]]]
    chosen = table.get("chosen on", "")
    return "\n".join(lines) + "\n" + (f"\nChosen on the same data: {chosen}\n" if chosen else "")


def _row(cells: Sequence[object]) -> str:
    return "| " + " | ".join(str(cell).replace("|", "\\|") for cell in cells) + " |"


_ROW_IN, _COLUMNS = 0.26, 80  # height of a line in the picture, inches; characters of one


def _wrapped(cell: object) -> str:
    return textwrap.fill(str(cell), _COLUMNS)


def _lines(row: Sequence[str]) -> int:
    return max(cell.count("\n") + 1 for cell in row)


def draw(tables: Mapping[str, Table], path: Path) -> None:
    """Draw tables as a picture, to be pasted where Markdown is not shown."""
    from matplotlib.figure import Figure

    wrapped = {name: [[_wrapped(cell) for cell in row] for row in table["rows"]] for name, table in tables.items()}
    heights = [_ROW_IN * (1 + sum(map(_lines, rows))) + 0.6 for rows in wrapped.values()]
    figure = Figure(figsize=(12, sum(heights)))
    panes = figure.subplots(len(tables), 1, height_ratios=heights, squeeze=False)[:, 0]
    for axes, (name, table) in zip(panes, tables.items(), strict=True):
        axes.axis("off")
        axes.set_title(name, loc="left", fontsize=11, fontweight="bold")
        if not table["rows"]:
            continue
        cells = wrapped[name]
        columns = [str(column) for column in table["columns"]]
        drawn = axes.table(cells, colLabels=columns, loc="upper left", cellLoc="left")
        drawn.auto_set_font_size(False)
        drawn.set_fontsize(9)
        drawn.auto_set_column_width(list(range(len(columns))))
        for (row, _), cell in drawn.get_celld().items():
            cell.set_edgecolor("#dddddd")
            if row == 0:
                cell.set_text_props(fontweight="bold")
            else:
                cell.set_height(cell.get_height() * _lines(cells[row - 1]))
    figure.savefig(path, dpi=110, bbox_inches="tight")
