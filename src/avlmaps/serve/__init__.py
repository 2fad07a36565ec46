"""The server of maps: HTTP for programs, the Model Context Protocol for agents (extra ``serve``).

    service = Service.open(named_maps(["home.avlmap"]), ServeSettings())
    app = create_app(service)

``operations`` lists what HTTP offers and ``tools`` what agents call; both run the functions of ``work`` in the threads
of a ``lanes.Lane``. ``guard`` stands before everything: Host, Origin, token, size and time of bodies.

**A further application under the same guard** (such as one that drives a robot) is any ASGI application, by its path:

    app = create_app(service, mounts={"/drive": drive_app(service)}, lifespans=[driver_is_connected])

It needs no checks of its own: a request reaches it only through the guard. It runs blocking work with
``await service.slow.run(lambda watch: ...)`` (bounded queue, time limit, ``watch.step`` for progress), or in a lane of
its own, ``Lane("drive", workers=1, waiting=0, answer_s=600.0)``. It turns errors into the server's JSON with
``responses.error_response(service, error)``; ``RequestError(sentence, status, kind)`` is an error of its own. Maps come
from ``service.shelf.get(name)``: take one at the beginning of a piece of work and keep it to the end. Further tools
for agents are ``AgentTool`` values: ``create_app(service, tools=(*TOOLS, drive_tool))``, and likewise ``serve_stdio``;
those that move something say ``read_only=False``.
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
