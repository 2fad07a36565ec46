"""The mistakes: what each makes of a right recording, and the words by which its cause is named."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from avlmaps.core import poses
from avlmaps.core.camera import Pinhole, Rig
from avlmaps.recordings.corrections import opencv_from_axes
from avlmaps_sim.bench.recordings.drafts import Draft, Picture

Change = Callable[[Draft, Draft, np.random.Generator], Draft]
Named = tuple[str, Change, str]  # a mistake within its group: name, change and cause


@dataclass(frozen=True, slots=True)
class Situation:
    """One mistake.

    ``change`` makes it of a right recording, another walk and a source of randomness; ``cause`` is a regular expression
    that a sentence matches which names the cause.
    """

    name: str
    group: str
    change: Change
    cause: str


def situations() -> tuple[Situation, ...]:
    """Return all of them."""
    groups = {
        "poses": _of_poses(), "scale": _of_scale(), "depth": _of_depth(), "colour": _of_colour(),
        "pictures": _of_pictures(), "intrinsics": _of_intrinsics(), "clock": _of_clocks(),
    }  # fmt: skip
    first = [Situation(name, group, change, cause) for group, made in groups.items() for name, change, cause in made]
    # What was added later stands at the end, so that the others keep their places.
    return (*first, Situation("all pictures BGR", "colour", _bgr(lambda i, n, g: True), "BGR"), *_of_later())


def _of_later() -> Iterator[Situation]:
    geometry, floors = r"do not agree|jump|exchanged|do not stay level|does not agree", "do not stay level"
    tilted, aside, rolled = (_on_poses(lambda p, axis=axis: p @ _turn(axis, 8.0)) for axis in range(3))
    yield Situation("camera tilted by 8 degrees in its mount", "poses", tilted, f"{floors}|principal point")
    yield Situation("camera rolled by 8 degrees, the other way", "poses", rolled, f"{floors}|turned by")
    yield Situation("camera turned aside by 8 degrees in its mount", "poses", aside, f"{geometry}|principal point")
    yield Situation("poses of another place on the robot, 0.3 m away", "poses", _on_poses(_beside), geometry)
    yield Situation("every second pose is the one before", "poses", _on_poses(_held), f"{geometry}|late")
    yield Situation("a pose is missing in the middle", "poses", _on_poses(_one_less), geometry)
    yield Situation("headings in steps of 15 degrees", "poses", _on_poses(_coarse), geometry)
    yield Situation("frames sorted as text", "poses", _as_text, geometry)
    yield Situation("every other frame of another camera", "poses", _by_turns, geometry)
    yield Situation("depth in cm, of which 8 bits are stored", "depth", _of_8_bits, "begin again at 0")
    yield Situation("depth stretched to 8 bits, frame by frame", "depth", _on_depth(_stretched), "depth|do not agree")
    yield Situation("depth x2 from the middle on", "depth", _twice_from_the_middle, "do not agree|depth")
    yield Situation("colour is a drawing of the depth", "colour", _drawn_depth, "colour")
    yield Situation("cut to 16:9, with the old middle", "intrinsics", _cut_to_wide, f"{floors}|principal point")
    yield Situation("lenses as they are, by a pinhole's numbers", "intrinsics", _of_a_lens, "lens")
    yield Situation("16:9 squeezed into 4:3", "intrinsics", _both(_narrow), "right angles|stay level")
    yield Situation("headings drift by 50 degrees", "poses", _on_poses(_drifting), f"{geometry}|Walls turn")
    yield Situation(
        "clock of the poses 5 % fast", "clock", lambda d, o, g: replace(d, pose_stamps_s=d.pose_stamps_s * 1.05), "late"
    )


def _turn(axis: int, degrees: float) -> np.ndarray:
    half = np.deg2rad(degrees) / 2.0
    return poses.from_quaternion(np.zeros((1, 3)), np.array([[*(np.sin(half) * np.eye(3)[axis]), np.cos(half)]]))[0]


def _beside(written: np.ndarray) -> np.ndarray:
    away = np.eye(4)
    away[:3, 3] = (0.3, 0.0, 0.1)
    return written @ away


def _held(written: np.ndarray) -> np.ndarray:
    return written[np.arange(len(written)) // 2 * 2]


def _one_less(written: np.ndarray) -> np.ndarray:
    rows = np.arange(len(written))
    return written[np.minimum(rows + (rows >= len(rows) // 2), len(rows) - 1)]


def _coarse(written: np.ndarray) -> np.ndarray:
    up = -written[:, :3, 1].mean(axis=0)
    up /= np.linalg.norm(up)
    level = np.cross(np.cross(up, written[:, :3, 2]), up)
    turned = np.arctan2(np.cross(level[0], level) @ up, level @ level[0])
    step = np.deg2rad(15.0)
    off_rad = (np.round(turned / step) * step - turned) / 2.0
    quaternion = np.column_stack([np.sin(off_rad)[:, None] * up, np.cos(off_rad)])
    coarse = written.copy()
    coarse[:, :3, :3] = poses.from_quaternion(np.zeros((len(written), 3)), quaternion)[:, :3, :3] @ written[:, :3, :3]
    return coarse


def _as_text(draft: Draft, other: Draft, rng: np.random.Generator) -> Draft:
    order = np.array(sorted(range(len(draft)), key=lambda number: str(number + 1)))
    return _reordered(draft, order, colour=True, depth=True)


def _by_turns(draft: Draft, other: Draft, rng: np.random.Generator) -> Draft:
    def mixed(own: tuple[Picture, ...], others: tuple[Picture, ...]) -> tuple[Picture, ...]:
        return tuple(pair[i % 2] for i, pair in enumerate(zip(own, _fitted(others, own), strict=True)))

    return replace(draft, rgb=mixed(draft.rgb, other.rgb), depth=mixed(draft.depth, other.depth))


def _of_8_bits(draft: Draft, other: Draft, rng: np.random.Generator) -> Draft:
    cm = draft.units_per_m / 100.0
    return replace(draft, depth=tuple(_as_16_bit(d // cm % 256) for d in draft.depth), units_per_m=100.0)


def _stretched(depth: Picture) -> Picture:
    low, high = float(depth.min()), float(depth.max())
    return _as_16_bit((depth - low) / max(high - low, 1.0) * 255.0 * 16.0)


def _twice_from_the_middle(draft: Draft, other: Draft, rng: np.random.Generator) -> Draft:
    half = len(draft) // 2
    return replace(draft, depth=(*draft.depth[:half], *(_as_16_bit(d * 2.0) for d in draft.depth[half:])))


def _drawn_depth(draft: Draft, other: Draft, rng: np.random.Generator) -> Draft:
    import cv2

    size = (draft.rig.rgb.width, draft.rig.rgb.height)
    shown = [np.clip(d / draft.units_per_m * 51.0, 0, 255).astype(np.uint8) for d in draft.depth]
    fitted = [cv2.resize(one, size, interpolation=cv2.INTER_NEAREST) for one in shown]
    return replace(draft, rgb=tuple(np.repeat(one[..., None], 3, axis=2) for one in fitted))


def _cut_to_wide(draft: Draft, other: Draft, rng: np.random.Generator) -> Draft:
    def cut(picture: Picture) -> Picture:
        height, width = picture.shape[:2]
        rows = width * 9 // 16
        return picture[(height - rows) // 2 :][:rows]

    def camera(old: Pinhole) -> Pinhole:
        return Pinhole(old.fx, old.fy, old.cx, old.cy, old.width, old.width * 9 // 16)

    rig = Rig(camera(draft.rig.rgb), camera(draft.rig.depth), draft.rig.rgb_from_depth)
    return replace(_both(cut)(draft, other, rng), rig=rig)


def _of_a_lens(draft: Draft, other: Draft, rng: np.random.Generator) -> Draft:
    import cv2

    def bent(picture: Picture, camera: Pinhole) -> Picture:
        matrix = np.array([[camera.fx, 0.0, camera.cx - 0.5], [0.0, camera.fy, camera.cy - 0.5], [0.0, 0.0, 1.0]])
        v, u = np.mgrid[: camera.height, : camera.width].astype(np.float32)
        seen = np.stack([u, v], axis=-1).reshape(-1, 1, 2)
        straight = cv2.undistortPoints(seen, matrix, np.array([-0.25, 0.0, 0.0, 0.0]), P=matrix)
        at = straight.reshape(camera.height, camera.width, 2).astype(np.float32)
        return cv2.remap(picture, at[..., 0], at[..., 1], cv2.INTER_NEAREST)

    rgb = tuple(bent(picture, draft.rig.rgb) for picture in draft.rgb)
    return replace(draft, rgb=rgb, depth=tuple(bent(picture, draft.rig.depth) for picture in draft.depth))


def _narrow(picture: Picture) -> Picture:
    height = len(picture)
    return picture[(np.arange(height) * 3 // 4) + height // 8]


def _drifting(written: np.ndarray) -> np.ndarray:
    up = -written[:, :3, 1].mean(axis=0)
    half = np.deg2rad(25.0) * np.linspace(0.0, 1.0, len(written))[:, None]
    turn = np.hstack([np.sin(half) * up / np.linalg.norm(up), np.cos(half)])
    return poses.from_quaternion(np.zeros((len(written), 3)), turn) @ written


def _on_poses(change: Callable[[np.ndarray], np.ndarray]) -> Change:
    return lambda draft, other, rng: replace(draft, poses=change(draft.poses))


def _of_axes(name: str) -> Change:
    turn = np.eye(4)
    turn[:3, :3] = opencv_from_axes(name)
    return _on_poses(lambda written: written @ turn)


_GL = np.diag([1.0, -1.0, -1.0, 1.0])
_Y_UP = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])


def _of_poses() -> Iterator[Named]:
    geometry = r"do not agree|jump|exchanged|m/s|Hardly any|mount"
    yield "camera_from_world", _on_poses(poses.inverse), "camera_from_world|camera-from-world"
    yield "quaternion written w first", lambda d, o, g: replace(d, quaternion_roll=1), "wxyz"
    yield "OpenGL camera", _on_poses(lambda p: p @ _GL), "opengl|RUB"
    yield "OpenGL camera in a y-up world", _on_poses(lambda p: _Y_UP @ p @ _GL), "opengl|RUB"
    yield "poses of a body, x forward", _of_axes("ros"), "ros|FLU"
    yield "inverse poses of an OpenGL camera", _on_poses(lambda p: poses.inverse(p @ _GL)), "camera-from-world"
    yield "rotations transposed", _on_poses(_transposed), geometry
    yield "positions in other axes", _on_poses(lambda p: _placed(p, p[:, [2, 0, 1], 3])), f"other axes|{geometry}"
    yield "poses of another walk", lambda d, o, g: replace(d, poses=o.poses[: len(d)]), geometry
    yield "poses reversed", _on_poses(lambda p: p[::-1].copy()), geometry
    yield "all poses the same", _on_poses(lambda p: np.repeat(p[:1], len(p), axis=0)), geometry
    yield "poses jump by 0.5 m", _on_poses(lambda p: _jump(p, (0.5, 0.0, 0.0))), geometry
    yield "poses jump by 2.5 m", _on_poses(lambda p: _jump(p, (2.5, 0.0, 0.0))), geometry
    yield "poses turn by 20 degrees", _on_poses(lambda p: _jump(p, (0.0, 0.0, 0.0), 20.0)), geometry
    yield "noise of 5 cm and 3 degrees", lambda d, o, g: replace(d, poses=_noisy(d.poses, g)), geometry
    yield "pictures of 10 frames exchanged", _exchanged, geometry
    yield "camera rolled by 8 degrees in its mount", _on_poses(lambda p: p @ _ROLLED), geometry
    yield "two neighbours exchanged", _neighbours(1, 0), "exchanged"
    yield "three neighbours exchanged", _neighbours(1, 2, 0), "exchanged"


_ROLLED = np.eye(4)
_ROLLED[:2, :2] = [[np.cos(0.14), -np.sin(0.14)], [np.sin(0.14), np.cos(0.14)]]


def _transposed(written: np.ndarray) -> np.ndarray:
    turned = written.copy()
    turned[:, :3, :3] = np.swapaxes(written[:, :3, :3], 1, 2)
    return turned


def _placed(written: np.ndarray, positions: np.ndarray) -> np.ndarray:
    placed = written.copy()
    placed[:, :3, 3] = positions
    return placed


def _jump(written: np.ndarray, by_m: tuple[float, float, float], degrees: float = 0.0) -> np.ndarray:
    half = np.deg2rad(degrees) / 2.0
    off = poses.from_quaternion(np.array([by_m]), np.array([[0.0, 0.0, np.sin(half), np.cos(half)]]))[0]
    moved = written.copy()
    moved[len(moved) // 2 :] = off @ moved[len(moved) // 2 :]
    return moved


def _noisy(written: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    turn = rng.normal(0.0, np.deg2rad(3.0) / 2.0, (len(written), 3))
    quaternion = np.column_stack([turn, np.ones(len(written))])
    return written @ poses.from_quaternion(rng.normal(0.0, 0.05, (len(written), 3)), quaternion)


def _exchanged(draft: Draft, other: Draft, rng: np.random.Generator) -> Draft:
    order = np.arange(len(draft))
    chosen = rng.choice(len(draft), min(10, len(draft)), replace=False)
    order[chosen] = np.roll(order[chosen], 1)
    return _reordered(draft, order, colour=True, depth=True)


def _neighbours(*order: int, colour: bool = True, depth: bool = True) -> Change:

    def changed(draft: Draft, other: Draft, rng: np.random.Generator) -> Draft:
        rows, first = np.arange(len(draft)), int(rng.integers(len(draft) // 3, 2 * len(draft) // 3))
        rows[first : first + len(order)] = first + np.array(order)
        return _reordered(draft, rows, colour=colour, depth=depth)

    return changed


def _reordered(draft: Draft, order: np.ndarray, *, colour: bool, depth: bool) -> Draft:
    rows: list[int] = order.tolist()
    return replace(
        draft,
        rgb=tuple(draft.rgb[i] for i in rows) if colour else draft.rgb,
        depth=tuple(draft.depth[i] for i in rows) if depth else draft.depth,
    )


def _of_scale() -> Iterator[Named]:
    for factor in (0.1, 0.3, 0.5, 2.0, 10.0, 100.0, 1000.0):
        yield f"positions x{factor:g}", _on_poses(lambda p, f=factor: _scaled(p, f)), _SCALE
    for factor in (0.1, 0.2, 0.25, 0.5, 2.0, 4.0, 5.0, 10.0):
        change: Change = lambda d, o, g, f=factor: replace(d, units_per_m=d.units_per_m / f)  # noqa: E731
        yield f"depth x{factor:g}", change, _SCALE


_SCALE = r"times too|in metres|depth.unit|too far to be reached|m/s|jumps by"


def _scaled(written: np.ndarray, factor: float) -> np.ndarray:
    scaled = written.copy()
    scaled[:, :3, 3] *= factor
    return scaled


def _on_depth(change: Callable[[Picture], Picture]) -> Change:
    return lambda draft, other, rng: replace(draft, depth=tuple(map(change, draft.depth)))


def _on_colour(change: Callable[[Picture], Picture]) -> Change:
    return lambda draft, other, rng: replace(draft, rgb=tuple(map(change, draft.rgb)))


def _as_16_bit(values: Any) -> Picture:
    return np.clip(values, 0, 65_535).astype(np.uint16)


def _of_depth() -> Iterator[Named]:
    depth = "do not agree|depth"
    yield "distance along the ray", _along_ray, "along the ray"
    yield "depth mirrored", _on_depth(lambda d: d[:, ::-1]), "depth pictures look mirrored"
    yield "depth upside down", _on_depth(lambda d: d[::-1, ::-1]), "depth pictures look upside down"
    yield "depth shuffled", lambda d, o, g: _reordered(d, g.permutation(len(d)), colour=False, depth=True), depth
    yield "depth of another walk", lambda d, o, g: replace(d, depth=_fitted(o.depth, d.depth)), depth
    yield "depth constant", _on_depth(lambda d: np.full_like(d, 3000)), "same depth"
    yield (
        "depth of noise",
        lambda d, o, g: replace(d, depth=tuple(g.integers(300, 6000, x.shape).astype(np.uint16) for x in d.depth)),
        depth,
    )
    yield (
        "disparity for depth",
        _on_depth(lambda d: np.where(d > 0, _as_16_bit(4e6 / np.maximum(d, 1)), 0).astype(np.uint16)),
        depth,
    )
    yield "bytes of depth swapped", _on_depth(lambda d: d.byteswap()), depth
    yield "depth in steps of 256", _on_depth(lambda d: d // 256 * 256), depth
    yield "depth shifted by a sixteenth", _on_depth(lambda d: np.roll(d, d.shape[1] // 16, axis=1)), depth
    yield "depth shifted downwards by a sixteenth", _on_depth(lambda d: np.roll(d, d.shape[1] // 16, axis=0)), depth
    yield "depth cut off at 2 m", _on_depth(lambda d: np.minimum(d, 2000)), depth
    yield "depth of two neighbours exchanged", _neighbours(1, 0, colour=False), "exchanged|depth"
    yield "no depth in half of the frames", _half_empty, "no depth"
    yield "depth froze", _frozen, depth


def _along_ray(draft: Draft, other: Draft, rng: np.random.Generator) -> Draft:
    length = np.linalg.norm(draft.rig.depth.rays(), axis=2)
    return replace(draft, depth=tuple(_as_16_bit(d * length) for d in draft.depth))


def _fitted(pictures: tuple[Picture, ...], like: tuple[Picture, ...]) -> tuple[Picture, ...]:
    import cv2

    size = (like[0].shape[1], like[0].shape[0])
    chosen = [pictures[i % len(pictures)] for i in range(len(like))]
    return tuple(cv2.resize(picture, size, interpolation=cv2.INTER_NEAREST) for picture in chosen)


def _half_empty(draft: Draft, other: Draft, rng: np.random.Generator) -> Draft:
    return replace(draft, depth=tuple(d if rng.random() < 0.5 else np.zeros_like(d) for d in draft.depth))


def _frozen(draft: Draft, other: Draft, rng: np.random.Generator) -> Draft:
    half = len(draft) // 2
    return replace(draft, depth=(*draft.depth[:half], *[draft.depth[half]] * (len(draft) - half)))


def _of_colour() -> Iterator[Named]:
    colour = "colour"
    yield "colour mirrored", _on_colour(lambda c: c[:, ::-1]), "colour pictures look mirrored"
    yield "colour upside down", _on_colour(lambda c: c[::-1, ::-1]), "colour pictures look upside down"
    yield "colour shuffled", lambda d, o, g: _reordered(d, g.permutation(len(d)), colour=True, depth=False), colour
    yield "colour reversed", lambda d, o, g: _reordered(d, np.arange(len(d))[::-1], colour=True, depth=False), colour
    yield "colour of another walk", lambda d, o, g: replace(d, rgb=_fitted(o.rgb, d.rgb)), colour
    yield (
        "colour of noise",
        lambda d, o, g: replace(d, rgb=tuple(g.integers(0, 255, c.shape, dtype=np.uint8) for c in d.rgb)),
        colour,
    )
    yield "colour of one shade", _on_colour(lambda c: np.full_like(c, 128)), "of one colour"
    yield "half of the pictures BGR", _bgr(lambda i, n, g: g.random() < 0.5), "BGR"
    yield "every fifth picture BGR", _bgr(lambda i, n, g: i % 5 == 0), "BGR"
    yield "the second half BGR", _bgr(lambda i, n, g: i > n // 2), "BGR"
    yield "colour shifted by a sixteenth", _on_colour(lambda c: np.roll(c, c.shape[1] // 16, axis=1)), "colour"
    yield "colour of two neighbours exchanged", _neighbours(1, 0, depth=False), "exchanged|colour"
    yield (
        "colour froze",
        lambda d, o, g: _reordered(d, np.minimum(np.arange(len(d)), len(d) // 2), colour=True, depth=False),
        colour,
    )
    yield "colour 3 frames late", _late(3), colour
    yield "colour black", _on_colour(lambda c: np.zeros_like(c)), "black"
    yield "a third of the pictures black", _black, "black"
    yield "colour dark", _on_colour(lambda c: (c * 0.03).astype(np.uint8)), "dark|one colour|black"
    yield "colour 10 frames late", _late(10), colour


def _late(frames: int) -> Change:
    def changed(draft: Draft, other: Draft, rng: np.random.Generator) -> Draft:
        order = np.minimum(np.arange(len(draft)) + frames, len(draft) - 1)
        return _reordered(draft, order, colour=True, depth=False)

    return changed


def _black(draft: Draft, other: Draft, rng: np.random.Generator) -> Draft:
    third = len(draft) // 3
    return replace(draft, rgb=(*map(np.zeros_like, draft.rgb[:third]), *draft.rgb[third:]))


def _bgr(chosen: Callable[[int, int, np.random.Generator], bool]) -> Change:

    def changed(draft: Draft, other: Draft, rng: np.random.Generator) -> Draft:
        count = len(draft)
        return replace(draft, rgb=tuple(c[..., ::-1] if chosen(i, count, rng) else c for i, c in enumerate(draft.rgb)))

    return changed


def _of_pictures() -> Iterator[Named]:
    yield "all mirrored", _both(lambda x: x[:, ::-1]), "pictures look mirrored"
    yield "all upside down", _both(lambda x: x[::-1, ::-1]), "LUF|upside down"
    yield "all turned by 90 degrees", _quarter, "URF|DLF|90 degrees"
    yield "all turned by 90 degrees and squeezed", _squeezed, "90 degrees"


def _both(change: Callable[[Picture], Picture]) -> Change:
    return lambda d, o, g: _on_depth(change)(_on_colour(change)(d, o, g), o, g)


def _quarter(draft: Draft, other: Draft, rng: np.random.Generator) -> Draft:
    def turned(camera: Pinhole) -> Pinhole:
        return Pinhole(camera.fy, camera.fx, camera.cy, camera.width - camera.cx, camera.height, camera.width)

    rig = Rig(turned(draft.rig.rgb), turned(draft.rig.depth), draft.rig.rgb_from_depth)
    return replace(_both(np.rot90)(draft, other, rng), rig=rig)


def _squeezed(draft: Draft, other: Draft, rng: np.random.Generator) -> Draft:
    import cv2

    def squeeze(picture: Picture) -> Picture:
        size = (picture.shape[1], picture.shape[0])
        return cv2.resize(np.ascontiguousarray(np.rot90(picture)), size, interpolation=cv2.INTER_NEAREST)

    return _both(squeeze)(draft, other, rng)


def _of_intrinsics() -> Iterator[Named]:
    yield "intrinsics of a picture twice as large", _on_cameras(lambda c: _camera(c, 2.0, 2.0, 2.0)), "picture"
    yield (
        "intrinsics of a picture half as large",
        _on_cameras(lambda c: _camera(c, 0.5, 0.5, 0.5)),
        "picture|intrinsics",
    )
    for factor in (0.5, 0.7, 1.4, 2.0):
        yield f"focal length x{factor:g}", _on_cameras(lambda c, f=factor: _camera(c, f)), "focal length"
    yield "principal point at the corner", _on_cameras(lambda c: _camera(c, 1.0, 0.0, 0.0)), "principal point"
    yield (
        "columns and rows exchanged",
        _on_cameras(lambda c: Pinhole(c.fy, c.fx, c.cy, c.cx, c.width, c.height)),
        "exchanged|principal|picture",
    )
    yield "focal length of colour x0.5", _on_cameras(lambda c: _camera(c, 0.5), depth=False), "colour|do not agree"
    yield "focal length of depth x0.5", _on_cameras(lambda c: _camera(c, 0.5), colour=False), "do not agree|focal"
    yield "colour camera 0.3 m beside", _mounted(0.3, 0.0, 0.0), "rgb_from_depth"
    yield "colour camera 0.15 m above", _mounted(0.0, 0.15, 0.0), "rgb_from_depth"
    yield "principal point off by a sixteenth", _on_cameras(lambda c: _camera(c, 1.0, 1.125)), "princip"


def _mounted(*by_m: float) -> Change:
    moved = np.eye(4)
    moved[:3, 3] = by_m
    return lambda d, o, g: replace(d, rig=Rig(d.rig.rgb, d.rig.depth, d.rig.rgb_from_depth @ moved))


def _camera(camera: Pinhole, focal: float, x: float = 1.0, y: float = 1.0) -> Pinhole:
    c = camera
    return Pinhole(c.fx * focal, c.fy * focal, c.cx * x, c.cy * y, c.width, c.height)


def _on_cameras(change: Callable[[Pinhole], Pinhole], *, colour: bool = True, depth: bool = True) -> Change:
    def changed(draft: Draft, other: Draft, rng: np.random.Generator) -> Draft:
        rig = draft.rig
        rgb = change(rig.rgb) if colour else rig.rgb
        return replace(draft, rig=Rig(rgb, change(rig.depth) if depth else rig.depth, rig.rgb_from_depth))

    return changed


def _of_clocks() -> Iterator[Named]:
    for delay_s in (-0.6, 0.3, 1.0):
        change: Change = lambda d, o, g, s=delay_s: replace(d, pose_stamps_s=d.pose_stamps_s + s)  # noqa: E731
        yield f"poses {delay_s:+g} s off", change, "late|early"
