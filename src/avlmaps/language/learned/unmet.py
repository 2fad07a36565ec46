"""What the words between names and amounts claim, and whether a reading does it: distance to keep, exceptions, sides.

The networks point at names and amounts. Words that stand between them can turn the meaning round ("leave the kitchen",
"the chair farthest from the door"). A rule finds such words and says which reading does what they ask; every other
reading becomes the rule's question, so that nothing moves on half of a sentence.
"""

from collections.abc import Callable, Sequence
from itertools import pairwise

from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps.language import lexer
from avlmaps.language.intents import (
    Ask,
    Beside,
    Clarify,
    Face,
    Go,
    Inquiry,
    Intent,
    Move,
    Pick,
    RefusalReason,
    Refuse,
    Side,
    StopAt,
    TargetKind,
    Turn,
    VisitEach,
)  # fmt: skip
from avlmaps.language.learned.answerable import unanswerable
from avlmaps.language.learned.linear import amount_end
from avlmaps.language.learned.said import BREAKS, DETERMINERS, HEARD, LOOKS, PREPOSITIONS, Claimed, Said, words
from avlmaps.language.learned.ways import directions
from avlmaps.language.lexer import Token
from avlmaps.language.rephrase import compass_point
from avlmaps.perception.embedded.words import is_word

_MOTIONS = frozenset({"go", "drive", "head", "move", "turn", "face", "visit", "come", "do"})
_ANYTHING = frozenset({"something", "anything", "somewhere", "anywhere", "someplace"})
_ONLY_ORDERS = frozenset({("skip",), ("skipping",), ("avoid",), ("avoiding",), ("exclude",), ("bypass",), ("never",)})
_ORDINALS = frozenset({"second", "third", "fourth", "fifth", "last", "next", "previous"})
_NUMBERED = frozenset({"floor", "class", "storey", "story", "level", "hand"})
_HAND_NOUNS = frozenset({"side", "rail", "wash", "basin", "dryer", "towel"})
_AHEAD = frozenset({"forward", "forwards", "ahead", "straight"})
_BACKWARDS = frozenset({"backward", "backwards", "reverse", "reversing"})
_VAGUE = frozenset({"a", "an", "one", "another"})
_NO_QUALITIES = frozenset({"near", "close", "far", "distant", "of", "likely", "probable"})
_COUNTED_ON = frozenset({"nearest", "closest", "farthest", "furthest", "next", "last", "first"})
_FAR_BACK = 4
_ONES = (("the", "one"), ("the", "ones"))
_ONE_TO_A_SIDE = tuple(("then", "one", "to", "the", side) for side in ("left", "right"))
_OF_SIDES = (("of",), ("side",), ("from",))
_PARTS_OF_HOURS = frozenset({"half", "quarter", "past"})
_COUNTED = frozenset({"times", "turns", "revolutions", "rotations", "spins", "laps", "rounds", "circles", "loops"})


def _away(said: Claimed) -> Clarify | None:
    """Return the question for what should be far off: only a distance in metres, or one's back to it, does that."""
    kept = any(
        isinstance(one, StopAt)
        or (isinstance(one, Beside) and one.metres is not None)
        or (isinstance(one, Face) and one.side is Side.BEHIND)
        or (isinstance(one, Move) and one.metres < 0)
        for one in said.steps
    )
    picked = any(target.pick is Pick.FARTHEST for target in said.targets)
    for start, end in said.spans("away"):
        scope = said.scope(end, BREAKS - {"to"})
        before = said.texts[max(0, start - 2) : start]
        about = said.content(scope)
        if "not" in before or "equally" in before or kept:
            continue
        if set(about[:2]) <= words().lists["here"] and (picked or said.texts[end - 1 : end] == ("from",)):
            continue
        if picked and "from" not in said.texts[start : end + 1]:
            continue
        return Clarify(
            f"'{said.said(start, scope)}': the robot can keep a distance in metres, such as: stop 2 m from the table. "
            "Else name the place where it should go."
        )
    return None


def _picked(said: Claimed) -> Clarify | None:
    """Return the question for "the farthest" that is not picked, or that is not counted from the robot."""
    far = said.spans("farthest")
    far_picks = [target for target in said.targets if target.pick is Pick.FARTHEST]
    for start, end in (*far, *said.spans("nearest")):
        if start and said.texts[start - 1] in words().lists["ordinals"]:
            phrase = " ".join(said.texts[start - 1 : end])
            return Clarify(f"I cannot choose the {phrase} from the map. Say what it is near.")
    for at in (at for at, pair in enumerate(pairwise(said.texts)) if pair == ("but", "one")):
        phrase = next((said.texts[i:] for i in range(max(0, at - _FAR_BACK), at) if said.texts[i] in _COUNTED_ON), ())
        if phrase and (at + 2 == len(said.texts) or said.tokens[at + 2].kind == "punct"):  # "the nearest lamp but one"
            return Clarify(f"I cannot choose the {phrase[0]} but one from the map. Say what it is near.")
    if not far and far_picks and not {"far", "most", "farther", "further"} & set(said.texts):
        return Clarify("Which one of them? Say what it is near.")
    for _, end in far:
        after = said.texts[end : end + 5]
        at = next((at for at, word in enumerate(after) if word in ("from", "to")), None)
        if at is not None and not any(token.kind == "punct" for token in said.tokens[end : end + at]):
            about = said.content(said.scope(end + at + 1))
            if after[at] == "from" and not set(about[:1]) <= words().lists["here"]:
                return Clarify("The farthest is counted from the robot. Say what it is near, or its room.")
        if not far_picks:
            return Clarify("The farthest of what? Say it like: go to the farthest chair.")
    return None


def _beside_one(said: Claimed) -> Clarify | None:
    """Return the question for "beside the one in the kitchen": a thing that has no name, and is no goal of its own."""
    for at, pair in enumerate(pairwise(said.texts)):
        begin = at - 1 - (said.texts[at - 1 : at] == ("to",))
        another = pair in _ONES and said.texts[at - 1 : at] in (("and",), ("then",)) and _is_place(said, at + 2)
        if another and len({target for target in said.targets if target.kind is TargetKind.OBJECT}) < 2:
            return Clarify(f"'{said.said(at, said.scope(at))}': say its name again, such as: and the chair there.")
        if pair in _ONES and at and said.texts[begin] in words().lists["beside"]:
            scope = said.scope(at + 2)
            if scope:
                return Clarify(f"'{said.said(begin, scope)}': 'one' is no name there; name the thing, or its room.")
    return None


def _is_place(said: Claimed, at: int) -> bool:
    return at < len(said.texts) and said.texts[at] in words().lists["beside"] | PREPOSITIONS


def _compass(said: Claimed) -> Clarify | None:
    """Return the question for a point of the compass that no step turns to: "go north, east 2 m"."""
    headings = {one.heading for one in said.steps if isinstance(one, Turn) and one.heading is not None}
    if not headings:
        return None
    at = 0
    while at < len(said.texts):
        size, degrees = compass_point(said.texts[at : at + 2])
        after = said.texts[at + size : at + size + 1]
        if degrees is not None and degrees not in headings and at not in said.named and after not in _OF_SIDES:
            return Clarify("Which way? Say one direction and one distance in each step.")
        at += size
    return None


def _leaving(said: Claimed) -> Clarify | None:
    """Return the question for a place that should be left and is driven to."""
    for start, end in said.spans("leaving"):
        verb = said.texts[end - 1] != "of"
        if verb and not (said.is_order(start) and said.texts[end : end + 1] and said.texts[end] in DETERMINERS):
            continue
        scope = said.scope(end, BREAKS | PREPOSITIONS)
        last = {"last", "end"} & set(said.texts[max((*scope, end)) + 1 :][:3])
        if said.names_in(scope) and not last and not LOOKS & set(said.texts[max(0, start - 1) : start]):
            return Clarify(f"'{said.said(start, scope)}': where should the robot go? Name the place.")
    return None


def _outside(said: Claimed) -> Clarify | None:
    """Return the question for "outside the kitchen": a reading has the kitchen, and no map has a name for outside."""
    openings = words().lists["openings"]
    beside = any(isinstance(one, Beside) for one in said.steps)
    for start, end in said.spans("outside"):
        if said.texts[start] == "beyond" and beside:
            continue
        scope = said.scope(end, BREAKS | PREPOSITIONS)
        corridor = any(
            one.kind is TargetKind.AREA and one.near for one in said.targets
        )  # "the hall outside the kitchen"
        if not corridor and said.names_in(scope) and openings.isdisjoint(said.texts[at] for at in scope):
            return Clarify(f"'{said.said(start, scope)}': what is there? Name a place or a thing, such as its door.")
    return None


def _through(said: Claimed) -> Clarify | None:
    """Return the question for a thing to drive through that is no way through: "through the boxes"."""
    for at, text in enumerate(said.texts):
        if text not in ("through", "thru") or (LOOKS | HEARD) & set(said.texts[max(0, at - 4) : at]):
            continue
        scope = said.scope(at + 1, (BREAKS | PREPOSITIONS) - {"of"})
        inside = {said.texts[i] for i in scope}
        for target in said.targets:
            head = target.name.split()[-1:]
            if target.kind is TargetKind.OBJECT and set(head) <= inside - words().lists["openings"]:
                return Clarify(
                    f"'{said.said(at, scope)}': the robot drives through rooms and doors. Say past it, or name a door."
                )
    return None


def _edges(said: Claimed) -> Clarify | None:
    """Return the question for a place behind a wall or a window: the map ends there; and for the end of a room."""
    for one in said.steps:
        if isinstance(one, Beside) and one.of.kind is TargetKind.AREA and ("end", "of") in pairwise(said.texts):
            return Clarify(f"What is at the end of the {one.of.name}? Name it.")
        if isinstance(one, Beside) and one.side is Side.BEHIND and one.of.name.split()[-1:]:
            head = one.of.name.split()[-1]
            if one.of.kind is TargetKind.OBJECT and head in words().lists["edges"]:
                return Clarify(f"What is behind the {head}? Name the room or the thing there.")
    return None


def _qualities(said: Claimed) -> Clarify | None:
    """Return the question for "the state of the stove": what a thing has, and the map does not hold."""
    lists = words().lists
    names = {target.name for target in said.targets if not _is_entry(target.name)}
    last = {name.split()[-1] for name in names if name}
    for at, text in enumerate(said.texts):
        if text in lists["qualities"] and (text in last or said.texts[at + 1 : at + 2] == ("of",)):
            return Clarify(f"A map does not hold the {text} of things; ask where they are, or how many.")
    return None


def _no_thing(said: Claimed) -> Refuse | None:
    """Return the refusal for "no kitchen" that is driven to."""
    for at, (before, after) in enumerate(pairwise(said.texts)):
        if before == "no" and _is_entry(after) and said.names_in({at + 1}):
            return Refuse(RefusalReason.NEGATION)
    return None


def _excluded(said: Claimed) -> Clarify | Refuse | None:
    """Return the refusal for what is not meant and is driven to, or is left out though it says which is meant."""
    choosing = {phrase for each in words().phrases["choosing"].values() for phrase in each}
    breaks = BREAKS - {"to", "for", "after", "before"}
    for start, end in said.spans("excluded"):
        phrase = said.texts[start:end]
        if phrase in _ONLY_ORDERS and not said.is_order(start):
            continue
        scope = said.scope(end, breaks)
        again = min((at for at in scope if at > end + 1 and said.texts[at] in _MOTIONS), default=len(said.tokens))
        scope = frozenset(at for at in scope if at < again)
        idiom = said.texts[end : end + 1] in (("forget",), ("mind",), ("hesitate",), ("worry",), ("suppose",)) or (
            said.texts[max(0, start - 1) : start] in (("why",), ("if",))
        )
        if idiom:
            continue
        lacks = phrase in choosing or (
            phrase == ("without",) and not words().lists["manners"].intersection(said.texts[end : end + 1])
        )
        if said.names_in(scope) or (lacks and scope):
            return Refuse(RefusalReason.NEGATION)
        one = said.texts[end : end + 1] in (("one",), ("ones",)) and len(said.content(scope)) > 1
        if one and phrase[0] in ("not", "but", "and") and not any(t.pick is Pick.OTHER for t in said.targets):
            return Refuse(RefusalReason.NEGATION)
    return None


def _changed(said: Claimed) -> Clarify | None:
    """Return the question for "the chair that is gone": a reading goes to a chair that is there."""
    found = said.spans("changed")
    if not found:
        return None
    phrase = " ".join(said.texts[slice(*found[0])])
    return Clarify(
        f"'{phrase}': a name does not say what has changed. Ask what changed, or where it was last seen; then name its "
        "place."
    )


def _ways(said: Claimed) -> Clarify | None:
    """Return the question for a wall or a path that should be followed and is driven to."""
    for start, end in said.spans("ways"):
        scope = said.scope(end, BREAKS | PREPOSITIONS)
        if said.texts[start] in words().lists["lines"]:
            return Clarify("The robot cannot follow a wall or a line. Name the place where it should go.")
        if end == start + 1 and said.texts[end : end + 1] and said.texts[end] not in DETERMINERS:
            continue
        if not words().lists["lines"].intersection(said.texts[at] for at in scope):
            continue
        if said.named and said.named <= scope:
            return Clarify(
                f"'{said.said(start, scope)}': the robot cannot follow a wall or a path. Name the place at its end."
            )
    return None


def _superlatives(said: Claimed) -> Clarify | None:
    """Return the question for "the quietest room", "the second door": no map says which that is."""
    for target in said.targets:
        for name in (target.name.split(), *(near.name.split() for near in target.near)):
            if len(name) > 2 and name[0] in ("left", "right") and name[1] == "hand" and name[2] not in _HAND_NOUNS:
                return Clarify(f"I cannot choose the {' '.join(name)} from the map. Say what it is near.")
            if len(name) > 1 and name[0] in _ORDINALS and name[1] not in _NUMBERED and not _is_entry(" ".join(name)):
                return Clarify(f"I cannot choose the {' '.join(name)} from the map. Say what it is near.")
    for at, (side, noun) in enumerate(pairwise(said.texts)):
        placed = side in words().lists["positions"] and at + 1 in said.named and not _is_entry(f"{side} {noun}")
        if placed and at and said.texts[at - 1] in DETERMINERS:
            return Clarify(f"I cannot choose the {side} {noun} from the map. Say what it is near.")
    for at, text in enumerate(said.texts):
        if at in said.named and (is_superlative(text) or said.texts[max(0, at - 2) : at] == ("the", "most")):
            return Clarify(f"I cannot choose the {text} from the map. Say what it is near.")
        if (
            text in ("most", "least")
            and at
            and said.texts[at - 1] == "the"
            and said.texts[at - 2 : at - 1] != ("in",)
            and _is_quality(said, at + 1)
        ):
            return Clarify(f"I cannot choose by '{text} {said.texts[at + 1]}' from the map. Name the thing.")
    return None


def _is_entry(name: str) -> bool:
    return any(lexicon().find(name, kind) is not None for kind in (EntryKind.THING, EntryKind.ROOM))


def _is_quality(said: Claimed, at: int) -> bool:
    return at < len(said.texts) and said.texts[at] not in _NO_QUALITIES


def is_superlative(word: str) -> bool:
    """Return whether a word is the highest degree of an adjective: "quietest"."""
    if not word.endswith("est") or len(word) < 6 or word in words().lists["no_superlatives"]:
        return False
    if any(lexicon().find(word, kind) is not None for kind in (EntryKind.THING, EntryKind.ROOM)):
        return False
    stem = word.removesuffix("est")
    stems = (
        stem,
        stem + "e",
        stem[:-1] if stem[-1:] == stem[-2:-1] else stem,
        stem[:-1] + "y" if stem[-1:] == "i" else stem,
    )
    return any(is_word(one) for one in stems)


def _nameless(said: Claimed) -> Clarify | None:
    """Return the question for "my room", "something to sit on": a name that leaves open which one."""
    for before, text in pairwise(said.texts):
        if before in ("to", "towards", "toward", "find", "visit", "near", "approach") and text in _ANYTHING:
            return Clarify(f"Which thing is '{text}'? Name it.")
    lists = words().lists
    for at in said.named:  # "a safe place" is no safe
        after = said.texts[at + 1] if at + 1 < len(said.texts) else ""
        vague = said.texts[at - 1 : at] in (("somewhere",), ("someplace",), ("anywhere",))
        if said.texts[at] in lists["states"] and (vague or (after in lists["anyone"] and at + 1 not in said.named)):
            return Clarify("Which place? Name it, or say what it is near.")
    every = {one.of for one in said.steps if isinstance(one, VisitEach)}
    for target in said.targets:
        if target in every:
            continue
        bare = target.name.split()
        if (
            len(bare) == 1
            and bare[0] in lists["things"]
            and {one.kind for one in target.near} <= {TargetKind.OBJECT, TargetKind.AREA}
        ):
            return Clarify(f"Which {bare[0]}? Name it.")
        if bare and bare[-1] in words().lists["anyone"] and not target.near and not target.pick and _says_nothing(bare):
            likely = next((w for w in ("likely", "probable", "probably") if w in said.texts), None)
            why = " The map does not know what is likely." if likely else ""
            return Clarify(f"Which {bare[-1]}? Name it, or say what it is near.{why}")
    return None


def _says_nothing(bare: Sequence[str]) -> bool:
    lists, name = words().lists, " ".join(bare)
    empty = DETERMINERS | lists["anyone"] | lists["states"] | {"'s", "robot"}
    return all(word in empty for word in bare) and (len(bare) == 1 or not _is_entry(name))


def _unread(said: Claimed) -> Clarify | None:
    """Return the question for a file that no step uses."""
    for token in said.tokens:
        if token.kind in ("image", "clip") and token.text not in {
            each.name for target in said.targets for each in (target, *target.near)
        }:
            what = "picture" if token.kind == "image" else "recording"
            return Clarify(f"What is the {what} {token.text} for? Say it like: the chair near the {what} {token.text}.")
    return None


def _amounts(said: Claimed) -> Clarify | None:
    """Return the question for a distance, an angle or a time with its unit that no step uses."""
    tokens = list(said.tokens)
    if words().lists["corrections"] & set(said.texts):
        return None
    read = {at for start in said.used for at in range(start, max(start + 1, amount_end(tokens, start)))}
    for at, token in enumerate(tokens):
        if lexer.clock_at(tokens, at) and _PARTS_OF_HOURS & set(said.texts[max(0, at - 2) : at]):
            return Clarify("Which way? Say a whole hour, such as: turn to your 2 o'clock, or degrees.")
        again = at > 0 and _goes_on(tokens, at)
        if said.texts[max(0, at - 1) : at + 4] in _ONE_TO_A_SIDE:
            return Clarify(f"'{' '.join(said.texts[at : at + 4])}': how far? Say it with its unit.")
        if (at in read and not again) or (token.kind != "number" and token.text in _VAGUE):
            continue
        if not (again or lexer.is_measure(tokens, at) or _is_count(tokens, at)):
            continue
        phrase = " ".join(said.texts[at : amount_end(tokens, at)])
        return Clarify(f"What is '{phrase}' for? Say each step with its own distance, angle or time.")
    return None


def _goes_on(tokens: list[Token], at: int) -> bool:
    """Return whether a number follows a distance or an angle and nothing says what for: "1 m 5", "30 degrees 30 min".

    What the lexer reads as one amount ("1 m 20", "5 feet 3") is one.
    """
    ends = {
        max(end for end, _ in found)
        for start in range(max(0, at - _FAR_BACK), at)
        for read in (lexer.length_at, lexer.angle_at)
        if (found := read(tokens, start))
    }
    if at not in ends or not lexer.number_at(tokens, at) or tokens[at].text in _VAGUE:
        return False
    end = max(end for end, _ in lexer.number_at(tokens, at))
    bare = end == len(tokens) or tokens[end].kind == "punct" or tokens[end].text in ("and", "then")
    return bare or (bool(lexer.duration_at(tokens, at)) and bool(lexer.angle_at(tokens, at - 2)))


def _sides(said: Claimed) -> Clarify | None:
    """Return the question for a reading whose side is the other one than the side that is said."""
    not_meant = frozenset(at for start, end in said.spans("excluded") for at in said.scope(max(start, end - 1)))
    texts = {text for at, text in enumerate(said.texts) if at not in not_meant}
    left, right = "left" in texts, "right" in texts
    if any(pair in (("left", "right"), ("right", "left")) for pair in _either(said.texts)):
        return Clarify("Left or right?", ("left", "right"))
    moves = [one.metres for one in said.steps if isinstance(one, Move)]
    ahead, backwards = _AHEAD & texts, _BACKWARDS & texts
    turned = (min(moves, default=0.0) > 0 and backwards and not ahead) or (
        max(moves, default=0.0) < 0 and ahead and not backwards
    )
    if turned and not {"back", "around", "round"} & texts:
        return Clarify("Forward or back? Say it like: move back 1 m.", ("forward", "back"))
    ways = [way for _, way in directions(said.texts)]
    clockwise, counter = ("clockwise" in ways, "counterclockwise" in ways)
    if {"other", "back", "against", "opposite", "o'clock"} & set(said.texts):
        return None
    turns = [one.degrees for one in said.steps if isinstance(one, Turn) and one.degrees and one.degrees % 180.0]
    sides = {str(one.side) for one in said.steps if isinstance(one, Beside | Face)}
    lefts = "left" in sides or any(turn < 0 for turn in turns)
    rights = "right" in sides or any(turn > 0 for turn in turns)
    if (rights and (left or counter) and not right and not clockwise) or (
        lefts and (right or clockwise) and not left and not counter
    ):
        return Clarify("Left or right? Say it like: turn left 90 degrees.", ("left", "right"))
    if ((left and clockwise and not right) or (right and counter and not left)) and turns and len(said.steps) == 1:
        return Clarify("Left or right? Left is counterclockwise.", ("left", "right"))
    return None


def _either(texts: Sequence[str]) -> list[tuple[str, str]]:
    """Return the words on the two sides of each "or"."""
    return [(texts[at - 1], texts[at + 1]) for at in range(1, len(texts) - 1) if texts[at] == "or"]


def _is_count(tokens: list[Token], at: int) -> bool:
    """Return whether a number of turns or rounds begins at a token: "three full revolutions"."""
    for end, value in lexer.number_at(tokens, at):
        after = [token.text for token in tokens[end : end + 2] if token.text not in ("full", "complete", "whole")]
        if value > 1 and after[:1] and after[0] in _COUNTED:
            return True
    return False


_RULES: tuple[Callable[[Claimed], Clarify | Refuse | None], ...] = (
    _away, _picked, _beside_one, _compass, _leaving, _outside, _through, _edges, _no_thing, _excluded, _changed, _ways,
    _superlatives, _nameless, _unread, _amounts, _sides,
)  # fmt: skip


_ASKED: tuple[Callable[[Claimed], Clarify | Refuse | None], ...] = (
    _picked, _beside_one, _excluded, _changed, _superlatives, _nameless, _unread, _amounts, _qualities,
)  # fmt: skip


def unmet_by(tokens: Sequence[Token], inquiry: Inquiry, used: frozenset[int]) -> str | None:
    """Return the question back for what a question claims and its reading leaves out; None where it does all."""
    if Said(tokens).spans("risks"):
        return "A map cannot judge what is safe or allowed; ask where things and sounds are."
    said = Claimed(tokens, tuple(Go(target) for target in inquiry.of), used)
    if said.texts[:1] in (("which",), ("what",)) and words().lists["persons"] & set(said.texts[1:3]):
        return "A map does not know who is where; ask where things are, or where somebody was heard."
    if _away(said) is not None:
        return "A map finds what is near something, not what is far from it; say what it is near."
    if _outside(said) is not None:
        return "A map finds what is in or near something, not what is outside it; say what it is near."
    beyond = unanswerable(said, inquiry)
    if beyond is not None:
        return beyond
    rules = (rule for rule in _ASKED if inquiry.ask is Ask.WHERE or rule is not _nameless)
    found = next((found for rule in rules if (found := rule(said)) is not None), None)
    if isinstance(found, Refuse):
        return "A map finds what is named, not what is left out; say only what is sought."
    return None if found is None else found.question


def unmet(tokens: Sequence[Token], intents: Sequence[Intent], used: frozenset[int]) -> Clarify | Refuse | None:
    """Return the question or refusal for what a sentence claims and a reading does not do; None where it does all."""
    said = Claimed(tokens, intents, used)
    return next((found for rule in _RULES if (found := rule(said)) is not None), None)
