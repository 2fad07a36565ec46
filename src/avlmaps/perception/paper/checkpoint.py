"""Reading published checkpoints: tensors only, and every key accounted for."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from pickle import UnpicklingError

import torch

from avlmaps.core.errors import BackendError

State = Mapping[str, torch.Tensor]
_SHOWN = 3


def read_state(path: Path, how_to_get: str) -> dict[str, torch.Tensor]:
    """Return the tensors of a checkpoint that is one flat dictionary of them, on the CPU.

    Args:
        path: a file that ``torch.save`` wrote; nothing in it is run.
        how_to_get: the command or page that brings the right file, for the error.

    Raises:
        BackendError: it cannot be read, or holds something else.
    """
    try:
        state = torch.load(path, map_location="cpu", weights_only=True)
    except (RuntimeError, UnpicklingError, EOFError, OSError, ValueError, KeyError) as fault:
        raise BackendError(
            f"{path} cannot be read as a checkpoint of tensors ({type(fault).__name__}); it may be damaged or cut "
            f"short: get it again with: {how_to_get}"
        ) from fault
    if not isinstance(state, Mapping) or not all(isinstance(value, torch.Tensor) for value in state.values()):
        raise BackendError(f"{path} holds no dictionary of tensors; get the published file with: {how_to_get}")
    return dict(state)


def load_strictly(
    module: torch.nn.Module, state: State, path: Path, how_to_get: str, not_needed: Iterable[str] = ()
) -> None:
    """Fill a module with a checkpoint: no key missing, none left over, every shape right.

    Args:
        module: takes the values.
        state: the checkpoint's tensors.
        path: where they come from, for the error.
        how_to_get: the command or page that brings the right file, for the error.
        not_needed: keys that the checkpoint must have as well, and that this module knowingly does without.

    Raises:
        BackendError: the checkpoint is another model's.
    """
    wanted = {key: value.shape for key, value in module.state_dict().items()}
    idle = set(not_needed)
    wrong = {
        "missing": sorted((wanted.keys() | idle) - state.keys()),
        "not known": sorted(state.keys() - wanted.keys() - idle),
        "of another shape": sorted(k for k, shape in wanted.items() if k in state and state[k].shape != shape),
    }
    if any(wrong.values()):
        told = "; ".join(f"{len(keys)} keys {how} ({_some(keys)})" for how, keys in wrong.items() if keys)
        raise BackendError(f"{path} is not the checkpoint that is expected: {told}; get it with: {how_to_get}")
    module.load_state_dict({key: state[key] for key in wanted}, strict=True)


def _some(keys: list[str]) -> str:
    return ", ".join(keys[:_SHOWN]) + (", ..." if len(keys) > _SHOWN else "")
