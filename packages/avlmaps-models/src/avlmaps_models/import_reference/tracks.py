"""Encoding the sounds of a scene of the data set again, from the walks below ``audio_video/``.

The reference stores its sound map as a pickle, which nobody should read who does not know who wrote it, and which holds
neither the time of a sound nor the sound itself. The tracks that it was made from lie beside it; they are encoded
here as in a build. They were recorded on walks of their own, in the world of the scene's poses: their times are made to
continue from the end of the scene's walk, one walk after the other.
"""

import glob
import shutil
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from avlmaps.core.columns import concat
from avlmaps.core.errors import MapError
from avlmaps.core.registry import Kind, find, load
from avlmaps.core.timeline import Trajectory
from avlmaps.maps.audio.events import collect, detect_events
from avlmaps.maps.settings import HearingSettings
from avlmaps.maps.store.manifest import ModelInfo
from avlmaps.maps.types import HeardSounds
from avlmaps.recordings.open import open_recording
from avlmaps.recordings.types import Recording
from avlmaps_models.import_reference.scene import SceneFiles

WALKS = "audio_video"
HEARING = HearingSettings()


@dataclass(frozen=True, slots=True)
class Ears:
    """Encodes the sounds on the walks of a scene; without walks, silence.

    Attributes:
        walks: opened with their tracks, in the order of their folders.
        start_s: where the time of each begins in the map's.
        backend: of the sound model, ``name`` or ``name@model``.
        model: its entry for the map; None for silence.
    """

    walks: tuple[Recording, ...] = ()
    start_s: Float[np.ndarray, " w"] = field(default_factory=lambda: np.zeros(0))
    backend: str = ""
    model: ModelInfo | None = None

    @classmethod
    def of(cls, scene: SceneFiles, track: str, backend: str, after_s: float) -> "Ears":
        """Open the walks of a scene, and the model that is to hear them.

        Args:
            scene: where they are.
            track: name of the track's file in each walk's folder, such as ``output_level_1.wav``; ``""`` for silence.
            backend: which sound model.
            after_s: end of the scene's own walk.

        Raises:
            MapError: none has such a track.
            RecordingError: a walk cannot be used.
            AudioError: a track cannot be read.
            BackendError: the model is not known, or missing.
        """
        if not track:
            return cls()
        walks = _find_walks(scene.folder, track)
        ends = [max(walk.duration_s, walk.audio.end_s if walk.audio else 0.0) for walk in walks]
        start_s = after_s + np.concatenate([[0.0], np.cumsum(ends)[:-1]])
        card = load(Kind.SOUNDS, backend).card
        return cls(walks, start_s, backend, ModelInfo.of(_with_model(backend), card))

    def ingredients(self) -> list[Any]:
        """Return the values that identify these sounds."""
        return [[walk.fingerprint for walk in self.walks], self.start_s.tolist(), self.model]

    def detect_events(self, clips_folder: Path) -> HeardSounds:
        """Find and encode the sounds of all walks.

        Args:
            clips_folder: where each sound is written as FLAC; made again if there are walks.

        Returns:
            The sounds in the order of their onset, in the map's time.
        """
        if not self.walks:
            return collect([], 0)
        shutil.rmtree(clips_folder, ignore_errors=True)
        heard: list[HeardSounds] = []
        for walk, start_s in zip(self.walks, self.start_s.tolist(), strict=True):
            here = clips_folder / walk.path.name
            track, walked = walk.audio, Trajectory(walk.stamps_s, walk.world_from_camera)
            assert track is not None
            found = detect_events(track, walked, load(Kind.SOUNDS, self.backend), HEARING, here)
            heard.append(_moved(found, here, clips_folder, start_s))
        return _joined(heard)


def _with_model(backend: str) -> str:
    name, _, model = backend.partition("@")
    model = model or find(Kind.SOUNDS, name).model
    return f"{name}@{model}" if model else name


def _find_walks(scene: Path, track: str) -> tuple[Recording, ...]:
    folder = scene / WALKS
    if Path(track).name != track:
        raise MapError(f"{track} is no file's name; give that of the track in each walk, such as output_level_1.wav.")
    found = sorted(path for path in folder.glob(f"*/{glob.escape(track)}") if path.is_file())
    if not found:
        there = sorted({path.name for path in folder.glob("*/*.wav")})
        raise MapError(f"No folder below {folder} has a {track}; there are: {', '.join(there) or 'no .wav files'}.")
    return tuple(open_recording(path.parent, format="avlmaps", audio=path) for path in found)


def _moved(found: HeardSounds, here: Path, clips_folder: Path, start_s: float) -> HeardSounds:
    """Return the sounds in the map's time, their clips under names that no other walk has."""
    names = tuple(clips_folder / f"{here.name}-{clip.name}" for clip in found.clips)
    for clip, name in zip(found.clips, names, strict=True):
        clip.rename(name)
    return replace(found, onset_s=found.onset_s + start_s, offset_s=found.offset_s + start_s, clips=names)


def _joined(heard: Sequence[HeardSounds]) -> HeardSounds:
    """Put the sounds of walks one after the other; the offsets of ragged arrays run on."""
    return concat(heard, clips=tuple(clip for one in heard for clip in one.clips))
