"""Peak memory of building a map, which follows its voxels and not its frames.

    python benchmarks/fusion_memory.py [--voxels 1000000] [--dim 512] [--rounds 1] [--file FILE.npy] [--json]

A camera is carried along a line over rough ground until the map has this many voxels; `--rounds 3` walks the line three
times. Then the map is finished: means of unit length in float16, in memory or written to a file.
"""

import sys
from pathlib import Path

from timing import parser, peak_bytes, seconds, show, use_one_thread

use_one_thread()

import numpy as np  # noqa: E402

from avlmaps.core.camera import Pinhole, Rig  # noqa: E402
from avlmaps.maps.fusion.accumulator import VoxelAccumulator  # noqa: E402
from avlmaps.maps.grid import GridSpec  # noqa: E402
from avlmaps.recordings.types import Frame  # noqa: E402

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


def build(voxels: int, dim: int, rounds: int) -> tuple[VoxelAccumulator, int]:
    total, steps, frames = VoxelAccumulator(GridSpec(0.05), dim), 0, 0
    features = np.random.default_rng(0).standard_normal((30, 40, dim), np.float32)
    while len(total) < voxels:
        total.add(frame_at(steps), features)
        steps += 1
    frames = steps
    for _ in range(rounds - 1):
        for step in range(steps):
            total.add(frame_at(step), features)
        frames += steps
    return total, frames


def main() -> int:
    arguments = parser((__doc__ or "").splitlines()[0])
    arguments.add_argument("--voxels", type=int, default=1_000_000)
    arguments.add_argument("--dim", type=int, default=512)
    arguments.add_argument("--rounds", type=int, default=1)
    arguments.add_argument("--file", type=Path, default=None, help="write the features to this .npy file")
    chosen = arguments.parse_args()
    build(1, chosen.dim, 1)[0].voxels()  # compiles
    before = peak_bytes()
    build_s, (total, frames) = seconds(build, chosen.voxels, chosen.dim, chosen.rounds)
    after_build = peak_bytes()
    out = None
    if chosen.file is not None:
        out = np.lib.format.open_memmap(chosen.file, "w+", np.float16, (len(total), chosen.dim))
    finish_s, _ = seconds(total.voxels, out)
    row: dict[str, object] = {
        "voxels": len(total),
        "frames": frames,
        "before_mb": before / 1e6,
        "sums_mb": len(total) * 4 * chosen.dim / 1e6,
        "peak_built_mb": after_build / 1e6,
        "peak_finished_mb": peak_bytes() / 1e6,
        "build_s": build_s,
        "finish_s": finish_s,
    }
    show(f"Peak memory of a map of {chosen.dim}-d features", [row], {}, chosen.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
