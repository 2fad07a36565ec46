"""The weights that ship, as networks that learn further: `export` backwards."""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import onnx
import torch
from onnx import numpy_helper
from training.language.network import Network, Size

from avlmaps.language.learned.linear import SYMBOLS


def unfolded(folder: Path) -> tuple[list[Network], dict[str, int]]:
    """Return the networks of a folder that `export.write` wrote, and their vocabulary.

    Raises:
        ValueError: a weight of another shape, or none, is found.
    """
    facts = json.loads((folder / "reader.json").read_text(encoding="utf-8"))
    told, arrays = facts["vocabulary"], {**_arrays(folder / "words.onnx"), **_arrays(folder / "step.onnx")}
    for name in [one for one in arrays if one.startswith("decoders.") and ".symbol" in one]:
        arrays[name] = _of_symbols(arrays[name], facts["symbols"])
    count = len({name.split(".")[1] for name in arrays})
    networks = [_network(arrays, number, Size(len(told))) for number in range(count)]
    return networks, {word: at for at, word in enumerate(told, start=1)}


def _of_symbols(rows: np.ndarray, known: Sequence[str]) -> np.ndarray:
    """Return the rows of today's symbols: one that the weights did not know begins as the mean of the questions."""
    asks = rows[[at for at, symbol in enumerate(known) if symbol.startswith("ask_")]].mean(0)
    return np.stack([rows[known.index(symbol)] if symbol in known else asks for symbol in SYMBOLS])


def _network(arrays: dict[str, np.ndarray], number: int, size: Size) -> Network:
    network = Network(size)
    parts = {"encoder.": "encoders", "decoder.": "decoders", "decoder.start.": "starts"}
    for name, value in network.state_dict().items():
        part = max((each for each in parts if name.startswith(each)), key=len)
        stored = f"{parts[part]}.{number}.{name.removeprefix(part)}"
        array = arrays.get(stored)
        if array is None or array.shape != tuple(value.shape):
            raise ValueError(f"The weights hold no {stored} of {tuple(value.shape)}; they are of another network.")
        value.copy_(torch.from_numpy(array.copy()))
    return network


def _arrays(path: Path) -> dict[str, np.ndarray]:
    """Return the weights of a graph by the names that they had in their modules."""
    graph = onnx.load(path).graph
    arrays = {
        each.name.removesuffix("_half"): numpy_helper.to_array(each).astype(np.float32) for each in graph.initializer
    }
    found = {name: array for name, array in arrays.items() if not name.startswith("onnx::")}
    for node in graph.node:
        module, _, kind = node.name.strip("/").replace("/", ".").rpartition(".")
        if kind == "GRU":
            _gru(module, [arrays[name] for name in node.input[1:4]], found)
        elif kind.startswith("MatMul") and node.input[1] in arrays:
            found[f"{module}.weight"] = arrays[node.input[1]].T
    return found


def _gru(module: str, weights: list[np.ndarray], found: dict[str, np.ndarray]) -> None:
    """Take a recurrent layer apart: its gates stand in another order, and both directions in one array."""
    inside, before, bias = weights
    biases = np.split(bias, 2, axis=1)
    for name, each in zip(("weight_ih", "weight_hh", "bias_ih", "bias_hh"), (inside, before, *biases), strict=True):
        for direction, array in enumerate(each):
            update, reset, new = np.split(array, 3)
            found[f"{module}.{name}_l0{'_reverse' if direction else ''}"] = np.concatenate([reset, update, new])
