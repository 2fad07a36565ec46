"""A tiny random SAM 2 in the layout of facebook/sam2.1-hiera-tiny (a video model), beside a tiny CLIP."""

from pathlib import Path

import torch

from tiny.clip_patches import write_clip_patches
from tiny.tipsv2 import shake

SIDE = 64
SAM = "facebook/sam2.1-hiera-tiny"


def write_regions(folder: Path, sam: str = SAM) -> None:
    """Write both checkpoints where ``model_folder`` finds them."""
    from transformers import Sam2VideoModel

    write_clip_patches(folder)
    place = folder / sam
    place.mkdir(parents=True, exist_ok=True)
    made = Sam2VideoModel(_config())
    shake(made, 11, 0.2)
    with torch.no_grad():
        # As a trained one it is sure of its masks, and these have sharp edges and hang on the point that was asked.
        made.mask_decoder.iou_prediction_head.proj_out.bias.fill_(4.0)
        made.prompt_encoder.point_embed.weight.mul_(5.0)
        for network in made.mask_decoder.output_hypernetworks_mlps:
            network.proj_out.weight.mul_(1000.0)
            network.proj_out.bias.zero_()
    made.save_pretrained(place)


def _config():
    from transformers import Sam2VideoConfig

    backbone = {
        "model_type": "sam2_hiera_det_model", "hidden_size": 8, "num_attention_heads": 1, "image_size": [SIDE, SIDE],
        "blocks_per_stage": [1, 1, 2, 1], "embed_dim_per_stage": [8, 16, 24, 32],
        "num_attention_heads_per_stage": [1, 1, 1, 1], "window_size_per_stage": [8, 4, 4, 2],
        "global_attention_blocks": [3], "window_positional_embedding_background_size": [7, 7],
    }  # fmt: skip
    vision = {
        "model_type": "sam2_vision_model", "backbone_config": backbone, "backbone_channel_list": [32, 24, 16, 8],
        "backbone_feature_sizes": [[SIDE // 4] * 2, [SIDE // 8] * 2, [SIDE // 16] * 2], "fpn_hidden_size": 32,
    }  # fmt: skip
    prompts = {"hidden_size": 32, "image_size": SIDE, "patch_size": 16}
    masks = {"hidden_size": 32, "mlp_dim": 32, "num_attention_heads": 2, "iou_head_hidden_dim": 32}
    return Sam2VideoConfig(
        vision_config=vision,
        prompt_encoder_config=prompts,
        mask_decoder_config=masks,
        image_size=SIDE,
        memory_attention_hidden_size=32,
        memory_attention_num_layers=1,
        memory_attention_num_attention_heads=1,
        memory_attention_feed_forward_hidden_size=32,
        memory_attention_rope_feat_sizes=[SIDE // 16] * 2,
        memory_encoder_hidden_size=32,
        memory_encoder_output_channels=16,
        mask_downsampler_embed_dim=32,
        memory_fuser_embed_dim=32,
        memory_fuser_intermediate_dim=32,
        memory_fuser_num_layers=1,
    )
