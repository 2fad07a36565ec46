"""How long locating a photo takes, stage by stage, beside plain methods in the same run.

python benchmarks/locate.py [--keyframes 100] [--photos 10] [--json]

The pictures are painted at random (640x480, about 1,000 keypoints); a photo is a keyframe shifted, with noise.
"""

from collections.abc import Callable
from typing import TypeVar

import timing

timing.use_one_thread()

import cv2  # noqa: E402
import numpy as np  # noqa: E402

from avlmaps.core.camera import Pinhole, Rig  # noqa: E402
from avlmaps.maps.keyframes.album import DescribedKeyframe, stack_keyframes  # noqa: E402
from avlmaps.perception.embedded.keypoints import RATIO, match_mutual  # noqa: E402
from avlmaps.perception.encoders import Encoders  # noqa: E402
from avlmaps.perception.pose import estimate_pose  # noqa: E402
from avlmaps.query.locate import alike, locate  # noqa: E402
from avlmaps_sim.bench.locate import LocatableMap  # noqa: E402

T = TypeVar("T")
CAMERA = Pinhole(525.0, 525.0, 320.0, 240.0, 640, 480)
DEPTH_M = 2.0


def painted(rng: np.random.Generator) -> np.ndarray:
    """Return a wall of random shapes, larger than a picture."""
    wall = np.full((560, 720, 3), 128, np.uint8)
    for _ in range(1500):
        colour = tuple(int(value) for value in rng.integers(0, 256, 3))
        centre = rng.uniform(0, (720, 560)).astype(int).tolist()
        half = np.maximum(2, rng.exponential(12, 2)).astype(int).tolist()
        cv2.ellipse(wall, centre, half, rng.uniform(0, 180), 0, 360, colour, -1, cv2.LINE_AA)
    return cv2.GaussianBlur(wall, (0, 0), 0.8)


def picture(wall: np.ndarray, shift_px: int, rng: np.random.Generator) -> np.ndarray:
    """Return the view of a wall from a little to the side."""
    seen = wall[20:500, 20 + shift_px : 660 + shift_px].astype(np.int16)
    return (seen + rng.normal(scale=3.0, size=seen.shape)).clip(0, 255).astype(np.uint8)


def made_map(walls: list[np.ndarray], rng: np.random.Generator) -> LocatableMap:
    """Return a map with one keyframe in front of each wall."""
    used = Encoders.named("embedded")
    pictures = [picture(wall, 0, rng) for wall in walls]
    local = [used.local.encode(rgb) for rgb in pictures]
    state = used.place.fit(local[:64], rng)
    seen = []
    for number, (rgb, one) in enumerate(zip(pictures, local, strict=True)):
        pose = np.eye(4)
        pose[0, 3] = 10.0 * number
        ray = np.column_stack([(one.xy - (CAMERA.cx, CAMERA.cy)) / CAMERA.fx, np.ones(len(one.xy))])
        points = (DEPTH_M * ray + pose[:3, 3]).astype(np.float32)
        place = used.place.encode(rgb, one, state)
        none = np.zeros(0, np.float32)
        seen.append(DescribedKeyframe(float(number), pose, points.mean(axis=0), none, place, one, points, b""))
    return LocatableMap(stack_keyframes(seen), state, used, Rig(CAMERA, CAMERA))


def by_opencv(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Match by cv2's brute force in both directions."""
    there = cv2.BFMatcher(cv2.NORM_L2).knnMatch(a, b, k=2)
    back = {match.queryIdx: match.trainIdx for match in cv2.BFMatcher(cv2.NORM_L2).match(b, a)}
    pairs = [(m.queryIdx, m.trainIdx) for m, n in there if m.distance < RATIO * n.distance]
    return np.array([(i, j) for i, j in pairs if back[j] == i])


def by_flann(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Match by cv2's approximate search, one direction."""
    there = cv2.FlannBasedMatcher({"algorithm": 1, "trees": 4}, {"checks": 64}).knnMatch(a, b, k=2)
    return np.array([(m.queryIdx, m.trainIdx) for m, n in there if m.distance < RATIO * n.distance])


def by_opencv_pnp(xy: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Estimate the pose by cv2's RANSAC."""
    _, _, shift, _ = cv2.solvePnPRansac(
        points.astype(np.float64),
        xy.astype(np.float64),
        CAMERA.matrix,
        None,
        iterationsCount=2000,
        reprojectionError=6.3,
    )
    return shift


def measure(stored: LocatableMap, photos: list[np.ndarray]) -> dict[str, float]:
    """Return milliseconds of processor time a photo, the median, for each stage and each other way."""
    taken: dict[str, list[float]] = {}

    def timed(name: str, work: Callable[..., T], *arguments: object) -> T:
        spent, result = timing.seconds(work, *arguments)
        taken.setdefault(name, []).append(1e3 * spent)
        return result

    keyframes, used = stored.keyframes, stored.encoders
    for rgb in photos:
        local = timed("RootSIFT", used.local.encode, rgb)
        place = timed("VLAD", used.place.encode, rgb, local, stored.place_state)
        best = int(timed("retrieval", alike, keyframes, place, 5)[0])
        rows = slice(keyframes.offsets[best], keyframes.offsets[best + 1])
        other = keyframes.descriptors[rows].astype(np.float32)
        pairs = timed("matching, ours", match_mutual, local.descriptors, other)
        timed("matching, cv2 brute force", by_opencv, local.descriptors, other)
        timed("matching, cv2 FLANN", by_flann, local.descriptors, other)
        xy, points = local.xy[pairs[:, 0]], keyframes.points_world[rows][pairs[:, 1]]
        timed("pose, PoseLib", estimate_pose, xy, points, CAMERA, np.random.default_rng(0))
        timed("pose, cv2", by_opencv_pnp, xy, points)
        found = timed("all of it", locate, stored, rgb, CAMERA, np.random.default_rng(0))
        if found.world_from_camera is None:
            raise SystemExit("a photo of the map was not located; the figures would mean nothing")
    return {name: float(np.median(values)) for name, values in taken.items()}


def main() -> None:
    """Make the map and the photos, measure, print."""
    arguments = timing.parser(__doc__ or "")
    arguments.add_argument("--keyframes", type=int, default=100)
    arguments.add_argument("--photos", type=int, default=10)
    given = arguments.parse_args()
    cv2.setNumThreads(1)
    rng = np.random.default_rng(0)
    walls = [painted(rng) for _ in range(given.keyframes)]
    stored = made_map(walls, rng)
    asked = np.linspace(0, given.keyframes - 1, given.photos).round().astype(int)
    figures = measure(stored, [picture(walls[k], int(rng.integers(5, 40)), rng) for k in asked])
    rows = [{"stage": name, "ms a photo, one thread": value} for name, value in figures.items()]
    facts = {"keyframes": given.keyframes, "keypoints a picture": int(np.diff(stored.keyframes.offsets).mean())}
    timing.show("Locating a photo", rows, facts, given.json)


if __name__ == "__main__":
    main()
