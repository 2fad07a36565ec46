"""Which frames a live map takes and encodes, what it makes of poses, and what it does with those kept back."""

import _thread
import resource
import signal
import threading
import time
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from live_frames import ENCODERS, EVERY, UP, Ones, add, frame, wait_for
from scipy.spatial import cKDTree

import avlmaps
from avlmaps.core.errors import MapError, RecordingError
from avlmaps.live import live_map
from avlmaps.live.gates import EncodingGate, Gates
from avlmaps.live.kept_back import KeptBack
from avlmaps.live.live_map import LiveMap
from avlmaps.live.pose_check import PoseCheck
from avlmaps.live.replay import end_drive
from avlmaps.live.saver import Unsaved
from avlmaps.live.settings import LiveSettings
from avlmaps.maps.fusion.accumulator import VoxelAccumulator
from avlmaps.maps.fusion.sensor import FusionSettings
from avlmaps.maps.grid import GridSpec
from avlmaps.maps.growing import GrowingMap
from avlmaps.maps.settings import BuildSettings, FrameSettings, GravitySettings
from avlmaps.maps.store.reader import open_stored


def test_a_gate_opens_for_new_surface_alone() -> None:
    gates, total = Gates(LiveSettings(known_views=2), 10.0), VoxelAccumulator(GridSpec(0.05), 0)
    assert gates.reason_against(frame(0), [total]) is None  # the first
    for _ in range(2):
        total.add(frame(0))
    assert gates.reason_against(frame(0), [total]) == "still"
    assert gates.reason_against(frame(20), [total]) is None
    for _ in range(2):
        total.add(frame(20))
    assert gates.reason_against(frame(0), [total]) == "known"


def test_a_frame_is_encoded_for_its_share_of_new_and_nearer_looks() -> None:
    settings = LiveSettings(looks=2, encoded_share=0.1)
    gate = EncodingGate(settings, FusionSettings())
    assert [gate.opens(frame(0)) for _ in range(4)] == [True, True, False, False]
    assert gate.opens(frame(40))  # another place
    nearer = frame(0)
    pose = nearer.world_from_camera.copy()
    pose[1, 3] += 1.0  # 1 m nearer to the wall: there the weight of a look is several times that of before
    assert gate.opens(replace(nearer, world_from_camera=pose, depth_m=nearer.depth_m - 1.0))
    free, pressed = (EncodingGate(settings, FusionSettings()) for _ in range(2))
    opened = [(free.opens(frame(n)), pressed.opens(frame(n), waiting=4)) for n in range(60)]
    assert opened[0] == (True, True)
    assert sum(one for one, _ in opened) > sum(other for _, other in opened) > 2


def test_frames_that_are_not_encoded_add_their_surface_alone(tmp_path: Path) -> None:
    chosen = LiveSettings(first_frames=2, known_views=100, new_share=0.0, looks=2)
    with LiveMap(tmp_path / "map", ENCODERS, up_in_world=UP, live=chosen) as live:
        for number in range(12):
            add(live, frame(number, step_m=0.005))
    status = live.status()
    assert status.fused == 12 and 0 < status.encoded < 12
    assert live.map.stored.info.counts.frames == 12 and live.ask("something red").found


def drive_forth_and_back(path: Path, chosen: LiveSettings) -> LiveMap:
    order = [*range(18), *range(17, -1, -1)]
    with LiveMap(path, ENCODERS, up_in_world=UP, live=chosen, settings=BuildSettings()) as live:
        for number, at in enumerate(order):
            add(live, replace(frame(at), index=number, stamp_s=0.1 * number))
    return live


def test_frames_that_were_kept_back_are_in_the_map_at_the_end(tmp_path: Path) -> None:
    every = drive_forth_and_back(tmp_path / "every", EVERY).map.stored.voxels
    few = LiveSettings(known_views=2, new_share=0.2, still_m=0.0, looks=1, encoded_share=0.4, later_looks=10_000)
    live = drive_forth_and_back(tmp_path / "kept", few)
    status, found = live.status(), live.map.stored.voxels
    assert status.dropped["known"] > 3 and status.encoded < status.fused
    assert status.encoded + status.encoded_later == 36 and status.kept == 0
    np.testing.assert_array_equal(found.index, every.index)
    np.testing.assert_array_equal(found.hits, every.hits)
    np.testing.assert_allclose(found.weight, every.weight, rtol=1e-5)
    np.testing.assert_allclose(found.feature, every.feature, atol=2e-3)
    without = drive_forth_and_back(tmp_path / "none", replace(few, kept_frames=0))
    assert without.status().encoded_later == 0 and without.map.stored.voxels.hits.sum() < every.hits.sum()


def test_frames_that_were_kept_back_are_looked_at_when_none_comes(tmp_path: Path) -> None:
    chosen = LiveSettings(first_frames=2, known_views=100, new_share=0.0, looks=2, snapshot_s=0.0)
    with LiveMap(tmp_path / "map", ENCODERS, up_in_world=UP, live=chosen) as live:
        for number in range(12):
            add(live, frame(number, step_m=0.005))
        wait_for(lambda: live.status().encoded_later > 0 and live.status().kept == 0)
        generation = live.generation
        wait_for(lambda: live.generation > generation or live.status().snapshot_age_s < 1.0)
        for number in range(12, 20):
            add(live, frame(number, step_m=0.005))
    assert live.status().fused == 20 and live.map.stored.info.counts.frames == 20


def test_kept_frames_wait_for_the_first_ones(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(live_map, "_CALM_S", 0.01)
    chosen = LiveSettings(
        first_frames=8, known_views=100, new_share=0.0, looks=1, encoded_share=0.4, later_looks=10_000
    )
    with LiveMap(tmp_path / "map", ENCODERS, up_in_world=UP, live=chosen) as live:
        for number in range(5):
            add(live, frame(number, step_m=0.005))
        wait_for(lambda: live.status().fused == 5 == live.status().encoded + live.status().kept)
        kept = live.status().kept
        time.sleep(0.2)
        assert live.status().kept == kept > 0
        for number in range(5, 12):
            add(live, frame(number, step_m=0.005))
    assert live.status().encoded + live.status().encoded_later == 12


# Looks at every place are worth one: what is not encoded at once is encoded at the end.
LATER = LiveSettings(known_views=100, new_share=0.0, looks=1, encoded_share=0.4, later_looks=10_000)


@pytest.mark.parametrize("frames", [1, 5, 7])
def test_a_drive_shorter_than_the_first_frames_ends_with_what_was_kept(tmp_path: Path, frames: int) -> None:
    ends = []
    for name, chosen in (("every", EVERY), ("kept", LATER)):
        with LiveMap(tmp_path / name, ENCODERS, up_in_world=UP, live=chosen, settings=BuildSettings()) as live:
            for number in range(frames):
                add(live, frame(number, step_m=0.005))
        ends.append(live)
    every, kept = (live.map.stored.voxels for live in ends)
    status = ends[1].status()
    assert status.encoded + status.encoded_later == status.fused == frames
    assert (status.encoded_later > 0) == (frames > 2)
    np.testing.assert_array_equal(kept.index, every.index)
    np.testing.assert_array_equal(kept.hits, every.hits)
    np.testing.assert_allclose(kept.weight, every.weight, rtol=1e-5)
    np.testing.assert_allclose(kept.feature, every.feature, atol=2e-3)


def while_busy(live: LiveMap, numbers: range, pause_s: float = 0.0) -> None:
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
    time.sleep(pause_s)
    go_on.set()


@pytest.mark.parametrize("before", [0, 12], ids=["at the start", "later"])
def test_late_frames_are_in_the_map_at_the_end(tmp_path: Path, before: int) -> None:
    with LiveMap(tmp_path / "every", ENCODERS, up_in_world=UP, live=EVERY) as every:
        for number in range(before + 20):
            add(every, frame(number))
    with LiveMap(tmp_path / "late", ENCODERS, up_in_world=UP, live=LATER, settings=BuildSettings()) as live:
        for number in range(before):
            add(live, frame(number))
        wait_for(lambda: live.status().waiting == 0)
        while_busy(live, range(before, before + 8))  # one is fused, two wait, five are late
        for number in range(before + 8, before + 20):
            add(live, frame(number))
    status, made, wanted = live.status(), live.map.stored.voxels, every.map.stored.voxels
    assert status.dropped == {"late": 5} and status.late_kept == 5
    assert "5 late dropped; 5 of the late ones stored" in str(status)
    assert status.fused == before + 15 and status.encoded + status.encoded_later == status.frames_in == before + 20
    np.testing.assert_array_equal(made.index, wanted.index)
    np.testing.assert_array_equal(made.hits, wanted.hits)
    np.testing.assert_allclose(made.weight, wanted.weight, rtol=1e-5)
    np.testing.assert_allclose(made.feature, wanted.feature, atol=2e-3)


def test_the_first_frames_of_all_may_come_late(tmp_path: Path) -> None:
    with LiveMap(tmp_path / "map", ENCODERS, up_in_world=UP, live=LATER) as live:
        with live._door:  # nobody takes a frame meanwhile
            for number in range(6):
                one = frame(number)
                live.add_frame(one.rgb, one.depth_m, one.camera, one.world_from_camera, 2.0 * number)
        for number in range(6, 9):
            add(live, replace(frame(number), stamp_s=2.0 * number))
    assert live.status().late_kept == 4 and live.status().encoded_later >= 4
    made = open_stored(tmp_path / "map")
    assert made.info.recording.duration_s == pytest.approx(8.0)
    assert made.voxels.hits.sum() > 0 and live.status().fused == 5


def test_a_late_frame_that_the_encoder_fails_on_is_listed(tmp_path: Path) -> None:
    class FailsLater(Ones):
        def encode(self, frame: avlmaps.Frame) -> np.ndarray:
            # Not by its index: that is the map's, and frames that are late get one when there is time for them.
            assert frame.stamp_s < 1.15, "out of memory"
            return super().encode(frame)

    encoders = avlmaps.Encoders(pixels=FailsLater())
    with LiveMap(tmp_path / "late", encoders, up_in_world=UP, live=LATER) as live:
        for number in range(8):
            add(live, frame(number))
        wait_for(lambda: live.status().waiting == 0)
        while_busy(live, range(8, 16))
    bad = open_stored(tmp_path / "late").info.bad_frames
    assert bad and all("out of memory" in one.why for one in bad)


@pytest.mark.parametrize(("most", "kept"), [(256, live_map._MOST_LATE), (0, 0)])
def test_late_frames_in_memory_are_bounded(tmp_path: Path, most: int, kept: int) -> None:
    chosen = replace(LATER, kept_frames=most)
    with LiveMap(tmp_path / "map", ENCODERS, up_in_world=UP, live=chosen) as live:
        while_busy(live, range(30))
        assert len(live._late) <= kept
    status = live.status()
    assert status.dropped == {"late": 27} and status.late_kept == kept
    assert status.encoded + status.encoded_later == (3 + kept if most else status.encoded)


def test_up_and_the_floor_of_a_walk_that_doubled_are_found_behind(monkeypatch: pytest.MonkeyPatch) -> None:
    found: list[int] = []
    find = GrowingMap._upright_of

    def counted(self: GrowingMap, held: avlmaps.Recording) -> Any:
        found.append(len(held))
        return find(self, held)

    monkeypatch.setattr(GrowingMap, "_upright_of", counted)
    settings = BuildSettings(gravity=GravitySettings(frames=8))
    growing = GrowingMap(settings, ENCODERS, np.array(UP), looks_later=True)
    for number in range(20):
        growing.add(frame(number))
    assert found == [8], "in the first frames alone"
    ground = growing._ground
    made = growing.finish(growing.freeze())
    assert len(found) == 2 and growing._ground is not ground and made.info.counts.frames == 20
    growing.finish(growing.freeze())
    assert len(found) == 2


def test_a_frame_that_waited_too_long_is_encoded_later(tmp_path: Path) -> None:
    chosen = replace(LATER, looks=10_000, encoded_share=0.0, fresh_s=0.05)
    with LiveMap(tmp_path / "map", ENCODERS, up_in_world=UP, live=chosen) as live:
        for number in range(10):
            add(live, frame(number))  # who waits for the map is not late
        wait_for(lambda: live.status().encoded == 10)
        while_busy(live, range(10, 13), pause_s=0.1)
        wait_for(lambda: live.status().fused == 13)
        assert live.status().encoded == 10
    assert live.status().encoded_later == 3


def test_where_nothing_is_new_there_is_time_for_frames_of_before(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(live_map, "_CALM_S", 600.0)
    chosen = replace(LATER, known_views=2, new_share=0.2, still_m=0.0)
    with LiveMap(tmp_path / "map", ENCODERS, up_in_world=UP, live=chosen) as live:
        for number, at in enumerate([*range(18), *range(17, -1, -1)]):
            add(live, replace(frame(at), index=number, stamp_s=0.1 * number))
        wait_for(lambda: live.status().encoded_later > 0)
        assert live.status().dropped["known"] > 0 == live.status().dropped.get("still", 0)


def test_ctrl_c_while_it_ends_leaves_out_what_waits(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[str] = []
    shown: list[str] = []

    def bar(items: Iterable[None], label: str, *, total: int) -> Iterable[None]:
        shown.append(label)
        assert total > 0
        return items

    monkeypatch.setattr(live_map, "progress", bar)
    monkeypatch.setattr(live_map, "_CALM_S", 600.0)  # what waits is not looked at before the end
    live = LiveMap(tmp_path / "map", ENCODERS, up_in_world=UP, live=LATER)
    for number in range(14):
        add(live, frame(number, step_m=0.005))
    wait_for(lambda: live.status().encoded + live.status().kept == 14)
    look_again, calls = live._growing.look_again, list[int]()

    def slowly(one: avlmaps.Frame, *, is_fused: bool) -> None:
        if "encoding what waited" in shown and not calls:
            calls.append(one.index)
            _thread.interrupt_main()
        time.sleep(0.5)
        look_again(one, is_fused=is_fused)

    live._growing.look_again = slowly  # type: ignore[method-assign]
    within_s = time.monotonic()
    usual = signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored where the tests run behind a shell
    try:
        end_drive(live, said.append)
    finally:
        signal.signal(signal.SIGINT, usual)
    assert time.monotonic() - within_s < 60.0
    assert "frames wait" in said[0] and "are left out" in said[1] and len(said) == 2
    status = live.status()
    assert status.encoded + status.encoded_later < status.fused == 14 and status.unsaved_s == 0.0
    assert len(open_stored(tmp_path / "map").voxels) > 0
    assert live.close() is live.map


@given(st.lists(st.sampled_from(["came", "frozen", "saved"]), max_size=40))
def test_unsaved_is_the_oldest_that_no_save_has(events: list[str]) -> None:
    unsaved, saved_s, came, frozen = Unsaved(), float("nan"), [], []
    for now_s, event in enumerate(events):
        if event == "came":
            unsaved.note(now_s - 0.5)
            came.append(now_s - 0.5)
        elif event == "frozen":
            unsaved.freeze(now_s)
            frozen.append(now_s)
        elif frozen:
            saved_s = frozen.pop(0)
        left = [one for one in came if not one < saved_s]
        assert unsaved.since_s(saved_s) == (left[0] if left else None)


def test_a_quiet_map_has_nothing_unsaved(tmp_path: Path) -> None:
    chosen = LiveSettings(first_frames=1, known_views=100, new_share=0.0, kept_frames=0, snapshot_s=0.0, save_s=0.0)
    with LiveMap(tmp_path / "map", ENCODERS, up_in_world=UP, live=chosen) as live:
        assert live.status().unsaved_s == 0.0
        for number in range(20):
            add(live, frame(number))
        wait_for(lambda: len(live) == 20 and live.status().unsaved_s == 0.0)
        wait_for(lambda: live.status().saved_age_s > 0.5)
        assert live.status().unsaved_s == 0.0
        live._saver.write = lambda *args: (_ for _ in ()).throw(MapError("The disk is full."))  # type: ignore[method-assign]
        add(live, frame(20))
        wait_for(lambda: "The disk is full." in live.doubts)
        time.sleep(0.1)
        assert 0.1 <= live.status().unsaved_s <= live.status().saved_age_s
        del live._saver.write
        add(live, frame(21))
        wait_for(lambda: live.status().unsaved_s == 0.0)
        add(live, frame(22))
    assert live.status().unsaved_s == 0.0


@given(st.lists(st.tuples(st.floats(0.01, 1.0), st.booleans()), max_size=30), st.integers(0, 6))
def test_the_frames_that_are_worth_most_are_kept(worths: list[tuple[float, bool]], most: int) -> None:
    kept = KeptBack(most)
    for number, (worth, is_fused) in enumerate(worths):
        kept.keep(frame(number), worth, is_fused=is_fused)
    assert len(kept) == min(len(worths), most)
    taken = []
    while (one := kept.take()) is not None:
        taken.append(one)
    assert [worths[one.index][0] for one, _ in taken] == sorted((worth for worth, _ in worths), reverse=True)[:most]
    for one, is_fused in taken:
        assert is_fused == worths[one.index][1]
        np.testing.assert_array_equal(one.rgb, frame(one.index).rgb)
        np.testing.assert_array_equal(one.depth_m, frame(one.index).depth_m)


def test_a_full_disk_is_said_once_and_what_is_kept_stays() -> None:
    kept, whole, one = KeptBack(9), resource.getrlimit(resource.RLIMIT_FSIZE), frame(0)
    room = int(2.5 * (one.rgb.nbytes + one.depth_m.nbytes))  # of files: for two frames, and a part of a third
    resource.setrlimit(resource.RLIMIT_FSIZE, (room, whole[1]))
    try:
        for number in range(2):
            kept.keep(frame(number), 0.5 - 0.1 * number, is_fused=True)
        with pytest.raises(MapError, match="cannot be stored"):
            kept.keep(frame(2), 0.9, is_fused=True)
        kept.keep(frame(3), 0.9, is_fused=True)
        for number in range(2):
            taken, _ = kept.take() or pytest.fail("it is gone")
            np.testing.assert_array_equal(taken.rgb, frame(number).rgb)
            np.testing.assert_array_equal(taken.depth_m, frame(number).depth_m)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, whole)
    assert kept.take() is None


def test_kept_frames_give_the_disk_back_when_the_map_is_closed(tmp_path: Path) -> None:
    few = LiveSettings(known_views=2, new_share=0.2, still_m=0.0, looks=1, encoded_share=0.4, later_looks=10_000)
    live = drive_forth_and_back(tmp_path / "kept", few)
    assert live.status().encoded_later > 0 and live._kept._file is None
    live._kept.keep(frame(0), 1.0, is_fused=False)
    assert live._kept._file is None and live.status().kept == 0


def test_poses_that_stop_fitting_the_pictures_are_in_doubt_within_three_seconds() -> None:
    check = PoseCheck()
    assert not any(check.add(frame(number)) for number in range(40))
    slipping = [check.add(frame(number, seen_m=2.0 + 0.1 * (number - 40))) for number in range(40, 80)]
    said = [(number, sentence) for number, sentence in enumerate(slipping) if sentence]
    assert len(said) == 1 and 0.1 * said[0][0] <= 3.0
    assert "The poses do not fit the pictures from" in said[0][1][0]


def test_a_pose_that_jumps_is_said_at_once() -> None:
    check = PoseCheck()
    assert not any(check.add(frame(number)) for number in range(10))
    assert "The pose jumps at 1.00 s: 4" in str(check.add(replace(frame(90), stamp_s=1.0)))
    assert "Stamps jump by 3600 s, from 1.0 to 3601.0 s" in str(check.add(replace(frame(90), stamp_s=3601.0)))


def test_stamps_in_microseconds_are_said_once_and_by_their_unit() -> None:
    check = PoseCheck()
    said = [check.add(replace(frame(0), stamp_s=1e5 * number)) for number in range(9)]
    assert "Stamps jump by 100000 s" in str(said[1]) and "their stamps look like microseconds" in str(said[2])
    assert not any(said[3:])


@pytest.mark.parametrize("slow", [1.0, 0.2])  # as the robot drives, and as fast as a recording is read
@pytest.mark.parametrize("paused", [False, True])
def test_a_clock_of_frames_that_was_set_is_said(slow: float, paused: bool) -> None:
    check, passed_s, said = PoseCheck(), 0.0, []
    for number in range(60):
        jumped_s = 40.0 if number >= 40 else 0.0
        passed_s += slow * (0.1 + (40.0 if paused and number == 40 else 0.0))
        stamp_s = 0.1 * number + jumped_s
        said += check.add(replace(frame(0), stamp_s=stamp_s), arrived_s=passed_s)
    if slow < 1.0 or paused:
        assert not said
    else:
        assert "Stamps jump by 40.1 s, from 3.9 to 44.0 s, while 0.1 s passed" in said[0] and len(said) == 1


@pytest.mark.parametrize("slow", [1.04, 1.2, 1.0 / 1.2])  # read too slowly, or played faster than it was recorded
def test_a_reader_that_catches_up_in_a_pause_is_no_jump_of_the_clock(
    slow: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(PoseCheck, "_compared", lambda _: None)
    check, last_s, still = PoseCheck(), 400.0 if slow == 1.04 else 50.0, frame(0)
    for stamp_s in (*np.arange(0.0, last_s, 0.5), *np.arange(last_s + 40.0, last_s + 45.0, 0.5)):
        late_s = (slow - 1.0) * stamp_s if stamp_s < last_s or slow < 1.0 else 0.0
        assert not check.add(replace(still, stamp_s=float(stamp_s)), arrived_s=float(stamp_s + late_s))


def test_frames_that_were_held_up_on_their_way_are_no_jump_of_the_clock() -> None:
    check = PoseCheck()
    for number in range(80):  # one is 9 s late, those until it arrived are lost
        stamp_s = 0.1 * number + (9.0 if number > 40 else 0.0)
        late_s = 9.0 if number == 40 else 0.0
        assert not check.add(replace(frame(0), stamp_s=stamp_s), arrived_s=stamp_s + late_s)


@pytest.mark.parametrize(
    ("frames_s", "sound_s", "said"),
    [
        (40.0, 0.0, "The sound is 40 s behind the frames since 44.0 s, though it still comes"),
        (0.0, 40.0, "The stamps of the sound skip 40 s at 4.0 s of the frames"),
        (40.0, 40.0, ""),  # the robot paused
    ],
)
def test_one_clock_that_jumps_beside_the_other_is_said(frames_s: float, sound_s: float, said: str) -> None:
    check, found = PoseCheck(), []
    for number in range(80):
        later = number >= 40
        at_s = 0.1 * number + later * frames_s
        heard_s = 0.1 * (number + 1) + later * sound_s
        found += check.add(replace(frame(0), stamp_s=at_s), heard_s, later * sound_s)
    assert len(found) == bool(said) and all(said in one for one in found)


def test_a_sensor_that_stops_while_frames_come_is_a_doubt_of_the_map(tmp_path: Path) -> None:
    with LiveMap(tmp_path / "map", ENCODERS, up_in_world=UP) as live:
        for number in range(150):
            one = frame(number % 10)
            blind = np.full_like(one.depth_m, np.nan if number % 2 else 0.0) if number >= 20 else one.depth_m
            add(live, replace(one, depth_m=blind, stamp_s=0.1 * number))
            if number < 5:
                live.add_audio(avlmaps.Sound(np.sin(np.arange(1600, dtype=np.float32)), 16_000), 0.1 * number)
    (depth, sound) = live.doubts
    assert depth.startswith("Frames have no depth since 1.9 s") and sound.startswith("No sound came since 0.5 s")
    assert {depth, sound} <= set(open_stored(tmp_path / "map").info.doubts)


@pytest.mark.slow
def test_corrected_poses_move_a_live_map_and_are_no_jump(tmp_path: Path) -> None:
    chosen = BuildSettings(frames=FrameSettings(per_submap=4), gravity=GravitySettings(frames=8))
    frames = [frame(number) for number in range(50)]
    strayed = [np.array(one.world_from_camera) for one in frames]
    for number, pose in enumerate(strayed[:30]):
        pose[1, 3] += 0.02 * number
    with LiveMap(tmp_path / "live", ENCODERS, up_in_world=UP, settings=chosen, live=EVERY) as live:
        for one, pose in zip(frames[:30], strayed, strict=False):
            add(live, replace(one, world_from_camera=pose))
        wait_for(lambda: live.status().voxels > 0)
        with pytest.raises(MapError, match="of no frame"):
            live.correct_poses([99.0], np.eye(4)[None])
        right = np.stack([one.world_from_camera for one in frames[:30]])
        median_m, most_m = live.correct_poses([one.stamp_s for one in frames[:30]], right)
        for one in frames[30:]:
            add(live, one)
        generation = live.generation
        wait_for(lambda: live.generation > generation)
        assert not [doubt for doubt in live.doubts if "jumps" in doubt]
    assert (median_m, most_m) == (pytest.approx(0.29), pytest.approx(0.58))
    made = open_stored(tmp_path / "live")
    wanted = avlmaps.VoxelMap(encoders=ENCODERS, up_in_world=UP)
    for one in frames:
        wanted.add(one.rgb, one.depth_m, one.camera, one.world_from_camera, one.stamp_s)
    there = {tuple(index) for index in wanted.voxel_index.tolist()}
    found = [tuple(index) for index in np.asarray(made.voxels.index).tolist()]
    off = cKDTree(sorted(there)).query(found)[0]
    assert off.max() < 2.0 and np.mean(off == 0.0) > 0.75, "moved surfaces are resampled, none stays where it strayed"
    assert np.mean([index in set(found) for index in there]) > 0.95
    submaps = made.submaps()
    assert submaps is not None
    assert len(submaps.stamp_s) == 50


def test_a_live_map_without_submaps_follows_no_correction(tmp_path: Path) -> None:
    with LiveMap(tmp_path / "live", ENCODERS, up_in_world=UP, live=EVERY) as live:
        add(live, frame(0))
        with pytest.raises(MapError, match="submaps"):
            live.correct_poses([0.0], frame(0).world_from_camera[None])
    with pytest.raises(MapError, match="closed"):
        live.correct_poses([0.0], np.eye(4)[None])


def test_microphones_are_given_by_name_and_what_is_none_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"microphones are an avlmaps.Microphones, a name \(.*not 5"):
        LiveMap(tmp_path / "none", ENCODERS, microphones=5)  # pyright: ignore[reportArgumentType]
    assert not (tmp_path / "none").exists()
    with LiveMap(tmp_path / "map", ENCODERS, up_in_world=UP) as live:
        with pytest.raises(RecordingError, match="There are no microphones called 'circle'"):
            live.place_microphones("circle")
        live.place_microphones("square4")
        assert live.microphones is not None and len(live.microphones.position_m) == 4
        add(live, frame(0))
    with pytest.raises(MapError, match="is closed"):
        live.place_microphones("stereo")
