"""The object benchmark's arithmetic, on a map whose encoder is always right."""

from dataclasses import dataclass, field
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.question import Modality, Part, Role
from avlmaps.maps.grid import GridSpec
from avlmaps.query.factors import NearThings
from avlmaps.query.heatmap import Heatmap
from avlmaps.query.voxel_space import Space
from avlmaps_sim.bench.objects import ObjectFigures, auroc, measure, missed, table_of
from avlmaps_sim.scene import SceneObject

SIZE_M = 0.05


def block(low: tuple[float, float, float], cells: int = 8) -> np.ndarray:
    return np.argwhere(np.ones((cells,) * 3)) + np.round(np.array(low) / SIZE_M).astype(int)


def thing(category: str, low: tuple[float, float, float]) -> SceneObject:
    high = tuple(value + 8 * SIZE_M for value in low)
    return SceneObject(category, low, (high[0], high[1], high[2]))


THINGS = (thing("chair", (0, 0, 0)), thing("chair", (2, 0, 0)), thing("bed", (4, 0, 0)))
INDEX = np.concatenate([block(one.low) for one in THINGS])


@dataclass
class Features:
    """Voxels of which only the features count."""

    feature: np.ndarray

    def __len__(self) -> int:
        return len(self.feature)


WORDS = ("chair", "bed", "toilet", "wall", "armchair")


def codes_of(words: list[str]) -> np.ndarray:
    """Return a unit vector for each word that the encoder knows, zero for others."""
    return np.array([[float(word == known) for known in WORDS] for word in words], np.float32)


@dataclass
class AskedMap:
    """Answers from a table: the blocks that each word claims, how surely, and the names of each block's voxels."""

    claims: dict[str, list[tuple[int, float]]]
    names: tuple[str, str, str] = ("chair", "chair", "bed")
    space: Space = field(default_factory=lambda: Space(GridSpec(SIZE_M), INDEX, np.array([0.0, 0.0, 1.0])))

    @property
    def encoders(self) -> SimpleNamespace:
        pixels = SimpleNamespace(vocabulary=("chair", "bed", "toilet", "wall"), encode_words=codes_of)
        return SimpleNamespace(pixels=pixels)

    def require_model(self, kind: object) -> None:
        """Every model is there."""

    @property
    def data(self) -> SimpleNamespace:
        return SimpleNamespace(voxels=Features(np.repeat(codes_of(list(self.names)), 512, axis=0)))

    def object(self, word: str, primary: bool = False) -> Heatmap:
        owner = np.repeat(np.arange(3), 512)
        claimed = self.claims.get(word, [])
        mask = np.isin(owner, [number for number, _ in claimed])
        order = {number: row for row, (number, _) in enumerate(claimed)}
        instance = np.array([order[number] for number in owner[mask]], np.int64)
        confidence = np.array([sure for _, sure in claimed], np.float32)
        part = Part(Modality.OBJECT, word, Role.PRIMARY)
        return Heatmap.of(NearThings(self.space, part, 2.0, mask, instance, confidence, bool(len(confidence))))


def test_a_map_that_is_right_is_right_in_every_figure() -> None:
    figures = measure(AskedMap({"chair": [(0, 0.9), (1, 0.8)], "bed": [(2, 0.9)]}), THINGS, {}, "room")  # pyright: ignore[reportArgumentType]
    assert figures.within == (2, 2)
    assert figures.precise == (3, 3)
    assert (figures.found_count, figures.true_count) == (3, 3)
    row = dict(zip(table_of([figures])["columns"], table_of([figures])["rows"][0], strict=True))
    assert row["found or not: AUROC"].startswith("1.000")
    assert row["voxels named rightly"] == "100.0% of 1536"
    assert row["mean over things"].startswith("100.0% of 3")


def test_a_bed_taken_for_a_chair_costs_precision_and_the_bed() -> None:
    figures = measure(AskedMap({"chair": [(0, 0.9), (2, 0.95)]}), THINGS, {}, "room")  # pyright: ignore[reportArgumentType]
    assert figures.reached["bed"] == np.inf
    assert figures.reached["chair"] > 0.5
    assert figures.precise == (1, 2)
    assert (figures.found_count, figures.true_count) == (1, 3)


def test_voxels_count_by_their_likeliest_name_whatever_the_map_claims() -> None:
    figures = measure(AskedMap({}, ("chair", "bed", "bed")), THINGS, {}, "room")  # pyright: ignore[reportArgumentType]
    assert list(figures.voxels) == [512, 512, 512] and list(figures.named) == [512, 0, 512]
    row = table_of([figures])["rows"][0]
    assert row[-2] == "66.7% of 1536" and row[-1].startswith("66.7% of 3 (1.3-100.0)")


def test_voxels_in_two_boxes_and_things_of_unknown_names_count_for_none() -> None:
    things = (THINGS[0], thing("chair", (0.2, 0, 0)), thing("hookah", (4, 0, 0)))
    figures = measure(AskedMap({}), things, {}, "room")  # pyright: ignore[reportArgumentType]
    # Boxes grow by 2 cm, less than half of a voxel: four of eight layers lie in both.
    assert figures.voxels[0] == figures.named[0] == 4 * 64 and figures.voxels[2] == 0
    none = table_of([measure(AskedMap({}), things[2:], {}, "room")])["rows"][0]  # pyright: ignore[reportArgumentType]
    assert none[-2:] == ["none", "none"]


def test_what_it_is_not_sure_of_does_not_count_against_it() -> None:
    figures = measure(AskedMap({"chair": [(0, 0.9), (2, 0.3)], "bed": [(2, 0.9)]}), THINGS, {}, "room")  # pyright: ignore[reportArgumentType]
    assert figures.precise == (2, 2)


def test_names_that_count_as_one_are_asked_as_one() -> None:
    things = (*THINGS[:2], thing("four-poster", (4, 0, 0)))
    figures = measure(AskedMap({"bed": [(2, 0.9)]}), things, {"four-poster": "bed"}, "room")  # pyright: ignore[reportArgumentType]
    assert figures.reached["bed"] == 0.0


def test_a_narrower_kind_answers_a_wider_name_and_not_the_reverse() -> None:
    things = (thing("chair", (0, 0, 0)), thing("armchair", (2, 0, 0)), thing("bed", (4, 0, 0)))
    claims = {"chair": [(1, 0.9)], "armchair": [(0, 0.9)], "bed": [(2, 0.9)]}
    figures = measure(AskedMap(claims), things, {}, "room")  # pyright: ignore[reportArgumentType]
    assert figures.reached["chair"] == 0.0, "an armchair is a chair"
    assert figures.reached["armchair"] > 0.5, "a chair is no armchair"
    assert figures.precise == (2, 3)
    assert figures.found_count == 1, "a thing is found by its own name"


def test_the_first_goal_of_a_map_lies_in_the_surest_instance() -> None:
    goals = AskedMap({"chair": [(0, 0.6), (1, 0.9)]}).object("chair").goals(2)
    assert [round(goal.position[0]) for goal in goals] == [2, 0]


@given(st.lists(st.floats(0, 1), min_size=1, max_size=20), st.lists(st.floats(0, 1), min_size=1, max_size=20))
def test_the_area_under_the_curve_is_the_share_of_pairs_in_order(there: list[float], absent: list[float]) -> None:
    pairs = [(a > b) + 0.5 * (a == b) for a in there for b in absent]
    score, is_there = np.array(there + absent), np.arange(len(there) + len(absent)) < len(there)
    assert auroc(score, is_there) == pytest.approx(np.mean(pairs))


def test_one_side_alone_has_no_curve() -> None:
    assert np.isnan(auroc(np.ones(3), np.ones(3, bool)))


def test_what_was_missed_is_listed_by_distance_in_one_scene_and_counted_in_several() -> None:
    one = ObjectFigures("one", {"bed": 0.5, "chair": 1.234, "lamp": np.inf}, [], 0, 0)
    other = ObjectFigures("other", {"bed": 0.1, "chair": 0.2, "lamp": 3.0}, [], 0, 0)
    assert missed([one])["rows"] == [["chair", "1.23"], ["lamp", "none"]]
    assert missed([one, other])["rows"] == [["lamp", "2", "0"], ["chair", "2", "1"]]
