"""Fit the gate's own layer and write it: python -m training.language.gate MODEL, the folder of all-MiniLM-L6-v2.

It stands on the three layers of `gate.onnx`, which stay as they are, since the reader learnt from their states. Needs
torch, onnx and safetensors; nine minutes of one core.
"""

import sys
from copy import deepcopy
from functools import cache
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory

import onnx
import torch
from safetensors.torch import load_file
from torch import Tensor, nn
from training.language.gate.sentences import filled, of_hands, of_lists
from training.language.gate.weights import stored_in_bytes

from avlmaps.language.learned.english import WIDTH, english

OUT = Path(__file__).parents[3] / "src/avlmaps/language/learned/weights"
BELOW, HEADS, RUNS, STEPS, AVERAGED, LOST = 3, 12, 2, 900, 0.98, 0.1
BATCH = {  # no orders and orders
    "frames": (6, 5), "contrasts": (10, 8), "lists": (3, 24), "old hands": (8, 7), "new hands": (24, 22),
}  # fmt: skip
NAMES = {
    "query": "attention.self.query", "key": "attention.self.key", "value": "attention.self.value",
    "heeded": "attention.output.dense", "norm": "attention.output.LayerNorm",
    "wide": "intermediate.dense", "narrow": "output.dense", "last": "output.LayerNorm",
}  # fmt: skip


class Judge(nn.Module):
    """The fourth layer of the model of English, the mean and the most over a sentence, and one number."""

    def __init__(self, weights: dict[str, Tensor]) -> None:
        super().__init__()
        self.query, self.key, self.value, self.heeded = (nn.Linear(WIDTH, WIDTH) for _ in range(4))
        self.wide, self.narrow = nn.Linear(WIDTH, 4 * WIDTH), nn.Linear(4 * WIDTH, WIDTH)
        self.norm, self.last = nn.LayerNorm(WIDTH, 1e-12), nn.LayerNorm(WIDTH, 1e-12)
        for name, its in NAMES.items():
            stored = {part: weights[f"encoder.layer.{BELOW}.{its}.{part}"] for part in ("weight", "bias")}
            getattr(self, name).load_state_dict(stored)
        self.head, self.drop = nn.Linear(2 * WIDTH, 1), nn.Dropout(LOST)

    def forward(self, states: Tensor, mask: Tensor | None = None) -> Tensor:
        """Return the logit of each sentence; a mask says which states are its own, None: all."""
        states = self.drop(states)
        split = (*states.shape[:2], HEADS, WIDTH // HEADS)
        query, key, value = (part(states).reshape(split).transpose(1, 2) for part in (self.query, self.key, self.value))
        heeded = query @ key.transpose(2, 3) / (WIDTH // HEADS) ** 0.5
        heeded = torch.softmax(heeded if mask is None else heeded + (mask[:, None, None] - 1.0) * 1e4, -1) @ value
        states = self.norm(states + self.heeded(heeded.transpose(1, 2).reshape(states.shape)))
        states = self.last(states + self.narrow(nn.functional.gelu(self.wide(states))))
        if mask is None:
            mean, most = states.mean(1), states.amax(1)
        else:
            mean = (states * mask[..., None]).sum(1) / mask.sum(1, keepdim=True)
            most = (states + (mask[..., None] - 1.0) * 1e4).amax(1)
        return self.head(self.drop(torch.cat([mean, most], 1)))[:, 0]


@cache
def seen(text: str) -> Tensor:
    """Return the states that the three layers give a sentence."""
    return torch.from_numpy(english().sentence(text)).half()


def padded(each: list[Tensor]) -> tuple[Tensor, Tensor]:
    """Return the states of some sentences side by side, and which are their own."""
    mask = [torch.ones(len(states)) for states in each]
    return nn.utils.rnn.pad_sequence(each, batch_first=True), nn.utils.rnn.pad_sequence(mask, batch_first=True)


def fitted(judge: Judge, seed: int) -> dict[str, Tensor]:
    """Return the layer's weights, fitted to the frames, the lists and the hands: the average of its last ones."""
    random = Random(seed)
    torch.manual_seed(seed)
    torch.set_num_threads(1)
    every = {
        "frames": list(filled(random, "frames", 4)), "contrasts": list(filled(random, "contrasts", 8)),
        "lists": list(of_lists()), "old hands": list(of_hands("cde")), "new hands": list(of_hands("fghij")),
    }  # fmt: skip
    parts = [
        ([text for closed, text in every[name] if closed is wanted], counts[not wanted], 0.96 * wanted + 0.02)
        for name, counts in BATCH.items()
        for wanted in (True, False)
    ]
    body = [each for name, each in judge.named_parameters() if not name.startswith("head")]
    rates = (5e-4, 2e-3)
    steps = torch.optim.AdamW([{"params": body}, {"params": judge.head.parameters()}], weight_decay=0.01)
    mean = deepcopy(judge.state_dict())
    for step in range(STEPS):
        for group, rate in zip(steps.param_groups, rates, strict=True):
            group["lr"] = rate * min(1.0, (step + 1) / 30) * max(0.02, 1.0 - step / STEPS)
        said = [(seen(text).float(), likely) for texts, count, likely in parts for text in random.sample(texts, count)]
        said.sort(key=lambda pair: len(pair[0]))
        for at in range(3):  # sentences of about one length have little padding
            some = said[at * len(said) // 3 : (at + 1) * len(said) // 3]
            with torch.autocast("cpu", torch.bfloat16):
                logits = judge(*padded([states for states, _ in some]))
            truth = torch.tensor([likely for _, likely in some])
            lost = nn.functional.binary_cross_entropy_with_logits(logits.float(), truth, reduction="sum")
            (lost / len(said)).backward()
        torch.nn.utils.clip_grad_norm_(body, 1.0)
        steps.step()
        steps.zero_grad()
        for name, value in judge.state_dict().items():
            mean[name].lerp_(value, 1.0 - min(AVERAGED, (step + 1) / (step + 10)))
    return mean


def main(folder: str) -> None:
    """Fit the layer a few times, and write the mean of its weights in 8 bits."""
    weights = load_file(Path(folder) / "model.safetensors")
    runs = [fitted(Judge(weights), seed) for seed in range(RUNS)]
    judge = Judge(weights)
    judge.load_state_dict({name: torch.stack([run[name] for run in runs]).mean(0) for name in runs[0]})
    with TemporaryDirectory() as where:
        graph = f"{where}/order.onnx"
        torch.onnx.export(
            judge.eval(), (torch.zeros(1, 12, WIDTH),), graph, input_names=["states"], output_names=["logit"],
            dynamic_axes={"states": {1: "n"}}, opset_version=17, dynamo=False,
        )  # fmt: skip
        onnx.save(stored_in_bytes(onnx.load(graph)), OUT / "order.onnx")


if __name__ == "__main__":
    main(sys.argv[1])
