"""Chairs with a wooden frame, by the make of their backs, and office chairs."""

from dataclasses import replace

import numpy as np

from avlmaps_sim.furniture.catalogue import Parts, family
from avlmaps_sim.furniture.chair_parts import (
    ChairFrame,
    bent_rail,
    chair_arms,
    chair_frame,
    front_legs,
    hoop,
    horizontal_slats,
    rear_posts,
    seat_board,
    seat_outline,
    side_rails,
    splat,
    upright_slats,
)
from avlmaps_sim.furniture.legs import LegStyle, leg, leg_style, named_leg, star_base, stretchers
from avlmaps_sim.furniture.recipe_helpers import chance, count, draw, made_of, pick, strut
from avlmaps_sim.furniture.upholstery import covering, cushion
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, Meshes, joined
from avlmaps_sim.shapes import box, cylinder, loft, prism, rounded_box, slab, tube


def _frame_look(rng: np.random.Generator) -> Material:
    return made_of(rng, "wood", "wood", "wood", "painted", "white", "black")


def _wooden(rng: np.random.Generator, frame: ChairFrame, look: Material, seat: str = "", finial: float = 0.0) -> Mesh:
    style = leg_style(rng, 0.026, 0.045)
    posts = LegStyle(((0.0, 0.75), (0.2, 1.0), (1.0, 1.0)), style.sides, style.thickness_m)
    rungs = count(rng, 1, 2) if chance(rng, 0.45) else 0
    parts = [
        seat_board(rng, frame, look, seat),
        side_rails(rng, frame, draw(rng, 0.03, 0.08), 0.02, look, rungs),
        rear_posts(frame, posts, look, finial),
        front_legs(frame, style, look),
    ]
    if chance(rng, 0.18):
        parts.append(chair_arms(rng, frame, look, named_leg("straight", style.sides, style.thickness_m * 0.8)))
    return joined(parts)


@family("chair", "rail back")
def _rail_back(rng: np.random.Generator) -> Parts:
    frame, look = chair_frame(rng), _frame_look(rng)
    number = count(rng, 1, 3)
    tall = draw(rng, 0.05, 0.3 / number)
    return [_wooden(rng, frame, look), horizontal_slats(rng, frame, look, number, tall)]


@family("chair", "ladder back")
def _ladder_back(rng: np.random.Generator) -> Parts:
    frame = chair_frame(rng, back=draw(rng, 0.5, 0.72))
    look = _frame_look(rng)
    number = count(rng, 3, 6)
    tall = draw(rng, 0.03, 0.06)
    seat = pick(rng, ("cushion", "padded", "board"))
    body = _wooden(rng, frame, look, seat, draw(rng, 0.03, 0.08))
    return [body, horizontal_slats(rng, frame, look, number, tall)]


@family("chair", "slat back")
def _slat_back(rng: np.random.Generator) -> Parts:
    frame, look = chair_frame(rng), _frame_look(rng)
    number = count(rng, 3, 8)
    wide = draw(rng, 0.012, 0.6 * frame.rear / number)
    return [_wooden(rng, frame, look), upright_slats(rng, frame, look, number, wide)]


@family("chair", "splat back")
def _splat_back(rng: np.random.Generator) -> Parts:
    frame = chair_frame(rng, back=draw(rng, 0.45, 0.62))
    look = _frame_look(rng)
    wide = draw(rng, 0.1, 0.2)
    shapes = ((1.0, 0.6, 0.5, 1.0, 1.3, 1.1), (0.7, 0.7, 0.75, 0.8), (0.9, 0.45, 0.9, 1.2, 0.7), (0.5, 1.1, 1.3, 0.6))
    widths = [wide * share for share in pick(rng, shapes)]
    crest = draw(rng, 0.05, 0.09)
    arch = draw(rng, 0.02, 0.06)
    z = frame.top - crest - arch / 2
    rail = bent_rail((frame.back_x(z), 0.0, z), frame.rear + draw(rng, 0.0, 0.08), crest, 0.025, 0.01, look, arch)
    seat = pick(rng, ("padded", "padded", "board"))
    return [_wooden(rng, frame, look, seat), splat(frame, frame.seat - 0.01, z + 0.02, widths, look), rail]


@family("chair", "solid back")
def _solid_back(rng: np.random.Generator) -> Parts:
    frame, look = chair_frame(rng), _frame_look(rng)
    low = frame.seat + draw(rng, 0.02, 0.2)
    x = frame.back_x((low + frame.top) / 2)
    lean = float(np.arctan2(frame.rake, frame.top - frame.seat))
    thick = draw(rng, 0.02, 0.07)
    padded = chance(rng, 0.6)
    cover = covering(rng, 0.4) if padded else look
    wide, tall = frame.rear * draw(rng, 0.86, 1.04), frame.top - low
    if padded:
        board = rounded_box((-thick / 2, -wide / 2, 0.0), (thick / 2, wide / 2, tall), 0.02, cover, 2)
    else:
        board = bent_rail((0.0, 0.0, 0.0), wide, tall, min(thick, 0.025), draw(rng, 0.0, 0.05), cover)
    back = board.tilted("y", -lean).moved(x + 0.5 * tall * float(np.sin(lean)), 0.0, low)
    return [_wooden(rng, frame, look, "padded" if padded else ""), back]


@family("chair", "windsor")
def _windsor(rng: np.random.Generator) -> Parts:
    frame = chair_frame(rng, back=draw(rng, 0.42, 0.68))
    look = _frame_look(rng)
    thick, splay = draw(rng, 0.03, 0.05), draw(rng, 0.03, 0.07)
    style = named_leg(pick(rng, ("turned", "bulged", "baluster", "tapered")), 8, draw(rng, 0.028, 0.042))
    seat = prism(seat_outline(frame, draw(rng, 0.1, 0.2)), frame.seat - thick, thick, look)
    under = frame.seat - thick
    x, y = frame.depth / 2 - 0.06, frame.rear / 2 - 0.06
    corners = [(sx, sy) for sx in (1, -1) for sy in (1, -1)]
    feet = [((sx * (x + splay), sy * (y + splay), 0.0), (sx * x, sy * y, under)) for sx, sy in corners]
    yield from (seat, *(leg(foot, top, style, look) for foot, top in feet))
    low = draw(rng, 0.14, 0.2)
    out = splay * (1 - low / under)
    yield stretchers(rng, 2 * (x + out), 2 * (y + out), low, 0.018, look)
    # The back stands a little within the edge of the seat, whose corners are round.
    back, wide = replace(frame, depth=frame.depth - 0.08), frame.rear * 0.86
    number = count(rng, 5, 9)
    if chance(rng, 0.55):
        power = draw(rng, 2.0, 3.2)
        yield hoop(back, back.seat - 0.01, wide, 0.012, look, power)
        shares = np.linspace(-0.8, 0.8, number)
        tops = (1 - np.abs(shares) ** power) ** (1 / power)
        ends = [back.seat + float(t) * (back.top - 0.02 - back.seat) for t in tops]
    else:
        crest = draw(rng, 0.05, 0.1)
        place = (back.back_x(back.top - crest), 0.0, back.top - crest)
        yield bent_rail(place, frame.rear * 1.04, crest, 0.02, draw(rng, 0.0, 0.05), look, draw(rng, 0.0, 0.03))
        shares, ends = np.linspace(-0.95, 0.95, number), [back.top - crest + 0.01] * number
    for share, end in zip(shares.tolist(), ends, strict=True):
        side, foot = share * wide / 2, (back.back_x(0.0), share * wide * 0.43, back.seat - 0.01)
        yield tube([foot, (back.back_x(end), side, end)], 0.007, look, 4)


@family("chair", "cross back", held_out=True)
def _cross_back(rng: np.random.Generator) -> Parts:
    frame, look = chair_frame(rng, back=draw(rng, 0.4, 0.5)), _frame_look(rng)
    low, top = frame.seat + draw(rng, 0.04, 0.1), frame.top - 0.04
    y = frame.rear / 2 - 0.04
    xl, xt = frame.back_x(low), frame.back_x(top)
    bars = [strut((xl, s * y, low), (xt, -s * y, top), 0.014, draw(rng, 0.02, 0.04), look) for s in (1, -1)]
    rail = bent_rail((frame.back_x(top), 0.0, top - 0.02), frame.rear, 0.06, 0.022, 0.0, look, draw(rng, 0.0, 0.05))
    return [_wooden(rng, frame, look), *bars, rail]


@family("chair", "bentwood")
def _bentwood(rng: np.random.Generator) -> Parts:
    wide = draw(rng, 0.38, 0.44)
    seat, top = draw(rng, 0.44, 0.48), draw(rng, 0.83, 0.95)
    # The rods pass the round seat where it is narrower than at its middle.
    frame = ChairFrame(wide * 0.66, wide, wide * 0.82, seat, top, draw(rng, 0.06, 0.13), 0.05)
    look = made_of(rng, "wood", "wood", "black", "painted")
    rod, z = draw(rng, 0.011, 0.016), seat - 0.03
    cover = covering(rng) if chance(rng, 0.4) else look
    yield cylinder(0.0, 0.0, z, wide / 2, 0.022, look, 16)
    yield cylinder(0.0, 0.0, z + 0.02, wide * 0.46, 0.012, cover, 16)
    yield hoop(frame, z, frame.rear, rod, look, draw(rng, 1.9, 2.6))
    within = replace(frame, top=seat + (top - seat) * draw(rng, 0.7, 0.9), rake=frame.rake * 0.8)
    yield hoop(within, z, frame.rear * draw(rng, 0.45, 0.75), rod * 0.8, look)
    splay, style = draw(rng, 0.02, 0.05), named_leg(pick(rng, ("slim", "tapered")), 8, rod * 2.4)
    for s in (1, -1):
        x, y = wide * 0.36, s * wide * 0.36
        yield leg((x + splay, y + s * splay, 0.0), (x, y, z), style, look)
        rear = (frame.back_x(0.0), s * frame.rear / 2, z)
        yield leg((rear[0] - splay - 0.04, rear[1] + s * 0.01, 0.0), rear, named_leg("slim", 8, rod * 2.6), look)
    ring = [(wide * 0.38 * float(np.cos(a)), wide * 0.38 * float(np.sin(a)), 0.24) for a in np.linspace(0, 6.283, 13)]
    yield tube(ring, rod * 0.6, look, 4)


@family("chair", "scandinavian")
def _scandinavian(rng: np.random.Generator) -> Parts:
    frame = chair_frame(rng, back=draw(rng, 0.27, 0.36))
    look = material("wood", rng)
    yield seat_board(rng, frame, look, pick(rng, ("padded", "board")))
    style = named_leg(pick(rng, ("tapered", "bulged", "slim")), 8, draw(rng, 0.03, 0.042))
    splay = draw(rng, 0.02, 0.06)
    y, reach = frame.front / 2 + 0.01, draw(rng, -0.1, 0.12)
    x_front, x_back = frame.depth / 2 - 0.05, -frame.depth / 2 + 0.04
    arms = reach > 0.04
    for s in (1, -1):
        front_top = (x_front, s * (y if arms else y - 0.04), frame.top - 0.05 if arms else frame.seat - 0.02)
        yield leg((x_front + splay, s * (y - 0.04 + splay), 0.0), front_top, style, look)
        top = (x_back - 0.03, s * (y - 0.02), frame.top - 0.03)
        yield leg((x_back - splay, s * (y - 0.04 + splay), 0.0), top, style, look)
    tall, lean = draw(rng, 0.04, 0.12), draw(rng, 0.0, 0.12)
    path = []
    for a in np.linspace(-np.pi / 2, np.pi / 2, 9):
        c, s = float(np.cos(a)), float(np.sin(a))
        path.append((x_back - 0.02 - (0.06 + lean) * c, y * s, frame.top - tall / 2))
    ends = [(x_front, s * y, frame.top - 0.06 if arms else frame.top - tall / 2) for s in (-1, 1)]
    path = [ends[0], *path, ends[1]] if arms else path
    flat = tube([(p[0], p[1], 0.0) for p in path], 0.016, look, 6)
    yield flat.scaled(1.0, 1.0, tall / 0.032).moved(z=frame.top - tall / 2)
    z = frame.seat - 0.045
    sides = [((x_back - 0.02, s * (y - 0.035), z), (x_front, s * (y - 0.035), z)) for s in (1, -1)]
    ends = [((x, -y + 0.04, z), (x, y - 0.04, z)) for x in (x_back, x_front - 0.01)]
    yield from (strut(start, end, 0.02, 0.04, look) for start, end in (*sides, *ends))


def _swivel(rng: np.random.Generator, seat: float) -> list[Mesh]:
    look = made_of(rng, "black", "black", "metal", "white")
    return [star_base(5, draw(rng, 0.27, 0.34), seat - 0.08, look, draw(rng, 0.022, 0.032), True),
            slab(0.0, 0.0, seat - 0.1, 0.2, 0.16, 0.05, material("black", rng))]  # fmt: skip


def _arm_rests(rng: np.random.Generator, half: float, seat: float, x: float) -> Meshes:
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
def _task_chair(rng: np.random.Generator) -> Parts:
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
def _executive_chair(rng: np.random.Generator) -> Parts:
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
def _mesh_chair(rng: np.random.Generator) -> Parts:
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
def _gaming_chair(rng: np.random.Generator) -> Parts:
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
