"""Calibration of the scores on what was held out, and a network's files: ``python -m training.pixels.calibrate``."""

import sys
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np
import torch
import tyro
from torch import Tensor
from training.pixels.batches import Shards
from training.pixels.export import MeanOf, load_network, write_onnx
from training.pixels.labels import CATEGORIES, FIRST_COARSE, ROOMS, UNLABELLED
from training.pixels.lexicon import CALLED, KINDS
from training.pixels.losses import groups
from training.pixels.network import MULTIPLE, RoomNetwork
from training.pixels.whole import WIDTH, whole_frame

from avlmaps.perception.embedded.scene_network import DEFAULT_WEIGHTS, Notes, checksum_of
from avlmaps_sim.bench.frames import SCORED

PIXELS_PER_FRAME = 400
LOOKED_AT = 40  # frames of each kind that show what range the features have
# Of the biases that make single pixels likeliest only this share is applied: they favour walls, which fill most of a
# view, and a thing whose pixels all lean to the wall is never seen. Instances are calibrated afterwards.
PRIOR_SHARE = 0.25
# What weights are called that do not ship.
OWN = "own/pixels-1"
NOTES = {
    "real": "Networks for homes and offices that began from ImageNet and learnt from rendered rooms, photographs and "
    "training frames of NYU Depth V2, which is published for research and states no licence: decide whether that "
    "suits you, or take --profile synthetic.",
    "synthetic": "A network for homes and offices that began from ImageNet and learnt from rendered rooms and "
    "photographs; it goes by shape first.",
}


@dataclass(frozen=True)
class Options:
    """Options of the calibration."""

    network: tuple[Path, ...] = (Path("build/pixels/network.pt"),)
    """Checkpoint of the training; of several the mean of their probabilities is written, as one network."""
    by: tuple[Path, ...] = ()
    """Checkpoints of the same recipe, in the same order, that held the real frames out: the constants and figures are
    theirs. Without them the networks themselves must have held these frames out."""
    frames: Path = Path("build/pixels/held-out")
    """Rendered frames of held-out homes."""
    real: Path | None = None
    """Real frames held out; with them the notes say what the weights saw."""
    out: Path = Path("build/pixels/eyes")
    """Folder of the files."""
    name: str = DEFAULT_WEIGHTS
    """Their name without an ending."""
    count: int = 500
    """Rendered frames to look at."""
    seed: int = 0
    """Draws them."""
    weights: str = "mean"
    """``mean``: of the training's last stretch, or the ``last`` ones."""
    id: str = ""
    """The model's name and version; ``""`` for those of the file that is replaced, or ``own/pixels-1``."""


@dataclass(frozen=True)
class Scores:
    """The network's outputs for some pixels and frames, and the truth."""

    category: Tensor
    label: Tensor
    room: Tensor
    share: Tensor


@torch.no_grad()
def scores_of(network: RoomNetwork | MeanOf, chosen: list, seed: int) -> Scores:
    """Encode frames as the running system does: whole, and in colour where they have it."""
    rng = np.random.default_rng(seed)
    category, label, room, share = [], [], [], []
    for frames, index in chosen:
        geometry, colour, depth, labels = whole_frame(frames, index, with_colour=True, fineness=network.fineness)
        score, rooms, _ = network(torch.from_numpy(geometry), torch.from_numpy(colour))
        score = score[:, :, : depth.shape[0] // 2, : depth.shape[1] // 2]
        truth = np.where(depth > 0, labels, UNLABELLED)[::2, ::2]
        near = (depth[::2, ::2] < 4.0) & (truth != UNLABELLED) & (truth < FIRST_COARSE + SCORED)
        at = rng.permutation(np.flatnonzero(near))[:PIXELS_PER_FRAME]
        category.append(score[0].reshape(len(CATEGORIES), -1).T[at])
        label.append(torch.from_numpy(truth.reshape(-1)[at].astype(np.int64)))
        room.append(rooms)
        share.append(torch.from_numpy(np.array(frames.room[index]))[None])
    return Scores(torch.cat(category), torch.cat(label), torch.cat(room), torch.cat(share))


def likelihood_loss(scores: Scores, bias: Tensor, temperature: Tensor) -> Tensor:
    """Return the negative logarithm of the truth's likelihood: of a kind, or of the class that gathers kinds."""
    log_p = ((scores.category + bias) / temperature).log_softmax(dim=1)
    fine = scores.label < FIRST_COARSE
    if bool(fine.all()):
        return -log_p.gather(1, scores.label[:, None]).mean()
    q = log_p.exp() @ groups().T
    return -(q.gather(1, (scores.label - FIRST_COARSE)[:, None]) + 1e-7).log().mean()


def fit_scores(parts: list[Scores]) -> tuple[np.ndarray, float]:
    """Return the bias of each category and the temperature that make the held-out truth likeliest.

    Every part counts alike. Biases are held near zero, so that a category that hardly occurs retains its own.
    """
    bias = torch.zeros(len(CATEGORIES), requires_grad=True)
    log_t = torch.zeros(1, requires_grad=True)
    optimiser = torch.optim.LBFGS([bias, log_t], max_iter=60)

    def closure() -> Tensor:
        optimiser.zero_grad()
        loss = torch.stack([likelihood_loss(part, bias, log_t.exp()) for part in parts]).mean()
        loss = loss + 0.002 * bias.square().mean()
        loss.backward()
        return loss

    optimiser.step(closure)
    return bias.detach().numpy(), float(log_t.detach().exp())


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
    truth_of = scores.label
    if bool((truth_of >= FIRST_COARSE).any()):
        p, truth_of = (p @ groups().T)[:, :SCORED], truth_of - FIRST_COARSE
    sure, guess = p.max(dim=1)
    right = guess == truth_of
    iou = []
    for c in range(p.shape[1]):
        truth, said = truth_of == c, guess == c
        if int(truth.sum()) >= 200:
            iou.append(float((truth & said).sum() / (truth | said).sum()))
    bins = torch.clamp((sure * 15).long(), max=14)
    error = sum(
        float((bins == b).float().mean() * (sure[bins == b].mean() - right[bins == b].float().mean()).abs())
        for b in range(15)
        if (bins == b).any()
    )
    told = {
        "pixels right": float(right.float().mean()), "mean IoU": float(np.mean(iou)), "categories": len(iou),
        "calibration error": error,
    }  # fmt: skip
    inside = scores.share.max(dim=1).values > 0.6
    if bool(inside.any()):
        rooms = (scores.room.argmax(dim=1) == scores.share.argmax(dim=1))[inside].float().mean()
        told |= {"rooms right": float(rooms), "rooms asked": int(inside.sum())}
    return told


def _together(networks: list[RoomNetwork], temperatures: list[float]) -> RoomNetwork | MeanOf:
    """Return one network of several; each one's scores are divided by its temperature first."""
    return networks[0] if len(networks) == 1 else MeanOf(networks, temperatures)


def _replaced_id(notes: Path) -> str:
    """Return the name and version that the notes which are written again bear; ``OWN`` where there are none."""
    return msgspec.json.decode(notes.read_bytes(), type=Notes).id if notes.is_file() else OWN


def calibrate(options: Options) -> None:
    """Write NAME.onnx and NAME.json, and print the figures on what was held out."""
    rng, shards = np.random.default_rng(options.seed), Shards(options.frames)
    chosen = [[shards.draw(rng) for _ in range(options.count)]]
    if options.real is not None:
        chosen.append(Shards(options.real).every())

    if options.by and len(options.by) != len(options.network):
        raise SystemExit(f"--by names {len(options.by)} checkpoint(s) for {len(options.network)} of --network")

    def parts_of(network: RoomNetwork | MeanOf) -> list[Scores]:
        return [scores_of(network, frames, options.seed) for frames in chosen]

    networks = [load_network(path, options.weights) for path in options.network]
    judged = [load_network(path, options.weights) for path in options.by] or networks
    temperatures = [fit_scores(parts_of(each))[1] for each in judged] if len(judged) > 1 else []
    network, parts = _together(networks, temperatures), parts_of(_together(judged, temperatures))
    bias, temperature = fit_scores(parts)
    bias = PRIOR_SHARE * bias
    known = set(CATEGORIES) | set(ROOMS)
    path = options.out / f"{options.name}.json"
    notes = Notes(
        id=options.id or _replaced_id(path),
        note=NOTES["real" if options.real else "synthetic"],
        categories=CATEGORIES,
        rooms=ROOMS,
        bias=tuple(round(float(b), 4) for b in bias),
        temperature=round(temperature, 4),
        room_temperature=round(fit_rooms(parts[0]), 4),
        called={name: phrases for name, phrases in CALLED.items() if name in known},
        kinds={word: names for word, names in KINDS.items() if set(names) <= known},
        width_px=WIDTH,
        multiple=MULTIPLE,
        fineness=network.fineness,
    )
    options.out.mkdir(parents=True, exist_ok=True)
    weights = options.out / f"{options.name}.onnx"
    frames = (one for part in chosen for one in part[:LOOKED_AT])
    looked_at = (whole_frame(*one, with_colour=True, fineness=network.fineness)[:2] for one in frames)
    write_onnx(network, weights, looked_at)
    notes = msgspec.structs.replace(notes, checksum=checksum_of(weights.read_bytes(), notes))
    path.write_bytes(msgspec.json.format(msgspec.json.encode(notes), indent=1) + b"\n")
    for name, part in zip(("rendered", "real"), parts, strict=False):
        for figure, value in figures(part, bias, temperature).items():
            print(f"{name}, {figure}: {value:.4g}", file=sys.stderr)


if __name__ == "__main__":
    calibrate(tyro.cli(Options))
