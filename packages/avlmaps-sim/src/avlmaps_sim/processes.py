"""Processes that work for another one."""

import os
import sys
from collections.abc import Callable, Generator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context, parent_process
from multiprocessing.context import SpawnContext, SpawnProcess
from threading import Thread
from typing import Any


def end_with_parent() -> None:
    """End this process as soon as the one that started it has ended, by ``kill -9`` too: nobody waits for its work."""
    parent = parent_process()
    if parent is None:
        return

    def wait() -> None:
        parent.join()
        os._exit(1)

    Thread(target=wait, daemon=True).start()


def fresh_processes(
    workers: int, begin: Callable[..., None], *arguments: Any, import_script: bool = False
) -> ProcessPoolExecutor:
    """Return processes that are started afresh: compiled kernels and threads do not survive a fork.

    They do not run the script that starts them a second time, so that it needs no ``if __name__ == "__main__":``. Each
    begins with a function of a module; ``import_script`` runs the script again, because the work needs what it defines.
    """
    context = get_context("spawn") if import_script else _WithoutScript()
    return ProcessPoolExecutor(workers, context, begin, arguments)


class _Process(SpawnProcess):
    @staticmethod
    def _Popen(process_obj: Any) -> Any:  # noqa: N802 - multiprocessing's own name
        with _nameless_script():
            return SpawnProcess._Popen(process_obj)  # pyright: ignore[reportAttributeAccessIssue]


class _WithoutScript(SpawnContext):
    Process = _Process


@contextmanager
def _nameless_script() -> Generator[None]:
    script = vars(sys.modules["__main__"])
    hidden = {name: script.pop(name) for name in ("__spec__", "__file__") if name in script}
    script["__spec__"] = None
    try:
        yield
    finally:
        script.update(hidden)
