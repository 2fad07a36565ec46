"""What the jobs of a cluster cost, and by that a plan for 1,000 robots that drive 8 h a day.

    python benchmarks/cluster.py --recording RECORDING

15, 30 and 60 frames of a recording, every eighth, become maps by the jobs that a cluster is given, one after the other
in this process; seconds are of one processor. "head" is what stays on the machine where one types. Where Ray is
installed, the longest is built once more by two of its workers, and its files are compared with those of one process.
"""

import argparse
import tempfile
from collections.abc import Callable, Generator, Sequence
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

from avlmaps.core.progress import silence
from avlmaps.days.merge import merge_maps
from avlmaps.maps.build import build_map
from avlmaps.maps.grid import GridSpec
from avlmaps.maps.pipeline.cluster import ClusterWorkers
from avlmaps.maps.pipeline.parts import MapPart, sum_parts
from avlmaps.maps.pipeline.plan import BuildPlan
from avlmaps.maps.pipeline.ray_pool import RayPool
from avlmaps.maps.settings import BuildSettings, FrameSettings
from avlmaps.maps.store.reader import StoredMap
from avlmaps.recordings.open import open_recording
from avlmaps.recordings.subset import Subset
from avlmaps.recordings.types import Recording

PART, STEP = 25, 8  # 13 s of this recording, as a part's 200 frames are at 15 a second
LENGTHS = (15, 30, 60)
SETTINGS = BuildSettings(frames=FrameSettings(per_part=PART))
ROBOTS, HOURS, RATE_HZ = 1000, 8, 15
CORES, MEMORY_GB, LINE_GB_S, DAY_S = 32, 128, 1.25, 86_400
FRAMES = HOURS * 3600 * RATE_HZ


class OneByOne:
    """A pool that does jobs here, and notes the processor time of each kind."""

    cores = 1

    def __init__(self) -> None:
        self.cpu_s: dict[str, float] = {}

    def run(self, function: Callable[[Any], Any], jobs: Sequence[Any]) -> Generator[tuple[int, Any]]:
        for number, job in enumerate(jobs):
            done = function(job)
            self.cpu_s[function.__name__] = self.cpu_s.get(function.__name__, 0.0) + done.cpu_s
            yield number, done


class Weighed(ClusterWorkers):
    """Notes what adding the parts up costs."""

    bytes, add_s, part_mb, part_s = 0, 0.0, 0.0, 0.0

    def add_up(self, plan: BuildPlan, parts: Sequence[MapPart]) -> Any:
        self.bytes = sum(size(part.folder) for part in parts)
        self.part_mb = size(parts[0].folder) / 1e6
        self.part_s = float(np.ptp(plan.recording.stamps_s[:PART]))
        begin = process_time()
        sum_parts(parts, GridSpec(plan.settings.voxel_size_m))
        self.add_s = process_time() - begin
        return super().add_up(plan, parts)


def first(path: Path, frames: int, begin: int = 0) -> Recording:
    """Open every eighth of the first frames of a recording, so that the camera has gone through the room."""
    return Subset(open_recording(path), range(begin, STEP * frames, STEP))


def size(folder: Path) -> int:
    """Return the bytes of all files in a folder."""
    return sum(file.stat().st_size for file in folder.rglob("*") if file.is_file())


def arrays(stored: StoredMap) -> dict[str, bytes]:
    """Return the files of a map's arrays."""
    return {file.name: file.read_bytes() for file in sorted(stored.path.rglob("*.npy"))}


def main() -> None:
    """Measure, print the rates, and plan."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--recording", type=Path, required=True)
    path = parser.parse_args().recording.absolute()
    silence()
    with tempfile.TemporaryDirectory() as folder:
        build_map(first(path, 4), Path(folder) / "warm", settings=SETTINGS)
        print("frames  keyframes  fuse s  describe s  head s  s a frame  parts MB  map MB")
        rows: list[dict[str, float]] = []
        stored = None
        for frames in LENGTHS:
            pool = OneByOne()
            spread, begin = Weighed(pool, partial(first, path, frames)), process_time()
            stored = build_map(first(path, frames), Path(folder) / f"{frames}", settings=SETTINGS, workers=spread)
            total_s = process_time() - begin - spread.add_s
            fuse_s, describe_s = (pool.cpu_s[f"{kind}_job"] for kind in ("fuse", "describe"))
            keyframes, voxels = stored.info.counts.keyframes, size(stored.path / "voxels")
            row = {
                "fuse": fuse_s, "describe": describe_s, "head": total_s - fuse_s - describe_s, "keyframes": keyframes,
                "parts": spread.bytes / 1e6, "map": size(stored.path) / 1e6, "add": spread.add_s,
                "voxels": voxels / 1e6, "seconds": stored.info.recording.duration_s,
                "part": spread.part_mb / (spread.part_s * RATE_HZ),
            }  # fmt: skip
            rows.append(row)
            print(
                f"{frames:6} {keyframes:10} {fuse_s:7.1f} {describe_s:11.1f} {row['head']:7.1f} "
                f"{total_s / frames:10.3f} {row['parts']:9.1f} {row['map']:7.1f}",
                flush=True,
            )
        assert stored is not None
        begin = process_time()
        other = first(path, LENGTHS[1], STEP // 2)
        merge_maps(stored, build_map(other, Path(folder) / "other", settings=SETTINGS), Path(folder) / "merged")
        merge_s = process_time() - begin
        plan(rows, merge_s, size_of_frames(path))
        if find_spec("ray") is not None:
            with RayPool(cores=2) as cluster:
                shared = build_map(first(path, LENGTHS[-1]), Path(folder) / "ray", settings=SETTINGS,
                                   workers=ClusterWorkers(cluster, partial(first, path, LENGTHS[-1])))  # fmt: skip
            same = "the same bits" if arrays(shared) == arrays(stored) else "OTHER BITS"
            print(f"\ntwo workers of Ray, {LENGTHS[-1]} frames: {same}")


def size_of_frames(path: Path) -> float:
    """Return megabytes of a frame as it is stored."""
    recording, some = open_recording(path), range(20)
    files = [file for at in some for file in (recording.colour_file(at), recording.depth_file(at)) if file]
    return sum(file.stat().st_size for file in files) / len(some) / 1e6


def plan(rows: list[dict[str, float]], merge_s: float, frame_mb: float) -> None:
    """Print the plan that follows from the rates."""
    last, before, frames = rows[-1], rows[-2], LENGTHS[-1]
    keyframes = HOURS * 3600 * last["keyframes"] / last["seconds"]
    fuse_s, describe_s = last["fuse"] / frames, last["describe"] / last["keyframes"]
    job_s = fuse_s + describe_s * keyframes / FRAMES
    head_s = max(0.0, (last["head"] - before["head"]) / (frames - LENGTHS[-2]))
    keyframe_mb = (last["map"] - last["voxels"]) / last["keyframes"]
    parts_mb, add_s = last["part"], last["add"] / last["parts"]
    cores = ROBOTS * FRAMES * job_s / DAY_S
    recorded, summed = ROBOTS * FRAMES * frame_mb / 1e6, ROBOTS * FRAMES * parts_mb / 1e6
    kept = ROBOTS * keyframes * keyframe_mb / 1e6
    print(
        f"\na frame: {fuse_s:.3f} s of jobs, at most {head_s:.3f} s of the head, {frame_mb:.2f} MB recorded, "
        f"{parts_mb:.3f} MB of parts\na keyframe, {last['keyframes'] / last['seconds']:.1f} a second: "
        f"{describe_s:.3f} s, {keyframe_mb:.3f} MB\nadding up: {add_s * 1000:.2f} s a GB; merging these two small "
        f"maps: {merge_s:.1f} s"
    )
    print(
        f"\n{ROBOTS:,} robots, {HOURS} h a day at {RATE_HZ} frames/s: {ROBOTS * FRAMES / 1e6:,.0f} million frames a day"
        f"\n  machines          {cores / CORES:8,.0f}  of {CORES} cores, to do a day's frames in a day"
        f"\n  recordings        {recorded:8,.0f}  TB a day, until they are mapped"
        f"\n  parts             {summed:8,.0f}  TB a day, written once and read once"
        f"\n  keyframes         {kept:8,.1f}  TB a day, stored with the maps"
        f"\n  storage traffic   {(recorded + 2 * summed + 2 * kept) * 1e3 / DAY_S:8,.1f}  GB/s"
    )
    each_gb = keyframes * keyframe_mb / 1e3
    line = (recorded + 2 * summed + 2 * kept) * 1e3 / DAY_S / LINE_GB_S
    head = FRAMES * (head_s + parts_mb * add_s) / DAY_S
    strain = {
        f"the line of one store of {LINE_GB_S} GB/s": line,
        "one machine, the head of one robot's day, in a day (at most: some of it is bounded)": head,
        f"{MEMORY_GB} GB of memory, the keyframes of one robot's day": each_gb / MEMORY_GB,
        "merging a day's maps, one after the other, in a day (at least: these are small)": ROBOTS * merge_s / DAY_S,
    }
    print("\nwhere it breaks first (1: just enough)")
    for name, times in sorted(strain.items(), key=lambda one: -one[1]):
        print(f"  {times:8.2f}  {name}")


if __name__ == "__main__":
    main()
