"""People, clothed: standing, walking, sitting, lying; and clothes without them. The front looks along +x.

Homes place none of them; training worlds do, since in real rooms somebody stands or sits about. A body is a pelvis from
which limbs go at the angles of its joints. Lengths are shares of its height (Drillis and Contini, 1966, rounded).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from avlmaps_sim.furniture.catalogue import Parts, family
from avlmaps_sim.furniture.recipe_helpers import chance, cloth, count, draw, made_of, pick
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, Meshes, Triple, joined
from avlmaps_sim.shapes import circle, ellipsoid, loft, rounded_box, tube

_THIGH, _SHANK, _FOOT_HIGH, _FOOT_LONG = 0.245, 0.235, 0.04, 0.15
_TRUNK, _NECK, _HEAD_HIGH = 0.29, 0.045, 0.13
_UPPER_ARM, _FOREARM, _HAND = 0.175, 0.15, 0.07
_HIP_HALF, _SHOULDER_HALF = 0.052, 0.108
_SKIN = ((0.94, 0.78, 0.67), (0.86, 0.66, 0.52), (0.72, 0.52, 0.38), (0.5, 0.34, 0.24), (0.32, 0.22, 0.17))
_HAIR = ((0.08, 0.06, 0.05), (0.25, 0.16, 0.1), (0.45, 0.32, 0.18), (0.75, 0.6, 0.38), (0.7, 0.7, 0.7), (0.5, 0.2, 0.1))
_SIDES = 10


@dataclass(frozen=True, slots=True)
class Pose:
    """Angles of the joints, radians; pairs are left and right."""

    lean: float = 0.0  # of the trunk, forward from upright
    hip: tuple[float, float] = (0.0, 0.0)  # how far each thigh is raised forward from straight down
    knee: tuple[float, float] = (0.0, 0.0)  # how far each shank is bent back from its thigh
    spread: float = 0.06  # how far the thighs are apart sideways, each
    shoulder: tuple[float, float] = (0.0, 0.0)  # how far each upper arm is raised forward from straight down the trunk
    aside: float = 0.12  # how far each is raised sideways
    elbow: tuple[float, float] = (0.2, 0.2)  # how far each forearm is bent forward from its upper arm


@dataclass(frozen=True, slots=True)
class _Looks:
    skin: Material
    hair: Material
    shirt: Material
    trousers: Material
    shoes: Material
    short_sleeves: bool
    bare_legs: bool
    long_hair: bool
    girth: float


def _looks(rng: np.random.Generator) -> _Looks:
    shirt, trousers = (material("fabric", rng) for _ in range(2))
    return _Looks(material("plastic", rng, pick(rng, _SKIN)), material("fabric", rng, pick(rng, _HAIR)), shirt,
                  shirt if chance(rng, 0.1) else trousers, made_of(rng, "leather", "black", "fabric"), chance(rng, 0.4),
                  chance(rng, 0.15), chance(rng, 0.4), draw(rng, 0.85, 1.3))  # fmt: skip


def _limb(path: Sequence[Float[np.ndarray, "3"]], radii: Sequence[float], look: Material) -> Mesh:
    points = np.asarray(path, np.float64)
    along = np.gradient(points, axis=0)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-9)
    aside = np.array([0.0, 1.0, 0.0]) if abs(along[0][1]) < 0.9 else np.array([1.0, 0.0, 0.0])
    rings = []
    for place, forward, radius in zip(points, along, radii, strict=True):
        aside = aside - forward * (aside @ forward)
        aside /= max(float(np.linalg.norm(aside)), 1e-9)
        ring = circle(radius, _SIDES)
        rings.append(place + ring[:, :1] * aside + ring[:, 1:] * np.cross(forward, aside))
    return loft(rings, look)


def _bent(forward_rad: float, aside_rad: float, side: int) -> Float[np.ndarray, "3"]:
    c = np.cos(aside_rad)
    return np.array([np.sin(forward_rad) * c, side * np.sin(aside_rad), -np.cos(forward_rad) * c])


def _leg(pose: Pose, number: int, height_m: float, looks: _Looks) -> list[Mesh]:
    side = 1 - 2 * number
    hip = np.array([0.0, side * _HIP_HALF * height_m, 0.0])
    thigh = _bent(pose.hip[number], pose.spread, side)
    knee = hip + thigh * _THIGH * height_m
    swing = pose.hip[number] - pose.knee[number]
    shank = _bent(swing, pose.spread * 0.5, side)
    ankle = knee + shank * _SHANK * height_m
    wide, bare = looks.girth * height_m, looks.skin if looks.bare_legs else looks.trousers
    upper = _limb([hip, (hip + knee) / 2, knee], [0.052 * wide, 0.046 * wide, 0.034 * wide], looks.trousers)
    lower = _limb([knee, (2 * knee + ankle) / 3, ankle], [0.034 * wide, 0.035 * wide, 0.024 * wide], bare)
    toes = np.array([np.cos(swing), 0.0, np.sin(swing)])
    high, long = _FOOT_HIGH * height_m, _FOOT_LONG * height_m
    half = 0.028 * height_m
    foot = rounded_box((-0.27 * long, -half, -high), (0.73 * long, half, 0.0), 0.018, looks.shoes)
    return [upper, lower, foot.mapped(np.column_stack([toes, [0.0, 1.0, 0.0], -shank])).moved(*ankle.tolist())]


def _arm(pose: Pose, number: int, shoulder: np.ndarray, height_m: float, looks: _Looks) -> list[Mesh]:
    side = 1 - 2 * number
    raised = pose.shoulder[number] + pose.lean
    elbow = shoulder + _bent(raised, pose.aside, side) * _UPPER_ARM * height_m
    wrist = elbow + _bent(raised + pose.elbow[number], pose.aside * 0.4, side) * _FOREARM * height_m
    wide = looks.girth * height_m
    sleeve = looks.skin if looks.short_sleeves else looks.shirt
    upper = _limb([shoulder, (shoulder + elbow) / 2, elbow], [0.036 * wide, 0.03 * wide, 0.026 * wide], looks.shirt)
    lower = _limb([elbow, (elbow + wrist) / 2, wrist], [0.026 * wide, 0.023 * wide, 0.016 * height_m], sleeve)
    palm = wrist + (wrist - elbow) / (_FOREARM * height_m) * _HAND / 2 * height_m
    hand = _limb([wrist, palm, 2 * palm - wrist], [0.014 * height_m, 0.022 * height_m, 0.01], looks.skin)
    return [upper, lower, hand]


def _head(top: np.ndarray, tilt: float, height_m: float, looks: _Looks) -> Mesh:
    half, neck = _HEAD_HIGH * height_m / 2, _NECK * height_m
    parts = [_limb([np.zeros(3), np.array([0.01, 0.0, 1.4 * neck])], [0.034 * height_m, 0.03 * height_m], looks.skin)]
    middle: Triple = (0.012, 0.0, neck + half)
    parts.append(ellipsoid(middle, (0.75 * half, 0.62 * half, half), looks.skin, 12, 8))
    cap = (-0.006, 0.0, neck + half * 1.18)
    parts.append(ellipsoid(cap, (0.8 * half, 0.7 * half, 0.88 * half), looks.hair, 12, 6))
    if looks.long_hair:
        back: Triple = (-0.5 * half, 0.0, neck + half * 0.5)
        parts.append(ellipsoid(back, (0.45 * half, 0.66 * half, 1.3 * half), looks.hair))
    c, s = np.cos(tilt), np.sin(tilt)
    return joined(parts).mapped(np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])).moved(*top.tolist())


def body(pose: Pose, height_m: float, looks: _Looks) -> Mesh:
    """Return a person whose hips' middle is the origin, z up."""
    c, s = np.cos(pose.lean), np.sin(pose.lean)
    wide, rings = looks.girth * height_m, []
    for share, deep, across in ((-0.16, 0.05, 0.07), (0.0, 0.066, 0.095), (0.35, 0.058, 0.08), (0.7, 0.066, 0.1),
                                (0.93, 0.055, 0.108), (1.0, 0.03, 0.05)):  # fmt: skip
        ring = circle(deep * wide, 14, across * (0.7 * height_m + 0.3 * wide))
        z = share * _TRUNK * height_m
        rings.append(np.column_stack([ring[:, 0] * c + z * s, ring[:, 1], -ring[:, 0] * s + z * c]))
    parts = [loft(rings[:3], looks.trousers if pose.hip[0] < 1.0 else looks.shirt), loft(rings[1:], looks.shirt)]
    along = np.array([s, 0.0, c]) * _TRUNK * height_m
    parts.append(_head(along, pose.lean * 0.5, height_m, looks))
    for number, side in enumerate((1, -1)):
        shoulder = 0.92 * along + np.array([0.0, side * _SHOULDER_HALF * height_m, 0.0])
        parts += [*_leg(pose, number, height_m, looks), *_arm(pose, number, shoulder, height_m, looks)]
    return joined(parts)


def _tall(rng: np.random.Generator) -> float:
    return draw(rng, 1.0, 1.45) if chance(rng, 0.15) else float(np.clip(rng.normal(1.7, 0.1), 1.5, 1.95))


def _arms(rng: np.random.Generator) -> tuple[tuple[float, float], tuple[float, float]]:
    kind = rng.random()
    if kind < 0.5:
        return (draw(rng, -0.2, 0.2), draw(rng, -0.2, 0.2)), (draw(rng, 0.1, 0.6), draw(rng, 0.1, 0.6))
    if kind < 0.8:
        bent = draw(rng, 1.0, 1.9)
        return (draw(rng, 0.0, 0.6), draw(rng, 0.0, 0.6)), (bent, bent + draw(rng, -0.4, 0.3))
    return (draw(rng, 0.8, 2.4), draw(rng, -0.1, 0.3)), (draw(rng, 0.1, 1.2), draw(rng, 0.1, 0.8))


def seated(rng: np.random.Generator, seat_m: float) -> Mesh:
    """Return somebody who sits: contact with the seat at x = y = 0, z = ``seat_m``; the floor is at z = 0."""
    height = _tall(rng)
    shank = (_SHANK + _FOOT_HIGH) * height
    # Feet on the floor where the legs reach it.
    thigh_up = float(np.arcsin(np.clip((shank - seat_m) / (_THIGH * height), -0.35, 0.35)))
    hips = tuple(np.pi / 2 + thigh_up + draw(rng, -0.08, 0.08) for _ in range(2))
    knees = tuple(hip + draw(rng, -0.25, 0.25) for hip in hips)
    shoulders, elbows = _arms(rng)
    pose = Pose(draw(rng, -0.3, 0.35), (hips[0], hips[1]), (knees[0], knees[1]), draw(rng, 0.0, 0.25), shoulders,
                draw(rng, 0.05, 0.35), elbows)  # fmt: skip
    looks = _looks(rng)
    mesh = body(pose, height, looks)
    return mesh.moved(z=seat_m + 0.055 * looks.girth * height)


@family("person", "standing")
def _standing(rng: np.random.Generator) -> Parts:
    shoulders, elbows = _arms(rng)
    bend = draw(rng, 0.0, 0.15)
    pose = Pose(draw(rng, -0.05, 0.3), (bend, draw(rng, 0.0, 0.15)), (bend, draw(rng, 0.0, 0.3)), draw(rng, 0.02, 0.15),
                shoulders, draw(rng, 0.05, 0.3), elbows)  # fmt: skip
    return [body(pose, _tall(rng), _looks(rng))]


@family("person", "walking", held_out=True)
def _walking(rng: np.random.Generator) -> Parts:
    step, side = draw(rng, 0.25, 0.55), pick(rng, (1.0, -1.0))
    hip = (side * step, -side * step)
    ahead, behind = draw(rng, 0.05, 0.3), draw(rng, 0.3, 0.7)
    knee = (ahead, behind) if side > 0 else (behind, ahead)
    pose = Pose(draw(rng, 0.0, 0.15), hip, knee, 0.04, (-hip[0], -hip[1]), 0.1,
                (draw(rng, 0.2, 0.9), draw(rng, 0.2, 0.9)))  # fmt: skip
    return [body(pose, _tall(rng), _looks(rng))]


@family("person", "sitting")
def _sitting(rng: np.random.Generator) -> Parts:
    return [seated(rng, draw(rng, 0.38, 0.5))]


@family("person", "lying", held_out=True)
def _lying(rng: np.random.Generator) -> Parts:
    shoulders, elbows = _arms(rng)
    bend = draw(rng, 0.0, 0.8)
    pose = Pose(0.0, (bend, draw(rng, 0.0, 0.5)), (bend * 1.5, 0.3), 0.1, shoulders, 0.2, elbows)
    return [body(pose, _tall(rng), _looks(rng)).tilted("y", -np.pi / 2)]


@family("person", "crouching")
def _crouching(rng: np.random.Generator) -> Parts:
    hip = draw(rng, 1.6, 2.1)
    pose = Pose(draw(rng, 0.2, 0.7), (hip, hip - draw(rng, 0.0, 0.5)), (hip + 0.5, hip + 0.3), 0.15,
                (draw(rng, 0.3, 0.9), draw(rng, 0.3, 0.9)), 0.15, (0.5, 0.5))  # fmt: skip
    return [body(pose, _tall(rng), _looks(rng))]


def fabric(rng: np.random.Generator) -> Material:
    """Return the cloth of a garment."""
    return made_of(rng, "fabric", "fabric", "fabric", "curtain", "leather")


def _waves(rng: np.random.Generator, number: int, longest: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    turn, wave = rng.uniform(0, 2 * np.pi, number), longest * rng.uniform(0.25, 1.0, number)
    vector = np.stack([np.cos(turn), np.sin(turn)], axis=1) * (2 * np.pi / wave)[:, None]
    return vector, rng.uniform(0, 2 * np.pi, number), rng.uniform(0.3, 1.0, number) * wave


def heap(rng: np.random.Generator, long: float, wide: float, high: float, look: Material) -> Mesh:
    """Return crumpled cloth on z = 0: an uneven outline, folds that run every direction, edges that lie flat."""
    sides, rings = 28, 10
    angle = np.linspace(0.0, 2 * np.pi, sides, endpoint=False)
    outline = 1.0 + sum(draw(rng, 0.0, 0.28 / k) * np.sin(k * angle + draw(rng, 0, 6.3)) for k in (1, 2, 3, 4, 5))
    vector, phase, tall = _waves(rng, 6, 0.5 * max(long, wide))
    layers = []
    for share in np.linspace(1.0, 0.02, rings):
        flat = np.column_stack([np.cos(angle) * long / 2, np.sin(angle) * wide / 2]) * (outline * share)[:, None]
        folds = np.sqrt(np.abs(np.sin(flat @ vector.T + phase))) @ tall / tall.sum()
        folds = np.clip(2.2 * folds - 1.0, 0.0, 1.0)
        rise = np.clip((1.0 - share) / 0.35, 0.0, 1.0) ** 0.6
        layers.append(np.column_stack([flat, 0.004 + high * rise * (0.2 + 0.8 * folds)]))
    first = layers[0].copy()
    first[:, 2] = 0.0
    return loft([first, *layers], look)


def thrown_over(rng: np.random.Generator, wide: float, front: float, back: float, thick: float, look: Material) -> Mesh:
    """Return cloth that hangs over an edge along y at z = 0, ``thick`` from front to back: two flaps and the fold."""
    across = np.linspace(-0.5, 0.5, 15)
    vector, phase, tall = _waves(rng, 5, 0.35)
    hem = rng.uniform(0.75, 1.1, 2)
    rows = []
    for side, length, low in ((1.0, front, hem[0]), (-1.0, back, hem[1])):
        for share in (1.0, 0.75, 0.5, 0.25, 0.05):
            y = wide * across * (1.0 + 0.15 * share * draw(rng, -1, 1))
            z = -length * share * (low + 0.12 * np.sin(5 * across + phase[0]) * share)
            folds = np.sin(np.stack([y, z], axis=1) @ vector.T + phase) @ tall / tall.sum()
            x = side * (thick / 2 + 0.012 + 0.035 * share * (1.0 + folds))
            rows.append(np.column_stack([x, y, z + 0.01]))
        if side > 0:
            rows.append(np.column_stack([np.zeros(15), wide * across, np.full(15, 0.022)]))
            rows[-1][:, 2] += 0.006 * np.sin(9 * across + phase[1])
    return cloth(np.stack([*rows[:6], *rows[:5:-1]]), look)


def _hanging(rng: np.random.Generator, look: Material, shoulders: float, long: float, deep: float) -> Mesh:
    rings, sides = [], 22
    angle = np.linspace(0.0, 2 * np.pi, sides, endpoint=False)
    phase, folds = draw(rng, 0, 6.3), count(rng, 3, 7)
    for share, width in ((0.0, 0.25), (0.08, 0.85), (0.2, 1.0), (0.6, 1.0), (1.0, draw(rng, 0.95, 1.25))):
        wrinkle = 1.0 + 0.18 * share * np.sin(folds * angle + phase)
        x, y = np.cos(angle) * deep / 2 * wrinkle, np.sin(angle) * shoulders / 2 * width
        rings.append(np.column_stack([x, y, np.full(sides, -long * share)]))
    return loft(rings, look)


def _sleeves(rng: np.random.Generator, look: Material, shoulders: float, long: float) -> Meshes:
    for side in (-1, 1):
        y, out = side * shoulders * 0.44, side * draw(rng, 0.02, 0.1)
        line = [(0.0, y, -0.06), (0.01, y + 0.6 * out, -0.3 * long), (0.02, y + out, -0.62 * long)]
        yield tube(line, draw(rng, 0.045, 0.065), look, 8)


@family("clothing", "heap")
def _heap(rng: np.random.Generator) -> Parts:
    long = draw(rng, 0.25, 0.75)
    return [heap(rng, long, long * draw(rng, 0.5, 1.0), draw(rng, 0.04, 0.16), fabric(rng))]


@family("clothing", "several in a heap")
def _pile(rng: np.random.Generator) -> Parts:
    z = 0.0
    for _ in range(count(rng, 2, 5)):
        long, high = draw(rng, 0.3, 0.6), draw(rng, 0.04, 0.12)
        one = heap(rng, long, long * draw(rng, 0.5, 0.9), high, fabric(rng)).turned(draw(rng, 0, 6.3))
        yield one.moved(draw(rng, -0.12, 0.12), draw(rng, -0.12, 0.12), z)
        z += 0.55 * high


@family("clothing", "folded stack")
def _stack(rng: np.random.Generator) -> Parts:
    z = 0.0
    long, wide = draw(rng, 0.25, 0.4), draw(rng, 0.2, 0.32)
    for _ in range(count(rng, 1, 7)):
        high = draw(rng, 0.012, 0.045)
        a, b = long / 2 * draw(rng, 0.85, 1.0), wide / 2 * draw(rng, 0.85, 1.0)
        one = rounded_box((-a, -b, 0.0), (a, b, high), 0.012, fabric(rng), soft_top=0.005)
        yield one.turned(draw(rng, -0.12, 0.12)).moved(z=z)
        z += high


@family("clothing", "wall hook")
def _on_hook(rng: np.random.Generator) -> Parts:
    look, long, shoulders = fabric(rng), draw(rng, 0.6, 1.15), draw(rng, 0.3, 0.45)
    yield from (_hanging(rng, look, shoulders, long, draw(rng, 0.1, 0.18)), *_sleeves(rng, look, shoulders, long))
    hook = tube([(-0.09, 0.0, 0.02), (0.0, 0.0, 0.0), (0.02, 0.0, 0.03)], 0.008, material("metal", rng), 6)
    yield hook


@family("clothing", "trousers laid out", held_out=True)
def _trousers(rng: np.random.Generator) -> Parts:
    look, long, wide = fabric(rng), draw(rng, 0.7, 1.05), draw(rng, 0.13, 0.2)
    for side in (-1, 1):
        apart = draw(rng, 0.5, 1.4) * side
        line = [(0.0, side * wide * 0.45, 0.02), (long * 0.5, apart * wide * 0.8, 0.024), (long, apart * wide, 0.016)]
        leg = tube(line, wide * 0.5, look, 10)
        yield leg.scaled(1.0, 1.0, 0.28)
    yield ellipsoid((0.0, 0.0, 0.014), (0.09, wide * 0.95, 0.022), look)


@family("clothing", "on hangers", held_out=True)
def _on_hangers(rng: np.random.Generator) -> Parts:
    x = 0.0
    for _ in range(count(rng, 3, 8)):
        look, long, shoulders = fabric(rng), draw(rng, 0.6, 1.1), draw(rng, 0.36, 0.46)
        one = joined([_hanging(rng, look, shoulders, long, 0.06), *_sleeves(rng, look, shoulders, long)])
        yield one.turned(draw(rng, -0.15, 0.15)).moved(x)
        x += draw(rng, 0.05, 0.1)
    rod = tube([(-0.1, 0.0, 0.05), (x + 0.1, 0.0, 0.05)], 0.014, material("metal", rng), 8)
    yield rod
