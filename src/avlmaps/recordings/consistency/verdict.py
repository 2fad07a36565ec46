"""What the check of a recording finds, how grave it is, and the words for it."""

from dataclasses import dataclass
from enum import StrEnum


class Grade(StrEnum):
    """How a recording stands after the check."""

    FINE = "fine"
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
    """

    frames: int
    pairs: int
    agreeing: float
    seen_through: float
    likeness: float
    median_depth_m: float
    findings: tuple[Finding, ...] = ()
    unread: int = 0

    def __post_init__(self) -> None:
        """Put the gravest finding first."""
        order = (Grade.IMPOSSIBLE, Grade.SUSPICIOUS)
        findings = sorted(self.findings, key=lambda finding: order.index(finding.grade))
        object.__setattr__(self, "findings", tuple(findings))

    @property
    def grade(self) -> Grade:
        """The gravest grade of the findings."""
        grades = {finding.grade for finding in self.findings}
        return next((grade for grade in (Grade.IMPOSSIBLE, Grade.SUSPICIOUS) if grade in grades), Grade.FINE)

    def sentences(self) -> tuple[str, ...]:
        """Return a sentence or two for each finding."""
        return tuple(map(str, self.findings))

    def refused(self, allowed: tuple[str, ...]) -> Finding | None:
        """Return the first finding that forbids a map, None where there is none or its reason is allowed."""
        grave = (finding for finding in self.findings if finding.grade == Grade.IMPOSSIBLE)
        return next((finding for finding in grave if finding.reason not in allowed), None)
