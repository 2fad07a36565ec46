"""The weights that ship, taken apart for training: the same scores, and normalisations that learn on."""

from collections.abc import Iterator
from copy import deepcopy
from pathlib import Path

import msgspec
import numpy as np
import pytest

torch = pytest.importorskip("torch")
pytest.importorskip("onnx")
from training.pixels.export import MeanOf, Shipped, write_onnx  # noqa: E402
from training.pixels.network import RoomNetwork  # noqa: E402
from training.pixels.unfold import TRAINED_RMS, unfolded  # noqa: E402

from avlmaps.perception.embedded.scene_network import Notes  # noqa: E402

CATEGORIES, ROOMS, WIDTHS = 5, 3, (8, 12, 16, 20, 24)


def pictures(count: int, seed: int) -> list[tuple["torch.Tensor", "torch.Tensor"]]:
    generator = torch.Generator().manual_seed(seed)
    return [(torch.randn(2, 8, 64, 96, generator=generator), torch.randn(2, 3, 64, 96, generator=generator))
            for _ in range(count)]  # fmt: skip


def looked_at() -> Iterator[tuple[np.ndarray, np.ndarray]]:
    for geometry, colour in pictures(6, 1):
        yield geometry[:1].numpy(), colour[:1].numpy()


@pytest.fixture
def shipped(tmp_path: Path) -> tuple[Path, RoomNetwork]:
    """Return a file and the network that it was written from, with statistics and scales of its own."""
    network = RoomNetwork(CATEGORIES, ROOMS, WIDTHS)
    for module in network.modules():
        if isinstance(module, torch.nn.BatchNorm2d):
            torch.nn.init.uniform_(module.weight, 0.3, 1.5)
            torch.nn.init.uniform_(module.bias, -0.5, 0.5)
    network.train()
    for geometry, colour in pictures(4, 1):
        network(geometry, colour)
    write_onnx(network.eval(), tmp_path / "network.onnx", looked_at())
    return tmp_path / "network.onnx", network


def test_a_file_of_8_bit_scores_nearly_as_its_network_does(shipped: tuple[Path, RoomNetwork]) -> None:
    path, network = shipped
    kinds = {name: "" for name in ("id", "note")} | {name: () for name in ("categories", "rooms", "bias")}
    notes = Notes(**kinds, temperature=1.0, room_temperature=1.0, called={}, kinds={})
    path.with_suffix(".json").write_bytes(msgspec.json.encode(notes))
    file = Shipped(path)
    for geometry, colour in pictures(3, 5):
        with torch.no_grad():
            one = network(geometry[:1], colour[:1])[0].numpy()
        said = file(geometry[:1], colour[:1])[0].numpy()
        assert np.corrcoef(said.ravel(), one.ravel())[0, 1] > 0.99


def test_it_scores_as_the_file_does(shipped: tuple[Path, RoomNetwork]) -> None:
    path, network = shipped
    again = unfolded(path, ROOMS, pictures(3, 2)).eval()
    for geometry, colour in pictures(2, 3):
        with torch.no_grad():
            for one, other in zip(network(geometry, colour), again(geometry, colour), strict=True):
                np.testing.assert_allclose(one.numpy(), other.numpy(), rtol=0.02, atol=0.05)  # 8 bit in the file


def test_of_several_networks_in_a_file_each_can_be_taken(shipped: tuple[Path, RoomNetwork], tmp_path: Path) -> None:
    pair = [shipped[1], deepcopy(shipped[1])]
    with torch.no_grad():
        for array in pair[1].parameters():
            array *= 1.0 + 0.2 * torch.randn_like(array)
    write_onnx(MeanOf(pair, [0.9, 1.2]), tmp_path / "both.onnx", looked_at())
    geometry, colour = pictures(1, 3)[0]
    for number, network in enumerate(pair):
        again = unfolded(tmp_path / "both.onnx", ROOMS, pictures(3, 2), number).eval()
        with torch.no_grad():
            one, other = network(geometry, colour)[0], again(geometry, colour)[0]
        np.testing.assert_allclose(one.numpy(), other.numpy(), rtol=0.05, atol=0.05)  # 8 bit in the file
    with pytest.raises(ValueError, match="no network number 2"):
        unfolded(tmp_path / "both.onnx", ROOMS, pictures(1, 2), 2)


def test_networks_that_answer_together_give_the_mean_of_their_probabilities(tmp_path: Path) -> None:
    torch.manual_seed(1)
    pair = [RoomNetwork(CATEGORIES, ROOMS, WIDTHS).eval() for _ in range(2)]
    for network in pair:
        torch.nn.init.normal_(network.score.weight, std=2.0)
    geometry, colour = pictures(1, 4)[0]
    with torch.no_grad():
        said = MeanOf(pair, [0.5, 2.0])(geometry, colour)[0].softmax(dim=1)
        each = [(network(geometry, colour)[0] / t).softmax(dim=1) for network, t in zip(pair, (0.5, 2.0), strict=True)]
    torch.testing.assert_close(said, (each[0] + each[1]) / 2, rtol=1e-4, atol=1e-5)


def test_it_computes_nearly_the_same_while_it_learns(shipped: tuple[Path, RoomNetwork]) -> None:
    """In training the statistics are those of the batch; they were taken from such batches."""
    path, _ = shipped
    seen = pictures(1, 2)
    again = unfolded(path, ROOMS, seen)
    with torch.no_grad():
        still = again.eval()(*seen[0])[0]
        for module in again.modules():
            if isinstance(module, torch.nn.BatchNorm2d):
                module.train()
        learning = again(*seen[0])[0]
    np.testing.assert_allclose(still.numpy(), learning.numpy(), rtol=0.02, atol=0.02)


def test_its_convolutions_are_as_large_as_trained_ones(shipped: tuple[Path, RoomNetwork]) -> None:
    """Steps of one size would otherwise tear small weights apart."""
    again = unfolded(shipped[0], ROOMS, pictures(1, 2))
    weights = [p for name, p in again.named_parameters() if p.ndim == 4 and "score" not in name]
    sizes = [weight.square().mean().sqrt().item() for weight in weights]
    np.testing.assert_allclose(sizes, TRAINED_RMS, rtol=1e-4)


def test_the_file_of_another_network_is_refused(shipped: tuple[Path, RoomNetwork], tmp_path: Path) -> None:
    import onnx

    path, _ = shipped
    model = onnx.load(path)
    kept = [node for node in model.graph.node if "/up1/" not in node.name]
    del model.graph.node[:]
    model.graph.node.extend(kept)
    onnx.save(model, tmp_path / "other.onnx")
    with pytest.raises(ValueError, match=r"no weights for up1\.first, up1\.second"):
        unfolded(tmp_path / "other.onnx", ROOMS, pictures(1, 0))
