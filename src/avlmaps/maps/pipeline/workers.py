"""Who does what a build can cut into jobs: this process alone, or machines that see the same folders (``cluster``)."""

from collections.abc import Sequence
from pathlib import Path

from avlmaps.maps.fusion.accumulator import VoxelAccumulator
from avlmaps.maps.fusion.sensor import SensorModel
from avlmaps.maps.grid import GridSpec
from avlmaps.maps.pipeline.encode_fuse import fuse_spans
from avlmaps.maps.pipeline.keyframes import KeyframeLots, describe_lots
from avlmaps.maps.pipeline.parts import MapPart, sum_parts
from avlmaps.maps.pipeline.plan import BuildPlan, Span
from avlmaps.maps.store.manifest import BadFrame


class Workers:
    """Does the three kinds of jobs here, one after the other. Who does them elsewhere leaves files of the same bits."""

    def fuse(
        self,
        plan: BuildPlan,
        jobs: Sequence[tuple[Span, Path]],
        sensor: SensorModel,
        known_bad: Sequence[BadFrame],
        done: int,
    ) -> None:
        """Fuse stretches of frames, each into a part of its own; see ``fuse_spans``."""
        fuse_spans(plan.recording, jobs, plan.encoders, plan.settings, sensor, known_bad, done)

    def describe(self, plan: BuildPlan, work: KeyframeLots) -> None:
        """Describe lots of keyframes, each into a folder of its own."""
        describe_lots(plan, work)

    def add_up(self, plan: BuildPlan, parts: Sequence[MapPart]) -> VoxelAccumulator:
        """Add the parts up, in the order given; only the total is in memory."""
        return sum_parts(parts, GridSpec(plan.settings.voxel_size_m))


ALONE = Workers()
