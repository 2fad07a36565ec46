"""The paper's own figures, to stand beside ours."""

import json
from functools import cache
from importlib.resources import files
from typing import Any


@cache
def paper_figures(suite: str) -> dict[str, Any]:
    """Return the figures that the paper gives for a suite (``indexing``, ``navigation``), and where they are from."""
    return json.loads((files("avlmaps_sim.bench") / "data" / f"paper_{suite}.json").read_text(encoding="utf-8"))


def paper_source(suite: str) -> str:
    """Return where the figures are from, and what to know about them, in sentences."""
    figures = paper_figures(suite)
    return f"{figures['source']}. {figures['note']}"
