"""Calibration of instances: maps of held-out homes, and the confidence of connected voxels of a name.

The log-odds that they are a true instance are those of their mean probability, plus 0.8 times the logarithm of their
area beside the usual one, plus a bias. The usual areas are the lexicon's sizes. Only the bias is fitted: it is the
largest at which ``PRECISION`` of the pieces with confidence 0.5 are true. Slopes and a bias of each category, fitted
as well, did no better on homes left out (README).
"""

import sys
from collections.abc import Iterator
from contextlib import nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import msgspec
import numpy as np
import tyro
from training.pixels.borrowed import borrowed_furniture
from training.pixels.worlds import FIRST_CALIBRATION_SEED

from avlmaps.core.errors import MapError
from avlmaps.core.lexicon import Entry, EntryKind, lexicon
from avlmaps.core.registry import Kind
from avlmaps.maps.build import build_map
from avlmaps.maps.settings import BuildSettings, KeyframeSettings
from avlmaps.maps.store.map_data import MapData
from avlmaps.perception.embedded.pixels import LARGEST_LOG_AREA, SMALLEST_LOG_AREA, EmbeddedPixels
from avlmaps.perception.embedded.scene_network import DEFAULT_WEIGHTS, InstanceNotes, Notes
from avlmaps.perception.encoders import profile
from avlmaps.perception.models import model_settings, using_models
from avlmaps.query.avlmap import AVLMap
from avlmaps.query.objects import FeatureVoxels, confident_instances
from avlmaps.query.settings import ObjectSettings
from avlmaps.query.words import ClosestWords, EncodedWord
from avlmaps.recordings.open import open_recording
from avlmaps.recordings.types import Recording
from avlmaps_sim.bench.objects import FEWEST_VOXELS, GROWN_M, STRUCTURE
from avlmaps_sim.recorder import RecordSettings, record_scene
from avlmaps_sim.scenes import open_scene
from avlmaps_sim.sensor_settings import SensorName
from avlmaps_sim.truth import read_truth

PRECISION = 0.8
SLOPES = (1.0, 0.8)
BIASES = np.arange(-2.0, 3.01, 0.1)
SENSORS: tuple[SensorName, ...] = ("kinect", "clean", "realsense")
# Objects need no keyframes, which cost more than they do.
FEW_KEYFRAMES = BuildSettings(keyframes=KeyframeSettings(translation_m=2.0, rotation_deg=90.0, max_gap_s=30.0))
# A thing of less surface than a mug's has none to speak of along that side.
_THINNEST_M = 0.02


@dataclass(frozen=True)
class Options:
    """What to calibrate on."""

    work: Path = Path("build/pixels/homes")
    """Folder of the recordings and maps."""
    out: Path = Path("build/pixels/eyes")
    """Folder of the weights; the notes are written again."""
    name: Literal["scene_encoder", "scene_encoder_synthetic"] = DEFAULT_WEIGHTS
    """Which: the first network, with the second one that goes with it, or the second alone."""
    furniture: Path | None = None
    """Folder of artists' models that take the places of most pieces (borrowed.py); None for pieces made by rule."""
    homes: int = 12
    """How many held-out homes; every sixth is an office."""
    frames: int = 300
    """Limit of frames of each walk."""

    @property
    def model(self) -> Path:
        """What the eyes are loaded from: the folder with both networks, or the file of the second."""
        return self.out if self.name == DEFAULT_WEIGHTS else self.out / f"{self.name}.onnx"


@dataclass(frozen=True)
class Pieces:
    """Instances of one category in one map: their mean probability and surface, and which are true."""

    category: str
    probability: np.ndarray
    area_m2: np.ndarray
    is_true: np.ndarray


def pieces_of(options: Options, number: int) -> Iterator[Pieces]:
    """Record and map a held-out home and yield the instances of every category."""
    seed, sensor = FIRST_CALIBRATION_SEED + 1000 + number, SENSORS[number % len(SENSORS)]
    recording = options.work / f"{seed}-{sensor}"
    if not (recording / "objects.json").is_file():
        with nullcontext() if options.furniture is None else borrowed_furniture(options.furniture, "held-out"):
            scene = open_scene(f"{'office' if number % 6 == 5 else 'house'}:{seed}:held-out")
        settings = RecordSettings(hearing="none", sensor=sensor, fps=5.0, max_frames=options.frames, workers=1)
        record_scene(scene, recording, settings, seed)
    path = options.work / f"{seed}-{sensor}-{options.name}.avlmap"
    asked = AVLMap(_map_of(open_recording(recording), path, options.model.name))
    encoder = asked.encoders.pixels
    assert isinstance(encoder, EmbeddedPixels)
    things, feature, space = read_truth(recording).objects, asked.data.voxels.feature, asked.space
    rivals = ClosestWords.of(feature, encoder, encoder.vocabulary)
    voxels = FeatureVoxels(space, feature, encoder, rivals, ObjectSettings(least_confidence=0.0))
    for name in encoder.vocabulary:
        if name in STRUCTURE:
            continue
        found = confident_instances(voxels, EncodedWord.of_name(encoder, name))
        count = found.voxel_count
        held = np.zeros(len(space.centres), bool)
        for thing in things:
            if thing.category == name:
                low, high = np.array(thing.low) - GROWN_M, np.array(thing.high) + GROWN_M
                held |= ((space.centres >= low) & (space.centres <= high)).all(axis=1)
        share = np.bincount(found.instance, weights=held[found.rows], minlength=len(count)) / np.maximum(count, 1)
        large = count >= FEWEST_VOXELS // 3
        area = count * space.grid.voxel_size_m**2
        yield Pieces(name, found.mean_probability[large].astype(np.float32), area[large], share[large] >= 0.5)


def _map_of(recording: Recording, path: Path, model: str) -> MapData:
    """Return the map of a recording by the weights as they are now; one that is there already is not made again."""
    eyes = f"trained@{model}"
    chosen = profile("trained").choosing({Kind.PIXELS: eyes, Kind.VIEWS: eyes})
    try:
        return build_map(recording, path, chosen, FEW_KEYFRAMES)
    except MapError:  # by other weights
        return build_map(recording, path, chosen, FEW_KEYFRAMES, overwrite=True)


def usual_area_m2(entry: Entry) -> float | None:
    """Return the surface that is mostly seen of a thing of middle size: three sides of its box."""
    if entry.size_m is None:
        return None
    w, d, h = (float(np.sqrt(max(low, _THINNEST_M) * max(high, _THINNEST_M))) for low, high in entry.size_m)
    return w * h + w * d + d * h


def fit_instances(found: list[Pieces], names: tuple[str, ...]) -> InstanceNotes:
    """Return the notes with the lexicon's areas and the bias that the pieces allow.

    Raises:
        ValueError: at no bias are enough of the confident pieces true.
    """
    entries = {name: lexicon().find(name, EntryKind.THING) for name in names}
    areas = {name: usual_area_m2(entry) for name, entry in entries.items() if entry is not None}
    usual = {name: round(area, 4) for name, area in areas.items() if area is not None}
    unfitted = InstanceNotes(slopes=SLOPES, area_m2=usual)
    odds = np.concatenate([log_odds(one, unfitted) for one in found])
    truth = np.concatenate([one.is_true for one in found])
    allowed = [bias for bias in BIASES if (sure := odds + bias >= 0.0).any() and truth[sure].mean() >= PRECISION]
    if not allowed:
        raise ValueError(f"At no bias are {PRECISION:.0%} of the confident pieces true; the network knows too little.")
    return msgspec.structs.replace(unfitted, default_bias=round(float(max(allowed)), 2))


def log_odds(pieces: Pieces, notes: InstanceNotes) -> np.ndarray:
    """Return the log-odds of pieces before a bias, as ``EmbeddedPixels.instance_probability`` takes them."""
    p = np.clip(pieces.probability, 1e-4, 1 - 1e-4)
    usual_m2 = notes.area_m2.get(pieces.category, notes.default_area_m2)
    size = np.clip(np.log(pieces.area_m2 / usual_m2), SMALLEST_LOG_AREA, LARGEST_LOG_AREA)
    return notes.slopes[0] * np.log(p / (1 - p)) + notes.slopes[1] * size


def calibrate_instances(options: Options) -> None:
    """Map held-out homes, fit, and write the notes again."""
    with using_models(replace(model_settings(), folder=options.model.absolute().parent)):
        pieces = [piece for number in range(options.homes) for piece in pieces_of(options, number)]
    found = [piece for piece in pieces if len(piece.is_true)]
    path = options.out / f"{options.name}.json"
    notes = msgspec.json.decode(path.read_bytes(), type=Notes)
    notes = msgspec.structs.replace(notes, instances=fit_instances(found, notes.categories))
    path.write_bytes(msgspec.json.format(msgspec.json.encode(notes), indent=1) + b"\n")
    true = sum(int(piece.is_true.sum()) for piece in found)
    print(
        f"{true} of {sum(len(p.is_true) for p in found)} instances are true; bias {notes.instances.default_bias}",
        file=sys.stderr,
    )


if __name__ == "__main__":
    calibrate_instances(tyro.cli(Options))
