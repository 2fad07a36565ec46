"""No signal that ends a drive is lost, where Python by itself loses it."""

import signal
import sys
import threading
import weakref
from collections.abc import Iterator

import pytest

from avlmaps.navigate.interrupts import Interrupted, raised_signals

pytestmark = pytest.mark.skipif(not hasattr(signal, "pthread_kill"), reason="this system sends no thread a signal")


@pytest.fixture
def asleep() -> Iterator[threading.Event]:
    """An event for which the main thread may wait; it comes when a signal was lost."""
    event = threading.Event()
    timer = threading.Timer(20.0, event.set)
    timer.start()
    yield event
    timer.cancel()


def test_a_signal_that_another_thread_takes_wakes_the_main_thread(asleep: threading.Event) -> None:
    # So it is, too, with one that comes after the main thread's last look and before it sleeps.
    def take() -> None:
        signal.pthread_kill(threading.get_ident(), signal.SIGTERM)

    with pytest.raises(Interrupted) as stop, raised_signals():
        threading.Timer(0.05, take).start()
        asleep.wait()
    assert stop.value.number == signal.SIGTERM and not asleep.is_set()


def test_a_signal_whose_exception_the_interpreter_drops_comes_again(asleep: threading.Event) -> None:
    thing = threading.Event()
    gone = weakref.ref(thing, lambda _: signal.raise_signal(signal.SIGTERM))
    with pytest.raises(Interrupted), raised_signals():
        del thing
        assert gone() is None
        asleep.wait()
    assert not asleep.is_set()


def test_a_second_signal_cuts_no_stop_short() -> None:
    with pytest.raises(Interrupted) as stop, raised_signals():
        try:
            signal.raise_signal(signal.SIGTERM)
        finally:
            signal.raise_signal(signal.SIGINT)
            threading.Event().wait(0.3)  # longer than until a lost signal is sent again
    assert stop.value.number == signal.SIGTERM


def test_afterwards_everything_is_as_before() -> None:
    def state() -> tuple[object, ...]:
        bell = signal.set_wakeup_fd(-1)
        signal.set_wakeup_fd(bell)
        return bell, sys.unraisablehook, signal.getsignal(signal.SIGTERM), signal.getsignal(signal.SIGINT)

    before = state()
    with pytest.raises(Interrupted), raised_signals():
        signal.raise_signal(signal.SIGTERM)
    assert state() == before
