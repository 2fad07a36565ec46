"""Running the benchmark: first all scenes' missions are made, then robots are sent, every scene in its own process."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from hashlib import sha256
from math import ceil
from pathlib import Path

import numpy as np
from jaxtyping import Float

from avlmaps.core.errors import BackendError
from avlmaps.core.motion import GroundPose
from avlmaps.core.version import __version__
from avlmaps.language.translator import Translator
from avlmaps.maps.obstacles import Obstacles
from avlmaps.navigate.costmap import BASE, obstacles_for
from avlmaps.navigate.driver import Driver, MapDriver
from avlmaps_sim.bench.harness.factors import WeakHearing
from avlmaps_sim.bench.harness.own_recording import is_recording
from avlmaps_sim.bench.harness.settings import TaskError, in_turn, load_versioned, save_versioned
from avlmaps_sim.bench.harness.workers import side_by_side
from avlmaps_sim.bench.harness.workplace import SceneJob, Workplace, scene_jobs
from avlmaps_sim.bench.indexing.tasks import area_tasks, near_sound_tasks, photo_tasks
from avlmaps_sim.bench.navigation.commands import command_missions, image_missions, pair_missions, sound_missions
from avlmaps_sim.bench.navigation.episode_runner import Foreknowledge, Pilot, WatchedBody
from avlmaps_sim.bench.navigation.episodes import Episode, Journal
from avlmaps_sim.bench.navigation.evidence import Floor, Ground
from avlmaps_sim.bench.navigation.map_variants import Configuration, KnownScene, configurations
from avlmaps_sim.bench.navigation.missions import (
    SCHEMA_VERSION,
    Mission,
    MissionSet,
    NavigationSettings,
    Series,
    asked_for,
    numbered,
)
from avlmaps_sim.body import Building, SimulatedBody
from avlmaps_sim.scene import Scene
from avlmaps_sim.scenes import open_scene

_PHOTOS = 120  # drawn in a scene; those that show too little are left
_TASKS = 20  # ambiguous things of each kind in a scene
_MORE = 2.0  # a scene offers this many times its share, since others may have fewer
_STREAM = 20  # of random numbers: those below are the indexing suite's


class NavigationPlace:
    """A scene's folder of work, and what missions take."""

    def __init__(self, job: SceneJob, settings: NavigationSettings, open_spec: Callable[[str], Scene]) -> None:
        self.job, self.settings = job, settings
        self.work = Workplace(job, open_spec)

    @cached_property
    def floor(self) -> Floor:
        """The true ground."""
        camera = self.work.recording.world_from_camera[:, :3, 3]
        return Floor.walked(self.work.scene, camera, BASE.radius_m, BASE.height_m)

    @cached_property
    def building(self) -> Building:
        """The true obstacles of a robot."""
        return Building(self.work.scene, BASE.step_m, BASE.height_m, self.floor.number)

    @cached_property
    def obstacles(self) -> Obstacles:
        """The obstacles that the map shows."""
        return obstacles_for(self.work.avlmap, BASE)

    @cached_property
    def _known(self) -> Foreknowledge:
        return Foreknowledge(self.obstacles, BASE.radius_m)

    @cached_property
    def ground(self) -> Ground:
        """The evidence from which missions are made."""
        evidence, rng = self.work.evidence, self._rng(0)
        photos = tuple(self.work.photos(_PHOTOS))
        tasks = (
            *near_sound_tasks(evidence, rng, _TASKS), *photo_tasks(evidence, photos, rng, _TASKS),
            *area_tasks(evidence, rng, _TASKS),
        )  # fmt: skip
        return Ground(evidence, self.floor, photos, tasks)

    def missions(self) -> list[Mission]:
        """Make this scene's missions: more than its share, in an order of which a first part can be taken."""
        made: list[Mission] = []
        for number, series in enumerate(Series):
            if series not in self.settings.series:
                continue
            total = self.settings.total(series)
            most = 0 if total is None else ceil(_MORE * total / len(self.settings.scenes))
            rng = self._rng(1 + number)
            if total is None:
                made += command_missions(self.ground, series, rng)
            elif series is Series.IMAGES:
                made += image_missions(self.ground, rng, most)
            elif series is Series.PAIRS:
                made += pair_missions(self.ground, rng, most)
            else:
                made += sound_missions(self.ground, series, rng, most)
        return numbered([mission for mission in made if self._fits(mission.pose)])

    def _fits(self, pose: GroundPose) -> bool:
        return self.building.clearance_m(pose.x_m, pose.y_m) > BASE.radius_m

    def _rng(self, stream: int) -> np.random.Generator:
        return self.job.rng(_STREAM + stream)

    def pilot(self, missions: list[Mission], translator: Translator | None) -> Pilot:
        """Return the runner of missions."""
        avlmap = self.work.avlmap
        if not np.allclose(avlmap.data.up_in_world, (0.0, 0.0, 1.0), atol=1e-9):
            raise BackendError(f"The map of {self.job.spec} is not level; its stops cannot be compared with the truth.")
        photos: dict[str, Float[np.ndarray, "4 4"]] = {}
        names: dict[str, tuple[str, ...]] = {}
        for mission in missions:
            files = [self.work.photo_file(pose) for pose in mission.world_from_photos]
            photos |= dict(zip([file.name for file in files], mission.world_from_photos, strict=True))
            names[mission.name] = tuple(f"./{file.name}" for file in files)
        label, seed = self.work.label, self.job.recorded.seed
        hearing = cache(lambda: WeakHearing(avlmap, seed))
        known = KnownScene(avlmap, self.work.truth, label, self.job.recorded.hearing, photos, hearing)
        return Pilot(
            known, self.floor, self._launch, translator, self.job.folder / "photos",
            lambda mission: names[mission.name], self.settings.guess, seed,
        )  # fmt: skip

    def _launch(self, start: GroundPose) -> tuple[Driver, WatchedBody]:
        body = WatchedBody(SimulatedBody(self.building, start, BASE.radius_m), self._known)
        return MapDriver(self.obstacles, body), body


_MAKING = 3  # raised when missions are made in another way
_SENDING = 4  # raised when robots are sent in another way
OpenSpec = Callable[[str], Scene]


@dataclass(frozen=True, slots=True)
class SceneFacts:
    """The properties of one scene.

    ``sounds`` counts those that were heard, and those that there were; ``clips`` are sound and clip of every event.
    """

    scene: str
    frames: int
    voxels: int
    sounds: tuple[int, int]
    episodes: tuple[Episode, ...]
    clips: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True, slots=True)
class Outcome:
    """The outcome of all scenes."""

    settings: NavigationSettings
    missions: MissionSet
    scenes: tuple[SceneFacts, ...]
    weights: Mapping[str, str] = field(default_factory=dict)

    @property
    def episodes(self) -> list[Episode]:
        """All episodes, scene by scene."""
        return [episode for scene in self.scenes for episode in scene.episodes]


@dataclass(frozen=True, slots=True)
class _Todo:
    job: SceneJob
    settings: NavigationSettings
    missions: tuple[Mission, ...]
    journal: Path
    open_spec: OpenSpec


def run(settings: NavigationSettings, out: Path, open_spec: OpenSpec = open_scene) -> Outcome:
    """Record and map every scene, and send robots on missions in it.

    ``out`` gets ``work`` (recordings and maps, shared with the indexing suite), ``navigation_missions.json`` and
    ``episodes``; a run that was broken off resumes from there.

    Raises:
        TaskError: the missions cannot be read, do not fit, or no scene yields any.
        BackendError: a model is missing.
    """
    weights = settings.checked()
    if recordings := [scene for scene in settings.scenes if is_recording(scene)]:
        raise TaskError(
            f"{recordings[0]} is a recording; robots are sent only through scenes whose geometry is known. Give "
            "house:SEED or a scene file, or run the suite indexing or objects."
        )
    missions = _missions(settings, out, open_spec)
    kept = tuple(mission for mission in missions.missions if mission.series in settings.series)
    if not kept:
        raise TaskError(
            f"The {len(missions.scenes)} scenes yield no mission of {', '.join(settings.series)}; take larger ones, or "
            f"more frames than {missions.recorded.frames}."
        )
    missions = replace(missions, missions=kept)
    if settings.save is not None:
        save_versioned(missions, settings.save)
    todo = [
        _Todo(
            job, settings, tuple(one for one in kept if one.scene == job.spec), _journal(settings, out, job), open_spec
        )
        for job in _jobs(settings, missions, out)
    ]
    total = sum(len(_pairs(one.missions)) for one in todo)
    scenes = side_by_side(
        _sent, todo, settings.jobs, "navigation", lambda: sum(Journal(one.journal).count() for one in todo), total
    )
    return Outcome(settings, missions, tuple(scenes), weights)


def _jobs(settings: NavigationSettings, missions: MissionSet, out: Path) -> list[SceneJob]:
    return scene_jobs(settings, missions.recorded, missions.scenes, out / "work")


def _journal(settings: NavigationSettings, out: Path, job: SceneJob) -> Path:
    return out / "episodes" / f"{job.folder.name}-{_key(settings)[:8]}.jsonl"


def _pairs(missions: Sequence[Mission]) -> list[tuple[Mission, Configuration]]:
    return [(mission, one) for mission in missions for one in configurations(mission.series)]


def _missions(settings: NavigationSettings, out: Path, open_spec: OpenSpec) -> MissionSet:
    if (given := settings.given(MissionSet, SCHEMA_VERSION)) is not None:
        return given
    asked = asked_for(
        settings.recorded, settings.scenes, settings.series, settings.sequences, settings.profile, settings.models,
        settings.rules, BASE, __version__, _MAKING,
    )  # fmt: skip
    path = out / "navigation_missions.json"
    if path.exists():
        before = load_versioned(path, MissionSet, SCHEMA_VERSION)
        if before.asked == asked:
            return before
    empty = MissionSet(settings.recorded, settings.scenes, BASE.radius_m, (), asked)
    todo = [_Todo(job, settings, (), _journal(settings, out, job), open_spec) for job in _jobs(settings, empty, out)]
    made = side_by_side(_made, todo, settings.jobs, "mapping")
    own = [
        mission
        for series in settings.series
        for mission in in_turn(
            [[one for one in scene if one.series is series] for scene in made], settings.total(series)
        )
    ]
    missions = replace(empty, missions=tuple(own))
    save_versioned(missions, path)
    return missions


def _made(todo: _Todo) -> list[Mission]:
    return NavigationPlace(todo.job, todo.settings, todo.open_spec).missions()


def _sent(todo: _Todo) -> SceneFacts:
    settings, journal = todo.settings, Journal(todo.journal)
    done = journal.read()
    place = NavigationPlace(todo.job, settings, todo.open_spec)
    pairs = [(mission, one) for mission, one in _pairs(todo.missions) if place.work.has(one.needs)]
    built = place.work.avlmap.data.info.build_key
    keyed = [(_key(settings, built, mission.fingerprint, one), mission, one) for mission, one in pairs]
    if any(key not in done for key, _, _ in keyed):
        pilot = place.pilot(list(todo.missions), translator_named(settings.language))
        for key, mission, one in keyed:
            if key not in done:
                done[key] = pilot.run(mission, one, key)
                journal.add(done[key])
    info = place.work.avlmap.data.info.counts
    sounds = (info.sounds, len(place.work.truth.events))
    episodes = tuple(done[key] for key, _, _ in keyed)
    clips = tuple((event.category, event.clip) for event in place.work.truth.events)
    return SceneFacts(todo.job.spec, info.frames, info.voxels, sounds, episodes, clips)


def _key(settings: NavigationSettings, *facts: object) -> str:
    how = (settings.rules, settings.language, settings.guess, BASE, settings.recorded, __version__, _SENDING)
    return sha256("\n".join(map(repr, (*how, *facts))).encode()).hexdigest()[:24]


def translator_named(language: str) -> Translator | None:
    """Return the translator of sentences into programs; None for programs as they are."""
    if language == "none":
        return None
    if language == "chat":
        from avlmaps.language.chat import ChatTranslator

        return ChatTranslator()
    from avlmaps.language.translator import LearnedTranslator

    return LearnedTranslator()
