"""Office chairs."""

import numpy as np

from avlmaps_sim.furniture.catalogue import Parts, family
from avlmaps_sim.furniture.legs import star_base
from avlmaps_sim.furniture.recipe_helpers import chance, count, draw, made_of, pick, strut
from avlmaps_sim.furniture.upholstery import covering, cushion
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, Meshes
from avlmaps_sim.shapes import box, loft, rounded_box, slab, tube


def _swivel(rng: np.random.Generator, seat: float) -> list[Mesh]:
    """Return a foot on castors with a gas lift up to the seat."""
    look = made_of(rng, "black", "black", "metal", "white")
    return [star_base(5, draw(rng, 0.27, 0.34), seat - 0.08, look, draw(rng, 0.022, 0.032), True),
            slab(0.0, 0.0, seat - 0.1, 0.2, 0.16, 0.05, material("black", rng))]  # fmt: skip


def _arm_rests(rng: np.random.Generator, half: float, seat: float, x: float) -> Meshes:
    """Return two arm rests: T-shaped, or loops."""
    look, high = material("black", rng), seat + draw(rng, 0.17, 0.26)
    style, apart = pick(rng, ("T", "loop")), half + draw(rng, 0.01, 0.05)
    for s in (1, -1):
        y = s * apart
        if style == "T":
            yield strut((x, s * half * 0.7, seat - 0.06), (x, y, seat - 0.03), 0.04, 0.02, look)
            yield box((x - 0.025, y - 0.012, seat - 0.05), (x + 0.025, y + 0.012, high - 0.02), look)
            yield rounded_box((x - 0.12, y - 0.04, high - 0.025), (x + 0.13, y + 0.04, high), 0.015, look, 2)
        else:
            path = [
                (x + 0.12, y, seat - 0.06),
                (x + 0.15, y, high - 0.03),
                (x + 0.1, y, high),
                (x - 0.15, y, high),
                (x - 0.22, y, seat + 0.05),
            ]
            yield tube(path, 0.016, look, 6)


def _curved_back(
    width: float, low: float, high: float, x: float, lean: float, bow: float, thick: float, look: Material,
    lumbar: float,
) -> Mesh:  # fmt: skip
    """Return a back that bends round the sitter and swells at the loins."""
    share, up = np.linspace(-1.0, 1.0, 6), np.linspace(0.0, 1.0, 6)
    swell = lumbar * np.exp(-(((up - 0.25) / 0.22) ** 2))
    wide = width / 2 * (1 - 0.22 * np.abs(up - 0.4) ** 1.5)
    faces = []
    for offset in (0.0, -thick):
        grid = np.stack(
            [
                x + offset + swell[:, None] + bow * share[None, :] ** 2 - lean * (up * (high - low))[:, None],
                wide[:, None] * share[None, :],
                np.broadcast_to((low + up * (high - low))[:, None], (6, 6)),
            ],
            axis=-1,
        )
        faces.append(grid)
    rings = [np.concatenate([face[i] for face in (faces[0], faces[1][:, ::-1])]) for i in range(6)]
    return loft(rings, look)


@family("office chair", "task")
def task_chair(rng: np.random.Generator) -> Parts:
    """Return a desk chair: padded seat and a low or middling back on a bar, with or without arms."""
    seat, width, depth = draw(rng, 0.42, 0.55), draw(rng, 0.44, 0.52), draw(rng, 0.42, 0.5)
    look = made_of(rng, "fabric", "fabric", "black", "leather", "plastic")
    yield from _swivel(rng, seat)
    yield cushion((-depth / 2, -width / 2, seat - 0.07), (depth / 2, width / 2, seat), look, 0.035, 0.012)
    low, high = seat + draw(rng, 0.1, 0.2), seat + draw(rng, 0.4, 0.62)
    back = -depth / 2 - draw(rng, 0.0, 0.05)
    lean = draw(rng, 0.05, 0.22)
    yield _curved_back(
        width * draw(rng, 0.8, 1.0), low, high, back, lean, draw(rng, 0.02, 0.07), draw(rng, 0.03, 0.07), look, 0.03
    )
    yield strut((-0.05, 0.0, seat - 0.08), (back - 0.07, 0.0, seat - 0.06), 0.07, 0.02, material("black", rng))
    yield strut((back - 0.06, 0.0, seat - 0.07), (back - 0.06, 0.0, low + 0.15), 0.07, 0.02, material("black", rng))
    if chance(rng, 0.6):
        yield from _arm_rests(rng, width / 2, seat, draw(rng, -0.05, 0.05))


@family("office chair", "executive")
def executive_chair(rng: np.random.Generator) -> Parts:
    """Return a high thick back in padded rolls with closed arms, mostly of leather."""
    seat, width, depth = draw(rng, 0.45, 0.54), draw(rng, 0.5, 0.58), draw(rng, 0.48, 0.54)
    look = covering(rng, 0.8)
    yield from _swivel(rng, seat)
    yield cushion((-depth / 2, -width / 2, seat - 0.12), (depth / 2, width / 2, seat), look, 0.05, 0.025)
    top, rolls, lean = seat + draw(rng, 0.6, 0.8), count(rng, 1, 4), draw(rng, 0.1, 0.22)
    rise = (top - seat) / rolls
    core = rounded_box((0.02 - top + seat, -width * 0.38, -0.03), (0.0, width * 0.38, 0.06), 0.02, look, 2)
    yield core.tilted("y", np.pi / 2 - lean).moved(x=-depth / 2 - 0.03, z=seat - 0.03)
    for i in range(rolls):
        wide = width * (1.0 - 0.06 * i)
        pad = rounded_box(
            (-rise * (i + 1) - 0.01, -wide / 2, 0.0), (0.01 - rise * i, wide / 2, draw(rng, 0.1, 0.14)), 0.05, look, 3
        )
        yield pad.tilted("y", np.pi / 2 - lean).moved(x=-depth / 2 - 0.03, z=seat - 0.03)
    yield from _arm_rests(rng, width / 2, seat, 0.0)


@family("office chair", "mesh")
def mesh_chair(rng: np.random.Generator) -> Parts:
    """Return a frame with netting for a back, perhaps with a head rest, and adjustable arms."""
    seat, width, depth = draw(rng, 0.43, 0.54), draw(rng, 0.46, 0.53), draw(rng, 0.43, 0.5)
    net, frame = material("fabric", rng, (0.12, 0.12, 0.13)), made_of(rng, "black", "white", "metal")
    if chance(rng, 0.3):
        net = material("fabric", rng)
    yield from _swivel(rng, seat)
    yield cushion((-depth / 2, -width / 2, seat - 0.06), (depth / 2, width / 2, seat), net, 0.03, 0.01)
    low, high, x, lean = seat + 0.06, seat + draw(rng, 0.48, 0.62), -depth / 2 - 0.03, draw(rng, 0.08, 0.2)
    bow = draw(rng, 0.03, 0.07)
    yield _curved_back(width * 0.96, low, high, x, lean, bow, 0.008, net, 0.04)
    half = width * 0.46
    rim = [
        (x - lean * (z - low) + bow, s * half, z)
        for s, z in ((1, low), (1, (low + high) / 2), (0.85, high), (-0.85, high), (-1, (low + high) / 2), (-1, low))
    ]
    yield tube([*rim, rim[0]], 0.013, frame, 5)
    yield tube(
        [(-0.05, 0.0, seat - 0.08), (x - 0.1, 0.0, seat - 0.02), (x - 0.07 - lean * 0.25, 0.0, low + 0.25)],
        0.022,
        frame,
        6,
    )
    if chance(rng, 0.5):
        z = high + draw(rng, 0.03, 0.08)
        at = x - lean * (z - low)
        yield _curved_back(width * 0.55, z, z + draw(rng, 0.1, 0.16), at + 0.03, 0.0, 0.03, 0.03, net, 0.0)
        yield tube([(at, 0.0, high - 0.1), (at, 0.0, z + 0.05)], 0.014, frame, 5)
    yield from _arm_rests(rng, width / 2, seat, draw(rng, -0.05, 0.05))


@family("office chair", "gaming", held_out=True)
def gaming_chair(rng: np.random.Generator) -> Parts:
    """Return a racing seat: raised bolsters at the seat and the back, shoulders, a cushion at the neck."""
    seat, width, depth = draw(rng, 0.44, 0.52), draw(rng, 0.5, 0.56), draw(rng, 0.48, 0.54)
    dark, accent = material("leather", rng, (0.08, 0.08, 0.09)), material("plastic", rng)
    yield from _swivel(rng, seat)
    yield cushion((-depth / 2, -width * 0.36, seat - 0.1), (depth / 2, width * 0.36, seat), dark, 0.03, 0.01)
    lean, top = draw(rng, 0.12, 0.3), draw(rng, 0.72, 0.84)
    back = []
    for s in (1, -1):
        y0, y1 = sorted((s * width * 0.34, s * width * 0.5))
        yield rounded_box(
            (-depth / 2, y0, seat - 0.09),
            (depth / 2 - 0.03, y1, seat + 0.05),
            0.03,
            accent if chance(rng, 0.5) else dark,
            3,
        )
        back.append(rounded_box((-top * 0.45, y0, 0.0), (0.0, y1, 0.15), 0.03, accent, 3))
        back.append(
            rounded_box((-top * 0.9, min(y0, y1 * 1.08), 0.0), (-top * 0.62, max(y0, y1 * 1.08), 0.13), 0.04, accent, 3)
        )
    back.append(rounded_box((-top, -width * 0.36, 0.0), (0.0, width * 0.36, 0.09), 0.03, dark, 3))
    back.append(cushion((-top * 0.93, -0.13, 0.08), (-top * 0.76, 0.13, 0.15), dark, 0.03, 0.01))
    yield from [m.tilted("y", np.pi / 2 - lean).moved(x=-depth / 2, z=seat - 0.02) for m in back]
    yield from _arm_rests(rng, width / 2, seat, 0.0)
