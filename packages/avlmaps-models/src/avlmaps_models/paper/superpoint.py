"""SuperPoint keypoints (DeTone, Malisiewicz, Rabinovich 2018) as the paper's code ran them.

Published as magic-leap-community/superpoint (1.3 million weights; Magic Leap's licence: academic and non-commercial
use only), run by transformers. The network sees the picture's grey values in [0, 1] at their full size: the size to
which transformers' own preprocessing would squeeze it is not used. Keypoints are whole pixels with a score above
0.005 that are maxima within 4 pixels and at least 4 pixels from the border, as many as there are; descriptors have 256
numbers. These are the settings that were in effect in the paper's code (its configuration named others, which were
never read).
"""

import cv2
import numpy as np
import torch
from jaxtyping import UInt8

from avlmaps.perception.models import public_name
from avlmaps.perception.protocols import LocalFeatures, ModelCard
from avlmaps_models.common.checksums import checksum_of, weights_in
from avlmaps_models.common.device import inference, select_device, to_numpy, unit_rows
from avlmaps_models.common.operators import declare_missing_operators
from avlmaps_models.common.pictures import has_nothing, local_features, no_features
from avlmaps_models.common.pretrained import load_pretrained, pretrained_folder

THRESHOLD = 0.005
RADIUS_PX = 4
BORDER_PX = 4
_CELL_PX = 8  # one descriptor, and 64 scores


class SuperPointKeypoints:
    """Finds keypoints by SuperPoint.

    Args:
        model: the hub's id, or a folder in its layout.

    Raises:
        BackendError: it is not here, or is not SuperPoint's.
    """

    def __init__(self, model: str = "magic-leap-community/superpoint") -> None:
        declare_missing_operators()
        from transformers import SuperPointForKeypointDetection

        folder = pretrained_folder(model)
        self._device = select_device()
        network = load_pretrained(SuperPointForKeypointDetection, folder, model, self._device, torch.float32)
        finder = network.keypoint_decoder
        finder.keypoint_threshold, finder.nms_radius = THRESHOLD, RADIUS_PX
        finder.border_removal_distance, finder.max_keypoints = BORDER_PX, -1
        self._network = network
        self.card = ModelCard(
            id=public_name(model),
            dim=int(network.config.descriptor_decoder_dim),
            licence="LicenseRef-MagicLeap-NonCommercial",
            checksum=checksum_of(weights_in(folder), f"superpoint grey full above={THRESHOLD} radius={RADIUS_PX} all"),
            note="non-commercial; keypoints are whole pixels, as many as a picture has",
        )

    def encode(self, rgb: UInt8[np.ndarray, "h w 3"]) -> LocalFeatures:
        """Return the picture's keypoints with their scores, row by row."""
        if has_nothing(rgb):
            return no_features(self.card.dim, rgb)
        grey = torch.from_numpy(cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY)).to(self._device)
        with inference():  # in float32: half precision makes neighbours equal, and then neither is a maximum
            found = self._network((grey.float() / 255.0)[None, None])
        height, width = grey.shape
        index = to_numpy(found.keypoints[0]).astype(np.float64) * (width, height)
        # transformers returns those at the right and lower border, which the published code removes as well.
        last = np.array([width, height]) // _CELL_PX * _CELL_PX - BORDER_PX
        kept = (index < last - 0.5).all(axis=1)
        descriptors, score = unit_rows(found.descriptors[0]), to_numpy(found.scores[0])
        return local_features(index[kept], descriptors[kept], score[kept], rgb, rgb)
