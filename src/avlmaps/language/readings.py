"""All readings of a sentence: its clauses, in order, with what joins them and what had to be skipped.

A reading is a path over the sentence: orders, names alone, statements, joining words and skipped words, each with a
cost. The cheapest readings come first; a skipped word costs much, a word that changes the meaning far more.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from typing import Any

from avlmaps.language import lexer
from avlmaps.language.chart import BuiltIn, Chart
from avlmaps.language.grammar import load_grammar
from avlmaps.language.lexer import Token
from avlmaps.language.names import Names
from avlmaps.language.spelling import respelt

MOST_READINGS = 4
_RUN_ON_REMARK = 0.9
_RUN_ON, _BARE, _MENTION, _REMARK, _REMARK_WORD = 0.8, 1.1, 0.9, 1.15, 0.04
_OWN_WISH = 0.7  # "I want to wash my hands, ..." says why
_WISHES = tuple([who, wish, "to"] for who in ("i", "we") for wish in ("want", "need", "have"))
_INTERJECTION, _CLAUSE, _FUNCTIONAL = 0.9, 0.7, 1.4
_PREPOSITIONS = frozenset({"of", "for", "from", "to", "at", "with", "in", "on"})
_SPEAKERS = frozenset({"i", "we", "one"})
_LEADS = frozenset({"to", "you", "u", "and", "if", "that"})  # the words after a wish
_PLAIN = 0.6  # an order that costs less is read without doubt
_PLAIN_VERBS = frozenset({"go", "drive", "move", "head", "visit", "turn", "face", "look", "circle", "come", "take"})
_NO_MANNERS = frozenset({"which", "that", "another", "to", "of", "for", "last", "next"})
_KINDNESS = frozenset({"kind", "good", "dear", "love", "favour", "favor", "great", "angel", "kindness"})
_DUTIES = frozenset({"should", "must", "have", "ought", "shall"})
_AFTER_REMARK = ("so", "and", "but", "please", "go", "can", "could", "take", "show", "bring", "turn", "drive", "head")
_AUXILIARIES = frozenset({"has", "have", "is", "was", "are", "were", "just", "been", "it", "goes"})
_SKIP, _SKIP_MARK, _SKIP_MEANING, _ORDER = 2.6, 0.05, 6.0, 0.3
_LISTED = 0.6  # a name alone costs this much less where an order goes before
_COURTESY, _COURTESY_WORD, _IDLE = 0.3, 0.05, 0.45
_MOST_COURTESIES = 14
_SILENT = frozenset({"THEN", "BUT", "mark", "POLITE", "GREETING", "FILLER", "INSTEAD_END", "courtesy"})
_HARD = frozenset({".", "!", "?", ";"})
_BREAKS = frozenset({*_HARD, ",", ":", "-", ">"})


@dataclass(frozen=True, slots=True)
class Item:
    """One part of a reading.

    Attributes:
        kind: ``order``, ``bare``, ``mention``, ``repeat``, ``refuse``, ``chat``, ``inquire``, ``remark``, ``skip``,
            ``slow``, or the class of words that joins two parts.
        value: the tree of a rule, else None.
        start: its first token.
        end: behind its last.
    """

    kind: str
    value: Any
    start: int
    end: int


@dataclass(frozen=True, slots=True)
class Reading:
    """One way to read a sentence."""

    items: tuple[Item, ...]
    cost: float


@dataclass(frozen=True, slots=True)
class _State:
    """A reading up to a token."""

    cost: float
    fresh: bool
    item: Item | None
    before: "_State | None"
    trail: tuple[Any, ...] = ()  # the items that mean something


class Sentence:
    """A tokenised sentence and its chart."""

    def __init__(self, text: str, knows: Callable[[str], bool] | None = None) -> None:
        """Take a sentence, and what besides the lexicon says that it knows a word."""
        self.text = text
        self.tokens, self.respelt = respelt(lexer.tokenise(text))
        self.names = Names(self.tokens, knows)
        self.chart = Chart(load_grammar(), self.tokens, _built_in(self.tokens, self.names))

    def words(self, start: int, end: int) -> str:
        """Return the words of some tokens, as they were written."""
        if start >= end:
            return ""
        return self.text[self.tokens[start].start : self.tokens[end - 1].end]


def _built_in(tokens: list[Token], names: Names) -> dict[str, BuiltIn]:
    def amounts(read: Callable[[list[Token], int], list[tuple[int, float]]]) -> BuiltIn:
        return lambda at: [(end, 0.0, value) for end, value in read(tokens, at)]

    def files(kind: str) -> BuiltIn:
        return lambda at: [(at + 1, 0.0, tokens[at].text)] if tokens[at].kind == kind else []

    return {
        "NUMBER": amounts(lexer.number_at), "LENGTH": amounts(lexer.length_at), "ANGLE": amounts(lexer.angle_at),
        "DURATION": amounts(lexer.duration_at), "CLOCK": amounts(lexer.clock_at), "IMAGE": files("image"),
        "CLIP": files("clip"), "NAME": names.names, "OPEN": names.open_names, "NOISE": names.noises,
        "ROOM": names.rooms, "VERB": names.verbs,
        "WORDS": lambda at: list(_rest(tokens, at)),
    }  # fmt: skip


def _rest(tokens: list[Token], at: int) -> Iterator[tuple[int, float, str]]:
    """Yield where the rest of a clause may end: before a mark, "and" or "then", and at the end of the sentence."""
    for end in range(at, len(tokens) + 1):
        stop = end == len(tokens) or tokens[end].text in _BREAKS or tokens[end].text in ("and", "then", "so")
        if stop and end > at:
            yield end, 0.02 * (end - at), ""
        if end < len(tokens) and tokens[end].text in _HARD:
            return


def readings(sentence: Sentence) -> list[Reading]:
    """Return the readings of a sentence, the cheapest first."""
    count = len(sentence.tokens)
    best: list[list[_State]] = [[] for _ in range(count + 1)]
    best[0] = [_State(0.0, True, None, None)]
    for at in range(count):
        states = _pruned(best[at])
        steps = list(_steps(sentence, at)) if states else []
        for state in states:
            for item, cost, fresh, needs_fresh in steps:
                run_on = item.kind in ("order", "bare") and not state.fresh
                extra = _RUN_ON if run_on and getattr(item.value, "rule", "") != "on_way" else 0.0
                if needs_fresh and not state.fresh:
                    first = sentence.tokens[item.start].text
                    if item.kind not in ("remark", "mention") or first in ("that", "which", "who"):
                        continue
                    extra = _RUN_ON_REMARK
                if item.kind == "bare" and any(kind in ("order", "bare") for kind, _ in state.trail):
                    extra -= _LISTED - _CLAUSE * _tells(sentence, item)
                keeps = state.fresh if fresh is None else fresh
                trail = state.trail if item.kind in _SILENT else (*state.trail, (item.kind, item.value))
                best[item.end].append(_State(state.cost + cost + extra, keeps, item, state, trail))
    return [_reading(state) for state in sorted(_pruned(best[count]), key=lambda state: state.cost)[:MOST_READINGS]]


def _pruned(states: list[_State]) -> list[_State]:
    kept: list[_State] = []
    for fresh in (True, False):
        trails: set[tuple[Any, ...]] = set()
        for state in sorted((s for s in states if s.fresh is fresh), key=lambda s: s.cost):
            if state.trail not in trails:
                trails.add(state.trail)
                kept.append(state)
            if len(trails) == MOST_READINGS:
                break
    return kept


def _reading(state: _State) -> Reading:
    items: list[Item] = []
    cost, at = state.cost, state
    while at.before is not None:
        assert at.item is not None
        items.append(at.item)
        at = at.before
    return Reading(tuple(reversed(items)), cost)


_RULES = (
    ("order", _ORDER, False, False), ("bare", _BARE, False, True), ("mention", _MENTION, False, True),
    ("repeat", 0.2, None, False),
    ("amount", 0.8, False, True), ("chat", 0.6, False, True), ("inquire", 0.6, False, True),
)  # fmt: skip
_JOINS = {
    "THEN": (0.0, True), "BUT_FIRST": (0.0, True), "BUT": (0.25, True), "BEFORE": (0.1, True), "AFTER": (0.1, True),
    "CORRECT": (0.15, True),
    "POLITE": (0.05, True), "GREETING": (0.12, None), "FILLER": (0.2, None), "SLOW": (0.1, None),
    "INSTEAD_END": (0.4, None),
    "MAKE_IT": (0.5, True), "THOUGH": (0.25, None),
}  # fmt: skip


def _steps(sentence: Sentence, at: int) -> Iterator[tuple[Item, float, bool | None, bool]]:
    """Yield the items that may begin at a token: item, cost, whether a clause may follow, whether it begins one."""
    chart, tokens = sentence.chart, sentence.tokens
    for rule, cost, fresh, needs in _RULES:
        for edge in chart.edges(rule, at):
            kind = "refuse" if getattr(edge.value, "rule", "") == "refuse" else rule
            anywhere = kind == "refuse" and edge.value.get("reason") in ("condition", "negation", "endless")
            after = edge.value.get("next") == "yes" or None if rule == "repeat" else fresh
            if getattr(edge.value, "rule", "") in ("lead", "arrive"):
                after = True
            if kind == "refuse" and not anywhere:
                needs = True
            yield Item(kind, edge.value, at, edge.end), cost + edge.cost, after, needs
    for name, (cost, fresh) in _JOINS.items():
        for edge in chart.terminal(name, at):
            closes = edge.end == len(tokens) or tokens[edge.end].kind == "punct"
            if name != "INSTEAD_END" or (at and closes):  # "the bed, go": at the end the verb says no more
                yield Item(name, edge.value, at, edge.end), cost, fresh, name == "POLITE"
    yield from _remarks(sentence, at)
    yield from _courtesies(sentence, at)
    mark = tokens[at].kind == "punct"
    if mark and chart.terminal("THEN", at):
        return
    begins = chart.begins(at)
    cost = _SKIP_MARK if mark else _SKIP_MEANING if not begins.isdisjoint(("NEGATION", "IF")) else _SKIP
    last = at + 1 == len(tokens) or tokens[at + 1].kind == "punct"
    dangling = last and tokens[at].text in _PREPOSITIONS
    if tokens[at].text in _listed("functional") and cost == _SKIP and not dangling:
        yield Item("courtesy", None, at, at + 1), _FUNCTIONAL, None, False
    yield Item("mark" if mark else "skip", None, at, at + 1), cost, True if mark else None, False


def _orders_inside(sentence: Sentence, start: int, end: int) -> bool:
    """Return whether a remark holds an order with a verb: "he is asleep just go to the nursery"."""
    return any(
        edge.end <= end and edge.cost < _PLAIN and getattr(edge.value, "rule", "") in ("go", "face", "beside", "circle")
        for at in range(start + 1, end - 1)
        if sentence.tokens[at].text in _PLAIN_VERBS
        for edge in sentence.chart.edges("order", at)
    )


def _tells(sentence: Sentence, item: Item) -> bool:
    """Return whether a name is a statement: "a guest has rung the bell" behind an order says why."""
    return any(token.text in _AUXILIARIES for token in sentence.tokens[item.start : item.end])


def _courtesies(sentence: Sentence, at: int) -> Iterator[tuple[Item, float, bool | None, bool]]:
    """Yield the wishes and manners that begin at a token: "I should be most grateful were you to", "if you like"."""
    chart, tokens = sentence.chart, sentence.tokens
    courtesy, idle = _listed("courtesy"), _listed("idle")
    conditional = not chart.begins(at).isdisjoint(("IF",))
    if tokens[at].text == "to" and at + 1 < len(tokens) and not chart.begins(at + 1).isdisjoint(("GO", "FACE", "TURN")):
        yield Item("courtesy", None, at, at + 1), _COURTESY, True, True
    if tokens[at].text in idle:
        yield Item("courtesy", None, at, at + 1), _IDLE, None, False
    if chart.terminal("VERB", at) and _begins_order(sentence, at + 1):
        yield Item("courtesy", None, at, at + 1), _INTERJECTION, True, True
    for end in range(at, min(at + _MOST_COURTESIES, len(tokens))):
        word = tokens[end].text
        if word not in courtesy and not (conditional and end > at and word == "not"):
            return
        after = tokens[end + 1] if end + 1 < len(tokens) else None
        closes = after is None or after.kind == "punct"
        dangling = tokens[at].text in _PREPOSITIONS if closes else tokens[at].text in _SPEAKERS and word not in _LEADS
        words = {token.text for token in tokens[at : end + 1]}
        dangling = dangling or tokens[at].text in _NO_MANNERS or (word == "and" and words.isdisjoint(_KINDNESS))
        if end > at and not dangling and (closes or _begins_order(sentence, end + 1)):
            yield (
                Item("courtesy", None, at, end + 1), _COURTESY + _COURTESY_WORD * (end + 1 - at),
                None if closes else True, not closes,
            )  # fmt: skip


@cache
def _listed(name: str) -> frozenset[str]:
    return frozenset(load_grammar().lists[name].split())


_ORDERS = frozenset({"GO", "DIRECT", "TURN", "FACE", "POLITE", "CIRCLE", "BACK_UP", "WAIT"})


def _begins_order(sentence: Sentence, at: int) -> bool:
    """Return whether an order may begin at a token."""
    return at < len(sentence.tokens) and not sentence.chart.begins(at).isdisjoint(_ORDERS)


def _remarks(sentence: Sentence, at: int) -> Iterator[tuple[Item, float, bool | None, bool]]:
    """Yield the statements that begin at a token: what people say about themselves, or why."""
    chart, tokens = sentence.chart, sentence.tokens
    if [token.text for token in tokens[at : at + 3]] == ["as", "soon", "as"]:
        return
    because = tokens[at].text in (
        "because",
        "since",
        "as",
        "so",
        "before",
        "while",
        "until",
        "which",
        "where",
        "when",
        "in",
        "by",
        "within",
    )
    starts = chart.terminal("SUBJECT", at)
    if not starts:
        return
    words: list[str] = []
    finite = tokens[at].text in ("its", "like", "cos", "cause")
    for end in range(at, len(tokens)):
        token = tokens[end]
        words.append(token.text)
        finite = (
            finite
            or bool(chart.terminal("FINITE", end))
            or token.text in ("minute", "moment", "o'clock", "noon", "arrive", "arrives", "starts", "sleep")
            or (words[-2:-1] in (["its"], ["im"], ["theyre"]) and token.text.endswith("ing"))
        )
        if end > at and token.text in ("not", "never", "if", "unless") and "you" in words:
            return
        after = tokens[end + 1].text if end + 1 < len(tokens) else "."
        if end > at and finite and (after in _BREAKS or after in _AFTER_REMARK):
            orders = "you" in words and not because and words[:2] != ["you", "are"]
            duty = any(pair[0] == "you" and pair[1] in _DUTIES for pair in pairwise(words))
            which = words[:2] == ["the", "one"] or words[0] in ("which", "that")
            if duty or which or _orders_inside(sentence, at, end + 1):
                continue  # it says which one, or what to do: it cannot be left out
            cost = _REMARK + _REMARK_WORD * len(words) + 1.5 * orders - _OWN_WISH * (words[:3] in _WISHES)
            yield Item("remark", None, at, end + 1), cost, after in _BREAKS or None, not because
        if after in _BREAKS or (
            after in ("so", "and", "but", "please") and finite and _begins_order(sentence, end + 2)
        ):
            return
