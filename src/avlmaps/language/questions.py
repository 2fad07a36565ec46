"""From a sentence to a question for the map: where something is, how many there are, whether there is one."""

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise

from avlmaps.core.errors import QueryError
from avlmaps.core.question import MOST_CHARACTERS, Modality, Part, Question
from avlmaps.language.asking import framed
from avlmaps.language.asking_back import missing_file, unknown
from avlmaps.language.chart import Tree
from avlmaps.language.commands import Given
from avlmaps.language.grammar import load_grammar
from avlmaps.language.intents import Ask, Clarify, Inquiry, Kind, Pick, Target
from avlmaps.language.readings import Sentence
from avlmaps.language.targets import Memory, UnresolvedError, resolve

_EXAMPLE = "the chair near the sound of glass breaking, or: the table in the kitchen"
_MODALITIES = {
    Kind.OBJECT: Modality.OBJECT, Kind.SOUND: Modality.SOUND, Kind.CLIP: Modality.SOUND, Kind.AREA: Modality.AREA,
    Kind.IMAGE: Modality.IMAGE,
}  # fmt: skip
_SKIP, _FILLER, _REMARK, _WORST = 3.6, 0.2, 0.15, 3.5
_WHERE = frozenset({"where", "which", "find", "show", "locate", "whereabouts", "room", "place"})
_TAIL = re.compile(r",?\s+or\s+(was|did|is|am|what|nah|not|something|are)\b[^,;.]*$", re.IGNORECASE)
_INFINITE = float("inf")
_PLACES = frozenset(
    {
        "location",
        "position",
        "place",
        "whereabouts",
        "source",
        "coordinates",
        "closest",
        "nearest",
        "number",
        "count",
        "amount",
        "total",
    }
)
_REMARKS = frozenset({"i", "it", "they", "we", "my", "he", "she", "its", "like", "because", "cos", "im", "so"})
_NO_STARTS = frozenset(
    {
        ("what", "is"),
        ("what", "colour"),
        ("what", "color"),
        ("what", "are"),
        ("what", "time"),
        ("how", "long"),
        ("how", "big"),
        ("how", "far"),
        ("how", "old"),
        ("what", "did"),
        ("what", "do"),
        ("what", "does"),
        ("what", "can"),
        ("what", "sound"),
        ("what", "sounds"),
        ("what", "hour"),
        ("tell", "about"),
        ("how", "high"),
    }
)
_NO_QUESTIONS = frozenset({"describe", "explain", "compare", "who", "why", "when", "whose"})
_MEANING = frozenset({"not", "no", "without", "except", "never", "unless", "or", "if", "but"})


@dataclass(frozen=True, slots=True)
class AskedSentence:
    """The query of a sentence.

    Attributes:
        inquiry: what is to be known, of which targets.
        notes: one sentence each: how words were taken.
    """

    inquiry: Inquiry
    notes: tuple[str, ...] = ()

    @property
    def questions(self) -> tuple[Question, ...]:
        """One question for each target; any of them answers."""
        return tuple(question_of(target) for target in self.inquiry.of)


def parse_sentence(sentence: str) -> Question:
    """Return the question that a sentence asks; its first part is sought, the others say where it is.

    Raises:
        QueryError: the sentence is empty, too long, or not understood; it says which words.
    """
    return read_question(sentence, Given(knows=lambda _: True)).questions[0]


def read_question(sentence: str, given: Given | None = None) -> AskedSentence:
    """Return the query of a sentence, of the grammar and the network.

    Raises:
        QueryError: the sentence is empty, too long, or not understood; it says which words.
    """
    given = given or Given()
    read = _sentence(sentence, given)
    grammar: AskedSentence | QueryError
    try:
        grammar = _by_grammar(read, given)
    except QueryError as fault:
        grammar = fault
    if not isinstance(grammar, QueryError) and _is_name(read, grammar.inquiry):
        return grammar
    from avlmaps.language.learned.agreement import agreed_question
    from avlmaps.language.learned.reader import learned_reader

    reader = learned_reader()
    reads = reader.question(read.tokens)
    found = agreed_question(
        None if isinstance(grammar, QueryError) else grammar.inquiry, reads, read.tokens, reader.limits
    )
    if found.why == "network" and found.inquiry is not None:
        try:
            return _put_right(found.inquiry, read, given)
        except QueryError:
            if not isinstance(grammar, QueryError):
                return grammar
            raise
    if isinstance(grammar, QueryError):
        raise grammar
    if found.inquiry is None:
        raise QueryError(f"A map cannot answer this; ask it like: {_EXAMPLE}.")
    return grammar


def read_question_by_grammar(sentence: str, given: Given | None = None) -> AskedSentence:
    """Return the query of a sentence as the grammar alone has it.

    Raises:
        QueryError: the sentence is empty, too long, or not understood; it says which words.
    """
    given = given or Given()
    return _by_grammar(_sentence(sentence, given), given)


def _is_name(read: Sentence, inquiry: Inquiry) -> bool:
    """Return whether a sentence is one name and nothing else: then there is nothing more to read."""
    words = [token.text for token in read.tokens if token.kind != "punct" and token.text not in ("the", "a", "an")]
    return len(inquiry.of) == 1 and not inquiry.of[0].near and words == inquiry.of[0].name.split()


def _put_right(inquiry: Inquiry, read: Sentence, given: Given) -> AskedSentence:
    """Return the network's question with names put right.

    Raises:
        QueryError: it asks for what a map cannot choose, or a name or a file is not known.
    """
    from avlmaps.language.learned.guard import Guard

    guard = Guard(read.names, given.image, given.clip)
    targets = tuple(guard.put_right(target) for target in inquiry.of)
    if guard.problem is not None:
        raise QueryError(guard.problem.question)
    for one in targets:
        if one.pick in (Pick.FARTHEST, Pick.OTHER):
            raise QueryError(f"A map cannot choose '{one.pick} {one.name}'; say what it is near.")
    return AskedSentence(Inquiry(inquiry.ask, targets), tuple(dict.fromkeys(guard.notes)))


def _sentence(sentence: str, given: Given) -> Sentence:
    """Return a question as tokens.

    Raises:
        QueryError: it is empty or too long.
    """
    if not any(mark.isalnum() for mark in sentence):
        raise QueryError(f"The sentence is empty; say what is sought, such as: {_EXAMPLE}.")
    if len(sentence) > MOST_CHARACTERS:
        raise QueryError(
            f"The sentence has {len(sentence)} characters, more than {MOST_CHARACTERS}; say it shorter, like: "
            f"{_EXAMPLE}."
        )
    return Sentence(_TAIL.sub("?", sentence), given.knows)


def _by_grammar(read: Sentence, given: Given) -> AskedSentence:
    starts = tuple(token.text for token in read.tokens[:3] if token.text != "me")[:2]
    of_place = any(token.text in _PLACES for token in read.tokens[2:4])
    if _asks_state(read):
        raise QueryError(f"A map does not know the state of a thing, only where it is; ask it like: {_EXAMPLE}.")
    if starts[0] in _NO_QUESTIONS or (starts in _NO_STARTS and not of_place):
        raise QueryError(f"A map knows where things and sounds are, and how many; ask it like: {_EXAMPLE}.")
    cost, tree, words = _best(read)
    try:
        free = framed(read)
        if free is not None and free.cost < min(cost, _WORST):
            ask, targets = free.ask, (free.target(),)
        elif tree is not None:
            ask, targets = Ask(tree.get("ask")), _targets(tree)
        else:
            raise QueryError(f"{words} is not understood; say it like: {_EXAMPLE}.")
        if any(one.pick in (Pick.FARTHEST, Pick.OTHER) for one in targets):
            question = f"A map cannot choose '{targets[0].pick} {targets[0].name}'; say what it is near."
            raise UnresolvedError(Clarify(question))
    except UnresolvedError as fault:
        raise QueryError(fault.question.question) from None
    notes: list[str] = []
    ask = Ask.EXISTS if ask is Ask.WHERE and _wants_yes(read) else ask
    checked = tuple(_checked(target, read, given, notes) for target in targets)
    return AskedSentence(Inquiry(ask, checked), tuple(notes))


def _wants_yes(read: Sentence) -> bool:
    """Return whether a statement is meant as a question: "behind the curtain there is a box?"."""
    words = [token.text for token in read.tokens]
    states = {("there", "is"), ("there", "are"), ("there", "any")} & set(pairwise(words))
    return words[-1] == "?" and (bool(states) or words[0] in ("anybody", "anyone")) and _WHERE.isdisjoint(words)


def _asks_state(read: Sentence) -> bool:
    """Return whether a sentence wants to know how something is: "is the window open"."""
    words = [token.text for token in read.tokens if token.kind != "punct"]
    opens = words[0] in ("is", "are", "was", "were") or words[-2:-1] in (["is"], ["are"])
    return opens and words[-1] in load_grammar().lists["states"].split() and words[1:2] != ["there"]


def question_of(target: Target) -> Question:
    """Return a target as a question to the map."""
    parts = [Part(_MODALITIES[one.kind], one.name, is_file=one.is_file) for one in (target, *target.near)]
    return Question.of(parts)


def _best(read: Sentence) -> tuple[float, Tree | None, str]:
    """Return the cheapest reading of a whole sentence, or the words that are not understood."""
    tokens, chart = read.tokens, read.chart
    count = len(tokens)
    best: tuple[float, Tree] | None = None
    longest = 0
    skips = [_skip(read, i) for i in range(count)]
    for at in range(count):
        for edge in chart.edges("question", at):
            around = [*tokens[:at], *tokens[edge.end :]]
            longest = max(longest, edge.end)
            if any(token.text in _MEANING for token in around) or edge.value.rule != "question":
                continue
            remark = edge.end < count and tokens[edge.end].text in _REMARKS
            after = sum(min(cost, _REMARK) if remark else cost for cost in skips[edge.end :])
            opening = at > 0 and tokens[0].text in _REMARKS
            before = sum(min(cost, _REMARK) if opening else cost for cost in skips[:at])
            if best is None or before + edge.cost + after < best[0]:
                best = (before + edge.cost + after, edge.value)
    if best is None or best[0] > _WORST:
        rest = read.words(longest, count)
        return _INFINITE, None, repr((rest if any(mark.isalnum() for mark in rest) else read.text)[:80])
    return best[0], best[1], ""


def _skip(read: Sentence, at: int) -> float:
    """Return the cost of leaving out a token."""
    if read.tokens[at].kind == "punct":
        return 0.02
    for before in range(max(0, at - 4), at + 1):
        for name in ("GREETING", "FILLER", "POLITE"):
            if any(edge.end > at for edge in read.chart.terminal(name, before)):
                return _FILLER
    return _SKIP


def _targets(tree: Tree) -> tuple[Target, ...]:
    memory = Memory()
    if tree.get("use") is not None:
        whole = [resolve(Tree("target", (("at", at),), 0, 0), memory) for at in tree.all("at")]
        near = [flat for one in whole for flat in (replace(one, near=()), *one.near)]
        return tuple(target.with_near(*near) for target in _for_use(str(tree.get("use"))))
    base = tree.get("of")
    target = Target(Kind.IMAGE) if tree.get("picture") else resolve(base, memory)
    beside = tree.get("at_in") or tree.get("at_near")
    if beside is not None:
        inside = resolve(beside, memory)
        target = target.with_near(replace(inside, near=()), *inside.near)
    for at in tree.all("at"):
        whole = resolve(Tree("target", (("at", at),), 0, 0), memory)
        target = target.with_near(replace(whole, near=()), *whole.near)
    return (target,)


def _for_use(use: str) -> tuple[Target, ...]:
    """Return the things that serve a purpose."""
    uses = load_grammar().lists["uses"]
    key = max((key for key in uses if use.startswith(key)), key=len, default=None)
    if key is None:
        raise UnresolvedError(Clarify(f"What serves to {use} is not known; name the thing."))
    return tuple(Target(Kind.OBJECT, name.strip()) for name in uses[key].split(","))


def _checked(target: Target, read: Sentence, given: Given, notes: list[str]) -> Target:
    if target.is_file and not target.name:
        path: str | None = given.image if target.kind is Kind.IMAGE else given.clip
        if path is None:
            raise QueryError(missing_file(target.kind).question)
        target = replace(target, name=path)
    elif not read.names.known(target):
        raise QueryError(unknown(target.name).question)
    if target.name in read.names.mended:
        notes.append(f"'{read.names.mended[target.name]}' is read as '{target.name}'.")
    return replace(target, near=tuple(_checked(one, read, given, notes) for one in target.near))


Knows = Callable[[str], bool]
