"""The published file of NetVLAD: MatConvNet's network as a struct of a ``.mat``, read into named tensors."""

import hashlib
from pathlib import Path
from typing import Any

import numpy as np
import torch

from avlmaps.core.errors import BackendError

Weights = dict[str, torch.Tensor]

# Where the layers with weights are in ``net.layers``; those between them are ReLU, pooling and normalisation.
CONVOLUTIONS = (0, 2, 5, 7, 10, 12, 14, 17, 19, 21, 24, 26, 28)
VLAD, WHITENING = 30, 33


def read_mat(path: Path, how_to_get: str) -> Weights:
    """Return the weights of the published file, float32, by the names of ``NetVladNetwork``.

    Raises:
        BackendError: it cannot be read, or lacks a layer, or has weights in a layer where none are expected.
    """
    from scipy.io import loadmat

    try:
        net = loadmat(path, struct_as_record=False, squeeze_me=True)["net"]
    except Exception as fault:
        reason = " ".join(str(fault).split())[:120]
        raise BackendError(
            f"{path} cannot be read as MatConvNet's network ({type(fault).__name__}: {reason}); get the published file "
            f"with: {how_to_get}"
        ) from fault
    try:
        layers = list(np.atleast_1d(net.layers))
        return {**_convolutions(layers), **_vlad(layers), **_whitening(layers), "mean": _mean(net)}
    except (AttributeError, IndexError, TypeError, ValueError) as fault:
        raise BackendError(
            f"{path} does not hold the layers of VGG16 and NetVLAD ({fault}); get the published file with: {how_to_get}"
        ) from fault


def checksum_of_weights(weights: Weights) -> str:
    """Return the hex SHA-256 of the weights themselves, the same for each form of the file."""
    found = hashlib.sha256(b"netvlad full size")
    for name in sorted(weights):
        tensor = weights[name].contiguous()
        found.update(f"{name} {tuple(tensor.shape)}".encode())
        found.update(tensor.numpy().reshape(-1).view(np.uint8).data)
    return found.hexdigest()


def _convolutions(layers: list[Any]) -> Weights:
    weights: Weights = {}
    for number, layer in enumerate(layers[: CONVOLUTIONS[-1] + 1]):
        if (number in CONVOLUTIONS) != bool(_weights(layer)):
            raise ValueError(f"layer {number} has {'no weights' if number in CONVOLUTIONS else 'weights'}")
    for number in CONVOLUTIONS:
        kernel, bias = _weights(layers[number])  # height, width, input, output
        weights[f"backbone.{number}.weight"] = _tensor(np.asarray(kernel).transpose(3, 2, 0, 1))
        weights[f"backbone.{number}.bias"] = _tensor(np.asarray(bias).reshape(-1))
    return weights


def _vlad(layers: list[Any]) -> Weights:
    assignment, centres = _weights(layers[VLAD])  # both (512, clusters); the file stores the negative centres
    return {"assign.weight": _tensor(np.asarray(assignment).T[:, :, None]), "centres": _tensor(-np.asarray(centres))}


def _whitening(layers: list[Any]) -> Weights:
    kernel, bias = _weights(layers[WHITENING])
    bias = np.asarray(bias).reshape(-1)
    return {
        "whiten.weight": _tensor(np.asarray(kernel).reshape(-1, len(bias)).T),
        "whiten.bias": _tensor(bias),
    }


def _mean(net: Any) -> torch.Tensor:
    """Return the mean colour; the published file repeats it for each pixel of a picture."""
    return _tensor(np.asarray(net.meta.normalization.averageImage).reshape(-1, 3)[0])


def _weights(layer: Any) -> tuple[Any, ...]:
    """Return a layer's arrays: a pair, or nothing."""
    held = getattr(layer, "weights", None)
    return tuple(held) if held is not None and np.size(held) else ()


def _tensor(array: np.ndarray) -> torch.Tensor:
    return torch.from_numpy(np.ascontiguousarray(array, np.float32))
