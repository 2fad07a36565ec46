"""The command line in a process of its own that is forked from one which has imported it: a start costs a third."""

import multiprocessing
import os
import signal
import sys
from collections.abc import Mapping
from multiprocessing.connection import Connection
from typing import Any

# Not the ROS client: the event loop that it makes when it is imported must not be shared.
_IMPORTED = [
    "avlmaps.cli.go", "avlmaps.cli.serve", "avlmaps.language.translator", "avlmaps.navigate.instruct",
    "avlmaps.query.avlmap", "avlmaps.serve.drive.app", "avlmaps.serve.service",
]  # fmt: skip


class Forked:
    """A command line that runs; what tests use of ``subprocess.Popen``, for output of at most 64 kB.

    Args:
        words: the command line after ``avlmaps``.
        env: variables that it has besides those of this process.
    """

    def __init__(self, *words: object, env: Mapping[str, str] | None = None) -> None:
        context = multiprocessing.get_context("forkserver")
        context.set_forkserver_preload(_IMPORTED)
        (out, its_out), (err, its_err) = context.Pipe(duplex=False), context.Pipe(duplex=False)
        arguments: Any = ([str(word) for word in words], {**os.environ, **(env or {})}, its_out, its_err)
        self._process = context.Process(target=_run, args=arguments)
        self._process.start()
        self.stdout, self.stderr = (open(os.dup(end.fileno()), encoding="utf-8") for end in (out, err))  # noqa: PTH123, SIM115
        for end in (out, its_out, err, its_err):
            end.close()

    @property
    def returncode(self) -> int | None:
        """Its exit status, less than zero where a signal ended it; None while it runs."""
        return self._process.exitcode

    def send_signal(self, number: int) -> None:
        """Send it a signal."""
        if self._process.pid is not None and self.returncode is None:
            os.kill(self._process.pid, number)

    def terminate(self) -> None:
        """Send SIGTERM."""
        self.send_signal(signal.SIGTERM)

    def kill(self) -> None:
        """Send SIGKILL."""
        self.send_signal(signal.SIGKILL)

    def wait(self, timeout: float | None = None) -> int:
        """Return its exit status when it ends."""
        self._process.join(timeout)
        assert self.returncode is not None, f"it still runs after {timeout} s"
        return self.returncode

    def communicate(self, timeout: float | None = None) -> tuple[str, str]:
        """Return what it wrote when it ends."""
        self.wait(timeout)
        return self.stdout.read(), self.stderr.read()


def _run(words: list[str], env: dict[str, str], out: Connection, err: Connection) -> None:
    for number, end in ((1, out), (2, err)):
        os.dup2(end.fileno(), number)
        end.close()
    # As an interpreter makes them that starts; the ones before were of a file.
    sys.stdout, sys.stderr = open(1, "w", encoding="utf-8"), open(2, "w", 1, encoding="utf-8")  # noqa: SIM115
    os.environ.update(env)
    # Where a test's own process ignores a signal (a shell in the background, nohup), this one heeds it all the same.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
    from avlmaps.cli import main

    main(words)
