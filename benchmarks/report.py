"""Run every benchmark into docs/benchmarks.json; write docs/benchmarks.md and the README's table from it.

    python benchmarks/report.py --sounds SOUNDS --recording RECORDING --house HOUSE
    python benchmarks/report.py --only words sounds --sounds SOUNDS
    python benchmarks/report.py --stale          # only what is missing, or was measured with other weights
    python benchmarks/report.py --page           # measure nothing, write the page again
    python benchmarks/report.py --check          # exit 1 unless page and README agree with docs/benchmarks.json

Each result is stored as soon as its command ends; the suites continue from their own work in --out. Commands
whose data is not there are skipped with a note.
"""

import argparse
import json
import os
import platform
import shlex
import subprocess
import sys
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
    FIGURES,
    PAGE,
    README,
    Entry,
    page,
    read_figures,
    readme_table,
    stale,
    with_figures,
)

SHARED = HERE.parents[1] / "shared"


def words_of(entry: Entry, data: dict[str, Path]) -> list[str] | None:
    """Return an entry's command with the folders of data in it; None where one is not there."""
    words: list[str] = []
    for word in shlex.split(entry.command):
        if word in data and not (word == "OUT" or data[word].exists()):
            return None
        words.append(str(data[word]) if word in data else word)
    if words[0] == "avlmaps":
        return [sys.executable, "-m", "avlmaps", *words[1:], "--json"]
    return [sys.executable, str(HERE / Path(words[1]).name), *words[2:]]


def measured(entry: Entry, words: list[str]) -> dict[str, Any]:
    """Run a command and return what it printed, when and where; ends the program where it fails."""
    done = subprocess.run(words, stdout=subprocess.PIPE, text=True, check=False)
    if done.returncode:
        sys.exit(f"{entry.name} failed ({done.returncode}): {shlex.join(words)}")
    python = platform.python_version()
    facts: dict[str, Any] = {
        "command": entry.command,
        "date": date.today().isoformat(),
        "avlmaps": __version__,
        "machine": f"{os.cpu_count()} cores of a shared {platform.machine()} machine, Python {python}",
    }
    return {**facts, "answer": json.loads(done.stdout)} if entry.is_suite else {**facts, "text": done.stdout}


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
    parser.add_argument("--out", type=Path, default=Path("bench_out"), help="folder of the suites' work")
    parser.add_argument("--only", nargs="+", choices=[entry.name for entry in ENTRIES], help="only these entries")
    parser.add_argument("--stale", action="store_true", help="only entries of other weights, or never measured")
    parser.add_argument("--page", action="store_true", help="measure nothing")
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
    data["OUT"] = asked.out
    data["ROOMS"] = asked.rooms
    for entry in () if asked.page else ENTRIES:
        if entry.name == "outside" or (asked.only and entry.name not in asked.only):
            continue
        if asked.stale and not stale(entry, found.get(entry.name), shipped_checksums()):
            continue
        words = words_of(entry, data)
        if words is None:
            print(f"skipping {entry.name}: its data is not there", file=sys.stderr)
            continue
        print(f"running {entry.name}: {entry.command}", file=sys.stderr)
        found[entry.name] = measured(entry, words)
        write({one.name: found[one.name] for one in ENTRIES if one.name in found})
    write({one.name: found[one.name] for one in ENTRIES if one.name in found})


if __name__ == "__main__":
    main()
