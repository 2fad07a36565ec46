"""One frame by itself, looked at in several sizes and in the mirror, and smoothed up to the edges of things.

A network errs on other pixels of each, so that the mean is right more often than any of them (multi-scale testing;
Chen et al., "DeepLab", IEEE TPAMI 2018). A map does the same with its many views of each voxel: there it gains nothing
(training/pixels/README.md).
"""

from dataclasses import replace
from itertools import product

import numpy as np

from avlmaps.perception.embedded.edge_aware import smoothed
from avlmaps.perception.embedded.paired_networks import PairedNetworks
from avlmaps.perception.embedded.scene_network import (
    PLAIN,
    Augmentation,
    SceneNetwork,
    Seen,
    at_working_size,
    subsampled,
)
from avlmaps.recordings.types import Frame

# The first is as maps look, and gives the grid. Larger pictures are worse by themselves.
AUGMENTATIONS = tuple(
    Augmentation(scale, mirrored) for scale, mirrored in product((PLAIN.scale, 1.2, 1.4), (PLAIN.mirrored, True))
)


def see_multi_scale(network: SceneNetwork | PairedNetworks, frame: Frame) -> Seen:
    """Encode a frame in every augmentation.

    Returns:
        the mean, on the grid of the plain one.
    """
    import cv2

    first, *others = (network.see(frame, one) for one in AUGMENTATIONS)
    rows, columns = first.known.shape
    resized = [cv2.resize(seen.category, (columns, rows), interpolation=cv2.INTER_LINEAR) for seen in others]
    category = np.stack([first.category, *resized]).mean(axis=0)
    camera, depth_m, rgb = at_working_size(frame, network.notes.width_px)
    cells = np.asarray(cv2.resize(rgb, (columns, rows), interpolation=cv2.INTER_AREA), np.uint8)
    return replace(
        first,
        category=smoothed(category, subsampled(depth_m, columns, rows), cells, camera.resized(columns, rows)),
        room=np.mean([seen.room for seen in (first, *others)], axis=0),
    )
