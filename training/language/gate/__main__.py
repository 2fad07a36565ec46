"""Fit the gate's network and write it: python -m training.language.gate MODEL, the folder of all-MiniLM-L6-v2.

Needs torch, transformers and onnxruntime; twelve minutes of one core.
"""

import json
import re
import sys
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory

import torch
from onnxruntime.quantization import QuantType, quantize_dynamic
from torch import Tensor, nn
from training.language.gate.sentences import filled, of_hands, of_lists
from transformers import AutoModel, AutoTokenizer

OUT = Path(__file__).parents[3] / "src/avlmaps/language/learned/weights"
LAYERS, HEADS, STEPS, LIMIT = 3, 12, 900, 0.2
BATCH = {"frames": (6, 4), "lists": (2, 12), "hands": (14, 14)}  # no orders and orders
MOST_PIECES = 80
USUAL = 15_000  # pieces of the vocabulary stand in the order of their use


class Judge(nn.Module):
    """The first layers of a model of English, the mean over a sentence, and one number."""

    def __init__(self, model: nn.Module) -> None:
        super().__init__()
        self.model, self.head = model, nn.Linear(384, 1)
        model.encoder.layer = model.encoder.layer[:LAYERS]

    def forward(self, pieces: Tensor, mask: Tensor) -> Tensor:
        """Return the logit of each sentence."""
        states = self.model(input_ids=pieces, attention_mask=mask).last_hidden_state
        wide = mask.unsqueeze(-1).float()
        return self.head((states * wide).sum(1) / wide.sum(1)).squeeze(-1)


class Exported(nn.Module):
    """The same for one sentence, with the usual pieces of the vocabulary alone."""

    def __init__(self, judge: Judge, kept: list[int]) -> None:
        super().__init__()
        words = judge.model.embeddings
        self.words = nn.Embedding.from_pretrained(words.word_embeddings.weight[kept].detach())
        kind = words.token_type_embeddings.weight[0]
        self.places = nn.Parameter((words.position_embeddings.weight[:MOST_PIECES] + kind).detach())
        self.norm, self.layers, self.head = words.LayerNorm, judge.model.encoder.layer, judge.head

    def forward(self, pieces: Tensor) -> Tensor:
        """Return the logit of a sentence of shape (1, n)."""
        count = pieces.shape[1]
        states = self.norm(self.words(pieces) + self.places[:count])

        def split(each: Tensor) -> Tensor:
            return each.reshape(1, count, HEADS, -1).transpose(1, 2)

        for layer in self.layers:
            own, out = layer.attention.self, layer.attention.output
            query, key, value = (split(part(states)) for part in (own.query, own.key, own.value))
            heeded = torch.softmax(query @ key.transpose(2, 3) / (384 // HEADS) ** 0.5, -1) @ value
            states = out.LayerNorm(states + out.dense(heeded.transpose(1, 2).reshape(1, count, 384)))
            wide = nn.functional.gelu(layer.intermediate.dense(states))
            states = layer.output.LayerNorm(states + layer.output.dense(wide))
        return self.head(states.mean(1))[:, 0]


def fitted(folder: str) -> Judge:
    """Return the network, fitted to the frames, the lists and the hands; nearly half of each batch is no order."""
    random = Random(2)
    torch.manual_seed(2)
    pieces_of, judge = AutoTokenizer.from_pretrained(folder), Judge(AutoModel.from_pretrained(folder))
    every = {"frames": list(filled(random, 8)), "lists": list(of_lists()), "hands": list(of_hands())}
    parts = [
        ([text for closed, text in every[name] if closed is wanted], counts[not wanted], 0.96 * wanted + 0.02)
        for name, counts in BATCH.items()
        for wanted in (True, False)
    ]
    truth = torch.tensor([likely for _, count, likely in parts for _ in range(count)])
    judge.model.embeddings.word_embeddings.requires_grad_(requires_grad=False)
    body = [each for each in judge.model.parameters() if each.requires_grad]
    rates = (1e-4, 2e-3)
    steps = torch.optim.AdamW([{"params": body}, {"params": judge.head.parameters()}], weight_decay=0.01)
    for step in range(STEPS):
        for group, rate in zip(steps.param_groups, rates, strict=True):
            group["lr"] = rate * min(1.0, (step + 1) / 30) * max(0.02, 1.0 - step / STEPS)
        texts = [text for said, count, _ in parts for text in random.sample(said, count)]
        batch = pieces_of(texts, padding=True, truncation=True, max_length=48, return_tensors="pt")
        loss = nn.functional.binary_cross_entropy_with_logits(judge(batch["input_ids"], batch["attention_mask"]), truth)
        steps.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(body, 1.0)
        steps.step()
    return judge.eval()


def main(folder: str) -> None:
    """Fit the network, and write it with its pieces and its limit."""
    judge, entries = fitted(folder), (Path(folder) / "vocab.txt").read_text(encoding="utf-8").splitlines()
    special = re.compile(r"\[(?:CLS|SEP|UNK)\]|(?:##)?[a-z]|[!-~]|(?:##)?\d{1,2}")
    usual = re.compile(r"(?:##)?[a-z]+")
    kept = [at for at, word in enumerate(entries) if special.fullmatch(word) or (usual.fullmatch(word) and at < USUAL)]
    with TemporaryDirectory() as where:
        graph = f"{where}/gate.onnx"
        torch.onnx.export(
            Exported(judge, kept).eval(), (torch.zeros(1, 12, dtype=torch.long),), graph, input_names=["pieces"],
            output_names=["logit"], dynamic_axes={"pieces": {1: "n"}}, opset_version=17, dynamo=False,
        )  # fmt: skip
        quantize_dynamic(graph, str(OUT / "gate.onnx"), weight_type=QuantType.QInt8, per_channel=True)
    facts = {"limit": LIMIT, "pieces": [entries[at] for at in kept]}
    (OUT / "gate.json").write_text(json.dumps(facts), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1])
