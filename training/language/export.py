"""Write networks as two ONNX graphs, words and next symbol, weights in half precision."""

import json
import math
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import torch
from onnx import TensorProto, helper, numpy_helper
from torch import Tensor, nn
from training.language.network import Network

from avlmaps.language.learned.english import WIDTH
from avlmaps.language.learned.features import MOST_PIECES, columns
from avlmaps.language.learned.linear import SYMBOLS
from avlmaps.perception.embedded.words import words_checksum

OPSET = 17


class _Step(nn.Module):
    """One step of several decoders for some lines at once; their probabilities are averaged."""

    def __init__(self, networks: Sequence[Network]) -> None:
        super().__init__()
        self.decoders = nn.ModuleList(network.decoder for network in networks)

    def forward(self, last: Tensor, states: Tensor, first: Tensor, second: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        count = len(self.decoders)
        wide = states.expand(last.shape[0], -1, -1)
        mask = torch.ones_like(wide[..., 0])
        said, firsts, seconds = zip(
            *(
                decoder(last, its, mask, (one, two))
                for decoder, its, one, two in zip(
                    self.decoders, wide.chunk(count, -1), first.chunk(count, -1), second.chunk(count, -1), strict=True
                )
            ),
            strict=True,
        )
        mean = torch.logsumexp(torch.stack(said), 0) - math.log(count)
        return mean[:, 0], torch.cat(firsts, -1), torch.cat(seconds, -1)


class _Begin(nn.Module):
    """The states of the words, and the first states of the decoders, side by side."""

    def __init__(self, networks: Sequence[Network]) -> None:
        super().__init__()
        self.encoders = nn.ModuleList(network.encoder for network in networks)
        self.starts = nn.ModuleList(network.decoder.start for network in networks)

    def forward(
        self, meaning: Tensor, words: Tensor, pieces: Tensor, marks: Tensor, context: Tensor
    ) -> tuple[Tensor, Tensor]:
        states = [encoder(meaning, words, pieces, marks, context) for encoder in self.encoders]
        begins = [torch.tanh(start(one.mean(1)))[None] for start, one in zip(self.starts, states, strict=True)]
        return torch.cat(states, -1), torch.cat(begins, -1)


def write(networks: Sequence[Network], vocabulary: dict[str, int], folder: Path, facts: dict[str, Any]) -> None:
    """Write ``words.onnx``, ``step.onnx`` and ``reader.json``: networks of one size that read together."""
    folder.mkdir(parents=True, exist_ok=True)
    size = networks[0].size
    wide, deep = 2 * size.state * len(networks), size.decoder * len(networks)
    n = 7
    inputs = (torch.zeros(1, n, 128), torch.zeros(1, n, dtype=torch.long),
              torch.zeros(1, n, MOST_PIECES, dtype=torch.long), torch.zeros(1, n, len(columns())),
              torch.zeros(1, n, WIDTH))  # fmt: skip
    names = ["meaning", "words", "pieces", "marks", "context"]
    _graph(_Begin(networks), inputs, folder / "words.onnx", names, ["states", "begin"],
           {name: {1: "n"} for name in (*names, "states")})  # fmt: skip
    step = (
        torch.zeros(3, 1, dtype=torch.long),
        torch.zeros(1, n, wide),
        torch.zeros(1, 3, deep),
        torch.zeros(1, 3, deep),
    )
    _graph(_Step(networks), step, folder / "step.onnx", ["last", "states", "first", "second"],
           ["said", "first_out", "second_out"],
           {"last": {0: "b"}, "states": {1: "n"}, "first": {1: "b"}, "second": {1: "b"}, "said": {0: "b", 1: "k"},
            "first_out": {1: "b"}, "second_out": {1: "b"}})  # fmt: skip
    told = {**facts, "symbols": list(SYMBOLS), "columns": list(columns()), "word_table": words_checksum(),
            "vocabulary": list(vocabulary)}  # fmt: skip
    (folder / "reader.json").write_text(json.dumps(told, ensure_ascii=False, indent=0) + "\n", encoding="utf-8")


def _graph(
    module: nn.Module, inputs: tuple[Tensor, ...], path: Path, names: list[str], out: list[str], axes: Any
) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        torch.onnx.export(module.eval(), inputs, str(path), input_names=names, output_names=out, dynamic_axes=axes,
                          opset_version=OPSET, dynamo=False)  # fmt: skip
    model = onnx.load(str(path))
    _halve(model.graph)
    model.producer_name, model.doc_string = "avlmaps", ""
    onnx.save(model, str(path))


def _halve(graph: onnx.GraphProto) -> None:
    """Store large weights in half precision; they are widened when the file is loaded."""
    casts = []
    for weight in list(graph.initializer):
        values = numpy_helper.to_array(weight)
        if values.dtype != np.float32 or values.size < 512:
            continue
        graph.initializer.remove(weight)
        graph.initializer.append(numpy_helper.from_array(values.astype(np.float16), f"{weight.name}_half"))
        casts.append(helper.make_node("Cast", [f"{weight.name}_half"], [weight.name], to=TensorProto.FLOAT))
    nodes = [*casts, *graph.node]
    del graph.node[:]
    graph.node.extend(nodes)
