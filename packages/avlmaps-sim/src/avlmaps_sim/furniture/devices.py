"""Printers, loudspeakers, keyboards and telephones."""

import numpy as np

from avlmaps_sim.furniture.catalogue import Parts, family
from avlmaps_sim.furniture.electronics import face_up, key_field, screen
from avlmaps_sim.furniture.fittings import body, chrome, face, feet, outline, spindle
from avlmaps_sim.furniture.recipe_helpers import chance, cloth, count, draw, made_of, pick, pictured, strut
from avlmaps_sim.materials import material
from avlmaps_sim.mesh import Material, Mesh, joined
from avlmaps_sim.shapes import along_y, box, cylinder, ellipsoid, lathe, rounded_box, sheet, shell, slab, tube


def _shell_look(rng: np.random.Generator) -> Material:
    kind = pick(rng, ("black", "white", "grey", "beige"))
    if kind in ("black", "white"):
        return material(kind, rng)
    return material("plastic", rng, (0.6, 0.6, 0.62) if kind == "grey" else (0.85, 0.82, 0.74))


@family("printer", "flat ink jet")
def _ink_jet(rng: np.random.Generator) -> Parts:
    wide, deep, high, look = draw(rng, 0.38, 0.48), draw(rng, 0.28, 0.38), draw(rng, 0.12, 0.2), _shell_look(rng)
    half, lid, dark = wide / 2, _shell_look(rng), material("black", rng)
    yield body(rng, (0.0, -half, 0.0), (deep, half, high - 0.035), look, 0.012)
    yield body(rng, (0.0, -half, high - 0.033), (deep * 0.88, half, high), lid, 0.008)
    yield box((deep - 0.02, -half * 0.65, 0.05), (deep + 0.002, half * 0.65, 0.09), dark)
    yield sheet((deep * 0.9, -half * 0.9, high - 0.034), (0.0, wide * 0.3, 0.0), (0.025, 0.0, -0.012), dark)
    if chance(rng, 0.6):
        out = draw(rng, 0.08, 0.16)
        yield slab(deep + out / 2, 0.0, 0.03, out, half, 0.008, look)
        yield slab(deep + out * 0.4, 0.0, 0.039, out * 0.9, half * 0.85, 0.004, material("paper", rng))
    if chance(rng, 0.5):
        back = sheet((-0.02, -half * 0.5, high - 0.03), (0.0, half, 0.0), (-0.09, 0.0, 0.16), look)
        yield back
        yield sheet((-0.01, -half * 0.42, high - 0.03), (0.0, half * 0.84, 0.0), (-0.1, 0.0, 0.22),
                    material("paper", rng))  # fmt: skip


@family("printer", "laser box")
def _laser(rng: np.random.Generator) -> Parts:
    wide, deep, high, look = draw(rng, 0.36, 0.46), draw(rng, 0.34, 0.46), draw(rng, 0.22, 0.42), _shell_look(rng)
    half, dark = wide / 2, material("black", rng)
    yield body(rng, (0.0, -half, 0.0), (deep, half, high), look, draw(rng, 0.008, 0.03))
    yield face_up((deep * 0.3, -half * 0.7), (deep * 0.9, half * 0.7), high + 0.001, dark)
    yield sheet((deep * 0.35, -half * 0.68, high + 0.003), (0.0, 1.36 * half, 0.0), (deep * 0.5, 0.0, -0.001),
                material("paper", rng) if chance(rng, 0.4) else dark)  # fmt: skip
    yield box((deep - 0.002, -half * 0.95, 0.02), (deep + 0.008, half * 0.95, 0.09), look if chance(rng, 0.5) else dark)
    yield box((deep, -0.06, 0.06), (deep + 0.012, 0.06, 0.075), dark)
    yield box((deep - 0.004, -half * 0.9, high * 0.55), (deep + 0.001, half * 0.9, high * 0.56), dark)
    if chance(rng, 0.5):
        yield face(deep + 0.002, (half * 0.4, high * 0.65), (half * 0.9, high * 0.85), screen(rng))


@family("printer", "office copier")
def _copier(rng: np.random.Generator) -> Parts:
    wide, deep, high = draw(rng, 0.55, 0.75), draw(rng, 0.55, 0.7), draw(rng, 0.95, 1.2)
    look, tray_look, dark, half = _shell_look(rng), _shell_look(rng), material("black", rng), wide / 2
    trays = count(rng, 2, 4)
    base = high * 0.55
    gap = draw(rng, 0.12, 0.18)
    yield box((0.0, -half, 0.06), (deep - 0.05, half, base), look)
    yield box((0.0, -half, base), (0.16, half, base + gap), look)
    yield box((0.0, half * 0.55, base), (deep * 0.9, half, base + gap), look)
    yield box((0.0, -half, base + gap), (deep * 0.95, half, high - 0.1), look)
    yield rounded_box((0.0, -half, high - 0.1), (deep * 0.93, half, high), 0.02, look, 2)
    yield slab(deep * 0.45, -half * 0.25, base, deep * 0.6, wide * 0.6, 0.01, dark)
    yield from feet((0.0, -half), (deep - 0.05, half), 0.06, dark, 0.05)
    step = (base - 0.1) / trays
    for i in range(trays):
        z = 0.08 + i * step
        yield box((deep - 0.05, -half + 0.01, z), (deep - 0.02, half - 0.01, z + step - 0.012), tray_look)
        yield box((deep - 0.021, -0.09, z + step * 0.6), (deep - 0.015, 0.09, z + step * 0.8), dark)
    yield sheet((deep * 0.9, half * 0.1, high - 0.13), (0.0, half * 0.75, 0.0), (0.1, 0.0, 0.05), screen(rng))
    if chance(rng, 0.6):
        yield strut((deep * 0.45, -half + 0.02, base + gap * 0.4), (deep * 0.45, -half - 0.28, base + gap * 0.8), 0.32,
                    0.012, tray_look)  # fmt: skip


@family("printer", "with needles and endless paper", held_out=True)
def _needles(rng: np.random.Generator) -> Parts:
    wide, deep, high = draw(rng, 0.36, 0.56), draw(rng, 0.28, 0.36), draw(rng, 0.11, 0.16)
    look, half = material("plastic", rng, (0.84, 0.81, 0.73)), wide / 2
    side = np.array([(0.0, 0.0), (deep, 0.0), (deep, high * 0.5), (deep * 0.6, high), (0.0, high)])
    paper = material("paper", rng)
    y = np.array([-half * 0.75, half * 0.75])
    run = [(-0.05, 0.01), (-0.03, high), (deep * 0.35, high + 0.03), (deep * 0.2, high + 0.16), (-0.05, high + 0.2),
           (-0.1, high + 0.1)]  # fmt: skip
    return [
        along_y(side, -half, half, look),
        cloth(np.stack([np.column_stack([np.full(2, x), y, np.full(2, z)]) for x, z in run]), paper),
        spindle([(0.022, 0.0), (0.02, 0.02)], material("black", rng), 0.0, 0.0, 12)
        .turned(np.pi / 2)
        .moved(deep * 0.4, half, high * 0.75),
        slab(deep * 0.4, 0.0, high * 0.98, 0.07, wide * 0.9, 0.006, material("black", rng)),
    ]


def _cone(x: float, y: float, z: float, radius: float, ring: Material, dark: Material) -> list[Mesh]:
    return [spindle([(radius, x), (radius * 0.98, x + 0.006), (radius * 0.85, x + 0.004),
                     (radius * 0.4, x - 0.012 if radius < 0.02 else x + 0.001)], ring, y, z, 16, capped=False),
            spindle([(radius * 0.85, x + 0.0035), (radius * 0.35, x + 0.0015), (radius * 0.2, x + 0.008)], dark, y, z,
                    16)]  # fmt: skip


def _box_speaker(rng: np.random.Generator, wide: float, deep: float, z: tuple[float, float], drivers: int,
                 look: Material) -> list[Mesh]:  # fmt: skip
    half, (low, high) = wide / 2, z
    dark, ring = material("black", rng), made_of(rng, "black", "black", "metal", "plastic")
    parts = [body(rng, (0.0, -half, low), (deep, half, high), look, draw(rng, 0.003, 0.012))]
    if chance(rng, 0.25):
        parts.append(rounded_box((deep - 0.002, -half * 0.95, low + 0.01), (deep + 0.012, half * 0.95, high - 0.01),
                                 0.004, material("fabric", rng, (g := draw(rng, 0.08, 0.35), g, g)), 2))  # fmt: skip
        return parts
    tweeter = half * draw(rng, 0.25, 0.4)
    parts += _cone(deep, 0.0, high - tweeter * 1.6, tweeter, ring, dark)
    place = high - tweeter * 3.0
    for _ in range(drivers):
        radius = min(half * draw(rng, 0.72, 0.9), (place - low) * 0.45)
        if radius < 0.02:
            break
        parts += _cone(deep, 0.0, place - radius, radius, ring, dark)
        place -= 2.15 * radius
    if place - low > 0.05:
        parts.append(spindle([(0.025, deep + 0.001), (0.02, deep - 0.0)], dark, 0.0, low + 0.03, 10))
    return parts


def _speaker_look(rng: np.random.Generator) -> Material:
    return made_of(rng, "wood", "wood", "black", "black", "white")


@family("loudspeaker", "floor standing")
def _floor_speaker(rng: np.random.Generator) -> Parts:
    wide, deep, high, look = draw(rng, 0.16, 0.32), draw(rng, 0.22, 0.42), draw(rng, 0.75, 1.25), _speaker_look(rng)
    yield from _box_speaker(rng, wide, deep, (0.025, high), count(rng, 1, 4), look)
    yield slab(deep / 2, 0.0, 0.0, deep * 1.05, wide * draw(rng, 0.95, 1.25), 0.025, material("black", rng))


@family("loudspeaker", "shelf box")
def _shelf_speaker(rng: np.random.Generator) -> Parts:
    wide = draw(rng, 0.1, 0.24)
    return _box_speaker(rng, wide, wide * draw(rng, 0.9, 1.5), (0.0, wide * draw(rng, 1.35, 1.9)), count(rng, 1, 2),
                        _speaker_look(rng))  # fmt: skip


@family("loudspeaker", "on a stand")
def _on_stand(rng: np.random.Generator) -> Parts:
    wide, lift = draw(rng, 0.15, 0.36), draw(rng, 0.5, 1.1)
    deep, tall, metal = wide * draw(rng, 0.9, 1.4), wide * draw(rng, 1.35, 1.8), material("black", rng)
    yield from _box_speaker(rng, wide, deep, (lift, lift + tall), count(rng, 1, 2), _speaker_look(rng))
    if chance(rng, 0.5):
        yield cylinder(deep / 2, 0.0, 0.3, 0.018, lift - 0.3, metal, 8)
        yield from [strut((deep / 2, 0.0, 0.45), (deep / 2 + 0.35 * float(np.cos(a)), 0.35 * float(np.sin(a)), 0.01),
                          0.025, 0.025, metal) for a in (0.0, 2.09, 4.19)]  # fmt: skip
        yield cylinder(deep / 2, 0.0, 0.28, 0.025, 0.2, metal, 8)
    else:
        yield slab(deep / 2, 0.0, 0.0, deep, wide * 1.1, 0.02, metal)
        yield slab(deep / 2, 0.0, lift - 0.012, deep * 0.8, wide * 0.9, 0.012, metal)
        yield slab(deep / 2, 0.0, 0.02, 0.06, draw(rng, 0.04, 0.12), lift - 0.03, metal)


@family("loudspeaker", "smart cylinder")
def _smart(rng: np.random.Generator) -> Parts:
    radius, high = draw(rng, 0.04, 0.09), draw(rng, 0.05, 0.25)
    look = material("fabric", rng, (g := pick(rng, (0.15, 0.3, 0.6, 0.85)), g, g))
    bulge = draw(rng, 0.85, 1.15)
    return [lathe([(radius * 0.9, 0.0), (radius * bulge, high * 0.15), (radius * bulge, high * 0.85),
                   (radius * 0.9, high)], look, sides=20),
            lathe([(radius * 0.85, high), (radius * 0.8, high + 0.004)], material("black", rng), sides=20)]  # fmt: skip


@family("loudspeaker", "sound bar")
def _sound_bar(rng: np.random.Generator) -> Parts:
    wide, deep, high = draw(rng, 0.55, 1.2), draw(rng, 0.06, 0.13), draw(rng, 0.05, 0.11)
    look = made_of(rng, "black", "black", "metal", "white")
    grille = material("fabric", rng, (g := draw(rng, 0.08, 0.4), g, g))
    return [rounded_box((0.0, -wide / 2, 0.0), (deep, wide / 2, high), draw(rng, 0.005, 0.03), look, 3),
            face(deep + 0.001, (-wide / 2 + 0.03, 0.012), (wide / 2 - 0.03, high - 0.012), grille)]  # fmt: skip


@family("loudspeaker", "radio", held_out=True)
def _radio(rng: np.random.Generator) -> Parts:
    wide, deep, high = draw(rng, 0.2, 0.5), draw(rng, 0.1, 0.2), draw(rng, 0.12, 0.26)
    look, dark, half = made_of(rng, "wood", "plastic", "painted", "black"), material("black", rng), wide / 2
    yield rounded_box((0.0, -half, 0.01), (deep, half, high), draw(rng, 0.006, 0.04), look, 3)
    yield from feet((0.0, -half), (deep, half), 0.012, dark, 0.02)
    if chance(rng, 0.5):
        for s in (-1, 1):
            yield from _cone(deep, s * half * 0.62, high * 0.45, min(0.4 * high, 0.3 * half), dark, dark)
        yield face(deep + 0.001, (-half * 0.25, high * 0.5), (half * 0.25, high * 0.85), material("metal", rng))
    else:
        yield face(deep + 0.001, (-half * 0.9, 0.03), (half * 0.1, high - 0.03), material("fabric", rng))
        yield face(deep + 0.001, (half * 0.2, high * 0.55), (half * 0.9, high * 0.85), material("paper", rng))
        for f in (0.35, 0.75):
            yield spindle([(0.016, deep), (0.014, deep + 0.015)], chrome(rng), half * f, high * 0.3, 10)
    if chance(rng, 0.6):
        yield tube([(deep / 2, -half * 0.8, high), (deep / 2, -half * 0.8, high + 0.05),
                    (deep / 2, half * 0.8, high + 0.05), (deep / 2, half * 0.8, high)], 0.007, look, 5)  # fmt: skip
    if chance(rng, 0.5):
        yield tube([(0.02, half * 0.8, high), (0.0, half * draw(rng, 0.9, 1.3), high + draw(rng, 0.15, 0.35))], 0.003,
                   chrome(rng), 4)  # fmt: skip


@family("loudspeaker", "low cube", held_out=True)
def _subwoofer(rng: np.random.Generator) -> Parts:
    size, look, dark = draw(rng, 0.24, 0.42), _speaker_look(rng), material("black", rng)
    parts = [rounded_box((0.0, -size / 2, 0.03), (size * draw(rng, 0.9, 1.15), size / 2, size), 0.012, look, 2),
             *feet((0.0, -size / 2), (size * 0.9, size / 2), 0.03, dark)]  # fmt: skip
    parts += _cone(float(parts[0].high[0]), 0.0, size / 2 + 0.015, size * 0.4, dark,
                   made_of(rng, "black", "metal", "painted"))  # fmt: skip
    return parts


def _key_look(rng: np.random.Generator) -> tuple[Material, Material]:
    case = material("plastic", rng,
                    pick(rng, ((0.08, 0.08, 0.08), (0.85, 0.83, 0.76), (0.9, 0.9, 0.9), (0.3, 0.3, 0.32))))  # fmt: skip
    return case, case if chance(rng, 0.4) else material("plastic", rng, (g := pick(rng, (0.1, 0.92, 0.6)), g, g))


def _slanted(rng: np.random.Generator, parts: list[Mesh]) -> Parts:
    return [joined(parts).tilted("y", draw(rng, 0.02, 0.1))]


@family("keyboard", "full size")
def _full_keyboard(rng: np.random.Generator) -> Parts:
    wide, deep, thick = draw(rng, 0.42, 0.47), draw(rng, 0.13, 0.19), draw(rng, 0.012, 0.03)
    case, keys = _key_look(rng)
    half, rise = wide / 2, draw(rng, 0.003, 0.009)
    parts = [rounded_box((-deep / 2, -half, 0.0), (deep / 2, half, thick), min(0.008, 0.4 * thick), case, 2)]
    low, high = -deep / 2 + 0.012, deep / 2 - draw(rng, 0.01, 0.05)
    main = -half + 0.012 + wide * 0.66
    parts += key_field(rng, (low, -half + 0.012), (high, main), thick, 5, 15, keys, rise)
    parts += key_field(rng, (low, main + 0.008), (high, main + 0.008 + wide * 0.12), thick, 5, 3, keys, rise)
    parts += key_field(rng, (low, main + 0.016 + wide * 0.12), (high, half - 0.01), thick, 5, 4, keys, rise)
    return _slanted(rng, parts)


@family("keyboard", "small flat")
def _small_keyboard(rng: np.random.Generator) -> Parts:
    wide, deep, thick = draw(rng, 0.27, 0.32), draw(rng, 0.1, 0.13), draw(rng, 0.007, 0.016)
    case = made_of(rng, "metal", "white", "black")
    keys = made_of(rng, "white", "black")
    low, high = (-deep / 2 + 0.005, -wide / 2 + 0.006), (deep / 2 - 0.005, wide / 2 - 0.006)
    parts = [rounded_box((-deep / 2, -wide / 2, 0.0), (deep / 2, wide / 2, thick), 0.003, case, 2)]
    if chance(rng, 0.5):
        parts.append(face_up(low, high, thick + 0.0008, pictured("keyboard", rng, "black"), fill=True))
    else:
        parts += key_field(rng, low, high, thick, 5, 14, keys, 0.0025)
    return _slanted(rng, parts)


@family("keyboard", "split in two", held_out=True)
def _split_keyboard(rng: np.random.Generator) -> Parts:
    case, keys = _key_look(rng)
    wide, deep, thick, turn = draw(rng, 0.15, 0.2), draw(rng, 0.12, 0.16), draw(rng, 0.015, 0.03), draw(rng, 0.08, 0.35)
    parts = []
    for s in (-1, 1):
        half = joined([rounded_box((-deep / 2, -wide / 2, 0.0), (deep / 2, wide / 2, thick), 0.008, case, 2),
                       *key_field(rng, (-deep / 2 + 0.01, -wide / 2 + 0.01), (deep / 2 - 0.015, wide / 2 - 0.01), thick,
                                  5, 7, keys, 0.006)])  # fmt: skip
        parts.append(half.turned(s * turn).moved(y=s * (wide * 0.55 + 0.02)))
    return _slanted(rng, parts)


@family("telephone", "desk with handset")
def _desk_phone(rng: np.random.Generator) -> Parts:
    wide, deep, look, dark = draw(rng, 0.17, 0.24), draw(rng, 0.17, 0.23), _shell_look(rng), material("black", rng)
    half, back, low = wide / 2, draw(rng, 0.05, 0.1), draw(rng, 0.02, 0.035)
    side = np.array([(0.0, 0.0), (deep, 0.0), (deep, low), (0.0, back)])
    yield along_y(side, -half, half, look)
    lean = float(np.arctan2(back - low, deep))
    top = [face_up((deep * 0.45, -half * 0.05), (deep * 0.92, half * 0.85), 0.001, dark),
           *key_field(rng, (deep * 0.47, 0.0), (deep * 0.9, half * 0.8), 0.001, 4, 3, material("white", rng), 0.004,
                      bar=False),
           face_up((deep * 0.1, -half * 0.05), (deep * 0.36, half * 0.85), 0.002, screen(rng, 0.4))]  # fmt: skip
    handset = [rounded_box((deep * 0.03, -half * 0.85, 0.025), (deep * 0.97, -half * 0.35, 0.045), 0.01, look, 2),
               *[rounded_box((x, -half * 0.9, 0.0), (x + 0.055, -half * 0.3, 0.035), 0.012, look, 2)
                 for x in (deep * 0.02, deep * 0.98 - 0.055)]]  # fmt: skip
    yield joined([*top, *handset]).tilted("y", lean).moved(z=back)
    yield tube([(deep * 0.9, -half * 0.7, low), (deep * 0.95, -half - 0.03, 0.006), (deep * 0.5, -half - 0.05, 0.006),
                (0.05, -half, 0.01)], 0.004, dark, 4)  # fmt: skip


@family("telephone", "rotary", held_out=True)
def _rotary(rng: np.random.Generator) -> Parts:
    look = material(
        "plastic", rng, pick(rng, ((0.06, 0.06, 0.06), (0.9, 0.87, 0.78), (0.6, 0.1, 0.08), (0.35, 0.45, 0.35)))
    )
    deep, wide, high, metal = draw(rng, 0.17, 0.2), draw(rng, 0.16, 0.2), draw(rng, 0.1, 0.13), chrome(rng)
    rings = [(outline(deep, wide, 5.0, 16, middle=(deep / 2, 0.0)), 0.0),
             (outline(deep * 0.95, wide * 0.95, 4.0, 16, middle=(deep * 0.47, 0.0)), 0.02),
             (outline(deep * 0.4, wide * 0.6, 4.0, 16, middle=(deep * 0.26, 0.0)), high)]  # fmt: skip
    tilt = 0.85
    disc = joined([spindle([(0.045, 0.0), (0.043, 0.006)], metal, 0.0, 0.0, 18),
                   spindle([(0.016, 0.006), (0.015, 0.009)], material("paper", rng), 0.0, 0.0, 10),
                   *[spindle([(0.006, 0.0065), (0.005, 0.007)], material("white", rng), 0.034 * float(np.cos(a)),
                             0.034 * float(np.sin(a)), 6) for a in np.linspace(0.6, 5.8, 10)]])  # fmt: skip
    return [shell(rings, look), disc.tilted("y", -tilt).moved(deep * 0.7, 0.0, high * 0.55),
            *[slab(deep * 0.26, s * wide * 0.24, high, 0.04, 0.015, 0.02, look) for s in (-1, 1)],
            tube([(deep * 0.26, -wide * 0.5, high + 0.035), (deep * 0.26, 0.0, high + 0.045),
                  (deep * 0.26, wide * 0.5, high + 0.035)], 0.014, look, 7),
            *[ellipsoid((deep * 0.26, s * wide * 0.56, high + 0.022), (0.03, 0.03, 0.022), look, 10, 5)
              for s in (-1, 1)]]  # fmt: skip


@family("telephone", "cordless in its base")
def _cordless(rng: np.random.Generator) -> Parts:
    look, dark = _shell_look(rng), material("black", rng)
    high, wide = draw(rng, 0.14, 0.18), draw(rng, 0.045, 0.055)
    handset = joined([rounded_box((0.0, -wide / 2, 0.0), (0.025, wide / 2, high), 0.011, look, 3),
                      face(0.026, (-wide * 0.35, high * 0.6), (wide * 0.35, high * 0.82), screen(rng, 0.5)),
                      *[face(0.0262, (wide * (k - 1) * 0.26 - 0.005, high * (0.14 + 0.1 * r)),
                             (wide * (k - 1) * 0.26 + 0.005, high * (0.19 + 0.1 * r)), dark) for r in range(4)
                        for k in range(3)]])  # fmt: skip
    return [handset.tilted("y", -draw(rng, 0.05, 0.4)).moved(x=0.02, z=0.02),
            rounded_box((-0.04, -wide, 0.0), (0.06, wide, draw(rng, 0.025, 0.05)), 0.012, look, 3)]  # fmt: skip


@family("telephone", "mobile")
def _mobile(rng: np.random.Generator) -> Parts:
    high, wide, thick = draw(rng, 0.13, 0.17), draw(rng, 0.063, 0.08), draw(rng, 0.007, 0.011)
    look = made_of(rng, "black", "metal", "white", "plastic")
    flat = joined([rounded_box((-high / 2, -wide / 2, 0.0), (high / 2, wide / 2, thick), 0.003, look, 2),
                   face_up((-high / 2 + 0.005, -wide / 2 + 0.004), (high / 2 - 0.005, wide / 2 - 0.004), thick + 0.0006,
                           screen(rng, 0.5), fill=True)])  # fmt: skip
    return [flat.turned(draw(rng, 0.0, 6.28))]
