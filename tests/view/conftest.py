"""The small map of the command line's tests, open on a page that is served."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from avlmaps.query.avlmap import AVLMap
from cli.conftest import built, walk  # noqa: F401 - fixtures
from helpers.viewing import Served, serving


@pytest.fixture(scope="session")
def room(built: Path) -> AVLMap:  # noqa: F811
    return AVLMap.open(built)


@pytest.fixture(scope="module")
def served(built: Path) -> Iterator[Served]:  # noqa: F811
    """A page of the map on a free port of this machine."""
    yield from serving(built)
