"""SuperGlue (Sarlin, DeTone, Malisiewicz, Rabinovich 2020): the matcher of the paper, on stored keypoints.

Published as magic-leap-community/superglue_indoor (12 million weights; Magic Leap's licence: academic and
non-commercial use only). transformers holds the network, but only for a pair of pictures of one size, whose keypoints
it finds itself and fills up to one number, which changes the optimal transport a little. So its parts are run here one
after the other on what the map stores of each picture: keypoints relative to their picture's size, scores and
descriptors of 256 numbers; keypoint encoder, attention within and across, projection, 100 Sinkhorn iterations. Pairs
are each other's best with a probability above 0.2, as in the paper's code (the hub's configuration says 0). No
coordinate is rounded.
"""

from typing import Any

import numpy as np
import torch
from jaxtyping import Float, Int

from avlmaps.core.errors import BackendError
from avlmaps.perception.models import public_name
from avlmaps.perception.protocols import LocalFeatures, ModelCard
from avlmaps_models.common.checksums import checksum_of, weights_in
from avlmaps_models.common.device import select_device
from avlmaps_models.common.matches import NetworkInput, network_input, no_matches
from avlmaps_models.common.operators import declare_missing_operators
from avlmaps_models.common.precision import mixed_precision
from avlmaps_models.common.pretrained import load_pretrained, pretrained_folder

PROBABILITY = 0.2
ITERATIONS = 100
_FIELD = 0.7  # keypoints are given as parts of this part of the longer side


class SuperGlue:
    """Matches SuperPoint keypoints.

    Args:
        model: the hub's id (``..._indoor``, ``..._outdoor``), or a folder in its layout.

    Raises:
        BackendError: it is not here, or is not SuperGlue's.
    """

    learned = True

    def __init__(self, model: str = "magic-leap-community/superglue_indoor") -> None:
        declare_missing_operators()
        from transformers import SuperGlueForKeypointMatching

        folder = pretrained_folder(model)
        self._device = select_device()
        network = load_pretrained(SuperGlueForKeypointMatching, folder, model, self._device, torch.float32)
        del network.keypoint_detector  # the SuperPoint that came with it; the map's keypoints are found already
        self._network: Any = network
        self.card = ModelCard(
            id=public_name(model),
            dim=int(network.config.hidden_size),
            licence="LicenseRef-MagicLeap-NonCommercial",
            checksum=checksum_of(weights_in(folder), f"superglue above={PROBABILITY} iterations={ITERATIONS}"),
            note="non-commercial; matches SuperPoint's keypoints only, time and memory grow with their number squared",
        )

    def match(self, a: LocalFeatures, b: LocalFeatures) -> Int[np.ndarray, "m 2"]:
        """Return rows (index in a, index in b), rising in a; each index at most once.

        Raises:
            BackendError: keypoints without scores or without their picture's size, or descriptors of another length.
        """
        if not len(a.xy) or not len(b.xy):
            return no_matches()
        for one in (a, b):
            if len(one.score) != len(one.xy):
                raise BackendError(
                    f"The matcher {self.card.id} needs the score of each keypoint; these came without. Build the map "
                    "again, with SuperPoint's keypoints."
                )
        with mixed_precision(self._device):
            first, second = self._described(*(network_input(one, self.card, self._device) for one in (a, b)))
        with torch.inference_mode():
            likeness = first.float() @ second.float().T / self.card.dim**0.5
            if self._device.type == "mps":  # has no float64
                likeness = likeness.cpu()
            likely = sinkhorn(likeness, self._network.bin_score, ITERATIONS)
        return mutual_best(likely.cpu().numpy(), PROBABILITY)

    def _described(self, a: NetworkInput, b: NetworkInput) -> tuple[torch.Tensor, torch.Tensor]:
        """Return descriptors, (n, d) and (m, d), that know their own picture and the other."""
        first, second = self._encoded(a), self._encoded(b)
        gnn = self._network.gnn
        for layer, kind in zip(gnn.layers, gnn.layers_types, strict=True):
            sources = (second, first) if kind == "cross" else (first, second)
            first, second = (
                states + layer(states, encoder_hidden_states=source)[0]
                for states, source in zip((first, second), sources, strict=True)
            )
        return self._network.final_projection(first)[0], self._network.final_projection(second)[0]

    def _encoded(self, picture: NetworkInput) -> torch.Tensor:
        """Return descriptors, (1, n, d), to which the place and the score of their keypoints are added."""
        places = (picture.index - picture.size / 2.0) / (picture.size.max() * _FIELD)
        return picture.descriptors[None] + self._network.keypoint_encoder(places[None], picture.score[None])[0]


def sinkhorn(likeness: torch.Tensor, idle: torch.Tensor, iterations: int) -> torch.Tensor:
    """Return how likely each pair is by optimal transport with a bin for those that match nothing (Sinkhorn).

    The published code does the same with logarithms in float32. Products in float64 need no logarithm in each round,
    which takes a tenth of the time: after each row is divided by its largest entry, nothing can overflow, and the bins
    keep every sum above zero.

    Args:
        likeness: (n, m) scores of the pairs.
        idle: the score of matching nothing.
        iterations: alternating normalisations of rows and columns.

    Returns:
        (n, m) probabilities, float64; rows and columns sum to at most about 1.
    """
    n, m = likeness.shape
    scores = torch.nn.functional.pad(likeness.double(), (0, 1, 0, 1), value=float(idle))
    kernel = (scores - scores.amax(dim=1, keepdim=True)).exp()
    # Each keypoint weighs 1, a bin as much as all keypoints of the other picture.
    rows, columns = kernel.new_ones(n + 1), kernel.new_ones(m + 1)
    rows[-1], columns[-1] = m, n
    by_row, by_column = torch.ones_like(rows), torch.ones_like(columns)
    for _ in range(iterations):
        by_row = rows / (kernel @ by_column)
        by_column = columns / (by_row @ kernel)
    return (by_row[:, None] * kernel * by_column)[:-1, :-1]


def mutual_best(likely: Float[np.ndarray, "n m"], above: float) -> Int[np.ndarray, "k 2"]:
    """Return the pairs that are the likeliest of both their row and their column, and likelier than a bound."""
    rows = np.arange(len(likely))
    best = likely.argmax(axis=1)
    kept = rows[(likely.argmax(axis=0)[best] == rows) & (likely[rows, best] > above)]
    return np.stack([kept, best[kept]], axis=1).astype(np.int64)
