"""The rows that the weights are fitted on: one labelled query each, with the evidence for its first goal."""

import csv
import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from avlmaps.core.question import Modality
from avlmaps.query.goals import FACTORS, GoalEvidence
from avlmaps_sim.bench.found.answers import Judged

ROWS = Path(__file__).parent / "rows.csv"
_COLUMNS = ("scene", "kind", "words", "answerable", "right", "combination", *FACTORS, "first_alone")


@dataclass(frozen=True, slots=True)
class Row:
    """One query.

    Attributes:
        scene: where.
        kind: of the query.
        words: the query.
        answerable: whether anything is right.
        right: whether the first goal is.
        combination: of what is sought and what it is near.
        numbers: of the evidence, in the order of ``FACTORS``.
        first_alone: probability of the first goal of a query for what is sought alone.
    """

    scene: str
    kind: str
    words: str
    answerable: bool
    right: bool
    combination: str
    numbers: tuple[float, ...]
    first_alone: float

    @classmethod
    def of(cls, judged: Judged, evidence: GoalEvidence) -> "Row":
        """Return the row of an answer."""
        numbers = tuple(round(float(getattr(evidence, name)), 4) for name in FACTORS)
        facts = judged.scene, judged.kind, judged.words, judged.answerable, judged.right
        return cls(*facts, combination(evidence), numbers, round(evidence.alone, 4))

    @property
    def evidence(self) -> GoalEvidence:
        """The evidence again."""
        lead, *near = self.combination.replace(" near ", " and ").split(" and ")
        alone = min(1.0 / (1.0 + math.exp(-self.numbers[0])), self.first_alone)
        numbers = dict(zip(FACTORS, self.numbers, strict=True))
        near_kinds = tuple(map(Modality, near))
        return GoalEvidence(Modality(lead), near_kinds, alone, **numbers)


def combination(evidence: GoalEvidence) -> str:
    """Return what is sought and the kinds of what it is near: ``sound near object``; ``object`` for one alone."""
    kinds = sorted(set(evidence.context))
    return f"{evidence.lead} near {' and '.join(kinds)}" if kinds else str(evidence.lead)


def write_rows(rows: Iterable[Row]) -> None:
    """Write rows as CSV."""
    with ROWS.open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(_COLUMNS)
        for row in rows:
            facts = row.scene, row.kind, row.words, int(row.answerable), int(row.right), row.combination
            out.writerow([*facts, *row.numbers, row.first_alone])


def read_rows() -> list[Row]:
    """Read rows that ``write_rows`` wrote."""
    with ROWS.open(newline="", encoding="utf-8") as file:
        return [
            Row(
                one["scene"], one["kind"], one["words"], one["answerable"] == "1", one["right"] == "1",
                one["combination"], tuple(float(one[name]) for name in FACTORS), float(one["first_alone"]),
            )
            for one in csv.DictReader(file)
        ]  # fmt: skip


def balanced(rows: list[Row]) -> np.ndarray:
    """Return a weight for each row: of each combination, what has an answer and what has none count alike."""
    key = [(row.combination, row.answerable) for row in rows]
    count = {one: key.count(one) for one in set(key)}
    whole = {name: sum(n for (other, _), n in count.items() if other == name) for name, _ in count}
    return np.array([whole[name] / 2.0 / count[name, answerable] for name, answerable in key])
