"""Where the sounds themselves come from: a folder of recordings, or rules."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol, runtime_checkable

import numpy as np

from avlmaps.core.errors import AudioError
from avlmaps.recordings.audio import Sound
from avlmaps_sim.hearing.kinds import kind_of
from avlmaps_sim.mixing.clips import Clip, audible, audible_part, find_clips

_LONGEST_S = 5.0


@runtime_checkable
class Bank(Protocol):
    """A collection of sounds by category."""

    @property
    def categories(self) -> tuple[str, ...]:
        """The categories that it has, sorted."""
        ...

    def draw(self, category: str, rng: np.random.Generator) -> tuple[str, Sound]:
        """Return a clip's name and its audible part, at most five seconds of it."""
        ...


@dataclass(frozen=True, slots=True)
class Synthesised:
    """Sounds made by rule; needs no files."""

    @property
    def categories(self) -> tuple[str, ...]:
        """The categories with a rule, sorted."""
        from avlmaps_sim.synthesis import MAKERS

        return tuple(sorted(MAKERS))

    def draw(self, category: str, rng: np.random.Generator) -> tuple[str, Sound]:
        """Make one; its name holds the seed it was made with."""
        from avlmaps_sim.synthesis import RATE_HZ, synthesise

        seed = int(rng.integers(1 << 31))
        made = audible(Sound(synthesise(category, np.random.default_rng(seed)), RATE_HZ), category)
        return f"synthesised:{category}:{seed}", Sound(made.samples[: round(_LONGEST_S * RATE_HZ)], RATE_HZ)


@dataclass(slots=True)
class Recorded:
    """Clips of a folder, laid out as ``avlmaps add-sounds`` reads them."""

    folder: Path
    rate_hz: int = 22_050
    _clips: dict[str, list[Clip]] = field(default_factory=dict, init=False)

    def __post_init__(self) -> None:
        for clip in find_clips(self.folder):
            self._clips.setdefault(clip.category, []).append(clip)

    @property
    def categories(self) -> tuple[str, ...]:
        """The categories of the folder, sorted."""
        return tuple(sorted(self._clips))

    def draw(self, category: str, rng: np.random.Generator) -> tuple[str, Sound]:
        """Return any clip of the category that can be read.

        Raises:
            AudioError: none can.
        """
        own = self._clips[category]
        problem: AudioError | None = None
        for index in rng.permutation(len(own)):
            try:
                return own[index].name, audible_part(own[index], self.rate_hz, _LONGEST_S)
            except AudioError as error:  # one bad file must not keep the others out
                problem = error
        raise problem or AudioError(f"{self.folder} has no clip of {category!r}.")


def chosen_categories(bank: Bank, wanted: tuple[str, ...] | None) -> tuple[str, ...]:
    """Return the requested categories, or those of the bank that homes make, sorted.

    Raises:
        AudioError: the bank lacks a requested one, or has none of a home.
    """
    if not wanted:
        of_homes = tuple(name for name in bank.categories if kind_of(name).indoors)
        return of_homes or bank.categories
    plain = tuple(sorted({" ".join(name.replace("_", " ").lower().split()) for name in wanted}))
    if missing := [name for name in plain if name not in bank.categories]:
        raise AudioError(f"There are no sounds of {', '.join(missing)}; there are {', '.join(bank.categories)}.")
    return plain
