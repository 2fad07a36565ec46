"""The network: two bidirectional recurrent layers over the words, a decoder that attends to them and points at them."""

from dataclasses import dataclass

import torch
from torch import Tensor, nn

from avlmaps.language.learned.english import WIDTH
from avlmaps.language.learned.features import BUCKETS, columns
from avlmaps.language.learned.linear import SYMBOLS


@dataclass(frozen=True, slots=True)
class Size:
    """How large the network is."""

    words: int
    own: int = 40
    letters: int = 24
    marks: int = 80
    meaning: int = 80
    context: int = 96
    state: int = 112
    decoder: int = 144
    symbol: int = 64


class Encoder(nn.Module):
    """From the features of the words to their states."""

    def __init__(self, size: Size) -> None:
        super().__init__()
        self.own = nn.Embedding(size.words + 1, size.own, padding_idx=0)
        self.letters = nn.Embedding(BUCKETS, size.letters, padding_idx=0)
        self.marks = nn.Linear(len(columns()), size.marks)
        self.meaning = nn.Linear(128, size.meaning)
        self.context = nn.Linear(WIDTH, size.context)
        width = size.own + size.letters + size.marks + size.meaning + size.context
        self.first = nn.GRU(width, size.state, batch_first=True, bidirectional=True)
        self.second = nn.GRU(2 * size.state, size.state, batch_first=True, bidirectional=True)
        self.drop = nn.Dropout(0.25)
        self.norm = nn.LayerNorm(width)

    def forward(self, meaning: Tensor, words: Tensor, pieces: Tensor, marks: Tensor, context: Tensor) -> Tensor:
        """Return states (b, n, 2 state); all sentences of a batch have the same length."""
        letters = self.letters(pieces).sum(2) * 0.3
        x = torch.cat([self.own(words), letters, self.marks(marks), self.meaning(meaning), self.context(context)], -1)
        x = self.drop(self.norm(x))
        y = self.first(x)[0]
        z = self.second(self.drop(y))[0]
        return y + z


class Decoder(nn.Module):
    """From the beginning of the line to the next symbol or pointer."""

    def __init__(self, size: Size) -> None:
        super().__init__()
        wide = 2 * size.state
        self.symbol = nn.Embedding(len(SYMBOLS), size.symbol)
        self.pointed = nn.Linear(wide, size.symbol)
        self.start = nn.Linear(wide, size.decoder)
        self.first = nn.GRU(size.symbol, size.decoder, batch_first=True)
        self.look = nn.Linear(size.decoder, wide)
        self.second = nn.GRU(size.decoder + wide, size.decoder, batch_first=True)
        self.look_again = nn.Linear(size.decoder, wide)
        self.out = nn.Linear(size.decoder + wide, size.decoder)
        self.symbols = nn.Linear(size.decoder, len(SYMBOLS))
        self.points = nn.Linear(size.decoder, wide)
        self.keys = nn.Linear(wide, wide)
        self.drop = nn.Dropout(0.25)

    def embedded(self, lines: Tensor, states: Tensor) -> Tensor:
        """Return the vectors of symbols and of the tokens that are pointed at."""
        base = len(SYMBOLS)
        is_symbol = lines < base
        symbols = self.symbol(torch.where(is_symbol, lines, 0))
        at = torch.where(is_symbol, 0, lines - base)
        chosen = torch.gather(states, 1, at[..., None].expand(-1, -1, states.shape[-1]))
        return torch.where(is_symbol[..., None], symbols, self.pointed(chosen))

    def forward(
        self, lines: Tensor, states: Tensor, mask: Tensor, before: tuple[Tensor, Tensor] | None = None
    ) -> tuple[Tensor, Tensor, Tensor]:
        """Return log-probabilities (b, m, symbols + n), and the two states of the decoder."""
        if before is None:
            mean = (states * mask[..., None]).sum(1) / mask.sum(1, keepdim=True).clamp(min=1)
            begin = torch.tanh(self.start(mean))[None]
            before = (begin, begin)
        x = self.drop(self.embedded(lines, states))
        h, first = self.first(x, before[0].contiguous())
        bias = (mask.to(states.dtype) - 1.0)[:, None, :] * 1e4
        scale = states.shape[-1] ** -0.5
        seen = torch.softmax(self.look(h) @ states.transpose(1, 2) * scale + bias, -1) @ states
        g, second = self.second(torch.cat([h, seen], -1), before[1].contiguous())
        g = g + h
        seen = torch.softmax(self.look_again(g) @ states.transpose(1, 2) * scale + bias, -1) @ states
        out = self.drop(torch.tanh(self.out(torch.cat([g, seen], -1))))
        points = self.points(out) @ self.keys(states).transpose(1, 2) * scale + bias
        return torch.log_softmax(torch.cat([self.symbols(out), points], -1), -1), first, second


class Network(nn.Module):
    """Encoder and decoder."""

    def __init__(self, size: Size) -> None:
        super().__init__()
        self.size = size
        self.encoder, self.decoder = Encoder(size), Decoder(size)

    def loss(self, batch: dict[str, Tensor]) -> Tensor:
        """Return the mean loss of a symbol; a pointer may point at any token of the same word."""
        states = self.encoder(*(batch[name] for name in ("meaning", "words", "pieces", "marks", "context")))
        said, _, _ = self.decoder(batch["lines"], states, batch["mask"])
        right = torch.logsumexp(said.masked_fill(~batch["goal"], -1e4), -1)
        weight = batch["real"] * batch["weight"][:, None]
        return -(right * weight).sum() / weight.sum()
