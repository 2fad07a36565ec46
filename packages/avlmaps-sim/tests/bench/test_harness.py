"""What the suites share: clips that were not trained on, models, a recording of one's own, regions, output."""

import csv
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.errors import AudioError, BackendError
from avlmaps.core.registry import Kind
from avlmaps.recordings.audio import Sound, write_flac
from avlmaps.recordings.types import Frame
from avlmaps.recordings.writer import RecordingWriter
from avlmaps_sim.bench.harness.evidence import Box
from avlmaps_sim.bench.harness.figures import (
    as_csv,
    chosen_on,
    clip_table,
    in_words,
    outdated,
    paper_figures,
    shown_scene,
    table_markdown,
    write_answer,
)
from avlmaps_sim.bench.harness.own_recording import OwnRecording, is_recording
from avlmaps_sim.bench.harness.settings import (
    TaskError,
    in_turn,
    models_of,
    shipped_checksums,
    unheard_folder,
    unheard_rows,
)
from avlmaps_sim.bench.indexing.runs import PAPER_SIZES, IndexingSettings, run
from avlmaps_sim.bench.indexing.scene_queries import cut_out, mixed, surface_regions
from avlmaps_sim.bench.indexing.tasks import Task, TaskKind
from avlmaps_sim.bench.navigation.missions import NavigationSettings
from avlmaps_sim.bench.navigation.runs import run as run_navigation
from avlmaps_sim.mixing.clips import find_clips
from avlmaps_sim.render import Renderer
from helpers.small_home import furnished

CAMERA = Pinhole(80.0, 80.0, 60.0, 45.0, 120, 90)


# Clips.


def clips(folder: Path, rows: list[tuple[str, str, str]]) -> Path:
    (folder / "a").mkdir(parents=True)
    for path, _, _ in rows:
        write_flac(folder / path, Sound(0.1 * np.ones(800, np.float32), 8000))
    with (folder / "index.csv").open("w", newline="") as stream:
        csv.writer(stream).writerows([("path", "category", "fold"), *rows])
    return folder


def test_clips_with_a_fold_trained_the_encoder_and_are_left_out(tmp_path: Path):
    source = clips(
        tmp_path / "c", [("a/1.flac", "dog bark", "2"), ("a/2.flac", "dog bark", ""), ("a/3.flac", "rain", "5")]
    )
    assert [row["path"] for row in unheard_rows(source)] == ["a/2.flac"]
    made = unheard_folder(source, tmp_path / "work")
    assert [(clip.category, clip.path) for clip in find_clips(made)] == [("dog bark", source / "a/2.flac")]
    assert unheard_folder(source, tmp_path / "work") == made


def test_clips_of_recordings_that_the_weights_name_are_left_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    rows = [("a/4-1234-A-3.flac", "rain", ""), ("a/4-1235-A-3.flac", "rain", ""), ("a/mine.flac", "rain", "")]
    source = clips(tmp_path / "c", rows)
    monkeypatch.setattr("avlmaps_sim.bench.harness.settings.trained_sources", lambda: frozenset({1234}))
    assert [row["path"] for row in unheard_rows(source)] == ["a/4-1235-A-3.flac", "a/mine.flac"]


def test_a_folder_that_does_not_say_what_was_trained_on_is_refused(tmp_path: Path):
    (tmp_path / "bare").mkdir()
    with pytest.raises(AudioError, match="sound_clips=all"):
        unheard_rows(tmp_path / "bare")
    with pytest.raises(AudioError, match="trained on all 1 clips"):
        unheard_rows(clips(tmp_path / "c", [("a/1.flac", "rain", "2")]))


# Models.


def test_a_model_is_chosen_by_its_word():
    assert models_of("embedded", ["views=clip"]).name_of(Kind.VIEWS) == "clip"
    assert models_of("embedded").name_of(Kind.VIEWS) == "embedded"


@pytest.mark.parametrize(
    "words", [["views"], ["eyes=clip"], ["views="], ["views=clip", "views=siglip2"], ["views=none-such"]]
)
def test_a_word_that_chooses_no_model_is_refused(words: list[str]):
    with pytest.raises(BackendError):
        models_of("embedded", words)


def test_weights_are_outdated_where_their_checksum_is_not_the_shipped_one():
    shipped = shipped_checksums()
    assert {"pixels", "views", "sounds", "words"} <= shipped.keys()
    assert outdated(shipped, shipped) == []
    assert outdated({**shipped, "pixels": "other"}, shipped) == ["pixels"]


def test_a_missing_model_is_named_before_anything_is_recorded(tmp_path: Path):
    def never(spec: str):
        raise AssertionError("no scene is needed")

    with pytest.raises(BackendError):
        run(IndexingSettings(scenes=("home",), profile="paper", jobs=1), tmp_path / "work", never)
    assert not (tmp_path / "work").exists()


# Sizes and choices.


def task(scene: str, number: int, kind: TaskKind = TaskKind.AREA) -> Task:
    box = Box((0, 0, 0), (1, 1, 1))
    return Task(f"{scene}/{kind}/{number}", kind, scene, "chair", "kitchen", (box,), 1)


@given(st.lists(st.integers(0, 9), min_size=1, max_size=6), st.integers(0, 30))
def test_tasks_are_taken_from_the_scenes_in_turn_up_to_the_size(counts: list[int], size: int):
    made = [[task(str(scene), number) for number in range(count)] for scene, count in enumerate(counts)]
    taken = in_turn(made, size)
    own = [sum(one.scene == str(scene) for one in taken) for scene in range(len(counts))]
    assert len(taken) == min(size, sum(counts))
    for a, taken_a in enumerate(own):  # a scene gives fewer than another by two only where it has no more
        assert all(taken_a >= taken_b - 1 or taken_a == counts[a] for taken_b in own)
    assert in_turn(made, None) == [one for scene in made for one in scene]


def test_the_sizes_are_the_papers():
    assert (PAPER_SIZES[TaskKind.AREA], PAPER_SIZES[TaskKind.SOUND]) == (100, 119)
    for row in paper_figures("indexing")["tables"]["visual-object"]:  # 159 explains every percentage
        for percent in row["recall_percent"]:
            assert min(abs(100 * hits / PAPER_SIZES[TaskKind.PHOTO] - percent) for hits in range(160)) < 0.015


def test_every_row_of_the_papers_tables_is_there():
    indexing = paper_figures("indexing")["tables"]
    assert [len(indexing[str(kind)]) for kind in (TaskKind.AREA, TaskKind.SOUND, TaskKind.PHOTO)] == [4, 4, 2]
    navigation = paper_figures("navigation")["tables"]
    assert [len(navigation[name]) for name in ("sounds-1", "sounds-2", "sounds-3", "images", "pairs")] == [
        1,
        1,
        1,
        1,
        4,
    ]


def test_choices_made_on_a_scene_are_named_beside_it():
    assert "RoomSettings.views_m" in chosen_on(["house:1000001:held-out", "house:1000011:held-out"])
    assert "(on 1 of the 2 scenes)" in chosen_on(["house:1000001:held-out", "house:1000011:held-out"])
    assert chosen_on(["house:1000011:held-out"]) == ""


# Output.


def test_every_table_is_written_as_json_markdown_and_csv(tmp_path: Path):
    table = {"columns": ["a", "b"], "rows": [["x, y", 1.5], ["p|q", 2]], "chosen on": "the weight."}
    write_answer({"suite": "made", "tables": {"First: one": table}}, tmp_path)
    assert json.loads((tmp_path / "made.json").read_text())["tables"]["First: one"] == table
    with (tmp_path / "made-first-one.csv").open(newline="") as stream:
        assert list(csv.reader(stream)) == [["a", "b"], ["x, y", "1.5"], ["p|q", "2"]]
    assert "p\\|q" in (tmp_path / "made.md").read_text()
    assert "Chosen on the same data: the weight." in table_markdown(table)
    assert as_csv(table).count("\n") == 3


def test_a_heading_says_where_sounds_are_from_and_what_the_encoder_heard():
    recorded = {"sounds": "esc", "clips": "unheard", "frames": 9, "sensor": "clean", "hearing": "overlay"}
    answer = {"profile": "embedded", "seed": 0, "scenes": ["s"], "recorded": recorded, "weights": {"pixels": "a" * 64}}
    assert "esc that the embedded sound encoder was not trained on" in in_words(answer)
    assert "that also made training sounds" in in_words({**answer, "recorded": {**recorded, "sounds": ""}})
    assert "weights not recorded" in in_words({**answer, "weights": {}})


def test_no_place_of_this_machine_is_shown():
    assert shown_scene("/data/mine/house.glb") == "house.glb"
    assert shown_scene("house:7:held-out") == "house:7:held-out"
    table = clip_table([("rain", "/data/esc/b.ogg"), ("rain", "esc/a.ogg"), ("dog bark", "/data/esc/c.ogg")])
    assert table["rows"] == [["dog bark", 1, "c.ogg"], ["rain", 2, "a.ogg, b.ogg"]]


# A recording of one's own.


@pytest.fixture(scope="module")
def own(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A walk through the small home with nothing beside it but boxes."""
    scene, folder = furnished(), tmp_path_factory.mktemp("own") / "REC"
    renderer, rig = Renderer(scene), Rig(CAMERA, CAMERA)
    down = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    with RecordingWriter(folder, rig, up_in_world=np.array([0.0, 0.0, 1.0])) as writer:
        for index in range(40):
            angle, pose = index * 2 * np.pi / 20, np.eye(4)
            turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1.0]])
            pose[:3, :3], pose[:3, 3] = turn @ down, (2.0 if index < 20 else 6.0, 1.7, 1.3)
            view = renderer.render(CAMERA, pose)
            writer.add(Frame(index, f"{index:06d}", index / 4.0, view.rgb, view.depth_m, pose, rig))
    things = [{"category": one.category, "low": one.low, "high": one.high, "area": one.area} for one in scene.objects]
    (folder / "objects.json").write_text(json.dumps(things))
    rooms = [
        {"kind": one.kind, "polygon": one.polygon.tolist(), "floor_m": one.floor_m, "ceiling_m": one.ceiling_m}
        for one in scene.areas
    ]
    (folder / "areas.json").write_text(json.dumps(rooms))
    return folder


def test_every_tenth_frame_of_ones_own_recording_is_a_photo_and_not_in_the_map(own: Path):
    recording = OwnRecording.open(own)
    assert is_recording(str(own))
    assert len(recording.mapped) == 36
    photos = recording.photos(10)
    assert len(photos) == 4
    mapped = {recording.mapped.name(i) for i in range(36)}
    assert recording.whole.name(9) not in mapped
    np.testing.assert_array_equal(recording.picture(photos[0].world_from_camera), recording.whole.frame(9).rgb)
    assert max(photo.share.sum() for photo in photos) > 0.3


@pytest.mark.nightly
def test_ones_own_recording_with_boxes_runs_through_the_tables(own: Path, tmp_path: Path, monkeypatch):
    monkeypatch.setattr("avlmaps_sim.bench.harness.factors._EXAMPLES", 2)
    settings = IndexingSettings(scenes=(str(own),), profile="colours", jobs=1, tasks_a_scene=3, rules="paper")
    outcome = run(settings, tmp_path / "work")
    kinds = {task.kind for task in outcome.tasks.tasks}
    assert kinds <= {TaskKind.AREA, TaskKind.PHOTO}  # no sounds are known
    assert kinds
    ceiling = [one for kind in kinds for one in outcome.answers(kind, "true perception")]
    assert np.median([one.off_m for one in ceiling]) < 0.5
    from avlmaps.maps.store.folder import read
    from avlmaps.query.settings import rules_of

    (path,) = (tmp_path / "work").rglob("colours-paper.avlmap")
    assert rules_of(read(path).info.settings) == "paper"


def test_robots_are_not_sent_through_a_recording(own: Path, tmp_path: Path):
    with pytest.raises(TaskError, match="is a recording"):
        run_navigation(NavigationSettings(scenes=(str(own),), profile="colours", jobs=1), tmp_path)


@pytest.mark.parametrize(
    ("content", "told"),
    [("[]", "lists no thing"), ("{", "cannot be read"), ('[{"category": "chair"}]', "low"),
     ('[{"category": "chair", "low": [1, 1, 1], "high": [0, 0, 0]}]', "lies above")],
)  # fmt: skip
def test_boxes_that_cannot_be_used_are_refused_in_one_sentence(own: Path, tmp_path: Path, content: str, told: str):
    import shutil

    copy = tmp_path / "REC"
    shutil.copytree(own, copy)
    (copy / "objects.json").write_text(content)
    with pytest.raises(TaskError, match=told):
        OwnRecording.open(copy)


def test_a_world_that_is_not_upright_is_refused(own: Path):
    with pytest.raises(TaskError, match="does not point up"):
        OwnRecording.open(own).label(np.zeros((1, 3)), np.array([0.0, 1.0, 0.0]))


# ConceptFusion's regions.


def test_regions_are_surfaces_and_know_no_class(own: Path):
    frame = OwnRecording.open(own).whole.frame(5)
    label = surface_regions(frame)
    assert 2 <= label.max() <= 12
    area = np.bincount(label.ravel())[1:]
    assert (np.diff(area) <= 0).all()  # the largest first
    for number in range(1, int(label.max()) + 1):  # no region bridges a step in depth
        rows, columns = np.nonzero((label[:, 1:] == number) & (label[:, :-1] == number))
        steps_m = np.abs(np.diff(frame.depth_m, axis=1))[rows, columns]
        assert (steps_m <= 0.0401 * frame.depth_m[rows, columns]).all()


def test_a_cut_out_is_a_frame_of_a_smaller_camera(own: Path):
    frame = OwnRecording.open(own).whole.frame(0)
    mask = np.zeros(frame.depth_m.shape, bool)
    mask[20:50, 30:80] = True
    part = cut_out(frame, mask)
    assert part.rgb.shape == (30, 50, 3)
    np.testing.assert_array_equal(part.depth_m, frame.depth_m[20:50, 30:80])
    np.testing.assert_allclose(part.rig.depth.rays(), frame.rig.depth.rays()[20:50, 30:80], atol=1e-12)


@given(st.integers(1, 6), st.integers(0, 99))
def test_a_mixed_feature_is_of_unit_length_and_between_region_and_view(count: int, seed: int):
    rows = np.random.default_rng(seed).normal(size=(count + 1, 8)).astype(np.float32)
    rows /= np.linalg.norm(rows, axis=1, keepdims=True)
    made = mixed(rows[0], rows[1:])
    np.testing.assert_allclose(np.linalg.norm(made, axis=1), 1.0, rtol=1e-5)
    assert (made @ rows[0] >= rows[1:] @ rows[0] - 1e-5).all()
    np.testing.assert_allclose(mixed(rows[0], rows[:1]), rows[:1], atol=1e-6)


def test_settings_name_the_clips_only_where_there_are_some():
    assert IndexingSettings().recorded.clips == "all"
    assert replace(IndexingSettings(), sounds=Path("x")).recorded.clips == "unheard"
