"""ALIKED with random weights, in the layout of the published ``aliked-n16.pth``."""

from pathlib import Path

import torch
from kornia.feature import ALIKED


def write_aliked(folder: Path, name: str = "aliked-n16") -> None:
    """Write the flat table of weights; the published file has none of the offsets that kornia keeps beside them."""
    torch.manual_seed(2)
    state = ALIKED(name).state_dict()
    del state["dkd.hw_grid"]
    # Their start is all positive, so that all descriptors would be nearly the same.
    torch.nn.init.normal_(state["desc_head.agg_weights"])
    torch.nn.init.orthogonal_(state["desc_head.sf_conv.weight"])
    torch.save(state, folder / f"{name}.pth")
