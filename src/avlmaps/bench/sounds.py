"""What the embedded sound encoder can do: figures of its cross-validation, and the shipped weights on other recordings.

The shipped weights have heard every fold of ESC-10, so those clips say nothing about them. The tables whose names
begin with "cross-validation" were written when the weights were made (``training/sounds``), by networks that had not
heard the clips they were asked about; the others are measured when the suite runs, on clips that no network heard.
"""

import json
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
from jaxtyping import Float32

from avlmaps.bench.harness.clips import unheard_rows
from avlmaps.perception.embedded.sounds import EmbeddedSounds
from avlmaps.recordings.audio import AudioTrack, Sound

Table = dict[str, list[Any]]

# What the index of the other clips calls things, and the kind that we know them as; the rest are unknown to us.
KINDS_OF_OTHERS = {
    "applause": "clapping",
    "car engine": "car engine",
    "chirping birds": "birds chirping",
    "clock alarm": "alarm clock",
    "crackling fire": "crackling fire",
    "crowd cheering": "crowd cheering",
    "door open close": "door opening or closing",
    "door wood creaks": "creaking door",
    "door wood knock": "door knock",
    "drinking sipping": "drinking or sipping",
    "engine": "car engine",
    "footsteps gravel": "footsteps",
    "footsteps hard": "footsteps",
    "footsteps metal": "footsteps",
    "footsteps wood": "footsteps",
    "glass breaking": "glass breaking",
    "insects": "buzzing insects",
    "keyboard typing": "keyboard typing",
    "piano": "piano",
    "rain": "rain",
    "running water": "running water",
    "snoring": "snoring",
    "thunder": "thunder",
    "train": "train",
    "wood chop": "chopping wood",
}


def run(sounds_folder: Path) -> dict[str, Table]:
    """Return every table, ``{name: {"columns", "rows"}}``.

    Args:
        sounds_folder: a folder of clips with an ``index.csv`` (path, category, fold ...); clips without a fold count.

    Raises:
        AudioError: there is no index, or no clip without a fold.
    """
    encoder = EmbeddedSounds()
    clips = [(row["path"], row["category"]) for row in unheard_rows(sounds_folder)]
    features = [encoder.encode(AudioTrack.open(sounds_folder / path).read()) for path, _ in clips]
    return {
        **cross_validation(),
        "other recordings, shipped weights": others_table(encoder, features, [category for _, category in clips]),
        "speed on one core": speed_table(encoder),
    }


def cross_validation() -> dict[str, Table]:
    """Return the tables that were written when the weights were made."""
    text = (files("avlmaps.bench") / "data" / "sounds_crossvalidation.json").read_text(encoding="utf-8")
    return {f"cross-validation: {name}": table for name, table in json.loads(text)["tables"].items()}


def others_table(
    encoder: EmbeddedSounds, features: Sequence[Float32[np.ndarray, "windows d"]], categories: Sequence[str]
) -> Table:
    """Return for every category of the other recordings what the shipped weights make of them.

    Refused is a clip of which no question by any kind's name is answered by yes.
    """
    origins = {kind.name: kind.origin for kind in encoder.kinds}
    names = [kind.called[0] for kind in encoder.kinds]
    ours = {word: kind.name for kind in encoder.kinds for word in (*kind.called, kind.name)} | KINDS_OF_OTHERS
    rows = []
    for category in sorted(set(categories)):
        mine = [f for f, c in zip(features, categories, strict=True) if c == category]
        heard = [encoder.describe(f) for f in mine]
        refused = int((encoder.score_words(mine, names).max(axis=1) < 0.5).sum())
        kind = ours.get(category, "")
        order = [[encoder.kinds[k].name for k in np.argsort(-h.kinds[: len(encoder.kinds)])] for h in heard]
        first = sum(names[0] == kind for names in order)
        five = sum(kind in names[:5] for names in order)
        rows.append([
            category, kind or "-", origins.get(kind, "unknown to it"), len(heard),
            first if kind else "-", five if kind else "-",
            refused, ", ".join(sorted({names[0] for names in order})),
        ])  # fmt: skip
    columns = ["category", "our kind", "learnt from", "clips", "first", "among five", "refused", "taken for"]
    return {"columns": columns, "rows": [*rows, *_sums(rows)]}


def _sums(rows: list[list[Any]]) -> list[list[Any]]:
    """Return a line for each origin."""
    sums = []
    for origin in ("recorded", "synthesised", "unknown to it"):
        mine = [row for row in rows if row[2] == origin]
        if mine:
            known = origin != "unknown to it"
            counts = [sum(row[k] for row in mine) if known or k == 6 else "-" for k in (4, 5, 6)]
            sums.append(["in all", "", origin, sum(row[3] for row in mine), *counts, ""])
    return sums


def speed_table(encoder: EmbeddedSounds, seconds: float = 60.0) -> Table:
    """Time the encoder on noise, once warm: how many seconds of sound it takes in a second of one core."""
    rng = np.random.default_rng(0)
    rows = []
    for rate_hz in (22_050, 44_100, 48_000):
        sound = Sound(0.1 * rng.standard_normal(int(seconds * rate_hz)).astype(np.float32), rate_hz)
        encoder.encode(sound)
        start = process_time()
        encoder.encode(sound)
        took_s = process_time() - start
        rows.append([f"{rate_hz} Hz", seconds, round(took_s * 1e3, 1), round(seconds / took_s)])
    return {"columns": ["sound", "seconds", "ms", "times real time"], "rows": rows}
