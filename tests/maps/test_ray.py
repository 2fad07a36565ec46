"""Builds on a Ray cluster of two workers: the bits of one process, also where workers die. `make test-cluster`."""

import os
import signal
import socket
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator
from functools import partial
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from build_fakes import SETTINGS, content_of, open_walk, register_fakes, write_beeps

from avlmaps.core.errors import AvlmapsError, BackendError, MapError
from avlmaps.days.merge import build_together
from avlmaps.maps.build import build_map
from avlmaps.maps.cluster import RayPool, cluster_workers
from avlmaps.perception.encoders import encoders_of
from avlmaps.query.avlmap import with_findings

PROFILE = register_fakes()
# It is not imported here: what it may listen on it asks once, when it is.
needs_ray = pytest.mark.skipif(find_spec("ray") is None, reason="Ray is not installed; `make test-cluster` has it")
KILLS = 10


@pytest.fixture(scope="module")
def folder() -> Iterator[Path]:
    memory = Path("/dev/shm")
    with tempfile.TemporaryDirectory(dir=memory if memory.is_dir() else None) as folder:
        yield Path(folder)


@pytest.fixture(scope="module")
def audio(folder: Path) -> Path:
    return write_beeps(folder / "beeps.flac")


@pytest.fixture(scope="module")
def alone(folder: Path, audio: Path) -> dict[str, bytes]:
    build_map(open_walk(audio), folder / "alone", PROFILE, SETTINGS, progress=False, finds=with_findings)
    return content_of(folder / "alone")


@pytest.fixture(scope="module")
def pool() -> Iterator[RayPool]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", os.pathsep.join(filter(None, sys.path)))  # workers import this folder's fakes
        with RayPool(cores=2) as pool:
            yield pool


def build(path: Path, pool: RayPool, audio: Path, slow_s: float = 0.0) -> dict[str, bytes]:
    workers = cluster_workers(pool, partial(open_walk, audio, slow_s=slow_s))
    build_map(open_walk(audio), path, PROFILE, SETTINGS, workers=workers, progress=False, finds=with_findings)
    return content_of(path)


def busy_workers(pool: RayPool) -> list[int]:
    """Return the processes of this cluster that do a job now."""
    found = []
    for process in Path("/proc").iterdir():
        try:
            doing = process.name.isdecimal() and (process / "cmdline").read_bytes().decode("utf-8", "replace")
            if doing and doing.startswith("ray::") and "_job" in doing:
                parent = (process / "stat").read_text().rpartition(")")[2].split()[1]
                if pool.folder in Path(f"/proc/{parent}/cmdline").read_text():
                    found.append(int(process.name))
        except OSError:  # it ended meanwhile
            continue
    return found


@needs_ray
def test_two_workers_make_the_map_of_one_process(
    folder: Path, pool: RayPool, audio: Path, alone: dict[str, bytes]
) -> None:
    assert (pool.cores, pool.machines) == (2, 1)
    assert build(folder / "two", pool, audio) == alone


@needs_ray
def test_whole_recordings_are_jobs_as_well(folder: Path, pool: RayPool, audio: Path, alone: dict[str, bytes]) -> None:
    walks = [partial(open_walk, audio), partial(open_walk, seed=1)]
    with pytest.raises(AvlmapsError):  # two walks that show other colours are not merged
        build_together(walks, folder / "all.avlmap", encoders_of(PROFILE), pool, SETTINGS)
    assert content_of(folder / "all-recordings" / "0001.avlmap") == alone


@needs_ray
@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="finds workers in /proc")
@pytest.mark.timeout(600)
def test_workers_killed_at_random_ten_times_change_no_bit(
    folder: Path, pool: RayPool, audio: Path, alone: dict[str, bytes]
) -> None:
    rng, killed, ended = np.random.default_rng(35), [], threading.Event()

    def kill() -> None:
        while not ended.wait(rng.uniform(0.0, 0.3)):
            busy = busy_workers(pool)
            if busy and len(killed) < KILLS:
                victim = int(rng.choice(busy))
                os.kill(victim, signal.SIGKILL)
                killed.append(victim)

    killer = threading.Thread(target=kill)
    killer.start()
    try:
        builds = 0
        while len(killed) < KILLS or builds == 0:
            builds += 1
            assert build(folder / f"killed-{builds}", pool, audio, slow_s=0.1) == alone
    finally:
        ended.set()
        killer.join()
    assert len(killed) == KILLS


@needs_ray
def test_a_cluster_of_this_machine_listens_on_loopback_alone(pool: RayPool) -> None:
    (node,) = import_module("ray").nodes()
    assert node["NodeManagerAddress"] == "127.0.0.1"
    if not Path("/proc/net/tcp6").exists():
        pytest.skip("finds sockets in /proc")
    own = {link for process in _processes(pool) for link in _sockets(process)}
    heard = [
        line.split()
        for table in ("tcp", "tcp6")
        for line in Path(f"/proc/net/{table}").read_text().splitlines()[1:]
        if line.split()[3] == "0A" and f"socket:[{line.split()[9]}]" in own
    ]
    assert heard
    for line in heard:
        address = line[1].rpartition(":")[0]
        assert address.endswith("0100007F"), f"it listens at {line[1]}"


def _processes(pool: RayPool) -> Iterator[Path]:
    for process in Path("/proc").iterdir():
        try:
            if process.name.isdecimal() and pool.folder in (process / "cmdline").read_text(errors="replace"):
                yield process
        except OSError:
            continue


def _sockets(process: Path) -> Iterator[str]:
    try:
        for file in (process / "fd").iterdir():
            yield str(file.readlink())
    except OSError:
        return


@needs_ray
def test_a_job_whose_code_a_worker_cannot_import_says_so(pool: RayPool) -> None:
    with pytest.raises(MapError, match="install the same avlmaps on all machines"):
        list(pool.run(_imports_nothing, [0]))


def _imports_nothing(_: int) -> None:
    raise ModuleNotFoundError("No module named 'avlmaps.tomorrow'")


# In a process of its own: what Ray was told to connect to, it remembers.
CONNECT = (
    "import sys\n"
    "from avlmaps.core.errors import AvlmapsError\n"
    "from avlmaps.maps.cluster import RayPool\n"
    "try:\n"
    "    with RayPool(sys.argv[1], wait_s=2.0): print('connected')\n"
    "except AvlmapsError as fault: print(fault)\n"
)


def connect(address: str) -> str:
    done = subprocess.run([sys.executable, "-c", CONNECT, address], capture_output=True, text=True, check=True)
    return done.stdout


@needs_ray
def test_an_address_where_nothing_answers_is_one_sentence() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))  # nobody listens
        said = connect(f"127.0.0.1:{taken.getsockname()[1]}")
    assert said.count("\n") == 1 and "No Ray cluster answers at 127.0.0.1:" in said
    assert "start one there, or check the address" in said


@needs_ray
def test_an_address_where_something_else_answers_is_one_sentence() -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        said = connect(f"127.0.0.1:{other.getsockname()[1]}")
    assert said.count("\n") == 1 and "what answers is no Ray cluster" in said


@pytest.mark.parametrize(
    "address", ["somewhere", "10.0.0.1", "10.0.0.1:port", "10.0.0.1:99999", "ray://10.0.0.1:10001"]
)
def test_what_is_no_address_is_refused_before_anything_is_asked(address: str) -> None:
    with pytest.raises(MapError, match="is no address of a Ray cluster; give HOST:PORT"), RayPool(address):
        pass


def test_without_ray_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ray", None)
    with (
        pytest.raises(BackendError, match=r"needs Ray, which is not installed; get it with: pip install .*\[cluster\]"),
        RayPool(),
    ):
        pass
