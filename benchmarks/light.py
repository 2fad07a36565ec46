"""How fast the profile ``light`` is on this machine: keyframes, sounds and new words a second.

python benchmarks/light.py [--models DIR] [--threads 2] [--repeats 5] [--json]

Without --models the files are exported into a temporary folder from checkpoints of the published sizes with random
weights (speed is the same): that takes some minutes and needs avlmaps[training] and avlmaps-models[foundation].
"""

import timing

timing.use_one_thread()

import os  # noqa: E402
import sys  # noqa: E402
import time  # noqa: E402
from collections.abc import Callable  # noqa: E402
from dataclasses import replace  # noqa: E402
from pathlib import Path  # noqa: E402
from tempfile import TemporaryDirectory  # noqa: E402

import numpy as np  # noqa: E402

from avlmaps.core.camera import Pinhole, Rig  # noqa: E402
from avlmaps.perception.models.settings import ModelSettings, using_models  # noqa: E402
from avlmaps.recordings.types import Frame  # noqa: E402
from avlmaps_models.light.bundle import open_bundle  # noqa: E402
from avlmaps_models.light.pixels import LightPixels  # noqa: E402
from avlmaps_models.light.sounds import LightSounds  # noqa: E402
from models import frame, sound  # noqa: E402


def export_random(folder: Path) -> None:
    """Write the files, from random weights of the published sizes."""
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
    import torch
    import tyro
    from training.light.__main__ import Options, main

    from random_models import write_clap_unfused, write_tipsv2

    torch.manual_seed(0)
    write_tipsv2(folder)
    write_clap_unfused(folder)
    words = ("--out", str(folder), "--models", str(folder), "--most-phrases", "8", "--least-kept", "0")
    if main(tyro.cli(Options, args=words)):
        raise SystemExit(1)


def cut_square(wide: Frame) -> Frame:
    """Return the 480x480 on the left of a frame of 640x480."""
    camera = Pinhole(525.0, 525.0, 240.0, 240.0, 480, 480)
    rgb, depth_m = (np.ascontiguousarray(part[:, :480]) for part in (wide.rgb, wide.depth_m))
    return replace(wide, rgb=rgb, depth_m=depth_m, rig=Rig(camera, camera))


def measured(what: str, work: Callable[[], object], repeats: int) -> dict[str, object]:
    """Call once to warm up, then time."""
    work()
    wall, processor = [], []
    for _ in range(repeats):
        begin, used = time.perf_counter(), time.process_time()
        work()
        wall.append(time.perf_counter() - begin)
        processor.append(time.process_time() - used)
    return {
        "item": what,
        "wall_s": float(np.median(wall)),
        "processor_s": float(np.median(processor)),
        "items_a_second": 1.0 / float(np.median(wall)),
    }


def main() -> None:
    """Load, time, print."""
    arguments = timing.parser(__doc__ or "")
    arguments.add_argument("--models", type=Path, help="folder of models that holds avlmaps/light-1")
    arguments.add_argument("--threads", type=int, default=2, help="cores that the process may use")
    arguments.add_argument("--repeats", type=int, default=5)
    given = arguments.parse_args()
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[: given.threads])
    with TemporaryDirectory(prefix="light-") as scratch:
        os.environ["AVLMAPS_HOME"] = scratch  # no word is known from before
        folder = given.models or Path(scratch) / "models"
        if given.models is None:
            folder.mkdir()
            export_random(folder)
        with using_models(ModelSettings(folder=folder)):
            pixels, sounds = LightPixels(), LightSounds()
            wide, heard = frame(0), sound(0)
            square = cut_square(wide)
            numbers = iter(range(10**6))
            rows = [
                measured("a picture of 640x480", lambda: pixels.encode(wide), given.repeats),
                measured("a picture of 480x480", lambda: pixels.encode(square), given.repeats),
                measured("10 s of sound", lambda: sounds.encode(heard), given.repeats),
                measured("a new word", lambda: pixels.encode_words([f"word {next(numbers)}"]), given.repeats),
            ]
            size = sum(note.bytes for note in open_bundle().manifest.files.values())
    facts: dict[str, object] = {"cores": given.threads, "files": f"{size / 1e6:.0f} MB"}
    facts["weights"] = "as given" if given.models else "random, of the published sizes"
    facts["peak"] = f"{timing.peak_bytes() / 1e6:.0f} MB"
    timing.show("The profile light", rows, facts, given.json)


if __name__ == "__main__":
    main()
