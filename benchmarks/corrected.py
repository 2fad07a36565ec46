"""What following corrected poses costs, and how near the map comes to one that is built again from them.

    python benchmarks/corrected.py --scenes house:7 house:12

Each home is driven there and back in the simulator, and odometry strays until it is off by a metre at the end. The map
of the strayed poses then follows (a) corrections as a pose graph gives them, smooth between closures every 3 s, and
(b) the true poses of every frame. Geometry alone, with random features of 128 numbers; seconds are of one processor:
of these, "merge" moves and adds up the rows of submaps, "clean" finds what is no surface, "features" are summed.
"share": of the voxels of a full rebuild that are there; "double": of the map's voxels, farther than two from those.
"""

import argparse
import tempfile
from dataclasses import fields, replace
from pathlib import Path
from time import process_time

import numpy as np
from scipy.spatial import KDTree

from avlmaps.core.camera import Rig
from avlmaps.core.columns import concat
from avlmaps.core.poses import inverse
from avlmaps.core.timeline import Trajectory
from avlmaps.maps.fusion.accumulator import VoxelAccumulator
from avlmaps.maps.fusion.free_space import FreeViews, clean, count_through, count_where_it_matters, free_views
from avlmaps.maps.fusion.sensor import PERFECT
from avlmaps.maps.fusion.submaps import MovedSubmaps, submap_of
from avlmaps.maps.grid import GridSpec
from avlmaps.maps.types import Submaps
from avlmaps.recordings.open import open_recording
from avlmaps.recordings.types import Frame
from avlmaps_sim.recorder import RecordSettings, record_scene
from avlmaps_sim.scenes import open_scene
from avlmaps_sim.sensor import drifted

GRID, DIM, CLOSURES = GridSpec(0.05), 128, 30


def drive(scene: str, size: tuple[int, int], most: int | None) -> tuple[list[Frame], np.ndarray, np.ndarray]:
    """Return frames of a drive there and back, their true poses, and poses that end a metre off."""
    with tempfile.TemporaryDirectory() as folder:
        settings = RecordSettings(size=size, hearing="none", max_frames=most, workers=1)
        record_scene(open_scene(scene), Path(folder) / "rec", settings, 0)
        recording = open_recording(Path(folder) / "rec")
        last = len(recording) - 1
        order = [*range(0, last + 1, 2), *range(last - 1 + last % 2, 0, -2)]
        frames = [replace(recording.frame(at), index=new, stamp_s=0.1 * new) for new, at in enumerate(order)]
    true = np.stack([frame.world_from_camera for frame in frames])
    for seed in range(1000):
        off = drifted(true, np.random.default_rng(seed))
        if 0.9 < np.linalg.norm(off[-1, :3, 3] - true[-1, :3, 3]) < 1.1:
            return frames, true, off
    raise SystemExit(f"no drift of {scene} ends a metre off")


def fused(frames: list[Frame], poses: np.ndarray, features: np.ndarray, step: int) -> Submaps:
    """Return the submaps of frames at some poses."""
    parts: list[Submaps] = []
    for first in range(0, len(frames), step):
        some, at = frames[first : first + step], poses[first : first + step]
        total = VoxelAccumulator(GRID, DIM, None, PERFECT, with_spread=True)
        free = []
        for frame, pose in zip(some, at, strict=True):
            placed = replace(frame, world_from_camera=pose)
            total.add(placed, features)
            free.append(placed)
        stamps = np.array([frame.stamp_s for frame in some])
        parts.append(submap_of(total.sums(), stamps, at, free_views(free, PERFECT).clear_mm))
    return concat(parts)


def surface(total: MovedSubmaps, clear_mm: np.ndarray, poses: np.ndarray, rig: Rig) -> np.ndarray:
    """Return the voxels that are a surface."""
    evidence = total.evidence()
    views = FreeViews(clear_mm, poses)
    kept, _ = clean(evidence, PERFECT, lambda index: count_through(index, GRID, rig.depth, [views]))
    total.voxels(kept=kept)
    return evidence.index[kept]


def followed(submaps: Submaps, poses: np.ndarray, rig: Rig) -> tuple[np.ndarray, np.ndarray]:
    """Return the same of submaps, as a finished map that follows does it, and what each stage took."""
    at_s = [process_time()]
    total, views = MovedSubmaps(submaps, poses, GRID), FreeViews(submaps.clear_mm, poses)
    at_s.append(process_time())
    evidence, camera = total.evidence(), rig.depth
    kept, _ = clean(evidence, PERFECT, lambda _: count_where_it_matters(evidence, GRID, camera, views))
    at_s.append(process_time())
    index = total.voxels(kept=kept).index
    return index, np.diff([*at_s, process_time()])


def compared(found: np.ndarray, wanted: np.ndarray) -> tuple[float, float, float]:
    """Return the share of wanted voxels that are there, that are within a voxel, and of those found that are double."""
    there = {tuple(one) for one in found.tolist()}
    share = float(np.mean([tuple(one) in there for one in wanted.tolist()]))
    near = float(np.mean(KDTree(found).query(wanted)[0] < 1.8))
    return share, near, float(np.mean(KDTree(wanted).query(found)[0] > 2.0))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--scenes", nargs="+", default=["house:7"])
    parser.add_argument("--frames", nargs="+", type=int, default=[16, 32, 64, 128])
    parser.add_argument("--size", nargs=2, type=int, default=[320, 240])
    parser.add_argument("--most", type=int, help="frames of the drive")
    asked = parser.parse_args()
    features = np.random.default_rng(0).normal(size=(30, 40, DIM)).astype(np.float32)
    features /= np.linalg.norm(features, axis=2, keepdims=True)
    print(f"{'scene':<10}{'poses':<8}{'frames':>7}{'m²':>6}{'rows':>11}{'MB':>7}{'s':>7}{'s / 10,000 m²':>15}"
          f"{'merge':>7}{'clean':>7}{'features':>10}{'share':>8}{'within 1':>10}{'double before':>15}{'after':>8}"
          )  # fmt: skip
    for scene in asked.scenes:
        frames, true, off = drive(scene, (asked.size[0], asked.size[1]), asked.most)
        stamps = np.array([frame.stamp_s for frame in frames])
        nodes = np.unique([*range(0, len(frames), CLOSURES), len(frames) - 1])
        smooth = Trajectory(stamps[nodes], (true @ inverse(off))[nodes]).at(stamps) @ off
        for name, corrected in (("graph", smooth), ("true", true)):
            again = fused(frames, corrected, features, len(frames))
            whole = MovedSubmaps(again, corrected, GRID)
            wanted = surface(whole, again.clear_mm, corrected, frames[0].rig)
            for step in asked.frames:
                submaps = fused(frames, off, features, step)
                before = surface(MovedSubmaps(submaps, off, GRID), submaps.clear_mm, off, frames[0].rig)
                found, stages_s = followed(submaps, corrected, frames[0].rig)
                took_s, area = stages_s.sum(), len(wanted) * GRID.voxel_size_m**2
                merge, cleaned, featured = 1e4 * stages_s / area
                share, near, after = compared(found, wanted)
                size = sum(np.asarray(getattr(submaps, one.name)).nbytes for one in fields(Submaps))
                print(f"{scene:<10}{name:<8}{step:>7}{area:>6.0f}{len(submaps.index):>11,}{size / 1e6:>7.0f}"
                      f"{took_s:>7.2f}{1e4 * took_s / area:>15.1f}{merge:>7.1f}{cleaned:>7.1f}{featured:>10.1f}"
                      f"{share:>8.1%}{near:>10.2%}{compared(before, wanted)[2]:>15.1%}{after:>8.2%}",
                      flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
