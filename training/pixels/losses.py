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
TAUGHT = 0.4  # the share of teachers beside labels


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
        teachers: networks whose probabilities are learnt too (``distil.py``).
    """

    def __init__(self, fine: Tensor, coarse: Tensor, teachers: nn.Module | None = None) -> None:
        """Keep the weights and the groups."""
        super().__init__()
        self.teachers = teachers
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
        real = ((label >= FIRST_COARSE) & (label != UNLABELLED)).flatten(1).any(dim=1)
        _swap_windows(real, geometry, colour, label, near)
        geometry, colour = (x.to(memory_format=torch.channels_last) for x in (geometry, colour))
        with torch.autocast(device.type, torch.bfloat16, enabled=has_bfloat16(device)):
            score, rooms, offset = network(geometry, colour)
        score = score.float().permute(0, 2, 3, 1)
        total, parts = score.new_zeros(()), {}
        for name, rows in (("rendered", ~real), ("real", real)):
            count = int(rows.sum())
            if count:
                loss, right = self._of_labels(score[rows], label[rows], near[rows])
                total = total + loss * (count / len(rows))
                parts |= {name: loss.detach(), f"{name} right": right}
        if self.teachers is not None:
            taught = self._of_teachers(score, self.teachers(geometry, colour), label, near * geometry[:, 6, ::2, ::2])
            total = (1.0 - TAUGHT) * total + TAUGHT * taught
            parts |= {"taught": taught.detach()}
        inside = room.sum(dim=1, keepdim=True)
        share = room / inside.clamp_min(1e-3)
        views = -((share * rooms.float().log_softmax(dim=1)).sum(dim=1) * inside[:, 0].clamp_max(1.0)).mean()
        known = ~floor.isnan()
        floors = nn.functional.smooth_l1_loss(offset.float()[known, 0], floor[known], beta=0.05, reduction="sum")
        floors = floors / known.sum().clamp_min(1)
        parts |= {"rooms": views.detach(), "floor": floors.detach()}
        return total + ROOM_SHARE * views + FLOOR_SHARE * floors, parts

    def _of_labels(self, score: Tensor, label: Tensor, near: Tensor) -> tuple[Tensor, Tensor]:
        """Return the mean loss over pixels with fine labels and with coarse ones, and the share that is right."""
        fine = label < len(CATEGORIES)
        flat, truth = score[fine], label[fine]
        each = nn.functional.cross_entropy(flat, truth, reduction="none", label_smoothing=SMOOTHING)
        weight = near[fine] * self.fine[truth]
        loss, weights = (each * weight).sum(), weight.sum()
        right, count = (flat.detach().argmax(dim=1) == truth).sum(), truth.numel()
        coarse = (label >= FIRST_COARSE) & (label != UNLABELLED)
        flat, truth = score[coarse], label[coarse] - FIRST_COARSE
        log_q = (flat.softmax(dim=1) @ self.groups.T).clamp_min(1e-7).log()
        each = -(1.0 - SMOOTHING) * log_q.gather(1, truth[:, None])[:, 0] - SMOOTHING * log_q[:, :SCORED].mean(dim=1)
        weight = near[coarse] * self.coarse[truth]
        loss, weights = loss + (each * weight).sum(), weights + weight.sum()
        scored = truth < SCORED
        right = right + ((log_q.detach()[:, :SCORED].argmax(dim=1) == truth) & scored).sum()
        return loss / weights.clamp_min(1.0), right / (count + scored.sum()).clamp_min(1)

    def _of_teachers(self, score: Tensor, told: Tensor, label: Tensor, near: Tensor) -> Tensor:
        """Return the cross entropy with what teachers say of the kinds that they know, but where another is true."""
        known = told.shape[-1]
        near = near * ((label < known) | (label >= FIRST_COARSE))
        each = -(told * score[..., :known].log_softmax(dim=-1)).sum(dim=-1)
        return (each * near).sum() / near.sum().clamp_min(1.0)


def _swap_windows(real: Tensor, geometry: Tensor, colour: Tensor, label: Tensor, near: Tensor) -> None:
    """Let pairs of real frames swap a window, in place, in half of the batches (CutMix; Yun et al., ICCV 2019)."""
    rows = real.nonzero()[:, 0]
    one, two = rows[: len(rows) // 2], rows[len(rows) // 2 :][: len(rows) // 2]
    h, w = label.shape[1:]
    draw = torch.rand(5).tolist()
    if draw[4] < 0.5 or not len(one):
        return
    tall, wide = (round(size * (0.35 + 0.4 * share)) for size, share in zip((h, w), draw, strict=False))
    y, x = round(draw[2] * (h - tall)), round(draw[3] * (w - wide))
    for array in (geometry, colour, label, near):
        n = array.shape[-1] // w  # of the array's pixels to a cell of the output
        window = (..., slice(n * y, n * (y + tall)), slice(n * x, n * (x + wide)))
        first, second = array[one], array[two]
        kept = first[window].clone()
        first[window], second[window] = second[window], kept
        array[one], array[two] = first, second
