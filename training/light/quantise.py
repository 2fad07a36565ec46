"""Small weights for onnxruntime: int8 products that keep up with outliers, 4-bit ones where only size counts.

- ``int8``: a weight has one scale for each output, an activation one for each token, computed as it comes: a token
  with a huge value, of which vision transformers have a few, costs the others nothing. Both are unsigned with zero at
  128, because onnxruntime's kernel for unsigned by signed bytes saturates on processors without VNNI.
- ``int4``: blocks of a row share a scale that is searched for the least squared error; activations stay float.

Tables of tokens are stored in the same number of bits by row or block. What is left over and large is stored in half
precision and widened when the file is loaded.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Literal

import numpy as np
import onnx
from onnx import helper, numpy_helper

Bits = Literal[4, 8]
_CONTRIB = "com.microsoft"
_ZERO = 128
_STEPS = 127.0
_BLOCK_OF_PRODUCT, _BLOCK_OF_TABLE = 128, 64
_LARGE = 256  # numbers; smaller arrays stay as they are
_TABLE = 4096
_SHRINKS = np.linspace(0.75, 1.0, 6)
_AT_ONCE = 2048


def quantise(path: Path, out: Path, bits: Bits) -> None:
    """Write a network of float32 with small weights.

    Args:
        path: the network, as torch exports it.
        out: where to write the other.
        bits: of products' weights and of tables.
    """
    model = onnx.load(path)
    _Rewriter(model.graph, bits).run()
    _halve(model.graph)
    del model.opset_import[:]
    model.opset_import.extend([helper.make_opsetid("", 17), helper.make_opsetid(_CONTRIB, 1)])
    model.ir_version = 10
    for noted in list(model.graph.value_info):  # shapes of what is no longer there
        model.graph.value_info.remove(noted)
    onnx.save(model, out)


class _Rewriter:
    """Replaces products with constant matrices, and look-ups in constant tables, in one graph."""

    def __init__(self, graph: onnx.GraphProto, bits: Bits) -> None:
        self._graph, self._bits = graph, bits
        self._constants = {row.name: row for row in graph.initializer}
        self._made: list[onnx.NodeProto] = []
        self._small: dict[
            str, tuple[str, str, str]
        ] = {}  # of an activation: bytes, scale of each token, shape in front

    def run(self) -> None:
        for node in self._graph.node:
            if node.op_type == "MatMul" and self._is_matrix(node.input[1]):
                (self._product_8 if self._bits == 8 else self._product_4)(node)
            elif node.op_type == "Gather" and self._is_table(node):
                (self._table_8 if self._bits == 8 else self._table_4)(node)
            else:
                self._made.append(node)
        del self._graph.node[:]
        self._graph.node.extend(self._made)
        used = {name for node in self._made for name in node.input} | {row.name for row in self._graph.output}
        for row in [row for row in self._graph.initializer if row.name not in used]:
            self._graph.initializer.remove(row)

    def _is_matrix(self, name: str) -> bool:
        return name in self._constants and len(self._constants[name].dims) == 2

    def _is_table(self, node: onnx.NodeProto) -> bool:
        return self._is_matrix(node.input[0]) and int(np.prod(self._constants[node.input[0]].dims)) >= _TABLE

    def _matrix(self, name: str) -> np.ndarray:
        return numpy_helper.to_array(self._constants[name]).astype(np.float32)

    def _keep(self, name: str, values: np.ndarray) -> str:
        if name not in self._constants:
            row = numpy_helper.from_array(np.ascontiguousarray(values), name)
            self._graph.initializer.append(row)
            self._constants[name] = row
        return name

    def _add(self, kind: str, inputs: list[str], name: str, *more: str, **settings: object) -> str:
        domain = {"domain": _CONTRIB} if kind in _CONTRIB_KINDS else {}
        self._made.append(helper.make_node(kind, inputs, [name, *more], name=name, **domain, **settings))
        return name

    def _product_8(self, node: onnx.NodeProto) -> None:
        """x·W by bytes: x is (..., k); each of its rows has a scale, and so has each column of W."""
        x, w, out = node.input[0], node.input[1], node.output[0]
        matrix = self._matrix(w)
        bytes_of_x, scale_of_x, front = self._activation(x, matrix.shape[0])
        scale = np.maximum(np.abs(matrix).max(axis=0) / _STEPS, 1e-12).astype(np.float32)
        weights = self._keep(f"{w}_u8", (np.round(matrix / scale) + _ZERO).astype(np.uint8))
        scales = self._keep(f"{w}_scale", scale)
        zero, one = self._keep("zero_point", np.array(_ZERO, np.uint8)), self._keep("one", np.array(1.0, np.float32))
        product = self._add("MatMulIntegerToFloat", [bytes_of_x, weights, one, scales, zero, zero], f"{out}_steps")
        rows = self._add("Mul", [product, scale_of_x], f"{out}_rows")
        columns = self._keep(f"columns_{matrix.shape[1]}", np.array([matrix.shape[1]], np.int64))
        shape = self._add("Concat", [front, columns], f"{out}_shape", axis=0)
        self._add("Reshape", [rows, shape], out)

    def _activation(self, x: str, width: int) -> tuple[str, str, str]:
        """Return the bytes (n, k) of an activation (..., k), the scale (n, 1) of each row, and the shape in front."""
        if x not in self._small:
            flat = self._add("Reshape", [x, self._keep(f"flat_{width}", np.array([-1, width], np.int64))], f"{x}_flat")
            size = self._add("Abs", [flat], f"{x}_abs")
            largest = self._add("ReduceMax", [size], f"{x}_max", axes=[1], keepdims=1)
            least = self._keep("least", np.array(1e-8, np.float32))
            most = self._add("Max", [largest, least], f"{x}_most")
            scale = self._add("Mul", [most, self._keep("step", np.array(1.0 / _STEPS, np.float32))], f"{x}_scale")
            vector = self._add("Reshape", [scale, self._keep("all", np.array([-1], np.int64))], f"{x}_scales")
            # zero points of a vector of scales must be a vector, too
            count = self._add("Shape", [vector], f"{x}_count")
            zeros = self._add(
                "ConstantOfShape", [count], f"{x}_zeros", value=numpy_helper.from_array(np.array([_ZERO], np.uint8))
            )
            bytes_of_x = self._add("QuantizeLinear", [flat, vector, zeros], f"{x}_u8", axis=0)
            whole = self._add("Shape", [x], f"{x}_whole")
            bounds = [self._keep(name, np.array([at], np.int64)) for name, at in (("begin", 0), ("end", -1))]
            front = self._add("Slice", [whole, *bounds], f"{x}_front")
            self._small[x] = bytes_of_x, scale, front
        return self._small[x]

    def _product_4(self, node: onnx.NodeProto) -> None:
        x, w, out = node.input[0], node.input[1], node.output[0]
        matrix = self._matrix(w)
        inner, outer = matrix.shape
        block = _block(inner, _BLOCK_OF_PRODUCT)
        steps, scale = in_blocks(matrix.T, block)
        packed = (steps[..., 0::2] + 8) | ((steps[..., 1::2] + 8) << 4)
        weights, scales = self._keep(f"{w}_u4", packed.astype(np.uint8)), self._keep(f"{w}_scale", scale.reshape(-1))
        self._add("MatMulNBits", [x, weights, scales], out, K=inner, N=outer, bits=4, block_size=block)

    def _table_8(self, node: onnx.NodeProto) -> None:
        table, ids, out = node.input[0], node.input[1], node.output[0]
        rows = self._matrix(table)
        scale = np.maximum(np.abs(rows).max(axis=1, keepdims=True) / _STEPS, 1e-12).astype(np.float32)
        weights = self._keep(f"{table}_s8", np.round(rows / scale).astype(np.int8))
        steps = self._add("Gather", [weights, ids], f"{out}_steps")
        exact = self._add("Cast", [steps], f"{out}_float", to=onnx.TensorProto.FLOAT)
        scales = self._add("Gather", [self._keep(f"{table}_scale", scale), ids], f"{out}_scale")
        self._add("Mul", [exact, scales], out)

    def _table_4(self, node: onnx.NodeProto) -> None:
        """Two steps in a byte, found by row and taken apart again: plain operators, since a text is short."""
        table, ids, out = node.input[0], node.input[1], node.output[0]
        rows = self._matrix(table)
        block = _block(rows.shape[1], _BLOCK_OF_TABLE)
        if rows.shape[1] % block:
            self._made.append(node)
            return
        steps, scale = in_blocks(rows, block)
        high, low = steps[..., : block // 2] + 8, steps[..., block // 2 :] + 8
        packed = self._keep(f"{table}_u4", (low | (high << 4)).astype(np.uint8))  # (tokens, blocks, block / 2)
        both = self._add("Gather", [packed, ids], f"{out}_packed")
        both = self._add("Cast", [both], f"{out}_both", to=onnx.TensorProto.INT32)
        sixteen = self._keep("sixteen", np.array(16, np.int32))
        parts = [self._add("Div", [both, sixteen], f"{out}_high"), self._add("Mod", [both, sixteen], f"{out}_low")]
        joined = self._add("Concat", parts, f"{out}_joined", axis=-1)
        exact = self._add("Cast", [joined], f"{out}_float", to=onnx.TensorProto.FLOAT)
        centred = self._add("Sub", [exact, self._keep("eight", np.array(8.0, np.float32))], f"{out}_centred")
        scales = self._add("Gather", [self._keep(f"{table}_scale", scale[..., None]), ids], f"{out}_scale")
        scaled = self._add("Mul", [centred, scales], f"{out}_blocks")
        shape = self._keep(f"tokens_{rows.shape[1]}", np.array([1, -1, rows.shape[1]], np.int64))
        self._add("Reshape", [scaled, shape], out)


_CONTRIB_KINDS = frozenset({"MatMulIntegerToFloat", "MatMulNBits"})


def in_blocks(rows: np.ndarray, block: int) -> tuple[np.ndarray, np.ndarray]:
    """Return rows as whole steps from -8 to 7, and the scale of each block of a row, of least squared error.

    Args:
        rows: (n, k); a last block that is not full is filled with zeros.
        block: numbers that share a scale.

    Returns:
        (n, blocks, block) int16, and (n, blocks) float32.
    """
    filled = np.pad(rows.astype(np.float32), ((0, 0), (0, -rows.shape[1] % block))).reshape(-1, block)
    steps, scale = np.empty(filled.shape, np.int16), np.empty(len(filled), np.float32)
    for start in range(0, len(filled), _AT_ONCE):  # a portion stays in the processor's cache
        stop = start + _AT_ONCE
        steps[start:stop], scale[start:stop] = _searched(filled[start:stop])
    return steps.reshape(len(rows), -1, block), scale.reshape(len(rows), -1)


def _searched(filled: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the steps (n, block) and the scale (n,) of each block."""
    at = np.abs(filled).argmax(axis=1)
    largest = filled[np.arange(len(filled)), at]  # with its sign: it may take the one step more that there is below
    best, least = np.ones(len(filled), np.float32), np.full(len(filled), np.inf, np.float32)
    for shrink in _SHRINKS:
        scale = largest * np.float32(shrink / -8.0)
        scale[scale == 0.0] = 1.0
        restored = np.clip(np.rint(filled / scale[:, None]), -8, 7) * scale[:, None] - filled
        error = np.einsum("ij,ij->i", restored, restored)
        better = error < least
        best[better], least[better] = scale[better], error[better]
    return np.clip(np.rint(filled / best[:, None]), -8, 7).astype(np.int16), best


def _block(width: int, wanted: int) -> int:
    """Return a block's size: a power of two that onnxruntime takes, no larger than the row."""
    while wanted > 16 and wanted > width:
        wanted //= 2
    return wanted


def _halve(graph: onnx.GraphProto) -> None:
    """Store large float arrays in half precision; a cast widens them when the file is loaded."""
    casts = []
    for row in list(graph.initializer):
        if row.data_type != onnx.TensorProto.FLOAT or int(np.prod(row.dims)) < _LARGE:
            continue
        values = numpy_helper.to_array(row)
        halves = values.astype(np.float16)
        if not np.allclose(halves, values, rtol=2e-3, atol=1e-4 * float(np.abs(values).max())):
            continue  # beyond what half precision holds
        graph.initializer.remove(row)
        graph.initializer.append(numpy_helper.from_array(halves, f"{row.name}_half"))
        casts.append(helper.make_node("Cast", [f"{row.name}_half"], [row.name], to=onnx.TensorProto.FLOAT))
    for node in reversed(casts):
        graph.node.insert(0, node)


def weights_of(path: Path) -> Iterator[tuple[str, tuple[int, ...]]]:
    """Yield the name and shape of each constant of a network."""
    for row in onnx.load(path).graph.initializer:
        yield row.name, tuple(row.dims)
