"""Rendering the worlds that the network learns from: ``python -m training.pixels.worlds --out build/pixels/training``.

Each shard holds the frames of some homes as plain arrays, so that training maps them into memory. It may run on
while training does: a shard counts from the moment that its folder has its final name, and beyond ``--shards`` the
oldest is replaced.
"""

import json
import os
import shutil
import sys
from contextlib import nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter, time

import numpy as np
import tyro
from training.pixels.borrowed import borrowed_furniture
from training.pixels.labels import CATEGORIES, ROOMS, UNLABELLED, room_of
from training.pixels.things import views_of_things, with_things

from avlmaps.core.camera import Pinhole
from avlmaps_sim.furniture.catalogue import Families
from avlmaps_sim.mesh import Mesh, joined
from avlmaps_sim.scene import Scene, SceneBuilder

WIDTH, HEIGHT = 320, 240
# Seeds of homes: those of the benchmarks begin at a million, those of calibration here, those of training at 0.
FIRST_CALIBRATION_SEED = 1_100_000
_NAME = {name: number for number, name in enumerate(CATEGORIES)}
_ROOM = {name: number for number, name in enumerate(ROOMS)}


@dataclass(frozen=True)
class Options:
    """Options of the rendering."""

    out: Path = Path("build/pixels/training")
    """Folder of the shards."""
    shards: int = 60
    """How many shards stay; then the oldest is replaced."""
    homes_per_shard: int = 8
    """Homes in a shard."""
    frames_per_home: int = 64
    """Views of each home."""
    first_seed: int = 0
    """Seed of the first home."""
    step: int = 1
    """Distance of the seeds, for several processes side by side."""
    which: Families = "training"
    """Families of shapes."""
    furniture: Path | None = None
    """Folder of artists' models (``borrowed.py``), which furnish half of the homes; those of ``which`` alone."""
    things: Path | None = None
    """Folder of models of small things (``things.py``), which then lie about; those of ``which`` alone."""
    at_things: float = 0.35
    """Share of views that look at one of these from near."""
    lived_in: float = 0.8
    """Share of homes with people, clothes, papers and shower curtains in them (``avlmaps_sim.homes.lived_in``)."""
    mirrors: float = 0.6
    """Share of homes whose mirrors reflect, in colour and in depth."""
    in_hands: float = 0.5
    """Share of views from cameras as people hold them, instead of robots'."""
    lit: float = 0.7
    """Share of homes rendered in colour; of the others only shape is learnt."""
    once: bool = False
    """Stop when there are enough shards instead of replacing old ones."""


def scene_of(seed: int, options: Options, rng: np.random.Generator) -> Scene:
    """Return the home or office of a seed, with things that are nothing in particular and the traces of people."""
    from avlmaps_sim.homes import lived_in, make_home, make_office

    borrows = options.furniture is not None and seed // options.step % 2 == 0
    with borrowed_furniture(options.furniture, options.which) if borrows and options.furniture else nullcontext():
        scene = make_office(seed, options.which) if seed % 6 == 5 else make_home(seed, options.which)
    scene = with_oddities(scene, rng)
    if rng.random() < options.lived_in:
        scene = lived_in(scene, rng, options.which)
    if options.things is not None:
        scene = with_things(scene, options.things, rng, options.which)
    return replace(scene, mirrors=bool(rng.random() < options.mirrors))


def with_oddities(scene: Scene, rng: np.random.Generator) -> Scene:
    """Return the scene with some meaningless assemblies of simple solids on its floors: the category ``other``."""
    builder = SceneBuilder.of(scene)
    for area in scene.areas:
        for _ in range(rng.poisson(0.5)):
            low, high = area.polygon.min(axis=0), area.polygon.max(axis=0)
            x, y = rng.uniform(low, high)
            if not area.contains(np.array([x, y])):
                continue
            mesh = _oddity(rng).moved(float(x), float(y), area.floor_m + max(0.0, rng.uniform(-1.5, 1.5)))
            builder.add("other", mesh)
    return builder.build()


def _oddity(rng: np.random.Generator) -> Mesh:
    from avlmaps_sim.materials import material
    from avlmaps_sim.shapes import box, cylinder, ellipsoid, lathe

    size, parts = rng.uniform(0.1, 0.9), []
    for _ in range(rng.integers(1, 6)):
        look = material(str(rng.choice(["wood", "plastic", "fabric", "metal", "painted"])), rng)
        x, y, z = rng.uniform(-size / 2, size / 2, 3) + np.array([0, 0, size / 2])
        a, b, c = rng.uniform(0.03, 0.6, 3) * size
        kind = rng.integers(4)
        if kind == 0:
            part = box((x - a, y - b, z - c), (x + a, y + b, z + c), look)
        elif kind == 1:
            part = cylinder(x, y, z, a, b + c, look)
        elif kind == 2:
            part = ellipsoid((x, y, z), (a, b, c), look)
        else:
            part = lathe([(r, z + i * c / 4) for i, r in enumerate(rng.uniform(0.1, 1.0, 5) * a)], look, x, y)
        parts.append(part.tilted("x", rng.normal(0, 0.3)))
    return joined(parts).standing()


def camera_of(rng: np.random.Generator) -> Pinhole:
    """Return a camera with a horizontal view of 54 to 98 degrees, its middle not quite the picture's."""
    focal = WIDTH / 2 / np.tan(np.deg2rad(rng.uniform(54.0, 98.0)) / 2)
    cx, cy = WIDTH / 2 + rng.normal(0, 3), HEIGHT / 2 + rng.normal(0, 3)
    return Pinhole(focal, focal * rng.uniform(0.98, 1.02), cx, cy, WIDTH, HEIGHT)


@dataclass
class Shard:
    """Frames collected already."""

    depth: list[np.ndarray]
    label: list[np.ndarray]
    rgb: list[np.ndarray]
    rgb_row: list[int]
    room: list[np.ndarray]
    camera: list[np.ndarray]


def add_home(shard: Shard, seed: int, options: Options) -> None:
    """Render the views of one home into the shard."""
    from avlmaps_sim.render import Renderer
    from avlmaps_sim.views import IN_HANDS, ON_A_ROBOT, random_views

    rng = np.random.default_rng([seed, 7])
    scene = scene_of(seed, options, rng)
    lit = rng.random() < options.lit
    renderer = Renderer(scene, lit=lit)
    names = scene.categories
    number = np.array([_NAME.get(name, UNLABELLED) for name in names] + [UNLABELLED], np.uint8)
    dull = np.isin((*names, ""), ("wall", "floor", "ceiling", ""))
    near = round(options.at_things * options.frames_per_home) if options.things is not None else 0
    heights = [(IN_HANDS if rng.random() < options.in_hands else ON_A_ROBOT).height_m for _ in range(near)]
    views = [views_of_things(scene, rng, camera_of(rng), heights)] if near else []
    left = options.frames_per_home - sum(map(len, views))
    held = round(options.in_hands * left)
    numbers = ((ON_A_ROBOT, left - held), (IN_HANDS, held))
    views += [random_views(scene, rng, count, camera_of(rng), stance) for stance, count in numbers if count]
    aimed = len(views[0]) if near else 0
    for number_of_view, pose in enumerate(np.concatenate(views)):
        # Of what is small narrow views show more.
        camera = max((camera_of(rng) for _ in range(3 if number_of_view < aimed else 1)), key=lambda one: one.fx)
        view = renderer.render(camera, pose)
        if dull[view.category].mean() > 0.97 and rng.random() < 0.9:  # a bare wall teaches little
            continue
        rgb, depth_m = _sensor(rng).spoil(view, camera, rng)
        row = -1
        if lit:
            row = len(shard.rgb)
            shard.rgb.append(rgb)
        shard.rgb_row.append(row)
        shard.depth.append(np.rint(np.clip(depth_m, 0, 65) * 1000).astype(np.uint16))
        shard.label.append(number[view.category])
        shard.room.append(_rooms_seen(scene, view.depth_m, camera, pose))
        up = pose[:3, :3].T @ np.array([0.0, 0.0, 1.0])
        shard.camera.append(
            np.array([camera.fx, camera.fy, camera.cx, camera.cy, *up, pose[2, 3] - _floor_under(scene, pose)])
        )


def _sensor(rng: np.random.Generator):
    from avlmaps_sim import sensor

    return sensor.Sensor((sensor.CLEAN, sensor.KINECT, sensor.KINECT, sensor.REALSENSE)[int(rng.integers(4))])


def _floor_under(scene: Scene, pose: np.ndarray) -> float:
    area = scene.area_at(pose[:3, 3].tolist())
    return scene.areas[area].floor_m if area >= 0 else 0.0


def _rooms_seen(scene: Scene, depth_m: np.ndarray, camera: Pinhole, pose: np.ndarray) -> np.ndarray:
    """Return the share of the view (within 6 m) that lies in each kind of room; the rest of it in none."""
    small = camera.resized(WIDTH // 8, HEIGHT // 8)
    z = depth_m[4::8, 4::8].astype(np.float64)
    v, u = np.nonzero((z > 0) & (z < 6.0))
    z = z[v, u]
    points = np.stack([(u + 0.5 - small.cx) / small.fx * z, (v + 0.5 - small.cy) / small.fy * z, z], axis=1)
    world = points @ pose[:3, :3].T + pose[:3, 3]
    share = np.zeros(len(ROOMS), np.float32)
    for area in scene.areas:
        kind = _ROOM.get(room_of(area.kind))
        if kind is not None:
            inside = area.contains(world[:, :2]) & (np.abs(world[:, 2] - area.floor_m - 1.3) < 1.8)
            share[kind] += inside.mean() if len(inside) else 0.0
    return share


def write_shard(shard: Shard, folder: Path) -> None:
    """Write the shard so that its final name appears when it is whole."""
    scratch = folder.with_name(f".{folder.name}.{os.getpid()}")
    scratch.mkdir(parents=True)
    empty = np.zeros((0, HEIGHT, WIDTH, 3), np.uint8)
    np.save(scratch / "depth.npy", np.stack(shard.depth))
    np.save(scratch / "label.npy", np.stack(shard.label))
    np.save(scratch / "rgb.npy", np.stack(shard.rgb) if shard.rgb else empty)
    np.save(scratch / "rgb_row.npy", np.array(shard.rgb_row, np.int32))
    np.save(scratch / "room.npy", np.stack(shard.room))
    np.save(scratch / "camera.npy", np.stack(shard.camera))
    (scratch / "about.json").write_text(json.dumps({"categories": CATEGORIES, "rooms": ROOMS, "made": time()}))
    shutil.rmtree(folder, ignore_errors=True)
    scratch.rename(folder)


def run(options: Options) -> None:
    """Render shards until there are enough, or for ever, replacing the oldest."""
    seed, number = options.first_seed, 0
    while not (options.once and number >= options.shards):
        shard, begin = Shard([], [], [], [], [], []), perf_counter()
        for _ in range(options.homes_per_shard):
            try:
                add_home(shard, seed, options)
            except (ValueError, IndexError, RuntimeError, KeyError, ZeroDivisionError) as fault:
                print(f"home {seed} left out: {type(fault).__name__}: {fault}", file=sys.stderr, flush=True)
            seed += options.step
        if not shard.depth:
            continue
        name = f"{options.first_seed:07d}-{number % options.shards:04d}"
        write_shard(shard, options.out / name)
        number += 1
        rate = len(shard.depth) / (perf_counter() - begin)
        print(f"{name}: {len(shard.depth)} frames, {rate:.1f} a second, next seed {seed}", file=sys.stderr, flush=True)


if __name__ == "__main__":
    run(tyro.cli(Options))
