"""Fusion on one core: frames and points a second, beside a per-point loop as the paper's published code does it.

    python benchmarks/fusion.py [--frames 40] [--repeats 7] [--json]

Frames are 640x480 with a 120x160x512 float32 feature map, voxels 5 cm. They are real ones of a kitchen where
`../shared` is present, and of a synthetic room elsewhere. Each frame is timed on its own, in every repeat, and its
least time counts, so that other work on the machine disturbs little. The feature maps rotate, so that none is still
in the cache from the frame before.
"""

import sys
from collections.abc import Sequence
from pathlib import Path

from timing import parser, seconds, show, use_one_thread

use_one_thread()

import cv2  # noqa: E402
import numpy as np  # noqa: E402

from avlmaps.core import poses  # noqa: E402
from avlmaps.core.camera import Pinhole, Rig  # noqa: E402
from avlmaps.maps.fusion.accumulator import VoxelAccumulator  # noqa: E402
from avlmaps.maps.grid import GridSpec  # noqa: E402
from avlmaps.recordings.types import Frame  # noqa: E402

KITCHEN = Path(__file__).resolve().parents[2] / "shared" / "data" / "redkitchen"
DEPTH = Pinhole(585.0, 585.0, 320.0, 240.0, 640, 480)
ROWS, COLUMNS, DIM = 120, 160, 512
ALPHA_VARIANCE, SAMPLE_EVERY = 0.6, 100


def read(path: Path, how: int) -> np.ndarray:
    picture = cv2.imread(str(path), how)
    assert picture is not None, path
    return picture


def kitchen_frames(count: int) -> list[Frame]:
    rig, frames = Rig(DEPTH, DEPTH), []
    paths = sorted(KITCHEN.glob("*.depth.png"))
    for path in paths[:: max(1, len(paths) // count)][:count]:
        depth = read(path, cv2.IMREAD_UNCHANGED).astype(np.float32) / 1000.0
        depth[depth > 60.0] = 0.0
        rgb = np.ascontiguousarray(
            read(path.with_name(path.name.replace("depth.png", "color.jpg")), cv2.IMREAD_COLOR)[..., ::-1]
        )
        pose = poses.orthonormalize(np.loadtxt(str(path).replace("depth.png", "pose.txt")), path.name)
        frames.append(Frame(len(frames), path.name, len(frames) / 15, rgb, depth, pose, rig))
    return frames


def room_frames(count: int) -> list[Frame]:
    """Return frames from the middle of a room of 5 x 2.6 x 4 m (y down), with 11 % of the depth missing."""
    rng, rig, frames = np.random.default_rng(0), Rig(DEPTH, DEPTH), []
    for n in range(count):
        half = 0.5 * 2 * np.pi * n / count
        pose = poses.from_quaternion(
            np.array([0.3 * np.sin(n), 0.0, 0.2]), np.array([0.0, np.sin(half), 0.0, np.cos(half)])
        )
        rays = DEPTH.rays() @ pose[:3, :3].T
        walls = np.where(rays > 0, np.array([2.5, 1.4, 2.0]), np.array([-2.5, -1.2, -2.0]))
        depth = ((walls - pose[:3, 3]) / rays).min(axis=-1)
        depth += rng.normal(scale=0.0015, size=depth.shape) * depth**2
        depth[np.kron(rng.random((30, 40)) < 0.11, np.ones((16, 16), bool))] = 0.0
        rgb = rng.integers(0, 256, (480, 640, 3), dtype=np.uint8)
        frames.append(Frame(n, f"{n:06d}", n / 15, rgb, depth.astype(np.float32), pose, rig))
    return frames


def with_rig(frames: list[Frame], rig: Rig) -> list[Frame]:
    return [Frame(f.index, f.name, f.stamp_s, f.rgb, f.depth_m, f.world_from_camera, rig) for f in frames]


class PointLoop:
    """The published way, written from its description: a hundredth of the pixels, a Python loop over them.

    A dense grid of 1000 x 1000 x 30 holds the row of each voxel; the running mean is stored in arrays that double.
    """

    def __init__(self) -> None:
        self.row_of = np.full((1000, 1000, 30), -1, np.int32)
        self.feature = np.zeros((100_000, DIM), np.float32)
        self.weight = np.zeros(100_000, np.float32)
        self.rgb = np.zeros((100_000, 3), np.uint8)
        self.count = 0

    def add(self, frame: Frame, features: np.ndarray, rng: np.random.Generator) -> int:
        camera = frame.rig.depth
        points = camera.backproject(frame.depth_m).reshape(-1, 3)
        points = points[(points[:, 2] > 0.1) & (points[:, 2] < 6.0)]
        points = points[rng.permutation(len(points))[::SAMPLE_EVERY]]
        world = poses.apply(frame.world_from_camera, points)
        for point_camera, point in zip(points, world, strict=True):
            self._add_point(frame, features, camera.matrix, point_camera, point)
        return len(points)

    def _add_point(self, frame, features, matrix, point_camera, point) -> None:
        row, column, height = int(500 - point[0] / 0.05), int(500 - point[2] / 0.05), int(15 - point[1] / 0.05)
        if not (0 <= row < 1000 and 0 <= column < 1000 and 0 <= height < 30):
            return
        u, v, _ = matrix @ (point_camera / point_camera[2])
        if not (0 <= u < 640 and 0 <= v < 480):
            return
        rgb = frame.rgb[int(v), int(u)]
        feature = features[int(v * ROWS / 480), int(u * COLUMNS / 640)]
        alpha = np.exp(-np.sum(np.square(point_camera)) / (2 * ALPHA_VARIANCE))
        n = self.row_of[row, column, height]
        if n < 0:
            n = self.row_of[row, column, height] = self.count
            self.count += 1
        weight = self.weight[n]
        self.feature[n] = (self.feature[n] * weight + feature * alpha) / (weight + alpha)
        self.rgb[n] = (self.rgb[n] * weight + rgb * alpha) / (weight + alpha)
        self.weight[n] = weight + alpha


def time_ours(frames: list[Frame], maps: Sequence[np.ndarray | None], repeats: int) -> tuple[np.ndarray, int, int]:
    """Return the least seconds of each frame, the points of all and the voxels."""
    best, points, voxels = np.full(len(frames), np.inf), 0, 0
    for _ in range(repeats):
        total, points = VoxelAccumulator(GridSpec(0.05), DIM), 0
        for n, frame in enumerate(frames):
            took, added = seconds(total.add, frame, maps[n % len(maps)])
            points += added
            best[n] = min(best[n], took)
        voxels = len(total)
    return best, points, voxels


def time_loop(frames: list[Frame], maps: list[np.ndarray], repeats: int) -> tuple[np.ndarray, int]:
    best, points = np.full(len(frames), np.inf), 0
    for _ in range(repeats):
        loop, points = PointLoop(), 0
        for n, frame in enumerate(frames):
            took, added = seconds(loop.add, frame, maps[n % len(maps)], np.random.default_rng(n))
            points += added
            best[n] = min(best[n], took)
    return best, points


def line(way: str, best_s: np.ndarray, points: int, loop_rate: float) -> dict[str, object]:
    rate = points / best_s.sum()
    return {
        "way": way,
        "ms_a_frame": float(1e3 * best_s.mean()),
        "frames_a_second": float(1.0 / best_s.mean()),
        "points_a_second": float(rate),
        "times_the_loop": float(rate / loop_rate),
    }


def main() -> int:
    arguments = parser((__doc__ or "").splitlines()[0])
    arguments.add_argument("--frames", type=int, default=40)
    arguments.add_argument("--repeats", type=int, default=7)
    chosen = arguments.parse_args()
    real = KITCHEN.is_dir()
    frames = kitchen_frames(chosen.frames) if real else room_frames(chosen.frames)
    rng = np.random.default_rng(0)
    maps = [rng.standard_normal((ROWS, COLUMNS, DIM), np.float32) for _ in range(3)]
    beside = Rig(
        Pinhole(525.0, 525.0, 320.0, 240.0, 640, 480),
        DEPTH,
        poses.from_quaternion(np.array([0.025, 0.0, 0.0]), np.array([0.0, 0.01, 0.0, 1.0])),
    )
    time_ours(frames[:1], maps, 1)  # compiles
    loop_s, loop_points = time_loop(frames[:4], maps, 3)
    loop_rate = loop_points / loop_s.sum()
    ours_s, points, voxels = time_ours(frames, maps, chosen.repeats)
    beside_s, beside_points, _ = time_ours(with_rig(frames, beside), maps, chosen.repeats)
    bare_s, bare_points, _ = time_ours(frames, [None], chosen.repeats)
    rows = [
        line(f"per-point loop, every {SAMPLE_EVERY}th pixel", loop_s, loop_points, loop_rate),
        line("avlmaps, every pixel, depth registered to colour", ours_s, points, loop_rate),
        line("avlmaps, every pixel, colour camera beside", beside_s, beside_points, loop_rate),
        line("avlmaps, colour and geometry only", bare_s, bare_points, loop_rate),
    ]
    facts: dict[str, object] = {
        "frames": f"{len(frames)} of {'the red kitchen' if real else 'a synthetic room'}",
        "points_a_frame": points / len(frames),
        "voxels": voxels,
        "time": f"processor time of one thread, the least of {chosen.repeats} repeats for each frame",
    }
    show("Fusion, 640x480 depth, 120x160x512 float32 features, 5 cm voxels", rows, facts, chosen.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
