"""Where the models of the profiles are published and how large they are: for people, not for loading."""

from dataclasses import dataclass

from avlmaps.core.registry import brought, entry_points

ENTRY_POINT_GROUP = "avlmaps.published_models"


@dataclass(frozen=True, slots=True)
class Published:
    """How a model is got.

    Attributes:
        files: names that its single file goes by, below a folder of models; none for a hub's folder under its id.
        repository: the hub's id of the repository that holds such a file.
        package: an installed package in whose folder such a file may lie.
        get: the command that brings it; ``hf download ID`` where it is ``""``.
        fetched: the file that a folder of its name holds once avlmaps has fetched it; ``""`` for all others.
        size_mb: about how much that is; 0 where it is not known.
    """

    files: tuple[str, ...] = ()
    repository: str = ""
    package: str = ""
    get: str = ""
    fetched: str = ""
    size_mb: float = 0.0


# By the name that a profile or the registry gives them. A model that is not here is looked for by its name.
PUBLISHED: dict[str, Published] = {
    "eyes": Published(get="python -m training.pixels --out MODELS/eyes (docs/guides/train-eyes.md)"),
}


def published_models() -> dict[str, Published]:
    """Return every model whose place is known, those that other packages bring among them."""
    found = dict(PUBLISHED)
    for entry in entry_points(group=ENTRY_POINT_GROUP):
        found = {**brought(entry, "the list of published models"), **found}
    return found
