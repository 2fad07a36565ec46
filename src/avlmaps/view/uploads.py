"""Files that a person gave to the page."""

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True)
class Upload:
    """A file that a person gave to the page.

    Attributes:
        path: where it lies on this machine; no answer names it.
        name: what its owner calls it.
    """

    path: Path
    name: str


def without_paths(text: str, *uploads: Upload | None) -> str:
    """Return a text in which uploaded files have the names that their owners gave them."""
    for upload in uploads:
        if upload is not None:
            text = text.replace(str(upload.path), upload.name)
    return text
