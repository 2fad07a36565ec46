"""A reader that goes away (`avlmaps ... | head -1`) ends any verb quietly, by a real pipe."""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from avlmaps.cli.verbs import installed

READER_GONE = 141


def ended(*words: object, reads: int = 0, buffered: bool = True) -> tuple[int, bytes]:
    """Run a command whose reader takes some bytes and goes; return its exit status and standard error."""
    reader, writer = os.pipe()
    command = [sys.executable, "-m", "avlmaps", *map(str, words)]
    if not reads:
        os.close(reader)
    surroundings = {**os.environ, "PYTHONUNBUFFERED": "" if buffered else "1"}
    process = subprocess.Popen(
        command, stdout=writer, stderr=subprocess.PIPE, stdin=subprocess.DEVNULL, env=surroundings
    )
    os.close(writer)
    if reads:
        os.read(reader, reads)
        os.close(reader)
    _, said = process.communicate(timeout=200)
    return process.returncode, said


@pytest.mark.nightly
@pytest.mark.parametrize(("words", "status"), [(["bench", "--nothing"], 2), (["info", "nothing.avlmap"], 1)])
@pytest.mark.parametrize("buffered", [True, False])
def test_an_error_keeps_its_status_and_its_sentence(words: list[str], status: int, buffered: bool) -> None:
    got, said = ended(*words, "--json", buffered=buffered)
    assert got == status and said
    assert b"Traceback" not in said and b"BrokenPipe" not in said and b"Exception ignored" not in said


@pytest.mark.parametrize("words", [["profiles"], ["profiles", "--json"]])
def test_answers(words: list[str]) -> None:
    assert ended(*words) == (READER_GONE, b"")


@pytest.mark.nightly
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="the system has no full device")
@pytest.mark.parametrize("words", [["--help"], ["profiles", "--json"], ["info", "nothing.avlmap", "--json"]])
def test_a_full_disk_is_one_sentence(words: list[str]) -> None:
    with Path("/dev/full").open("wb") as full:
        done = subprocess.run([sys.executable, "-m", "avlmaps", *words], stdout=full, stderr=subprocess.PIPE, text=True)
    assert done.returncode == 1
    assert done.stderr.startswith("avlmaps: ") and done.stderr.count("\n") == 1


def test_another_broken_pipe_is_an_error(
    run: Callable[..., tuple[int, str, str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The connection to a robot that breaks is no reader that went away."""

    def break_off(_: object) -> None:
        raise BrokenPipeError(32, "Broken pipe")

    monkeypatch.setattr(installed()[0]["profiles"], "run", break_off)
    status, out, err = run("profiles", "--json")
    assert status == 1 and "Broken pipe" in err
    assert json.loads(out)["error"]["kind"] == "system"
