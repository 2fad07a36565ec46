"""LightGlue (Lindenberger, Sarlin, Pollefeys 2023), as kornia runs it: a transformer that matches keypoints.

Published as ``disk_lightglue.pth`` and ``aliked_lightglue.pth`` (github.com/cvg/LightGlue, release v0.1_arxiv; copies
in the hub's kornia/lightglue), Apache-2.0; 12 million weights, nine layers. It reads keypoints, relative to the
pictures' sizes, and their descriptors of 128 numbers. It stops after fewer layers when it is confident, drops keypoints
that match nothing, with the published thresholds; pairs are each other's best with a score above 0.1. The weights hold
for the keypoints that they were learnt on, and for no others.
"""

from pathlib import Path

import numpy as np
from jaxtyping import Int
from kornia.feature import LightGlue as KorniaLightGlue

from avlmaps.core.errors import BackendError
from avlmaps.perception.protocols import LocalFeatures, ModelCard
from avlmaps_models.common.checksums import checksum_of
from avlmaps_models.common.device import select_device
from avlmaps_models.common.matches import network_input, no_matches
from avlmaps_models.common.precision import mixed_precision
from avlmaps_models.common.published import load_strictly, published_file, read_tensors

DIM = 128
SCORE = 0.1
LAYERS = 9
_KEYPOINTS = ("disk", "aliked")
_REPOSITORY = "kornia/lightglue"
_COMPUTED = ("confidence_thresholds",)


class LightGlue:
    """Matches DISK or ALIKED keypoints.

    Args:
        model: which keypoints it was learnt on, ``disk`` or ``aliked``; or a path to a checkpoint in their layout.

    Raises:
        BackendError: the file is not here, or is not LightGlue's.
    """

    learned = True

    def __init__(self, model: str = "disk") -> None:
        name = _file_name(model)
        get = f"hf download {_REPOSITORY} {Path(name).name}"
        stem = Path(name).stem
        cached = [f"checkpoints/{stem}{ending}" for ending in (".pth", "_v0-1_arxiv.pth", "_v0-1_arxiv-pth")]
        path = published_file(name, get, _REPOSITORY, cached)
        network = KorniaLightGlue(features=None, input_dim=DIM, filter_threshold=SCORE, n_layers=LAYERS)  # pyright: ignore[reportArgumentType]
        state = {_present_name(key): value for key, value in read_tensors(path, get).items()}
        # The published files hold constants of training, too (log_assignment.0.r ...), which its loader ignores.
        load_strictly(network, state, path, get, computed=_COMPUTED, takes_all=False)
        self._device = select_device()
        self._network = network.eval().to(self._device)
        self.card = ModelCard(
            id=f"lightglue/{Path(name).name}",
            dim=DIM,
            licence="Apache-2.0",
            checksum=checksum_of([path], f"lightglue score={SCORE}"),
            note="matches only the keypoints that it was learnt on",
        )

    def match(self, a: LocalFeatures, b: LocalFeatures) -> Int[np.ndarray, "m 2"]:
        """Return rows (index in a, index in b), rising in a; each index at most once.

        Raises:
            BackendError: the descriptors are not as long as DISK's and ALIKED's, or a picture's size is not known.
        """
        if not len(a.xy) or not len(b.xy):
            return no_matches()
        inputs = [network_input(one, self.card, self._device) for one in (a, b)]
        data = [
            {"keypoints": one.index[None], "descriptors": one.descriptors[None], "image_size": one.size[None]}
            for one in inputs
        ]
        with mixed_precision(self._device):
            pairs = self._network({"image0": data[0], "image1": data[1]})["matches"][0]
        return pairs.cpu().numpy().astype(np.int64).reshape(-1, 2)


def _file_name(model: str) -> str:
    if model.endswith((".pth", ".pt", ".safetensors")):
        return model
    if model not in _KEYPOINTS:
        raise BackendError(f"There is no LightGlue here for {model!r}; choose {' or '.join(_KEYPOINTS)}, or a file.")
    return f"{model}_lightglue.pth"


def _present_name(key: str) -> str:
    """Return today's name of a weight: ``self_attn.0`` of the published files is ``transformers.0.self_attn``."""
    block, dot, rest = key.removeprefix("matcher.").partition(".")
    layer, dot, rest = rest.partition(".") if block in ("self_attn", "cross_attn") else ("", dot, rest)
    return f"transformers.{layer}.{block}.{rest}" if layer.isdecimal() else f"{block}{dot}{rest}"
