"""A file that another program cuts short while it is mapped ends a verb with one sentence, in every thread."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

_READS = """
import sys, threading
import numpy as np
from avlmaps.cli.process import end_at_shortened_files
path, as_json, in_thread = sys.argv[1], sys.argv[2] == "json", sys.argv[3] == "thread"
np.zeros(1 << 20).tofile(path)
end_at_shortened_files(as_json=as_json)
mapped = np.memmap(path, np.float64, "r")
open(path, "r+b").truncate(4096)
if in_thread:
    worker = threading.Thread(target=mapped.sum)
    worker.start()
    worker.join()
mapped.sum()
print("read it all the same")
"""


@pytest.mark.skipif(sys.platform == "win32", reason="files cannot be cut short there while they are mapped")
@pytest.mark.parametrize("where", ["main", "thread"])
@pytest.mark.parametrize("form", ["text", "json"])
def test_a_shortened_file_is_one_sentence(tmp_path: Path, form: str, where: str) -> None:
    command = [sys.executable, "-c", _READS, str(tmp_path / "array.bin"), form, where]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=100, check=False)
    assert ended.returncode == 1
    assert ended.stderr.startswith("avlmaps: a file of the map was cut short")
    assert ended.stderr.count("\n") == 1
    if form == "json":
        assert json.loads(ended.stdout)["error"]["kind"] == "map"
    else:
        assert ended.stdout == ""
