"""From the words of a command to calls of the library, and back to plain values."""

import sys
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np

from avlmaps.cli.output import UsageError
from avlmaps.core.camera import Pinhole
from avlmaps.core.errors import BackendError, QueryError
from avlmaps.core.progress import say
from avlmaps.core.registry import Kind, backends

if TYPE_CHECKING:
    from avlmaps.cli.verbs import Build, Query


def build(verb: "Build") -> dict[str, Any]:
    """Build a map and describe it."""
    from avlmaps.maps.build import build_map, describe
    from avlmaps.maps.settings import BuildSettings
    from avlmaps.recordings.open import open_recording

    begin = perf_counter()
    recording = open_recording(verb.recording, format=verb.format, audio=verb.audio)
    for notice in recording.notices:
        say(f"note: {notice}")
    stored = build_map(recording, verb.out, profile=verb.profile, settings=BuildSettings())
    return {**describe(stored), "elapsed_s": round(perf_counter() - begin, 3)}


def camera_of(intrinsics: str | None, rgb: np.ndarray) -> Pinhole | None:
    """Read ``fx,fy,cx,cy`` for a picture; None stays None."""
    if intrinsics is None:
        return None
    try:
        fx, fy, cx, cy = (float(word) for word in intrinsics.split(","))
        return Pinhole(fx, fy, cx, cy, width=rgb.shape[1], height=rgb.shape[0])
    except ValueError as error:
        raise UsageError(
            f"--intrinsics takes fx,fy,cx,cy in pixels, such as 525,525,320,240; not {intrinsics!r} ({error})."
        ) from None
