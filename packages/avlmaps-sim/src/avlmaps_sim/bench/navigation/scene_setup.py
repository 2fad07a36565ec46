"""One scene made ready: its missions drawn, its robots launched. Recordings and maps are as in the indexing suite."""

from collections.abc import Callable
from functools import cached_property
from math import ceil

import numpy as np
from jaxtyping import Float

from avlmaps.core.errors import BackendError
from avlmaps.core.motion import GroundPose
from avlmaps.language.translator import Translator
from avlmaps.maps.obstacles import Obstacles
from avlmaps.navigate.bodies import BASE
from avlmaps.navigate.costmap import obstacles_for
from avlmaps.navigate.driver import Driver, MapDriver
from avlmaps_sim.bench.harness.factors import WeakHearing
from avlmaps_sim.bench.harness.workplace import SceneJob, Workplace
from avlmaps_sim.bench.indexing.tasks import area_tasks, near_sound_tasks, photo_tasks
from avlmaps_sim.bench.navigation.commands import command_missions
from avlmaps_sim.bench.navigation.episode_runner import Foreknowledge, Pilot, WatchedBody
from avlmaps_sim.bench.navigation.evidence import Ground
from avlmaps_sim.bench.navigation.floor import Floor
from avlmaps_sim.bench.navigation.map_variants import KnownScene
from avlmaps_sim.bench.navigation.missions import Mission, NavigationSettings, Series, numbered
from avlmaps_sim.bench.navigation.rules import image_missions, pair_missions, sound_missions
from avlmaps_sim.body import Building, SimulatedBody
from avlmaps_sim.scene import Scene

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
        hearing = _once(lambda: WeakHearing(avlmap, seed))
        known = KnownScene(avlmap, self.work.truth, label, self.job.recorded.hearing, photos, hearing)
        return Pilot(
            known, self.floor, self._launch, translator, self.job.folder / "photos",
            lambda mission: names[mission.name], self.settings.guess, seed,
        )  # fmt: skip

    def _launch(self, start: GroundPose) -> tuple[Driver, WatchedBody]:
        body = WatchedBody(SimulatedBody(self.building, start, BASE.radius_m), self._known)
        return MapDriver(self.obstacles, body), body


def _once(make: Callable[[], WeakHearing]) -> Callable[[], WeakHearing]:
    made: list[WeakHearing] = []

    def given() -> WeakHearing:
        if not made:
            made.append(make())
        return made[0]

    return given
