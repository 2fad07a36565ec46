"""LightGlue and SuperGlue on kept keypoints: the published computation, and places found with them end to end."""

import os
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from kornia.feature import LightGlue as KorniaLightGlue
from tiny.aliked import write_aliked
from tiny.disk import write_disk
from tiny.lightglue import write_lightglue
from tiny.netvlad import write_netvlad
from tiny.superglue import FOLDER, write_superglue
from tiny.superpoint import write_superpoint

from avlmaps.core.errors import BackendError
from avlmaps.core.poses import rotation_angle_rad
from avlmaps.core.registry import Kind, load
from avlmaps.maps.build import build_map
from avlmaps.maps.store.folder import read
from avlmaps.perception.conformance import check
from avlmaps.perception.encoders import Encoders
from avlmaps.perception.models import ModelSettings, using_models
from avlmaps.perception.protocols import LearnedMatcher, LocalFeatures
from avlmaps.query.avlmap import AVLMap
from avlmaps.query.locate import locate
from avlmaps_models.foundation import aliked, disk
from avlmaps_models.foundation.lightglue import LightGlue
from avlmaps_models.paper import superglue
from avlmaps_models.paper.superglue import SuperGlue, mutual_best, sinkhorn
from avlmaps_sim.bench.locate import map_of
from helpers.picture_room import RoomWalk

WRITERS: dict[str, Callable[..., None]] = {
    "lightglue-disk": write_lightglue,
    "lightglue-aliked": lambda folder, **how: write_lightglue(folder, "aliked", **how),
    "superglue": write_superglue,
}


def features(count: int, dim: int, seed: int, size: tuple[int, int] = (320, 240)) -> LocalFeatures:
    rng = np.random.default_rng(seed)
    descriptors = rng.standard_normal((count, dim)).astype(np.float32)
    descriptors /= np.linalg.norm(descriptors, axis=1, keepdims=True)
    return LocalFeatures(
        xy=rng.uniform((4, 4), np.array(size) - 4, (count, 2)).astype(np.float32),
        descriptors=descriptors,
        score=rng.uniform(0.01, 0.9, count).astype(np.float32),
        size=size,
    )


def seen_again(a: LocalFeatures, seed: int) -> tuple[LocalFeatures, np.ndarray]:
    """Return the same keypoints in another order, a little moved, and the order."""
    rng = np.random.default_rng(seed)
    order = rng.permutation(len(a.xy))
    moved = a.xy[order] + rng.normal(0, 1, (len(order), 2)).astype(np.float32)
    return replace(a, xy=moved, descriptors=a.descriptors[order], score=a.score[order]), order


@pytest.fixture(scope="module")
def shelf(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder that holds each tiny checkpoint twice, as real LightGlues are large to write."""
    folder = tmp_path_factory.mktemp("shelf")
    for kind, random in (("likeness", False), ("random", True)):
        for name, write in WRITERS.items():
            (folder / kind / name).mkdir(parents=True)
            write(folder / kind / name, random=random)
    return folder


@pytest.fixture
def put(shelf: Path, models: Path) -> Callable[..., None]:
    """Return what puts a matcher's checkpoint into the folder of models."""

    def put_into(name: str, random: bool = False) -> None:
        kind = "random" if random else "likeness"
        shutil.copytree(shelf / kind / name, models, copy_function=os.link, dirs_exist_ok=True)

    return put_into


@pytest.fixture(params=list(WRITERS))
def name(request: pytest.FixtureRequest) -> str:
    return request.param


@pytest.mark.parametrize("random", [False, True])
def test_it_conforms_with_random_weights_and_with_others(name: str, random: bool, put: Any) -> None:
    put(name, random)
    matcher = load(Kind.MATCHER, name)
    assert isinstance(matcher, LearnedMatcher)
    check(Kind.MATCHER, matcher)


def test_like_finds_like_where_the_weights_say_so(name: str, put: Any) -> None:
    put(name)
    matcher = load(Kind.MATCHER, name)
    a = features(60, matcher.card.dim, 0)
    b, order = seen_again(a, 1)
    pairs = matcher.match(a, b)
    assert len(pairs) == 60
    np.testing.assert_array_equal(order[pairs[:, 1]], pairs[:, 0])
    np.testing.assert_array_equal(pairs[:, 0], np.sort(pairs[:, 0]))


def test_strangers_match_hardly_where_the_weights_go_by_likeness(name: str, put: Any) -> None:
    put(name)
    matcher = load(Kind.MATCHER, name)
    a, b = features(1, matcher.card.dim, 0), features(1, matcher.card.dim, 1)
    opposite = replace(a, descriptors=-a.descriptors)
    assert matcher.match(a, b).shape[1] == 2
    if name == "superglue":  # whose bin takes what is less alike than it
        assert len(matcher.match(a, opposite)) == 0


def test_lightglue_matches_as_kornia_does_with_keypoints_counted_from_the_first_pixels_centre(put: Any) -> None:
    put("lightglue-disk", random=True)
    network = KorniaLightGlue(features=None, input_dim=128, depth_confidence=-1, width_confidence=-1).eval()
    own = load(Kind.MATCHER, "lightglue-disk")
    network.load_state_dict(own._network.state_dict())
    own._network.conf.depth_confidence = own._network.conf.width_confidence = -1
    # random weights are never sure: believe anything, so that there is something to compare
    own._network.conf.filter_threshold = network.conf.filter_threshold = 0.0
    places: dict[str, list[torch.Tensor]] = {"own": [], "kornia": []}
    for who, one in (("own", own._network), ("kornia", network)):
        one.posenc.register_forward_pre_hook(lambda _, given, who=who: places[who].append(given[0]))
    a, b = features(50, 128, 0), features(70, 128, 1, (640, 400))
    data = {
        f"image{number}": {
            "keypoints": torch.from_numpy(one.xy - 0.5)[None],
            "descriptors": torch.from_numpy(one.descriptors)[None],
            "image": torch.zeros(1, 3, one.size[1], one.size[0]),
        }
        for number, one in enumerate((a, b))
    }
    with torch.no_grad():
        expected = network(data)["matches"][0].numpy()
    pairs = own.match(a, b)
    assert len(expected) > 5
    np.testing.assert_array_equal(pairs, expected)
    for ours, theirs, one in zip(places["own"], places["kornia"], (a, b), strict=True):
        torch.testing.assert_close(ours, theirs, atol=1e-5, rtol=0)
        size = np.array(one.size)
        np.testing.assert_allclose(ours[0], (one.xy - 0.5 - size / 2) / (size.max() / 2), atol=1e-5)


@pytest.mark.parametrize("old", [True, False])
def test_lightglue_takes_the_published_names_and_todays(models: Path, old: bool) -> None:
    write_lightglue(models)
    path = models / "disk_lightglue.pth"
    state = torch.load(path, weights_only=True)
    assert "self_attn.0.Wqkv.weight" in state and not any(name.startswith("transformers") for name in state)
    if not old:
        torch.save(LightGlue("disk")._network.state_dict(), path)
    a = features(20, 128, 0)
    assert len(LightGlue("disk").match(a, a)) == 20


def test_superglue_matches_as_transformers_does_for_as_many_keypoints_of_pictures_of_one_size(models: Path) -> None:
    from transformers import SuperGlueForKeypointMatching

    write_superglue(models, random=True)
    whole = SuperGlueForKeypointMatching.from_pretrained(models / FOLDER, matching_threshold=0.2).eval()
    own = load(Kind.MATCHER, "superglue")
    found = 0
    for seed in range(6):
        a = features(40, 256, seed)
        b, _ = seen_again(a, seed)
        with torch.no_grad():
            matches, *_ = whole._match_image_pair(
                torch.from_numpy(np.stack([a.xy - 0.5, b.xy - 0.5]))[None],
                torch.from_numpy(np.stack([a.descriptors, b.descriptors]))[None],
                torch.from_numpy(np.stack([a.score, b.score]))[None],
                height=240,
                width=320,
            )
        first = matches[0, 0].numpy()
        expected = np.stack([np.flatnonzero(first >= 0), first[first >= 0]], axis=1)
        np.testing.assert_array_equal(own.match(a, b), expected)
        found += len(expected)
    assert found > 10


def by_formula(state: dict[str, np.ndarray], a: LocalFeatures, b: LocalFeatures) -> np.ndarray:
    """Return SuperGlue's scores of all pairs, layer by layer and head by head in float64, for two layers of 4 heads."""

    def linear(name: str, x: np.ndarray) -> np.ndarray:
        return x @ state[f"{name}.weight"].T + state[f"{name}.bias"]

    def block(name: str, x: np.ndarray) -> np.ndarray:
        x, norm = linear(f"{name}.linear", x), f"{name}.batch_norm"
        x = (x - state[f"{norm}.running_mean"]) / np.sqrt(state[f"{norm}.running_var"] + 1e-5)
        return np.maximum(x * state[f"{norm}.weight"] + state[f"{norm}.bias"], 0.0)

    def encoded(one: LocalFeatures) -> np.ndarray:
        size = np.array(one.size, float)
        x = np.concatenate([(one.xy - 0.5 - size / 2) / (0.7 * size.max()), one.score[:, None]], axis=1)
        for number in range(4):
            x = block(f"keypoint_encoder.encoder.{number}", x)
        return one.descriptors + linear("keypoint_encoder.encoder.4", x)

    def message(layer: str, x: np.ndarray, source: np.ndarray) -> np.ndarray:
        heads = []
        for head in np.split(np.arange(256), 4):
            query, key, value = (
                linear(f"{layer}.attention.self.{part}", given)[:, head]
                for part, given in (("query", x), ("key", source), ("value", source))
            )
            weight = np.exp(query @ key.T / 8.0)
            heads.append(weight / weight.sum(axis=1, keepdims=True) @ value)
        told = linear(f"{layer}.attention.output.dense", np.concatenate(heads, axis=1))
        return linear(f"{layer}.mlp.1", block(f"{layer}.mlp.0", np.concatenate([x, told], axis=1)))

    x, y = encoded(a), encoded(b)
    x, y = x + message("gnn.layers.0", x, x), y + message("gnn.layers.0", y, y)
    x, y = x + message("gnn.layers.1", x, y), y + message("gnn.layers.1", y, x)
    return linear("final_projection.final_proj", x) @ linear("final_projection.final_proj", y).T / 16.0


def test_superglue_is_its_formula_for_pictures_of_two_sizes_and_any_numbers_of_keypoints(
    put: Any, models: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from safetensors.torch import load_file

    put("superglue", random=True)
    state = {name: value.double().numpy() for name, value in load_file(models / FOLDER / "model.safetensors").items()}
    seen = []
    monkeypatch.setattr(superglue, "sinkhorn", lambda likeness, *rest: seen.append(likeness) or likeness.double())
    own = load(Kind.MATCHER, "superglue")
    for n, m, size in ((30, 45, (640, 400)), (1, 7, (100, 900)), (9, 1, (320, 240))):
        a, b = features(n, 256, n), features(m, 256, m, size)
        own.match(a, b)
        expected = by_formula(state, a, b)
        np.testing.assert_allclose(seen[-1].numpy(), expected, atol=2e-4 * np.abs(expected).max())


def test_superglue_looks_at_the_places_and_the_scores(put: Any) -> None:
    put("superglue", random=True)
    own = load(Kind.MATCHER, "superglue")
    a, b = features(40, 256, 0), features(50, 256, 1, (640, 400))
    described = own._described(*(own_input(own, one) for one in (a, b)))[0]
    for other in (
        replace(a, score=a.score[::-1].copy()),
        replace(a, xy=a.xy[::-1].copy()),
        replace(a, size=(640, 480)),
    ):
        changed = own._described(*(own_input(own, one) for one in (other, b)))[0]
        assert (changed - described).abs().max() > 1e-3
    larger = replace(a, xy=(a.xy - 0.5) * 2.0 + 0.5, size=(640, 480))
    same = own._described(*(own_input(own, one) for one in (larger, b)))[0]
    torch.testing.assert_close(same, described, atol=1e-4, rtol=1e-3)


def own_input(matcher: Any, local: LocalFeatures) -> Any:
    from avlmaps_models.common.matches import network_input

    return network_input(local, matcher.card, torch.device("cpu"))


@given(
    n=st.integers(1, 12), m=st.integers(1, 12), scale=st.sampled_from([0.1, 1.0, 10.0, 1000.0]), seed=st.integers(0, 99)
)
def test_transport_is_that_of_the_published_logarithms(n: int, m: int, scale: float, seed: int) -> None:
    from transformers.models.superglue.modeling_superglue import log_optimal_transport

    torch.manual_seed(seed)
    likeness, idle = scale * torch.randn(n, m), torch.tensor(1.0)
    expected = log_optimal_transport(likeness[None].double(), idle.double(), 100)[0, :-1, :-1].exp()
    torch.testing.assert_close(sinkhorn(likeness, idle, 100), expected, atol=1e-6, rtol=1e-6)


@given(n=st.integers(1, 9), m=st.integers(1, 9), seed=st.integers(0, 999))
def test_mutual_best_pairs_are_the_best_of_row_and_column_and_above_the_bound(n: int, m: int, seed: int) -> None:
    likely = np.random.default_rng(seed).uniform(0, 1, (n, m))
    pairs = mutual_best(likely, 0.2)
    expected = [
        [i, j]
        for i in range(n)
        for j in range(m)
        if likely[i, j] > 0.2 and likely[i, j] == likely[i].max() == likely[:, j].max()
    ]
    assert pairs.tolist() == expected


@settings(max_examples=8, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(n=st.integers(0, 5), m=st.integers(0, 5))
def test_a_handful_of_keypoints_is_matched_without_a_fault(name: str, models: Path, put: Any, n: int, m: int) -> None:
    if not any(models.iterdir()):
        put(name, random=True)
    matcher = load(Kind.MATCHER, name)
    pairs = matcher.match(features(n, matcher.card.dim, 0), features(m, matcher.card.dim, 1, (50, 700)))
    assert pairs.shape == (len(pairs), 2) and len(pairs) <= min(n, m)


def test_what_a_matcher_cannot_read_is_one_sentence(name: str, put: Any) -> None:
    put(name)
    matcher = load(Kind.MATCHER, name)
    good = features(5, matcher.card.dim, 0)
    with pytest.raises(BackendError, match=f"learnt on descriptors of {matcher.card.dim} numbers, these have 64"):
        matcher.match(features(5, 64, 0), good)
    with pytest.raises(BackendError, match="needs the size of the picture; its keypoints came without"):
        matcher.match(good, replace(good, size=(0, 0)))
    with pytest.raises(BackendError, match="Keypoints lie outside of their picture of 100x100: up to"):
        matcher.match(replace(good, size=(100, 100)), good)


def test_superglue_asks_for_scores(models: Path) -> None:
    write_superglue(models)
    good = features(5, 256, 0)
    with pytest.raises(BackendError, match="needs the score of each keypoint; these came without"):
        load(Kind.MATCHER, "superglue").match(good, replace(good, score=np.zeros(0, np.float32)))


def test_cards_tell_models_licences_and_checksums_apart(models: Path, put: Any) -> None:
    for name in WRITERS:
        put(name)
    cards = {name: load(Kind.MATCHER, name).card for name in WRITERS}
    assert cards["lightglue-disk"].id == "lightglue/disk_lightglue.pth"
    assert cards["superglue"].id == FOLDER and "NonCommercial" in cards["superglue"].licence
    assert len({card.checksum for card in cards.values()}) == 3
    (models / "disk_lightglue.pth").unlink()
    put("lightglue-disk", random=True)
    with using_models(ModelSettings(folder=models, device="cpu")):
        assert load(Kind.MATCHER, "lightglue-disk").card.checksum != cards["lightglue-disk"].checksum


def test_a_file_that_is_not_lightglues_or_not_here_is_one_sentence(
    models: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TORCH_HOME", str(models.parent / "torch"))
    with pytest.raises(BackendError, match=r"get it with: hf download kornia/lightglue aliked_lightglue\.pth"):
        load(Kind.MATCHER, "lightglue-aliked")
    with pytest.raises(BackendError, match="There is no LightGlue here for 'sift'; choose disk or aliked"):
        load(Kind.MATCHER, "lightglue-disk@sift")
    torch.save({"self_attn.0.Wqkv.weight": torch.zeros(3)}, models / "aliked_lightglue.pth")
    with pytest.raises(BackendError, match=r"is not the checkpoint of LightGlue: it lacks input_proj\.weight"):
        load(Kind.MATCHER, "lightglue-aliked")


def test_another_superglue_is_refused_where_a_weight_is_missing(models: Path) -> None:
    from safetensors.torch import load_file, save_file

    write_superglue(models)
    path = models / FOLDER / "model.safetensors"
    state = load_file(path)
    del state["bin_score"]
    save_file(state, path, {"format": "pt"})
    with pytest.raises(BackendError, match="it lacks bin_score"):
        SuperGlue()


@pytest.mark.parametrize(
    "local, matcher, place", [("disk", "lightglue-disk", "netvlad"), ("aliked", "lightglue-aliked", "netvlad"),
                              ("superpoint", "superglue", "netvlad")]
)  # fmt: skip
def test_a_keyframe_is_located_where_it_was_taken(
    models: Path, put: Any, monkeypatch: pytest.MonkeyPatch, local: str, matcher: str, place: str
) -> None:
    """Through the whole pipeline: kept as float16 with scores, retrieved by NetVLAD, matched, and solved for a pose."""
    for write in (write_disk, write_aliked, write_superpoint, write_netvlad):
        write(models)
    put(matcher)
    monkeypatch.setattr(disk, "MAX_KEYPOINTS", 250)
    monkeypatch.setattr(aliked, "MAX_KEYPOINTS", 250)
    walk = RoomWalk(frames=4)
    stored = map_of(walk, Encoders("test", local=local, matcher=matcher, place=place), np.random.default_rng(0))
    assert len(stored.keyframes) >= 2 and stored.place_state == {}
    assert len(stored.keyframes.score) == len(stored.keyframes.xy)
    frame = walk.frame(2)
    found = locate(stored, frame.rgb, None, np.random.default_rng(0))
    assert found.world_from_camera is not None and found.inliers > 40
    assert np.linalg.norm(found.world_from_camera[:3, 3] - frame.world_from_camera[:3, 3]) < 0.01
    assert np.rad2deg(rotation_angle_rad(found.world_from_camera, frame.world_from_camera)) < 0.3
    assert found.reference_stamp_s == frame.stamp_s
    blank = locate(stored, np.full_like(frame.rgb, 99), None, np.random.default_rng(0))
    assert (blank.world_from_camera, blank.inliers) == (None, 0)


def test_a_map_on_the_disk_locates_by_superglue_and_says_so_where_it_has_no_scores(models: Path, put: Any) -> None:
    """Built, closed, opened: what a matcher needs has been kept, and a map from before there were scores is honest."""
    for write in (write_superpoint, write_netvlad):
        write(models)
    put("superglue")
    walk = RoomWalk(frames=2)
    used = Encoders("kept", pixels="colours", local="superpoint", matcher="superglue", place="netvlad")
    path = models.parent / "room.avlmap"
    build_map(walk, path, used, progress=False)
    data = read(path)
    assert data.keyframes.score.dtype == np.float16 and len(data.keyframes.score) == len(data.keyframes.xy) > 0
    kept = AVLMap.open(path)
    found = kept.locate(walk.frame(0).rgb)
    assert found.world_from_camera is not None
    assert np.linalg.norm(found.world_from_camera[:3, 3] - walk.frame(0).world_from_camera[:3, 3]) < 0.01
    keyframes = replace(data.keyframes, score=np.zeros(0, np.float16))
    before = AVLMap(replace(data, keyframes=keyframes), kept.encoders)
    with pytest.raises(
        BackendError, match=r"needs the score of each keypoint; these came without\. Build the map again"
    ):
        before.locate(walk.frame(0).rgb)
