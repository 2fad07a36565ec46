"""The server of maps: HTTP for programs and browsers, the Model Context Protocol for agents.

    service = Service.open(named_maps(["home.avlmap"]), ServeSettings())
    app = create_app(service)

``operations`` is the one table of what HTTP offers and agents call; it runs the functions of ``work`` in the threads of
a ``lanes.Lane``. ``guard`` stands before everything: Host, Origin, token, size and time of bodies. A further
application under the same guard: ``create_app(service, mounts={"/drive": app})``.
"""

from typing import TYPE_CHECKING

from avlmaps.serve.settings import Limits, ServeError, ServeSettings

if TYPE_CHECKING:
    from avlmaps.serve.app import create_app
    from avlmaps.serve.service import Service
    from avlmaps.serve.shelf import named_maps

__all__ = ["Limits", "ServeError", "ServeSettings", "Service", "create_app", "named_maps"]


def __getattr__(name: str) -> object:
    import importlib

    homes = {"create_app": "app", "Service": "service", "named_maps": "shelf"}
    if name not in homes:
        raise AttributeError(f"module 'avlmaps.serve' has no attribute {name!r}")
    return getattr(importlib.import_module(f"avlmaps.serve.{homes[name]}"), name)
