"""`avlmaps live --serve` and `--view`: the server's page of a map while it grows, and afterwards."""

import sys
import threading
import time
from collections.abc import Callable
from urllib.parse import quote

from avlmaps.cli.view import open_browser, require_port, run_page
from avlmaps.core.progress import say
from avlmaps.live.live_map import LiveMap
from avlmaps.live.replay import end_drive
from avlmaps.serve.service import Service, listening_socket, url_of
from avlmaps.serve.settings import ServeSettings
from avlmaps.serve.shelf import MapSource

_NAME = "live"
_LOOK_S = 0.1


def live_source(live: LiveMap) -> MapSource:
    """Return a live map as the server takes it: its last snapshot; none before the first."""
    return MapSource(live.path, lambda: live.generation or None, lambda: live.map, tells=False)


class LiveFeed:
    """Frames that come into a live map in a thread of their own, to the end of which the map is closed."""

    def __init__(self, live: LiveMap, drive: Callable[[Callable[[], bool]], None]) -> None:
        self._live, self._drive = live, drive
        self._over = threading.Event()
        self._fault: BaseException | None = None
        self._thread = threading.Thread(target=self._run, name="avlmaps-drive", daemon=True)
        self._thread.start()

    @property
    def has_ended(self) -> bool:
        """Whether no frame comes any more."""
        return not self._thread.is_alive()

    def end(self) -> None:
        """Let it end after the frame that it has, wait until the map is closed, and raise what went wrong."""
        self._over.set()
        self._thread.join()
        if self._fault is not None:
            raise self._fault

    def _run(self) -> None:
        try:
            self._drive(self._over.is_set)
            end_drive(self._live)
            say("The drive is over; its map is answered on until Ctrl-C.")
        except BaseException as fault:  # noqa: BLE001 - raised where it is waited for
            self._fault = fault
            if self._live.generation:  # else the command ends with it at once
                say(f"note: The drive ended, and no frame comes any more; stop with Ctrl-C. {fault}")


def serve_while(live: LiveMap, drive: Callable[[Callable[[], bool]], None], port: int, *, browse: bool) -> None:
    """Serve a live map on this machine until Ctrl-C, while a drive gives it frames, and close it.

    Raises:
        ServeError: the port is taken.
    """
    require_port(port)
    settings = ServeSettings(host="127.0.0.1", port=port)
    with listening_socket(settings) as opened:
        running = LiveFeed(live, drive)
        try:
            while not live.generation and not running.has_ended:
                time.sleep(_LOOK_S)
            if not live.generation:  # it ended without a map, or by a fault
                return
            service = Service.open({_NAME: live_source(live)}, settings, say)
            url = f"{url_of(settings, opened)}/maps/{quote(_NAME)}/view"

            def told() -> None:
                say(f"The map is at {url}; the page grows with it. Stop with Ctrl-C.")
                sys.stderr.flush()
                if browse:
                    open_browser(url)

            run_page(service, opened, told)
        finally:
            running.end()
