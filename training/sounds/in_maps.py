"""What editions of the sound encoder hear in maps: the tracks of simulated walks, cut and cleaned as a map does it.

``python -m training.sounds.in_maps --clips FOLDER --weights A B`` lets the robot drive through held-out homes as
``avlmaps bench indexing`` does, without pictures. Things are truly known, so the rows are that benchmark's "true
objects + sound": what the ears lose, and nothing of the eyes. Tracks stay in the folder ``--work``, so another edition
takes seconds. Needs no torch.
"""

import argparse
import json
import pickle
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from avlmaps.core.question import Modality, Part, Role
from avlmaps.core.timeline import Trajectory
from avlmaps.maps.audio.events import detect_events
from avlmaps.maps.grid import GridSpec
from avlmaps.maps.settings import HearingSettings
from avlmaps.maps.types import HeardSounds
from avlmaps.perception.embedded import logmel
from avlmaps.perception.embedded.sounds import EmbeddedSounds
from avlmaps.query.heatmap import Heatmap, product
from avlmaps.query.modalities import sound_factor
from avlmaps.query.settings import HeatSettings, SoundSettings
from avlmaps.query.voxel_space import Space
from avlmaps.recordings.audio import AudioTrack, Sound, resample, write_flac
from avlmaps_sim.bench.harness.evidence import LEAST_SEEN, Event, Evidence
from avlmaps_sim.bench.harness.factors import true_things
from avlmaps_sim.bench.harness.settings import Recorded, unheard_folder
from avlmaps_sim.bench.harness.workplace import SceneJob, called
from avlmaps_sim.bench.indexing.runs import DEFAULT_SCENES
from avlmaps_sim.bench.indexing.tasks import Task, TaskKind, near_sound_tasks, sound_tasks
from avlmaps_sim.free_space import STRUCTURE
from avlmaps_sim.recorder import _soundings, _track, _trip  # pyright: ignore[reportPrivateUsage]
from avlmaps_sim.scenes import open_scene

ROOT = Path(__file__).resolve().parents[2]
PAUSE_S, NOISE_DB = 4.0, -20.0  # between two pieces of a track, and its noise against their loudness
VOXEL_M = 0.1
RIGHT_M = 0.5
REACH_M = 0.6  # floor round the walk that can be a goal
NOTHING = -1


@dataclass(frozen=True, slots=True)
class Walk:
    """A home that was driven through.

    Attributes:
        index: voxels of its things and of the floor round the walk, sorted.
        label: the thing that each is, -1 for floor.
        categories: of the things.
        events: what sounded, by the names that people use: onset, offset, name.
        heard: what a map holds of the track; its features are numbers alone, into ``sounds``.
        sounds: what an encoder is given.
        tasks: a sound near an object (Table IV), and an object near a sound.
    """

    index: np.ndarray
    label: np.ndarray
    categories: tuple[str, ...]
    events: tuple[tuple[float, float, str], ...]
    heard: HeardSounds
    sounds: tuple[Sound, ...]
    tasks: tuple[Task, ...]


class Listener:
    """Stands where an encoder stands, and remembers what it was given."""

    card = SimpleNamespace(id="listener", dim=1)

    def __init__(self) -> None:
        self.given: list[Sound] = []

    def encode(self, sound: Sound) -> np.ndarray:
        """Return a number for a feature."""
        self.given.append(sound)
        return np.ones((1, 1), np.float32)


def as_a_map_cuts(sounds: Sequence[Sound], work: Path) -> tuple[list[Sound], np.ndarray]:
    """Put one to three seconds of each sound into a track of pink noise; return what a map cuts out, and of which."""
    rng, rate_hz = np.random.default_rng(0), logmel.RATE_HZ
    parts, spans, at = [np.zeros(int(PAUSE_S * rate_hz), np.float32)], [], PAUSE_S
    for sound in sounds:
        samples = resample(sound, rate_hz).samples
        length = min(len(samples), int(rng.uniform(1.0, 3.0) * rate_hz))
        energy = np.convolve(samples.astype(np.float64) ** 2, np.ones(length), "valid")[:: rate_hz // 20]
        first = int(energy.argmax()) * (rate_hz // 20)
        piece = samples[first : first + length]
        piece = piece * (0.1 / max(float(np.sqrt(np.mean(piece**2))), 1e-6))
        spans.append((at, at + len(piece) / rate_hz))
        parts += [piece.astype(np.float32), np.zeros(int(PAUSE_S * rate_hz), np.float32)]
        at += (len(parts[-2]) + len(parts[-1])) / rate_hz
    clean = np.concatenate(parts)
    spectrum = np.fft.rfft(rng.normal(size=len(clean)))
    pink = np.fft.irfft(spectrum / np.sqrt(np.maximum(np.arange(len(spectrum)), 20.0)), len(clean))
    track = clean + 0.1 * 10.0 ** (NOISE_DB / 20.0) * pink / pink.std()
    work.mkdir(parents=True, exist_ok=True)
    write_flac(work / "pieces.flac", Sound((0.5 * track).astype(np.float32), rate_hz))
    still = Trajectory(np.array([0.0, at]), np.stack([np.eye(4)] * 2))
    listener = Listener()
    heard = detect_events(
        AudioTrack.open(work / "pieces.flac"),
        still,
        listener,  # pyright: ignore[reportArgumentType]
        HearingSettings(),
        work / "pieces",
    )
    cut, which = [], []
    for number, (begin, end) in enumerate(spans):
        shared = np.minimum(heard.offset_s, end) - np.maximum(heard.onset_s, begin)
        if len(shared) and shared.max() > 0.0:
            cut.append(listener.given[int(shared.argmax())])
            which.append(number)
    return cut, np.array(which)


def walk_of(spec: str, recorded: Recorded, clips: Path | None, work: Path) -> Walk:
    """Drive through a home as the benchmark does: the same walk, the same sounds at the same times."""
    job = SceneJob(spec, recorded, clips, "embedded", work)
    scene, settings = open_scene(spec), job.record_settings
    for_walk, for_sounds, for_track, _ = np.random.default_rng(int(job.rng(0).integers(1 << 31))).spawn(4)
    trip = _trip(scene, settings, for_walk)
    soundings = _soundings(scene, settings, trip, for_sounds)
    track = _track(scene, settings, trip, soundings, for_track)
    assert isinstance(track, Sound)
    file = work / f"{job.folder.name}.flac"
    write_flac(file, track)
    walked = Trajectory(trip.stamps_s, trip.world_from_camera)
    listener = Listener()
    heard = detect_events(
        AudioTrack.open(file),
        walked,
        listener,  # pyright: ignore[reportArgumentType]
        HearingSettings(),
        work / "clips",
    )
    robot = trip.world_from_camera[:, :3, 3]
    events = [(s.onset_s, s.offset_s, Event(called(s.source.category), s.robot, _places(trip, s))) for s in soundings]
    eye_m = float(np.median(robot[:, 2]))
    seen = np.full(len(scene.objects), LEAST_SEEN)
    evidence = Evidence(
        spec, scene.objects, seen, scene.areas, tuple(e for _, _, e in events), (eye_m - 1.7, eye_m + 1.3)
    )
    index, label = _voxels(scene, robot, eye_m)
    tasks = (*near_sound_tasks(evidence, job.rng(2), 20), *sound_tasks(evidence, job.rng(5), 20))
    named = tuple((onset, offset, event.category) for onset, offset, event in events)
    return Walk(
        index, label, tuple(o.category for o in scene.objects), named, heard, tuple(listener.given), tasks
    )  # fmt: skip


def _places(trip: Any, s: Any) -> tuple[tuple[float, float, float], ...]:
    during = (trip.stamps_s >= s.onset_s) & (trip.stamps_s <= s.offset_s)
    return tuple(tuple(place) for place in trip.world_from_camera[during, :3, 3].tolist())  # pyright: ignore


def _voxels(scene: Any, robot: np.ndarray, eye_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Fill the boxes of a storey's things, and the floor round the walk."""
    parts, labels = [], []
    for number, thing in enumerate(scene.objects):
        if thing.category in STRUCTURE or not eye_m - 1.7 <= thing.centre[2] <= eye_m + 1.3:
            continue
        axes = [
            np.arange(int(np.floor(low / VOXEL_M)), int(np.floor((high - 1e-6) / VOXEL_M)) + 1)
            for low, high in zip(thing.low, thing.high, strict=True)
        ]
        cells = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
        parts.append(cells)
        labels.append(np.full(len(cells), number))
    reach = np.arange(-REACH_M, REACH_M, VOXEL_M)
    around = np.stack(np.meshgrid(reach, reach, indexing="ij"), axis=-1).reshape(1, -1, 2)
    floor = (robot[::2, None, :2] + around).reshape(-1, 2)
    floor = np.column_stack([floor, np.full(len(floor), eye_m - 1.5)])
    parts.append(np.floor(floor / VOXEL_M).astype(np.int64))
    labels.append(np.full(len(floor), NOTHING))
    index, first = np.unique(np.concatenate(parts), axis=0, return_index=True)
    return index.astype(np.int32), np.concatenate(labels)[first]


def measured(walks: Sequence[Walk], encoder: EmbeddedSounds) -> dict[str, Any]:
    """Return how sounds are named, and how tasks are answered.

    An event is named by the segment that overlaps it most, among the kinds that sound in its home.
    """
    named, yes, other, answers = [], [], [], {TaskKind.SOUND: [], TaskKind.NEAR_SOUND: []}
    found = {TaskKind.SOUND: [], TaskKind.NEAR_SOUND: []}
    for walk in walks:
        features = [encoder.encode(sound) for sound in walk.sounds]
        kinds = sorted({name for _, _, name in walk.events})
        scores = encoder.score_words(features, kinds)
        for onset, offset, name in walk.events:
            shared = np.minimum(walk.heard.offset_s, offset) - np.maximum(walk.heard.onset_s, onset)
            own = scores[int(shared.argmax())] if len(shared) and shared.max() > 0 else np.zeros(len(kinds))
            right = kinds.index(name)
            named.append(bool(own.argmax() == right and own.max() > 0))
            yes.append(bool(own[right] >= 0.5))
            other.append(bool((np.delete(own, right) >= 0.5).any()))
        space = Space(GridSpec(VOXEL_M), walk.index, np.array([0.0, 0.0, 1.0]))
        for task in walk.tasks:
            goal, sure = _answer(space, walk, task, scores[:, kinds.index(task.sound_name)])
            answers[task.kind].append(goal is not None and task.off_m(goal) < RIGHT_M)
            found[task.kind].append(sure)
    return {
        "id": encoder.card.id,
        "events": len(named),
        "named first in its home": int(np.sum(named)),
        "own name says yes": int(np.sum(yes)),
        "some other name of the home says yes": int(np.sum(other)),
        **{f"{kind} {what}": value for kind in answers for what, value in (
            ("tasks", len(answers[kind])), ("right", int(np.sum(answers[kind]))),
            ("found and right", int(np.sum(np.logical_and(answers[kind], found[kind])))),
            ("found and wrong", int(np.sum(np.logical_and(np.logical_not(answers[kind]), found[kind])))),
        )},
        "each": {"named": named, **{str(kind): list(map(bool, answers[kind])) for kind in answers}},
    }  # fmt: skip


def _answer(space: Space, walk: Walk, task: Task, scores: np.ndarray) -> tuple[Any, bool]:
    heat, sought = HeatSettings(), task.kind is TaskKind.SOUND
    roles = (Role.PRIMARY, Role.CONTEXT) if sought else (Role.CONTEXT, Role.PRIMARY)
    heard = Part(Modality.SOUND, task.sound_name, roles[0], False)
    thing = Part(Modality.OBJECT, task.object_name, roles[1], False)
    own = [i for i, category in enumerate(walk.categories) if category == task.object_name]
    parts = [
        Heatmap.of(sound_factor(space, walk.heard, scores, heard, SoundSettings(), heat)),
        Heatmap.of(true_things(space, thing, heat.falloff_per_m(roles[1]), walk.label, own)),
    ]
    whole = product(parts if sought else parts[::-1])
    goals = whole.goals(1)
    return (goals[0].position, whole.found) if goals else (None, False)


def write_json(path: Path, content: dict[str, Any]) -> None:
    """Write JSON that a person can read."""
    path.write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def main() -> None:
    """Drive, listen, print the figures of every edition, and write them to a file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--clips", type=Path, help="folder of clips with an index.csv; made by rule if left out")
    parser.add_argument("--scenes", nargs="+", default=list(DEFAULT_SCENES))
    parser.add_argument("--weights", type=Path, nargs="*", default=[], help="folders of editions, beside what ships")
    parser.add_argument("--work", type=Path, default=ROOT / "build" / "sounds" / "walks")
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "sounds" / "in_maps.json")
    arguments = parser.parse_args()
    arguments.work.mkdir(parents=True, exist_ok=True)
    clips = arguments.clips
    recorded = Recorded("overlay", 600, 14, 2, "clean", clips.name if clips else "", 0, "unheard" if clips else "all")
    if clips:
        unheard_folder(clips, arguments.work)  # an index that cannot be used is named before the work
    walks = []
    for spec in arguments.scenes:
        file = arguments.work / f"{spec.replace(':', '-')}-{recorded.sounds or 'made'}.pkl"
        if not file.exists():
            file.write_bytes(pickle.dumps(walk_of(spec, recorded, clips, arguments.work)))
        walks.append(pickle.loads(file.read_bytes()))
        print(spec, len(walks[-1].events), "events", len(walks[-1].sounds), "segments", flush=True)
    nobody = arguments.work / "nobody"
    figures = {}
    for folder in [None, *arguments.weights]:
        encoder = EmbeddedSounds(folder=nobody, weights=folder)
        figures[str(folder or "ships")] = measured(walks, encoder)
        shown = {k: v for k, v in figures[str(folder or "ships")].items() if k != "each"}
        print(folder or "ships", shown, flush=True)
    write_json(arguments.out, figures)


if __name__ == "__main__":
    main()
