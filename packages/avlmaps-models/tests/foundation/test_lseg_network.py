"""LSeg's network: the published keys, and the same numbers as slow formulas and as timm's transformer."""

import math
from pathlib import Path

import pytest
import torch
from slow_lseg import resized, tapped_tokens, window_features
from tiny.lseg import PUBLISHED, Sizes, lseg_layout, random_weights

from avlmaps_models.paper.lseg_network import LSegNetwork, LSegSizes

LAYOUT = Path(__file__).parent / "layouts" / "lseg.txt"


@pytest.fixture(scope="module")
def weights() -> dict[str, torch.Tensor]:
    return random_weights(lseg_layout(Sizes()), half=("clip_pretrained.",))


@pytest.fixture(scope="module")
def network(weights: dict[str, torch.Tensor]) -> LSegNetwork:
    made = LSegNetwork(LSegSizes.of(weights))
    made.load_state_dict(weights, strict=True)
    return made.eval().requires_grad_(False)


def published_layout() -> dict[str, tuple[int, ...]]:
    """Return the committed list; written from the code of lang-seg and VLMaps, and held against timm and open_clip."""
    rows = (line.split() for line in LAYOUT.read_text().splitlines())
    return {key: () if shape == "()" else tuple(map(int, shape.split("x"))) for key, shape in rows}


def shapes_of(module: torch.nn.Module, prefix: str) -> dict[str, tuple[int, ...]]:
    return {f"{prefix}{key}": tuple(value.shape) for key, value in module.state_dict().items()}


def test_the_real_network_has_exactly_the_published_keys_and_shapes() -> None:
    with torch.device("meta"):
        made = LSegNetwork(LSegSizes())
    listed = published_layout()
    assert shapes_of(made, "net.") == listed
    assert len(listed) == 730
    parameters = sum(math.prod(shape) for key, shape in listed.items() if not key.endswith("num_batches_tracked"))
    assert parameters == 495_144_681


def test_the_published_keys_of_the_transformer_are_those_of_timm() -> None:
    timm = pytest.importorskip("timm")
    with torch.device("meta"):
        made = timm.create_model("vit_large_patch16_384")
    theirs = shapes_of(made, "net.pretrained.model.")
    assert theirs == {key: shape for key, shape in published_layout().items() if ".pretrained.model." in key}


def test_the_published_keys_of_clip_are_those_of_open_clip() -> None:
    model = pytest.importorskip("open_clip.model")
    with torch.device("meta"):
        vision = model.CLIPVisionCfg(layers=12, width=768, patch_size=32, image_size=224)
        made = model.CLIP(512, vision, model.CLIPTextCfg(width=512, heads=8, layers=12), quick_gelu=True)
    theirs = shapes_of(made, "net.clip_pretrained.")
    assert theirs == {key: shape for key, shape in published_layout().items() if ".clip_pretrained." in key}


def test_the_sizes_are_read_off_the_weights() -> None:
    with torch.device("meta"):
        made = LSegNetwork(LSegSizes())
    assert LSegSizes.of(made.state_dict()) == LSegSizes()
    assert LSegSizes().tapped == (5, 11, 17, 23)
    assert lseg_layout(PUBLISHED).keys() == made.state_dict().keys()


def test_the_transformer_gives_the_tokens_of_timm(network: LSegNetwork, weights: dict[str, torch.Tensor]) -> None:
    vit = pytest.importorskip("timm.models.vision_transformer")
    made = vit.VisionTransformer(img_size=384, patch_size=16, embed_dim=64, depth=4, num_heads=1, num_classes=5).eval()
    start = "pretrained.model."
    theirs = {key.removeprefix(start): value for key, value in weights.items() if key.startswith(start)}
    made.load_state_dict(theirs, strict=True)
    behind: list[torch.Tensor] = []
    for block in made.blocks:
        block.register_forward_hook(lambda _module, _given, found: behind.append(found))
    pictures = torch.rand(2, 3, 384, 384, generator=torch.Generator().manual_seed(1)) * 2 - 1
    with torch.no_grad():
        made(pictures)
        ours = network.pretrained.model(pictures)
    assert len(ours) == len(behind) == 4
    for our, their in zip(ours, behind, strict=True):
        torch.testing.assert_close(our, their, rtol=1e-4, atol=1e-4)


def test_tokens_and_features_are_those_of_slow_formulas(network: LSegNetwork, weights: dict[str, torch.Tensor]) -> None:
    picture = torch.rand(3, 96, 160, generator=torch.Generator().manual_seed(2)) * 2 - 1
    exact = {key: value.double() for key, value in weights.items()}
    with torch.no_grad():
        slow_tokens = tapped_tokens(exact, picture.double())
        for our, slow in zip(network.pretrained.model(picture[None]), slow_tokens, strict=True):
            torch.testing.assert_close(our[0].double(), slow, rtol=1e-4, atol=1e-4)
        ours = network(picture[None])[0].double()
    slow = window_features(exact, picture.double())
    assert ours.shape == (32, 48, 80)
    # A feature may be rounded to the neighbouring half-precision number: 1/128 where it is 8 to 16 long.
    torch.testing.assert_close(resized(ours, 96, 160), slow, rtol=0.0, atol=0.016)
    assert (resized(ours, 96, 160) - slow).abs().mean() < 1e-4


def test_the_skip_of_a_residual_unit_is_taken_before_the_activation(network: LSegNetwork) -> None:
    unit = network.scratch.get_submodule("refinenet1").resConfUnit2
    below = -torch.ones(1, 8, 5, 5)
    with torch.no_grad():
        changed = unit(below) - unit(torch.zeros(1, 8, 5, 5))
    torch.testing.assert_close(changed, below)


def test_letting_go_of_what_is_idle_changes_no_feature(weights: dict[str, torch.Tensor]) -> None:
    made = LSegNetwork(LSegSizes.of(weights))
    made.load_state_dict(weights, strict=True)
    made.eval()
    pictures = torch.rand(1, 3, 64, 64) * 2 - 1
    with torch.no_grad():
        before = made(pictures)
        made.let_go_of_the_idle()
        assert torch.equal(made(pictures), before)
    assert sum(p.numel() for p in made.parameters()) < sum(v.numel() for v in weights.values())


def test_half_precision_is_near_enough(network: LSegNetwork) -> None:
    """As on a GPU, where autocast runs the network in half precision; a CPU has bfloat16, which is coarser still."""
    pictures = torch.rand(1, 3, 96, 96, generator=torch.Generator().manual_seed(4)) * 2 - 1
    with torch.no_grad():
        exact = network(pictures)
        with torch.autocast("cpu", torch.bfloat16):
            coarse = network(pictures)
    assert coarse.dtype == torch.float32
    assert torch.cosine_similarity(exact, coarse, dim=1).mean() > 0.995
