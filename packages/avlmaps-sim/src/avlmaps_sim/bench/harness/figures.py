"""Figures as they are printed: tables with origin, 95 % intervals, the paper's own figures beside them."""

import csv
import io
import json
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from importlib.resources import files
from pathlib import Path, PurePath
from typing import Any

import msgspec
import numpy as np
from jaxtyping import Float

from avlmaps.core.errors import AvlmapsError
from avlmaps.core.files import write_bytes_atomically
from avlmaps.core.version import __version__
from avlmaps_sim.bench.harness.settings import Recorded, SceneSettings


@cache
def paper_figures(suite: str) -> dict[str, Any]:
    """Return the figures that the paper gives for a suite (``indexing``, ``navigation``), and where they are from."""
    return json.loads((files("avlmaps_sim.bench") / "data" / f"paper_{suite}.json").read_text(encoding="utf-8"))


def paper_source(suite: str) -> str:
    """Return where the figures are from, and what to know about them, in sentences."""
    figures = paper_figures(suite)
    return f"{figures['source']}. {figures['note']}"


_Z = 1.959964  # of the normal distribution, two-sided 95 %


def wilson(hits: int, count: int) -> tuple[float, float]:
    """Return the 95 % interval of a share after Wilson (1927), within [0, 1]; all of it where nothing was counted."""
    if count == 0:
        return 0.0, 1.0
    share, square = hits / count, _Z * _Z
    middle = (share + square / (2 * count)) / (1 + square / count)
    half = _Z / (1 + square / count) * math.sqrt(share * (1 - share) / count + square / (4 * count * count))
    return max(0.0, middle - half), min(1.0, middle + half)


def of_mean(shares: Float[np.ndarray, " n"]) -> tuple[float, float]:
    """Return the 95 % interval of the mean of shares, by the normal; all of [0, 1] for fewer than two.

    For what is alike within a group, such as the pixels of a frame or the voxels of a thing: each group counts once.
    """
    if len(shares) < 2:
        return 0.0, 1.0
    half = 1.96 * float(shares.std(ddof=1)) / math.sqrt(len(shares))
    return max(0.0, float(shares.mean()) - half), min(1.0, float(shares.mean()) + half)


def median_interval(values: Float[np.ndarray, " n"]) -> tuple[float, float, float]:
    """Return the median and its 95 % interval, by the ranks between which it lies."""
    ordered = np.sort(values)
    half = 0.98 * np.sqrt(len(ordered))
    low = int(max(0, np.floor(len(ordered) / 2 - half)))
    high = int(min(len(ordered) - 1, np.ceil(len(ordered) / 2 + half)))
    return float(np.median(ordered)), float(ordered[low]), float(ordered[high])


def in_percent(interval: tuple[float, float]) -> str:
    """Return an interval of a share as tables show it: "48.7 to 67.0"."""
    low, high = interval
    return f"{100 * low:.1f} to {100 * high:.1f}"


def poisson(count: int) -> tuple[float, float]:
    """Return the exact 95 % interval of the mean of a Poisson count."""
    from scipy.special import gammaincinv

    low = float(gammaincinv(count, 0.025)) if count else 0.0
    return low, float(gammaincinv(count + 1, 0.975))


# Each choice, and the scenes that decided it.
_CHOICES: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("the weight by distance in fusion", ("house:1000000:held-out",)),
    (
        "how far a view's vote spreads (RoomSettings.views_m), the limits of unsure instances (ObjectSettings."
        "least_in_company, score_in_company) and the settings of photos by colour (PhotometricSettings)",
        tuple(f"house:{seed}:held-out" for seed in range(1_000_000, 1_000_005)),
    ),
    (
        "which of three sets of pixel weights ships",
        tuple(f"house:{seed}:held-out" for seed in range(1_000_000, 1_000_010)),
    ),
)


def chosen_on(scenes: Sequence[str]) -> str:
    """Return one sentence on the choices that scenes of a table decided; ``""`` where they decided none."""
    parts = [
        f"{choice} (on {sum(scene in deciding for scene in scenes)} of the {len(scenes)} scenes)"
        for choice, deciding in _CHOICES
        if any(scene in deciding for scene in scenes)
    ]
    return "; ".join(parts) + "." if parts else ""


_SHOWN = 12  # of a checksum


def provenance(
    settings: SceneSettings, recorded: Recorded, scenes: Sequence[str], weights: Mapping[str, str]
) -> dict[str, Any]:
    """Return the provenance that a suite on scenes writes beside its tables."""
    return {
        "scenes": [shown_scene(scene) for scene in scenes],
        "profile": settings.profile,
        "models": list(settings.models),
        "rules": settings.rules,
        "seed": recorded.seed,
        "recorded": msgspec.to_builtins(recorded),
        "weights": dict(weights),
    }


def shown_scene(spec: str) -> str:
    """Return a scene's name for tables: of a file or folder its own name, never the place on this machine."""
    return PurePath(spec).name if "/" in spec or "\\" in spec else spec


def clip_table(clips: Iterable[tuple[str, str]]) -> dict[str, Any]:
    """Return the table of the clips that were heard: sound, number of times, names of the files."""
    named: dict[str, list[str]] = {}
    for sound, clip in clips:
        named.setdefault(sound, []).append(PurePath(clip).name)
    rows = [[sound, len(own), ", ".join(sorted(set(own)))] for sound, own in sorted(named.items())]
    return {"columns": ["sound", "times", "clips"], "rows": rows}


def in_words(answer: Mapping[str, Any]) -> str:
    """Return the provenance of an answer as one paragraph."""
    models = f" with {', '.join(answer['models'])}" if answer.get("models") else ""
    recorded = answer.get("recorded")
    parts = [f"Encoders {answer['profile']}{models}", f"rules {answer.get('rules', 'ours')}", f"seed {answer['seed']}"]
    if answer.get("scenes"):
        count = len(answer["scenes"])
        parts.append(f"{count} scene{'s' if count > 1 else ''} ({', '.join(answer['scenes'])})")
    if recorded:
        parts += [
            f"at most {recorded['frames']} frames each",
            f"sensor {recorded['sensor']}",
            f"hearing {recorded['hearing']}",
            _sounds(recorded),
        ]
    parts.append(f"weights {weights_in_words(answer.get('weights', {}))}")
    return "; ".join(parts) + "."


def _sounds(recorded: Mapping[str, Any]) -> str:
    if not recorded["sounds"]:
        return "sounds made by the rules that also made training sounds of the embedded encoder"
    if recorded.get("clips") == "unheard":
        return f"recorded clips of {recorded['sounds']} that the embedded sound encoder was not trained on"
    return f"recorded clips of {recorded['sounds']}"


def weights_in_words(weights: Mapping[str, str]) -> str:
    """Return modules and the first digits of their models' checksums."""
    return ", ".join(f"{module} {checksum[:_SHOWN]}" for module, checksum in sorted(weights.items())) or "not recorded"


def outdated(weights: Mapping[str, str], shipped: Mapping[str, str]) -> list[str]:
    """Return the modules whose weights a table was measured with are not those that ship."""
    return sorted(module for module, checksum in weights.items() if shipped.get(module) != checksum)


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
