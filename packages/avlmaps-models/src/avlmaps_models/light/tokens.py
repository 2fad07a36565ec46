"""Texts into tokens by byte pairs, in plain Python: as the tokenizers of TIPSv2 and of CLAP's RoBERTa do.

Byte pairs are merged in the order of a learnt list (Sennrich et al., "Neural Machine Translation of Rare Words with
Subword Units", ACL 2016). Two kinds of pieces:

- ``words``: small letters, cut at blanks, ``▁`` in front of each word (SentencePiece); a letter that the vocabulary
  lacks goes in as its bytes;
- ``bytes``: cut into words, numbers and signs with the blank in front of them (GPT-2), each byte a letter.

The export holds every phrase of the lexicon to the published tokenizer before it writes a list.
"""

import unicodedata
import zlib
from functools import lru_cache
from itertools import groupby, pairwise
from pathlib import Path
from typing import Literal

import msgspec

from avlmaps.core.errors import BackendError
from avlmaps.core.files import DESCRIPTION_BYTES, decode_json, read_regular

_MARK = "▁"
_GZIP = 31  # a gzip header, the largest window
_ENDINGS = ("s", "t", "re", "ve", "m", "ll", "d")


class TokenList(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A vocabulary and its merges.

    Attributes:
        kind: of the pieces, ``words`` or ``bytes``.
        vocabulary: tokens by number.
        merges: pairs of tokens, the first to be merged first.
        start: number of the token in front of a text; -1 for none.
        end: number of the token behind it; -1 for none.
        unknown: number of the token for what the vocabulary lacks; -1 for none.
        compatible: whether letters are put into their compatible form first (NFKC).
    """

    kind: Literal["words", "bytes"]
    vocabulary: list[str]
    merges: list[tuple[str, str]]
    start: int = -1
    end: int = -1
    unknown: int = -1
    compatible: bool = False


class Tokens:
    """Turns texts into numbers of tokens.

    Args:
        known: the vocabulary.
        most: tokens of a text; what is longer is cut off.
    """

    def __init__(self, known: TokenList, most: int) -> None:
        self._known, self._most = known, most
        self._number = {token: number for number, token in enumerate(known.vocabulary) if token}
        self._rank = {pair: rank for rank, pair in enumerate(known.merges)}
        self._letters = _letters_of_bytes()
        self._piece = lru_cache(maxsize=4096)(self._of_piece)

    def encode(self, text: str) -> list[int]:
        """Return the numbers of a text's tokens, start and end among them."""
        whole = text.encode("utf-16-le", "surrogatepass").decode("utf-16-le", "replace")
        whole = unicodedata.normalize("NFKC", whole) if self._known.compatible else whole
        pieces = _words(whole) if self._known.kind == "words" else self._byte_pieces(whole)
        numbers = [number for piece in pieces for number in self._piece(piece)]
        start = [self._known.start] if self._known.start >= 0 else []
        end = [self._known.end] if self._known.end >= 0 else []
        return [*start, *numbers[: self._most - len(start) - len(end)], *end]

    def _byte_pieces(self, text: str) -> list[str]:
        return ["".join(self._letters[byte] for byte in piece.encode()) for piece in _gpt_pieces(text)]

    def _of_piece(self, piece: str) -> tuple[int, ...]:
        symbols = self._symbols(piece)
        while len(symbols) > 1:
            ranked = [(self._rank.get(pair, -1), i) for i, pair in enumerate(pairwise(symbols))]
            possible = [entry for entry in ranked if entry[0] >= 0]
            if not possible:
                break
            _, at = min(possible)
            symbols[at : at + 2] = [symbols[at] + symbols[at + 1]]
        return tuple(self._number.get(symbol, self._known.unknown) for symbol in symbols)

    def _symbols(self, piece: str) -> list[str]:
        """Return a piece's letters; one that is not known as its bytes, else as one unknown token for all in a row."""
        symbols: list[str] = []
        for letter in piece:
            as_bytes = [f"<0x{byte:02X}>" for byte in letter.encode()]
            if letter in self._number:
                symbols.append(letter)
            elif all(name in self._number for name in as_bytes):
                symbols.extend(as_bytes)
            elif self._known.unknown >= 0 and symbols[-1:] != [""]:
                symbols.append("")
        return symbols


def read_tokens(path: Path, most: int) -> Tokens:
    """Return the tokens of a file (gzip around JSON).

    Raises:
        BackendError: it cannot be read.
    """
    try:
        unpacked = zlib.decompressobj(wbits=_GZIP).decompress(read_regular(path, DESCRIPTION_BYTES), DESCRIPTION_BYTES)
        return Tokens(decode_json(unpacked, TokenList), most)
    except (OSError, zlib.error, msgspec.DecodeError, UnicodeDecodeError) as fault:
        raise BackendError(f"{path} is no list of tokens ({fault}); get the files again.") from fault


def _words(text: str) -> list[str]:
    runs = groupby(text.lower(), key=lambda letter: _class(letter) == " ")
    return [_MARK + "".join(letters) for blank, letters in runs if not blank]


def _gpt_pieces(text: str) -> list[str]:
    """Cut a text as GPT-2 does: endings after an apostrophe, then words, numbers and signs with one blank in front."""
    pieces: list[str] = []
    at = 0
    while at < len(text):
        stop = _ending(text, at)
        if not stop:
            begin = at + 1 if text[at] == " " and at + 1 < len(text) and _class(text[at + 1]) != " " else at
            kind, stop = _class(text[begin]), begin + 1
            while stop < len(text) and _class(text[stop]) == kind:
                stop += 1
            if kind == " " and stop < len(text) and stop - at > 1:
                stop -= 1  # the last blank goes with what follows
        pieces.append(text[at:stop])
        at = stop
    return pieces


def _ending(text: str, at: int) -> int:
    if text[at] == "'":
        for ending in _ENDINGS:
            if text.startswith(ending, at + 1):
                return at + 1 + len(ending)
    return 0


def _class(letter: str) -> str:
    """Return L for a letter, N for a number, a blank for white space, and ``-`` for any other sign."""
    if letter.isspace() and letter not in "\x1c\x1d\x1e\x1f":
        return " "
    kind = unicodedata.category(letter)[0]
    return kind if kind in "LN" else "-"


def _letters_of_bytes() -> list[str]:
    """Return the letter that stands for each byte: itself where it prints, else one beyond the first 256."""
    plain = {*range(ord("!"), ord("~") + 1), *range(ord("¡"), ord("¬") + 1), *range(ord("®"), ord("ÿ") + 1)}
    others = iter(range(256, 512))
    return [chr(byte) if byte in plain else chr(next(others)) for byte in range(256)]
