"""The pool of training examples as arrays: each row once, and its variants."""

import random
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from training.language.align import Aligned, aligned
from training.language.augment import joinable, names_of, variant, with_manners
from training.language.plain import plain
from training.language.rows import Example, examples_of, lists

from avlmaps.language.intents import Clarify
from avlmaps.language.learned.english import WIDTH
from avlmaps.language.learned.features import features, seen_as
from avlmaps.language.learned.linear import INDEX, SYMBOLS
from avlmaps.language.sentence import Sentence
from avlmaps.language.verbalise import strange_word

_MOST_TOKENS = 70
# The voices of the first fold of `leave_out`: three learners of English, three ordinary users.
HELD_OUT = frozenset({"v33", "v36"})


@dataclass(slots=True)
class Pool:
    """Examples as arrays.

    Attributes:
        words: every word of the pool.
        meaning: the vector of each.
        pieces: its runs of letters.
        items: one an example: words, packed marks, line, places of each pointer, start symbol, voices.
    """

    words: list[str]
    meaning: np.ndarray
    pieces: np.ndarray
    items: "list[Item]"


@dataclass(slots=True)
class Item:
    """One example.

    Attributes:
        words: its words, numbers of the pool.
        marks: packed bits.
        context: the state of each word, of a model of English, half precision.
        line: numbers of symbols; a pointer at token i is ``len(SYMBOLS) + i``.
        places: for each pointer all tokens of that word, for each symbol itself.
        start: the symbol that the line begins with.
        voices: whose rows it is made of.
        weight: how much it counts.
    """

    words: np.ndarray
    marks: np.ndarray
    context: np.ndarray
    line: np.ndarray
    places: list[list[int]]
    start: int
    voices: frozenset[str]
    weight: float = 1.0


class _Words:
    def __init__(self) -> None:
        self.index: dict[str, int] = {}
        self.meaning: list[np.ndarray] = []
        self.pieces: list[np.ndarray] = []

    def item(self, one: Aligned, weight: float) -> Item:
        seen = features(one.tokens, {})
        numbers: list[int] = []
        for at, token in enumerate(one.tokens):
            key = seen_as(token)
            if key not in self.index:
                self.index[key] = len(self.index)
                self.meaning.append(seen.meaning[at].astype(np.float16))
                self.pieces.append(seen.pieces[at].astype(np.int16))
            numbers.append(self.index[key])
        base = len(SYMBOLS)
        line = np.array([INDEX[s] if isinstance(s, str) else base + s for s in one.line], np.int32)
        texts = [token.text for token in one.tokens]
        places: list[list[int]] = []
        name = False
        for symbol in one.line:
            if isinstance(symbol, str):
                name = symbol in ("object", "sound", "area")
                places.append([INDEX[symbol]])
            elif name:
                places.append([base + i for i, text in enumerate(texts) if text == texts[symbol]])
            else:
                places.append([base + symbol])
        start = INDEX["start_question" if one.is_question else "start_command"]
        voices = frozenset({one.example.voice, *one.example.also})
        return Item(
            np.array(numbers, np.int32), np.packbits(seen.marks > 0, axis=1), seen.context.astype(np.float16), line,
            places, start, voices, weight,
        )  # fmt: skip


def collected() -> list[Example]:
    """Return every row, each with what it means most likely."""
    found = [one for paths in lists().values() for path in paths for one in examples_of(path) if one.row]
    return [one for one in found if not _names_nonsense(one)]


def _names_nonsense(example: Example) -> bool:
    """Return whether a command is unclear for a word that is none: then the guard asks, not the network."""
    if example.is_question or not isinstance(example.meaning, tuple) or not isinstance(example.meaning[0], Clarify):
        return False
    return strange_word(Sentence(example.say).tokens) is not None


def build(variants: int, made: int, seed: int, rows: Sequence[Example] | None = None) -> Pool:
    """Return the pool of rows.

    Args:
        variants: how many variants each row has.
        made: how many plain sentences are made besides; each has one variant.
        seed: of every choice.
        rows: the rows; None: all. Names that only the voices of the first fold say are put into no other row.
    """
    draw = random.Random(seed)
    rows = collected() if rows is None else rows
    words, items = _Words(), []
    dropped: Counter[str] = Counter()
    names = names_of([row for row in rows if row.voice not in HELD_OUT])
    others = [row for row in rows if joinable(row) and len(row.say) < 90]

    def add(example: Example, weight: float) -> None:
        one = aligned(example)
        if one is None or len(one.tokens) > _MOST_TOKENS or len(one.line) > 78:
            dropped[example.voice] += 1
            return
        items.append(words.item(one, weight))

    for row in rows:
        add(row, 1.0)
        for _ in range(variants):
            add(variant(row, others, names, draw), 0.8)
    for row in plain(made, names, draw):
        add(row, 0.6)
        add(with_manners(row, draw), 0.6)
    print(f"{len(rows)} rows, {len(items)} examples, {sum(dropped.values())} dropped", flush=True)
    return Pool(list(words.index), np.stack(words.meaning), np.stack(words.pieces), items)


def without(pool: Pool, voices: frozenset[str]) -> Pool:
    """Return a pool without what is made of some voices."""
    return replace(pool, items=[item for item in pool.items if not (item.voices & voices)])


def vocabulary(pool: Pool, least: int = 3) -> dict[str, int]:
    """Return the words that occur in enough rows, with numbers from 1 on."""
    seen: Counter[int] = Counter()
    for item in pool.items:
        if item.weight >= 1.0:
            seen.update(set(item.words.tolist()))
    kept = [pool.words[at] for at, count in sorted(seen.items(), key=lambda pair: (-pair[1], pool.words[pair[0]]))
            if count >= least]  # fmt: skip
    return {word: at for at, word in enumerate(kept, start=1)}


def batches(pool: Pool, size: int, draw: random.Random) -> Iterator[list[Item]]:
    """Yield batches of sentences of the same length, in random order, for ever."""
    by_length: dict[int, list[Item]] = {}
    for item in pool.items:
        by_length.setdefault(len(item.words), []).append(item)
    while True:
        groups: list[list[Item]] = []
        for _, items in sorted(by_length.items()):
            draw.shuffle(items)
            near = sorted(items, key=lambda item: len(item.line) + draw.randint(0, 3))
            groups += [near[at : at + size] for at in range(0, len(near), size)]
        draw.shuffle(groups)
        yield from groups


def collated(items: Sequence[Item], pool: Pool, to_known: np.ndarray, columns: int) -> dict[str, Any]:
    """Return a batch as padded arrays."""
    n, m = max(len(i.words) for i in items), max(len(i.line) for i in items)
    base, size = len(SYMBOLS), len(items)
    words = np.full((size, n), -1, np.int64)
    marks = np.zeros((size, n, columns), np.float32)
    context = np.zeros((size, n, WIDTH), np.float32)
    lines = np.zeros((size, m), np.int64)
    goal = np.zeros((size, m, base + n), bool)
    real = np.zeros((size, m), bool)
    for b, item in enumerate(items):
        words[b, : len(item.words)] = item.words
        marks[b, : len(item.words)] = np.unpackbits(item.marks, axis=1)[:, :columns]
        context[b, : len(item.words)] = item.context
        lines[b, 0] = item.start
        lines[b, 1 : len(item.line)] = item.line[:-1]
        real[b, : len(item.line)] = True
        for t, places in enumerate(item.places):
            goal[b, t, places] = True
    mask = words >= 0
    safe = np.maximum(words, 0)
    meaning = pool.meaning[safe].astype(np.float32) * mask[:, :, None]
    return {
        "meaning": meaning, "words": to_known[safe] * mask,
        "pieces": pool.pieces[safe].astype(np.int64) * mask[:, :, None],
        "marks": marks, "context": context, "mask": mask, "lines": lines, "goal": goal, "real": real,
        "weight": np.array([i.weight for i in items], np.float32),
    }  # fmt: skip
