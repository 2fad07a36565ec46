"""A scene: triangles, and what a person would say is there (objects, rooms, lights). World frame, z up, metres.

Homes make scenes by rule, files hold them; the renderer, the walk and the sounds take either.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float, Float32, Int, Int32

from avlmaps_sim.mesh import Mesh, Triple, joined

NOTHING = -1  # the instance of a pixel that shows no triangle


@dataclass(frozen=True, slots=True)
class SceneObject:
    """One thing with a name: furniture, a picture, a wall."""

    category: str  # what it is (``chair``)
    low: Triple  # lowest corner of the box round it, world axes
    high: Triple  # highest corner
    heading_rad: float = 0.0  # where its front looks, counter-clockwise from +x
    family: str = ""  # which recipe it was made by, ``""`` where it was read from a file
    name: str = ""  # what the file calls it, or category and number
    area: int = -1  # index of the area that it stands in, −1 for none

    @property
    def centre(self) -> Triple:
        """Middle of its box."""
        x, y, z = ((a + b) / 2 for a, b in zip(self.low, self.high, strict=True))
        return (x, y, z)

    @property
    def size(self) -> Triple:
        """Extent of its box along x, y and z."""
        x, y, z = (b - a for a, b in zip(self.low, self.high, strict=True))
        return (x, y, z)


@dataclass(frozen=True, slots=True)
class Area:
    """One room, or part of an open plan."""

    kind: str  # ``kitchen``, ``bedroom``
    polygon: Float[np.ndarray, "k 2"]  # (k, 2) top-down corners, counter-clockwise
    floor_m: float = 0.0  # height of its floor
    ceiling_m: float = 2.6  # height of its ceiling
    name: str = ""  # kind and number

    def contains(self, xy: Float[np.ndarray, "*n 2"]) -> np.ndarray:
        """Return which points lie inside it, top-down."""
        x, y = np.asarray(xy)[..., 0], np.asarray(xy)[..., 1]
        a, b = self.polygon, np.roll(self.polygon, -1, axis=0)
        inside = np.zeros(x.shape, bool)
        for (ax, ay), (bx, by) in zip(a, b, strict=True):
            crosses = (ay > y) != (by > y)
            with np.errstate(divide="ignore", invalid="ignore"):
                inside ^= crosses & (x < (bx - ax) * (y - ay) / (by - ay) + ax)
        return inside


@dataclass(frozen=True, slots=True)
class Light:
    """A small lamp."""

    position: Triple  # world, metres
    # Linear RGB of its power; (1, 1, 1) lights a white wall at 2 m to about half of full white.
    colour: Triple = (1.0, 1.0, 1.0)


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """A building to look at."""

    name: str  # ``house:12`` or the file's name
    mesh: Mesh  # every triangle
    instance: Int32[np.ndarray, " t"]  # (t,) which object each triangle belongs to, an index into ``objects``
    objects: tuple[SceneObject, ...]  # what is there; walls, floors and ceilings are among them
    areas: tuple[Area, ...] = ()  # its rooms
    lights: tuple[Light, ...] = ()  # its lamps
    mirrors: bool = False  # whether its mirrors reflect; otherwise they show the colour of their glass

    def __post_init__(self) -> None:
        if self.instance.shape != (len(self.mesh.triangle),):
            raise ValueError(f"{len(self.mesh.triangle)} triangles, {self.instance.shape} instances")
        if len(self.instance) and not (self.instance.min() >= 0 and self.instance.max() < len(self.objects)):
            raise ValueError(f"a triangle belongs to none of the {len(self.objects)} objects")

    @property
    def categories(self) -> tuple[str, ...]:
        """The names of the categories in it, sorted; category images hold indices into this."""
        return tuple(sorted({thing.category for thing in self.objects}))

    @property
    def category_of_instance(self) -> Int[np.ndarray, " i"]:
        """For each object the index of its category in ``categories``."""
        number = {name: index for index, name in enumerate(self.categories)}
        return np.array([number[thing.category] for thing in self.objects], np.int32)

    def area_at(self, position: Sequence[float]) -> int:
        """Return the index of the area that holds a place, −1 for none."""
        x, y, z = position
        for index, area in enumerate(self.areas):
            if area.floor_m - 0.3 <= z <= area.ceiling_m + 0.3 and bool(area.contains(np.array([x, y]))):
                return index
        return -1


@dataclass
class SceneBuilder:
    """Collects objects and makes them one scene."""

    name: str
    areas: list[Area] = field(default_factory=list)
    lights: list[Light] = field(default_factory=list)
    objects: list[SceneObject] = field(default_factory=list)
    mirrors: bool = False
    _meshes: list[Mesh] = field(default_factory=list)
    _instances: list[np.ndarray] = field(default_factory=list)

    @classmethod
    def of(cls, scene: Scene) -> "SceneBuilder":
        """Return a builder that holds all of a finished scene, to add more."""
        return cls(
            scene.name, list(scene.areas), list(scene.lights), list(scene.objects), scene.mirrors, [scene.mesh],
            [scene.instance],
        )  # fmt: skip

    def add(
        self, category: str, mesh: Mesh, heading_rad: float = 0.0, family: str = "", name: str = "", area: int = -1
    ) -> int:
        """Add an object whose mesh already lies in the world; return its instance."""
        instance = len(self.objects)
        low, high = (tuple(float(v) for v in corner) for corner in (mesh.low, mesh.high))
        title = name or f"{category}#{1 + sum(o.category == category for o in self.objects)}"
        self.objects.append(SceneObject(category, low, high, heading_rad, family, title, area))  # pyright: ignore[reportArgumentType]
        self._meshes.append(mesh)
        self._instances.append(np.full(len(mesh.triangle), instance, np.int32))
        return instance

    def build(self) -> Scene:
        """Return the scene."""
        none: Float32[np.ndarray, " 0"] = np.zeros(0, np.float32)
        instance = np.concatenate(self._instances) if self._instances else none.astype(np.int32)
        mesh = joined(self._meshes)
        return Scene(
            self.name, mesh, instance, tuple(self.objects), tuple(self.areas), tuple(self.lights), self.mirrors
        )
