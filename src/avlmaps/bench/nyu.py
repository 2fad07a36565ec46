"""Labelled frames in the layout of NYU Depth V2, and which of our kinds each of its 40 classes holds.

A folder has `frames.csv` (frame, up_x, up_y, up_z: up in the camera's frame) and for each frame `NNNN.color.jpg`,
`NNNN.depth8.png` (8 bit, metres = value / 25.5, in-painted) and `NNNN.label.png` (class 1 to 40, 0 unlabelled).
Silberman et al., "Indoor Segmentation and Support Inference from RGBD Images", ECCV 2012; the 40 classes are those of
Gupta et al., "Perceptual Organization and Recognition of Indoor Scenes from RGB-D Images", CVPR 2013.
"""

import csv
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float, Float32, Int, UInt8

from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.errors import RecordingError
from avlmaps.maps.gravity.floor import find_ground
from avlmaps.recordings.types import Frame, Ground

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
    "bookshelf": ("bookshelf",),
    "picture": ("picture",),
    "counter": ("kitchen counter", "kitchen island"),
    "blinds": ("blinds",),
    "desk": ("desk",),
    "shelves": ("wall shelf", "shoe rack"),
    "curtain": ("curtain",),
    "dresser": ("chest of drawers",),
    "pillow": ("cushion",),
    "mirror": ("mirror",),
    "floor mat": ("carpet", "mat"),
    "clothes": ("clothing",),
    "ceiling": ("ceiling",),
    "books": ("book",),
    "refrigerator": ("refrigerator",),
    "tv": ("tv", "monitor"),
    "paper": ("paper",),
    "towel": ("towel",),
    "shower curtain": ("shower curtain",),
    "box": ("box",),
    "whiteboard": ("whiteboard",),
    "person": ("person",),
    "nightstand": ("nightstand",),
    "toilet": ("toilet",),
    "sink": ("sink",),
    "lamp": ("lamp",),
    "bathtub": ("bathtub",),
    "bag": ("bag",),
    "other structure": ("column", "stairs", "railing", "fireplace", "radiator", "air conditioner", "shower"),
    "other furniture": ("ottoman", "coat rack", "piano", "play tent", "aquarium", "fitness equipment", "stove",
                        "dishwasher", "washing machine", "baby stroller", "ironing board"),
    "other prop": ("microwave", "range hood", "kettle", "toaster", "coffee machine", "fan", "vacuum cleaner",
                   "water heater", "laptop", "computer", "printer", "loudspeaker", "keyboard", "telephone", "clock",
                   "chandelier", "plant", "vase", "candle", "bottle", "cup", "bowl", "pot", "basket", "trash can",
                   "toy", "shoes", "laundry basket", "tableware", "guitar", "dumbbell", "ball", "bicycle",
                   "rocking horse", "pet bed", "water dispenser", "other"),
}  # fmt: skip

CAMERA = Pinhole(518.86, 519.47, 325.58, 253.74, 640, 480)
METRES_A_STEP = 1.0 / 25.5
# The depth of the outer pixels was in-painted from nothing.
MARGIN_PX = 12
# A floor of fewer pixels does not give the height of the camera.
FEWEST_FLOOR_PIXELS = 800
_FLOOR = CLASSES.index("floor") + 1


@dataclass(frozen=True, slots=True)
class LabelledFrame:
    """A frame and its truth.

    Attributes:
        frame: colour and depth, with its ground.
        label: (480, 640) class 1 to 40, 0 where there is none.
        floor_is_labelled: the labels gave the camera's height; else ``find_ground`` estimated it from this frame.
    """

    frame: Frame
    label: UInt8[np.ndarray, "h w"]
    floor_is_labelled: bool


class NyuFolder:
    """The frames of a folder, read one at a time.

    Args:
        folder: see the module.

    Attributes:
        names: of the frames, in the order of ``frames.csv``.
    """

    def __init__(self, folder: Path) -> None:
        """Read the index.

        Raises:
            RecordingError: there is no index, it is damaged, or it names no frame.
        """
        self.folder = folder
        index = folder / "frames.csv"
        if not index.is_file():
            raise RecordingError(f"There is no {index}; the suite frames needs a folder in the layout of NYU Depth V2.")
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
        self.names = tuple(self._up)
        if not self.names:
            raise RecordingError(f"{index} names no frame.")

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.names)

    def read(self, number: int) -> LabelledFrame:
        """Read one frame by its row in the index.

        Raises:
            RecordingError: a picture is missing, damaged or of another size.
        """
        name = self.names[number]
        rgb = self._picture(f"{name}.color.jpg", cv2.IMREAD_COLOR)[..., ::-1]
        label = self._picture(f"{name}.label.png", cv2.IMREAD_UNCHANGED)
        if label.ndim != 2 or label.max() > len(CLASSES):
            raise RecordingError(f"{self.folder / name}.label.png holds other values than classes 0 to 40.")
        depth_m = smooth_depth(self._picture(f"{name}.depth8.png", cv2.IMREAD_UNCHANGED))
        return _grounded(name, number, np.ascontiguousarray(rgb), depth_m, label, self._up[name])

    def _picture(self, name: str, flags: int) -> UInt8[np.ndarray, "h w *c"]:
        path = self.folder / name
        picture = cv2.imread(str(path), flags)
        if picture is None:
            raise RecordingError(f"{path} is missing or damaged.")
        if picture.shape[:2] != (CAMERA.height, CAMERA.width) or picture.dtype != np.uint8:
            raise RecordingError(
                f"{path} is {picture.dtype} of {picture.shape}; it must be uint8 of {CAMERA.height} rows and "
                f"{CAMERA.width} columns."
            )
        return np.asarray(picture, np.uint8)


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


def class_of_kinds(kinds: tuple[str, ...]) -> Int[np.ndarray, " k"]:
    """Return for each kind the index of its class in ``CLASSES``; a kind that stands nowhere is an other prop."""
    of = {kind: number for number, name in enumerate(CLASSES) for kind in KINDS_OF_CLASS[name]}
    return np.array([of.get(kind, len(CLASSES) - 1) for kind in kinds])


def _grounded(
    name: str, number: int, rgb: np.ndarray, depth_m: np.ndarray, label: np.ndarray, up: Float[np.ndarray, "3"]
) -> LabelledFrame:
    """Return the frame on the floor that its labels show, or on the one that a build would find."""
    frame = Frame(number, name, 0.0, rgb, depth_m, np.eye(4), Rig(CAMERA, CAMERA))
    floor = (label == _FLOOR) & (depth_m > 0.0)
    is_labelled = int(floor.sum()) >= FEWEST_FLOOR_PIXELS
    if is_labelled:
        floor_m = float(np.median(CAMERA.backproject(depth_m)[floor] @ up))
        ground = Ground(up, np.zeros(1), np.array([floor_m]))
    else:
        ground = find_ground([frame], up).ground
    return LabelledFrame(Frame(number, name, 0.0, rgb, depth_m, np.eye(4), frame.rig, ground), label, is_labelled)
