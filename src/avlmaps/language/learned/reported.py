"""Reports of a drive, and questions about one, which order none: "did you go to the kitchen?", "I went to the sofa"."""

from avlmaps.language.intents import Clarify
from avlmaps.language.learned.said import Claimed, words
from avlmaps.language.rephrase import order_words

_ENDS = frozenset({".", ";", "?", "!", ":", ",", "but", "so"})
# What is wished or said of a thing is no report: "if you went", "the chair where you were".
_RELATES = frozenset({"if", "rather", "wish", "where", "wherever", "that", "which", "whereas", "while", "since"})


def reported(said: Claimed) -> Clarify | None:
    """Return the question for a drive that a sentence reports or queries, where the reading holds nothing else."""
    for start, end in said.spans("reports"):
        opens = (
            start == 0
            or said.tokens[start - 1].kind == "punct"
            or said.texts[start - 1] in words().lists["before_reports"]
        )
        if not opens or not _RELATES.isdisjoint(said.texts[max(0, start - 2) : start]):
            continue
        stop = next((at for at in range(end, len(said.texts)) if said.texts[at] in _ENDS), len(said.texts))
        clause = frozenset(range(start, stop))
        ordered = any(
            text in order_words() and said.is_order(at) for at, text in enumerate(said.texts) if at not in clause
        )
        if said.named and said.named <= clause and not ordered:
            phrase = " ".join(said.texts[start:stop])
            return Clarify(f"'{phrase}' orders no drive. Say what to do, such as: go to the kitchen.")
    return None
