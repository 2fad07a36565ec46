"""A tiny random MegaLoc in the layouts of the hub's model.safetensors and of the release's megaloc.torch."""

from pathlib import Path

import torch

WIDTH, DEPTH, HIDDEN, GRID, CLUSTERS, CLUSTER_DIM, TOKEN_DIM, MLP, DIM = 128, 2, 256, 37, 6, 5, 7, 16, 40
TINY = (WIDTH, DEPTH, HIDDEN, CLUSTERS, CLUSTER_DIM, TOKEN_DIM, MLP, DIM)
PUBLISHED = (768, 12, 3072, 64, 256, 256, 512, 8448)


def write_megaloc(folder: Path, model: str = "gberton/MegaLoc", tiny: bool = True) -> None:
    """Write the checkpoint where ``model_folder`` finds it; of the published sizes unless ``tiny``."""
    from safetensors.torch import save_file

    place = folder / model
    place.mkdir(parents=True)
    save_file(random_weights(TINY if tiny else PUBLISHED), place / "model.safetensors", metadata={"format": "pt"})


def write_released(path: Path) -> None:
    """Write the same weights as the older file has them."""
    released = {
        name.replace("backbone.", "backbone.model.", 1) if name.startswith("backbone.") else name: values
        for name, values in random_weights().items()
    }
    torch.save(released | {"backbone.model.mask_token": torch.zeros(1, WIDTH)}, path)


def random_weights(sizes: tuple[int, ...] = TINY) -> dict[str, torch.Tensor]:
    """Return weights under the published names, every one of them random."""
    width, depth, hidden, clusters, cluster_dim, token_dim, mlp, dim = sizes
    shapes: dict[str, tuple[int, ...]] = {
        "backbone.cls_token": (1, 1, width),
        "backbone.pos_embed": (1, 1 + GRID**2, width),
        "backbone.patch_embed.proj.weight": (width, 3, 14, 14),
        "backbone.patch_embed.proj.bias": (width,),
        "backbone.norm.weight": (width,),
        "backbone.norm.bias": (width,),
        "aggregator.agg.dust_bin": (),
        "aggregator.agg.token_features.0.weight": (mlp, width),
        "aggregator.agg.token_features.0.bias": (mlp,),
        "aggregator.agg.token_features.2.weight": (token_dim, mlp),
        "aggregator.agg.token_features.2.bias": (token_dim,),
        "aggregator.linear.weight": (dim, token_dim + clusters * cluster_dim),
        "aggregator.linear.bias": (dim,),
    }
    for part, count in (("cluster_features", cluster_dim), ("score", clusters)):
        shapes |= {f"aggregator.agg.{part}.0.weight": (mlp, width, 1, 1), f"aggregator.agg.{part}.0.bias": (mlp,)}
        shapes |= {f"aggregator.agg.{part}.3.weight": (count, mlp, 1, 1), f"aggregator.agg.{part}.3.bias": (count,)}
    for block in range(depth):
        at = f"backbone.blocks.{block}."
        shapes |= {f"{at}{norm}.{what}": (width,) for norm in ("norm1", "norm2") for what in ("weight", "bias")}
        shapes |= {f"{at}{scale}.gamma": (width,) for scale in ("ls1", "ls2")}
        for layer, rows, columns in (
            ("attn.qkv", 3 * width, width),
            ("attn.proj", width, width),
            ("mlp.fc1", hidden, width),
            ("mlp.fc2", width, hidden),
        ):
            shapes |= {f"{at}{layer}.weight": (rows, columns), f"{at}{layer}.bias": (rows,)}
    generator = torch.Generator().manual_seed(11)
    made: dict[str, torch.Tensor] = {}
    for name, shape in shapes.items():
        noise = 0.1 * torch.randn(shape, generator=generator)
        made[name] = 1.0 + noise if ".norm" in name and name.endswith("weight") else noise
    return made
