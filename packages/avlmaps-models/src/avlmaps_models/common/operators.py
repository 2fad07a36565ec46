"""Letting transformers, timm and open_clip be imported beside a torchvision that was built for another torch.

They import torchvision for its resizing, which is plain torch. The wheel of torchvision that the public index offers is
built for CUDA; beside the CPU's build of torch its compiled operators cannot be loaded, and then its import fails
altogether, because it wants to describe two of them (suppression of overlapping boxes) that no model here calls.
"""

from importlib.util import find_spec
from pathlib import Path

import torch

_BOXES = "(Tensor dets, Tensor scores, float iou_threshold) -> Tensor"


def declare_missing_operators() -> bool:
    """Declare what torchvision wants to describe where its own operators cannot be loaded; return whether that was so.

    Called again it does nothing.
    """
    if not _unloadable():
        return False
    for name in ("nms", "qnms"):
        if not hasattr(torch.ops.torchvision, name):
            _declared.define(f"{name}{_BOXES}")
    return True


_declared = torch.library.Library("torchvision", "FRAGMENT")


def _unloadable() -> bool:
    spec = find_spec("torchvision")
    folders = spec.submodule_search_locations if spec is not None else None
    for compiled in (path for folder in folders or () for path in Path(folder).glob("_C*.so")):
        try:
            torch.ops.load_library(str(compiled))
        except OSError:
            return True
    return False
