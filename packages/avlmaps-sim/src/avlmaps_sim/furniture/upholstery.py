"""Soft parts: seat and back cushions, loose pillows, mattresses, blankets and throws."""

import itertools
from dataclasses import dataclass

import numpy as np

from avlmaps_sim.furniture.recipe_helpers import chance, cloth, draw, pick
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, Meshes, Triple, joined
from avlmaps_sim.shapes import rounded_box


def covering(rng: np.random.Generator, leather: float = 0.25) -> Material:
    """Draw the cover of a seat: fabric, or leather in a share of the cases."""
    return material("leather" if chance(rng, leather) else "fabric", rng)


def pillow(rng: np.random.Generator, width: float, height: float, thickness: float, look: Material) -> Mesh:
    """Return a loose pillow lying flat about the origin, ``height`` along x, ``width`` along y, thin at its seams."""
    n = 6
    u, v = np.meshgrid(np.linspace(-1.0, 1.0, n), np.linspace(-1.0, 1.0, n), indexing="ij")
    swell = (1 - np.abs(u) ** 3) * (1 - np.abs(v) ** 3)
    waist = draw(rng, 0.03, 0.09)
    x = u * height / 2 * (1 - waist * (1 - v**2))
    y = v * width / 2 * (1 - waist * (1 - u**2))
    dent = 1 + rng.uniform(-0.12, 0.12, (n, n))
    halves = [np.stack([x, y, s * swell * dent * thickness / 2], axis=-1) for s in (1.0, -1.0)]
    return joined([cloth(halves[0], look), cloth(halves[1][::-1], look)])


def leaning_pillow(
    rng: np.random.Generator, place: Triple, side: float, look: Material, lean: float = 0.35, heading: float = 0.0
) -> Mesh:
    """Return a square pillow that stands with its lower edge at a place and leans back towards -x by an angle."""
    mesh = pillow(rng, side * draw(rng, 0.95, 1.3), side, side * draw(rng, 0.25, 0.4), look)
    upright = mesh.moved(x=-side / 2).tilted("y", np.pi / 2 - lean).turned(heading)
    return upright.moved(*place)


def scattered_pillows(
    rng: np.random.Generator, x: float, z: float, ys: tuple[float, float], number: int, lean: float
) -> Meshes:
    """Return pillows that lean against a back along y, their lower edges at x and z, metres."""
    looks = [material("fabric", rng) for _ in range(2)]
    side = draw(rng, 0.34, 0.48)
    room = max(ys[1] - ys[0] - side, 0.0)
    for _ in range(number):
        y = ys[0] + side / 2 + (pick(rng, (0.05, 0.95, draw(rng, 0.0, 1.0))) + draw(rng, -0.05, 0.05)) * room
        place = (x + draw(rng, 0.0, 0.06), y, z)
        yield leaning_pillow(rng, place, side, pick(rng, looks), lean + draw(rng, -0.1, 0.15), draw(rng, -0.3, 0.3))


def cushion(low: Triple, high: Triple, look: Material, radius: float = 0.04, crown: float = 0.025) -> Mesh:
    """Return a cushion with a crowned top that fills a box to within its crown."""
    (_, _, bottom), (d, e, top) = low, high
    crown = min(crown, 0.3 * (top - bottom))
    return rounded_box(low, (d, e, top - crown), radius, look, 2, crown)


def cushion_row(
    low: Triple, high: Triple, number: int, look: Material, radius: float = 0.04, crown: float = 0.025
) -> list[Mesh]:
    """Return cushions side by side along y, filling a box."""
    (a, b, c), (d, e, f) = low, high
    edge = np.linspace(b, e, number + 1)
    gap = 0.004
    return [
        cushion((a, float(s) + gap, c), (d, float(t) - gap, f), look, radius, crown)
        for s, t in itertools.pairwise(edge)
    ]


def back_cushions(
    low: Triple, high: Triple, number: int, look: Material, lean: float, radius: float = 0.05, crown: float = 0.05
) -> list[Mesh]:
    """Return cushions side by side along y that stand in a box, swell to the front and lean back by an angle."""
    (a, b, c), (d, e, f) = low, high
    edge = np.linspace(b, e, number + 1)
    out = []
    for s, t in itertools.pairwise(edge):
        # Made lying, its crowned face up, then set up so that the face looks along +x.
        flat = cushion((c - f, float(s) + 0.004, 0.0), (0.0, float(t) - 0.004, d - a), look, radius, crown)
        out.append(flat.tilted("y", np.pi / 2 - lean).moved(x=a, z=c))
    return out


@dataclass(frozen=True, slots=True)
class Bedding:
    """Where bedding lies."""

    low: Triple  # least corner of the mattress (x, y, z), metres; the head of the bed is at its least x
    high: Triple  # greatest corner of the mattress


def mattress(bed: Bedding, look: Material) -> Mesh:
    """Return a mattress with round edges."""
    return rounded_box(bed.low, bed.high, 0.05, look, 2, 0.012)


def _smooth_noise(rng: np.random.Generator, n: int, m: int) -> np.ndarray:
    u, v = np.meshgrid(np.linspace(0.0, 1.0, n), np.linspace(0.0, 1.0, m), indexing="ij")
    out = np.zeros((n, m))
    for _ in range(5):
        fu, fv = rng.uniform(-3.0, 3.0, 2)
        out += 0.4 * np.sin(2 * np.pi * (fu * u + fv * v) + rng.uniform(0.0, 6.28))
    return out


def blanket(
    rng: np.random.Generator, bed: Bedding, look: Material, start: float, rumple: float, hang: float, foot: bool = True
) -> Mesh:
    """Return a blanket over a mattress that hangs down its sides by ``hang``, and over its foot where ``foot`` says so.

    It begins at the share ``start`` of the length from the head; its folds are ``rumple`` high.
    """
    (a, b, _), (d, e, top) = bed.low, bed.high
    n, inner = 10, 9
    x = list(np.linspace(a + start * (d - a), d - 0.01, n - (2 if foot else 0)))
    drop_x = [0.0] * len(x)
    if foot:
        x, drop_x = [*x, d + 0.015, d + 0.022], [*drop_x, 0.03, hang]
    y = [b - 0.03, b - 0.02, *np.linspace(b + 0.01, e - 0.01, inner), e + 0.02, e + 0.03]
    drop_y = [hang, 0.03, *[0.0] * inner, 0.03, hang]
    drop = np.maximum(np.asarray(drop_x)[:, None], np.asarray(drop_y)[None, :])
    noise = _smooth_noise(rng, len(x), len(y))
    z = top + 0.03 + rumple * np.abs(noise) - drop * (1 + 0.12 * noise * (drop > 0.05))
    grid = np.stack(np.broadcast_arrays(np.asarray(x)[:, None], np.asarray(y)[None, :], z), axis=-1).copy()
    wavy = rumple * 0.8 * noise
    grid[0, :, 0] += wavy[0] * 2  # the turned-down edge is not straight
    grid[:, 0, 1] -= np.abs(wavy[:, 0])
    grid[:, -1, 1] += np.abs(wavy[:, -1])
    return cloth(grid, look)


def heap(rng: np.random.Generator, place: Triple, size: float, look: Material) -> Mesh:
    """Return a cover thrown on a heap: hills over a patch with a wavy rim, lowest there."""
    n = 11
    u, v = np.meshgrid(np.linspace(-1.0, 1.0, n), np.linspace(-1.0, 1.0, n), indexing="ij")
    fall = (1 - np.abs(u) ** 2.5) * (1 - np.abs(v) ** 2.5)
    noise, stretch = _smooth_noise(rng, n, n), draw(rng, 0.7, 1.1)
    x = u * size * (0.85 + 0.15 * np.cos(2 * v + draw(rng, 0.0, 6.0)))
    y = v * size * stretch * (0.85 + 0.15 * np.cos(2 * u + draw(rng, 0.0, 6.0)))
    z = size * fall * (draw(rng, 0.1, 0.25) + 0.18 * np.abs(noise)) + 0.02
    grid = np.stack([x, y, z], axis=-1)
    return cloth(grid, look).turned(draw(rng, 0.0, 6.28)).moved(*place)


def throw(rng: np.random.Generator, profile: list[tuple[float, float]], y: float, width: float, look: Material) -> Mesh:
    """Return a cover hung over something: it follows a profile of (x, z) and is ``width`` wide about y, metres."""
    xs, zs = (np.asarray(values) for values in zip(*profile, strict=True))
    across = np.linspace(-0.5, 0.5, 6) * width
    noise = _smooth_noise(rng, len(xs), len(across)) * 0.008
    grid = np.stack([xs[:, None] + noise, (y + across)[None, :] + 2 * noise, zs[:, None] + np.abs(noise)], axis=-1)
    return cloth(grid, look)


def head_pillows(rng: np.random.Generator, bed: Bedding, number: int, look: Material) -> Meshes:
    """Return pillows at the head of a bed: lying, or propped up against the headboard."""
    (a, b, _), (_, e, top) = bed.low, bed.high
    each = (e - b) / number
    wide, deep = min(each * draw(rng, 0.75, 0.95), 0.85), draw(rng, 0.38, 0.55)
    propped = chance(rng, 0.35)
    for i in range(number):
        y = b + each * (i + 0.5) + draw(rng, -0.03, 0.03)
        mesh = pillow(rng, wide, deep, draw(rng, 0.13, 0.2), look)
        if propped:
            lean = draw(rng, 0.45, 0.9)
            mesh = mesh.moved(x=-deep / 2).tilted("y", np.pi / 2 - lean)
            yield mesh.moved(a + 0.1 + deep * float(np.sin(lean)), y, top)
        else:
            tilt = draw(rng, -0.15, 0.15)
            yield mesh.turned(tilt).moved(a + 0.06 + deep / 2, y, top + 0.055)
