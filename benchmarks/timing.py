"""Parts that the benchmarks share: one thread, the best of repeats, a table and JSON."""

import argparse
import json
import os
import resource
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from typing import TypeVar

T = TypeVar("T")
THREAD_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


def use_one_thread() -> None:
    """Limit every library to one thread; call it before numpy is imported."""
    for variable in THREAD_VARIABLES:
        os.environ[variable] = "1"


def seconds(work: Callable[..., T], *arguments: object) -> tuple[float, T]:
    """Call once; return the seconds of processor time of this thread (waiting is not counted) and the result."""
    begin = time.thread_time()
    result = work(*arguments)
    return time.thread_time() - begin, result


def peak_bytes() -> int:
    """Return the most memory that this process has held, files that it maps included."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else peak * 1024


def parser(description: str) -> argparse.ArgumentParser:
    """Return a parser of arguments that knows ``--json``."""
    arguments = argparse.ArgumentParser(description=description)
    arguments.add_argument("--json", action="store_true", help="print one JSON object instead of a table")
    return arguments


def show(title: str, rows: Sequence[Mapping[str, object]], facts: Mapping[str, object], as_json: bool) -> None:
    """Print a table with the facts below it, or all of it as one JSON object."""
    if as_json:
        print(json.dumps({"title": title, "rows": list(rows), **facts}))
        return
    columns = list(rows[0])
    cells = [columns, *([_text(row[column]) for column in columns] for row in rows)]
    widths = [max(len(line[n]) for line in cells) for n in range(len(columns))]
    print(title)
    for line in cells:
        print("  " + "  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip())
    for name, value in facts.items():
        print(f"{name}: {_text(value)}")


def _text(value: object) -> str:
    if isinstance(value, float):
        return f"{value:.2f}" if abs(value) < 100 else f"{value:,.0f}"
    return f"{value:,}" if isinstance(value, int) else str(value)
