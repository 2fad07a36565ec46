"""The server of maps: HTTP for programs and browsers, the Model Context Protocol for agents.

    from avlmaps.serve.app import create_app
    from avlmaps.serve.service import Service
    from avlmaps.serve.settings import ServeSettings
    from avlmaps.serve.shelf import named_maps

    service = Service.open(named_maps(["home.avlmap"]), ServeSettings())
    app = create_app(service)

``operations`` is the one table of what HTTP offers and agents call; it runs the functions of ``work`` in the threads of
a ``lanes.Lane``. ``guard`` stands before everything: Host, Origin, token, size and time of bodies. A further
application under the same guard: ``create_app(service, mounts={"/drive": app})``.
"""
