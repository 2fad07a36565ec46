"""Finding up and the floor in a recording: what the first stages of a build and of a part have in common."""

from collections.abc import Iterator
from contextlib import suppress

import numpy as np

from avlmaps.core.errors import RecordingError
from avlmaps.maps.gravity.floor import GroundedRecording, find_ground
from avlmaps.maps.settings import BuildSettings
from avlmaps.maps.store.manifest import UpInfo
from avlmaps.recordings.types import Frame, Recording

_RANDOMNESS = 1  # number of the stage as a source of randomness (keyframes have 2)


def look_for_up(recording: Recording, settings: BuildSettings) -> UpInfo:
    """Return which way is up: as the recording says, else as the planes in view do, else as the camera was held."""
    from avlmaps.maps.gravity.up import find_up

    if recording.up_in_world is not None:
        return UpInfo.of(recording.up_in_world, "recording", 1.0)
    rng = np.random.default_rng([settings.seed, _RANDOMNESS])
    try:
        up = find_up(spread_frames(recording, settings.gravity.frames), rng)
    except RecordingError:  # too little smooth surface: people and robots hold cameras upright, more or less
        held = -recording.world_from_camera[:, :3, 1].mean(axis=0)
        return UpInfo.of(held if np.linalg.norm(held) > 0.01 else np.array([0.0, 0.0, 1.0]), "camera", 0.0)
    return UpInfo.of(up.direction, "planes", float(up.support))


def spread_frames(recording: Recording, count: int) -> Iterator[Frame]:
    """Read frames evenly spread over the recording; what cannot be read is told when it comes to fusing."""
    for index in np.unique(np.linspace(0, len(recording) - 1, count).round().astype(int)):
        with suppress(RecordingError):
            yield recording.frame(int(index))


def grounded(recording: Recording, settings: BuildSettings) -> Recording:
    """Return the recording with its frames told where up and the floor are; the same on every machine."""
    up = np.array(look_for_up(recording, settings).direction)
    return GroundedRecording(recording, find_ground(spread_frames(recording, settings.gravity.frames), up))
