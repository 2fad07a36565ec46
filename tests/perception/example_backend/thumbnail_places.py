"""Places told by a small grey picture of them: a whole backend of a package of one's own."""

from hashlib import sha256

import cv2
import numpy as np

from avlmaps.perception.protocols import LocalFeatures, ModelCard

SIDE = 12


class ThumbnailPlaces:
    """A ``PlaceEncoder``; it learns nothing from the recording and looks at no keypoints."""

    def __init__(self) -> None:
        checksum = sha256(f"thumbnail of {SIDE}x{SIDE}, mean removed".encode()).hexdigest()
        self.card = ModelCard("example/thumbnail-1", SIDE * SIDE, "MIT", checksum, note="any change of light moves it")

    def fit(self, local: list[LocalFeatures], rng: np.random.Generator) -> dict[str, np.ndarray]:
        return {}

    def encode(self, rgb: np.ndarray, local: LocalFeatures, state: dict[str, np.ndarray]) -> np.ndarray:
        grey = cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY)
        small = cv2.resize(grey, (SIDE, SIDE), interpolation=cv2.INTER_AREA).astype(np.float32).ravel()
        small -= small.mean()
        return small / max(float(np.linalg.norm(small)), 1e-6)
