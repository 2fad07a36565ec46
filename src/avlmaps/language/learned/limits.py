"""How likely a reading of the network must be before it counts."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Limits:
    """How likely a reading of the network must be; chosen on voices that it was not fitted to.

    Attributes:
        alone: to drive where the grammar asks back.
        doubtful: the same, where a number or a word such as "not" is not part of the reading.
        over: to drive where the grammar reads another place.
        stop: to stop where the grammar drives.
        danger: a refusal for danger, to stop.
        trusted: below this the network says nothing against the grammar.
        question_stop: to refuse a question that the grammar reads.
        question_alone: to answer a question that the grammar does not read.
        question_over: to answer a question that the grammar reads otherwise.
    """

    alone: float = 0.6
    doubtful: float = 0.85
    over: float = 0.95
    stop: float = 0.6
    danger: float = 0.5
    trusted: float = 0.0
    question_stop: float = 0.6
    question_alone: float = 0.5
    question_over: float = 0.8
