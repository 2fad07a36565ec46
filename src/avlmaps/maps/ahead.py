"""Running a producer ahead of its consumer in one thread, so that the slower of the two sets the pace."""

import queue
import threading
from collections.abc import Generator, Iterable
from dataclasses import dataclass
from typing import Any, TypeVar

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class _End:
    fault: BaseException | None = None


def run_ahead(items: Iterable[T], depth: int = 2) -> Generator[T]:
    """Yield the items in their order, made by a background thread that is at most ``depth`` items ahead.

    An exception of the producer comes out here, where its item would have come. When the consumer stops early (an
    exception, ``close``), the thread stops after the item at hand and is waited for.
    """
    ready: queue.Queue[Any] = queue.Queue(maxsize=max(depth, 1))
    stop = threading.Event()

    def hand_over(item: Any) -> None:
        while not stop.is_set():
            try:
                ready.put(item, timeout=0.05)
            except queue.Full:
                continue
            return

    def produce() -> None:
        fault: BaseException | None = None
        try:
            for item in items:
                if stop.is_set():
                    return
                hand_over(item)
        except BaseException as raised:  # noqa: BLE001 - raised again by the consumer
            fault = raised
        hand_over(_End(fault))

    thread = threading.Thread(target=produce, name="avlmaps-ahead", daemon=True)
    thread.start()
    try:
        while not isinstance(item := ready.get(), _End):
            yield item
        if item.fault is not None:
            raise item.fault
    finally:
        stop.set()
        thread.join()
