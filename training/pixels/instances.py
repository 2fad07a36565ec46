"""Calibration of instances: maps of held-out homes, and the confidence of connected voxels of a name."""

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import msgspec
import numpy as np
import tyro
from scipy.optimize import minimize
from training.pixels.worlds import FIRST_CALIBRATION_SEED

from avlmaps.bench.objects import FEWEST_VOXELS, GROWN_M, STRUCTURE
from avlmaps.core.errors import MapError
from avlmaps.maps.build import build_map
from avlmaps.maps.store.reader import StoredMap
from avlmaps.perception.embedded.pixels import LARGEST_LOG_AREA, SMALLEST_LOG_AREA, EmbeddedPixels
from avlmaps.perception.embedded.scene_network import DEFAULT_WEIGHTS, SYNTHETIC_WEIGHTS, InstanceNotes, Notes
from avlmaps.query.avlmap import AVLMap
from avlmaps.query.modalities.object import Asked, ObjectSettings, Rivals, object_pieces
from avlmaps.recordings.open import open_recording
from avlmaps.recordings.types import Recording
from avlmaps.sim.recorder import RecordSettings, record_scene
from avlmaps.sim.scenes import open_scene
from avlmaps.sim.truth import read_truth

# How far the categories' biases lie apart: of 1, 0.6, 0.4, 0.25 and 0.1 the one that pieces left out found likeliest.
SPREAD = 0.4


@dataclass(frozen=True)
class Options:
    """Options of the calibration."""

    work: Path = Path("build/pixels/homes")
    """Folder of the recordings and maps."""
    out: Path = Path("src/avlmaps/perception/embedded/weights")
    """Folder of the notes, which are written again."""
    profile: Literal["embedded", "synthetic"] = "embedded"
    """Whose weights."""
    homes: int = 6
    """How many held-out homes."""
    frames: int = 260
    """Frames of each walk."""


@dataclass(frozen=True)
class Pieces:
    """Instances of one category in one map: their mean probability and surface, and which are true."""

    category: str
    probability: np.ndarray
    area_m2: np.ndarray
    is_true: np.ndarray


def pieces_of(folder: Path, seed: int, frames: int, profile: str) -> Iterator[Pieces]:
    """Record and map a held-out home and yield the instances of every category."""
    scene = open_scene(f"{'office' if seed % 6 == 5 else 'house'}:{seed}:held-out")
    recording = folder / f"{seed}"
    if not (recording / "objects.json").is_file():
        settings = RecordSettings(hearing="none", sensor="kinect", max_frames=frames, workers=1)
        record_scene(scene, recording, settings, seed)
    asked = AVLMap(_map_of(open_recording(recording), folder / f"{seed}-{profile}.avlmap", profile))
    encoder = asked.stored.profile.pixel_encoder()
    assert isinstance(encoder, EmbeddedPixels)
    things, feature, space = read_truth(recording).objects, asked.stored.voxels.feature, asked.space
    rivals = Rivals.of(feature, encoder, encoder.vocabulary)
    settings = ObjectSettings(least_confidence=0.0)
    for name in encoder.vocabulary:
        if name in STRUCTURE:
            continue
        pieces = object_pieces(space, feature, encoder, rivals, Asked.of(encoder, name), settings)
        count = np.bincount(pieces.instance, minlength=len(pieces.mean_probability))
        held = np.zeros(len(space.centres), bool)
        for thing in things:
            if thing.category == name:
                low, high = np.array(thing.low) - GROWN_M, np.array(thing.high) + GROWN_M
                held |= ((space.centres >= low) & (space.centres <= high)).all(axis=1)
        share = np.bincount(pieces.instance, weights=held[pieces.mask], minlength=len(count)) / np.maximum(count, 1)
        large = count >= FEWEST_VOXELS // 3
        area = count * space.grid.voxel_size_m**2
        yield Pieces(name, pieces.mean_probability[large], area[large], share[large] >= 0.5)


def _map_of(recording: Recording, path: Path, profile: str) -> StoredMap:
    """Return the map of a recording by the weights as they are now; one that is there already is not made again."""
    try:
        return build_map(recording, path, profile=profile)
    except MapError:  # by other weights
        return build_map(recording, path, profile=profile, overwrite=True)


def fit_instances(found: list[Pieces]) -> InstanceNotes:
    """Return the logistic regression with one bias a category, held near the common one where it was met seldom."""
    names = sorted({one.category for one in found})
    number = np.concatenate([np.full(len(one.is_true), names.index(one.category)) for one in found])
    p = np.clip(np.concatenate([one.probability for one in found]), 1e-4, 1 - 1e-4)
    area, truth = np.concatenate([one.area_m2 for one in found]), np.concatenate([one.is_true for one in found])
    usual = {
        n: float(np.median(area[(number == i) & truth]))
        for i, n in enumerate(names)
        if (truth & (number == i)).sum() >= 2
    }
    common = float(np.median(area[truth]))
    size = np.log(area / np.array([usual.get(n, common) for n in names])[number])
    odds, size = np.log(p / (1 - p)), np.clip(size, SMALLEST_LOG_AREA, LARGEST_LOG_AREA)

    def loss(x: np.ndarray) -> float:
        z = x[2] + x[3 + number] + x[0] * odds + x[1] * size
        return float(np.logaddexp(0.0, np.where(truth, -z, z)).sum() + 0.5 * np.square(x[3:]).sum() / SPREAD**2)

    x = minimize(loss, np.concatenate([[1.0, 0.8, 0.0], np.zeros(len(names))]), method="L-BFGS-B").x
    bias = {name: round(float(x[2] + x[3 + i]), 3) for i, name in enumerate(names)}
    slopes = (round(float(x[0]), 4), round(float(x[1]), 4))
    return InstanceNotes(
        slopes, bias, {n: round(a, 4) for n, a in usual.items()}, round(float(x[2]), 3), round(common, 4)
    )


def calibrate_instances(options: Options) -> None:
    """Map held-out homes, fit, and write the notes again."""
    found = [
        piece
        for number in range(options.homes)
        for piece in pieces_of(options.work, FIRST_CALIBRATION_SEED + 1000 + number, options.frames, options.profile)
        if len(piece.is_true)
    ]
    weights = DEFAULT_WEIGHTS if options.profile == "embedded" else SYNTHETIC_WEIGHTS
    path = options.out / f"{weights}.json"
    notes = msgspec.json.decode(path.read_bytes(), type=Notes)
    notes = msgspec.structs.replace(notes, instances=fit_instances(found))
    path.write_bytes(msgspec.json.format(msgspec.json.encode(notes), indent=1) + b"\n")
    true = sum(int(piece.is_true.sum()) for piece in found)
    print(
        f"{true} of {sum(len(p.is_true) for p in found)} instances are true; {notes.instances.slopes}", file=sys.stderr
    )


if __name__ == "__main__":
    calibrate_instances(tyro.cli(Options))
