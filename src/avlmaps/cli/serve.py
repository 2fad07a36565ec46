"""`avlmaps serve`: answer programs by HTTP and agents by MCP."""

import logging
import sys
from contextlib import ExitStack, closing
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar

from tyro.conf import Positional, UseAppendAction, arg

from avlmaps.cli.output import AnsweredError, UsageError, emit
from avlmaps.cli.verb import PORT, Asking, ModelVerb
from avlmaps.core.progress import say


@dataclass(frozen=True, kw_only=True)
class Serve(Asking, ModelVerb):
    """Answer programs by HTTP and agents by MCP.

    The server prints its address. Its page lists every operation; /openapi.json describes them; agents connect to /mcp.
    It listens on this machine only, until --host says otherwise; then clients need a token. SIGTERM and Ctrl-C end it
    after the queries that are running. A map that is built again is picked up without a restart.

    Example: avlmaps serve home.avlmap

    Example: curl -G http://127.0.0.1:8750/maps/home/ask --data-urlencode "sentence=the chair near the table"

    Example: avlmaps serve home.avlmap office=/data/day2.avlmap --host 0.0.0.0 --token-file token.txt

    Example: avlmaps serve home.avlmap --stdio

    Example: avlmaps serve home.avlmap --drive robot.json
    """

    compiles: ClassVar[bool] = True

    map: Positional[Annotated[str, arg(metavar="MAP")]]
    """Map (NAME.avlmap); NAME=MAP gives it another name in addresses."""
    more: Positional[Annotated[tuple[str, ...], arg(metavar="[MAP ...]")]] = ()
    """Further maps."""
    stdio: bool = False
    """Serve one agent by standard input and output instead of HTTP."""
    host: Annotated[str, arg(metavar="ADDRESS")] = "127.0.0.1"
    """Address to listen on. Any other than this machine's loopback needs a token."""
    port: Annotated[int, PORT, arg(metavar="N")] = 8750
    """Port; 0 takes a free one."""
    token_file: Annotated[Path | None, arg(metavar="FILE")] = None
    """File with the token that clients must send. Default: the variable AVLMAPS_TOKEN, or no token."""
    tls_cert: Annotated[Path | None, arg(metavar="FILE")] = None
    """PEM certificate, for https."""
    tls_key: Annotated[Path | None, arg(metavar="FILE")] = None
    """PEM key of the certificate."""
    allow_host: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="NAME")] = ()
    """A further name of this server in the Host header, such as that of a reverse proxy; may be repeated."""

    drive: Annotated[Path | None, arg(metavar="ROBOT.json")] = None
    """Drive the robot of this file as well: plans, confirmations and stops under /drive, every order logged."""
    drive_log: Annotated[Path | None, arg(metavar="FILE")] = None
    """Log of orders, for --drive. Default: $XDG_STATE_HOME/avlmaps/orders.jsonl."""

    def run(self) -> None:
        if self.stdio and self.drive is not None:
            raise UsageError("--drive is served by HTTP, not by --stdio; leave one of them out.")
        if self.drive_log is not None and self.drive is None:
            raise UsageError("--drive-log belongs to --drive.")
        if self.stdio and self.json:
            raise UsageError("--stdio speaks a protocol on standard output, so --json cannot be used with it.")
        serve(self)


def serve(verb: "Serve") -> None:
    """Serve until the server is ended."""
    from avlmaps.serve.service import Service, listening_socket, read_token, run_http, url_of
    from avlmaps.serve.settings import ServeSettings
    from avlmaps.serve.shelf import named_maps

    logging.basicConfig(level=logging.WARNING, format="%(asctime)s %(name)s: %(message)s")
    settings = ServeSettings(
        host=verb.host, port=verb.port, token=None if verb.stdio else read_token(verb.token_file),
        allowed_hosts=verb.allow_host, tls_certificate=verb.tls_cert, tls_key=verb.tls_key,
        query=verb.query_settings(),
    )  # fmt: skip
    maps = named_maps([verb.map, *verb.more])
    if verb.stdio:
        import asyncio

        from avlmaps.serve.agents import agent_server, serve_stdio

        with closing(Service.open(maps, settings, say)) as service:
            asyncio.run(serve_stdio(agent_server(service, reads_files=True), service.settings.limits.answer_s))
        return
    from avlmaps.serve.app import create_app
    from avlmaps.serve.drive.app import PATH, open_driving

    with listening_socket(settings) as opened, ExitStack() as stack:
        service = Service.open(maps, settings, say)
        stack.callback(service.close)
        driving = None if verb.drive is None else open_driving(verb.drive, service, verb.drive_log)
        if driving is not None:
            stack.callback(driving.dispatcher.close)
        names, url = list(service.shelf.names), url_of(settings, opened)

        def started() -> None:
            lines = [f"serving {', '.join(names)} at {url} (operations: {url}/, agents: {url}/mcp)"]
            if not settings.is_loopback and settings.scheme == "http":
                say("note: the token goes over the network unencrypted; give --tls-cert and --tls-key for https.")
            answer = {"url": url, "mcp": f"{url}/mcp", "maps": names, "token": settings.token is not None}
            if driving is not None:
                robot, log = driving.dispatcher.machine.name, driving.dispatcher.log.path
                lines.append(f"driving {robot} at {url}/drive (agents: {url}/drive/mcp, log: {log})")
                answer |= {"drive": f"{url}/drive", "robot": robot, "log": str(log)}
            emit(answer, lines, verb.json)
            sys.stdout.flush()  # a program that started the server reads its address from a pipe

        if driving is None:
            run_http(create_app(service), service, opened, started)
        else:
            run_http(create_app(service, {PATH: driving.app}), service, opened, started, driving.end)
    if driving is not None and driving.dispatcher.fault:
        from avlmaps.navigate.interrupts import UNCONFIRMED_STATUS

        raise AnsweredError(
            f"The robot did not confirm that it stands ({driving.dispatcher.fault.rstrip('.')}), and may still be "
            "driving; use its own stop.",
            UNCONFIRMED_STATUS,
        )
