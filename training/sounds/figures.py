"""The tables of the cross-validation, from features of clips that the networks had not heard."""

import csv
from collections.abc import Sequence
from importlib.resources import files
from typing import Any

import numpy as np
from training.sounds.calibrate import Evidence, fit_pairs, heard_kinds, matching_odds, pair_features
from training.sounds.crossvalidate import Stranger
from training.sounds.fit import EncodeWords
from training.sounds.kinds import KINDS, RECORDED

from avlmaps.bench.harness.intervals import wilson
from avlmaps.perception.embedded.sound_calibration import Calibration, log_odds, same_kind

DRAWS = 50
Table = dict[str, Any]


def read_paraphrases() -> list[list[str]]:
    """Return sets of phrases, one for each recorded kind in their order; none was used in training."""
    text = (files("avlmaps.bench") / "data" / "sounds_paraphrases.csv").read_text(encoding="utf-8")
    of_kind: dict[str, list[str]] = {name: [] for name in RECORDED}
    for row in csv.DictReader(text.splitlines()):
        of_kind[row["kind"]].append(row["phrase"])
    return [list(phrases) for phrases in zip(*of_kind.values(), strict=True)]


def share(hits: int, count: int) -> list[Any]:
    """Return cells: hits, count, per cent, and the 95 % interval after Wilson."""
    low, high = wilson(hits, count)
    return [hits, count, round(100.0 * hits / count, 1), f"{100 * low:.1f}-{100 * high:.1f}"]


def first_by_words(
    heard: Evidence, kinds: np.ndarray, phrases: Sequence[str], encode: EncodeWords, c: Calibration
) -> np.ndarray:
    """Tell for each clip whether the right one of ten phrases ranks first."""
    return matching_odds(heard, phrases, encode, c).argmax(axis=1) == kinds


def words_table(
    held_out: dict[str, Evidence], kinds: np.ndarray, encode: EncodeWords, c: Calibration
) -> tuple[Table, Table]:
    """Return the questions by words under every condition: in all, and for every kind."""
    names = [KINDS[name][0] for name in RECORDED]
    right = {condition: first_by_words(found, kinds, names, encode, c) for condition, found in held_out.items()}
    sets = [first_by_words(held_out["clean"], kinds, phrases, encode, c) for phrases in read_paraphrases()]
    right["paraphrases, clean"] = np.stack(sets, axis=1)
    noisy = [first_by_words(held_out["pink 10 dB"], kinds, phrases, encode, c) for phrases in read_paraphrases()]
    right["paraphrases, pink 10 dB"] = np.stack(noisy, axis=1)
    rows = [[condition, *share(int(hits.sum()), hits.size)] for condition, hits in right.items()]
    overall = {"columns": ["asked by", "first", "of", "%", "95 %"], "rows": rows}
    columns = ["kind", "clips", *(f"{condition} %" for condition in right), "clean 95 %", "taken for"]
    by_kind = []
    answers = matching_odds(held_out["clean"], names, encode, c).argmax(axis=1)
    for k, name in enumerate(RECORDED):
        mine = kinds == k
        wrong = [list(RECORDED)[a] for a in answers[mine] if a != k]
        confusions = ", ".join(f"{w} {wrong.count(w)}" for w in sorted(set(wrong), key=wrong.count, reverse=True))
        cells = [round(100.0 * float(hits[mine].mean()), 1) for hits in right.values()]
        interval = share(int(right["clean"][mine].sum()), int(mine.sum()))[3]
        by_kind.append([name, int(mine.sum()), *cells, interval, confusions or "-"])
    return overall, {"columns": columns, "rows": by_kind}


def clips_table(heard: Evidence, kinds: np.ndarray, folds: np.ndarray, c: Calibration) -> Table:
    """Return the questions by a clip.

    Each clip of the fold that was kept out asks for its kind among one other clip of every kind, drawn from the same
    fold by seed; the last constants are fitted on the three other folds. Ranked by the score, and by the cosine alone.
    """
    rng = np.random.default_rng(0)
    pairs = pair_features(heard, c)
    counts = {"score": [0, 0], "cosine": [0, 0], "score, all": [0, 0], "cosine, all": [0, 0]}
    by_kind = np.zeros((len(RECORDED), 2), int)
    for fold in np.unique(folds):
        others = folds != fold
        fitted = fit_pairs(heard.at(others), kinds[others], folds[others], c)
        rows = np.flatnonzero(folds == fold)
        scores = {
            "score": same_kind(pairs[:, :, 0], pairs[:, :, 1], fitted),
            "cosine": pairs[:, :, 0],
        }
        for row in rows:
            rest = rows[rows != row]
            for way, score in scores.items():
                nearest = rest[int(score[row, rest].argmax())]
                counts[f"{way}, all"][0] += int(kinds[nearest] == kinds[row])
                counts[f"{way}, all"][1] += 1
            for _ in range(DRAWS):
                drawn = np.array([rng.choice(rest[kinds[rest] == k]) for k in range(len(RECORDED))])
                for way, score in scores.items():
                    hit = int(score[row, drawn].argmax() == kinds[row])
                    counts[way][0] += hit
                    counts[way][1] += 1
                    by_kind[kinds[row]] += (hit, 1) if way == "score" else (0, 0)
    clips = len(kinds)
    rows_out = []
    for way, (hits, count) in counts.items():
        how = "nearest of all other clips" if "all" in way else f"one clip of each kind, {DRAWS} draws"
        low, high = wilson(round(hits / count * clips), clips)
        rows_out.append(
            [way.split(",")[0], how, clips, round(100 * hits / count, 1), f"{100 * low:.1f}-{100 * high:.1f}"]
        )
    for k, name in enumerate(RECORDED):
        hits, count = by_kind[k]
        mine = int((kinds == k).sum())
        low, high = wilson(round(hits / count * mine), mine)
        rows_out.append(
            ["score", f"{name} asks", mine, round(100 * hits / count, 1), f"{100 * low:.1f}-{100 * high:.1f}"]
        )
    return {"columns": ["ranked by", "among", "clips", "same kind first %", "95 %"], "rows": rows_out}


def area_under_curve(known: np.ndarray, unknown: np.ndarray, clips: int | None = None) -> tuple[float, float, float]:
    """Return the area under the ROC curve and its 95 % interval (Hanley and McNeil 1982).

    Args:
        known: scores that should be high.
        unknown: scores that should be low.
        clips: how many different clips the unknown scores are of, where several networks scored each.
    """
    order = np.sort(known)
    below = np.searchsorted(order, unknown, side="right") / len(known)
    level = np.searchsorted(order, unknown, side="left") / len(known)
    area = float(1.0 - (below + level).mean() / 2.0)
    q1, q2 = area / (2.0 - area), 2.0 * area**2 / (1.0 + area)
    m, n = len(known), len(unknown) if clips is None else clips
    spread = (area * (1 - area) + (m - 1) * (q1 - area**2) + (n - 1) * (q2 - area**2)) / (m * n)
    half = 1.96 * float(np.sqrt(max(spread, 0.0)))
    return area, max(0.0, area - half), min(1.0, area + half)


def recorded_scores(heard: Evidence, c: Calibration, kinds: Sequence[int]) -> np.ndarray:
    """Return how likely each one-window sound is the most likely of some kinds."""
    return heard_kinds(heard, c)[:, list(kinds)].max(axis=1)


def refusal_table(
    heard: Evidence,
    other_categories: Sequence[str],
    others: Sequence[Sequence[Evidence]],
    strangers: Sequence[Stranger],
    c: Calibration,
) -> Table:
    """Return how well sounds of no recorded kind are told from those of the ten.

    Known are held-out clips of the ten kinds. Unknown are, first, the recordings of other categories, each scored by
    the four networks of the folds; second, clips of kinds that a network was fitted without. The score is that of
    the most likely recorded kind: what a question for any of them would find.
    """
    rows = []
    ten = range(len(RECORDED))
    known = recorded_scores(heard, c, ten)
    foreign = [i for i, category in enumerate(other_categories) if category not in RECORDED]
    for what, chosen in (
        ("recordings of other categories", foreign),
        ("the same, those longer than one window (5.2 s)", [i for i in foreign if len(others[0][i]) > 1]),
    ):
        unknown = np.array([
            recorded_scores(of_fold[i], c, ten).max() for of_fold in others for i in chosen
        ])  # fmt: skip
        rows.append(_refusal_row(what, known, unknown, c, len(chosen)))
    scores_known, scores_unknown, any_known, any_unknown = [], [], [], []
    for one in strangers:
        left = [k for k in ten if k not in one.without]
        every = [k for k in range(len(KINDS)) if k not in one.without]
        of_left, of_any = (recorded_scores(one.heard, c, which) for which in (left, every))
        scores_known.append(of_left[~one.unknown])
        scores_unknown.append(of_left[one.unknown])
        any_known.append(of_any[~one.unknown])
        any_unknown.append(of_any[one.unknown])
    two = "clips of five recorded kinds left out of training, twice"
    rows.append(_refusal_row(two, np.concatenate(scores_known), np.concatenate(scores_unknown), c))
    whole = f"{two}; score of the most likely of all {len(KINDS)} kinds"
    rows.append(_refusal_row(whole, np.concatenate(any_known), np.concatenate(any_unknown), c))
    columns = ["unknown are", "known clips", "unknown clips", "AUC", "95 %", "yes to known %", "no to unknown %"]
    return {"columns": columns, "rows": rows}


def yes(scores: np.ndarray, c: Calibration) -> np.ndarray:
    """Tell where a question for the most likely kind would be answered by yes."""
    bias, slope = c.word
    return bias + slope * log_odds(scores) >= 0.0


def _refusal_row(
    what: str, known: np.ndarray, unknown: np.ndarray, c: Calibration, clips: int | None = None
) -> list[Any]:
    area, low, high = area_under_curve(known, unknown, clips)
    return [
        what, len(known), clips or len(unknown), round(area, 3), f"{low:.3f}-{high:.3f}",
        round(100 * float(yes(known, c).mean()), 1), round(100 * float((~yes(unknown, c)).mean()), 1),
    ]  # fmt: skip


def yes_table(held_out: dict[str, Evidence], kinds: np.ndarray, encode: EncodeWords, c: Calibration) -> Table:
    """Return how often the score says yes to the right name of ten, and to a wrong one."""
    names = [KINDS[name][0] for name in RECORDED]
    rows = []
    for condition, heard in held_out.items():
        bias, slope = c.word
        said_yes = bias + slope * matching_odds(heard, names, encode, c) >= 0.0
        right = kinds[:, None] == np.arange(len(RECORDED))[None, :]
        rows.append(
            [
                condition,
                *share(int(said_yes[right].sum()), int(right.sum())),
                *share(int(said_yes[~right].sum()), int((~right).sum())),
            ]
        )
    columns = ["condition", "yes to the right", "of", "%", "95 %", "yes to a wrong", "of", "% ", "95 % "]
    return {"columns": columns, "rows": rows}


def taught_table(strangers: Sequence[Stranger], c: Calibration) -> Table:
    """Return how well kinds are found that the networks were fitted without and that were taught from a few clips.

    The clips to find are of other sources than those that taught, of the fold that was kept out; the wrong ones are of
    all nine other kinds. Twenty lessons a kind, drawn by seed.
    """
    rows = []
    bias, slope = c.taught
    for clips in (1, 3, 5):
        given = [lesson for one in strangers for lesson in one.lessons(clips)]
        areas = [area_under_curve(g.lead[g.right], g.lead[~g.right])[0] for g in given if g.right.any()]
        said_yes = [(bias + slope * g.lead >= 0.0) for g in given]
        found = sum(int(y[g.right].sum()) for y, g in zip(said_yes, given, strict=True))
        wrong = sum(int(y[~g.right].sum()) for y, g in zip(said_yes, given, strict=True))
        right, others = sum(int(g.right.sum()) for g in given), sum(int((~g.right).sum()) for g in given)
        rows.append([
            clips, len({g.kind for g in given}), len(given), round(float(np.mean(areas)), 3),
            round(100.0 * found / right, 1), round(100.0 * wrong / others, 1),
        ])  # fmt: skip
    columns = ["taught from clips", "kinds", "lessons", "mean AUC", "yes to its own %", "yes to others %"]
    return {"columns": columns, "rows": rows}
