"""A tiny random MegaLoc in the layouts of the hub's model.safetensors and of the release's megaloc.torch."""

from pathlib import Path

import torch

WIDTH, DEPTH, HIDDEN, GRID, CLUSTERS, CLUSTER_DIM, TOKEN_DIM, MLP, DIM = 128, 2, 256, 37, 6, 5, 7, 16, 40


def write_megaloc(folder: Path, model: str = "gberton/MegaLoc") -> None:
    """Write the checkpoint where ``model_folder`` finds it."""
    from safetensors.torch import save_file

    place = folder / model
    place.mkdir(parents=True)
    save_file(random_weights(), place / "model.safetensors", metadata={"format": "pt"})


def write_released(path: Path) -> None:
    """Write the same weights as the older file has them."""
    released = {
        name.replace("backbone.", "backbone.model.", 1) if name.startswith("backbone.") else name: values
        for name, values in random_weights().items()
    }
    torch.save(released | {"backbone.model.mask_token": torch.zeros(1, WIDTH)}, path)


def random_weights() -> dict[str, torch.Tensor]:
    """Return weights under the published names, every one of them random."""
    shapes: dict[str, tuple[int, ...]] = {
        "backbone.cls_token": (1, 1, WIDTH),
        "backbone.pos_embed": (1, 1 + GRID**2, WIDTH),
        "backbone.patch_embed.proj.weight": (WIDTH, 3, 14, 14),
        "backbone.patch_embed.proj.bias": (WIDTH,),
        "backbone.norm.weight": (WIDTH,),
        "backbone.norm.bias": (WIDTH,),
        "aggregator.agg.dust_bin": (),
        "aggregator.agg.token_features.0.weight": (MLP, WIDTH),
        "aggregator.agg.token_features.0.bias": (MLP,),
        "aggregator.agg.token_features.2.weight": (TOKEN_DIM, MLP),
        "aggregator.agg.token_features.2.bias": (TOKEN_DIM,),
        "aggregator.linear.weight": (DIM, TOKEN_DIM + CLUSTERS * CLUSTER_DIM),
        "aggregator.linear.bias": (DIM,),
    }
    for part, count in (("cluster_features", CLUSTER_DIM), ("score", CLUSTERS)):
        shapes |= {f"aggregator.agg.{part}.0.weight": (MLP, WIDTH, 1, 1), f"aggregator.agg.{part}.0.bias": (MLP,)}
        shapes |= {f"aggregator.agg.{part}.3.weight": (count, MLP, 1, 1), f"aggregator.agg.{part}.3.bias": (count,)}
    for block in range(DEPTH):
        at = f"backbone.blocks.{block}."
        shapes |= {f"{at}{norm}.{what}": (WIDTH,) for norm in ("norm1", "norm2") for what in ("weight", "bias")}
        shapes |= {f"{at}{scale}.gamma": (WIDTH,) for scale in ("ls1", "ls2")}
        for layer, rows, columns in (
            ("attn.qkv", 3 * WIDTH, WIDTH),
            ("attn.proj", WIDTH, WIDTH),
            ("mlp.fc1", HIDDEN, WIDTH),
            ("mlp.fc2", WIDTH, HIDDEN),
        ):
            shapes |= {f"{at}{layer}.weight": (rows, columns), f"{at}{layer}.bias": (rows,)}
    generator = torch.Generator().manual_seed(11)
    made: dict[str, torch.Tensor] = {}
    for name, shape in shapes.items():
        noise = 0.1 * torch.randn(shape, generator=generator)
        made[name] = 1.0 + noise if ".norm" in name and name.endswith("weight") else noise
    return made
