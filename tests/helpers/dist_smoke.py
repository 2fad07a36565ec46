"""Build the four distributions and try them in empty environments: ``make dist-test``.

    python tests/helpers/dist_smoke.py FOLDER [PYTHON ...]

Each is built as a wheel, as an sdist, and as a wheel again out of that sdist; both wheels must hold the same files.
Then, for the Python that runs this script and for each further one: ``avlmaps`` alone builds a map of a small
recording, answers, writes a page, serves, and says what to install for the rest; all four, from the sdists, record in
a simulated home and drive there.

The environments hold nothing but wheels. Their dependencies are links into the environment that runs this script, so
that nothing is downloaded; a further Python gets an environment of the locked ones first (kept, and with a network).
"""

import json
import os
import shutil
import subprocess
import sys
import tarfile
import urllib.request
import zipfile
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
SOURCES = {
    "avlmaps": ROOT,
    **{name: ROOT / "packages" / name for name in ("avlmaps-sim", "avlmaps-models", "avlmaps-ros")},
}
_SITE = "import sysconfig; print(sysconfig.get_path('purelib'))"
_WALK = (
    "import sys; from pathlib import Path; from helpers.walked_room import write_walk; write_walk(Path(sys.argv[1]))"
)


def environment(**more: str) -> dict[str, str]:
    """Return the variables of this process without the checkout on Python's path: only installed files count."""
    return {**{name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}, **more}


def run(*words: object, cwd: Path, status: int = 0, **more: str) -> str:
    command = [str(word) for word in words]
    done = subprocess.run(command, cwd=cwd, env=environment(**more), capture_output=True, text=True)
    if done.returncode != status:
        sys.exit(f"{' '.join(command)} ended with {done.returncode}:\n{done.stdout}{done.stderr}")
    return done.stdout


def site_of(python: Path) -> Path:
    return Path(run(python, "-c", _SITE, cwd=python.parent).strip())


def built(kind: str, source: Path, out: Path) -> Path:
    run(sys.executable, "-m", "hatchling", "build", "-t", kind, "-d", out, cwd=source)
    return max(out.iterdir(), key=lambda path: path.stat().st_mtime_ns)


def distribution(name: str, out: Path) -> tuple[Path, Path]:
    """Return the wheel of a distribution, and the one that its sdist gives."""
    sdist = built("sdist", SOURCES[name], out / "sdists")
    with tarfile.open(sdist) as archive:
        archive.extractall(out / "unpacked", filter="data")
    unpacked = out / "unpacked" / sdist.name.removesuffix(".tar.gz")
    wheels = built("wheel", SOURCES[name], out / "wheels"), built("wheel", unpacked, out / "rebuilt")
    held = [sorted(zipfile.ZipFile(wheel).namelist()) for wheel in wheels]
    assert held[0] == held[1], f"the wheel of {sdist.name} differs: {set(held[0]) ^ set(held[1])}"
    assert wheels[0].name == wheels[1].name
    return wheels


def dependencies(python: Path, folder: Path) -> Path:
    """Return a folder of links to all that is installed for a Python, without what comes from this repository."""
    folder.mkdir()
    for one in site_of(python).iterdir():
        if not one.name.startswith(("avlmaps", "_editable_impl_avlmaps", "__pycache__")):
            (folder / one.name).symlink_to(one)
    return folder


def locked(python: Path, out: Path) -> Path:
    """Return the Python of an environment of the locked dependencies; it is kept from run to run."""
    name = run(python, "-c", "import sys; print('%d.%d' % sys.version_info[:2])", cwd=out).strip()
    folder = out.with_name(f"{out.name}-locked-{name}")
    made = folder / "bin" / "python"
    lock = ROOT / "requirements" / "lock.txt"
    done = folder / "lock.txt"
    if not done.exists() or done.read_text() != lock.read_text():
        run(python, "-m", "venv", "--clear", folder, cwd=out)
        run(made, "-m", "pip", "install", "--quiet", "--require-hashes", "-r", lock, cwd=out)
        shutil.copy(lock, done)
    return made


def installed(python: Path, held: Path, folder: Path, wheels: list[Path]) -> Path:
    """Return the Python of an empty environment that holds these wheels."""
    run(python, "-m", "venv", folder, cwd=folder.parent)
    made = folder / "bin" / "python"
    run(made, "-m", "pip", "install", "--quiet", "--no-index", "--no-deps", *wheels, cwd=folder.parent)
    (site_of(made) / "dependencies.pth").write_text(f"{held}\n")
    for wheel in wheels:
        package = wheel.name.partition("-")[0]
        where = run(made, "-c", f"import {package}; print({package}.__file__)", cwd=folder).strip()
        assert Path(where).is_relative_to(folder), f"{where} is not the installed package"
    return made


def answer(python: Path, cwd: Path, *words: object, status: int = 0) -> dict[str, Any]:
    return json.loads(run(python.with_name("avlmaps"), *words, "--json", cwd=cwd, status=status))


def alone(python: Path, cwd: Path) -> None:
    """Try `avlmaps` without the other two."""
    assert run(python.with_name("avlmaps"), "--version", cwd=cwd).startswith("avlmaps ")
    assert {one["name"] for one in answer(python, cwd, "profiles")["profiles"]} >= {"embedded", "colours"}
    run(python, "-c", _WALK, cwd / "rec", cwd=cwd, PYTHONPATH=str(ROOT / "tests"))
    answer(python, cwd, "build", "rec", "--out", "room.avlmap", "--voxel-size-m", "0.1")
    found = answer(python, cwd, "query", "room.avlmap", "a chair")
    assert found["parts"][0]["query"] == "chair"
    answer(python, cwd, "view", "room.avlmap", "--out", "room.html", "--questions", "a chair")
    assert (cwd / "room.html").stat().st_size > 100_000
    served(python, cwd)
    for words, name in (
        (("record", "--scene", "house:7", "--out", "other"), "avlmaps-sim"),
        (("demo",), "avlmaps-sim"),
        (("go", "room.avlmap", "go to the chair", "--scene", "house:7"), "avlmaps-sim"),
        (("import-map", "scene", "--out", "other.avlmap"), "avlmaps-models"),
        (("build", "rec", "--out", "other.avlmap", "--profile", "foundation"), "avlmaps-models"),
    ):
        message = answer(python, cwd, *words, status=1)["error"]["message"]
        assert message.endswith(f"get it with: pip install {name}"), message


def served(python: Path, cwd: Path) -> None:
    """Start the server, ask it, and end it."""
    words = [python.with_name("avlmaps"), "serve", "room.avlmap", "--port", "0", "--json"]
    with subprocess.Popen(words, cwd=cwd, env=environment(), stdout=subprocess.PIPE, text=True) as server:
        assert server.stdout is not None
        try:
            url = json.loads(server.stdout.readline())["url"]
            with urllib.request.urlopen(f"{url}/maps/room/ask?sentence=a%20chair", timeout=120) as told:
                assert json.load(told)["parts"][0]["query"] == "chair"
        finally:
            server.terminate()


def together(python: Path, cwd: Path) -> None:
    """Try all three."""
    listed = {one["name"] for one in answer(python, cwd, "profiles")["profiles"]}
    assert listed >= {"embedded", "foundation", "paper"}
    answer(python, cwd, "record", "--scene", "house:7", "--out", "rec", "--size", "160x120", "--max-frames", "160")
    answer(python, cwd, "build", "rec", "--out", "home.avlmap", "--voxel-size-m", "0.1")
    found = answer(python, cwd, "query", "home.avlmap", "a chair near the sound of a dog")
    assert {part["modality"] for part in found["parts"]} == {"object", "sound"}
    drive = ("go", "home.avlmap", "turn left", "--scene", "house:7")
    assert answer(python, cwd, *drive)["ok"]
    assert answer(python, cwd, "import-map", "nowhere", "--out", "m", status=1)["error"]["kind"] == "map"


def main() -> None:
    out = Path(sys.argv[1]).absolute()
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    made = {name: distribution(name, out) for name in SOURCES}
    for number, given in enumerate([sys.executable, *sys.argv[2:]]):
        python = Path(given) if number == 0 else locked(Path(given), out)
        place = out / f"python-{number}"
        place.mkdir()
        held = dependencies(python, place / "dependencies")
        for name, tried, wheels in (
            ("alone", alone, [made["avlmaps"][0]]),
            ("together", together, [rebuilt for _, rebuilt in made.values()]),
        ):
            cwd = place / name
            cwd.mkdir()
            tried(installed(python, held, place / f"env-{name}", wheels), cwd)
        version = run(python, "-V", cwd=out).strip()
        sys.stdout.write(f"{version}: {', '.join(wheel.name for wheel, _ in made.values())} install and answer\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
