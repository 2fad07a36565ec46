"""The object benchmark: are things where the map says, are its instances real things, does it report absence.

Four figures for each scene. *First goal*: of the categories that stand there, how many have the first answer
within half a metre of a true one. *Instances*: of the instances of confidence 0.5 or more how many are
true, and of the true ones how many are found. *Found*: how well the best confidence separates categories that are there
from those that are not (area under the ROC curve). Truth: boxes of things, of which the walk saw at least some. A thing
of a narrower kind is true for a wider name: a dining table answers "table", a table does not answer "dining table".
A true thing counts as found by its own name alone. *Voxels*: of those in the box of one thing alone, how many have its
name as their likeliest, over all and as a mean over things. It has no threshold, and separates encoders and fusions
that the other figures do not.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Bool, Float, Int

from avlmaps.core.errors import QueryError
from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps.core.progress import progress
from avlmaps.query.words import VoxelNamer
from avlmaps_sim.bench.harness.figures import (
    chosen_on,
    in_words,
    markdown,
    of_mean,
    provenance,
    shown_scene,
    wilson,
    write_answer,
)
from avlmaps_sim.scene import SceneObject

if TYPE_CHECKING:
    from avlmaps.query.avlmap import AVLMap
    from avlmaps_sim.bench.indexing.runs import IndexingSettings

STRUCTURE = ("wall", "floor", "ceiling", "column", "stairs", "railing")
# A box is grown by this: voxels and poses are that coarse.
GROWN_M = 0.1
# And by this where its voxels are separated from those beside it.
NARROW_M = 0.02
REACH_M = 0.5
FEWEST_VOXELS = 15
SMALLEST_M = 0.3
_MOSTLY, _A_QUARTER = 0.5, 0.25


@dataclass(frozen=True, slots=True)
class Instances:
    """The map's answer for one category. Most of the voxels of a true one lie in boxes of true things."""

    category: str
    confidence: Float[np.ndarray, " i"]
    is_true: Bool[np.ndarray, " i"]


@dataclass(frozen=True, slots=True)
class ObjectFigures:
    """The results of one scene.

    ``reached`` is the distance from the first goal to a true one, metres, inf for none. ``true_count`` counts the
    things of some size that the walk saw, ``found_count`` those that confident instances hold; ``voxels`` lie in the
    box of one thing alone, ``named`` of them have its name as their likeliest.
    """

    scene: str
    reached: dict[str, float]
    said: list[Instances]
    true_count: int
    found_count: int
    best: dict[str, tuple[float, bool]] = field(default_factory=dict)
    voxels: Int[np.ndarray, " things"] = field(default_factory=lambda: np.zeros(0, np.int64))
    named: Int[np.ndarray, " things"] = field(default_factory=lambda: np.zeros(0, np.int64))

    @property
    def within(self) -> tuple[int, int]:
        """How many categories were reached within half a metre, of how many."""
        return sum(distance <= REACH_M for distance in self.reached.values()), len(self.reached)

    @property
    def precise(self) -> tuple[int, int]:
        """How many of the confident instances are true, of how many."""
        sure = [one.is_true[one.confidence >= 0.5] for one in self.said]
        return sum(int(a.sum()) for a in sure), sum(len(a) for a in sure)


def measure(avlmap: "AVLMap", things: Sequence[SceneObject], same: Mapping[str, str], scene: str) -> ObjectFigures:
    """Query a map for everything that it could hold and compare with the truth.

    ``same`` is category to the one that it counts as (``picture frame`` to ``picture``); others count as themselves.
    """
    centres = avlmap.space.centres
    inside = [_inside(centres, thing) for thing in things]
    name = [same.get(thing.category, thing.category) for thing in things]
    seen = [number for number, rows in enumerate(inside) if len(rows) >= FEWEST_VOXELS]
    present = {name[number] for number in seen}
    vocabulary = [word for word in avlmap.encoders.pixels.vocabulary if word not in STRUCTURE]
    words = sorted({same.get(word, word) for word in vocabulary} | (present - set(STRUCTURE)))
    answers = cache(lambda name, word: name == word or lexicon().is_a(name, word, EntryKind.THING))
    said, held, best, covered = [], np.zeros(len(centres), bool), {}, dict[str, np.ndarray]()
    reached = dict.fromkeys(present.intersection(words), np.inf)
    for word in words:
        try:
            heat = avlmap.object(word, primary=True)
        except QueryError:  # the encoder was not trained to detect it
            continue
        factor = heat.factors[0]
        rows = np.flatnonzero(getattr(factor, "mask", np.zeros(len(centres), bool)))
        of_word = [number for number in seen if answers(name[number], word)]
        held[:] = False
        for number in of_word:
            held[inside[number]] = True
        count = np.maximum(np.bincount(factor.instance, minlength=len(factor.confidence)), 1)
        true_share = np.bincount(factor.instance, weights=held[rows], minlength=len(factor.confidence)) / count
        one = Instances(word, np.asarray(factor.confidence, np.float64), true_share >= _MOSTLY)
        said.append(one)
        good = (one.confidence >= 0.5) & one.is_true
        covered[word] = rows[good[factor.instance]]
        best[word] = (float(one.confidence.max(initial=0.0)), bool(of_word))
        if word in present:
            goals = heat.goals(1)
            reached[word] = _distance(goals[0].position, [things[n] for n in of_word]) if goals else np.inf
    large = [n for n in seen if name[n] not in STRUCTURE and max(things[n].size) >= SMALLEST_M]
    found = sum(np.isin(inside[n], covered.get(name[n], [])).mean() >= _A_QUARTER for n in large)
    movable = [(thing, called) for thing, called in zip(things, name, strict=True) if called not in STRUCTURE]
    return ObjectFigures(scene, reached, said, len(large), int(found), best, *_named(avlmap, movable, words))


def _named(
    avlmap: "AVLMap", things: Sequence[tuple[SceneObject, str]], words: Sequence[str]
) -> tuple[Int[np.ndarray, " things"], Int[np.ndarray, " things"]]:
    """Return how many voxels lie in the box of each thing alone, and how many of them are named as it is.

    Things whose name the map's encoder does not know count no voxel.
    """
    namer = VoxelNamer(avlmap, words)
    likeliest, _ = namer.best()
    centres = avlmap.space.centres
    inside = [_inside(centres, thing, NARROW_M) for thing, _ in things]
    boxes = np.bincount(np.concatenate([*inside, np.zeros(0, np.int64)]), minlength=len(centres))
    voxels, named = np.zeros((2, len(things)), np.int64)
    for number, (rows, (_, name)) in enumerate(zip(inside, things, strict=True)):
        alone = rows[boxes[rows] == 1]
        if name in namer.names and len(alone) >= FEWEST_VOXELS:
            voxels[number] = len(alone)
            named[number] = np.count_nonzero(likeliest[alone] == namer.names.index(name))
    return voxels, named


def _inside(centres: Float[np.ndarray, "n 3"], thing: SceneObject, grown_m: float = GROWN_M) -> Int[np.ndarray, " m"]:
    low, high = np.array(thing.low) - grown_m, np.array(thing.high) + grown_m
    return np.flatnonzero(((centres >= low) & (centres <= high)).all(axis=1))


def _distance(position: Sequence[float], things: Sequence[SceneObject]) -> float:
    place = np.array(position)
    gaps = [np.maximum(np.array(t.low) - place, 0) + np.maximum(place - np.array(t.high), 0) for t in things]
    return float(min(np.linalg.norm(gap) for gap in gaps))


def run_objects(settings: "IndexingSettings | None", out: Path) -> dict[str, Any]:
    """Map scenes, or take the maps that the suite ``indexing`` left in the same folder, and measure each.

    Recordings and maps stay in ``out/work``.

    ``BackendError``: a model is missing; nothing is recorded then.
    """
    from avlmaps_sim.bench.harness.workplace import Workplace, scene_jobs
    from avlmaps_sim.bench.indexing.runs import IndexingSettings
    from avlmaps_sim.scenes import open_scene

    settings = settings or IndexingSettings()
    weights = settings.checked()
    figures = []
    jobs = scene_jobs(settings, settings.recorded, settings.scenes, out / "work")
    for job in progress(jobs, "measuring", unit="scene"):
        place = Workplace(job, open_scene)
        figures.append(measure(place.avlmap, place.truth.objects, _same(place.truth.objects), shown_scene(job.spec)))
    named = {
        "objects found by their names": table_of(figures),
        "categories whose first goal is elsewhere": missed(figures),
    }
    chosen = chosen_on(settings.scenes)
    tables = {name: {**table, "chosen on": chosen} if chosen else table for name, table in named.items()}
    answer = {"suite": "objects", **provenance(settings, settings.recorded, settings.scenes, weights), "tables": tables}
    return write_answer(answer, out, f"{in_words(answer)}\n\n{markdown(tables)}")


def _same(things: Sequence[SceneObject]) -> dict[str, str]:
    entries = {thing.category: lexicon().find(thing.category, EntryKind.THING) for thing in things}
    return {word: entry.name for word, entry in entries.items() if entry is not None}


def missed(scenes: Sequence[ObjectFigures]) -> dict[str, Any]:
    """Return a table of the categories that were missed: of one scene how far off, of several how often."""
    if len(scenes) == 1:
        rows = [
            [category, f"{distance:.2f}" if np.isfinite(distance) else "none"]
            for category, distance in sorted(scenes[0].reached.items())
            if distance > REACH_M
        ]
        return {"columns": ["category", "first goal, m from a true one"], "rows": rows}
    reached = [pair for scene in scenes for pair in scene.reached.items()]
    held = Counter(category for category, _ in reached)
    found = Counter(category for category, distance in reached if distance <= REACH_M)
    worst = sorted((one for one in held if found[one] < held[one]), key=lambda one: (found[one] - held[one], one))
    rows = [[category, str(held[category]), str(found[category])] for category in worst]
    return {"columns": ["category", "scenes that hold it", f"first goal within {REACH_M:g} m"], "rows": rows}


def auroc(score: Float[np.ndarray, " n"], is_there: Bool[np.ndarray, " n"]) -> float:
    """Return how likely one that is there scores above one that is not; ties count half, NaN where a side is empty."""
    there, absent = score[is_there], score[~is_there]
    if not len(there) or not len(absent):
        return float("nan")
    above = (there[:, None] > absent).mean() + 0.5 * (there[:, None] == absent).mean()
    return float(above)


def table_of(scenes: Sequence[ObjectFigures]) -> dict[str, list]:
    """Return the figures of scenes, and of all together, as a table."""
    columns = [
        "scene", "first goal within 0.5 m", "instances true", "true things found", "found or not: AUROC",
        "voxels named rightly", "mean over things",
    ]  # fmt: skip
    rows = [_row(scene.scene, [scene]) for scene in scenes]
    if len(scenes) > 1:
        rows.append(_row(f"all {len(scenes)}", scenes))
    return {"columns": columns, "rows": rows}


def _row(name: str, scenes: Sequence[ObjectFigures]) -> list[str]:
    pairs = [
        tuple(map(sum, zip(*(s.within for s in scenes), strict=True))),
        tuple(map(sum, zip(*(s.precise for s in scenes), strict=True))),
        (sum(s.found_count for s in scenes), sum(s.true_count for s in scenes)),
    ]
    best = [entry for s in scenes for entry in s.best.values()]
    score = auroc(np.array([b[0] for b in best]), np.array([b[1] for b in best], bool))
    voxels, named = (np.concatenate([getattr(s, kind) for s in scenes]) for kind in ("voxels", "named"))
    return [name, *(_share(int(a), int(n)) for a, n in pairs), f"{score:.3f} of {len(best)}", *_naming(voxels, named)]


def _naming(voxels: Int[np.ndarray, " things"], named: Int[np.ndarray, " things"]) -> list[str]:
    shares = named[voxels > 0] / voxels[voxels > 0]
    if not len(shares):
        return ["none", "none"]
    low, high = of_mean(shares)
    over_things = f"{shares.mean():.1%} of {len(shares)} ({100 * low:.1f}-{100 * high:.1f})"
    return [f"{named.sum() / voxels.sum():.1%} of {voxels.sum()}", over_things]


def _share(count: int, of: int) -> str:
    if not of:
        return "none"
    low, high = wilson(count, of)
    return f"{count / of:.1%} of {of} ({100 * low:.1f}-{100 * high:.1f})"
