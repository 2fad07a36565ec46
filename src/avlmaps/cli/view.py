"""`avlmaps view`: look at a map in the browser, ask it, drive in it; or write it all into one file."""

import contextlib
import sys
import threading
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any
from urllib.parse import quote, urlencode

from tyro.conf import Positional, arg

from avlmaps.cli.output import UsageError, emit, size_of
from avlmaps.cli.verb import PORT, Asking, MapVerb
from avlmaps.core.progress import say

if TYPE_CHECKING:
    from collections.abc import Callable
    from socket import socket

    from avlmaps.serve.service import Service
    from avlmaps.serve.settings import ServeSettings

_ANSWER_S = 600.0  # the contents of a large map take their time, and the page waits for them


@dataclass(frozen=True, kw_only=True)
class View(Asking, MapVerb):
    """Show a map in the browser: look, click, ask in words, by photo or by sound, and drive.

    It is a page of `avlmaps serve`, and answers this machine alone. For another --host it makes a token, which is part
    of the address that it prints. Stop it with Ctrl-C. With --out it writes one file instead, which opens without
    avlmaps and without a network.

    Example: avlmaps view home.avlmap

    Example: avlmaps view home.avlmap --scene house:7

    Example: avlmaps view before.avlmap after.avlmap

    Example: avlmaps view home.avlmap --out home.html --questions "the chair near the tv"
    """

    other: Annotated[Positional[Path | None], arg(metavar="[MAP]")] = None
    """Second map of the same place, to compare: side by side, or before and after."""
    host: Annotated[str, arg(metavar="ADDRESS")] = "127.0.0.1"
    """Address to listen on. One that other machines reach makes the page need a token."""
    port: Annotated[int, PORT, arg(metavar="NUMBER")] = 8080
    """Port to listen on; 0 takes a free one."""
    no_browser: bool = False
    """Do not open a browser."""
    scene: Annotated[str | None, arg(metavar="SCENE")] = None
    """Scene in which a simulated robot drives the commands typed in the page, as for `avlmaps go`."""
    out: Annotated[Path | None, arg(metavar="FILE")] = None
    """Write one HTML file, and serve nothing."""
    questions: Annotated[tuple[str, ...], arg(metavar="SENTENCE ...")] = ()
    """Questions whose answers the file holds (--out). Default: some that fit the map."""
    overwrite: bool = False
    """Replace a file that exists (--out)."""

    def run(self) -> None:
        _require_fitting(self)
        if self.out is not None:
            from avlmaps.query.avlmap import AVLMap
            from avlmaps.view.page import write_page

            maps = [AVLMap.open(path, self.query_settings()) for path in (self.map, self.other) if path is not None]
            answer = write_page(self.out, maps, self.questions)
            emit(answer, _lines(answer), self.json)
        else:
            _serve(self)


def _require_fitting(verb: View) -> None:
    if verb.out is None:
        if verb.questions or verb.overwrite:
            raise UsageError("--questions and --overwrite belong to --out FILE; in the browser, type the questions.")
        return
    if verb.scene is not None:
        raise UsageError("--scene belongs to the live page; a file drives no robot.")
    if verb.out.suffix.lower() not in (".html", ".htm"):
        raise UsageError(f"--out takes a file that ends in .html; {verb.out.name!r} does not.")
    if verb.out.exists() and not verb.overwrite:
        raise UsageError(f"{verb.out} exists; give another --out, or replace it with --overwrite.")


def _lines(answer: dict[str, Any]) -> list[str]:
    lines = [f"query: {one['question']}: {'found' if one['found'] else 'not found'}" for one in answer["questions"]]
    counts = zip(answer["voxels"], answer["voxels_of_maps"], strict=True)
    lines += [
        f"note: the file shows {drawn:,} of {all_of_map:,} voxels, one of each small block; answers come from all"
        for drawn, all_of_map in counts
        if drawn < all_of_map
    ]
    return [*lines, f"wrote {answer['page']} ({size_of(answer['bytes'])})"]


def _serve(verb: View) -> None:
    import secrets

    from avlmaps.core.machine import is_loopback
    from avlmaps.navigate.robots import open_robot_scene
    from avlmaps.serve.service import Service, listening_socket
    from avlmaps.serve.settings import Limits, ServeSettings

    token = None if is_loopback(verb.host) else secrets.token_urlsafe(24)
    settings = ServeSettings(
        host=verb.host.strip("[]"), port=verb.port, token=token, query=verb.query_settings(),
        limits=Limits(answer_s=_ANSWER_S),
    )  # fmt: skip
    named = _named(verb)
    with listening_socket(settings) as opened:
        robot = None if verb.scene is None else open_robot_scene(verb.scene).robot
        service = Service.open(named, settings, say, robot, warm=False)
        first = next(iter(named))
        if verb.scene is not None:
            service.shelf.get(first).guide.prepare()  # a scene that is not the map's is an error before a page opens
        url = _address(settings, opened.getsockname()[1], list(named))

        def started() -> None:
            answer = {"url": url, "maps": [str(path) for path in named.values()]}
            emit(answer, [f"the map is at {url}"], verb.json)
            sys.stdout.flush()
            if token is not None:
                say("Other machines put this machine's name in the place of 127.0.0.1; the token stays.")
            say("Stop the viewer with Ctrl-C.")
            if not verb.no_browser:
                open_browser(url)

        run_page(service, opened, started)
        say("The viewer is stopped.")


def run_page(service: "Service", opened: "socket", started: "Callable[[], None]") -> None:
    """Serve maps to browsers until Ctrl-C, and close the service."""
    from avlmaps.serve.app import create_app
    from avlmaps.serve.service import run_http

    try:
        with contextlib.suppress(KeyboardInterrupt):  # where signals do not reach the server's loop: Windows
            run_http(create_app(service, agents=False), service, opened, started)
    finally:
        service.close()


def _named(verb: View) -> dict[str, Path]:
    named: dict[str, Path] = {}
    for path in (verb.map, verb.other):
        if path is not None:
            letters = path.resolve().name.removesuffix(".avlmap")
            name = "".join(c if c.isalnum() or c in "-_. " else "-" for c in letters).strip(" .") or "map"
            named[f"{name}-2" if name in named else name] = path
    return named


def _address(settings: "ServeSettings", port: int, names: list[str]) -> str:
    host = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(settings.host, settings.host)
    words = {} if len(names) < 2 else {"other": names[1]}
    words |= {} if settings.token is None else {"token": settings.token}
    query = f"?{urlencode(words)}" if words else ""
    return f"http://{f'[{host}]' if ':' in host else host}:{port}/maps/{quote(names[0])}/view{query}"


def open_browser(url: str) -> None:
    """Open a page in the browser of this machine, without waiting for it."""
    import webbrowser

    threading.Thread(target=webbrowser.open, args=(url,), daemon=True).start()
