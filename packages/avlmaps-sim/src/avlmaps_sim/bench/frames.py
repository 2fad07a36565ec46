"""The frame benchmark: what the pixel encoder recognises in single labelled frames, without any map.

Each of our kinds belongs to one of the classes (``avlmaps_sim.bench.nyu``); the likeliest of the 37 scored classes, by
the sum of its kinds' probabilities, is the answer for a pixel. Every second pixel is scored where it has one of the 37.
Up is the data set's. The floor is the median height of the labelled floor where that has 800 of 640x480 pixels or
more, else the one that ``find_ground`` estimates from the frame alone, as a build does from all frames.

Frames are measured twice: seen once, as maps see each of their many frames, and at several scales and mirrored
(``perception.embedded.multi_scale``), as single frames are best seen.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from jaxtyping import Float32, Int, UInt8

from avlmaps.core.progress import progress
from avlmaps.perception.embedded.pixels import EmbeddedPixels
from avlmaps_sim.bench.harness.intervals import of_mean
from avlmaps_sim.bench.labelled_folder import LabelledFolder
from avlmaps_sim.bench.nyu import CLASSES, SCORED, class_of_kinds

STEP = 2
# How frames are seen.
ONCE, SEVERAL = "once, as in maps", "at several scales"
Table = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class FrameFigures:
    """Results over all frames.

    Rows of ``confusion`` are true classes; ``floors_labelled`` counts the frames whose labels gave the floor.
    """

    confusion: Int[np.ndarray, "37 37"]
    frames: int
    floors_labelled: int
    right_by_frame: Float32[np.ndarray, " n"]

    @property
    def accuracy(self) -> float:
        """Share of pixels that are right."""
        return float(np.trace(self.confusion) / max(1, self.confusion.sum()))

    @property
    def recall(self) -> Float32[np.ndarray, " 37"]:
        """Share of each class's pixels that are right; NaN for a class that does not occur."""
        truth = self.confusion.sum(axis=1)
        return np.where(truth > 0, np.diag(self.confusion) / np.maximum(truth, 1), np.nan).astype(np.float32)

    @property
    def iou(self) -> Float32[np.ndarray, " 37"]:
        """Intersection over union of each class; NaN for a class that does not occur."""
        truth, right = self.confusion.sum(axis=1), np.diag(self.confusion)
        union = truth + self.confusion.sum(axis=0) - right
        return np.where(truth > 0, right / np.maximum(union, 1), np.nan).astype(np.float32)

    @property
    def class_accuracy(self) -> float:
        """Mean recall of the classes that occur."""
        return float(np.nanmean(self.recall))

    @property
    def mean_iou(self) -> float:
        """Mean IoU of the classes that occur."""
        return float(np.nanmean(self.iou))


def class_probabilities(
    probability: Float32[np.ndarray, "hc wc k"], kinds: tuple[str, ...], size: tuple[int, int]
) -> Float32[np.ndarray, "h w 37"]:
    """Return the sums over each scored class's kinds, spread over a picture of a size (rows, columns)."""
    number = class_of_kinds(kinds)
    group = np.zeros((len(kinds), len(CLASSES)), np.float32)
    group[np.arange(len(kinds)), number] = 1.0
    summed = probability @ group[:, :SCORED]
    return np.asarray(cv2.resize(summed, size[::-1], interpolation=cv2.INTER_LINEAR), np.float32)


def measure(
    encoder: EmbeddedPixels, folder: LabelledFolder, seen: Sequence[str] = (ONCE, SEVERAL)
) -> dict[str, FrameFigures]:
    """Score every frame of a folder, by default as seen once and as seen at several scales."""
    modes = {mode: {ONCE: encoder.see, SEVERAL: encoder.see_multi_scale}[mode] for mode in seen}
    counts: dict[str, list[Int[np.ndarray, "37 37"]]] = {mode: [] for mode in modes}
    labelled = 0
    for number in progress(range(len(folder)), "frames"):
        one = folder.read(number)
        labelled += one.floor_is_labelled
        for mode, see in modes.items():
            said = class_probabilities(see(one.frame).category, encoder.names, one.label.shape).argmax(axis=2)
            counts[mode].append(_confusion(one.label, said))
    return {mode: _figures(own, labelled) for mode, own in counts.items()}


def _confusion(label: UInt8[np.ndarray, "h w"], said: Int[np.ndarray, "h w"]) -> Int[np.ndarray, "37 37"]:
    truth, said = label[::STEP, ::STEP].astype(np.int64) - 1, said[::STEP, ::STEP]
    scored = (truth >= 0) & (truth < SCORED)
    return np.bincount(truth[scored] * SCORED + said[scored], minlength=SCORED**2).reshape(SCORED, SCORED)


def _figures(counts: Sequence[Int[np.ndarray, "37 37"]], labelled: int) -> FrameFigures:
    shares = [np.trace(own) / own.sum() for own in counts if own.any()]
    return FrameFigures(np.sum(counts, axis=0), len(counts), labelled, np.array(shares, np.float32))


def run_frames(encoder: EmbeddedPixels, folder: Path) -> dict[str, Table]:
    """Return the tables of a folder of labelled frames.

    Raises:
        RecordingError: the folder has no index, or a frame cannot be read.
    """
    figures = measure(encoder, LabelledFolder(folder))
    return {
        "labelled frames": summary_table(figures),
        "by class": class_table(figures[ONCE]),
        "by class at several scales": class_table(figures[SEVERAL]),
    }


def summary_table(figures: Mapping[str, FrameFigures]) -> Table:
    """Return a row for each way of seeing: frames, pixels and the three means, the first with its interval."""
    columns = [
        "frames", "floor labelled", "pixels scored", "pixel accuracy", "mean over frames, 95 %", "class accuracy",
        "mean IoU", "classes", "seen",
    ]  # fmt: skip
    return {"columns": columns, "rows": [_summary(mode, one) for mode, one in figures.items()]}


def _summary(mode: str, figures: FrameFigures) -> list[Any]:
    low, high = of_mean(figures.right_by_frame)
    return [
        figures.frames, figures.floors_labelled, int(figures.confusion.sum()),
        f"{figures.accuracy:.3f}", f"{low:.3f}-{high:.3f}", f"{figures.class_accuracy:.3f}", f"{figures.mean_iou:.3f}",
        int((figures.confusion.sum(axis=1) > 0).sum()), mode,
    ]  # fmt: skip


def class_table(figures: FrameFigures) -> Table:
    """Return for each class its pixels, recall, IoU, and what it is mostly taken for."""
    rows, truth = [], figures.confusion.sum(axis=1)
    for number, name in enumerate(CLASSES[:SCORED]):
        if not truth[number]:
            rows.append([name, 0, "-", "-", "-"])
            continue
        mistaken = figures.confusion[number].copy()
        mistaken[number] = 0
        most = [k for k in np.argsort(-mistaken, kind="stable")[:3] if mistaken[k] >= 0.03 * truth[number]]
        taken = ", ".join(f"{CLASSES[k]} {mistaken[k] / truth[number]:.2f}" for k in most)
        rows.append([
            name, int(truth[number]), f"{figures.recall[number]:.3f}", f"{figures.iou[number]:.3f}", taken or "-"
        ])  # fmt: skip
    return {"columns": ["class", "pixels", "recall", "IoU", "taken for"], "rows": rows}
