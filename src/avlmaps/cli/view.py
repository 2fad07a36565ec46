"""`avlmaps view`: look at a map in the browser, ask it, drive in it; or write it all into one file."""

import signal
import sys
import threading
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from tyro.conf import Positional, arg

from avlmaps.cli.output import UsageError, emit, size_of
from avlmaps.cli.verb import ModelVerb
from avlmaps.core.progress import say

if TYPE_CHECKING:
    from types import FrameType

    from avlmaps.query.avlmap import AVLMap
    from avlmaps.view.route import MakeRobot


@dataclass(frozen=True, kw_only=True)
class View(ModelVerb):
    """Show a map in the browser: look, click, ask in words, by photo or by sound, and drive.

    The viewer answers this machine alone. For another --host it makes a token, which is part of the address that it
    prints. Stop it with Ctrl-C. With --out it writes one file instead, which opens without avlmaps and without a
    network.

    Examples:
    avlmaps view home.avlmap
    avlmaps view home.avlmap --scene house:7
    avlmaps view before.avlmap after.avlmap
    avlmaps view home.avlmap --out home.html --questions "the sofa" "the chair near the tv"
    """

    compiles: ClassVar[bool] = True

    map: Annotated[Positional[Path], arg(metavar="MAP")]
    """Map folder (NAME.avlmap)."""
    other: Annotated[Positional[Path | None], arg(metavar="[MAP]")] = None
    """Second map of the same place, to compare: side by side, or before and after."""
    host: Annotated[str, arg(metavar="ADDRESS")] = "127.0.0.1"
    """Address to listen on. One that other machines reach makes the page need a token."""
    port: Annotated[int, arg(metavar="NUMBER")] = 8080
    """Port to listen on; 0 takes a free one."""
    no_browser: bool = False
    """Do not open a browser."""
    scene: Annotated[str | None, arg(metavar="SCENE")] = None
    """Scene in which a simulated robot drives the commands typed in the page, as for `avlmaps go`."""
    found_at: Annotated[float, arg(metavar="PROBABILITY")] = 0.5
    """Call a query found from this probability of its first goal on, 0 to 1."""
    out: Annotated[Path | None, arg(metavar="FILE")] = None
    """Write one HTML file, and serve nothing."""
    questions: Annotated[tuple[str, ...], arg(metavar="SENTENCE ...")] = ()
    """Questions whose answers the file holds (--out). Default: some that fit the map."""
    overwrite: bool = False
    """Replace a file that exists (--out)."""

    def run(self) -> None:
        """Serve the page until it is stopped, or write it."""
        _require_fitting(self)
        if self.out is not None:
            answer = _written(self, self.out)
            emit(answer, _lines(answer), self.json)
        else:
            _serve(self)


def _require_fitting(verb: View) -> None:
    if verb.out is None:
        if verb.questions or verb.overwrite:
            raise UsageError("--questions and --overwrite belong to --out FILE; in the browser, type the questions.")
        if not 0 <= verb.port <= 65535:
            raise UsageError(f"--port is {verb.port}; it must lie between 0 and 65535.")
        return
    if verb.scene is not None:
        raise UsageError("--scene belongs to the live page; a file drives no robot.")
    if verb.out.suffix.lower() not in (".html", ".htm"):
        raise UsageError(f"--out takes a file that ends in .html; {verb.out.name!r} does not.")
    if verb.out.exists() and not verb.overwrite:
        raise UsageError(f"{verb.out} exists; give another --out, or replace it with --overwrite.")


def _maps(verb: View) -> "list[AVLMap]":
    from avlmaps.query.avlmap import AVLMap, QuerySettings

    settings = QuerySettings(found_at=verb.found_at)
    return [AVLMap.open(path, settings) for path in (verb.map, verb.other) if path is not None]


def _written(verb: View, out: Path) -> dict[str, Any]:
    from avlmaps.view.page import write_page

    return write_page(out, _maps(verb), verb.questions)


def _lines(answer: dict[str, Any]) -> list[str]:
    lines = [f"query: {one['question']}: {'found' if one['found'] else 'not found'}" for one in answer["questions"]]
    counts = zip(answer["voxels"], answer["voxels_of_maps"], strict=True)
    lines += [
        f"note: the file shows {drawn:,} of {all_of_map:,} voxels, one of each small block; answers come from all"
        for drawn, all_of_map in counts
        if drawn < all_of_map
    ]
    return [*lines, f"wrote {answer['page']} ({size_of(answer['bytes'])})"]


def _robot(scene: str) -> "MakeRobot":
    from avlmaps.navigate.scenes import open_robot_scene

    opened = open_robot_scene(scene)
    return lambda avlmap: opened.robot(avlmap).driver


def _serve(verb: View) -> None:
    from avlmaps.view.server import ViewServer
    from avlmaps.view.session import ViewSession

    session = ViewSession(_maps(verb), None if verb.scene is None else _robot(verb.scene))
    server = ViewServer(session, verb.host, verb.port)
    try:
        # SIGINT too: a shell that starts a command in the background has it ignored.
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, _stop)
        if verb.scene is not None:
            session.guide.prepare()  # a scene that is not the map's is an error before a page opens
        session.prepare()
        answer = {"url": server.url, "maps": [str(path) for path in (verb.map, verb.other) if path is not None]}
        emit(answer, [f"the map is at {server.url}"], verb.json)
        sys.stdout.flush()
        if server.token is not None:
            say("Other machines put this machine's name in the place of 127.0.0.1; the token stays.")
        say("Stop the viewer with Ctrl-C.")
        if not verb.no_browser:
            _open_browser(server.url)
        server.serve_forever(poll_interval=0.2)
    except KeyboardInterrupt:
        say("The viewer is stopped.")
    finally:
        server.server_close()
        session.close()


def _stop(number: int, frame: "FrameType | None") -> None:
    raise KeyboardInterrupt


def _open_browser(url: str) -> None:
    import webbrowser

    threading.Thread(target=webbrowser.open, args=(url,), daemon=True).start()
