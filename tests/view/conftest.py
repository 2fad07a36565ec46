"""The small map of the command line's tests, open on a page that is served."""

import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from avlmaps.query.avlmap import AVLMap
from avlmaps.view.server import ViewServer
from avlmaps.view.session import ViewSession
from cli.conftest import built, walk  # noqa: F401 - fixtures


@pytest.fixture(scope="session")
def room(built: Path) -> AVLMap:  # noqa: F811
    return AVLMap.open(built)


@pytest.fixture(scope="module")
def served(room: AVLMap) -> Iterator[ViewServer]:
    """A page of the map on a free port of this machine."""
    yield from serving(ViewSession([room]))


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
