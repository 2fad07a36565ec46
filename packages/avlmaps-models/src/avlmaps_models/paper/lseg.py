"""Pixels by LSeg, as the paper's maps have them: ``demo_e200.ckpt``, ViT-L/16 and the words of CLIP ViT-B/32.

Li et al., "Language-driven semantic segmentation", ICLR 2022, https://github.com/isl-org/lang-seg. The checkpoint
(MIT; a PyTorch-Lightning file of some gigabytes; the repository's README links it, and so do those of VLMaps and
AVLMaps) is loaded strictly; a flat dictionary of the same weights (lseg-minimal's ``lseg_minimal_e200.ckpt``) does as
well. Features have 512 numbers. A frame of any size is looked at as the published code does it (``lseg_windows``), and
what it has at every second pixel is returned: the network's own grid is no finer, and a quarter of the memory.
``published`` returns all of it, unscaled, to compare.

A word's feature is the mean over 63 sentences. The published code leaves that mean shorter than one, which favours
words whose sentences agree; here every feature has unit length. Intrinsics are the map's affair: the grid covers the
picture evenly for every camera (the published code takes every camera for one of 90 degrees).
"""

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float32, UInt8

from avlmaps.core.errors import BackendError
from avlmaps.perception.models import public_name
from avlmaps.perception.protocols import ModelCard
from avlmaps_models.common.checksums import checksum_of
from avlmaps_models.common.device import inference, select_device, to_numpy, unit_rows
from avlmaps_models.common.files import model_file
from avlmaps_models.common.precision import mixed_precision
from avlmaps_models.common.prompts import Prompted
from avlmaps_models.common.published import network_from
from avlmaps_models.foundation.open_pixels import OpenPixels
from avlmaps_models.paper.archives import read_weights
from avlmaps_models.paper.clip_text import padded
from avlmaps_models.paper.clip_tokens import clip_tokens
from avlmaps_models.paper.lseg_network import LSegNetwork, LSegSizes
from avlmaps_models.paper.lseg_windows import Windows, cut_into_windows, every_nth, joined
from avlmaps_models.paper.prompts import THING_PROMPTS, VOCABULARY

PUBLISHED = "demo_e200.ckpt"
HOW_TO_GET = "gdown 1ayk6NXURI_vIPlym16f_RG3ffxBWHxvb -O demo_e200.ckpt (github.com/isl-org/lang-seg links it)"
_PREFIX = "net."
# Of its variants with another head for logits; no pixel's feature goes through them.
_HEAD_FOR_LOGITS = "scratch.head_block."
_ON_GPU = 8
_WINDOWS_AT_ONCE_ON_CPU = 1


class LSegPixels(OpenPixels):
    """A feature for every second pixel of a picture 520 pixels long, in the space of CLIP ViT-B/32's texts.

    Args:
        model: the checkpoint's name in the folder of models, or a path.
        every: 1 for all pixels of the resized picture, as the published code has them; 2 for every second one.

    Raises:
        BackendError: the checkpoint is not here, damaged, or another network's, or CLIP's tokens are not here.
    """

    def __init__(self, model: str = PUBLISHED, every: int = 2) -> None:
        path = model_file(model, HOW_TO_GET)
        self._device = select_device()
        self._network = read_network(path).to(self._device)
        self._tokens = clip_tokens()
        sizes = self._network.sizes
        if len(self._tokens) != sizes.clip.text.tokens:
            raise BackendError(
                f"{path} was trained with {sizes.clip.text.tokens} tokens, the list of merges that was found makes "
                f"{len(self._tokens)}; get the published file: {HOW_TO_GET}"
            )
        self._every = every
        card = ModelCard(
            id=public_name(model),
            dim=sizes.dim,
            licence="MIT",
            checksum=checksum_of([path], f"lseg 520/480/320 every {every}", *THING_PROMPTS),
            prompts=THING_PROMPTS,
            note="knows best the names of the segmentation data sets that it was trained on; others it knows less well",
        )
        super().__init__(card, Prompted(self._encode_texts, sizes.dim, THING_PROMPTS), 1.0 / 0.07, _ON_GPU)

    @property
    def vocabulary(self) -> tuple[str, ...]:
        """Matterport3D's classes, with which the paper's maps are queried, without ``other``."""
        return VOCABULARY

    def _encode_pictures(self, pictures: list[UInt8[np.ndarray, "h w 3"]]) -> list[Float32[np.ndarray, "hf wf d"]]:
        """Return a unit vector for each cell of a grid about 260 cells long."""
        with mixed_precision(self._device):
            cut = [cut_into_windows(rgb, self._device) for rgb in pictures]
            return [
                unit_rows(joined(windows, features, *every_nth(windows.size, self._every)))
                for windows, features in zip(cut, self._features(cut), strict=True)
            ]

    def published(self, rgb: UInt8[np.ndarray, "h w 3"]) -> Float32[np.ndarray, "d hf wf"]:
        """Return the published code's features of a picture: all pixels, about 14.3 long and not of unit length."""
        with mixed_precision(self._device):
            windows = cut_into_windows(rgb, self._device)
            features = joined(windows, self._features([windows])[0], *every_nth(windows.size, 1))
            return to_numpy(features.permute(2, 0, 1))

    def _features(self, pictures: Sequence[Windows]) -> list[torch.Tensor]:
        """Return the features (n, d, 240, 240) of each picture's windows."""
        pixels = torch.cat([windows.pixels for windows in pictures])
        at_once = _WINDOWS_AT_ONCE_ON_CPU if self._device.type == "cpu" else 2 * max(1, self.batch)
        features = torch.cat([self._network(some) for some in pixels.split(at_once)])
        ends = np.cumsum([0, *(len(windows.corners) for windows in pictures)]).tolist()
        return [features[start:end] for start, end in pairwise(ends)]

    def _encode_texts(self, texts: list[str]) -> Float32[np.ndarray, "n d"]:
        tower = self._network.clip_pretrained
        with inference():
            return unit_rows(tower(padded(self._tokens.encode(texts)).to(self._device)))


def read_network(path: Path) -> LSegNetwork:
    """Return LSeg with all the weights of a checkpoint, on the CPU, without what no feature depends on.

    Raises:
        BackendError: the file is damaged, or another network's.
    """
    state = read_weights(path, HOW_TO_GET, _PREFIX)
    idle = [key for key in state if key.startswith(_HEAD_FOR_LOGITS)]
    what = "LSeg with the backbone clip_vitl16_384"
    network = network_from(lambda: LSegNetwork(LSegSizes.of(state)), what, state, path, HOW_TO_GET, idle)
    network.let_go_of_the_idle()
    return network
