"""The note on a name that an encoder of a closed set does not know."""

from avlmaps.core.lexicon import EntryKind, lexicon, noun_of

_WHO = {EntryKind.THING: "pixel", EntryKind.ROOM: "view"}


def unknown_note(phrase: str, kind: EntryKind = EntryKind.THING) -> str:
    """Return one sentence on why a phrase cannot be found: misspelt, a known word that is not learnt, or unknown.

    Args:
        phrase: one that the encoder takes for none of its names.
        kind: what it was to name.
    """
    known, who = lexicon(), _WHO[kind]
    entry = known.find(phrase, kind) or known.head(phrase, kind)
    if entry is not None:
        return f"{entry.name!r} is a known word, but this map's {who} encoder was not trained to detect it"
    noun = noun_of(phrase)
    wrong, better = _respelt(phrase, noun, kind)
    if better:
        return f"{wrong!r} is not a known {kind}; did you mean {better}?"
    return f"{noun!r} is not a known {kind}, so the {who} encoder has nothing to look for"


def _respelt(phrase: str, noun: str, kind: EntryKind) -> tuple[str, str]:
    known = lexicon()
    before = phrase.lower().split()[: phrase.split().index(noun)]
    nouns = [(noun, near) for near in known.suggest(noun, kind)]
    for compound in (" ".join([*before, near]) for _, near in nouns if before):
        if known.find(compound, kind) is not None:
            return phrase, compound
    wholes = [(phrase, near) for near in known.suggest(phrase, kind, most=1)] if before else []
    right_before = all(word in known.words() for word in before)
    return next(iter([*nouns, *wholes] if right_before else [*wholes, *nouns]), (noun, ""))
