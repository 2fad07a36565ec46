"""The meaning of a phrase among the names of a closed-set encoder.

The lexicon decides where it knows the noun: by name, synonym, compound or wider kind. The nearness of words chooses
between several names that fit, and reads descriptions ("something to boil water in"). A noun that nobody knows means
nothing: a "desk dragon" is not a desk.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from avlmaps.core.arrays import Float32
from avlmaps.core.lexicon import Entry, EntryKind, lexicon, noun_of
from avlmaps.perception.protocols import WordEncoder

# A phrase that starts with one of these describes, without a noun of its own.
_DESCRIBES = frozenset({
    "something", "anything", "somewhere", "anywhere", "someplace", "where", "place", "spot", "what", "thing", "things",
    "one", "ones", "stuff", "whatever", "wherever",
})  # fmt: skip
_ARTICLES = frozenset({"a", "an", "the", "some", "any", "my", "our", "your", "his", "her", "their", "this", "that"})


@dataclass(frozen=True)
class Meanings:
    """Finds the names that a phrase means, and the share of each.

    Attributes:
        names: what can be meant.
        called: for each name the phrases that stand for it, itself among them.
        kinds: what a wider word takes in: ``table`` is a dining table, a coffee table ...; and a name its narrower
            names: an armchair is a ``chair``.
        words: vectors of phrases.
        kind: of entry that the names are.
        temperature: a cosine lower by this than the best makes a name e times less meant.
        least_cosine: of the best name for a description; below, it means none of them.
        least_within: the same where the noun is known and only the choice between its names is open.
        sure_cosine: of a noun that the lexicon lacks; below, it means none of the names.
        least_share: names meant less than this beside the best one are left out.
        narrower: a narrower name must be nearer by this cosine than the noun's own.
        narrower_share: a name means its narrower ones by this much: the chair is rather a chair than an armchair.
    """

    names: tuple[str, ...]
    called: tuple[tuple[str, ...], ...]
    kinds: dict[str, tuple[str, ...]]
    words: WordEncoder
    kind: EntryKind = EntryKind.THING
    temperature: float = 0.07
    least_cosine: float = 0.5
    least_within: float = 0.3
    sure_cosine: float = 0.8
    least_share: float = 0.2
    narrower: float = 0.15
    narrower_share: float = 0.8

    def name_weights(self, phrase: str) -> Float32[np.ndarray, " k"]:
        """Return for each name how much the phrase means it, 1 for the most meant; all zero where it means none."""
        weights = out = self.own_weights(phrase)
        entry = lexicon().find(_clean(phrase), self.kind)
        if entry is not None and entry.is_compound(_clean(phrase)):
            return weights
        for name, weight in zip(self.names, weights, strict=True):
            if weight > 0.0 and name in self.kinds:
                out = np.maximum(out, self.narrower_share * weight * self._all_of(self.kinds[name]))
        return out

    def own_weights(self, phrase: str) -> Float32[np.ndarray, " k"]:
        """Return the same without what is narrower than the names: an armchair is a name of its own."""
        clean = _clean(phrase)
        if clean in self._exactly:
            return self._all_of(self._exactly[clean])
        if clean in self.kinds:
            return self._all_of(self.kinds[clean])
        known = lexicon()
        if senses := known.senses(clean, self.kind):
            weights = (self._all_of(self.names_of(entry)) for entry in senses)
            some = next((each for each in weights if each.any()), self._all_of(()))
            return some if some.any() or not senses[0].generic else self._general(clean, senses[0])
        if clean.partition(" ")[0] in _DESCRIBES:
            return self._nearest(clean, self.names, self.least_cosine)
        head = known.head(clean, self.kind)
        if head is None:  # the words round it would make a sofa of a "sofa elephant"
            return self._nearest(noun_of(clean), self.names, self.sure_cosine)
        if head.generic:
            return self._general(clean, head)
        return self._described(clean, head)

    def names_of(self, entry: Entry) -> tuple[str, ...]:
        """Return the names that stand for an entry: its own, those that it takes in, its wider kind, or its likeness.

        A treadmill is fitness equipment, a table one of the tables, a freezer looks like a refrigerator.
        """
        own = tuple(name for name, called in zip(self.names, self.called, strict=True) if entry.name in called)
        if own or entry.name in self.kinds:
            return own or self.kinds[entry.name]
        members = tuple(each.name for each in lexicon().members(entry.name) if each.name in self.names)
        if members and not entry.generic:
            return members
        for wide in (*(each.name for each in lexicon().wider(entry.name, self.kind)), *entry.like):
            if wide in self.names:
                return (wide,)
        return ()

    def _general(self, phrase: str, head: Entry) -> Float32[np.ndarray, " k"]:
        """Return the meaning of a phrase about an appliance, a piece of furniture ...: the nearest name."""
        near = self._nearest(phrase, self.names, self.least_cosine)
        fitting = [entry.name for entry in lexicon().members(head.name) if entry.name in self.names]
        return near if near.any() else self._nearest(phrase, fitting, self.least_within)

    def _described(self, phrase: str, head: Entry) -> Float32[np.ndarray, " k"]:
        """Return the meaning of a known noun with words round it: of several fitting names the nearest."""
        fitting = self.names_of(head)
        if len(fitting) > 1:
            near = self._nearest(phrase, fitting, self.least_within)
            return near if near.any() else self._all_of(fitting)
        if head.name not in fitting:
            return self._all_of(fitting)
        narrow = [each.name for each in lexicon().members(head.name) if each.name in self.names]
        cosine = self._cosines(phrase)
        own = cosine[self.names.index(head.name)]
        best = max(narrow, key=lambda name: cosine[self.names.index(name)], default=head.name)
        clear = cosine[self.names.index(best)] > own + self.narrower
        return self._all_of((best,) if clear else fitting)

    def _all_of(self, names: Sequence[str]) -> Float32[np.ndarray, " k"]:
        return np.array([name in names for name in self.names], np.float32)

    def _nearest(self, phrase: str, among: Sequence[str], least: float) -> Float32[np.ndarray, " k"]:
        cosine = np.where(self._all_of(among) > 0.0, self._cosines(phrase), -1.0)
        best = float(cosine.max(initial=-1.0))
        if best < least:
            return np.zeros(len(self.names), np.float32)
        share = np.exp((cosine - best) / self.temperature)
        return np.where(share >= self.least_share, share, 0.0).astype(np.float32)

    @cached_property
    def _exactly(self) -> dict[str, list[str]]:
        """The names that each phrase stands for."""
        out: dict[str, list[str]] = {}
        for name, called in zip(self.names, self.called, strict=True):
            for phrase in called:
                out.setdefault(phrase, []).append(name)
        return out

    @cached_property
    def _flat(self) -> list[str]:
        return [alias for called in self.called for alias in called]

    def _cosines(self, phrase: str) -> Float32[np.ndarray, " k"]:
        starts = np.cumsum([0, *(len(called) for called in self.called[:-1])])
        vectors = self.words.encode([phrase, *self._flat])
        return np.maximum.reduceat(vectors[1:] @ vectors[0], starts)


def _clean(phrase: str) -> str:
    """Return a phrase in small letters without the article before it."""
    words = phrase.lower().split()
    return " ".join(words[1:] if len(words) > 1 and words[0] in _ARTICLES else words)
