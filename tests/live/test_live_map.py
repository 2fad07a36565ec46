"""A live map ends as a build does, answers meanwhile, and refuses what is no frame without losing anything."""

import _thread
import os
import resource
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterable
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

import avlmaps
from avlmaps.core.errors import AudioError, BackendError, MapError, RecordingError
from avlmaps.live import live_map
from avlmaps.live.gates import EncodingGate, Gates
from avlmaps.live.kept_back import KeptBack
from avlmaps.live.live_map import LiveMap
from avlmaps.live.pose_check import PoseCheck
from avlmaps.live.replay import end_drive, tell_doubts
from avlmaps.live.saver import Unsaved
from avlmaps.live.settings import LiveSettings
from avlmaps.live.status import Tally
from avlmaps.maps.build import build_map
from avlmaps.maps.fusion.accumulator import VoxelAccumulator
from avlmaps.maps.fusion.sensor import FusionSettings
from avlmaps.maps.grid import GridSpec
from avlmaps.maps.growing import GrowingMap
from avlmaps.maps.settings import BuildSettings, FrameSettings, GravitySettings
from avlmaps.maps.sources.growing import GrowingSources
from avlmaps.maps.store.reader import StoredMap, open_stored
from avlmaps.maps.types import SourceEvidence
from avlmaps.query.avlmap import AVLMap

ENCODERS = avlmaps.Encoders.named("colours")
CAMERA = avlmaps.Pinhole(80.0, 80.0, 40.0, 30.0, 80, 60)
UP = (0.0, 0.0, 1.0)
EVERY = LiveSettings(gates=False)


def frame(number: int, *, step_m: float = 0.05, seen_m: float | None = None) -> avlmaps.Frame:
    """Return what a camera sees that goes along a wavy, coloured wall 2 m away.

    Args:
        number: of the frame, ten a second.
        step_m: from frame to frame, as its pose says.
        seen_m: where it really is; by default where its pose says.
    """
    pose = np.eye(4)
    pose[:3, :3] = [[1, 0, 0], [0, 0, 1], [0, -1, 0]]
    pose[0, 3] = number * step_m
    x_m = pose[0, 3] if seen_m is None else seen_m
    slope, depth = (np.arange(80) + 0.5 - 40.0) / 80.0, np.full(80, 2.0)
    for _ in range(12):  # where each ray meets the wall: a true one, or every check looks for what is wrong with it
        depth = 2.0 + 0.25 * np.sin(4.0 * (x_m + slope * depth))
    along, depth = x_m + slope * depth, np.tile(depth, (60, 1)).astype(np.float32)
    shade = (127.0 + 120.0 * np.sin(9.0 * along)).astype(np.uint8)
    rgb = np.stack([np.tile(shade, (60, 1)), np.full((60, 80), 60, np.uint8), np.tile(255 - shade, (60, 1))], axis=-1)
    rig = avlmaps.Rig(CAMERA, CAMERA)
    return avlmaps.Frame(number, f"{number:06d}", 0.1 * number, rgb, depth, pose, rig)


def add(live: LiveMap, one: avlmaps.Frame, **parts: object) -> None:
    live.add_frame(one.rgb, one.depth_m, one.camera, one.world_from_camera, one.stamp_s, wait=True, **parts)


def recorded(folder: Path, frames: int) -> avlmaps.Recording:
    with avlmaps.RecordingWriter(folder, frame(0).rig, np.array(UP)) as writer:
        for number in range(frames):
            writer.add(frame(number))
    return avlmaps.open_recording(folder)


def wait_for(condition, seconds: float = 60.0) -> None:
    end_s = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end_s, "it did not happen"
        time.sleep(0.01)


def test_without_gates_the_end_is_the_build_of_the_same_frames_bit_by_bit(tmp_path: Path) -> None:
    recording = recorded(tmp_path / "rec", 25)
    settings = BuildSettings(frames=FrameSettings(per_part=10))
    built = build_map(recording, tmp_path / "built", ENCODERS, settings, progress=False, allow=["geometry", "colour"])
    with LiveMap(tmp_path / "live", ENCODERS, up_in_world=UP, settings=settings, live=EVERY) as live:
        for one in recording:
            add(live, one)
    made = open_stored(tmp_path / "live", verify=True)
    for field in fields(made.voxels):
        np.testing.assert_array_equal(getattr(made.voxels, field.name), getattr(built.voxels, field.name))
    np.testing.assert_array_equal(made.keyframes.stamp_s, built.keyframes.stamp_s)
    assert live.status().dropped == {} and len(live) == 25


def test_it_answers_from_other_threads_on_snapshots_that_do_not_change(tmp_path: Path) -> None:
    chosen = LiveSettings(first_frames=2, snapshot_s=0.0, new_share=0.0)
    faults: list[BaseException] = []
    done = threading.Event()

    def query() -> None:
        try:
            while not done.is_set():
                snapshot = live.map
                voxels = len(snapshot.points)
                live.ask("something red")
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


def test_late_frames_are_dropped_and_counted(tmp_path: Path) -> None:
    with LiveMap(tmp_path / "map", ENCODERS, up_in_world=UP, live=EVERY) as live:
        for number in range(40):
            one = frame(number)
            live.add_frame(one.rgb, one.depth_m, one.camera, one.world_from_camera, one.stamp_s)
    status = live.status()
    assert status.fused + status.dropped.get("late", 0) == status.frames_in == 40


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (dict(stamp_s=0.5), r"at 0.5 s is out of order \(1.1 s\)"),
        (dict(stamp_s=1.1), "repeats the last frame"),
        (dict(rgb=np.zeros((30, 40, 3), np.uint8)), "has 40x30 pixels, its camera 80x60"),
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
        parts = dict(
            rgb=good.rgb,
            depth_m=good.depth_m,
            camera=good.camera,
            world_from_camera=good.world_from_camera,
            stamp_s=1.2,
        )
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


class Ones:
    """Encodes everything alike."""

    def encode(self, frame: avlmaps.Frame) -> np.ndarray:
        return np.ones((6, 8, 1), np.float32)

    def encode_words(self, words: list[str]) -> np.ndarray:
        return np.ones((len(words), 1), np.float32)


def test_a_frame_that_an_encoder_fails_on_costs_no_other(tmp_path: Path) -> None:
    class Fails(Ones):
        calls = 0

        def encode(self, frame: avlmaps.Frame) -> np.ndarray:
            self.calls += 1
            if self.calls == 3:
                raise RuntimeError("out of memory")
            return super().encode(frame)

    faults: list[str] = []
    with LiveMap(tmp_path / "m", avlmaps.Encoders(pixels=Fails()), up_in_world=UP, live=EVERY) as live:
        for number in range(8):
            try:
                add(live, frame(number))
            except BackendError as fault:
                faults.append(str(fault))
            wait_for(lambda: live.status().waiting == 0)
    info = open_stored(tmp_path / "m").info
    assert len(faults) == 1 and "out of memory" in faults[0]
    assert info.counts.frames == 7
    assert [(bad.index, bad.why) for bad in info.bad_frames] == [(2, faults[0])]
    assert "1 of 8 frames were left out (bad_frames in map.json says why)." in info.notices


def test_late_frames_of_an_encoder_that_always_fails_end_with_a_sentence(tmp_path: Path) -> None:
    class Fails(Ones):
        def encode(self, frame: avlmaps.Frame) -> np.ndarray:
            raise RuntimeError("out of memory")

    live = LiveMap(tmp_path / "m", avlmaps.Encoders(pixels=Fails()), up_in_world=UP)
    with live._door:  # nobody takes a frame meanwhile
        for number in range(4):
            one = frame(number)
            live.add_frame(one.rgb, one.depth_m, one.camera, one.world_from_camera, one.stamp_s)
    wait_for(lambda: live.status().kept > 0)
    with pytest.raises(MapError, match="No frame came"):
        live.close()
    assert live._broken is None


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
    assert live.map.stored.info.counts.frames == 3


def within(seconds: float, work: Callable[[], object]) -> None:
    """Do work in a thread, and fail where it does not end: a hand-over that lost its answer waits for ever."""
    faults: list[BaseException] = []

    def watched() -> None:
        try:
            work()
        except BaseException as fault:  # noqa: BLE001 - raised below
            faults.append(fault)

    thread = threading.Thread(target=watched, daemon=True)
    thread.start()
    thread.join(seconds)
    assert not thread.is_alive(), f"it did not end within {seconds:g} s"
    if faults:
        raise faults[0]


def test_maps_that_are_closed_at_any_moment_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(0)

    def of_a_slow_thread(tally: Tally, what: str) -> int:
        if threading.current_thread().name == "avlmaps-behind":
            time.sleep(0.01)  # between two steps of the hand-over, where a map may be closed
        return tally._counts[what]

    monkeypatch.setattr(Tally, "of", of_a_slow_thread)
    chosen = LiveSettings(gates=False, snapshot_s=0.0, save_s=1e9)
    settings = BuildSettings(frames=FrameSettings(per_part=10))
    few = avlmaps.Encoders()  # neither keyframes nor pixels: the threads do little else than hand over

    def live_shortly() -> None:
        live = LiveMap(tmp_path / "map", few, up_in_world=UP, settings=settings, live=chosen, overwrite=True)
        for number in range(int(rng.integers(1, 4))):
            add(live, frame(number))
        time.sleep(float(rng.uniform(0.0, 0.02)))
        live.close()

    for _ in range(25):
        within(60.0, live_shortly)


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
@pytest.mark.parametrize("part", ["freeze", "finish"])
def test_a_thread_that_breaks_between_two_snapshots_leaves_nobody_waiting(tmp_path: Path, part: str) -> None:
    live = LiveMap(tmp_path / "map", ENCODERS, up_in_world=UP, live=LiveSettings(gates=False, first_frames=1))
    setattr(live._growing, part, lambda *args, **kwargs: 1 // 0)

    def add_until_it_is_said() -> None:
        for number in range(100_000):
            add(live, frame(number))

    with pytest.raises(ZeroDivisionError):
        within(60.0, add_until_it_is_said)
    delattr(live._growing, part)
    within(60.0, live.close)
    assert live.map.stored.info.counts.frames == len(live) > 0


def breaks(*_: object, **__: object) -> Any:
    raise ZeroDivisionError("division by zero")


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
@pytest.mark.parametrize("lost", [2, 0], ids=["the one that fuses", "the one behind"])
def test_a_thread_that_breaks_while_closing_is_told_and_its_map_is_written(tmp_path: Path, lost: int) -> None:
    live = LiveMap(tmp_path / "map", ENCODERS, up_in_world=UP, live=EVERY)
    for number in range(3):
        add(live, frame(number))
    wait_for(lambda: len(live) == 3)
    if lost:
        live._check.add = breaks  # type: ignore[method-assign]
    else:
        live._what_came = breaks  # type: ignore[method-assign]
        wait_for(lambda: live._broken is not None)
    with live._door:  # nobody takes these before it is closed
        for number in range(3, 3 + lost):
            one = frame(number)
            live.add_frame(one.rgb, one.depth_m, one.camera, one.world_from_camera, one.stamp_s)
    with pytest.raises(MapError, match=rf"\(ZeroDivisionError: division by zero\); .* with 3 frames, and {lost} that"):
        live.close()
    assert live.close().stored.info.counts.frames == 3 == open_stored(tmp_path / "map", verify=True).info.counts.frames


def test_an_end_that_breaks_is_a_sentence_and_what_was_saved_stays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    chosen = LiveSettings(first_frames=1, known_views=100, new_share=0.0, snapshot_s=0.0, save_s=0.0)
    live = LiveMap(tmp_path / "map", ENCODERS, up_in_world=UP, live=chosen)
    for number in range(3):
        add(live, frame(number))
    wait_for(lambda: live.status().saved_age_s >= 0.0)
    with monkeypatch.context() as patch:
        patch.setattr(GrowingMap, "stored", breaks)
        with pytest.raises(MapError, match=r"could not be finished \(ZeroDivisionError: division by zero\)"):
            live.close()
    assert open_stored(tmp_path / "map", verify=True).info.counts.frames > 0
    assert live.close().stored.info.counts.frames == 3


def test_a_process_does_not_end_while_questions_are_prepared(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    prepares: list[threading.Thread] = []
    monkeypatch.setattr(live_map, "_warm", lambda made: prepares.append(threading.current_thread()))
    with LiveMap(tmp_path / "map", ENCODERS, up_in_world=UP, live=LiveSettings(first_frames=1, snapshot_s=0.0)) as live:
        add(live, frame(0))
        wait_for(lambda: len(prepares) == 1)
    assert prepares[0].name == "avlmaps-warm" and not prepares[0].daemon


def test_sounds_are_in_the_map_with_the_frames(tmp_path: Path) -> None:
    ears = avlmaps.Encoders.named("colours", sounds="embedded")
    samples = np.random.default_rng(0).normal(scale=1e-3, size=64_000).astype(np.float32)
    samples[16_000:24_000] += 0.3 * np.sin(np.arange(8_000) / 4.0).astype(np.float32)
    with LiveMap(tmp_path / "map", ears, up_in_world=UP, live=EVERY) as live:
        for number in range(40):
            add(live, frame(number))
            live.add_audio(avlmaps.Sound(samples[1600 * number : 1600 * (number + 1)], 16_000), 0.1 * number)
    (heard,) = live.map.stored.sounds.onset_s
    assert heard == pytest.approx(1.0, abs=0.1)


def test_a_sound_has_its_name_before_its_source_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    may_locate, locate = threading.Event(), GrowingSources.until_now

    def located_when_it_may(self: GrowingSources, *args: Any) -> SourceEvidence | None:
        may_locate.wait(20.0)
        return locate(self, *args)

    def snapshot_with(is_so: Callable[[StoredMap], bool]) -> AVLMap:
        until_s = time.monotonic() + 20.0
        while time.monotonic() < until_s:
            if live.generation and is_so(live.map.stored):
                return live.map
            time.sleep(0.01)
        raise AssertionError("no such snapshot was published")

    monkeypatch.setattr(GrowingSources, "until_now", located_when_it_may)
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
        assert named.stored.arrays.sources_wait == 1 and not may_locate.is_set()
        assert "1 wait; ask again" in " ".join(named.ask("where does the last sound come from?").notes)
        with pytest.raises(avlmaps.QueryError, match="1 wait; ask again in a moment"):
            named.sources()
        may_locate.set()
        located = snapshot_with(lambda stored: len(stored.sounds) == 1 and not stored.arrays.sources_wait)
        assert len(located.sources()) == 1 and not located.ask("where does the last sound come from?").notes
    sources = live.map.stored.sources()
    assert sources is not None and len(sources) == 1 and sources.heard.any()


def test_channels_that_are_not_the_microphones_and_directions_out_of_order_cost_nothing(tmp_path: Path) -> None:
    with LiveMap(tmp_path / "map", ENCODERS, up_in_world=UP, live=EVERY, microphones="square4") as live:
        add(live, frame(0))
        four = avlmaps.ChannelSound(np.zeros((4, 1600), np.float32), 16_000)
        live.add_audio(four, 0.0)
        for chunk, said in (
            (avlmaps.ChannelSound(four.samples[:2], 16_000), "2 channel.s., but 4 microphone.s. are described"),
            (avlmaps.Sound(four.samples[0], 16_000), "1 channel.s., those before 4"),
            (avlmaps.ChannelSound(four.samples, 8_000), "8000 samples a second, those before 16000"),
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
        track = live._growing.sound_track
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
        track = live._growing.sound_track
        assert track is not None and track.track is not None and track.channels == 1
        np.testing.assert_allclose(track.track.read().samples, 0.3, atol=1e-6)
    with pytest.raises(avlmaps.RecordingError, match="no microphones called 'cube9'"):
        LiveMap(tmp_path / "three", ENCODERS, microphones="cube9")
    assert not (tmp_path / "three").exists()


KILLED = """
import os, sys
sys.path[:0] = {path!r}
from test_live_map import ENCODERS, UP, add, frame
from avlmaps.live.live_map import LiveMap
from avlmaps.live.settings import LiveSettings
from avlmaps.live.status import Tally
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


@pytest.mark.slow
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
        left = open_stored(folder, verify=True)
        assert len(left.voxels) > 0 and avlmaps.open_map(folder).object("red").peak >= 0.0
        with LiveMap(folder, ENCODERS, up_in_world=UP, overwrite=True) as again:  # the lock went with the process
            add(again, frame(0))


# Gates and poses


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
    made = open_stored(tmp_path / "map", verify=True)
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
    assert len(open_stored(tmp_path / "map", verify=True).voxels) > 0
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
@settings(max_examples=30, deadline=None)
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
