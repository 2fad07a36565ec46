"""Writing the network for onnxruntime, its large weights in half precision."""

from pathlib import Path

import msgspec
import numpy as np
import onnx
import onnxruntime
import torch
from onnx import numpy_helper
from torch import Tensor
from training.pixels.network import COLOUR, GEOMETRY, RoomNetwork

from avlmaps.perception.embedded.scene_network import Notes


def load_network(checkpoint: Path, weights: str = "mean") -> RoomNetwork:
    """Return the network, with the running ``mean`` of its weights or the ``last`` ones."""
    state = torch.load(checkpoint, map_location="cpu", weights_only=True)
    has_tower = any(name.startswith("tower.") for name in state[weights])
    network = RoomNetwork(len(state["categories"]), len(state["rooms"]), tuple(state["widths"]), has_tower=has_tower)
    network.load_state_dict({name: value.float() for name, value in state[weights].items()})
    return network.eval()


class Shipped:
    """A file that ``write_onnx`` wrote, queried like the network.

    Attributes:
        fineness: as the network's; the notes beside the file say it.
    """

    def __init__(self, path: Path) -> None:
        self._session = onnxruntime.InferenceSession(str(path), providers=["CPUExecutionProvider"])
        self.fineness = msgspec.json.decode(path.with_suffix(".json").read_bytes(), type=Notes).fineness

    def __call__(self, geometry: Tensor, colour: Tensor) -> tuple[Tensor, ...]:
        """Return the scores of categories and of rooms, and the floor's height."""
        outputs = self._session.run(None, {"geometry": geometry.numpy(), "colour": colour.numpy()})
        return tuple(torch.from_numpy(output) for output in outputs)


def write_onnx(network: RoomNetwork, path: Path) -> None:
    """Write the network; its pictures may have any size that is a multiple of 32."""
    n = network.fineness
    inputs = (torch.zeros(1, GEOMETRY, 64, 96), torch.zeros(1, COLOUR, n * 64, n * 96))
    size, finer = {2: "height", 3: "width"}, {2: f"{n}*height", 3: f"{n}*width"} if n > 1 else None
    torch.onnx.export(
        network, inputs, str(path), input_names=["geometry", "colour"], output_names=["category", "room", "floor"],
        dynamic_axes={"geometry": size, "colour": finer or size, "category": {2: "rows", 3: "columns"}},
        opset_version=17, do_constant_folding=True, dynamo=False,
    )  # fmt: skip
    _halve(path)


def _halve(path: Path) -> None:
    """Store large weights in half precision; a cast widens them when the file is loaded."""
    model = onnx.load(path)
    graph, casts = model.graph, []
    for weight in list(graph.initializer):
        if weight.data_type != onnx.TensorProto.FLOAT or int(np.prod(weight.dims)) < 256:
            continue
        values = numpy_helper.to_array(weight).astype(np.float16)
        graph.initializer.remove(weight)
        graph.initializer.append(numpy_helper.from_array(values, f"{weight.name}_half"))
        casts.append(onnx.helper.make_node("Cast", [f"{weight.name}_half"], [weight.name], to=onnx.TensorProto.FLOAT))
    for node in reversed(casts):
        graph.node.insert(0, node)
    onnx.checker.check_model(model)
    onnx.save(model, path)
