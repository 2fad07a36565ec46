"""Run every benchmark into docs/benchmarks.json; write docs/benchmarks.md and the README's table from it.

    python benchmarks/report.py --sounds SOUNDS --recording RECORDING --house HOUSE
    python benchmarks/report.py --only words sounds --sounds SOUNDS
    python benchmarks/report.py --stale          # only what is missing, or was measured with other weights
    python benchmarks/report.py --whole          # the paper's numbers of homes, tasks and missions (two nights)
    python benchmarks/report.py --page           # measure nothing, write the page again
    python benchmarks/report.py --check          # exit 1 unless page and README agree with docs/benchmarks.json
    python benchmarks/report.py --small          # every command on little data; writes nothing

Each result is stored as soon as its command ends; the suites continue from their own work in --out. Commands
whose data is not there are skipped with a note.
"""

import argparse
import csv
import json
import os
import platform
import shlex
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from datetime import date
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

from avlmaps.core.files import write_bytes_atomically  # noqa: E402
from avlmaps.core.version import __version__  # noqa: E402
from avlmaps_sim.bench.harness.settings import shipped_checksums  # noqa: E402
from page import (  # noqa: E402
    ENTRIES,
    FEW,
    FIGURES,
    HOMES,
    PAGE,
    README,
    Entry,
    is_there,
    page,
    read_figures,
    readme_table,
    stale,
    with_figures,
)

SHARED = HERE.parents[1] / "shared"
_HOME = "--scenes house:1 --frames 60 --jobs 1 --out OUT"
_TASKS = f"{_HOME} --tasks-a-scene 2"
# The commands that take minutes or more, on little.
SMALL = {
    "fusion": "python benchmarks/fusion.py --frames 2 --repeats 1",
    "geometry": "python benchmarks/geometry.py --scenes house:5 --sensors kinect --frames 8",
    "corrected": "python benchmarks/corrected.py --scenes house:1 --frames 16 32 --size 80 60 --most 60",
    "queries": "python benchmarks/queries.py --voxels 20000 --features 5000 --dim 32",
    "cold-start": "python benchmarks/cold_start.py --scene house:1 --frames 20 --repeats 1",
    "scale": "python benchmarks/scale.py --folder OUT --voxels 50000 --only object",
    "locating": "python benchmarks/locate.py RECORDING --elsewhere PHOTOS --photos 3 --pairs 1",
    "store": "python benchmarks/store.py --voxels 50000",
    "house": "avlmaps bench objects --scenes HOUSE --frames 20 --jobs 1 --out OUT",
    "objects": f"avlmaps bench objects {_HOME}",
    "objects-lived-in": "avlmaps bench objects --scenes house:1:lived-in --frames 20 --jobs 1 --out OUT",
    "rooms": f"avlmaps bench rooms {_HOME}",
    "change": "avlmaps bench change --scenes house:1 --days 2 --frames 40 --jobs 1 --out OUT",
    "live": "avlmaps bench live --scenes RECORDING --laps 1 --kills 1 --out OUT",
    "sources": "avlmaps bench sources --scenes house:1 --rooms ROOMS --trials 1 --jobs 1 --out OUT",
    "indexing": f"avlmaps bench indexing {_TASKS}",
    "indexing-clips": f"avlmaps bench indexing --sounds SOUNDS {_TASKS}",
    "indexing-paper": f"avlmaps bench indexing --rules paper {_TASKS}",
    "found": f"avlmaps bench found {_HOME}",
    "navigation": f"avlmaps bench navigation --sequences 1 {_HOME}",
}


def words_of(command: str, data: dict[str, Path], homes: Sequence[str]) -> list[str] | None:
    """Return a command with the folders of data and the homes in it; None where one is not there."""
    words: list[str] = []
    for word in shlex.split(command):
        if word in data and not (word == "OUT" or data[word].exists()):
            return None
        if word.startswith("HOMES"):
            words += [word.replace("HOMES", home) for home in homes]
        else:
            words.append(str(data[word]) if word in data else word)
    if words[0] == "avlmaps":
        return [sys.executable, "-m", "avlmaps", *words[1:], "--json"]
    return [sys.executable, str(HERE / Path(words[1]).name), *words[2:]]


def measured(entry: Entry, words: list[str], command: str) -> dict[str, Any] | None:
    """Run a command and return what it printed, when, where and in what time; None where it fails."""
    before_s = processor_s()
    done = subprocess.run(words, stdout=subprocess.PIPE, text=True, check=False)
    if done.returncode:
        print(f"{entry.name} failed ({done.returncode}): {shlex.join(words)}", file=sys.stderr)
        return None
    python = platform.python_version()
    facts: dict[str, Any] = {
        "command": command,
        "date": date.today().isoformat(),
        "processor_s": round(processor_s() - before_s),
        "avlmaps": __version__,
        "machine": f"{os.cpu_count()} cores of a shared {platform.machine()} machine, Python {python}",
    }
    return {**facts, "answer": json.loads(done.stdout)} if entry.is_suite else {**facts, "text": done.stdout}


def processor_s() -> float:
    """Return the processor time of all commands that ended."""
    times = os.times()
    return times.children_user + times.children_system


def run_small(entries: list[Entry], data: dict[str, Path]) -> list[str]:
    """Run each entry on little data; return those that fail, or whose figures are not in what they print."""
    failed: list[str] = []
    with tempfile.TemporaryDirectory() as folder:
        data = {**data, **small_data(data, Path(folder)), "OUT": Path(folder) / "out"}
        for entry in entries:
            words = words_of(SMALL.get(entry.name, entry.command), data, HOMES[:1])
            if words is None:
                print(f"{entry.name}: skipped, its data is not there")
                continue
            begin_s = time.monotonic()
            found = measured(entry, words, entry.command)
            missing = [one.label for one in entry.figures if found is not None and not is_there(one, found)]
            if found is None or missing:
                failed.append(entry.name)
            said = "failed" if found is None else f"not in its answer: {', '.join(missing)}" if missing else "runs"
            print(f"{entry.name}: {said} ({time.monotonic() - begin_s:.0f} s)", flush=True)
    return failed


def small_data(data: dict[str, Path], folder: Path) -> dict[str, Path]:
    """Return links to a part of each folder: 25 frames, three labelled pictures, a clip of each kind and fold."""
    found: dict[str, Path] = {}
    if data["RECORDING"].is_dir():
        stems = sorted(path.name.partition(".")[0] for path in data["RECORDING"].glob("frame-*.pose.txt"))[::4][:25]
        files = [path for path in data["RECORDING"].iterdir() if path.name.partition(".")[0] in stems]
        found["RECORDING"] = _linked(folder / "recording", data["RECORDING"], [*files, *_plain(data["RECORDING"])])
    if data["NYUV2"].is_dir():
        rows = (data["NYUV2"] / "frames.csv").read_text(encoding="utf-8").splitlines()[:4]
        names = {row.partition(",")[0] for row in rows[1:]}
        files = [path for path in data["NYUV2"].iterdir() if path.name.partition(".")[0] in names]
        found["NYUV2"] = _linked(folder / "nyuv2", data["NYUV2"], files)
        (found["NYUV2"] / "frames.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    if (data["SOUNDS"] / "index.csv").is_file():
        with (data["SOUNDS"] / "index.csv").open(newline="", encoding="utf-8") as stream:
            clips = list(csv.DictReader(stream))
        chosen = list({(clip["category"], clip["fold"]): clip for clip in clips}.values())
        files = [data["SOUNDS"] / clip["path"] for clip in chosen]
        found["SOUNDS"] = _linked(folder / "sounds", data["SOUNDS"], files)
        with (found["SOUNDS"] / "index.csv").open("w", newline="", encoding="utf-8") as stream:
            writer = csv.DictWriter(stream, list(chosen[0]))
            writer.writeheader()
            writer.writerows(chosen)
    return found


def _plain(folder: Path) -> list[Path]:
    return [path for path in folder.glob("*.txt") if "pose" not in path.name]


def _linked(place: Path, source: Path, files: list[Path]) -> Path:
    for path in files:
        link = place / path.relative_to(source)
        link.parent.mkdir(parents=True, exist_ok=True)
        link.symlink_to(path.resolve())
    return place


def write(found: dict[str, Any]) -> None:
    """Write the figures, the page and the README's table."""
    write_bytes_atomically(FIGURES, (json.dumps(found, indent=1, ensure_ascii=False) + "\n").encode())
    for path, text in rendered(found).items():
        write_bytes_atomically(path, text.encode())


def rendered(found: dict[str, Any]) -> dict[Path, str]:
    """Return the text of every file that follows from the figures."""
    readme = README.read_text(encoding="utf-8")
    return {
        PAGE: page(found, shipped_checksums()),
        README: with_figures(readme, readme_table(found)),
    }


def arguments() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--sounds", type=Path, default=SHARED / "data" / "sounds", help="folder of clips, index.csv")
    parser.add_argument("--recording", type=Path, default=SHARED / "data" / "redkitchen", help="recording with poses")
    parser.add_argument("--nyuv2", type=Path, default=SHARED / "data" / "nyuv2", help="folder of labelled frames")
    parser.add_argument("--rooms", type=Path, default=SHARED / "data" / "rooms", help="folder of a measured room")
    parser.add_argument("--house", type=Path, default=SHARED / "scenes" / "small_house.glb", help="scene file")
    parser.add_argument("--photos", type=Path, default=SHARED / "data" / "photos", help="folder of photos of elsewhere")
    parser.add_argument("--out", type=Path, default=Path("bench_out"), help="folder of the suites' work")
    parser.add_argument("--only", nargs="+", choices=[entry.name for entry in ENTRIES], help="only these entries")
    parser.add_argument("--stale", action="store_true", help="only entries of other weights, or never measured")
    parser.add_argument("--whole", action="store_true", help="the paper's size: all homes, tasks and missions")
    parser.add_argument("--page", action="store_true", help="measure nothing")
    parser.add_argument("--small", action="store_true", help="run every entry on little data; write nothing")
    parser.add_argument("--check", action="store_true", help="write nothing; exit 1 if page or README differ")
    return parser.parse_args()


def main() -> None:
    """Run, keep, write."""
    asked = arguments()
    found = read_figures() if FIGURES.is_file() else {}
    if asked.check:
        differing = [path.name for path, text in rendered(found).items() if path.read_text(encoding="utf-8") != text]
        sys.exit(f"{', '.join(differing)}: run python benchmarks/report.py --page" if differing else 0)
    data = {"SOUNDS": asked.sounds, "RECORDING": asked.recording, "HOUSE": asked.house, "NYUV2": asked.nyuv2}
    data = {**data, "ROOMS": asked.rooms, "PHOTOS": asked.photos, "OUT": asked.out}
    entries = [entry for entry in ENTRIES if entry.name != "outside" and (not asked.only or entry.name in asked.only)]
    if asked.small:
        failed = run_small(entries, data)
        sys.exit(f"failed: {', '.join(failed)}" if failed else 0)
    for entry in () if asked.page else entries:
        if asked.stale and not stale(entry, found.get(entry.name), shipped_checksums()):
            continue
        command = f"{entry.command} {entry.whole}".rstrip() if asked.whole else entry.command
        words = words_of(command, data, HOMES if asked.whole else HOMES[:FEW])
        if words is None:
            print(f"skipping {entry.name}: its data is not there", file=sys.stderr)
            continue
        print(f"running {entry.name}: {command}", file=sys.stderr)
        answer = measured(entry, words, command)
        if answer is None:
            sys.exit(1)
        found = {**read_figures(), entry.name: answer}  # another command may have ended meanwhile
        write({one.name: found[one.name] for one in ENTRIES if one.name in found})
    write({one.name: found[one.name] for one in ENTRIES if one.name in found})


if __name__ == "__main__":
    main()
