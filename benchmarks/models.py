"""How fast the large models are on this machine, at their published sizes, with random weights (speed is the same).

python benchmarks/models.py [--backends tipsv2 siglip2 ...] [--device auto] [--precision auto] [--batch 0] [--frames 5]
    [--keypoints 1000] [--json]

Each backend's checkpoint is written into a temporary folder, loaded as ``avlmaps build`` does, timed, and removed, in
processes of its own. An item is a picture of 640x480, ten seconds of sound, or a pair of pictures to match.
"""

import timing

timing.use_one_thread()

import gc  # noqa: E402
import os  # noqa: E402
import sys  # noqa: E402
import time  # noqa: E402
from argparse import Namespace  # noqa: E402
from collections.abc import Callable  # noqa: E402
from concurrent.futures import ProcessPoolExecutor  # noqa: E402
from concurrent.futures.process import BrokenProcessPool  # noqa: E402
from multiprocessing import get_context  # noqa: E402
from pathlib import Path  # noqa: E402
from tempfile import TemporaryDirectory  # noqa: E402
from typing import Any  # noqa: E402

import cv2  # noqa: E402
import numpy as np  # noqa: E402

from avlmaps.core.camera import Pinhole, Rig  # noqa: E402
from avlmaps.core.errors import AvlmapsError  # noqa: E402
from avlmaps.core.registry import Backend, Kind, backends, load  # noqa: E402
from avlmaps.perception.models.settings import ModelSettings, precision_in_force, using_models  # noqa: E402
from avlmaps.perception.protocols import LocalFeatures  # noqa: E402
from avlmaps.recordings.audio import Sound  # noqa: E402
from avlmaps.recordings.types import Frame  # noqa: E402
from random_models import LEFT_OUT, WRITERS  # noqa: E402

CAMERA = Pinhole(525.0, 525.0, 320.0, 240.0, 640, 480)
SOUND_S, RATE_HZ = 10, 48_000
VIEWS_AT_ONCE = 16  # as a build hands them to a large model; a CPU takes them one by one nevertheless


def large_models() -> dict[str, Backend]:
    """Return the backends on torch by their names, which no two kinds share."""
    return {backend.name: backend for backend in backends() if "torch" in backend.needs}


def frame(number: int) -> Frame:
    """Return a picture of random shapes, two metres away."""
    rng = np.random.default_rng(number)
    rgb = np.full((480, 640, 3), 128, np.uint8)
    for _ in range(800):
        centre, half = rng.integers(0, (640, 480)).tolist(), (3 + rng.exponential(15, 2)).astype(int).tolist()
        cv2.ellipse(rgb, centre, half, rng.uniform(0, 180), 0, 360, rng.integers(0, 256, 3).tolist(), -1, cv2.LINE_AA)
    depth = np.full((480, 640), 2.0, np.float32)
    return Frame(number, f"{number:06d}", number / 30.0, rgb, depth, np.eye(4), Rig(CAMERA, CAMERA))


def sound(number: int) -> Sound:
    """Return ten seconds of noise under a slow swell."""
    rng = np.random.default_rng(number)
    swell = np.sin(np.linspace(0.0, 20.0, SOUND_S * RATE_HZ)) ** 2
    return Sound((0.1 * swell * rng.standard_normal(SOUND_S * RATE_HZ)).astype(np.float32), RATE_HZ)


def keypoints(number: int, count: int, dim: int) -> LocalFeatures:
    """Return random keypoints of a picture."""
    rng = np.random.default_rng(number)
    rows = rng.standard_normal((count, dim)).astype(np.float32)
    rows /= np.linalg.norm(rows, axis=1, keepdims=True)
    xy = rng.uniform(8.0, (632.0, 472.0), (count, 2)).astype(np.float32)
    return LocalFeatures(xy, rows, score=rng.uniform(0.1, 1.0, count).astype(np.float32), size=(640, 480))


def task(kind: Kind, encoder: Any, on_gpu: bool, asked: Namespace) -> tuple[int, Callable[[], Any]]:
    """Return how many items go through at once, as a build hands them over, and what does one such batch."""
    if kind == Kind.SOUNDS:
        heard = sound(0)
        return 1, lambda: encoder.encode(heard)
    if kind == Kind.MATCHER:
        pictures = [keypoints(n, asked.keypoints, encoder.card.dim) for n in (0, 1)]
        return 1, lambda: encoder.match(*pictures)
    batch = asked.batch or (VIEWS_AT_ONCE if on_gpu else 1)
    if kind == Kind.PIXELS:
        batch = int(getattr(encoder, "batch", 1))
    if kind in (Kind.LOCAL, Kind.PLACE):
        batch = 1
    frames = [frame(n) for n in range(batch)]
    blank = LocalFeatures(np.zeros((0, 2), np.float32), np.zeros((0, 128), np.float32))
    state = encoder.fit([], np.random.default_rng(0)) if kind == Kind.PLACE else {}
    works: dict[Kind, Callable[[], Any]] = {
        Kind.PIXELS: lambda: encoder.encode_batch(frames),
        Kind.VIEWS: lambda: encoder.encode(frames),
        Kind.LOCAL: lambda: encoder.encode(frames[0].rgb),
        Kind.PLACE: lambda: encoder.encode(frames[0].rgb, blank, state),
    }
    return batch, works[kind]


def measure(name: str, folder: Path, asked: Namespace) -> dict[str, object]:
    """Load a backend from a folder of models and time it; runs in a process of its own, for the memory."""
    kind = large_models()[name].kind
    settings = ModelSettings(folder, asked.device, asked.precision, asked.batch, offline=True)
    with using_models(settings):
        encoder: Any = load(kind, name)
        import torch

        from avlmaps_models.common.device import select_device

        device = select_device()
        on_gpu = device.type != "cpu"
        batch, work = task(kind, encoder, on_gpu, asked)
        # A GPU is waited for; on a busy CPU waiting must not count, which only one thread can separate.
        clock = time.perf_counter if on_gpu or torch.get_num_threads() > 1 else time.thread_time
        made = work()
        times = []
        for _ in range(asked.frames):
            begin = clock()
            made = work()
            times.append(clock() - begin)
        cuda = device.type == "cuda"
        ms = 1e3 * float(np.median(times)) / batch
        return {
            "module": str(kind),
            "backend": name,
            "model": encoder.card.id,
            "weights_m": round(loaded_weights(torch.nn.Module) / 1e6, 1),
            "device": str(device),
            "precision": precision_in_force(),
            "batch": batch,
            "result": shape(made),
            "ms_an_item": ms,
            "items_a_second": 1e3 / ms,
            "peak_mb": round((torch.cuda.max_memory_allocated() if cuda else timing.peak_bytes()) / 1e6),
        }


def loaded_weights(module: type) -> int:
    """Return how many weights there are in all networks of this process."""
    networks = [thing for thing in gc.get_objects() if issubclass(type(thing), module)]
    counts = {id(row): row.numel() for network in networks for row in network._parameters.values() if row is not None}
    return sum(counts.values())


def shape(made: Any) -> str:
    """Return the size of the output, or the number of keypoints."""
    if isinstance(made, LocalFeatures):
        return f"{len(made.xy)} keypoints"
    made = made[0] if isinstance(made, list) else made
    return "x".join(map(str, made.shape))


def write(name: str, folder: Path) -> None:
    """Write a backend's checkpoint; runs in a process of its own, for the memory."""
    import torch

    from avlmaps_models.common import device  # noqa: F401 - before transformers, see models/operators.py

    torch.manual_seed(0)
    WRITERS[name](folder)


def alone(work: Callable[..., Any], *arguments: object) -> Any:
    """Call in a fresh process."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        return pool.submit(work, *arguments).result()


def reason_against(name: str, known: dict[str, Backend]) -> str:
    """Return why a backend cannot be timed here, or ``""``."""
    if name in LEFT_OUT:
        return LEFT_OUT[name]
    missing = known[name].missing
    return f"needs {', '.join(missing)}: {known[name].how_to_get}" if missing else ""


def main() -> None:
    """Write, load and time one backend after the other; print."""
    known = large_models()
    arguments = timing.parser(__doc__ or "")
    arguments.add_argument("--backends", nargs="+", choices=known, default=list(known), metavar="NAME")
    arguments.add_argument("--device", default="auto")
    arguments.add_argument("--precision", default="auto", choices=("auto", "float32", "float16", "bfloat16"))
    arguments.add_argument("--batch", type=int, default=0, help="pictures at once; 0 as a build chooses")
    arguments.add_argument("--frames", type=int, default=5, help="batches that are timed, after one to warm up")
    arguments.add_argument("--keypoints", type=int, default=1000, help="of each of two pictures that are matched")
    given = arguments.parse_args()
    os.environ |= {"HF_HUB_OFFLINE": "1", "HF_HUB_DISABLE_PROGRESS_BARS": "1", "TRANSFORMERS_VERBOSITY": "error"}
    rows: list[dict[str, object]] = []
    left_out: dict[str, str] = {}
    for name in given.backends:
        if reason := reason_against(name, known):
            left_out[name] = reason
            continue
        print(f"{name} ...", file=sys.stderr)
        try:
            with TemporaryDirectory(prefix="random-models-") as folder:
                alone(write, name, Path(folder))
                rows.append(alone(measure, name, Path(folder), given))
            print(f"{name}: {rows[-1]['ms_an_item']:,.0f} ms", file=sys.stderr)
        except (AvlmapsError, ImportError, RuntimeError, OSError, MemoryError, BrokenProcessPool) as fault:
            left_out[name] = " ".join(f"{type(fault).__name__}: {fault}".split())[:300]
    facts: dict[str, object] = {f"left out: {name}": reason for name, reason in left_out.items()}
    facts["weights"] = "random, of the published sizes"
    facts["item"] = f"a picture of 640x480, {SOUND_S} s of sound, or two pictures of {given.keypoints:,} keypoints each"
    facts["time"] = "median; a CPU's: processor time of one thread"
    if not rows:
        raise SystemExit("\n".join(f"{what}: {why}" for what, why in facts.items()))
    timing.show("Large models", rows, facts, given.json)


if __name__ == "__main__":
    main()
