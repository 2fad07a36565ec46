"""Making a scene ready: recorded, mapped, its voxels labelled from points spread over true things, photos taken."""

import json
import os
import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from hashlib import sha256
from pathlib import Path

import msgspec
import numpy as np
from jaxtyping import Float, Int, UInt8

from avlmaps.core.camera import Pinhole
from avlmaps.core.errors import MapError
from avlmaps.core.files import write_bytes_atomically
from avlmaps.core.registry import Kind
from avlmaps.core.version import __version__
from avlmaps.days.surfaces import packed, unpacked
from avlmaps.maps.grid import GridSpec, index_ends
from avlmaps.perception.encoders import Encoders
from avlmaps.query.avlmap import AVLMap
from avlmaps.query.modalities import read_picture
from avlmaps.query.settings import Rules, build_settings, query_settings
from avlmaps.recordings.types import Recording
from avlmaps_sim.bench.harness.evidence import Event, Evidence, Photo, photo_name
from avlmaps_sim.bench.harness.own_recording import OwnRecording, is_recording
from avlmaps_sim.bench.harness.settings import Recorded, SceneSettings, TaskError, models_of, unheard_folder
from avlmaps_sim.free_space import STRUCTURE
from avlmaps_sim.hearing.sound_library import kind_of
from avlmaps_sim.mesh import Triple
from avlmaps_sim.recorder import RecordSettings, record_scene
from avlmaps_sim.scene import NOTHING, Scene, SceneObject
from avlmaps_sim.truth import OBJECTS, HeardEvent, Truth, read_truth

_SPACING_M = 0.02
_FOR_THINGS = 4.0  # a thing's points count more than a wall's, as the eye takes a picture for a picture
_TRIANGLES = 1_000  # at once: their points stay in the cache
_STEP_U, _STEP_V = 0.7548776662466927, 0.5698402909980532  # 1/p and 1/p², p³ = p + 1: the evenest steps in the plane


@dataclass(frozen=True, slots=True, eq=False)
class TrueVoxels:
    """The voxels that a scene's surfaces pass through: packed indices, rising, and what fills most of each."""

    key: Int[np.ndarray, " m"]
    instance: Int[np.ndarray, " m"]

    @classmethod
    def of(cls, scene: Scene, grid: GridSpec) -> "TrueVoxels":
        """Spread points over all triangles and let each voxel belong to the thing with most points in it."""
        corners = np.asarray(scene.mesh.corners(), np.float64)
        if not len(corners):
            return cls(np.zeros(0, np.int64), np.zeros(0, np.int64))
        low, high = index_ends(grid.index_of(corners.reshape(-1, 3)))
        first, shape = low - 1, high - low + 3  # a point may be rounded out of its triangle
        weight = np.array([1.0 if thing.category in STRUCTURE else _FOR_THINGS for thing in scene.objects])
        pairs = list[np.ndarray]()  # voxel and thing of each point, as one number, since one array is sorted quickly
        for start in range(0, len(corners), _TRIANGLES):
            part = slice(start, start + _TRIANGLES)
            points, triangle = _spread(corners[part], _SPACING_M)
            voxel = np.ravel_multi_index(tuple((grid.index_of(points) - first).T), tuple(shape))
            pairs.append(voxel * len(weight) + scene.instance[part][triangle])
        pair, count = np.unique(np.concatenate(pairs), return_counts=True)
        voxel, instance = np.divmod(pair, len(weight))
        order = np.lexsort((-count * weight[instance], voxel))
        most = order[np.flatnonzero(np.diff(voxel[order], prepend=-1))]
        return cls(packed(np.stack(np.unravel_index(voxel[most], tuple(shape)), axis=1) + first), instance[most])

    def label(self, index: Int[np.ndarray, "n 3"]) -> Int[np.ndarray, " n"]:
        """Return the thing of each voxel of a map, -1 for none; a voxel beside a surface counts as on it."""
        index = np.asarray(index, np.int64)
        label = self._at(index)
        for offset in _NEIGHBOURS:
            missing = np.flatnonzero(label == NOTHING)
            label[missing] = self._at(index[missing] + offset)
        return label

    @property
    def index(self) -> Int[np.ndarray, "m 3"]:
        """The voxels, as the grid counts them."""
        return unpacked(self.key)

    def _at(self, index: Int[np.ndarray, "n 3"]) -> Int[np.ndarray, " n"]:
        if not len(self.key):
            return np.full(len(index), NOTHING)
        key = packed(index)
        row = np.minimum(np.searchsorted(self.key, key), len(self.key) - 1)
        return np.where(self.key[row] == key, self.instance[row], NOTHING)


_STEPS = np.stack(np.meshgrid(*[[-1, 0, 1]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
_NEIGHBOURS = _STEPS[np.argsort(np.abs(_STEPS).sum(axis=1), kind="stable")][1:]  # those that share a face first


def _spread(corners: Float[np.ndarray, "t 3 3"], spacing_m: float) -> tuple[np.ndarray, np.ndarray]:
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2.0
    count = 1 + np.ceil(2.0 * area / spacing_m**2).astype(np.int64)
    owner = np.repeat(np.arange(len(corners)), count)
    number = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    u, v = (number * _STEP_U + 0.5) % 1.0, (number * _STEP_V + 0.5) % 1.0
    folded = u + v > 1.0
    u, v = np.where(folded, 1.0 - u, u)[:, None], np.where(folded, 1.0 - v, v)[:, None]
    return a[owner] + u * (b - a)[owner] + v * (c - a)[owner], owner


_FPS = 5.0
_STOREY_BELOW_M, _STOREY_ABOVE_M = 1.7, 1.3  # from the camera's height
_RECIPE = 1  # raised when what a folder of work holds is made in another way


@dataclass(frozen=True, slots=True)
class SceneJob:
    """The settings of the scenes that one process makes ready.

    Sounds are made by rule where there is no folder of clips; ``work`` holds all scenes' work.
    """

    spec: str
    recorded: Recorded
    sounds: Path | None
    profile: str
    work: Path
    models: tuple[str, ...] = ()
    rules: Rules = "ours"

    @property
    def used(self) -> Encoders:
        """The encoders of the profile, with the models that were chosen."""
        return models_of(self.profile, self.models)

    @property
    def map_name(self) -> str:
        """Name of the map's folder: one for each choice of models and rules."""
        others = f"-{sha256(repr(sorted(self.models)).encode()).hexdigest()[:8]}" if self.models else ""
        return f"{self.profile}{others}{'' if self.rules == 'ours' else '-' + self.rules}.avlmap"

    @property
    def folder(self) -> Path:
        """This scene's own folder, named by everything that its recording depends on."""
        source = Path(self.spec)
        source = source / OBJECTS if is_recording(self.spec) else source
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
        wanted, sounds = self.recorded, self.sounds
        if sounds is not None and wanted.clips == "unheard":
            sounds = unheard_folder(sounds, self.work)
        return RecordSettings(
            fps=_FPS, sensor=wanted.sensor, hearing=wanted.hearing, sounds=sounds, sources=wanted.sources,  # pyright: ignore[reportArgumentType]
            ambiguous=wanted.ambiguous, places=wanted.places, max_frames=wanted.frames, workers=1,
        )  # fmt: skip


def scene_jobs(settings: SceneSettings, recorded: Recorded, names: Sequence[str], work: Path) -> list[SceneJob]:
    """Return one job for each scene."""
    return [
        SceneJob(name, recorded, settings.sounds, settings.profile, work, settings.models, settings.rules)
        for name in names
    ]


@dataclass(eq=False)
class Workplace:
    """A scene's folder of work; what is there already is not made again."""

    job: SceneJob
    open_spec: Callable[[str], Scene]

    @cached_property
    def scene(self) -> Scene:
        """The scene itself; making it takes seconds, and a second run needs it only for new photos.

        ``TaskError``: it is not the scene that was recorded, or a recording, of which no geometry is known.
        """
        if self.own is not None:
            raise TaskError(
                f"{self.job.spec} is a recording: its geometry is not known beyond its boxes. Give house:SEED or "
                "a scene file."
            )
        scene = self.open_spec(self.job.spec)
        folder = self.job.folder / "recording"
        if folder.exists() and not _same_things(scene.objects, read_truth(folder).objects):
            raise TaskError(
                f"{self.job.spec} is no longer the scene that {folder} was recorded in (the simulator has changed); "
                f"remove {self.job.folder} and run again."
            )
        return scene

    @cached_property
    def own(self) -> OwnRecording | None:
        """The user's recording, where the job names one; None for a scene to be simulated."""
        return OwnRecording.open(Path(self.job.spec)) if is_recording(self.job.spec) else None

    @cached_property
    def _renderer(self):
        from avlmaps_sim.render import Renderer

        return Renderer(self.scene)

    @cached_property
    def recording(self) -> Recording:
        """The recording, made if need be."""
        from avlmaps.recordings.open import open_recording

        if self.own is not None:
            return self.own.mapped
        folder = self.job.folder / "recording"
        if not folder.exists():
            unfinished = _fresh(self.job.folder / f"recording-unfinished-{os.getpid()}")
            seed = int(self.job.rng(0).integers(1 << 31))
            record_scene(self.scene, unfinished, self.job.record_settings, seed)
            unfinished.rename(folder)
        return open_recording(folder)

    @cached_property
    def truth(self) -> Truth:
        """The truth of the scene; sounds by the names that people use, for any names of a collection."""
        truth = read_truth(self.recording.path) if self.own is None else self.own.truth
        named = tuple(replace(event, category=called(event.category)) for event in truth.events)
        return replace(truth, events=named)

    @cached_property
    def avlmap(self) -> AVLMap:
        """The map, built if need be."""
        from avlmaps.maps.build import build_map

        path, rules, used = self.job.folder / self.job.map_name, self.job.rules, self.job.used
        settings = build_settings(rules)
        path.parent.mkdir(parents=True, exist_ok=True)
        try:  # a finished one is taken as it is
            stored = build_map(self.recording, path, used, settings, progress=False)
        except MapError:  # by another release, or with other settings
            stored = build_map(self.recording, path, used, settings, overwrite=True, progress=False)
        return AVLMap(stored, path=path, settings=query_settings(rules))

    @cached_property
    def _true_voxels(self) -> TrueVoxels:
        grid = self.avlmap.data.grid
        path = self.job.folder / f"true-voxels-{round(grid.voxel_size_m * 1000)}mm.npz"
        if not path.exists():
            made = TrueVoxels.of(self.scene, grid)
            unfinished = path.with_suffix(f".{os.getpid()}.tmp.npz")
            np.savez(unfinished, key=made.key, instance=made.instance)
            unfinished.rename(path)
        with np.load(path, allow_pickle=False) as kept:
            return TrueVoxels(kept["key"], kept["instance"])

    @property
    def wall_points(self) -> Float[np.ndarray, "w 3"]:
        """Middles of the voxels that the walls of a simulated scene pass through, metres."""
        true = self._true_voxels
        walls = np.array([thing.category in ("wall", "column") for thing in self.truth.objects])
        return self.avlmap.data.grid.centre_of(true.index[walls[true.instance]])

    @cached_property
    def label(self) -> Int[np.ndarray, " n"]:
        """The true thing of each voxel of the map, -1 for none."""
        if self.own is not None:
            return self.own.label(self.avlmap.space.centres, self.avlmap.data.up_in_world)
        return self._true_voxels.label(np.asarray(self.avlmap.data.voxels.index))

    def has(self, kinds: Sequence[Kind]) -> bool:
        """Return whether the map's profile has models for all of these."""
        return all(kind in self.avlmap.encoders for kind in kinds)

    def photo(self, world_from_camera: Float[np.ndarray, "4 4"]) -> UInt8[np.ndarray, "h w 3"]:
        """Return the photo taken from a pose, drawn if need be."""
        return read_picture(self.photo_file(world_from_camera))

    def photo_file(self, world_from_camera: Float[np.ndarray, "4 4"]) -> Path:
        """Return the file of a photo taken from a pose, drawn if need be."""
        path = self.job.folder / "photos" / photo_name(world_from_camera)
        if not path.exists():
            import cv2

            path.parent.mkdir(parents=True, exist_ok=True)
            if self.own is None:
                rgb = self._renderer.render(self.camera, world_from_camera).rgb
            else:
                rgb = self.own.picture(world_from_camera)
            content = cv2.imencode(".png", np.ascontiguousarray(rgb[..., ::-1]))[1].tobytes()
            write_bytes_atomically(path, content)
        return path

    @property
    def camera(self) -> Pinhole:
        """The camera of the recording, and of the photos."""
        return self.recording.rig.rgb

    @property
    def evidence(self) -> Evidence:
        """The map and the truth from which tasks are made."""
        label, truth = self.label, self.truth
        seen = np.bincount(label[label != NOTHING], minlength=len(truth.objects))
        eye_m = float(np.median(self.recording.world_from_camera[:, 2, 3]))
        storey_m = (eye_m - _STOREY_BELOW_M, eye_m + _STOREY_ABOVE_M)
        events = tuple(map(self._event, truth.events))
        return Evidence(self.job.spec, truth.objects, seen, truth.areas, events, storey_m)

    def _event(self, event: HeardEvent) -> Event:
        if self.job.recorded.hearing == "acoustic":
            return Event(event.category, event.source)
        stamps_s = self.recording.stamps_s
        during = np.flatnonzero((stamps_s >= event.onset_s) & (stamps_s <= event.offset_s))
        places: list[Triple] = [tuple(p) for p in self.recording.world_from_camera[during, :3, 3].tolist()]
        return Event(event.category, event.robot, tuple(places))

    def photos(self, count: int) -> Sequence[Photo]:
        """Render from places where the robot never stood, held out from the walk; only on the floor that it walked."""
        if self.own is not None:
            return self.own.photos(count)
        from avlmaps_sim.views import random_views

        views = random_views(self.scene, self.job.rng(4), count, self.camera)
        heights = self.recording.world_from_camera[:, 2, 3]
        found: list[Photo] = []
        for pose in views[np.abs(views[:, 2, 3] - heights.mean()) < 1.5]:
            instance = self._renderer.render(self.camera, pose).instance
            shown = np.bincount(instance[instance != NOTHING], minlength=len(self.truth.objects))
            found.append(Photo(pose, shown / instance.size))
        return found


def _same_things(made: Sequence[SceneObject], recorded: Sequence[SceneObject]) -> bool:
    if [thing.category for thing in made] != [thing.category for thing in recorded]:
        return False
    corners = (np.array([(*thing.low, *thing.high) for thing in things]) for things in (made, recorded))
    return bool(np.allclose(*corners, rtol=0.0, atol=1e-3))


def _fresh(folder: Path) -> Path:
    folder.parent.mkdir(parents=True, exist_ok=True)
    for stale in folder.parent.glob("recording-unfinished-*"):
        shutil.rmtree(stale, ignore_errors=True)
    return folder


def called(sound: str) -> str:
    """Return our name of a kind of sound: ``door knock`` for clips of ``door wood knock``; other names stay."""
    return kind_of(sound).names[0] or sound
