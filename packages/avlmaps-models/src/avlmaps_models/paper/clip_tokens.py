"""The tokens of OpenAI's CLIP: byte pairs merged in the order of a published list of 48,894 merges.

The list is ``bpe_simple_vocab_16e6.txt.gz`` (released with CLIP and with AudioCLIP; open_clip's package holds it too)
or, the same merges, ``merges.txt`` of any CLIP on the hub.
"""

import gzip
import html
import unicodedata
from collections.abc import Sequence
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path

from tokenizers import Regex, Tokenizer, models, pre_tokenizers

from avlmaps.core.errors import BackendError
from avlmaps_models.common.files import model_file, model_folder

MERGES = 48894
BYTE_PAIRS = "bpe_simple_vocab_16e6.txt.gz"
HOW_TO_GET = f"curl -LO https://github.com/AndreyGuzhov/AudioCLIP/releases/download/v0.1/{BYTE_PAIRS}"
_HUB = ("openai/clip-vit-base-patch32", "openai/clip-vit-large-patch14")
_PIECES = r"'s|'t|'re|'ve|'m|'ll|'d|[\p{L}]+|[\p{N}]|[^\s\p{L}\p{N}]+"


class ClipTokens:
    """Turns phrases into tokens as CLIP did in training: plain lower case, white space folded, both ends marked.

    Args:
        merges: pairs of pieces, each two words in one line, the first to be merged first.
    """

    def __init__(self, merges: Sequence[str]) -> None:
        pairs = [(first, second) for first, _, second in (line.partition(" ") for line in merges)]
        letters = _byte_letters()
        names = [*letters, *(letter + "</w>" for letter in letters), *(first + second for first, second in pairs)]
        numbers = {name: number for number, name in enumerate(names)}
        self.start, self.end = len(names), len(names) + 1
        self._pieces = Tokenizer(models.BPE(vocab=numbers, merges=pairs, end_of_word_suffix="</w>"))
        self._pieces.pre_tokenizer = pre_tokenizers.Sequence(
            [
                pre_tokenizers.Split(Regex(_PIECES), behavior="removed", invert=True),
                pre_tokenizers.ByteLevel(add_prefix_space=False, use_regex=False),
            ]
        )

    def __len__(self) -> int:
        return self.end + 1

    def encode(self, phrases: Sequence[str], context: int = 77) -> list[list[int]]:
        """Return each phrase's tokens, start and end among them; what is longer than the context is cut off."""
        plain = [_plain(phrase) for phrase in phrases]
        return [
            [self.start, *coded.ids[: context - 2], self.end]
            for coded in self._pieces.encode_batch(plain, add_special_tokens=False)
        ]


def clip_tokens() -> ClipTokens:
    """Return CLIP's tokens by the first list of merges that is found: folder of models, open_clip, a CLIP on the hub.

    Raises:
        BackendError: none is here, or it is another list.
    """
    return _tokens(_merges_file())


@lru_cache(maxsize=2)
def _tokens(path: Path) -> ClipTokens:
    raw = path.read_bytes()
    try:
        lines = (gzip.decompress(raw) if path.suffix == ".gz" else raw).decode("utf-8").split("\n")
    except (OSError, EOFError, UnicodeDecodeError) as fault:
        raise BackendError(f"{path} cannot be read ({type(fault).__name__}); get it with: {HOW_TO_GET}") from fault
    merges = [line.strip() for line in lines[1 : 1 + MERGES]]
    if len(merges) < MERGES or not all(line.count(" ") == 1 for line in merges):
        raise BackendError(f"{path} is not CLIP's list of {MERGES} merges; get it with: {HOW_TO_GET}")
    return ClipTokens(merges)


def _merges_file() -> Path:
    try:
        return model_file(BYTE_PAIRS, HOW_TO_GET)
    except BackendError as fault:
        package = find_spec("open_clip")
        if package is not None and package.origin and (kept := Path(package.origin).parent / BYTE_PAIRS).is_file():
            return kept
        for hub_id in _HUB:
            try:
                merges = model_folder(hub_id, ("merges.txt",)) / "merges.txt"
            except BackendError:
                continue
            if merges.is_file():
                return merges
        raise fault from None


def _plain(phrase: str) -> str:
    """Return a phrase as CLIP's own preparation leaves it: straight quotes, single letters, no entities, lower case.

    The published code has ftfy do most of it. Only the mending of text that was decoded wrongly and of terminals'
    colours is left out here. Halves of letters, which the command line makes of bytes that are no text, become marks.
    """
    whole = phrase.encode("utf-16-le", "surrogatepass").decode("utf-16-le", "replace")
    letters = html.unescape(html.unescape(whole)).translate(_PLAIN_LETTERS)
    return " ".join(unicodedata.normalize("NFC", letters).split()).lower()


def _plain_letters() -> dict[int, str | None]:
    """Return the plain form of a letter in a joined, wide or curly form, and None for other characters, as in ftfy."""
    joined = (0x132, 0x133, 0x149, *range(0x1C4, 0x1CD), *range(0x1F1, 0x1F4), *range(0xFB00, 0xFB07))
    wide = (0x3000, *range(0xFF01, 0xFFF0))
    quotes = {
        **dict.fromkeys(map(ord, "\u02bc\u2018\u2019\u201a\u201b"), "'"),
        **dict.fromkeys(range(0x201C, 0x2020), '"'),
    }
    letters = {code: unicodedata.normalize("NFKC", chr(code)).translate(quotes) for code in (*joined, *wide)}
    none = (*range(0x09), 0x0B, *range(0x0E, 0x20), 0x7F, *range(0x206A, 0x2070), 0xFEFF, *range(0xFFF9, 0xFFFD))
    return {**letters, **quotes, **dict.fromkeys(none)}


_PLAIN_LETTERS = _plain_letters()


def _byte_letters() -> list[str]:
    """Return the letter that stands for each byte, in the order of the vocabulary: first the bytes that print."""
    plain = [*range(ord("!"), ord("~") + 1), *range(ord("¡"), ord("¬") + 1), *range(ord("®"), ord("ÿ") + 1)]
    return [*map(chr, plain), *(chr(256 + i) for i in range(256 - len(plain)))]
