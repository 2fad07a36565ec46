"""Python names that moved to another distribution; they work for one more release, with a warning.

Modules are aliases, not copies: ``avlmaps.sim.mesh.Mesh`` is ``avlmaps_sim.mesh.Mesh``, also for what was pickled.
"""

import importlib
import sys
import warnings
from importlib.machinery import ModuleSpec
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from types import ModuleType

_MIXING = ("add_sounds", "background", "clips", "spacing")
_SHARED = ("prompts", "picture_sizes", "sound_windows", "sound_scores")
_ON_TORCH = (
    "device",
    "matches",
    "operators",
    "pictures",
    "precision",
    "pretrained",
    "published",
    "texts",
    "transformer",
)
# A module's name before and now; what lies below moved with it.
MODULES = {
    "avlmaps.sim": "avlmaps_sim",
    "avlmaps.bench": "avlmaps_sim.bench",
    "avlmaps.demo.driving": "avlmaps_sim.robots",
    "avlmaps.demo": "avlmaps_sim.demo",
    **{f"avlmaps.recordings.{one}": f"avlmaps_sim.mixing.{one}" for one in _MIXING},
    "avlmaps.maps.import_reference": "avlmaps_models.import_reference",
    "avlmaps.perception.foundation": "avlmaps_models.foundation",
    "avlmaps.perception.paper": "avlmaps_models.paper",
    **{f"avlmaps.perception.foundation.{one}": f"avlmaps.perception.models.{one}" for one in _SHARED},
    **{f"avlmaps.perception.models.{one}": f"avlmaps_models.common.{one}" for one in _ON_TORCH},
}
# What ``avlmaps`` itself gave.
NAMES = {"RecordSettings": "avlmaps_sim", "open_scene": "avlmaps_sim", "record_scene": "avlmaps_sim"}


class _Finder:
    """Finds modules by the names that they had."""

    def find_spec(self, name: str, path: object = None, target: object = None) -> ModuleSpec | None:
        """Return how an old name is loaded; None for every other name."""
        if not name.startswith("avlmaps."):
            return None
        old = name
        while old not in MODULES:
            old, _, last = old.rpartition(".")
            if not last or "." not in old:
                return None
        return ModuleSpec(name, _Alias(MODULES[old] + name[len(old) :]))  # pyright: ignore[reportArgumentType] - by methods


class _Alias:
    """Puts the module of the new name in the place of the old one."""

    def __init__(self, new: str) -> None:
        self.new = new

    def create_module(self, spec: ModuleSpec) -> None:
        """Leave it to Python to make one, which is replaced."""

    def exec_module(self, module: "ModuleType") -> None:
        """Import the module by its new name."""
        old = module.__name__
        _warn(old, self.new, level=3)
        sys.modules[old] = _imported(self.new, old)


def moved_name(name: str) -> Any:
    """Return what ``avlmaps`` gave by a name of `NAMES`."""
    _warn(f"avlmaps.{name}", f"{NAMES[name]}.{name}", level=4)
    return getattr(_imported(NAMES[name], f"avlmaps.{name}"), name)


def _warn(old: str, new: str, level: int) -> None:
    warnings.warn(f"{old} is now {new}; the old name goes in the next release.", DeprecationWarning, stacklevel=level)


def _imported(new: str, old: str) -> "ModuleType":
    try:
        return importlib.import_module(new)
    except ModuleNotFoundError as fault:
        package = new.partition(".")[0]
        if fault.name != package:
            raise
        from avlmaps.core.extras import install_command

        get = install_command(distribution=package.replace("_", "-"))
        raise ModuleNotFoundError(f"{old} is now {new}, which is not installed; get it with: {get}", name=new) from None


def install() -> None:
    """Let Python find modules by the names that they had; before all else, since empty folders of old may be left."""
    sys.meta_path.insert(0, _Finder())  # pyright: ignore[reportArgumentType] - a finder by its methods
