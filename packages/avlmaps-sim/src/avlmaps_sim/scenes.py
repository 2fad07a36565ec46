"""Scenes by name: `house:12`, `office:3`, `house:12:held-out`, `house:12:lived-in`, `house:12:day-3`, a file."""

from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from avlmaps.core.errors import AvlmapsError
from avlmaps_sim.furniture import Families
from avlmaps_sim.homes import lived_in, make_home, make_office
from avlmaps_sim.rearranged import Change, rearranged
from avlmaps_sim.scene import Scene

_MAKERS = {"house": make_home, "office": make_office}
_LIVED_IN = "lived-in"
_DAY = "day-"
_FAMILIES: dict[str, Families] = {"training": "training", "held-out": "held-out", "all": "all"}


class SceneError(AvlmapsError):
    """A scene cannot be opened: no such kind, no seed, no such file."""


def open_scene(spec: str) -> Scene:
    """Return a scene by its name.

    Args:
        spec: ``house:SEED`` or ``office:SEED``, with ``:training``, ``:held-out`` or ``:all`` (as when nothing is
            said) behind it for the families of furniture, ``:lived-in`` for people, clothes, papers, shower
            curtains and mirrors that reflect, and, last, ``:day-N`` for the building N days later; or the path of a
            file.

    Returns:
        The scene; the name of a building made by rule is the one that it was opened by.

    Raises:
        SceneError: there is no such scene.
    """
    return open_changed(spec)[0]


def open_changed(spec: str) -> tuple[Scene, tuple[Change, ...]]:
    """Return a scene by its name, and what changed in it since day 0; see ``open_scene``."""
    if not isinstance(spec, str):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise SceneError(f"a scene is a text such as house:12, or the path of a file as a text; not {spec!r}")
    before, day = _day_of(spec)
    if day is None or Path(spec).exists():
        return _opened(spec), ()
    scene, changes = _rearranged(before, day)
    return replace(scene, name=spec), changes


@lru_cache(maxsize=2)  # days are mostly opened one after the other, and each follows from the one before
def _rearranged(before: str, day: int) -> tuple[Scene, tuple[Change, ...]]:
    if day == 0:
        return _opened(before), ()
    scene, changes = _rearranged(before, day - 1)
    scene, new = rearranged(scene, day, _families_of(before), day - 1)
    return scene, (*changes, *new)


def on_day(spec: str, day: int) -> str:
    """Return the name of a scene made by rule on a later day.

    ``SceneError``: the day is before the first, the name says one already, or it is that of a file.
    """
    if day < 0:
        raise SceneError(f"a scene cannot be rearranged {day} times; give 0 or more")
    if _day_of(spec)[1] is not None:
        raise SceneError(f"the scene {spec!r} names its day already; leave out {_DAY}N, or the number of days")
    if Path(spec).exists() or spec.partition(":")[0] not in _MAKERS:
        raise SceneError(f"only house:SEED and office:SEED can be rearranged, not {spec!r}")
    return f"{spec}:{_DAY}{day}" if day else spec


def _day_of(spec: str) -> tuple[str, int | None]:
    before, _, last = spec.rpartition(":")
    if before and last.startswith(_DAY) and last.removeprefix(_DAY).isdecimal():
        return before, int(last.removeprefix(_DAY))
    return spec, None


def _families_of(spec: str) -> Families:
    said: list[Families] = [_FAMILIES[word] for word in spec.split(":") if word in _FAMILIES]
    return said[0] if said else "all"


def _opened(spec: str) -> Scene:
    kind, _, rest = spec.partition(":")
    if kind in _MAKERS and not Path(spec).exists():
        return _made(kind, *rest.split(":"), spec=spec)
    if not Path(spec).exists():
        raise SceneError(f"there is no scene {spec!r}; give house:SEED, office:SEED or a file that exists")
    from avlmaps_sim.files import load_scene  # here, so that homes need no reader of files

    return load_scene(Path(spec))


def _made(kind: str, seed: str, *words: str, spec: str) -> Scene:
    which = [word for word in words if word != _LIVED_IN]
    if not seed.isdecimal() or len(which) > 1 or not set(which) <= _FAMILIES.keys() or words.count(_LIVED_IN) > 1:
        raise SceneError(
            f"the scene {spec!r} names no seed and families; write {kind}:12, or {kind}:12:held-out "
            f"({', '.join(_FAMILIES)}), :{_LIVED_IN} behind it for people, clothes and mirrors that reflect, and "
            f":{_DAY}N last for the building N days later"
        )
    families = _FAMILIES[which[0] if which else "all"]
    scene = replace(_MAKERS[kind](int(seed), families), name=spec)  # by which a command opens it again
    if _LIVED_IN not in words:
        return scene
    return replace(lived_in(scene, np.random.default_rng([int(seed), 11]), families), mirrors=True)
