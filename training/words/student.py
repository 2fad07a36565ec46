"""The student: a table with a vector for each word piece, word and run of words; a phrase is their weighted sum."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float32
from torch.nn import functional as nnf

from avlmaps.perception.embedded.words import WordPieces, clean_phrase, replace_aliases

ROLES = 3


@dataclass(frozen=True, slots=True)
class Cut:
    """Phrases cut into rows of the table: phrase i has ``rows[starts[i]:starts[i + 1]]``."""

    rows: np.ndarray
    roles: np.ndarray
    starts: np.ndarray

    def batch(self, chosen: np.ndarray) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """Return rows, and for each the bag (phrase of the batch) that it belongs to, and the role."""
        lengths = self.starts[chosen + 1] - self.starts[chosen]
        first = np.repeat(self.starts[chosen], lengths)
        within = np.arange(lengths.sum()) - np.repeat(np.cumsum(lengths) - lengths, lengths)
        at = first + within
        bag = np.repeat(np.arange(len(chosen)), lengths)
        return torch.from_numpy(self.rows[at]), torch.from_numpy(bag), torch.from_numpy(self.roles[at])


def cut(phrases: Sequence[str], pieces: WordPieces, aliases: dict[str, str]) -> Cut:
    """Cut phrases as the encoder does at run time."""
    rows: list[int] = []
    roles: list[int] = []
    starts = [0]
    for phrase in phrases:
        found, role = pieces.rows_and_roles(replace_aliases(clean_phrase(phrase).split(), aliases))
        rows += found
        roles += role
        starts.append(len(rows))
    return Cut(np.array(rows, np.int64), np.array(roles, np.int64), np.array(starts, np.int64))


class Student(torch.nn.Module):
    """The table, a diagonal scaling for each role (before the head, the head, after it) and a small correction."""

    def __init__(self, table: Float32[np.ndarray, "rows d"], hidden: int = 0, roles: bool = True) -> None:
        super().__init__()
        dim = table.shape[1]
        self.table = torch.nn.Embedding.from_pretrained(torch.from_numpy(table.copy()), freeze=False, sparse=True)
        self.roles = torch.nn.Parameter(torch.ones(ROLES, dim), requires_grad=roles)
        self.inner = torch.nn.Linear(dim, hidden) if hidden else None
        self.outer = torch.nn.Linear(hidden, dim) if hidden else None
        if self.outer is not None:
            torch.nn.init.zeros_(self.outer.weight)
            torch.nn.init.zeros_(self.outer.bias)

    def forward(self, cut_: Cut, chosen: np.ndarray) -> torch.Tensor:
        """Return unit vectors (n, d) of the chosen phrases."""
        rows, bag, role = cut_.batch(chosen)
        summed = torch.zeros(len(chosen) * ROLES, self.table.embedding_dim)
        summed = summed.index_add(0, bag * ROLES + role, self.table(rows))
        pooled = (summed.view(len(chosen), ROLES, -1) * self.roles).sum(dim=1)
        pooled = nnf.normalize(pooled, dim=1)
        if self.inner is not None and self.outer is not None:
            pooled = nnf.normalize(pooled + self.outer(torch.relu(self.inner(pooled))), dim=1)
        return pooled


@dataclass(frozen=True, slots=True)
class Schedule:
    """How long and how the student learns.

    Attributes:
        epochs: passes over the phrases.
        batch: phrases a step.
        rate: Adam's step at the start; it falls to zero as a cosine.
        relations: weight of the loss on similarities between the phrases of a batch.
        labels: weight of the loss that draws a paraphrase to its concept, among all concepts.
        temperature: of that loss.
    """

    epochs: int = 8
    batch: int = 1024
    rate: float = 3e-3
    relations: float = 1.0
    labels: float = 0.2
    temperature: float = 0.07


@dataclass(frozen=True, slots=True)
class Lessons:
    """The student's data: phrases with targets (unit, d), and paraphrases with the index of a concept."""

    phrases: Cut
    targets: Float32[np.ndarray, "n d"]
    paraphrases: Cut
    concept_of: np.ndarray
    concepts: Cut


def train(student: Student, lessons: Lessons, schedule: Schedule, rng: np.random.Generator) -> Student:
    """Train the student in place and return it."""
    rest = [p for name, p in student.named_parameters() if name != "table.weight" and p.requires_grad]
    # A step touches a tenth of the table: sparse gradients are some times faster than dense ones.
    optimisers: list[torch.optim.Optimizer] = [
        torch.optim.SparseAdam([student.table.weight], lr=schedule.rate, betas=(0.9, 0.99))
    ]
    if rest:
        optimisers.append(torch.optim.Adam(rest, lr=schedule.rate / 3, betas=(0.9, 0.99)))
    count = len(lessons.targets)
    steps = schedule.epochs * (count // schedule.batch)
    slopes = [torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, steps) for optimiser in optimisers]
    every_concept = np.arange(len(lessons.concepts.starts) - 1)
    order = np.zeros(0, np.int64)
    for _ in range(steps):
        if len(order) < schedule.batch:
            order = rng.permutation(count)
        chosen, order = order[: schedule.batch], order[schedule.batch :]
        target = torch.from_numpy(lessons.targets[chosen])
        made = student(lessons.phrases, chosen)
        loss = 1 - (made * target).sum(dim=1).mean()
        if schedule.relations:
            loss = loss + schedule.relations * nnf.mse_loss(made @ made.T, target @ target.T) * 10
        if schedule.labels:
            drawn = rng.integers(len(lessons.concept_of), size=256)
            scores = student(lessons.paraphrases, drawn) @ student(lessons.concepts, every_concept).T
            right = torch.from_numpy(lessons.concept_of[drawn])
            loss = loss + schedule.labels * nnf.cross_entropy(scores / schedule.temperature, right)
        student.zero_grad(set_to_none=True)
        loss.backward()
        for optimiser, slope in zip(optimisers, slopes, strict=True):
            optimiser.step()
            slope.step()
    return student


def encoder(
    student: Student, pieces: WordPieces, aliases: dict[str, str]
) -> Callable[[Sequence[str]], Float32[np.ndarray, "n d"]]:
    """Return the student as a function from phrases to vectors, before its weights are rounded."""

    def encode(phrases: Sequence[str]) -> Float32[np.ndarray, "n d"]:
        with torch.no_grad():
            return student(cut(phrases, pieces, aliases), np.arange(len(phrases))).numpy()

    return encode
