"""Writing networks for onnxruntime, in a form that it is quick at: convolutions in 8 bit."""

from collections.abc import Iterable, Sequence
from pathlib import Path

import msgspec
import numpy as np
import onnx
import onnxruntime
import torch
from onnxruntime.quantization import (
    CalibrationDataReader,
    CalibrationMethod,
    QuantFormat,
    QuantType,
    quantize_static,
)
from torch import Tensor, nn
from training.pixels.network import COLOUR, GEOMETRY, RoomNetwork

from avlmaps.perception.embedded.scene_network import Notes


def load_network(checkpoint: Path, weights: str = "mean") -> RoomNetwork:
    """Return the network, with the running ``mean`` of its weights or the ``last`` ones."""
    state = torch.load(checkpoint, map_location="cpu", weights_only=True)
    has_tower = any(name.startswith("tower.") for name in state[weights])
    network = RoomNetwork(len(state["categories"]), len(state["rooms"]), tuple(state["widths"]), has_tower=has_tower)
    network.load_state_dict({name: value.float() for name, value in state[weights].items()})
    return network.eval()


def notes_of(weights: Path) -> Notes:
    """Return the notes beside a file of weights."""
    return msgspec.json.decode(weights.with_suffix(".json").read_bytes(), type=Notes)


class Shipped:
    """A file that ``write_onnx`` wrote, queried like the network.

    Attributes:
        fineness: as the network's; the notes beside the file say it.
    """

    def __init__(self, path: Path) -> None:
        self._session = onnxruntime.InferenceSession(str(path), providers=["CPUExecutionProvider"])
        self.fineness = notes_of(path).fineness

    def __call__(self, geometry: Tensor, colour: Tensor) -> tuple[Tensor, ...]:
        """Return the scores of categories and of rooms, and the floor's height."""
        outputs = self._session.run(None, {"geometry": geometry.numpy(), "colour": colour.numpy()})
        return tuple(torch.from_numpy(output) for output in outputs)


class MeanOf(nn.Module):
    """Several networks that answer together: the mean of their probabilities, as scores.

    Args:
        networks: of one fineness.
        temperatures: each one's scores are divided by its own first.
    """

    def __init__(self, networks: Sequence[RoomNetwork], temperatures: Sequence[float]) -> None:
        super().__init__()
        self.networks, self._temperatures = nn.ModuleList(networks), tuple(temperatures)
        self.fineness = networks[0].fineness
        self.eval()

    def forward(self, geometry: Tensor, colour: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Return what a network returns; the floor is the mean."""
        score, room, floor = zip(*(network(geometry, colour) for network in self.networks), strict=True)
        kinds = [(each / t).softmax(dim=1) for each, t in zip(score, self._temperatures, strict=True)]
        rooms = [each.softmax(dim=1) for each in room]
        return _log_mean(completed(kinds)), _log_mean(rooms), torch.stack(floor).mean(dim=0)


def completed(kinds: Sequence[Tensor], dim: int = 1) -> list[Tensor]:
    """Return probabilities of as many kinds as the first has: of those that another does not know, as the first says.

    The other's own are scaled to what is left.
    """
    first, out = kinds[0], []
    for each in kinds:
        more = first.narrow(dim, each.shape[dim], first.shape[dim] - each.shape[dim])
        left = 1.0 - more.sum(dim=dim, keepdim=True)
        out.append(torch.cat([each * left, more], dim=dim) if more.shape[dim] else each)
    return out


def _log_mean(probabilities: Sequence[Tensor]) -> Tensor:
    return (torch.stack(list(probabilities)).mean(dim=0) + 1e-9).log()


def write_onnx(network: RoomNetwork | MeanOf, path: Path, looked_at: Iterable[tuple[np.ndarray, np.ndarray]]) -> None:
    """Write the network; its pictures may have any size that is a multiple of 32.

    Args:
        network: what answers.
        path: the file.
        looked_at: geometry and colour of some frames, which show what range the features have.
    """
    n = network.fineness
    inputs = (torch.zeros(1, GEOMETRY, 64, 96), torch.zeros(1, COLOUR, n * 64, n * 96))
    size, finer = {2: "height", 3: "width"}, {2: f"{n}*height", 3: f"{n}*width"} if n > 1 else None
    torch.onnx.export(
        network, inputs, str(path), input_names=["geometry", "colour"], output_names=["category", "room", "floor"],
        dynamic_axes={"geometry": size, "colour": finer or size, "category": {2: "rows", 3: "columns"}},
        opset_version=17, do_constant_folding=True, dynamo=False,
    )  # fmt: skip
    model = onnx.load(path)
    quicken(model.graph)
    onnx.checker.check_model(model)
    onnx.save(model, path)
    in_8_bit(path, looked_at)


def in_8_bit(path: Path, looked_at: Iterable[tuple[np.ndarray, np.ndarray]]) -> None:
    """Let a file compute its convolutions in whole numbers of 8 bit, in the ranges that some frames show.

    Kernels have a scale for each output and 7 bit: two products of 8 bit overflow the sums of processors without
    AVX-512 VNNI, and every processor shall see alike. Scores, and what becomes of them, stay in single precision.
    """
    model = onnx.load(path)
    names = [node.name for node in model.graph.node]
    together = any(name.startswith("/networks.") for name in names)
    apart = [name for name in names if "/score/" in name or (together and not name.startswith("/networks."))]
    quantize_static(
        model, path, _Frames(looked_at), quant_format=QuantFormat.QDQ, per_channel=True, reduce_range=True,
        activation_type=QuantType.QUInt8, weight_type=QuantType.QInt8, calibrate_method=CalibrationMethod.MinMax,
        op_types_to_quantize=["Conv", "Add", "Mul", "Concat", "Relu", "Clip", "Resize"], nodes_to_exclude=apart,
    )  # fmt: skip


class _Frames(CalibrationDataReader):
    def __init__(self, looked_at: Iterable[tuple[np.ndarray, np.ndarray]]) -> None:
        self._left = iter(looked_at)

    def get_next(self) -> dict[str, np.ndarray]:
        return next(({"geometry": geometry, "colour": colour} for geometry, colour in self._left), {})


def quicken(graph: onnx.GraphProto) -> None:
    """Write differently what onnxruntime is slow at; every number that comes out stays as it is.

    Padding is the convolution's own, so that features need not change their order in memory round it. The mean of
    several networks' probabilities is taken of rows, each of one pixel: softmax over the channels of a picture takes
    seven times as long, and a mean over a stack of pictures ten times.
    """
    made = {name: node for node in graph.node for name in node.output}
    nodes, grid = list[onnx.NodeProto](), ""
    for node in graph.node:
        source = made.get(node.input[0] if node.input else "", onnx.NodeProto())
        match node.op_type, source.op_type:
            case "Conv", "Pad":
                of = {each.name: each.ints for each in node.attribute}
                more = [size - stride for size, stride in zip(of["kernel_shape"], of["strides"], strict=True)]
                of["pads"][:] = [each // 2 for each in more] + [each - each // 2 for each in more]  # as in tower.py
                node.input[0] = source.input[0]
            case "Softmax", "Div":
                last, rows = f"{source.output[0]}_last", f"{source.output[0]}_rows"
                grid = grid or last  # the first network's: it knows all kinds
                nodes.append(onnx.helper.make_node("Transpose", [source.output[0]], [last], perm=[0, 2, 3, 1]))
                nodes.append(onnx.helper.make_node("Flatten", [last], [rows], axis=3))
                node.input[0] = rows
            case "ReduceMean", "Concat":
                parts = [made[name].input[0] for name in source.input]
                node = onnx.helper.make_node("Mean", parts, node.output, node.name)
            case "Log", _ if node.output[0] == "category" and grid:
                node.output[0] = "category_rows"
                nodes += [
                    node,
                    onnx.helper.make_node("Shape", [grid], ["category_shape"]),
                    onnx.helper.make_node("Reshape", ["category_rows", "category_shape"], ["category_last"]),
                ]
                node = onnx.helper.make_node("Transpose", ["category_last"], ["category"], perm=[0, 3, 1, 2])
        nodes.append(node)
    used = {output.name for output in graph.output}
    needed = []
    for node in reversed(nodes):
        if used.intersection(node.output):
            used.update(node.input)
            needed.insert(0, node)
    del graph.node[:]
    graph.node.extend(needed)
