"""Small inputs that are whole: a recording in each format and a map, for the fuzz campaign to break."""

# pyright: reportMissingImports=false
import sys
from pathlib import Path

import numpy as np

_TESTS = Path(__file__).parent.parent
for _folder in (".", "recordings", "maps", "fuzz"):
    if str(_TESTS / _folder) not in sys.path:
        sys.path.insert(0, str(_TESTS / _folder))

import build_fakes  # noqa: E402
import recording_scenes as scenes  # noqa: E402
import test_avlmaps_layout  # noqa: E402
import test_replica_scannet  # noqa: E402
import test_tum  # noqa: E402
from test_rosbag import write_bag  # noqa: E402

from avlmaps.maps.build import build_map  # noqa: E402
from avlmaps.recordings.open import open_recording  # noqa: E402
from helpers import bag_writers, format_writers  # noqa: E402

PROFILE = build_fakes.register_fakes()


def write_seeds(folder: Path) -> dict[str, Path]:
    """Write every seed below a folder; return where each lies."""
    walk = scenes.write_folder(folder / "folder")
    build_fakes.write_beeps(walk / "audio.flac")
    timed = scenes.write_folder(folder / "timed")
    (timed / "frames.csv").write_text("name,stamp_s\n" + "".join(f"{i:06d},{i / 10}\n" for i in range(5)))
    found = {
        "folder": walk,
        "timed": timed,
        "7scenes": scenes.write_seven_scenes(folder / "7scenes"),
        "tum": test_tum._write(folder / "tum"),
        "replica": test_replica_scannet._write_replica(folder / "replica", folder / "replica/cam_params.json"),
        "scannet": test_replica_scannet._write_scannet(folder / "scannet"),
        "avlmaps": test_avlmaps_layout._write(folder / "avlmaps"),
    }
    for kind in ("ros1", "ros2", "mcap"):
        (folder / kind).mkdir()
        found[kind] = write_bag(folder / kind, kind, sound=True)
    for name, written in format_writers.WRITTEN.items():
        if name not in found and written.format == name:
            found[name] = written.write(folder / f"room_{name}", written.truth())
    found["foxglove"] = bag_writers.write_foxglove(folder / "foxglove", format_writers.example_truth())
    found["map"] = folder / "walk.avlmap"
    build_map(open_recording(walk), found["map"], PROFILE, build_fakes.SETTINGS, progress=False, allow=["geometry"])
    return found


# A mutator reads files whole; one that an earlier mutator made huge is left as it is.
MOST_BYTES = 64_000_000


def files_of(seed: Path) -> list[Path]:
    """Return the files of a seed that can be read whole, in a fixed order."""
    files = [seed] if seed.is_file() else sorted(file for file in seed.rglob("*") if file.is_file())
    return [file for file in files if file.stat().st_size <= MOST_BYTES]


def is_text(file: Path) -> bool:
    """Tell whether a file is one of numbers or words."""
    return file.suffix in (".csv", ".txt", ".json", ".yaml")


def numbers_of(rng: np.random.Generator) -> str:
    """Return a number as nobody writes one."""
    odd = (
        "nan",
        "inf",
        "-inf",
        "1e308",
        "1e6",
        "-1e4",
        "0",
        "1e-300",
        "",
        "x",
        "1.#IND",
        "99999999999999999999",
        "0x10",
    )
    return str(rng.choice(odd))
