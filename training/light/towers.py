"""The four networks of the profile ``light`` as torch modules of one picture, sound or text each, made for tracing.

They hold the modules of transformers' ``Tipsv2Model`` and ``ClapModel``, weights and all, and run them without padding
and without masks: one text goes through at its own length, so that nothing has to be hidden. Tests hold each of them to
transformers' own result.
"""

from typing import Any

import torch
from torch import nn
from torch.nn import functional


def attend(query: torch.Tensor, key: torch.Tensor, value: torch.Tensor, heads: int) -> torch.Tensor:
    """Return softmax attention (1, n, d) of projected tokens (1, n, d) to (1, m, d)."""
    width = query.shape[-1] // heads
    q, k, v = (rows.view(1, -1, heads, width).transpose(1, 2) for rows in (query, key, value))
    share = torch.softmax((q * width**-0.5) @ k.transpose(-1, -2), dim=-1)
    return (share @ v).transpose(1, 2).reshape(1, -1, heads * width)


class PictureTower(nn.Module):
    """TIPSv2's picture tower: the features of patches by their values, and of the whole picture.

    Patches are those of ``foundation/tipsv2.py``: in the last block each takes its own value. The first class token,
    which learnt from captions of whole pictures, attends there as published, and becomes the feature of the view. Both
    go through the rest of the last block together, which holds its weights once.

    Args:
        vision: a ``Tipsv2VisionModel``.
    """

    def __init__(self, vision: Any) -> None:
        super().__init__()
        self.vision = vision
        config = vision.config
        self.heads, self.front = int(config.num_attention_heads), 1 + int(config.num_register_tokens)
        grid = int(config.image_size) // int(config.patch_size)
        places = vision.embeddings.position_embeddings.detach()
        self.grid, self.width = grid, places.shape[-1]
        self.register_buffer("places", places[0, 1:].reshape(grid, -1))
        self.register_buffer("first", vision.embeddings.cls_token.detach() + places[:, :1])

    def forward(
        self, pixels: torch.Tensor, rows: torch.Tensor, columns: torch.Tensor
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """Return unit features of the patches (h·w, d) and of the picture (d,).

        Args:
            pixels: (1, 3, 14·h, 14·w) in [0, 1].
            rows: (h, grid) weights that interpolate the position embeddings along the height.
            columns: (w, grid) the same along the width.
        """
        embeddings = self.vision.embeddings
        along = (rows @ self.places).view(-1, self.grid, self.width)
        places = (columns @ along).reshape(1, -1, self.width)
        patches = embeddings.patch_embeddings.projection(pixels).flatten(2).transpose(1, 2) + places
        hidden = torch.cat([self.first, embeddings.register_tokens, patches], dim=1)
        *before, last = self.vision.encoder.layer
        for layer in before:
            normal = layer.norm1(hidden)
            attention = layer.attention
            seen = attend(attention.q_proj(normal), attention.k_proj(normal), attention.v_proj(normal), self.heads)
            hidden = hidden + layer.layer_scale1(attention.o_proj(seen))
            hidden = hidden + layer.layer_scale2(layer.mlp(layer.norm2(hidden)))
        normal, attention = last.norm1(hidden), last.attention
        value = attention.v_proj(normal)
        whole = attend(attention.q_proj(normal[:, :1]), attention.k_proj(normal), value, self.heads)
        hidden = torch.cat([hidden[:, :1], hidden[:, self.front :]], dim=1)
        own = attention.o_proj(torch.cat([whole, value[:, self.front :]], dim=1))
        hidden = hidden + last.layer_scale1(own)
        hidden = hidden + last.layer_scale2(last.mlp(last.norm2(hidden)))
        found = functional.normalize(self.vision.layernorm(hidden)[0], dim=-1)
        return found[1:], found[0]


class PictureWords(nn.Module):
    """TIPSv2's text tower: the mean over the tokens of one text.

    Args:
        text: a ``Tipsv2TextModel``.
    """

    def __init__(self, text: Any) -> None:
        super().__init__()
        self.text = text

    def forward(self, ids: torch.Tensor) -> torch.Tensor:
        """Return the unit feature (d,) of a text.

        Args:
            ids: (1, n) its tokens.
        """
        embeddings, count = self.text.embeddings, ids.shape[1]
        hidden = embeddings.token_embedding(ids) * embeddings.embed_scale
        hidden = hidden + embeddings.position_embedding.weights[:count]
        for layer in self.text.encoder.layers:
            normal, attention = layer.layer_norm1(hidden), layer.self_attn
            seen = attend(
                attention.q_proj(normal), attention.k_proj(normal), attention.v_proj(normal), attention.num_heads
            )
            hidden = hidden + attention.out_proj(seen)
            hidden = hidden + layer.mlp(layer.layer_norm2(hidden))
        return functional.normalize(self.text.final_layer_norm(hidden).mean(dim=1)[0], dim=-1)


class SoundTower(nn.Module):
    """CLAP's tower of sounds, for one window of ten seconds.

    Args:
        clap: a ``ClapModel`` without fusion.
    """

    def __init__(self, clap: Any) -> None:
        super().__init__()
        self.audio, self.projection = clap.audio_model, clap.audio_projection

    def forward(self, mels: torch.Tensor) -> torch.Tensor:
        """Return the unit feature (d,) of a window.

        Args:
            mels: (1, 1, frames, bands) decibels.
        """
        pooled = self.audio(input_features=mels).pooler_output
        return functional.normalize(self.projection(pooled)[0], dim=-1)


class SoundWords(nn.Module):
    """CLAP's text tower, a RoBERTa whose first token stands for the text.

    Args:
        clap: a ``ClapModel``.
    """

    def __init__(self, clap: Any) -> None:
        super().__init__()
        self.text, self.projection = clap.text_model, clap.text_projection

    def forward(self, ids: torch.Tensor) -> torch.Tensor:
        """Return the unit feature (d,) of a text.

        Args:
            ids: (1, n) its tokens, start and end among them.
        """
        embeddings, first = self.text.embeddings, self.text.embeddings.padding_idx + 1
        places = embeddings.position_embeddings.weight[first : first + ids.shape[1]]
        hidden = embeddings.word_embeddings(ids) + embeddings.token_type_embeddings.weight[0] + places
        hidden = embeddings.LayerNorm(hidden)
        for layer in self.text.encoder.layer:
            attention = layer.attention.self
            seen = attend(
                attention.query(hidden), attention.key(hidden), attention.value(hidden), attention.num_attention_heads
            )
            hidden = layer.attention.output(seen, hidden)
            hidden = layer.output(layer.intermediate(hidden), hidden)
        pooled = self.text.pooler(hidden)
        return functional.normalize(self.projection(pooled)[0], dim=-1)
