"""Names that people gave to things, rooms and places of a map: "my charging dock" is in no lexicon.

A sentence is read with a word that is known in the place of each, since what was learnt reads such words best; what was
read has the own name again.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps.language.claims import claimed_words
from avlmaps.language.intents import Target
from avlmaps.language.lexer import WORDS, tokenise

OwnName = tuple[str, bool]
"""A name without its article, in lower case, and whether it is that of a room."""
_DETERMINERS = frozenset({"the", "this", "that", "my", "your", "our", "her", "his", "their", "a", "an", "any", "every"})
_THINGS = ("lamp", "clock", "vase", "suitcase", "printer", "basket")
_ROOMS = ("kitchen", "garage", "library", "bathroom", "gym")


@dataclass(frozen=True, slots=True)
class StandIns:
    """A sentence with known words in the place of own names.

    Attributes:
        text: the sentence.
        own: the own name of each word.
    """

    text: str
    own: dict[str, str] = field(default_factory=dict)

    def back(self, text: str) -> str:
        """Return words with the own names."""
        for word, name in self.own.items():
            text = re.sub(rf"\b{word}\b", lambda _, name=name: name, text, flags=re.IGNORECASE)
        return text

    def target(self, target: Target) -> Target:
        """Return a target with its own name."""
        return replace(target, name=self.own.get(target.name, target.name), near=tuple(map(self.target, target.near)))


def is_reserved(name: str) -> bool:
    """Return whether a name would take a word of orders: "stop", "left", "5 m", "near the bed"."""
    said = [token.text for token in tokenise(name) if token.kind != "punct"]
    said = said[1:] if said[:1] and said[0] in _DETERMINERS and len(said) > 1 else said
    taken = claimed_words("reserved") | claimed_words("stops") | WORDS
    return bool(said) and (
        said[0] in claimed_words("leading") or all(word in taken or word[0].isdigit() for word in said)
    )


def stand_ins(text: str, names: Sequence[OwnName]) -> StandIns:
    """Return a sentence with a known word for each own name in it that the lexicon does not have."""
    out, own = text, dict[str, str]()
    for name, is_room in sorted(names, key=lambda one: -len(one[0])):
        if is_reserved(name) or lexicon().find(name, EntryKind.ROOM if is_room else EntryKind.THING) is not None:
            continue
        said = re.compile(rf"(?<![\w-])(?:(?:the|a|an|my|your|our) )?{re.escape(name)}(?![\w-])", re.IGNORECASE)
        if not said.search(out):
            continue
        free = (one for one in (_ROOMS if is_room else _THINGS) if one not in own and one not in text.casefold())
        word = next(free, None)
        if word is None:
            break
        out = said.sub(f"the {word}", out)
        own[word] = name
    return StandIns(out, own)
