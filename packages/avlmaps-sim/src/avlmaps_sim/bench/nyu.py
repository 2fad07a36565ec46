"""The 40 classes of NYU Depth V2's labels, and which of our kinds each of them holds.

Silberman et al., "Indoor Segmentation and Support Inference from RGBD Images", ECCV 2012; the 40 classes are those of
Gupta et al., "Perceptual Organization and Recognition of Indoor Scenes from RGB-D Images", CVPR 2013. Other data sets
label in the same classes, ScanNet among them.
"""

import numpy as np
from jaxtyping import Int

from avlmaps.core.camera import Pinhole

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

# The data set's colour camera, undistorted (its toolbox); depth is registered to it.
CAMERA = Pinhole(518.86, 519.47, 325.58, 253.74, 640, 480)


def class_of_kinds(kinds: tuple[str, ...]) -> Int[np.ndarray, " k"]:
    """Return for each kind the index of its class in ``CLASSES``; a kind that stands nowhere is an other prop."""
    of = {kind: number for number, name in enumerate(CLASSES) for kind in KINDS_OF_CLASS[name]}
    return np.array([of.get(kind, len(CLASSES) - 1) for kind in kinds])
