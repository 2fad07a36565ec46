"""Install the built wheel, and one built from the sdist, in empty environments and try them: ``make dist-test``.

    python tests/helpers/dist_smoke.py FOLDER

The environments hold nothing but the package. Its dependencies come, by a path file, from the environment that runs
this script, so that nothing is downloaded; that environment's own editable install of the package is not reached.
"""

import json
import os
import shutil
import subprocess
import sys
import sysconfig
import tarfile
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]


def run(*words: object, cwd: Path) -> str:
    # The folder of the checkout is not on the path: only installed files count.
    clean = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    done = subprocess.run([str(word) for word in words], cwd=cwd, env=clean, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, words))} ended with {done.returncode}:\n{done.stdout}{done.stderr}")
    return done.stdout


def built(kind: str, source: Path, out: Path) -> Path:
    run(sys.executable, "-m", "hatchling", "build", "-t", kind, "-d", out, cwd=source)
    return max(out.iterdir(), key=lambda path: path.stat().st_mtime_ns)


def installed(wheel: Path, folder: Path) -> Path:
    """Return the python of an empty environment that holds a wheel."""
    run(sys.executable, "-m", "venv", folder, cwd=folder.parent)
    python = folder / "bin" / "python"
    run(python, "-m", "pip", "install", "--quiet", "--no-index", "--no-deps", wheel, cwd=folder.parent)
    site = Path(run(python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))", cwd=folder.parent).strip())
    (site / "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n")
    return python


def answer(python: Path, cwd: Path, *words: object) -> dict[str, Any]:
    return json.loads(run(python.with_name("avlmaps"), *words, "--json", cwd=cwd))


def main() -> None:
    out = Path(sys.argv[1]).absolute()
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    sdist = built("sdist", ROOT, out / "sdist")
    with tarfile.open(sdist) as archive:
        archive.extractall(out / "unpacked", filter="data")
    wheels = built("wheel", ROOT, out / "wheel"), built("wheel", next((out / "unpacked").iterdir()), out / "rebuilt")
    pythons = [installed(wheel, out / f"env-{number}") for number, wheel in enumerate(wheels)]
    for python in pythons:
        where = run(python, "-c", "import avlmaps; print(avlmaps.__file__)", cwd=out).strip()
        assert Path(where).is_relative_to(python.parents[1]), f"{where} is not the installed package"
        assert run(python.with_name("avlmaps"), "--version", cwd=out).startswith("avlmaps ")
        assert answer(python, out, "profiles")["profiles"]
    files = [sorted(path.relative_to(p.parents[1]).as_posix() for path in p.parents[1].rglob("avlmaps/**/*")
                    if path.is_file() and "__pycache__" not in path.parts) for p in pythons]  # fmt: skip
    assert files[0] == files[1], f"the sdist's wheel differs: {set(files[0]) ^ set(files[1])}"
    python = pythons[0]
    answer(python, out, "record", "--scene", "house:1", "--out", "rec", "--size", "160x120", "--max-frames", "12")
    answer(python, out, "build", "rec", "--out", "home.avlmap", "--voxel-size-m", "0.1")
    found = answer(python, out, "query", "home.avlmap", "a chair near the sound of a dog")
    assert {part["modality"] for part in found["parts"]} == {"object", "sound"}
    sys.stdout.write(f"{wheels[0].name} and {sdist.name} install and answer\n")


if __name__ == "__main__":
    main()
