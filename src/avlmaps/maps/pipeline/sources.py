"""The stage of the sources: where each sound began, of a recording whose microphones are known."""

from time import perf_counter

import numpy as np

from avlmaps.core.timeline import Trajectory
from avlmaps.maps.grid import GridSpec
from avlmaps.maps.pipeline.plan import BuildPlan
from avlmaps.maps.types import HeardSounds, SourceEvidence, Voxels


def locate_sources(
    plan: BuildPlan, up_in_world: np.ndarray, heard: HeardSounds, voxels: Voxels
) -> tuple[SourceEvidence | None, float]:
    """Return the evidence of each sound over the surfaces of the map, and the seconds that took; None without any."""
    begin, recording = perf_counter(), plan.recording
    if recording.audio is None or recording.audio.microphones is None or not len(heard):
        return None, 0.0
    from avlmaps.maps.sources.find import find_sources

    walk = recording.trajectory or Trajectory(recording.stamps_s, recording.world_from_camera)
    spans_s = list(zip(heard.onset_s.tolist(), heard.offset_s.tolist(), strict=True))
    voxel_m = GridSpec(plan.settings.voxel_size_m).centre_of(np.asarray(voxels.index))
    found = find_sources(recording.audio, walk, spans_s, voxel_m, up_in_world)
    return found, perf_counter() - begin
