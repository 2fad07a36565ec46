"""A live map ends as a build does, answers meanwhile, and refuses what is no frame without losing anything."""

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from live_frames import CAMERA, ENCODERS, EVERY, UP, Ones, add, frame, recorded, wait_for, within

import avlmaps
from avlmaps.core.errors import AudioError, BackendError, MapError, RecordingError
from avlmaps.live.live_map import LiveMap
from avlmaps.live.replay import tell_doubts
from avlmaps.live.status import LiveSettings
from avlmaps.maps.build import build_map
from avlmaps.maps.mapper import Mapper
from avlmaps.maps.settings import BuildSettings, FrameSettings, GravitySettings
from avlmaps.maps.sources.find import SourceFinder
from avlmaps.maps.store.folder import read
from avlmaps.maps.store.map_data import MapData
from avlmaps.maps.types import SourceEvidence
from avlmaps.query.avlmap import AVLMap


def test_without_gates_the_end_is_the_build_of_the_same_frames(tmp_path: Path) -> None:
    recording = recorded(tmp_path / "rec", 25)
    settings = BuildSettings(frames=FrameSettings(per_part=10))
    built = build_map(recording, tmp_path / "built", ENCODERS, settings, progress=False, allow=["geometry", "colour"])
    with LiveMap(tmp_path / "live", ENCODERS, up_in_world=UP, settings=settings, live=EVERY) as live:
        for one in recording:
            add(live, one)
    made = read(tmp_path / "live")
    for field in fields(made.voxels):
        ours, theirs = getattr(made.voxels, field.name), getattr(built.voxels, field.name)
        np.testing.assert_allclose(ours, theirs, rtol=1e-3, atol=2e-3)
    np.testing.assert_array_equal(made.keyframes.stamp_s, built.keyframes.stamp_s)
    assert live.status().dropped == {} and len(live) == 25


def test_corrected_poses_move_what_came_and_a_closed_map_takes_none(tmp_path: Path) -> None:
    settings, shift = BuildSettings(frames=FrameSettings(per_submap=4)), np.eye(4)
    shift[0, 3] = 0.5
    moved = [replace(one, world_from_camera=shift @ one.world_from_camera) for one in map(frame, range(13))]
    corrected = np.array([one.stamp_s for one in moved[:12]]), np.stack([one.world_from_camera for one in moved[:12]])
    with LiveMap(tmp_path / "map", ENCODERS, up_in_world=UP, settings=settings, live=EVERY) as live:
        for number in range(12):
            add(live, frame(number))
        assert live.correct_poses(*corrected) == pytest.approx((0.5, 0.5))
        add(live, moved[12])
    with pytest.raises(MapError, match="is closed"):
        live.correct_poses(*corrected)
    assert len(live) == 13 and live.doubts == ()
    assert live.map.data.info.bounding_box_m.low[0] == pytest.approx(-0.5, abs=0.2)  # 1 m to the left of the first


def test_it_answers_from_other_threads_on_snapshots_that_do_not_change(tmp_path: Path) -> None:
    chosen = LiveSettings(first_frames=2, snapshot_s=0.0, new_share=0.0)
    faults: list[BaseException] = []
    done = threading.Event()

    def query() -> None:
        try:
            while not done.is_set():
                snapshot = live.map
                voxels = len(snapshot.points)
                live.ask(object="red")
                assert len(snapshot.points) == voxels
        except BaseException as fault:  # noqa: BLE001 - shown below
            faults.append(fault)

    with LiveMap(tmp_path / "map", ENCODERS, up_in_world=UP, live=chosen) as live:
        with pytest.raises(MapError, match="no surface yet"):
            live.ask("something red")
        for number in range(4):
            add(live, frame(number))
        wait_for(lambda: live.generation >= 1)
        first = live.map
        threads = [threading.Thread(target=query) for _ in range(2)]
        for thread in threads:
            thread.start()
        before = live.generation
        for number in range(4, 30):
            add(live, frame(number))
        wait_for(lambda: live.generation > before)
        done.set()
        for thread in threads:
            thread.join()
    assert not faults
    assert len(first.points) < len(live.map.points)


def test_frames_that_bring_nothing_are_dropped_by_reason(tmp_path: Path) -> None:
    with LiveMap(tmp_path / "map", ENCODERS, up_in_world=UP, live=LiveSettings(known_views=3)) as live:
        for number in range(12):
            add(live, replace(frame(0), stamp_s=0.1 * number))
        for number in range(12, 30):  # to the right, and back again
            add(live, replace(frame(number - 12), stamp_s=0.1 * number))
        for number in range(30, 48):
            add(live, replace(frame(47 - number), stamp_s=0.1 * number))
    dropped = live.status().dropped
    assert dropped["still"] >= 5 and dropped["known"] >= 5
    assert len(live) + sum(dropped.values()) == live.status().frames_in == 48


@pytest.mark.few(3)
@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (dict(stamp_s=0.5), r"at 0.5 s is out of order \(1.1 s\)"),
        (dict(stamp_s=1.1), "repeats the last frame"),
        (dict(rgb=np.zeros((30, 40, 3), np.uint8)), "40x30 pixels .* the camera 80x60"),
        (dict(camera=replace(CAMERA, fx=90.0)), "another camera"),
        (dict(depth_m=None), "must be an array of numbers, not NoneType"),
        (dict(world_from_camera=None), "must be an array of numbers, not NoneType"),
    ],
    ids=lambda one: next(iter(one)) if isinstance(one, dict) else "",
)
def test_what_is_no_next_frame_is_refused_and_costs_nothing(tmp_path: Path, wrong: dict, said: str) -> None:
    with LiveMap(tmp_path / "map", ENCODERS, up_in_world=UP, live=EVERY) as live:
        for number in range(12):
            add(live, frame(number))
        good = frame(12)
        names = ("rgb", "depth_m", "camera", "world_from_camera")
        parts = {name: getattr(good, name) for name in names} | {"stamp_s": 1.2}
        with pytest.raises(RecordingError, match=said):
            live.add_frame(**{**parts, **wrong})
        with pytest.raises(AudioError, match=r"must be an avlmaps\.Sound"):
            live.add_audio(np.zeros(3))
        live.add_frame(**parts, wait=True)
    assert len(live) == 13 and live.status().refused == 2


def test_a_second_writer_a_finished_map_and_an_empty_one_get_a_sentence(tmp_path: Path) -> None:
    with LiveMap(tmp_path / "map", ENCODERS, up_in_world=UP) as live:
        with pytest.raises(MapError, match="is being built by this program"):
            LiveMap(tmp_path / "map", ENCODERS)
        add(live, frame(0))
    with pytest.raises(MapError, match="is a finished map already"):
        LiveMap(tmp_path / "map", ENCODERS)
    with pytest.raises(MapError, match="is closed"):
        add(live, frame(1))
    with pytest.raises(MapError, match="No frame came"), LiveMap(tmp_path / "none", ENCODERS):
        pass
    with LiveMap(tmp_path / "map", ENCODERS, up_in_world=UP, overwrite=True) as again:
        add(again, frame(0))


def test_a_frame_that_an_encoder_fails_on_costs_no_other(tmp_path: Path) -> None:
    class Fails(Ones):
        calls = 0

        def encode(self, frame: avlmaps.Frame) -> np.ndarray:
            self.calls += 1
            if self.calls == 3:
                raise RuntimeError("out of memory")
            return super().encode(frame)

    faults: list[str] = []
    chosen = replace(EVERY, first_frames=1, gates=True, known_views=100, new_share=0.0)
    with LiveMap(tmp_path / "m", avlmaps.Encoders(pixels=Fails()), up_in_world=UP, live=chosen) as live:
        for number in range(8):
            try:
                add(live, frame(number))
            except BackendError as fault:
                faults.append(str(fault))
            wait_for(lambda: live.status().waiting == 0)
    info = read(tmp_path / "m").info
    assert len(faults) == 1 and "out of memory" in faults[0]
    assert info.counts.frames == 7
    assert [(bad.index, bad.why) for bad in info.bad_frames] == [(2, faults[0])]
    assert "1 of 8 frames were left out (bad_frames in map.json says why)." in info.notices


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_a_fault_of_ours_ends_the_waiting_and_is_raised(tmp_path: Path) -> None:
    with LiveMap(tmp_path / "m.avlmap", ENCODERS, up_in_world=UP, live=EVERY) as live:
        for number in range(3):
            add(live, frame(number))
        wait_for(lambda: len(live) == 3)
        live._check.add = lambda *_: 1 // 0  # type: ignore[method-assign]
        with pytest.raises(ZeroDivisionError):
            for number in range(3, 30):
                add(live, frame(number))
        with pytest.raises(ZeroDivisionError):
            add(live, frame(31))
    assert live.map.data.info.counts.frames == 3


@pytest.mark.nightly
def test_maps_that_are_closed_at_any_moment_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(0)

    show = LiveMap._show

    def slowly(live: LiveMap, *of: Any) -> None:
        time.sleep(0.01)  # between two steps of the hand-over, where a map may be closed
        show(live, *of)

    monkeypatch.setattr(LiveMap, "_show", slowly)
    chosen = LiveSettings(gates=False, snapshot_s=0.0, save_s=1e9)
    settings = BuildSettings(frames=FrameSettings(per_part=10))
    few = avlmaps.Encoders()  # neither keyframes nor pixels: the threads do little else than hand over

    def live_shortly() -> None:
        live = LiveMap(tmp_path / "map", few, up_in_world=UP, settings=settings, live=chosen, overwrite=True)
        for number in range(int(rng.integers(1, 4))):
            add(live, frame(number))
        time.sleep(float(rng.uniform(0.0, 0.02)))
        live.close()

    for _ in range(8):
        within(60.0, live_shortly)


def breaks(*_: object, **__: object) -> Any:
    raise ZeroDivisionError("division by zero")


@pytest.mark.few(1)
@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
@pytest.mark.parametrize("lost", [2, 0], ids=["the one that fuses", "the one behind"])
def test_a_thread_that_breaks_while_closing_is_told_and_its_map_is_written(tmp_path: Path, lost: int) -> None:
    live = LiveMap(
        tmp_path / "map", ENCODERS, up_in_world=UP, live=LiveSettings(first_frames=1, known_views=100, new_share=0.0)
    )
    for number in range(3):
        add(live, frame(number))
    wait_for(lambda: len(live) == 3)
    if lost:
        live._check.add = breaks  # type: ignore[method-assign]
    else:
        live._publish = breaks  # type: ignore[method-assign]
        wait_for(lambda: live._broken is not None)
    with live._door:  # nobody takes these before it is closed
        for number in range(3, 3 + lost):
            one = frame(number)
            live.add_frame(one.rgb, one.depth_m, one.camera, one.world_from_camera, one.stamp_s)
    with pytest.raises(MapError, match=rf"\(ZeroDivisionError: division by zero\); .* with 3 frames, and {lost} that"):
        live.close()
    assert live.close().data.info.counts.frames == 3 == read(tmp_path / "map").info.counts.frames


@pytest.mark.nightly
def test_an_end_that_breaks_is_a_sentence_and_what_was_saved_stays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    chosen = LiveSettings(first_frames=1, known_views=100, new_share=0.0, snapshot_s=0.0, save_s=0.0)
    live = LiveMap(tmp_path / "map", ENCODERS, up_in_world=UP, live=chosen)
    for number in range(3):
        add(live, frame(number))
    wait_for(lambda: live.status().saved_age_s >= 0.0)
    with monkeypatch.context() as patch:
        patch.setattr(Mapper, "finish", breaks)
        with pytest.raises(MapError, match=r"could not be finished \(ZeroDivisionError: division by zero\)"):
            live.close()
    assert read(tmp_path / "map").info.counts.frames > 0
    assert live.close().data.info.counts.frames == 3


def test_sounds_are_in_the_map_with_the_frames(tmp_path: Path) -> None:
    ears = avlmaps.Encoders.named("colours", sounds="embedded")
    samples = np.random.default_rng(0).normal(scale=1e-3, size=64_000).astype(np.float32)
    samples[16_000:24_000] += 0.3 * np.sin(np.arange(8_000) / 4.0).astype(np.float32)
    with LiveMap(tmp_path / "map", ears, up_in_world=UP, live=EVERY) as live:
        for number in range(40):
            add(live, frame(number))
            live.add_audio(avlmaps.Sound(samples[1600 * number : 1600 * (number + 1)], 16_000), 0.1 * number)
    (heard,) = live.map.data.sounds.onset_s
    assert heard == pytest.approx(1.0, abs=0.1)


def test_a_sound_has_its_name_before_its_source_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    may_locate, locate = threading.Event(), SourceFinder.find_next

    def located_when_it_may(self: SourceFinder, *args: Any) -> SourceEvidence | None:
        may_locate.wait(20.0)
        return locate(self, *args)

    def snapshot_with(is_so: Callable[[MapData], bool]) -> AVLMap:
        until_s = time.monotonic() + 20.0
        while time.monotonic() < until_s:
            if live.generation and is_so(live.map.data):
                return live.map
            time.sleep(0.01)
        raise AssertionError("no such snapshot was published")

    monkeypatch.setattr(SourceFinder, "find_next", located_when_it_may)
    ears = avlmaps.Encoders.named("colours", sounds="embedded")
    rng = np.random.default_rng(0)
    source = rng.normal(scale=1e-3, size=64_100)
    source[16_000:24_000] += 0.3 * rng.normal(size=8_000)
    two = np.stack([source[100:], source[95:-5]]).astype(np.float32)
    few = BuildSettings(gravity=GravitySettings(frames=8))
    with LiveMap(tmp_path / "map", ears, up_in_world=UP, live=EVERY, settings=few, microphones="stereo") as live:
        for number in range(40):
            add(live, frame(number))
            piece = slice(1600 * number, 1600 * (number + 1))
            live.add_audio(avlmaps.ChannelSound(two[:, piece], 16_000), 0.1 * number)
        named = snapshot_with(lambda stored: len(stored.sounds) == 1)
        assert named.data.sources_wait == 1 and not may_locate.is_set()
        assert "1 wait; ask again" in " ".join(named.ask("where does the last sound come from?").notes)
        with pytest.raises(avlmaps.QueryError, match="1 wait; ask again in a moment"):
            named.sources()
        may_locate.set()
        located = snapshot_with(lambda stored: len(stored.sounds) == 1 and not stored.sources_wait)
        assert len(located.sources()) == 1 and not located.ask("where does the last sound come from?").notes
    sources = live.map.data.sources
    assert sources is not None and len(sources) == 1 and sources.heard.any()


def test_channels_that_are_not_the_microphones_and_directions_out_of_order_cost_nothing(tmp_path: Path) -> None:
    with LiveMap(tmp_path / "map", ENCODERS, up_in_world=UP, live=EVERY, microphones="square4") as live:
        add(live, frame(0))
        four = avlmaps.ChannelSound(np.zeros((4, 1600), np.float32), 16_000)
        live.add_audio(four, 0.0)
        for chunk, said in (
            (avlmaps.ChannelSound(four.samples[:2], 16_000), "2 channel.s., but 4 microphone.s. are described"),
            (avlmaps.Sound(four.samples[0], 16_000), "in 1 channel.s.; 16000 in 4"),
            (avlmaps.ChannelSound(four.samples, 8_000), "8000 samples a second in 4 channel.s.; 16000"),
        ):
            with pytest.raises(avlmaps.AudioError, match=said):
                live.add_audio(chunk)
        live.add_directions(0.1, 1.5)
        live.add_directions([0.2, 0.3], [1.5, -1.5])
        for stamp_s, azimuth_rad, said in (
            (0.3, 1.0, "0.300 s, and one of 0.300 s came before"),
            ([0.5, 0.4], [1.0, 1.0], "stamps must rise"),
            (0.5, 90.0, "look like degrees"),
            ([0.5, 0.6], [1.0], "as many numbers as there are stamps"),
            (0.5, None, "azimuth_rad is None"),
            (0.5, "left", "azimuth_rad is 'left'"),
        ):
            with pytest.raises(avlmaps.RecordingError, match=said):
                live.add_directions(stamp_s, azimuth_rad)
        with pytest.raises(avlmaps.AudioError, match="before the first piece"):
            live.place_microphones(avlmaps.Microphones(np.zeros((1, 3))))
        assert live.status().refused == 9
        live.add_audio(four)
        live.add_directions(0.5, 1.0)
        track = live._mapper.hearing.came
        assert track is not None and (track.end_s, track.channels) == (0.2, 4)
        assert not live.doubts


def test_one_channel_of_several_microphones_is_a_doubt_and_several_without_places_are_mixed(tmp_path: Path) -> None:
    with LiveMap(tmp_path / "one", ENCODERS, up_in_world=UP, live=EVERY, microphones="stereo") as live:
        add(live, frame(0))
        live.add_audio(avlmaps.Sound(np.zeros(1600, np.float32), 16_000))
        assert "one channel, and 2 microphones" in live.doubts[0]
        told: list[str] = []
        known: set[str] = set()
        for one in ("", "a save failed"):
            if one:
                live._doubt(one)
            tell_doubts(live, known, told.append)
        assert [one[:16] for one in told] == ["note: The sound ", "note: a save fai"]
    with LiveMap(tmp_path / "two", ENCODERS, up_in_world=UP, live=EVERY) as live:
        add(live, frame(0))
        live.add_audio(avlmaps.ChannelSound(np.array([[0.5] * 9, [0.1] * 9], np.float32), 16_000))
        track = live._mapper.hearing.came
        assert track is not None and track.track is not None and track.channels == 1
        np.testing.assert_allclose(track.track.read().samples, 0.3, atol=1e-6)
    with pytest.raises(avlmaps.RecordingError, match="no microphones called 'cube9'"):
        LiveMap(tmp_path / "three", ENCODERS, microphones="cube9")
    assert not (tmp_path / "three").exists()


KILLED = """
import os, sys
sys.path[:0] = {path!r}
from live_frames import ENCODERS, UP, add, frame
from avlmaps.live.live_map import LiveMap
from avlmaps.live.status import LiveSettings
chosen = LiveSettings(first_frames=2, snapshot_s=0.0, save_s=0.0, new_share=0.0)
for folder in sys.argv[1:]:
    if process := os.fork():  # it has what was imported
        print("process", process, flush=True)
        os.waitpid(process, 0)
        continue
    live = LiveMap(folder, ENCODERS, up_in_world=UP, live=chosen)
    for number in range(100_000):
        add(live, frame(number))
        if live.status().saved_age_s >= 0.0:
            print("saved", flush=True)
"""


@pytest.mark.nightly
def test_what_a_kill_leaves_is_a_whole_map(tmp_path: Path) -> None:
    rng, folders = np.random.default_rng(1), [tmp_path / "map0", tmp_path / "map1"]
    command = [sys.executable, "-c", KILLED.format(path=[str(Path(__file__).parent)]), *map(str, folders)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        for _ in folders:
            child = next(int(line.split()[1]) for line in process.stdout if line.startswith("process"))
            assert process.stdout.readline() == "saved\n"
            time.sleep(float(rng.uniform(0.0, 0.5)))
            os.kill(child, signal.SIGKILL)
    for folder in folders:
        left = read(folder)
        assert len(left.voxels) > 0 and avlmaps.open_map(folder).object("red").peak >= 0.0
        with LiveMap(folder, ENCODERS, up_in_world=UP, overwrite=True) as again:  # the lock went with the process
            add(again, frame(0))
