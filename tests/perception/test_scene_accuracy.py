"""What the shipped weights recognise: rendered rooms under several sensors, and real frames of two cameras."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from avlmaps.core.camera import Pinhole, Rig
from avlmaps.perception.embedded.pixels import EmbeddedPixels
from avlmaps.perception.embedded.scene_network import DEFAULT_WEIGHTS, SYNTHETIC_WEIGHTS, SceneNetwork, load_network
from avlmaps.recordings.open import open_recording
from avlmaps.recordings.types import Frame, Ground
from avlmaps_sim.bench.frames import CLASSES, ONCE, LabelledFolder, class_of_kinds, measure
from avlmaps_sim.render import Renderer, View
from avlmaps_sim.scenes import open_scene
from avlmaps_sim.sensor import CLEAN, KINECT, Sensor, SensorSettings
from avlmaps_sim.walk import random_views

WEIGHTS = (DEFAULT_WEIGHTS, SYNTHETIC_WEIGHTS)
CAMERA = Pinhole(260.0, 260.0, 160.0, 120.0, 320, 240)
Views = list[tuple[Frame, np.ndarray]]


@cache
def rendered(scene_name: str, count: int) -> tuple[np.ndarray, list[tuple[np.ndarray, View]]]:
    """Return the names of what is in a home that no network saw, and poses with what is truly seen from them."""
    scene = open_scene(scene_name)
    renderer, names = Renderer(scene), np.array([*scene.categories, ""])
    poses = random_views(scene, np.random.default_rng(0), count, CAMERA)
    return names, [(pose, renderer.render(CAMERA, pose)) for pose in poses]


def views_of(scene_name: str, sensor: SensorSettings, count: int) -> Views:
    """Return views of a home under a sensor, and what each pixel truly shows."""
    names, seen = rendered(scene_name, count)
    rng, frames = np.random.default_rng(0), []
    for number, (pose, view) in enumerate(seen):
        rgb, depth_m = Sensor(sensor).spoil(view, CAMERA, rng)
        ground = Ground(np.array([0.0, 0.0, 1.0]), np.zeros(1), np.zeros(1))
        frame = Frame(number, str(number), 0.0, rgb, depth_m, pose, Rig(CAMERA, CAMERA), ground)
        frames.append((frame, names[view.category]))
    return frames


def share_right(network: SceneNetwork, views: Views) -> float:
    """Return the share of cells nearer than 4 m whose likeliest kind is the true one."""
    kinds, right, known = np.array(network.notes.categories), 0, 0
    for frame, truth in views:
        seen = network.see(frame)
        h, w = seen.category.shape[:2]
        rows, columns = ((np.arange(n) + 0.5) * size / n for n, size in ((h, 240), (w, 320)))
        at = np.ix_(rows.astype(int), columns.astype(int))
        near = (frame.depth_m[at] > 0) & (frame.depth_m[at] < 4.0) & np.isin(truth[at], kinds)
        right += int((kinds[seen.category.argmax(axis=2)] == truth[at])[near].sum())
        known += int(near.sum())
    return right / known


@pytest.fixture(scope="module", params=[CLEAN, KINECT], ids=["clean", "kinect"])
def home(request: pytest.FixtureRequest) -> Views:
    return views_of("house:1200003:held-out", request.param, 16)


@pytest.mark.nightly
@pytest.mark.parametrize("weights", WEIGHTS)
def test_two_thirds_of_a_new_home_are_recognised_under_either_sensor(home: Views, weights: str) -> None:
    assert share_right(load_network(weights), home) > 0.66


@pytest.mark.shared
@pytest.mark.nightly
@pytest.mark.parametrize(("weights", "least"), [(DEFAULT_WEIGHTS, 0.55), (SYNTHETIC_WEIGHTS, 0.33)])
def test_real_frames_of_nyu_are_recognised(shared_data: Path, weights: str, least: float) -> None:
    folder = LabelledFolder(_shared(shared_data / "data" / "nyuv2"))
    folder.names = HELD_OUT
    figures = measure(EmbeddedPixels(load_network(weights)), folder, (ONCE,))[ONCE]
    assert figures.accuracy > least
    assert np.nanmean(figures.recall) > least / 2.5


# Frames of the training split that no weights learnt from (training/pixels/real.py).
HELD_OUT = ("0124", "0146", "0399", "0415", "0427", "0730", "0748", "0997", "1016", "1031", "1357", "1373")  # fmt: skip

# Rectangles (left, top, right, bottom) of two frames of the red kitchen, by eye, and the class that fills them.
KITCHEN = {
    0: {"table": (440, 220, 580, 300), "floor": (40, 300, 120, 440), "chair": (360, 400, 590, 450),
        "cabinet": (40, 120, 160, 210)},
    60: {"cabinet": (110, 240, 340, 360)},
}  # fmt: skip


@pytest.mark.nightly
@pytest.mark.shared
@pytest.mark.parametrize(("weights", "least"), [(DEFAULT_WEIGHTS, 0.6)])
def test_the_real_kitchen_of_another_camera_is_recognised(shared_data: Path, weights: str, least: float) -> None:
    recording = open_recording(_shared(shared_data / "data" / "redkitchen"))
    network = load_network(weights)
    number = class_of_kinds(network.notes.categories)
    # Up from the planes of the whole recording; the first camera was held 1.41 m over the floor.
    up = np.array([0.0065, -0.8934, -0.4493])
    ground = Ground(up / np.linalg.norm(up), np.zeros(1), np.array([-1.41]))
    for index, boxes in KITCHEN.items():
        seen = network.see(replace(recording.frame(index), ground=ground))
        h, w = seen.category.shape[:2]
        for name, (left, top, right, bottom) in boxes.items():
            box = seen.category[top * h // 480 : bottom * h // 480, left * w // 640 : right * w // 640]
            share = float(box[..., number == CLASSES.index(name)].sum(axis=2).mean())
            assert share > least, f"{name} in frame {index}: {share:.2f}"


def _shared(path: Path) -> Path:
    if not path.is_dir():
        pytest.skip(f"needs {path.name} in ../shared/data, which is not part of this repository")
    return path
