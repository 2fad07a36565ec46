"""The rows of the tables: which sources of heat are joined. The map, the fusion and the goals are the same for all."""

from collections.abc import Callable
from dataclasses import dataclass

from avlmaps.core.errors import QueryError
from avlmaps.core.question import Role
from avlmaps.core.registry import Kind
from avlmaps.query.heatmap import Heatmap, product
from avlmaps_sim.bench.indexing.scene_queries import QueriedScene
from avlmaps_sim.bench.indexing.tasks import Task, TaskKind
from avlmaps_sim.mesh import Triple

Source = Callable[[QueriedScene, Task, Role], Heatmap | None]

OURS, CEILING = "ours", "true perception"


@dataclass(frozen=True, slots=True)
class Configuration:
    """A row of a table.

    The first of the ``sources`` is what is sought, the others say where it is; ``role`` is ``baseline`` for single
    modalities, ``ours``, ``ceiling``, else ``variant``.
    """

    kind: TaskKind
    name: str
    sources: tuple[Source, ...]
    needs: tuple[Kind, ...] = ()
    role: str = "variant"

    def answer(self, scene: QueriedScene, task: Task) -> tuple[Triple | None, bool]:
        """Return the first goal's place and whether the whole was reported as found.

        The place is None where the map has no answer, or knows nothing of a word.
        """
        try:
            heat = [
                source(scene, task, Role.CONTEXT if number else Role.PRIMARY)
                for number, source in enumerate(self.sources)
            ]
        except QueryError:
            return None, False
        whole = product([one for one in heat if one is not None])
        goals = whole.goals(1)
        return (goals[0].position, whole.found) if goals else (None, False)


_PIXELS, _SOUNDS = (Kind.PIXELS,), (Kind.PIXELS, Kind.SOUNDS)
_VIEWS = (Kind.PIXELS, Kind.VIEWS)
_PHOTOS = (Kind.PIXELS, Kind.LOCAL, Kind.PLACE, Kind.MATCHER)
_object, _sound, _weak = QueriedScene.map_object, QueriedScene.map_sound, QueriedScene.weak_sound
_area, _true_object, _true_sound = QueriedScene.map_area, QueriedScene.true_object, QueriedScene.true_sound

_AREA_ROWS = (
    ("object only", (_object,), _PIXELS, "baseline"),
    ("+ area by the object encoder", (_object, QueriedScene.area_as_object), _PIXELS, "variant"),
    ("+ whole views in each voxel", (_object, QueriedScene.pixel_views), _VIEWS, "variant"),
    ("+ ConceptFusion: regions and views in each voxel", (_object, QueriedScene.region_views), _VIEWS, "variant"),
    ("+ sparse view map by the paper's rules", (_object, QueriedScene.paper_area), _VIEWS, "variant"),
    ("+ sparse view map (ours)", (_object, _area), _VIEWS, OURS),
    ("+ true region map", (_object, QueriedScene.true_area), _PIXELS, "variant"),
    ("true objects + sparse view map", (_true_object, _area), (Kind.VIEWS,), "variant"),
    (CEILING, (_true_object, QueriedScene.true_area), (), "ceiling"),
)
# The primary part stands first: here the sound.
_SOUND_ROWS = (
    ("sound only, weaker encoder", (_weak,), (), "baseline"),
    ("sound only", (_sound,), (Kind.SOUNDS,), "baseline"),
    ("object + sound, weaker encoder", (_weak, _object), _PIXELS, "variant"),
    ("object + sound (ours)", (_sound, _object), _SOUNDS, OURS),
    ("object + true sound", (_true_sound, _object), _PIXELS, "variant"),
    ("true objects + sound", (_sound, _true_object), (Kind.SOUNDS,), "variant"),
    (CEILING, (_true_sound, _true_object), (), "ceiling"),
)
_PHOTO_ROWS = (
    ("object only", (_object,), _PIXELS, "baseline"),
    ("image only", (QueriedScene.map_photo,), _PHOTOS[1:], "baseline"),
    ("object + most alike keyframe, not located", (_object, QueriedScene.alike_keyframe), _PHOTOS, "variant"),
    ("object + image (ours)", (_object, QueriedScene.map_photo), _PHOTOS, OURS),
    ("object + true camera", (_object, QueriedScene.true_camera), _PIXELS, "variant"),
    ("true objects + image", (_true_object, QueriedScene.map_photo), _PHOTOS[1:], "variant"),
    (CEILING, (_true_object, QueriedScene.true_camera), (), "ceiling"),
)
_NEAR_SOUND_ROWS = (
    ("object only", (_object,), _PIXELS, "baseline"),
    ("sound only, weaker encoder", (_weak,), (), "baseline"),
    ("sound only", (_sound,), (Kind.SOUNDS,), "baseline"),
    ("object + sound, weaker encoder", (_object, _weak), _PIXELS, "variant"),
    ("object + sound (ours)", (_object, _sound), _SOUNDS, OURS),
    ("object + true sound", (_object, _true_sound), _PIXELS, "variant"),
    ("true objects + sound", (_true_object, _sound), (Kind.SOUNDS,), "variant"),
    (CEILING, (_true_object, _true_sound), (), "ceiling"),
)
_ROWS = {
    TaskKind.AREA: _AREA_ROWS,
    TaskKind.SOUND: _SOUND_ROWS,
    TaskKind.PHOTO: _PHOTO_ROWS,
    TaskKind.NEAR_SOUND: _NEAR_SOUND_ROWS,
}
CONFIGURATIONS: tuple[Configuration, ...] = tuple(
    Configuration(kind, name, sources, needs, role)
    for kind, rows in _ROWS.items()
    for name, sources, needs, role in rows
)


def configurations(kind: TaskKind) -> tuple[Configuration, ...]:
    """Return the rows of a table, in their order."""
    return tuple(one for one in CONFIGURATIONS if one.kind is kind)
