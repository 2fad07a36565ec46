"""Labels that teachers add to real pictures: ``python -m training.pixels.teachers --nyuv2 DIR --photos DIR --out DIR``.

| teacher | what it gives |
|---|---|
| MOSAIC R3 (`mosaic_r3_ade31_int8.tflite`, Apache 2.0) | the likeliest of 32 classes of a pixel, where it is sure |
| FastestDet (`fastestdet_coco80.onnx`, BSD 3) | boxes of 80 kinds of COCO, on a picture and nine enlarged parts of it |
| `looked_at.csv` | those of FastestDet's boxes on NYU's frames whose name a language model found right, or gave |

Of 2,678 boxes of FastestDet on NYU's frames a quarter is right, and only for plants (.60) and microwaves (.75) there is
a score from which four of five are. So each box was looked at. ``--propose FILE`` writes the boxes to look at.

Two packed files come out, as ``training.pixels.real`` reads them. `nyu.npz` holds the frames of NYU Depth V2's training
split: NYU's label stays, except where it only says "other" or nothing and lies in such a box. Frames of the development
split keep NYU's labels alone. `photos.npz` holds photographs without depth: MOSAIC's classes, and over them what stands
in the boxes and outlines of ``labels.csv``. MOSAIC needs ``ai-edge-litert``.
"""

import csv
import sys
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import cv2
import flatbuffers
import numpy as np
import onnxruntime
import tyro
from training.pixels.labels import CATEGORIES, FIRST_COARSE, UNLABELLED
from training.pixels.real import HEIGHT, WIDTH, Real, fitted, held_out_rows, write_pack

from avlmaps_sim.bench.frames import CLASSES, LabelledFolder

COCO = (
    "person", "bicycle", "car", "motorcycle", "airplane", "bus", "train", "truck", "boat", "traffic light",
    "fire hydrant", "stop sign", "parking meter", "bench", "bird", "cat", "dog", "horse", "sheep", "cow", "elephant",
    "bear", "zebra", "giraffe", "backpack", "umbrella", "handbag", "tie", "suitcase", "frisbee", "skis", "snowboard",
    "sports ball", "kite", "baseball bat", "baseball glove", "skateboard", "surfboard", "tennis racket", "bottle",
    "wine glass", "cup", "fork", "knife", "spoon", "bowl", "banana", "apple", "sandwich", "orange", "broccoli",
    "carrot", "hot dog", "pizza", "donut", "cake", "chair", "couch", "potted plant", "bed", "dining table", "toilet",
    "tv", "laptop", "mouse", "remote", "keyboard", "cell phone", "microwave", "oven", "toaster", "sink",
    "refrigerator", "book", "clock", "vase", "scissors", "teddy bear", "hair drier", "toothbrush",
)  # fmt: skip
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
ADE = (
    "other", "wall", "building", "sky", "floor", "tree", "ceiling", "road", "bed", "windowpane", "grass", "cabinet",
    "sidewalk", "person", "earth", "door", "table", "mountain", "plant", "curtain", "chair", "car", "water", "painting",
    "sofa", "shelf", "house", "sea", "mirror", "rug", "field", "armchair",
)  # fmt: skip
# Of MOSAIC's classes those that teach: our category, or NYU's class, and the least probability. Measured on NYU's
# development frames (README); persons and plants by eye on the photographs.
SEGMENTED = {
    "wall": ("nyu:wall", 0.8), "floor": ("nyu:floor", 0.8), "ceiling": ("nyu:ceiling", 0.6), "bed": ("nyu:bed", 0.6),
    "person": ("nyu:person", 0.8), "table": ("nyu:table", 0.8), "plant": ("plant", 0.8), "chair": ("nyu:chair", 0.6),
    "painting": ("nyu:picture", 0.7), "sofa": ("nyu:sofa", 0.6), "rug": ("nyu:floor mat", 0.6),
}  # fmt: skip
# FastestDet's boxes on the photographs count from this score on, by eye.
LEAST_OF_PHOTOS = 0.55
# Boxes of the photographs that are no small things.
COARSE_OF_BOX = {
    "chair": "nyu:chair",
    "couch": "nyu:sofa",
    "bed": "nyu:bed",
    "toilet": "nyu:toilet",
    "tv": "nyu:tv",
    "sink": "nyu:sink",
    "refrigerator": "nyu:refrigerator",
}
# Two boxes that overlap by more are one thing.
MOST_OVERLAP = 0.45
# Width and height of a part of the picture, of the whole's.
PART = 0.55
# The ellipse of a thing, of its box.
MIDDLE = 0.8


@dataclass(frozen=True)
class Box:
    """A kind of COCO, how sure it is, and its corners in pixels."""

    kind: str
    score: float
    corners: tuple[float, float, float, float]


class Detector:
    """FastestDet."""

    def __init__(self, path: Path) -> None:
        """Load the network."""
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = 1
        self._session = onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])
        self._name = self._session.get_inputs()[0].name

    def boxes(self, bgr: np.ndarray, least: float) -> list[Box]:
        """Return boxes on the picture and its enlarged parts, the surest of those that overlap."""
        h, w = bgr.shape[:2]
        wide, tall = round(PART * w), round(PART * h)
        parts = [(0, 0, w, h)] + [
            (round(x * (w - wide) / 2), round(y * (h - tall) / 2), wide, tall) for y in range(3) for x in range(3)
        ]
        found: list[Box] = []
        for x, y, pw, ph in parts:
            for box in self._on(bgr[y : y + ph, x : x + pw], least):
                x0, y0, x1, y1 = box.corners
                # What a part's edge cuts is seen whole elsewhere.
                cut = (x0 < 2 < x) or (y0 < 2 < y) or (x1 > pw - 2 and x + pw < w) or (y1 > ph - 2 and y + ph < h)
                if not cut:
                    inside = (max(x0, 0) + x, max(y0, 0) + y, min(x1, pw) + x, min(y1, ph) + y)
                    found.append(Box(box.kind, box.score, inside))
        kept: list[Box] = []
        for box in sorted(found, key=lambda one: -one.score):
            if all(overlap(box.corners, other.corners) < MOST_OVERLAP for other in kept):
                kept.append(box)
        return kept

    def _on(self, bgr: np.ndarray, least: float) -> list[Box]:
        h, w = bgr.shape[:2]
        small = cv2.resize(bgr, (352, 352), interpolation=cv2.INTER_LINEAR).transpose(2, 0, 1)[None]
        out = np.asarray(self._session.run(None, {self._name: small.astype(np.float32) / 255.0})[0])[0]
        n = out.shape[1]
        score = out[0] ** 0.6 * out[5:].max(axis=0) ** 0.4
        found = []
        for i, j in np.argwhere(score >= least):
            _, dx, dy, bw, bh = out[:5, i, j]
            cx, cy = (j + np.tanh(dx)) / n * w, (i + np.tanh(dy)) / n * h
            bw, bh = (size / (1 + np.exp(-value)) / 2 for size, value in ((w, bw), (h, bh)))
            kind = COCO[int(out[5:, i, j].argmax())]
            found.append(
                Box(kind, float(score[i, j]), (float(cx - bw), float(cy - bh), float(cx + bw), float(cy + bh)))
            )
        return found


def overlap(one: tuple[float, ...], other: tuple[float, ...]) -> float:
    """Return the intersection of two boxes over their union."""
    w = min(one[2], other[2]) - max(one[0], other[0])
    h = min(one[3], other[3]) - max(one[1], other[1])
    if w <= 0 or h <= 0:
        return 0.0
    area = [(b[2] - b[0]) * (b[3] - b[1]) for b in (one, other)]
    return w * h / (sum(area) - w * h)


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
    propose: Path | None = None
    """Write FastestDet's boxes on NYU's frames, without those of the development split, into this file instead."""


# Of a kind of COCO, or of a name of ``looked_at.csv``: what may cover a pixel of NYU's, beside what says "other".
_LOOSE = (0, *(CLASSES.index(name) + 1 for name in ("other structure", "other furniture", "other prop")))
_BAG = CLASSES.index("bag") + 1
_ALSO = dict.fromkeys(("backpack", "suitcase", "handbag", "bag"), (_BAG,))
# Least share of a box's middle that NYU leaves open.
LEAST_OPEN = 0.5
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
    _, piece = cv2.connectedComponents((loose & (label > 0)).astype(np.uint8), connectivity=4)
    inside, everywhere = (np.bincount(piece[where], minlength=piece.max() + 1) for where in (box, np.ones_like(box)))
    whole = inside >= WITHIN * np.maximum(everywhere, 1)
    whole[0] = False
    return chosen | (whole[piece] & np.isin(piece, piece[chosen]))


def propose(folder: LabelledFolder, detector: Detector, path: Path, least: float = 0.35) -> None:
    """Write boxes whose middle NYU leaves open, to be looked at."""
    held_out = set(held_out_rows(folder.names))
    with path.open("w", newline="", encoding="utf-8") as stream:
        table = csv.writer(stream)
        table.writerow(["frame", "proposed", "x0", "y0", "x1", "y1", "score"])
        for number in set(range(len(folder))) - held_out:
            one = folder.read(number)
            for box in detector.boxes(np.ascontiguousarray(one.frame.rgb[..., ::-1]), least):
                loose = np.isin(one.label, (*_LOOSE, *_ALSO.get(box.kind, ())))
                if loose[middle(box.corners, one.label.shape)].mean() >= LEAST_OPEN:
                    table.writerow([folder.names[number], box.kind, *map(round, box.corners), f"{box.score:.2f}"])


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
        real = fitted(one, folder.camera)
        if number not in held_out:
            fine = np.full(one.label.shape, UNLABELLED, np.uint8)
            for row in sorted(named.get(name, []), key=area_of, reverse=True):
                fine[open_part(one.label, row["category"], corners_of(row))] = CATEGORIES.index(row["category"])
            h, w = one.label.shape
            fine = fine[(np.arange(HEIGHT) * h // HEIGHT)[:, None], np.arange(WIDTH) * w // WIDTH]
            real.label = np.where(fine == UNLABELLED, real.label, fine)
        frames.append(real)
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
    share = cv2.resize(share[..., [ADE.index(name) for name in SEGMENTED]], (w, h), interpolation=cv2.INTER_LINEAR)
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
    pixels, shown = Counter[int](), Counter[int]()
    for one in frames:
        values, counts = np.unique(one.label, return_counts=True)
        pixels.update(dict(zip(values.tolist(), counts.tolist(), strict=True)))
        shown.update(values.tolist())
    for value, count in sorted(pixels.items(), key=lambda item: -item[1]):
        if value != UNLABELLED:
            name = CATEGORIES[value] if value < FIRST_COARSE else f"nyu:{CLASSES[value - FIRST_COARSE]}"
            print(f"{title}: {name}: {count} pixels, {shown[value]} frames", file=sys.stderr)


def main(options: Options) -> None:
    """Write the packed files, or the boxes to look at."""
    if options.nyuv2 is not None:
        folder = LabelledFolder(options.nyuv2)
        if options.propose is not None:
            propose(folder, Detector(options.teachers / "fastestdet_coco80.onnx"), options.propose)
            return
        frames = taught_frames(folder, Path(__file__).parent / "looked_at.csv")
        write_pack(frames, folder.names, options.out / "nyu.npz")
        tell("nyu", frames)
    if options.photos is not None:
        frames, names = taught_photos(options.photos, Segmenter(options.teachers / "mosaic_r3_ade31_int8.tflite"))
        write_pack(frames, names, options.out / "photos.npz")
        tell("photos", frames)


if __name__ == "__main__":
    main(tyro.cli(Options))
