"""Naming the pixels of labelled frames: NYU Depth V2's folder and others in the same layout, against our kinds.

Silberman et al., "Indoor Segmentation and Support Inference from RGBD Images", ECCV 2012; the 40 classes are those of
Gupta et al., "Perceptual Organization and Recognition of Indoor Scenes from RGB-D Images", CVPR 2013. Other data sets
label in the same classes, ScanNet among them.

| file | what |
|---|---|
| `frames.csv` | frame, up_x, up_y, up_z: for each frame up in the axes of its camera (x right, y down), length 1 |
| `NAME.color.jpg` or `.png` | the picture |
| `NAME.depth.png` | 16 bit, millimetres, 0 where there is none; registered to the picture and of its size |
| `NAME.depth8.png` | instead: 8 bit, metres = value / 25.5, in-painted, as NYU's frames are often passed on |
| `NAME.label.png` | 8 bit: class 1 to 40 of `avlmaps_sim.bench.frames`, 0 unlabelled |
| `camera.json` | fx, fy, cx, cy, width, height of all pictures, pixels; without it NYU's camera, 640x480 |

Each of our kinds belongs to one of the classes; the likeliest of the 37 scored classes, by
the sum of its kinds' probabilities, is the answer for a pixel. Every second pixel is scored where it has one of the 37.
Up is the data set's. The floor is the median height of the labelled floor where that has 800 of 640x480 pixels or
more, else the one that ``find_ground`` estimates from the frame alone, as a build does from all frames.

Frames are measured twice: seen once, as maps see each of their many frames, and at several scales and mirrored
(``see_multi_scale``), as single frames are best seen.
"""

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import msgspec
import numpy as np
from jaxtyping import Float, Float32, Int, UInt8

from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.errors import RecordingError
from avlmaps.core.files import DESCRIPTION_BYTES, decode_json, read_regular
from avlmaps.core.progress import progress
from avlmaps.maps.gravity import find_ground
from avlmaps.perception.embedded.pixels import EmbeddedPixels
from avlmaps.recordings.layout import CameraNumbers
from avlmaps.recordings.types import Frame, Ground
from avlmaps_sim.bench.harness.figures import Table, of_mean

CLASSES = (
    "wall", "floor", "cabinet", "bed", "chair", "sofa", "table", "door", "window", "bookshelf", "picture", "counter",
    "blinds", "desk", "shelves", "curtain", "dresser", "pillow", "mirror", "floor mat", "clothes", "ceiling", "books",
    "refrigerator", "tv", "paper", "towel", "shower curtain", "box", "whiteboard", "person", "nightstand", "toilet",
    "sink", "lamp", "bathtub", "bag", "other structure", "other furniture", "other prop",
)  # fmt: skip
# Only these are scored; the other three gather what has no class of its own.
SCORED = 37

# The kinds of each class. Every kind of the embedded pixel encoder stands here once (a test holds that).
KINDS_OF_CLASS: dict[str, tuple[str, ...]] = {
    "wall": ("wall", "partition"),
    "floor": ("floor",),
    "cabinet": ("cabinet", "kitchen cabinet", "wardrobe", "tv cabinet", "filing cabinet", "locker"),
    "bed": ("bed", "bunk bed", "crib"),
    "chair": ("chair", "armchair", "office chair", "stool", "bench"),
    "sofa": ("sofa",),
    "table": ("dining table", "coffee table", "side table", "console table", "pool table"),
    "door": ("door", "folding door"),
    "window": ("window",),
    "bookshelf": ("bookshelf",), "picture": ("picture",),
    "counter": ("kitchen counter", "kitchen island"),
    "blinds": ("blinds",), "desk": ("desk",),
    "shelves": ("wall shelf", "shoe rack"),
    "curtain": ("curtain",),
    "dresser": ("chest of drawers",),
    "pillow": ("cushion",),
    "mirror": ("mirror",),
    "floor mat": ("carpet", "mat"),
    "clothes": ("clothing",), "ceiling": ("ceiling",), "books": ("book",), "refrigerator": ("refrigerator",),
    "tv": ("tv", "monitor"),
    "paper": ("paper",), "towel": ("towel",),
    "shower curtain": ("shower curtain",),
    "box": ("box",),
    "whiteboard": ("whiteboard",),
    "person": ("person",),
    "nightstand": ("nightstand",),
    "toilet": ("toilet",),
    "sink": ("sink",),
    "lamp": ("lamp",),
    "bathtub": ("bathtub",),
    "bag": ("bag", "backpack", "suitcase"),
    "other structure": ("column", "stairs", "railing", "fireplace", "radiator", "air conditioner", "shower"),
    "other furniture": ("ottoman", "coat rack", "piano", "play tent", "aquarium", "fitness equipment", "stove",
                        "dishwasher", "washing machine", "baby stroller", "ironing board"),
    "other prop": ("microwave", "range hood", "kettle", "toaster", "coffee machine", "fan", "vacuum cleaner",
                   "water heater", "laptop", "computer", "printer", "loudspeaker", "keyboard", "telephone", "clock",
                   "chandelier", "plant", "vase", "candle", "bottle", "cup", "bowl", "pot", "basket", "trash can",
                   "toy", "shoes", "laundry basket", "tableware", "guitar", "dumbbell", "ball", "bicycle",
                   "rocking horse", "pet bed", "water dispenser", "other", "plate", "drinking glass", "can", "food",
                   "fruit", "cutlery", "pan", "jug", "chopping board", "knife block", "mobile phone",
                   "remote control", "tablet", "headphones", "camera", "games console", "umbrella", "hat", "key",
                   "eyeglasses", "scissors", "tool", "flashlight", "medicine", "soap", "toilet paper", "brush",
                   "broom", "fire extinguisher", "power socket", "light switch", "smoke detector", "racket",
                   "stapler", "pen", "blender", "computer mouse"),
}  # fmt: skip

# The data set's colour camera, undistorted (its toolbox); depth is registered to it.
CAMERA = Pinhole(518.86, 519.47, 325.58, 253.74, 640, 480)


def class_of_kinds(kinds: tuple[str, ...]) -> Int[np.ndarray, " k"]:
    """Return for each kind the index of its class in ``CLASSES``; a kind that stands nowhere is an other prop."""
    of = {kind: number for number, name in enumerate(CLASSES) for kind in KINDS_OF_CLASS[name]}
    return np.array([of.get(kind, len(CLASSES) - 1) for kind in kinds])


METRES_A_STEP = 1.0 / 25.5
# The depth of the outer pixels of NYU's frames was in-painted from nothing.
MARGIN_PX = 12
# A floor of a smaller share of the picture does not give the height of the camera: 800 pixels of 640x480.
LEAST_FLOOR = 800 / (640 * 480)
_FLOOR = CLASSES.index("floor") + 1


@dataclass(frozen=True, slots=True)
class LabelledFrame:
    """A frame and its truth.

    Labels are classes 1 to 40, 0 where there is none; where these do not give the camera's height, ``find_ground``
    estimated it from this frame.
    """

    frame: Frame
    label: UInt8[np.ndarray, "h w"]
    floor_is_labelled: bool


class LabelledFolder:
    """The frames of a folder (see the module) in the order of ``frames.csv``, read one at a time."""

    def __init__(self, folder: Path, most: int | None = None) -> None:
        """Read the index and the camera; a longer index is thinned evenly to ``most`` frames.

        ``RecordingError``: there is no index, it or the camera's file is damaged, or it names no frame.
        """
        self.folder = folder
        index = folder / "frames.csv"
        if not index.is_file():
            raise RecordingError(f"There is no {index}; labelled frames need it: frame, up_x, up_y, up_z.")
        self._up: dict[str, np.ndarray] = {}
        with index.open(newline="", encoding="utf-8") as stream:
            for line, row in enumerate(csv.DictReader(stream), 2):
                try:
                    up = np.array([float(row[f"up_{axis}"]) for axis in "xyz"])
                    name = row["frame"]
                except (KeyError, TypeError, ValueError) as fault:
                    raise RecordingError(f"Line {line} of {index} has no frame, up_x, up_y, up_z ({fault}).") from fault
                length = float(np.linalg.norm(up))
                if not np.isfinite(length) or abs(length - 1.0) > 0.05:
                    raise RecordingError(f"Line {line} of {index}: up has length {length:.3g}; it must be 1.")
                self._up[name] = up / length
        if not (count := len(self._up)):
            raise RecordingError(f"{index} names no frame.")
        kept = np.linspace(0, count - 1, min(most or count, count)).round().astype(int)
        self.names: tuple[str, ...] = tuple(np.array(list(self._up))[kept].tolist())
        self.camera = _camera_of(folder / "camera.json")

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.names)

    def read(self, number: int) -> LabelledFrame:
        """Read one frame by its row in the index.

        ``RecordingError``: a picture is missing, damaged, or of another size or depth.
        """
        name = self.names[number]
        is_png = (self.folder / f"{name}.color.png").is_file()
        rgb = self._picture(f"{name}.color.{'png' if is_png else 'jpg'}", cv2.IMREAD_COLOR)[..., ::-1]
        label = self._picture(f"{name}.label.png", cv2.IMREAD_UNCHANGED)
        if label.ndim != 2 or label.max() > len(CLASSES):
            raise RecordingError(f"{self.folder / name}.label.png holds other values than classes 0 to 40.")
        frame = Frame(
            number, name, 0.0, np.ascontiguousarray(rgb), self._depth_m(name), np.eye(4), Rig(self.camera, self.camera)
        )
        return _grounded(frame, label, self._up[name])

    def _depth_m(self, name: str) -> Float32[np.ndarray, "h w"]:
        if (self.folder / f"{name}.depth.png").is_file():
            depth_mm = self._picture(f"{name}.depth.png", cv2.IMREAD_UNCHANGED, "uint16")
            return depth_mm.astype(np.float32) / np.float32(1000.0)
        return smooth_depth(self._picture(f"{name}.depth8.png", cv2.IMREAD_UNCHANGED))

    def _picture(self, name: str, flags: int, dtype: str = "uint8") -> np.ndarray:
        path = self.folder / name
        picture = cv2.imread(str(path), flags)
        if picture is None:
            raise RecordingError(f"{path} is missing or damaged.")
        if picture.shape[:2] != (self.camera.height, self.camera.width) or picture.dtype != dtype:
            raise RecordingError(
                f"{path} is {picture.dtype} of {picture.shape}; it must be {dtype} of {self.camera.height} rows and "
                f"{self.camera.width} columns."
            )
        return picture


def _camera_of(path: Path) -> Pinhole:
    if not path.is_file():
        return CAMERA
    try:
        told: CameraNumbers = decode_json(read_regular(path, DESCRIPTION_BYTES), CameraNumbers)
        return told.camera()
    except (OSError, msgspec.DecodeError, UnicodeDecodeError, ValueError) as fault:
        raise RecordingError(f"{path} is no camera ({fault}); it needs fx, fy, cx, cy, width and height.") from fault


def smooth_depth(value: UInt8[np.ndarray, "h w"]) -> Float32[np.ndarray, "h w"]:
    """Return metres of a depth in 8 bit; its steps of 39 mm are smoothed within surfaces, its margin is 0.

    Two bilateral filters, as wide as three steps of depth. The steps are this file format's, not a sensor's.
    """
    depth = value.astype(np.float32) * np.float32(METRES_A_STEP)
    for _ in range(2):
        depth = cv2.bilateralFilter(depth, d=9, sigmaColor=3.0 * METRES_A_STEP, sigmaSpace=4.0)
    depth = np.where(value > 0, depth, np.float32(0.0))
    inside = np.zeros(depth.shape, bool)
    inside[MARGIN_PX:-MARGIN_PX, MARGIN_PX:-MARGIN_PX] = True
    return np.where(inside, depth, np.float32(0.0)).astype(np.float32)


def _grounded(frame: Frame, label: UInt8[np.ndarray, "h w"], up: Float[np.ndarray, "3"]) -> LabelledFrame:
    floor = (label == _FLOOR) & (frame.depth_m > 0.0)
    is_labelled = bool(floor.mean() >= LEAST_FLOOR)
    if is_labelled:
        floor_m = float(np.median(frame.rig.depth.backproject(frame.depth_m)[floor] @ up))
        ground = Ground(up, np.zeros(1), np.array([floor_m]))
    else:
        ground = find_ground([frame], up).ground
    return LabelledFrame(replace(frame, ground=ground), label, is_labelled)


STEP = 2
# How frames are seen.
ONCE, SEVERAL = "once, as in maps", "at several scales"


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


def run_frames(encoder: EmbeddedPixels, folder: Path, most: int | None = None) -> dict[str, Table]:
    """Return the tables of a folder of labelled frames, or of up to ``most`` of them.

    ``RecordingError``: the folder has no index, or a frame cannot be read.
    """
    figures = measure(encoder, LabelledFolder(folder, most))
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
