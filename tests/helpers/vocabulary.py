"""Checks the words of everything a reader sees: pages, help, errors, docstrings and comments.

The table "Words to avoid" of docs/glossary.md is the list. ``python tests/helpers/vocabulary.py [FILE ...]`` prints
each hit as ``file:line: word -> better word`` and exits 1 if there is one.

Code, text in backticks, names of arguments and quoted sentences are exempt: they are names, data or the words of
somebody else. Strings in triple quotes are prose. Other strings count as prose from four words on, because shorter
ones are mostly keys, names and phrases to be parsed.
"""

import argparse
import io
import re
import sys
import tokenize
from bisect import bisect_right
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
GLOSSARY = ROOT / "docs" / "glossary.md"
HEADING = "## Words to avoid"
LEAST_WORDS = 4
# Folders and files whose prose is still to be rewritten. The aim is an empty list.
NOT_YET: tuple[str, ...] = ()
# The glossary quotes the words, the change log is history, and benchmarks/ (checked) writes the page of results.
EXEMPT = ("docs/glossary.md", "docs/benchmarks.md", "CHANGELOG.md")
_QUOTED = re.compile(r"(?m:^[ \t]*\w+:(?=\s))|``.*?``|`[^`]*`|\"[^\"\n]{1,120}\"|“[^”]*”", re.DOTALL)
# Names of tables in docs/benchmarks.json and in the figures that ship with the weights.
_TABLES = ("cross-validation: asked by words", "phrases kept out of training")
_NAMES = re.compile("|".join(map(re.escape, _TABLES)))
_FENCED = re.compile(r"^(```|~~~).*?^\1|^(?: {4}|\t).*?$|<!--.*?-->|\]\([^)]*\)", re.MULTILINE | re.DOTALL)
_FIELD = re.compile(r"\{[^{}]*\}")
_SKIPPED = {tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT}
_FSTRING_MIDDLE: int = getattr(tokenize, "FSTRING_MIDDLE", -1)
_FSTRING_BOUNDS = {getattr(tokenize, name, -1) for name in ("FSTRING_START", "FSTRING_END")}


@dataclass(frozen=True)
class Hit:
    """One word to avoid: where it stands, what it is, and what the glossary says instead."""

    file: str
    line: int
    word: str
    better: str

    def __str__(self) -> str:
        return f"{self.file}:{self.line}: {self.word!r} -> {self.better}"


def words_to_avoid(page: str | None = None) -> dict[str, str]:
    """Reads the table of the glossary: each word or phrase of the left column, with the right column's text.

    Raises:
        ValueError: The page has no such table, or a word stands in two rows.
    """
    text = GLOSSARY.read_text(encoding="utf-8") if page is None else page
    found: dict[str, str] = {}
    for row in re.findall(r"^\| *([^|]+?) *\| *([^|]*?) *\|$", text.partition(HEADING)[2], re.MULTILINE):
        if row[0] in ("Not", "---"):
            continue
        for word in row[0].split(","):
            if word.strip() in found:
                raise ValueError(f"The glossary lists {word.strip()!r} twice.")
            found[word.strip()] = row[1]
    if not found:
        raise ValueError(f"{GLOSSARY.name} has no table under {HEADING!r}.")
    return found


def hits_in(file: str, text: str, words: dict[str, str]) -> list[Hit]:
    """Returns the words to avoid in one file's prose; the suffix says how it is read (``.md`` or ``.py``)."""
    pattern = re.compile(r"\b(" + "|".join(sorted(map(_phrase, words), key=len, reverse=True)) + r")\b", re.IGNORECASE)
    pieces = _python_prose(text) if file.endswith(".py") else [(1, _blank(_FENCED, text))]
    found: list[Hit] = []
    for first_line, piece in pieces:
        prose = _blank(_NAMES, _blank(_QUOTED, piece))
        starts = [0, *(match.end() for match in re.finditer("\n", prose))]
        for match in pattern.finditer(prose):
            word = re.sub(r"\s+", " ", match[0]).lower()
            found.append(Hit(file, first_line + bisect_right(starts, match.start()) - 1, word, words[word]))
    return found


def files() -> Iterator[Path]:
    """Yields every file whose prose is checked."""
    for pattern in (
        "*.md",
        "docs/**/*.md",
        "training/**/*.md",
        "training/**/*.py",
        "src/avlmaps/**/*.py",
        "packages/*/*.md",
        "packages/*/src/**/*.py",
        "benchmarks/**/*.py",
    ):
        for path in sorted(ROOT.glob(pattern)):
            name = path.relative_to(ROOT).as_posix()
            if not name.startswith((*EXEMPT, *NOT_YET)):
                yield path


def hits(paths: Iterable[Path]) -> list[Hit]:
    """Returns the words to avoid in these files."""
    words = words_to_avoid()
    return [
        hit
        for path in paths
        for hit in hits_in(path.resolve().relative_to(ROOT).as_posix(), path.read_text(encoding="utf-8"), words)
    ]


def _phrase(words: str) -> str:
    return r"\s+".join(map(re.escape, words.split()))


def _blank(pattern: re.Pattern[str], text: str) -> str:
    """Replaces each match by spaces and keeps line breaks, so that places stay."""
    return pattern.sub(lambda match: re.sub(r"[^\n]", " ", match[0]), text)


def _python_prose(text: str) -> list[tuple[int, str]]:
    """Returns (first line, text) of each block of comments and of each string that is prose."""
    blocks: list[_Block] = []
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        kind = _kind(token)
        if kind == "other":
            if blocks:
                blocks[-1].closed = True
        elif kind is not None:
            last = blocks[-1] if blocks else None
            if last is None or last.kind != kind or last.closed or token.start[0] > last.line + 1:
                last = _Block(kind, token.start[0])
                blocks.append(last)
            last.add(token)
    return [(block.first, block.text) for block in blocks if block.is_prose()]


def _kind(token: tokenize.TokenInfo) -> str | None:
    if token.type in _SKIPPED or token.type in _FSTRING_BOUNDS:
        return None
    if token.type == tokenize.COMMENT:
        return "comment"
    return "string" if token.type in (tokenize.STRING, _FSTRING_MIDDLE) else "other"


class _Block:
    """Comments on consecutive lines, or strings that Python joins, as one text with the file's line breaks."""

    def __init__(self, kind: str, line: int) -> None:
        self.kind, self.first, self.line = kind, line, line
        self.text, self.closed, self._raw, self._long = "", False, False, False

    def add(self, token: tokenize.TokenInfo) -> None:
        self.text += "\n" * (token.start[0] - self.line)
        self.text += self._content(token)
        self.line = token.end[0]

    def is_prose(self) -> bool:
        if self._raw:
            return False
        return self.kind == "comment" or self._long or len(re.findall(r"[^\W\d_]{2,}", self.text)) >= LEAST_WORDS

    def _content(self, token: tokenize.TokenInfo) -> str:
        if self.kind == "comment":
            return token.string.lstrip("#")
        if token.type == _FSTRING_MIDDLE:
            return token.string
        prefix, body = re.match(r"(?s)([a-zA-Z]*)(.*)", token.string).groups()  # pyright: ignore[reportOptionalMemberAccess]
        self._raw |= "r" in prefix.lower()
        quotes = 3 if body[:3] in ('"""', "'''") else 1
        self._long |= quotes == 3
        body = body[quotes:-quotes]
        return _blank(_FIELD, body) if "f" in prefix.lower() else body


def main() -> int:
    """Prints the hits in the named files, or in all of them."""
    parser = argparse.ArgumentParser(description="Report words that docs/glossary.md lists as words to avoid.")
    parser.add_argument("files", nargs="*", type=Path, metavar="FILE")
    given = parser.parse_args().files
    checked = set(files())
    found = hits([path for path in given if path.resolve() in checked] if given else sorted(checked))
    for hit in found:
        sys.stdout.write(f"{hit}\n")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
