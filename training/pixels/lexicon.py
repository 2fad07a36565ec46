"""Other phrases for the categories, and wider words that take several of them in, from the project's lexicon."""

from training.pixels.labels import CATEGORIES, ROOMS

from avlmaps.core.lexicon import EntryKind, lexicon

# The wider words that notes carry besides the categories that have narrower ones; everything else is left to the
# nearness of words.
_WIDE = {
    EntryKind.THING: ("table", "seat", "place to sit", "place to sleep", "cupboard", "light", "screen", "shelf",
                      "counter", "furniture"),
    EntryKind.ROOM: ("workplace", "place to cook"),
}  # fmt: skip
_NAMES = {EntryKind.THING: CATEGORIES, EntryKind.ROOM: ROOMS}


def _called() -> dict[str, tuple[str, ...]]:
    entries = [lexicon().named(name, kind) for kind, names in _NAMES.items() for name in names if name != "other"]
    return {entry.name: entry.learnt for entry in entries if entry.learnt}


def _kinds() -> dict[str, tuple[str, ...]]:
    out: dict[str, tuple[str, ...]] = {}
    for kind, words in _WIDE.items():
        for word in (*words, *(CATEGORIES if kind is EntryKind.THING else ())):
            members = {word, *(entry.name for entry in lexicon().members(word))}
            names = tuple(name for name in _NAMES[kind] if name in members)
            if word in words or (len(names) > 1 and word != "other"):
                out[word] = names
    return out


CALLED: dict[str, tuple[str, ...]] = _called()
KINDS: dict[str, tuple[str, ...]] = _kinds()
