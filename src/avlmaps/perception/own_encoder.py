"""An encoder that somebody wrote for a script: what its protocol needs and it does not say is made for it.

An encoder of pixels or views needs ``encode_words``, one of sounds ``score_words``; each its ``encode`` where a map is
to be made with it. A card, a vocabulary and ``understood`` are made.
"""

import hashlib
import inspect
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import cache
from typing import Any

import numpy as np

from avlmaps.core.errors import AvlmapsError, BackendError
from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps.core.registry import Kind
from avlmaps.perception.protocols import ModelCard

_NEEDED = {
    Kind.PIXELS: ("encode_words",),
    Kind.VIEWS: ("encode_words",),
    Kind.SOUNDS: ("score_words",),
    Kind.LOCAL: ("encode",),
    Kind.PLACE: ("fit", "encode"),
    Kind.MATCHER: ("match",),
}
_OF_WORDS = (Kind.PIXELS, Kind.VIEWS)
_DEEPEST = 4
_whole: dict[int, tuple[object, object]] = {}


def completed(kind: Kind, encoder: object) -> Any:
    """Return an encoder of a module with all that its protocol asks for: itself where it has that already.

    ``BackendError``: it is a class, or lacks a method that nobody can make for it.
    """
    name = type(encoder).__qualname__
    if isinstance(encoder, type):
        raise BackendError(
            f"The {kind} encoder is the class {encoder.__qualname__}; give an object: {encoder.__qualname__}()."
        )
    lacking = [method for method in _NEEDED[kind] if not callable(getattr(encoder, method, None))]
    if lacking:
        raise BackendError(
            f"An encoder of {kind} needs {' and '.join(_NEEDED[kind])}; the {name} that was given has no {lacking[0]} "
            "(avlmaps.perception.protocols)."
        )
    made = _made(kind, encoder)
    missing = {attribute: value for attribute, value in made.items() if not hasattr(encoder, attribute)}
    if not hasattr(encoder, "card"):
        missing["card"] = made_card(kind, encoder)
    if kind is Kind.PIXELS and "vocabulary" in missing:
        rows = np.asarray(_words_of(Kind.PIXELS, encoder, missing["vocabulary"]))
        known = tuple(name for name, row in zip(missing["vocabulary"], rows, strict=False) if np.any(row))
        if not known:
            raise BackendError(
                f"The pixels encoder {type(encoder).__qualname__} has no vocabulary, the names that compete for a "
                "voxel, and knows none of the lexicon's things; give it one, such as vocabulary = ('red', 'green')."
            )
        missing["vocabulary"] = known
    if not missing:
        return encoder
    return with_members(encoder, (name for name in dir(encoder) if not name.startswith("_")), missing)


def whole(kind: Kind, encoder: object) -> Any:
    """Return a package's encoder as ``completed`` does, the same object each time."""
    before, made = _whole.get(id(encoder), (None, None))
    if before is not encoder:
        made = completed(kind, encoder)
        _whole[id(encoder)] = encoder, made
    return made


class _Members:
    # In an object's own dictionary, where ``isinstance`` sees them.
    def __init__(self, encoder: object, members: Mapping[str, Any]) -> None:
        self.__dict__.update(members)
        self._name = type(encoder).__qualname__

    def __repr__(self) -> str:
        return self._name


def with_members(encoder: object, names: Iterable[str], others: Mapping[str, Any]) -> Any:
    """Return an object with those of some members that an encoder has, and with others beside or instead of them."""
    members: dict[str, Any] = {}
    for name in names:
        with suppress(AttributeError):  # it has none, or a property does not hold yet
            members[name] = getattr(encoder, name)
    return _Members(encoder, members | dict(others))


def _made(kind: Kind, encoder: Any) -> dict[str, Any]:
    name = type(encoder).__qualname__

    @cache
    def understood(word: str) -> str:
        return word if np.any(np.asarray(encoder.encode_words([word]))) else ""

    def refuse(of: str) -> Callable[..., np.ndarray]:
        def refused(*_: object) -> np.ndarray:
            raise BackendError(f"The encoder {name} of {kind} has no {of}; it encodes words alone.")

        return refused

    if kind is Kind.PIXELS:
        things = tuple(entry.name for entry in lexicon().entries(EntryKind.THING) if entry.split == "training")
        return {"vocabulary": things, "understood": understood, "encode": refuse("encode")}
    if kind is Kind.VIEWS:
        return {"encode": refuse("encode")}
    methods = ("encode", "encode_words", "score_sounds")
    return {"vocabulary": (), **{of: refuse(of) for of in methods}} if kind is Kind.SOUNDS else {}


def made_card(kind: Kind, encoder: Any) -> ModelCard:
    """Return a card for an encoder without one: its class's name, and a hash of its code and of what it holds."""
    dim = 0
    if kind in _OF_WORDS:
        rows = np.asarray(_words_of(kind, encoder))
        if rows.ndim != 2 or len(rows) != 1 or rows.shape[1] < 1:
            raise BackendError(
                f"encode_words of the {kind} encoder {type(encoder).__qualname__} must give a row for each word, shape "
                f"(1, d) for one; it gave {rows.shape}."
            )
        dim = rows.shape[1]
    digest = hashlib.sha256()
    for piece in (type(encoder).__qualname__.encode(), _code(type(encoder)), *_held(encoder, _DEEPEST)):
        digest.update(hashlib.sha256(piece).digest())
    note = "its card was made from its code and what it holds; it had none"
    return ModelCard(type(encoder).__qualname__.rpartition(".")[2], dim, "unknown", digest.hexdigest(), note=note)


def _words_of(kind: Kind, encoder: Any, words: Sequence[str] = ("chair",)) -> Any:
    try:
        return encoder.encode_words(list(words))
    except AvlmapsError:
        raise
    except Exception as fault:
        raise BackendError(
            f"encode_words({list(words)[:1]}) of the {kind} encoder {type(encoder).__qualname__} raised "
            f"{type(fault).__name__}: {fault}"
        ) from fault


def _code(kind: type) -> bytes:
    try:
        return inspect.getsource(kind).encode()
    except (OSError, TypeError):  # there is none to read
        return b""


def _held(value: Any, depth: int) -> Iterator[bytes]:
    value = _opened(value)
    if isinstance(value, np.ndarray):
        yield f"{value.dtype} {value.shape}".encode() + np.ascontiguousarray(value).tobytes()
    elif isinstance(value, str | bytes | int | float | bool | None):
        yield repr(value).encode()
    elif depth and isinstance(value, Mapping):
        for name in sorted(value, key=repr):
            yield repr(name).encode()
            yield from _held(value[name], depth - 1)
    elif depth and isinstance(value, Sequence):
        for one in value:
            yield from _held(one, depth - 1)
    else:
        yield type(value).__qualname__.encode()


def _opened(value: Any) -> Any:
    if isinstance(value, str | bytes | int | float | bool | None | np.ndarray | Mapping | Sequence):
        return value
    if callable(getattr(value, "state_dict", None)):
        return dict(value.state_dict())
    if callable(getattr(value, "cpu", None)):  # a tensor
        return value.cpu().numpy()
    names = getattr(value, "__slots__", ())
    return getattr(
        value,
        "__dict__",
        {name: getattr(value, name) for name in names if hasattr(value, name)} or type(value).__qualname__,
    )
