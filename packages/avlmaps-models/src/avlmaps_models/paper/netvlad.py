"""NetVLAD (Arandjelović and others 2016): the descriptor of places that the paper retrieves by.

Published as ``VGG16-NetVLAD-Pitts30K.mat`` (and ``...-TokyoTM.mat``): MatConvNet's network as a plain struct, as hloc
reads it; research use. Written here after the published layers: the picture at its full size, 0 to 255, less the mean
colour; VGG16 up to conv5_3 without its ReLU; each place's 512 numbers to unit length; soft assignment to 64 clusters;
the residuals of each cluster to unit length, then all of them; whitening to 4096 numbers; unit length. It looks at the
pixels alone and learns nothing on a map.

``convert_netvlad`` writes the same weights as a ``.safetensors`` file, which opens faster; features are the same to
the bit, and a map made with the one can be queried with the other.
"""

from itertools import pairwise
from pathlib import Path
from typing import Any, TypeGuard, cast

import cv2
import numpy as np
import torch
from jaxtyping import Float32, UInt8
from torch import nn
from torch.nn import functional

from avlmaps.core.errors import BackendError
from avlmaps.perception.protocols import LocalFeatures, ModelCard
from avlmaps_models.common.device import inference, select_device, unit_rows
from avlmaps_models.common.published import load_strictly, published_file, read_tensors
from avlmaps_models.paper.netvlad_file import CONVOLUTIONS, Weights, checksum_of_weights, read_mat

PUBLISHED = "https://cvg-data.inf.ethz.ch/hloc/netvlad"
_POOLED_AFTER = (1, 3, 6, 9)  # convolutions of VGG16 that a max-pooling follows
_SMALLEST_PX = 2 ** len(_POOLED_AFTER)


class NetVlad:
    """Describes places by NetVLAD.

    Args:
        model: ``VGG16-NetVLAD-Pitts30K.mat``, the name of a converted ``.safetensors``, or a path to one of them. Where
            the ``.mat`` is not here but its converted form is, that is taken.

    Raises:
        BackendError: the file is not here, or is not NetVLAD's.
    """

    def __init__(self, model: str = "VGG16-NetVLAD-Pitts30K.mat") -> None:
        path, get = _found(model)
        weights = read_mat(path, get) if path.suffix == ".mat" else cast(Weights, read_tensors(path, get))
        network = _network(weights, path, get)
        self._device = select_device()
        self._network = network.eval().to(self._device)
        self.card = ModelCard(
            id=f"netvlad/{path.stem}",
            dim=network.whiten.out_features,
            licence="LicenseRef-NetVLAD-research",
            checksum=checksum_of_weights(weights),
            note="research use; slow on a CPU for large pictures, which it sees at their full size",
        )

    def fit(self, local: object, rng: np.random.Generator) -> dict[str, np.ndarray]:
        """Learn nothing: the clusters are published with the weights."""
        return {}

    def encode(
        self, rgb: UInt8[np.ndarray, "h w 3"], local: LocalFeatures, state: dict[str, np.ndarray]
    ) -> Float32[np.ndarray, " d"]:
        """Return the unit vector of a picture; its keypoints are not looked at."""
        height, width = rgb.shape[:2]
        if min(height, width) < _SMALLEST_PX:  # too small for one number to come out of the poolings
            size = max(width, _SMALLEST_PX), max(height, _SMALLEST_PX)
            rgb = cv2.resize(rgb, size, interpolation=cv2.INTER_LINEAR)  # pyright: ignore[reportAssignmentType]
        picture = torch.from_numpy(np.ascontiguousarray(rgb.transpose(2, 0, 1)))[None].to(self._device)
        with inference():  # in float32 always: its activations come near the largest float16
            return unit_rows(self._network(picture.float()))[0]


class NetVladNetwork(nn.Module):
    """The published layers; ``forward`` takes (b, 3, h, w) colours from 0 to 255 and returns (b, d) unit vectors.

    Args:
        channels: inputs of the first convolution, then the outputs of each.
        clusters: visual words.
        dim: numbers after whitening.
    """

    mean: torch.Tensor

    def __init__(self, channels: list[int], clusters: int, dim: int) -> None:
        super().__init__()
        layers: list[nn.Module] = []
        for number, (before, after) in enumerate(pairwise(channels)):
            layers.append(nn.Conv2d(before, after, kernel_size=3, padding=1))
            if number < len(channels) - 2:
                layers.append(nn.ReLU(inplace=True))
            if number in _POOLED_AFTER:
                layers.append(nn.MaxPool2d(2))
        self.backbone = nn.Sequential(*layers)
        self.assign = nn.Conv1d(channels[-1], clusters, kernel_size=1, bias=False)
        self.centres = nn.Parameter(torch.empty(channels[-1], clusters))
        self.whiten = nn.Linear(channels[-1] * clusters, dim)
        self.register_buffer("mean", torch.empty(3))

    def forward(self, colours: torch.Tensor) -> torch.Tensor:
        """See the class."""
        features = self.backbone(colours - self.mean[:, None, None]).flatten(start_dim=2)
        features = functional.normalize(features, dim=1)
        share = functional.softmax(self.assign(features), dim=1)
        # Σ share·(feature - centre), without a number for each pair of place and cluster
        residuals = features @ share.transpose(1, 2) - self.centres * share.sum(dim=2)[:, None, :]
        residuals = functional.normalize(residuals, dim=1)
        described = functional.normalize(residuals.flatten(start_dim=1), dim=1)
        return functional.normalize(self.whiten(described), dim=1)


def convert_netvlad(mat: Path, out: Path) -> None:
    """Write the published ``.mat`` as ``.safetensors``, float32, by the names of ``NetVladNetwork``.

    Raises:
        BackendError: it is not NetVLAD's file.
    """
    from safetensors.torch import save_file

    get = _how_to_get(mat.name)
    weights = read_mat(mat, get)
    _network(weights, mat, get)
    out.parent.mkdir(parents=True, exist_ok=True)
    save_file({name: tensor.contiguous() for name, tensor in weights.items()}, out)


def _network(weights: Weights, path: Path, get: str) -> NetVladNetwork:
    """Return the network in the sizes of the weights, filled with them."""
    kernels = [weights.get(f"backbone.{number}.weight") for number in CONVOLUTIONS]
    centres, whitening = weights.get("centres"), weights.get("whiten.weight")
    if centres is None or whitening is None or not _all_kernels(kernels):
        raise BackendError(f"{path} does not hold NetVLAD's layers; get the published file with: {get}")
    channels = [kernels[0].shape[1], *(kernel.shape[0] for kernel in kernels)]
    with torch.device("meta"):
        network = NetVladNetwork(channels, centres.shape[-1], whitening.shape[0])
    network.to_empty(device="cpu")
    load_strictly(network, cast("dict[str, Any]", weights), path, get)
    return network


def _all_kernels(kernels: list[torch.Tensor | None]) -> TypeGuard[list[torch.Tensor]]:
    return all(kernel is not None and kernel.ndim == 4 for kernel in kernels)


def _found(model: str) -> tuple[Path, str]:
    get = _how_to_get(Path(model).name)
    try:
        return published_file(model, get, cached=[f"netvlad/{Path(model).name}"]), get
    except BackendError:
        if Path(model).suffix != ".mat":
            raise
        try:
            return published_file(str(Path(model).with_suffix(".safetensors")), get), get
        except BackendError:
            pass
        raise


def _how_to_get(name: str) -> str:
    stem = Path(name).stem
    return f"curl -L -o {stem}.mat {PUBLISHED}/{stem.removeprefix('VGG16-NetVLAD-')}_struct.mat"
