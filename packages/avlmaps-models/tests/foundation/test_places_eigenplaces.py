"""EigenPlaces: files in the published layout load strictly, whichever network they are of, and compute the formula."""

from pathlib import Path

import numpy as np
import pytest
import torch
from tiny.eigenplaces import DIM, random_weights, with_aggregation, write_eigenplaces

from avlmaps.core.errors import BackendError
from avlmaps.core.registry import Kind
from avlmaps.perception.conformance import check, example_frame
from avlmaps.perception.protocols import LocalFeatures
from avlmaps_models.foundation.eigenplaces import EigenPlaces

NAME = "ResNet50_2048_eigenplaces.pth"
NOTHING = LocalFeatures(np.zeros((0, 2), np.float32), np.zeros((0, 8), np.float32))
PICTURE = example_frame(1, width=160, height=96).rgb


def test_it_conforms(models: Path) -> None:
    write_eigenplaces(models)
    places = EigenPlaces()
    check(Kind.PLACE, places)
    assert places.card.id == NAME and places.card.dim == DIM and places.card.licence == "MIT"


def test_it_computes_what_torchvisions_layers_and_the_formula_give(models: Path) -> None:
    """The network is called layer by layer by its own names in torchvision; the rest is written out in numpy."""
    from torchvision.models import resnet

    write_eigenplaces(models)
    state = random_weights()
    made = resnet.ResNet(resnet.BasicBlock, [1, 1, 1, 1]).eval()
    children = [name for name, _ in made.named_children()]
    theirs = {}
    for key, row in state.items():
        part, number, *rest = key.split(".")
        if part == "backbone":
            theirs[".".join([children[int(number)], *rest])] = row
    assert not made.load_state_dict(theirs, strict=False).unexpected_keys
    mean, deviation = np.array([0.485, 0.456, 0.406]), np.array([0.229, 0.224, 0.225])
    x = torch.from_numpy(((PICTURE / 255.0 - mean) / deviation).astype(np.float32)).permute(2, 0, 1)[None]
    with torch.no_grad():
        x = made.maxpool(made.relu(made.bn1(made.conv1(x))))
        x = made.layer4(made.layer3(made.layer2(made.layer1(x))))[0].double().numpy()
    p = float(state["aggregation.1.p"])
    unit = x / np.maximum(np.linalg.norm(x, axis=0), 1e-12)
    pooled = (np.maximum(unit, 1e-6) ** p).mean(axis=(1, 2)) ** (1 / p)
    row = state["aggregation.3.weight"].double().numpy() @ pooled + state["aggregation.3.bias"].double().numpy()
    found = EigenPlaces().encode(PICTURE, NOTHING, {})
    np.testing.assert_allclose(found, row / np.linalg.norm(row), atol=2e-5)


def test_the_network_is_told_by_the_weights(models: Path) -> None:
    """Bottlenecks, any number of blocks, and VGG-16, whose last convolution is number 28."""
    from torchvision.models.vgg import cfgs, make_layers

    torch.save(random_weights("Bottleneck", (1, 2, 1, 1)), models / "ResNet50_128_eigenplaces.pth")
    plain = make_layers(cfgs["D"])[:-2]
    for values in plain.parameters():
        torch.nn.init.normal_(values, std=0.02)
    vgg = with_aggregation(plain, 512)
    assert "backbone.28.bias" in vgg and "backbone.0.weight" in vgg
    torch.save(vgg, models / "VGG16_512_eigenplaces.pth")
    small = example_frame(1, width=80, height=64).rgb
    rows = [EigenPlaces(name).encode(small, NOTHING, {}) for name in
            ("ResNet50_128_eigenplaces.pth", "VGG16_512_eigenplaces.pth")]  # fmt: skip
    for row in rows:
        assert row.shape == (DIM,) and np.linalg.norm(row) == pytest.approx(1.0, abs=1e-5)


def test_pictures_are_taken_as_they_are_unless_they_are_too_large_or_too_small(models: Path) -> None:
    from avlmaps_models.foundation.eigenplaces import _size

    assert _size(480, 640) == (480, 640)
    assert _size(1080, 1920) == (512, 910)
    assert _size(3, 6) == (64, 128)
    assert _size(60, 6000) == (64, 256)


def test_what_is_not_the_published_file_is_refused(models: Path) -> None:
    get = r"curl -LO https://github\.com/gmberton/EigenPlaces/releases/download/v1\.0/ResNet50_2048_eigenplaces\.pth"
    with pytest.raises(BackendError, match=get):
        EigenPlaces()
    state = random_weights()
    wrong = {
        "it lacks backbone.1.running_mean": {k: v for k, v in state.items() if k != "backbone.1.running_mean"},
        "nothing takes backbone.9.weight": state | {"backbone.9.weight": torch.zeros(1)},
        "has no aggregation.3.weight": {k: v for k, v in state.items() if k != "aggregation.3.weight"},
        "holds no ResNet and no VGG-16": {k: v for k, v in state.items() if not k.startswith("backbone.5.")},
        "of another size is aggregation.1.p": state | {"aggregation.1.p": torch.zeros(2)},
    }
    for sentence, held in wrong.items():
        torch.save(held, models / NAME)
        with pytest.raises(BackendError, match=sentence.replace(".", r"\.")):
            EigenPlaces()
