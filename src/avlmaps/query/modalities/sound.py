"""Where a sound was heard: by its name or by a clip."""

import itertools
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from avlmaps.core.arrays import Float, Float32
from avlmaps.core.errors import AudioError, QueryError
from avlmaps.core.question import HeardAt, Part
from avlmaps.maps.types import HeardSounds
from avlmaps.query.factors import FOUND_AT, HeatSettings, NearAnchors, stretch_scores
from avlmaps.query.voxel_space import Space
from avlmaps.recordings.audio import Sound

# A clip whose loudest sample is below this (−80 dB of full scale) holds nothing to compare.
_SILENCE = 1e-4


@dataclass(frozen=True, slots=True)
class SoundSettings:
    """From scores to heat."""

    normalise: Literal["none", "min-max"] = "none"
    """``none`` takes the encoder's calibrated scores; ``min-max`` stretches them over the heard sounds (the paper)."""
    at: HeardAt | None = None
    """Where the heat of every sound is: where the robot was when it heard it (the paper), or where it came from. None:
    where a query says, else where the robot was."""
    prior: Literal["lexicon", "none"] = "lexicon"
    """Whether things that usually make a sound count as its source, besides what the microphones say."""


def sound_features(sounds: HeardSounds) -> list[Float32[np.ndarray, "windows d"]]:
    """Return the features of each heard sound."""
    offsets = sounds.feature_offsets
    return [
        np.asarray(sounds.feature[a:b], np.float32) for a, b in itertools.pairwise(offsets)
    ]  # fmt: skip


def sound_factor(
    space: Space,
    sounds: HeardSounds,
    scores: Float[np.ndarray, " sounds"],
    part: Part,
    settings: SoundSettings,
    heat: HeatSettings,
) -> NearAnchors:
    """Return the heat of a sound: its anchors are the places along its track, each with the sound's score.

    ``scores`` are, for each detected sound, the probability that it matches the query.
    """
    best = float(np.max(scores, initial=0.0))
    note = ""
    if not len(sounds):
        note = "the map holds no sounds"
    elif best < FOUND_AT:
        note = (
            f"none of the {len(sounds)} detected sounds is like {part.query!r}; the best score is {best:.2f}, "
            f"below {FOUND_AT:.2f}"
        )
    used = (
        stretch_scores(np.asarray(scores, np.float64)) if settings.normalise == "min-max" else np.clip(scores, 0.0, 1.0)
    )
    which = np.repeat(np.arange(len(sounds)), np.diff(sounds.track_offsets))
    anchors = np.asarray(sounds.track, np.float64).reshape(-1, 3)
    return NearAnchors(
        space, part, heat.falloff_per_m(part.role), anchors, used[which], which, best >= FOUND_AT, part.query, note
    )


def read_clip(path: Path) -> Sound:
    """Read a clip to ask with.

    Raises:
        QueryError: it is missing, unreadable or silent.
    """
    from avlmaps.recordings.audio import AudioTrack

    if not path.is_file():
        raise QueryError(f"The clip {path} is not there; check the name.")
    try:
        sound = AudioTrack.open(path).read()
    except AudioError as fault:
        raise QueryError(f"The clip {path} cannot be read as sound: {fault}") from fault
    return require_audible(sound, str(path))


def require_audible(sound: Sound, name: str) -> Sound:
    """Return the sound, or raise ``QueryError`` where it is empty, silent or holds NaN."""
    if not len(sound.samples):
        raise QueryError(f"The clip {name} has no samples; ask with another one.")
    if not np.isfinite(sound.samples).all():
        raise QueryError(f"The clip {name} holds NaN or infinity; ask with another one.")
    loudest = float(np.abs(sound.samples).max())
    if loudest < _SILENCE:
        raise QueryError(
            f"The clip {name} is silent (its loudest sample is {loudest:.2g}); ask with one that has sound."
        )
    return sound
