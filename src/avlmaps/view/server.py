"""The page over HTTP, on this machine alone; on another host, behind a token.

| path | answer |
|---|---|
| `/` | the page |
| `/api/maps` | what the page needs to begin |
| `/api/maps/K/voxels` | the voxels (`layout.RECORD`), in the order of drawing |
| `/api/maps/K/contents`, `/api/maps/K/labels` | things, sounds, rooms; and four bytes for each voxel |
| `/api/maps/K/voxels/N` | what one voxel is taken for |
| `/api/maps/K/keyframes/N`, `/api/maps/K/clips/N` | a JPEG; a FLAC file |
| POST `/api/ask`, `/api/go` | JSON in; the length of the JSON (4 bytes), the JSON, the heat; JSON |
| POST `/api/uploads/photo`, `/api/uploads/clip` | a file in, its number out |

Another web site must not use the viewer of who visits it: a request names this host and no other origin, and what is
posted has a type that browsers do not send elsewhere unasked.
"""

import gzip
import hmac
import json
import secrets
import socket
from http.cookies import CookieError, SimpleCookie
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import parse_qs, unquote, urlsplit

from avlmaps.core.errors import AvlmapsError, QueryError
from avlmaps.core.network import is_loopback
from avlmaps.view.page import live_page
from avlmaps.view.session import MOST_UPLOAD_BYTES, MapOnPage, ViewSession

_MOST_JSON_BYTES = 100_000
_COOKIE = "avlmaps_view"
_IDLE_S = 60.0
_WORTH_PACKING = 10_000
_HEADERS = {
    "Cache-Control": "no-store",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}


class _RefusedError(Exception):
    """A request that is not answered.

    Attributes:
        status: of HTTP.
    """

    def __init__(self, status: int, message: str) -> None:
        super().__init__(message)
        self.status = status


class ViewServer(ThreadingHTTPServer):
    """Serves one session.

    Attributes:
        session: what is served.
        token: what a browser must show; None where only this machine reaches the server.
    """

    daemon_threads = True
    allow_reuse_address = True

    def __init__(self, session: ViewSession, host: str = "127.0.0.1", port: int = 8080) -> None:
        """Bind; `serve_forever` answers.

        Raises:
            QueryError: the port is taken, or the host is none of this machine's.
        """
        self.session, self.host = session, host
        self.token = None if is_loopback(host) else secrets.token_urlsafe(24)
        self.address_family = socket.AF_INET6 if ":" in host.strip("[]") else socket.AF_INET
        self.page, self.page_type = live_page().encode("utf-8"), "text/html; charset=utf-8"
        try:
            super().__init__((host.strip("[]"), port), _Handler)
        except (OSError, OverflowError) as fault:
            why = fault.strerror if isinstance(fault, OSError) and fault.strerror else str(fault)
            raise QueryError(
                f"The viewer cannot listen on {host}, port {port}: {why}. Choose another --port (0 takes a free one) "
                "or another --host."
            ) from fault

    @property
    def url(self) -> str:
        """Where a browser finds the page."""
        bare = self.host.strip("[]")
        bare = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(bare, bare)
        host = f"[{bare}]" if ":" in bare else bare
        query = "" if self.token is None else f"?token={self.token}"
        return f"http://{host}:{self.server_address[1]}/{query}"

    def server_bind(self) -> None:
        """Bind without looking up this machine's name, which may take seconds."""
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self.socket.bind(self.server_address)
        self.server_address = self.socket.getsockname()
        self.server_name, self.server_port = str(self.server_address[0]), int(self.server_address[1])

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Say nothing where a browser went away."""


class _Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    server_version, sys_version = "avlmaps", ""
    timeout = _IDLE_S
    server: ViewServer  # pyright: ignore[reportIncompatibleVariableOverride]

    def log_message(self, format: str, *args: object) -> None:
        """Log nothing."""

    def do_GET(self) -> None:
        """Answer what is read."""
        self._answered(self._read)

    def do_POST(self) -> None:
        """Answer what is posted."""
        self._answered(self._post)

    def _answered(self, answer: Any) -> None:
        try:
            self._require_allowed()
            answer()
        except _RefusedError as fault:
            self.close_connection = True  # a body may not have been read
            self._send_json({"error": {"message": str(fault)}}, fault.status)
        except AvlmapsError as fault:
            self._send_json({"error": {"message": str(fault)}}, 400)
        except (BrokenPipeError, ConnectionResetError, TimeoutError):
            self.close_connection = True
        except Exception as fault:  # noqa: BLE001 - the page shows it, and the server continues
            self.close_connection = True
            message = f"{type(fault).__name__}: {fault}; this is a fault of avlmaps, please report it."
            self._send_json({"error": {"message": message}}, 500)

    def _require_allowed(self) -> None:
        host = self.headers.get("Host", "")
        if self.server.token is None and not is_loopback(urlsplit(f"//{host}").hostname or ""):
            raise _RefusedError(403, "The viewer answers this machine alone; open it by localhost or 127.0.0.1.")
        origin = self.headers.get("Origin")
        if origin is not None and urlsplit(origin).netloc != host:
            raise _RefusedError(403, "The viewer answers its own page alone.")
        if self.server.token is not None and not self._shows_token():
            raise _RefusedError(403, "The viewer needs its token; open the address that `avlmaps view` printed.")

    def _shows_token(self) -> bool:
        given = parse_qs(urlsplit(self.path).query).get("token", [""])[0]
        try:
            kept = SimpleCookie(self.headers.get("Cookie", "")).get(_COOKIE)
        except CookieError:
            kept = None
        shown = (given, "" if kept is None else kept.value)
        token = (self.server.token or "").encode()
        return any([hmac.compare_digest(one.encode("utf-8", "replace"), token) for one in shown])

    def _read(self) -> None:
        parts = [unquote(part) for part in urlsplit(self.path).path.split("/") if part]
        match parts:
            case []:
                self._send_page()
            case ["api", "maps"]:
                self._send_json(self.server.session.describe())
            case ["api", "maps", number, *rest]:
                self._read_map(self._map(number), rest)
            case _:
                raise _RefusedError(404, "There is no such page; the viewer is at /.")

    def _read_map(self, one: MapOnPage, rest: list[str]) -> None:
        match rest:
            case ["voxels"]:
                self._send(one.layout.records, "application/octet-stream")
            case ["labels"]:
                self._send(one.labels.voxels.tobytes(), "application/octet-stream")
            case ["contents"]:
                self._send_json(one.describe_contents())
            case ["voxels", number]:
                self._send_json(one.describe_voxel(_whole(number)))
            case ["keyframes", number] if (jpeg := one.layout.thumbnail(_whole(number))) is not None:
                self._send(jpeg, "image/jpeg")
            case ["clips", number] if 0 <= _whole(number) < len(one.avlmap.stored.sounds):
                self._send(one.avlmap.stored.clip_path(_whole(number)).read_bytes(), "audio/flac")
            case _:
                raise _RefusedError(404, "The map has no such part.")

    def _map(self, number: str) -> MapOnPage:
        maps = self.server.session.maps
        if not 0 <= (at := _whole(number)) < len(maps):
            raise _RefusedError(404, f"There is no map {at}; the page shows {len(maps)}.")
        return maps[at]

    def _post(self) -> None:
        session = self.server.session
        parts = [part for part in urlsplit(self.path).path.split("/") if part]
        match parts:
            case ["api", "ask"]:
                words = self._json()
                answer, heat = session.ask(words.get("sentence", ""), words.get("photo"), words.get("clip"))
                header = json.dumps(answer, allow_nan=False).encode("utf-8")
                self._send(len(header).to_bytes(4, "little") + header + heat, "application/octet-stream")
            case ["api", "go"]:
                words = self._json()
                again = words.get("again") == "yes"
                self._send_json(
                    session.obey(words.get("command", ""), words.get("photo"), words.get("clip"), again=again)
                )
            case ["api", "uploads", kind]:
                content = self._body("application/octet-stream", MOST_UPLOAD_BYTES)
                name = unquote(self.headers.get("X-Name", kind))
                self._send_json({"upload": session.upload(kind, name, content)})
            case _:
                raise _RefusedError(404, "Nothing is posted there.")

    def _body(self, kind: str, most: int) -> bytes:
        if self.headers.get_content_type() != kind:
            raise _RefusedError(415, f"What is posted here is {kind}.")
        length = self.headers.get("Content-Length", "")
        if not length.isascii() or not length.isdigit():
            raise _RefusedError(411, "A length is needed.")
        if int(length) > most:
            raise _RefusedError(413, f"This has {int(length):,} bytes, more than {most:,}; give a smaller one.")
        return self.rfile.read(int(length))

    def _json(self) -> dict[str, str]:
        """Return the texts of a JSON object; other values in it are left out."""
        try:
            words = json.loads(self._body("application/json", _MOST_JSON_BYTES))
        except (ValueError, RecursionError):
            raise _RefusedError(400, "This is no JSON.") from None
        if not isinstance(words, dict):
            raise _RefusedError(400, "A JSON object is needed.")
        return {key: value for key, value in words.items() if isinstance(value, str)}

    def _send_page(self) -> None:
        if self.server.token is not None and "token=" in urlsplit(self.path).query:
            # The token leaves the address, so that it is in no history and in no picture of the screen.
            self.send_response(303)
            cookie = f"{_COOKIE}={self.server.token}; HttpOnly; SameSite=Strict; Path=/"
            for name, value in (("Location", "/"), ("Set-Cookie", cookie), ("Content-Length", "0")):
                self.send_header(name, value)
            self.end_headers()
            return
        self._send(self.server.page, self.server.page_type)

    def _send_json(self, answer: dict[str, Any], status: int = 200) -> None:
        self._send(json.dumps(answer, allow_nan=False).encode("utf-8"), "application/json", status)

    def _send(self, content: bytes, kind: str, status: int = 200) -> None:
        packed = len(content) > _WORTH_PACKING and kind not in ("image/jpeg", "audio/flac")
        packed = packed and "gzip" in self.headers.get("Accept-Encoding", "") and not self._is_near()
        if packed:
            content = gzip.compress(content, 1)
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(content)))
        if packed:
            self.send_header("Content-Encoding", "gzip")
        for name, value in _HEADERS.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(content)

    def _is_near(self) -> bool:
        """Return whether the browser is on this machine, so that packing only costs time."""
        return is_loopback(str(self.client_address[0]))


def _whole(text: str) -> int:
    if not text.isascii() or not text.isdigit() or len(text) > 12:
        raise _RefusedError(404, f"{text[:40]!r} is no number.")
    return int(text)
