"""The guard before every request: Host, Origin, token, connections, size and time of the body, security headers.

Programs send the token in a header. A browser brings it in the address once, and stores it in a cookie from then on.
It is plain ASGI and stands before the whole application, sub-applications and MCP included.
"""

import asyncio
import hashlib
import hmac
import socket
from collections.abc import Awaitable, Callable, MutableMapping
from ipaddress import ip_address
from typing import Any
from urllib.parse import quote, unquote, urlencode, urlsplit

from starlette.requests import Request
from starlette.responses import JSONResponse, Response

from avlmaps.core.machine import is_loopback
from avlmaps.core.wording import Spelling, asked_as, flag
from avlmaps.serve.lanes import RequestError
from avlmaps.serve.settings import ServeSettings

Scope = MutableMapping[str, Any]
Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
App = Callable[[Scope, Receive, Send], Awaitable[None]]

# What every response says: no type guessing, no framing, no use by other sites, no copy in caches.
HEADERS = (
    (b"x-content-type-options", b"nosniff"),
    (b"x-frame-options", b"DENY"),
    (b"referrer-policy", b"no-referrer"),
    (b"cross-origin-resource-policy", b"same-origin"),
)
_NO_STORE = (b"cache-control", b"no-store")
_COOKIE, _IN_ADDRESS = "avlmaps_token", "token"
_OPEN_PATHS = frozenset({"/health"})
# Nothing in a body may stand against a stop: it is not read there, so its size does not count.
_UNREAD_PATHS = frozenset({"/drive/stop"})


class AccessGuard:
    """ASGI middleware; see the module."""

    def __init__(self, app: App, settings: ServeSettings) -> None:
        self._app = app
        self._settings = settings
        self._token = None if settings.token is None else token_digest(settings.token)
        self._hosts = {name.lower().rstrip(".") for name in settings.allowed_hosts}
        if is_loopback(settings.host):
            self._hosts |= {"localhost", "127.0.0.1", "::1", settings.host}
        else:
            self._hosts |= {settings.host.lower(), socket.gethostname().lower(), socket.getfqdn().lower()}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, or answer it with an error."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        if scope["type"] != "http":  # no WebSocket is served
            await send({"type": "websocket.close", "code": 1008})
            return
        with asked_as(Spelling.FIELD):
            await self._answer(scope, receive, send)

    async def _answer(self, scope: Scope, receive: Receive, send: Send) -> None:
        body = _LimitedBody(receive, self._settings.limits.body_bytes, self._settings.limits.body_s)
        started = False

        async def sent(message: Message) -> None:
            nonlocal started
            if message["type"] == "http.response.start":
                started = True
                headers = list(message.get("headers", ()))
                names = {name.lower() for name, _ in headers}
                headers += [pair for pair in (*HEADERS, _NO_STORE) if pair[0] not in names]
                message = {**message, "headers": headers}
            await send(message)

        try:
            answer = self._check(Request(scope)) or self._app
            await answer(scope, body, sent)
        except RequestError as error:  # also of the body, which the application reads
            if started:
                raise
            # The connection is closed, since the body may be unread.
            headers = {**error.headers, "connection": "close"}
            said = {"error": {"kind": error.kind, "message": str(error)}}
            await JSONResponse(said, error.status, headers)(scope, receive, sent)

    def _check(self, request: Request) -> Response | None:
        """Return a redirection where a browser brings the token in the address, else None."""
        path = request.scope["path"]
        size = 0 if path in _UNREAD_PATHS else _length(_header(request, "content-length") or "0")
        if self._settings.limits.body_bytes < size:
            raise too_large(self._settings.limits.body_bytes)
        host = _header(request, "host")
        if not self._is_ours(host):
            raise RequestError(
                "The Host header names no host of this server; connect by its own name or address, or start it with "
                f"{flag('allow-host', 'NAME')}.", 421, "host",
            )  # fmt: skip
        other = urlsplit(_header(request, "origin")).netloc.lower() != host.lower()
        site, mode = _header(request, "sec-fetch-site"), request.headers.get("sec-fetch-mode", "navigate")
        by_page = site in ("cross-site", "same-site") and mode != "navigate"
        if by_page or (other and "origin" in request.headers):
            raise RequestError("Pages of other sites may not use this server.", 403, "origin")
        if self._token is None or path in _OPEN_PATHS:
            return None
        given = request.query_params.get(_IN_ADDRESS)
        if request.method == "GET" and given is not None and self._is_token(given):
            # The token leaves the address, so that it is in no history and in no picture of the screen.
            left = urlencode([pair for pair in request.query_params.multi_items() if pair[0] != _IN_ADDRESS])
            entered = Response(status_code=303, headers={"location": f"?{left}"})
            is_secure = self._settings.scheme == "https"
            entered.set_cookie(_COOKIE, quote(given, safe=""), httponly=True, samesite="strict", secure=is_secure)
            return entered
        self._check_token(request)
        return None

    def _is_ours(self, host: str) -> bool:
        """Return whether a Host header names this server. An address cannot be rebound by DNS, a name can."""
        name = _host_name(host)
        if name in self._hosts:
            return True
        if is_loopback(self._settings.host):
            return False
        try:
            return bool(ip_address(name))
        except ValueError:
            return False

    def _is_token(self, given: str) -> bool:
        return hmac.compare_digest(token_digest(given), self._token or b"")

    def _check_token(self, request: Request) -> None:
        scheme, _, given = _header(request, "authorization").partition(" ")
        kept = unquote(request.cookies.get(_COOKIE, ""))
        if not (scheme.lower() == "bearer" and self._is_token(given.strip())) and not self._is_token(kept):
            raise RequestError(
                "This server needs a token; send the header 'Authorization: Bearer TOKEN', or add ?token=TOKEN to the "
                "address in a browser.", 401, "token", WWW_Authenticate='Bearer realm="avlmaps"',
            )  # fmt: skip


class _LimitedBody:
    def __init__(self, receive: Receive, most_bytes: int, most_s: float) -> None:
        self._receive, self._most_bytes, self._most_s = receive, most_bytes, most_s
        self._bytes, self._until, self._complete = 0, None, False

    async def __call__(self) -> Message:
        if self._complete:  # from here on, this waits for the client to leave
            return await self._receive()
        loop = asyncio.get_running_loop()
        if self._until is None:
            self._until = loop.time() + self._most_s
        try:
            async with asyncio.timeout_at(self._until):
                message = await self._receive()
        except TimeoutError:
            raise RequestError(
                f"The body did not arrive within {self._most_s:g} s; send it again.", 408, "timeout"
            ) from None
        self._bytes += len(message.get("body", b""))
        if self._bytes > self._most_bytes:
            raise too_large(self._most_bytes)
        self._complete = not message.get("more_body", False)
        return message


def too_large(most_bytes: int) -> RequestError:
    """Return the error of a body that is too large."""
    return RequestError(f"The body is larger than {most_bytes:,} bytes; send smaller files.", 413, "size")


def _header(request: Request, name: str) -> str:
    """Return a header, "" without it; one that is given twice is neither of both."""
    return ", ".join(request.headers.getlist(name))


def _length(text: str) -> int:
    return int(text) if text.isascii() and text.isdigit() and len(text) < 20 else 1 << 62


def _host_name(host: str) -> str:
    host = host.strip().lower()
    if host.startswith("["):
        return host[1:].partition("]")[0]
    return host.partition(":")[0].rstrip(".") if host.count(":") <= 1 else host


def token_digest(token: str) -> bytes:
    """Return a hash of equal length for every token, so that a comparison shows nothing of it."""
    return hashlib.sha256(token.encode("utf-8", "surrogatepass")).digest()
