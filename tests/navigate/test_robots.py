"""Real robots are of another package: without it, one sentence says how to get it."""

from importlib.metadata import EntryPoints

import pytest

from avlmaps.core.errors import BackendError
from avlmaps.live import replay as sources
from avlmaps.navigate import robots


@pytest.mark.parametrize(
    "wanted",
    [
        lambda: robots.find_robot("nav2", "native", None),
        lambda: robots.find_robot("move_base", "ws://robot", None),
        lambda: sources.join_source("ros2", {}),
    ],
)
def test_what_is_not_installed_is_named(monkeypatch, wanted):
    for module in (robots, sources):
        monkeypatch.setattr(module, "entry_points", lambda _: EntryPoints())
    with pytest.raises(BackendError, match="avlmaps-ros"):
        wanted()
