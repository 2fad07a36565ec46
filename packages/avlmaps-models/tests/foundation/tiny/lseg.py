"""A tiny random LSeg in the layout of ``demo_e200.ckpt``: its keys, written down from the published code.

The keys below ``pretrained.model`` are those of timm's ``vit_large_patch16_384``, the ones below ``clip_pretrained``
those of OpenAI's CLIP ViT-B/32, and the rest those of lang-seg's ``_make_vit_b16_backbone`` and ``_make_fusion_block``.
"""

import math
from argparse import Namespace
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import torch

Shapes = dict[str, tuple[int, ...]]


@dataclass(frozen=True)
class Sizes:
    """Those of a network in LSeg's layout; heads are 64 wide."""

    width: int = 64
    layers: int = 4
    classes: int = 5
    grid: int = 24
    levels: tuple[int, int, int, int] = (8, 12, 16, 16)
    fused: int = 8
    dim: int = 32
    text_width: int = 64
    text_layers: int = 2
    image_width: int = 64
    image_layers: int = 1


PUBLISHED = Sizes(1024, 24, 1000, 24, (256, 512, 1024, 1024), 256, 512, 512, 12, 768, 12)


def clip_layout(sizes: Sizes, patch: int = 32, side: int = 224) -> Shapes:
    """Return the keys and shapes of OpenAI's CLIP with a vision transformer."""
    shapes: Shapes = {
        "positional_embedding": (77, sizes.text_width),
        "text_projection": (sizes.text_width, sizes.dim),
        "logit_scale": (),
        "visual.class_embedding": (sizes.image_width,),
        "visual.positional_embedding": ((side // patch) ** 2 + 1, sizes.image_width),
        "visual.proj": (sizes.image_width, sizes.dim),
        "visual.conv1.weight": (sizes.image_width, 3, patch, patch),
        "token_embedding.weight": (49408, sizes.text_width),
    }
    for norm, width in (("visual.ln_pre", sizes.image_width), ("visual.ln_post", sizes.image_width)):
        shapes |= _weight_and_bias(norm, (width,))
    shapes |= _weight_and_bias("ln_final", (sizes.text_width,))
    towers = (("visual.", sizes.image_width, sizes.image_layers), ("", sizes.text_width, sizes.text_layers))
    for tower, width, layers in towers:
        for layer in range(layers):
            shapes |= _clip_block(f"{tower}transformer.resblocks.{layer}", width)
    return shapes


def lseg_layout(sizes: Sizes) -> Shapes:
    """Return the keys, without the ``net.`` before them, and shapes of LSeg."""
    shapes = {f"clip_pretrained.{key}": shape for key, shape in clip_layout(sizes).items()}
    shapes |= {f"pretrained.model.{key}": shape for key, shape in _vit_layout(sizes).items()}
    one, two, _, four = sizes.levels
    for level, channels in enumerate(sizes.levels, start=1):
        step = f"pretrained.act_postprocess{level}"
        shapes |= _weight_and_bias(f"{step}.0.project.0", (sizes.width, 2 * sizes.width))
        shapes |= _weight_and_bias(f"{step}.3", (channels, sizes.width, 1, 1))
        shapes[f"scratch.layer{level}_rn.weight"] = (sizes.fused, channels, 3, 3)
        shapes |= _fusion(f"scratch.refinenet{level}", sizes.fused)
    shapes |= _weight_and_bias("pretrained.act_postprocess1.4", (one, one, 4, 4))
    shapes |= _weight_and_bias("pretrained.act_postprocess2.4", (two, two, 2, 2))
    shapes |= _weight_and_bias("pretrained.act_postprocess4.4", (four, four, 3, 3))
    return shapes | _weight_and_bias("scratch.head1", (sizes.dim, sizes.fused, 1, 1))


def random_weights(shapes: Shapes, seed: int = 0, half: Sequence[str] = ()) -> dict[str, torch.Tensor]:
    """Return weights under which signals neither die nor blow up, and no normalisation is idle.

    Args:
        shapes: of each key.
        seed: of the random numbers.
        half: what keys begin with that are kept in half precision, as a CLIP that was on a GPU is.
    """
    dice = torch.Generator().manual_seed(seed)
    weights = {}
    for key, shape in shapes.items():
        if key.endswith("num_batches_tracked"):
            weights[key] = torch.tensor(100)
            continue
        weights[key] = _random(key, shape, dice)
        if key.startswith(tuple(half)) and half:
            weights[key] = weights[key].half()
    return weights


def write_checkpoint(path: Path, state: dict[str, torch.Tensor]) -> None:
    """Write weights as PyTorch-Lightning does, with objects of other programs beside them."""
    path.parent.mkdir(parents=True, exist_ok=True)
    torch.save(
        {
            "epoch": 200,
            "global_step": 1,
            "pytorch-lightning_version": "1.4.9",
            "state_dict": {f"net.{key}": value for key, value in state.items()},
            "callbacks": {},
            "hyper_parameters": Namespace(backbone="clip_vitl16_384", arch_option=0, block_depth=0, data=Path("data")),
        },
        path,
    )


def write_lseg(folder: Path, sizes: Sizes | None = None) -> None:
    """Write a ``demo_e200.ckpt``, a tiny one unless other sizes are given."""
    state = random_weights(lseg_layout(sizes or Sizes()), half=("clip_pretrained.",))
    write_checkpoint(folder / "demo_e200.ckpt", state)


def _random(key: str, shape: tuple[int, ...], dice: torch.Generator) -> torch.Tensor:
    noise = torch.randn(shape, generator=dice)
    if key.endswith("running_var"):
        return 0.5 + noise.abs()
    if key.endswith("logit_scale"):
        return torch.tensor(4.6)
    if key.endswith(("bias", "running_mean")):
        return 0.1 * noise
    if len(shape) == 1 and not key.endswith("class_embedding"):
        return 1.0 + 0.1 * noise
    if len(shape) < 2 or "embed" in key or key.endswith("cls_token"):
        return 0.5 * noise
    return noise * math.prod(shape[1:]) ** -0.5


def _weight_and_bias(name: str, weight: tuple[int, ...]) -> Shapes:
    """Return both; only a transposed convolution has another number of outputs in front, and here they agree."""
    return {f"{name}.weight": weight, f"{name}.bias": weight[:1]}


def _clip_block(name: str, width: int) -> Shapes:
    return {
        f"{name}.attn.in_proj_weight": (3 * width, width),
        f"{name}.attn.in_proj_bias": (3 * width,),
        **_weight_and_bias(f"{name}.attn.out_proj", (width, width)),
        **_weight_and_bias(f"{name}.ln_1", (width,)),
        **_weight_and_bias(f"{name}.mlp.c_fc", (4 * width, width)),
        **_weight_and_bias(f"{name}.mlp.c_proj", (width, 4 * width)),
        **_weight_and_bias(f"{name}.ln_2", (width,)),
    }


def _vit_layout(sizes: Sizes) -> Shapes:
    width = sizes.width
    shapes: Shapes = {"cls_token": (1, 1, width), "pos_embed": (1, 1 + sizes.grid**2, width)}
    shapes |= _weight_and_bias("patch_embed.proj", (width, 3, 16, 16))
    for layer in range(sizes.layers):
        name = f"blocks.{layer}"
        shapes |= _weight_and_bias(f"{name}.norm1", (width,))
        shapes |= _weight_and_bias(f"{name}.attn.qkv", (3 * width, width))
        shapes |= _weight_and_bias(f"{name}.attn.proj", (width, width))
        shapes |= _weight_and_bias(f"{name}.norm2", (width,))
        shapes |= _weight_and_bias(f"{name}.mlp.fc1", (4 * width, width))
        shapes |= _weight_and_bias(f"{name}.mlp.fc2", (width, 4 * width))
    return shapes | _weight_and_bias("norm", (width,)) | _weight_and_bias("head", (sizes.classes, width))


def _fusion(name: str, channels: int) -> Shapes:
    shapes = _weight_and_bias(f"{name}.out_conv", (channels, channels, 1, 1))
    for unit in ("resConfUnit1", "resConfUnit2"):
        for number in (1, 2):
            shapes[f"{name}.{unit}.conv{number}.weight"] = (channels, channels, 3, 3)
            shapes |= _weight_and_bias(f"{name}.{unit}.bn{number}", (channels,))
            for kept in ("running_mean", "running_var"):
                shapes[f"{name}.{unit}.bn{number}.{kept}"] = (channels,)
            shapes[f"{name}.{unit}.bn{number}.num_batches_tracked"] = ()
    return shapes
