"""One small map for every test of the server, and the server's application without a network."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
from starlette.testclient import TestClient

from avlmaps.serve.app import create_app
from avlmaps.serve.service import Service
from avlmaps.serve.settings import ServeSettings
from helpers.walked_room import shared_walk, walked_map


@pytest.fixture(scope="session")
def walk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The recording of the map."""
    return shared_walk(tmp_path_factory)


@pytest.fixture(scope="session")
def room(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A map of about 3,000 voxels with one sound."""
    return walked_map(tmp_path_factory)


@pytest.fixture(scope="session")
def service(room: Path) -> Iterator[Service]:
    """The service of that map."""
    opened = Service.open({"room": room})
    yield opened
    opened.close()


@pytest.fixture
def serving() -> Iterator[Callable[..., TestClient]]:
    """Serve a service with other settings; return its client."""
    with ExitStack() as stack:

        def start(service: Service, settings: ServeSettings | None = None, **words: Any) -> TestClient:
            from dataclasses import replace

            opened = service if settings is None else replace(service, settings=settings)
            app = create_app(opened, **words)
            return stack.enter_context(TestClient(app, base_url="http://127.0.0.1:8750"))

        yield start


@pytest.fixture(scope="module")
def client(service: Service) -> Iterator[TestClient]:
    """A client of the server of the small map."""
    with TestClient(create_app(service), base_url="http://127.0.0.1:8750") as opened:
        yield opened
