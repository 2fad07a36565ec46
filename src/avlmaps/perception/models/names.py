"""What a model is called in a map, which may travel: a hub's id or a file's name, never a path of this machine."""

import ntpath
import posixpath


def public_name(model: str) -> str:
    """Return a model's name without the folders of a path: ``/data/me/tips`` is ``tips``, ``google/tips`` stays.

    A hub's id has at most one slash, so that anything with more, or that starts like a path, is one.
    """
    is_path = model.startswith(("/", "~", ".")) or "\\" in model or model.count("/") > 1 or ntpath.splitdrive(model)[0]
    return posixpath.basename(model.replace("\\", "/").rstrip("/")) if is_path else model


def public_choice(choice: str, card_id: str = "") -> str:
    """Return a backend's name (``name`` or ``name@model``) as a map remembers it.

    Args:
        choice: as in a profile.
        card_id: the model's own name, which stands for a path.
    """
    name, _, model = choice.partition("@")
    if not model or public_name(model) == model:
        return choice
    return f"{name}@{public_name(card_id) or public_name(model)}"
