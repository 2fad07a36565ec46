"""SuperPoint with random weights of the real sizes, in the hub's layout."""

import json
from pathlib import Path

import torch
from safetensors.torch import save_file

from avlmaps_models.common.operators import declare_missing_operators

FOLDER = "magic-leap-community/superpoint"
# As the hub has it; transformers itself would write more.
CONFIG = {
    "architectures": ["SuperPointForKeypointDetection"],
    "border_removal_distance": 4,
    "decoder_hidden_size": 256,
    "descriptor_decoder_dim": 256,
    "encoder_hidden_sizes": [64, 64, 128, 128],
    "initializer_range": 0.02,
    "keypoint_decoder_dim": 65,
    "keypoint_threshold": 0.005,
    "max_keypoints": -1,
    "model_type": "superpoint",
    "nms_radius": 4,
    "torch_dtype": "float32",
}


def write_superpoint(folder: Path) -> None:
    """Write ``config.json``, ``preprocessor_config.json`` and ``model.safetensors``."""
    declare_missing_operators()
    from transformers import SuperPointConfig, SuperPointForKeypointDetection

    home = folder / FOLDER
    home.mkdir(parents=True)
    (home / "config.json").write_text(json.dumps(CONFIG))
    squeezed = {"do_rescale": True, "do_resize": True, "size": {"height": 480, "width": 640}}
    (home / "preprocessor_config.json").write_text(json.dumps(squeezed))
    torch.manual_seed(4)
    network = SuperPointForKeypointDetection(SuperPointConfig())
    for module in network.modules():
        if isinstance(module, torch.nn.Conv2d):  # livelier than transformers' own start, which is nearly blind
            torch.nn.init.kaiming_normal_(module.weight)
            torch.nn.init.zeros_(module.bias)
    save_file(network.state_dict(), home / "model.safetensors", metadata={"format": "pt"})
