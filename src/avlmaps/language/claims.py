"""What the words of a sentence claim that no reading holds: rows of `claims.toml`, read by one matcher.

The networks point at names and amounts. Words between those can turn the meaning round ("leave the kitchen"). A row
says which words, of which readings, and what is done: a refusal or a question back, so that nothing moves on half of a
sentence.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache, partial

import msgspec

from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps.language import intents as act
from avlmaps.language.lexer import READS, Token, angle_at, begins_amount
from avlmaps.language.names import describes, is_entry, sounding_forms, sounds_like
from avlmaps.language.word_classes import filled, listed, load_word_classes, pattern_of, table, word_list

_ANSWERS = "it answers where things and sounds are, how many there are, and whether there is one."
_MARKS = {act.TargetKind.AREA: "@", act.TargetKind.SOUND: "$"}
_BEGIN = r"(?<![^ ^@$])[\^@$]?"  # of a word
_ENDS = frozenset(act.Pick(side) for side in ("left", "right", "north", "south", "east", "west"))
_VAGUE = frozenset({"a", "an", "one", "another"})


class Row(msgspec.Struct, rename={"of": "if"}):
    """A row of the table: which words, of which readings, and what is done of them; see `claims.toml`."""

    says: str
    of: frozenset[str] = frozenset()
    unless: frozenset[str] = frozenset()
    ask: str = ""
    refuse: act.RefusalReason | None = None
    choices: tuple[str, ...] = ()


claimed_words = partial(word_list, "claims")  # the words of a list


def is_alive(name: str) -> bool:
    """Return whether a name is of what comes and goes: a person, an animal, a vehicle."""
    alive = claimed_words("persons") | claimed_words("living") | claimed_words("passing")
    return not alive.isdisjoint(name.split()[-1:])


@cache
def reasons() -> Mapping[act.RefusalReason, frozenset[str]]:
    """Return for each reason of refusal the words of which one is said where it is the true one."""
    return {act.RefusalReason(name): frozenset(text.split()) for name, text in table("claims")["reasons"].items()}


@cache
def _known() -> Mapping[str, str]:
    book = table("claims")
    known = {name: f"{_BEGIN}(?:{'|'.join(map(re.escape, text.split()))}) " for name, text in book["lists"].items()}
    known |= {name: f"{_BEGIN}(?:{pattern_of(text)})" for name, text in book["phrases"].items()}
    also = {"colours": lexicon().colours, "choices": listed("choices")}
    known |= {name: f"{_BEGIN}(?:{'|'.join(map(re.escape, words))}) " for name, words in also.items()}
    for name, text in book["patterns"].items():
        known[name] = filled(text, known)
    return known


@cache
def _rows(kind: str) -> Sequence[Row]:
    return msgspec.convert(table("claims")[kind], list[Row])


@cache
def _pattern(says: str) -> re.Pattern[str]:
    return re.compile(f"(?<![^ ^@$])(?:{filled(says, _known())})")


class _Marked:
    """A sentence as rows see it: its names with marks, its amounts and files as one word each."""

    def __init__(self, tokens: Sequence[Token], used: frozenset[int] | None, kinds: Mapping[str, str]) -> None:
        self.tokens, self.text = list(tokens), " "
        self._starts, at = list[tuple[int, int]](), 0
        while at < len(tokens):
            self._starts.append((len(self.text), at))
            at, word = self._word(self.tokens, at, used, kinds)
            self.text += f"{word} "
        self._starts.append((len(self.text), len(tokens)))

    @staticmethod
    def _word(tokens: list[Token], at: int, used: frozenset[int] | None, kinds: Mapping[str, str]) -> tuple[int, str]:
        token = tokens[at]
        if token.kind in ("image", "clip"):
            return at + 1, "‹file›" if used is None or at in used else "‹file!›"
        ends = {name: max((end for end, _ in read(tokens, at)), default=at) for name, read in READS.items()}
        name = max(ends, key=ends.__getitem__)
        reads = used is None or not used.isdisjoint(range(at, ends[name]))
        counted = ends[name] < len(tokens) and tokens[ends[name]].text in claimed_words("counted")
        counts = name != "n" or token.kind == "number" or counted
        if ends[name] > at and counts and token.text not in kinds and (reads or token.text not in _VAGUE):
            return ends[name], f"‹{name}›" if reads else f"‹{name}!›"
        named = used is not None and at in used and (token.text in kinds or not begins_amount(token))
        return at + 1, f"{kinds.get(token.text, '^') if named else ''}{token.text}"

    def said(self, start: int, end: int) -> str:
        """Return the words of the sentence from one character of the text to another."""
        first = max((at for begin, at in self._starts if begin <= start), default=0)
        last = min((at for begin, at in self._starts if begin >= end), default=len(self.tokens))
        return " ".join(token.text for token in self.tokens[first:last])


def _first(kind: str, marked: _Marked, facts: frozenset[str]) -> act.Refuse | act.Clarify | None:
    for row in _rows(kind):
        claims = row.unless.isdisjoint(facts) and not any(facts.isdisjoint(one.split("|")) for one in row.of)
        if not claims or (found := _pattern(row.says).search(marked.text)) is None:
            continue
        start, end = next((found.span(name) for name in found.groupdict() if found[name]), found.span())
        said = marked.said(start, end)
        asks = row.ask.format(said=said)
        if row.refuse is not None:
            return act.Refuse(row.refuse, asks)
        choices = tuple(choice.format(said=said) for choice in row.choices)
        return act.Clarify(asks or f"A map does not know '{said}'; {_ANSWERS}", choices)
    return None


def claimed(kind: str, tokens: Sequence[Token], named: frozenset[int] | None = None) -> act.Refuse | act.Clarify | None:
    """Return the refusal or question for words that no reading could make good; None without such.

    Of a command they are ``words``, of one that lacks something ``unclear`` (``named`` are the words of known names),
    of a question ``unanswered``.
    """
    return _first(kind, _Marked(tokens, named, {}), frozenset())


def unmet(
    tokens: Sequence[Token], intents: Sequence[act.Intent], used: frozenset[int]
) -> act.Refuse | act.Clarify | None:
    """Return the refusal or question for what a command claims and a reading does not do; None where it does all."""
    targets = [each for intent in intents for one in act.targets_of(intent) for each in (one, *one.near)]
    return _first("command", _Marked(tokens, used, _kinds(targets)), frozenset(_facts(intents, targets)))


def unmet_by(tokens: Sequence[Token], inquiry: act.Inquiry, used: frozenset[int]) -> str | None:
    """Return the question back for what a question claims and its reading leaves out; None where it does all."""
    targets = [each for one in inquiry.of for each in (one, *one.near)]
    marked = _Marked(tokens, used, _kinds(targets))
    facts = {str(inquiry.ask), *_facts_of_targets(targets)} | ({"several"} if len(inquiry.of) > 1 else set())
    about = inquiry.of[0] if inquiry.of else None
    if about is not None and about.kind in (act.TargetKind.SOUND, act.TargetKind.CLIP):
        facts |= {"sound"} | ({"heard sound"} if claimed_words("heard") & {token.text for token in tokens} else set())
        facts |= {"no sound"} if "heard sound" not in facts and not _sounds(about.name) else set()
    facts |= {token.kind for token in tokens if token.kind in ("clip", "image")}
    if inquiry.ask is act.Ask.EXISTS or _pattern("{ask}").search(marked.text):
        facts.add("whether")
    found = _first("question", marked, frozenset(facts))
    return None if found is None else getattr(found, "question", "A map cannot answer this.")


def at_each(tokens: Sequence[Token], intents: Sequence[act.Intent]) -> tuple[act.Intent, ...]:
    """Return intents with a wait inside the visit before it where the words say so: "wait 5 seconds at each"."""
    told = list(intents)
    says = _pattern("{at_each}").search(f" {' '.join(token.text for token in tokens)} ")
    for at in range(len(told) - 2, -1, -1) if says else ():
        visit, there = told[at : at + 2]
        if isinstance(visit, act.VisitEach) and isinstance(there, act.Wait):
            told[at : at + 2] = [replace(visit, body=(there,))]
    return tuple(told)


def in_direction(tokens: Sequence[Token], intents: Sequence[act.Intent]) -> tuple[act.Intent, ...] | act.Clarify:
    """Return intents whose circles run in the direction that is said, or the question which one is meant."""
    steps = act.steps_of(intents)
    turns = any(isinstance(step, act.Turn) for step in steps)
    senses = {word: sense for sense in act.TurnSense if sense for word in claimed_words(sense)}
    said = ((at, token.text) for at, token in enumerate(tokens))
    ways = [senses[word] for at, word in said if word in senses and not (turns and _turns(tokens, at))]
    circles = sum(isinstance(step, act.Circle) for step in steps)
    if not circles or not ways:
        return tuple(intents)
    if len(ways) != circles:
        return act.Clarify("Which way round? Say it for each: go clockwise around the table.")
    left = iter(ways)

    def turned(intent: act.Intent) -> act.Intent:
        intent = act.within(intent, turned)
        return replace(intent, way=next(left)) if isinstance(intent, act.Circle) else intent

    return tuple(map(turned, intents))


def _turns(tokens: Sequence[Token], at: int) -> bool:
    cuts = [number for number, token in enumerate(tokens) if token.kind == "punct" or token.text in ("then", "and")]
    start = max((cut for cut in cuts if cut < at), default=-1)
    clause = list(tokens[start + 1 : min((cut for cut in cuts if cut > at), default=len(tokens))])
    turns = load_word_classes().words["TURN_HERE"]
    orders = {token.text for token in clause} & turns - {"turning", "rotating"}  # "circle it, turning clockwise"
    return bool(orders) or any(angle_at(clause, number) for number in range(len(clause)))


def _sounds(name: str) -> bool:
    words = name.split()
    known = any(lexicon().find(" ".join(words[at:]), EntryKind.SOUND) for at in range(len(words)))
    told = sounding_forms().keys() | claimed_words("ringers")
    return known or any(sounds_like(word) or word in told for word in words)


def _kinds(targets: Sequence[act.Target]) -> dict[str, str]:
    return {word: _MARKS.get(target.kind, "^") for target in targets for word in target.name.split()}


def _facts_of_targets(targets: Sequence[act.Target]) -> Iterator[str]:
    for target in targets:
        if target.pick:
            yield str(target.pick)
        if target.number > 1:
            yield "number"
        if target.pick in _ENDS:
            yield "end"
        if target.near:
            yield from ("near", "room near") if target.kind is act.TargetKind.AREA else ("near",)
        if target.kind is act.TargetKind.SOUND:
            yield "sound"
        *before, last = target.name.split() or ("",)
        if before and any(lexicon().find(target.name, kind) for kind in (EntryKind.THING, EntryKind.ROOM)):
            yield from ("entry", "positioned") if before[0] in claimed_words("positions") else ("entry",)
        elif before and is_entry(" ".join(before)) and not is_entry(target.name):
            yield from ("stated", "described") if describes(last) and not is_entry(last) else ("stated",)
    if len(targets) == 1:
        yield "one name"


def _facts(intents: Sequence[act.Intent], targets: Sequence[act.Target]) -> Iterator[str]:
    """Yield what a reading of a command does, in the words of `if` and `unless`."""
    yield from _facts_of_targets(targets)
    if len({one for intent in intents for one in act.targets_of(intent) if one.kind is act.TargetKind.OBJECT}) < 2:
        yield "one thing"
    for intent in act.every(intents):
        if isinstance(intent, act.If):
            yield from ("if", "if alive") if is_alive(intent.of.name) else ("if",)
        yield from (act.Filled().vformat(fact, (), act.values_of(intent)) for fact in act.row_of(intent).facts)
    if len(act.steps_of(intents)) == 1:
        yield "one step"
