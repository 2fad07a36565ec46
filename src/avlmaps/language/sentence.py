"""A sentence as tokens, misspelt words put right, and what besides the lexicon knows its names."""

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from avlmaps.core.question import HeardAt
from avlmaps.language import lexer
from avlmaps.language.lexer import Token
from avlmaps.language.numbers import in_figures
from avlmaps.language.own_names import OwnName
from avlmaps.language.rephrase import in_degrees, rewritten
from avlmaps.language.spelling import respelt

# Words that may mean a file that came along.
_PICTURE = frozenset({
    "photo", "photos", "photograph", "photographed", "picture", "pictured", "image", "pic", "snapshot", "shot", "view",
    "selfie", "screenshot", "polaroid",
})  # fmt: skip
_SOUND = frozenset({"recording", "recorded", "clip", "sound", "audio", "noise", "tape", "recordings", "memo"})
_SIDE = re.compile(
    r"\b((?:left|right|north|south|east|west|in front) of|behind|opposite|"
    r"across from|underneath|under|beneath|below|above|over)\b"
)
_POINTS = frozenset({"this", "these", "attached", "attachment", "here", "file", "sent", "enclosed", "uploaded"})


@dataclass(frozen=True, slots=True)
class Attachments:
    """The files and names that came along with a sentence.

    Attributes:
        image: the file that "this photo" means.
        clip: the file that "this recording" means.
        knows: says whether the map's encoder knows a word that the lexicon does not; None: only the lexicon counts.
        at: the place of every sound; None: as the words say, else where it was heard.
        own: names that people gave to things and rooms of the map.
        no_sources: says why the map does not know where sounds came from; "" where it does, or no map is known yet.
    """

    image: str | None = None
    clip: str | None = None
    knows: Callable[[str], bool] | None = None
    at: HeardAt | None = "robot"
    own: tuple[OwnName, ...] = ()
    no_sources: Callable[[], str] = lambda: ""

    def tokens(self, words: Iterable[str], at: int) -> list[Token]:
        """Return the files that a sentence may speak of as tokens behind it, so that "this photo" can point to one."""
        said = frozenset(words)
        files = (("image", self.image, _PICTURE), ("clip", self.clip, _SOUND))
        return [Token(name, name, kind, at, at) for kind, name, means in files if name and said & (means | _POINTS)]


class Sentence:
    """A tokenised sentence, with the files that came along behind it.

    Attributes:
        text: as it was written.
        tokens: its words, numbers, files and marks.
        given: the files and names that came along.
        respelt: misspelt words, with what they are taken for.
        order_notes: one sentence for each time that is read before its order.
    """

    def __init__(self, text: str, given: "Attachments | None" = None) -> None:
        given = given or Attachments()
        self.text = text
        plain, self.order_notes = rewritten(text)
        tokens, self.respelt = respelt(lexer.tokenise(plain))
        self.tokens = in_degrees(in_figures(tokens))
        self.tokens += given.tokens((token.text for token in self.tokens), len(text))
        self.given = given

    def knows(self, name: str) -> bool:
        """Return whether the map's encoder knows a name."""
        return bool(self.given.knows and self.given.knows(name))

    @property
    def notes(self) -> tuple[str, ...]:
        """One sentence for each misspelt word, and for each order that is read at another place."""
        return (*(f"'{said}' is read as '{meant}'." for said, meant in self.respelt.items()), *self.order_notes)

    @property
    def side_notes(self) -> tuple[str, ...]:
        """One sentence for each side of a thing that it speaks of: what is near has none."""
        sides = _SIDE.findall(" ".join(token.text for token in self.tokens))
        return tuple(
            f"'{side}' is read as 'near': distance counts, the side does not." for side in dict.fromkeys(sides)
        )
