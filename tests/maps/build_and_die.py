"""Builds small maps on demand in forked children and kills them; started by test_resume.py, told by lines of JSON.

Importing and loading compiled kernels take longer than building, so that they come first, before children are forked.
"""

import json
import os
import signal
import sys
import tempfile
import time
from pathlib import Path

import cv2
from build_fakes import SETTINGS, Walk, register_fakes, write_beeps

from avlmaps.maps.build import build_map

FRAMES = 14
DEADLY = ("fsync", "replace", "unlink", "rmdir", "mkdir")


def build(path: str, seed: int, audio: Path) -> None:
    build_map(
        Walk(FRAMES, seed=seed, bad=(5,), audio=audio), Path(path), "fake", SETTINGS, progress=False, overwrite=True
    )


def count_steps(fatal: int | None) -> list[str]:
    """Log every call that changes the disk, and die just before number ``fatal``."""
    steps: list[str] = []

    def watched(name: str):
        real = getattr(os, name)

        def call(*args, **kwargs):
            if len(steps) == fatal:
                os.kill(os.getpid(), signal.SIGKILL)
            steps.append("manifest" if name == "replace" and Path(args[1]).name == "map.json" else name)
            return real(*args, **kwargs)

        return call

    os.fsync = os.fstat  # a kill leaves to the system what was written: nothing waits for the disk
    for name in DEADLY:
        setattr(os, name, watched(name))
    return steps


def child(order: dict, audio: Path) -> None:
    status = 1
    try:
        steps = count_steps(order.get("step"))
        build(order["path"], order["seed"], audio)
        Path(order["log"]).write_text(json.dumps(steps))
        status = 0
    finally:
        sys.stderr.flush()
        os._exit(status)


def main() -> None:
    register_fakes()
    cv2.setNumThreads(1)
    with tempfile.TemporaryDirectory() as folder:
        audio = write_beeps(Path(folder) / "beeps.flac")
        build(f"{folder}/warm.avlmap", 0, audio)
        obey(audio)


def obey(audio: Path) -> None:
    for line in sys.stdin:
        order = json.loads(line)
        begin = time.perf_counter()
        cv2.setNumThreads(0)  # threads do not survive a fork: a child would wait for the pool for ever
        pid = os.fork()
        if pid == 0:
            child(order, audio)
        if order.get("delay_s") is not None:
            time.sleep(order["delay_s"])
            os.kill(pid, signal.SIGKILL)
        _, status = os.waitpid(pid, 0)
        code = os.waitstatus_to_exitcode(status)
        sys.stdout.write(json.dumps({"code": code, "seconds": time.perf_counter() - begin}) + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
