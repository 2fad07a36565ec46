"""A map as one row of the tables perceives it: whose senses drive, with obstacles shared by all rows."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
from jaxtyping import Float, Int, UInt8

from avlmaps.core.camera import Pinhole
from avlmaps.core.errors import QueryError
from avlmaps.core.question import Modality, Part, Role
from avlmaps.core.registry import Kind
from avlmaps.query.avlmap import AVLMap, role_of
from avlmaps.query.heatmap import Heatmap
from avlmaps.query.modalities import Photo, read_picture
from avlmaps_sim.bench.harness.factors import (
    VoxelHeat,
    WeakHearing,
    alike_keyframe,
    true_places,
    true_regions,
    true_things,
)
from avlmaps_sim.bench.navigation.missions import Series, spoken
from avlmaps_sim.truth import Truth

Sense = Literal["ours", "weak", "true", "none"]


@dataclass(frozen=True, slots=True)
class Senses:
    """Where each modality's heat comes from."""

    objects: Sense = "ours"  # ``ours``, ``true`` or ``none``
    sounds: Sense = "ours"  # ``ours``, ``weak`` (a plainer ear), ``true`` or ``none``
    # ``ours``, ``weak`` (the most alike keyframe's place, nothing matched), ``true`` or ``none``.
    images: Sense = "ours"
    areas: Sense = "ours"  # ``ours``, ``true`` or ``none``


@dataclass(frozen=True, eq=False)
class KnownScene:
    """The truth of a scene, beside its map.

    ``label`` is the true thing of each voxel, -1 for none; a sound's true place is the robot's (``overlay``) or its
    source's (``acoustic``). Photos are ``world_from_camera`` by the names of their files.
    """

    avlmap: AVLMap
    truth: Truth
    label: Int[np.ndarray, " n"]
    hearing: str
    photos: Mapping[str, Float[np.ndarray, "4 4"]]
    weak: Callable[[], WeakHearing]
    heats: dict[tuple[Any, ...], Heatmap] = field(default_factory=dict)


class Perceived(AVLMap):
    """The same map, queried through other encoders; a robot does not notice.

    A sense that is none knows nothing of what is sought, and takes every place as equally near to a mark.
    """

    def __init__(self, scene: KnownScene, senses: Senses) -> None:
        known = scene.avlmap
        super().__init__(known.data, known.encoders, path=known.path, settings=known.settings)
        self.space = scene.avlmap.space  # so that heat of all senses multiplies
        self._scene, self._senses = scene, senses

    def object(self, word: str, primary: bool = False, vocabulary: Sequence[str] | None = None) -> Heatmap:
        """Return the heat of a thing."""
        if self._senses.objects == "none":
            return self._nothing(Modality.OBJECT, word, primary)
        if self._senses.objects == "ours":
            return self._once(("object", word, primary), lambda: self._scene.avlmap.object(word, primary))
        return self._once(("true object", word, primary), lambda: self._true_object(word, primary))

    def sound(self, text: str, primary: bool = False, *, at: Literal["robot", "source"] | None = None) -> Heatmap:
        """Return the heat of where a sound was heard."""
        sense = self._senses.sounds
        makers: dict[str, Callable[[], Heatmap]] = {
            "ours": lambda: self._scene.avlmap.sound(text, primary, at=at),
            "weak": lambda: self._scene.weak().heat(self._category(text), role_of(primary)),
            "true": lambda: self._true_sound(text, primary),
            "none": lambda: self._nothing(Modality.SOUND, text, primary),
        }
        return self._once((sense, "sound", text, primary, at), makers[sense])

    def image(
        self,
        picture: str | Path | Photo | UInt8[np.ndarray, "h w 3"],
        intrinsics: Pinhole | None = None,
        primary: bool = False,
    ) -> Heatmap:
        """Return the heat of where a photo was taken."""
        if isinstance(picture, np.ndarray | Photo):
            raise ValueError("missions name photos by their files")
        name, sense = Path(picture).name, self._senses.images
        makers: dict[str, Callable[[], Heatmap]] = {
            "ours": lambda: self._scene.avlmap.image(picture, intrinsics, primary),
            "weak": lambda: alike_keyframe(self._scene.avlmap, read_picture(Path(picture)), name, role_of(primary)),
            "true": lambda: self._places(Modality.IMAGE, name, primary, [self._scene.photos[name][None, :3, 3]]),
            "none": lambda: self._nothing(Modality.IMAGE, name, primary),
        }
        return self._once((sense, "image", name, primary), makers[sense])

    def area(self, word: str, primary: bool = False) -> Heatmap:
        """Return the heat of a kind of room."""
        sense = self._senses.areas
        makers: dict[str, Callable[[], Heatmap]] = {
            "ours": lambda: self._scene.avlmap.area(word, primary),
            "true": lambda: self._true_area(word, primary),
            "none": lambda: self._nothing(Modality.AREA, word, primary),
        }
        return self._once((sense, "area", word, primary), makers[sense])

    def _once(self, key: tuple[Any, ...], make: Callable[[], Heatmap]) -> Heatmap:
        if key not in self._scene.heats:
            self._scene.heats[key] = make()
        return self._scene.heats[key]

    def _true_object(self, word: str, primary: bool) -> Heatmap:
        part = Part(Modality.OBJECT, word, role_of(primary))
        own = [i for i, thing in enumerate(self._scene.truth.objects) if thing.category == _plain(word)]
        falloff = self.settings.heat.falloff_per_m(part.role)
        return Heatmap.of(true_things(self.space, part, falloff, self._scene.label, own))

    def _category(self, text: str) -> str:
        named = {spoken(event.category): event.category for event in self._scene.truth.events}
        return named.get(spoken(_plain(text)), text)

    def _true_sound(self, text: str, primary: bool) -> Heatmap:
        events = [event for event in self._scene.truth.events if spoken(event.category) == spoken(_plain(text))]
        acoustic = self._scene.hearing == "acoustic"
        tracks = [np.array([event.source if acoustic else event.robot]) for event in events]
        return self._places(Modality.SOUND, text, primary, tracks)

    def _true_area(self, word: str, primary: bool) -> Heatmap:
        own = [area for area in self._scene.truth.areas if area.kind == _plain(word)]
        if primary:  # a primary part has places; those of a room are its middle
            middles = [np.append(area.polygon.mean(axis=0), area.floor_m)[None] for area in own]
            return self._places(Modality.AREA, word, primary, middles)
        return Heatmap.of(true_regions(self.space, Part(Modality.AREA, _plain(word)), own))

    def _places(self, modality: Modality, query: str, primary: bool, tracks: Sequence[np.ndarray]) -> Heatmap:
        part = Part(modality, query, role_of(primary), modality is Modality.IMAGE)
        return Heatmap.of(true_places(self.space, part, self.settings.heat.falloff_per_m(part.role), tracks))

    def _nothing(self, modality: Modality, query: str, primary: bool) -> Heatmap:
        if primary:
            raise QueryError(f"The {modality} {query!r} means nothing to a robot without that sense; name another.")
        part = Part(modality, query, Role.CONTEXT, modality is Modality.IMAGE)
        return Heatmap.of(VoxelHeat(self.space, part, np.ones(len(self.space), np.float32)))


def _plain(words: str) -> str:
    return " ".join(words.replace("_", " ").lower().split()).removeprefix("the ")


OURS, CEILING = "ours", "true perception"
_SOUNDS = (Series.SOUNDS_1, Series.SOUNDS_2, Series.SOUNDS_3)
_TRUE = Senses("true", "true", "true", "true")
_PHOTOS = (Kind.LOCAL, Kind.PLACE, Kind.MATCHER)


@dataclass(frozen=True, slots=True)
class Configuration:
    """A row of a table."""

    name: str
    senses: Senses
    series: tuple[Series, ...]
    needs: tuple[Kind, ...] = ()


CONFIGURATIONS: tuple[Configuration, ...] = (
    Configuration("weaker sound encoder", Senses(sounds="weak"), _SOUNDS),
    Configuration(OURS, Senses(), _SOUNDS, (Kind.SOUNDS,)),
    Configuration(CEILING, _TRUE, _SOUNDS),
    Configuration("objects only", Senses(sounds="none", images="none"), (Series.IMAGES,), (Kind.PIXELS,)),
    Configuration("image by the most alike keyframe", Senses(images="weak"), (Series.IMAGES,), (Kind.PIXELS, *_PHOTOS)),
    Configuration(OURS, Senses(), (Series.IMAGES,), (Kind.PIXELS, *_PHOTOS)),
    Configuration(CEILING, _TRUE, (Series.IMAGES,)),
    Configuration("objects only", Senses(sounds="none", images="none"), (Series.PAIRS,), (Kind.PIXELS,)),
    Configuration("sounds only", Senses(objects="none", images="none"), (Series.PAIRS,), (Kind.SOUNDS,)),
    Configuration("weaker sound encoder", Senses(sounds="weak"), (Series.PAIRS,), (Kind.PIXELS,)),
    Configuration(OURS, Senses(), (Series.PAIRS,), (Kind.PIXELS, Kind.SOUNDS)),
    Configuration("true objects, our sounds", Senses(objects="true"), (Series.PAIRS,), (Kind.SOUNDS,)),
    Configuration(CEILING, _TRUE, (Series.PAIRS,)),
    Configuration(OURS, Senses(), (Series.COMMANDS, Series.SPATIAL), (Kind.PIXELS, Kind.SOUNDS)),
    Configuration(CEILING, _TRUE, (Series.COMMANDS, Series.SPATIAL)),
)


def configurations(series: Series) -> tuple[Configuration, ...]:
    """Return the rows of an experiment, in their order."""
    return tuple(one for one in CONFIGURATIONS if series in one.series)
