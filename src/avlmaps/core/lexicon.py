"""The words that this project knows: things, rooms and sounds, with what is usual about each (`lexicon.toml`).

Every table that needs a name, a synonym or a wider kind reads it here. Look-ups ignore case, hyphens, blanks and the
plural, so "Arm-chairs" is an armchair. How to add a thing stands in ``docs/guides/add-a-thing.md``.
"""

import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from functools import cache, cached_property
from importlib.resources import files
from types import MappingProxyType
from typing import Any, Literal

from avlmaps.core.inflection import plural_of, singulars_of
from avlmaps.core.spelling import Speller, squeezed

Range = tuple[float, float]
Mount = Literal["floor", "wall", "ceiling", "top", "built in"]
Split = Literal["training", "held out"]

_DEFAULTS = "all"
# After one of these a phrase describes; what is named stands before it: "a bottle of wine" is a bottle.
_LINKS = frozenset({"of", "with", "without", "for", "on", "in", "at", "from", "under", "to", "that", "which"})


class Kind(StrEnum):
    """What an entry names."""

    THING = "thing"
    ROOM = "room"
    SOUND = "sound"


@dataclass(frozen=True, slots=True, eq=False)
class Entry:
    """One thing, room or sound.

    Attributes:
        name: what answers call it, singular where it has one.
        kind: thing, room or sound.
        plural: of the name; the name itself where it has no other.
        synonyms: other names of the same, British and American.
        learnt: phrases that the encoders which ship were trained with or carry in their notes for it; most are
            synonyms, some name what the encoder takes for it: a tap for a sink.
        wider: the kinds that it belongs to, nearest first, each an entry of its own: a chair is a seat.
        compounds: names of special ones that are no entry of their own: a dining chair is a chair.
        mount: where it usually is: on the floor, on a wall, on the ceiling, on top of another thing, or built in.
        size_m: the usual width, depth and height, each from least to greatest, metres; None where it varies too much.
        soft: whether it swallows sound.
        sounds: names of the sounds that it makes, for a thing.
        makers: names of the things that make it, the likeliest first, for a sound.
        rooms: names of the rooms where it usually is; for a sound, where it is also heard without its makers.
        split: ``training`` where an encoder which ships was trained to tell it; ``held out`` for all others.
    """

    name: str
    kind: Kind
    plural: str = ""
    synonyms: tuple[str, ...] = ()
    learnt: tuple[str, ...] = ()
    wider: tuple[str, ...] = ()
    compounds: tuple[str, ...] = ()
    mount: Mount = "floor"
    size_m: tuple[Range, Range, Range] | None = None
    soft: bool = False
    sounds: tuple[str, ...] = ()
    makers: tuple[str, ...] = ()
    rooms: tuple[str, ...] = ()
    split: Split = "held out"

    @property
    def spellings(self) -> tuple[str, ...]:
        """The name, its synonyms and its compounds."""
        return (self.name, *self.synonyms, *self.compounds)

    def __repr__(self) -> str:
        return f"Entry({self.name!r}, {self.kind.value})"


class Lexicon:
    """All entries, with look-ups; `lexicon` returns the one that ships.

    Args:
        source: the parsed file: tables ``thing``, ``room`` and ``sound`` of groups of entries, and lists of adjectives.

    Attributes:
        colours: names of colours.
        materials: adjectives that say what a thing is made of.
        ambiguous: words that name several entries of one kind, each with the kind and the names, the likeliest first.
    """

    def __init__(self, source: Mapping[str, Any]) -> None:
        self.colours = _listed(source.get("colours", ""))
        self.materials = _listed(source.get("materials", ""))
        self.ambiguous: Mapping[tuple[Kind, str], tuple[str, ...]] = MappingProxyType(
            {
                (kind, squeezed(word)): _listed(names)
                for kind in Kind
                for word, names in source.get("ambiguous", {}).get(kind.value, {}).items()
            }
        )
        made = _sounds_of(source.get("sound", {}))
        self._entries = tuple(entry for kind in Kind for entry in _entries(kind, source.get(kind.value, {}), made))
        self._named = {(entry.kind, squeezed(entry.name)): entry for entry in self._entries}
        self._index = self._indexed()

    def entries(self, kind: Kind | None = None) -> tuple[Entry, ...]:
        """Return the entries, or those of one kind, in the order of the file."""
        return self._entries if kind is None else tuple(entry for entry in self._entries if entry.kind is kind)

    def find(self, phrase: str, kind: Kind | None = None) -> Entry | None:
        """Return the entry that a phrase names exactly, by any of its spellings; None where there is none.

        Without a kind things come before rooms and rooms before sounds. An ambiguous word names its likeliest entry.

        Args:
            phrase: ``Sofas``, ``arm-chair`` or ``couch``; no article.
            kind: only entries of this kind.
        """
        for key in (squeezed(phrase), *(squeezed(single) for single in singulars_of(phrase))):
            for each in Kind if kind is None else (kind,):
                if found := self._index[each].get(key):
                    return found
        return None

    def senses(self, phrase: str, kind: Kind | None = None) -> tuple[Entry, ...]:
        """Return every entry that a phrase can name, the likeliest first: several for an ambiguous word."""
        out: dict[str, Entry] = {}
        for each in Kind if kind is None else (kind,):
            if (found := self.find(phrase, each)) is not None:
                out[f"{each} {found.name}"] = found
            for single in (phrase, *singulars_of(phrase)):
                for name in self.ambiguous.get((each, squeezed(single)), ()):
                    entry = self._named[each, squeezed(name)]
                    out.setdefault(f"{each} {entry.name}", entry)
        return tuple(out.values())

    def head(self, phrase: str, kind: Kind | None = None) -> Entry | None:
        """Return the entry that the longest known tail of a phrase names; None where even its last word is unknown.

        A description after the noun is left out: "bottle of wine" is a bottle, "red chest of drawers" a chest of
        drawers.

        Args:
            phrase: ``red kitchen table`` is a table.
            kind: only entries of this kind.
        """
        words = phrase.split()
        link = next((at for at, word in enumerate(words) if at and word.lower() in _LINKS), len(words))
        for end in (len(words), link) if link < len(words) else (link,):
            for start in range(link):
                if (found := self.find(" ".join(words[start:end]), kind)) is not None:
                    return found
        return None

    def wider(self, name: str, kind: Kind | None = None) -> tuple[Entry, ...]:
        """Return all kinds that an entry belongs to, nearest first: an armchair is a chair, a seat and furniture."""
        entry = self.find(name, kind)
        out: dict[str, Entry] = {}
        todo = [entry] if entry is not None else []
        for each in todo:
            for parent in (self._named[each.kind, squeezed(wide)] for wide in each.wider):
                if parent.name not in out:
                    out[parent.name] = parent
                    todo.append(parent)
        return tuple(out.values())

    def members(self, wider: str) -> tuple[Entry, ...]:
        """Return all entries that a wider kind takes in, in the order of the file: "seat" takes in chair and sofa."""
        return tuple(entry for each in self.senses(wider) for entry in self._members[each.kind].get(each.name, ()))

    def is_a(self, other: str, wanted: str) -> bool:
        """Return whether what one phrase names is what another wants.

        Args:
            other: ``red office chair``; its head counts.
            wanted: ``chair``, ``chairs`` or ``seat``; a chair is no office chair.
        """
        wants = self.senses(wanted)
        if not wants:
            return _ends_with(other, wanted)
        for kind in {entry.kind for entry in wants}:
            named = self.senses(other, kind) or tuple(filter(None, (self.head(other, kind),)))
            for entry in named:
                if any(want is entry or want in self.wider(entry.name, kind) for want in wants):
                    return True
        return _ends_with(other, wanted)

    def suggest(self, word: str, kind: Kind | None = None, most: int = 3) -> tuple[str, ...]:
        """Return known spellings close to a word that may be misspelt, the closest first: "labtop" gives laptop.

        Args:
            word: one that `find` does not know; a phrase is compared whole.
            kind: only spellings of entries of this kind.
            most: how many at most.
        """
        return tuple(spelling for spelling, _ in self.scored_suggestions(word, kind, most))

    def scored_suggestions(self, word: str, kind: Kind | None = None, most: int = 3) -> tuple[tuple[str, float], ...]:
        """Return what `suggest` does, each with how alike it is: 1 is the word itself, 0 nothing in common."""
        return self._spellers[kind].suggest(word, most)

    def words(self) -> frozenset[str]:
        """Return every single word that is known, in small letters: of all spellings, colours and materials."""
        return self._words

    @cached_property
    def _words(self) -> frozenset[str]:
        phrases = [*self.colours, *self.materials]
        for entry in self._entries:
            phrases += [*entry.spellings, entry.plural]
        return frozenset(word for phrase in phrases for word in phrase.lower().replace("-", " ").split())

    @cached_property
    def _spellers(self) -> "dict[Kind | None, Speller]":
        of_kind = {kind: Speller(word for e in self.entries(kind) for word in e.spellings) for kind in Kind}
        return {None: Speller(word for entry in self._entries for word in entry.spellings), **of_kind}

    @cached_property
    def _members(self) -> dict[Kind, dict[str, tuple[Entry, ...]]]:
        out: dict[Kind, dict[str, tuple[Entry, ...]]] = {kind: {} for kind in Kind}
        for entry in self._entries:
            for parent in self.wider(entry.name, entry.kind):
                out[entry.kind][parent.name] = (*out[entry.kind].get(parent.name, ()), entry)
        return out

    def _indexed(self) -> dict[Kind, dict[str, Entry]]:
        index: dict[Kind, dict[str, Entry]] = {kind: {} for kind in Kind}
        for kind, key in self._named:
            index[kind][key] = self._named[kind, key]
        for (kind, key), names in self.ambiguous.items():
            index[kind].setdefault(key, self._named[kind, squeezed(names[0])])
        for entry in self._entries:
            for spelling in (entry.plural, *entry.synonyms, *entry.compounds):
                index[entry.kind].setdefault(squeezed(spelling), entry)
        return index


@cache
def lexicon() -> Lexicon:
    """Return the lexicon that ships, read once."""
    text = files("avlmaps.core").joinpath("lexicon.toml").read_text(encoding="utf-8")
    return Lexicon(tomllib.loads(text))


def _entries(kind: Kind, groups: Mapping[str, Any], made: Mapping[str, tuple[str, ...]]) -> Iterable[Entry]:
    own = {squeezed(word) for said in _own(groups) for word in said}
    for group in groups.values():
        usual = group.get(_DEFAULTS, {})
        for name, said in group.items():
            if name != _DEFAULTS:
                yield _entry(name, kind, {**usual, **said}, own, made.get(name, ()) if kind is Kind.THING else ())


def _own(groups: Mapping[str, Any]) -> Iterable[tuple[str, ...]]:
    """Return what each entry of a kind says that it is called."""
    for group in groups.values():
        for name, said in group.items():
            yield (name, *_listed(said.get("also", "")))


def _entry(name: str, kind: Kind, said: Mapping[str, Any], own: set[str], sounds: tuple[str, ...]) -> Entry:
    learnt = _listed(said.get("learnt", ""))
    # An encoder may take other things for one of its own: a tap for a sink. They are no synonyms.
    same = (word for word in learnt if squeezed(word) not in own)
    return Entry(
        name=name,
        kind=kind,
        plural=said.get("plural") or (name if kind is Kind.SOUND else plural_of(name)),
        synonyms=(*same, *_listed(said.get("also", ""))),
        learnt=learnt,
        wider=_listed(said.get("wider", "")),
        compounds=_listed(said.get("such_as", "")),
        mount=said.get("mount", "floor"),
        size_m=_size(said["size"]) if "size" in said else None,
        soft=said.get("soft", False),
        sounds=sounds,
        makers=_listed(said.get("makers", "")),
        rooms=_listed(said.get("rooms", "")),
        split="training" if said.get("trained", False) else "held out",
    )


def _sounds_of(groups: Mapping[str, Any]) -> dict[str, tuple[str, ...]]:
    """Return for each thing the sounds that it makes, from what makes each sound."""
    out: dict[str, tuple[str, ...]] = {}
    for group in groups.values():
        for name, said in group.items():
            for maker in _listed(said.get("makers", "")):
                out[maker] = (*out.get(maker, ()), name)
    return out


def _listed(text: str) -> tuple[str, ...]:
    return tuple(part for part in (each.strip() for each in text.split(",")) if part)


def _size(text: str) -> tuple[Range, Range, Range]:
    """Return the three ranges of ``0.4-0.6 x 0.4-0.6 x 0.8-1.1``: width, depth, height."""
    width, depth, height = ((float(low), float(high)) for low, _, high in (p.partition("-") for p in text.split(" x ")))
    return width, depth, height


def _ends_with(phrase: str, tail: str) -> bool:
    """Return whether a phrase is another one, or ends in it: an office chair is a chair."""
    phrase, tail = " ".join(phrase.lower().split()), " ".join(tail.lower().split())
    return bool(tail) and (phrase == tail or phrase.endswith(f" {tail}"))
