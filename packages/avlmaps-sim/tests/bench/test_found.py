"""The benchmark of `found`: queries whose truth is known, twins that have none, and Brier scores in closed form."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps.core.question import Modality, Role
from avlmaps.query.goals import FACTORS, probability_of
from avlmaps.query.goals import GoalEvidence as QueryEvidence
from avlmaps_sim.bench.found.answers import FAR_M, NEAR_M, Judged, labelled_queries
from avlmaps_sim.bench.found.suite import brier, factors_table, kinds_table, reliability_table
from avlmaps_sim.bench.harness.evidence import Event, Evidence
from avlmaps_sim.bench.indexing.tasks import area_tasks, between_m, near_sound_tasks, sound_tasks
from avlmaps_sim.scene import SceneObject
from helpers.small_home import HEARD, furnished

NAMES = ["chair", "table", "lamp", "plant", "tv", "sofa", "bed", "fridge", "wall"]
SOUNDS = ["snoring", "doorbell", "rooster", "siren"]


@pytest.fixture(scope="module")
def evidence() -> Evidence:
    scene = furnished()
    events = tuple(Event(name, (x, y, 1.3)) for name, x, y in HEARD)
    return Evidence("made", scene.objects, np.full(len(scene.objects), 100), scene.areas, events)


def held(evidence: Evidence) -> list[SceneObject]:
    return [thing for thing in evidence.objects if thing.category not in ("wall", "floor", "ceiling")]


@settings(max_examples=8, deadline=None)
@given(st.integers(0, 2**32))
def test_what_has_an_answer_is_there_and_what_has_none_is_not(evidence: Evidence, seed: int) -> None:
    rng = np.random.default_rng(seed)
    tasks = [*area_tasks(evidence, rng, 9), *near_sound_tasks(evidence, rng, 9), *sound_tasks(evidence, rng, 9)]
    queries = labelled_queries(evidence, tasks, NAMES, SOUNDS, ("kitchen", "bathroom"), rng)
    things, sounds = {thing.category for thing in held(evidence)}, {event.category for event in evidence.events}
    for query in queries:
        assert query.parts[0].role is Role.PRIMARY and sum(part.role is Role.PRIMARY for part in query.parts) == 1
        known = [
            part.query in (things if part.modality is Modality.OBJECT else sounds)
            or any(lexicon().is_a(thing, part.query, EntryKind.THING) for thing in things)
            for part in query.parts
            if part.modality in (Modality.OBJECT, Modality.SOUND)
        ]
        assert not query.targets or all(known), query
        if query.targets:
            low, high = query.targets[0].low, query.targets[0].high
            assert query.off_m(tuple((a + b) / 2 for a, b in zip(low, high, strict=True))) == 0.0  # pyright: ignore
        else:
            assert query.off_m((0.0, 0.0, 0.0)) == np.inf
        if query.kind == "object-object" and all(known):
            first, second = (
                [evidence.box(i) for i, thing in enumerate(evidence.objects) if thing.category == part.query]
                for part in query.parts
            )
            gaps = [min(between_m(own, other) for other in second) for own in first]
            assert min(gaps) <= NEAR_M if query.targets else min(gaps) > FAR_M
    alone = [query for query in queries if query.kind in ("object", "sound", "area")]
    assert {query.kind for query in alone} == {"object", "sound", "area"}
    assert {bool(query.targets) for query in alone} == {True, False}


def answers(probability: list[float], right: list[bool]) -> list[Judged]:
    pairs = zip(probability, right, strict=True)
    return [Judged(f"home {k % 2}", "object", "chair", is_right, is_right, p) for k, (p, is_right) in enumerate(pairs)]


outcomes = st.lists(st.tuples(st.floats(0, 1), st.booleans()), min_size=1, max_size=40)


@given(outcomes)
def test_the_brier_score_is_0_for_an_oracle_and_least_at_the_rate(pairs: list[tuple[float, bool]]) -> None:
    p, right = np.array([one for one, _ in pairs]), np.array([float(one) for _, one in pairs])
    rate = np.full(len(right), right.mean())
    assert brier(right, right) == 0.0 <= brier(p, right) <= 1.0
    assert brier(rate, right) == pytest.approx(right.mean() * (1.0 - right.mean()))
    assert brier(np.full(len(right), p[0]), right) >= brier(rate, right) - 1e-12


@given(outcomes)
def test_every_query_is_in_one_row_of_the_reliability(pairs: list[tuple[float, bool]]) -> None:
    rows = reliability_table(answers(*map(list, zip(*pairs, strict=True))))["rows"]  # pyright: ignore
    assert sum(row[1] for row in rows) == len(pairs)
    assert sum(row[1] * row[2] for row in rows) == pytest.approx(sum(p for p, _ in pairs), abs=1e-2 * len(pairs))
    assert sum(round(row[1] * row[3]) for row in rows) == sum(right for _, right in pairs)


def test_the_table_counts_right_wrong_and_absent_apart(tmp_path: Path) -> None:
    said = answers([0.9, 0.2, 0.6, 0.1], [True, True, False, False])
    said.append(Judged("home 0", "object", "bed", True, False, 0.7))
    row = next(row for row in kinds_table(said)["rows"] if row[0] == "object")
    assert [str(cell).split(" (")[0] for cell in row[5:]] == ["50.0% of 2", "100.0% of 1", "50.0% of 2"]
    assert next(row for row in kinds_table(said[:1])["rows"] if row[0] == "object")[5:] == [
        "100.0% of 1 (20.7 to 100.0)",
        "",
        "",
    ]
    low, high = map(float, row[3].split(" to "))
    assert low <= row[2] <= high
    assert next(row for row in kinds_table(said[:1])["rows"])[3] == ""


@given(st.floats(-4, 4), st.floats(-4, 0), st.floats(0, 2))
def test_factors_are_means_of_goals_whose_product_is_their_probability(
    thing: float, room: float, choice: float
) -> None:
    of = QueryEvidence(Modality.OBJECT, (Modality.AREA,), 1.0, thing, 0.0, room)
    p = probability_of(of)
    rows = factors_table([Judged("home", "area-object", "bed + bedroom", True, True, p, of)] * 3)["rows"]
    (row,) = [row for row in rows if row[2]]
    assert row[1] == ("right, found" if p >= 0.5 else "right, not found") and row[2] == 3
    values = dict(zip(FACTORS, row[3:], strict=True))
    assert values["near"] == values["marks"] == ""
    assert float(np.prod([values[name] for name in ("thing", "room")])) == pytest.approx(p, abs=0.02)
