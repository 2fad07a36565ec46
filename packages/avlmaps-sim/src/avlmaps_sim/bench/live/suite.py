"""The tables of ``avlmaps bench live``: recordings played into live maps, and what a killed process leaves."""

import json
import os
import tempfile
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, fields
from hashlib import sha256
from itertools import cycle
from pathlib import Path

import numpy as np

import avlmaps
from avlmaps.core.errors import QueryError
from avlmaps.core.files import write_bytes_atomically
from avlmaps.core.progress import say
from avlmaps.core.wording import option
from avlmaps.live.live_map import LiveMap
from avlmaps.live.replay import Ears
from avlmaps.live.status import LiveSettings, LiveStatus
from avlmaps.maps.build import build_map
from avlmaps.maps.store.map_data import MapData
from avlmaps.perception.encoders import Encoders
from avlmaps.query.avlmap import AVLMap
from avlmaps.recordings.open import open_recording
from avlmaps.recordings.types import Frame, Recording
from avlmaps_sim.bench.harness.figures import BenchError, Table
from avlmaps_sim.bench.live import killed
from avlmaps_sim.bench.live.killed import lost_s

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


_VOXEL_M = 0.05
_SHOWN_LAPS = 12  # of an hour
_KILLED = Path(killed.__file__)
_Rows = list[list[object]]


@dataclass(frozen=True, slots=True)
class LiveBench:
    """What can be chosen."""

    laps: int = 2  # how often each recording is driven at its own pace; 0 measures kills alone
    # How many processes are killed; those that a folder of work holds, of the same package, are not repeated.
    kills: int = 40
    rate: float = 1.0  # how many times faster than it was recorded a recording is driven
    ends: bool = True  # whether its end is compared with the build, and it is also driven as fast as the map takes it


def run_live(
    scenes: Sequence[Path], used: Encoders, profile: str, chosen: LiveBench, seed: int, out: Path
) -> dict[str, Table]:
    """Return the tables; ``out/work`` stores the outcome of each kill.

    ``BenchError``: no recording was given, or one of fewer than two frames.
    """
    if not scenes:
        raise BenchError(f"This suite measures on recordings with poses; name one or more with {option('scenes')}.")
    pace: _Rows = []
    processor: _Rows = []
    laps: _Rows = []
    ends: _Rows = []
    kills: list[float] = []
    for path in scenes:
        recording, name = open_recording(path), path.resolve().name
        if len(recording) < 2:
            raise BenchError(f"{path} has {len(recording)} frames; a drive takes two or more.")
        with tempfile.TemporaryDirectory() as folder:
            place = Path(folder)
            for rate in _paces(chosen):
                found = play(
                    recording, place / "live", used, rate=rate, laps=chosen.laps if rate else 1,
                    settings=LiveSettings(),
                )  # fmt: skip
                word = _pace_word(rate)
                pace.append([name, word, *_pace(found)])
                processor.append([name, word, *_processor(found)])
                if rate:
                    shown = np.unique(np.linspace(0, len(found.laps) - 1, _SHOWN_LAPS).astype(int)).tolist()
                    laps += [[name, lap + 1, *found.laps[lap]] for lap in shown]
            if chosen.laps and chosen.ends:
                ends += _ends(name, recording, place, used, chosen.rate)
            kills += _kills(path, place / "killed", profile, chosen.kills, seed, out / "work")
    tables = {
        "pace": _table(
            "recording|pace|frames|s|frames/s|fused|encoded|late|frame to map ms p50|p95|questions|question ms p50|p95"
            "|most unsaved s|load of the machine|close s", pace,
        ),
        "processor time a frame, ms": _table("recording|pace|all|fusing|snapshots", processor),
        "laps over the same surface": _table("recording|lap|voxels|keyframes|fused until then|MB", laps),
        "the end beside the build of all frames": _table(
            "recording|gates|pace|late|voxels live|build|equal bit by bit|things in both|in one alone|within a voxel"
            "|within 0.1 m|median m", ends,
        ),
        "kills at random moments": _table(
            "kills|whole maps left|lost s median|most|lost more than 5 s", _killed(kills)
        ),
    }  # fmt: skip
    return {name: table for name, table in tables.items() if table["rows"]}


def _pace_word(rate: float | None) -> str:
    return "as fast as it can" if rate is None else "its own" if rate == 1.0 else f"{rate:g} times"


def _paces(chosen: LiveBench) -> tuple[float | None, ...]:
    return () if not chosen.laps else (chosen.rate, None) if chosen.ends else (chosen.rate,)


def _table(columns: str, rows: _Rows) -> Table:
    return {"columns": columns.split("|"), "rows": rows}


def _pace(found: Played) -> list[object]:
    status, asked = found.status, found.asked_ms or [float("nan")]
    assert status is not None
    return [
        found.frames, round(found.seconds, 1), round(found.frames / found.seconds, 1), status.fused, status.encoded,
        status.dropped.get("late", 0), _whole(status.frame_ms_p50), _whole(status.frame_ms_p95), len(found.asked_ms),
        *(round(float(np.percentile(asked, p)), 1) for p in (50, 95)), round(found.unsaved_s, 1),
        round(found.load, 1), round(found.close_s, 1),
    ]  # fmt: skip


def _whole(ms: float) -> float:
    return round(ms) if np.isfinite(ms) else ms  # where every frame came late none has an age


def _processor(found: Played) -> list[float]:
    return [round(found.processor_ms[name], 1) for name in ("all", "fusing", "snapshots")]


def _kills(recording: Path, path: Path, profile: str, kills: int, seed: int, work: Path) -> list[float]:
    facts = open_recording(recording).fingerprint, profile, seed, _code(Path(avlmaps.__file__).parent, _KILLED)
    stored = work / f"live-kills-{sha256(repr(facts).encode()).hexdigest()[:12]}.json"
    lost: list[float] = json.loads(stored.read_bytes())[:kills] if stored.is_file() else []
    if lost:
        say(f"live: {len(lost)} kills of before are taken from {stored}")
    for number in range(len(lost), kills):
        lost.append(lost_s(recording, path, profile, np.random.default_rng([seed, number])))
        stored.parent.mkdir(parents=True, exist_ok=True)
        write_bytes_atomically(stored, json.dumps(lost).encode())
        say(f"live: kill {number + 1} of {kills} lost {lost[-1]:.1f} s")
    return lost


def _code(*places: Path) -> str:
    digest = sha256()
    for place in places:
        for file in sorted(place.rglob("*")) if place.is_dir() else [place]:
            if file.is_file() and "__pycache__" not in file.parts:
                digest.update(str(file.relative_to(place)).encode() + b"\0" + sha256(file.read_bytes()).digest())
    return digest.hexdigest()


def _killed(lost: list[float]) -> list[list[object]]:
    if not lost:
        return []
    return [[len(lost), len(lost), round(float(np.median(lost)), 1), round(max(lost), 1), sum(s > 5.0 for s in lost)]]


def _ends(name: str, recording: Recording, place: Path, used: Encoders, rate: float) -> list[list[object]]:
    every = avlmaps.BuildSettings(frames=avlmaps.FrameSettings(look_m=0.0))
    built = build_map(recording, place / "built", used, every, progress=False, allow=["geometry", "colour"])
    rows: list[list[object]] = []
    for gates, pace in ((True, None), (True, rate), (False, None)):
        played = play(recording, place / "end", used, rate=pace, settings=LiveSettings(gates=gates))
        late = 0 if played.status is None else played.status.dropped.get("late", 0)
        compared = _compared(AVLMap.open(place / "end"), AVLMap(built))
        rows.append([name, "on" if gates else "off", _pace_word(pace), late, *compared])
    return rows


def _compared(live: AVLMap, built: AVLMap) -> list[object]:
    counts: list[object] = [len(live.data.voxels), len(built.data.voxels)]
    apart_m, alone = _goals(live, built)
    near = [sum(m <= limit + 1e-6 for m in apart_m) for limit in (_VOXEL_M, 0.1)]
    median = round(float(np.median(apart_m)), 3) if apart_m else float("nan")
    return [*counts, _equality(live.data, built.data), len(apart_m), alone, *near, median]


def _equality(one: MapData, other: MapData) -> str:
    names = [field.name for field in fields(one.voxels)]
    differ = [name for name in names if not np.array_equal(getattr(one.voxels, name), getattr(other.voxels, name))]
    if len(differ) == len(names):
        return "no"
    return f"all but {', '.join(differ)}" if differ else "yes"


def _goals(one: AVLMap, other: AVLMap) -> tuple[list[float], int]:
    apart_m, alone = list[float](), 0
    for word in one.encoders.pixels.vocabulary:
        answers = [avlmap.ask(word).to_dict() for avlmap in (one, other)]
        found = [bool(answer["found"]) for answer in answers]
        alone += found[0] != found[1]
        if all(found):
            places = [np.array(answer["goals"][0]["position"]) for answer in answers]
            apart_m.append(float(np.linalg.norm(places[0] - places[1])))
    return apart_m, alone
