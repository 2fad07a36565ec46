"""A page that is served on a free port of this machine, until the test ends."""

import threading
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np

from avlmaps.view.server import ViewServer
from avlmaps.view.session import ViewSession


def decoded(png: bytes | Path) -> np.ndarray:
    """Return a picture, RGB."""
    content = png.read_bytes() if isinstance(png, Path) else png
    shown = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_COLOR)
    assert shown is not None
    return shown[..., ::-1]


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
