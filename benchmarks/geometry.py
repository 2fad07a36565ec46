"""Geometry of a map beside the true surface: accuracy and completeness, with and without the sensor model.

    python benchmarks/geometry.py [--scenes house:4 house:5] [--sensors kinect realsense clean] [--frames 250] [--json]

A scene is recorded with the faults of each sensor and fused twice in the same run: every depth as it is (before) and
with the sensor model that the build chooses by itself (after). Accuracy is the share of voxels whose middle lies within
5 cm of the scene's triangles. Completeness is the share of the true surface seen within 4 m of a camera (places on a
grid of 2.5 cm) that has a voxel's middle within 5 cm.
"""

import sys
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

from timing import parser, seconds, show, use_one_thread

use_one_thread()

import numpy as np  # noqa: E402
from scipy.spatial import KDTree  # noqa: E402

from avlmaps.core.columns import concat  # noqa: E402
from avlmaps.maps.estimate import estimate_sensor  # noqa: E402
from avlmaps.maps.fusion.accumulator import VoxelAccumulator  # noqa: E402
from avlmaps.maps.fusion.free_space import FreeViews, clean, count_through, free_views  # noqa: E402
from avlmaps.maps.fusion.sensor import NONE, SensorModel  # noqa: E402
from avlmaps.maps.grid import GridSpec  # noqa: E402
from avlmaps.maps.settings import BuildSettings  # noqa: E402
from avlmaps.recordings.open import open_recording  # noqa: E402
from avlmaps.recordings.types import Recording  # noqa: E402
from avlmaps_sim.recorder import RecordSettings, record_scene  # noqa: E402
from avlmaps_sim.render import Renderer  # noqa: E402
from avlmaps_sim.scene import Scene  # noqa: E402
from avlmaps_sim.scenes import open_scene  # noqa: E402
from avlmaps_sim.sensor_settings import SensorName  # noqa: E402

GRID = GridSpec(0.05)
WITHIN_M, SEEN_M, FAR_OFF_M = 0.05, 4.0, 0.2
_SURFACE_STEP_M = 0.025


def thinned(points: np.ndarray, cell_m: float) -> np.ndarray:
    """Return one point of each cell."""
    return points[np.unique(np.floor(points / cell_m).astype(np.int32), axis=0, return_index=True)[1]]


def surface_of(scene: Scene) -> np.ndarray:
    """Return points on all triangles, at most 2.5 cm apart."""
    corners = scene.mesh.corners().astype(np.float64)
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    parts = np.maximum(1, np.ceil(sides / _SURFACE_STEP_M)).astype(int)
    out = []
    for n in np.unique(parts):
        i, j = (grid.ravel() for grid in np.mgrid[:n, :n])
        a, b = (i[i + j < n] + 1 / 3) / n, (j[i + j < n] + 1 / 3) / n
        these = corners[parts == n]
        for block in np.array_split(these, -(-len(these) * len(a) // 2_000_000)):
            first, along, beside = block[:, None, 0], block[:, None, 1], block[:, None, 2]
            points = first + a[:, None] * (along - first) + b[:, None] * (beside - first)
            out.append(thinned(points.reshape(-1, 3), 0.02))
    return thinned(np.concatenate(out), 0.02)


def seen_of(scene: Scene, recording: Recording) -> np.ndarray:
    """Return the places of the true surface that lie within 4 m of a camera that sees them."""
    renderer, camera, out = Renderer(scene, lit=False), recording.rig.depth, []
    for pose in recording.world_from_camera:
        points = camera.backproject(renderer.render(camera, pose).depth_m.astype(np.float64))
        near = (points[..., 2] > 0) & (np.linalg.norm(points, axis=-1) <= SEEN_M)
        out.append(thinned(points[near] @ pose[:3, :3].T + pose[:3, 3], 0.025))
    return thinned(np.concatenate(out), 0.025)


@dataclass(frozen=True, slots=True)
class Made:
    """Voxels of a map, and the processor time that they took."""

    index: np.ndarray
    seconds: float


def made(recording: Recording, sensor: SensorModel) -> Made:
    """Fuse a recording without features."""
    total, free, spent = VoxelAccumulator(GRID, 0, sensor=sensor), list[FreeViews](), 0.0
    for frame in recording.frames():
        took, views = seconds(free_views, [frame], sensor)
        spent += seconds(total.add, frame)[0] + took
        free.append(views)
    evidence = total.evidence()
    count = partial(count_through, grid=GRID, camera=recording.rig.depth, parts=[concat(free)])
    took, (kept, _) = seconds(clean, evidence, sensor, count)
    return Made(evidence.index[kept], spent + took)


def row(name: str, found: Made, surface: KDTree, seen: np.ndarray, frames: int) -> dict[str, object]:
    middles = GRID.centre_of(found.index)
    off = surface.query(middles, distance_upper_bound=1.0)[0]
    near = np.isfinite(KDTree(middles).query(seen, distance_upper_bound=WITHIN_M)[0])
    return {
        "map": name,
        "voxels": len(off),
        "accuracy_percent": round(100 * float((off <= WITHIN_M).mean()), 2),
        "voxels_over_20_cm_off": int((off > FAR_OFF_M).sum()),
        "completeness_percent": round(100 * float(near.mean()), 2),
        "ms_a_frame": round(1e3 * found.seconds / frames, 2),
    }


def rows_of(spec: str, sensors: list[SensorName], frames: int) -> list[dict[str, object]]:
    scene, out = open_scene(spec), []
    surface, seen = KDTree(surface_of(scene)), None
    with TemporaryDirectory() as scratch:
        for sensor in sensors:
            path = Path(scratch) / sensor
            settings = RecordSettings(sensor=sensor, hearing="none", max_frames=frames, workers=1)
            record_scene(scene, path, settings)
            recording = open_recording(path)
            seen = seen_of(scene, recording) if seen is None else seen  # the walk is the same
            info = estimate_sensor(recording, BuildSettings())
            made(recording, info.model)  # compiles
            for name, model in (("before", NONE), (f"after ({info.name})", info.model)):
                out.append(
                    row(f"{Path(spec).name} {sensor} {name}", made(recording, model), surface, seen, len(recording))
                )
    return out


def main() -> int:
    arguments = parser((__doc__ or "").splitlines()[0])
    arguments.add_argument("--scenes", nargs="+", default=["house:4", "house:5"])
    arguments.add_argument("--sensors", nargs="+", default=["kinect", "realsense", "clean"])
    arguments.add_argument("--frames", type=int, default=250)
    chosen = arguments.parse_args()
    rows = [one for spec in chosen.scenes for one in rows_of(spec, chosen.sensors, chosen.frames)]
    facts: dict[str, object] = {
        "frames": f"{chosen.frames} of 320x240, evenly from a walk",
        "accuracy": "share of voxels within 5 cm of the true surface",
        "completeness": "share of the true surface seen within 4 m that has a voxel within 5 cm",
        "time": "processor time of one thread, fusion without features and cleaning",
    }
    show("Geometry, 5 cm voxels", rows, facts, chosen.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
