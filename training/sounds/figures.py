"""The tables of the cross-validation, from features of clips that the networks were not trained on."""

from collections import Counter
from collections.abc import Sequence
from itertools import product
from typing import Any

import numpy as np
from training.sounds.calibrate import Evidence, heard_kinds, matching_odds
from training.sounds.crossvalidate import LEFT_OUT, ROOM_S, Answers, Held
from training.sounds.fit import EncodeWords
from training.sounds.kinds import CALLED, ESC10, KINDS, NAMES, RECORDED

from avlmaps.perception.embedded.sounds import SoundCalibration, log_odds, sigmoid
from avlmaps_sim.bench.harness.figures import wilson

Table = dict[str, Any]
FIFTY = [KINDS[name][0] for name in RECORDED]


def share(hits: np.ndarray) -> list[Any]:
    """Return cells: hits, count, per cent, and the 95 % interval after Wilson."""
    found, count = int(hits.sum()), int(hits.size)
    low, high = wilson(found, count)
    return [found, count, round(100.0 * found / max(count, 1), 1), f"{100 * low:.1f}-{100 * high:.1f}"]


def scores(heard: Evidence, phrases: Sequence[str], encode: EncodeWords, c: SoundCalibration) -> np.ndarray:
    """Return how likely each clip is what each phrase names."""
    bias, slope = c.word
    return sigmoid(bias + slope * matching_odds(heard, phrases, encode, c))


def words_table(answers: Answers, encode: EncodeWords, c: SoundCalibration) -> Table:
    """Return the questions by words: household clips, and those of ESC-10, among fifty names."""
    rows, held = [], answers.held
    rooms = (("dry", held.dry), (f"RT60 {ROOM_S} s, 4 m", held.wet), ("pieces in rooms and noise", held.pieces))
    groups = (("household", held.kinds >= len(ESC10)), ("ESC-10", held.kinds < len(ESC10)))
    for (group, mine), (room, heard) in product(groups, rooms):
        kinds = held.kinds[mine]
        right = kinds[:, None] == np.arange(len(FIFTY))[None, :]
        found = scores(heard, FIFTY, encode, c)[mine]
        every = scores(heard, CALLED, encode, c)[mine]
        rows += [
            [group, room, f"right name first among {len(FIFTY)} names", *share(found.argmax(axis=1) == kinds)],
            [group, room, f"right name first among all {len(CALLED)}", *share(every.argmax(axis=1) == kinds)],
            [group, room, "right kind says yes", *share(found[right] >= 0.5)],
            [group, room, "another kind says yes", *share(found[~right] >= 0.5)],
            [group, room, "some other kind says yes, of clips", *share(((found >= 0.5) & ~right).any(axis=1))],
            [group, room, "median score of the right kind", "", "", round(float(np.median(found[right])), 2), ""],
        ]
    return {"columns": ["clips", "room", "question", "hits", "of", "%", "95 %"], "rows": rows}


def kinds_table(held: Held, learnt: dict[str, int], encode: EncodeWords, c: SoundCalibration) -> Table:
    """Return for every recorded kind how many clips it was learnt from and how its held-out clips fare."""
    found = scores(held.dry, FIFTY, encode, c)
    order = np.argsort(-found, axis=1)
    rows = []
    for k in np.unique(held.kinds):
        mine = held.kinds == k
        wrong = Counter(NAMES[o] for o in order[mine, 0] if o != k)
        rows.append([
            NAMES[k], learnt[NAMES[k]], len(np.unique(held.sources[mine])), int(mine.sum()),
            int((order[mine, 0] == k).sum()), int((order[mine, :5] == k).any(axis=1).sum()),
            int((found[mine, k] >= 0.5).sum()),
            ", ".join(f"{name} {count}" for name, count in wrong.most_common()) or "-",
        ])  # fmt: skip
    columns = ["kind", "learnt from clips", "recordings", "clips held out", "first", "among five", "yes", "taken for"]
    return {"columns": columns, "rows": rows}


def area_under_curve(known: np.ndarray, unknown: np.ndarray) -> tuple[float, float, float]:
    """Return the area under the ROC curve and its 95 % interval (Hanley and McNeil 1982).

    Args:
        known: scores that should be high.
        unknown: scores that should be low.
    """
    order = np.sort(known)
    below = np.searchsorted(order, unknown, side="right") / len(known)
    level = np.searchsorted(order, unknown, side="left") / len(known)
    area = float(1.0 - (below + level).mean() / 2.0)
    q1, q2 = area / (2.0 - area), 2.0 * area**2 / (1.0 + area)
    m, n = len(known), len(unknown)
    spread = (area * (1 - area) + (m - 1) * (q1 - area**2) + (n - 1) * (q2 - area**2)) / (m * n)
    half = 1.96 * float(np.sqrt(max(spread, 0.0)))
    return area, max(0.0, area - half), min(1.0, area + half)


def refusal_table(answers: Answers, c: SoundCalibration) -> Table:
    """Return how well unknown clips are separated from known ones, by the score of the most likely recorded kind.

    Strangers are clips of ten kinds that one network was fitted without.
    """
    bias, slope = c.word
    rows = []
    for room, where in (("dry", "dry"), ("wet", f"RT60 {ROOM_S} s, 4 m"), ("pieces", "pieces in rooms and noise")):
        known, strange = (
            heard_kinds(getattr(held, room), c)[:, : len(RECORDED)].max(axis=1)
            for held in (answers.peers, answers.strangers)
        )
        area, low, high = area_under_curve(known, strange)
        yes, no = bias + slope * log_odds(known) >= 0.0, bias + slope * log_odds(strange) < 0.0
        shares = [round(100.0 * float(part.mean()), 1) for part in (yes, no)]
        rows.append([where, len(known), len(strange), round(area, 3), f"{low:.3f}-{high:.3f}", *shares])
    columns = ["room", "clips", "strangers", "AUC", "95 %", "yes to known %", "no to strangers %"]
    return {"columns": columns, "rows": rows}


def taught_table(answers: Answers, c: SoundCalibration) -> Table:
    """Return how well kinds are found that a network was fitted without and that were taught from a few clips.

    The clips to find are of other sources than those that taught. Twenty lessons a kind, drawn by seed.
    """
    rows = []
    bias, slope = c.taught
    for clips in (1, 3, 5):
        given = [lesson for lesson in answers.lessons(clips) if lesson.right.any()]
        areas = [area_under_curve(g.lead[g.right], g.lead[~g.right])[0] for g in given]
        own = np.concatenate([g.lead[g.right] for g in given])
        others = np.concatenate([g.lead[~g.right] for g in given])
        at_five = float(np.quantile(others, 0.95))
        rows.append([
            clips, len({g.kind for g in given}), len(given), round(float(np.mean(areas)), 3),
            round(100.0 * float((bias + slope * own >= 0.0).mean()), 1),
            round(100.0 * float((bias + slope * others >= 0.0).mean()), 1),
            round(100.0 * float((own > at_five).mean()), 1),
        ])  # fmt: skip
    columns = [
        "taught from clips", "kinds", "lessons", "mean AUC", "yes to its own %", "yes to others %",
        "recall at 5 % false alarms",
    ]  # fmt: skip
    return {"columns": columns, "rows": rows}


def all_tables(answers: Answers, learnt: dict[str, int], encode: EncodeWords, c: SoundCalibration) -> dict[str, Table]:
    """Return every table of figures."""
    return {
        "asked by words": words_table(answers, encode, c),
        "each recorded kind": kinds_table(answers.held, learnt, encode, c),
        f"refusing {len(LEFT_OUT)} kinds left out of training": refusal_table(answers, c),
        "taught kinds, those left out": taught_table(answers, c),
    }
