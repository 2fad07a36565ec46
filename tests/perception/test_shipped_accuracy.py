"""The accuracy of the weights that ship, on a small set that is rendered and synthesised here; random weights fail it.

The floors lie some points below what the weights reach (in brackets, 26 November 2026): they notice a file that was
damaged, exchanged or badly quantised, not the last point. ``avlmaps bench`` measures the accuracy itself.
"""

from dataclasses import replace
from importlib.resources import files

import numpy as np
import pytest

from avlmaps.core.camera import Pinhole, Rig
from avlmaps.perception.embedded.scene_network import SceneNetwork, load_network
from avlmaps.perception.embedded.sounds import EmbeddedSounds
from avlmaps.perception.embedded.words import EmbeddedWords
from avlmaps.recordings.types import Frame, Ground
from avlmaps_sim.bench.words import heldout, places
from avlmaps_sim.hearing.sound_library import Synthesised
from avlmaps_sim.render import Renderer
from avlmaps_sim.scenes import open_scene
from avlmaps_sim.views import random_views
from helpers.onnx_weights import shuffled_weights

WEIGHTS = files("avlmaps.perception.embedded") / "weights"
CAMERA = Pinhole(130.0, 130.0, 80.0, 60.0, 160, 120)
LEAST_PIXELS, LEAST_ROOMS = 0.66, 0.08  # (0.73; rooms 0.125 of 32, and 0.458 of 413 views, 0.443 before)
LEAST_SOUNDS, LEAST_WORDS = 0.7, 0.6  # (0.91 of 32, 0.68 of 355)
Views = list[tuple[Frame, np.ndarray, str]]


@pytest.fixture(scope="module")
def views() -> Views:
    """Views of two held-out homes: the frame, what each pixel truly shows, and the kind of room."""
    made: Views = []
    for name in ("house:1300001:held-out", "house:1300002:held-out"):
        scene, rng = open_scene(name), np.random.default_rng(1)
        renderer, names = Renderer(scene), np.array([*scene.categories, ""])
        for pose in random_views(scene, rng, 9, CAMERA):
            view = renderer.render(CAMERA, pose)
            (kind,) = [area.kind for area in scene.areas if area.contains(pose[None, :2, 3])[0]][:1] or [""]
            ground = Ground(np.array([0.0, 0.0, 1.0]), np.zeros(1), np.zeros(1))
            frame = Frame(len(made), "", 0.0, view.rgb, view.depth_m, pose, Rig(CAMERA, CAMERA), ground)
            made.append((frame, names[view.category], kind))
    return made


def accuracy(network: SceneNetwork, views: Views) -> tuple[float, float]:
    """Return the share of right pixels nearer than 4 m, and of right rooms among views of a kind that is known."""
    kinds, rooms = np.array(network.notes.categories), list(network.notes.rooms)
    right, known, right_rooms = 0, 0, []
    for frame, truth, room in views:
        seen = network.see(frame)
        height, width = seen.category.shape[:2]
        row = ((np.arange(height) + 0.5) * CAMERA.height / height).astype(int)
        column = ((np.arange(width) + 0.5) * CAMERA.width / width).astype(int)
        at = np.ix_(row, column)
        near = (frame.depth_m[at] > 0) & (frame.depth_m[at] < 4.0) & np.isin(truth[at], kinds)
        right += int((kinds[seen.category.argmax(axis=2)] == truth[at])[near].sum())
        known += int(near.sum())
        if room in rooms:
            right_rooms.append(rooms[int(seen.room.argmax())] == room)
    assert len(right_rooms) > 9
    return right / known, float(np.mean(right_rooms))


def untrained(network: SceneNetwork) -> SceneNetwork:
    """Return the network with its weights shuffled."""
    (name,) = [f"{stem}.onnx" for stem in ("scene_encoder", "rooms") if (WEIGHTS / f"{stem}.onnx").is_file()]
    content = shuffled_weights((WEIGHTS / name).read_bytes(), np.random.default_rng(0))
    return SceneNetwork(lambda: content, network.notes)


@pytest.mark.nightly
def test_the_pixel_and_view_weights_recognise_new_homes_and_shuffled_ones_do_not(views: Views) -> None:
    pixels, rooms = accuracy(load_network(), views)
    assert pixels > LEAST_PIXELS
    assert rooms > LEAST_ROOMS
    shuffled_pixels, shuffled_rooms = accuracy(untrained(load_network()), views)
    assert shuffled_pixels < LEAST_PIXELS - 0.2
    assert shuffled_rooms < LEAST_ROOMS


def named_first(encoder: EmbeddedSounds, seed: int = 7_654_321) -> float:
    """Return the share of new synthesised sounds whose own kind has the highest score of all kinds."""
    rng, names = np.random.default_rng(seed), [kind.called[0] for kind in encoder.kinds]
    bank = Synthesised()
    own = [number for number, kind in enumerate(encoder.kinds) if kind.name in bank.categories][::2]
    features = [encoder.encode(bank.draw(encoder.kinds[number].name, rng)[1]) for number in own]
    return float(np.mean(encoder.score_words(features, names).argmax(axis=1) == own))


@pytest.mark.nightly
def test_the_sound_weights_name_new_sounds_and_shuffled_ones_do_not(monkeypatch: pytest.MonkeyPatch, tmp_path) -> None:
    encoder = EmbeddedSounds(folder=tmp_path)
    assert named_first(encoder) > LEAST_SOUNDS
    untrained = EmbeddedSounds(folder=tmp_path)
    content = shuffled_weights((WEIGHTS / "sounds.onnx").read_bytes(), np.random.default_rng(0))
    monkeypatch.setattr(untrained, "_network", content)
    assert named_first(untrained) < LEAST_SOUNDS / 2


def test_the_word_weights_understand_held_out_phrases_and_shuffled_ones_do_not(monkeypatch: pytest.MonkeyPatch) -> None:
    rows = heldout()
    encoder, untrained = EmbeddedWords(), EmbeddedWords()
    assert float((places(encoder, rows) == 0).mean()) > LEAST_WORDS
    table = np.random.default_rng(0).permutation(untrained._weights.table)
    monkeypatch.setattr(untrained, "_weights", replace(untrained._weights, table=table))
    # Phrases that share a word with their label are found whatever the vectors are.
    assert float((places(untrained, rows) == 0).mean()) < LEAST_WORDS - 0.2
