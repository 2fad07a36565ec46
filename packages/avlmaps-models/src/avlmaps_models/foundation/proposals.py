"""Regions of a picture by SAM 2, prompted at a grid of points (Apache-2.0).

Any of ``facebook/sam2.1-hiera-{tiny,small,base-plus,large}`` (and of ``sam2-hiera-*``), as transformers runs them
(``Sam2Model``; the hub's files hold the video model, whose memory is left out). Thresholds are those of SAM 2's own
automatic mask generator. The mask generation pipeline of transformers is not used: it places the grid as for a picture
padded to a square, while SAM 2 stretches it to one, so that the lower part of a wide picture is never prompted.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from jaxtyping import Bool, Float, Float32, Int, UInt8

from avlmaps.perception.models import public_name
from avlmaps_models.common.checksums import checksum_of, weights_in
from avlmaps_models.common.device import select_device, to_numpy
from avlmaps_models.common.precision import mixed_precision
from avlmaps_models.common.pretrained import load_pretrained, pretrained_folder
from avlmaps_models.foundation.pictures import Size, stack_pictures

_MEAN, _DEVIATION = (0.485, 0.456, 0.406), (0.229, 0.224, 0.225)
_POINTS_AT_ONCE = 64


@dataclass(frozen=True, slots=True)
class ProposalSettings:
    """Which regions count.

    Attributes:
        points_per_side: of the grid of prompts; SAM 2's own generator takes 32, at four times the cost.
        least_quality: the overlap with a true region that SAM 2 expects of its mask.
        least_stability: overlap of the masks that follow from a stricter and a laxer threshold.
        stability_offset: how much stricter and laxer, in logits.
        same_box_overlap: of two regions whose boxes overlap more, the worse one goes.
        least_area: part of the picture that a region covers.
    """

    points_per_side: int = 16
    least_quality: float = 0.8
    least_stability: float = 0.95
    stability_offset: float = 1.0
    same_box_overlap: float = 0.7
    least_area: float = 0.0005


@dataclass(frozen=True, slots=True)
class Proposals:
    """Regions of a picture, the largest first.

    Attributes:
        mask: on a grid that covers the picture evenly.
        box: x0, y0, x1, y1 in [0, 1]: parts of the picture's width and height.
        area: part of the picture that each covers.
    """

    mask: Bool[np.ndarray, "n h w"]
    box: Float32[np.ndarray, "n 4"]
    area: Float32[np.ndarray, " n"]


class Sam2Proposals:
    """Finds regions.

    Args:
        model: hub id or folder.
        settings: which regions count.

    Raises:
        BackendError: the model is not here, or another one.
    """

    def __init__(self, model: str = "facebook/sam2.1-hiera-tiny", settings: ProposalSettings | None = None) -> None:
        from transformers import Sam2Model

        self._settings = settings or ProposalSettings()
        folder = pretrained_folder(model)
        self._device = select_device()
        self._model: Any = load_pretrained(Sam2Model, folder, model, self._device, torch.float32)
        self._side = int(self._model.config.prompt_encoder_config.image_size)
        self.name = public_name(model)
        self.checksum = checksum_of(weights_in(folder), repr(self._settings))
        self._mean = torch.tensor(_MEAN, device=self._device)[:, None, None]
        self._deviation = torch.tensor(_DEVIATION, device=self._device)[:, None, None]

    def find(self, rgb: UInt8[np.ndarray, "h w 3"], grid: Size) -> Proposals:
        """Return the regions of a picture.

        Args:
            rgb: the picture.
            grid: rows and columns of the masks.
        """
        with mixed_precision(self._device):
            picture = stack_pictures([rgb], (self._side, self._side), self._device, torch.float32, "bilinear")
            seen = self._model.get_image_embeddings((picture - self._mean) / self._deviation)
            points = _grid_of_points(self._settings.points_per_side, self._device) * self._side
            found = [self._at(seen, some) for some in points.split(_POINTS_AT_ONCE)]
        logits, quality = (torch.cat(parts) for parts in zip(*found, strict=True))
        box, area = _extents(logits > 0.0)
        best = apart(to_numpy(box), to_numpy(quality), self._settings.same_box_overlap)
        best = best[np.argsort(-to_numpy(area)[best], kind="stable")]
        rows = torch.from_numpy(best).to(self._device)
        mask = torch.zeros((0, 1, *grid), device=self._device)
        if len(best):
            mask = torch.nn.functional.interpolate(logits[rows][:, None], size=grid, mode="bilinear")
        return Proposals(to_numpy(mask)[:, 0] > 0.0, to_numpy(box[rows]), to_numpy(area[rows]))

    def _at(self, seen: list[torch.Tensor], points: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Return the masks (k, h, w), as logits, that are good enough at some points, and how good each is."""
        settings = self._settings
        output = self._model(
            image_embeddings=list(seen),
            input_points=points[None, :, None],
            input_labels=torch.ones((1, len(points), 1), dtype=torch.int64, device=points.device),
            multimask_output=True,
        )
        logits, quality = output.pred_masks[0].flatten(0, 1).float(), output.iou_scores[0].flatten().float()
        sure = (logits > settings.stability_offset).sum(dim=(1, 2))
        perhaps = (logits > -settings.stability_offset).sum(dim=(1, 2))
        covered = (logits > 0.0).float().mean(dim=(1, 2))
        good = (quality > settings.least_quality) & (covered >= settings.least_area)
        good &= sure > settings.least_stability * perhaps
        return logits[good], quality[good]


def apart(
    box: Float[np.ndarray, "n 4"], quality: Float[np.ndarray, " n"], same_overlap: float
) -> Int[np.ndarray, " k"]:
    """Return which boxes stay, the best first, when each one takes away all worse ones that overlap it too much.

    Args:
        box: x0, y0, x1, y1.
        quality: the higher, the better.
        same_overlap: intersection over union above which the worse one goes.
    """
    left = np.argsort(-quality, kind="stable")
    size = (box[:, 2] - box[:, 0]) * (box[:, 3] - box[:, 1])
    kept: list[int] = []
    while len(left):
        best, rest = int(left[0]), left[1:]
        kept.append(best)
        width = np.minimum(box[best, 2], box[rest, 2]) - np.maximum(box[best, 0], box[rest, 0])
        height = np.minimum(box[best, 3], box[rest, 3]) - np.maximum(box[best, 1], box[rest, 1])
        common = np.maximum(width, 0.0) * np.maximum(height, 0.0)
        left = rest[common <= same_overlap * (size[best] + size[rest] - common)]
    return np.array(kept, np.int64)


def _grid_of_points(per_side: int, device: torch.device) -> torch.Tensor:
    """Return x and y (n, 2) in (0, 1) of the middles of equal cells."""
    place = (torch.arange(per_side, device=device) + 0.5) / per_side
    y, x = torch.meshgrid(place, place, indexing="ij")
    return torch.stack([x.flatten(), y.flatten()], dim=1)


def _extents(mask: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    """Return the boxes (n, 4) in [0, 1] of masks (n, h, w) that are not empty, and the part that each covers."""
    height, width = mask.shape[1:]

    def span(used: torch.Tensor, size: int) -> tuple[torch.Tensor, torch.Tensor]:
        first = used.float().argmax(dim=1)
        last = size - used.flip(1).float().argmax(dim=1)
        return first / size, last / size

    (x0, x1), (y0, y1) = span(mask.any(dim=1), width), span(mask.any(dim=2), height)
    return torch.stack([x0, y0, x1, y1], dim=1), mask.float().mean(dim=(1, 2))
