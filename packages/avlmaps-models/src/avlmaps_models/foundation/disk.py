"""DISK keypoints (Tyszkiewicz, Fua, Trulls 2020), as kornia runs them.

Published as ``depth-save.pth`` and ``epipolar-save.pth`` (github.com/cvlab-epfl/disk; copies in the hub's
kornia/disk), Apache-2.0. The network is a U-Net of 1.1 million weights; it sees colours in [0, 1] as they are, sides
filled up to multiples of 16 with zeros, and gives each pixel a logit and a descriptor of 128 numbers. Keypoints are
whole pixels that are the strict maximum of their 5x5 neighbourhood with a logit above 0, the strongest
``MAX_KEYPOINTS``. Pictures whose longer side has more than ``MAX_SIDE_PX`` are looked at in a smaller copy, as the
LightGlue for these keypoints was trained.
"""

from pathlib import Path

import numpy as np
import torch
from jaxtyping import UInt8
from kornia.feature import DISK

from avlmaps.core.errors import BackendError
from avlmaps.perception.protocols import LocalFeatures, ModelCard
from avlmaps_models.common.checksums import checksum_of
from avlmaps_models.common.device import inference, select_device, to_numpy, unit_rows
from avlmaps_models.common.pictures import has_nothing, local_features, no_features, shrunk
from avlmaps_models.common.published import load_strictly, published_file, read_tensors

DIM = 128
MAX_KEYPOINTS = 2048
MAX_SIDE_PX = 1024
WINDOW_PX = 5
_VARIANTS = ("depth", "epipolar")
_REPOSITORY = "kornia/disk"


class DiskKeypoints:
    """Finds keypoints by DISK.

    Args:
        model: ``disk-depth`` (more exact), ``disk-epipolar`` (keypoints also where depth is unknown, as on thin
            things), or a path to a checkpoint in their layout.

    Raises:
        BackendError: the file is not here, or is not DISK's.
    """

    def __init__(self, model: str = "disk-depth") -> None:
        name = _file_name(model)
        get = f"hf download {_REPOSITORY} {name}"
        path = published_file(name, get, _REPOSITORY, [f"checkpoints/{Path(name).name}"])
        # The published file holds the network of its training's reward beside the extractor.
        state = read_tensors(path, get, part="extractor")
        network = DISK(desc_dim=DIM)
        load_strictly(network, state, path, get)
        self._device = select_device()
        self._network = network.eval().to(self._device)
        self.card = ModelCard(
            id=f"disk/{Path(name).name}",
            dim=DIM,
            licence="Apache-2.0",
            checksum=checksum_of([path], f"disk keypoints={MAX_KEYPOINTS} side={MAX_SIDE_PX} window={WINDOW_PX}"),
            note="keypoints are whole pixels; fails, as every finder of keypoints, where nothing has texture",
        )

    def encode(self, rgb: UInt8[np.ndarray, "h w 3"]) -> LocalFeatures:
        """Return at most ``MAX_KEYPOINTS`` keypoints, row by row; the score is the sigmoid of DISK's logit."""
        if has_nothing(rgb):
            return no_features(DIM, rgb)
        seen = shrunk(rgb, MAX_SIDE_PX)
        picture = torch.from_numpy(np.ascontiguousarray(seen.transpose(2, 0, 1)))[None].to(self._device)
        with inference():  # in float32: half precision makes neighbours equal, and then neither is a maximum
            found = self._network(
                picture.float() / 255.0, n=MAX_KEYPOINTS, window_size=WINDOW_PX, pad_if_not_divisible=True
            )[0]
        score = to_numpy(torch.sigmoid(found.detection_scores))
        return local_features(to_numpy(found.keypoints), unit_rows(found.descriptors), score, seen, rgb)


def _file_name(model: str) -> str:
    if model.endswith((".pth", ".pt", ".safetensors")):
        return model
    variant = model.removeprefix("disk-")
    if variant not in _VARIANTS:
        raise BackendError(
            f"There is no DISK called {model!r}; choose {', '.join(f'disk-{v}' for v in _VARIANTS)} or a file."
        )
    return f"{variant}-save.pth"
