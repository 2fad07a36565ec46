"""What a command says and no part of a reading accounts for: circumstances, paths over what is alive, strange words.

A reading holds names and amounts. What else is said has to be a word that the parser knows to change nothing; else
the robot would drive on half of a sentence.
"""

from collections.abc import Sequence
from itertools import pairwise

from avlmaps.language import lexer
from avlmaps.language.intents import RefusalReason, Refuse
from avlmaps.language.learned.linear import amount_end
from avlmaps.language.learned.said import BREAKS, LOOKS, PREPOSITIONS, Said, words
from avlmaps.language.lexer import Token
from avlmaps.language.names import class_words

_CLAUSES = frozenset({"then", "and", "so", "because", "but", "as", "for"})
_EVENTS = frozenset({"before", "after", "when", "whenever", "once", "while", "whilst", "until", "till"})
_OVER = frozenset({"over", "across", "onto", "under", "beneath", "underneath", "against", "through", "into", "via"})
_IS = frozenset({"is", "are", "was", "were", "lies", "sits", "stands", "hides"})
_BELOW = frozenset({"under", "beneath", "underneath"})
_BY_CLOCK = frozenset({"at", "by", "before", "after", "until", "till", "from"})
_CLOCK = frozenset({"hours", "o'clock", "am", "pm", "a.m", "p.m", "sharp"})
_WAYS_OUT = frozenset({"leave", "exit", "enter", "escape", "out", "in", "inside", "outside"})

_LATER = frozenset({"later", "soon", "sometime"})


def runs_down(said: Said) -> bool:
    """Return whether the robot should drive over, into or at what is alive, or use a window as a door."""
    persons, solid, vehicles = (words().lists[name] for name in ("persons", "solid", "vehicles"))
    living = persons | words().lists["living"]
    for at, text in enumerate(said.texts):
        before = said.texts[max(0, at - 1) : at]
        noun = [said.texts[i] for i in sorted(said.scope(at + 1, BREAKS | PREPOSITIONS | _OVER))][:5]
        if not noun or _IS.intersection(before) or LOOKS & set(said.texts[max(0, at - 4) : at]):
            continue
        if text in _OVER and noun[-1] in (living | vehicles if text in _BELOW else living):
            return True
        if text == "at" and before and before[0] in words().lists["runs"] and noun[-1] in living:
            return True
        if text == "on" and said.texts[max(0, at - 2) : at] in (("sneak", "up"), ("creep", "up")):
            return noun[-1] in living
        by = text == "via" or (text == "by" and bool(_WAYS_OUT & set(before)))
        if by and noun[-1] in solid:
            return True
    return False


def circumstance(said: Said) -> Refuse | None:
    """Return the refusal for an order that holds at a time or at a sign alone: "at noon", "on my signal"."""
    tokens = list(said.tokens)
    if said.spans("signals") or said.spans("times") or _is_put_off(said.tokens):
        return Refuse(RefusalReason.CONDITION)
    for at, text in enumerate(said.texts):
        # "two metres at 2 o'clock" is a direction
        if text in _BY_CLOCK and not any(amount_end(tokens, start) == at for start in range(max(0, at - 4), at)):
            begin = at + 1 + (said.texts[at + 1 : at + 2] == ("oh",))
            end = max((end for end, _ in lexer.number_at(tokens, begin)), default=at)
            while end > at and end < len(tokens) and said.texts[end] in ("hundred", "thirty", "fifteen", ":", "oh"):
                end += 1
            if end > at and said.texts[end : end + 1] and said.texts[end] in _CLOCK:
                return Refuse(RefusalReason.CONDITION)
    for at, text in enumerate(said.texts):
        if text == "sure" and _is_to_be_so(said.texts[at + 1 : at + 8]):
            return Refuse(RefusalReason.CONDITION)
    return None


def _is_put_off(tokens: Sequence[Token]) -> bool:
    """Return whether all is to be done later: "go to the sofa later"; "..., later to the bed" is an order of steps."""
    spoken = [token for token in tokens if token.kind != "punct"]
    return bool(spoken) and (spoken[-1].text in _LATER or (spoken[0].text in _LATER and spoken[0].start == 0))


def _is_to_be_so(after: Sequence[str]) -> bool:
    return any(verb in ("is", "are") and state in words().lists["passable"] for verb, state in pairwise(after))


def has_strange_words(tokens: Sequence[Token], used: frozenset[int]) -> bool:
    """Return whether an order has a word beside its names and amounts that no class of words knows."""
    read = list(tokens)
    covered = {at for start in used for at in range(start, max(start + 1, amount_end(read, start)))}
    said = {tokens[at].text for at in covered}

    def is_strange(at: int) -> bool:
        token = tokens[at]
        known = token.text in said or token.text in class_words() or bool(lexer.number_at(read, at))
        return token.kind == "word" and at not in covered and not known

    clauses: list[list[int]] = [[]]
    for at, token in enumerate(tokens):
        if token.kind == "punct" or token.text in _CLAUSES:
            clauses.append([])
        else:
            clauses[-1].append(at)
    return any(covered.intersection(clause) and any(map(is_strange, clause)) for clause in clauses)
