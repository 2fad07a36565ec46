"""The register of recipes. A recipe yields or returns the parts of a piece; a module of recipes registers its own.

A piece stands on z = 0 with the middle of its footprint at x = y = 0 and its front looks along +x (heading 0), so
its depth runs along x and its width along y. What hangs (a picture, a mirror, a range hood) touches the wall behind
it with its lowest x; the rules of the home choose its height.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from importlib import import_module
from typing import Literal

import numpy as np

from avlmaps_sim.mesh import Mesh, Triple, joined

Families = Literal["training", "held-out", "all"]

# Modules with recipes, imported at the first question.
_MODULES = (
    "seating", "seating_sofas", "seating_chairs", "seating_small", "tables", "tables_low", "beds", "storage",
    "storage_cabinets", "storage_small", "kitchen", "stoves", "kitchen_machines", "bathroom", "washbasins",
    "toiletries", "appliances", "heating", "electronics", "devices", "decor", "lighting", "plants", "drapes",
    "openings", "clutter", "containers", "leisure", "nursery", "fitness", "office", "people",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Support:
    """A flat top that small things may stand on."""

    low: tuple[float, float]  # least x and y
    high: tuple[float, float]  # greatest x and y
    z: float  # height
    clearance_m: float = 1.0  # free height over it


@dataclass(frozen=True, slots=True, eq=False)
class Piece:
    """One thing, ready to be put somewhere."""

    mesh: Mesh  # standing as the module says
    supports: tuple[Support, ...] = ()  # where clutter may stand
    light: tuple[Triple, ...] = ()  # places in the piece's frame that shine (a lamp's bulb)
    category: str = ""  # filled in by the register
    family: str = ""  # filled in by the register


# What a recipe makes: meshes, tops where clutter may stand, and places that shine, all in one frame of its own choice.
Parts = Iterable[Mesh | Support | Triple]
Recipe = Callable[[np.random.Generator], Parts]


@dataclass(frozen=True, slots=True)
class _Family:
    name: str
    recipe: Recipe
    held_out: bool


_REGISTER: dict[str, list[_Family]] = {}
_loaded: list[str] = []


def family(category: str, name: str, held_out: bool = False) -> Callable[[Recipe], Recipe]:
    """Register a recipe as a family of shapes of a category; held-out families never enter training."""

    def keep(recipe: Recipe) -> Recipe:
        _REGISTER.setdefault(category, []).append(_Family(name, recipe, held_out))
        return recipe

    return keep


def _load() -> None:
    if not _loaded:
        for module in _MODULES:
            import_module(f"avlmaps_sim.furniture.{module}")
        _loaded.extend(_MODULES)


def categories() -> tuple[str, ...]:
    """Return every category that has a recipe, sorted."""
    _load()
    return tuple(sorted(_REGISTER))


def families(category: str, which: Families = "all") -> tuple[str, ...]:
    """Return the names of a category's families."""
    _load()
    return tuple(f.name for f in _REGISTER[category] if which == "all" or f.held_out == (which == "held-out"))


def make(category: str, rng: np.random.Generator, which: Families = "all", name: str | None = None) -> Piece:
    """Make a piece of a category.

    Args:
        category: what.
        rng: draws the family and every measure.
        which: from the families that training may see, from those held out (where a category has none: from
            all), or from all.
        name: this family and no other.

    Raises:
        KeyError: no such category or family.
    """
    _load()
    known = _REGISTER[category]
    choice = [f for f in known if which == "all" or f.held_out == (which == "held-out")] or known
    if name is not None:
        choice = [f for f in known if f.name == name]
        if not choice:
            raise KeyError(f"{category} has no family {name!r}; it has {', '.join(f.name for f in known)}")
    chosen = choice[int(rng.integers(len(choice)))]
    return finished(chosen.recipe(rng), category, chosen.name)


def finished(parts: Parts, category: str = "", family: str = "") -> Piece:
    """Join parts into a piece that stands on z = 0 about the origin; its lights and tops move with it."""
    parts = tuple(parts)
    whole = joined([part for part in parts if isinstance(part, Mesh)])
    x, y = ((whole.low + whole.high) / 2)[:2].tolist()
    z = float(whole.low[2])
    tops = tuple(
        Support((s.low[0] - x, s.low[1] - y), (s.high[0] - x, s.high[1] - y), s.z - z, s.clearance_m)
        for s in parts
        if isinstance(s, Support)
    )
    light = tuple((part[0] - x, part[1] - y, part[2] - z) for part in parts if isinstance(part, tuple))
    return Piece(whole.moved(-x, -y, -z), tops, light, category, family)
