"""The suite `recordings`: situations on three sources with counts of outcomes, and right recordings without a word."""

import os
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from avlmaps.core.files import write_bytes_atomically
from avlmaps.core.progress import progress
from avlmaps.maps.build import build_map
from avlmaps.perception.cache import CacheSettings
from avlmaps.recordings.consistency.suspicions import examine_recording
from avlmaps.recordings.open import open_recording
from avlmaps_sim.bench.harness.figures import Table, as_csv, in_percent, wilson
from avlmaps_sim.bench.recordings.drafts import Draft, RoomWalk
from avlmaps_sim.bench.recordings.outcomes import FOLDER, FORMATS, TUM_CAMERA, Case, Judge, Outcome, right_case
from avlmaps_sim.bench.recordings.situations import situations
from avlmaps_sim.recorder import RecordSettings, record_scene
from avlmaps_sim.scenes import open_scene
from avlmaps_sim.sensor import OdometryFaults, SensorName

SIZE = (160, 120)
_FRAMES = 40
_WINDOW = 40
# Thresholds were set on other homes (11 to 14), other walks of the room and other mistakes.
HOMES: tuple[tuple[str, SensorName, bool], ...] = (
    ("house:31:lived-in", "kinect", False),
    ("house:32:lived-in", "kinect", True),
    ("house:33:lived-in", "realsense", True),
    ("house:34", "realsense", False),
    ("office:35", "kinect", True),
    ("house:36:lived-in", "clean", False),
    ("house:37:lived-in", "realsense", True),
    ("house:38", "kinect", True),
)
ROOMS = (
    RoomWalk("room, as it is", seed=1),
    RoomWalk("room, fast camera", seed=2, turn_rad_s=1.6),
    RoomWalk("room, slow camera at 30 Hz", seed=3, frames=120, rate_hz=30.0, turn_rad_s=0.2),
    RoomWalk("room, two people walk through", seed=4, people=2),
    RoomWalk("room, three people and noise of a Kinect", seed=5, people=3, noise=0.0019),
    RoomWalk("room, a chair is moved", seed=6, moved_chair=True, people=1),
    RoomWalk("room, holes of a RealSense and noise", seed=7, holes=0.3, noise=0.0025),
    RoomWalk("room, drift of 1 cm and 0.06 degrees a step", seed=8, drift=0.01),
    RoomWalk("room, exposure flickers by 30 %", seed=9, flicker=0.3, noise=0.0019),
    RoomWalk("room, a picture a second", seed=10, frames=30, rate_hz=1.0, turn_rad_s=0.3),
)


_HIDDEN = ("scale", "clock")
# Walks on which mistakes of some groups cannot show.
WALKS: tuple[tuple[RoomWalk, tuple[str, ...]], ...] = (
    (RoomWalk("room, even turn in one place", seed=15, round_rad_s=0.0, even=True), _HIDDEN),
    (
        RoomWalk("room, hardly any motion", seed=16, round_rad_s=0.02, turn_rad_s=0.05, noise=0.0019, even=True),
        _HIDDEN,
    ),
    (RoomWalk("room, keyframes without overlap", seed=17, frames=4, rate_hz=0.2, turn_rad_s=0.3), ("poses",)),
)
_A_TASK = 12  # mistakes


def run(
    scenes: Sequence[Path], out: Path, seed: int = 0, homes: Sequence[tuple[str, SensorName, bool]] = HOMES
) -> dict[str, Table]:
    """Change the first recording, check all as they are, and homes: scene, sensor, and whether its poses drift."""
    rendered = [_rendered(out / "homes", *home) for home in homes]
    other = RoomWalk("room, other", seed=12).draft()
    sources = [_Source(RoomWalk("room", seed=11).draft(), other)]
    sources += [_Source(walk.draft(), other, groups) for walk, groups in WALKS]
    if len(rendered) > 1:
        sources.append(_Source(_dense(rendered[0], "home"), _dense(rendered[1], "other home")))
    for path in scenes[:1]:
        windows = list(_windows(path))
        if len(windows) > 1:
            sources.append(_Source(replace(windows[1], name=path.name), windows[-1]))
    camera = TUM_CAMERA.resized(*SIZE)
    room, other = RoomWalk("room", seed=13).draft(camera), RoomWalk("room, other", seed=14).draft(camera)
    turns = len(FORMATS)  # each mistake in one of them, by turns
    others = [_Source(room, other, form=number, step=(number, turns)) for number in range(turns)]
    found = _cases([*sources, *others], seed)
    cases = [case for case in found if case.format == FOLDER.name]
    in_formats = [case for case in found if case.format != FOLDER.name]
    rights = [*[room.draft() for room in ROOMS], *[_whole(path) for path in rendered]]
    rights += [window for path in scenes for window in _windows(path)]
    every = _listed([*cases, *in_formats])
    write_bytes_atomically(out / "recordings-every-mistake.csv", as_csv(every).encode())
    return {
        "mistakes by source": _counts(cases, [source.right.name for source in sources]),
        "mistakes by kind": _counts(cases, list(dict.fromkeys(case.group for case in cases)), by="group"),
        "mistakes by format": _counts(in_formats, [form.name for form in FORMATS], by="format"),
        "without a word": _listed([case for case in (*cases, *in_formats) if case.outcome in _WITHOUT_A_WORD]),
        "right recordings": _rights(rights),
        "cost": _cost(rendered, out),
    }


_WITHOUT_A_WORD = (Outcome.RIGHT, Outcome.UNCHECKED, Outcome.SILENT)


@dataclass(frozen=True, slots=True)
class _Source:
    """A right recording, another for what is foreign, and which mistakes are made.

    ``form`` is the number of the format among `FORMATS`, None our own; ``step`` is the first of the mistakes, and after
    how many the next follows; no groups are all.
    """

    right: Draft
    other: Draft
    groups: tuple[str, ...] = ()
    form: int | None = None
    step: tuple[int, int] = (0, 1)

    def chosen(self) -> list[int]:
        known = situations()
        every = range(self.step[0], len(known), self.step[1])
        return [number for number in every if not self.groups or known[number].group in self.groups]


def _cases(sources: Sequence[_Source], seed: int) -> list[Case]:
    tasks = [
        (source, numbers[first : first + _A_TASK], seed)
        for source in sources
        for numbers in [source.chosen()]
        for first in range(0, len(numbers), _A_TASK)
    ]
    workers = 2 * (os.cpu_count() or 1)  # files are small and many, so that half of them wait for the disk
    with ProcessPoolExecutor(min(workers, 4), mp_context=get_context("spawn")) as pool:
        return [case for some in progress(pool.map(_some, tasks), "mistakes", total=len(tasks)) for case in some]


def _some(task: tuple[_Source, Sequence[int], int]) -> list[Case]:
    source, numbers, seed = task
    form = FOLDER if source.form is None else FORMATS[source.form]
    judge, known = Judge(source.right, form), situations()
    made = (judge.judge(known[number], source.other, seed) for number in numbers)
    return [case for case in made if case is not None]


def _rendered(folder: Path, spec: str, sensor: SensorName, drift: bool) -> Path:
    path = folder / f"{spec.replace(':', '-')}-{sensor}{'-drift' if drift else ''}"
    if not (path / "recording.json").exists():
        faults = OdometryFaults() if drift else None
        settings = RecordSettings(
            size=SIZE, sensor=sensor, drift=faults, hearing="none", colour="jpg", max_frames=120, workers=1
        )
        record_scene(open_scene(spec), path, seed=0, settings=settings)
    return path


def _whole(path: Path) -> Draft:
    recording = open_recording(path)
    return Draft.of(recording, path.name, range(len(recording)))


def _dense(path: Path, name: str) -> Draft:
    recording = open_recording(path)
    return Draft.of(recording, name, range(min(_FRAMES, len(recording))))


def _windows(path: Path) -> Iterator[Draft]:
    recording = open_recording(path)
    for step in (1, 2, 3, 5, 8, 12):
        for first in np.linspace(0, len(recording) - _WINDOW * step, 2).round().astype(int).tolist():
            if first < 0 or (step == 12 and first > 0):
                continue
            yield Draft.of(recording, f"{path.name} from {first} by {step}", range(first, first + _WINDOW * step, step))


def _counts(cases: Sequence[Case], names: Sequence[str], by: str = "source") -> Table:
    rows: list[list[str | int]] = []
    for name in (*names, "all"):
        found = Counter(case.outcome for case in cases if name in ("all", getattr(case, by)))
        total = sum(found.values())
        silent = found[Outcome.SILENT]
        rows.append([name, total, *[found[outcome] for outcome in Outcome], in_percent(wilson(silent, total))])
    return {"columns": [by, "mistakes", *[outcome.value for outcome in Outcome], "silent wrong %: 95 %"], "rows": rows}


def _rights(drafts: Sequence[Draft]) -> Table:
    rows: list[list[str]] = []
    for draft in progress(drafts, "right recordings", total=len(drafts)):
        case, verdict = right_case(draft)
        numbers = ("-",) * 3
        if verdict is not None:
            numbers = (f"{verdict.agreeing:.3f}", f"{verdict.seen_through:.4f}", f"{verdict.likeness:.3f}")
        rows.append([draft.name, str(len(draft)), *numbers, case.outcome.value, " ".join(case.said)])
    columns = ["recording", "frames", "agreeing", "seen through", "likeness", "outcome", "said"]
    return {"columns": columns, "rows": rows}


def _cost(paths: Sequence[Path], out: Path) -> Table:
    columns = ["recording", "frames", "check, processor s", "whole build, processor s", "share %"]
    return {"columns": columns, "rows": [_cost_of(path, out) for path in paths[:1]]}


def _cost_of(path: Path, out: Path) -> list[str | int]:
    recording, cache = open_recording(path), CacheSettings(place="off")
    check_s = _processor_s(lambda: examine_recording(recording))
    with TemporaryDirectory(dir=out) as folder:
        place = Path(folder) / "home.avlmap"
        build_s = _processor_s(lambda: build_map(recording, place, cache=cache, progress=False))
    share = f"{100.0 * check_s / build_s:.1f}"
    return [path.name, len(recording), f"{check_s:.2f}", f"{build_s:.1f}", share]


def _processor_s(work: Callable[[], object]) -> float:

    def spent() -> float:
        times = os.times()
        return times.user + times.system + times.children_user + times.children_system

    begin = spent()
    work()
    return spent() - begin


def _listed(cases: Sequence[Case]) -> Table:
    rows = [
        [case.source, case.format, case.group, case.situation, case.outcome.value, " ".join(case.said)]
        for case in cases
    ]
    return {"columns": ["source", "format", "kind", "mistake", "outcome", "said"], "rows": rows}
