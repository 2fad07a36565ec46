"""The models that a suite measures: a profile with others chosen, and the checksums that name them."""

from collections.abc import Sequence
from functools import cache

from avlmaps.core.errors import BackendError
from avlmaps.core.registry import Kind
from avlmaps.perception.profiles import Profile, profile


def chosen_profile(name: str, words: Sequence[str] = ()) -> Profile:
    """Return a profile with other backends for some modules.

    Args:
        name: of the profile.
        words: ``module=backend`` or ``module=backend@model``.

    Raises:
        BackendError: a word names no module or backend, or two words the same module.
    """
    perceived = {kind.value: kind for kind in Kind if kind is not Kind.WORDS}
    choices: dict[Kind, str] = {}
    for word in words:
        module, _, backend = word.partition("=")
        if module not in perceived or not backend.partition("@")[0]:
            raise BackendError(
                f"A model is chosen by words like pixels=clip-patches@openai/clip-vit-large-patch14, not {word!r}; the "
                f"modules are {', '.join(perceived)}."
            )
        if perceived[module] in choices:
            raise BackendError(f"The module {module} is chosen twice; choose one backend for it.")
        choices[perceived[module]] = backend
    return profile(name).choosing(choices)


def checksums(used: Profile) -> dict[str, str]:
    """Return the checksum of every model of a profile, by module. Loads the models: one that is missing raises.

    Raises:
        BackendError: a model's package or files are missing.
    """
    return {kind.value: card.checksum for kind, card in used.cards().items()}


@cache
def shipped_checksums() -> dict[str, str]:
    """Return the checksums of the models that ship with this package (the profile ``embedded``, and its words)."""
    from avlmaps.core.registry import load

    words = load(Kind.WORDS, "embedded")
    return {**checksums(profile("embedded")), "words": words.card.checksum}  # pyright: ignore[reportAttributeAccessIssue]
