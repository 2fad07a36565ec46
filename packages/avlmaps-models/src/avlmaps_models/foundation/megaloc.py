"""Places by MegaLoc, one network for streets and rooms: DINOv2 patches, gathered by optimal transport.

Berton & Masone, "MegaLoc: one retrieval to place them all", 2025 (MIT), after SALAD (Izquierdo & Civera, "Optimal
transport aggregation for visual place recognition", 2024). Published code: gmberton/MegaLoc; weights: the hub's
``gberton/MegaLoc`` (``model.safetensors``, about 0.9 GB), and before ``megaloc.torch`` of the repository's release
v1.0, whose names have ``backbone.model.`` for ``backbone.`` and one weight more (DINOv2's mask token, which only its
training needs). Both are read; the computation is the same.

A picture is squashed to 322 x 322 pixels (bilinear, ImageNet's mean and deviation), as the paper tests it. DINOv2
ViT-B/14 makes 23 x 23 patches and a class token. Each patch gets a feature of 256 numbers and a score for each of 64
clusters; a 65th, the dustbin, takes patches that identify no place. Three rounds of Sinkhorn's algorithm make shares of
the scores, the clusters' sums are put behind the class token's 256 numbers, and a linear layer makes 8448 numbers.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float32, UInt8
from torch import nn
from torch.nn import functional

from avlmaps.core.errors import BackendError
from avlmaps.perception.models import public_name
from avlmaps.perception.protocols import LocalFeatures, ModelCard
from avlmaps_models.common.checksums import checksum_of, weights_in
from avlmaps_models.common.device import select_device, unit_rows
from avlmaps_models.common.files import model_folder
from avlmaps_models.common.precision import mixed_precision
from avlmaps_models.common.published import load_strictly, published_file, read_tensors
from avlmaps_models.foundation.dino_network import DinoNetwork, DinoSizes
from avlmaps_models.foundation.whole_pictures import imagenet_picture

RELEASED = "megaloc.torch"
_HUB_ID = "gberton/MegaLoc"
_GET = f"hf download {_HUB_ID}"
_SIDE = 322
_ROUNDS = 3
_RELEASED_PREFIX, _PREFIX = "backbone.model.", "backbone."
_NOT_NEEDED = ("backbone.mask_token",)
_FILES = (".torch", ".pth", ".pt", ".safetensors")


class MegaLoc:
    """Describes whole pictures by 8448 numbers.

    Args:
        model: the hub's id, a folder with ``model.safetensors``, or a file of either layout (``megaloc.torch``).
        side: pixels that the picture's sides are squashed to, a multiple of 14.

    Raises:
        BackendError: it is not here, damaged, or another model.
    """

    def __init__(self, model: str = _HUB_ID, side: int = _SIDE) -> None:
        path = _found(model)
        state = _current_names(read_tensors(path, _GET))
        network = MegaLocNetwork(_sizes_of(state, path), _aggregation_of(state, path))
        load_strictly(network, state, path, _GET)
        self._device, self._side = select_device(), side
        self._network = network.eval().requires_grad_(False).to(self._device)
        self.card = ModelCard(
            id=public_name(model),
            dim=network.aggregator.linear.out_features,
            licence="MIT",
            checksum=checksum_of([path], f"squashed to {side}", "bilinear", "ImageNet"),
        )

    def fit(self, local: Sequence[LocalFeatures], rng: np.random.Generator) -> dict[str, np.ndarray]:
        """Return nothing: it has learnt what it needs."""
        return {}

    def encode(
        self, rgb: UInt8[np.ndarray, "h w 3"], local: LocalFeatures, state: dict[str, np.ndarray]
    ) -> Float32[np.ndarray, " d"]:
        """Return a unit vector for any picture; its keypoints are not looked at."""
        picture = imagenet_picture(rgb, (self._side, self._side), self._device)
        with mixed_precision(self._device):
            tokens = self._network.backbone(picture)
        with torch.inference_mode():
            return unit_rows(self._network.aggregator(tokens.to(torch.float32)))[0]


@dataclass(frozen=True, slots=True)
class AggregationSizes:
    """How large the part behind the backbone is.

    Attributes:
        clusters: that patches are shared among.
        cluster_dim: numbers that a patch brings to its cluster.
        token_dim: numbers from the class token.
        hidden: width of the small networks.
        dim: of the descriptor.
    """

    clusters: int = 64
    cluster_dim: int = 256
    token_dim: int = 256
    hidden: int = 512
    dim: int = 8448


class MegaLocNetwork(nn.Module):
    """The network under its published names: ``backbone`` and ``aggregator``."""

    def __init__(self, backbone: DinoSizes, aggregation: AggregationSizes) -> None:
        super().__init__()
        self.backbone = DinoNetwork(backbone)
        self.aggregator = Aggregator(backbone.width, aggregation)

    def forward(self, pictures: torch.Tensor) -> torch.Tensor:
        """Return (n, dim) of unit length."""
        return functional.normalize(self.aggregator(self.backbone(pictures)), dim=1)


class Aggregator(nn.Module):
    """Tokens to one descriptor, not yet of unit length."""

    def __init__(self, width: int, sizes: AggregationSizes) -> None:
        super().__init__()
        self.agg = Salad(width, sizes)
        self.linear = nn.Linear(sizes.token_dim + sizes.clusters * sizes.cluster_dim, sizes.dim)

    def forward(self, tokens: torch.Tensor) -> torch.Tensor:
        """Return (n, dim) of (n, 1 + patches, width)."""
        return self.linear(self.agg(tokens))


class Salad(nn.Module):
    """Gathers patches in clusters, each patch shared among them by optimal transport."""

    def __init__(self, width: int, sizes: AggregationSizes) -> None:
        super().__init__()
        hidden, nothing = sizes.hidden, nn.Identity  # where training drops some of the numbers
        self.token_features = nn.Sequential(nn.Linear(width, hidden), nn.ReLU(), nn.Linear(hidden, sizes.token_dim))
        self.cluster_features = nn.Sequential(
            nn.Conv2d(width, hidden, 1), nothing(), nn.ReLU(), nn.Conv2d(hidden, sizes.cluster_dim, 1)
        )
        self.score = nn.Sequential(
            nn.Conv2d(width, hidden, 1), nothing(), nn.ReLU(), nn.Conv2d(hidden, sizes.clusters, 1)
        )
        self.dust_bin = nn.Parameter(torch.tensor(1.0))

    def forward(self, tokens: torch.Tensor) -> torch.Tensor:
        """Return (n, token_dim + cluster_dim·clusters) of unit length from (n, 1 + patches, width)."""
        patches = tokens[:, 1:].transpose(1, 2)[..., None]
        feature = self.cluster_features(patches)[..., 0]
        share = shares(self.score(patches)[..., 0], self.dust_bin)
        gathered = functional.normalize(torch.einsum("ndp,ncp->ndc", feature, share), dim=1).flatten(1)
        token = functional.normalize(self.token_features(tokens[:, 0]), dim=-1)
        return functional.normalize(torch.cat([token, gathered], dim=-1), dim=-1)


def shares(score: torch.Tensor, dustbin: torch.Tensor, rounds: int = _ROUNDS) -> torch.Tensor:
    """Return how much of each patch goes to each cluster (n, clusters, patches), by Sinkhorn's algorithm.

    Every patch has the same to give; each cluster takes as much as one patch gives, the dustbin what is left. Rows and
    columns are brought to those sums in turn, the columns (patches) last.

    Args:
        score: (n, clusters, patches); more patches than clusters.
        dustbin: score of the dustbin, for any patch.
        rounds: how often.
    """
    n, clusters, patches = score.shape
    cost = torch.cat([score, dustbin.expand(n, 1, patches)], dim=1)
    even = -math.log(clusters + patches)
    takes = cost.new_full((n, clusters + 1), even)
    takes[:, -1] += math.log(patches - clusters)
    gives = cost.new_full((n, patches), even)
    of_row, of_column = torch.zeros_like(takes), torch.zeros_like(gives)
    for _ in range(rounds):
        of_row = takes - torch.logsumexp(cost + of_column[:, None], dim=2)
        of_column = gives - torch.logsumexp(cost + of_row[:, :, None], dim=1)
    return torch.exp(cost + of_row[:, :, None] + of_column[:, None] - even)[:, :-1]


def _found(model: str) -> Path:
    """Return the file of weights."""
    if model.endswith(_FILES):
        return published_file(model, _GET, cached=(f"checkpoints/{Path(model).name}",))
    try:
        folder = model_folder(model)
    except BackendError:
        if model != _HUB_ID:
            raise
        try:  # the released file, where torch.hub of other programs has left it or a person has put it
            return published_file(RELEASED, _GET, cached=(f"checkpoints/{RELEASED}",))
        except BackendError:
            pass
        raise
    for path in (*weights_in(folder), *sorted(folder.glob("*.torch"))):
        return path
    raise BackendError(f"{folder} has no file of weights (model.safetensors, {RELEASED}); get it with: {_GET}")


def _current_names(state: Mapping[str, torch.Tensor]) -> dict[str, torch.Tensor]:
    """Return weights under the names of the newer file, without those that only training needs."""
    renamed = {
        _PREFIX + key.removeprefix(_RELEASED_PREFIX) if key.startswith(_RELEASED_PREFIX) else key: value
        for key, value in state.items()
    }
    return {key: value for key, value in renamed.items() if key not in _NOT_NEEDED}


def _sizes_of(state: Mapping[str, torch.Tensor], path: Path) -> DinoSizes:
    try:
        return DinoSizes.of(state, _PREFIX)
    except (KeyError, ValueError) as fault:
        raise _another(path, fault) from fault


def _aggregation_of(state: Mapping[str, torch.Tensor], path: Path) -> AggregationSizes:
    def rows(name: str) -> int:
        return state[f"aggregator.{name}.weight"].shape[0]

    try:
        features, score, token = "agg.cluster_features", "agg.score.3", "agg.token_features.2"
        return AggregationSizes(rows(score), rows(f"{features}.3"), rows(token), rows(f"{features}.0"), rows("linear"))
    except KeyError as fault:
        raise _another(path, fault) from fault


def _another(path: Path, fault: Exception) -> BackendError:
    return BackendError(f"{path} is not MegaLoc's checkpoint (it lacks {fault}); get it with: {_GET}")
