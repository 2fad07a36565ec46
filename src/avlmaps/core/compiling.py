"""The notice that the first run on a machine compiles its loops, which takes up to a minute; later runs load them."""

from collections.abc import Callable, Generator
from contextlib import AbstractContextManager, contextmanager

from avlmaps.core.progress import say

NOTICE = "compiling once (up to a minute or two; later runs skip this)"


@contextmanager
def announce_compiling() -> Generator[None]:
    """Print one line on standard error when a loop is not in the cache and is compiled, in this process or a fork."""
    from numba.core import event

    class Listener(event.Listener):
        announced = False

        def on_start(self, event: object) -> None:
            if not self.announced:
                type(self).announced = True
                say(NOTICE)

        def on_end(self, event: object) -> None:
            pass

    install: Callable[..., AbstractContextManager[None]] = event.install_listener  # pyright: ignore[reportUnknownMemberType, reportUnknownVariableType]
    with install("numba:compile", Listener()):
        yield
