"""Connections for operations behind which a bridge waits: each has a connection to itself until it is answered.

rosbridge handles what one client sends in order, and waits for the end of a goal or a call before it takes the next,
unless it is launched otherwise. A heartbeat or a cancel behind a goal would come when the goal is over.
"""

import threading
from collections.abc import Callable
from typing import Any

from avlmaps.core.errors import NavigationError
from avlmaps_ros.link import Link
from avlmaps_ros.messages import Incoming

_MOST = 6
_OPEN_WITHIN_S = 2.0


class Errands:
    """The connections beside a session's first; opened when they are needed, and used again once they are free."""

    def __init__(self, open_link: Callable[[float], Link], answer: Callable[[Incoming], None]) -> None:
        self._open, self._answer = open_link, answer
        self._lock = threading.Lock()
        self._lasting = ""
        self._links: list[tuple[Link, str]] = []  # and the operation that each is at; "" for none

    def send(self, name: str, operation: dict[str, Any], *, lasting: bool = False) -> bool:
        """Send an operation; return whether a connection could take it.

        The connection of a ``lasting`` one stays open when others are many; it takes the place of the last such one.
        """
        if lasting:
            self.leave(self._lasting)
            self._lasting = name
        link = self._taken(name)
        if link is None:
            return False
        link.send(operation)
        return True

    def follow(self, name: str, operation: dict[str, Any]) -> None:
        """Send an operation behind another one, on its connection where that stands."""
        with self._lock:
            links = [link for link, at in self._links if at == name]
        for link in links:
            link.send(operation)

    def _taken(self, name: str) -> Link | None:
        with self._lock:
            self._links = [(link, at) for link, at in self._links if link.lost is None]
            for index, (link, at) in enumerate(self._links):
                if not at:
                    self._links[index] = link, name
                    return link
            unanswered = [index for index, (_, at) in enumerate(self._links) if at != self._lasting]
            crowded = self._links.pop(unanswered[0])[0] if len(self._links) >= _MOST and unanswered else None
        if crowded is not None:
            crowded.drop()
        try:
            link = self._open(_OPEN_WITHIN_S)
        except NavigationError:
            return None
        link.listen(self._answer)
        with self._lock:
            self._links.append((link, name))
        return link

    def done(self, name: str) -> None:
        """Take note that an operation is answered: its connection is free."""
        with self._lock:
            self._links = [(link, "" if at == name else at) for link, at in self._links]

    def lost(self, name: str) -> str | None:
        """Return why the connection of an operation is over; None where it stands, or there is none."""
        with self._lock:
            return next((link.lost for link, at in self._links if at == name), None)

    def leave(self, name: str) -> None:
        """Give up the connection of an operation: its answer is waited for no more."""
        if not name:
            return
        with self._lock:
            left = [link for link, at in self._links if at == name]
            self._links = [(link, at) for link, at in self._links if at != name]
        for link in left:
            link.drop()

    def close(self) -> None:
        """End every connection."""
        with self._lock:
            links, self._links = self._links, []
        for link, _ in links:
            link.drop()
