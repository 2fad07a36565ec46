"""Where models are loaded from and where they run: settings of this process, not of a map.

What a map depends on (which model, its checksum) is in its cards; these say how this machine gets at it.
"""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

from avlmaps.core.errors import BackendError
from avlmaps.core.files import user_path
from avlmaps.core.registry import forget_loaded

Precision = Literal["auto", "float32", "float16", "bfloat16"]


@dataclass(frozen=True, slots=True)
class ModelSettings:
    """How this process loads models.

    Attributes:
        folder: looked through before the hub's cache; holds models as ``org/name``, ``org--name`` or ``name``, and
            single files by their name.
        device: ``auto`` (a GPU where there is one), ``cpu``, ``cuda``, ``cuda:1``, ``mps``.
        precision: of weights and activations; ``auto`` is float16 on a CUDA device and float32 elsewhere.
        batch: frames that go through a model at once; 0 lets each model choose (1 on a CPU).
        offline: never ask a hub; only files that are here.
    """

    folder: Path | None = None
    device: str = "auto"
    precision: Precision = "auto"
    batch: int = 0
    offline: bool = False

    def __post_init__(self) -> None:
        if self.precision not in get_args(Precision):
            raise BackendError(f"There is no precision {self.precision!r}; choose {', '.join(get_args(Precision))}.")
        if self.batch < 0:
            raise BackendError(f"batch is {self.batch}; choose 0 (automatic) or more.")
        if self.folder is not None and not self.folder.is_dir():
            raise BackendError(f"The folder of models {self.folder} is not there; make it, or leave it out.")


def from_environment() -> ModelSettings:
    """Return the settings of AVLMAPS_MODELS, AVLMAPS_DEVICE, AVLMAPS_PRECISION, AVLMAPS_BATCH and HF_HUB_OFFLINE.

    Raises:
        BackendError: one of them is no such value.
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
