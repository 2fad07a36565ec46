"""The probability that a goal is right: a law of its evidence, and weights that homes nobody trained on agree with."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from training.found.fit import fitted, held_out
from training.found.rows import balanced, read_rows

from avlmaps.core.question import Modality
from avlmaps.query.goals import FACTORS, GoalEvidence, logit, probability_of, weights
from avlmaps_sim.bench.found.suite import brier

logits, logs = st.floats(-4, 4), st.floats(-4, 0)
joined = st.builds(
    lambda lead, context, thing, near, room, marks: GoalEvidence(
        lead, (context,), 1 / (1 + np.exp(-thing)), thing, near, room, marks
    ),
    st.sampled_from(Modality), st.sampled_from(Modality), logits, logs, logs, logits,
)  # fmt: skip


@given(joined, st.sampled_from(FACTORS), st.floats(0, 2))
def test_more_of_any_evidence_makes_a_goal_no_less_likely(evidence: GoalEvidence, name: str, more: float) -> None:
    better = replace(evidence, **{name: getattr(evidence, name) + more})
    if name == "thing":
        better = replace(better, alone=1 / (1 + np.exp(-better.thing)))
    assert 0.0 <= probability_of(evidence) <= probability_of(better) <= 1.0


@given(joined, joined)
def test_a_part_alone_has_its_own_confidence(evidence: GoalEvidence, other: GoalEvidence) -> None:
    alone = replace(evidence, context=(), near=other.near, marks=other.marks)
    assert probability_of(alone) == pytest.approx(evidence.alone, abs=1e-3)


@given(st.floats(0.0, 1.0))
def test_log_odds_stay_finite(probability: float) -> None:
    assert abs(logit(probability)) <= 4.0


def test_the_weights_that_ship_are_those_of_the_rows() -> None:
    assert fitted(read_rows()) == pytest.approx(weights(), abs=2e-2)


def test_each_row_is_evidence_again() -> None:
    for row in read_rows()[::50]:
        assert [getattr(row.evidence, name) for name in FACTORS] == pytest.approx(list(row.numbers))


@pytest.mark.nightly
def test_on_homes_left_out_it_says_more_than_the_rate_alone() -> None:
    rows = read_rows()
    probability, weight = held_out(rows), balanced(rows)
    right = np.array([row.right for row in rows], float)
    for kind in {row.kind for row in rows}:
        own = np.array([row.kind == kind for row in rows])
        rate = np.average(right[own], weights=weight[own])
        assert brier(probability[own], right[own], weight[own]) < 0.85 * rate * (1.0 - rate), kind


@pytest.mark.slow
@pytest.mark.nightly
def test_those_who_are_certain_are_mostly_right() -> None:
    rows = read_rows()
    probability, right = held_out(rows), np.array([row.right for row in rows])
    several = np.array([bool(row.evidence.context) for row in rows])
    assert right[several & (probability >= 0.8)].mean() > 0.75
    assert right[several & (probability < 0.2)].mean() < 0.15
