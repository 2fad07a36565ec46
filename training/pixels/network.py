"""The network: a residual U-Net on geometry with colour beside it, and heads for the room and for the floor."""

import torch
from torch import Tensor, nn
from training.pixels.tower import TOWER_WIDTHS, Tower

GEOMETRY, COLOUR = 8, 3
# Pictures are padded to a multiple of this.
MULTIPLE = 32
# Channels at 1/2, 1/4, 1/8, 1/16 and 1/32 of the picture's size.
WIDTHS = (32, 64, 128, 192, 224)


class Block(nn.Module):
    """Two 3x3 convolutions round a shortcut; it begins as the identity."""

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


class Joint(nn.Module):
    """A 1x1 convolution whose output is added to other features; it begins at zero."""

    def __init__(self, inputs: int, outputs: int) -> None:
        super().__init__()
        self.mix = nn.Conv2d(inputs, outputs, 1, bias=False)
        self.norm = nn.BatchNorm2d(outputs)
        nn.init.zeros_(self.norm.weight)

    def forward(self, x: Tensor) -> Tensor:
        """Return the residual."""
        return self.norm(self.mix(x))


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
        widths: see ``WIDTHS``.
        dropout: share of channels at 1/16 and before the scores that training withholds.
        has_tower: colour has twice the size of geometry, and a tower that knows photographs looks at it.

    Attributes:
        fineness: how many times as wide and high as geometry the colour is.
    """

    def __init__(
        self,
        categories: int,
        rooms: int,
        widths: tuple[int, ...] = WIDTHS,
        dropout: tuple[float, float] = (0.1, 0.1),
        has_tower: bool = False,
    ) -> None:
        super().__init__()
        b, c, d, e, f = widths
        self.stem = nn.Sequential(step(GEOMETRY, b, 2), Block(b))
        self.down2 = nn.Sequential(step(b, c, 2), Block(c))
        self.down3 = nn.Sequential(step(c, d, 2), Block(d), Block(d))
        self.down4 = nn.Sequential(step(d, e, 2), Block(e), Block(e))
        self.down5 = nn.Sequential(step(e, f, 2), Block(f))
        self.colour = nn.Sequential(step(COLOUR, 16, 2), step(16, 32, 2), step(32, 32))
        self.colour3 = nn.Sequential(step(32, 64, 2), Block(64))
        self.colour4 = nn.Sequential(step(64, 96, 2), Block(96))
        self.whole = nn.Linear(e, e)
        self.from_colour3, self.from_colour4, self.from5 = Joint(64, d), Joint(96, e), Joint(f, e)
        self.drop4, self.drop1 = nn.Dropout2d(dropout[0]), nn.Dropout2d(dropout[1])
        self.side3, self.side2, self.side1 = (
            step(d + e, d, size=1),
            step(c + d + 32, c, size=1),
            step(b + c + 16, b, size=1),
        )
        self.up3, self.up2, self.up1 = Block(d), Block(c), Block(b)
        self.tower, self.fineness = (Tower(), 2) if has_tower else (None, 1)
        if has_tower:
            self.from_tower = nn.ModuleList(Joint(w, t) for w, t in zip(TOWER_WIDTHS, (b, c, d, e), strict=True))
        self.score = nn.Conv2d(b, categories, 1)
        pooled = 2 * e + d
        self.room = nn.Sequential(nn.Linear(pooled, 128), nn.ReLU(inplace=True), nn.Dropout(0.3), nn.Linear(128, rooms))
        self.floor = nn.Sequential(nn.Linear(pooled, 64), nn.ReLU(inplace=True), nn.Linear(64, 1))

    def forward(self, geometry: Tensor, colour: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Return scores before any softmax, (n, categories, h/2, w/2) and (n, rooms), and (n, 1) metres of floor.

        The last is the height of the true floor over the one that the geometry was made with. h and w are multiples
        of ``MULTIPLE``; with a tower, colour is (n, 3, 2 h, 2 w).
        """
        towered = self._towered(colour)
        if towered:
            colour = nn.functional.avg_pool2d(colour, 2)
        x1 = self.stem(geometry)
        x2 = self.down2(x1)
        x3 = self.down3(x2)
        x4 = self.down4(x3)
        fine = self.colour[0](colour)
        coarse = self.colour[1:](fine)
        mean, top = x4.mean(dim=(2, 3)), x4.amax(dim=(2, 3))
        colour3 = self.colour3(coarse)
        deep = x4 + self.from_colour4(self.colour4(colour3))
        deep = torch.relu(deep + towered[3] if towered else deep)
        deep = deep + _doubled(self.from5(self.down5(deep)))
        deep = self.drop4(deep + self.whole(mean)[:, :, None, None])
        y3 = self.side3(torch.cat([x3, _doubled(deep)], 1)) + self.from_colour3(colour3)
        y3 = self.up3(torch.relu(y3 + towered[2] if towered else y3))
        y2 = self.side2(torch.cat([x2, _doubled(y3), coarse], 1))
        y2 = self.up2(torch.relu(y2 + towered[1]) if towered else y2)
        y1 = self.side1(torch.cat([x1, _doubled(y2), fine], 1))
        y1 = self.up1(torch.relu(y1 + towered[0]) if towered else y1)
        pooled = torch.cat([mean, top, y3.mean(dim=(2, 3))], 1)
        return self.score(self.drop1(y1)), self.room(pooled), self.floor(pooled)

    def _towered(self, colour: Tensor) -> list[Tensor]:
        """Return what the tower adds at 1/2, 1/4, 1/8 and 1/16 of the geometry's size; nothing without a tower."""
        if self.tower is None:
            return []
        return [joint(x) for joint, x in zip(self.from_tower, self.tower(colour), strict=True)]


def _doubled(x: Tensor) -> Tensor:
    return nn.functional.interpolate(x, scale_factor=2.0, mode="nearest")


def has_bfloat16(device: torch.device) -> bool:
    """Return whether bfloat16 is quicker than float32: on a CPU with tiles (AMX) alone.

    Without AVX512-BF16 it is imitated, three times slower; with it but no tiles a step takes 1.14 s instead of 0.89 s.
    """
    return device.type != "cpu" or torch.cpu._is_amx_tile_supported()


def begin_with(network: RoomNetwork, state: dict[str, Tensor]) -> list[str]:
    """Load the weights of an earlier network into the parts that it had; return the names of the others.

    Scores of kinds that it did not know begin at zero weights and a bias low enough to leave the others as they were.
    """
    own = network.state_dict()
    new = []
    for name, value in own.items():
        old = state.get(name)
        if old is None:
            new.append(name)
        elif old.shape == value.shape:
            value.copy_(old)
        elif name.startswith("score."):
            value.zero_() if value.ndim > 1 else value.fill_(-6.0)
            value[: len(old)].copy_(old)
        else:
            new.append(name)
    return new
