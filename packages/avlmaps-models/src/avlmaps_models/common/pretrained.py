"""Models of transformers from a local folder: loaded strictly, with one sentence for what does not fit."""

from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

import torch

from avlmaps.core.errors import BackendError
from avlmaps_models.common.checksums import weights_in
from avlmaps_models.common.files import model_folder
from avlmaps_models.common.published import differences

T = TypeVar("T")
# Constants that transformers works out itself; old checkpoints hold them as if they were weights.
_COMPUTED = ("position_ids", "token_type_ids", "relative_position_index", "num_batches_tracked", "inv_freq")
_TOKENS = ("tokenizer.json", "vocab.json", "vocab.txt", "*.model")
_SMALL = ("*.json", "*.txt", "*.model", "*.jinja")


def pretrained_folder(model: str) -> Path:
    """Return the folder of a model, fetched from the hub if need be: safetensors where it has them, else its ``.bin``.

    Raises:
        BackendError: it is not here and cannot be fetched, or holds no weights.
    """
    folder = model_folder(model)
    if not weights_in(folder):
        folder = model_folder(model, (*_SMALL, "pytorch_model*.bin"))
    if not weights_in(folder):
        raise BackendError(f"{folder} holds no weights (*.safetensors or *.bin); get it with: hf download {model}")
    return folder


def load_pretrained(
    kind: type[T],
    folder: Path,
    model: str,
    device: torch.device,
    precision: torch.dtype,
) -> T:
    """Return a model of transformers, ready for inference on a device, every weight from the checkpoint.

    Nothing but tensors is read from a file, no code is run and no hub is queried.

    Args:
        kind: its class, such as ``ClapModel``.
        folder: where its files lie.
        model: what it is called, for the error.
        device: where it shall run.
        precision: of its weights.

    Raises:
        BackendError: the checkpoint is of another model, damaged, or not whole.
    """
    load: Any = kind
    try:
        with _quietly():
            made, loading = load.from_pretrained(
                folder, output_loading_info=True, local_files_only=True, dtype=precision, weights_only=True
            )
    except Exception as fault:  # transformers, safetensors and torch raise many types for damaged files
        raise BackendError(
            f"{folder} cannot be loaded as {kind.__name__} ({type(fault).__name__}: {_short(fault)}); get it again "
            f"with: hf download {model}"
        ) from fault
    missing = _uncomputed(loading["missing_keys"])
    unknown = _uncomputed(loading["unexpected_keys"])
    sizes = [str(name) for name, *_ in loading.get("mismatched_keys", ())]
    if faults := differences(missing, unknown, sizes):
        raise BackendError(f"{folder} is not a whole {kind.__name__}: {faults}. Get it again with: hf download {model}")
    return made.eval().to(device)


def load_helper(kind: Any, folder: Path, model: str) -> Any:
    """Return a tokenizer or feature extractor of transformers from a local folder.

    Raises:
        BackendError: its files are missing or damaged.
    """
    try:
        with _quietly():
            made = kind.from_pretrained(folder, local_files_only=True)
        # without its files, transformers makes up a tokenizer that knows no word
        if hasattr(made, "convert_tokens_to_ids") and not any(path for name in _TOKENS for path in folder.glob(name)):
            raise FileNotFoundError(f"none of {', '.join(_TOKENS)} is there")
        return made
    except Exception as fault:
        raise BackendError(
            f"{folder} has no {kind.__name__} that can be loaded ({type(fault).__name__}: {_short(fault)}); get all "
            f"its files with: hf download {model}"
        ) from fault


@contextmanager
def _quietly() -> Iterator[None]:
    """Hide transformers' bars and reports of loading: avlmaps reports what matters of them."""
    from transformers.utils import logging

    bars, level = logging.is_progress_bar_enabled(), logging.get_verbosity()
    logging.disable_progress_bar()
    logging.set_verbosity_error()
    try:
        yield
    finally:
        logging.set_verbosity(level)
        if bars:
            logging.enable_progress_bar()


def _uncomputed(names: Collection[str]) -> list[str]:
    return sorted(name for name in names if name.rpartition(".")[2] not in _COMPUTED)


def _short(fault: Exception, words: int = 24) -> str:
    said: Sequence[str] = str(fault).split()
    return " ".join(said[:words]) + (" ..." if len(said) > words else "")
