"""The kinds of sound, and where the sounds themselves come from: a folder of recordings, or rules."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol, runtime_checkable

import numpy as np

from avlmaps.core.errors import AudioError
from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps.recordings.audio import Sound
from avlmaps_sim.mixing.clips import Clip, audible, audible_part, find_clips

ANYWHERE = ("*",)


@dataclass(frozen=True, slots=True)
class SoundKind:
    """A kind of sound and where a home has it."""

    names: tuple[str, ...]  # what clips of it are called; the first is ours
    objects: tuple[str, ...] = ()  # categories of objects that make it, the likeliest first
    # Kinds of rooms in which it is also heard where nothing that makes it stands; ``("*",)``: in any.
    floor: tuple[str, ...] = ()
    height_m: float = 1.0  # height over the floor there
    level_db: float = 0.0  # loudness at 1 m against other kinds
    indoors: bool = True  # whether homes make it; sounds from outdoors come in by the windows and only on request


# Height over the floor where nothing that makes it stands, metres, and loudness at 1 m against other kinds, dB.
_INDOORS = {
    "running water": (1.0, 0.0), "water drops": (0.9, -6.0), "pouring water": (1.0, -3.0),
    "brushing teeth": (1.3, -4.0), "toilet flush": (0.7, 0.0), "hair dryer": (1.3, 2.0),
    "microwave beep": (1.2, 0.0), "kettle boiling": (1.0, 0.0), "frying": (1.0, -3.0), "blender": (1.0, 4.0),
    "dishes clattering": (1.0, 0.0), "can opening": (1.0, -2.0), "drinking or sipping": (1.1, -6.0),
    "washing machine": (0.5, 0.0), "vacuum cleaner": (0.3, 4.0), "fan or air conditioner": (1.5, -4.0),
    "crackling fire": (0.5, -2.0), "door knock": (1.3, 0.0), "door opening or closing": (1.0, 2.0),
    "creaking door": (1.0, -3.0), "doorbell": (1.8, 2.0), "chest open close": (0.8, -2.0),
    "clock tick": (1.6, -8.0), "alarm clock": (0.6, 2.0), "smoke alarm": (2.3, 4.0), "phone ringing": (0.9, 0.0),
    "keyboard typing": (0.8, -5.0), "mouse click": (0.8, -8.0), "television or music": (1.0, 0.0),
    "piano": (1.0, 2.0), "guitar": (0.8, 0.0), "crying baby": (0.6, 4.0), "snoring": (0.6, -3.0),
    "breathing": (0.6, -8.0), "dog bark": (0.4, 4.0), "cat meowing": (0.3, 0.0), "mouse squeaking": (0.1, -6.0),
    "buzzing insects": (1.5, -6.0), "glass breaking": (0.2, 3.0), "footsteps": (0.1, -3.0), "coughing": (1.4, 0.0),
    "sneezing": (1.4, 2.0), "laughing": (1.4, 0.0), "talking": (1.4, 0.0), "whistling": (1.5, 0.0),
    "clapping": (1.2, 0.0), "children playing": (0.7, 2.0), "electric drill": (1.2, 4.0), "hammering": (1.5, 3.0),
    "hand saw": (0.8, 2.0), "bicycle bell": (1.0, 0.0),
}  # fmt: skip
_OUTDOORS = {
    "crowd cheering": (1.0, 0.0), "rain": (1.5, 0.0),
}  # fmt: skip
# Homes of the simulator call a storage room so.
_AREA = {"storage room": "storage"}


def _kind(name: str, height_m: float, level_db: float, indoors: bool) -> SoundKind:
    entry = lexicon().named(name, EntryKind.SOUND)
    floor = tuple(_AREA.get(room, room) for room in entry.rooms)
    return SoundKind((name, *entry.synonyms), entry.makers, floor, height_m, level_db, indoors)


KINDS: tuple[SoundKind, ...] = tuple(
    _kind(name, *measures, indoors=table is _INDOORS)
    for table in (_INDOORS, _OUTDOORS)
    for name, measures in table.items()
)
_BY_NAME = {kind.names[0]: kind for kind in KINDS}
_FOREIGN = SoundKind(("",), ("window",), ANYWHERE, 1.5, indoors=False)


def kind_of(name: str) -> SoundKind:
    """Return the kind of a sound by its name; one that no home makes comes in by the windows, or from anywhere."""
    entry = lexicon().find(name.replace("_", " "), EntryKind.SOUND)
    return _FOREIGN if entry is None else _BY_NAME.get(entry.name, _FOREIGN)


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
        """Return any clip of the category that can be read. ``AudioError``: none can."""
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

    ``AudioError``: the bank lacks a requested one, or has none of a home.
    """
    if not wanted:
        of_homes = tuple(name for name in bank.categories if kind_of(name).indoors)
        return of_homes or bank.categories
    plain = tuple(sorted({" ".join(name.replace("_", " ").lower().split()) for name in wanted}))
    if missing := [name for name in plain if name not in bank.categories]:
        raise AudioError(f"There are no sounds of {', '.join(missing)}; there are {', '.join(bank.categories)}.")
    return plain
