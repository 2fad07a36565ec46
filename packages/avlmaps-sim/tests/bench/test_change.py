"""The benchmark of change: its scores by hand, and one home over two days from the recording to the tables."""

import json
from pathlib import Path

import numpy as np
import pytest

from avlmaps.core.errors import MapError
from avlmaps.days.find import NotTheSamePlaceError
from avlmaps.days.merge import merge_maps
from avlmaps.query.asking import Asked, ask
from avlmaps.query.avlmap import AVLMap
from avlmaps_sim.bench.change.scores import Happened, judged, judged_list, true_changes
from avlmaps_sim.bench.change.suite import TRUE, run_change
from avlmaps_sim.bench.harness.settings import SceneSettings
from avlmaps_sim.rearranged import Change
from helpers.heard_flat import heard_flat

HERE, THERE, FAR = (0.0, 0.0, 0.2), (2.0, 0.0, 0.2), (9.0, 9.0, 0.2)


def test_a_change_is_right_by_kind_name_and_place() -> None:
    true = [Happened("moved", "bag", HERE, THERE), Happened("gone", "box", FAR, None)]
    near = (0.3, 0.1, 0.9)
    counts = judged([Happened("moved", "bag", near, THERE), Happened("gone", "box", FAR, None)], true)
    assert counts.right == {"appeared": 0, "gone": 1, "moved": 1} and counts.f1("moved") == 1.0
    for wrong in (
        Happened("moved", "bag", FAR, THERE),
        Happened("moved", "sofa", HERE, THERE),
        Happened("gone", "bag", HERE, None),
    ):
        counts = judged([wrong], true[:1])
        assert sum(counts.right.values()) == 0 and counts.wrong[wrong.kind] == 1 and counts.missed["moved"] == 1
    once = judged([Happened("moved", "bag", HERE, THERE)] * 2, true[:1])
    assert (once.right["moved"], once.wrong["moved"]) == (1, 1)


def test_what_nobody_could_notice_is_neither_right_nor_wrong() -> None:
    hidden = Happened("gone", "box", FAR, None)
    counts = judged([hidden, Happened("gone", "door", HERE, None)], [], [HERE], [hidden])
    assert sum(counts.right.values()) == sum(counts.wrong.values()) == sum(counts.missed.values()) == 0


def test_of_a_move_from_where_nobody_looked_either_end_is_neither_right_nor_wrong() -> None:
    hidden = Happened("moved", "box", FAR, THERE)
    said = [Happened("appeared", "box", None, THERE), Happened("gone", "box", FAR, None)]
    assert sum(judged(said, [], (), [hidden]).wrong.values()) == 0
    assert sum(judged([Happened("appeared", "box", None, FAR)], [], (), [hidden]).wrong.values()) == 1
    assert sum(judged(said, [hidden]).wrong.values()) == 2, "where it could be noticed, both are wrong"


def test_only_what_was_seen_counts_as_happened() -> None:
    changes = [
        Change(1, "removed", "box#1", "box", HERE, None), Change(1, "added", "bag#day1.1", "bag", None, THERE),
        Change(1, "swung", "door#1", "door", HERE, HERE), Change(2, "moved", "bag#2", "bag", HERE, THERE),
    ]  # fmt: skip
    both = true_changes(changes, 1, ["box#1"], ["bag#day1.1"])
    assert [one.kind for one in both] == ["gone", "appeared"]
    assert true_changes(changes, 1, [], []) == [] and true_changes(changes, 2, ["bag#2"], []) == []


def test_an_empty_list_is_not_stale() -> None:
    assert judged_list([], [], [], []).listed == 0


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict]:
    out = tmp_path_factory.mktemp("change")
    settings = SceneSettings(scenes=("house:7",), profile="synthetic", frames=24, sources=1, ambiguous=0, jobs=1)
    return out, run_change(settings, 2, out)


@pytest.mark.nightly
def test_a_home_over_two_days_is_recognised_and_judged(bench: tuple[Path, dict]) -> None:
    out, answer = bench
    row = answer["tables"]["homes, true perception"]["rows"][0]
    assert row[1:3] == [1, 0], "one day merged, none refused"
    assert float(row[3]) < 2.0 and float(row[4]) < 0.3, "centimetres and degrees from where it was driven"
    lost = next(row for row in answer["tables"]["static things lost"]["rows"] if row[0] == TRUE)
    assert lost[1].startswith("0.0% of")
    assert json.loads((out / "change.json").read_text())["days"] == 2


@pytest.mark.nightly
def test_a_merged_map_is_a_map_and_bad_merges_are_refused(bench: tuple[Path, dict], tmp_path: Path) -> None:
    work = bench[0] / "work"
    (first,) = work.glob("house-7-*/synthetic.avlmap")
    (second,) = work.glob("house-7-day-1-*/turned-synthetic.avlmap")
    (merged,) = work.glob("house-7-day-1-*/merged-true-1.avlmap")
    one, other, both = (AVLMap.open(path) for path in (first, second, merged))
    assert len(both.data.info.visits) == 2 and both.data.life is not None
    most = len(one.data.keyframes) + len(other.data.keyframes)
    assert len(both.data.keyframes) == len(both.data.keyframes.clear_mm) <= most
    # The second world is another one: the transform is far from none.
    assert np.abs(np.array(both.data.info.visits[1].map_from_recording) - np.eye(4)).max() > 0.5
    avlmap = both
    assert len(avlmap.things(at=1)) > 10 and avlmap.changes()["days"][1]["visit"] == 2
    answer = ask(avlmap, Asked(sentence="what is new?"))
    assert answer.text and len(answer.when) == len(answer.goals)
    with pytest.raises(MapError, match="map of 2 days"):
        merge_maps(one, both, tmp_path / "no.avlmap")
    with pytest.raises(MapError, match="no day"):
        merge_maps(one, other, tmp_path / "no.avlmap", first_day="monday")
    with pytest.raises(MapError, match="finished map already"):
        merge_maps(one, other, merged)
    assert not (tmp_path / "no.avlmap").exists()


@pytest.mark.nightly
def test_another_home_is_refused_with_numbers(
    bench: tuple[Path, dict], tmp_path_factory: pytest.TempPathFactory, tmp_path: Path
) -> None:
    (first,) = (bench[0] / "work").glob("house-7-*/synthetic.avlmap")
    _, other = heard_flat(tmp_path_factory)
    with pytest.raises(NotTheSamePlaceError, match=r"of \d+ keyframes .* \d+ were located"):
        merge_maps(AVLMap.open(first), AVLMap.open(other), tmp_path / "no.avlmap")
