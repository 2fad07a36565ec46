"""Regions by SAM 2, and ConceptFusion's mixture of what CLIP says of each and of the whole."""

from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from safetensors.torch import load_file, save_file
from tiny.clip_patches import DIM, IMAGE
from tiny.regions import SAM, SIDE, write_regions

from avlmaps.core.errors import BackendError
from avlmaps.core.registry import Kind, load
from avlmaps.perception.conformance import check, example_frame
from avlmaps.perception.protocols import BatchPixelEncoder, ScaledEncoder
from avlmaps_models.foundation.proposals import Proposals, ProposalSettings, Sam2Proposals, apart
from avlmaps_models.foundation.regions import RegionPixels, blend_with_whole, crop

CLIP = "openai/clip-vit-base-patch16"
ALL = ProposalSettings(points_per_side=3, least_quality=0.0, least_stability=0.0, same_box_overlap=1.0, least_area=0.0)


class Given:
    """A proposer that finds what it is told."""

    name, checksum = "given", "0" * 64

    def __init__(self, proposals: Proposals) -> None:
        self.proposals = proposals

    def find(self, rgb: np.ndarray, grid: tuple[int, int]) -> Proposals:
        assert self.proposals.mask.shape[1:] == grid
        return self.proposals


def unit(rows: np.ndarray) -> np.ndarray:
    return rows / np.linalg.norm(rows, axis=-1, keepdims=True)


@given(st.integers(1, 6), st.integers(0, 1000))
def test_the_mixture_is_the_papers(count: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    whole, regions = unit(rng.standard_normal(8)), unit(rng.standard_normal((count, 8)))
    alike = []
    for i in range(count):
        others = sum(float(regions[i] @ regions[j]) for j in range(count) if j != i)
        alike.append(float(regions[i] @ whole) + others / count)
    weight = np.exp(alike) / np.exp(alike).sum()
    expected = unit(weight[:, None] * whole + (1.0 - weight[:, None]) * regions)
    np.testing.assert_allclose(
        blend_with_whole(torch.tensor(whole), torch.tensor(regions)).numpy(), expected, atol=1e-9
    )


@given(st.integers(0, 12), st.integers(0, 1000), st.sampled_from([0.0, 0.3, 0.7, 1.0]))
def test_what_stays_is_apart_and_what_goes_overlaps_something_better(count: int, seed: int, same: float) -> None:
    rng = np.random.default_rng(seed)
    corner = rng.integers(0, 4, (count, 2)) / 8.0
    box = np.concatenate([corner, corner + rng.integers(1, 4, (count, 2)) / 8.0], axis=1)
    quality = rng.permutation(count) / 10.0

    def overlap(i: int, j: int) -> float:
        cells = np.zeros((2, 64, 64), bool)
        for layer, (x0, y0, x1, y1) in zip(cells, (box[[i, j]] * 64).astype(int), strict=True):
            layer[y0:y1, x0:x1] = True
        return (cells[0] & cells[1]).sum() / (cells[0] | cells[1]).sum()

    kept = apart(box, quality, same)
    assert list(quality[kept]) == sorted(quality[kept], reverse=True)
    for i in kept:
        assert all(overlap(i, j) <= same + 1e-9 for j in kept if i != j)
    for j in set(range(count)) - set(kept.tolist()):
        assert any(overlap(i, j) > same - 1e-9 and quality[i] > quality[j] for i in kept)


def test_a_cut_out_is_never_empty() -> None:
    rgb = np.arange(5 * 7 * 3, dtype=np.uint8).reshape(5, 7, 3)
    np.testing.assert_array_equal(crop(rgb, np.array([0, 0, 1, 1], np.float32)), rgb)
    for box in ([1, 1, 1, 1], [0.5, 0.5, 0.5, 0.5], [0, 0.99, 0.01, 1.0]):
        assert crop(rgb, np.array(box, np.float32)).size > 0
    np.testing.assert_array_equal(crop(rgb, np.array([3 / 7, 0.4, 5 / 7, 0.8], np.float32)), rgb[2:4, 3:5])


def test_masks_are_those_of_sam2_at_every_point_of_the_picture(models: Path) -> None:
    from transformers import Sam2ImageProcessor, Sam2Model

    write_regions(models)
    rgb = example_frame(width=96, height=64).rgb
    found = Sam2Proposals(settings=ALL).find(rgb, (SIDE // 4, SIDE // 4))
    model = Sam2Model.from_pretrained(models / SAM).eval()
    processor = Sam2ImageProcessor(size={"height": SIDE, "width": SIDE})
    picture = processor(rgb, return_tensors="pt")["pixel_values"]
    expected = []
    for y in (1 / 6, 3 / 6, 5 / 6):
        for x in (1 / 6, 3 / 6, 5 / 6):
            points = torch.tensor([[[[x * SIDE, y * SIDE]]]])
            with torch.no_grad():
                masks = model(pixel_values=picture, input_points=points).pred_masks[0, 0]
            expected += [mask.numpy() > 0 for mask in masks if (mask > 0).any()]
    assert len(found.mask) == len(expected)
    # It resizes to whole numbers of 255, so that a cell at an edge may differ.
    for mask in expected:
        assert min((mask != other).mean() for other in found.mask) < 0.03
    assert (np.diff(found.area) <= 0).all()
    for mask, (x0, y0, x1, y1) in zip(found.mask, found.box * SIDE / 4, strict=True):
        rows, columns = np.flatnonzero(mask.any(1)), np.flatnonzero(mask.any(0))
        assert (columns[0], rows[0], columns[-1] + 1, rows[-1] + 1) == (x0, y0, x1, y1)


def test_features_lie_in_their_regions_small_ones_on_large_ones(models: Path) -> None:
    from transformers import CLIPImageProcessorPil, CLIPModel

    write_regions(models)
    encoder = RegionPixels(short_side=8)
    frame = example_frame(seed=5, width=2 * IMAGE, height=2 * IMAGE)
    mask = np.zeros((2, 8, 8), bool)
    mask[0, :4], mask[1, 2:4, 2:4] = True, True
    box = np.array([[0, 0, 1, 0.5], [0.25, 0.25, 0.5, 0.5]], np.float32)
    encoder._proposer = Given(Proposals(mask, box, np.array([0.5, 0.0625], np.float32)))  # pyright: ignore
    found = encoder.encode(frame)

    clip = CLIPModel.from_pretrained(models / CLIP).eval()
    processor = CLIPImageProcessorPil.from_pretrained(models / CLIP)
    cut_outs = [frame.rgb, frame.rgb[:IMAGE], frame.rgb[IMAGE // 2 : IMAGE, IMAGE // 2 : IMAGE]]
    with torch.no_grad():
        rows = [
            clip.get_image_features(processor(c, return_tensors="pt")["pixel_values"]).pooler_output for c in cut_outs
        ]
    rows = [row / row.norm() for row in rows]
    expected = blend_with_whole(rows[0][0], torch.cat(rows[1:])).numpy()
    assert not found[4:].any()
    assert (found[2:4, 2:4] @ expected[1]).min() > 0.999
    assert (found[:2].reshape(-1, DIM) @ expected[0]).min() > 0.999
    np.testing.assert_allclose(found[3, 0], found[0, 0], atol=1e-5)
    assert found[3, 3] @ found[0, 0] < 0.9999


def test_conforms_and_finds_something(models: Path) -> None:
    write_regions(models)
    encoder = load(Kind.PIXELS, "regions")
    assert isinstance(encoder, BatchPixelEncoder)
    assert isinstance(encoder, ScaledEncoder)
    check(Kind.PIXELS, encoder)
    assert encoder.card.id == f"{CLIP}+{SAM}"
    assert encoder.encode(example_frame(width=96, height=64)).any()


def test_a_picture_without_regions_has_no_features(models: Path) -> None:
    write_regions(models)
    encoder = RegionPixels(short_side=8, settings=ProposalSettings(points_per_side=2, least_quality=1.0))
    features = encoder.encode(example_frame(width=96, height=64))
    assert features.shape == (8, 12, DIM)
    assert not features.any()


def test_another_proposer_is_chosen_and_told_apart(models: Path) -> None:
    write_regions(models)
    write_regions(models, "facebook/sam2.1-hiera-small")
    small = RegionPixels(f"{CLIP}+facebook/sam2.1-hiera-small")
    assert small.card.id == f"{CLIP}+facebook/sam2.1-hiera-small"
    assert small.card.checksum != RegionPixels(settings=ALL).card.checksum


def test_a_proposer_that_is_not_whole_is_told(models: Path) -> None:
    write_regions(models)
    path = models / SAM / "model.safetensors"
    weights = load_file(path)
    name = next(key for key in weights if "mask_tokens" in key)
    weights.pop(name)
    save_file(weights, path, metadata={"format": "pt"})
    with pytest.raises(BackendError, match="mask_tokens"):
        RegionPixels()
