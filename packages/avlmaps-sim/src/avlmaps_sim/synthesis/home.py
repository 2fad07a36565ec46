"""Sounds of the home: doors, kitchens, machines, bells."""

import numpy as np

from avlmaps_sim.synthesis.blocks import (
    RATE_HZ,
    SECONDS,
    Pieces,
    Rng,
    at_random,
    band,
    between,
    click,
    glide,
    jittered,
    makes,
    noise,
    place,
    regular,
    resonant,
    ringing,
    struck,
    swell,
    times,
    tone,
    wander,
)


@makes("door knock")
def door_knock(rng: Rng) -> Pieces:
    """Two to six knuckle blows on a panel, perhaps twice."""
    low, period = between(rng, 70, 220), between(rng, 0.12, 0.3)
    body = [(f * low, jittered(rng, 0.03, 0.3), g) for f, g in ((1.0, 1.0), (1.7, 0.7), (2.6, 0.5), (4.1, 0.3))]
    start = rng.uniform(0.1, 1.5)
    for _ in range(rng.integers(1, 4)):
        for k in range(rng.integers(2, 7)):
            hz, decay, gain = zip(*body, strict=True)
            blow = ringing(hz, decay, gain, 0.3) + 0.5 * click(rng, 0.004, 500, 4000, 0.3)
            yield (start + k * jittered(rng, period, 0.05), rng.uniform(0.6, 1.0) * blow)
        start += 6 * period + rng.uniform(0.4, 1.2)


@makes("door opening or closing")
def door_closing(rng: Rng) -> Pieces:
    """A latch, then a thud of the leaf in its frame, or the other way round."""
    thud = struck(rng, 50, 400, 12, between(rng, 0.04, 0.15), 1.0) + click(rng, 0.03, 60, 1500, 1.0) * 2
    latch = [(0.02 * k, rng.uniform(0.2, 0.6) * click(rng, 0.004, 1200, 7000)) for k in range(rng.integers(1, 4))]
    scrape = band(noise(rng, 0.5), 300, 3000) * swell(0.5, 0.2, 0.2) * rng.uniform(0.0, 0.15)
    start = rng.uniform(0.1, 2.0)
    for _ in range(rng.integers(1, 3)):
        yield from ((start, scrape), (start + 0.4, thud * 0.4))
        yield from [(start + 0.35 + rng.uniform(0.0, 0.15) + onset, sound) for onset, sound in latch]
        start += rng.uniform(1.0, 2.5)


@makes("creaking door")
def door_creak(rng: Rng) -> Pieces:
    """Stick and slip: pulses of a rate that moves, through a few woody resonances."""
    for onset in regular(rng, between(rng, 1.2, 3.0), 0.2):
        seconds = rng.uniform(0.6, 2.0)
        rate = glide(seconds, *(between(rng, 25, 240) for _ in range(4)))
        pulses = (np.diff(np.floor(np.cumsum(rate) / RATE_HZ), prepend=0) > 0) * rng.uniform(0.5, 1.0, len(rate))
        peaks = [(between(rng, 400, 3500), between(rng, 60, 250), rng.uniform(0.3, 1.0)) for _ in range(5)]
        yield onset, resonant(pulses, peaks) * swell(seconds, 0.1, 0.3)


@makes("glass breaking")
def glass_breaking(rng: Rng) -> Pieces:
    """A bang, then a shower of ringing shards."""
    start = rng.uniform(0.1, 2.0)
    yield from ((start, 4 * click(rng, 0.01, 800, 9000)), (start, 3 * struck(rng, 1500, 9000, 14, 0.03, 0.4)))
    spread = between(rng, 0.1, 0.6)
    for _ in range(rng.integers(12, 60)):
        shard = struck(rng, 2500, 10000, 4, between(rng, 0.01, 0.08), 0.4)
        late = rng.exponential(spread)
        yield (start + late, shard * np.exp(-late) * rng.uniform(0.1, 1.0))


@makes("dishes clattering")
def dishes(rng: Rng) -> Pieces:
    """Plates and cutlery put down, one after another."""
    for onset in at_random(rng, between(rng, 2, 7)):
        hard = struck(rng, between(rng, 900, 2500), 8000, 8, between(rng, 0.03, 0.15), 0.5)
        yield onset, (hard + click(rng, 0.003, 1500, 9000, 0.5)) * rng.uniform(0.2, 1.0)


@makes("can opening")
def can_opening(rng: Rng) -> np.ndarray:
    """A crack of the tab, a hiss that dies away."""
    start = rng.uniform(0.2, 2.5)
    hiss = band(noise(rng, 1.5), 2500, 10000) * np.exp(-times(1.5) / between(rng, 0.06, 0.4))
    crack = struck(rng, 900, 6000, 6, 0.02, 0.2) * 3 + 3 * click(rng, 0.003, 1000, 9000, 0.2)
    return place([(start, crack), (start + 0.02, hiss), (start + rng.uniform(0.15, 0.6), crack * 0.6)])


@makes("vacuum cleaner")
def vacuum_cleaner(rng: Rng) -> np.ndarray:
    """A whine of the motor over broad suction noise, steady or pushed to and fro."""
    hz = between(rng, 180, 700) * (1 + 0.02 * wander(rng, SECONDS, 1.0))
    whine = tone(hz, [1.0, 0.6, 0.5, 0.3, 0.3, 0.15, 0.1, 0.1])
    air = band(noise(rng, SECONDS, rng.uniform(-5, -1)), 150, between(rng, 3000, 9000), 1)
    push = 1 + 0.3 * np.sin(2 * np.pi * rng.uniform(0.3, 0.9) * times(SECONDS)) * rng.uniform(0, 1)
    return (rng.uniform(0.1, 0.5) * whine / whine.std() + air / air.std()) * push


@makes("hair dryer")
def hair_dryer(rng: Rng) -> np.ndarray:
    """A higher, thinner blower."""
    whine = tone(between(rng, 500, 1300) * (1 + 0.004 * wander(rng, SECONDS, 2.0)), [1.0, 0.5, 0.3, 0.1])
    air = band(noise(rng, SECONDS, rng.uniform(-2, 1)), 500, 9000, 1)
    return rng.uniform(0.05, 0.3) * whine / whine.std() + air / air.std()


@makes("fan or air conditioner")
def fan(rng: Rng) -> np.ndarray:
    """A low hum of the mains with soft moving air."""
    mains = tone(np.full(len(times(SECONDS)), rng.choice([50.0, 60.0, 100.0, 120.0])), [1, 0.6, 0.3, 0.2, 0.1])
    blades = 1 + rng.uniform(0, 0.4) * np.sin(2 * np.pi * rng.uniform(1.5, 14) * times(SECONDS))
    air = band(noise(rng, SECONDS, -5.0), 60, between(rng, 600, 2500), 1)
    return rng.uniform(0.1, 0.8) * mains / mains.std() + air / air.std() * blades


@makes("washing machine")
def washing_machine(rng: Rng) -> np.ndarray:
    """A drum that turns: rumble, motor hum and slosh, all at the rate of turning."""
    t = times(SECONDS)
    turn = rng.uniform(0.6, 2.5) if rng.random() < 0.6 else rng.uniform(8, 18)
    phase = 2 * np.pi * turn * t + rng.uniform(0, 6)
    rumble = band(noise(rng, SECONDS, -6.0), 30, 400) * (0.6 + 0.4 * np.sin(phase))
    slosh = band(noise(rng, SECONDS), 400, 4000) * np.clip(np.sin(phase + 1.0), 0, 1) ** 3 * rng.uniform(0.05, 0.4)
    motor = tone(between(rng, 50, 300) * (1 + 0.02 * np.sin(phase)), [1, 0.5, 0.5, 0.3, 0.2, 0.1])
    return rumble / rumble.std() + slosh + rng.uniform(0.1, 0.6) * motor / motor.std()


@makes("blender")
def blender(rng: Rng) -> np.ndarray:
    """A hard, loud motor with bursts of load."""
    load = 1 + 0.12 * wander(rng, SECONDS, 3.0)
    motor = tone(between(rng, 150, 350) * load, [1 / k**0.5 for k in range(1, 25)])
    grit = band(noise(rng), 800, 8000) * (1 + 0.5 * wander(rng, SECONDS, 25.0))
    return motor / motor.std() + rng.uniform(0.3, 1.0) * grit / grit.std()


@makes("electric drill")
def electric_drill(rng: Rng) -> np.ndarray:
    """A motor that winds up, bites and winds down."""
    speed = np.interp(times(SECONDS), [0, 0.6, 3.8, SECONDS], [0.25, 1.0, rng.uniform(0.7, 1.0), 0.2])
    motor = tone(between(rng, 300, 900) * speed, [1, 0.8, 0.7, 0.5, 0.5, 0.3, 0.3, 0.2, 0.2])
    return motor / motor.std() * np.sqrt(speed) + rng.uniform(0.2, 0.6) * band(noise(rng), 1500, 9000) * speed


@makes("alarm clock")
def alarm_clock(rng: Rng) -> np.ndarray:
    """Groups of electronic beeps, or a bell with a hammer."""
    if rng.random() < 0.3:
        hz = between(rng, 1500, 4000)
        hammer = regular(rng, between(rng, 0.04, 0.09), 0.03)
        bell = ringing([hz, hz * 2.4, hz * 1.51], [0.15, 0.06, 0.1], [1, 0.5, 0.6], 0.4)
        return place((onset, bell * rng.uniform(0.7, 1.0)) for onset in hammer)
    hz, count, beep_s = between(rng, 900, 4200), int(rng.integers(1, 5)), between(rng, 0.04, 0.2)
    sound = tone(np.full(len(times(beep_s)), hz), [1, 0, rng.uniform(0, 0.5), 0, rng.uniform(0, 0.3)])
    sound = sound * swell(beep_s, 0.004, 0.004)
    groups = regular(rng, count * 2 * beep_s + between(rng, 0.15, 0.9), 0.0)
    return place((group + 2 * k * beep_s, sound) for group in groups for k in range(count))


@makes("smoke alarm")
def smoke_alarm(rng: Rng) -> np.ndarray:
    """Three loud, long, high beeps and a pause."""
    hz, beep_s = rng.uniform(2800, 3500), rng.uniform(0.35, 0.55)
    sound = tone(np.full(len(times(beep_s)), hz), [1, 0.1, 0.3]) * swell(beep_s, 0.003, 0.003)
    groups = regular(rng, 3 * 2 * beep_s + rng.uniform(0.4, 1.2), 0.0)
    return place((group + 2 * k * beep_s, sound) for group in groups for k in range(3))


@makes("microwave beep")
def microwave_beep(rng: Rng) -> np.ndarray:
    """One to five long plain beeps after a hum that stops."""
    hz, beep_s, start = rng.uniform(900, 2600), rng.uniform(0.25, 0.8), rng.uniform(0.2, 2.0)
    sound = tone(np.full(len(times(beep_s)), hz), [1, 0, 0.15]) * swell(beep_s, 0.006, 0.006)
    hum = tone(np.full(len(times(start)), 100.0), [1, 0.5, 0.3, 0.3]) * 0.15 * rng.uniform(0, 1)
    beeps = [(start + k * 1.6 * beep_s, sound) for k in range(rng.integers(1, 6))]
    return place([(0.0, hum), *beeps])


@makes("doorbell")
def doorbell(rng: Rng) -> np.ndarray:
    """Ding-dong of two bars, a chime of several, or a buzzer."""
    start, kind = rng.uniform(0.1, 1.5), rng.random()
    if kind < 0.2:
        buzz = tone(np.full(len(times(0.9)), rng.choice([50.0, 60.0]) * 2), [1 / k**0.3 for k in range(1, 50)])
        return place([(start, buzz * swell(0.9, 0.01, 0.02)), (start + rng.uniform(1.2, 2.0), buzz)])
    high = between(rng, 500, 1100)
    steps = [1.0, 0.794] if kind < 0.75 else list(rng.choice([1, 0.794, 0.667, 0.595, 0.891], 4, replace=False))
    pieces = []
    for k, step in enumerate(steps):
        hz, decay = high * step, between(rng, 0.4, 1.2)
        bar = ringing([hz, 2.76 * hz, 5.4 * hz], [decay, decay / 3, decay / 8], [1, 0.3, 0.15], 3.0)
        pieces += [(start + k * rng.uniform(0.35, 0.75), bar), (start + k * 0.5, 0.1 * click(rng, 0.003, 1000, 8000))]
    return place(pieces)


@makes("phone ringing")
def phone_ringing(rng: Rng) -> np.ndarray:
    """A bell ringer, a warble of two tones, or a little tune."""
    kind, on_s = rng.random(), rng.uniform(0.6, 1.8)
    t = times(on_s)
    if kind < 0.4:
        hz = between(rng, 900, 1800)
        bells = [ringing([f * hz, 2.6 * f * hz], [0.2, 0.08], [1, 0.5], 0.3) for f in (1.0, 1.26)]
        sound = place(((k * 0.035, bells[k % 2]) for k in range(int(on_s / 0.035))), on_s)
    elif kind < 0.75:
        low, ratio, rate = between(rng, 600, 1900), rng.uniform(1.15, 1.4), rng.uniform(8, 22)
        sound = tone(np.where((t * rate) % 1 < 0.5, low, low * ratio), [1, 0.1, 0.4, 0, 0.2])
    else:
        notes = between(rng, 500, 1200) * 2 ** (rng.choice([0, 2, 4, 5, 7, 9, 12], 40) / 12)
        sound = tone(notes[(t / rng.uniform(0.09, 0.2)).astype(int) % 40], [1, 0.4, 0.2, 0.1])
    return place((onset, sound * swell(on_s, 0.01, 0.02)) for onset in regular(rng, on_s + rng.uniform(0.3, 2.0), 0.0))


@makes("keyboard typing")
def keyboard_typing(rng: Rng) -> Pieces:
    """Many small clicks down and up, with a hollow body, in bursts."""
    low = between(rng, 250, 900)
    for onset in regular(rng, between(rng, 0.09, 0.22), 0.5):
        key = click(rng, 0.003, 1200, 8000, 0.08) + 0.5 * struck(rng, low, 6 * low, 5, 0.012, 0.08)
        gain = rng.uniform(0.3, 1.0)
        yield from ((onset, gain * key), (onset + rng.uniform(0.04, 0.1), 0.4 * gain * click(rng, 0.002, 2000, 9000)))


@makes("mouse click")
def mouse_click(rng: Rng) -> Pieces:
    """Down and up of a small switch, a few times."""
    high = between(rng, 2000, 4500)
    for onset in regular(rng, between(rng, 0.3, 1.6), 0.5):
        for delay, gain in ((0.0, 1.0), (rng.uniform(0.05, 0.14), 0.7)):
            switch = struck(rng, high, 9000, 5, 0.004, 0.05) + click(rng, 0.001, 1500, 10000, 0.05)
            yield (onset + delay, gain * switch)


@makes("footsteps")
def footsteps(rng: Rng) -> Pieces:
    """Heel and toe at a walking pace on wood, stone, metal or gravel."""
    ground, period = rng.integers(4), between(rng, 0.33, 0.75)
    heel, toe = between(rng, 60, 250), rng.uniform(0.06, 0.16)
    for onset in regular(rng, period, 0.06):
        if ground == 3:
            grains = at_random(rng, 250, 0.22)
            step = place(((g, rng.uniform(0.1, 1) * click(rng, 0.003, 900, 9000, 0.03)) for g in grains), 0.3)
            yield onset, step
            continue
        modes, decay, top = ((8, 0.035, 1500), (5, 0.012, 3500), (12, 0.09, 5000))[ground]
        for delay, gain in ((0.0, 1.0), (toe, 0.5)):
            blow = struck(rng, heel, top, modes, decay, 0.4) + 0.7 * click(rng, 0.006, 150, 3500, 0.4)
            yield (onset + delay, gain * rng.uniform(0.7, 1.0) * blow)


@makes("running water")
def running_water(rng: Rng) -> np.ndarray:
    """A tap or a stream: hiss with many small bubbles that rise in pitch."""
    hiss = band(noise(rng, SECONDS, rng.uniform(-4, 0)), between(rng, 200, 900), between(rng, 3000, 9000), 1)
    flow = 1 + 0.15 * wander(rng, SECONDS, 4.0)
    return hiss / hiss.std() * flow + rng.uniform(0.2, 1.2) * bubbles(rng, between(rng, 40, 160), (400, 3000))


def bubbles(rng: Rng, rate_hz: float, pitch: tuple[float, float]) -> np.ndarray:
    """Return many decaying chirps, as bubbles of air make them (van den Doel 2005)."""
    pieces = []
    for onset in at_random(rng, rate_hz):
        seconds = between(rng, 0.01, 0.06)
        hz = between(rng, *pitch) * (1 + rng.uniform(0, 6) * times(seconds))
        pieces.append((onset, rng.exponential(1.0) * tone(hz, [1.0]) * np.exp(-5 * times(seconds) / seconds)))
    return place(pieces)


@makes("water drops")
def water_drops(rng: Rng) -> Pieces:
    """Single drops: a tick and a bubble."""
    for onset in regular(rng, between(rng, 0.2, 1.2), rng.uniform(0.0, 0.4)):
        seconds = between(rng, 0.03, 0.1)
        hz = between(rng, 500, 2500) * (1 + rng.uniform(1, 8) * times(seconds))
        drop = tone(hz, [1.0, 0.1]) * np.exp(-4 * times(seconds) / seconds)
        yield from ((onset, 0.3 * click(rng, 0.002, 2000, 9000)), (onset + 0.01, drop * rng.uniform(0.6, 1.0)))


@makes("pouring water")
def pouring_water(rng: Rng) -> np.ndarray:
    """Bubbles and hiss in a vessel whose resonance rises as it fills."""
    base = bubbles(rng, between(rng, 60, 150), (300, 1500)) + 0.4 * band(noise(rng), 500, 6000)
    low, high = between(rng, 300, 700), between(rng, 1200, 3000)
    halves = [resonant(base, [(f, f / 5, 1.0), (3 * f, f / 3, 0.4)], 0.1) for f in np.geomspace(low, high, 6)]
    at = np.linspace(0, 5, len(base))
    level = np.stack([np.clip(1 - np.abs(at - k), 0, 1) for k in range(6)])
    return (np.stack(halves) * level).sum(axis=0) * swell(SECONDS, 0.2, rng.uniform(0.2, 1.5))


@makes("toilet flush")
def toilet_flush(rng: Rng) -> np.ndarray:
    """A lever, a rush that swells, gurgles and dies into filling."""
    t, peak = times(SECONDS), rng.uniform(0.6, 1.8)
    rush = band(noise(rng, SECONDS, -3.0), 100, 5000, 1) * np.where(
        t < peak, (t / peak) ** 2, np.exp(-(t - peak) / 1.5)
    )
    gurgle = bubbles(rng, 60, (120, 700)) * np.exp(-((t - peak - 1.0) ** 2) / 1.2)
    fill = band(noise(rng), 1500, 8000) * 0.08 * np.clip(t - peak, 0, 1)
    lever = 0.8 * struck(rng, 200, 2500, 6, 0.03, 0.3)
    return place([(0.0, rush / rush.std() + gurgle + fill), (0.05, lever)])


@makes("kettle boiling")
def kettle_boiling(rng: Rng) -> np.ndarray:
    """A rumble of steam bubbles; in half of the cases a whistle on top."""
    boil = bubbles(rng, between(rng, 80, 200), (80, 600)) + band(noise(rng, SECONDS, -3.0), 80, 3000, 1)
    if rng.random() < 0.5:
        return boil / boil.std()
    rise = np.clip(times(SECONDS) / rng.uniform(0.5, 4.0), 0, 1)
    whistle = tone(between(rng, 1200, 3200) * (0.8 + 0.2 * rise) * (1 + 0.004 * wander(rng, SECONDS, 9)), [1, 0.3, 0.1])
    return 0.3 * boil / boil.std() + whistle * rise


@makes("frying")
def frying(rng: Rng) -> np.ndarray:
    """Sizzle: dense tiny crackles in high noise."""
    crackle = (
        rng.standard_normal(len(times(SECONDS))) * (rng.random(len(times(SECONDS))) < between(rng, 0.002, 0.02)) * 6
    )
    return band(crackle + 0.5 * noise(rng), between(rng, 1500, 3500), 10000, 1) * (1 + 0.3 * wander(rng, SECONDS, 6.0))


@makes("brushing teeth")
def brushing_teeth(rng: Rng) -> np.ndarray:
    """Short strokes of bright noise, four to six a second."""
    rate, t = rng.uniform(2.5, 6.0), times(SECONDS)
    stroke = np.abs(np.sin(np.pi * rate * t * (1 + 0.01 * wander(rng, SECONDS, 1)))) ** rng.uniform(0.7, 2.5)
    pause = wander(rng, SECONDS, 1.5) > -1.0
    centre = between(rng, 2500, 6000)
    return band(noise(rng), centre / 2, centre * 1.8) * stroke * np.where(pause, 1.0, 0.15)


@makes("piano")
def piano(rng: Rng) -> Pieces:
    """Notes of a scale with stretched partials."""
    root = between(rng, 110, 330)
    for onset in regular(rng, between(rng, 0.18, 0.6), 0.2):
        for hz in root * 2 ** (rng.choice([0, 2, 4, 5, 7, 9, 11, 12, 14, 16], rng.integers(1, 4)) / 12):
            k = np.arange(1, 12)
            partials = hz * k * np.sqrt(1 + 4e-4 * k**2)
            note = ringing(partials, 1.2 / k**0.8, rng.uniform(0.4, 1) / k**1.1, 2.0)
            yield onset, note + 0.1 * click(rng, 0.005, 200, 3000, 2.0)


@makes("television or music")
def music(rng: Rng) -> Pieces:
    """A beat, a bass and chords."""
    beat, root = 60 / rng.uniform(80, 150), between(rng, 55, 110)
    for k, onset in enumerate(np.arange(rng.uniform(0, 0.4), SECONDS, beat / 2)):
        if k % 2 == 0:
            kick = tone(glide(0.2, 160, 50), [1.0]) * np.exp(-times(0.2) / 0.06)
            snare = click(rng, 0.05, 200, 8000, 0.3)
            yield onset, kick * 1.5 if k % 4 == 0 else snare[: len(snare)]
        yield onset, 0.25 * click(rng, 0.012, 5000, 10000, 0.1)
        hz = root * 2 ** (rng.choice([0, 3, 5, 7, 10]) / 12)
        yield onset, 0.5 * tone(np.full(len(times(beat / 2)), hz), [1, 0.5, 0.3, 0.2])
        if k % 4 == 0:
            for step in (0, rng.choice([3, 4]), 7):
                chord = tone(np.full(len(times(2 * beat)), 4 * hz * 2 ** (step / 12)), [1, 0.5, 0.4, 0.2, 0.1])
                yield onset, 0.2 * chord * swell(2 * beat, 0.02, 0.3)
