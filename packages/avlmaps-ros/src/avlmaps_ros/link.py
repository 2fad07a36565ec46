"""A way to topics; and one connection to rosbridge: opened, listened to, sent over, and closed."""

import json
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any
from urllib.parse import urlsplit

import msgspec

from avlmaps.core.errors import BackendError, NavigationError
from avlmaps.core.extras import install_command
from avlmaps.core.machine import is_loopback
from avlmaps_ros.messages import MOST_BYTES, Incoming, sanitize_line, text_in

DEFAULT_PORT = 9090
START_IT = (
    "start rosbridge on the robot with `ros2 launch rosbridge_server rosbridge_websocket_launch.xml` (ROS 1: "
    "`roslaunch rosbridge_server rosbridge_websocket.launch`), and check the address, the port and the firewall"
)


class Line(ABC):
    """A way to a robot's topics. It stands or is over; it never comes back by itself.

    What arrives is handed on in the network's thread, where ``ValueError`` says that a message is unreadable. Who takes
    it keeps what he needs; neither sends anything while it holds ``heard``, on which the driver's thread waits.

    Attributes:
        name: how sentences call it.
        heard: notified whenever something arrived or changed.
        lost: why it is over; None while it stands.
        complaint: the latest that may explain a silence.
        unread: how many messages were none, and were left out.
    """

    def __init__(self, name: str, heard: threading.Condition | None = None) -> None:
        self.name, self.heard = name, heard or threading.Condition()
        self.lost: str | None = None
        self.complaint, self.unread = "", 0

    @abstractmethod
    def subscribe(self, topic: str, kind: str, hand_on: Callable[[Any], None], every_s: float = 0.0) -> None:
        """Hand on what is published, over a bridge at most once in ``every_s``."""

    @abstractmethod
    def advertise(self, topic: str, kind: str) -> None: ...

    @abstractmethod
    def publish(self, topic: str, message: dict[str, Any]) -> None: ...

    @abstractmethod
    def later(self, wait_s: float, work: Callable[[], None]) -> None:
        """Do something in the network's thread after some seconds."""

    @abstractmethod
    def close(self) -> None: ...

    def ended(self, why: str) -> None:
        """Take note that it is over, or that nobody answered."""
        self.lost = self.lost or why or "it was closed"
        self.note()

    def note(self) -> None:
        """Wake who waits for what arrives."""
        with self.heard:
            self.heard.notify_all()


class Link(Line):
    """One connection to rosbridge; ``listener`` takes what answers goals and calls."""

    def __init__(
        self,
        url: str,
        token: str | None = None,
        timeout_s: float = 10.0,
        heard: threading.Condition | None = None,
        most_bytes: int = MOST_BYTES,
    ) -> None:
        """Connect.

        Args:
            url: ``ws://host:9090`` or ``wss://host``.
            token: sent as ``Authorization: Bearer``, for a proxy in front of the bridge that asks for it.
            timeout_s: how long to wait for the robot.
            heard: notified whenever something has arrived or changed; one of its own by default.
            most_bytes: a message that is larger ends the connection.

        Raises:
            BackendError: autobahn or twisted is not installed.
            NavigationError: nobody answers there, or the address is none.
        """
        super().__init__(address(url), heard)
        self._token, self._is_open = token, False
        headers = {} if token is None else {"Authorization": f"Bearer {_checked(token, self.name)}"}
        self.listener: Callable[[Incoming], None] = lambda _: None
        self._topics: dict[str, Callable[[msgspec.Raw], None]] = {}
        try:
            from avlmaps_ros.wire import Websocket

            self._socket = Websocket(self, headers, timeout_s, most_bytes)
        except ImportError as fault:
            raise BackendError(
                f"Driving a ROS robot over rosbridge needs autobahn and twisted ({fault}); get them with: "
                f"{install_command(distribution='avlmaps-ros')}"
            ) from None
        except RuntimeError as fault:
            raise NavigationError(
                f"No connection to {self.name} can be made from this process ({fault}); start a new one."
            ) from None
        with self.heard:
            self.heard.wait_for(lambda: self.lost is not None or self._is_open, timeout_s)
        if not self._is_open:
            self._socket.drop()
            why = (self.lost or f"no answer within {timeout_s:g} s").rstrip(".")
            raise NavigationError(f"No rosbridge answers at {self.name} ({why}); {START_IT}.")

    def beside(self, timeout_s: float) -> "Link":
        """Open another connection to the same bridge, which notifies the same ``heard``."""
        return Link(self.name, self._token, timeout_s, self.heard)

    def subscribe(self, topic: str, kind: str, hand_on: Callable[[Any], None], every_s: float = 0.0) -> None:
        self._topics[topic] = hand_on
        self.send({"op": "subscribe", "topic": topic, "type": kind, "throttle_rate": round(1000.0 * every_s)})

    def advertise(self, topic: str, kind: str) -> None:
        self.send({"op": "advertise", "topic": topic, "type": kind})

    def publish(self, topic: str, message: dict[str, Any]) -> None:
        self.send({"op": "publish", "topic": topic, "msg": message})

    def send(self, operation: dict[str, Any]) -> None:
        """Send one operation of the protocol; nothing happens where the connection is over."""
        if self.lost is None:
            self._socket.send(json.dumps(operation).encode())

    def later(self, wait_s: float, work: Callable[[], None]) -> None:
        from avlmaps_ros.wire import reactor

        def then() -> None:
            work()
            self.note()

        reactor.callFromThread(reactor.callLater, wait_s, then)

    def drop(self) -> None:
        """End the connection without waiting for its end."""
        self.ended("it was closed")
        self._socket.drop()

    def close(self) -> None:
        """End the connection."""
        self._socket.drop()
        with self.heard:
            self.heard.wait_for(lambda: self.lost is not None, 2.0)
        self.ended("it was closed")

    # In the network's thread.

    def opened(self) -> None:
        self._is_open = True
        self.note()

    def received(self, payload: bytes, is_binary: bool) -> None:
        """Read one message as data and hand it on; what is none is counted and left out."""
        try:
            if is_binary:
                raise ValueError("binary")
            self._hand_on(msgspec.json.decode(payload, type=Incoming))
        except (ValueError, TypeError, RecursionError, OverflowError):
            self.unread += 1
            self.complaint = self.complaint or "messages came that cannot be read (is it launched with bson_only_mode?)"
        self.note()

    def _hand_on(self, message: Incoming) -> None:
        if message.op == "publish":
            if message.topic in self._topics:
                self._topics[message.topic](message.msg)
        elif message.op == "status":
            if message.level in ("error", "warning"):
                self.complaint = text_in(message.msg)
        else:
            self.listener(message)


def address(url: str) -> str:
    """Return the websocket address that a user means: ``robot``, ``robot:9090`` and ``ws://robot`` are one.

    ``NavigationError``: it is not an address of a websocket.
    """
    whole = url if "://" in url else f"ws://{url}"
    try:
        parts = urlsplit(whole)
        host, port = parts.hostname, parts.port
    except ValueError:
        host, port, parts = None, None, urlsplit("")
    if parts.scheme not in ("ws", "wss") or not host or parts.username or any(c <= " " or c > "~" for c in url):
        raise NavigationError(
            f"{sanitize_line(url)!r} is not an address of a rosbridge; write it as ws://HOST:{DEFAULT_PORT}."
        )
    port = port or (DEFAULT_PORT if parts.scheme == "ws" else 443)
    name = f"[{host}]" if ":" in host else host
    return f"{parts.scheme}://{name}:{port}{parts.path or '/'}" + (f"?{parts.query}" if parts.query else "")


def _checked(token: str, url: str) -> str:
    if not token or any(c <= " " or c > "~" for c in token):
        raise NavigationError("The token for the robot is empty or has a blank in it; give it as one word.")
    host = urlsplit(url).hostname or ""
    if url.startswith("ws://") and not is_loopback(host):
        raise NavigationError(
            f"A token would go to {url} in the clear; give a wss:// address, or reach the robot through an SSH tunnel."
        )
    return token
