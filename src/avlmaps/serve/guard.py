"""The guard before every request: Host, Origin, token, connections, size and time of the body, security headers.

Programs send the token in a header. A browser brings it in the address once, and stores it in a cookie from then on.
It is plain ASGI and stands before the whole application, sub-applications and MCP included.
"""

import asyncio
import hashlib
import hmac
import json
import socket
from collections.abc import Awaitable, Callable, MutableMapping
from http.cookies import CookieError, SimpleCookie
from ipaddress import ip_address
from typing import Any
from urllib.parse import parse_qsl, quote, unquote, urlencode, urlsplit

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
        try:
            entered = self._check(scope)
        except RequestError as error:
            await refuse(error, send)
            return
        if entered is not None:
            await _enter(entered, send)
            return
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
            await self._app(scope, body, sent)
        except RequestError as error:  # of the body, which the application reads
            if started:
                raise
            await refuse(error, send)

    def _check(self, scope: Scope) -> list[tuple[bytes, bytes]] | None:
        """Return the headers of a redirection where a browser brings the token in the address, else None.

        Raises:
            RequestError: the request is refused.
        """
        headers = _headers(scope)
        size = 0 if scope["path"] in _UNREAD_PATHS else _length(headers.get("content-length", "0"))
        if self._settings.limits.body_bytes < size:
            raise too_large(self._settings.limits.body_bytes)
        host = headers.get("host", "")
        if not self._is_ours(host):
            raise RequestError(
                "The Host header names no host of this server; connect by its own name or address, or start it with "
                f"{flag('allow-host', 'NAME')}.",
                421,
                "host",
            )
        self._check_site(headers, host)
        if self._token is None or scope["path"] in _OPEN_PATHS:
            return None
        pairs = parse_qsl(scope.get("query_string", b"").decode("latin-1"), keep_blank_values=True)
        given = dict(pairs).get(_IN_ADDRESS)
        if scope["method"] == "GET" and given is not None and self._is_token(given):
            # The token leaves the address, so that it is in no history and in no picture of the screen.
            left = urlencode([pair for pair in pairs if pair[0] != _IN_ADDRESS])
            secure = "; Secure" if self._settings.scheme == "https" else ""
            cookie = f"{_COOKIE}={quote(given, safe='')}; HttpOnly; SameSite=Strict; Path=/{secure}"
            return [(b"location", f"?{left}".encode()), (b"set-cookie", cookie.encode())]
        self._check_token(headers)
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

    def _check_site(self, headers: dict[str, str], host: str) -> None:
        origin = headers.get("origin")
        same = origin is None or urlsplit(origin).netloc.lower() == host.lower()
        site, mode = headers.get("sec-fetch-site", "none"), headers.get("sec-fetch-mode", "navigate")
        if not same or (site in ("cross-site", "same-site") and mode != "navigate"):
            raise RequestError("Pages of other sites may not use this server.", 403, "origin")

    def _is_token(self, given: str) -> bool:
        return hmac.compare_digest(token_digest(given), self._token or b"")

    def _check_token(self, headers: dict[str, str]) -> None:
        scheme, _, given = headers.get("authorization", "").partition(" ")
        if not (scheme.lower() == "bearer" and self._is_token(given.strip())) and not self._is_token(_kept(headers)):
            raise RequestError(
                "This server needs a token; send the header 'Authorization: Bearer TOKEN', or add ?token=TOKEN to the "
                "address in a browser.",
                401,
                "token",
                WWW_Authenticate='Bearer realm="avlmaps"',
            )


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


async def refuse(error: RequestError, send: Send) -> None:
    """Send an error as JSON and close the connection, since its body may be unread."""
    body = json.dumps({"error": {"kind": error.kind, "message": str(error)}}).encode()
    headers = [
        (b"content-type", b"application/json"),
        (b"content-length", str(len(body)).encode()),
        (b"connection", b"close"),
        *HEADERS,
        _NO_STORE,
        *((name.lower().encode(), value.encode()) for name, value in error.headers.items()),
    ]
    await send({"type": "http.response.start", "status": error.status, "headers": headers})
    await send({"type": "http.response.body", "body": body})


async def _enter(headers: list[tuple[bytes, bytes]], send: Send) -> None:
    headers = [*headers, (b"content-length", b"0"), *HEADERS, _NO_STORE]
    await send({"type": "http.response.start", "status": 303, "headers": headers})
    await send({"type": "http.response.body", "body": b""})


def _kept(headers: dict[str, str]) -> str:
    try:
        kept = SimpleCookie(headers.get("cookie", "")).get(_COOKIE)
    except CookieError:
        return ""
    return "" if kept is None else unquote(kept.value)


def _headers(scope: Scope) -> dict[str, str]:
    found: dict[str, str] = {}
    for name, value in scope["headers"]:
        key = name.decode("latin-1").lower()
        found[key] = value.decode("latin-1") if key not in found else f"{found[key]}, {value.decode('latin-1')}"
    return found


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
