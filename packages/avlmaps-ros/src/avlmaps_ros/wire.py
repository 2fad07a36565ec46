"""A websocket to rosbridge: sizes capped, certificates checked, and no second try.

Importing this module imports twisted; only `link` does, and only when a robot is needed. A connection that is lost
stays lost: what was meant for then must not be sent minutes later. The driver makes a new one for its next goal.
"""

import threading
from collections.abc import Mapping
from math import ceil
from typing import TYPE_CHECKING, Any

from autobahn.twisted.websocket import WebSocketClientFactory, WebSocketClientProtocol, connectWS
from twisted.internet import reactor as _reactor
from twisted.internet.error import ReactorNotRestartable
from twisted.internet.ssl import optionsForClientTLS

from avlmaps_ros.messages import sanitize_line

if TYPE_CHECKING:
    from avlmaps_ros.link import Link

reactor: Any = _reactor  # its methods are put on it at run time
_PING_EVERY_S, _PING_WAIT_S = 5.0, 10.0
_starting = threading.Lock()


class _Protocol(WebSocketClientProtocol):
    factory: "Websocket"

    def onOpen(self) -> None:  # noqa: N802 - autobahn's names
        self.factory.current = self
        self.factory.link.opened()

    def onMessage(self, payload: bytes, isBinary: bool) -> None:  # noqa: N802, N803
        self.factory.link.received(payload, isBinary)

    def onClose(self, wasClean: bool, code: int | None, reason: str | None) -> None:  # noqa: N802, N803
        self.factory.close_reason = str(reason or "")


class Websocket(WebSocketClientFactory):
    """Connects a link, and calls it in the reactor's thread; its own methods are for any thread."""

    protocol = _Protocol
    noisy = False
    isSecure: bool  # noqa: N815 - autobahn's name

    def __init__(self, link: "Link", headers: Mapping[str, str], timeout_s: float, most_bytes: int) -> None:
        super().__init__(link.name, headers=dict(headers))
        self.link, self._timeout_s = link, timeout_s
        self.current: _Protocol | None = None
        self.close_reason = ""
        self._connector: Any = None
        self.setProtocolOptions(
            maxFramePayloadSize=most_bytes,
            maxMessagePayloadSize=most_bytes,
            openHandshakeTimeout=timeout_s,
            closeHandshakeTimeout=1,
            autoPingInterval=_PING_EVERY_S,
            autoPingTimeout=_PING_WAIT_S,
        )
        start_reactor()
        reactor.callFromThread(self._connect)

    def _connect(self) -> None:
        # Without options autobahn would take any certificate for the robot's.
        options = optionsForClientTLS(str(self.host)) if self.isSecure else None
        self._connector = connectWS(self, options, timeout=ceil(self._timeout_s))

    def send(self, payload: bytes) -> None:
        """Send one message, if the connection still stands by then."""
        reactor.callFromThread(self._send, payload)

    def _send(self, payload: bytes) -> None:
        if self.current is not None and self.current.state == self.current.STATE_OPEN:
            self.current.sendMessage(payload)

    def drop(self) -> None:
        """End the connection in any state."""
        reactor.callFromThread(self._drop)

    def _drop(self) -> None:
        if self.current is not None and self.current.state == self.current.STATE_OPEN:
            self.current.sendClose()
        elif self._connector is not None:
            self._connector.disconnect()

    def clientConnectionLost(self, connector: Any, reason: Any) -> None:  # noqa: N802 - twisted's names
        """End the link."""
        self.current = None
        self.link.ended(sanitize_line(self.close_reason or reason.getErrorMessage()))

    clientConnectionFailed = clientConnectionLost  # noqa: N815 - nobody answered


def start_reactor() -> None:
    """Run twisted's reactor in a thread of its own, once in a process.

    ``RuntimeError``: it ran before and was stopped; twisted cannot start it again.
    """
    with _starting:
        if reactor.running:
            return
        begun, fault = threading.Event(), []

        def run() -> None:
            try:
                reactor.callWhenRunning(begun.set)
                reactor.run(installSignalHandlers=False)
            except ReactorNotRestartable as ended:
                fault.append(ended)
                begun.set()

        threading.Thread(target=run, name="avlmaps-ros", daemon=True).start()
        if not begun.wait(10.0) or fault:
            raise RuntimeError("twisted's reactor was stopped earlier in this process and cannot start again")
