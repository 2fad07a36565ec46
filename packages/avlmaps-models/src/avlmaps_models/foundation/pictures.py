"""Pictures on their way into a transformer: as which numbers, several at once."""

from collections.abc import Callable, Iterable, Sequence
from typing import Literal

import numpy as np
import torch
from jaxtyping import Float32, UInt8

from avlmaps.core.errors import BackendError
from avlmaps.recordings.types import Frame
from avlmaps_models.common.picture_sizes import Size


def stack_pictures(
    pictures: Sequence[UInt8[np.ndarray, "h w 3"]],
    size: Size,
    device: torch.device,
    precision: torch.dtype,
    how: Literal["bicubic", "bilinear"] = "bicubic",
) -> torch.Tensor:
    """Return pictures of one size as a tensor (b, 3, height, width) in [0, 1], resized without aliasing.

    Args:
        pictures: all of one shape.
        size: (height, width) to resize to.
        device: where the tensor goes; the resizing is done there.
        precision: of the result; the resizing is done in float32.
        how: the resizing interpolates.
    """
    picture = torch.from_numpy(np.ascontiguousarray(np.stack(pictures))).to(device)
    picture = picture.permute(0, 3, 1, 2).to(torch.float32).div(255.0)
    if picture.shape[-2:] != size:
        picture = torch.nn.functional.interpolate(picture, size=size, mode=how, align_corners=False, antialias=True)
    return picture.clamp(0.0, 1.0).to(precision)


def encode_in_batches(
    frames: Sequence[Frame],
    batch: int,
    encode: Callable[[list[UInt8[np.ndarray, "h w 3"]]], Iterable[Float32[np.ndarray, "hf wf d"]]],
) -> list[Float32[np.ndarray, "hf wf d"]]:
    """Encode the frames' colour pictures, at most ``batch`` at once; those of one batch have the same shape."""
    out: list[Float32[np.ndarray, "hf wf d"]] = []
    start = 0
    while start < len(frames):
        stop = start + 1
        while stop < min(start + batch, len(frames)) and frames[stop].rgb.shape == frames[start].rgb.shape:
            stop += 1
        out.extend(encode([frame.rgb for frame in frames[start:stop]]))
        start = stop
    return out


def split_model_way(choice: str, ways: Sequence[str]) -> tuple[str, str]:
    """Split a choice into a model and the kind of its features: ``model#way``, by default the first.

    Raises:
        BackendError: there is no such way.
    """
    model, _, way = choice.partition("#")
    if way and way not in ways:
        raise BackendError(f"{model} gives no features of the kind {way!r}; choose one of: {', '.join(ways)}.")
    return model, way or ways[0]
