"""Processor time of ``avlmaps query`` from the shell, beside bare Python and beside an open map in the same run.

python benchmarks/cold_start.py [--map MAP] [--scene house:1] [--frames 400] [--repeats 5] [--json]

Each row starts a process of its own; the least of the repeats counts, after one run that fills the disk's cache.
"""

import timing

timing.use_one_thread()

import os  # noqa: E402
import subprocess  # noqa: E402
import sys  # noqa: E402
import tempfile  # noqa: E402
from pathlib import Path  # noqa: E402

from avlmaps import AVLMap, build_map  # noqa: E402
from avlmaps_sim import RecordSettings, open_scene, record_scene  # noqa: E402

THING, SENTENCE = "bed", "the chair near the table"


def processor_s(command: list[str], repeats: int) -> float:
    """Return the least processor time of a command's process, user and system, seconds."""
    spent = []
    for _ in range(repeats + 1):
        child = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        assert child.stderr is not None
        said = child.stderr.read().decode()
        _, status, usage = os.wait4(child.pid, 0)
        if status != 0:
            raise SystemExit(f"{' '.join(command)} ended with {os.waitstatus_to_exitcode(status)}: {said}")
        spent.append(usage.ru_utime + usage.ru_stime)
    return min(spent[1:])


def made_map(scene: str, frames: int, folder: Path) -> Path:
    """Record a scene and map it."""
    record_scene(open_scene(scene), folder / "REC", RecordSettings(max_frames=frames, hearing="none"), seed=0)
    build_map(folder / "REC", folder / "home.avlmap", progress=False)
    return folder / "home.avlmap"


def main() -> None:
    """Print the table."""
    arguments = timing.parser(str(__doc__))
    arguments.add_argument("--map", type=Path, help="map to query; without one a scene is recorded and mapped")
    arguments.add_argument("--scene", default="house:1")
    arguments.add_argument("--frames", type=int, default=400)
    arguments.add_argument("--repeats", type=int, default=5)
    asked = arguments.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        path = asked.map or made_map(asked.scene, asked.frames, Path(folder))
        avlmap = AVLMap.open(path)
        query = [sys.executable, "-m", "avlmaps", "query", str(path)]
        commands = {
            "python -c pass": [sys.executable, "-c", "pass"],
            "import numpy": [sys.executable, "-c", "import numpy"],
            "import numpy, scipy.spatial, numba": [sys.executable, "-c", "import numpy, scipy.spatial, numba"],
            "avlmaps --help": [sys.executable, "-m", "avlmaps", "--help"],
            f"avlmaps query MAP {THING}": [*query, THING, "--json"],
            f'avlmaps query MAP "{SENTENCE}"': [*query, SENTENCE, "--json"],
        }
        spent = {what: processor_s(command, asked.repeats) for what, command in commands.items()}
        avlmap.ask(THING)
        again = min(timing.seconds(avlmap.ask, THING)[0] for _ in range(asked.repeats))
    base = spent["import numpy"]
    rows = [{"what": what, "processor s": took, "times import numpy": took / base} for what, took in spent.items()]
    rows.append({"what": f"{THING} in an open map", "processor s": again, "times import numpy": again / base})
    timing.show("A query from the shell", rows, {"voxels": len(avlmap.space)}, asked.json)


if __name__ == "__main__":
    main()
