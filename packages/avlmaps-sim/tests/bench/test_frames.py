"""The frame benchmark: the kinds of its classes, the reader of its folders, and its arithmetic on known answers."""

import json
from dataclasses import asdict
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.errors import RecordingError
from avlmaps.perception.embedded.pixels import EmbeddedPixels
from avlmaps.perception.embedded.scene_network import DEFAULT_WEIGHTS, SYNTHETIC_WEIGHTS, load_network
from avlmaps.recordings.types import Frame, Ground
from avlmaps_sim.bench import frames
from avlmaps_sim.bench.frames import (
    CAMERA,
    CLASSES,
    KINDS_OF_CLASS,
    MARGIN_PX,
    METRES_A_STEP,
    ONCE,
    SCORED,
    SEVERAL,
    LabelledFolder,
    LabelledFrame,
    Table,
    class_of_kinds,
    class_probabilities,
    class_table,
    measure,
    smooth_depth,
    summary_table,
)
from avlmaps_sim.bench.harness.figures import of_mean
from avlmaps_sim.bench.suites import BenchError, SuiteInputs, run_suite

with pytest.MonkeyPatch.context() as patch:  # training is beside the package, not in it
    patch.syspath_prepend(str(Path(__file__).resolve().parents[4]))
    real = import_module("training.pixels.real")

CHAIR, FLOOR, OTHER_PROP = (CLASSES.index(name) for name in ("chair", "floor", "other prop"))


def write_frame(folder: Path, name: str, label: np.ndarray, depth: np.ndarray | None = None) -> None:
    """Write one frame; its depth is a floor 1.2 m under a level camera, unless one is given."""
    rows = np.arange(CAMERA.height) + 0.5
    below = np.clip(1.2 * CAMERA.fy / np.maximum(rows - CAMERA.cy, 1.0), 0.5, 5.0)
    flat = np.repeat(np.rint(below / METRES_A_STEP).astype(np.uint8)[:, None], CAMERA.width, axis=1)
    cv2.imwrite(str(folder / f"{name}.color.jpg"), np.full((CAMERA.height, CAMERA.width, 3), 90, np.uint8))
    cv2.imwrite(str(folder / f"{name}.depth8.png"), flat if depth is None else depth)
    cv2.imwrite(str(folder / f"{name}.label.png"), label)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return a folder of two frames: one of floor and a chair, one of things without a class."""
    (tmp_path / "frames.csv").write_text("frame,up_x,up_y,up_z\n0001,0,-1,0\n0002,0,-1,0\n")
    label = np.zeros((CAMERA.height, CAMERA.width), np.uint8)
    label[400:470, 20:620] = FLOOR + 1
    label[100:300, 200:400] = CHAIR + 1
    write_frame(tmp_path, "0001", label)
    write_frame(tmp_path, "0002", np.full_like(label, OTHER_PROP + 1))
    return tmp_path


def encoder_of(kinds: tuple[str, ...], said: np.ndarray, several: np.ndarray | None = None):
    """Return an encoder that sees the same in every frame; ``said`` names a kind for each cell of (60, 80).

    ``several``: what it sees at several scales, if that is something else.
    """
    once, often = (
        np.eye(len(kinds), dtype=np.float32)[cells] for cells in (said, said if several is None else several)
    )
    return SimpleNamespace(
        names=kinds,
        see=lambda frame: SimpleNamespace(category=once),
        see_multi_scale=lambda frame: SimpleNamespace(category=often),
    )


@pytest.mark.parametrize("weights", [DEFAULT_WEIGHTS, SYNTHETIC_WEIGHTS])
def test_every_kind_of_the_encoders_belongs_to_one_class(weights: str) -> None:
    listed = [kind for kinds in KINDS_OF_CLASS.values() for kind in kinds]
    assert len(listed) == len(set(listed))
    assert set(load_network(weights).notes.categories) <= set(listed)
    assert tuple(KINDS_OF_CLASS) == CLASSES and len(CLASSES) == 40
    assert all(KINDS_OF_CLASS[name] for name in CLASSES)


def test_an_encoder_that_is_right_is_right_in_every_figure(folder: Path) -> None:
    kinds = ("floor", "office chair", "wall")
    said = np.zeros((60, 80), int)
    said[10:40, 22:54] = 1
    figures = measure(encoder_of(kinds, said), LabelledFolder(folder))[SEVERAL]  # pyright: ignore[reportArgumentType]
    assert (figures.accuracy, figures.class_accuracy, figures.mean_iou) == (1.0, 1.0, 1.0)
    assert figures.confusion.sum() == 35 * 300 + 100 * 100
    (row,) = summary_table({"once": figures})["rows"]
    assert row[0] == 2 and row[-2:] == [2, "once"]
    assert len(LabelledFolder(folder, 1)) == 1 and len(LabelledFolder(folder, 600)) == 2


def test_a_chair_taken_for_floor_costs_what_it_covers(folder: Path) -> None:
    wrong, right = np.zeros((60, 80), int), np.zeros((60, 80), int)
    right[10:40, 22:54] = 1
    both = measure(encoder_of(("floor", "chair"), wrong, right), LabelledFolder(folder))  # pyright: ignore[reportArgumentType]
    assert both[SEVERAL].accuracy == 1.0
    figures = both[ONCE]
    floor, chair = 35 * 300, 100 * 100
    assert figures.accuracy == pytest.approx(floor / (floor + chair))
    assert figures.class_accuracy == pytest.approx(0.5)
    assert figures.mean_iou == pytest.approx(0.5 * floor / (floor + chair), rel=1e-6)
    rows = {row[0]: row for row in class_table(figures)["rows"]}
    assert rows["chair"][-1] == "floor 1.00" and rows["sofa"][1] == 0


def test_kinds_of_a_class_add_up_against_a_likelier_kind_of_another() -> None:
    kinds = ("sofa", "chair", "armchair", "kettle")
    p = np.tile(np.array([0.3, 0.2, 0.15, 0.35], np.float32), (6, 8, 1))
    summed = class_probabilities(p, kinds, (480, 640))
    assert summed.shape == (480, 640, SCORED)
    assert (summed.argmax(axis=2) == CHAIR).all()
    assert summed.sum(axis=2).max() == pytest.approx(0.65, abs=1e-5)


@given(st.lists(st.sampled_from([k for ks in KINDS_OF_CLASS.values() for k in ks]), min_size=1, max_size=20))
def test_the_sums_of_classes_keep_all_probability_that_is_scored(kinds: list[str]) -> None:
    p = np.full((4, 4, len(kinds)), 1.0 / len(kinds), np.float32)
    scored = float((class_of_kinds(tuple(kinds)) < SCORED).mean())
    np.testing.assert_allclose(class_probabilities(p, tuple(kinds), (12, 16)).sum(axis=2), scored, atol=1e-5)


def test_the_labelled_floor_gives_the_height_of_the_camera(folder: Path) -> None:
    one = LabelledFolder(folder).read(0)
    assert one.floor_is_labelled and one.frame.ground is not None
    assert one.frame.ground.camera_height_m(np.eye(4)) == pytest.approx(1.2, abs=0.03)
    other = LabelledFolder(folder).read(1)
    assert not other.floor_is_labelled and other.frame.ground is not None


def test_steps_of_depth_are_smoothed_and_edges_stay() -> None:
    columns = np.linspace(50.0, 60.0, CAMERA.width)
    value = np.rint(np.tile(columns, (CAMERA.height, 1))).astype(np.uint8)
    value[:, 400:] += 40
    depth = smooth_depth(value)
    truth = (columns + 40 * (np.arange(CAMERA.width) >= 400)) * METRES_A_STEP
    row = depth[240]
    inside = np.r_[20:390, 410:620]
    assert np.abs(row[inside] - truth[inside]).max() < 0.75 * METRES_A_STEP
    assert np.abs(np.diff(row[20:390])).max() < 0.4 * METRES_A_STEP
    assert row[405] - row[395] > 1.4
    assert (depth[:MARGIN_PX] == 0).all() and (depth[:, -MARGIN_PX:] == 0).all()


@pytest.mark.parametrize(
    ("damage", "says"),
    [
        (lambda f: (f / "frames.csv").unlink(), "There is no"),
        (lambda f: (f / "frames.csv").write_text("frame,up_x,up_y,up_z\n"), "names no frame"),
        (lambda f: (f / "frames.csv").write_text("frame,up_x\n0001,0\n"), "Line 2"),
        (lambda f: (f / "frames.csv").write_text("frame,up_x,up_y,up_z\n0001,0,-3,0\n"), "length 3"),
        (lambda f: (f / "0001.depth8.png").unlink(), "missing or damaged"),
        (lambda f: cv2.imwrite(str(f / "0001.label.png"), np.zeros((10, 10), np.uint8)), "480 rows"),
        (lambda f: cv2.imwrite(str(f / "0001.label.png"), np.full((480, 640), 77, np.uint8)), "classes 0 to 40"),
    ],
)
def test_a_damaged_folder_is_refused_in_one_sentence(folder: Path, damage, says: str) -> None:
    damage(folder)
    with pytest.raises(RecordingError, match=says):
        LabelledFolder(folder).read(0)


OWN = Pinhole(300.0, 310.0, 200.0, 110.0, 400, 225)


@pytest.fixture
def own_camera(tmp_path: Path) -> Path:
    """Return a folder of one frame of another camera: 16 bit of depth, a floor 1 m under it, and a chair."""
    rows = np.arange(OWN.height) + 0.5
    below_mm = np.rint(1000.0 * np.clip(1.0 * OWN.fy / np.maximum(rows - OWN.cy, 1.0), 0.5, 5.0)).astype(np.uint16)
    label = np.zeros((OWN.height, OWN.width), np.uint8)
    label[200:] = FLOOR + 1
    label[50:150, 100:200] = CHAIR + 1
    (tmp_path / "frames.csv").write_text("frame,up_x,up_y,up_z\nhall-a,0,-1,0\n")
    (tmp_path / "camera.json").write_text(json.dumps(asdict(OWN)))
    cv2.imwrite(str(tmp_path / "hall-a.color.png"), np.full((OWN.height, OWN.width, 3), 90, np.uint8))
    cv2.imwrite(str(tmp_path / "hall-a.depth.png"), np.repeat(below_mm[:, None], OWN.width, axis=1))
    cv2.imwrite(str(tmp_path / "hall-a.label.png"), label)
    return tmp_path


def test_frames_of_another_camera_are_read_and_scored(own_camera: Path) -> None:
    read = LabelledFolder(own_camera)
    one = read.read(0)
    assert read.camera == one.frame.rig.depth == one.frame.rig.rgb == OWN
    assert one.floor_is_labelled and one.frame.ground is not None
    assert one.frame.ground.camera_height_m(np.eye(4)) == pytest.approx(1.0, abs=0.01)
    said = np.zeros((45, 80), int)
    said[9:31, 19:41] = 1
    figures = measure(encoder_of(("floor", "chair"), said), read)[ONCE]  # pyright: ignore[reportArgumentType]
    assert figures.accuracy == 1.0 and figures.confusion.sum() == 50 * 50 + 13 * 200


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("camera.json", b"{", "is no camera"),
        ("camera.json", b'{"fx": 300}', "needs fx, fy, cx, cy, width and height"),
        ("camera.json", b'{"fx":-1,"fy":1,"cx":0,"cy":0,"width":400,"height":225}', "positive focal lengths"),
        ("camera.json", b'{"fx":300,"fy":300,"cx":0,"cy":0,"width":640,"height":480}', "480 rows and 640 columns"),
        ("hall-a.depth.png", None, "it must be uint16"),
    ],
)
def test_a_damaged_camera_or_depth_is_refused_in_one_sentence(
    own_camera: Path, name: str, content: bytes | None, says: str
) -> None:
    if content is None:
        cv2.imwrite(str(own_camera / name), np.zeros((OWN.height, OWN.width), np.uint8))
    else:
        (own_camera / name).write_bytes(content)
    with pytest.raises(RecordingError, match=says):
        LabelledFolder(own_camera).read(0)


@given(st.integers(20, 900), st.integers(20, 900), st.floats(0.5, 2.0))
def test_a_frame_that_is_learnt_keeps_its_rays_whatever_its_shape(width: int, height: int, focal: float) -> None:
    camera = Pinhole(focal * width, focal * width, 0.4 * width, 0.6 * height, width, height)
    number = np.arange(width * height).reshape(height, width)
    frame = Frame(
        0, "a", 0.0, np.zeros((height, width, 3), np.uint8), number.astype(np.float32) % 60, np.eye(4),
        Rig(camera, camera), Ground(np.array([0.0, -1.0, 0.0]), np.zeros(1), np.array([-1.2])),
    )  # fmt: skip
    shown = real.fitted(LabelledFrame(frame, (number % 41).astype(np.uint8), True), camera)
    assert shown.depth_mm.shape == shown.label.shape == shown.rgb.shape[:2] == (240, 320)
    fx, fy, cx, cy, *up, height_m, is_known = shown.camera
    assert (up, height_m, is_known) == ([0.0, -1.0, 0.0], 1.2, 1.0)
    w, h = round(width * cx / camera.cx), round(height * cy / camera.cy)
    assert max(w / 320, h / 240) == pytest.approx(1.0) and w <= 320 and h <= 240
    assert (shown.label[h:] == 255).all() and (shown.label[:, w:] == 255).all()
    assert not shown.depth_mm[h:].any() and not shown.depth_mm[:, w:].any()
    row, column = np.arange(h) * height // h, np.arange(w) * width // w
    # The pixel that a cell was sampled from lies on the cell's ray, to the width of a cell or of a pixel.
    off_x = (np.arange(w) + 0.5 - cx) / fx - (column + 0.5 - camera.cx) / camera.fx
    off_y = (np.arange(h) + 0.5 - cy) / fy - (row + 0.5 - camera.cy) / camera.fy
    assert np.abs(off_x).max() <= max(1.0 / fx, 1.0 / camera.fx)
    assert np.abs(off_y).max() <= max(1.0 / fy, 1.0 / camera.fy)
    np.testing.assert_array_equal(shown.depth_mm[:h, :w], (number[row[:, None], column] % 60) * 1000)


@given(st.lists(st.integers(0, 3), min_size=1, max_size=200))
def test_held_out_frames_are_whole_blocks_between_gaps(steps: list[int]) -> None:
    numbers = np.cumsum(np.array(steps) + 1)
    for names in (tuple(f"{n:04d}" for n in numbers), tuple(f"hall-{n}" for n in numbers)):
        cut = real.blocks(names)
        assert [row for block in cut for row in block] == list(range(len(names)))
        assert all(len(block) >= real.BLOCK for block in cut[:-1])
    assert all(len(block) == real.BLOCK for block in cut[:-1])  # names without numbers show no gaps


def test_the_suite_needs_a_folder_and_an_encoder_of_kinds(tmp_path: Path, folder: Path) -> None:
    with pytest.raises(BenchError, match="nyuv2"):
        run_suite("frames", SuiteInputs(), tmp_path)
    with pytest.raises(BenchError, match="colours"):
        run_suite("frames", SuiteInputs(nyuv2=folder, profile="colours"), tmp_path)


def test_the_suite_measures_the_chosen_model_not_the_profiles(
    tmp_path: Path, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(BenchError, match="the pixel encoder 'colours'"):
        run_suite("frames", SuiteInputs(nyuv2=folder, models=("pixels=colours",)), tmp_path)
    measured = []

    def run_frames(encoder: EmbeddedPixels, *_: Path | int | None) -> dict[str, Table]:
        measured.append(encoder.card.checksum)
        return {"a table": {"columns": ["a"], "rows": [[1]]}}

    monkeypatch.setattr(frames, "run_frames", run_frames)
    run_suite("frames", SuiteInputs(nyuv2=folder, models=("pixels=embedded-synthetic",)), tmp_path / "out")
    assert measured == [load_network(SYNTHETIC_WEIGHTS).checksum]


@pytest.mark.parametrize("suite", ["words", "sounds"])
def test_suites_of_the_embedded_encoder_refuse_another_model(tmp_path: Path, suite: str) -> None:
    with pytest.raises(BenchError, match="leave out model pixels=colours"):
        run_suite(suite, SuiteInputs(sounds=tmp_path, models=("pixels=colours",)), tmp_path / "out")


@pytest.mark.nightly
def test_the_suite_writes_its_tables_in_every_form(tmp_path: Path, folder: Path) -> None:
    answer = run_suite("frames", SuiteInputs(nyuv2=folder, profile="synthetic"), tmp_path / "out")
    assert set(answer["tables"]) == {"labelled frames", "by class", "by class at several scales"}
    assert [row[-1] for row in answer["tables"]["labelled frames"]["rows"]] == ["once, as in maps", "at several scales"]
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert names == {"frames.json", "frames.md", "frames-labelled-frames.csv", "frames-by-class.csv",
                     "frames-by-class-at-several-scales.csv"}  # fmt: skip
    assert (tmp_path / "out" / "frames-by-class.csv").read_text().startswith("class,pixels,recall,IoU,taken for\n")


@given(st.lists(st.floats(0, 1, width=32), min_size=2, max_size=30))
def test_the_interval_over_frames_holds_their_mean(shares: list[float]) -> None:
    low, high = of_mean(np.array(shares, np.float32))
    assert 0.0 <= low <= np.mean(shares) + 1e-6 and np.mean(shares) - 1e-6 <= high <= 1.0
