"""Scenes by name: `house:12`, `office:3`, `house:12:held-out`, or a file."""

from pathlib import Path

from avlmaps.core.errors import AvlmapsError
from avlmaps.sim.furniture import Families
from avlmaps.sim.homes import make_home, make_office
from avlmaps.sim.scene import Scene

_MAKERS = {"house": make_home, "office": make_office}
_FAMILIES: dict[str, Families] = {"training": "training", "held-out": "held-out", "all": "all"}


class SceneError(AvlmapsError):
    """A scene cannot be opened: no such kind, no seed, no such file."""


def open_scene(spec: str) -> Scene:
    """Return a scene by its name.

    Args:
        spec: ``house:SEED`` or ``office:SEED``, with ``:training``, ``:held-out`` or ``:all`` (as when nothing is
            said) behind it for the families of furniture; or the path of a file.

    Raises:
        SceneError: there is no such scene.
    """
    kind, _, rest = spec.partition(":")
    if kind in _MAKERS and not Path(spec).exists():
        seed, _, which = rest.partition(":")
        if not seed.isdecimal() or (which or "all") not in _FAMILIES:
            raise SceneError(
                f"the scene {spec!r} names no seed and families; write {kind}:12, or {kind}:12:held-out "
                f"({', '.join(_FAMILIES)})"
            )
        return _MAKERS[kind](int(seed), _FAMILIES[which or "all"])
    if not Path(spec).exists():
        raise SceneError(f"there is no scene {spec!r}; give house:SEED, office:SEED or a file that exists")
    from avlmaps.sim.files import load_scene  # here, so that homes need no reader of files

    return load_scene(Path(spec))
