"""The weights that ship, as a network that learns further.

A file for onnxruntime holds each convolution with its normalisation folded into it. Here they are taken apart again:
the folded weights become the convolution's, and the normalisation gets the statistics of what comes out on some frames,
and a scale and a shift that undo them. The network computes the same as before, and its normalisations work on.

Folded weights are up to ten times as small as those that were trained, and Muon's steps have one size: at the usual
rate they would tear the network apart. So each convolution is enlarged to the size of trained weights
(``TRAINED_RMS``), which its normalisation undoes. A tower is left as it is folded: AdamW trains it, and its
normalisations learn no statistics.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import onnx
import torch
from onnx import numpy_helper
from torch import Tensor, nn
from training.pixels.network import RoomNetwork

TRAINED_RMS = 0.1  # root mean square of a convolution's weights after long training with Muon
# The convolution's name within its part of the network, and that of the normalisation behind it.
_NORM = {
    "0": "1", "first": "norm_first", "second": "norm_second", "mix": "norm",
    "_conv_stem": "_bn0", "_expand_conv": "_bn0", "_depthwise_conv": "_bn1", "_project_conv": "_bn2",
}  # fmt: skip
_TOWER = "tower."


def unfolded(path: Path, rooms: int, batches: Sequence[tuple[Tensor, Tensor]], number: int = 0) -> RoomNetwork:
    """Return the network of an ONNX file that ``write_onnx`` wrote.

    Args:
        path: the file.
        rooms: how many kinds of room.
        batches: geometry and colour of some frames, to take the statistics from; none if it learns no more.
        number: which, of several that answer together.

    Raises:
        ValueError: the file holds another network.
    """
    arrays, convolutions = _read(path, number)
    widths = tuple(
        len(arrays[convolutions[name][1]]) for name in ("stem.0.0", "down2.0.0", "down3.0.0", "down4.0.0", "down5.0.0")
    )
    towered = any(name.startswith(_TOWER) for name in convolutions)
    network = RoomNetwork(len(arrays[convolutions["score"][0]]), rooms, widths, has_tower=towered)
    state, named = network.state_dict(), dict(network.named_modules())
    left = {name for name, module in named.items() if isinstance(module, nn.Conv2d)} - convolutions.keys()
    if left:
        raise ValueError(f"{path} holds no weights for {', '.join(sorted(left))}; it is another network.")
    normed: list[tuple[nn.Conv2d, nn.BatchNorm2d]] = []
    for name, (weight, bias) in convolutions.items():
        state[f"{name}.weight"].copy_(torch.from_numpy(arrays[weight]))
        norm = _norm_of(name, named)
        shift = torch.from_numpy(arrays[bias])
        if norm is None:
            state[f"{name}.bias"].copy_(shift)
            continue
        convolution, module = named[name], named[norm]
        assert isinstance(convolution, nn.Conv2d)
        assert isinstance(module, nn.BatchNorm2d)
        if not name.startswith(_TOWER):
            normed.append((convolution, module))
        state[f"{norm}.weight"].fill_(1.0)
        state[f"{norm}.bias"].copy_(shift)
        state[f"{norm}.running_mean"].zero_()
        state[f"{norm}.running_var"].fill_(1.0 - module.eps)
    for name, value in state.items():
        if name in arrays:
            value.copy_(torch.from_numpy(arrays[name]).reshape(value.shape))
    network.load_state_dict(state)
    network.eval()
    if batches:
        _take_statistics(network.to(batches[0][0].device), normed, batches)
    return network.cpu()


def has_tower(path: Path) -> bool:
    """Return whether the network of a file has a tower on colour."""
    return any(name.startswith(_TOWER) for name in _read(path)[1])


def _read(path: Path, number: int = 0) -> tuple[dict[str, np.ndarray], dict[str, tuple[str, str]]]:
    """Return the arrays of one network of a file, and for each convolution by its name those of its weight and bias."""
    graph = onnx.load(path).graph
    arrays = {each.name: np.array(numpy_helper.to_array(each), np.float32) for each in graph.initializer}
    for node in graph.node:
        if node.op_type == "DequantizeLinear" and node.input[0] in arrays:
            whole, scale, zero = (arrays[name] for name in node.input)
            ahead = (-1, *[1] * (whole.ndim - 1)) if scale.ndim else ()
            arrays[node.output[0]] = (whole - zero.reshape(ahead)) * scale.reshape(ahead)
    nodes = [node for node in graph.node if node.op_type == "Conv"]
    of_one = [node for node in nodes if node.name.startswith(f"/networks.{number}/")]
    if number and not of_one:
        raise ValueError(f"{path} holds no network number {number}.")

    def own(array: str) -> str:
        return array.removeprefix(f"networks.{number}.")

    convolutions = {
        _module_name(node.name.removeprefix(f"/networks.{number}/")): (own(node.input[1]), own(node.input[2]))
        for node in of_one or nodes
    }
    return {own(name): value for name, value in arrays.items()}, convolutions


def _module_name(node: str) -> str:
    """Return the module of a node: ``/down3/down3.1/first/Conv`` is ``down3.1.first``."""
    name = ""
    for part in node.strip("/").split("/")[:-1]:
        name = part if name and part.startswith(f"{name}.") else f"{name}.{part}".lstrip(".")
    return name


def _norm_of(convolution: str, named: dict[str, nn.Module]) -> str | None:
    head, _, last = convolution.rpartition(".")
    norm = f"{head}.{_NORM.get(last, '')}"
    return norm if isinstance(named.get(norm), nn.BatchNorm2d) else None


@torch.no_grad()
def _take_statistics(
    network: RoomNetwork,
    normed: list[tuple[nn.Conv2d, nn.BatchNorm2d]],
    batches: Sequence[tuple[Tensor, Tensor]],
) -> None:
    """Give each normalisation the mean and spread of what it is fed, and undo them in its scale and shift."""
    device = batches[0][0].device
    sums = {id(n): torch.zeros(3, n.num_features, dtype=torch.float64, device=device) for _, n in normed}

    def look(module: nn.Module, inputs: tuple[Tensor, ...]) -> None:
        x = inputs[0].double()
        count = torch.full_like(x[0, :, 0, 0], x[:, 0].numel())
        sums[id(module)] += torch.stack([count, x.sum((0, 2, 3)), x.square().sum((0, 2, 3))])

    hooks = [norm.register_forward_pre_hook(look) for _, norm in normed]
    for geometry, colour in batches:
        network(geometry, colour)
    for hook in hooks:
        hook.remove()
    for convolution, norm in normed:
        count, total, squares = sums[id(norm)]
        mean = (total / count).float()
        spread = (squares / count - (total / count).square()).clamp(min=1e-6).float()
        larger = TRAINED_RMS / convolution.weight.square().mean().sqrt()
        convolution.weight *= larger
        assert norm.running_mean is not None
        assert norm.running_var is not None
        norm.running_mean.copy_(larger * mean)
        norm.running_var.copy_(larger.square() * spread)
        norm.bias += mean
        norm.weight.copy_((norm.running_var + norm.eps).sqrt() / larger)
