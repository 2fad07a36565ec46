"""The models that perceive, one for each module, and the profiles that name a set of them.

An encoder is an object or a name of the registry. A name is resolved where the encoder is used: a map opens without its
models. A map remembers the name of its profile and every model's card.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from avlmaps.core.errors import BackendError
from avlmaps.core.extras import how_to_get
from avlmaps.core.registry import Backend, Kind, brought, entry_points, find, load
from avlmaps.core.words import nearest
from avlmaps.perception import protocols
from avlmaps.perception.own_encoder import completed, whole

ENTRY_POINT_GROUP = "avlmaps.profiles"
GIVEN = "given:"
MODULES = tuple(kind for kind in Kind if kind is not Kind.WORDS)
_OWN = "own"


@dataclass(frozen=True, slots=True)
class Source:
    """Where the encoder of a module comes from."""

    kind: Kind
    name: str  # what a map remembers: ``backend`` or ``backend@model``, or ``given:Class`` for an object
    given: Any = None  # the object, if it is one, or what stands before the named one
    # of its own; a made one does not know all that an object may read: its features are not stored
    has_card: bool = True

    @classmethod
    def of(cls, kind: Kind, one: object) -> "Source":
        """Return the source of an object or a name; raises ``BackendError`` where an object lacks a method."""
        if isinstance(one, str):
            return cls(kind, one)
        return cls(kind, GIVEN + type(one).__qualname__.rpartition(".")[2], completed(kind, one), hasattr(one, "card"))

    def load(self) -> Any:
        """Return the encoder, the same object each time.

        Raises:
            BackendError: it is unknown, a package or file that it needs is missing, or it lacks a method.
        """
        if self.given is not None:
            return self.given
        if self.name.startswith(GIVEN):
            raise BackendError(
                f"The {self.kind} of this map were made by an object of the class {self.name.removeprefix(GIVEN)}, "
                f"which it does not hold; open it in Python with encoders=avlmaps.Encoders({self.kind}=...)."
            )
        encoder = load(self.kind, self.name)
        return encoder if isinstance(encoder, protocols.PROTOCOLS[self.kind]) else whole(self.kind, encoder)

    @property
    def backend(self) -> Backend | None:
        """The registry's entry of a named encoder; raises ``BackendError`` where there is none of that name."""
        return None if self.name.startswith(GIVEN) else find(self.kind, self.name.partition("@")[0])

    @property
    def chosen(self) -> str:
        """Its name with its model: ``name@model``, the default one if no other is chosen."""
        entry = self.backend
        return f"{self.name}@{entry.model}" if entry and entry.model and "@" not in self.name else self.name

    @property
    def is_slow(self) -> bool:
        """Whether its features are known to take longer to make than to store and read."""
        return self.backend is not None and self.backend.is_slow

    @property
    def keyframes_only(self) -> bool:
        """Whether only keyframes are given to it: the other frames add surfaces and colours."""
        entry = self.backend
        return bool(getattr(self.given, "keyframes_only", False)) if entry is None else entry.keyframes_only


@dataclass(frozen=True, slots=True, init=False, repr=False)
class Encoders:
    """The models that perceive, by module; ``encoders.pixels`` is the pixel encoder. One with a name is a profile.

    Attributes:
        sources: where each comes from; a module that is not among them is not perceived.
        about: one sentence for ``avlmaps profiles``.
        weight_variance_m2: v of the weight exp(−d² / (2·v)) by which a pixel counts in fusion, d its distance from the
            camera in metres; the paper's 0.6 makes the nearest looks count alone.
    """

    name: str
    sources: Mapping[Kind, Source]
    about: str
    weight_variance_m2: float

    def __init__(
        self,
        name: str = _OWN,
        *,
        pixels: protocols.PixelEncoder | object | None = None,
        views: protocols.ViewEncoder | object | None = None,
        sounds: protocols.SoundEncoder | object | None = None,
        local: protocols.LocalEncoder | object | None = None,
        place: protocols.PlaceEncoder | object | None = None,
        matcher: protocols.Matcher | object | None = None,
        about: str = "",
        weight_variance_m2: float = 0.6,
        sources: Mapping[Kind, Source] | None = None,
    ) -> None:
        """Take objects, or names of the registry (``name``, ``name@model``); None and ``""`` perceive nothing.

        With ``sources`` the modules come from these alone. ``BackendError``: an object lacks a method of its protocol.
        """
        given = dict(zip(MODULES, (pixels, views, sounds, local, place, matcher), strict=True))
        values = {"name": name, "about": about, "weight_variance_m2": weight_variance_m2}
        for field, value in (values | {"sources": _sources(given) if sources is None else dict(sources)}).items():
            object.__setattr__(self, field, value)

    @classmethod
    def named(cls, profile: "str | Encoders", /, **instead: object) -> "Encoders":
        """Return the encoders of a profile, with others (objects, names of backends, None for none) for some modules.

        Raises:
            BackendError: there is no such profile, module or backend, or an object lacks a method of its protocol.
        """
        return encoders_of(profile).having(**instead)

    @classmethod
    def remembered(cls, name: str, backends: Mapping[str, str]) -> "Encoders":
        """Return encoders by the names that a map has for them; none of them need be known before it is used."""
        return cls(name, sources=_sources({kind: backends.get(kind.value) for kind in MODULES}))

    def having(self, **instead: object) -> "Encoders":
        """Return these encoders with others for some modules; see ``named``."""
        modules = {kind.value: kind for kind in MODULES}
        if unknown := sorted(set(instead) - set(modules)):
            raise BackendError(f"There is no module called {unknown[0]!r}; an encoder is one of {', '.join(modules)}.")
        others = _sources({modules[word]: one for word, one in instead.items()})
        kept = {kind: source for kind, source in self.sources.items() if kind.value not in instead}
        known = _known({**kept, **others})
        return Encoders(self.name, sources=known, weight_variance_m2=self.weight_variance_m2, about=self.about)

    def choosing(self, choices: Mapping[Kind, str]) -> "Encoders":
        """Return these encoders with other backends or models (``name``, ``name@model``) for some modules.

        Other keypoints bring the matcher that was made for them, unless a matcher is chosen, too. ``BackendError``:
        there is no such backend, or no profile perceives that module.
        """
        if Kind.WORDS in choices:
            raise BackendError("Words are read by each model's own text encoder; there is none to choose.")
        chosen = {kind.value: name for kind, name in choices.items()}
        if Kind.LOCAL in choices:
            # A matcher's training holds for the keypoints that it was trained on.
            keypoints = find(Kind.LOCAL, choices[Kind.LOCAL].partition("@")[0])
            chosen.setdefault(Kind.MATCHER.value, keypoints.matcher or "mutual-ratio")
        return self.having(**chosen)

    def over(self, others: "Encoders") -> "Encoders":
        """Return these encoders, and others for the modules that they leave out."""
        sources = {**others.sources, **self.sources}
        return Encoders(others.name, sources=sources, weight_variance_m2=self.weight_variance_m2)

    def __contains__(self, kind: object) -> bool:
        return kind in self.sources

    def __iter__(self) -> Iterator[Kind]:
        return iter(self.sources)

    def __repr__(self) -> str:
        return f"Encoders({self.name!r}: {', '.join(f'{kind}={self.sources[kind].name}' for kind in self)})"

    def name_of(self, kind: Kind) -> str:
        """Return what a map remembers a module's encoder by, ``""`` for none."""
        return self.sources[kind].name if kind in self.sources else ""

    def load(self, kind: Kind) -> Any:
        """Return a module's encoder; ``BackendError`` where there is none, or it cannot be loaded."""
        if kind in self.sources:
            return self.sources[kind].load()
        if self.name == _OWN:
            raise BackendError(
                f"The encoders that were given have no {kind} backend; a map that was made without it is queried "
                f"with one in Python: encoders=avlmaps.Encoders({kind}=...)."
            )
        raise BackendError(
            f"The profile {self.name!r} has no {kind} backend; choose another profile (avlmaps profiles)."
        )

    @property
    def pixels(self) -> protocols.PixelEncoder:
        """Features of objects."""
        return self.load(Kind.PIXELS)

    @property
    def views(self) -> protocols.ViewEncoder:
        """Features of areas."""
        return self.load(Kind.VIEWS)

    @property
    def sounds(self) -> protocols.SoundEncoder:
        """Features of sounds."""
        return self.load(Kind.SOUNDS)

    @property
    def local(self) -> protocols.LocalEncoder:
        """Keypoints."""
        return self.load(Kind.LOCAL)

    @property
    def place(self) -> protocols.PlaceEncoder:
        """Retrieval of places."""
        return self.load(Kind.PLACE)

    @property
    def matcher(self) -> protocols.Matcher:
        """Matching of keypoints."""
        return self.load(Kind.MATCHER)

    @property
    def keyframes_only(self) -> bool:
        """Whether only keyframes get features of pixels."""
        return Kind.PIXELS in self and self.sources[Kind.PIXELS].keyframes_only

    def card(self, kind: Kind) -> protocols.ModelCard:
        """Return one module's card; no other model is loaded for it. Raises ``BackendError`` where there is none."""
        return self.load(kind).card

    def cards(self) -> dict[Kind, protocols.ModelCard]:
        """Return the card of every model. Loads them."""
        return {kind: self.card(kind) for kind in MODULES if kind in self}


def _sources(given: Mapping[Kind, object]) -> dict[Kind, Source]:
    return {kind: Source.of(kind, one) for kind, one in given.items() if one is not None and one != ""}


def _known(sources: dict[Kind, Source]) -> dict[Kind, Source]:
    for source in sources.values():
        _ = source.backend
    return sources


def register_profile(profile: Encoders) -> None:
    """Make a profile known by its name."""
    _PROFILES[profile.name] = profile


def profiles() -> list[Encoders]:
    """Return every known profile; other packages bring theirs through the entry point group ``avlmaps.profiles``."""
    others = {entry.name: brought(entry, "the profile") for entry in entry_points(group=ENTRY_POINT_GROUP)}
    return list({**_PROFILES, **others, **_PROFILES}.values())


def profile(name: str) -> Encoders:
    """Return the profile of that name; ``BackendError`` where there is none."""
    if name in _PROFILES:  # installed packages need not be searched
        return _PROFILES[name]
    known = {one.name: one for one in profiles()}
    if name not in known:
        if get := how_to_get("profiles", name):
            raise BackendError(f"The profile {name!r} is not installed; get it with: {get}")
        close = f" Did you mean {near}?" if (near := nearest(name, known)) else ""
        raise BackendError(f"There is no profile called {name!r}; known are: {', '.join(known)}.{close}")
    return known[name]


def encoders_of(chosen: str | Encoders) -> Encoders:
    """Return the encoders of a profile's name, or encoders themselves; ``BackendError`` where there are none."""
    if isinstance(chosen, str):
        chosen = profile(chosen)
    if not isinstance(chosen, Encoders):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise BackendError(
            f"Encoders are an avlmaps.Encoders or the name of a profile, not {type(chosen).__qualname__}; an encoder "
            "of your own goes in as avlmaps.Encoders(pixels=encoder)."
        )
    _known(dict(chosen.sources))
    return chosen


def read_choices(words: Sequence[str]) -> dict[Kind, str]:
    """Return the backend and model that ``module=backend`` or ``module=backend@model`` choose for each module.

    ``ValueError`` where a word names no module or backend, or two name one; the text continues the name of a flag.
    """
    modules = {kind.value: kind for kind in MODULES}
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


_KEYPOINTS: Any = {"local": "xfeat", "place": "xfeat", "matcher": "xfeat"}
# A small network knows a sofa from two metres better than a cushion's width of it from half a metre: with nearly even
# weights 44 % of the voxels of things are named rightly, with the paper's 41 %.
_EVEN_M2 = 50.0
_PROFILES = {one.name: one for one in (
    Encoders(
        "embedded", pixels="embedded", views="embedded", sounds="embedded", **_KEYPOINTS, weight_variance_m2=_EVEN_M2,
        about="small models shipped with the package: no download, no GPU; its eyes learnt from rendered worlds and "
        "from frames of NYU Depth V2, a data set for research that states no licence",
    ),
    Encoders(
        "colours", pixels="colours", sounds="embedded", **_KEYPOINTS,
        about="objects by their colour alone: the quickest, and no network for pictures",
    ),
    Encoders(
        "synthetic", pixels="embedded-synthetic", views="embedded-synthetic", sounds="embedded", **_KEYPOINTS,
        about="as embedded, but its eyes saw rendered worlds and photographs, no NYU Depth V2; weaker in real rooms",
        weight_variance_m2=_EVEN_M2,
    ),
    Encoders(
        "trained", pixels="trained", views="trained", sounds="embedded", **_KEYPOINTS, weight_variance_m2=_EVEN_M2,
        about="as embedded, with eyes that you trained yourself",
    ),
)}  # fmt: skip
