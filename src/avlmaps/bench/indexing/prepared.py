"""Making a scene ready to be asked: recorded, mapped, its voxels labelled, its photos drawn; all kept on the disk."""

import json
import os
import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from pathlib import Path

import msgspec
import numpy as np
from jaxtyping import Float, UInt8

from avlmaps.bench.indexing.rules import Event, Evidence, Photo, area_tasks, photo_tasks, sound_tasks
from avlmaps.bench.indexing.scene_queries import AskedScene
from avlmaps.bench.indexing.tasks import Recorded, Task, TaskError, TaskKind
from avlmaps.bench.indexing.true_voxels import TrueVoxels
from avlmaps.core.camera import Pinhole
from avlmaps.core.errors import MapError
from avlmaps.core.files import write_bytes_atomically
from avlmaps.core.version import __version__
from avlmaps.query.avlmap import AVLMap
from avlmaps.query.modalities.image import read_picture
from avlmaps.recordings.types import Recording
from avlmaps.sim.recorder import RecordSettings, record_scene
from avlmaps.sim.scene import NOTHING, Scene, SceneObject
from avlmaps.sim.truth import Truth, read_truth

_FPS = 5.0
_PHOTOS_A_TASK = 12  # so many are tried for each that is wanted
_STOREY_BELOW_M, _STOREY_ABOVE_M = 1.7, 1.3  # from the camera's height
_RECIPE = 1  # raised when what a folder of work holds is made in another way


@dataclass(frozen=True, slots=True)
class SceneJob:
    """What one process makes ready.

    Attributes:
        spec: the scene's name.
        recorded: how it is recorded.
        sounds: the folder of clips; None for sounds made by rule.
        profile: which models map it.
        work: where all scenes' work is kept.
    """

    spec: str
    recorded: Recorded
    sounds: Path | None
    profile: str
    work: Path

    @property
    def folder(self) -> Path:
        """This scene's own folder, named by everything that its recording depends on."""
        source = Path(self.spec)
        content = sha256(source.read_bytes()).hexdigest() if source.is_file() else ""
        facts = [self.spec, content, msgspec.to_builtins(self.recorded), __version__, _RECIPE]
        name = "".join(c if c.isalnum() else "-" for c in self.spec)[-40:]
        return self.work / f"{name}-{sha256(json.dumps(facts).encode()).hexdigest()[:12]}"

    def rng(self, stream: int) -> np.random.Generator:
        """Return randomness for one purpose, from the seed and the scene's name alone."""
        named = int.from_bytes(sha256(self.spec.encode()).digest()[:4], "little")
        return np.random.default_rng([self.recorded.seed, named, stream])

    @property
    def record_settings(self) -> RecordSettings:
        """The settings of the recording."""
        wanted = self.recorded
        return RecordSettings(
            fps=_FPS, sensor=wanted.sensor, hearing=wanted.hearing, sounds=self.sounds, sources=wanted.sources,  # pyright: ignore[reportArgumentType]
            ambiguous=wanted.ambiguous, max_frames=wanted.frames, workers=1,
        )  # fmt: skip


@dataclass(eq=False)
class Workplace:
    """A scene's folder of work; what is there already is not made again.

    Attributes:
        job: which scene.
        open_spec: makes a scene of its name.
    """

    job: SceneJob
    open_spec: Callable[[str], Scene]

    @cached_property
    def scene(self) -> Scene:
        """The scene itself; making it takes seconds, and a second run needs it only for new photos."""
        scene = self.open_spec(self.job.spec)
        folder = self.job.folder / "recording"
        if folder.exists() and not _same_things(scene.objects, read_truth(folder).objects):
            raise TaskError(
                f"{self.job.spec} is no longer the scene that {folder} was recorded in (the simulator has changed); "
                f"remove {self.job.folder} and run again."
            )
        return scene

    @cached_property
    def _renderer(self):
        from avlmaps.sim.render import Renderer

        return Renderer(self.scene)

    @cached_property
    def recording(self) -> Recording:
        """The recording, made if need be."""
        from avlmaps.recordings.open import open_recording

        folder = self.job.folder / "recording"
        if not folder.exists():
            unfinished = _fresh(self.job.folder / f"recording-unfinished-{os.getpid()}")
            seed = int(self.job.rng(0).integers(1 << 31))
            record_scene(self.scene, unfinished, self.job.record_settings, seed)
            unfinished.rename(folder)
        return open_recording(folder)

    @cached_property
    def truth(self) -> Truth:
        """What is truly there."""
        return read_truth(self.recording.path)

    @cached_property
    def asked(self) -> AVLMap:
        """The map, built if need be."""
        from avlmaps.maps.build import build_map

        path = self.job.folder / f"{self.job.profile}.avlmap"
        try:  # one that is there already is taken as it is
            return AVLMap(build_map(self.recording, path, self.job.profile, progress=False))
        except MapError:  # by another release, or with other settings
            return AVLMap(build_map(self.recording, path, self.job.profile, overwrite=True, progress=False))

    @cached_property
    def _true_voxels(self) -> TrueVoxels:
        grid = self.asked.stored.grid
        path = self.job.folder / f"true-voxels-{round(grid.voxel_size_m * 1000)}mm.npz"
        if not path.exists():
            made = TrueVoxels.of(self.scene, grid)
            unfinished = path.with_suffix(f".{os.getpid()}.tmp.npz")
            np.savez(unfinished, key=made.key, instance=made.instance)
            unfinished.rename(path)
        with np.load(path, allow_pickle=False) as kept:
            return TrueVoxels(kept["key"], kept["instance"])

    @cached_property
    def asked_scene(self) -> AskedScene:
        """The scene, ready to be asked."""
        label = self._true_voxels.label(np.asarray(self.asked.stored.voxels.index))
        hearing, seed = self.job.recorded.hearing, self.job.recorded.seed
        return AskedScene(self.asked, self.recording, self.truth, label, hearing, self.photo_of, seed)

    def photo_of(self, task: Task) -> UInt8[np.ndarray, "h w 3"]:
        """Return a task's photo, drawn if need be."""
        return read_picture(self.photo_file(task.world_from_photo))

    def photo_file(self, world_from_camera: Float[np.ndarray, "4 4"]) -> Path:
        """Return the file of a photo taken from a pose, drawn if need be."""
        named = sha256(world_from_camera.round(9).tobytes()).hexdigest()[:12]
        path = self.job.folder / "photos" / f"{named}.png"
        if not path.exists():
            import cv2

            path.parent.mkdir(parents=True, exist_ok=True)
            view = self._renderer.render(self.camera, world_from_camera)
            content = cv2.imencode(".png", np.ascontiguousarray(view.rgb[..., ::-1]))[1].tobytes()
            write_bytes_atomically(path, content)
        return path

    @property
    def camera(self) -> Pinhole:
        """The camera of the recording, and of the photos."""
        return self.recording.rig.rgb

    @property
    def evidence(self) -> Evidence:
        """What tasks are made of."""
        label, truth = self.asked_scene.label, self.truth
        seen = np.bincount(label[label != NOTHING], minlength=len(truth.objects))
        acoustic = self.job.recorded.hearing == "acoustic"
        events = tuple(Event(e.category, e.source if acoustic else e.robot) for e in truth.events)
        eye_m = float(np.median(self.recording.world_from_camera[:, 2, 3]))
        storey_m = (eye_m - _STOREY_BELOW_M, eye_m + _STOREY_ABOVE_M)
        return Evidence(self.job.spec, truth.objects, seen, truth.areas, events, storey_m)

    def tasks(self, most: int) -> list[Task]:
        """Make this scene's tasks, at most so many of each kind."""
        evidence = self.evidence
        photos = self.photos(_PHOTOS_A_TASK * most)
        return [
            *area_tasks(evidence, self.job.rng(1), most),
            *sound_tasks(evidence, self.job.rng(2), most),
            *photo_tasks(evidence, photos, self.job.rng(3), most),
        ]

    def photos(self, count: int) -> Sequence[Photo]:
        """Look from places where the robot never stood, held out from the walk; only on the floor that it walked."""
        from avlmaps.sim.views import random_views

        views = random_views(self.scene, self.job.rng(4), count, self.camera)
        heights = self.recording.world_from_camera[:, 2, 3]
        found: list[Photo] = []
        for pose in views[np.abs(views[:, 2, 3] - heights.mean()) < 1.5]:
            instance = self._renderer.render(self.camera, pose).instance
            shown = np.bincount(instance[instance != NOTHING], minlength=len(self.truth.objects))
            found.append(Photo(pose, shown / instance.size))
        return found


def _same_things(made: Sequence[SceneObject], recorded: Sequence[SceneObject]) -> bool:
    """Tell whether things are the same, to the rounding of the files."""
    if [thing.category for thing in made] != [thing.category for thing in recorded]:
        return False
    corners = (np.array([(*thing.low, *thing.high) for thing in things]) for things in (made, recorded))
    return bool(np.allclose(*corners, rtol=0.0, atol=1e-3))


def _fresh(folder: Path) -> Path:
    folder.parent.mkdir(parents=True, exist_ok=True)
    for stale in folder.parent.glob("recording-unfinished-*"):
        shutil.rmtree(stale, ignore_errors=True)
    return folder


def kinds_of(tasks: Sequence[Task]) -> dict[TaskKind, int]:
    """Count tasks by kind."""
    return {kind: sum(task.kind is kind for task in tasks) for kind in TaskKind}
