"""Reading checkpoints that hold more than tensors, without running anything that is in them.

A PyTorch-Lightning checkpoint holds hyper-parameters and callbacks beside the weights, as objects of classes of the
program that trained it. torch's safe reader refuses any class that it does not know; here each such class is replaced
by one that stores nothing and does nothing, so that the weights can be read and nothing of the rest comes to life. A
scripted archive (the ``.pt`` files of OpenAI's CLIP) holds code that loading may run; it is opened only where it is, by
its checksum, one of those that OpenAI published.
"""

import hashlib
from collections import OrderedDict
from collections.abc import Mapping
from pathlib import Path
from pickle import UnpicklingError
from typing import Any
from zipfile import BadZipFile, ZipFile

import torch

from avlmaps.core.errors import BackendError

_FAULTS = (RuntimeError, UnpicklingError, EOFError, OSError, ValueError, KeyError, TypeError, AttributeError)
PUBLISHED_SCRIPTS = frozenset(
    {
        "b8cca3fd41ae0c99ba7e8951adf17d267cdb84cd88be6f7c2e0eca1737a03836",  # ViT-L-14.pt
        "3035c92b350959924f9f00213499208652fc7ea050643e8b385c2dac08641f02",  # ViT-L-14-336px.pt
        "5806e77cd80f8b59890b7e101eabd078d9fb84e6937f9e85e4ecb61988df416f",  # ViT-B-16.pt
        "40d365715913c9da98579312b702a82c18be219cc2a73407c4526f58eba950af",  # ViT-B-32.pt
    }
)


def read_weights(path: Path, how_to_get: str, prefix: str = "") -> dict[str, torch.Tensor]:
    """Return a checkpoint's tensors, on the CPU, mapped from the file where it allows that.

    Args:
        path: a flat dictionary of tensors, or a Lightning checkpoint with one under ``state_dict``, or one of the
            scripted archives that OpenAI published.
        how_to_get: the command or page that brings the right file, for the error.
        prefix: taken off every key if all begin with it.

    Raises:
        BackendError: it cannot be read, or holds something else.
    """
    if _is_scripted(path):
        return _of_script(path, how_to_get)
    held = _read(path, how_to_get)
    state = held.get("state_dict", held) if isinstance(held, Mapping) else None
    tensors = isinstance(state, Mapping) and all(isinstance(value, torch.Tensor) for value in state.values())
    if not state or not tensors:
        raise BackendError(f"{path} holds no dictionary of tensors; get the published file: {how_to_get}")
    if all(str(key).startswith(prefix) for key in state):
        return {str(key).removeprefix(prefix): value for key, value in state.items()}
    return {str(key): value for key, value in state.items()}


def _read(path: Path, how_to_get: str) -> Any:
    try:
        with torch.serialization.safe_globals(_stand_ins(path)):
            return torch.load(path, map_location="cpu", weights_only=True, mmap=_is_archive(path))
    except _FAULTS as fault:
        raise BackendError(
            f"{path} cannot be read as a checkpoint ({type(fault).__name__}); it may be damaged, cut short, or hold "
            f"what is not a weight: get the published file: {how_to_get}"
        ) from fault


def _stand_ins(path: Path) -> list[Any]:
    """Return an inert class for each name that the file wants and torch does not know as safe."""
    scan = getattr(torch.serialization, "get_unsafe_globals_in_checkpoint", None)  # from torch 2.6 on
    if scan is None or not _is_archive(path):
        return []
    return [_stand_in(*name.rpartition(".")[::2]) for name in scan(path)]


def _stand_in(module: str, name: str) -> type:
    # Objects of numpy are set up by tuples, all else by dictionaries, and the reader fills only true dictionaries.
    base = _Inert if module.startswith("numpy") else _InertMapping
    return type(name or "unnamed", (base,), {"__module__": module, "__qualname__": name})


class _InertMapping:
    """Stands for a class of another program: it is a dictionary, for any content."""

    def __new__(cls, *_args: Any) -> Any:
        return OrderedDict()


class _Inert:
    """Stands for a class of another program: it is empty, for any content."""

    def __new__(cls, *_args: Any) -> Any:
        return object.__new__(cls)

    def __setstate__(self, _state: Any) -> None:
        """Forget it."""


def _names_in(path: Path) -> list[str]:
    try:
        with ZipFile(path) as archive:
            return archive.namelist()
    except (BadZipFile, OSError):
        return []


def _is_archive(path: Path) -> bool:
    return bool(_names_in(path))


def _is_scripted(path: Path) -> bool:
    return any(name.endswith("/constants.pkl") for name in _names_in(path))


def _of_script(path: Path, how_to_get: str) -> dict[str, torch.Tensor]:
    with path.open("rb") as file:
        found = hashlib.file_digest(file, "sha256").hexdigest()
    if found not in PUBLISHED_SCRIPTS:
        raise BackendError(
            f"{path} is a scripted archive, whose code would run when it is opened, and not one of those that OpenAI "
            f"published; get the published file ({how_to_get}), or one that holds its state_dict() alone."
        )
    try:
        return dict(torch.jit.load(str(path), map_location="cpu").state_dict())
    except _FAULTS as fault:
        raise BackendError(f"{path} cannot be read ({type(fault).__name__}); get it again: {how_to_get}") from fault
