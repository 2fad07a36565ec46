"""A page that is served on a free port of this machine, until the test ends."""

import threading
from collections.abc import Iterator

from avlmaps.view.server import ViewServer
from avlmaps.view.session import ViewSession


def serving(session: ViewSession, host: str = "127.0.0.1") -> Iterator[ViewServer]:
    server = ViewServer(session, host, 0)
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True)
    thread.start()
    try:
        yield server
    finally:
        server.shutdown()
        server.server_close()
        session.close()
        thread.join()
