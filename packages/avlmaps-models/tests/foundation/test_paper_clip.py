"""Areas by CLIP as the published code sees them: from the hub's layout and from OpenAI's own, against transformers."""

from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image
from tiny.clip_views import OPENAI, PATCH, SIDE, openai_weights, write_clip_views, write_openai_clip
from tiny.lseg import write_lseg

from avlmaps.core.errors import BackendError
from avlmaps.core.registry import Kind, find
from avlmaps.perception.conformance import check, example_frame
from avlmaps.perception.protocols import ScaledEncoder
from avlmaps_models.paper import archives
from avlmaps_models.paper.clip_network import Clip, ClipSizes, clip_picture
from avlmaps_models.paper.clip_tokens import clip_tokens
from avlmaps_models.paper.clip_views import PaperClipViews

HUB, FILE = "openai/clip-vit-large-patch14", "ViT-L-14.pt"


def clip_of_transformers() -> torch.nn.Module:
    """Return transformers' CLIP with the weights of OpenAI's layout under its own names."""
    from transformers import CLIPConfig, CLIPModel

    common = {"num_attention_heads": 1, "layer_norm_eps": 1e-5, "hidden_act": "quick_gelu"}
    sizes = {"hidden_size": 64, "intermediate_size": 256, "num_hidden_layers": 2}
    text = {**common, **sizes, "vocab_size": 49408, "eos_token_id": 49407, "bos_token_id": 49406}
    vision = {**common, "hidden_size": 128, "intermediate_size": 512, "num_hidden_layers": 2, "num_attention_heads": 2}
    vision |= {"patch_size": PATCH, "image_size": SIDE}
    made = CLIPModel(CLIPConfig(text_config=text, vision_config=vision, projection_dim=OPENAI.dim))
    own = {key: value.float() for key, value in openai_weights().items()}
    state = {
        "logit_scale": own["logit_scale"],
        "text_projection.weight": own["text_projection"].T,
        "visual_projection.weight": own["visual.proj"].T,
        "text_model.embeddings.token_embedding.weight": own["token_embedding.weight"],
        "text_model.embeddings.position_embedding.weight": own["positional_embedding"],
        "vision_model.embeddings.class_embedding": own["visual.class_embedding"],
        "vision_model.embeddings.patch_embedding.weight": own["visual.conv1.weight"],
        "vision_model.embeddings.position_embedding.weight": own["visual.positional_embedding"],
    }
    norms = {
        "text_model.final_layer_norm": "ln_final",
        "vision_model.pre_layrnorm": "visual.ln_pre",
        "vision_model.post_layernorm": "visual.ln_post",
    }
    parts = {"mlp.fc1": "mlp.c_fc", "mlp.fc2": "mlp.c_proj", "layer_norm1": "ln_1", "layer_norm2": "ln_2"}
    for end in ("weight", "bias"):
        state |= {f"{theirs}.{end}": own[f"{ours}.{end}"] for theirs, ours in norms.items()}
        for tower, prefix in (("text_model", ""), ("vision_model", "visual.")):
            for i in range(2):
                ours, theirs = f"{prefix}transformer.resblocks.{i}", f"{tower}.encoder.layers.{i}"
                state |= {f"{theirs}.{there}.{end}": own[f"{ours}.{here}.{end}"] for there, here in parts.items()}
                state[f"{theirs}.self_attn.out_proj.{end}"] = own[f"{ours}.attn.out_proj.{end}"]
                for part, values in zip("qkv", own[f"{ours}.attn.in_proj_{end}"].chunk(3), strict=True):
                    state[f"{theirs}.self_attn.{part}_proj.{end}"] = values
    missing, unexpected = made.load_state_dict(state, strict=False)
    assert not unexpected
    assert all(key.endswith("position_ids") for key in missing)
    return made.eval()


def unit(rows: torch.Tensor) -> np.ndarray:
    return (rows / rows.norm(dim=-1, keepdim=True)).detach().numpy()


def test_both_layouts_keep_what_view_encoders_promise(models: Path) -> None:
    write_clip_views(models)
    write_openai_clip(models / FILE)
    for model in (HUB, FILE):
        encoder = PaperClipViews(model)
        check(Kind.VIEWS, encoder)
        assert isinstance(encoder, ScaledEncoder)
        assert (encoder.card.id, encoder.card.licence, encoder.card.prompts) == (model, "MIT", ("{}",))
        assert encoder.encode([]).shape == (0, encoder.card.dim)
        assert encoder.logit_scale == pytest.approx(100.0, rel=0.02)
    entry = find(Kind.VIEWS, "clip-paper")
    assert (entry.target, entry.model) == ("avlmaps_models.paper.clip_views:PaperClipViews", HUB)


def test_openais_file_gives_what_transformers_gives_with_the_same_weights(models: Path) -> None:
    write_openai_clip(models / FILE)
    encoder, theirs = PaperClipViews(FILE), clip_of_transformers()
    frames = [example_frame(seed) for seed in range(3)]
    pixels = torch.from_numpy(np.stack([clip_picture(frame.rgb, SIDE) for frame in frames]))
    expected = unit(theirs.get_image_features(pixel_values=pixels).pooler_output)
    np.testing.assert_allclose(encoder.encode(frames), expected, atol=1e-5)
    for word in ("kitchen", "living room", "a room with a sofa, a tv and 2 chairs"):
        tokens = torch.tensor(clip_tokens().encode([word]))
        expected = unit(theirs.get_text_features(input_ids=tokens).pooler_output)
        np.testing.assert_allclose(encoder.encode_words([word]), expected, atol=1e-5)


def test_the_hubs_layout_is_read_by_transformers_with_the_bare_name(models: Path) -> None:
    write_clip_views(models)
    from transformers import AutoTokenizer, CLIPModel

    encoder, theirs = PaperClipViews(), CLIPModel.from_pretrained(models / HUB).eval()
    tokens = AutoTokenizer.from_pretrained(models / HUB)(["the kitchen"], return_tensors="pt")
    expected = unit(theirs.get_text_features(**tokens).pooler_output)
    np.testing.assert_allclose(encoder.encode_words(["the kitchen"]), expected, atol=1e-5)
    frame = example_frame(width=80, height=100)
    pixels = torch.from_numpy(clip_picture(frame.rgb, 56))[None]
    expected = unit(theirs.get_image_features(pixel_values=pixels).pooler_output)
    np.testing.assert_allclose(encoder.encode([frame]), expected, atol=1e-5)


@pytest.mark.parametrize("size", [(640, 480), (480, 640), (224, 224), (100, 333), (225, 1001), (301, 225)])
def test_pictures_are_prepared_as_published(size: tuple[int, int]) -> None:
    """OpenAI's code resizes, cuts and normalises with torchvision on a picture of Pillow's."""
    transforms = pytest.importorskip("torchvision.transforms")
    rgb = np.random.default_rng(0).integers(0, 256, (size[1], size[0], 3), np.uint8)
    published = transforms.Compose(
        [
            transforms.Resize(224, interpolation=transforms.InterpolationMode.BICUBIC),
            transforms.CenterCrop(224),
            transforms.ToTensor(),
            transforms.Normalize((0.48145466, 0.4578275, 0.40821073), (0.26862954, 0.26130258, 0.27577711)),
        ]
    )
    np.testing.assert_allclose(clip_picture(rgb, 224), published(Image.fromarray(rgb)).numpy(), atol=1e-5)


def test_the_middle_of_a_wide_picture_is_seen() -> None:
    rgb = np.zeros((100, 300, 3), np.uint8)
    rgb[:, 100:200] = 255
    seen = clip_picture(rgb, 50)
    assert (seen[:, :, 5:-5] > 1.0).all()
    assert clip_picture(rgb.transpose(1, 0, 2), 50).shape == (3, 50, 50)


def test_the_real_network_has_exactly_the_keys_of_open_clip() -> None:
    model = pytest.importorskip("open_clip.model")
    with torch.device("meta"):
        vision = model.CLIPVisionCfg(layers=24, width=1024, patch_size=14, image_size=224)
        theirs = model.CLIP(768, vision, model.CLIPTextCfg(width=768, heads=12, layers=12), quick_gelu=True)
        sizes = ClipSizes.of(theirs.state_dict())
        ours = Clip(sizes)
    assert (sizes.side, sizes.patch, sizes.width, sizes.layers, sizes.text.dim) == (224, 14, 1024, 24, 768)
    expected = {key: value.shape for key, value in theirs.state_dict().items()}
    assert {key: value.shape for key, value in ours.state_dict().items()} == expected


def test_another_file_is_refused_in_a_sentence(models: Path) -> None:
    with pytest.raises(BackendError, match=r"ViT-L-14\.pt is not here.*curl"):
        PaperClipViews(FILE)
    write_lseg(models)
    (models / "demo_e200.ckpt").rename(models / FILE)
    with pytest.raises(BackendError, match="not a checkpoint of a CLIP with a vision transformer"):
        PaperClipViews(FILE)
    state = openai_weights()
    del state["visual.ln_post.bias"]
    torch.save(state, models / FILE)
    with pytest.raises(BackendError, match=r"visual\.ln_post\.bias"):
        PaperClipViews(FILE)


def test_openais_scripted_archive_is_read_for_its_weights(models: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Published(torch.nn.Module):
        """Holds weights under the names that the archive has."""

        def forward(self, x: torch.Tensor) -> torch.Tensor:
            return x

    made = Published()
    for key, value in openai_weights().items():
        *path, last = key.split(".")
        place: torch.nn.Module = made
        for name in path:
            if name not in dict(place.named_children()):
                place.add_module(name, torch.nn.Identity())
            place = place.get_submodule(name)
        place.register_buffer(last, value)
    torch.jit.save(torch.jit.trace(made, torch.zeros(1)), str(models / FILE))
    with pytest.raises(BackendError, match="scripted archive"):
        PaperClipViews(FILE)
    known = archives.hashlib.sha256((models / FILE).read_bytes()).hexdigest()
    monkeypatch.setattr(archives, "PUBLISHED_SCRIPTS", frozenset({known}))
    found = PaperClipViews(FILE).encode([example_frame()])
    write_openai_clip(models / "flat.pt")
    np.testing.assert_allclose(found, PaperClipViews("flat.pt").encode([example_frame()]), atol=1e-5)
