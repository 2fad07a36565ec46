"""Half precision where it is worth it: on a GPU, with the weights and all coordinates in float32."""

from collections.abc import Iterator
from contextlib import contextmanager

import torch

from avlmaps_models.common.device import inference, select_dtype


@contextmanager
def mixed_precision(device: torch.device) -> Iterator[None]:
    """Run without gradients, and on a GPU in the chosen type wherever torch holds that to be safe (autocast).

    For networks that read places in a picture: a float16 holds no fraction of a pixel above 1024. On a CPU half
    precision is slower, so that everything stays float32 there.
    """
    kind = select_dtype(device)
    half = device.type != "cpu" and kind is not torch.float32
    with inference(), torch.autocast(device.type, dtype=kind if half else None, enabled=half):
        yield
