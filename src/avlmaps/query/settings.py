"""What can be chosen about a query."""

from dataclasses import dataclass, field

from avlmaps.core.errors import QueryError
from avlmaps.core.numbers import hold_numbers
from avlmaps.query.factors import FOUND_AT, HeatSettings
from avlmaps.query.modalities.area import AreaSettings
from avlmaps.query.modalities.sound import SoundSettings
from avlmaps.query.object_settings import ObjectSettings


@dataclass(frozen=True, slots=True)
class QuerySettings:
    """Everything about a query that can be chosen."""

    heat: HeatSettings = field(default_factory=HeatSettings)
    """How fast heat falls."""
    objects: ObjectSettings = field(default_factory=ObjectSettings)
    """From a word to instances."""
    sounds: SoundSettings = field(default_factory=SoundSettings)
    """From a sound's scores to heat."""
    areas: AreaSettings = field(default_factory=AreaSettings)
    """From views to heat."""
    found_at: float = FOUND_AT
    """A query is found where its first goal is right with at least this probability, all parts together; in [0, 1]."""
    seed: int = 0
    """Seed of what is drawn at random when a picture is located."""

    def __post_init__(self) -> None:
        hold_numbers(self, QueryError)
        if not 0.0 <= self.found_at <= 1.0:
            raise QueryError(f"A query cannot be found at a probability of {self.found_at:g}; it lies between 0 and 1.")
