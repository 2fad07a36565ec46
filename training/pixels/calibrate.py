"""Calibration of the scores on homes and families of shapes that were held out, and the files that ship."""

import sys
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np
import torch
import tyro
from torch import Tensor, nn
from training.pixels.batches import Shards
from training.pixels.export import load_network, write_onnx, write_start
from training.pixels.labels import CATEGORIES, ROOMS, UNLABELLED
from training.pixels.lexicon import CALLED, KINDS
from training.pixels.whole import WIDTH, whole_frame

from avlmaps.perception.embedded.scene_network import Notes

PIXELS_PER_FRAME = 400
# Of the biases that make single pixels likeliest only so much is applied: they favour walls, which fill most of a
# view, and a thing whose pixels all lean to the wall is never seen. Instances are calibrated afterwards.
PRIOR_SHARE = 0.25


@dataclass(frozen=True)
class Options:
    """What to calibrate on."""

    network: Path = Path("build/pixels/network.pt")
    """Checkpoint of the training."""
    frames: Path = Path("build/pixels/held-out")
    """Rendered frames of held-out homes."""
    out: Path = Path("src/avlmaps/perception/embedded/weights")
    """Folder of rooms.onnx and rooms.json."""
    start: Path = Path("training/pixels/start.npz")
    """Where the weights are kept for a training that goes on from them."""
    count: int = 600
    """Frames to look at."""
    seed: int = 0
    """Draws them."""
    weights: str = "last"
    """``mean``: of the training's last stretch, or the ``last`` ones."""


@dataclass(frozen=True)
class Scores:
    """What the network says of some pixels and frames, and the truth."""

    category: Tensor
    label: Tensor
    room: Tensor
    share: Tensor


@torch.no_grad()
def scores_of(network: nn.Module, options: Options) -> Scores:
    """Look at held-out frames as the running system does: whole, and in colour where they have it."""
    rng, shards = np.random.default_rng(options.seed), Shards(options.frames)
    category, label, room, share = [], [], [], []
    for _ in range(options.count):
        frames, index = shards.draw(rng)
        geometry, colour, depth, labels = whole_frame(frames, index, with_colour=True)
        score, rooms = network(torch.from_numpy(geometry), torch.from_numpy(colour))
        score = score[:, :, : depth.shape[0] // 2, : depth.shape[1] // 2]
        truth = np.where(depth > 0, labels, UNLABELLED)[::2, ::2]
        near = (depth[::2, ::2] < 4.0) & (truth != UNLABELLED)
        at = rng.permutation(np.flatnonzero(near))[:PIXELS_PER_FRAME]
        category.append(score[0].reshape(len(CATEGORIES), -1).T[at])
        label.append(torch.from_numpy(truth.reshape(-1)[at].astype(np.int64)))
        room.append(rooms)
        share.append(torch.from_numpy(np.array(frames.room[index]))[None])
    return Scores(torch.cat(category), torch.cat(label), torch.cat(room), torch.cat(share))


def fit_scores(scores: Scores) -> tuple[np.ndarray, float]:
    """Return the bias of each category and the temperature that make the held-out truth likeliest.

    Biases are held near zero, so that a category that hardly occurs keeps its own.
    """
    bias = torch.zeros(len(CATEGORIES), requires_grad=True)
    log_t = torch.zeros(1, requires_grad=True)
    optimiser = torch.optim.LBFGS([bias, log_t], max_iter=60)

    def closure() -> Tensor:
        optimiser.zero_grad()
        loss = nn.functional.cross_entropy((scores.category + bias) / log_t.exp(), scores.label)
        loss = loss + 0.002 * bias.square().mean()
        loss.backward()
        return loss

    optimiser.step(closure)
    return bias.detach().numpy(), float(log_t.exp())


def fit_rooms(scores: Scores) -> float:
    """Return the temperature of the rooms' scores that makes the held-out shares likeliest."""
    inside = scores.share.sum(dim=1) > 0.5
    share = scores.share[inside] / scores.share[inside].sum(dim=1, keepdim=True)
    tried = np.geomspace(0.3, 5.0, 60)
    loss = [-(share * (scores.room[inside] / t).log_softmax(dim=1)).sum(dim=1).mean().item() for t in tried]
    return float(tried[int(np.argmin(loss))])


def figures(scores: Scores, bias: np.ndarray, temperature: float) -> dict[str, float]:
    """Return accuracy, mean IoU over the categories that occur, calibration error, and accuracy of rooms."""
    p = ((scores.category + torch.from_numpy(bias)) / temperature).softmax(dim=1)
    sure, guess = p.max(dim=1)
    right = guess == scores.label
    iou = []
    for c in range(len(CATEGORIES)):
        truth, said = scores.label == c, guess == c
        if int(truth.sum()) >= 200:
            iou.append(float((truth & said).sum() / (truth | said).sum()))
    bins = torch.clamp((sure * 15).long(), max=14)
    error = sum(
        float((bins == b).float().mean() * (sure[bins == b].mean() - right[bins == b].float().mean()).abs())
        for b in range(15)
        if (bins == b).any()
    )
    inside = scores.share.max(dim=1).values > 0.6
    rooms = (scores.room.argmax(dim=1) == scores.share.argmax(dim=1))[inside].float().mean()
    return {
        "pixels right": float(right.float().mean()), "mean IoU": float(np.mean(iou)), "categories": len(iou),
        "calibration error": error, "rooms right": float(rooms), "rooms asked": int(inside.sum()),
    }  # fmt: skip


def calibrate(options: Options) -> dict[str, float]:
    """Write rooms.onnx and rooms.json, return the figures on the held-out frames."""
    network = load_network(options.network, options.weights)
    scores = scores_of(network, options)
    bias, temperature = fit_scores(scores)
    bias = PRIOR_SHARE * bias
    told = figures(scores, bias, temperature)
    options.out.mkdir(parents=True, exist_ok=True)
    write_onnx(network, options.out / "rooms.onnx")
    write_start(network, options.start)
    known = set(CATEGORIES) | set(ROOMS)
    notes = Notes(
        id="avlmaps/pixels-1",
        note="A small network for homes and offices, trained on rendered rooms alone; it goes by shape.",
        categories=CATEGORIES,
        rooms=ROOMS,
        bias=tuple(round(float(b), 4) for b in bias),
        temperature=round(temperature, 4),
        room_temperature=round(fit_rooms(scores), 4),
        called={name: phrases for name, phrases in CALLED.items() if name in known},
        kinds={word: names for word, names in KINDS.items() if set(names) <= known},
        width_px=WIDTH,
    )
    (options.out / "rooms.json").write_bytes(msgspec.json.format(msgspec.json.encode(notes), indent=1) + b"\n")
    for name, value in told.items():
        print(f"{name}: {value:.4g}", file=sys.stderr)
    return told


if __name__ == "__main__":
    calibrate(tyro.cli(Options))
