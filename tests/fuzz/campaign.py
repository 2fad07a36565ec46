"""The fuzz campaign: whole inputs are broken in seeded ways, and every one must end in a plausible map or one sentence.

    python tests/fuzz/campaign.py --cases 10000 --out fuzz_out

Case N is the same on every run. Each runs in a process of its own with bounded memory, processor time and patience; the
verbs are those of the command line. ``fuzz_out/cases.jsonl`` has a line for each case; a stopped campaign goes on from
there. What is neither exit 0 with a plausible map nor exit 1 with one sentence is a finding. The cases of ``--wrong``
are well-formed, with the mistakes of ``avlmaps bench recordings``: there a map that is wrong without a word is one.
"""

import argparse
import io
import json
import os
import resource
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout, suppress
from functools import partial
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

from mutators import MUTATORS, copied
from seeds import PROFILE, write_seeds

MEMORY_BYTES = 1 << 30  # beyond what the process has before the case
PROCESSOR_S = 20
PATIENCE_S = 120
_LONGEST_SENTENCE = 900


def seeds_in(folder: Path) -> dict[str, Path]:
    """Write the seeds, and build one here: the children then need not load the same modules and kernels again."""
    seeds = write_seeds(folder)
    with redirect_stderr(io.StringIO()), redirect_stdout(io.StringIO()):
        assert build(seeds["folder"], folder / "first.avlmap") == 0
    return seeds


def broken(number: int, seeds: dict[str, Path], folder: Path) -> tuple[str, str, Path]:
    """Make a case; return the seed's name, what was done to it, and where it lies."""
    rng = np.random.default_rng([2026, number])
    name = list(seeds)[number % len(seeds)]
    case = copied(seeds[name], folder)
    done = []
    for _ in range(1 if rng.random() < 0.8 else 2):
        mutator = MUTATORS[int(rng.integers(len(MUTATORS)))]
        try:
            done.append(mutator(rng, case))
        except (OSError, ValueError, IndexError, KeyError, TypeError, RecursionError):  # broken beyond that before
            done.append(f"({mutator.__name__} cannot)")
    return name, ", ".join(done), case


def run_case(number: int, seeds: dict[str, Path], scratch: Path) -> dict[str, object]:
    """Run one case in a child process; return its line for the report."""
    with tempfile.TemporaryDirectory(dir=scratch) as folder:
        name, done, case = broken(number, seeds, Path(folder))
        begin = time.perf_counter()
        out = Path(folder) / "out.avlmap"
        status, text = in_child(lambda: look_into_map(case) if name == "map" else build(case, out))
        seconds = round(time.perf_counter() - begin, 3)
        text = text.replace(folder, "CASE")
    verdict = verdict_of(status, text)
    return {
        "case": number,
        "seed": name,
        "done": done,
        "verdict": verdict,
        "status": status,
        "s": seconds,
        "text": text,
    }


def verdict_of(status: int, text: str) -> str:
    if status == 0:
        return "map"
    lines = [line for line in text.splitlines() if line.startswith("avlmaps: ")]
    if status == 1 and len(lines) == 1 and "Traceback" not in text and len(lines[0]) < _LONGEST_SENTENCE:
        return "sentence"
    return "finding"


def in_child(work: Callable[[], int]) -> tuple[int, str]:
    """Do work in a child with bounds; return its exit status and what it said or the traceback."""
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(read)
        _child(work, write)
    os.close(write)
    alarm = time.monotonic() + PATIENCE_S
    os.set_blocking(read, False)
    text = b""
    while True:
        with suppress(BlockingIOError):
            text += os.read(read, 1 << 16)
        ended, status = os.waitpid(child, os.WNOHANG)
        if ended:
            break
        if time.monotonic() > alarm:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
            os.close(read)
            return -99, "hangs"
        time.sleep(0.002)
    with suppress(BlockingIOError):
        while piece := os.read(read, 1 << 16):
            text += piece
    os.close(read)
    return os.waitstatus_to_exitcode(status), text.decode("utf-8", "replace")


def _child(work: Callable[[], int], write: int) -> None:
    """Do the work; never returns."""
    status, text = 70, ""
    try:
        used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (used + MEMORY_BYTES, used + MEMORY_BYTES))
        resource.setrlimit(resource.RLIMIT_CPU, (PROCESSOR_S, PROCESSOR_S + 1))
        said = io.StringIO()
        with redirect_stderr(said), redirect_stdout(io.StringIO()):
            status = work()
        text = said.getvalue()
    except BaseException:  # noqa: BLE001 - a traceback is what is being looked for
        text = traceback.format_exc()
    os.write(write, text[-20_000:].encode("utf-8", "replace"))
    os._exit(status)


EVERY_REASON = ("geometry", "colour", "depth", "intrinsics", "motion")


def build(case: Path, out: Path, allow: tuple[str, ...] = EVERY_REASON) -> int:
    """Build a map as ``avlmaps build`` does, and look whether it is plausible."""
    from avlmaps.cli.build import Build
    from avlmaps.cli.main import _run

    # The seeds that are broken are no walk through one room, so that every reason is allowed of them.
    given = Build(recording=case, out=out, profile=PROFILE, feature_cache="off", max_bad_share=0.5, allow=allow)  # type: ignore
    status = _run(given)
    return status or look_into_map(out)


def look_into_map(path: Path) -> int:
    """Open a map as ``avlmaps info`` does, read all of it, and raise where it cannot be that of a small room."""
    from avlmaps.cli.info import Info
    from avlmaps.cli.main import _run

    if status := _run(Info(path=path, json=True)):
        return status
    from avlmaps.maps.store.folder import read
    from avlmaps.query.plots import TopDown
    from avlmaps.query.voxel_space import Space

    stored = read(path)
    raster = TopDown.of(Space(stored.grid, stored.voxels.index, stored.up_in_world, stored))
    assert raster.rgb.nbytes < 100_000_000
    assert np.isfinite(stored.keyframes.world_from_camera).all() and np.isfinite(stored.voxels.feature).all()
    assert 0 < len(stored.voxels) < 100_000
    return 0


def report(lines: list[dict[str, object]]) -> str:
    """Return the counts by verdict and format, and every finding."""
    counts = Counter((str(line["seed"]), str(line["verdict"])) for line in lines)
    verdicts = ("map", "told", "sentence", "finding")
    rows = [f"{'format':16}" + "".join(f"{verdict:>10}" for verdict in verdicts)]
    rows += [f"{s:16}" + "".join(f"{counts[s, v]:10}" for v in verdicts) for s in sorted({s for s, _ in counts})]
    rows.append(f"{'all':16}" + "".join(f"{sum(n for (_, w), n in counts.items() if w == v):10}" for v in verdicts))
    found = [line for line in lines if line["verdict"] == "finding"]
    rows += [f"case {f['case']} ({f['seed']}: {f['done']}): {str(f['text']).strip()[-300:]}" for f in found]
    return "\n".join(rows)


def main() -> None:
    """Run the campaign."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--cases", type=int, default=10_000)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--wrong", type=int, default=1_000, help="cases that are well-formed and wrong")
    parser.add_argument("--out", type=Path, default=Path("fuzz_out"))
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    log = given.out / "cases.jsonl"
    lines = [json.loads(line) for line in log.read_text().splitlines()] if log.is_file() else []
    had = {line["case"] for line in lines}
    with tempfile.TemporaryDirectory() as scratch, log.open("a") as stream:
        from mistakes import run_mistake  # it needs this module

        here = Path(scratch)
        seeds = seeds_in(here / "seeds")
        cases: list[tuple[int | str, Callable[[], dict[str, object]]]] = [
            *((n, partial(run_case, n, seeds, here)) for n in range(given.first, given.first + given.cases)),
            *((f"wrong {n}", partial(run_mistake, n, here)) for n in range(given.wrong)),
        ]
        for case, run in cases:
            if case in had:
                continue
            lines.append(run())
            stream.write(json.dumps(lines[-1]) + "\n")
            stream.flush()
            if lines[-1]["verdict"] == "finding":
                sys.stderr.write(f"finding: case {case}\n")
    (given.out / "report.txt").write_text(report(lines) + "\n")
    sys.stdout.write(report(lines) + "\n")
    sys.exit(any(line["verdict"] == "finding" for line in lines))


if __name__ == "__main__":
    main()
