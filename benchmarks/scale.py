"""What opening and first questions cost on large maps: processor seconds and peak memory, each in a process of its own.

    python benchmarks/scale.py home.avlmap --voxels 1000000 5000000 --against ../before/src

The map is tiled to each size (``tiled.py``). With ``--against``, each command is run with that source as well, one
after the other, and the ratio is given.
"""

import argparse
import os
import re
import resource
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

import timing
from tiled import write_tiled

# What is run, by its name; MAP, PHOTO and OUT are put in.
COMMANDS = {
    "info": "info MAP",
    "object": "query MAP sofa --json",
    "object near sound": "query MAP 'the chair near the sound of a hair dryer' --json",
    "object near object": "query MAP 'the chair near the table in the kitchen' --json",
    "area": "query MAP 'the kitchen' --json",
    "image": "query MAP --image PHOTO --json",
    "locate": "locate MAP PHOTO --json",
    "things": "things MAP --json",
    "view --out": "view MAP --out OUT/page.html --json",
}
PEAK = """
import atexit, pathlib, sys
def peak():
    said = pathlib.Path("/proc/self/status").read_text()
    sys.stderr.write("\\npeak kB " + said.partition("VmHWM:")[2].split()[0] + "\\n")
atexit.register(peak)
from avlmaps.cli import main
sys.argv[0] = "avlmaps"
main()
"""


def run(command: str, source: Path | None) -> tuple[float, float]:
    """Run one command; return the seconds of processor time of the system and of the program, and its peak in MB."""
    where = {**os.environ, **dict.fromkeys(timing.THREAD_VARIABLES, "1")}
    if source is not None:
        where["PYTHONPATH"] = str(source)
    words = [sys.executable, "-c", PEAK, *shlex.split(command)]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(words, env=where, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, check=False)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    said = re.search(r"^peak kB (\d+)$", done.stderr, re.MULTILINE)
    if done.returncode not in (0, 1) or said is None:
        sys.exit(f"avlmaps {command} failed ({done.returncode}): {done.stderr[-400:]}")
    used_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return used_s, int(said[1]) / 1024


def rows_of(path: Path, photo: Path, chosen: argparse.Namespace, work: Path) -> list[dict[str, object]]:
    """Run every command on one map, and with the other source where one is given."""
    rows: list[dict[str, object]] = []
    for name, form in COMMANDS.items():
        if chosen.only and name not in chosen.only:
            continue
        row: dict[str, object] = {"command": name}
        told = {"MAP": str(path), "PHOTO": str(photo), "OUT": str(work)}
        command = form
        for word, value in told.items():
            command = command.replace(word, shlex.quote(value))
        for label, source in (("", None), (" before", chosen.against)):
            if label and source is None:
                continue
            (work / "page.html").unlink(missing_ok=True)
            row[f"CPU s{label}"], row[f"peak MB{label}"] = run(command, source)
        if chosen.against is not None:
            row["ratio"] = row["CPU s before"] / row["CPU s"]  # pyright: ignore[reportOperatorIssue]
        rows.append(row)
        print(row, file=sys.stderr)
    return rows


def main() -> None:
    """Print a table for each size."""
    arguments = timing.parser((__doc__ or "").splitlines()[0])
    arguments.add_argument("map", type=Path)
    arguments.add_argument("photo", type=Path, help="a photo taken in it")
    arguments.add_argument("--voxels", type=int, nargs="+", default=[1_000_000])
    arguments.add_argument("--against", type=Path, help="source folder of another version")
    arguments.add_argument("--only", nargs="+", choices=list(COMMANDS))
    arguments.add_argument("--folder", type=Path, help="where the large maps are stored")
    chosen = arguments.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = chosen.folder or Path(temporary)
        for count in chosen.voxels:
            path = folder / f"{count}.avlmap"
            if not path.exists():
                write_tiled(chosen.map, path, count)
            rows = rows_of(path, chosen.photo, chosen, Path(temporary))
            timing.show(f"Questions to a map of {count:,} voxels", rows, {}, chosen.json)


if __name__ == "__main__":
    main()
