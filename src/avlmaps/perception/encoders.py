"""The models that perceive, one for each module: objects, or names of the registry.

A name is resolved where encoders are made, and its model is loaded when it is first used: a map opens without it.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

from avlmaps.core.errors import BackendError
from avlmaps.core.registry import Backend, Kind, find, load
from avlmaps.perception.profiles import GIVEN, MODULES, Profile, no_backend, profile
from avlmaps.perception.protocols import (
    PROTOCOLS,
    LocalEncoder,
    Matcher,
    ModelCard,
    PixelEncoder,
    PlaceEncoder,
    SoundEncoder,
    ViewEncoder,
)

if TYPE_CHECKING:
    from avlmaps.perception.cache.feature_store import FeatureStore

_OWN = "own"


@dataclass(frozen=True, slots=True)
class Source:
    """Where the encoder of a module comes from.

    Attributes:
        kind: the module.
        name: what a map remembers it by: ``backend`` or ``backend@model``, or ``given:Class`` for an object.
        given: the object, if it is one.
        has_card: whether that brought a card of its own; one that was made knows its code and numbers, not all that
            it may read, so that its features are not stored.
        remembering: puts a store before the encoder, which rounds features of pixels by slow models to float16; None
            gives it as it is.
        store: that store; None stores none.
    """

    kind: Kind
    name: str
    given: Any = None
    has_card: bool = True
    remembering: "Callable[..., Any] | None" = None
    store: "FeatureStore | None" = None

    def load(self) -> Any:
        """Return the encoder, the same object each time where nothing is remembered.

        Raises:
            BackendError: it is unknown, a package or file that it needs is missing, or it lacks a method.
        """
        encoder = self.given
        if encoder is None:
            if self.name.startswith(GIVEN):
                raise BackendError(
                    f"The {self.kind} of this map were made by an object of the class "
                    f"{self.name.removeprefix(GIVEN)}, which it does not hold; open it in Python with "
                    f"encoders=avlmaps.Encoders({self.kind}=...)."
                )
            encoder = load(self.kind, self.name)
            if not isinstance(encoder, PROTOCOLS[self.kind]):
                from avlmaps.perception.own_encoder import whole

                encoder = whole(self.kind, encoder)
        if self.remembering is None:
            return encoder
        return self.remembering(self.kind, encoder, self.store, half=self.is_slow)

    @property
    def _entry(self) -> Backend | None:
        return None if self.given is not None else find(self.kind, self.name.partition("@")[0])

    @property
    def chosen(self) -> str:
        """Its name with its model: ``name@model``, the default one if no other is chosen."""
        entry = self._entry
        return f"{self.name}@{entry.model}" if entry and entry.model and "@" not in self.name else self.name

    @property
    def on_torch(self) -> bool:
        """Whether it is known as a large model on torch."""
        return self._entry is not None and "torch" in self._entry.needs

    @property
    def is_slow(self) -> bool:
        """Whether its features are known to take longer to make than to store and read."""
        return self._entry is not None and self._entry.is_slow

    @property
    def keyframes_only(self) -> bool:
        """Whether only keyframes are given to it: the other frames add surfaces and colours."""
        entry = self._entry
        return bool(getattr(self.given, "keyframes_only", False)) if entry is None else entry.keyframes_only


@dataclass(frozen=True, slots=True, init=False, repr=False)
class Encoders:
    """The models that perceive, by module; ``encoders.pixels`` is the pixel encoder.

    Attributes:
        name: of the profile that they come from; ``own`` where there is none.
        sources: where each comes from; a module that is not among them is not perceived.
        weight_variance_m2: see ``Profile``.
    """

    name: str
    sources: Mapping[Kind, Source]
    weight_variance_m2: float

    def __init__(
        self,
        name: str = _OWN,
        *,
        pixels: PixelEncoder | object | None = None,
        views: ViewEncoder | object | None = None,
        sounds: SoundEncoder | object | None = None,
        local: LocalEncoder | object | None = None,
        place: PlaceEncoder | object | None = None,
        matcher: Matcher | object | None = None,
        weight_variance_m2: float = 0.6,
    ) -> None:
        """Take objects, or names of the registry (``name``, ``name@model``); None and ``""`` perceive nothing.

        Raises:
            BackendError: an object lacks a method of its protocol.
        """
        given = dict(zip(MODULES, (pixels, views, sounds, local, place, matcher), strict=True))
        self._set(
            name, {kind: _source(kind, one) for kind, one in given.items() if one not in (None, "")}, weight_variance_m2
        )

    def _set(self, name: str, sources: Mapping[Kind, Source], weight_variance_m2: float) -> None:
        for field, value in (("name", name), ("sources", sources), ("weight_variance_m2", weight_variance_m2)):
            object.__setattr__(self, field, value)

    @classmethod
    def of(cls, name: str, sources: Mapping[Kind, Source], weight_variance_m2: float = 0.6) -> "Encoders":
        """Return the encoders of these sources."""
        made = cls.__new__(cls)
        made._set(name, dict(sources), weight_variance_m2)
        return made

    @classmethod
    def named(cls, profile: str | Profile, /, **instead: object) -> "Encoders":
        """Return the encoders of a profile, with others for some modules.

        Args:
            profile: it, or its name (``avlmaps profiles``).
            instead: by module: an object, the name of a backend, or None for none.

        Raises:
            BackendError: there is no such profile, module or backend, or an object lacks a method of its protocol.
        """
        return encoders_of(profile).having(**instead)

    @classmethod
    def remembered(cls, name: str, backends: Mapping[str, str]) -> "Encoders":
        """Return encoders by the names that a map has for them; none of them need be known before it is used."""
        kinds = [kind for kind in MODULES if backends.get(kind.value)]
        return cls.of(name, {kind: Source(kind, backends[kind.value]) for kind in kinds})

    def having(self, **instead: object) -> "Encoders":
        """Return these encoders with others for some modules; see ``named``."""
        unknown = set(instead) - {kind.value for kind in MODULES}
        if unknown:
            raise BackendError(
                f"There is no module called {sorted(unknown)[0]!r}; an encoder is one of "
                f"{', '.join(kind.value for kind in MODULES)}."
            )
        sources = {kind: source for kind, source in self.sources.items() if kind.value not in instead}
        for word, one in instead.items():
            if one is not None and one != "":
                sources[Kind(word)] = _source(Kind(word), one)
        return Encoders.of(self.name, sources, self.weight_variance_m2)

    def over(self, others: "Encoders") -> "Encoders":
        """Return these encoders, and others for the modules that they leave out."""
        return Encoders.of(others.name, {**others.sources, **self.sources}, self.weight_variance_m2)

    def without(self, kind: Kind) -> "Encoders":
        """Return the encoders but for one module's."""
        return self.having(**{kind.value: None})

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
        """Return a module's encoder.

        Raises:
            BackendError: there is none, or it cannot be loaded.
        """
        if kind not in self.sources:
            if self.name == _OWN:
                raise BackendError(
                    f"The encoders that were given have no {kind} backend; a map that was made without it is queried "
                    f"with one in Python: encoders=avlmaps.Encoders({kind}=...)."
                )
            raise BackendError(no_backend(self.name, kind))
        return self.sources[kind].load()

    @property
    def pixels(self) -> PixelEncoder:
        """Features of objects."""
        return cast(PixelEncoder, self.load(Kind.PIXELS))

    @property
    def views(self) -> ViewEncoder:
        """Features of areas."""
        return cast(ViewEncoder, self.load(Kind.VIEWS))

    @property
    def sounds(self) -> SoundEncoder:
        """Features of sounds."""
        return cast(SoundEncoder, self.load(Kind.SOUNDS))

    @property
    def local(self) -> LocalEncoder:
        """Keypoints."""
        return cast(LocalEncoder, self.load(Kind.LOCAL))

    @property
    def place(self) -> PlaceEncoder:
        """Retrieval of places."""
        return cast(PlaceEncoder, self.load(Kind.PLACE))

    @property
    def matcher(self) -> Matcher:
        """Matching of keypoints."""
        return cast(Matcher, self.load(Kind.MATCHER))

    @property
    def keyframes_only(self) -> bool:
        """Whether only keyframes get features of pixels."""
        return Kind.PIXELS in self and self.sources[Kind.PIXELS].keyframes_only

    def card(self, kind: Kind) -> ModelCard:
        """Return one module's card; no other model is loaded for it. Raises ``BackendError`` where there is none."""
        return cast(ModelCard, self.load(kind).card)

    def cards(self) -> dict[Kind, ModelCard]:
        """Return the card of every model. Loads them."""
        return {kind: self.card(kind) for kind in MODULES if kind in self}


def encoders_of(chosen: str | Profile | Encoders) -> Encoders:
    """Return the encoders of a profile or of its name; encoders are themselves.

    Raises:
        BackendError: it is none of these, there is no such profile or backend, or an object lacks a method of its
            protocol.
    """
    if isinstance(chosen, Encoders):
        return chosen
    if not isinstance(chosen, str | Profile):
        raise BackendError(
            f"Encoders are an avlmaps.Encoders or the name of a profile, not {type(chosen).__qualname__}; an encoder "
            "of your own goes in as avlmaps.Encoders(pixels=encoder)."
        )
    used = profile(chosen)
    given = {kind.value: getattr(used, kind.value) for kind in MODULES}
    return Encoders(used.name, **given, weight_variance_m2=used.weight_variance_m2)


def _source(kind: Kind, one: object) -> Source:
    if isinstance(one, str):
        find(kind, one.partition("@")[0])
        return Source(kind, one)
    from avlmaps.perception.own_encoder import completed

    name = GIVEN + type(one).__qualname__.rpartition(".")[2]
    return Source(kind, name, completed(kind, one), hasattr(one, "card"))
