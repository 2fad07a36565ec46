"""Settings of the server: where it listens, who may query, and the limits of each request."""

from dataclasses import dataclass, field
from pathlib import Path

from avlmaps.core.errors import AvlmapsError
from avlmaps.core.machine import is_loopback
from avlmaps.core.wording import option
from avlmaps.query.settings import QuerySettings

DEFAULT_PORT = 8750
MB = 1 << 20
SHORTEST_TOKEN = 16


class ServeError(AvlmapsError):
    """The server cannot be started as it is configured."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """Limits of each request; a request beyond one gets an error, and the others continue."""

    body_bytes: int = 32 * MB  # largest body of a request
    body_s: float = 20.0  # longest time in which a body arrives
    answer_s: float = 60.0  # longest time until an answer; a query that is waiting by then is dropped
    quick_workers: int = 2  # queries in words that run at one time
    slow_workers: int = 1  # photos, clips, lists and pictures that run at one time
    waiting: int = 64  # queries that wait, for each of the two; more are refused with 503
    connections: int = 256  # open connections; more are refused with 503
    picture_pixels: int = 1 << 25  # largest photo
    clip_s: float = 120.0  # longest clip
    goals: int = 100  # most goals of an answer
    cache_bytes: int = 192 * MB  # memory for the heat of words that were queried before, for each map
    shutdown_s: float = 30.0  # longest time for running queries after SIGTERM


@dataclass(frozen=True, slots=True, kw_only=True)
class ServeSettings:
    """How a server listens."""

    host: str = "127.0.0.1"  # every address but loopback needs a token
    port: int = DEFAULT_PORT  # 0 takes a free one
    token: str | None = field(default=None, repr=False)  # that clients send as ``Authorization: Bearer TOKEN``
    allowed_hosts: tuple[str, ...] = ()  # more names in the Host header, such as that of a reverse proxy
    tls_certificate: Path | None = None  # PEM file of the certificate and its chain; None for plain HTTP
    tls_key: Path | None = None  # PEM file of its key
    query: QuerySettings = field(default_factory=QuerySettings)
    limits: Limits = field(default_factory=Limits)

    def __post_init__(self) -> None:
        if not self.is_loopback and self.token is None:
            raise ServeError(
                f"A server on {self.host} can be reached by other machines, so it needs a token; give "
                f"{option('token-file', 'FILE')} or set AVLMAPS_TOKEN."
            )
        if self.token is not None and (len(self.token) < SHORTEST_TOKEN or not self.token.isascii()):
            raise ServeError(
                f"The token has {len(self.token)} characters; give at least {SHORTEST_TOKEN} of ASCII, such as from: "
                "python -c 'import secrets; print(secrets.token_urlsafe())'"
            )
        if (self.tls_certificate is None) != (self.tls_key is None):
            raise ServeError(f"TLS needs two files; give both {option('tls-cert')} and {option('tls-key')}.")

    @property
    def is_loopback(self) -> bool:
        """Whether only programs of this machine can connect."""
        return is_loopback(self.host)

    @property
    def scheme(self) -> str:
        """``http`` or ``https``."""
        return "http" if self.tls_certificate is None else "https"
