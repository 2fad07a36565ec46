"""A recording that is played into a live map, and what that took."""

import os
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import cycle
from pathlib import Path

import numpy as np

from avlmaps.core.errors import QueryError
from avlmaps.live.live_map import LiveMap
from avlmaps.live.replay import Ears
from avlmaps.live.settings import LiveSettings
from avlmaps.live.status import LiveStatus
from avlmaps.perception.encoders import Encoders
from avlmaps.recordings.types import Frame, Recording

QUESTIONS = ("the sofa", "the door", "a plant", "where can I sit?", "the table", "the chair near the table")
_THREADS = {"fusing": "avlmaps-fuse", "snapshots": "avlmaps-behind"}


@dataclass
class Played:
    """What a drive took.

    ``processor_ms`` is that of a frame, by thread; ``all`` has reading and questions in it. A kill would have lost
    things of at most ``unsaved_s``. Each lap has voxels, keyframes, frames fused until then, and resident MB.
    """

    frames: int = 0
    seconds: float = 0.0
    close_s: float = 0.0
    status: LiveStatus | None = None
    asked_ms: list[float] = field(default_factory=list)
    processor_ms: dict[str, float] = field(default_factory=dict)
    unsaved_s: float = 0.0
    laps: list[tuple[int, int, int, int]] = field(default_factory=list)
    load: float = 0.0


def play(
    recording: Recording, path: Path, used: Encoders, *, rate: float | None, laps: int = 1, settings: LiveSettings
) -> Played:
    """Play a recording into a map and close it; lap after lap it goes forth and back over the same surface.

    A ``rate`` of None waits for the map.
    """
    found, over = Played(), threading.Event()
    track = recording.audio
    live = LiveMap(
        path, used, up_in_world=recording.up_in_world, live=settings, overwrite=True,
        microphones=None if track is None else track.microphones,
    )  # fmt: skip
    ears = Ears(track, live)
    person = threading.Thread(target=_ask, args=(live, over, found.asked_ms))
    person.start()
    begin_s, begin_cpu_s = time.perf_counter(), time.process_time()
    try:
        for frame, stamp_s, ends_lap in _frames(recording, laps):
            if rate is not None:
                since_s = stamp_s - float(recording.stamps_s[0])
                time.sleep(max(0.0, begin_s + since_s / rate - time.perf_counter()))
            live.add_frame(frame.rgb, frame.depth_m, frame.rig, frame.world_from_camera, stamp_s, wait=rate is None)
            ears.hear(stamp_s)
            status = live.status()
            found.frames += 1
            found.unsaved_s = max(found.unsaved_s, status.unsaved_s)
            if ends_lap:
                found.laps.append((status.voxels, status.keyframes, status.fused, round(status.memory_mb)))
        found.seconds, cpu_s = time.perf_counter() - begin_s, time.process_time() - begin_cpu_s
        found.status, found.load = live.status(), os.getloadavg()[0]
        found.processor_ms = {"all": 1e3 * cpu_s / found.frames}
        for name, thread in _THREADS.items():
            found.processor_ms[name] = 1e3 * _processor_s(thread) / found.frames
    finally:
        over.set()
        person.join()
        end_s = time.perf_counter()
        live.close()
        found.close_s = time.perf_counter() - end_s
    return found


def _frames(recording: Recording, laps: int) -> Iterator[tuple[Frame, float, bool]]:
    stamps_s = recording.stamps_s
    lap_s = recording.duration_s + float(np.median(np.diff(stamps_s)))
    for lap in range(laps):
        order = range(len(recording)) if lap % 2 == 0 else range(len(recording) - 1, -1, -1)
        for number, index in enumerate(order):
            since_s = abs(float(stamps_s[index] - stamps_s[order[0]]))
            stamp_s = float(stamps_s[index]) if lap == 0 else float(stamps_s[0]) + lap * lap_s + since_s
            yield recording.frame(index), stamp_s, number == len(recording) - 1


def _ask(live: LiveMap, over: threading.Event, took_ms: list[float]) -> None:
    questions = cycle(QUESTIONS)
    while not over.wait(0.5):
        if live.generation:
            begin_s = time.perf_counter()
            with suppress(QueryError):  # an encoder that knows other words
                live.ask(next(questions))
            took_ms.append(1e3 * (time.perf_counter() - begin_s))


def _processor_s(name: str) -> float:
    found = [one.ident for one in threading.enumerate() if one.name == name and one.ident is not None]
    return sum(time.clock_gettime(time.pthread_getcpuclockid(ident)) for ident in found)
