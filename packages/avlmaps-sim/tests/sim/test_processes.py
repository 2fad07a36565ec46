"""A process that works for another does not outlive it."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

SCRIPT = """
import os, sys, time
from pathlib import Path
from avlmaps_sim.processes import end_with_parent, fresh_processes

def work(folder):
    (Path(folder) / str(os.getpid())).touch()
    time.sleep(300)

if __name__ == "__main__":
    with fresh_processes(2, end_with_parent, import_script=True) as pool:
        list(pool.map(work, [sys.argv[1]] * 2))
"""
# As a student writes it: no guard. What the processes do is a module's, and the script stays as it was.
UNGUARDED = """
import math, os
from pathlib import Path
from avlmaps_sim.processes import end_with_parent, fresh_processes

with (Path(__file__).parent / "runs").open("a") as runs:
    runs.write("run ")
name = __file__
with fresh_processes(2, end_with_parent) as pool:
    assert list(pool.map(math.sqrt, [4, 9])) == [2, 3]
assert __file__ == name and __name__ == "__main__"
"""


def _until(condition, patience_s: float = 60.0) -> bool:
    end = time.monotonic() + patience_s
    while not condition() and time.monotonic() < end:
        time.sleep(0.05)
    return condition()


def _lives(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="reads /proc")
def test_workers_end_when_their_parent_is_killed(tmp_path: Path) -> None:
    script, marks = tmp_path / "pool.py", tmp_path / "pids"
    script.write_text(SCRIPT)
    marks.mkdir()
    parent = subprocess.Popen([sys.executable, str(script), str(marks)])
    try:
        assert _until(lambda: len(list(marks.iterdir())) == 2)
        workers = [int(mark.name) for mark in marks.iterdir()]
        assert all(map(_lives, workers))
        parent.send_signal(signal.SIGKILL)
        parent.wait()
        assert _until(lambda: not any(map(_lives, workers)))
    finally:
        parent.kill()
        for mark in marks.iterdir():
            if _lives(int(mark.name)):
                os.kill(int(mark.name), signal.SIGKILL)


@pytest.mark.parametrize("words", [["{}"], ["-m", "student"]], ids=["script", "module"])
def test_a_script_without_a_guard_runs_once(tmp_path: Path, words: list[str]) -> None:
    script = tmp_path / "student.py"
    script.write_text(UNGUARDED)
    command = [sys.executable, *(word.format(script) for word in words)]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "runs").read_text() == "run "
