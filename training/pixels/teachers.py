"""Labels that teachers add to real pictures: ``python -m training.pixels.teachers --nyuv2 DIR --photos DIR --out DIR``.

| teacher | what it gives |
|---|---|
| MOSAIC R3 (`mosaic_r3_ade31_int8.tflite`, Apache 2.0) | the likeliest of 32 classes of a pixel, where it is sure |
| FastestDet (`fastestdet_coco80.onnx`, BSD 3) | boxes of 80 kinds of COCO; they are in the tables below |
| `looked_at.csv` | those of its boxes on NYU's frames whose name a language model found right, or gave |
| `labels.csv` of the photographs | its boxes there, beside those that people drew |

Of 2,678 boxes of FastestDet on NYU's frames a quarter is right, and only for plants (.60) and microwaves (.75) there is
a score from which four of five are. So each box was looked at.

Two packed files come out, as ``training.pixels.real`` reads them. `nyu.npz` holds the frames of NYU Depth V2's training
split: NYU's label stays, except where it only says "other" or nothing and lies in such a box. Frames of the development
split keep NYU's labels alone. `photos.npz` holds photographs without depth: MOSAIC's classes, and over them what stands
in the boxes and outlines of ``labels.csv``. MOSAIC needs ``ai-edge-litert``.
"""

import csv
import sys
from dataclasses import dataclass
from pathlib import Path

import cv2
import flatbuffers
import numpy as np
import tyro
from training.pixels.labels import CATEGORIES, FIRST_COARSE, UNLABELLED
from training.pixels.real import HEIGHT, WIDTH, Real, fitted, held_out_rows, write_pack

from avlmaps_sim.bench.frames import CLASSES, LabelledFolder

# Ours for COCO's kinds; what is missing teaches nothing.
OURS = {
    "cup": "cup", "bottle": "bottle", "wine glass": "drinking glass", "bowl": "bowl", "laptop": "laptop",
    "mouse": "computer mouse", "remote": "remote control", "keyboard": "keyboard", "cell phone": "mobile phone",
    "book": "book", "clock": "clock", "vase": "vase", "teddy bear": "toy", "sports ball": "ball",
    "backpack": "backpack", "handbag": "bag", "suitcase": "suitcase", "umbrella": "umbrella",
    "potted plant": "plant", "microwave": "microwave", "oven": "stove", "toaster": "toaster", "fork": "cutlery",
    "knife": "cutlery", "spoon": "cutlery", "scissors": "scissors", "apple": "fruit", "orange": "fruit",
    "banana": "fruit", "sandwich": "food", "pizza": "food", "cake": "food", "donut": "food", "carrot": "food",
    "broccoli": "food", "hot dog": "food", "bicycle": "bicycle", "person": "person",
}  # fmt: skip
# Of MOSAIC's 32 classes those that teach, by their number: our category, or NYU's class, and the least probability.
# NYU's development frames bear them out; persons and plants by eye on the photographs.
SEGMENTED = {
    1: ("nyu:wall", 0.8), 4: ("nyu:floor", 0.8), 6: ("nyu:ceiling", 0.6), 8: ("nyu:bed", 0.6), 13: ("nyu:person", 0.8),
    16: ("nyu:table", 0.8), 18: ("plant", 0.8), 20: ("nyu:chair", 0.6), 23: ("nyu:picture", 0.7), 24: ("nyu:sofa", 0.6),
    29: ("nyu:floor mat", 0.6),
}  # fmt: skip
# FastestDet's boxes on the photographs count from this score on, by eye.
LEAST_OF_PHOTOS = 0.55
# Boxes of the photographs that are no small things.
COARSE_OF_BOX = {
    "chair": "nyu:chair", "couch": "nyu:sofa", "bed": "nyu:bed", "toilet": "nyu:toilet", "tv": "nyu:tv",
    "sink": "nyu:sink", "refrigerator": "nyu:refrigerator",
}  # fmt: skip
MIDDLE = 0.8  # the ellipse of a thing, of its box


class Segmenter:
    """MOSAIC without its last operator, which would enlarge the scores and keep the likeliest class alone."""

    def __init__(self, path: Path) -> None:
        """Load the network."""
        from ai_edge_litert import schema_py_generated as schema
        from ai_edge_litert.interpreter import Interpreter

        model = schema.ModelT.InitFromPackedBuf(path.read_bytes(), 0)
        graph = model.subgraphs[0]
        graph.outputs = [int(graph.operators.pop().inputs[0])]
        builder = flatbuffers.Builder(1 << 22)
        builder.Finish(model.Pack(builder), b"TFL3")
        self._network = Interpreter(model_content=bytes(builder.Output()), num_threads=1)
        self._network.allocate_tensors()
        self._input, self._output = self._network.get_input_details()[0], self._network.get_output_details()[0]

    def probabilities(self, rgb: np.ndarray) -> np.ndarray:
        """Return (128, 128, 32) of a picture that is stretched to a square."""
        small = cv2.resize(rgb, (512, 512), interpolation=cv2.INTER_LINEAR)
        self._network.set_tensor(self._input["index"], small[None])
        self._network.invoke()
        scale, zero = self._output["quantization"]
        score = (self._network.get_tensor(self._output["index"])[0].astype(np.float32) - zero) * scale
        e = np.exp(score - score.max(axis=2, keepdims=True))
        return e / e.sum(axis=2, keepdims=True)


@dataclass(frozen=True)
class Options:
    """Where pictures and teachers come from, and where the packed files go."""

    nyuv2: Path | None = None
    """Folder of NYU's frames; none: no `nyu.npz`."""
    photos: Path | None = None
    """Folder of photographs with ``labels.csv``; none: no `photos.npz`."""
    teachers: Path = Path("build/teachers")
    """Folder of the teachers' weights."""
    out: Path = Path("build/pixels/taught")
    """Folder of the two files."""


# Of a kind of COCO, or of a name of ``looked_at.csv``: what may cover a pixel of NYU's, beside what says "other".
_LOOSE = (0, *(CLASSES.index(name) + 1 for name in ("other structure", "other furniture", "other prop")))
_BAG = CLASSES.index("bag") + 1
_ALSO: dict[str, tuple[int, ...]] = dict.fromkeys(("backpack", "suitcase", "handbag", "bag"), (_BAG,))
# A thing that NYU cut out for itself lies in its box with this share.
WITHIN = 0.9


def middle(corners: tuple[float, ...], shape: tuple[int, ...]) -> np.ndarray:
    """Return the ellipse in a box as a mask."""
    x0, y0, x1, y1 = corners
    axes = (max(1, round(MIDDLE * (x1 - x0) / 2)), max(1, round(MIDDLE * (y1 - y0) / 2)))
    mask = np.zeros(shape[:2], np.uint8)
    cv2.ellipse(mask, (round((x0 + x1) / 2), round((y0 + y1) / 2)), axes, 0, 0, 360, 1, -1)
    return mask > 0


def open_part(label: np.ndarray, name: str, corners: tuple[float, ...]) -> np.ndarray:
    """Return where NYU leaves open what a box shows: its middle, and pieces of "other" that lie in the box alone."""
    loose = np.isin(label, (*_LOOSE, *_ALSO.get(name, ())))
    chosen = middle(corners, label.shape) & loose
    x0, y0, x1, y1 = (round(value) for value in corners)
    box = np.zeros(label.shape, bool)
    box[max(y0, 0) : y1 + 1, max(x0, 0) : x1 + 1] = True
    piece = np.asarray(cv2.connectedComponents((loose & (label > 0)).astype(np.uint8), connectivity=4)[1], np.intp)
    inside, everywhere = (np.bincount(piece[where], minlength=piece.max() + 1) for where in (box, np.ones_like(box)))
    whole = inside >= WITHIN * np.maximum(everywhere, 1)
    whole[0] = False
    return chosen | (whole[piece] & np.isin(piece, piece[chosen]))


def rows_of(path: Path, key: str) -> dict[str, list[dict[str, str]]]:
    """Return a table's rows by a column."""
    rows: dict[str, list[dict[str, str]]] = {}
    with path.open(newline="", encoding="utf-8") as stream:
        for row in csv.DictReader(stream):
            rows.setdefault(row[key], []).append(row)
    return rows


def corners_of(row: dict[str, str]) -> tuple[float, ...]:
    """Return a row's box."""
    return tuple(float(row[name]) for name in ("x0", "y0", "x1", "y1"))


def area_of(row: dict[str, str]) -> float:
    """Return the area of a row's box."""
    x0, y0, x1, y1 = corners_of(row)
    return (x1 - x0) * (y1 - y0)


def taught_frames(folder: LabelledFolder, looked_at: Path) -> list[Real]:
    """Return NYU's frames with the names of boxes where NYU leaves them open, small boxes over large ones."""
    named, held_out = rows_of(looked_at, "frame"), set(held_out_rows(folder.names))
    frames = []
    for number, name in enumerate(folder.names):
        one = folder.read(number)
        fine = np.full(one.label.shape, UNLABELLED, np.uint8)
        for row in sorted(named.get(name, []) if number not in held_out else [], key=area_of, reverse=True):
            fine[open_part(one.label, row["category"], corners_of(row))] = CATEGORIES.index(row["category"])
        frames.append(fitted(one, folder.camera, fine))
    return frames


def taught_photos(folder: Path, segmenter: Segmenter) -> tuple[list[Real], tuple[str, ...]]:
    """Return photographs with MOSAIC's classes, and over them what their boxes and outlines show."""
    labels = rows_of(folder / "labels.csv", "file")
    paths = sorted(folder.glob("*.jpg"))
    return [taught_photo(path, labels.get(path.name, []), segmenter) for path in paths], tuple(p.stem for p in paths)


def taught_photo(path: Path, rows: list[dict[str, str]], segmenter: Segmenter) -> Real:
    """Return a photograph as a frame without depth; the longer side is seen under 60 degrees, held level at 1.3 m."""
    picture = cv2.imread(str(path), cv2.IMREAD_COLOR)
    assert picture is not None, path
    rgb = np.ascontiguousarray(picture[..., ::-1])
    h, w = rgb.shape[:2]
    label = np.full((h, w), UNLABELLED, np.uint8)
    share = segmenter.probabilities(rgb)
    share = cv2.resize(share[..., list(SEGMENTED)], (w, h), interpolation=cv2.INTER_LINEAR)
    for number, (ours, least) in enumerate(SEGMENTED.values()):
        label[share[..., number] >= least] = numbered(ours)
    for row in sorted((row for row in rows if row["x0"]), key=area_of, reverse=True):
        ours = OURS.get(row["kind"]) or COARSE_OF_BOX.get(row["kind"])
        teacher, _, score = row["origin"].partition(" ")
        if ours is None or (teacher == "FastestDet" and float(score.split()[0]) < LEAST_OF_PHOTOS):
            continue
        if row["polygon"]:
            outline = np.array(row["polygon"].split(), float).reshape(-1, 2)
            mask = np.zeros((h, w), np.uint8)
            cv2.fillPoly(mask, [np.rint(outline).astype(np.int32)], 1)
            label[mask > 0] = numbered(ours)
        else:
            # Beside the middle of a box nobody knows where the thing ends.
            x0, y0, x1, y1 = (max(0, round(value)) for value in corners_of(row))
            label[y0 : y1 + 1, x0 : x1 + 1] = UNLABELLED
            label[middle(corners_of(row), label.shape)] = numbered(ours)
    scale = min(WIDTH / w, HEIGHT / h)
    sw, sh = max(1, round(w * scale)), max(1, round(h * scale))
    rest = ((0, HEIGHT - sh), (0, WIDTH - sw))
    focal = max(sw, sh) / 2 / np.tan(np.deg2rad(30.0))
    row, column = (np.arange(sh) * h // sh)[:, None], np.arange(sw) * w // sw
    return Real(
        np.zeros((HEIGHT, WIDTH), np.uint16),
        np.pad(label[row, column], rest, constant_values=UNLABELLED),
        np.pad(cv2.resize(rgb, (sw, sh), interpolation=cv2.INTER_AREA), (*rest, (0, 0))),
        np.array([focal, focal, sw / 2, sh / 2, 0.0, -1.0, 0.0, 1.3, 0.0]),
    )


def numbered(name: str) -> int:
    """Return the number of a category, or of a class of NYU written as "nyu:NAME"."""
    if name.startswith("nyu:"):
        return FIRST_COARSE + CLASSES.index(name.removeprefix("nyu:"))
    return CATEGORIES.index(name)


def tell(title: str, frames: list[Real]) -> None:
    """Print how many pixels and frames show each category."""
    label = np.stack([one.label for one in frames])
    for value in np.unique(label[label != UNLABELLED]).tolist():
        name = CATEGORIES[value] if value < FIRST_COARSE else f"nyu:{CLASSES[value - FIRST_COARSE]}"
        there = label == value
        print(f"{title}: {name}: {there.sum()} pixels, {there.any(axis=(1, 2)).sum()} frames", file=sys.stderr)


def main(options: Options) -> None:
    """Write the packed files."""
    if options.nyuv2 is not None:
        folder = LabelledFolder(options.nyuv2)
        frames = taught_frames(folder, Path(__file__).parent / "looked_at.csv")
        write_pack(frames, folder.names, options.out / "nyu.npz")
        tell("nyu", frames)
    if options.photos is not None:
        frames, names = taught_photos(options.photos, Segmenter(options.teachers / "mosaic_r3_ade31_int8.tflite"))
        write_pack(frames, names, options.out / "photos.npz")
        tell("photos", frames)


if __name__ == "__main__":
    main(tyro.cli(Options))
