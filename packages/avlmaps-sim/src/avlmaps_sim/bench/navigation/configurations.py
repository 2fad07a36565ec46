"""The rows of the tables: whose senses drive. Obstacles, planning, driving and language are the same for all."""

from dataclasses import dataclass

from avlmaps.core.registry import Kind
from avlmaps_sim.bench.navigation.map_variants import Senses
from avlmaps_sim.bench.navigation.missions import Series

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
