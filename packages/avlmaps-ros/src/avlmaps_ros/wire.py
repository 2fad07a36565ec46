"""roslibpy's own connection, made safe: sizes capped, messages read strictly, certificates checked, no silent retries.

Importing this module imports twisted; only `link` does, and only when a robot is needed.

roslibpy tries again for ever when a connection is lost, and then sends what was meant for then; a goal that comes
minutes late is a danger. Here a connection that is lost stays lost, and the driver makes a new one for the next goal.
"""

import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import ceil
from typing import Any

import msgspec
import roslibpy
from autobahn.twisted.websocket import connectWS
from roslibpy.comm.comm_autobahn import AutobahnRosBridgeClientFactory, AutobahnRosBridgeProtocol
from twisted.internet import reactor as _reactor
from twisted.internet.error import ReactorNotRestartable
from twisted.internet.ssl import optionsForClientTLS

from avlmaps_ros.messages import Incoming, sanitize_line

reactor: Any = _reactor  # its methods are put on it at run time
_PING_EVERY_S, _PING_WAIT_S = 5.0, 10.0
_starting = threading.Lock()


@dataclass(frozen=True, slots=True)
class Listener:
    """The receiver of a connection's events; all are called in the network's thread.

    Attributes:
        incoming: a message came.
        fault: what came is not a message.
        opened: messages can go.
        over: the connection is lost, or nobody answered; called with the reason.
    """

    incoming: Callable[[Incoming], None]
    fault: Callable[[str], None]
    opened: Callable[[], None]
    over: Callable[[str], None]


class _Protocol(AutobahnRosBridgeProtocol):
    """Reads what comes as data, and hands it on; what is not a message is counted and left out."""

    factory: "_Factory"

    def onMessage(self, payload: bytes, isBinary: bool) -> None:  # noqa: N802, N803 - autobahn's names
        """Read one message."""
        try:
            if isBinary:
                raise ValueError("binary")
            message = msgspec.json.decode(payload, type=Incoming)
            self.factory.listener.incoming(message)
        except (ValueError, TypeError, RecursionError) as fault:
            self.factory.listener.fault(sanitize_line(str(fault)))

    def onClose(self, wasClean: bool, code: int | None, reason: str | None) -> None:  # noqa: N802, N803
        """Store why the connection ended."""
        self.factory.close_reason = sanitize_line(str(reason or ""))

    def send_message(self, payload: bytes) -> None:
        """Send one message, if the connection still stands by then."""
        reactor.callFromThread(self._post, payload)

    def _post(self, payload: bytes) -> None:
        if self.state == self.STATE_OPEN:
            self.sendMessage(payload)


class _Factory(AutobahnRosBridgeClientFactory):
    """Makes one connection and reports when it is there, and when it is over."""

    protocol = _Protocol
    maxRetries = 0  # noqa: N815 - twisted's name
    noisy = False

    def __init__(
        self, url: str, headers: Mapping[str, str], listener: Listener, timeout_s: float, most_bytes: int
    ) -> None:
        super().__init__(url, headers=dict(headers))
        self.listener = listener
        self.timeout_s = timeout_s
        self.close_reason = ""
        self.setProtocolOptions(
            maxFramePayloadSize=most_bytes,
            maxMessagePayloadSize=most_bytes,
            openHandshakeTimeout=timeout_s,
            closeHandshakeTimeout=1,
            autoPingInterval=_PING_EVERY_S,
            autoPingTimeout=_PING_WAIT_S,
        )

    def connect(self) -> None:
        """Begin to connect, in the reactor's thread."""
        reactor.callFromThread(self._begin)

    def _begin(self) -> None:
        # Without options autobahn would take any certificate for the robot's.
        options = optionsForClientTLS(str(self.host)) if self.isSecure else None
        self.connector = connectWS(self, options, timeout=ceil(self.timeout_s))

    def ready(self, proto: AutobahnRosBridgeProtocol) -> None:
        """Take note that messages can go."""
        super().ready(proto)
        self.listener.opened()

    def clientConnectionLost(self, connector: Any, reason: Any) -> None:  # noqa: N802 - twisted's name
        """Take note that it is over."""
        self._proto = None
        self.listener.over(self.close_reason or sanitize_line(reason.getErrorMessage()))

    def clientConnectionFailed(self, connector: Any, reason: Any) -> None:  # noqa: N802 - twisted's name
        """Take note that nobody answered."""
        self.listener.over(sanitize_line(reason.getErrorMessage()))

    def drop(self) -> None:
        """End the connection in any state; from any thread."""
        reactor.callFromThread(self._drop)

    def _drop(self) -> None:
        proto = self._proto
        if proto is not None and proto.state == proto.STATE_OPEN:
            proto.sendClose()
        elif self.connector is not None:
            self.connector.disconnect()


class Bridge(roslibpy.Ros):
    """roslibpy's connection over the factory above; its topics work on it as on any other."""

    def __init__(
        self, url: str, headers: Mapping[str, str], listener: Listener, timeout_s: float, most_bytes: int
    ) -> None:
        self._mine = _Factory(url, headers, listener, timeout_s, most_bytes)
        super().__init__(url)

    def connect(self) -> None:
        """Connect through our own factory, in place of the one that roslibpy has just made."""
        self.factory = self._mine
        super().connect()


def repeat(every_s: float, turn: Callable[[], bool]) -> None:
    """Call a function in the reactor's thread until it returns False."""

    def again() -> None:
        if turn():
            reactor.callLater(every_s, again)

    reactor.callFromThread(again)


def later(wait_s: float, work: Callable[[], None]) -> None:
    """Call a function in the reactor's thread after some seconds."""
    reactor.callFromThread(reactor.callLater, wait_s, work)


def start_reactor() -> None:
    """Run twisted's reactor in a thread of its own, once in a process.

    Raises:
        RuntimeError: it ran before and was stopped; twisted cannot start it again.
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
