"""A command, cut into clauses of one action each: politeness left out, files set aside, order made the order of doing.

Nothing is understood here; that is the grammar's part. "Please visit the sofa after going to the sink, and then turn
left" becomes "going to the sink", "visit the sofa", "turn left".
"""

import re
from dataclasses import dataclass

from avlmaps.language.rules.bare import with_articles
from avlmaps.language.rules.figures import in_figures
from avlmaps.language.rules.motions import plain_motions
from avlmaps.language.rules.purposes import without_purposes
from avlmaps.language.rules.retelling import retold, with_places_of_it
from avlmaps.language.rules.rewriting import rewritten

_PICTURES = r"png|jpe?g|bmp|webp|tiff?"
_CLIPS = r"wav|flac|ogg|mp3|m4a"
_FILE = re.compile(
    rf"""\"([^"]+\.(?:{_PICTURES}|{_CLIPS}))\"|'([^']+\.(?:{_PICTURES}|{_CLIPS}))'|"""
    rf"""((?:[^\s"',;()\[\]<>]+)\.(?:{_PICTURES}|{_CLIPS}))(?=[\s,.;:?!)\]>]|$)""",
    re.IGNORECASE,
)

_MARKS = {
    "⟦both⟧": "the two", "⟦inside⟧": "there", "⟦heading⟧": "heading", "⟦and⟧": "and", "⟦ahead⟧": "in front of you",
    "⟦shuttle⟧": "back and forth",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Clause:
    """One action of a command.

    Attributes:
        text: its words.
        arrival: said only to tell when the next begins ("once you are at the fridge"): no second way there.
    """

    text: str
    arrival: bool = False


@dataclass(frozen=True, slots=True)
class Clauses:
    """A command cut into clauses.

    Attributes:
        clauses: in the order of doing.
        files: the paths that were named; a clause has `⟦i0⟧` for the first if it is a picture, `⟦c0⟧` if a clip.
        left_out: what was left out, since it is nothing to be done.
    """

    clauses: tuple[Clause, ...]
    files: tuple[str, ...]
    left_out: tuple[str, ...] = ()

    def shown(self, text: str) -> str:
        """Return a text of a clause with its files in place again."""
        spoken = re.sub(r"⟦said⟧ ?|(?<=toilet)-room", "", text)
        for mark, meant in _MARKS.items():
            spoken = spoken.replace(mark, meant)
        return re.sub(r"⟦[ic](\d+)⟧", lambda found: self.files[int(found[1])], spoken)


def split_clauses(command: str, *, plainer: bool = False) -> Clauses:
    """Cut a command into clauses; `plainer` tells it again in plainer words before (`retelling`)."""
    text = re.sub(r"[‘’`´]", "'", re.sub(r"[“”«»]", '"', command)).replace("⟦", "(").replace("⟧", ")")
    text, files = _without_files(text)
    # A capital at the start of a sentence is no part of a name.
    text = re.sub(r"(?:^|(?<=[.!?] ))[A-Z](?=[a-z'-]*\b)(?!')(?! [A-Z])", _lowered, text)
    text = text.replace('"', " ")
    text = re.sub(r"(?<=\d)\s*°", " degrees", text)
    text = re.sub(r"(?:^|(?<=\n))\s*[-*•]\s+", "; ", text)
    text = re.sub(r"\s*(?:[-=]+>|→|⇒|➜)\s*", "; ", text)
    text = re.sub(r"\s*(?:[—–]|\s-+\s|\.\.\.|…)\s*", ", ", text)
    text = re.sub(r"(?:^|(?<=[;\n.!?]))\s*(?:\d+|[a-h])[.)]\s+", "; ", text)
    text = re.sub(r"\s*\n\s*", "; ", text.strip())
    text, left_out = without_purposes(in_figures(re.sub(r"\s+", " ", text.replace("&", " and "))))
    text = plain_motions(with_places_of_it(text))
    if plainer:
        told = retold(text)
        text, left_out = told.text, [*left_out, *told.left_out]
    text = rewritten(text)
    pieces = [piece.strip(" ,") for piece in re.split(r"\s*;[\s;,]*", text)]
    return Clauses(tuple(_in_order([with_articles(piece) for piece in pieces if piece])), tuple(files), tuple(left_out))


def _lowered(found: re.Match[str]) -> str:
    return found[0].lower()


def _without_files(text: str) -> tuple[str, list[str]]:
    """Return a text with a mark instead of every file, and the files."""
    files: list[str] = []

    def mark(found: re.Match[str]) -> str:
        path = found[1] or found[2] or found[3]
        files.append(path)
        kind = "i" if re.search(rf"\.(?:{_PICTURES})$", path, re.IGNORECASE) else "c"
        return f" ⟦{kind}{len(files) - 1}⟧ "

    return _FILE.sub(mark, text), files


def _in_order(pieces: list[str]) -> list[Clause]:
    """Return the clauses in the order of doing: "A after B" is B, A; "before A, B" is B, A."""
    clauses: list[Clause] = []
    held: Clause | None = None
    for piece in pieces:
        text = re.sub(r"⟦(?:arrival|after|before)⟧", "", piece).strip(" ,")
        if not re.search(r"[\w⟦]", text):
            continue
        clause = Clause(text, arrival="⟦arrival⟧" in piece)
        if "⟦before⟧" in piece and held is None:
            held = clause
            continue
        if "⟦after⟧" in piece and clauses:
            clauses.insert(len(clauses) - 1, Clause(text))
        else:
            clauses.append(clause)
        if held is not None:
            clauses.append(held)
            held = None
    return clauses if held is None else [*clauses, held]
