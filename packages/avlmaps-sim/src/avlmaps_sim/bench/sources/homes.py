"""Sources in homes: the normal walk with an array, its map, and each sound's source against the truth."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

import numpy as np
from jaxtyping import Float

from avlmaps.core.errors import MapError
from avlmaps.core.timeline import Trajectory
from avlmaps.maps.build import build_map
from avlmaps.maps.sources.find import find_sources
from avlmaps.query.avlmap import AVLMap
from avlmaps.query.contents import Thing
from avlmaps.query.sound_sources import SourceMap, things_that_may_be
from avlmaps.recordings.open import open_recording
from avlmaps_sim.bench.harness.factors import outline_away_m
from avlmaps_sim.bench.sources.arrays import ARRAYS, RECORDED, track_of
from avlmaps_sim.hearing.impulse import Acoustics
from avlmaps_sim.recorder import RecordSettings, record_scene
from avlmaps_sim.scene import Area, Scene, SceneObject
from avlmaps_sim.truth import HeardEvent, read_truth

SNR_DB = 20.0
_FRAMES, _SIZE, _FPS = 300, (160, 120), 5.0
_OVERLAP_S = 0.2
_AT_M = 0.3


@dataclass(frozen=True, slots=True)
class HomeJob:
    """One home to measure.

    Attributes:
        spec: its name.
        work: folder of all homes' recordings and maps.
        seed: of walk and sounds.
        sounds: folder of clips; None for sounds made by rule.
    """

    spec: str
    work: Path
    seed: int = 0
    sounds: Path | None = None


@dataclass(frozen=True, slots=True)
class Placed:
    """One sound as one array placed it, or as a baseline did.

    Attributes:
        array: a name of ``ARRAYS`` with its prior, or a baseline.
        error_m: on the plan, from the place where it sounded.
        room: whether the place lies in the right room; None where the source is in none.
        in_50: whether the region of 50 % holds the truth; None of a baseline.
        in_90: of 90 %.
        area_90_m2: of that region.
        right: probability that it gives to the truth within 0.5 m of the place.
        thing: whether the right thing is among the first three; None where no thing made it.
        same_room: whether the robot was in the source's room.
        elapsed_s: seconds that its evidence took.
        voxels: of the map.
    """

    array: str
    error_m: float
    room: bool | None
    in_50: bool | None = None
    in_90: bool | None = None
    area_90_m2: float = float("nan")
    thing: bool | None = None
    same_room: bool = True
    elapsed_s: float = float("nan")
    voxels: int = 0
    right: float = float("nan")


@dataclass(frozen=True, slots=True)
class HomeOutcome:
    """What was measured in one home: its sounds, those that the map holds, and every placement."""

    spec: str
    sounds: int
    heard: int
    placed: tuple[Placed, ...]


def measure_home(job: HomeJob, open_spec: Callable[[str], Scene]) -> HomeOutcome:
    """Record, map and measure one home; what is there already is not made again."""
    scene = open_spec(job.spec)
    name = "".join(c if c.isalnum() else "-" for c in job.spec)
    folder = job.work / f"{name}-{job.seed}"
    recording_path, map_path = folder / "recording", folder / "home.avlmap"
    folder.mkdir(parents=True, exist_ok=True)
    if not recording_path.exists():
        settings = RecordSettings(
            size=_SIZE, fps=_FPS, max_frames=_FRAMES, hearing="acoustic", microphones=RECORDED, snr_db=SNR_DB,
            sources=14, ambiguous=2, sounds=job.sounds, workers=1,
        )  # fmt: skip
        record_scene(scene, folder / "recording.unfinished", settings, job.seed)
        (folder / "recording.unfinished").rename(recording_path)
    recording, truth = open_recording(recording_path), read_truth(recording_path)
    try:  # a finished one is taken as it is
        avlmap = AVLMap(build_map(recording, map_path, progress=False))
    except MapError:  # by another release
        avlmap = AVLMap(build_map(recording, map_path, overwrite=True, progress=False))
    things = avlmap.things()
    heard = avlmap.stored.sounds
    spans = list(zip(heard.onset_s.tolist(), heard.offset_s.tolist(), strict=True))
    pairs = matched(truth.events, spans)
    air = Acoustics(scene, 22_050)
    true = {index: air.sounds_from(np.array(truth.events[index].source)) for index, _ in pairs}
    placed: list[Placed] = []
    things_named = avlmap.source_map.things if len(spans) else lambda names: ()
    walk = Trajectory(recording.stamps_s, recording.world_from_camera)
    assert recording.audio is not None
    for array in ARRAYS:
        track = track_of(recording.audio, array, folder)
        begin = perf_counter()
        evidence = find_sources(track, walk, spans, avlmap.points, avlmap.stored.up_in_world)
        each_s = (perf_counter() - begin) / max(len(spans), 1)
        if evidence is None:
            continue
        known = SourceMap(evidence, avlmap.space, things_named)
        for index, number in pairs:
            event = truth.events[index]
            for prior in (False, True):
                one = known.joined([number], event.category, prior)
                at = known.position_of(one)
                cell = nearest_held(one.density.plan.is_held, one.density.plan.cell_of(true[index][None, :2])[0])
                placed.append(Placed(
                    f"{array}, lexicon" if prior else array,
                    float(np.linalg.norm(at[:2] - true[index][:2])),
                    in_room(truth.areas, true[index], at),
                    bool(one.density.region(0.5).ravel()[cell]),
                    bool(one.density.region(0.9).ravel()[cell]),
                    one.density.area_m2(0.9),
                    right_thing(event, truth.objects, [n for n, _ in things_that_may_be(known, one, things)], things),
                    same_room(truth.areas, event.source, event.robot),
                    each_s,
                    len(avlmap.space),
                    one.density.spread.right,
                ))  # fmt: skip
    for index, number in pairs:
        placed += baselines(truth.events[index], true[index], truth.areas, things, avlmap, number)
    return HomeOutcome(job.spec, len(truth.events), len(pairs), tuple(placed))


def matched(events: Sequence[HeardEvent], spans_s: Sequence[tuple[float, float]]) -> list[tuple[int, int]]:
    """Return pairs of true sounds and detected ones: for each true one the detected one that overlaps it most."""
    pairs: list[tuple[int, int]] = []
    for index, event in enumerate(events):
        shared = [min(event.offset_s, end) - max(event.onset_s, begin) for begin, end in spans_s]
        if shared and max(shared) > _OVERLAP_S:
            pairs.append((index, int(np.argmax(shared))))
    return pairs


def nearest_held(is_held: np.ndarray, cell: int) -> int:
    """Return a flat cell itself where a candidate lies in it, else the nearest one where one does."""
    if is_held.ravel()[cell]:
        return int(cell)
    held = np.argwhere(is_held)
    at = np.array(np.unravel_index(cell, is_held.shape))
    best = held[int(np.argmin(((held - at) ** 2).sum(axis=1)))]
    return int(np.ravel_multi_index(tuple(best), is_held.shape))


def area_of(areas: Sequence[Area], at: Sequence[float] | Float[np.ndarray, " k"]) -> int:
    """Return the room of a place: the one that holds it, else the nearest one within 0.6 m, else −1."""
    xy = np.asarray(at, np.float64)[:2]
    inside = [number for number, area in enumerate(areas) if bool(area.contains(xy))]
    if inside or not areas:
        return inside[0] if inside else -1
    away = [float(outline_away_m(area, xy[None])[0]) for area in areas]
    return int(np.argmin(away)) if min(away) < 0.6 else -1


def in_room(areas: Sequence[Area], true: np.ndarray, at: np.ndarray) -> bool | None:
    """Return whether a place lies in the room of the truth; None where the truth is in none."""
    own = area_of(areas, true)
    return None if own < 0 else area_of(areas, at) == own


def same_room(areas: Sequence[Area], one: Sequence[float], other: Sequence[float]) -> bool:
    """Return whether two places lie in one room."""
    return area_of(areas, one) == area_of(areas, other)


def right_thing(
    event: HeardEvent, objects: Sequence[SceneObject], listed: Sequence[int], things: Sequence[Thing]
) -> bool | None:
    """Return whether one of the listed things is the one that sounded; None where none did, or the map lacks it.

    Args:
        event: the sound.
        objects: of the scene.
        listed: numbers of things of the map.
        things: of the map.
    """
    if event.instance < 0:
        return None
    low = np.array(objects[event.instance].low) - _AT_M
    high = np.array(objects[event.instance].high) + _AT_M

    def fits(thing: Thing) -> bool:
        return bool(((thing.points >= low) & (thing.points <= high)).all(axis=1).mean() > 0.5)

    if not any(fits(thing) for thing in things):
        return None
    return any(fits(things[number]) for number in listed)


def baselines(
    event: HeardEvent,
    true: np.ndarray,
    areas: Sequence[Area],
    things: Sequence[Thing],
    avlmap: AVLMap,
    number: int,
) -> list[Placed]:
    """Return where the robot was (the paper), the thing nearest to it, and the middle of the room that it was in."""
    offsets = avlmap.stored.sounds.track_offsets
    robot = np.asarray(avlmap.stored.sounds.track[offsets[number] : offsets[number + 1]], np.float64).mean(axis=0)
    found = {"robot's place (the paper)": robot}
    if things:
        away = [float(np.linalg.norm(np.array(thing.position[:2]) - robot[:2])) for thing in things]
        found["nearest thing"] = np.array(things[int(np.argmin(away))].position)
    own = area_of(areas, robot)
    if own >= 0:
        found["room's middle"] = np.asarray(areas[own].polygon, np.float64).mean(axis=0)
    same = same_room(areas, event.source, event.robot)
    return [
        Placed(name, float(np.linalg.norm(at[:2] - true[:2])), in_room(areas, true, at), same_room=same)
        for name, at in found.items()
    ]
