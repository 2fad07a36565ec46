"""The name of a model in a map, which may travel: a hub's id or a file's name, never a path of this machine."""

import ntpath
import posixpath


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
