"""Laws of a set of instances: what is left out, put together or given other numbers is otherwise as it was."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.query.objects import Instances, best_guesses


@st.composite
def found(draw: st.DrawFn, first_row: int = 0) -> Instances:
    """Voxels of some instances, each of which has one."""
    count = draw(st.integers(0, 4))
    more = draw(st.lists(st.integers(0, count - 1), max_size=12)) if count else []
    instance = np.array(draw(st.permutations([*range(count), *more])), np.int64)
    n = len(instance)
    rows = first_row + np.cumsum(np.array(draw(st.lists(st.integers(1, 3), min_size=n, max_size=n)), np.int64))
    numbers = st.lists(st.floats(0.0, 1.0, width=32), min_size=n, max_size=n)
    margin, score = (np.array(draw(numbers), np.float32) for _ in range(2))
    confidence = draw(st.lists(st.floats(0.0, 1.0, width=32), min_size=count, max_size=count))
    return Instances(rows, instance, margin, score, np.array(confidence, np.float32))


def things(one: Instances) -> list[tuple[float, tuple[int, ...], tuple[float, ...]]]:
    """Return the confidence, voxels and scores of each instance, in an order of their own."""
    of = [one.instance == number for number in range(len(one))]
    told = [(float(one.confidence[n]), tuple(one.rows[m]), tuple(one.score[m])) for n, m in enumerate(of)]
    return sorted(told)


@given(found(), st.data())
def test_some_and_the_others_are_all(one: Instances, data: st.DataObject) -> None:
    kept = np.array(data.draw(st.lists(st.booleans(), min_size=len(one), max_size=len(one))), bool)
    some, others = one.only(kept), one.only(~kept)
    assert sorted(things(some) + things(others)) == things(one)
    both = some.with_others(others)
    assert things(both) == things(one)
    assert (np.diff(both.rows) > 0).all()
    assert both.confidence[: len(some)].tolist() == some.confidence.tolist(), "the first keep their numbers"


@given(found())
def test_each_instance_has_a_voxel_and_a_mean_within_its_scores(one: Instances) -> None:
    assert (one.voxel_count > 0).all() and one.voxel_count.sum() == len(one.rows)
    for number, mean in enumerate(one.mean_probability):
        squares = np.square(one.score[one.instance == number], dtype=np.float64)
        assert squares.min() - 1e-6 <= mean <= squares.max() + 1e-6


@given(found())
def test_new_numbers_leave_out_what_has_none_and_are_not_scored(one: Instances) -> None:
    again = one.relabelled(one.instance)
    assert again.rows.tolist() == one.rows.tolist() and len(again) == len(one) and again.best == 0.0
    assert not len(one.relabelled(np.full(len(one.rows), -1)))


@given(found())
def test_best_guesses_are_no_specks_and_half_as_likely_as_the_best(one: Instances) -> None:
    guesses = best_guesses(one, 0.1)  # two voxels of 0.1 m show more than a mug
    solid = [confidence for confidence, rows, _ in things(one) if len(rows) >= 2 and confidence > 0.0]
    wanted = sorted(confidence for confidence in solid if confidence >= max(solid) / 2)
    assert sorted(guesses.confidence.tolist()) == wanted
