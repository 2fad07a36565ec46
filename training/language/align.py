"""From an example to a line of symbols: which tokens its names and amounts are."""

from collections.abc import Sequence
from dataclasses import dataclass
from difflib import SequenceMatcher
from itertools import pairwise

from training.language.linearise import Pointers, is_written_well, line_of, line_of_question
from training.language.rows import Example

from avlmaps.core.words import singulars_of, stem_of
from avlmaps.language import lexer
from avlmaps.language.intents import Ask, Inquiry, TargetKind
from avlmaps.language.learned.linear import MalformedError, Pointable, Symbol, amount
from avlmaps.language.lexer import Token
from avlmaps.language.names import sounding_forms
from avlmaps.language.questions import use_in
from avlmaps.language.sentence import Attachments, Sentence

_ALIKE = 0.75
_ENDINGS = ("ings", "ing", "ers", "ies", "ed", "es", "s", "er", "y", "e")


@dataclass(frozen=True, slots=True)
class Aligned:
    """A sentence and the line that it means.

    Attributes:
        tokens: the sentence.
        line: symbols and tokens.
        is_question: which of the two forms.
        example: where it comes from.
    """

    tokens: Sequence[Token]
    line: tuple[Symbol, ...]
    is_question: bool
    example: Example


def aligned(example: Example) -> Aligned | None:
    """Return an example with its line; None where its words or numbers do not stand in the sentence."""
    tokens = Sentence(example.say, Attachments(example.image, example.clip)).tokens
    if not tokens:
        return None
    found = _Found(tokens, example)
    try:
        write = line_of_question if example.is_question else line_of
        line = write(example.meaning, found)  # pyright: ignore[reportArgumentType]
    except MalformedError:
        if not (example.is_question and isinstance(example.meaning, Inquiry) and example.meaning.ask is Ask.WHERE):
            return None
        if use_in(example.say) is None:
            return None
        line = ["purpose", "end"]
    if not is_written_well(line, Pointable(tokens), is_question=example.is_question):
        return None
    return Aligned(tokens, tuple(line), example.is_question, example)


class _Found(Pointers):
    """The tokens of one example."""

    def __init__(self, tokens: Sequence[Token], example: Example) -> None:
        self.tokens, self.example = list(tokens), example
        self._used: list[int] = []
        self._stems = [stem_of(token.text, _ENDINGS) for token in tokens]

    def amount(self, value: float, of: str) -> int | None:
        found = [
            i for i in range(len(self.tokens))
            if (said := amount(self.tokens, i, of)) is not None and abs(said - value) < max(0.011, 0.01 * abs(value))
        ]  # fmt: skip
        fresh = [i for i in found if i not in self._used]
        longest = max(fresh or found, key=lambda i: self._end(i, of) - i, default=None)
        at = next(iter(fresh or found), None)
        if longest is not None and at is not None and self._end(longest, of) - longest > self._end(at, of) - at:
            at = longest
        if at is not None:
            self._used.append(at)
        return at

    def _end(self, at: int, of: str) -> int:
        return max((end for end, _ in lexer.READS[of](self.tokens, at)), default=at)

    def words(self, name: str, kind: TargetKind) -> list[int]:
        if kind in (TargetKind.IMAGE, TargetKind.CLIP):
            found = [i for i, t in enumerate(self.tokens) if t.kind == str(kind) and t.text == name]
            given = self.example.image if kind is TargetKind.IMAGE else self.example.clip
            if not found and given != name:
                raise MalformedError(f"{name} is not said")
            return found[:1]
        wanted = [t.text for t in lexer.tokenise(name) if t.kind in ("word", "number") or t.text == "&"]
        if not wanted:
            raise MalformedError("an empty name")
        places = [self._places(word) for word in wanted]
        if not all(places):
            missing = [word for word, found in zip(wanted, places, strict=True) if not found]
            raise MalformedError(f"{missing} not said")
        return _closest(places)

    def _places(self, word: str) -> list[int]:
        usable = [i for i, t in enumerate(self.tokens) if t.kind in ("word", "number") or t.text == "&"]
        same = [i for i in usable if self.tokens[i].text == word]
        if same:
            return same
        forms = {word, *singulars_of(word)}
        number = [i for i in usable if forms & {self.tokens[i].text, *singulars_of(self.tokens[i].text)}]
        if number:
            return number
        heard = [i for i in usable if sounding_forms().get(self.tokens[i].text) == word]  # "rang" of "ringing"
        if heard:
            return heard
        stem = [i for i in usable if self._stems[i] == stem_of(word, _ENDINGS)]
        if stem:
            return stem
        alike = [(SequenceMatcher(None, word, self.tokens[i].text).ratio(), i) for i in usable]
        best = max(alike, default=(0.0, -1))
        return [best[1]] if best[0] >= _ALIKE and len(word) > 3 else []


def _closest(places: list[list[int]]) -> list[int]:
    """Return one place for each word, as close together as they come, the first of equals."""
    best: tuple[int, list[int]] | None = None
    for start in places[0]:
        line = [start]
        for options in places[1:]:
            free = [i for i in options if i not in line]
            if not free:
                break
            line.append(min(free, key=lambda i: abs(i - line[-1] - 1)))
        if len(line) == len(places):
            spread = sum(abs(b - a - 1) for a, b in pairwise(line))
            if best is None or spread < best[0]:
                best = (spread, line)
    if best is None:
        raise MalformedError("a word of a name is said less often than it is needed")
    return best[1]
