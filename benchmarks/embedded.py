"""Looking at frames with the embedded pixel and view encoder on one core, at the size it ships with and at others.

    python benchmarks/embedded.py [--scene house:3] [--frames 12] [--repeats 3] [--widths 120 160 240] [--json]

A frame is 320x240 with depth, ground and colour, as the recorder makes them. Each is timed on its own, in every repeat,
all widths after one another, and its least time counts, so that other work on the machine disturbs little.
"""

import copy
import os
import sys

from timing import parser, seconds, show, use_one_thread

use_one_thread()
if hasattr(os, "sched_setaffinity"):  # the network takes as many threads as the process may use cores
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})

import cv2  # noqa: E402
import msgspec  # noqa: E402
import numpy as np  # noqa: E402

from avlmaps.core.camera import Pinhole, Rig  # noqa: E402
from avlmaps.perception.embedded.scene_network import SceneNetwork, load_network  # noqa: E402
from avlmaps.recordings.types import Frame, Ground  # noqa: E402
from avlmaps_sim.render import Renderer  # noqa: E402
from avlmaps_sim.scenes import open_scene  # noqa: E402
from avlmaps_sim.views import random_views  # noqa: E402

CAMERA = Pinhole(277.0, 277.0, 160.0, 120.0, 320, 240)


def frames_of(scene_name: str, count: int) -> list[Frame]:
    """Return views from all over a home."""
    scene, rig = open_scene(scene_name), Rig(CAMERA, CAMERA)
    renderer = Renderer(scene)
    up, floor_m = np.array([0.0, 0.0, 1.0]), np.zeros(1)
    frames = []
    for number, pose in enumerate(random_views(scene, np.random.default_rng(0), count, CAMERA)):
        view = renderer.render(CAMERA, pose)
        ground = Ground(up, pose[2:3, 3], floor_m)
        frames.append(Frame(number, str(number), number / 10, view.rgb, view.depth_m, pose, rig, ground))
    return frames


def network_at(width_px: int) -> SceneNetwork:
    """Return the network that ships, looking at pictures of another width."""
    network = copy.copy(load_network())
    network.notes = msgspec.structs.replace(network.notes, width_px=width_px)
    return network


def main() -> int:
    arguments = parser((__doc__ or "").splitlines()[0])
    arguments.add_argument("--scene", default="house:3")
    arguments.add_argument("--frames", type=int, default=12)
    arguments.add_argument("--repeats", type=int, default=3)
    arguments.add_argument("--widths", type=int, nargs="+", default=[120, 160, 240])
    chosen = arguments.parse_args()
    cv2.setNumThreads(1)
    frames = frames_of(chosen.scene, chosen.frames)
    networks = {width: network_at(width) for width in chosen.widths}
    best = {width: np.full(len(frames), np.inf) for width in networks}
    for _ in range(chosen.repeats):
        for number, frame in enumerate(frames):
            for width, network in networks.items():
                best[width][number] = min(best[width][number], seconds(network.see, frame)[0])
    widest = max(networks)
    rows: list[dict[str, object]] = [
        {
            "width_px": width,
            "ms_a_frame": float(1e3 * least.mean()),
            "frames_a_second": float(1 / least.mean()),
            "times_the_widest": float(best[widest].mean() / least.mean()),
        }
        for width, least in best.items()
    ]
    facts: dict[str, object] = {"ships with": load_network().notes.width_px, "frames": len(frames)}
    show("The embedded pixel and view encoder, one core", rows, facts, chosen.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
