"""An up direction that someone gave, held against the level surfaces in view, how the camera was held, and the walk."""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float

from avlmaps.core.errors import RecordingError
from avlmaps.core.wording import option
from avlmaps.maps.gravity.up import find_up
from avlmaps.recordings.consistency.verdict import Finding, Grade, Reason
from avlmaps.recordings.types import Frame, Recording

_FRAMES = 16
# Given and found directions closer than this are one; beside it, a slope or a tilted sensor explains the difference.
_APART_DEG = 20.0
# Planes count where so large a share of the surface agrees and the camera was held within this angle of them.
_LEAST_SUPPORT, _HELD_DEG = 0.1, 40.0
# A walk is level: along what is up it spreads less than half as far as along what is not.
_FLATTER, _STILL_M = 0.5, 0.15


def up_doubts(recording: Recording, frames: Iterator[Frame], rng: np.random.Generator) -> tuple[Finding, ...]:
    """Return a finding where the up direction of a recording is not that of what it shows, or nothing.

    A camera that is mounted on its side shows walls where floors are expected; then the walk decides: nobody walks
    up and down as far as along.

    Args:
        recording: whose up direction was given.
        frames: some of its frames.
        rng: draws the normals.
    """
    given = recording.up_in_world
    if given is None:
        return ()
    try:
        found = find_up(frames, rng)
    except RecordingError:  # too little smooth surface
        return ()
    held = -recording.world_from_camera[:, :3, 1].mean(axis=0)
    apart = _angle_deg(given, found.direction)
    if apart < _APART_DEG or found.support < _LEAST_SUPPORT or _angle_deg(held, found.direction) > _HELD_DEG:
        return ()
    places = recording.world_from_camera[:, :3, 3]
    along_given_m, along_found_m = (float(np.std(places @ up)) for up in (given, found.direction))
    if max(along_given_m, along_found_m) > _STILL_M and along_found_m > _FLATTER * along_given_m:
        return ()
    said, is_so = (_words(up) for up in (given, found.direction))
    sentence = (
        f"Up is given as {said}, but {found.support:.0%} of the surface in view is level along {is_so}, {apart:.0f} "
        "degrees away, and so was the camera held."
    )
    return (Finding(Reason.UP, Grade.SUSPICIOUS, sentence, f"Give {option('up', is_so)}, or fix the poses."),)


def some_frames(recording: Recording) -> Iterator[Frame]:
    """Read a few frames, evenly spread; those that cannot be read are left out."""
    for index in np.unique(np.linspace(0, len(recording) - 1, _FRAMES).round().astype(int)).tolist():
        try:
            yield recording.frame(index)
        except RecordingError:
            continue


def _words(up: Float[np.ndarray, "3"]) -> str:
    return ",".join(f"{value + 0.0:.2f}" for value in np.round(up, 2).tolist())  # + 0.0 turns -0.0 into 0.0


def _angle_deg(a: Float[np.ndarray, "3"], b: Float[np.ndarray, "3"]) -> float:
    length = float(np.linalg.norm(a) * np.linalg.norm(b))
    return float(np.degrees(np.arccos(np.clip(a @ b / max(length, 1e-12), -1.0, 1.0))))
