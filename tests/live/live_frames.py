"""A camera along a coloured wall, for the tests of live maps."""

import threading
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import avlmaps
from avlmaps.live.live_map import LiveMap
from avlmaps.live.status import LiveSettings

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


class Ones:
    """Encodes everything alike."""

    def encode(self, frame: avlmaps.Frame) -> np.ndarray:
        return np.ones((6, 8, 1), np.float32)

    def encode_words(self, words: list[str]) -> np.ndarray:
        return np.ones((len(words), 1), np.float32)


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
