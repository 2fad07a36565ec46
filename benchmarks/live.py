"""A live map at the pace of a robot: frames a second, time from frame to map, questions meanwhile, memory over time.

    python benchmarks/live.py REC [--rate 1] [--laps 1] [--out figures.json]

The recording is played into a ``LiveMap``: once as fast as the map takes it, which says how much processor time a frame
costs, and once at its own pace, which says how long frames and questions take and which frames are late. The second
depends on what else the machine does; its load is printed with it. With ``--laps`` the recording is played again and
again, forth and back: time passes, and the surface stays the same.
"""

import argparse
import json
import os
import tempfile
import threading
import time
from collections.abc import Iterator
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np

import avlmaps

QUESTIONS = ("the sofa", "the door", "a plant", "where can I sit?", "the table", "the chair near the table")


def frames(recording: avlmaps.Recording, laps: int) -> Iterator[tuple[avlmaps.Frame, float]]:
    """Yield frames and their stamps, lap after lap, forth and back."""
    step_s = float(np.median(np.diff(recording.stamps_s)))
    order = list(range(len(recording)))
    stamp_s = 0.0
    for lap in range(laps):
        for index in order if lap % 2 == 0 else order[::-1]:
            stamp_s += step_s
            yield recording.frame(index), stamp_s


def processor_s(thread: threading.Thread) -> float:
    """Return the processor time of a thread that runs; that of its encoders' own threads is not in it."""
    assert thread.ident is not None
    return time.clock_gettime(time.pthread_getcpuclockid(thread.ident))


def played(recording: avlmaps.Recording, rate: float | None, laps: int, gates: bool) -> dict[str, Any]:
    """Play a recording into a map and return the figures."""
    asked_s: list[float] = []
    reading_s, course = 0.0, []
    over = threading.Event()
    with tempfile.TemporaryDirectory() as folder:
        live = avlmaps.LiveMap(
            Path(folder) / "map", up_in_world=recording.up_in_world, live=avlmaps.LiveSettings(gates=gates)
        )

        def ask() -> None:
            questions = cycle(QUESTIONS)
            while not over.wait(0.5):
                if live.generation:
                    begin_s = time.perf_counter()
                    live.ask(next(questions))
                    asked_s.append(time.perf_counter() - begin_s)

        person = threading.Thread(target=ask)
        person.start()
        begin_s, begin_cpu_s, heard_s, saved_age_s = time.perf_counter(), time.process_time(), 0.0, 0.0
        count = laps * len(recording)
        for number, (frame, stamp_s) in enumerate(frames(recording, laps)):
            if rate is not None:
                time.sleep(max(0.0, begin_s + stamp_s / rate - time.perf_counter()))
            live.add_frame(frame.rgb, frame.depth_m, frame.camera, frame.world_from_camera, stamp_s, wait=rate is None)
            reading_s = time.thread_time()
            if recording.audio is not None and stamp_s < recording.audio.end_s:
                live.add_audio(recording.audio.read(heard_s, stamp_s), heard_s)
                heard_s = stamp_s
            status = live.status()
            saved_age_s = max(saved_age_s, np.nan_to_num(status.saved_age_s))
            if number % max(1, count // 12) == 0:
                course.append({"s": round(stamp_s, 1), "mb": round(status.memory_mb), "voxels": status.voxels})
        took_s, cpu_s = time.perf_counter() - begin_s, time.process_time() - begin_cpu_s
        status = live.status()
        fusing_s, behind_s = processor_s(live._fuser), processor_s(live._behind)
        over.set()
        person.join()
        closing_s = time.perf_counter()
        live.close()
        closing_s = time.perf_counter() - closing_s
    per_frame = 1e3 / count
    return {
        "pace": "as fast as possible" if rate is None else rate,
        "gates": gates,
        "frames": count,
        "frames_per_s": round(count / took_s, 2),
        "fused": status.fused,
        "dropped": status.dropped,
        "frame_to_map_ms": {"p50": round(status.frame_ms_p50, 1), "p95": round(status.frame_ms_p95, 1)},
        "processor_ms_a_frame": {
            "all": round(cpu_s * per_frame, 1),
            "reading the recording": round(reading_s * per_frame, 1),
            "fusing thread": round(fusing_s * per_frame, 1),
            "thread behind": round(behind_s * per_frame, 1),
        },
        "question_ms": {f"p{p}": round(1e3 * float(np.percentile(asked_s or [np.nan], p)), 1) for p in (50, 95)},
        "questions": len(asked_s),
        "oldest_save_s": round(float(saved_age_s), 1),
        "closing_s": round(closing_s, 1),
        "course": course,
        "load_of_the_machine": round(os.getloadavg()[0], 1),
        "doubts": list(status.doubts),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recording", type=Path)
    parser.add_argument("--rate", type=float, default=1.0)
    parser.add_argument("--laps", type=int, default=1)
    parser.add_argument("--gates", choices=("on", "off"), default="on")
    parser.add_argument("--only", choices=("fast", "paced"))
    parser.add_argument("--out", type=Path)
    words = parser.parse_args()
    recording = avlmaps.open_recording(words.recording)
    paces = [None, words.rate] if words.only is None else [None if words.only == "fast" else words.rate]
    figures = [played(recording, pace, words.laps, words.gates == "on") for pace in paces]
    text = json.dumps(figures, indent=2)
    print(text)
    if words.out:
        words.out.write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
