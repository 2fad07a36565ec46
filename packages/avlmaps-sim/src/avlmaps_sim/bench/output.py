"""The output of a suite: its tables as JSON, Markdown, CSV and a picture, with everything needed to judge them."""

import csv
import io
import json
import re
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
