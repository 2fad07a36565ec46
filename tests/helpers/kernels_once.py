"""Each compiled loop is compiled by one worker of a test run, and the others load it from the cache on disk."""

from pathlib import Path
from typing import Any

from helpers.made_once import locked


def compile_each_kernel_once() -> None:
    """Let a worker wait while another one compiles the same kernel; on a clean clone all would compile all of them."""
    from numba.core.compiler_lock import global_compiler_lock
    from numba.core.dispatcher import Dispatcher

    compile_here, held = Dispatcher.compile, set[Path]()

    def compile_once(self: Any, sig: Any) -> Any:
        folder = self._cache.cache_path
        lock = Path(folder or ".", f"{self.py_func.__module__}.{self.py_func.__qualname__}.lock")
        if folder is None or lock in held:  # it is not cached, or calls itself
            return compile_here(self, sig)
        lock.parent.mkdir(parents=True, exist_ok=True)
        # Numba's own lock comes first, so that two threads of a worker cannot wait for each other.
        with global_compiler_lock, locked(lock):
            held.add(lock)
            try:
                return compile_here(self, sig)
            finally:
                held.remove(lock)

    Dispatcher.compile = compile_once
