"""LSeg by slow formulas in float64, straight from a checkpoint's tensors: what the published code computes."""

import math
from collections.abc import Mapping

import numpy as np
import torch
from torch.nn.functional import conv2d, conv_transpose2d, pad

State = Mapping[str, torch.Tensor]
LONG, CROP, STRIDE = 520, 480, 320


def corner_on_corner(known: int, wanted: int) -> torch.Tensor:
    """Return the (wanted, known) matrix of linear interpolation, the first on the first, the last on the last."""
    matrix = torch.zeros(wanted, known, dtype=torch.float64)
    for i in range(wanted):
        place = i * (known - 1) / (wanted - 1) if wanted > 1 else 0.0
        low = min(int(place), known - 1)
        matrix[i, low] += 1.0 - (place - low)
        matrix[i, min(low + 1, known - 1)] += place - low
    return matrix


def middles_on_middles(known: int, wanted: int) -> torch.Tensor:
    """Return the matrix of linear interpolation between the middles of pixels."""
    matrix = torch.zeros(wanted, known, dtype=torch.float64)
    for i in range(wanted):
        place = max(0.0, (i + 0.5) * known / wanted - 0.5)
        low = min(int(place), known - 1)
        matrix[i, low] += 1.0 - (place - low)
        matrix[i, min(low + 1, known - 1)] += place - low
    return matrix


def resized(x: torch.Tensor, height: int, width: int, matrix=corner_on_corner) -> torch.Tensor:
    """Return maps (..., h, w) at another size."""
    return matrix(x.shape[-2], height) @ x @ matrix(x.shape[-1], width).T


def layer_norm(x: torch.Tensor, state: State, name: str, eps: float = 1e-6) -> torch.Tensor:
    mean, variance = x.mean(-1, keepdim=True), x.var(-1, keepdim=True, unbiased=False)
    return (x - mean) / (variance + eps).sqrt() * state[f"{name}.weight"] + state[f"{name}.bias"]


def linear(x: torch.Tensor, state: State, name: str) -> torch.Tensor:
    return x @ state[f"{name}.weight"].T + state[f"{name}.bias"]


def gelu(x: torch.Tensor) -> torch.Tensor:
    return x * 0.5 * (1.0 + torch.erf(x / math.sqrt(2.0)))


def attention(x: torch.Tensor, state: State, name: str) -> torch.Tensor:
    n, width = x.shape
    mixed = []
    for head in linear(x, state, f"{name}.qkv").view(n, 3, width // 64, 64).permute(2, 1, 0, 3):
        query, key, value = head
        mixed.append((query @ key.T / 8.0).softmax(-1) @ value)
    return linear(torch.cat(mixed, dim=-1), state, f"{name}.proj")


def tapped_tokens(state: State, picture: torch.Tensor) -> list[torch.Tensor]:
    """Return the tokens of a picture (3, h, w) behind four blocks of the transformer."""
    name = "pretrained.model"
    weight, bias = state[f"{name}.patch_embed.proj.weight"], state[f"{name}.patch_embed.proj.bias"]
    rows, columns = picture.shape[1] // 16, picture.shape[2] // 16
    patches = picture.unfold(1, 16, 16).unfold(2, 16, 16).permute(1, 2, 0, 3, 4).reshape(rows * columns, -1)
    places = state[f"{name}.pos_embed"][0]
    side = math.isqrt(len(places) - 1)
    grid = resized(places[1:].T.reshape(-1, side, side), rows, columns, middles_on_middles)
    places = torch.cat([places[:1], grid.reshape(len(grid), -1).T])
    x = torch.cat([state[f"{name}.cls_token"][0], patches @ weight.flatten(1).T + bias]) + places
    blocks = 1 + max(int(key.split(".")[3]) for key in state if key.startswith(f"{name}.blocks."))
    behind = []
    for i in range(blocks):
        block = f"{name}.blocks.{i}"
        x = x + attention(layer_norm(x, state, f"{block}.norm1"), state, f"{block}.attn")
        hidden = gelu(linear(layer_norm(x, state, f"{block}.norm2"), state, f"{block}.mlp.fc1"))
        x = x + linear(hidden, state, f"{block}.mlp.fc2")
        if (i + 1) % (blocks // 4) == 0:
            behind.append(x)
    return behind


def residual(x: torch.Tensor, state: State, name: str) -> torch.Tensor:
    out = x
    for i in (1, 2):
        out = conv2d(out.clamp_min(0.0), state[f"{name}.conv{i}.weight"], padding=1)
        norm = {end: state[f"{name}.bn{i}.{end}"][:, None, None] for end in ("weight", "bias")}
        mean, variance = (state[f"{name}.bn{i}.running_{end}"][:, None, None] for end in ("mean", "var"))
        out = (out - mean) / (variance + 1e-5).sqrt() * norm["weight"] + norm["bias"]
    return x + out


def window_features(state: State, picture: torch.Tensor) -> torch.Tensor:
    """Return (dim, 480, 480) of a window (3, 480, 480)."""
    rows, columns = picture.shape[1] // 16, picture.shape[2] // 16
    levels = []
    for level, tokens in enumerate(tapped_tokens(state, picture), start=1):
        name = f"pretrained.act_postprocess{level}"
        both = torch.cat([tokens[1:], tokens[:1].repeat(len(tokens) - 1, 1)], dim=-1)
        x = gelu(linear(both, state, f"{name}.0.project.0")).T.reshape(1, -1, rows, columns)
        x = conv2d(x, state[f"{name}.3.weight"], state[f"{name}.3.bias"])
        if level < 3:
            x = conv_transpose2d(x, state[f"{name}.4.weight"], state[f"{name}.4.bias"], stride=(4, 2)[level - 1])
        elif level == 4:
            x = conv2d(x, state[f"{name}.4.weight"], state[f"{name}.4.bias"], stride=2, padding=1)
        levels.append(conv2d(x, state[f"scratch.layer{level}_rn.weight"], padding=1))
    x = None
    for level in (4, 3, 2, 1):
        name, finer = f"scratch.refinenet{level}", levels[level - 1]
        x = finer if x is None else x + residual(finer, state, f"{name}.resConfUnit1")
        x = residual(x, state, f"{name}.resConfUnit2")
        x = resized(x, 2 * x.shape[-2], 2 * x.shape[-1])
        x = conv2d(x, state[f"{name}.out_conv.weight"], state[f"{name}.out_conv.bias"])
    x = conv2d(x, state["scratch.head1.weight"], state["scratch.head1.bias"])[0]
    x = (x / x.norm(dim=0)).half().float() * torch.tensor(1.0 / 0.07).half().float()
    return resized(x.half().double(), 2 * x.shape[-2], 2 * x.shape[-1])


def picture_features(state: State, rgb: np.ndarray) -> torch.Tensor:
    """Return (dim, h, w) of a picture of any size, by the published windows."""
    exact = {key: value.double() for key, value in state.items()}
    height, width = rgb.shape[:2]
    size = (LONG, int(width * LONG / height + 0.5)) if height > width else (int(height * LONG / width + 0.5), LONG)
    picture = torch.from_numpy(rgb).double().permute(2, 0, 1) / 127.5 - 1.0
    picture = resized(picture, *size)
    whole = pad(picture, (0, max(0, CROP - size[1]), 0, max(0, CROP - size[0])), value=-1.0)
    total, count = 0.0, torch.zeros(whole.shape[-2:])
    for top in range(0, 1 + STRIDE * math.ceil((whole.shape[-2] - CROP) / STRIDE), STRIDE):
        for left in range(0, 1 + STRIDE * math.ceil((whole.shape[-1] - CROP) / STRIDE), STRIDE):
            window = whole[:, top : top + CROP, left : left + CROP]
            rows, columns = window.shape[-2:]
            full = pad(window, (0, CROP - columns, 0, CROP - rows), value=-1.0)
            found = window_features(exact, full)[:, :rows, :columns]
            total = total + pad(found, (left, whole.shape[2] - left - columns, top, whole.shape[1] - top - rows))
            count[top : top + rows, left : left + columns] += 1
    return (total / count)[:, : size[0], : size[1]]
