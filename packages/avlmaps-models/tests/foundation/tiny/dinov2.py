"""A tiny random DINOv2 in the layout of facebook/dinov2-small."""

from pathlib import Path

from tiny.siglip2 import shake

WIDTH, LAYERS, HEADS, PATCH, IMAGE = 32, 2, 4, 14, 518


def write_dinov2(folder: Path, model: str = "facebook/dinov2-small", registers: int = 0) -> None:
    """Write the checkpoint where ``model_folder`` finds it.

    Args:
        folder: of models.
        model: hub id.
        registers: tokens beside the class token, for the models that have them.
    """
    from transformers import Dinov2Config, Dinov2Model, Dinov2WithRegistersConfig, Dinov2WithRegistersModel

    sizes = {
        "hidden_size": WIDTH, "num_hidden_layers": LAYERS, "num_attention_heads": HEADS, "patch_size": PATCH,
        "image_size": IMAGE, "mlp_ratio": 2,
    }  # fmt: skip
    if registers:
        made = Dinov2WithRegistersModel(Dinov2WithRegistersConfig(**sizes, num_register_tokens=registers))
    else:
        made = Dinov2Model(Dinov2Config(**sizes))
    shake(made)
    made.save_pretrained(folder / model)
