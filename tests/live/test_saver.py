"""The thread that saves a live map rests as long as it should, by a clock that the test turns."""

import threading
from pathlib import Path
from types import SimpleNamespace

import pytest

from avlmaps.live import saver
from avlmaps.maps.store.reader import StoredMap
from avlmaps.maps.types import Submaps

STATE = object.__new__(StoredMap)  # nothing of it is read


@pytest.mark.parametrize("every_s", [0.0, 5.0, 30.0])
@pytest.mark.parametrize("took_s", [0.25, 1.0, 20.0])
def test_between_two_saves_it_rests_as_long_as_one_took_but_a_second_at_most(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, took_s: float, every_s: float
) -> None:
    clock, begun, faults = SimpleNamespace(now_s=0.0), [], []

    class Door(threading.Condition):
        def wait(self, timeout: float | None = None) -> bool:
            if timeout is None:
                return super().wait()
            clock.now_s += timeout
            return False

    class SlowSaver(saver.Saver):
        def write(self, stored: StoredMap, submaps: Submaps | None = None) -> None:
            begun.append(clock.now_s)
            clock.now_s += took_s
            if len(begun) < 2:
                self.offer(STATE, clock.now_s, clock.now_s)
            else:
                self._ended = True

    monkeypatch.setattr(saver, "time", SimpleNamespace(perf_counter=lambda: clock.now_s))
    monkeypatch.setattr(saver, "Condition", Door)
    one = SlowSaver(tmp_path / "map", every_s, faults.append, faults.append)
    one.offer(STATE, 0.0, 0.0)
    one.thread.join(60.0)
    assert not one.thread.is_alive() and not faults
    assert begun == pytest.approx([0.0, max(every_s, took_s + min(took_s, 1.0))])
