"""Drawing a furnished home at 320x240 on one core, alone and with a depth camera's faults laid over it.

    python benchmarks/render.py [--scene house:3] [--views 60] [--repeats 5] [--json]

Beside it stands embree (embreex), where it is installed: it casts the same rays in the same run and says which
triangle each meets and how far away, and no more. Views are drawn from places all over the home. Each is timed on its
own, in every repeat, and its least time counts, so that other work on the machine disturbs little.
"""

import sys
from collections.abc import Callable

from timing import parser, seconds, show, use_one_thread

use_one_thread()

import cv2  # noqa: E402
import numpy as np  # noqa: E402

from avlmaps.core.camera import Pinhole  # noqa: E402
from avlmaps_sim.render import Renderer  # noqa: E402
from avlmaps_sim.scene import Scene  # noqa: E402
from avlmaps_sim.scenes import open_scene  # noqa: E402
from avlmaps_sim.sensor import KINECT, Sensor  # noqa: E402
from avlmaps_sim.views import random_views  # noqa: E402

CAMERA = Pinhole(277.0, 277.0, 160.0, 120.0, 320, 240)


def embree_caster(scene: Scene) -> Callable[[np.ndarray], object] | None:
    """Return a caster of a view's rays through embree; None where it is not installed."""
    try:
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene
    except ImportError:
        return None
    tree = EmbreeScene()
    TriangleMesh(tree, np.ascontiguousarray(scene.mesh.corners(), np.float32))

    def cast(pose: np.ndarray) -> object:
        rays = (CAMERA.rays().reshape(-1, 3) @ pose[:3, :3].T).astype(np.float32)
        origin = np.repeat(pose[None, :3, 3].astype(np.float32), len(rays), axis=0)
        return tree.run(origin, rays, output=True)

    return cast


def least_s(work: Callable[[np.ndarray], object], poses: np.ndarray, repeats: int) -> np.ndarray:
    """Return the least seconds of each view."""
    best = np.full(len(poses), np.inf)
    for _ in range(repeats):
        for n, pose in enumerate(poses):
            best[n] = min(best[n], seconds(work, pose)[0])
    return best


def main() -> int:
    arguments = parser((__doc__ or "").splitlines()[0])
    arguments.add_argument("--scene", default="house:3")
    arguments.add_argument("--views", type=int, default=60)
    arguments.add_argument("--repeats", type=int, default=5)
    chosen = arguments.parse_args()
    cv2.setNumThreads(1)
    scene = open_scene(chosen.scene)
    poses = random_views(scene, np.random.default_rng(0), chosen.views, CAMERA)
    Renderer(scene)  # compiles
    prepare_s, lit = seconds(Renderer, scene)
    plain_s, plain = seconds(Renderer, scene, False)
    sensor, rng = Sensor(KINECT), np.random.default_rng(0)
    ways: dict[str, Callable[[np.ndarray], object]] = {
        "avlmaps, plain colours": lambda pose: plain.render(CAMERA, pose),
        "avlmaps, light, shadows and pictures": lambda pose: lit.render(CAMERA, pose),
        "avlmaps, the same and a depth camera's faults": lambda pose: sensor.spoil(
            lit.render(CAMERA, pose), CAMERA, rng
        ),
    }
    cast = embree_caster(scene)
    if cast is not None:
        ways = {"embree, depth and triangle only": cast, **ways}
    times = {way: least_s(work, poses, chosen.repeats) for way, work in ways.items()}
    reference = next(iter(times.values())).mean()
    rows: list[dict[str, object]] = [
        {
            "way": way,
            "ms_a_view": float(1e3 * best.mean()),
            "slowest_ms": float(1e3 * best.max()),
            "views_a_second": float(1 / best.mean()),
            "times_the_first": float(reference / best.mean()),
        }
        for way, best in times.items()
    ]
    facts: dict[str, object] = {
        "scene": f"{scene.name}: {len(scene.mesh.triangle):,} triangles, {len(scene.objects)} objects, "
        f"{len(scene.lights)} lamps",
        "views": len(poses),
        "seconds_to_prepare_with_light": prepare_s,
        "seconds_to_prepare_without": plain_s,
        "time": f"processor time of one thread, the least of {chosen.repeats} repeats for each view",
    }
    show("Rendering, 320x240", rows, facts, chosen.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
