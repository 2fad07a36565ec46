"""One connection to rosbridge: opened, listened to, sent over, and closed. Nothing here knows of robots."""

import threading
from collections.abc import Callable
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

import msgspec

from avlmaps.core.errors import BackendError, NavigationError
from avlmaps.core.extras import install_command
from avlmaps.core.machine import is_loopback
from avlmaps_ros.messages import MOST_BYTES, Incoming, sanitize_line, text_in

if TYPE_CHECKING:
    from avlmaps_ros.wire import Bridge

DEFAULT_PORT = 9090
START_IT = (
    "start rosbridge on the robot with `ros2 launch rosbridge_server rosbridge_websocket_launch.xml` (ROS 1: "
    "`roslaunch rosbridge_server rosbridge_websocket.launch`), and check the address, the port and the firewall"
)
_MOST_COMPLAINTS = 20


class Link:
    """A connection that stands or is over; it never comes back by itself.

    What arrives is handed to listeners in the network's thread. They keep what they need and notify ``heard``, on
    which the driver's thread waits; neither sends anything while it holds it.

    Attributes:
        url: where to.
        heard: notified whenever something has arrived or changed.
        lost: why the connection is over; None while it stands.
        complaints: those of the bridge, the latest last.
        unread: how many messages were none, and were left out.
    """

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
            heard: notified by this connection; one of its own by default.
            most_bytes: a message that is larger ends the connection.

        Raises:
            BackendError: roslibpy is not installed.
            NavigationError: nobody answers there, or the address is none.
        """
        self.url = address(url)
        headers = {} if token is None else {"Authorization": f"Bearer {_checked(token, self.url)}"}
        self.heard = heard or threading.Condition()
        self.lost: str | None = None
        self.complaints: list[str] = []
        self.unread = 0
        self._open = False
        self._listeners: list[Callable[[Incoming], None]] = []
        self._topics: dict[str, Any] = {}
        self._bridge = self._opened(headers, timeout_s, most_bytes)

    def _opened(self, headers: dict[str, str], timeout_s: float, most_bytes: int) -> "Bridge":
        if find_spec("roslibpy") is None:
            raise BackendError(
                f"Driving a ROS robot needs roslibpy; get it with: {install_command(distribution='avlmaps-ros')}"
            )
        try:
            from avlmaps_ros.wire import Bridge, Listener, start_reactor

            start_reactor()
            listener = Listener(self._arrived, self._unreadable, self._stands, self._over)
            bridge = Bridge(self.url, headers, listener, timeout_s, most_bytes)
        except RuntimeError as fault:
            raise NavigationError(
                f"No connection to {self.url} can be made from this process ({sanitize_line(str(fault), 300)}); "
                "start a new one, without the environment variable ROSLIBPY_TRANSPORT."
            ) from None
        with self.heard:
            self.heard.wait_for(lambda: self.lost is not None or self._open, timeout_s)
        if not self._open:
            bridge.factory.drop()
            why = (self.lost or f"no answer within {timeout_s:g} s").rstrip(".")
            raise NavigationError(f"No rosbridge answers at {self.url} ({why}); {START_IT}.")
        return bridge

    def listen(self, listener: Callable[[Incoming], None]) -> None:
        """Hand on what answers goals and calls, from now on."""
        self._listeners.append(listener)

    def subscribe(self, topic: str, kind: str, hand_on: Callable[[msgspec.Raw], None], every_s: float = 0.0) -> None:
        """Hand on what is published; a listener raises ``ValueError`` for what it cannot read.

        Args:
            topic: its name.
            kind: its type.
            hand_on: takes each message.
            every_s: the bridge leaves out messages that come sooner after another.
        """
        self._topic(topic, kind, round(1000.0 * every_s)).subscribe(hand_on)

    def advertise(self, topic: str, kind: str) -> None:
        """Announce that something will be published."""
        self._topic(topic, kind).advertise()

    def publish(self, topic: str, message: dict[str, Any]) -> None:
        """Publish to a topic that was advertised."""
        self._topics[topic].publish(message)

    def send(self, operation: dict[str, Any]) -> None:
        """Send one operation of the protocol; nothing happens where the connection is over."""
        import roslibpy

        if self.lost is None:
            self._bridge.send_on_ready(roslibpy.Message(operation))

    def repeat(self, every_s: float, work: Callable[[], None]) -> None:
        """Do something in the network's thread again and again, until the connection is over."""
        from avlmaps_ros.wire import repeat

        def turn() -> bool:
            if self.lost is None:
                work()
            return self.lost is None

        repeat(every_s, turn)

    def later(self, wait_s: float, work: Callable[[], None]) -> None:
        """Do something in the network's thread after some seconds."""
        from avlmaps_ros.wire import later

        def then() -> None:
            work()
            with self.heard:
                self.heard.notify_all()

        later(wait_s, then)

    def drop(self) -> None:
        """End the connection without waiting for its end."""
        with self.heard:
            self.lost = self.lost or "it was closed"
        self._bridge.factory.drop()

    def close(self) -> None:
        """End the connection."""
        self._bridge.factory.drop()
        with self.heard:
            self.heard.wait_for(lambda: self.lost is not None, 2.0)
            self.lost = self.lost or "it was closed"

    def _topic(self, topic: str, kind: str, every_ms: int = 0) -> Any:
        import roslibpy

        if topic not in self._topics:
            self._topics[topic] = roslibpy.Topic(
                self._bridge, topic, kind, throttle_rate=every_ms, reconnect_on_close=False
            )
        return self._topics[topic]

    def _arrived(self, message: Incoming) -> None:
        if message.op == "publish":
            if message.topic in self._topics:
                self._bridge.emit(message.topic, message.msg)
        elif message.op == "status":
            if message.level in ("error", "warning"):
                self._keep(text_in(message.msg))
        else:
            for listener in self._listeners:
                listener(message)
        with self.heard:
            self.heard.notify_all()

    def _keep(self, complaint: str) -> None:
        with self.heard:
            self.complaints.append(complaint)
            del self.complaints[:-_MOST_COMPLAINTS]

    def _unreadable(self, _why: str) -> None:
        with self.heard:
            self.unread += 1
            self.heard.notify_all()

    def _stands(self) -> None:
        with self.heard:
            self._open = True
            self.heard.notify_all()

    def _over(self, why: str) -> None:
        with self.heard:
            self.lost = self.lost or why or "it was closed"
            self.heard.notify_all()


def address(url: str) -> str:
    """Return the websocket address that a user means: ``robot``, ``robot:9090`` and ``ws://robot`` are one.

    Raises:
        NavigationError: it is not an address of a websocket.
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
