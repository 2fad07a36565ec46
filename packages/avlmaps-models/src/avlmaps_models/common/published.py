"""Checkpoints that are published as single files of tensors: found, read without running code, loaded strictly."""

from collections.abc import Callable, Collection, Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TypeVar

import torch
from torch import nn

from avlmaps.core.errors import BackendError
from avlmaps.perception.models import model_settings
from avlmaps_models.common.files import model_file

N = TypeVar("N", bound=nn.Module)
_COUNTED = ".num_batches_tracked"  # of training; old files have no such number
_SHOWN = 2


def published_file(name: str, how_to_get: str, repository: str = "", cached: Sequence[str] = ()) -> Path:
    """Return where a published file lies: the folder of models, else the caches of the hub and of torch.

    Nothing is fetched: which copy of a file a program runs is for a person to choose, once.

    Args:
        name: the published name, or a path.
        how_to_get: the command that brings it, for the error.
        repository: the hub's id of the repository that holds it, if any does.
        cached: its paths below ``torch.hub.get_dir()`` as other programs cache it.

    Raises:
        BackendError: it is not here.
    """
    try:
        return model_file(name, how_to_get)
    except BackendError:
        places = [
            _below_models(repository, name),
            _in_hub_cache(repository, name),
            *(Path(torch.hub.get_dir()) / path for path in cached),
        ]
        for place in places:
            if place is not None and place.is_file():
                return place
        raise


def _below_models(repository: str, name: str) -> Path | None:
    """Return where ``hf download`` puts a file when it gets the folder of models and the repository's name in it."""
    folder = model_settings().folder
    return folder / repository / name if folder and repository else None


def _in_hub_cache(repository: str, name: str) -> Path | None:
    if not repository or find_spec("huggingface_hub") is None:
        return None
    from huggingface_hub import try_to_load_from_cache

    found = try_to_load_from_cache(repository, name)
    return Path(found) if isinstance(found, str) else None


def read_tensors(path: Path, how_to_get: str, part: str = "") -> dict[str, torch.Tensor]:
    """Return the tensors that a ``.safetensors`` or a torch file holds by name, on the CPU; no code in it is ever run.

    Args:
        path: the file.
        how_to_get: the command that brings the published one, for the error.
        part: the name under which the file may keep them, beside others.

    Raises:
        BackendError: it is no such file, or holds more than tensors.
    """
    try:
        if path.suffix == ".safetensors":
            from safetensors.torch import load_file

            return load_file(path)
        held = torch.load(path, map_location="cpu", weights_only=True)
    except Exception as fault:
        reason = " ".join(str(fault).split())[:120]
        raise BackendError(
            f"{path} cannot be read as a file of weights ({type(fault).__name__}: {reason}); it may be damaged or cut "
            f"short: get it again with: {how_to_get}"
        ) from fault
    state = held.get(part, held) if isinstance(held, Mapping) else held
    if not isinstance(state, Mapping):
        raise BackendError(f"{path} holds {type(state).__name__} instead of named weights; get it with: {how_to_get}")
    if others := [str(name) for name, value in state.items() if not isinstance(value, torch.Tensor)]:
        raise BackendError(
            f"{path} holds more than weights ({_some(others)}); get the published one with: {how_to_get}"
        )
    return dict(state)


def load_strictly(
    module: nn.Module,
    state: Mapping[str, torch.Tensor],
    path: Path,
    how_to_get: str,
    *,
    computed: Collection[str] = (),
    not_needed: Collection[str] = (),
    takes_all: bool = True,
) -> None:
    """Put weights into a network: each of the network's is there, each of the file's has a place, all sizes agree.

    Args:
        module: the network.
        state: the file's weights, by the network's names.
        path: the file, for the error.
        how_to_get: the command that brings the published one, for the error.
        computed: names that the network works out itself; a file may lack them.
        not_needed: names that the file must have as well, and that this network knowingly does without.
        takes_all: each tensor of the file needs a place; False where the published loader passes over others, too.

    Raises:
        BackendError: the file is of another network; the sentence names the first differences.
    """
    own = module.state_dict()
    needed = [name for name in own if name not in computed and not name.endswith(_COUNTED)]
    missing = [name for name in (*needed, *sorted(not_needed)) if name not in state]
    unknown = [name for name in state if takes_all and name not in own and name not in not_needed]
    sizes = [
        f"{name} {tuple(state[name].shape)} for {tuple(own[name].shape)}"
        for name in own
        if name in state and state[name].shape != own[name].shape
    ]
    if faults := differences(missing, unknown, sizes):
        raise BackendError(
            f"{path} is not the checkpoint of {type(module).__name__}: {faults}. Get the published one with: "
            f"{how_to_get}"
        )
    module.load_state_dict({name: value for name, value in state.items() if name in own}, strict=False)


def network_from(
    make: Callable[[], N],
    what: str,
    state: Mapping[str, torch.Tensor],
    path: Path,
    how_to_get: str,
    not_needed: Collection[str] = (),
) -> N:
    """Return a network with all the weights of a file, on the CPU, ready for inference.

    Args:
        make: returns the network with what sizes the weights have, or raises ``KeyError``, ``ValueError`` or
            ``IndexError`` where they are not its own; its tensors take no memory before the file fills them, so that
            it may hold nothing that it works out itself.
        what: the network, for the error.
        state: the file's weights, by the network's names.
        path: the file, for the error.
        how_to_get: the command that brings the published one, for the error.
        not_needed: names that the file must have as well, and that this network knowingly does without.

    Raises:
        BackendError: the file is of another network.
    """
    try:
        with torch.device("meta"):
            network = make()
    except (KeyError, ValueError, IndexError) as fault:
        raise BackendError(
            f"{path} is not a checkpoint of {what} (it lacks {fault}); get the published one with: {how_to_get}"
        ) from fault
    network = network.to_empty(device="cpu")
    load_strictly(network, state, path, how_to_get, not_needed=not_needed)
    return network.eval().requires_grad_(False)


def differences(missing: Sequence[str], unknown: Sequence[str], sizes: Sequence[str]) -> str:
    """Return in words how a checkpoint differs from its network, ``""`` where it does not."""
    faults = (("it lacks", missing), ("nothing takes", unknown), ("of another size is", sizes))
    return "; ".join(f"{what} {_some(names)}" for what, names in faults if names)


def _some(names: Sequence[str]) -> str:
    return ", ".join(names[:_SHOWN]) + (f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else "")
