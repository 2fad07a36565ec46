"""Writing a published tokenizer as the plain list that `avlmaps_models/light/tokens.py` reads, and proving it equal."""

import gzip
import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import msgspec

from avlmaps_models.light.tokens import TokenList, Tokens

_SENTENCEPIECE = ["WhitespaceSplit", "Metaspace"]
_PLAIN = ("Lowercase", "Precompiled", "NFKC")


class UnknownTokenizerError(ValueError):
    """A tokenizer of a kind that the light profile does not read."""


def write_tokens(tokenizer: Any, path: Path, most: int, texts: Iterable[str]) -> Tokens:
    """Write a tokenizer of transformers as a list, and hold it to the tokenizer.

    Args:
        tokenizer: with a fast backend.
        path: where to write.
        most: tokens of a text.
        texts: that both must read alike.

    Raises:
        UnknownTokenizerError: it is of another kind, or reads a text otherwise.
    """
    known = list_of(json.loads(tokenizer.backend_tokenizer.to_str()))
    made = Tokens(known, most)
    for text in texts:
        expected = list(tokenizer(text, truncation=True, max_length=most)["input_ids"])
        found = made.encode(text)
        if found != expected:
            raise UnknownTokenizerError(f"{text!r} is {expected} by the published tokenizer and {found} by the list")
    path.write_bytes(gzip.compress(msgspec.json.encode(known), mtime=0))
    return made


def list_of(described: dict[str, Any]) -> TokenList:
    """Return the list of a tokenizer's description (tokenizer.json).

    Raises:
        UnknownTokenizerError: it is of another kind.
    """
    model = described["model"]
    if model["type"] != "BPE" or model.get("continuing_subword_prefix") or model.get("end_of_word_suffix"):
        raise UnknownTokenizerError(f"a model of the type {model['type']} with prefixes or suffixes of its own")
    number = {**model["vocab"], **{row["content"]: row["id"] for row in described.get("added_tokens", ())}}
    vocabulary = [""] * (1 + max(number.values()))
    for token, at in number.items():
        vocabulary[at] = token
    pairs = (pair.split(" ") if isinstance(pair, str) else pair for pair in model["merges"])
    merges = [(str(left), str(right)) for left, right in pairs]
    cutting, letters = (
        _parts(described["pre_tokenizer"], "pretokenizers"),
        _parts(described["normalizer"], "normalizers"),
    )
    unknown = number.get(model.get("unk_token") or "", -1)
    names = [part["type"] for part in cutting]
    if names == ["ByteLevel"] and cutting[0].get("use_regex", True) and not letters:
        if cutting[0]["add_prefix_space"]:
            raise UnknownTokenizerError("a blank is put in front of each text")
        start, end = _ends(described["post_processor"])
        return TokenList("bytes", vocabulary, merges, start, end, unknown)
    if (
        names == _SENTENCEPIECE
        and all(part["type"] in _PLAIN for part in letters)
        and letters[0]["type"] == "Lowercase"
    ):
        return TokenList("words", vocabulary, merges, -1, -1, unknown, compatible=len(letters) > 1)
    raise UnknownTokenizerError(f"pieces cut by {', '.join(names)} after {[part['type'] for part in letters]}")


def _parts(described: dict[str, Any] | None, several: str) -> list[dict[str, Any]]:
    if described is None:
        return []
    return described[several] if described["type"] == "Sequence" else [described]


def _ends(described: dict[str, Any] | None) -> tuple[int, int]:
    """Return the numbers of the tokens round a text."""
    for part in _parts(described, "processors"):
        if part["type"] == "RobertaProcessing":
            return int(part["cls"][1]), int(part["sep"][1])
    raise UnknownTokenizerError(f"ends put round a text otherwise than by RoBERTa: {described}")
