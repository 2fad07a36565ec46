"""LSeg's network under the names of its published checkpoint: a ViT-L/16, a DPT decoder, and a CLIP for the words.

Li et al., "Language-driven semantic segmentation", ICLR 2022; published at https://github.com/isl-org/lang-seg (MIT),
in the form that VLMaps and AVLMaps use (backbone ``clip_vitl16_384``, ``arch_option`` 0, batch normalisation). Written
here from the paper and from the checkpoint's layout. Four blocks of the transformer are tapped; each map of tokens is
joined with the class token, brought to its own scale (4, 2, 1 and 1/2 times the patches), and fused from the coarsest
to the finest; a 1x1 convolution makes CLIP's dimensions of it. The features are half the picture's size.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import torch
from torch import nn
from torch.nn import functional

from avlmaps_models.common.transformer import EPSILON, Block
from avlmaps_models.paper.clip_network import Clip, ClipSizes
from avlmaps_models.paper.clip_text import ClipTextSizes

_LEVELS = (1, 2, 3, 4)
_CLIP, _VIT = "clip_pretrained.", "pretrained.model."
_TEMPERATURE = 0.07


@dataclass(frozen=True, slots=True)
class LSegSizes:
    """How large an LSeg is; the defaults are those of ``demo_e200.ckpt``.

    Attributes:
        clip: of the CLIP inside it.
        patch: side of a patch, pixels.
        grid: patches along a side of the picture that the position embeddings were made for.
        width: of the transformer's residual stream.
        layers: its blocks; a multiple of four.
        classes: outputs of the classifier that the transformer was trained with; never run.
        levels: channels of the four scales.
        fused: channels of the decoder.
    """

    clip: ClipSizes = field(
        default_factory=lambda: ClipSizes(ClipTextSizes(dim=512), side=224, patch=32, width=768, layers=12)
    )
    patch: int = 16
    grid: int = 24
    width: int = 1024
    layers: int = 24
    classes: int = 1000
    levels: tuple[int, int, int, int] = (256, 512, 1024, 1024)
    fused: int = 256

    @property
    def dim(self) -> int:
        """Length of a feature."""
        return self.clip.text.dim

    @property
    def tapped(self) -> tuple[int, ...]:
        """The blocks whose output is used: at a quarter, half, three quarters and the end (5, 11, 17, 23 of 24)."""
        return tuple(self.layers * level // 4 - 1 for level in _LEVELS)

    @classmethod
    def of(cls, state: Mapping[str, torch.Tensor]) -> "LSegSizes":
        """Return the sizes of the network in a checkpoint.

        Raises:
            KeyError: there is no LSeg in it.
        """
        width, _, patch, _ = state[f"{_VIT}patch_embed.proj.weight"].shape
        one, two, three, four = (len(state[f"pretrained.act_postprocess{i}.3.weight"]) for i in _LEVELS)
        return cls(
            clip=ClipSizes.of(state, _CLIP),
            patch=patch,
            grid=round((state[f"{_VIT}pos_embed"].shape[1] - 1) ** 0.5),
            width=width,
            layers=len({key.split(".")[3] for key in state if key.startswith(f"{_VIT}blocks.")}),
            classes=len(state[f"{_VIT}head.weight"]),
            levels=(one, two, three, four),
            fused=len(state["scratch.layer1_rn.weight"]),
        )


class _PatchEmbed(nn.Module):
    def __init__(self, width: int, patch: int) -> None:
        super().__init__()
        self.proj = nn.Conv2d(3, width, patch, patch)


class _VisionTransformer(nn.Module):
    """Returns the tokens (n, 1 + patches, width) behind each tapped block, the class token first."""

    def __init__(self, sizes: LSegSizes) -> None:
        super().__init__()
        self.tapped = sizes.tapped
        self.patch_embed = _PatchEmbed(sizes.width, sizes.patch)
        self.cls_token = nn.Parameter(torch.zeros(1, 1, sizes.width))
        self.pos_embed = nn.Parameter(torch.zeros(1, 1 + sizes.grid**2, sizes.width))
        self.blocks = nn.ModuleList(Block(sizes.width, 4 * sizes.width, scaled=False) for _ in range(sizes.layers))
        self.norm: nn.Module = nn.LayerNorm(sizes.width, eps=EPSILON)
        self.head: nn.Module = nn.Linear(sizes.width, sizes.classes)

    def forward(self, pictures: torch.Tensor) -> list[torch.Tensor]:
        patches = self.patch_embed.proj(pictures)
        places = self._places(patches.shape[-2], patches.shape[-1])
        x = torch.cat([self.cls_token.expand(len(pictures), -1, -1), patches.flatten(2).transpose(1, 2)], dim=1)
        x = x + places.to(x.dtype)
        behind = []
        for number, block in enumerate(self.blocks):
            x = block(x)
            if number in self.tapped:
                behind.append(x)
        return behind

    def _places(self, rows: int, columns: int) -> torch.Tensor:
        """Return the position embeddings for a grid of another size, in between by bilinear interpolation."""
        first, grid = self.pos_embed[:, :1].float(), self.pos_embed[:, 1:].float()
        side = math.isqrt(grid.shape[1])
        grid = grid.reshape(1, side, side, -1).permute(0, 3, 1, 2)
        grid = functional.interpolate(grid, (rows, columns), mode="bilinear", align_corners=False)
        return torch.cat([first, grid.flatten(2).transpose(1, 2)], dim=1)


class _JoinClassToken(nn.Module):
    """Gives every patch what the class token knows of the whole picture."""

    def __init__(self, width: int) -> None:
        super().__init__()
        self.project = nn.Sequential(nn.Linear(2 * width, width), nn.GELU())

    def forward(self, tokens: torch.Tensor) -> torch.Tensor:
        patches = tokens[:, 1:]
        return self.project(torch.cat([patches, tokens[:, :1].expand_as(patches)], dim=-1))


def _rescaling(level: int, channels: int) -> list[nn.Module]:
    """Return the layer that brings a level from the patches' scale to its own."""
    if level in (1, 2):
        times = 4 if level == 1 else 2
        return [nn.ConvTranspose2d(channels, channels, times, times)]
    return [] if level == 3 else [nn.Conv2d(channels, channels, 3, 2, 1)]


class _Backbone(nn.Module):
    """Returns the four levels (n, channels, rows, columns), the finest first."""

    def __init__(self, sizes: LSegSizes) -> None:
        super().__init__()
        self.model = _VisionTransformer(sizes)
        self.patch = sizes.patch
        for level, channels in zip(_LEVELS, sizes.levels, strict=True):
            steps = [
                _JoinClassToken(sizes.width),
                nn.Identity(),  # the published list of steps counts the change to a map as two
                nn.Identity(),
                nn.Conv2d(sizes.width, channels, 1),
                *_rescaling(level, channels),
            ]
            self.add_module(f"act_postprocess{level}", nn.Sequential(*steps))

    def forward(self, pictures: torch.Tensor) -> list[torch.Tensor]:
        rows, columns = (side // self.patch for side in pictures.shape[-2:])
        levels = []
        for level, tokens in zip(_LEVELS, self.model(pictures), strict=True):
            join, _, _, *rest = self.get_submodule(f"act_postprocess{level}").children()
            x = join(tokens).transpose(1, 2).unflatten(2, (rows, columns))
            for step in rest:
                x = step(x)
            levels.append(x)
        return levels


class _ResidualUnit(nn.Module):
    def __init__(self, channels: int) -> None:
        super().__init__()
        self.conv1 = nn.Conv2d(channels, channels, 3, padding=1, bias=False)
        self.conv2 = nn.Conv2d(channels, channels, 3, padding=1, bias=False)
        self.bn1 = nn.BatchNorm2d(channels)
        self.bn2 = nn.BatchNorm2d(channels)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        changed = self.bn1(self.conv1(functional.relu(x)))
        return self.bn2(self.conv2(functional.relu(changed))) + x


class _Fusion(nn.Module):
    """Adds a finer level to what came from the coarser ones, and doubles the size."""

    def __init__(self, channels: int) -> None:
        super().__init__()
        self.out_conv = nn.Conv2d(channels, channels, 1)
        self.resConfUnit1 = _ResidualUnit(channels)
        self.resConfUnit2 = _ResidualUnit(channels)

    def forward(self, x: torch.Tensor, finer: torch.Tensor | None = None) -> torch.Tensor:
        x = self.resConfUnit2(x if finer is None else x + self.resConfUnit1(finer))
        return self.out_conv(functional.interpolate(x, scale_factor=2, mode="bilinear", align_corners=True))


class _Decoder(nn.Module):
    def __init__(self, sizes: LSegSizes) -> None:
        super().__init__()
        for level, channels in zip(_LEVELS, sizes.levels, strict=True):
            self.add_module(f"layer{level}_rn", nn.Conv2d(channels, sizes.fused, 3, padding=1, bias=False))
            self.add_module(f"refinenet{level}", _Fusion(sizes.fused))
        self.head1 = nn.Conv2d(sizes.fused, sizes.dim, 1)

    def forward(self, levels: list[torch.Tensor]) -> torch.Tensor:
        even = {level: self.get_submodule(f"layer{level}_rn")(x) for level, x in zip(_LEVELS, levels, strict=True)}
        x = self.get_submodule("refinenet4")(even[4])
        for level in (3, 2, 1):
            x = self.get_submodule(f"refinenet{level}")(x, even[level])
        return self.head1(x)


class LSegNetwork(nn.Module):
    """Pictures to features in the space of CLIP's texts."""

    def __init__(self, sizes: LSegSizes) -> None:
        super().__init__()
        self.sizes = sizes
        self.clip_pretrained = Clip(sizes.clip)
        self.pretrained = _Backbone(sizes)
        self.scratch = _Decoder(sizes)

    def forward(self, pictures: torch.Tensor) -> torch.Tensor:
        """Return features (n, dim, height/2, width/2) in float32 as the published code has them before its upsampling.

        They are scaled to unit length, rounded to half precision, and multiplied by 1 / 0.07 in half precision.

        Args:
            pictures: (n, 3, height, width) in [-1, 1]; the sides are multiples of twice the patch, or of the patch
                where that gives an even number of them.
        """
        features = self.scratch(self.pretrained(pictures)).float()
        features = features / features.norm(dim=1, keepdim=True)
        scale = torch.tensor(math.log(1.0 / _TEMPERATURE), device=features.device).exp()
        return (scale * features.half()).float()

    def let_go_of_the_idle(self) -> None:
        """Drop what the checkpoint holds and no feature depends on, to save a third of a gigabyte."""
        self.clip_pretrained.visual = nn.Identity()
        self.pretrained.model.norm = nn.Identity()
        self.pretrained.model.head = nn.Identity()
        self.scratch.get_submodule("refinenet4").resConfUnit1 = nn.Identity()
