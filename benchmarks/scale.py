"""What opening and first questions cost on large maps: processor seconds and peak memory, each in a process of its own.

    python benchmarks/scale.py --folder OUT --voxels 1000000 5000000 --against decabd78
    python benchmarks/scale.py --folder OUT --map home.avlmap --photo photo.png

The map, by default that of the home house:7, is tiled to each size (``tiled.py``). With ``--against``, each command is
run with the source of that commit, or in that folder, as well, one after the other, and the ratio is given; it
must read the same schema.
"""

import argparse
import os
import re
import resource
import shlex
import subprocess
import sys
import tarfile
import tempfile
from io import BytesIO
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


def run(command: str, source: str | None) -> tuple[float, float]:
    """Run one command; return the seconds of processor time of the system and of the program, and its peak in MB."""
    where = {**os.environ, **dict.fromkeys(timing.THREAD_VARIABLES, "1")}
    if source is not None:
        where["PYTHONPATH"] = source
    words = [sys.executable, "-c", PEAK, *shlex.split(command)]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(words, env=where, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, check=False)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    said = re.search(r"^peak kB (\d+)$", done.stderr, re.MULTILINE)
    if done.returncode not in (0, 1) or said is None:
        sys.exit(f"avlmaps {command} failed ({done.returncode}): {done.stderr[-400:]}")
    used_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return used_s, int(said[1]) / 1024


def source_of(named: str, work: Path) -> str:
    """Return the PYTHONPATH of a source folder, or of a commit, which is unpacked."""
    if Path(named).is_dir():
        return named
    unpacked = subprocess.run(["git", "archive", named, "src"], stdout=subprocess.PIPE, check=True).stdout
    with tarfile.open(fileobj=BytesIO(unpacked)) as archive:
        archive.extractall(work / "before", filter="data")
    return str(work / "before" / "src")


def rows_of(path: Path, chosen: argparse.Namespace, source: str | None, work: Path) -> list[dict[str, object]]:
    """Run every command on one map: with nothing stored beside it, as a build leaves it, and with the other source."""
    rows: list[dict[str, object]] = []
    for name, form in COMMANDS.items():
        if chosen.only and name not in chosen.only:
            continue
        row: dict[str, object] = {"command": name}
        command = form
        for word, value in {"MAP": str(path), "PHOTO": str(chosen.photo), "OUT": str(work)}.items():
            command = command.replace(word, shlex.quote(value))

        def measured(with_source: str | None, command: str = command) -> tuple[float, float]:
            (work / "page.html").unlink(missing_ok=True)
            return run(command, with_source)

        if source is not None:
            row["CPU s before"], row["peak MB before"] = measured(source)
        row["CPU s"], row["peak MB"] = measured(None)
        if source is not None:
            row["ratio"] = row["CPU s before"] / row["CPU s"]  # pyright: ignore[reportOperatorIssue]
        rows.append(row)
        print(row, file=sys.stderr)
    return rows


def make_home(folder: Path) -> tuple[Path, Path]:
    """Return a map of a simulated home and a photo taken in it; made where they are not there yet."""
    recording, path = folder / "home.rec", folder / "home.avlmap"
    avlmaps = [sys.executable, "-m", "avlmaps"]
    if not recording.is_dir():
        subprocess.run([*avlmaps, "record", "--scene", "house:7", "--out", str(recording)], check=True)
    if not path.is_dir():
        subprocess.run([*avlmaps, "build", str(recording), "--out", str(path)], check=True, stdout=subprocess.DEVNULL)
    return path, recording / "rgb" / "000300.png"


def main() -> None:
    """Print a table for each size."""
    arguments = timing.parser((__doc__ or "").splitlines()[0])
    arguments.add_argument("--folder", type=Path, required=True, help="large maps are stored in its folder scale")
    arguments.add_argument("--map", type=Path, help="a map whose up is z")
    arguments.add_argument("--photo", type=Path, help="a photo taken in it")
    arguments.add_argument("--voxels", type=int, nargs="+", default=[1_000_000])
    arguments.add_argument("--against", help="another version: a commit, or a source folder")
    arguments.add_argument("--only", nargs="+", choices=list(COMMANDS))
    chosen = arguments.parse_args()
    if (chosen.map is None) != (chosen.photo is None):
        arguments.error("give --map and --photo, or neither")
    folder = chosen.folder / "scale"
    folder.mkdir(parents=True, exist_ok=True)
    if chosen.map is None:
        chosen.map, chosen.photo = make_home(folder)
    with tempfile.TemporaryDirectory() as temporary:
        work = Path(temporary)
        source = None if chosen.against is None else source_of(chosen.against, work)
        rows_of(chosen.map, chosen, source, work)  # compiles the loops
        for count in chosen.voxels:
            path = folder / f"{count}.avlmap"
            if not path.exists():
                write_tiled(chosen.map, path, count)
            rows = rows_of(path, chosen, source, work)
            timing.show(f"Questions to a map of {count:,} voxels", rows, {}, chosen.json)


if __name__ == "__main__":
    main()
