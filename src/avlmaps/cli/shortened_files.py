"""One sentence instead of a crash where a map's file is cut short while it is read.

Large arrays are memory-mapped. Where another program shortens such a file, the next access to the lost part raises
SIGBUS, for which Python has no exception: the access cannot be completed. All that can be done is to say so and end.
A robot that is driving is stopped by its guard process, as after any sudden end.
"""

import ctypes
import json
import os
import signal

from avlmaps.cli.output import error_answer, kind_of
from avlmaps.core.errors import MapError

_MESSAGE = (
    "a file of the map was cut short while it was read; check the map with avlmaps info MAP --verify, and restore "
    "it from a copy, or build it again."
)
_SAID = f"avlmaps: {_MESSAGE}\n".encode()
_JSON = (json.dumps({"error": error_answer(kind_of(MapError(_MESSAGE)), _MESSAGE)}) + "\n").encode()
_handlers: list[object] = []  # the C library holds their addresses


def end_at_shortened_files(*, as_json: bool) -> None:
    """Let SIGBUS end this process with exit status 1 and one sentence; on systems without it nothing is done.

    Python's own handlers run between two instructions of Python, which the failed access never reaches; this one is
    called by the C library at the access itself, and only writes and ends.
    """
    if not hasattr(signal, "SIGBUS") or os.name != "posix":
        return

    def end(_: int) -> None:
        os.write(2, _SAID)
        if as_json:
            os.write(1, _JSON)
        os._exit(1)

    handler = ctypes.CFUNCTYPE(None, ctypes.c_int)(end)
    _handlers[:] = [handler]
    ctypes.CDLL(None).signal(int(signal.SIGBUS), handler)
