"""Make the file of ``sounds=efficientat``: ``python -m training.light.efficientat --help``."""

import csv
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import onnx
import torch
import tyro
from training.sounds.clips import read_index
from training.sounds.efficientat import EfficientAT, opinion, read_efficientat
from training.sounds.mixtures import of_training, read_audio

from avlmaps.core.progress import progress, say
from avlmaps_models.light import efficientat as backend

ROOT = Path(__file__).resolve().parents[2]
_OPSET = 17


@dataclass(frozen=True)
class Options:
    """What to make, and from what."""

    weights: Path
    """The published checkpoint, for example mn04_as_mAP_432.pt."""
    names: Path
    """AudioSet's class_labels_indices.csv."""
    out: Path
    """Folder of models: the file is written into DIR/efficientat/mn04_as.onnx."""
    sounds: Path = ROOT.parent / "shared" / "data" / "sounds"
    """Clips by which the usual log-odds of each name are taken, with an index.csv."""


def main(options: Options) -> None:
    """Write the network with its names and their usual log-odds, and compare what both say of some clips."""
    net = read_efficientat(options.weights)
    clips = of_training(tuple(read_index(options.sounds)), without=0)
    length = round(backend.STEP_S * backend.RATE_HZ)
    heard = [read_audio(options.sounds / clip.path) for clip in progress(clips, "reading", unit="clip")]
    whole = [np.pad(each, (0, max(0, length - len(each))))[:length] for each in heard]
    said = opinion(net, whole)
    path = options.out / backend.MODEL
    path.parent.mkdir(parents=True, exist_ok=True)
    write(net, read_names(options.names), said.logits.mean(axis=0), path)
    encoder = backend.EfficientATSounds(str(path))
    farthest = max(
        float(np.abs(encoder.logits(encoder.encode_samples(wave)) - logits).max())
        for wave, logits in zip(whole[:50], said.logits, strict=False)
    )
    say(f"{path}: {path.stat().st_size / 1e6:.1f} MB; log-odds of 50 clips differ by at most {farthest:.1e}")


def read_names(path: Path) -> list[str]:
    """Return AudioSet's names in the order of the network's outputs."""
    with path.open(newline="", encoding="utf-8") as stream:
        return [row["display_name"] for row in csv.DictReader(stream)]


def write(net: EfficientAT, names: list[str], centres: np.ndarray, path: Path) -> None:
    """Write a network as ONNX with its notes inside."""
    example = torch.zeros(1, 1, backend.BANDS, 500)
    torch.onnx.export(
        net, (example,), str(path), input_names=[backend.INPUT], output_names=["features", "logits"],
        dynamic_axes={backend.INPUT: {3: "frames"}}, opset_version=_OPSET, dynamo=False,
    )  # fmt: skip
    model = onnx.load(str(path))
    notes = {backend.NAMES: names, backend.CENTRES: [round(float(c), 3) for c in centres]}
    onnx.helper.set_model_props(model, {key: json.dumps(value) for key, value in notes.items()})
    onnx.save(model, str(path))


if __name__ == "__main__":
    main(tyro.cli(Options))
