"""Models: how they are named, where their files lie and are published, and how this process loads them."""

import ntpath
import os
import posixpath
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Literal, get_args

from avlmaps.core.errors import BackendError
from avlmaps.core.files import user_path
from avlmaps.core.registry import Backend, brought, entry_points, forget_loaded, load
from avlmaps.core.wording import option

# By system: the variable that says where, and where it is without one; what has no row is as Linux.
_OWN = {"win32": ("APPDATA", "AppData/Roaming"), "darwin": ("", "Library/Application Support")}
_CACHE = {"win32": ("LOCALAPPDATA", "AppData/Local"), "darwin": ("", "Library/Caches")}


def user_folder() -> Path:
    """Return the folder of this person's own profile; it need not exist yet.

    ``AVLMAPS_HOME`` where it is set; else ``avlmaps`` in ``%APPDATA%``, ``~/Library/Application Support`` or
    ``$XDG_DATA_HOME``.
    """
    own = os.environ.get("AVLMAPS_HOME")
    return user_path(own) if own else _of_system(*_OWN.get(sys.platform, ("XDG_DATA_HOME", ".local/share")))


def cache_folder() -> Path:
    """Return the folder for what can be computed again and may be deleted at any time; it need not exist yet.

    ``cache`` in ``AVLMAPS_HOME`` where that is set; else ``avlmaps`` in ``%LOCALAPPDATA%``, ``~/Library/Caches`` or
    ``$XDG_CACHE_HOME``.
    """
    own = os.environ.get("AVLMAPS_HOME")
    return user_path(own) / "cache" if own else _of_system(*_CACHE.get(sys.platform, ("XDG_CACHE_HOME", ".cache")))


def _of_system(variable: str, usual: str) -> Path:
    return Path(os.environ.get(variable) or Path.home() / usual) / "avlmaps"


Precision = Literal["auto", "float32", "float16", "bfloat16"]


@dataclass(frozen=True, slots=True)
class ModelSettings:
    """How this process loads models."""

    # looked through before the hub's cache; holds models as ``org/name``, ``org--name`` or ``name``, and single files
    # by their name
    folder: Path | None = None
    device: str = "auto"  # ``auto`` (a GPU where there is one), ``cpu``, ``cuda``, ``cuda:1``, ``mps``
    precision: Precision = "auto"  # of weights and activations; ``auto`` is float16 on a CUDA device, else float32
    batch: int = 0  # frames that go through a model at once; 0 lets each model choose (1 on a CPU)
    offline: bool = False  # never ask a hub; only files that are here

    def __post_init__(self) -> None:
        if self.precision not in get_args(Precision):
            raise BackendError(f"There is no precision {self.precision!r}; choose {', '.join(get_args(Precision))}.")
        if self.batch < 0:
            raise BackendError(f"batch is {self.batch}; choose 0 (automatic) or more.")
        if self.folder is not None and not self.folder.is_dir():
            raise BackendError(f"The folder of models {self.folder} is not there; make it, or leave it out.")


def from_environment() -> ModelSettings:
    """Return the settings of AVLMAPS_MODELS, AVLMAPS_DEVICE, AVLMAPS_PRECISION, AVLMAPS_BATCH and HF_HUB_OFFLINE.

    ``BackendError``: one of them is no such value.
    """
    batch = os.environ.get("AVLMAPS_BATCH") or "0"
    if not batch.isdecimal():
        raise BackendError(f"AVLMAPS_BATCH is {batch!r}; set a whole number, 0 for automatic.")
    folder = os.environ.get("AVLMAPS_MODELS")
    return ModelSettings(
        folder=user_path(folder) if folder else None,
        device=os.environ.get("AVLMAPS_DEVICE") or "auto",
        precision=os.environ.get("AVLMAPS_PRECISION") or "auto",  # pyright: ignore[reportArgumentType] - checked there
        batch=int(batch),
        offline=os.environ.get("HF_HUB_OFFLINE", "").upper() in ("1", "TRUE", "YES", "ON"),
    )


def environment_of(settings: ModelSettings) -> dict[str, str]:
    """Return the environment variables that say the same, for processes that this one starts."""
    return {
        "AVLMAPS_MODELS": "" if settings.folder is None else str(settings.folder.absolute()),
        "AVLMAPS_DEVICE": settings.device,
        "AVLMAPS_PRECISION": settings.precision,
        "AVLMAPS_BATCH": str(settings.batch),
        "HF_HUB_OFFLINE": "1" if settings.offline else "0",
    }


def precision_in_force() -> str:
    """Return the precision in which models on torch run here, ``auto`` resolved once one of them has been loaded."""
    return model_settings().precision if _current.resolved is None else _current.resolved()


def resolve_precision(resolved: Callable[[], str]) -> None:
    """Take what says in which precision torch runs; who loads torch calls it, since this module stays without."""
    _current.resolved = resolved


@dataclass(slots=True)
class _Current:
    settings: ModelSettings | None = None
    resolved: Callable[[], str] | None = None


_current = _Current()


def model_settings() -> ModelSettings:
    """Return the settings in force: those of ``use_models``, else the environment's."""
    return _current.settings if _current.settings is not None else from_environment()


def use_models(settings: ModelSettings | None) -> None:
    """Load models so from now on, in the whole process; None goes back to the environment. Loaded ones are let go."""
    _current.settings = settings
    forget_loaded()


@contextmanager
def using_models(settings: ModelSettings) -> Iterator[None]:
    """Load models so for a while."""
    before = _current.settings
    use_models(settings)
    try:
        yield
    finally:
        use_models(before)


ENTRY_POINT_GROUP = "avlmaps.published_models"


@dataclass(frozen=True, slots=True)
class Published:
    """How a model is got."""

    # names of its single file below a folder of models; none for a hub's folder under its id
    files: tuple[str, ...] = ()
    repository: str = ""  # the hub's id of the repository that holds such a file
    package: str = ""  # an installed package in whose folder such a file may lie
    get: str = ""  # the command that brings it; ``hf download ID`` where it is ""
    fetched: str = ""  # the file that a folder of its name holds once avlmaps has fetched it; "" for all others
    size_mb: float = 0.0  # about how much that is; 0 where it is not known


# By the name that a profile or the registry gives them. A model that is not here is looked for by its name.
PUBLISHED = {"eyes": Published(get="python -m training.pixels --out MODELS/eyes (docs/guides/train-eyes.md)")}


def published_models() -> dict[str, Published]:
    """Return every model whose place is known, those that other packages bring among them."""
    found = dict(PUBLISHED)
    for entry in entry_points(group=ENTRY_POINT_GROUP):
        found = {**brought(entry, "the list of published models"), **found}
    return found


def public_name(model: str) -> str:
    """Return a model's name without the folders of a path: ``/data/me/tips`` is ``tips``, ``google/tips`` stays.

    A hub's id has at most one slash, so that anything with more, or that starts like a path, is one. What some backends
    take behind a ``#`` stays.
    """
    place, mark, way = model.partition("#")
    is_path = place.startswith(("/", "~", ".")) or "\\" in place or place.count("/") > 1 or ntpath.splitdrive(place)[0]
    if is_path:
        place = posixpath.basename(place.replace("\\", "/").rstrip("/"))
    return f"{place}{mark}{way}"


def public_choice(choice: str) -> str:
    """Return a backend's choice (``name`` or ``name@model``) as a map remembers it: found again by the model's name."""
    name, at, model = choice.partition("@")
    return f"{name}{at}{public_name(model)}"


def local_model(model: str, how_to_get: str) -> Path:
    """Return the folder or file of a model that is never fetched: a name in the folder of models, or a path.

    ``BackendError``, with the command that brings it, where it is not here.
    """
    for place in places_of(model):
        if place.exists():
            return place
    folder = model_settings().folder
    looked = f"in {folder} and " if folder else f"in no folder of models, {option('models', 'DIR')} sets one, and "
    raise BackendError(f"The model {model} is not here (looked {looked}for that path); get it with: {how_to_get}")


def places_of(model: str) -> list[Path]:
    """Return where a model may lie, the likeliest first."""
    folder = model_settings().folder
    inside = [folder / model, folder / model.replace("/", "--"), folder / Path(model).name] if folder else []
    return [*inside, user_path(model)]


def folders_of(model: str) -> list[Path]:
    """Return where the folder of a model that no hub holds may lie, the likeliest first; the last is the user's own."""
    return [*places_of(model), fetched_folder() / model]


def fetched_folder() -> Path:
    """Return the folder of models that avlmaps fetched itself where the settings name none; it need not exist yet."""
    return user_folder() / "models"


State = Literal["ready", "package missing", "weights missing", "broken"]


@dataclass(frozen=True, slots=True)
class Availability:
    """The state of a backend, its model and licence, what to do about it or know of its limits, and a feature's length.

    ``ready`` says that it can be loaded (a small one: that it was); ``dim`` is 0 where only loading would show it.
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
    known = published_models().get(model, Published())
    command = known.get or f"hf download {model}"
    size = f"{known.size_mb / 1000:.1f} GB" if known.size_mb >= 1000 else f"{known.size_mb:.0f} MB"
    return f"{command} ({size})" if known.size_mb else command


def _places(model: str) -> Iterator[Path]:
    known = published_models().get(model, Published())
    if known.fetched or (user_path(model) / "manifest.json").is_file():
        yield from (place / "manifest.json" for place in folders_of(model))
        return
    for name in known.files or (model,):
        yield from places_of(name)
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
    # By the environment variables that its own library obeys.
    if own := os.environ.get("HF_HUB_CACHE") or os.environ.get("HUGGINGFACE_HUB_CACHE"):
        return user_path(own)
    base = Path(os.environ.get("XDG_CACHE_HOME") or "~/.cache")
    return user_path(os.environ.get("HF_HOME") or base / "huggingface") / "hub"


def _torch_cache() -> Path:
    base = Path(os.environ.get("XDG_CACHE_HOME") or "~/.cache")
    return user_path(os.environ.get("TORCH_HOME") or base / "torch") / "hub"
