"""The losses of the network: fine labels of rendered frames, coarse ones of real frames, rooms and floors."""

import numpy as np
import torch
from torch import Tensor, nn
from training.pixels.batches import Batch, Shards, View, draw_batch
from training.pixels.labels import CATEGORIES, FIRST_COARSE, UNLABELLED
from training.pixels.light import in_other_light
from training.pixels.network import MULTIPLE, has_bfloat16
from training.pixels.shape import channels_of

from avlmaps_sim.bench.frames import CLASSES, SCORED, class_of_kinds

SMOOTHING = 0.03
# Labels without a class of their own are loose ("other prop" also where nobody labelled): they count less.
WEIGHT_OF_OTHERS = 0.25
ROOM_SHARE, FLOOR_SHARE = 0.15, 0.2


def groups() -> Tensor:
    """Return (classes, categories): 1 where a category belongs to a class of the real labels.

    ``other`` belongs to each of the classes that gather what has none.
    """
    matrix = torch.zeros(len(CLASSES), len(CATEGORIES))
    for kind, number in enumerate(class_of_kinds(CATEGORIES)):
        matrix[number, kind] = 1.0
    matrix[SCORED:, CATEGORIES.index("other")] = 1.0
    return matrix


def fine_weights(shards: Shards, rng: np.random.Generator) -> Tensor:
    """Return a weight for each category: rare ones count more, by the root of how rare they are; 1 without frames."""
    count = np.zeros(256)
    if not shards.refresh():
        return torch.ones(len(CATEGORIES))
    for _ in range(15):
        count += np.bincount(draw_batch([(shards, 16)], View(), rng).label.reshape(-1), minlength=256)
    share = count[: len(CATEGORIES)] / count[: len(CATEGORIES)].sum()
    return torch.from_numpy(np.clip(np.sqrt(0.01 / np.maximum(share, 1e-6)), 0.25, 2.5)).float()


def coarse_weights(shards: Shards) -> Tensor:
    """Return a weight for each class of the real labels."""
    count = np.zeros(256)
    for frames, index in shards.every():
        count += np.bincount(frames.label[index][::4, ::4].reshape(-1), minlength=256)
    count = count[FIRST_COARSE : FIRST_COARSE + len(CLASSES)]
    weight = np.clip(np.sqrt(0.015 / np.maximum(count / count[:SCORED].sum(), 1e-6)), 0.35, 2.5)
    weight[SCORED:] = WEIGHT_OF_OTHERS
    return torch.from_numpy(weight).float()


class Losses(nn.Module):
    """The sum of all losses.

    Args:
        fine: weight of each category.
        coarse: weight of each class of the real labels.
    """

    def __init__(self, fine: Tensor, coarse: Tensor) -> None:
        """Keep the weights and the groups."""
        super().__init__()
        self.register_buffer("fine", fine)
        self.register_buffer("coarse", coarse)
        self.register_buffer("groups", groups())

    def forward(self, network: nn.Module, batch: Batch[Tensor], fineness: int) -> tuple[Tensor, dict[str, Tensor]]:
        """Return the loss and its parts, those of real frames by themselves."""
        device = self.groups.device
        depth, camera, rgb, kept, label, near, room, floor = (x.to(device, non_blocking=True) for x in batch)
        geometry, colour = channels_of(depth, camera, MULTIPLE), in_other_light(rgb, kept, fineness * MULTIPLE)
        margin = [pad for size in depth.shape[:0:-1] for pad in (0, -size % MULTIPLE // 2)]
        label = nn.functional.pad(label, margin, value=UNLABELLED).long()
        near = nn.functional.pad(near, margin)
        geometry, colour = (x.to(memory_format=torch.channels_last) for x in (geometry, colour))
        with torch.autocast(device.type, torch.bfloat16, enabled=has_bfloat16(device)):
            score, rooms, offset = network(geometry, colour)
        score = score.float().permute(0, 2, 3, 1)
        real = ((label >= FIRST_COARSE) & (label != UNLABELLED)).flatten(1).any(dim=1)
        total, parts = score.new_zeros(()), {}
        for name, rows, part in (("rendered", ~real, self._fine), ("real", real, self._coarse)):
            count = int(rows.sum())
            if count:
                loss, right = part(score[rows], label[rows], near[rows])
                total = total + loss * (count / len(rows))
                parts |= {name: loss.detach(), f"{name} right": right}
        inside = room.sum(dim=1, keepdim=True)
        share = room / inside.clamp_min(1e-3)
        views = -((share * rooms.float().log_softmax(dim=1)).sum(dim=1) * inside[:, 0].clamp_max(1.0)).mean()
        known = ~floor.isnan()
        floors = nn.functional.smooth_l1_loss(offset.float()[known, 0], floor[known], beta=0.05, reduction="sum")
        floors = floors / known.sum().clamp_min(1)
        parts |= {"rooms": views.detach(), "floor": floors.detach()}
        return total + ROOM_SHARE * views + FLOOR_SHARE * floors, parts

    def _fine(self, score: Tensor, label: Tensor, near: Tensor) -> tuple[Tensor, Tensor]:
        known = label < len(CATEGORIES)
        flat, truth = score[known], label[known]
        each = nn.functional.cross_entropy(flat, truth, reduction="none", label_smoothing=SMOOTHING)
        weight = near[known] * self.fine[truth]
        right = (flat.detach().argmax(dim=1) == truth).float().mean()
        return (each * weight).sum() / weight.sum().clamp_min(1.0), right

    def _coarse(self, score: Tensor, label: Tensor, near: Tensor) -> tuple[Tensor, Tensor]:
        known = label != UNLABELLED
        flat, truth = score[known], label[known] - FIRST_COARSE
        log_q = (flat.softmax(dim=1) @ self.groups.T).clamp_min(1e-7).log()
        each = -(1.0 - SMOOTHING) * log_q.gather(1, truth[:, None])[:, 0] - SMOOTHING * log_q[:, :SCORED].mean(dim=1)
        weight = near[known] * self.coarse[truth]
        scored = truth < SCORED
        right = (log_q.detach()[:, :SCORED].argmax(dim=1) == truth)[scored].float().mean()
        return (each * weight).sum() / weight.sum().clamp_min(1.0), right
