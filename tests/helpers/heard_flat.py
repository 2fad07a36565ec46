"""A recording of the flat with an array of microphones and its map, which several files of tests need."""

from pathlib import Path

import pytest

from avlmaps.maps.build import build_map
from avlmaps.maps.settings import BuildSettings, FrameSettings
from avlmaps.recordings.open import open_recording
from avlmaps_sim.recorder import RecordSettings, record_scene
from helpers.hearing_scenes import flat
from helpers.made_once import made_once


def heard_flat(factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Return a recording of the flat with an array of four microphones, and its map with submaps; the caller's own."""
    folder = made_once(factory, "heard-flat", _map_flat)
    return folder / "rec", folder / "flat.avlmap"


def _map_flat(folder: Path) -> None:
    settings = RecordSettings(
        size=(160, 120), fps=4.0, hearing="acoustic", microphones="square4", snr_db=20.0, rt60_s=0.3,
        rate_hz=16_000, sources=2, workers=1, max_frames=80,
    )  # fmt: skip
    record_scene(flat(), folder / "rec", settings, seed=1)
    built = BuildSettings(frames=FrameSettings(per_submap=32))
    build_map(open_recording(folder / "rec"), folder / "flat.avlmap", "synthetic", built, progress=False)
