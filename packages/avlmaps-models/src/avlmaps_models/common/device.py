"""Where torch runs, and in which precision; importing it makes torchvision importable, too (``models.operators``)."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache

import numpy as np
import torch
from jaxtyping import Float32

from avlmaps.core.errors import BackendError
from avlmaps.core.wording import option
from avlmaps.perception.models import model_settings, resolve_precision
from avlmaps_models.common.operators import declare_missing_operators

declare_missing_operators()
_TYPES = {"float32": torch.float32, "float16": torch.float16, "bfloat16": torch.bfloat16}


def select_device() -> torch.device:
    """Return the device of the settings.

    Raises:
        BackendError: it is not there.
    """
    _use_cores()
    wanted = model_settings().device
    if wanted == "auto":
        if torch.cuda.is_available():
            return torch.device("cuda")
        return torch.device("mps" if torch.backends.mps.is_available() else "cpu")
    try:
        device = torch.device(wanted)
        torch.zeros(1, device=device)
    except (RuntimeError, AssertionError) as fault:
        here = "cuda" if torch.cuda.is_available() else "mps" if torch.backends.mps.is_available() else "cpu"
        raise BackendError(
            f"The device {wanted!r} cannot be used here ({fault}); choose {option('device', here)}."
        ) from fault
    return device


@cache
def _use_cores() -> None:
    """Let large models on the CPU use all cores, as torch would, though the command line limits all else to one."""
    threads = os.environ.get("AVLMAPS_TORCH_THREADS", "")
    if threads.isdecimal() and int(threads):
        torch.set_num_threads(int(threads))


def select_dtype(device: torch.device) -> torch.dtype:
    """Return the precision of the settings: by default float16 on CUDA, float32 elsewhere."""
    wanted = model_settings().precision
    if wanted == "auto":
        return torch.float16 if device.type == "cuda" else torch.float32
    return _TYPES[wanted]


def select_batch(on_gpu: int) -> int:
    """Return how many pictures go through at once: the settings' number, else ``on_gpu`` on a GPU and 1 elsewhere."""
    return model_settings().batch or (1 if select_device().type == "cpu" else on_gpu)


@contextmanager
def inference() -> Iterator[None]:
    """Run without gradients."""
    with torch.inference_mode():
        yield


def to_numpy(rows: torch.Tensor) -> Float32[np.ndarray, "..."]:
    """Return a tensor as float32 on the CPU."""
    return rows.detach().to("cpu", torch.float32).numpy()


def unit_rows(rows: torch.Tensor) -> Float32[np.ndarray, "... d"]:
    """Return rows scaled to unit length in float32; a row of zeros stays one."""
    rows = rows.detach().to(torch.float32)
    return to_numpy(rows / rows.norm(dim=-1, keepdim=True).clamp_min(1e-12))


resolve_precision(lambda: str(select_dtype(select_device())).removeprefix("torch."))
