"""Store a network's weights in 8 bits; its products are computed in single precision.

Products in 8 bits differ between processors: without VNNI two of them are added in 16 bits, and what is larger is cut.
"""

import numpy as np
import onnx
from onnx import helper, numpy_helper


def stored_in_bytes(model: onnx.ModelProto) -> onnx.ModelProto:
    """Return a network whose matrices are bytes with a factor for each column, multiplied when it is loaded."""
    graph = model.graph
    matrices = {each.name: each for each in graph.initializer if len(each.dims) == 2}
    used = [node.input[1] for node in graph.node if node.op_type == "MatMul" and node.input[1] in matrices]
    for name in dict.fromkeys(used):
        weights = numpy_helper.to_array(matrices[name]).astype(np.float32)
        factor = np.maximum(np.abs(weights).max(0), 1e-9) / 127.0
        rounded = np.rint(weights / factor).astype(np.int8)
        graph.initializer.remove(matrices[name])
        graph.initializer.extend(
            numpy_helper.from_array(array, f"{name}_{part}")
            for part, array in (("bytes", rounded), ("factor", factor.astype(np.float32)))
        )
        inputs = [f"{name}_bytes", f"{name}_factor"]
        graph.node.insert(0, helper.make_node("DequantizeLinear", inputs, [name], axis=1))
    onnx.checker.check_model(model)
    return model
