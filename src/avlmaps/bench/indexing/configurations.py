"""The rows of the tables: which sources of heat are joined. The map, the fusion and the goals are the same for all."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from avlmaps.bench.indexing.scene_queries import AskedScene
from avlmaps.bench.indexing.tasks import Task, TaskKind
from avlmaps.core.errors import QueryError
from avlmaps.core.question import Role
from avlmaps.core.registry import Kind
from avlmaps.query.heatmap import Heatmap, fused
from avlmaps.sim.mesh import Triple

Source = Callable[[AskedScene, Task, Role], Heatmap | None]

OURS, CEILING = "ours", "true perception"


@dataclass(frozen=True, slots=True)
class Configuration:
    """A row of a table.

    Attributes:
        kind: which table.
        name: what the row is called.
        sources: what is joined; the first is what is sought, the others say where it is.
        needs: models that the profile must have.
        role: ``baseline`` for single modalities, ``ours``, ``ceiling``, else ``variant``.
    """

    kind: TaskKind
    name: str
    sources: tuple[Source, ...]
    needs: tuple[Kind, ...] = ()
    role: str = "variant"

    def answer(self, scene: AskedScene, task: Task) -> Triple | None:
        """Return the first goal's place; None where the map has no answer, or knows nothing of a word."""
        try:
            heat = [
                source(scene, task, Role.CONTEXT if number else Role.PRIMARY)
                for number, source in enumerate(self.sources)
            ]
        except QueryError:
            return None
        goals = fused([one for one in heat if one is not None]).goals(1)
        return goals[0].position if goals else None


_CAMERA, _CENTRE = (partial(AskedScene.map_area, anchor=anchor) for anchor in ("camera", "centre"))
_PIXELS, _SOUNDS = (Kind.PIXELS,), (Kind.PIXELS, Kind.SOUNDS)
_VIEWS = (Kind.PIXELS, Kind.VIEWS)
_PHOTOS = (Kind.PIXELS, Kind.LOCAL, Kind.PLACE, Kind.MATCHER)
_object = AskedScene.map_object

CONFIGURATIONS: tuple[Configuration, ...] = (
    Configuration(TaskKind.AREA, "object only", (_object,), _PIXELS, "baseline"),
    Configuration(TaskKind.AREA, "+ area by the object encoder", (_object, AskedScene.area_as_object), _PIXELS),
    Configuration(TaskKind.AREA, "+ pixel-aligned view features", (_object, AskedScene.pixel_views), _VIEWS),
    Configuration(TaskKind.AREA, "+ sparse view map, camera (the paper's)", (_object, _CAMERA), _VIEWS),
    Configuration(TaskKind.AREA, "+ sparse view map (ours)", (_object, _CENTRE), _VIEWS, OURS),
    Configuration(TaskKind.AREA, "+ true region map", (_object, AskedScene.true_area), _PIXELS),
    Configuration(TaskKind.AREA, "true objects + sparse view map", (AskedScene.true_object, _CENTRE), (Kind.VIEWS,)),
    Configuration(TaskKind.AREA, CEILING, (AskedScene.true_object, AskedScene.true_area), (), "ceiling"),
    Configuration(TaskKind.SOUND, "object only", (_object,), _PIXELS, "baseline"),
    Configuration(TaskKind.SOUND, "sound only, weak", (AskedScene.weak_sound,), (), "baseline"),
    Configuration(TaskKind.SOUND, "sound only", (AskedScene.map_sound,), (Kind.SOUNDS,), "baseline"),
    Configuration(TaskKind.SOUND, "object + sound, weak", (_object, AskedScene.weak_sound), _PIXELS),
    Configuration(TaskKind.SOUND, "object + sound (ours)", (_object, AskedScene.map_sound), _SOUNDS, OURS),
    Configuration(TaskKind.SOUND, "object + true sound", (_object, AskedScene.true_sound), _PIXELS),
    Configuration(
        TaskKind.SOUND, "true objects + sound", (AskedScene.true_object, AskedScene.map_sound), (Kind.SOUNDS,)
    ),
    Configuration(TaskKind.SOUND, CEILING, (AskedScene.true_object, AskedScene.true_sound), (), "ceiling"),
    Configuration(TaskKind.PHOTO, "object only", (_object,), _PIXELS, "baseline"),
    Configuration(TaskKind.PHOTO, "image only", (AskedScene.map_photo,), _PHOTOS[1:], "baseline"),
    Configuration(
        TaskKind.PHOTO, "object + most alike keyframe, not located", (_object, AskedScene.alike_keyframe), _PHOTOS
    ),
    Configuration(TaskKind.PHOTO, "object + image (ours)", (_object, AskedScene.map_photo), _PHOTOS, OURS),
    Configuration(TaskKind.PHOTO, "object + true camera", (_object, AskedScene.true_camera), _PIXELS),
    Configuration(TaskKind.PHOTO, "true objects + image", (AskedScene.true_object, AskedScene.map_photo), _PHOTOS[1:]),
    Configuration(TaskKind.PHOTO, CEILING, (AskedScene.true_object, AskedScene.true_camera), (), "ceiling"),
)


def configurations(kind: TaskKind) -> tuple[Configuration, ...]:
    """Return the rows of a table, in their order."""
    return tuple(one for one in CONFIGURATIONS if one.kind is kind)
