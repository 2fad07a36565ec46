"""Writing networks for onnxruntime, their kernels in 8 bit, in a form that it is quick at.

``python -m training.pixels.export --weights NAME.onnx`` writes a file of before again in that form; it computes the
same, to the last bit, and its models keep their ``checksum``.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np
import onnx
import onnxruntime
import torch
import tyro
from onnx import numpy_helper
from torch import Tensor, nn
from training.pixels.network import COLOUR, GEOMETRY, RoomNetwork

from avlmaps.perception.embedded.scene_network import Notes, checksum_of


def load_network(checkpoint: Path, weights: str = "mean") -> RoomNetwork:
    """Return the network, with the running ``mean`` of its weights or the ``last`` ones."""
    state = torch.load(checkpoint, map_location="cpu", weights_only=True)
    has_tower = any(name.startswith("tower.") for name in state[weights])
    network = RoomNetwork(len(state["categories"]), len(state["rooms"]), tuple(state["widths"]), has_tower=has_tower)
    network.load_state_dict({name: value.float() for name, value in state[weights].items()})
    return network.eval()


# Values of an output's kernel that 8 bit are enough for; depthwise ones have 9 or 25 and vary widely.
FEWEST = 64


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


def write_onnx(network: RoomNetwork | MeanOf, path: Path) -> None:
    """Write the network; its pictures may have any size that is a multiple of 32."""
    n = network.fineness
    inputs = (torch.zeros(1, GEOMETRY, 64, 96), torch.zeros(1, COLOUR, n * 64, n * 96))
    size, finer = {2: "height", 3: "width"}, {2: f"{n}*height", 3: f"{n}*width"} if n > 1 else None
    torch.onnx.export(
        network, inputs, str(path), input_names=["geometry", "colour"], output_names=["category", "room", "floor"],
        dynamic_axes={"geometry": size, "colour": finer or size, "category": {2: "rows", 3: "columns"}},
        opset_version=17, do_constant_folding=True, dynamo=False,
    )  # fmt: skip
    _pack(path)


def _pack(path: Path) -> None:
    """Store large kernels as whole numbers of 8 bit and a scale for each output, other large arrays in half precision.

    They are widened once, when the file is loaded; what is computed stays in single precision.
    """
    model = onnx.load(path)
    quicken(model.graph)
    graph, nodes = model.graph, []
    for weight in list(graph.initializer):
        if weight.data_type != onnx.TensorProto.FLOAT or int(np.prod(weight.dims)) < 256:
            continue
        values, name = numpy_helper.to_array(weight), weight.name
        graph.initializer.remove(weight)
        wide = onnx.TensorProto.FLOAT
        if values.ndim < 4 or values[0].size < FEWEST:
            graph.initializer.append(numpy_helper.from_array(values.astype(np.float16), f"{name}_half"))
            nodes.append(onnx.helper.make_node("Cast", [f"{name}_half"], [name], to=wide))
            continue
        scale = np.maximum(np.abs(values).max(axis=(1, 2, 3), keepdims=True), 1e-12) / 127.0
        whole = np.rint(values / scale).astype(np.int8)
        graph.initializer.append(numpy_helper.from_array(whole, f"{name}_whole"))
        graph.initializer.append(numpy_helper.from_array(scale.astype(np.float32), f"{name}_scale"))
        nodes.append(onnx.helper.make_node("Cast", [f"{name}_whole"], [f"{name}_wide"], to=wide))
        nodes.append(onnx.helper.make_node("Mul", [f"{name}_wide", f"{name}_scale"], [name]))
    for node in reversed(nodes):
        graph.node.insert(0, node)
    onnx.checker.check_model(model)
    onnx.save(model, path)


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


@dataclass(frozen=True)
class Options:
    """Options of writing a file again."""

    weights: Path
    """The file ``NAME.onnx``, with ``NAME.json`` beside it."""


def main(options: Options) -> None:
    """Write the file and its notes again."""
    model = onnx.load(options.weights)
    quicken(model.graph)
    onnx.checker.check_model(model)
    onnx.save(model, options.weights)
    path = options.weights.with_suffix(".json")
    notes = msgspec.json.decode(path.read_bytes(), type=Notes)
    notes = msgspec.structs.replace(notes, rewritten=checksum_of(options.weights.read_bytes(), notes))
    path.write_bytes(msgspec.json.format(msgspec.json.encode(notes), indent=1) + b"\n")


if __name__ == "__main__":
    main(tyro.cli(Options))
