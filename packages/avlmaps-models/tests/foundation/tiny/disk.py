"""DISK with random weights, in the layout of the published ``depth-save.pth``."""

from pathlib import Path

import torch
from kornia.feature import DISK


def write_disk(folder: Path) -> None:
    """Write ``depth-save.pth``: the extractor beside something of its training, as the published file has it."""
    torch.manual_seed(1)
    torch.save({"extractor": DISK().state_dict(), "baseline": torch.zeros(3)}, folder / "depth-save.pth")
