"""Light in a scene, computed once: lamps with shadows, and what comes back from walls, windows and screens.

Large flat surfaces carry patches of texels on a lattice of the world; small and round ones carry light at their
corners. Every sample is lit on both sides, since triangles are seen from both. What is solid is a grid of small
cells; rays walk through it. Light that has bounced is gathered at probes on a coarse grid, and a sample takes it
from the probes that it sees, darkened where corners are narrow.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Float32, Int, Int32, UInt8

from avlmaps_sim import lighting_kernels
from avlmaps_sim.mesh import Mesh
from avlmaps_sim.scene import Light, Scene

_MOST_CELLS = 12_000_000  # solid cells
_CELL_M = 0.05
_TEXEL_M = 0.12  # step of the lattice of texels
_PATCH_M = 0.25  # triangles longer than this carry texels if they are flat
_LONG_M = 1.2  # triangles longer than this do so in any case
_PROBE_M = 0.45
_SEND_CELLS = 5  # solid cells along a side of a coarse cell, in which sent light is summed
_ROOM = 12  # cells to the nearest solid one are counted up to here
_ONE_LAMP_M = 0.7  # lamps that are nearer to each other shine as one
_BOUNCE = 1.7  # light that has bounced more than once, as a factor of that which has once
_NEARBY_M = 0.3  # crevices take their light from as far away
_CREVICE = 0.4  # the share of it that they take
_GLOW = 2.5  # linear radiance of a surface of emission 1
_SKY = (1.15, 1.25, 1.4)  # linear, what shines in where there is no wall
_DEFAULT_LAMP_M = 3.0  # distance between lamps put by default
_STRUCTURE = frozenset({"wall", "floor", "ceiling", "column", "stairs", "railing"})


@dataclass(frozen=True, slots=True, eq=False)
class LightMap:
    """Light on every surface of a scene, in the order of its triangles."""

    # (t, 3) samples at the corners; or -1 in the first column, and in the second the patch.
    sample: Int32[np.ndarray, "t 3"]
    turned: Bool[np.ndarray, " t"]  # (t,) True where side 0 of its samples is the triangle's back
    first: Int[np.ndarray, " g"]  # (g,) first sample of each patch
    axes: Int[np.ndarray, "g 2"]  # (g, 2) axes of the world along which the patch's rows and columns run
    low: Int[np.ndarray, "g 2"]  # (g, 2) lattice numbers of the first sample
    columns: Int[np.ndarray, " g"]  # (g,) samples in a row of the patch
    light: Float32[np.ndarray, "s 2 3"]  # (s, 2, 3) linear RGB falling on both sides; 1 shows a white surface as white
    step_m: float = _TEXEL_M  # step of the lattice


@dataclass(frozen=True, slots=True, eq=False)
class _Samples:
    place: Float[np.ndarray, "s 3"]
    normal: Float[np.ndarray, "s 3"]
    triangle: Int[np.ndarray, " s"]
    area_m2: Float[np.ndarray, " s"]
    needed: Bool[np.ndarray, " s"]


def default_lights(scene: Scene) -> tuple[Light, ...]:
    """Return lamps for a scene that has none: one under the ceiling of each area, or a grid of them over its box."""
    lights = []
    for area in scene.areas:
        x, y = area.polygon.mean(axis=0)
        power = float(np.clip(np.prod(np.ptp(area.polygon, axis=0)) / 14.0, 0.5, 2.0))
        lights.append(Light((float(x), float(y), area.ceiling_m - 0.25), (power, 0.95 * power, 0.88 * power)))
    if lights or not len(scene.mesh.vertex):
        return tuple(lights)
    low, high = scene.mesh.low.astype(float), scene.mesh.high.astype(float)
    rows, columns = (max(1, round(float(extent) / _DEFAULT_LAMP_M)) for extent in (high - low)[:2])
    z = float(min(high[2] - 0.3, low[2] + 2.3)) if high[2] - low[2] > 1.5 else float(high[2] + 1.0)
    for i in range(rows):
        for j in range(columns):
            x, y = low[:2] + (high - low)[:2] * (np.array([i, j]) + 0.5) / np.array([rows, columns])
            lights.append(Light((float(x), float(y), z), (0.9, 0.87, 0.82)))
    return tuple(lights)


@dataclass(frozen=True, slots=True, eq=False)
class _Solid:
    """Cells that no light passes: by cell, how many cells away the nearest of them is, 0 in it."""

    empty: UInt8[np.ndarray, "x y z"]
    low: Float[np.ndarray, "3"]
    cell_m: float


def _solid(scene: Scene, lights: tuple[Light, ...]) -> _Solid:
    mesh = scene.mesh
    clear = np.array([m.opacity < 0.6 for m in mesh.materials], bool)
    place = np.array([lamp.position for lamp in lights]).reshape(-1, 3)
    holds_lamp = np.zeros(len(scene.objects), bool)
    for index, thing in enumerate(scene.objects):
        if thing.category not in _STRUCTURE:
            low, high = np.array(thing.low) - 0.05, np.array(thing.high) + 0.05
            holds_lamp[index] = ((low <= place) & (place <= high)).all(axis=1).any()
    kept = ~clear[mesh.material] & ~holds_lamp[scene.instance]
    low, high = mesh.low.astype(float) - 0.3, mesh.high.astype(float) + 0.3
    cell_m = max(_CELL_M, float((np.prod(high - low) / _MOST_CELLS) ** (1 / 3)))
    cells = np.zeros(np.ceil((high - low) / cell_m).astype(int), np.uint8)
    lighting_kernels.mark_solid(mesh.corners()[kept], low, cell_m, cells)
    _close(cells, scene, float(low[2]), cell_m)
    return _Solid(_room(cells), low, cell_m)


def _close(cells: UInt8[np.ndarray, "x y z"], scene: Scene, low_m: float, cell_m: float) -> None:
    known = {thing.category for thing in scene.objects}
    if scene.areas and "floor" in known:
        cells[:, :, : max(0, int((min(area.floor_m for area in scene.areas) - low_m) / cell_m))] = 1
    if scene.areas and "ceiling" in known:
        cells[:, :, int((max(area.ceiling_m for area in scene.areas) - low_m) / cell_m) + 1 :] = 1


def _room(solid: UInt8[np.ndarray, "x y z"]) -> UInt8[np.ndarray, "x y z"]:
    """Return for each cell how many cells away, along any axis, the nearest solid one is, up to a limit."""
    room = np.where(solid, 0, _ROOM).astype(np.uint8)
    lighting_kernels.spread_along_columns(room)
    for axis in (1, 0):
        before = np.moveaxis(room.copy(), axis, 0)
        after = np.moveaxis(room, axis, 0)
        for k in range(1, _ROOM):
            np.minimum(after[k:], np.maximum(before[:-k], k), out=after[k:])
            np.minimum(after[:-k], np.maximum(before[k:], k), out=after[:-k])
    return room


def _merged(lights: tuple[Light, ...]) -> tuple[Light, ...]:
    place = np.array([lamp.position for lamp in lights]).reshape(-1, 3)
    power = np.array([lamp.colour for lamp in lights]).reshape(-1, 3)
    left = np.ones(len(lights), bool)
    merged = []
    while left.any():
        one = left & (np.linalg.norm(place - place[left.argmax()], axis=1) < _ONE_LAMP_M)
        left &= ~one
        weight = power[one].sum(axis=1) + 1e-9
        x, y, z = (weight @ place[one] / weight.sum()).tolist()
        red, green, blue = power[one].sum(axis=0).tolist()
        merged.append(Light((x, y, z), (red, green, blue)))
    return tuple(merged)


def _smooth_corners(mesh: Mesh) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    incident = np.argsort(mesh.triangle.reshape(-1), kind="stable").astype(np.int64)
    first = np.concatenate([[0], np.cumsum(np.bincount(mesh.triangle.reshape(-1), minlength=len(mesh.vertex)))])
    smooth = np.zeros((len(mesh.triangle), 3, 3), np.float32)
    lighting_kernels.corner_normals(mesh.triangle, mesh.normals(), mesh.areas_m2(), first, incident, smooth)
    return smooth, first, incident


def _corner_samples(mesh: Mesh, chosen: Bool[np.ndarray, " t"], smooth: np.ndarray, first: np.ndarray,
                    incident: np.ndarray) -> tuple[_Samples, Int32[np.ndarray, "t 3"]]:  # fmt: skip
    sample = np.full((len(mesh.triangle), 3), -1, np.int32)
    stands = np.zeros(3 * len(mesh.triangle), np.int64)
    count = lighting_kernels.share_corners(mesh.triangle, smooth, first, incident, chosen, sample, stands)
    t, k = stands[:count] // 3, stands[:count] % 3
    corners = mesh.corners().astype(np.float64)
    inward = corners[t].mean(axis=1) - corners[t, k]
    length = np.linalg.norm(inward, axis=1, keepdims=True)
    place = corners[t, k] + inward * np.minimum(0.3, 0.03 / np.maximum(length, 1e-9))
    area = np.bincount(sample[chosen].reshape(-1), np.repeat(mesh.areas_m2()[chosen] / 3, 3), count)
    return _Samples(place, smooth[t, k].astype(np.float64), t, area, np.ones(count, bool)), sample


@dataclass(frozen=True, slots=True, eq=False)
class _Patches:
    group: Int[np.ndarray, " n"]
    turned: Bool[np.ndarray, " n"]
    axes: Int[np.ndarray, "g 2"]
    low: Int[np.ndarray, "g 2"]
    rows: Int[np.ndarray, " g"]
    columns: Int[np.ndarray, " g"]
    first: Int[np.ndarray, " g"]


def _patches(mesh: Mesh, chosen: Int[np.ndarray, " n"], instance: Int[np.ndarray, " n"]) -> _Patches:
    normal = mesh.normals()[chosen].astype(np.float64)
    axis = np.abs(normal).argmax(axis=1)
    turned = np.take_along_axis(normal, axis[:, None], 1)[:, 0] < 0
    normal = np.where(turned[:, None], -normal, normal)
    corners = mesh.corners()[chosen].astype(np.float64)
    offset = np.round(np.einsum("ni,ni->n", normal, corners.mean(axis=1)) / 0.004)
    key = np.column_stack([instance, axis, np.round(normal * 100), offset]).astype(np.int64)
    _, group = np.unique(key, axis=0, return_inverse=True)
    group = group.reshape(-1)
    axes_of = np.array([[1, 2], [0, 2], [0, 1]])[axis]
    flat = np.take_along_axis(corners, axes_of[:, None, :].repeat(3, 1), 2)
    low = np.floor(flat.min(axis=1) / _TEXEL_M).astype(np.int64)
    high = np.floor(flat.max(axis=1) / _TEXEL_M).astype(np.int64) + 1
    count = int(group.max(initial=-1)) + 1
    least = np.full((count, 2), np.iinfo(np.int64).max)
    most = np.full((count, 2), np.iinfo(np.int64).min)
    np.minimum.at(least, group, low)
    np.maximum.at(most, group, high)
    axes = np.zeros((count, 2), np.int64)
    axes[group] = axes_of
    rows, columns = (most - least + 1).T if count else (np.zeros(0, np.int64),) * 2
    first = np.concatenate([[0], np.cumsum(rows * columns)])[:count]
    return _Patches(group, turned, axes, least, np.ascontiguousarray(rows), np.ascontiguousarray(columns), first)


def _texel_samples(mesh: Mesh, chosen: Int[np.ndarray, " n"], patches: _Patches) -> _Samples:
    """Return a sample for each texel, on the nearest triangle of its patch."""
    total = int((patches.rows * patches.columns).sum())
    corners = mesh.corners()[chosen].astype(np.float64)
    axes = patches.axes[patches.group]
    flat = np.take_along_axis(corners, axes[:, None, :].repeat(3, 1), 2)
    place, distance = np.zeros((total, 2)), np.full(total, 1e9)
    owner = np.zeros(total, np.int64)
    lighting_kernels.place_texels(flat, patches.group, patches.first, patches.low, patches.columns, _TEXEL_M,
                                  2 * _TEXEL_M, place, distance, owner)  # fmt: skip
    normal = mesh.normals()[chosen].astype(np.float64)
    normal = np.where(patches.turned[:, None], -normal, normal)[owner]
    across = 3 - axes[owner].sum(axis=1)
    world = np.zeros((total, 3))
    np.put_along_axis(world, axes[owner], place, 1)
    # the third coordinate follows from the plane
    n_across = np.take_along_axis(normal, across[:, None], 1)[:, 0]
    rest = np.einsum("si,si->s", normal, corners[owner, 0] - world)
    np.put_along_axis(world, across[:, None], (rest / np.where(n_across == 0, 1, n_across))[:, None], 1)
    area = np.full(total, _TEXEL_M**2)
    return _Samples(world, normal, chosen[owner], area, distance < 1e9)


def _joined(a: _Samples, b: _Samples) -> _Samples:
    return _Samples(*(np.concatenate([getattr(a, name), getattr(b, name)]) for name in _Samples.__slots__))


def _directions(count: int, half: bool = False) -> Float[np.ndarray, "r 3"]:
    k = np.arange(count) + 0.5
    turn = np.pi * (1 + 5**0.5) * k
    z = np.sqrt(1 - k / count) if half else 1 - 2 * k / count
    r = np.sqrt(1 - z * z)
    return np.column_stack([r * np.cos(turn), r * np.sin(turn), z])


def _lit(samples: _Samples, lights: tuple[Light, ...], solid: _Solid, albedo: np.ndarray, glow: np.ndarray
         ) -> tuple[Float32[np.ndarray, "s 2 3"], Bool[np.ndarray, "s 2"]]:  # fmt: skip
    n = len(samples.place)
    light, start, free = np.zeros((n, 2, 3), np.float32), np.zeros((n, 2, 3), np.float32), np.zeros((n, 2), bool)
    lamp = np.array([lamp.position for lamp in lights]).reshape(-1, 3)
    power = np.array([lamp.colour for lamp in lights]).reshape(-1, 3)
    space = (solid.empty, solid.low, solid.cell_m)
    lighting_kernels.direct(samples.place, samples.normal, lamp, power, *space, light, start, free)
    coarse = np.array(solid.empty.shape) // _SEND_CELLS + 1
    sent = np.zeros((*coarse, 6, 4), np.float32)
    lighting_kernels.splat(samples.place, samples.normal, albedo, glow, samples.area_m2, light, free, solid.low,
                           solid.cell_m * _SEND_CELLS, sent)  # fmt: skip
    extent = np.array(solid.empty.shape) * solid.cell_m
    count = np.ceil(extent / _PROBE_M).astype(np.int64)
    index = np.stack(np.meshgrid(*(np.arange(c) for c in count), indexing="ij"), axis=-1).reshape(-1, 3)
    cube, seen = np.zeros((len(index), 6, 3), np.float32), np.zeros(len(index), bool)
    lighting_kernels.gather(solid.low + (index + 0.5) * _PROBE_M, _directions(96), *space, sent, float(_SEND_CELLS),
                            np.array(_SKY), cube, seen)  # fmt: skip
    probes = (cube, seen, count, _PROBE_M)
    lighting_kernels.ambient(samples.normal, _directions(8, half=True), solid.empty, solid.cell_m, probes, _BOUNCE,
                             light, start, free)  # fmt: skip
    return light, free


def _around(
    place: Float[np.ndarray, "s 3"], light: Float32[np.ndarray, "s 2 3"], free: Bool[np.ndarray, "s 2"]
) -> Float32[np.ndarray, "s 3"]:
    low = place.min(axis=0)
    cell = np.floor((place - low) / _NEARBY_M).astype(np.int64)
    count = cell.max(axis=0) + 1
    key = (cell[:, 0] * count[1] + cell[:, 1]) * count[2] + cell[:, 2]
    number = np.bincount(key, free.sum(axis=1), int(np.prod(count)))
    total = np.where(free[..., None], light, 0).sum(axis=1)
    mean = [np.bincount(key, total[:, c], len(number)) / np.maximum(number, 1) for c in range(3)]
    return (_CREVICE * np.stack(mean, axis=1)[key]).astype(np.float32)


def light_map(scene: Scene, albedo: Float[np.ndarray, "m 3"]) -> LightMap:
    """Work out the light in a scene. ``albedo`` is the mean linear colour of each material."""
    mesh = scene.mesh
    lights = _merged(scene.lights or default_lights(scene))
    smooth, first, incident = _smooth_corners(mesh)
    corners = mesh.corners()
    longest = (corners.max(axis=1) - corners.min(axis=1)).max(axis=1)
    flat = (np.einsum("tkc,tc->tk", smooth, mesh.normals()) > 0.998).all(axis=1)
    on_patch = (longest > _PATCH_M) & (flat | (longest > _LONG_M))
    at_corner, sample = _corner_samples(mesh, ~on_patch, smooth, first, incident)
    chosen = np.flatnonzero(on_patch)
    patches = _patches(mesh, chosen, scene.instance[chosen])
    samples = _joined(at_corner, _texel_samples(mesh, chosen, patches))
    material = mesh.material[samples.triangle]
    glow = _GLOW * np.array([m.emission for m in mesh.materials], np.float64)
    light = np.zeros((len(samples.place), 2, 3), np.float32)
    free = np.zeros((len(samples.place), 2), bool)
    needed = samples.needed
    wanted = _Samples(*(getattr(samples, name)[needed] for name in _Samples.__slots__))
    light[needed], free[needed] = _lit(wanted, lights, _solid(scene, scene.lights or lights), albedo[material[needed]],
                                       glow[material[needed]])  # fmt: skip
    begin = len(at_corner.place)
    filled = np.where(free[..., None], light, _around(samples.place, light, free)[:, None])
    lighting_kernels.fill_texels(begin + patches.first, patches.rows, patches.columns, light, free, filled)
    turned = np.zeros(len(mesh.triangle), bool)
    turned[chosen], sample[chosen, 1] = patches.turned, patches.group
    return LightMap(sample, turned, begin + patches.first, patches.axes, patches.low, patches.columns, filled)
