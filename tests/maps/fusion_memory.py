"""Builds a map in a process of its own, for the test of what that takes of memory: VOXELS ROUNDS.

A camera is carried along a line over rough ground until the map has this many voxels; three rounds walk the line three
times. Then the map is finished: means of unit length in float16, in memory.
"""

import os
import sys

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ[variable] = "1"

import json  # noqa: E402
import resource  # noqa: E402

import numpy as np  # noqa: E402

from avlmaps.core.camera import Pinhole, Rig  # noqa: E402
from avlmaps.maps.fusion.accumulator import VoxelAccumulator  # noqa: E402
from avlmaps.maps.grid import GridSpec  # noqa: E402
from avlmaps.recordings.types import Frame  # noqa: E402

DIM = 512
CAMERA = Pinhole(140.0, 140.0, 80.0, 60.0, 160, 120)
RIG = Rig(CAMERA, CAMERA)
RGB = np.zeros((120, 160, 3), np.uint8)


def frame_at(step: int) -> Frame:
    """Return the frame of a place along the line; each sees some ten thousand voxels, most of them new."""
    rng = np.random.default_rng(step)
    pose = np.eye(4)
    pose[:3, 3] = 4.0 * (step % 50), 4.0 * (step // 50), 0.0
    depth = rng.uniform(2.0, 6.0, (120, 160)).astype(np.float32)
    return Frame(step, f"{step:06d}", step / 30, RGB, depth, pose, RIG)


def build(voxels: int, rounds: int) -> tuple[VoxelAccumulator, int]:
    total, steps = VoxelAccumulator(GridSpec(0.05), DIM), 0
    features = np.random.default_rng(0).standard_normal((30, 40, DIM), np.float32)
    while len(total) < voxels:
        total.add(frame_at(steps), features)
        steps += 1
    for _ in range(rounds - 1):
        for step in range(steps):
            total.add(frame_at(step), features)
    return total, rounds * steps


def peak_mb() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e6


def main() -> None:
    voxels, rounds = map(int, sys.argv[1:])
    build(1, 1)[0].voxels()  # compiles
    before_mb = peak_mb()
    total, frames = build(voxels, rounds)
    total.voxels()
    sums_mb = len(total) * 4 * DIM / 1e6
    row = {"voxels": len(total), "frames": frames, "before_mb": before_mb, "sums_mb": sums_mb}
    sys.stdout.write(json.dumps({**row, "peak_finished_mb": peak_mb()}))


if __name__ == "__main__":
    main()
