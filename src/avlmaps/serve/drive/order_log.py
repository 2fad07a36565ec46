"""The log of orders: one JSON object a line, appended and on the disk before anything moves."""

import json
import os
import threading
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from avlmaps.core.errors import NavigationError
from avlmaps.core.files import state_file
from avlmaps.core.printable import printable_json


def default_log() -> Path:
    """Return the log in the user's state folder."""
    return state_file("orders.jsonl")


class OrderLog:
    """Appends entries; a line is whole or not there, also when several processes write."""

    def __init__(self, path: Path) -> None:
        """Open the log.

        Raises:
            NavigationError: it cannot be opened for writing.
        """
        self.path = path
        self._lock = threading.Lock()
        try:
            path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            self._file = os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o600)
        except OSError as error:
            raise self._fault(error) from None

    def write(self, event: str, entry: Mapping[str, Any]) -> None:
        """Append an entry and wait until it is on the disk.

        Raises:
            NavigationError: it cannot be written; then nothing may move.
        """
        time = datetime.now(UTC).isoformat(timespec="milliseconds")
        line = json.dumps({"time": time, "event": event, **entry}, ensure_ascii=False, allow_nan=False)
        content = printable_json(line).encode() + b"\n"
        try:
            with self._lock:
                if os.write(self._file, content) != len(content):
                    raise OSError("the disk is full")
                os.fsync(self._file)
        except OSError as error:
            raise self._fault(error) from None

    def close(self) -> None:
        """Close the file."""
        with self._lock:
            if self._file >= 0:
                os.close(self._file)
            self._file = -1  # the number may be another file's from now on

    def _fault(self, error: OSError) -> NavigationError:
        return NavigationError(
            f"The log of orders {self.path.name} cannot be written ({error.strerror or error}), so nothing is driven; "
            "check its folder and the space on the disk."
        )
