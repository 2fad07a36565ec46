"""Folders of labelled frames: NYU Depth V2's, and those of any other camera in the same layout.

| file | what |
|---|---|
| `frames.csv` | frame, up_x, up_y, up_z: for each frame up in the axes of its camera (x right, y down), length 1 |
| `NAME.color.jpg` or `.png` | the picture |
| `NAME.depth.png` | 16 bit, millimetres, 0 where there is none; registered to the picture and of its size |
| `NAME.depth8.png` | instead: 8 bit, metres = value / 25.5, in-painted, as NYU's frames are often passed on |
| `NAME.label.png` | 8 bit: class 1 to 40 of `avlmaps_sim.bench.nyu`, 0 unlabelled |
| `camera.json` | fx, fy, cx, cy, width, height of all pictures, pixels; without it NYU's camera, 640x480 |
"""

import csv
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import msgspec
import numpy as np
from jaxtyping import Float, Float32, UInt8

from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.errors import RecordingError
from avlmaps.core.files import DESCRIPTION_BYTES, decode_json, read_regular
from avlmaps.maps.gravity.floor import find_ground
from avlmaps.recordings.layout import CameraNumbers
from avlmaps.recordings.types import Frame, Ground
from avlmaps_sim.bench.nyu import CAMERA, CLASSES

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

    def __init__(self, folder: Path) -> None:
        """Read the index and the camera.

        Raises:
            RecordingError: there is no index, it or the camera's file is damaged, or it names no frame.
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
        self.names = tuple(self._up)
        if not self.names:
            raise RecordingError(f"{index} names no frame.")
        self.camera = _camera_of(folder / "camera.json")

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.names)

    def read(self, number: int) -> LabelledFrame:
        """Read one frame by its row in the index.

        Raises:
            RecordingError: a picture is missing, damaged, or of another size or depth.
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
