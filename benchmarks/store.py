"""Writing and opening a large map: seconds, and memory in use.

    python benchmarks/store.py [--map home.avlmap] [--voxels 1000000] [--folder /tmp] [--json]

The map is tiled to the size (``tiled.py``). Opening is measured in processes of their own, with the files in the
system's cache and (where the system allows it) without.
"""

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import timing
from scale import make_home
from tiled import write_tiled

OPEN = """
import json, resource, sys, time
from pathlib import Path
from avlmaps.maps.store.folder import damaged_files, read
before = time.perf_counter()
stored = read(sys.argv[1])
if sys.argv[2] == "verify":
    damaged_files(Path(sys.argv[1]))
opened = time.perf_counter()
rows = stored.voxels.feature[:: max(1, len(stored.voxels) // 5000)].astype("f4").sum()
print(json.dumps({"open_s": opened - before, "rows_s": time.perf_counter() - opened,
                  "peak_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024}))
"""


def forget_cache(path: Path) -> bool:
    """Ask the system to drop the files from its cache."""
    if not hasattr(os, "posix_fadvise"):
        return False
    for file in filter(Path.is_file, path.rglob("*")):
        descriptor = os.open(file, os.O_RDONLY)
        os.posix_fadvise(descriptor, 0, 0, os.POSIX_FADV_DONTNEED)
        os.close(descriptor)
    return True


def opened(path: Path, mode: str = "") -> dict[str, float]:
    """Open the map in a process of its own; return seconds and the peak of its memory."""
    command = [sys.executable, "-c", OPEN, str(path), mode]
    return json.loads(subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True).stdout)


def main() -> None:
    """Measure and print a table, or one JSON object."""
    parser = timing.parser((__doc__ or "").splitlines()[0])
    parser.add_argument("--map", type=Path, help="without one, a home is recorded and mapped")
    parser.add_argument("--voxels", type=int, default=1_000_000)
    parser.add_argument("--folder", type=Path, default=None)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(dir=options.folder) as folder:
        path = Path(folder) / "large.avlmap"
        home = options.map or make_home(Path(folder))[0]
        begin = time.perf_counter()
        write_tiled(home, path, options.voxels)
        rows: list[dict[str, Any]] = [
            {
                "what": "tile and write, with fsync and sha256",
                "seconds": time.perf_counter() - begin,
                "peak_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
            }
        ]
        cold = opened(path) if forget_cache(path) else None
        for what, found in (
            ("open, not in the file cache", cold),
            ("open, in the file cache", opened(path)),
            ("open and check every file", opened(path, "verify")),
        ):
            if found is not None:
                rows.append({"what": what, "seconds": found["open_s"], "peak_mb": found["peak_mb"]})
                rows.append({"what": f"{what}, then read 5,000 features", "seconds": found["rows_s"], "peak_mb": ""})
        size_gb = sum(file.stat().st_size for file in filter(Path.is_file, path.rglob("*"))) / 1e9
    timing.show(f"A map of {options.voxels:,} voxels, {size_gb:.2f} GB", rows, {}, options.json)


if __name__ == "__main__":
    main()
