"""LightGlue in the layout of ``disk_lightglue.pth``: random weights, or ones that match like with like."""

from pathlib import Path

import torch
from kornia.feature import LightGlue


def write_lightglue(folder: Path, keypoints: str = "disk", random: bool = False) -> None:
    """Write ``<keypoints>_lightglue.pth`` with the names of release v0.1, ``self_attn.0`` for today's transformers.0.

    Args:
        folder: of models.
        keypoints: ``disk`` or ``aliked``.
        random: leave all weights at random; else attention adds nothing, and pairs are as likely as they are alike.
    """
    torch.manual_seed(3)
    state = LightGlue(features=None, input_dim=128).state_dict()
    del state["confidence_thresholds"]
    if not random:
        for name, weight in state.items():
            if name.endswith(("ffn.3.weight", "ffn.3.bias", "final_proj.bias", "matchability.weight")):
                weight.zero_()
            elif name.endswith("final_proj.weight"):
                weight.copy_(400.0 * torch.eye(len(weight)))
            elif name.endswith("matchability.bias"):
                weight.fill_(10.0)
        state["input_proj.weight"].copy_(torch.eye(256, 128))
        state["input_proj.bias"].zero_()
    torch.save({_published(name): weight for name, weight in state.items()}, folder / f"{keypoints}_lightglue.pth")


def _published(name: str) -> str:
    if not name.startswith("transformers."):
        return name
    _, layer, block, rest = name.split(".", 3)
    return f"{block}.{layer}.{rest}"
