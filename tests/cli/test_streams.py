"""Standard streams that are closed or of another encoding, too little memory, and a fault in one line of the shell."""

import errno
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from avlmaps.cli.output import fault_sentence, is_short_of_memory, json_line, kind_of
from avlmaps.core.errors import RecordingError

pytestmark = pytest.mark.skipif(os.name == "nt", reason="a POSIX shell closes the streams")


def ran(*words: object, redirect: str = "", **surroundings: str) -> tuple[int, str, str]:
    line = f'exec "$@" {redirect}'
    command = ["bash", "-c", line, "bash", sys.executable, "-m", "avlmaps", *map(str, words)]
    done = subprocess.run(command, capture_output=True, env={**os.environ, **surroundings}, timeout=200)
    return done.returncode, done.stdout.decode("utf-8", "replace"), done.stderr.decode("utf-8", "replace")


def test_an_error_keeps_its_sentence_and_status_with_closed_streams() -> None:
    status, _, said = ran("info", "nothing.avlmap", "--json", redirect=">&-")
    assert status == 1 and said.startswith("avlmaps: ") and "nothing.avlmap is not there" in said
    status, said, _ = ran("info", "nothing.avlmap", "--json", redirect="2>&-")
    assert status == 1 and json.loads(said)["error"]["kind"] == "map"
    assert ran("info", "nothing.avlmap", redirect="<&- >&- 2>&-")[0] == 1


@pytest.mark.nightly
@pytest.mark.parametrize("encoding", ["ascii", "cp1252"])
def test_what_an_encoding_lacks_is_escaped(built: Path, tmp_path: Path, encoding: str) -> None:
    place = tmp_path / "Über ☃ 🪑.avlmap"
    place.symlink_to(built)
    environment = {"PYTHONIOENCODING": encoding, "PYTHONUTF8": "0"}
    status, said, err = ran("info", place, **environment)
    assert status == 0 and r"\u2603" in said and "Traceback" not in err
    status, said, _ = ran("things", place, "--json", **environment)
    assert status == 0 and json.loads(said)["map"] == str(place)
    status, _, err = ran("info", tmp_path / "☃.avlmap", **environment)
    assert status == 1 and r"\u2603.avlmap is not there" in err and "Traceback" not in err


def test_json_reads_the_same_in_every_encoding() -> None:
    answer = {"name": "Küche ☃ 🪑\x1b", "values": [1.5, None, True]}
    for encoding in ("ascii", "latin-1", "utf-8", "utf-16", None):
        line = json_line(answer, encoding)
        assert json.loads(line) == answer and "\x1b" not in line
        line.encode(encoding or "utf-8")


SHORT = [
    MemoryError(),
    OSError(errno.ENOMEM, "Cannot allocate memory"),
    ImportError("libx.so: failed to map segment from shared object"),
    ImportError("libx.so: cannot allocate memory in static TLS block"),
    RuntimeError("can't start new thread"),
    RuntimeError("std::bad_alloc"),
    ValueError("OpenCV: (-4:Insufficient memory) Failed to allocate 4 bytes"),
]


@pytest.mark.parametrize("error", SHORT, ids=repr)
def test_too_little_memory_is_known_whoever_notices(error: Exception) -> None:
    assert is_short_of_memory(error) and kind_of(error) == "memory"
    assert fault_sentence(error).startswith("there is not enough memory for this")
    try:
        try:
            raise error
        except Exception as cause:
            raise RuntimeError("the encoder failed") from cause
    except RuntimeError as wrapped:
        assert is_short_of_memory(wrapped)


def test_other_errors_are_not_about_memory() -> None:
    for error in (ValueError("x"), OSError(errno.ENOENT, "no"), RecordingError("the folder 'out of memory' is no map")):
        assert not is_short_of_memory(error)


def test_a_fault_in_one_line_of_the_shell_ends_only_that_line(
    built: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from io import StringIO

    from avlmaps.cli.shell import answer_lines, piped_lines

    class Session:
        def answer(self, line: str, confirms: Any) -> Any:
            if line == "bad":
                raise ZeroDivisionError("division by zero")
            raise RecordingError("There is nothing.")

    failed, count = answer_lines(Session(), piped_lines(StringIO("bad\nworse\n")), as_json=True)  # pyright: ignore[reportArgumentType]
    said = capsys.readouterr()
    assert (failed, count) == (2, 2)
    assert "ZeroDivisionError: division by zero; this is a fault of avlmaps" in said.err
    assert [json.loads(line)["error"]["kind"] for line in said.out.splitlines()] == ["zero-division", "recording"]
