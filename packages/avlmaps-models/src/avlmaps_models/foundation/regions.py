"""Features of regions: what CLIP says of each region's cut-out, mixed with what it says of the whole picture.

ConceptFusion's idea (Jatavallabhula et al., RSS 2023; published code: concept-fusion/concept-fusion): a proposer that
knows no classes finds regions (``facebook/sam2.1-hiera-tiny`` by default); CLIP sees each region's box and the whole
picture (``openai/clip-vit-base-patch16``, 512 numbers a feature; patch32, large-patch14 and -336 as well). With f_i of
region i and f of the whole, all of unit length,

    w = softmax over i of <f_i, f> + (1/R) sum over j != i of <f_i, f_j>        (the paper's equations, temperature 1)
    feature of region i = w_i f + (1 - w_i) f_i, scaled to unit length

so that a region that is like the whole and like the others takes more of the whole. It is written to the region's
cells, larger regions first, so that a cup has its own feature on its table. Cells of no region have none.

CLIP is never retrained, so that rare things keep their names; but it is slow: one look of SAM 2 and one of CLIP for
each of some fifty regions a frame. Another pair of models is chosen by ``CLIP+SAM``.
"""

import numpy as np
import torch
from jaxtyping import Float32, UInt8

from avlmaps.perception.protocols import ModelCard
from avlmaps_models.common.device import inference, select_batch, to_numpy, unit_rows
from avlmaps_models.common.picture_sizes import working_size
from avlmaps_models.common.prompts import CLIP_PROMPTS
from avlmaps_models.foundation.clip_tower import ClipTower
from avlmaps_models.foundation.open_pixels import OpenPixels
from avlmaps_models.foundation.proposals import Proposals, ProposalSettings, Sam2Proposals

_PROPOSER = "facebook/sam2.1-hiera-tiny"
_CUTOUTS_ON_GPU = 64
_CUTOUTS_ON_CPU = 8


class RegionPixels(OpenPixels):
    """A feature for every cell of a grid, the same for all cells of a region.

    Args:
        model: hub id or folder of CLIP, behind ``+`` that of the proposer.
        short_side: cells along the shorter side of the grid.
        settings: which regions count.
    """

    def __init__(
        self,
        model: str = "openai/clip-vit-base-patch16",
        short_side: int = 96,
        settings: ProposalSettings | None = None,
    ) -> None:
        clip, _, proposer = model.partition("+")
        self._clip = ClipTower(clip)
        self._proposer = Sam2Proposals(proposer or _PROPOSER, settings)
        self._short_side = short_side
        same = self._clip.licence == "Apache-2.0"
        card = ModelCard(
            id=f"{self._clip.name}+{self._proposer.name}",
            dim=self._clip.dim,
            licence=self._clip.licence if same else f"{self._clip.licence} AND Apache-2.0",
            checksum=self._clip.checksum(self._proposer.checksum, f"regions {short_side}", *CLIP_PROMPTS),
            prompts=CLIP_PROMPTS,
            note="a pixel in no region (some walls and floors) has no feature; slow: a GPU is needed in practice",
        )
        super().__init__(card, self._clip.words, self._clip.logit_scale)

    @property
    def batch(self) -> int:
        """How many frames it likes to be given at once: a frame's regions fill a batch by themselves."""
        return 1

    def _encode_pictures(self, pictures: list[UInt8[np.ndarray, "h w 3"]]) -> Float32[np.ndarray, "b hf wf d"]:
        """Return a unit vector for each cell of a region, zero elsewhere."""
        height, width = pictures[0].shape[:2]
        grid = working_size(height, width, self._short_side, 1, most_patches=self._short_side**2 * 8)
        features = np.zeros((len(pictures), *grid, self.card.dim), np.float32)
        for rgb, cells in zip(pictures, features, strict=True):
            found = self._proposer.find(rgb, grid)
            if len(found.area):
                for mask, row in zip(found.mask, self._features(rgb, found), strict=True):
                    cells[mask] = row
        return features

    def _features(self, rgb: UInt8[np.ndarray, "h w 3"], found: Proposals) -> Float32[np.ndarray, "n d"]:
        """Return the mixed feature of each region."""
        cutouts = [rgb, *(crop(rgb, box) for box in found.box)]
        at_once = select_batch(_CUTOUTS_ON_GPU) if self._clip.device.type != "cpu" else _CUTOUTS_ON_CPU
        rows: list[torch.Tensor] = []
        with inference():
            for start in range(0, len(cutouts), at_once):
                some = [self._clip.whole(picture) for picture in cutouts[start : start + at_once]]
                rows.append(self._clip.picture_features(torch.cat(some)))
            unit = torch.from_numpy(unit_rows(torch.cat(rows)))
            return to_numpy(blend_with_whole(unit[0], unit[1:]))


def blend_with_whole(whole: torch.Tensor, regions: torch.Tensor) -> torch.Tensor:
    """Return the unit features (r, d) of regions with some of the whole picture in each.

    Args:
        whole: (d,) unit vector of the picture.
        regions: (r, d) unit vectors of its regions.
    """
    among = regions @ regions.T
    alike = regions @ whole + (among.sum(dim=1) - among.diagonal()) / len(regions)
    weight = torch.softmax(alike, dim=0)[:, None]
    both = weight * whole + (1.0 - weight) * regions
    return both / both.norm(dim=1, keepdim=True).clamp_min(1e-12)


def crop(rgb: UInt8[np.ndarray, "h w 3"], box: Float32[np.ndarray, "4"]) -> UInt8[np.ndarray, "h2 w2 3"]:
    """Return the part of a picture in a box (x0, y0, x1, y1 in [0, 1]), at least one pixel of it."""
    height, width = rgb.shape[:2]
    x0, y0 = min(int(box[0] * width), width - 1), min(int(box[1] * height), height - 1)
    x1, y1 = max(x0 + 1, round(float(box[2] * width))), max(y0 + 1, round(float(box[3] * height)))
    return rgb[y0:y1, x0:x1]
