"""Whole frames as the running system looks at them, for what is fitted after the network."""

import cv2
import numpy as np
from training.pixels.batches import Frames
from training.pixels.network import MULTIPLE

from avlmaps.core.camera import Pinhole
from avlmaps.perception.embedded.scene_network import channels

# Larger than things are in most windows of the training: of several sizes the one that held-out frames like best.
WIDTH, HEIGHT = 160, 120


def whole_frame(
    frames: Frames, index: int, with_colour: bool, fineness: int = 1
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return geometry (1, 8, h, w) and colour (1, 3, h, w) times its fineness, padded; depth and label as they are."""
    h, w = frames.depth[index].shape
    row = ((np.arange(HEIGHT) + 0.5) * h / HEIGHT).astype(int)
    column = ((np.arange(WIDTH) + 0.5) * w / WIDTH).astype(int)
    depth = frames.depth[index][row[:, None], column].astype(np.float32) / 1000.0
    label = np.array(frames.label[index][row[:, None], column])
    fx, fy, cx, cy, *up, height = frames.camera[index][:8]
    wide, high = fineness * WIDTH, fineness * HEIGHT
    colour = np.zeros((3, high, wide), np.float32)
    rgb_row = int(frames.rgb_row[index])
    if with_colour and rgb_row >= 0:
        rgb = cv2.resize(np.ascontiguousarray(frames.rgb[rgb_row]), (wide, high), interpolation=cv2.INTER_AREA)
        colour = rgb.transpose(2, 0, 1).astype(np.float32) / 127.5 - 1.0
    camera = Pinhole(fx, fy, cx, cy, w, h).resized(WIDTH, HEIGHT)
    geometry = channels(np.ascontiguousarray(depth), camera, np.array(up), height)
    more = (-HEIGHT % MULTIPLE, -WIDTH % MULTIPLE)
    geometry = np.pad(geometry, ((0, 0), *((0, each) for each in more)))
    colour = np.pad(colour, ((0, 0), *((0, fineness * each) for each in more)))
    return geometry[None], colour[None], depth, label
