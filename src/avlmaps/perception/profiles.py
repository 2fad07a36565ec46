"""Profiles: which backend serves which module. A map stores the name of its profile and every model's card."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from avlmaps.core.errors import BackendError
from avlmaps.core.extras import how_to_get
from avlmaps.core.registry import Kind, brought, entry_points, find
from avlmaps.core.words import nearest

ENTRY_POINT_GROUP = "avlmaps.profiles"
GIVEN = "given:"
MODULES = tuple(kind for kind in Kind if kind is not Kind.WORDS)


@dataclass(frozen=True, slots=True)
class Profile:
    """A name for a set of backends, each by its name or an object; ``""`` where a profile has none for a module.

    Attributes:
        name: the word on the command line.
        pixels: features of objects.
        views: features of areas.
        sounds: features of sounds.
        local: keypoints.
        place: retrieval of places.
        matcher: matching of keypoints.
        about: one sentence for ``avlmaps profiles``.
        weight_variance_m2: v of the weight exp(−d² / (2·v)) by which a pixel counts in fusion, d its distance from the
            camera in metres; the paper's 0.6 makes the nearest looks count alone.
    """

    name: str
    pixels: str | object = ""
    views: str | object = ""
    sounds: str | object = ""
    local: str | object = ""
    place: str | object = ""
    matcher: str | object = ""
    about: str = ""
    weight_variance_m2: float = 0.6

    def choosing(self, choices: Mapping[Kind, str]) -> "Profile":
        """Return the profile with other backends or models (``name``, ``name@model``) for some of its modules.

        Other keypoints bring the matcher that was made for them, unless a matcher is chosen, too.

        Raises:
            BackendError: there is no such backend, or none of these modules is perceived by a profile.
        """
        for kind, name in choices.items():
            if kind is Kind.WORDS:
                raise BackendError("Words are read by each model's own text encoder; there is none to choose.")
            find(kind, name.partition("@")[0])
        chosen: dict[str, Any] = {kind.value: name for kind, name in choices.items()}
        if Kind.LOCAL in choices and Kind.MATCHER not in choices:
            # A matcher's training holds for the keypoints that it was trained on.
            keypoints = find(Kind.LOCAL, choices[Kind.LOCAL].partition("@")[0])
            chosen[Kind.MATCHER.value] = keypoints.matcher or "mutual-ratio"
        return replace(self, **chosen)

    def backend_name(self, kind: Kind) -> str:
        """Return the name of the backend for a module, ``""`` for none; of an object its class's."""
        chosen = getattr(self, kind.value)
        return chosen if isinstance(chosen, str) else GIVEN + type(chosen).__qualname__


def no_backend(profile: str, kind: Kind) -> str:
    """Return the sentence of a module that a profile leaves out."""
    return f"The profile {profile!r} has no {kind} backend; choose another profile (avlmaps profiles)."


_PROFILES: dict[str, Profile] = {}


def register_profile(profile: Profile) -> None:
    """Make a profile known by its name."""
    _PROFILES[profile.name] = profile


def profiles() -> list[Profile]:
    """Return every known profile."""
    own_first = {**_PROFILES, **_brought_profiles()}
    return list({**own_first, **_PROFILES}.values())


def _brought_profiles() -> dict[str, Profile]:
    return {entry.name: brought(entry, "the profile") for entry in entry_points(group=ENTRY_POINT_GROUP)}


def choose_models(name: str, words: Sequence[str] = ()) -> Profile:
    """Return a profile with other backends or models for some modules.

    Args:
        name: of the profile.
        words: ``module=backend`` or ``module=backend@model``.

    Raises:
        BackendError: a word is not of that form, or there is no such profile or backend.
    """
    try:
        choices = read_choices(words)
    except ValueError as problem:
        raise BackendError(f"A choice of models {problem}") from None
    return profile(name).choosing(choices)


def read_choices(words: Sequence[str]) -> dict[Kind, str]:
    """Return the backend and model that ``module=backend`` or ``module=backend@model`` choose for each module.

    Raises:
        ValueError: a word names no module or backend, or two words name the same module; the text continues the name
            of a flag.
    """
    modules = {kind.value: kind for kind in Kind if kind is not Kind.WORDS}
    choices: dict[Kind, str] = {}
    for word in words:
        module, _, backend = word.partition("=")
        if module not in modules or not backend.partition("@")[0]:
            raise ValueError(
                f"takes words like pixels=clip-patches@openai/clip-vit-large-patch14, not {word!r}; the modules are "
                f"{', '.join(modules)}."
            )
        if modules[module] in choices:
            raise ValueError(f"names {module} twice; choose one.")
        choices[modules[module]] = backend
    return choices


def profile(name: str | Profile) -> Profile:
    """Return the profile of that name; one that is given is itself.

    Raises:
        BackendError: there is none.
    """
    if isinstance(name, Profile):
        return name
    if name in _PROFILES:  # installed packages need not be searched
        return _PROFILES[name]
    known = {one.name: one for one in profiles()}
    if name not in known:
        if get := how_to_get("profiles", name):
            raise BackendError(f"The profile {name!r} is not installed; get it with: {get}")
        close = f" Did you mean {near}?" if (near := nearest(name, known)) else ""
        raise BackendError(f"There is no profile called {name!r}; known are: {', '.join(known)}.{close}")
    return known[name]


_EMBEDDED = Profile(
    name="embedded",
    pixels="embedded",
    views="embedded",
    sounds="embedded",
    local="xfeat",
    place="xfeat",
    matcher="xfeat",
    about="small models shipped with the package: no download, no GPU; its eyes learnt from rendered worlds and from "
    "frames of NYU Depth V2, a data set for research that states no licence",
    # A small network knows a sofa from two metres better than a cushion's width of it from half a metre: with nearly
    # even weights 44 % of the voxels of things are named rightly, with the paper's 41 %.
    weight_variance_m2=50.0,
)
register_profile(_EMBEDDED)
register_profile(
    replace(
        _EMBEDDED,
        name="colours",
        pixels="colours",
        views="",
        weight_variance_m2=0.6,
        about="objects by their colour alone: the quickest, and no network for pictures",
    )
)
register_profile(
    replace(
        _EMBEDDED,
        name="synthetic",
        pixels="embedded-synthetic",
        views="embedded-synthetic",
        about="as embedded, but its eyes learnt from rendered worlds alone; weaker in real rooms",
    )
)
register_profile(
    replace(
        _EMBEDDED,
        name="trained",
        pixels="trained",
        views="trained",
        about="as embedded, with eyes that you trained yourself",
    )
)
