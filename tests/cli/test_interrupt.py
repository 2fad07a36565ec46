"""Ctrl-C ends in a sentence however early it comes."""

import subprocess
import sys


def run(code: str) -> tuple[int, str]:
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    return done.returncode, done.stderr


def test_while_the_command_line_is_loading() -> None:
    interrupt = (
        "import builtins\nreal = builtins.__import__\n"
        "def load(name, *rest):\n    if name == 'tyro': raise KeyboardInterrupt\n    return real(name, *rest)\n"
        "builtins.__import__ = load\nfrom avlmaps.cli import main\nmain(['--help'])"
    )
    assert run(interrupt) == (130, "avlmaps: stopped\n")
