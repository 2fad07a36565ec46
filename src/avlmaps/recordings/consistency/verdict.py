"""What the check of a recording finds: rows that may be wrong, findings with their words, and the verdict."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, NamedTuple

import numpy as np


class Grade(StrEnum):
    """How a recording stands after the check."""

    FINE = "fine"
    UNCHECKED = "unchecked"
    SUSPICIOUS = "suspicious"
    IMPOSSIBLE = "impossible"


class Reason(StrEnum):
    """What can be wrong; the word lets a recording through that is refused because of it."""

    GEOMETRY = "geometry"
    COLOUR = "colour"
    DEPTH = "depth"
    INTRINSICS = "intrinsics"
    MOTION = "motion"
    UP = "up"
    MICROPHONES = "microphones"
    SOUND = "sound"


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that is not as it should be.

    Attributes:
        reason: its word.
        grade: suspicious or impossible.
        sentence: what, with numbers.
        remedy: the likely cause and what to do, one sentence.
    """

    reason: Reason
    grade: Grade
    sentence: str
    remedy: str

    def __str__(self) -> str:
        return f"{self.sentence} {self.remedy}"


class Said(NamedTuple):
    """What a measure says: a sentence with numbers, what to do where that differs, and whether it cannot be right."""

    sentence: str
    remedy: str = ""
    sure: bool = False


class Suspicion(NamedTuple):
    """One row of what may be wrong: its word, what measures it, and the likely cause with what to do."""

    reason: Reason
    measure: Callable[[Any], Iterable[Said]]
    remedy: str = ""


def findings_of(rows: Iterable[Suspicion], evidence: Any) -> Iterator[Finding]:
    """Yield what the rows find in the evidence, in their order."""
    for reason, measure, remedy in rows:
        for said in measure(evidence):
            grade = Grade.IMPOSSIBLE if said.sure else Grade.SUSPICIOUS
            yield Finding(reason, grade, said.sentence, said.remedy or remedy)


@dataclass(frozen=True, slots=True)
class Verdict:
    """The outcome of the check.

    Attributes:
        frames: number of frames that were looked at.
        pairs: number of pairs of them that see the same place.
        agreeing: share of points of the one frame on the surface that the other sees; NaN without pairs.
        seen_through: share of points that the other frame looks through; NaN without pairs.
        likeness: correlation of the brightness of the same points; NaN where nothing varies.
        median_depth_m: of the pixels with a depth; NaN without any.
        findings: what is wrong, the gravest first.
        unread: number of frames of the sample that could not be read.
        unchecked: what could be wrong without showing, and why, one sentence each, where there are no findings.
    """

    frames: int
    pairs: int
    agreeing: float
    seen_through: float
    likeness: float
    median_depth_m: float
    findings: tuple[Finding, ...] = ()
    unread: int = 0
    unchecked: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        gravest_first = sorted(self.findings, key=lambda finding: finding.grade is not Grade.IMPOSSIBLE)
        object.__setattr__(self, "findings", tuple(gravest_first))

    @property
    def grade(self) -> Grade:
        """The gravest grade of the findings; without any, whether frames could be compared at all."""
        if self.findings:
            return self.findings[0].grade
        return Grade.UNCHECKED if np.isnan(self.agreeing) else Grade.FINE

    def sentences(self) -> tuple[str, ...]:
        """Return a sentence or two for each finding."""
        return tuple(map(str, self.findings))

    def refused(self, allowed: tuple[str, ...]) -> Finding | None:
        """Return the first finding that forbids a map, None where there is none or its reason is allowed."""
        grave = (finding for finding in self.findings if finding.grade == Grade.IMPOSSIBLE)
        return next((finding for finding in grave if finding.reason not in allowed), None)
