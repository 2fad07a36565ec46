"""Write networks as one ONNX file: batch norms folded, weights in half precision, the features' mean inside."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import onnx
import torch
from onnx import TensorProto, helper, numpy_helper
from torch import nn
from training.sounds.network import Block, SoundNet

from avlmaps.perception.embedded import logmel

OPSET = 17


class _Graph:
    """Collects nodes and weights; every method returns the name of its output."""

    def __init__(self) -> None:
        self.nodes: list[onnx.NodeProto] = []
        self.weights: list[onnx.TensorProto] = []
        self._count = 0

    def add(self, operator: str, *inputs: str, **attributes: object) -> str:
        self._count += 1
        name = f"{operator.lower()}{self._count}"
        self.nodes.append(helper.make_node(operator, list(inputs), [name], **attributes))
        return name

    def half(self, values: np.ndarray) -> str:
        """Store weights in half precision; they are widened when the file is loaded."""
        self._count += 1
        name = f"weight{self._count}"
        self.weights.append(numpy_helper.from_array(values.astype(np.float16), name))
        return self.add("Cast", name, to=TensorProto.FLOAT)

    def integers(self, *values: int) -> str:
        self._count += 1
        name = f"integers{self._count}"
        self.weights.append(numpy_helper.from_array(np.array(values, np.int64), name))
        return name

    def convolution(self, x: str, convolution: nn.Conv2d, norm: nn.BatchNorm2d) -> str:
        """Add a convolution with its batch norm folded in."""
        scale = norm.weight / torch.sqrt(norm.running_var + norm.eps)  # pyright: ignore[reportOperatorIssue, reportArgumentType]
        weight = convolution.weight * scale[:, None, None, None]
        bias = norm.bias - norm.running_mean * scale  # pyright: ignore[reportOptionalOperand]
        down, across = (int(p) for p in convolution.padding)
        return self.add(
            "Conv", x, self.half(weight.detach().numpy()), self.half(bias.detach().numpy()),
            strides=list(convolution.stride), pads=[down, across, down, across],
        )  # fmt: skip

    def block(self, x: str, block: Block) -> str:
        y = self.add("Relu", self.convolution(x, block.first, block.first_norm))
        y = self.convolution(y, block.second, block.second_norm)
        short = self.add("AveragePool", x, kernel_shape=[2, 2], strides=[2, 2])
        return self.add("Relu", self.add("Add", y, self.convolution(short, block.short, block.short_norm)))

    def unit(self, x: str) -> str:
        return self.add("Div", x, self.add("ReduceL2", x, axes=[1], keepdims=1))

    def network(self, x: str, net: SoundNet) -> str:
        y = self.add("Relu", self.convolution(x, net.stem, net.stem_norm))
        for block in net.blocks:
            assert isinstance(block, Block)
            y = self.block(y, block)
        y = self.add("ReduceMean", y, axes=[2], keepdims=0)
        mean = self.add("ReduceMean", y, axes=[2], keepdims=0)
        highest = self.add("ReduceMax", y, axes=[2], keepdims=0)
        both = self.add("Concat", mean, highest, axis=1)
        weight, bias = net.head.weight.detach().numpy(), net.head.bias.detach().numpy()
        return self.unit(self.add("Gemm", both, self.half(weight), self.half(bias), transB=1))


@torch.no_grad()
def write_onnx(nets: Sequence[SoundNet], path: Path) -> None:
    """Write the ensemble: input ``heard`` (n, 2, bands, frames), output ``feature`` (n, dim), unit vectors."""
    graph = _Graph()
    parts = [graph.network("heard", net.eval()) for net in nets]
    total = parts[0] if len(parts) == 1 else graph.add("Sum", *parts)
    feature = graph.unit(total)
    graph.nodes.append(helper.make_node("Identity", [feature], ["feature"]))
    shape = ["windows", 2, logmel.BANDS, logmel.WINDOW_FRAMES]
    model = helper.make_model(
        helper.make_graph(
            graph.nodes, "sounds",
            [helper.make_tensor_value_info("heard", TensorProto.FLOAT, shape)],
            [helper.make_tensor_value_info("feature", TensorProto.FLOAT, ["windows", nets[0].head.out_features])],
            graph.weights,
        ),
        opset_imports=[helper.make_opsetid("", OPSET)], ir_version=8, producer_name="avlmaps training/sounds",
    )  # fmt: skip
    onnx.checker.check_model(model)
    path.write_bytes(model.SerializeToString())


def read_onnx(path: Path) -> SoundNet:
    """Return the network of a file that ``write_onnx`` wrote from one network, to continue from it.

    Its batch norms are folded; ``opened_norms`` sets them so that it can be fitted again.
    """
    tensors = [torch.from_numpy(numpy_helper.to_array(t).astype(np.float32)) for t in onnx.load(path).graph.initializer]
    tensors = [t for t in tensors if t.is_floating_point() and t.ndim]
    net = SoundNet(tensors[-2].shape[0], tensors[0].shape[0])
    layers = [(net.stem, net.stem_norm)]
    for block in net.blocks:
        assert isinstance(block, Block)
        layers += [(block.first, block.first_norm), (block.second, block.second_norm), (block.short, block.short_norm)]
    with torch.no_grad():
        for (convolution, norm), weight, bias in zip(layers, tensors[0:-2:2], tensors[1:-2:2], strict=True):
            convolution.weight.copy_(weight)
            norm.bias.copy_(bias)
            norm.running_var.fill_(1.0 - norm.eps)  # pyright: ignore[reportOptionalMemberAccess]
        net.head.weight.copy_(tensors[-2])
        net.head.bias.copy_(tensors[-1])
    return net.eval()


@torch.no_grad()
def opened_norms(net: SoundNet, x: torch.Tensor) -> SoundNet:
    """Give folded batch norms the statistics of a batch (n, 2, bands, frames), without changing what the net answers.

    Without that, fitting would begin with every channel scaled again.
    """

    def open_up(norm: nn.Module, inputs: tuple[torch.Tensor, ...]) -> None:
        assert isinstance(norm, nn.BatchNorm2d) and norm.running_mean is not None and norm.running_var is not None
        mean, var = inputs[0].mean(dim=(0, 2, 3)), inputs[0].var(dim=(0, 2, 3), unbiased=False)
        norm.weight.copy_(torch.sqrt(var + norm.eps))
        norm.bias.add_(mean)
        norm.running_mean.copy_(mean)
        norm.running_var.copy_(var)

    net = net.eval()
    hooks = [m.register_forward_pre_hook(open_up) for m in net.modules() if isinstance(m, nn.BatchNorm2d)]
    net(x)
    for hook in hooks:
        hook.remove()
    return net
