"""A day that was recorded in a world of its own: the simulator's frame, turned and shifted, as another robot's is."""

import hashlib
from dataclasses import fields, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from avlmaps.core.poses import apply, inverse
from avlmaps.recordings.types import Frame, Recording, Subset
from avlmaps_sim.bench.harness.workplace import SceneJob, Workplace

_FARTHEST_M = 20.0


class TurnedRecording(Subset):
    """All frames of a recording, in another world."""

    def __init__(self, whole: Recording, turned_from_scene: Float[np.ndarray, "4 4"]) -> None:
        super().__init__(whole, range(len(whole)))
        self._turn = turned_from_scene
        self.world_from_camera = turned_from_scene @ whole.world_from_camera
        self.trajectory = None
        up = whole.up_in_world
        self.up_in_world = None if up is None else turned_from_scene[:3, :3] @ up

    def frame(self, index: int) -> Frame:
        """Read one frame."""
        return replace(super().frame(index), world_from_camera=self.world_from_camera[index])

    @cached_property
    def fingerprint(self) -> str:
        """Of the recording, and of its world."""
        return hashlib.sha256(self.whole.fingerprint.encode() + self._turn.tobytes()).hexdigest()


class TurnedJob(SceneJob):
    """A scene that is mapped in another world than the simulator's; its recording is the same."""

    @classmethod
    def of(cls, job: SceneJob) -> "TurnedJob":
        """Return the job in another world."""
        return cls(**{each.name: getattr(job, each.name) for each in fields(job)})

    @property
    def map_name(self) -> str:
        """Name of the map's folder."""
        return f"turned-{super().map_name}"


def turned_from_scene(job: SceneJob) -> Float[np.ndarray, "4 4"]:
    """Return the world of a day's recording, from the simulator's: turned about the vertical, and shifted."""
    rng = job.rng(11)
    yaw = rng.uniform(-np.pi, np.pi)
    out = np.eye(4)
    out[:2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
    out[:3, 3] = rng.uniform(-_FARTHEST_M, _FARTHEST_M, 3) * (1.0, 1.0, 0.1)
    return out


class TurnedPlace(Workplace):
    """The folder of work of such a job."""

    @property
    def turn(self) -> Float[np.ndarray, "4 4"]:
        """Its world, from the simulator's."""
        return turned_from_scene(self.job)

    @cached_property
    def recording(self) -> Recording:
        """The recording in its own world."""
        return TurnedRecording(Workplace(self.job, self.open_spec).recording, self.turn)

    @cached_property
    def label(self) -> Int[np.ndarray, " n"]:
        """The true thing of each voxel of the map, -1 for none."""
        points = apply(inverse(self.turn), self.avlmap.space.centres)
        return self._true_voxels.label(self.avlmap.data.grid.index_of(points))
