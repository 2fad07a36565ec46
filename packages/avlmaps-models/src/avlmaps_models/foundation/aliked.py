"""ALIKED keypoints (Zhao and others 2023), as kornia runs them: sub-pixel, with deformable descriptors.

Published as ``aliked-n16.pth``, ``aliked-n16rot.pth``, ``aliked-n32.pth`` and ``aliked-t16.pth``
(github.com/Shiaoming/ALIKED; copies in the hub's kornia/aliked), BSD-3-Clause. The network has 0.3 to 1 million
weights and sees colours in [0, 1] as they are. Keypoints are maxima of the score map in 5x5 windows with a
score above 0.2, moved by a soft arg-max, the strongest ``MAX_KEYPOINTS``; their descriptors have 128 numbers (64 for
t16). Where no maximum is above the threshold, those above the picture's mean are taken. Pictures whose longer side has
more than ``MAX_SIDE_PX`` are looked at in a smaller copy.
"""

from pathlib import Path

import numpy as np
import torch
from jaxtyping import UInt8
from kornia.feature import ALIKED
from torch.nn import functional

from avlmaps.core.errors import BackendError
from avlmaps.perception.protocols import LocalFeatures, ModelCard
from avlmaps_models.common.checksums import checksum_of
from avlmaps_models.common.device import inference, select_device, to_numpy, unit_rows
from avlmaps_models.common.pictures import has_nothing, local_features, no_features, shrunk
from avlmaps_models.common.published import load_strictly, published_file, read_tensors

DIMS = {"aliked-n16": 128, "aliked-n16rot": 128, "aliked-n32": 128, "aliked-t16": 64}
MAX_KEYPOINTS = 2048
MAX_SIDE_PX = 1024
THRESHOLD = 0.2
RADIUS_PX, TEMPERATURE = 2, 0.1  # of the windows, and of the soft arg-max in them
_REPOSITORY = "kornia/aliked"
_COMPUTED = ("dkd.hw_grid",)  # the offsets within a window; the published network works them out, too


class AlikedKeypoints:
    """Finds keypoints by ALIKED.

    Args:
        model: ``aliked-n16``, ``aliked-n16rot`` (trained with turned pictures), ``aliked-n32`` or ``aliked-t16``; or a
            path to such a file, whose name begins with one of these.

    Raises:
        BackendError: the file is not here, or is not ALIKED's.
    """

    def __init__(self, model: str = "aliked-n16") -> None:
        variant = _variant(model)
        name = model if model != variant else f"{model}.pth"
        get = f"hf download {_REPOSITORY} {variant}.pth"
        path = published_file(name, get, _REPOSITORY, [f"checkpoints/{Path(name).name}"])
        network = ALIKED(variant, max_num_keypoints=MAX_KEYPOINTS, detection_threshold=THRESHOLD)
        load_strictly(network, read_tensors(path, get), path, get, computed=_COMPUTED)
        self._device = select_device()
        self._network = network.eval().to(self._device)
        self.card = ModelCard(
            id=f"aliked/{Path(name).name}",
            dim=DIMS[variant],
            licence="BSD-3-Clause",
            checksum=checksum_of([path], f"aliked keypoints={MAX_KEYPOINTS} side={MAX_SIDE_PX} above={THRESHOLD}"),
            note="sub-pixel; bears turned pictures badly but for n16rot",
        )

    def encode(self, rgb: UInt8[np.ndarray, "h w 3"]) -> LocalFeatures:
        """Return at most ``MAX_KEYPOINTS`` keypoints with their scores."""
        if has_nothing(rgb):
            return no_features(self.card.dim, rgb)
        seen = shrunk(rgb, MAX_SIDE_PX)
        if min(seen.shape[:2]) < 8:  # a strip: its windows reach over both borders
            return no_features(self.card.dim, rgb)
        picture = torch.from_numpy(np.ascontiguousarray(seen.transpose(2, 0, 1)))[None].to(self._device)
        with inference():  # in float32: half precision makes neighbours equal, and then neither is a maximum
            features, scores = self._network.extract_dense_map(picture.float() / 255.0)
            places, found = _keypoints(scores[0, 0])
            if not len(places):
                return no_features(self.card.dim, rgb)
            descriptors, _ = self._network.desc_head(features, [places])
        last = np.array([seen.shape[1] - 1, seen.shape[0] - 1])
        index = (to_numpy(places).astype(np.float64) + 1.0) / 2.0 * last
        return local_features(index, unit_rows(descriptors[0]), to_numpy(found), seen, rgb)


def _keypoints(scores: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    """Return places in [-1, 1] and scores of keypoints, as the published code finds them; kornia's finds some fewer.

    A maximum that a stronger neighbour hides is taken where that neighbour is hidden itself.
    """
    peak = _maxima(scores)
    peak[:RADIUS_PX] = peak[-RADIUS_PX:] = False
    peak[:, :RADIUS_PX] = peak[:, -RADIUS_PX:] = False
    chosen = peak & (scores > THRESHOLD)
    row, column = torch.nonzero(chosen if chosen.any() else peak & (scores > scores.mean()), as_tuple=True)
    strongest = scores[row, column].argsort(descending=True)[:MAX_KEYPOINTS].sort().values
    row, column = row[strongest], column[strongest]
    step = torch.arange(-RADIUS_PX, RADIUS_PX + 1, device=scores.device)
    patch = scores[row[:, None, None] + step[:, None], column[:, None, None] + step]
    share = ((patch - patch.amax(dim=(1, 2), keepdim=True)) / TEMPERATURE).exp()
    share = share / share.sum(dim=(1, 2), keepdim=True)
    x = column + (share.sum(dim=1) * step).sum(dim=1)
    y = row + (share.sum(dim=2) * step).sum(dim=1)
    height, width = scores.shape
    place = torch.stack([x / (width - 1), y / (height - 1)], dim=1) * 2.0 - 1.0
    return place, functional.grid_sample(scores[None, None], place[None, None], align_corners=True)[0, 0, 0]


def _maxima(scores: torch.Tensor) -> torch.Tensor:
    """Return where the published suppression of SuperPoint and ALIKED leaves a maximum."""

    def greatest(values: torch.Tensor) -> torch.Tensor:
        return functional.max_pool2d(values[None], 2 * RADIUS_PX + 1, stride=1, padding=RADIUS_PX)[0]

    peak = scores == greatest(scores)
    for _ in range(2):
        hidden = greatest(peak.float()) > 0
        rest = torch.where(hidden, 0.0, scores)
        peak = peak | ((rest == greatest(rest)) & ~hidden)
    return peak


def _variant(model: str) -> str:
    """Return which ALIKED a name or a file's name means; the longest that fits."""
    stem = Path(model).stem if model.endswith((".pth", ".pt", ".safetensors")) else model
    fitting = [name for name in DIMS if stem == name or (stem != model and stem.startswith(name))]
    if not fitting:
        raise BackendError(f"There is no ALIKED called {model!r}; choose {', '.join(DIMS)}, or a file named so.")
    return max(fitting, key=len)
