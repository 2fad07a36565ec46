"""How likely a reading must be before it counts."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class ReadingLimits:
    """How likely a reading must be; chosen on voices that the networks were not fitted to.

    Attributes:
        command: to drive.
        doubtful: to drive where a number, a name or a word such as "not" is not part of the reading.
        danger: a refusal for danger, to stop.
        question: to answer a question.
        question_doubtful: the same, where such a word is not part of the reading.
    """

    command: float = 0.7
    doubtful: float = 0.85
    danger: float = 0.3
    question: float = 0.4
    question_doubtful: float = 0.6
