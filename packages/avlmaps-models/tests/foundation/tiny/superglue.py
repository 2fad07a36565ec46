"""SuperGlue in the hub's layout, two layers instead of eighteen: random weights, or ones that match like with like."""

import json
from pathlib import Path

import torch
from safetensors.torch import save_file

from avlmaps_models.common.operators import declare_missing_operators
from tiny.superpoint import CONFIG as SUPERPOINT

FOLDER = "magic-leap-community/superglue_indoor"
CONFIG = {
    "architectures": ["SuperGlueForKeypointMatching"],
    "gnn_layers_types": ["self", "cross"],
    "hidden_size": 256,
    "keypoint_detector_config": SUPERPOINT,
    "keypoint_encoder_sizes": [32, 64, 128, 256],
    "matching_threshold": 0.0,
    "model_type": "superglue",
    "num_attention_heads": 4,
    "sinkhorn_iterations": 100,
    "torch_dtype": "float32",
}


def write_superglue(folder: Path, random: bool = False, layers: int = 2) -> None:
    """Write ``config.json`` and ``model.safetensors``, the SuperPoint within it included.

    Args:
        folder: of models.
        random: leave all weights at random; else places and attention add nothing, and pairs are as likely as alike.
        layers: of attention; the published one has eighteen.
    """
    declare_missing_operators()
    from transformers import SuperGlueConfig, SuperGlueForKeypointMatching

    home = folder / FOLDER
    home.mkdir(parents=True)
    kinds = ["self", "cross"] * (layers // 2)
    (home / "config.json").write_text(json.dumps({**CONFIG, "gnn_layers_types": kinds}))
    torch.manual_seed(5)
    config = SuperGlueConfig(gnn_layers_types=kinds, attn_implementation="eager")
    network = SuperGlueForKeypointMatching(config)
    for module in network.modules():
        if isinstance(module, torch.nn.BatchNorm1d):  # as after training: not the identity
            module.running_mean.normal_(0.0, 0.1)
            module.running_var.uniform_(0.5, 2.0)
        if random and isinstance(module, torch.nn.Linear):
            torch.nn.init.xavier_normal_(module.weight, gain=1.5)
    state = network.state_dict()
    if not random:
        for name, weight in state.items():
            if "mlp.1." in name or "encoder.encoder.4." in name or name.endswith("final_proj.bias"):
                weight.zero_()
        state["final_projection.final_proj.weight"].copy_(400.0 * torch.eye(256))
    save_file(
        {name: weight.contiguous() for name, weight in state.items()}, home / "model.safetensors", {"format": "pt"}
    )
