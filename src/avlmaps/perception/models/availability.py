"""Which backends can run here, found without torch, without a network, and without opening a single weight.

A model counts as here when its files lie where loading would look: in the folder of models, in the hub's cache, in
torch's. Whether they are whole and the right ones is found out when they are loaded.
"""

import os
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Literal

from avlmaps.core.errors import BackendError
from avlmaps.core.files import user_path
from avlmaps.core.registry import Backend, load
from avlmaps.perception.models.files import folders_of
from avlmaps.perception.models.published_models import Published, published_models
from avlmaps.perception.models.settings import model_settings

State = Literal["ready", "package missing", "weights missing", "broken"]


@dataclass(frozen=True, slots=True)
class Availability:
    """The state of a backend.

    Attributes:
        state: ``ready`` says that it can be loaded (a small one: that it was).
        model: which model it runs.
        licence: of the weights.
        note: what to do about it, or what to know of its limits.
        dim: length of a feature; 0 where only loading would show it.
    """

    state: State
    model: str = ""
    licence: str = ""
    note: str = ""
    dim: int = 0


def availability(backend: Backend, model: str = "") -> Availability:
    """Return the state of a backend."""
    model = model or backend.model
    if backend.missing:
        return Availability("package missing", model, backend.licence, backend.how_to_get)
    if not model:
        return _loaded(backend)
    licence = backend.licence if model == backend.model else ""
    needed = (model.partition("#")[0], *backend.also)
    missing = [one for one in needed if not is_here(one)]
    if not missing:
        return Availability("ready", model, licence)
    return Availability("weights missing", model, licence, "; ".join(map(how_to_get, missing)))


def _loaded(backend: Backend) -> Availability:
    try:
        card = load(backend.kind, backend.name).card
    except BackendError as fault:  # one broken package must not hide the others
        return Availability("broken", note=str(fault))
    return Availability("ready", card.id, card.licence, card.note, card.dim)


def is_here(model: str) -> bool:
    """Return whether a model's files lie where they would be loaded from."""
    return any(place.exists() for place in _places(model))


def how_to_get(model: str) -> str:
    """Return the command that brings a model, and how much that is where it is known."""
    known = _published(model)
    command = known.get or f"hf download {model}"
    return f"{command} ({_size(known.size_mb)})" if known.size_mb else command


def _published(model: str) -> Published:
    return published_models().get(model, Published())


def _size(size_mb: float) -> str:
    return f"{size_mb / 1000:.1f} GB" if size_mb >= 1000 else f"{size_mb:.0f} MB"


def _places(model: str) -> Iterator[Path]:
    known, folder = _published(model), model_settings().folder
    if known.fetched or (user_path(model) / "manifest.json").is_file():
        yield from (place / "manifest.json" for place in folders_of(model))
        return
    names = known.files or (model,)
    for name in names:
        if folder is not None:
            yield from (folder / name, folder / name.replace("/", "--"), folder / Path(name).name)
        yield user_path(name)
        yield from (_torch_cache() / place / Path(name).name for place in ("checkpoints", "netvlad"))
        if known.package and (package := find_spec(known.package)) is not None and package.origin:
            yield Path(package.origin).parent / name
    repository = known.repository or (model if not known.files and model.count("/") == 1 else "")
    if not repository:
        return
    kept = _hub_cache() / f"models--{repository.replace('/', '--')}" / "snapshots"
    for revision in sorted(kept.glob("*")) if kept.is_dir() else ():
        # A snapshot of which only a configuration was ever fetched is not a model.
        files = [revision / Path(name).name for name in known.files]
        yield from files or (*revision.glob("*.safetensors"), *revision.glob("*.bin"))


def _hub_cache() -> Path:
    """Return where the hub's files are cached, by the environment variables that its own library obeys."""
    if own := os.environ.get("HF_HUB_CACHE") or os.environ.get("HUGGINGFACE_HUB_CACHE"):
        return user_path(own)
    base = Path(os.environ.get("XDG_CACHE_HOME") or "~/.cache")
    return user_path(os.environ.get("HF_HOME") or base / "huggingface") / "hub"


def _torch_cache() -> Path:
    base = Path(os.environ.get("XDG_CACHE_HOME") or "~/.cache")
    return user_path(os.environ.get("TORCH_HOME") or base / "torch") / "hub"
