"""The network: a residual U-Net on geometry, colour as a small late branch, and a head for the kind of room."""

import torch
from torch import Tensor, nn

GEOMETRY, COLOUR = 8, 3


class Block(nn.Module):
    """Two 3x3 convolutions round a shortcut."""

    def __init__(self, width: int) -> None:
        super().__init__()
        self.first = nn.Conv2d(width, width, 3, padding=1, bias=False)
        self.norm_first = nn.BatchNorm2d(width)
        self.second = nn.Conv2d(width, width, 3, padding=1, bias=False)
        self.norm_second = nn.BatchNorm2d(width)
        nn.init.zeros_(self.norm_second.weight)

    def forward(self, x: Tensor) -> Tensor:
        """Return features of the same shape."""
        y = torch.relu(self.norm_first(self.first(x)))
        return torch.relu(x + self.norm_second(self.second(y)))


def step(inputs: int, outputs: int, stride: int = 1, size: int = 3) -> nn.Sequential:
    """Return convolution, normalisation and rectifier."""
    return nn.Sequential(
        nn.Conv2d(inputs, outputs, size, stride, size // 2, bias=False), nn.BatchNorm2d(outputs), nn.ReLU(inplace=True)
    )


class RoomNetwork(nn.Module):
    """Geometry and colour to scores of categories at half the picture's size, and of kinds of room per picture.

    Args:
        categories: how many.
        rooms: how many kinds of room.
        widths: channels at 1/2, 1/4, 1/8 and 1/16 of the picture's size.
    """

    def __init__(self, categories: int, rooms: int, widths: tuple[int, ...] = (40, 80, 144, 208)) -> None:
        super().__init__()
        b, c, d, e = widths
        self.stem = nn.Sequential(step(GEOMETRY, b, 2), Block(b))
        self.down2 = nn.Sequential(step(b, c, 2), Block(c))
        self.down3 = nn.Sequential(step(c, d, 2), Block(d), Block(d))
        self.down4 = nn.Sequential(step(d, e, 2), Block(e), Block(e))
        self.colour = nn.Sequential(step(COLOUR, 16, 2), step(16, 32, 2), step(32, 32))
        self.whole = nn.Linear(e, e)
        self.side3, self.side2, self.side1 = (
            step(d + e, d, size=1),
            step(c + d + 32, c, size=1),
            step(b + c + 16, b, size=1),
        )
        self.up3, self.up2, self.up1 = Block(d), Block(c), Block(b)
        self.score = nn.Conv2d(b, categories, 1)
        self.room = nn.Sequential(
            nn.Linear(2 * e + d, 128), nn.ReLU(inplace=True), nn.Dropout(0.3), nn.Linear(128, rooms)
        )

    def forward(self, geometry: Tensor, colour: Tensor) -> tuple[Tensor, Tensor]:
        """Return (n, categories, h/2, w/2) and (n, rooms) scores before any softmax; h and w are multiples of 16."""
        x1 = self.stem(geometry)
        x2 = self.down2(x1)
        x3 = self.down3(x2)
        x4 = self.down4(x3)
        fine = self.colour[0](colour)
        coarse = self.colour[1:](fine)
        mean, top = x4.mean(dim=(2, 3)), x4.amax(dim=(2, 3))
        x4 = x4 + self.whole(mean)[:, :, None, None]
        y3 = self.up3(self.side3(torch.cat([x3, _doubled(x4)], 1)))
        y2 = self.up2(self.side2(torch.cat([x2, _doubled(y3), coarse], 1)))
        y1 = self.up1(self.side1(torch.cat([x1, _doubled(y2), fine], 1)))
        return self.score(y1), self.room(torch.cat([mean, top, y3.mean(dim=(2, 3))], 1))


def _doubled(x: Tensor) -> Tensor:
    return nn.functional.interpolate(x, scale_factor=2.0, mode="nearest")


def has_bfloat16(device: torch.device) -> bool:
    """Say whether the device multiplies bfloat16 rather than imitates it (three times slower than float32)."""
    return device.type != "cpu" or torch.cpu._is_avx512_bf16_supported()
