"""A page that is served on a free port of this machine, until the test ends."""

import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import uvicorn

from avlmaps.serve.app import create_app
from avlmaps.serve.service import Service, listening_socket
from avlmaps.serve.settings import ServeSettings


@dataclass(frozen=True, slots=True)
class Served:
    """A page, and where a browser finds it."""

    service: Service
    url: str


def decoded(png: bytes | Path) -> np.ndarray:
    """Return a picture, RGB."""
    content = png.read_bytes() if isinstance(png, Path) else png
    shown = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_COLOR)
    assert shown is not None
    return shown[..., ::-1]


def serving(*maps: Path) -> Iterator[Served]:
    """Serve the page of a map, or of two that are compared."""
    settings = ServeSettings(port=0)
    service = Service.open({f"map{k}": path for k, path in enumerate(maps)}, settings, warm=False)
    with listening_socket(settings) as opened:
        server = uvicorn.Server(uvicorn.Config(create_app(service, agents=False), log_config=None, ws="none"))
        thread = threading.Thread(target=server.run, kwargs={"sockets": [opened]})
        thread.start()
        while not server.started:
            assert thread.is_alive()
            time.sleep(0.01)
        query = "?other=map1" if len(maps) > 1 else ""
        try:
            yield Served(service, f"http://127.0.0.1:{opened.getsockname()[1]}/maps/map0/view{query}")
        finally:
            server.should_exit = True
            thread.join()
            service.close()
