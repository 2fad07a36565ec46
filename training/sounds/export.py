"""Write a network as an ONNX file: batch norms folded, weights in bytes."""

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

    def constant(self, values: np.ndarray) -> str:
        self._count += 1
        name = f"weight{self._count}"
        self.weights.append(numpy_helper.from_array(values, name))
        return self.add("Cast", name, to=TensorProto.FLOAT)

    def half(self, values: np.ndarray) -> str:
        """Store numbers in half precision; they are widened when the file is loaded."""
        return self.constant(values.astype(np.float16))

    def bytes(self, values: np.ndarray) -> str:
        """Store weights as bytes, with one scale for each output; they are widened when the file is loaded."""
        axes = tuple(range(1, values.ndim))
        scale = np.abs(values).max(axis=axes, keepdims=True) / 127.0
        scale = np.maximum(scale, 1e-6).astype(np.float16).astype(np.float32)
        rounded = np.clip(np.rint(values / scale), -127, 127).astype(np.int8)
        return self.add("Mul", self.constant(rounded), self.half(scale))

    def convolution(self, x: str, convolution: nn.Conv2d, norm: nn.BatchNorm2d) -> str:
        """Add a convolution with its batch norm folded in."""
        scale = norm.weight / torch.sqrt(norm.running_var + norm.eps)  # pyright: ignore[reportOperatorIssue, reportArgumentType]
        weight = convolution.weight * scale[:, None, None, None]
        bias = norm.bias - norm.running_mean * scale  # pyright: ignore[reportOptionalOperand]
        down, across = (int(p) for p in convolution.padding)
        return self.add(
            "Conv", x, self.bytes(weight.detach().numpy()), self.half(bias.detach().numpy()),
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
        return self.unit(self.add("Gemm", both, self.bytes(weight), self.half(bias), transB=1))


@torch.no_grad()
def write_onnx(net: SoundNet, path: Path) -> None:
    """Write the network: input ``heard`` (n, 2, bands, frames), output ``feature`` (n, dim), unit vectors."""
    graph = _Graph()
    feature = graph.network("heard", net.eval())
    graph.nodes.append(helper.make_node("Identity", [feature], ["feature"]))
    shape = ["windows", 2, logmel.BANDS, logmel.WINDOW_FRAMES]
    model = helper.make_model(
        helper.make_graph(
            graph.nodes, "sounds",
            [helper.make_tensor_value_info("heard", TensorProto.FLOAT, shape)],
            [helper.make_tensor_value_info("feature", TensorProto.FLOAT, ["windows", net.head.out_features])],
            graph.weights,
        ),
        opset_imports=[helper.make_opsetid("", OPSET)], ir_version=8, producer_name="avlmaps training/sounds",
    )  # fmt: skip
    onnx.checker.check_model(model)
    path.write_bytes(model.SerializeToString())
