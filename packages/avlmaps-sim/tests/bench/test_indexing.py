"""The indexing benchmark: its rules make ambiguous tasks with one right answer, its truth reaches the ceiling."""

import shutil
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.question import Modality, Part
from avlmaps.maps.grid import GridSpec
from avlmaps.query.avlmap import AVLMap
from avlmaps_sim.bench.harness.evidence import MARGIN_M, NEAR_M, Box, Event, Evidence, Photo, alone_near
from avlmaps_sim.bench.harness.factors import WeakSounds, true_regions
from avlmaps_sim.bench.harness.settings import TaskError, save_versioned
from avlmaps_sim.bench.harness.workplace import TrueVoxels
from avlmaps_sim.bench.indexing.runs import (
    LIMITS_M,
    Answered,
    IndexingSettings,
    configurations,
    judged,
    run,
    scored,
)
from avlmaps_sim.bench.indexing.scene_queries import QueriedScene
from avlmaps_sim.bench.indexing.suite import columns, open_tasks, score_others, tables
from avlmaps_sim.bench.indexing.tasks import (
    Task,
    TaskKind,
    TaskSet,
    area_tasks,
    near_sound_tasks,
    photo_tasks,
    sound_tasks,
)
from avlmaps_sim.hearing.sound_library import Synthesised
from avlmaps_sim.mesh import Material
from avlmaps_sim.scene import Area, Scene, SceneBuilder
from avlmaps_sim.shapes import box
from avlmaps_sim.truth import HeardEvent, Truth

PLAIN = Material()
GRID = GridSpec(0.05)
# Two rooms of 5 x 5 m with a door between them at x = 5; everything but the plant stands twice.
THINGS = (
    ("chair", (0.4, 0.4, 0.0), (0.9, 0.9, 0.9)),
    ("chair", (9.0, 4.0, 0.0), (9.5, 4.5, 0.9)),
    ("table", (0.5, 3.6, 0.0), (1.9, 4.6, 0.75)),
    ("table", (8.4, 0.5, 0.0), (9.6, 1.4, 0.75)),
    ("plant", (4.0, 0.3, 0.0), (4.5, 0.8, 1.2)),
)


def rectangle(x0: float, y0: float, x1: float, y1: float) -> np.ndarray:
    return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]], np.float64)


def home(swap: bool = False, moved_m: float = 0.0) -> Scene:
    """A kitchen and a bedroom; ``swap`` exchanges them."""
    kinds = ("bedroom", "kitchen") if swap else ("kitchen", "bedroom")
    areas = [
        Area(kinds[0], rectangle(0, 0, 5, 5), name=kinds[0]),
        Area(kinds[1], rectangle(5, 0, 10, 5), name=kinds[1]),
    ]
    builder = SceneBuilder("home", areas=areas)
    builder.add("floor", box((0, 0, -0.1), (10, 5, 0), PLAIN))
    builder.add("ceiling", box((0, 0, 2.6), (10, 5, 2.7), PLAIN))
    for low, high in (
        ((-0.1, -0.1, 0), (0, 5.1, 2.6)), ((10, -0.1, 0), (10.1, 5.1, 2.6)), ((0, -0.1, 0), (10, 0, 2.6)),
        ((0, 5, 0), (10, 5.1, 2.6)), ((4.95, 0, 0), (5.05, 2, 2.6)), ((4.95, 3.2, 0), (5.05, 5, 2.6)),
    ):  # fmt: skip
        builder.add("wall", box(low, high, PLAIN))
    for category, low, high in THINGS:
        by = np.array([0.0, 0.0, moved_m])
        corners = (tuple(np.array(corner) + by) for corner in (low, high))
        builder.add(category, box(*corners, PLAIN), area=0 if low[0] < 5 else 1)
    return builder.build()


def heard(category: str, place: tuple[float, float, float]) -> HeardEvent:
    return HeardEvent(1.0, 2.0, category, "", place, place, -1)


@dataclass
class _Perfect:
    """A scene whose map holds exactly the voxels of its surfaces, and the evidence that its recording would give."""

    scene: Scene
    asked: QueriedScene
    evidence: Evidence


def perfect(scene: Scene, events: tuple[HeardEvent, ...]) -> _Perfect:
    voxels = TrueVoxels.of(scene, GRID)
    index = np.stack([(voxels.key >> shift) & 0x1FFFFF for shift in (42, 21, 0)], axis=1) - (1 << 20)
    stored = SimpleNamespace(grid=GRID, voxels=SimpleNamespace(index=index), up_in_world=np.array([0.0, 0.0, 1.0]))
    truth = Truth({}, events, scene.objects, scene.areas)
    label = voxels.label(index)
    asked = QueriedScene(AVLMap(stored), None, truth, label, "overlay", lambda task: None)  # pyright: ignore[reportArgumentType]
    seen = np.bincount(label, minlength=len(scene.objects))
    own = tuple(Event(e.category, e.robot) for e in events)
    return _Perfect(scene, asked, Evidence("home", scene.objects, seen, scene.areas, own))


@pytest.fixture(scope="module")
def kitchen_and_bedroom() -> _Perfect:
    return perfect(home(), (heard("snoring", (1.5, 1.5, 1.3)), heard("doorbell", (5.0, 2.5, 1.3))))


def evidence_of(boxes: list[tuple[float, float]], events: tuple[Event, ...] = ()) -> Evidence:
    """Chairs of 0.4 m at these places, all seen."""
    scene = SceneBuilder("made")
    for x, y in boxes:
        scene.add("chair", box((x - 0.2, y - 0.2, 0), (x + 0.2, y + 0.2, 0.9), PLAIN))
    objects = tuple(scene.objects)
    return Evidence("made", objects, np.full(len(objects), 100), (), events)


# The rule of one near thing.

distances = st.lists(st.floats(0.0, 12.0), min_size=1, max_size=6)


@given(distances)
def test_the_one_near_is_near_and_all_others_are_farther_by_the_margin(away: list[float]):
    chosen = alone_near(away)
    clear = [
        i for i, d in enumerate(away) if d <= NEAR_M and all(o - d >= MARGIN_M for j, o in enumerate(away) if j != i)
    ]
    assert ([] if chosen is None else [chosen]) == clear


# The rules of tasks.


def test_a_sound_beside_one_of_two_chairs_makes_a_task_for_that_chair():
    evidence = evidence_of([(0, 0), (6, 0)], (Event("snoring", (5.0, 0.5, 1.3)),))
    (task,) = near_sound_tasks(evidence, np.random.default_rng(0), 10)
    assert task.targets == (evidence.box(1),)
    assert task.rivals == 1
    assert task.sentence == "the chair near the sound of snoring"


@pytest.mark.parametrize(
    ("chairs", "sounds"),
    [
        ([(0, 0)], [(0.5, 0.5)]),  # one chair: its name tells
        ([(0, 0), (4, 0)], [(2.0, 0.0)]),  # in the middle of both
        ([(0, 0), (1.0, 0)], [(0.0, 0.5)]),  # both are near
        ([(0, 0), (9, 0)], [(4.0, 0.0)]),  # near none
        ([(0, 0), (9, 0)], [(0.5, 0.5), (8.5, 0.5)]),  # heard at both
    ],
)
def test_no_task_is_made_where_the_answer_is_not_the_only_one_or_needs_no_sound(chairs, sounds):
    evidence = evidence_of(chairs, tuple(Event("snoring", (x, y, 1.3)) for x, y in sounds))
    assert near_sound_tasks(evidence, np.random.default_rng(0), 10) == []


def test_a_chair_that_the_recording_does_not_show_is_neither_asked_for_nor_a_rival():
    evidence = evidence_of([(0, 0), (6, 0)], (Event("snoring", (5.0, 0.5, 1.3)),))
    for hidden in (0, 1):
        seen = np.where(np.arange(2) == hidden, 0, 100)
        assert near_sound_tasks(replace(evidence, seen=seen), np.random.default_rng(0), 10) == []


def test_what_stands_on_another_storey_is_no_rival():
    evidence = evidence_of([(0, 0), (6, 0), (6, 0)], (Event("snoring", (5.0, 0.5, 1.3)),))
    above = replace(evidence.objects[2], low=(5.8, -0.2, 3.0), high=(6.2, 0.2, 3.9))
    stacked = replace(evidence, objects=(*evidence.objects[:2], above))
    assert near_sound_tasks(stacked, np.random.default_rng(0), 10) == []
    (task,) = near_sound_tasks(replace(stacked, storey_m=(-0.4, 2.6)), np.random.default_rng(0), 10)
    assert task.targets == (evidence.box(1),)


def test_a_sound_heard_at_three_places_of_which_one_is_near_an_object_makes_a_task_for_that_place():
    near, far = (4.6, 0.5, 1.3), (-5.0, 0.0, 1.3)
    passing = tuple((x, 0.5, 1.3) for x in (4.4, 4.6, 4.8))
    twice = (Event("snoring", far), Event("snoring", near, passing))
    assert sound_tasks(evidence_of([(5.5, 0)], twice), np.random.default_rng(0), 10) == [], "a coin would do"
    events = (*twice, Event("snoring", (0.0, 5.0, 1.3)), Event("doorbell", near))
    (task,) = sound_tasks(evidence_of([(5.5, 0)], events), np.random.default_rng(0), 10)
    assert (task.category, task.context, task.rivals) == ("snoring", "chair", 2)
    assert (task.sound_name, task.object_name) == ("snoring", "chair")
    assert task.sentence == "the sound of snoring near the chair"
    assert task.off_m((4.8, 0.5, 0.0)) == 0.0  # anywhere along the way on which the sound was heard
    assert task.off_m((5.5, 0.0, 0.0)) > 0.5  # the object itself is not an answer


@pytest.mark.parametrize(
    "places",
    [
        [(0.5, 0.5)],  # heard once: no context is needed
        [(0.5, 0.5), (0.0, 1.0), (9.0, 0.0)],  # two are near the chair
        [(6.0, 0.0), (9.0, 0.0), (12.0, 0.0)],  # none is
    ],
)
def test_no_task_for_a_sound_is_made_where_the_object_does_not_tell_its_places_apart(places):
    events = tuple(Event("snoring", (x, y, 1.3)) for x, y in places)
    assert sound_tasks(evidence_of([(0, 0)], events), np.random.default_rng(0), 10) == []


def test_a_photo_asks_only_for_what_it_shows():
    evidence = evidence_of([(0, 0), (6, 0)])
    pose = np.eye(4)
    pose[:3, 3] = (4.5, 0.5, 1.3)
    shown, hidden = (Photo(pose, np.array([0.0, share])) for share in (0.2, 0.0))
    (task,) = photo_tasks(evidence, [shown], np.random.default_rng(0), 5)
    assert task.targets == (evidence.box(1),)
    np.testing.assert_array_equal(task.world_from_photo, pose)
    assert photo_tasks(evidence, [hidden], np.random.default_rng(0), 5) == []


@pytest.mark.nightly
def test_an_area_asks_for_what_stands_in_rooms_of_two_kinds(kitchen_and_bedroom: _Perfect):
    tasks = area_tasks(kitchen_and_bedroom.evidence, np.random.default_rng(0), 10)
    asked = {(task.category, task.context) for task in tasks}
    assert asked == {(thing, area) for thing in ("chair", "table") for area in ("kitchen", "bedroom")}
    for task in tasks:
        assert all((target.low[0] < 5) == (task.context == "kitchen") for target in task.targets)


# Figures.


def test_distances_are_horizontal_and_to_the_box():
    target = Box((1.0, 1.0, 0.0), (2.0, 3.0, 1.0))
    assert target.distance_m((1.5, 2.0, 9.0)) == 0.0
    assert target.distance_m((5.0, 7.0, 0.0)) == pytest.approx(5.0)
    assert target.centre_distance_m((1.5, 5.0, 0.0)) == pytest.approx(3.0)


def answered(off_m: float | None) -> Answered:
    task = Task("t", TaskKind.AREA, "s", "chair", "kitchen", (Box((0, 0, 0), (0, 0, 1)),), 1)
    return judged(task, "c", None if off_m is None else (off_m, 0.0, 0.0), 12.0)


def test_recall_counts_answers_within_each_distance_and_no_answer_is_as_far_as_the_scene_is_large():
    score = scored([answered(off) for off in (0.0, 0.4, 0.9, 1.2, None)])
    assert score.hits == (2, 3, 4, 4)
    assert score.recall(LIMITS_M[0]) == pytest.approx(0.4)
    assert score.mean_m == pytest.approx((0.0 + 0.4 + 0.9 + 1.2 + 12.0) / 5)
    assert (score.count, score.answered) == (5, 4)
    assert score.recall_interval(LIMITS_M[0])[0] < 0.4 < score.recall_interval(LIMITS_M[0])[1]


def test_another_system_is_judged_by_saved_tasks_as_ours_is(tmp_path: Path):
    tasks = tuple(
        Task(f"t{x}", TaskKind.AREA, "s", "chair", "kitchen", (Box((x, 0, 0), (x + 1, 1, 1)),), 1) for x in (0, 9)
    )
    save_versioned(TaskSet(IndexingSettings().recorded, ("s",), tasks), tmp_path / "tasks.json")
    read = open_tasks(tmp_path / "tasks.json")
    (table,) = score_others(read, {"t0": (0.5, 1.2, 7.0)}).values()
    chance, yours, _ = (dict(zip(table["columns"], row, strict=True)) for row in table["rows"])
    assert (chance["R@1 < 0.5 m %"], yours["R@1 < 0.5 m %"], yours["answered %"]) == (50.0, 50.0, 50.0)
    assert yours["mean m"] == pytest.approx((0.2 + np.hypot(10, 1)) / 2, abs=0.01)
    (table,) = score_others(read[:1], {}).values()  # a chair 1 m wide, not answered: no hit within 2 m
    assert table["rows"][1][columns().index("R@1 < 2 m %")] == 0.0
    wrongs: list[dict[str, Any]] = [{"t1": (0, 0, 0)}, {"t0": (float("nan"), 0, 0)}, {"t0": ()}, {"t0": "1, 2, 3"}]
    for wrong in wrongs:
        with pytest.raises(TaskError):
            score_others(read, wrong)


# Truth.


@pytest.mark.nightly
def test_every_voxel_of_a_thing_is_labelled_with_it(kitchen_and_bedroom: _Perfect):
    asked, scene = kitchen_and_bedroom.asked, kitchen_and_bedroom.scene
    centres = asked.space.centres
    for instance, thing in enumerate(scene.objects):
        own = centres[asked.label == instance]
        assert (own > np.array(thing.low) - 0.05).all()
        assert (own < np.array(thing.high) + 0.05).all()
        area_m2 = 2 * sum(thing.size[a] * thing.size[b] for a, b in ((0, 1), (1, 2), (0, 2)))
        assert len(own) * 0.05**2 > 0.7 * area_m2


@pytest.mark.nightly
def test_the_true_region_map_is_one_in_the_rooms_asked_for(kitchen_and_bedroom: _Perfect):
    asked = kitchen_and_bedroom.asked
    factor = true_regions(asked.space, Part(Modality.AREA, "kitchen"), asked.truth.areas)
    x, y, _ = asked.space.centres.T
    inner = (x > 0) & (y > 0) & (y < 5)
    np.testing.assert_array_equal(factor.values[inner], (x < 5.1).astype(np.float32)[inner])


def all_tasks(home: _Perfect) -> list[Task]:
    rng = np.random.default_rng(0)
    pose = np.eye(4)
    pose[:3, 3] = (2.0, 2.0, 1.3)
    share = np.full(len(home.scene.objects), 0.1)
    return [
        *area_tasks(home.evidence, rng, 10),
        *near_sound_tasks(home.evidence, rng, 10),
        *sound_tasks(home.evidence, rng, 10),
        *photo_tasks(home.evidence, [Photo(pose, share)] * 3, rng, 10),
    ]


@pytest.mark.nightly
@pytest.mark.parametrize("swap", [False, True])
def test_true_perception_answers_every_task_within_a_voxel(swap: bool):
    places = (
        ("snoring", (1.5, 1.5, 1.3)), ("doorbell", (8.0, 2.0, 1.3)), ("doorbell", (3.5, 0.6, 1.3)),
        ("doorbell", (5.5, 4.8, 1.3)),
    )  # fmt: skip
    made = perfect(home(swap), tuple(heard(*one) for one in places))
    tasks = all_tasks(made)
    assert {task.kind for task in tasks} == set(TaskKind)
    for task in tasks:
        (ceiling,) = [one for one in configurations(task.kind) if one.role == "ceiling"]
        position, found = ceiling.answer(made.asked, task)
        assert position is not None and found
        assert task.off_m(position) <= 0.05


@pytest.mark.nightly
def test_without_context_the_larger_or_equal_thing_wins_whatever_was_heard(kitchen_and_bedroom: _Perfect):
    """The object alone cannot tell: over all area tasks it is right for exactly one of the two rooms."""
    tasks = area_tasks(kitchen_and_bedroom.evidence, np.random.default_rng(0), 10)
    (ceiling,) = [one for one in configurations(TaskKind.AREA) if one.role == "ceiling"]
    alone = replace(ceiling, sources=ceiling.sources[:1])
    offs = [task.off_m(alone.answer(kitchen_and_bedroom.asked, task)[0] or (99.0, 0.0, 0.0)) for task in tasks]
    assert sum(off < 0.5 for off in offs) == len(tasks) / 2


# Files.


@pytest.mark.nightly
def test_a_whole_run_makes_tables_and_a_second_one_makes_nothing_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    few = WeakSounds.learnt(np.random.default_rng(0), Synthesised().categories[::12])  # the ear has a test of its own
    monkeypatch.setattr("avlmaps_sim.bench.harness.factors.weak_ear", lambda seed: few)
    opened: list[str] = []

    def open_spec(spec: str) -> Scene:
        opened.append(spec)
        return home()

    settings = IndexingSettings(
        scenes=("home",),
        profile="colours",
        frames=20,
        sources=2,
        ambiguous=0,
        tasks_a_scene=2,
        jobs=1,
        save=tmp_path / "tasks.json",
    )
    first = run(settings, tmp_path / "work", open_spec)
    assert opened == ["home"]
    opened.clear()
    second = run(replace(settings, load=settings.save, save=None), tmp_path / "work", open_spec)
    assert opened == []
    assert second.tasks == first.tasks
    assert second.scenes[0].answers == first.scenes[0].answers
    (tmp_path / "other").mkdir()
    shutil.copytree(tmp_path / "work", tmp_path / "other" / "work")
    for photo in (tmp_path / "other").rglob("photos"):
        shutil.rmtree(photo)
    for answers in (tmp_path / "other").rglob("answers-*.json"):
        answers.unlink()
    with pytest.raises(TaskError, match="no longer the scene"):
        run(replace(settings, save=None), tmp_path / "other" / "work", lambda spec: home(swap=True, moved_m=0.5))
    assert set(first.weights) == {"pixels", "sounds", "local", "place", "matcher"}
    recorded = replace(first.tasks.recorded, sounds="esc")
    heard_clips = tables(replace(first, tasks=replace(first.tasks, recorded=recorded)))["Clips that were heard"]
    assert sum(row[1] for row in heard_clips["rows"]) == len(first.scenes[0].clips) > 0
    made = tables(first)
    by_name = {row[0]: row for row in made["Table III: an object in an area"]["rows"]}
    asked = sum(task.kind is TaskKind.AREA for task in first.tasks.tasks)
    assert asked > 0
    assert by_name["true perception"][1:3] == [asked, 100.0]
    assert 0.0 < by_name["chance: one of the candidates"][2] < 100.0
    photos = {row[0]: row for row in made["Table V: an object near a photo"]["rows"]}
    (centre,) = [name for name in photos if name.endswith(", by the centre")]
    assert photos[centre][2] <= photos[centre.removesuffix(", by the centre")][2]
    assert any("paper" in name for name in by_name)
    answers = [replace(one, off_m=off, found=off < 0.5) for one in first.scenes[0].answers for off in (0.1, 0.2, 0.9)]
    told = tables(replace(first, scenes=(replace(first.scenes[0], answers=tuple(answers)),)))["Ours reported as found"]
    counted = {kind: sum(task.kind is kind for task in first.tasks.tasks) for kind in TaskKind}
    photo = list(TaskKind).index(TaskKind.PHOTO)  # "colours" has no models for the areas of the first row
    wanted = [2 * counted[TaskKind.PHOTO], 100.0, counted[TaskKind.PHOTO], 0.0]
    assert counted[TaskKind.PHOTO] > 0
    assert [told["rows"][photo][column] for column in (1, 2, 4, 5)] == wanted
