"""Lanes: a bounded queue, a time limit, progress, and an end for work that nobody waits for."""

import asyncio
import threading

import pytest

from avlmaps.serve.lanes import Cancellation, CancelledWorkError, Lane, RequestError, watch_here


@pytest.fixture
def gate() -> threading.Event:
    return threading.Event()


def test_work_runs_and_reports_its_steps() -> None:
    lane, steps = Lane("t", 1, 0, 10.0), []

    def work(watch: Cancellation) -> int:
        watch.step("one", 1, 2)
        watch_here().step("two", 2, 2)
        return 7

    assert asyncio.run(lane.run(work, lambda *step: steps.append(step))) == 7
    assert steps == [("started", 0, 0), ("one", 1, 2), ("two", 2, 2)]
    lane.close()


def test_more_than_the_queue_holds_is_refused_and_the_others_are_answered(gate: threading.Event) -> None:
    lane = Lane("t", 1, 1, 10.0)

    async def run() -> list[object]:
        first = [asyncio.ensure_future(lane.run(lambda _: gate.wait(5))) for _ in range(2)]
        await asyncio.sleep(0.05)
        with pytest.raises(RequestError) as fault:
            await lane.run(lambda _: 1)
        assert (fault.value.status, fault.value.headers) == (503, {"Retry-After": "1"})
        gate.set()
        return [*await asyncio.gather(*first), await lane.run(lambda _: 1)]

    assert asyncio.run(run()) == [True, True, 1]
    lane.close()
    assert lane.taken == 0


def test_work_that_takes_too_long_is_answered_so_and_stops_at_its_next_step(gate: threading.Event) -> None:
    lane, ended = Lane("t", 1, 0, 0.05), threading.Event()

    def work(watch: Cancellation) -> None:
        gate.wait(5)
        try:
            watch.step("next")
        except CancelledWorkError:
            ended.set()
            raise

    async def run() -> None:
        with pytest.raises(RequestError) as fault:
            await lane.run(work)
        assert fault.value.status == 504
        assert lane.taken == 1, "its thread is not free yet"
        gate.set()

    asyncio.run(run())
    assert ended.wait(5)
    lane.close()
    assert lane.taken == 0


def test_work_that_waits_is_dropped_when_its_client_leaves(gate: threading.Event) -> None:
    lane, ran = Lane("t", 1, 4, 10.0), []

    async def run() -> None:
        first = asyncio.ensure_future(lane.run(lambda _: gate.wait(5)))
        second = asyncio.ensure_future(lane.run(lambda _: ran.append(1)))
        await asyncio.sleep(0.05)
        second.cancel()
        await asyncio.sleep(0.05)
        gate.set()
        await first

    asyncio.run(run())
    lane.close()
    assert not ran
