import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from query_fakes import asked, furnished_map, sounds_of

from avlmaps.core.errors import QueryError
from avlmaps.core.question import Modality, Part, Question, Role
from avlmaps.maps.grid import GridSpec
from avlmaps.query.factors import NearAnchors, NearThings
from avlmaps.query.goals import Goal
from avlmaps.query.heatmap import Heatmap
from avlmaps.query.rooms import modes
from avlmaps.query.settings import QuerySettings
from avlmaps.query.voxel_space import Space
from avlmaps_sim.bench.harness.factors import VoxelHeat


def track(x: float, y: float, z: float = 1.2, length_m: float = 1.0) -> np.ndarray:
    return np.stack([np.linspace(x, x + length_m, 5), np.full(5, y), np.full(5, z)], axis=1)


def test_each_chair_is_one_goal_and_the_larger_one_leads() -> None:
    goals = furnished_map().object("chair", primary=True).goals(top=5)
    assert len(goals) == 2
    assert goals[0].size == pytest.approx((0.2, 0.2, 0.4))
    assert goals[1].size == pytest.approx((0.2, 0.2, 0.3))
    assert goals[0].score >= goals[1].score > 0.5
    assert goals[0].position == pytest.approx((0.6, 0.6, 0.25), abs=0.06)  # the middle of the chair
    assert goals[0].parts == {"object": 1.0}


def things(space: Space, mask: np.ndarray, instance: np.ndarray, confidence: np.ndarray) -> NearThings:
    return NearThings(space, Part(Modality.OBJECT, "chair", Role.PRIMARY), 2.0, mask, instance, confidence, True)


def heard(space: Space, places: np.ndarray, falloff_per_m: float = 0.2) -> NearAnchors:
    part, count = Part(Modality.SOUND, "dog"), len(places)
    return NearAnchors(space, part, falloff_per_m, places, np.ones(count), np.arange(count), True)


@given(st.integers(0, 2**32 - 1))
def test_no_condition_makes_an_answer_likelier(seed: int) -> None:
    """The plant in a room near the door is no likelier than that near the door; of goals the first is likeliest."""
    rng = np.random.default_rng(seed)
    voxels = np.unique(rng.integers(0, 60, (150, 3)), axis=0).astype(np.int32)
    space = Space(GridSpec(0.05), voxels, np.array([0.0, 0.0, 1.0]))
    green, number = rng.uniform(0.0, 1.0, 9), voxels[:, 0] // 20 * 3 + voxels[:, 1] // 20
    plant = things(space, np.ones(len(voxels), bool), number, rng.uniform(0.1, 1.0, 9).astype(np.float32))
    coloured = replace(plant, confidence=(plant.confidence * green).astype(np.float32), plain=lambda: plant)
    area = VoxelHeat(space, Part(Modality.AREA, "y"), rng.random(len(voxels)).astype(np.float32), regional=True)
    conditions = [heard(space, rng.uniform(0, 3, (2, 3))), heard(space, rng.uniform(0, 3, (1, 3)), 0.4), area]
    likely = dict[tuple[bool, ...], float]()
    for colour, *which in itertools.product([False, True], repeat=4):
        said = [one for one, is_said in zip(conditions, which, strict=True) if is_said]
        goals = Heatmap(space, (coloured if colour else plant, *said)).goals(9)
        each = [goal.probability for goal in goals] or [0.0]
        assert each == sorted(each, reverse=True)
        likely[colour, *which] = each[0]
    for more, fewer in itertools.product(likely, repeat=2):
        if all(a >= b for a, b in zip(more, fewer, strict=True)):
            assert likely[more] <= likely[fewer] + 1e-9


@given(st.integers(0, 2**32 - 1), st.booleans())
def test_no_two_goals_lie_within_one_thing(seed: int, has_context: bool) -> None:
    rng = np.random.default_rng(seed)
    voxels = np.unique(rng.integers(0, 20, (150, 3)), axis=0).astype(np.int32)
    space = Space(GridSpec(0.05), voxels, np.array([0.0, 0.0, 1.0]))
    instance = np.unique((voxels[:, 0] // 5) * 4 + rng.integers(0, 2, len(voxels)), return_inverse=True)[1]
    thing = things(space, np.ones(len(voxels), bool), instance, rng.uniform(0.1, 1.0, 8))
    dog = heard(space, rng.uniform(0, 1, (1, 3)))
    goals = (Heatmap.of(thing) * Heatmap.of(dog) if has_context else Heatmap.of(thing)).goals(top=10)
    assert goals
    places = np.array([goal.position for goal in goals])
    own = thing.instance[[np.argmin(np.linalg.norm(thing.anchors - place, axis=1)) for place in places]]
    for number in own:
        points = thing.anchors[thing.instance == number]
        inside = (places >= points.min(axis=0) - 1e-6) & (places <= points.max(axis=0) + 1e-6)
        assert inside.all(axis=1).sum() == 1


def test_a_sound_decides_between_two_chairs() -> None:
    for x, y, nearest in ((0.3, 0.6, (0.6, 0.6)), (5.0, 3.1, (5.1, 3.1))):
        m = furnished_map(sounds=sounds_of([track(x, y, length_m=0.2)], [0.9]))
        heat = m.object("chair", primary=True) * m.sound("dog")
        best = heat.goals()[0]
        assert best.position[:2] == pytest.approx(nearest, abs=0.15)
        assert best.parts["object"] == 1.0
        assert best.parts["sound"] == pytest.approx(0.9, abs=0.1)
        assert heat.found


def test_the_best_goal_of_certain_instances_is_nearly_the_hottest_place() -> None:
    m = furnished_map(sounds=sounds_of([track(1.0, 2.0), track(4.0, 1.0)], [0.9, 0.7]))
    heat = m.object("chair", primary=True) * m.sound("dog")
    goal = heat.goals()[0]
    assert 0.8 * heat.peak - 1e-6 <= goal.parts["object"] * goal.parts["sound"] <= heat.peak + 1e-6
    assert goal.score == pytest.approx(heat.peak * heat.lead.confidence.max(), abs=0.001)


def test_a_stray_voxel_at_the_edge_of_a_thing_is_not_the_goal() -> None:
    block = np.stack(np.meshgrid(range(10), range(10), range(8), indexing="ij"), axis=-1).reshape(-1, 3)
    stray = np.array([[10 + k, 0, 0] for k in range(6)])  # a trail along the floor, towards the sound
    voxels = np.concatenate([block, stray]).astype(np.int32)
    space = Space(GridSpec(0.05), voxels, np.array([0.0, 0.0, 1.0]))
    chair = things(space, np.ones(len(voxels), bool), np.zeros(len(voxels), int), np.ones(1))
    dog = heard(space, np.array([[1.5, 0.0, 0.2]]))
    goal = (Heatmap.of(chair) * Heatmap.of(dog)).goals()[0]
    assert goal.position[0] < 0.5 and goal.position[2] > 0.1


@given(st.integers(0, 2**32 - 1))
def test_a_goal_on_a_thing_is_one_of_its_own_voxels(seed) -> None:
    rng = np.random.default_rng(seed)
    voxels = np.unique(rng.integers(0, 30, (200, 3)), axis=0).astype(np.int32)
    space = Space(GridSpec(0.05), voxels, np.array([0.0, 0.0, 1.0]))
    mask = rng.random(len(voxels)) < 0.3
    mask[0] = True
    instance = rng.integers(0, 3, mask.sum())
    instance[:1] = 2
    thing, sound = things(space, mask, instance, np.full(3, 0.7)), heard(space, rng.uniform(0, 1.5, (2, 3)))
    for goal in (Heatmap.of(thing) * Heatmap.of(sound)).goals(top=5):
        assert np.linalg.norm(thing.anchors - goal.position, axis=1).min() < 1e-9
        assert goal.parts["object"] == pytest.approx(1.0)


@given(st.floats(0.3, 0.9))
def test_a_goal_is_on_the_thing_where_the_context_ends_beside_it(reach_m) -> None:
    thing, floor = np.array([[k, 0, 0] for k in range(4)]), np.array([[k, 0, 0] for k in range(4, 40)])
    space = Space(GridSpec(0.05), np.concatenate([thing, floor]).astype(np.int32), np.array([0.0, 0.0, 1.0]))
    mask = np.arange(len(space)) < len(thing)
    chair = things(space, mask, np.zeros(4, np.int64), np.ones(1))
    place = np.array([[0.2 + reach_m, 0.0, 0.0]])  # its cone ends between the thing and the floor's warm part
    sound = heard(space, place, 1.0 / reach_m)
    heat = Heatmap.of(chair) * Heatmap.of(sound)
    for goal in heat.goals():
        assert goal.position[0] == pytest.approx(0.175)


@given(st.integers(0, 2**32 - 1))
def test_a_thing_is_as_far_in_a_region_as_its_voxels_are(seed) -> None:
    """Heat beside it, behind a wall for example, changes nothing."""
    rng = np.random.default_rng(seed)
    voxels = np.unique(rng.integers(0, 20, (300, 3)), axis=0).astype(np.int32)
    space = Space(GridSpec(0.05), voxels, np.array([0.0, 0.0, 1.0]))
    mask, region = rng.random(len(voxels)) < 0.3, rng.random(len(voxels)).astype(np.float32)
    instance = voxels[mask, 0] // 7  # three slabs
    confidence = rng.uniform(0.5, 1.0, 3)
    thing = things(space, mask, instance, confidence)

    def goals(inside: np.ndarray) -> list[Goal]:
        area = VoxelHeat(space, Part(Modality.AREA, "y"), inside, regional=True)
        return (Heatmap.of(thing) * Heatmap.of(area)).goals(top=3)

    wanted = [confidence[k] * region[mask][instance == k].mean() for k in range(3)]
    assert sorted(goal.score for goal in goals(region)) == pytest.approx(sorted(wanted), abs=0.001)
    beside = np.where(mask, region, np.float32(1.0))
    assert [(goal.position, goal.score) for goal in goals(beside)] == [
        (goal.position, goal.score) for goal in goals(region)
    ]


def test_of_two_regions_both_count_and_a_sound_as_before() -> None:
    m = furnished_map(sounds=sounds_of([track(0.3, 0.6, length_m=0.2)], [0.9]))
    thing = m.object("chair", primary=True)
    even = [Heatmap.of(VoxelHeat(m.space, Part(Modality.AREA, "y"), np.full(len(m.space), share, np.float32),
                                 regional=True)) for share in (0.5, 0.8)]  # fmt: skip
    plain, with_regions = thing * m.sound("dog"), thing * m.sound("dog") * even[0] * even[1]
    assert [goal.position for goal in with_regions.goals()] == [goal.position for goal in plain.goals()]
    assert [goal.score for goal in with_regions.goals()] == pytest.approx(
        [0.4 * goal.score for goal in plain.goals()], abs=0.002
    )


def test_a_sound_alone_is_put_where_it_was_heard_not_at_any_height() -> None:
    m = furnished_map(sounds=sounds_of([track(1.0, 2.0, z=1.3), track(4.0, 1.0, z=0.9)], [0.9, 0.7]))
    first, second = m.sound("dog", primary=True).goals(top=5)
    assert first.position == pytest.approx((1.5, 2.0, 1.3))  # the middle of its track
    assert second.position == pytest.approx((4.5, 1.0, 0.9))
    middles = [sound.track.mean(axis=0) for sound in m.sounds()]  # it is in the room of that, as lists say
    np.testing.assert_allclose(m.sound("dog", primary=True).lead.middles, middles, atol=1e-6)
    assert (first.score, second.score) == pytest.approx((0.9, 0.7))
    assert first.size == pytest.approx((1.0, 0.0, 0.0), abs=1e-6)


def test_two_sounds_at_one_place_are_one_goal() -> None:
    m = furnished_map(sounds=sounds_of([track(1.0, 2.0), track(1.1, 2.2)], [0.9, 0.8]))
    assert len(m.sound("dog", primary=True).goals(top=5)) == 1


def test_a_column_between_anchors_is_put_at_the_height_of_the_lead() -> None:
    m = furnished_map(sounds=sounds_of([track(1.0, 2.0, z=1.3)], [0.9]))
    camera = Part(Modality.IMAGE, "x.png", is_file=True)
    image = Heatmap.of(
        NearAnchors(m.space, camera, 0.2, np.array([[4.0, 2.0, 5.0]]), np.ones(1), np.zeros(1, int), True)
    )
    goal = (m.sound("dog", primary=True) * image).goals()[0]
    assert goal.position[2] == pytest.approx(1.3)
    assert goal.parts["sound"] * goal.parts["image"] == pytest.approx(goal.score)


def test_it_is_not_found_where_the_parts_do_not_come_together() -> None:
    far = furnished_map(sounds=sounds_of([track(30.0, 30.0)], [0.9]))
    heat = far.object("chair", primary=True) * far.sound("dog")
    assert all(factor.found for factor in heat.factors)
    assert not heat.found
    assert heat.goals() == []


def test_it_is_not_found_where_one_part_is_not() -> None:
    m = furnished_map(sounds=sounds_of([track(0.5, 0.5)], [0.05]))
    heat = m.object("chair", primary=True) * m.sound("dog")
    assert not heat.found
    assert heat.goals()[0].score < 0.5


@pytest.mark.parametrize("found_at", [0.0, 0.3, 0.9, 1.0])
def test_the_limit_of_found_is_a_setting(found_at: float) -> None:
    m = asked(furnished_map(sounds=sounds_of([track(0.5, 0.5)], [0.9])), settings=QuerySettings(found_at=found_at))
    for heat in (m.object("chair", primary=True), m.sound("dog"), m.object("chair", primary=True) * m.sound("dog")):
        assert heat.found == (heat.probability >= found_at)
    answer = m.ask(Question.of([Part(Modality.OBJECT, "chair"), Part(Modality.SOUND, "dog")]))
    assert answer.found == (answer.probability >= found_at)
    unsaid = [one for one in answer.parts if not one.found and "is found by itself" not in answer.text]
    assert not answer.found or not unsaid, "what is not found by itself is told"


@pytest.mark.parametrize("found_at", [0.0, 1e-9, 0.5])
def test_where_there_is_no_goal_nothing_is_found_at_any_limit(found_at: float) -> None:
    m = asked(furnished_map(sounds=sounds_of([], [])), settings=QuerySettings(found_at=found_at))
    answer = m.ask(Question.of([Part(Modality.SOUND, "dog")]))
    assert not answer.goals and not answer.found and answer.text == "No sound of dog is found."


def test_a_limit_outside_of_probabilities_is_refused() -> None:
    with pytest.raises(QueryError, match="between 0 and 1"):
        QuerySettings(found_at=1.5)


@pytest.mark.parametrize("primary", [True, False])
def test_heat_alone_never_makes_an_absent_thing_found(primary: bool) -> None:
    heat = furnished_map(sounds=sounds_of([track(1.0, 2.0)], [0.49])).sound("dog", primary)
    assert not heat.found
    assert "the best score is 0.49, below 0.50" in heat.factors[0].note


def test_a_second_part_of_a_modality_has_a_name_of_its_own() -> None:
    m = furnished_map()
    heat = m.object("chair", primary=True) * m.object("table") * m.object("floor")
    assert list(heat.goals()[0].parts) == ["object", "object_2", "object_3"]


def test_sizes_lie_along_the_level_frame() -> None:
    tilted = np.array([0.0, -1.0, 0.0])  # a camera's world: up is -y
    column = np.stack([np.zeros(20), np.arange(20), np.zeros(20)], axis=1).astype(np.int32)
    space = Space(GridSpec(0.05), column, tilted)
    part = Part(Modality.SOUND, "dog", Role.PRIMARY)
    anchors = np.array([[0.0, 0.0, 0.0], [0.0, 0.5, 0.0]])
    heat = Heatmap.of(NearAnchors(space, part, 2.0, anchors, np.ones(2), np.zeros(2, int), True))
    assert heat.goals()[0].size == pytest.approx((0.0, 0.0, 0.5))


@given(st.integers(0, 2**32 - 1), st.sampled_from([0, 1, 2, 30]))
def test_modes_lead_uphill_to_a_local_maximum(seed, count) -> None:
    rng = np.random.default_rng(seed)
    points, score = rng.uniform(0, 4, (count, 2)), rng.choice([0.2, 0.5, 0.9], count)
    group = modes(points, score, 1.0)
    assert group.shape == (count,)
    for k in range(count):
        peak = score[group == group[k]].max()
        assert score[k] <= peak
        near = np.linalg.norm(points - points[k], axis=1) <= 1.0
        assert score[near].max() <= peak + 1e-12 or score[k] < score[near].max()
    assert not count or group[np.argmax(score)] == 0
