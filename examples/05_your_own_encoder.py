"""An encoder of your own, without a registry: python examples/05_your_own_encoder.py REC mine.avlmap."""

import sys

import numpy as np

import avlmaps

COLOURS = {"red": (1, 0, 0), "green": (0, 1, 0), "blue": (0, 0, 1), "other": (1, 1, 1)}


class Hues:
    """The direction of a colour, which is near the direction of its name."""

    vocabulary = ("red", "green", "blue")

    def encode(self, frame: avlmaps.Frame) -> np.ndarray:
        rgb = frame.rgb[::4, ::4].astype(np.float32) + 1.0
        return rgb / np.linalg.norm(rgb, axis=2, keepdims=True)

    def encode_words(self, words: list[str]) -> np.ndarray:
        rows = np.array([COLOURS.get(word, (0, 0, 0)) for word in words], np.float32)
        return rows / np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), 1e-9)


encoders = avlmaps.Encoders.named("colours", pixels=Hues())
m = avlmaps.build_map(sys.argv[1], sys.argv[2], encoders=encoders, progress=False, overwrite=True)
print(m.object("red").probability, m.data.info.models["pixels"].id)
