"""MegaLoc: both published layouts load strictly, and every part computes what its formula says."""

from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from tiny.megaloc import CLUSTERS, DIM, TOKEN_DIM, WIDTH, random_weights, write_megaloc, write_released

from avlmaps.core.errors import BackendError
from avlmaps.core.registry import Kind
from avlmaps.perception.conformance import check, example_frame
from avlmaps.perception.protocols import LocalFeatures
from avlmaps_models.foundation.dino_network import DinoNetwork, DinoSizes
from avlmaps_models.foundation.megaloc import RELEASED, MegaLoc, MegaLocNetwork, shares
from avlmaps_models.foundation.whole_pictures import imagenet_picture

NOTHING = LocalFeatures(np.zeros((0, 2), np.float32), np.zeros((0, 8), np.float32))
PICTURE = example_frame(1, width=120, height=90).rgb


def test_it_conforms(models: Path) -> None:
    write_megaloc(models)
    places = MegaLoc()
    check(Kind.PLACE, places)
    assert places.card.id == "gberton/MegaLoc" and places.card.dim == DIM and places.card.licence == "MIT"
    assert places.fit([], np.random.default_rng(0)) == {}


def test_both_published_layouts_give_the_same_descriptor(models: Path) -> None:
    write_released(models / RELEASED)
    released = MegaLoc()  # the hub's folder is not here, the older file is
    by_name = MegaLoc(str(models / RELEASED))
    assert by_name.card.id == RELEASED
    write_megaloc(models)
    current = MegaLoc()
    rows = [places.encode(PICTURE, NOTHING, {}) for places in (released, by_name, current)]
    np.testing.assert_allclose(rows[1:], [rows[0]] * 2, atol=1e-5)
    assert released.card.checksum == by_name.card.checksum != current.card.checksum


def test_the_published_names_and_sizes_are_those_of_the_network() -> None:
    """The default sizes are the published ones: 12 blocks of 768, 64 clusters of 256, 8448 numbers."""
    from avlmaps_models.foundation.megaloc import AggregationSizes

    with torch.device("meta"):
        state = MegaLocNetwork(DinoSizes(), AggregationSizes()).state_dict()
    assert state["backbone.pos_embed"].shape == (1, 1370, 768)
    assert state["backbone.blocks.11.attn.qkv.weight"].shape == (2304, 768)
    assert state["aggregator.agg.score.3.weight"].shape == (64, 512, 1, 1)
    assert state["aggregator.linear.weight"].shape == (8448, 64 * 256 + 256)
    assert state["aggregator.agg.dust_bin"].shape == ()
    assert len(state) == 4 + 12 * 14 + 2 + 1 + 3 * 4 + 2


def test_the_backbone_is_dinov2_as_transformers_has_it(tmp_path: Path) -> None:
    """At the size that it was trained with no position is interpolated, and the two must agree."""
    from safetensors.torch import save_file
    from transformers import Dinov2Config, Dinov2Model

    weights = {key.removeprefix("backbone."): row for key, row in random_weights().items() if "backbone" in key}
    sizes = DinoSizes.of(weights)
    assert (sizes.width, sizes.patch, sizes.grid) == (WIDTH, 14, 37)
    ours = DinoNetwork(sizes)
    ours.load_state_dict(weights, strict=True)
    config = Dinov2Config(
        hidden_size=WIDTH, num_hidden_layers=sizes.depth, num_attention_heads=WIDTH // 64, image_size=518,
        mlp_ratio=sizes.hidden // WIDTH,
    )  # fmt: skip
    config.save_pretrained(tmp_path)
    save_file(_as_in_transformers(weights), tmp_path / "model.safetensors", metadata={"format": "pt"})
    theirs, told = Dinov2Model.from_pretrained(tmp_path, output_loading_info=True)
    assert not told["missing_keys"] and not told["unexpected_keys"]
    picture = torch.rand((1, 3, 518, 518), generator=torch.Generator().manual_seed(1))
    with torch.no_grad():
        np.testing.assert_allclose(ours(picture), theirs.eval()(picture).last_hidden_state, atol=2e-4)


def _as_in_transformers(weights: dict[str, torch.Tensor]) -> dict[str, torch.Tensor]:
    """Return DINOv2's own weights under the names of the hub's checkpoints."""
    made = {"embeddings.mask_token": torch.zeros(1, WIDTH)}
    fixed = {
        "cls_token": "embeddings.cls_token", "pos_embed": "embeddings.position_embeddings",
        "patch_embed.proj.": "embeddings.patch_embeddings.projection.", "blocks.": "encoder.layer.",
        "attn.proj": "attention.output.dense", "ls1.gamma": "layer_scale1.lambda1", "ls2.gamma": "layer_scale2.lambda1",
    }  # fmt: skip
    for key, row in weights.items():
        if "attn.qkv" in key:
            for part, piece in zip(("query", "key", "value"), row.chunk(3), strict=True):
                name = key.replace("blocks.", "encoder.layer.").replace("attn.qkv", f"attention.attention.{part}")
                made[name] = piece.contiguous()
            continue
        name = key
        for ours, theirs in fixed.items():
            name = name.replace(ours, theirs)
        made[name if not name.startswith("norm.") else f"layernorm.{name.removeprefix('norm.')}"] = row
    return made


def test_positions_are_interpolated_with_the_published_offset() -> None:
    """Cubic convolution (a = -0.75) at (i + 1/2) / scale - 1/2, scale = (rows + 0.1) / grid, edges repeated."""
    network = DinoNetwork(DinoSizes(width=64, depth=0, hidden=1, patch=14, grid=5))
    generator = torch.Generator().manual_seed(2)
    network.pos_embed.data = torch.randn(network.pos_embed.shape, generator=generator)
    rows, columns, grid = 7, 3, 5
    own = network.pos_embed[0, 1:].detach().numpy().astype(np.float64).reshape(grid, grid, 64)

    def weights(count: int) -> np.ndarray:
        out = np.zeros((count, grid))
        for i in range(count):
            at = (i + 0.5) * grid / (count + 0.1) - 0.5
            for tap in range(int(np.floor(at)) - 1, int(np.floor(at)) + 3):
                t, a = abs(at - tap), -0.75
                near, far = (a + 2) * t**3 - (a + 3) * t**2 + 1, a * (t**3 - 5 * t**2 + 8 * t - 4)
                out[i, min(max(tap, 0), grid - 1)] += near if t <= 1 else far
        return out

    expected = np.einsum("ia,jb,abd->ijd", weights(rows), weights(columns), own).reshape(-1, 64)
    with torch.no_grad():
        found = network._places(rows, columns)
        np.testing.assert_allclose(found[0, 1:], expected, atol=1e-5)
        assert torch.equal(found[:, 0], network.pos_embed[:, 0])
        assert network._places(5, 5) is network.pos_embed


def test_the_aggregation_is_the_formula(models: Path) -> None:
    """Written out patch by patch, in float64, from the weights."""
    state = {key: row.double().numpy() for key, row in random_weights().items()}
    write_megaloc(models)
    places = MegaLoc()
    with torch.no_grad():
        tokens = (
            places._network.backbone(imagenet_picture(PICTURE, (322, 322), torch.device("cpu")))[0].double().numpy()
        )
    at = "aggregator.agg."

    def small(part: str, second: int, x: np.ndarray) -> np.ndarray:
        first = state[f"{at}{part}.0.weight"].reshape(-1, WIDTH) @ x + state[f"{at}{part}.0.bias"]
        last = state[f"{at}{part}.{second}.weight"]
        return last.reshape(len(last), -1) @ np.maximum(first, 0.0) + state[f"{at}{part}.{second}.bias"]

    patches = tokens[1:]
    score = np.stack([small("score", 3, x) for x in patches], axis=1)
    share = _sinkhorn(score, float(state[f"{at}dust_bin"]))
    feature = np.stack([small("cluster_features", 3, x) for x in patches], axis=1)
    gathered = np.stack([(feature * share[c]).sum(axis=1) for c in range(CLUSTERS)], axis=1)
    gathered /= np.linalg.norm(gathered, axis=0)
    token = small("token_features", 2, tokens[0])
    whole = np.concatenate([token / np.linalg.norm(token), gathered.reshape(-1)])
    whole = state["aggregator.linear.weight"] @ (whole / np.linalg.norm(whole)) + state["aggregator.linear.bias"]
    assert len(token) == TOKEN_DIM
    np.testing.assert_allclose(places.encode(PICTURE, NOTHING, {}), whole / np.linalg.norm(whole), atol=1e-5)


def _sinkhorn(score: np.ndarray, dustbin: float, rounds: int = 3) -> np.ndarray:
    """Scale rows and columns in turn, by division: rows take 1 each and the dustbin the rest, columns give 1 each."""
    clusters, patches = score.shape
    plan = np.exp(np.vstack([score, np.full(patches, dustbin)]))
    takes = np.append(np.ones(clusters), patches - clusters)
    for _ in range(rounds):
        plan *= (takes / plan.sum(axis=1))[:, None]
        plan *= 1.0 / plan.sum(axis=0)
    return plan[:-1]


@given(st.integers(1, 5), st.integers(1, 20), st.floats(-3.0, 3.0), st.integers(0, 2**31))
def test_shares_are_what_sinkhorn_gives_by_division(clusters: int, more: int, dustbin: float, seed: int) -> None:
    score = 2.0 * np.random.default_rng(seed).standard_normal((clusters, clusters + more))
    found = shares(torch.from_numpy(score)[None], torch.tensor(dustbin, dtype=torch.float64))[0].numpy()
    np.testing.assert_allclose(found, _sinkhorn(score, dustbin), rtol=1e-9, atol=1e-12)
    assert (found.sum(axis=0) <= 1.0 + 1e-9).all(), "a patch gives no more than it has"
    settled = shares(torch.from_numpy(score)[None], torch.tensor(dustbin, dtype=torch.float64), 500)[0].numpy()
    np.testing.assert_allclose(settled.sum(axis=1), 1.0, atol=1e-3)


@pytest.mark.parametrize(
    ("key", "sentence"),
    [
        ("aggregator.agg.dust_bin", r"it lacks aggregator\.agg\.dust_bin"),
        ("aggregator.linear.weight", r"is not MegaLoc's checkpoint .* hf download gberton/MegaLoc$"),
        ("backbone.pos_embed", r"is not MegaLoc's checkpoint .* hf download gberton/MegaLoc$"),
    ],
)
def test_a_checkpoint_that_lacks_a_weight_is_refused(models: Path, key: str, sentence: str) -> None:
    torch.save({name: row for name, row in random_weights().items() if name != key}, models / RELEASED)
    with pytest.raises(BackendError, match=sentence):
        MegaLoc(RELEASED)


def test_a_weight_that_nothing_takes_is_refused_and_code_is_never_run(models: Path) -> None:
    torch.save(random_weights() | {"head.weight": torch.zeros(2)}, models / RELEASED)
    with pytest.raises(BackendError, match=r"nothing takes head\.weight"):
        MegaLoc(RELEASED)
    torch.save(torch.nn.Linear(2, 2), models / RELEASED)
    with pytest.raises(BackendError, match=r"cannot be read as a file of weights"):
        MegaLoc(RELEASED)
    (models / RELEASED).unlink()
    with pytest.raises(BackendError, match=r"hf download gberton/MegaLoc$"):
        MegaLoc()
