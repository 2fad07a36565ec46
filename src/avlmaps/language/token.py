"""A token of a sentence."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Token:
    """A word, figure, file name or mark.

    Attributes:
        text: lower case, clitics apart ("don't" is ``do`` and ``not``); the path of a file.
        raw: as it was written.
        kind: ``word``, ``number``, ``image``, ``clip`` or ``punct``.
        start: where it begins in the sentence.
        end: where it ends.
    """

    text: str
    raw: str
    kind: str
    start: int
    end: int
