"""Accuracy of the embedded sound encoder: its cross-validation, and the shipped weights on other recordings.

The shipped weights were trained on every fold of ESC-10, so those clips say nothing about them. The tables whose names
begin with "cross-validation" were written when the weights were made (``training/sounds``), by networks that were not
trained on the clips of the tables; the others are measured when the suite runs, on clips that no network has seen.
"""

import json
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
from jaxtyping import Float32

from avlmaps.core.errors import AudioError
from avlmaps.perception.embedded.sounds import EmbeddedSounds
from avlmaps.recordings.audio import AudioTrack, Sound
from avlmaps_sim.bench.sound_clips import kind_names, read_clips

Table = dict[str, list[Any]]


def run(sounds_folder: Path) -> dict[str, Table]:
    """Return every table, ``{name: {"columns", "rows"}}``.

    Args:
        sounds_folder: a folder of clips with an ``index.csv`` (path, category ...); clips that the weights were
            fitted to do not count.

    Raises:
        AudioError: there is no index, or no clip that the weights were not fitted to.
    """
    encoder = EmbeddedSounds()
    clips = [clip for clip in read_clips(sounds_folder, encoder) if not clip.heard]
    if not clips:
        raise AudioError(f"The weights were fitted to every clip of {sounds_folder}; give clips of other recordings.")
    features = [encoder.encode(AudioTrack.open(clip.path).read()) for clip in clips]
    return {
        **cross_validation(),
        "other recordings, shipped weights": others_table(encoder, features, [clip.category for clip in clips]),
        "speed on one core": speed_table(encoder),
    }


def cross_validation() -> dict[str, Table]:
    """Return the tables that were written when the weights were made."""
    text = (files("avlmaps_sim.bench") / "data" / "sounds_crossvalidation.json").read_text(encoding="utf-8")
    return {f"cross-validation: {name}": table for name, table in json.loads(text)["tables"].items()}


def others_table(
    encoder: EmbeddedSounds, features: Sequence[Float32[np.ndarray, "windows d"]], categories: Sequence[str]
) -> Table:
    """Return for every category of the other recordings what the shipped weights make of them.

    Refused is a clip of which no question by any kind's name is answered by yes.
    """
    origins = {kind.name: kind.origin for kind in encoder.kinds}
    kinds = kind_names(encoder)
    names = [kind.called[0] for kind in encoder.kinds]
    rows = []
    for category in sorted(set(categories)):
        mine = [f for f, c in zip(features, categories, strict=True) if c == category]
        scores = encoder.score_words(mine, names)
        refused = int((scores.max(axis=1) < 0.5).sum())
        kind = kinds.get(category, "")
        order = [[encoder.kinds[k].name for k in likeliest] for likeliest in np.argsort(-scores, axis=1)]
        first = sum(names[0] == kind for names in order)
        five = sum(kind in names[:5] for names in order)
        rows.append([
            category, kind or "-", origins.get(kind, "unknown to it"), len(mine),
            first if kind else "-", five if kind else "-",
            refused, ", ".join(sorted({names[0] for names in order})),
        ])  # fmt: skip
    columns = ["category", "our kind", "learnt from", "clips", "first", "among five", "refused", "taken for"]
    return {"columns": columns, "rows": [*rows, *_sums(rows)]}


def _sums(rows: list[list[Any]]) -> list[list[Any]]:
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
