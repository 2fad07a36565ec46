"""The words that this project knows: things, rooms and sounds, with what is usual about each (`lexicon.toml`).

Every table that needs a name, a synonym or a wider kind reads it here. Look-ups ignore case, hyphens, blanks and the
plural, so "Arm-chairs" is an armchair. How to add a thing stands in ``docs/guides/extend.md``.
"""

import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cache, cached_property
from pathlib import Path
from typing import Any, Literal

from avlmaps.core.words import Speller, plural_of, singulars_of, squeezed

Range = tuple[float, float]
Mount = Literal["floor", "wall", "ceiling", "top", "built in"]
Split = Literal["training", "held out"]

_DEFAULTS = "all"
# After one of these a phrase describes; what is named stands before it: "a bottle of wine" is a bottle.
_LINKS = frozenset({
    "of", "with", "without", "for", "on", "in", "at", "from", "under", "to", "that", "which", "where", "beside", "next",
    "near", "above", "below", "behind", "by", "over", "between", "full", "made", "used", "like", "when", "inside",
    "against", "opposite", "across", "who",
})  # fmt: skip


class EntryKind(StrEnum):
    """The kind of an entry."""

    THING = "thing"
    ROOM = "room"
    SOUND = "sound"


@dataclass(frozen=True, slots=True, eq=False)
class Entry:
    """One thing, room or sound; ``lexicon.toml`` explains what is not said here."""

    name: str  # what answers call it, singular where it has one
    kind: EntryKind
    plural: str = ""  # the name itself where it has no other
    synonyms: tuple[str, ...] = ()  # other names of it, British and American
    # phrases that the encoders which ship know it by; some name what they take for it: a tap for a sink
    learnt: tuple[str, ...] = ()
    # the kinds that it belongs to, nearest first, each an entry of its own: a chair is a seat
    wider: tuple[str, ...] = ()
    compounds: tuple[str, ...] = ()  # special ones that are no entry of their own: a dining chair is a chair
    mount: Mount = "floor"
    # usual width, depth and height, least to greatest; None where it varies too much
    size_m: tuple[Range, Range, Range] | None = None
    soft: bool = False
    sounds: tuple[str, ...] = ()  # that a thing makes
    makers: tuple[str, ...] = ()  # things that make a sound, the likeliest first
    rooms: tuple[str, ...] = ()  # where a thing usually is; where a sound is also heard without its makers
    like: tuple[str, ...] = ()
    generic: bool = False
    wet: bool = False
    tiled: bool = False
    spoken: str = ""  # what people mostly say for it where that is not the name
    split: Split = "held out"  # whether an encoder which ships was trained to name it

    @property
    def spellings(self) -> tuple[str, ...]:
        """The name, its synonyms and its compounds."""
        return (self.name, *self.synonyms, *self.compounds)

    def is_compound(self, phrase: str) -> bool:
        """Return whether a phrase names a special one: a dining chair is more than a chair, and no armchair is one."""
        return squeezed(phrase) in map(squeezed, self.compounds)

    def __repr__(self) -> str:
        return f"Entry({self.name!r}, {self.kind.value})"


class Lexicon:
    """All entries, with look-ups, of a parsed file; ``lexicon`` returns the one that ships."""

    def __init__(self, source: Mapping[str, Any]) -> None:
        self.colours = _listed(source.get("colours", ""))
        self.materials = _listed(source.get("materials", ""))
        self.room_kinds = frozenset(_listed(source.get("room_kinds", "")))  # areas that say of a thing what it is for
        self.ambiguous: dict[EntryKind, dict[str, tuple[str, ...]]] = {
            kind: {squeezed(word): _listed(names) for word, names in source.get("ambiguous", {}).get(kind, {}).items()}
            for kind in EntryKind
        }
        self._said = {kind: dict(_flat(source.get(kind, {}))) for kind in EntryKind}
        self._index = {kind: self._indexed(kind) for kind in EntryKind}
        self._known: dict[EntryKind, dict[str, Entry]] = {kind: {} for kind in EntryKind}

    def entries(self, kind: EntryKind | None = None) -> tuple[Entry, ...]:
        """Return the entries, or those of one kind, in the order of the file."""
        kinds = EntryKind if kind is None else (kind,)
        return tuple(self._entry(each, name) for each in kinds for name in self._said[each])

    def named(self, name: str, kind: EntryKind) -> Entry:
        """Return the entry of exactly this name; ``KeyError`` where there is none."""
        if name not in self._said[kind]:
            raise KeyError(f"the lexicon has no {kind} {name!r}; add it to core/lexicon.toml")
        return self._entry(kind, name)

    def find(self, phrase: str, kind: EntryKind | None = None) -> Entry | None:
        """Return the entry that a phrase without article names exactly: ``Sofas``, ``arm-chair``, ``couch``; else None.

        Without a kind things come before rooms and rooms before sounds. An ambiguous word names its likeliest entry.
        """
        for key in (squeezed(phrase), *(squeezed(single) for single in singulars_of(phrase))):
            for each in EntryKind if kind is None else (kind,):
                if (name := self._index[each].get(key)) is not None:
                    return self._entry(each, name)
        return None

    def senses(self, phrase: str, kind: EntryKind | None = None) -> tuple[Entry, ...]:
        """Return every entry that a phrase can name, the likeliest first: several for an ambiguous word."""
        out: dict[str, Entry] = {}
        for each in EntryKind if kind is None else (kind,):
            if (found := self.find(phrase, each)) is not None:
                out[f"{each} {found.name}"] = found
            for single in (phrase, *singulars_of(phrase)):
                for name in self.ambiguous[each].get(squeezed(single), ()):
                    out.setdefault(f"{each} {name}", self._entry(each, name))
        return tuple(out.values())

    def head(self, phrase: str, kind: EntryKind | None = None) -> Entry | None:
        """Return the entry that the longest known tail of a phrase names: ``red kitchen table`` is a table; else None.

        A description after the noun is left out: "bottle of wine" is a bottle, "red chest of drawers" a chest of
        drawers.
        """
        words = phrase.split()
        link = _link(words)
        for end in (len(words), link) if link < len(words) else (link,):
            for start in range(link):
                if (found := self.find(" ".join(words[start:end]), kind)) is not None:
                    return found
        return None

    def in_room(self, phrase: str) -> tuple[str, str] | None:
        """Return the thing and the room that a phrase names in one: ``red kitchen chair``, a red chair in the kitchen.

        None for what is an entry, wherever it is (an office chair), and for a room that says its kind (a gym bag).
        """
        words, own = phrase.split(), self.find(phrase)
        if own is not None and not any(own.is_compound(one) for one in (phrase, *singulars_of(phrase))):
            return None
        for start, end in ((at, end) for at in range(_link(words)) for end in range(len(words) - 1, at, -1)):
            name, rest = " ".join(words[start:end]), " ".join(words[end:])
            room, thing = self.find(name), self.head(rest, EntryKind.THING)  # what is a thing too is no place
            is_place = room is not None and room.kind is EntryKind.ROOM and name not in self.room_kinds
            if is_place and thing and own in (None, thing):
                return " ".join([*words[:start], rest]), name
        return None

    def wider(self, name: str, kind: EntryKind | None = None) -> tuple[Entry, ...]:
        """Return all kinds that an entry belongs to, nearest first: an armchair is a chair, a seat and furniture."""
        entry = self.find(name, kind)
        out: dict[str, Entry] = {}
        todo = [entry] if entry is not None else []
        for each in todo:
            for parent in (self._entry(each.kind, wide) for wide in each.wider):
                if parent.name not in out:
                    out[parent.name] = parent
                    todo.append(parent)
        return tuple(out.values())

    def members(self, wider: str) -> tuple[Entry, ...]:
        """Return all entries that a wider kind takes in, in the order of the file: "seat" takes in chair and sofa."""
        return tuple(entry for each in self.senses(wider) for entry in self._members[each.kind].get(each.name, ()))

    def is_a(self, other: str, wanted: str, kind: EntryKind | None = None) -> bool:
        """Return whether what one phrase (its head counts) names is what another wants: a chair, chairs or a seat.

        A chair is no office chair.
        """
        for want in self.senses(wanted, kind):
            named = self.senses(other, want.kind) or tuple(filter(None, (self.head(other, want.kind),)))
            # A dining chair is a chair; an armchair is a chair too, and no dining chair.
            wide = not want.is_compound(wanted)
            if any(want is entry or (wide and want in self.wider(entry.name, want.kind)) for entry in named):
                return True
        phrase, tail = (" ".join(one.lower().split()) for one in (other, wanted))
        return bool(tail) and f" {phrase}".endswith(f" {tail}")

    def suggest(self, word: str, kind: EntryKind | None = None, most: int = 3) -> tuple[tuple[str, float], ...]:
        """Return known spellings close to one that `find` does not know, with their likeness (1: equal), best first."""
        return self._spellers[kind].suggest(word, most)

    @cached_property
    def words(self) -> frozenset[str]:
        """Every known word in small letters: of all spellings, joined ones too, colours and materials."""
        phrases = [*self.colours, *self.materials]
        for entry in self.entries():
            phrases += [*entry.spellings, entry.plural]
        single = {word for phrase in phrases for word in phrase.lower().replace("-", " ").split()}
        return frozenset(single | {squeezed(phrase) for phrase in phrases})

    @cached_property
    def _spellers(self) -> "dict[EntryKind | None, Speller]":
        # Names that encoders were trained on are the common ones; they win where two words are as near.
        entries = sorted(self.entries(), key=lambda entry: entry.split != "training")
        kinds: tuple[EntryKind | None, ...] = (None, *EntryKind)
        return {
            kind: Speller(word for entry in entries if kind in (None, entry.kind) for word in entry.spellings)
            for kind in kinds
        }

    @cached_property
    def _members(self) -> dict[EntryKind, dict[str, tuple[Entry, ...]]]:
        out: dict[EntryKind, dict[str, tuple[Entry, ...]]] = {kind: {} for kind in EntryKind}
        for entry in self.entries():
            for parent in self.wider(entry.name, entry.kind):
                out[entry.kind][parent.name] = (*out[entry.kind].get(parent.name, ()), entry)
        return out

    def _indexed(self, kind: EntryKind) -> dict[str, str]:
        # By squeezed spelling; names first, then what the file calls ambiguous, other spellings, what encoders take for
        # it.
        said = self._said[kind]
        index = {squeezed(name): name for name in said}
        for key, names in self.ambiguous[kind].items():
            index.setdefault(key, names[0])
        for field in ("plural", "also", "such_as", "learnt"):
            for name, own in said.items():
                if field in own:
                    for key in squeezed(own[field]).split(","):
                        index.setdefault(key, name)
        return index

    def _entry(self, kind: EntryKind, name: str) -> Entry:
        if (known := self._known[kind].get(name)) is None:
            known = self._known[kind][name] = self._made(kind, name, self._said[kind][name])
        return known

    def _made(self, kind: EntryKind, name: str, said: Mapping[str, Any]) -> Entry:
        learnt = _listed(said.get("learnt", ""))
        # An encoder may take other things for one of its own: a tap for a sink. They are no synonyms.
        special = _listed(said.get("such_as", ""))
        keys = {squeezed(word): word for word in reversed(learnt) if word not in special}
        same = (word for key, word in reversed(keys.items()) if self._index[kind][key] == name)
        return Entry(
            name=name,
            kind=kind,
            plural=said.get("plural") or (name if kind is EntryKind.SOUND else plural_of(name)),
            synonyms=(*same, *_listed(said.get("also", ""))),
            learnt=learnt,
            compounds=special,
            mount=said.get("mount", "floor"),
            size_m=_size(said["size"]) if "size" in said else None,
            sounds=self._sounds_of.get(name, ()) if kind is EntryKind.THING else (),
            spoken=said.get("spoken", ""),
            split="training" if said.get("trained", False) else "held out",
            **{field: _listed(said.get(field, "")) for field in ("wider", "makers", "rooms", "like")},
            **{field: said.get(field, False) for field in ("soft", "generic", "wet", "tiled")},
        )

    @cached_property
    def _sounds_of(self) -> dict[str, tuple[str, ...]]:
        out: dict[str, tuple[str, ...]] = {}
        for name, said in self._said[EntryKind.SOUND].items():
            for maker in _listed(said.get("makers", "")):
                out[maker] = (*out.get(maker, ()), name)
        return out


@cache
def lexicon() -> Lexicon:
    """Return the lexicon that ships, read once."""
    text = Path(__file__).with_name("lexicon.toml").read_text(encoding="utf-8")
    return Lexicon(tomllib.loads(text))


def noun_of(phrase: str) -> str:
    """Return the word that says what a phrase is about, known or not: "blue zebra in a cage" is a zebra."""
    words = phrase.split()
    return words[_link(words) - 1] if words else ""


def _link(words: Sequence[str]) -> int:
    return next((at for at, word in enumerate(words) if at and word.lower() in _LINKS), len(words))


def _flat(groups: Mapping[str, Any]) -> Iterable[tuple[str, Mapping[str, Any]]]:
    for group in groups.values():
        usual = group.get(_DEFAULTS, {})
        for name, said in group.items():
            if name != _DEFAULTS:
                yield name, {**usual, **said}


def _listed(text: str) -> tuple[str, ...]:
    return tuple(text.split(", ")) if text else ()


def _size(text: str) -> tuple[Range, Range, Range]:
    width, depth, height = ((float(low), float(high)) for low, _, high in (p.partition("-") for p in text.split(" x ")))
    return width, depth, height
