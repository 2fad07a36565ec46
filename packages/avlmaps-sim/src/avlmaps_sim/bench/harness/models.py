"""The checksums that name the models a suite measures."""

from functools import cache

from avlmaps.core.registry import Kind
from avlmaps.perception.encoders import Encoders


def checksums(used: Encoders) -> dict[str, str]:
    """Return the checksum of every model of some encoders, by module. Loads the models: one that is missing raises.

    Raises:
        BackendError: a model's package or files are missing.
    """
    return {kind.value: card.checksum for kind, card in used.cards().items()}


@cache
def shipped_checksums() -> dict[str, str]:
    """Return the checksums of the models that ship with this package (the profile ``embedded``, and its words)."""
    from avlmaps.core.registry import load

    words = load(Kind.WORDS, "embedded")
    return {**checksums(Encoders.named("embedded")), "words": words.card.checksum}  # pyright: ignore[reportAttributeAccessIssue]
