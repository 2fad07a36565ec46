"""Words that no reading of a command could make good: signs of numbers, dangers, walls to drive through, questions."""

from collections.abc import Sequence
from itertools import pairwise

from avlmaps.language import lexer
from avlmaps.language.intents import Clarify, RefusalReason, Refuse
from avlmaps.language.learned.accounted import circumstance, runs_down
from avlmaps.language.learned.linear import amount_end
from avlmaps.language.learned.said import BREAKS, HEARD, LOOKS, PREPOSITIONS, TURNS, Said, words
from avlmaps.language.lexer import Token

_ROUND = frozenset({"left", "right", "clockwise", "counterclockwise", "anticlockwise", "cw", "ccw"})
_FAST_AS = {("fast", "as"), ("quick", "as"), ("quickly", "as"), ("hard", "as")}
_SHARES = frozenset(
    {"part", "some", "most", "third", "thirds", "quarter", "quarters", "fifth", "fifths", "percent", "%"}
)
_MOTIONS_WITH_SIGN = frozenset({"move", "translate", "forward", "forwards", "back", "drive", "advance"})


def forbidden(tokens: Sequence[Token]) -> Clarify | Refuse | None:
    """Return the refusal or question for words that no reading of a command could make good; None where there are none.

    They are signs of numbers, dangers that the robot should not see, walls to drive through, and questions.
    """
    said = Said(tokens)
    if said.spans("unsafe") or _through(said) or _races(said) or runs_down(said):
        return Refuse(RefusalReason.HARM)
    if said.spans("bans") or any(_ends_with(said, end) for _, end in said.spans("cancels")):
        return Refuse(RefusalReason.NEGATION)
    conditions = [at for at, _ in said.spans("conditions") if said.texts[at - 1 : at] not in (("as",), ("even",))]
    if conditions or _alternative(said):
        return Refuse(RefusalReason.CONDITION)
    if said.spans("risks") or said.spans("questions"):
        return Refuse(RefusalReason.QUESTION)
    return circumstance(said) or _timed(said) or _signed(said) or _scaled(said)


def is_stop(tokens: Sequence[Token]) -> bool:
    """Return whether a command says to stop, and nothing else: "stop!", "halt, please"."""
    texts = [token.text for token in tokens if token.kind != "punct"]
    lists = words().lists
    return any(text in lists["stops"] for text in texts) and all(
        text in lists["stops"] or text in lists["beside_stops"] or text in lists["robots"] for text in texts
    )


def _ends_with(said: Said, end: int) -> bool:
    """Return whether nothing of weight is said from a place on."""
    rest = [text for at, text in enumerate(said.texts[end:], end) if said.tokens[at].kind != "punct"]
    return all(
        text in ("please", "sorry", "robot", "thanks", "ok", "haha", "lol", "it", "that", "all") for text in rest
    )


def _through(said: Said) -> bool:
    """Return whether the robot should drive through what is solid, or into what hurts it or others."""
    lists = words().lists
    for at, text in enumerate(said.texts):
        if text not in ("through", "thru", "into", "onto") or (LOOKS | HEARD) & set(said.texts[max(0, at - 4) : at]):
            continue
        noun = [said.texts[i] for i in sorted(said.scope(at + 1, BREAKS | PREPOSITIONS))][:5]
        if noun[:1] and noun[-1:] and (lists["solid" if text[:2] == "th" else "deadly"] & set(noun[-1:])):
            return True
        if text[:2] == "th" and lists["blocked"] & set(noun[:-1]):
            return True
    return False


def _races(said: Said) -> bool:
    """Return whether the robot should race as fast as it can: "race to the door as fast as u can"."""
    fast = [pair for pair in pairwise(said.texts) if pair in _FAST_AS]
    return bool(fast) and not words().lists["racing"].isdisjoint(said.texts)


def _alternative(said: Said) -> bool:
    """Return whether an order holds only where another does not: "check the hall, else go to the door"."""
    others = words().lists["others"]
    for at, text in enumerate(said.texts):
        told = said.texts[max(0, at - 1) : at] in (("told",), ("said",), ("instructed",))
        if (text == "otherwise" and not told) or (text == "else" and at and said.texts[at - 1] not in others):
            return bool(said.scope(at + 1)) or any(token.kind == "word" for token in said.tokens[at + 1 :])
    return False


def _timed(said: Said) -> Clarify | Refuse | None:
    """Return the question for a time that is no wait: a deadline, a rhythm, a time to drive for."""
    tokens = list(said.tokens)
    for at, text in enumerate(said.texts):
        ends = [end for end, _ in lexer.duration_at(tokens, at + 1)]
        if not ends:
            continue
        phrase = " ".join(said.texts[at : max(ends)])
        if text == "within" or said.texts[max(0, at - 2) : at + 1] == ("in", "less", "than"):
            return Clarify(f"'{phrase}': the robot knows no deadline. Say only where to go.")
        if text == "every":
            return Refuse(RefusalReason.ENDLESS)
        if text == "for" and at and said.texts[at - 1] in words().lists["drives"]:
            return Clarify(f"'{phrase}': say how far to drive or to turn, not how long.")
    return None


def _signed(said: Said) -> Clarify | None:
    """Return the question for a number with a sign: -90 degrees are right for some and left for others."""
    tokens = list(said.tokens)
    for at, text in enumerate(said.texts):
        if text in ("<", ">") and tokens[at].raw == text and lexer.number_at(tokens, at + 1):
            return Clarify(f"What does '{text} {said.texts[at + 1]}' mean? Say only where to go.")
        behind = any(amount_end(tokens, start) == at for start in range(max(0, at - 4), at))
        if text in ("negative", "minus") and behind and not lexer.number_at(tokens, at + 1):
            return Clarify(f"What does the {text} behind the number mean? Say it without a sign.")
        if text not in ("minus", "negative", "plus", "-", "+", "±") or not _is_number(tokens, at + 1, text):
            continue
        if text == "-" and not (at and said.texts[at - 1] in (TURNS | words().lists["signed"])):
            continue
        end = amount_end(tokens, at + 1)
        sign = "-" if text in ("minus", "negative", "-") else text.replace("plus", "+")
        number = " ".join(said.texts[at + 1 : end])
        turns = bool(lexer.angle_at(tokens, at + 1)) or bool(TURNS & set(said.texts[:at]))
        if sign == "+" and not (turns and _ROUND.isdisjoint(said.texts)):
            continue
        if not turns and not _MOTIONS_WITH_SIGN & set(said.texts[:at]):
            return Clarify(f"What does the sign of {sign}{number} mean? Say it without a sign.")
        left, right = ("turn left", "turn right") if turns else ("move back", "move forward")
        choices = (f"{left} {number}", f"{right} {number}")
        return Clarify(f"What does the sign of {sign}{number} mean? Say {choices[0]} or {choices[1]}.", choices)
    return None


def _scaled(said: Said) -> Clarify | None:
    """Return the question for what another number or side is meant by: "half of 90 degrees", "your other left"."""
    tokens = list(said.tokens)
    for start, end in said.spans("scales"):
        vague = said.texts[end : end + 1] in (
            ("a",),
            ("an",),
            ("the",),
        )  # "a quarter of an hour" is an amount of its own
        if not vague and lexer.number_at(tokens, end):
            phrase = " ".join(said.texts[start : amount_end(tokens, end)])
            return Clarify(f"How much is '{phrase}'? Say the number alone.")
    for at in range(1, len(said.texts) - 2):
        part, after = said.texts[at - 1], set(said.texts[at + 3 : at + 4])
        if said.texts[at : at + 3] == ("of", "the", "way") and part in _SHARES and not after & {"round", "around"}:
            phrase = " ".join(said.texts[at - 1 : at + 3])
            return Clarify(f"How far is '{phrase}'? Say a distance, such as: go 1 m towards the sofa.")
    for before, side in pairwise(said.texts):
        if before in ("other", "wrong") and side in ("left", "right"):
            return Clarify(f"Is '{before} {side}' left or right?", ("left", "right"))
    return None


def _is_number(tokens: list[Token], at: int, sign: str) -> bool:
    """Return whether a number begins at a token, or behind a sign in words an amount without one: "minus a metre"."""
    return bool(lexer.number_at(tokens, at)) or (sign in ("minus", "negative") and lexer.is_amount(tokens, at))
