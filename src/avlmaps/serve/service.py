"""What every part of the server shares, and running it: uvicorn with a graceful end, the token, faults of starting."""

import asyncio
import contextlib
import errno
import logging
import os
import signal
import socket
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING

from starlette.responses import Response

from avlmaps.core.files import read_regular, user_path
from avlmaps.core.wording import option
from avlmaps.query.schema import ErrorAnswer
from avlmaps.serve.guard import App
from avlmaps.serve.lanes import JSON_TYPE, Lane, RequestError, described, without_folders
from avlmaps.serve.settings import ServeError, ServeSettings
from avlmaps.serve.shelf import MapSource, Shelf
from avlmaps.serve.work import encoded

if TYPE_CHECKING:
    from avlmaps.view.route import MakeRobot


log = logging.getLogger("avlmaps.serve")


@dataclass(frozen=True, slots=True)
class Service:
    """What every part of the server shares."""

    settings: ServeSettings
    shelf: Shelf
    quick: Lane  # of queries in words
    slow: Lane  # of photos, clips, lists and pictures

    @classmethod
    def open(
        cls,
        maps: Mapping[str, Path | MapSource],
        settings: ServeSettings | None = None,
        note: Callable[[str], None] = lambda _: None,
        robot: "MakeRobot | None" = None,
        warm: bool = True,
    ) -> "Service":
        """Open the maps, or raise ``MapError``, and start the lanes; see `Shelf`."""
        settings = settings or ServeSettings()
        limits = settings.limits
        shelf = Shelf(maps, limits, note, settings.query, robot, warm)
        workers = {"quick": limits.quick_workers, "slow": limits.slow_workers}
        lanes = (Lane(name, count, limits.waiting, limits.answer_s) for name, count in workers.items())
        return cls(settings, shelf, *lanes)

    def close(self) -> None:
        """End the lanes after the work that they have."""
        self.quick.close()
        self.slow.close()

    def described(self, error: BaseException) -> tuple[int, ErrorAnswer]:
        """Return the HTTP status and the JSON of an error; what is a fault of ours goes to the log."""
        status, answer = described(error, self._public)
        if status >= 500 and not isinstance(error, RequestError):
            log.error("%s", error, exc_info=error if status == 500 else None)
        return status, answer

    def _public(self, sentence: str) -> str:
        for name, path in self.shelf.paths.items():
            sentence = sentence.replace(str(path), name)
        return without_folders(sentence)


def error_response(service: Service, error: BaseException) -> Response:
    """Return an error as the JSON that the command line prints."""
    status, answer = service.described(error)
    return Response(encoded(answer), status, getattr(error, "headers", {}), JSON_TYPE)


TOKEN_VARIABLE = "AVLMAPS_TOKEN"
_TOKEN_BYTES = 4096


def read_token(path: Path | None) -> str | None:
    """Return the token of a file, else that of the environment, else None."""
    if path is None:
        return os.environ.get(TOKEN_VARIABLE) or None
    try:
        token = read_regular(user_path(path), _TOKEN_BYTES).decode().strip()
    except (OSError, UnicodeDecodeError) as error:
        reason = (error.strerror if isinstance(error, OSError) else None) or "it is no text"
        raise ServeError(f"The token file {path} cannot be read ({reason}); write the token into it as text.") from None
    if not token:
        raise ServeError(f"The token file {path} is empty; write the token into it as text.")
    return token


def listening_socket(settings: ServeSettings) -> socket.socket:
    """Return a socket that listens; ``ServeError`` where the port is taken, or the address is not this machine's."""
    host, port = settings.host, settings.port
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        return socket.create_server((host, port), family=family, dualstack_ipv6=host == "::")
    except OSError as error:
        free = f"{option('port', '0')} for any free one"
        said = {
            errno.EADDRINUSE: f"the port is taken by another program; choose one by {option('port', 'N')}, or {free}",
            errno.EACCES: "it needs more rights",
        }.get(error.errno or 0, f"{error.strerror or error}; check {option('host')}")
        raise ServeError(f"The server cannot listen on port {port} of {host}: {said}.") from None


def url_of(settings: ServeSettings, opened: socket.socket) -> str:
    """Return the address under which clients reach the server."""
    host = f"[{settings.host}]" if ":" in settings.host else settings.host
    return f"{settings.scheme}://{host}:{opened.getsockname()[1]}"


def run_http(
    app: App,
    service: Service,
    opened: socket.socket,
    started: Callable[[], None],
    ending: Callable[[], None] = lambda: None,
) -> None:
    """Serve until SIGTERM or SIGINT; what runs by then is finished, up to a time.

    ``started`` is called when the server answers, ``ending`` at the signal, before what runs is finished.
    """
    import ssl

    import uvicorn

    class Server(uvicorn.Server):
        """Uvicorn that ends with its process still in hand: a signal ends the serving, and no more."""

        @contextlib.contextmanager
        def capture_signals(self) -> Iterator[None]:
            loop = asyncio.get_running_loop()
            for one in (signal.SIGINT, signal.SIGTERM):
                with contextlib.suppress(NotImplementedError, RuntimeError):  # Windows, or a thread of a test
                    loop.add_signal_handler(one, self.handle_exit, one, None)
            yield

        def handle_exit(self, sig: int, frame: FrameType | None) -> None:
            ending()
            super().handle_exit(sig, frame)

        async def startup(self, sockets: list[socket.socket] | None = None) -> None:
            await super().startup(sockets)
            started()

    settings = service.settings
    config = uvicorn.Config(
        app, log_config=None, log_level=logging.WARNING, access_log=False, server_header=False, proxy_headers=False,
        ws="none", lifespan="on", limit_concurrency=settings.limits.connections, timeout_keep_alive=30,
        timeout_graceful_shutdown=round(settings.limits.shutdown_s), ssl_certfile=settings.tls_certificate,
        ssl_keyfile=settings.tls_key,
    )  # fmt: skip
    try:
        config.load()
    except (OSError, ssl.SSLError) as error:
        raise ServeError(
            f"The TLS files cannot be used ({error.strerror or error}); give a PEM certificate and its key."
        ) from None
    asyncio.run(Server(config).serve(sockets=[opened]))
