"""NetVLAD from the published .mat layout, held against a slow formula, and its converted form."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.io import loadmat, savemat
from tiny.netvlad import CLUSTERS, DIM, MEAN, netvlad_net, write_netvlad

from avlmaps.core.errors import BackendError
from avlmaps.core.registry import Kind, load
from avlmaps.perception.conformance import check
from avlmaps.perception.models import ModelSettings, using_models
from avlmaps.perception.protocols import LocalFeatures
from avlmaps_models.paper.netvlad import NetVlad, convert_netvlad
from helpers.picture_room import painting

MAT = "VGG16-NetVLAD-Pitts30K.mat"
NONE = LocalFeatures(np.zeros((0, 2), np.float32), np.zeros((0, 128), np.float32))


@pytest.fixture
def encoder(models: Path) -> Any:
    write_netvlad(models)
    return load(Kind.PLACE, "netvlad")


def picture(width: int = 72, height: int = 56, seed: int = 0) -> np.ndarray:
    return painting(np.random.default_rng(seed), height, width, shapes=80)


def unit(values: np.ndarray) -> np.ndarray:
    return values / np.linalg.norm(values)


def by_formula(path: Path, rgb: np.ndarray) -> np.ndarray:
    """Return the descriptor by the published layers one after the other, in float64, place by place."""
    layers = loadmat(path, struct_as_record=False, squeeze_me=True)["net"].layers
    x = torch.from_numpy((rgb.astype(np.float64) - np.float32(MEAN)).transpose(2, 0, 1))[None]
    for layer in layers[:29]:
        if layer.type == "conv":
            kernel, bias = (torch.from_numpy(np.asarray(weight, np.float64)) for weight in layer.weights)
            x = torch.nn.functional.conv2d(x, kernel.permute(3, 2, 0, 1), bias, padding=1)
        else:
            x = x.relu() if layer.type == "relu" else torch.nn.functional.max_pool2d(x, 2)
    assignment, minus_centres = (np.asarray(weight, np.float64) for weight in layers[30].weights)
    residuals = np.zeros(assignment.shape)
    for row in range(x.shape[2]):
        for column in range(x.shape[3]):
            feature = unit(x[0, :, row, column].numpy())
            share = np.exp(feature @ assignment)
            residuals += share / share.sum() * (feature[:, None] + minus_centres)
    described = unit(np.concatenate([unit(cluster) for cluster in residuals.T]))
    # MatConvNet and hloc count clusters fastest: all clusters of the first number, then those of the second
    described = described.reshape(len(residuals.T), -1).T.ravel()
    kernel, bias = (np.asarray(weight, np.float64) for weight in layers[33].weights)
    return unit(described @ kernel + bias)


def test_it_conforms(encoder: NetVlad) -> None:
    check(Kind.PLACE, encoder)


@pytest.mark.parametrize("width, height", [(72, 56), (90, 41)])
def test_the_descriptor_is_that_of_the_published_layers(
    encoder: NetVlad, models: Path, width: int, height: int
) -> None:
    rgb = picture(width, height)
    found = encoder.encode(rgb, NONE, {})
    assert found.dtype == np.float32 and found.shape == (DIM,)
    np.testing.assert_allclose(found, by_formula(models / MAT, rgb), atol=2e-5)


def test_the_picture_is_seen_at_its_full_size_and_the_keypoints_are_not_looked_at(encoder: NetVlad) -> None:
    rgb = picture(160, 120)
    small = np.ascontiguousarray(rgb[::2, ::2])
    assert unit(encoder.encode(rgb, NONE, {})) @ encoder.encode(small, NONE, {}) < 0.999
    some = LocalFeatures(np.ones((3, 2), np.float32), np.ones((3, 128), np.float32))
    np.testing.assert_allclose(encoder.encode(rgb, NONE, {}), encoder.encode(rgb, some, {}), atol=1e-5)
    assert encoder.fit([some], np.random.default_rng(0)) == {}


@settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(width=st.integers(1, 60), height=st.integers(1, 60), value=st.integers(0, 255))
def test_pictures_of_any_size_and_blank_ones_have_a_unit_vector(
    encoder: NetVlad, width: int, height: int, value: int
) -> None:
    found = encoder.encode(np.full((height, width, 3), value, np.uint8), NONE, {})
    assert np.linalg.norm(found) == pytest.approx(1.0, abs=1e-5)


def test_the_converted_form_gives_the_same_features_and_the_same_card(encoder: NetVlad, models: Path) -> None:
    rgb = picture()
    before, card = encoder.encode(rgb, NONE, {}), encoder.card
    convert_netvlad(models / MAT, models / MAT.replace(".mat", ".safetensors"))
    (models / MAT).unlink()
    with using_models(ModelSettings(folder=models, device="cpu")):
        again = load(Kind.PLACE, "netvlad")
        named = load(Kind.PLACE, "netvlad@VGG16-NetVLAD-Pitts30K.safetensors")
    assert again.card == card == named.card
    np.testing.assert_allclose(again.encode(rgb, NONE, {}), before, atol=1e-5)


def test_the_card_hangs_on_the_weights(encoder: NetVlad, models: Path) -> None:
    net = netvlad_net()
    net["layers"][0][0]["weights"][0, 1][0, 0] += 1.0
    savemat(models / MAT, {"net": net})
    other = NetVlad()
    assert other.card.checksum != encoder.card.checksum
    assert other.card.dim == DIM and "research" in other.card.licence


def test_another_training_of_it_can_be_chosen(models: Path) -> None:
    savemat(models / "VGG16-NetVLAD-TokyoTM.mat", {"net": netvlad_net(clusters=3, dim=10)})
    other = load(Kind.PLACE, "netvlad@VGG16-NetVLAD-TokyoTM.mat")
    assert (other.card.id, other.card.dim) == ("netvlad/VGG16-NetVLAD-TokyoTM", 10)


def test_the_cache_of_hloc_is_looked_through(models: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_netvlad(models)
    cache = models.parent / "torch" / "hub" / "netvlad"
    cache.mkdir(parents=True)
    (models / MAT).rename(cache / MAT)
    monkeypatch.setenv("TORCH_HOME", str(models.parent / "torch"))
    assert load(Kind.PLACE, "netvlad").card.dim == DIM


def test_where_it_is_not_here_the_command_is_told(models: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TORCH_HOME", str(models.parent / "torch"))
    with pytest.raises(BackendError) as fault:
        load(Kind.PLACE, "netvlad")
    assert str(fault.value) == (
        f"The checkpoint {MAT} is not here (looked in {models}); get it with: curl -L -o {MAT} "
        "https://cvg-data.inf.ethz.ch/hloc/netvlad/Pitts30K_struct.mat"
    )


def without_a_layer(net: dict[str, Any]) -> None:
    net["layers"] = net["layers"][:, :33]


def without_weights(net: dict[str, Any]) -> None:
    del net["layers"][0][5]["weights"]


def shifted(net: dict[str, Any]) -> None:
    net["layers"][0][[28, 27]] = net["layers"][0][[27, 28]]


def of_other_widths(net: dict[str, Any]) -> None:
    net["layers"][0][33]["weights"][0, 0] = np.zeros((1, 1, 10, DIM), np.float32)


def without_mean(net: dict[str, Any]) -> None:
    del net["meta"]["normalization"]["averageImage"]


@pytest.mark.parametrize("spoil", [without_a_layer, without_weights, shifted, of_other_widths, without_mean])
def test_a_file_of_another_network_is_one_sentence(models: Path, spoil: Any) -> None:
    net = netvlad_net()
    spoil(net)
    savemat(models / MAT, {"net": net})
    with pytest.raises(BackendError, match=r"Pitts30K\.mat .*with: curl -L") as fault:
        load(Kind.PLACE, "netvlad")
    assert "\n" not in str(fault.value)


@pytest.mark.parametrize("name", [MAT, "VGG16-NetVLAD-Pitts30K.safetensors"])
def test_a_damaged_file_is_one_sentence(models: Path, name: str) -> None:
    (models / name).write_bytes(b"not a file of weights")
    with pytest.raises(BackendError, match=r"cannot be read as .*get .* with: curl"):
        load(Kind.PLACE, f"netvlad@{name}")


def test_a_converted_file_without_a_weight_is_one_sentence(models: Path) -> None:
    from safetensors.torch import load_file, save_file

    write_netvlad(models)
    path = models / "other.safetensors"
    convert_netvlad(models / MAT, path)
    state = load_file(path)
    assert state["assign.weight"].shape == (CLUSTERS, 16, 1)
    del state["whiten.bias"]
    save_file(state, path)
    with pytest.raises(BackendError, match=r"it lacks whiten\.bias"):
        load(Kind.PLACE, "netvlad@other.safetensors")


def test_the_layers_are_as_wide_as_the_published_ones_where_the_file_is(models: Path) -> None:
    """Real widths, a small whitening: the published file itself has 32,768 times 4096 numbers there."""
    widths = (64, 64, 128, 128, 256, 256, 256, 512, 512, 512, 512, 512, 512)
    savemat(models / MAT, {"net": netvlad_net(widths, 64, 8)})
    rgb = picture(48, 32)
    np.testing.assert_allclose(NetVlad().encode(rgb, NONE, {}), by_formula(models / MAT, rgb), atol=1e-4)
