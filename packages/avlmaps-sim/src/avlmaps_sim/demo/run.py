"""Make a home, drive through it, hear it, map it, ask it, send a robot through it.

The truth measures afterwards how far each answer and each stop is off.
"""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from avlmaps.core.camera import Pinhole
from avlmaps.core.errors import AvlmapsError, MapError
from avlmaps.core.progress import progress, say
from avlmaps.core.wording import option
from avlmaps_sim.demo.evidence import Box, Evidence
from avlmaps_sim.demo.questions import CLIP, FURNITURE, MAP, PAGE, PHOTO, Ask, PhotoView, in_a_room, spoken
from avlmaps_sim.demo.report import DemoReport, Step
from avlmaps_sim.free_space import STRUCTURE
from avlmaps_sim.hearing.sound_library import KINDS, Synthesised
from avlmaps_sim.homes.plan import area_m2
from avlmaps_sim.render import Renderer
from avlmaps_sim.scene import NOTHING, Scene
from avlmaps_sim.scenes import open_scene
from avlmaps_sim.views import random_views

if TYPE_CHECKING:
    from avlmaps.query.answer import Answer
    from avlmaps.query.avlmap import AVLMap
    from avlmaps.recordings.types import Recording
    from avlmaps_sim.demo.evidence import Evidence
    from avlmaps_sim.demo.questions import PhotoView
    from avlmaps_sim.recorder import RecordSettings
    from avlmaps_sim.scene import Scene

# Homes of these seeds, and the held-out families of furniture that they are made of, no training has seen.
FIRST_SEED, SEEDS_APART = 3_000_000, 1000
_TRIES = 40
_ROOMS = (5, 9)
_LARGEST_M2 = 110.0
_FEWEST_SOUNDS = 6
_FEWEST_FAR_APART, _FAR_M = 4, 4.0
_EVERYWHERE = {"door", "folding door", "window", "picture"}


def choose_home(seed: int) -> Scene:
    """Return the first home from a seed on that fits; only its furniture decides, never an answer of a map.

    ``AvlmapsError``: none of many fits.
    """
    for number in range(_TRIES):
        scene = open_scene(f"house:{FIRST_SEED + SEEDS_APART * seed + number}:held-out")
        if fits(scene):
            return scene
    raise AvlmapsError(
        f"None of {_TRIES} homes from seed {seed} on fits the demonstration; try another {option('seed')}."
    )


def fits(scene: Scene) -> bool:
    """Return whether a home is of one floor, neither small nor large, and holds what the questions need."""
    if len({area.floor_m for area in scene.areas}) != 1 or not _ROOMS[0] <= len(scene.areas) <= _ROOMS[1]:
        return False
    if sum(abs(area_m2(area.polygon)) for area in scene.areas) > _LARGEST_M2:
        return False
    every = np.ones(len(scene.objects), bool)
    evidence = Evidence(scene.objects, every, scene.areas, (), np.zeros(0), np.zeros((0, 3)))
    in_room = in_a_room(evidence, np.random.default_rng(0))
    return (
        bool(spoken(thing.category for thing in scene.objects))
        and in_room is not None
        and in_room.about in FURNITURE
        and len(_far_apart(evidence)) >= _FEWEST_FAR_APART
        and len(sounds_of(scene)) >= _FEWEST_SOUNDS
    )


def _far_apart(evidence: Evidence) -> list[str]:
    found: list[str] = []
    for category, own in evidence.ambiguous().items():
        boxes = [Box.of(evidence.objects[i]) for i in own]
        if category in FURNITURE and max(a.apart_m(b) for a in boxes for b in boxes) >= _FAR_M:
            found.append(category)
    return found


def sounds_of(scene: Scene) -> tuple[str, ...]:
    """Return the kinds of sound that things of a home make, those of doors and windows left out."""
    categories = {thing.category for thing in scene.objects} - _EVERYWHERE
    made = set(Synthesised().categories)
    here = {kind.names[0] for kind in KINDS if kind.indoors and categories & set(kind.objects)}
    return tuple(sorted(here & made))


_TRIED = 150
_OFF_THE_WALK_M = 0.4
# The robot must have looked the same way from not too far: a wall's other side can be recognised by nobody.
_LOOKED_FROM_M, _LOOKED_ALIKE_RAD = 2.0, np.deg2rad(45.0)
_DEPTH_M = (1.0, 5.0)
_STOREY_M = 1.5
# A bare wall could be any: at least this many things, walls not counted, fill this share of a picture each.
_FEWEST_THINGS, _LEAST_SHARE = 2, 0.01


def photo_views(
    scene: Scene,
    renderer: Renderer,
    camera: Pinhole,
    evidence: Evidence,
    world_from_camera: Float[np.ndarray, "n 4 4"],
    rng: np.random.Generator,
) -> list[PhotoView]:
    """Return pictures off the walk, looking at what the walk looked at too; those that show most things first."""
    found: list[tuple[int, PhotoView]] = []
    is_thing = np.array([thing.category not in STRUCTURE for thing in scene.objects], bool)
    for pose in random_views(scene, rng, _TRIED, camera):
        away = np.linalg.norm(evidence.walk - pose[:3, 3], axis=1)
        away_m = float(np.linalg.norm((evidence.walk - pose[:3, 3])[:, :2], axis=1).min())
        alike = world_from_camera[:, :3, 2] @ pose[:3, 2] > np.cos(_LOOKED_ALIKE_RAD)
        if away_m < _OFF_THE_WALK_M or away.min() > _STOREY_M or not (alike & (away < _LOOKED_FROM_M)).any():
            continue
        view = renderer.render(camera, pose)
        solid = view.instance != NOTHING
        middle_m = float(np.median(view.depth_m[solid])) if solid.mean() > 0.9 else 0.0
        if _DEPTH_M[0] <= middle_m <= _DEPTH_M[1]:
            share = np.bincount(view.instance[solid], minlength=len(scene.objects)) / solid.size
            things = int((share[is_thing] >= _LEAST_SHARE).sum())
            found += [(things, PhotoView(pose, share, away_m))] if things >= _FEWEST_THINGS else []
    return [photo for _, photo in sorted(found, key=lambda entry: -entry[0])]


MARKER = ".avlmaps-demo"


@dataclass(frozen=True, slots=True)
class DemoSettings:
    """How large the demonstration is."""

    frames: int = 560  # limit of frames that are recorded
    size: tuple[int, int] = (320, 240)  # columns and rows of the pictures
    # Number of sounds, if the walk has room for them; None places one for every twelve seconds.
    sounds: int | None = None
    workers: int = 0  # processes that draw; 0 takes as many as there are cores
    moments: int = 24  # of the walk that the report shows


def run_demo(
    out: Path, seed: int = 0, scene: "Scene | None" = None, settings: DemoSettings | None = None
) -> DemoReport:
    """Run the whole demonstration into a folder; an earlier one there is replaced, anything else is left alone.

    Another seed takes another home, walk, sounds and questions; a scene is walked through instead of the home.

    ``MapError``: the folder holds something that is not a demonstration.
    """
    from avlmaps.maps.build import build_map
    from avlmaps.maps.store.map_data import describe
    from avlmaps.query.avlmap import AVLMap, with_findings
    from avlmaps_sim.demo.drive import drive
    from avlmaps_sim.demo.evidence import Evidence
    from avlmaps_sim.demo.report import write_report

    _make_room(out)
    settings = settings or DemoSettings()
    seconds: dict[str, float] = {}
    for_questions, for_photos, for_clip = np.random.default_rng(seed).spawn(3)
    with _stage("home", seconds, "A home is built and furnished."):
        scene = scene or choose_home(seed)
    with _stage("record", seconds, f"A robot with a depth camera and a microphone drives through {_rooms(scene)}."):
        recording = _record(scene, out, settings, seed)
    with _stage("build", seconds, "The recording becomes a map."):
        data = build_map(recording, out / MAP, finds=with_findings)
    with _stage("choose", seconds, "Questions are chosen by what is truly there."):
        evidence = Evidence.of(recording)
        asks, photo = _choose(scene, recording, evidence, out, for_questions, for_photos)
        _write_clip(asks, out, for_clip)
    with _stage("ask", seconds, "The map is queried."):
        avlmap = AVLMap(data, path=out / MAP)
        answered = [
            _answer(avlmap, ask, number, out) for number, ask in enumerate(progress(asks, "asking", unit="question"), 1)
        ]
        located = None if photo is None else _located(avlmap, photo, out)
    steps = tuple(step for step, _ in answered)
    with _stage("drive", seconds, "A robot drives to goals by one command."):
        driven = drive(asks, avlmap, scene, out, say)
    report = DemoReport(out, scene.name, steps, describe(avlmap.path, data), located, seconds, driven)
    with _stage("page", seconds, "The map becomes a page to walk through."):
        from avlmaps.view.page import write_page

        plain = [step.ask for step in steps if not any(part.is_file for part in step.ask.question.parts)]
        write_page(out / PAGE, [avlmap], [(ask.title, ask.question) for ask in plain])
    with _stage("report", seconds, "A page with pictures is written."):
        write_report(
            report, scene, recording, avlmap, evidence, photo, [answer for _, answer in answered], settings.moments
        )
    return report


@contextmanager
def _stage(name: str, seconds: dict[str, float], sentence: str) -> Iterator[None]:
    say(sentence)
    begin = perf_counter()
    yield
    seconds[name] = round(perf_counter() - begin, 1)


def _make_room(out: Path) -> None:
    if out.exists() and any(out.iterdir()) and not (out / MARKER).exists():
        raise MapError(f"{out} holds something else than a demonstration; choose another folder with {option('out')}.")
    out.mkdir(parents=True, exist_ok=True)
    for entry in out.iterdir():  # one by one, since the folder may be a link
        if entry.is_dir() and not entry.is_symlink():
            shutil.rmtree(entry, ignore_errors=True)
        else:
            entry.unlink()
    (out / MARKER).touch()


def _rooms(scene: "Scene") -> str:
    return f"{len(scene.areas)} rooms ({scene.name})" if scene.areas else scene.name


def record_settings(scene: "Scene", settings: DemoSettings) -> "RecordSettings":
    """Return how a home is recorded: a Kinect's faults, and sounds that reach the microphone through the rooms."""
    from avlmaps_sim.recorder import RecordSettings

    return RecordSettings(
        size=settings.size, sensor="kinect", hearing="acoustic", categories=sounds_of(scene), sources=settings.sounds,
        max_frames=settings.frames, semantic=True, workers=settings.workers,
    )  # fmt: skip


def _record(scene: "Scene", out: Path, settings: DemoSettings, seed: int) -> "Recording":
    from avlmaps.recordings.open import open_recording
    from avlmaps_sim.recorder import record_scene

    record_scene(scene, out / "recording", record_settings(scene, settings), seed)
    return open_recording(out / "recording")


def _choose(
    scene: "Scene",
    recording: "Recording",
    evidence: "Evidence",
    out: Path,
    for_questions: np.random.Generator,
    for_photos: np.random.Generator,
) -> "tuple[list[Ask], PhotoView | None]":
    import cv2

    from avlmaps_sim.demo.questions import choose_questions
    from avlmaps_sim.render import Renderer

    renderer, camera = Renderer(scene), recording.rig.rgb
    poses = np.asarray(recording.world_from_camera)
    photos = photo_views(scene, renderer, camera, evidence, poses, for_photos)
    asks, photo = choose_questions(evidence, photos, out, for_questions)
    if photo is not None:
        cv2.imwrite(str(out / PHOTO), renderer.render(camera, photo.world_from_camera).rgb[..., ::-1])
    return asks, photo


def _write_clip(asks: list[Ask], out: Path, rng: np.random.Generator) -> None:
    import soundfile

    from avlmaps_sim.hearing.sound_library import Synthesised

    for ask in asks:
        if ask.kind == "clip":
            _, sound = Synthesised().draw(ask.about, rng)
            soundfile.write(out / CLIP, sound.samples, sound.rate_hz)


def _answer(avlmap: "AVLMap", ask: Ask, number: int, out: Path) -> "tuple[Step, Answer]":
    answer = avlmap.ask(ask.question)
    picture = f"question_{number}.png"
    if answer.heat is not None:
        answer.heat.plot(out / picture)
    return Step(ask, answer.to_dict(), picture), answer


def _located(avlmap: "AVLMap", photo: "PhotoView", out: Path) -> tuple[float, float] | None:
    from avlmaps.core.poses import rotation_angle_rad
    from avlmaps.query.modalities import read_picture

    pose, truth = avlmap.locate(read_picture(out / PHOTO)).world_from_camera, photo.world_from_camera
    if pose is None:
        return None
    off_cm = 100.0 * float(np.linalg.norm(pose[:3, 3] - truth[:3, 3]))
    return off_cm, float(np.rad2deg(rotation_angle_rad(pose, truth)))
