"""The input of learned matchers: keypoints as their networks count pixels, descriptors, scores, the picture's size."""

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Int

from avlmaps.core.errors import BackendError
from avlmaps.perception.protocols import LocalFeatures, ModelCard
from avlmaps_models.common.pictures import PIXEL_CENTRE

_ROUNDING_PX = 1.0


@dataclass(frozen=True, slots=True)
class NetworkInput:
    """One picture's keypoints on the device, float32.

    Attributes:
        index: (n, 2) x and y, the centre of the first pixel at (0, 0), inside the picture.
        descriptors: (n, d).
        score: (n,); empty where it is not known.
        size: (2,) width and height.
    """

    index: torch.Tensor
    descriptors: torch.Tensor
    score: torch.Tensor
    size: torch.Tensor


def network_input(local: LocalFeatures, card: ModelCard, device: torch.device) -> NetworkInput:
    """Return a picture's keypoints as a learned matcher reads them.

    Args:
        local: at least one keypoint.
        card: the matcher's; ``dim`` is the length of the descriptors that it was learnt on.
        device: where it runs.

    Raises:
        BackendError: descriptors of another length, no size, or keypoints outside of the picture.
    """
    if local.descriptors.shape[1] != card.dim:
        raise BackendError(
            f"The matcher {card.id} was learnt on descriptors of {card.dim} numbers, these have "
            f"{local.descriptors.shape[1]}; choose the matcher that was made for the keypoints."
        )
    size = np.array(local.size, np.float32)
    if not (size > 0).all():
        raise BackendError(f"The matcher {card.id} needs the size of the picture; its keypoints came without.")
    if (local.xy < -_ROUNDING_PX).any() or (local.xy > size + _ROUNDING_PX).any():
        raise BackendError(
            f"Keypoints lie outside of their picture of {local.size[0]}x{local.size[1]}: up to "
            f"{local.xy.max(axis=0).tolist()}; give the size of the picture that they were found in."
        )
    index = np.clip(local.xy - PIXEL_CENTRE, 0.0, size)
    arrays = (index, local.descriptors, local.score, size)
    return NetworkInput(*(torch.from_numpy(np.array(array, np.float32)).to(device) for array in arrays))


def no_matches() -> Int[np.ndarray, "m 2"]:
    """Return no matches."""
    return np.zeros((0, 2), np.int64)
