"""Whole pictures on their way into a network that describes places: resized, with ImageNet's mean and deviation."""

import numpy as np
import torch
from jaxtyping import UInt8

_MEAN, _DEVIATION = (0.485, 0.456, 0.406), (0.229, 0.224, 0.225)


def imagenet_picture(
    rgb: UInt8[np.ndarray, "h w 3"],
    size: tuple[int, int],
    device: torch.device,
) -> torch.Tensor:
    """Return a picture as (1, 3, height, width) in float32, resized without aliasing where it has another size.

    Args:
        rgb: the picture.
        size: (height, width) that it shall have.
        device: where the tensor goes; the resizing is done there.
    """
    picture = torch.from_numpy(np.ascontiguousarray(rgb)).to(device).permute(2, 0, 1)[None].to(torch.float32) / 255.0
    if picture.shape[-2:] != size:
        picture = torch.nn.functional.interpolate(
            picture, size=size, mode="bilinear", align_corners=False, antialias=True
        )
    mean, deviation = (torch.tensor(row, device=device).view(1, 3, 1, 1) for row in (_MEAN, _DEVIATION))
    return (picture - mean) / deviation
