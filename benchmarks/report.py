"""Run every benchmark and every bench suite, and write docs/benchmarks.md.

    python benchmarks/report.py --out docs/benchmarks.md [--sounds DIR] [--recording DIR] [--only speed|quality]

What is not given (no folder of sounds, no recording) is left out, and the page says so.
"""

import argparse
import os
import platform
import subprocess
import sys
from collections.abc import Iterator
from datetime import date
from pathlib import Path

HERE = Path(__file__).resolve().parent
SHARED = HERE.parents[1] / "shared" / "data"
SPEED = {
    "Fusion": "fusion.py",
    "Memory of fusion": "fusion_memory.py",
    "Queries": "queries.py",
    "Locating a photo": "locate.py",
    "Keeping a map": "store.py",
    "Drawing views": "render.py",
    "Looking with the embedded encoders": "embedded.py",
}
SUITES = {
    "words": "Words",
    "sounds": "Sounds",
    "segmentation": "Finding sounds in a track",
    "locate": "Where a photo was taken",
    "objects": "Things by their names",
    "indexing": "Things by sounds, photos and areas: the paper's Tables III to V",
}
INTRODUCTION = """# Benchmarks

Made by `make bench` on {machine}, Python {python}, {when}.

Speed is told as a ratio against another way of doing the same in the same run, because machines differ and are busy;
quality is told with counts and 95 % intervals, on data that nothing was trained on or chosen by. `avlmaps bench SUITE`
makes any of the quality tables again.
"""


def speed() -> Iterator[str]:
    """Run the scripts beside this one."""
    for title, script in SPEED.items():
        print(f"running {script}", file=sys.stderr)
        done = subprocess.run([sys.executable, HERE / script], capture_output=True, text=True)
        if done.returncode:
            sys.exit(f"{script} failed:\n{done.stderr}")
        yield f"## {title}\n\n```\n{done.stdout.rstrip()}\n```\n"


def quality(sounds: Path, recording: Path, folder: Path) -> Iterator[str]:
    """Run the suites of `avlmaps bench`."""
    from avlmaps.bench.suites import Asked, markdown, run_suite

    for suite, title in SUITES.items():
        needs = {"sounds": sounds, "segmentation": sounds, "locate": recording}.get(suite)
        if needs is not None and not needs.is_dir():
            yield f"## {title}\n\nNot measured: there is no {needs.name} folder.\n"
            continue
        print(f"running suite {suite}", file=sys.stderr)
        scenes = (recording,) if suite == "locate" else ()
        answer = run_suite(suite, Asked(sounds=sounds if needs == sounds else None, scenes=scenes), folder)
        yield f"## {title}\n\n{markdown(answer['tables'])}"


def main() -> None:
    """Read the arguments, run, write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("docs/benchmarks.md"))
    parser.add_argument("--sounds", type=Path, default=SHARED / "sounds")
    parser.add_argument("--recording", type=Path, default=SHARED / "redkitchen")
    parser.add_argument("--only", choices=("speed", "quality"), default=None)
    asked = parser.parse_args()
    machine = f"{os.cpu_count()} cores of a shared {platform.machine()} machine without a GPU"
    page = [INTRODUCTION.format(machine=machine, python=platform.python_version(), when=date.today().isoformat())]
    if asked.only != "quality":
        page += speed()
    if asked.only != "speed":
        page += quality(asked.sounds, asked.recording, Path("bench_out"))
    asked.out.write_text("\n".join(page), encoding="utf-8")


if __name__ == "__main__":
    main()
