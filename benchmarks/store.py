"""Writing and opening a map of a million voxels with 512-d features: seconds, and memory in use.

    python benchmarks/store.py [--voxels 1000000] [--dim 512] [--folder /tmp]

Opening is measured in processes of their own, with the files in the system's cache and (where the system allows it)
without.
"""

import json
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import fields
from pathlib import Path

import numpy as np

import timing
from avlmaps.core.camera import Pinhole
from avlmaps.core.camera import Rig as CameraRig
from avlmaps.maps.fusion.voxel_sums import VoxelSums
from avlmaps.maps.pipeline.parts import PartInfo
from avlmaps.maps.settings import BuildSettings
from avlmaps.maps.store.checkpoints import save_checkpoint
from avlmaps.maps.store.manifest import Counts, MapBounds, MapInfo, RecordingInfo, RigInfo, Timings, UpInfo
from avlmaps.maps.store.writer import MapContent, write_map
from avlmaps.maps.types import HeardSounds, Keyframes, Voxels

PEAK = """
import json, pathlib, resource, sys, time
def peak_mb():
    status = pathlib.Path("/proc/self/status")  # ru_maxrss begins with the parent's
    if status.exists():
        return int(status.read_text().partition("VmHWM:")[2].split()[0]) / 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
"""
OPEN = """
from avlmaps.maps.store.reader import open_stored
before = time.perf_counter()
stored = open_stored(sys.argv[1], verify=sys.argv[2] == "verify")
opened = time.perf_counter()
mapped = type(stored.voxels.feature).__name__
rows = stored.voxels.feature[:: max(1, len(stored.voxels) // 5000)].astype("f4").sum()
print(json.dumps({"open_s": opened - before, "features": mapped, "then_5000_rows_s": time.perf_counter() - opened,
                  "peak_mb": peak_mb()}))
"""
MERGE = """
from pathlib import Path
from avlmaps.maps.grid import GridSpec
from avlmaps.maps.pipeline.parts import sum_parts, load_part
from avlmaps.maps.store.array_files import write_array
before = time.perf_counter()
folders = sorted(Path(sys.argv[1]).glob("part*"))
voxels = sum_parts([load_part(folder, verify=False) for folder in folders], GridSpec()).voxels()
merged = time.perf_counter()
write_array(Path(sys.argv[1]), "feature", voxels.feature)
print(json.dumps({"parts": len(folders), "voxels": len(voxels), "merge_s": merged - before,
                  "write_s": time.perf_counter() - merged, "peak_mb": peak_mb()}))
"""


def content(voxels: int, dim: int, clips: Path) -> MapContent:
    """Make up a map; features are drawn once and repeated, which no step of the store can detect."""
    rng = np.random.default_rng(0)
    side = int(np.ceil(voxels ** (1 / 3)))
    index = np.stack(np.unravel_index(np.arange(voxels), (side, side, side)), axis=1).astype(np.int32)
    block = rng.normal(size=(1000, dim)).astype(np.float16)
    feature = np.resize(block, (voxels, dim))
    frames, points = 500, 800
    return MapContent(
        Voxels(
            index,
            feature,
            rng.uniform(size=voxels).astype(np.float32),
            rng.integers(0, 256, (voxels, 3)).astype(np.uint8),
            rng.uniform(size=voxels),
            rng.integers(1, 99, voxels),
        ),
        Keyframes(
            np.arange(frames, dtype=float),
            np.tile(np.eye(4), (frames, 1, 1)),
            np.zeros((frames, 3), np.float32),
            np.zeros((frames, 128), np.float32),
            np.zeros((frames, 64 * 128), np.float32),
            np.arange(frames + 1) * points,
            np.zeros((frames * points, 2), np.float32),
            np.zeros((frames * points, 128), np.float16),
            np.zeros((frames * points, 3), np.float32),
            np.arange(frames + 1) * 10_000,
            np.zeros(frames * 10_000, np.uint8),
        ),
        {"centres": np.zeros((64, 128), np.float32)},
        HeardSounds(
            np.zeros(0),
            np.zeros(0),
            np.zeros(1, np.int64),
            np.zeros((0, 3), np.float32),
            np.zeros(1, np.int64),
            np.zeros((0, 128), np.float32),
            (),
        ),
        clips,
    )


def manifest(made_up: MapContent) -> MapInfo:
    """Make up what map.json says."""
    camera = Pinhole(525.0, 525.0, 320.0, 240.0, 640, 480)
    return MapInfo(
        avlmaps_version="benchmark",
        build_key="",
        voxel_size_m=0.05,
        up=UpInfo.of(np.array([0.0, 0.0, 1.0]), "recording", 1.0),
        rig=RigInfo.of(CameraRig(camera, camera)),
        profile="embedded",
        models={},
        settings=BuildSettings(),
        seed=0,
        recording=RecordingInfo(
            name="made up",
            format="none",
            fingerprint="",
            frames=0,
            duration_s=float(np.ptp(made_up.voxels.last_seen_s)),
        ),
        counts=Counts(frames=0, keyframes=len(made_up.keyframes), voxels=len(made_up.voxels), sounds=0),
        bounding_box_m=MapBounds.of(made_up.voxels.index, 0.05),
        timings=Timings(finished="", elapsed_s=0.0, stages_s={}),
    )


def forget_cache(path: Path) -> bool:
    """Ask the system to drop the files from its cache."""
    if not hasattr(os, "posix_fadvise"):
        return False
    for file in path.rglob("*.npy"):
        descriptor = os.open(file, os.O_RDONLY)
        os.posix_fadvise(descriptor, 0, 0, os.POSIX_FADV_DONTNEED)
        os.close(descriptor)
    return True


def in_a_process(script: str, path: Path, mode: str = "") -> dict:
    """Run a script with the path and the mode as its arguments; return what it prints."""
    command = [sys.executable, "-c", PEAK + script, str(path), mode]
    return json.loads(subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True).stdout)


def write_parts(folder: Path, voxels: int, dim: int, parts: int = 4) -> None:
    """Make up parts that overlap by half and cover this many voxels in all."""
    size = 2 * voxels // (parts + 1)
    for number in range(parts):
        rows = np.arange(number * size // 2, number * size // 2 + size)
        ones = np.ones(len(rows))
        sums = VoxelSums(
            np.stack([rows // 1000, rows % 1000, rows % 7], axis=1).astype(np.int32),
            np.ones((len(rows), dim), np.float32),
            ones,
            np.ones((len(rows), 3)),
            ones,
            ones.astype(np.int64),
            ones.astype(np.int32),
            ones.astype(np.int64),
            ones,
        )
        info = PartInfo(recording="", spans=((number, number + 1, 1),), fused=1, bad_frames=(), elapsed_s=0.0)
        save_checkpoint(folder / f"part{number}", "key", info, {f.name: getattr(sums, f.name) for f in fields(sums)})


def main() -> None:
    """Measure and print a table, or one JSON object."""
    parser = timing.parser((__doc__ or "").splitlines()[0])
    parser.add_argument("--voxels", type=int, default=1_000_000)
    parser.add_argument("--dim", type=int, default=512)
    parser.add_argument("--folder", type=Path, default=None)
    options = parser.parse_args()
    folder = Path(tempfile.mkdtemp(dir=options.folder))
    try:
        made_up = content(options.voxels, options.dim, folder)
        before_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        begin = time.perf_counter()
        info = write_map(folder / "m.avlmap", made_up, manifest(made_up))
        result = {
            "voxels": options.voxels,
            "dim": options.dim,
            "bytes": info.bytes,
            "write_s": time.perf_counter() - begin,
            "write_extra_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024 - before_mb,
            "open_warm": in_a_process(OPEN, folder / "m.avlmap"),
            "open_cold": in_a_process(OPEN, folder / "m.avlmap") if forget_cache(folder / "m.avlmap") else None,
            "open_and_verify": in_a_process(OPEN, folder / "m.avlmap", "verify"),
        }
        del made_up
        shutil.rmtree(folder / "m.avlmap")
        write_parts(folder, options.voxels, options.dim)
        result["merge_parts"] = in_a_process(MERGE, folder)
    finally:
        shutil.rmtree(folder)
    if options.json:
        print(json.dumps(result, indent=2))
        return
    cold, warm, checked, merged = (
        result[k] or {} for k in ("open_cold", "open_warm", "open_and_verify", "merge_parts")
    )
    rows = [
        {
            "what": "write, with fsync and sha256",
            "seconds": result["write_s"],
            "peak_mb": "+" + _mb(result["write_extra_mb"]),
        },
        {"what": "open, not in the file cache", "seconds": cold.get("open_s", "-"), "peak_mb": ""},
        {
            "what": "then read 5,000 features at random",
            "seconds": cold.get("then_5000_rows_s", "-"),
            "peak_mb": _mb(cold.get("peak_mb")),
        },
        {"what": "open, in the file cache", "seconds": warm["open_s"], "peak_mb": ""},
        {"what": "open and check every file", "seconds": checked["open_s"], "peak_mb": _mb(checked["peak_mb"])},
        {"what": f"merge {merged['parts']} parts", "seconds": merged["merge_s"], "peak_mb": _mb(merged["peak_mb"])},
    ]
    title = f"A map of {options.voxels:,} voxels by {options.dim}, {result['bytes'] / 1e9:.2f} GB"
    timing.show(title, rows, {}, as_json=False)


def _mb(value: float | None) -> str:
    return "-" if value is None else f"{value:,.0f}"


if __name__ == "__main__":
    main()
