"""Gates leave out frames that bring nothing, and a frame that others wait behind adds its surface alone."""

import threading
from dataclasses import replace
from pathlib import Path

import numpy as np
from live_frames import ENCODERS, EVERY, UP, add, frame, wait_for

import avlmaps
from avlmaps.live.live_map import Gates, LiveMap
from avlmaps.live.status import LiveSettings
from avlmaps.maps.mapper import Mapper
from avlmaps.maps.settings import BuildSettings, GravitySettings


def test_a_gate_opens_for_new_surface_alone() -> None:
    mapper = Mapper(BuildSettings(), avlmaps.Encoders(), np.array(UP), first_frames=1)
    gates, count = Gates(LiveSettings(known_views=2), 10.0), iter(range(10))

    def fused(at: int) -> None:
        number = next(count)
        mapper.add(replace(frame(at), index=number, stamp_s=0.1 * number))

    assert gates.reason_against(frame(0), mapper) is None  # the first
    for _ in range(2):
        fused(0)
    mapper.snapshot()  # what is absorbed counts as what is not
    assert gates.reason_against(frame(0), mapper) == "still"
    assert gates.reason_against(frame(20), mapper) is None
    for _ in range(2):
        fused(20)
    assert gates.reason_against(frame(0), mapper) == "known"


def while_busy(live: LiveMap, numbers: range) -> None:
    """Add frames that nobody takes, as the thread that fuses is at another; the first is that one."""
    begun, go_on, check = threading.Event(), threading.Event(), live._check.add

    def slow(one: avlmaps.Frame, *others: object) -> tuple[str, ...]:
        begun.set()
        assert go_on.wait(60.0)
        live._check.add = check  # type: ignore[method-assign]
        return check(one, *others)

    live._check.add = slow  # type: ignore[method-assign]
    for number in numbers:
        one = frame(number)
        live.add_frame(one.rgb, one.depth_m, one.camera, one.world_from_camera, one.stamp_s)
        assert begun.wait(60.0)
    go_on.set()


def test_a_frame_that_others_wait_behind_adds_its_surface_alone(tmp_path: Path) -> None:
    chosen = LiveSettings(first_frames=2, known_views=100, new_share=0.0)
    with LiveMap(tmp_path / "map", ENCODERS, up_in_world=UP, live=chosen, settings=BuildSettings()) as live:
        for number in range(6):
            add(live, frame(number))
        wait_for(lambda: live.status().fused == 6)
        while_busy(live, range(6, 14))  # one is fused, two wait, five are late
    status = live.status()
    assert status.dropped == {"late": 5} and status.fused == 9 and 6 < status.encoded < 9
    assert live.map.data.info.counts.frames == 9 and live.ask(object="red").found


def test_up_and_the_floor_are_found_again_behind_when_the_walk_has_doubled() -> None:
    settings = BuildSettings(gravity=GravitySettings(frames=8))
    mapper = Mapper(settings, ENCODERS, np.array(UP), behind=True)
    for number in range(20):
        mapper.add(frame(number))
    first = mapper.start
    mapper.snapshot()
    second = mapper.start
    assert first is not None and second is not None and first is not second and first.sensor is second.sensor
    mapper.snapshot()
    assert mapper.start is second


def test_without_gates_no_frame_is_left_out(tmp_path: Path) -> None:
    with LiveMap(tmp_path / "map", ENCODERS, up_in_world=UP, live=EVERY) as live:
        for number in range(12):
            add(live, replace(frame(0), stamp_s=0.1 * number))
    assert live.status().fused == live.status().encoded == 12 and live.status().dropped == {}
