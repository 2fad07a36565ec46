"""Where the models of the profiles are published and how large they are: for people, not for loading."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Published:
    """How a model is got.

    Attributes:
        files: names that its single file goes by; none for a hub's folder under its id.
        repository: the hub's id of the repository that holds the file.
        get: the command that brings it; ``hf download ID`` where it is ``""``.
        size_mb: about how much that is; 0 where it is not known.
        also: other models that its backend needs.
        note: what to know of its limits.
    """

    files: tuple[str, ...] = ()
    repository: str = ""
    get: str = ""
    size_mb: float = 0.0
    also: tuple[str, ...] = ()
    note: str = ""


PUBLISHED: dict[str, Published] = {}
