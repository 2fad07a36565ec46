"""Weather, streets, tools and bells."""

import numpy as np

from avlmaps_sim.synthesis.blocks import (
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


@makes("thunder")
def thunder(rng: Rng) -> np.ndarray:
    """A crack, then a rumble that rolls away, perhaps over rain."""
    start, pieces = rng.uniform(0.0, 1.5), []
    crack = band(noise(rng, 0.6), 60, between(rng, 800, 5000), 1) * np.exp(-times(0.6) / between(rng, 0.03, 0.2))
    pieces.append((start, rng.uniform(0.0, 2.5) * crack))
    for _ in range(rng.integers(4, 12)):
        seconds = rng.uniform(0.8, 2.5)
        roll = band(noise(rng, seconds, -6), 25, between(rng, 150, 500)) * swell(seconds, 0.15, 0.7 * seconds)
        late = rng.exponential(1.0)
        pieces.append((start + late, 3 * np.exp(-late / 2) * roll))
    return place(pieces) + rng.uniform(0, 0.03) * noise(rng)


@makes("wind")
def wind(rng: Rng) -> np.ndarray:
    """Low gusts, and a howl whose pitch follows them."""
    gust = np.clip(0.6 + 0.4 * wander(rng, SECONDS, between(rng, 0.6, 2.0)), 0.05, None)
    low = band(noise(rng, SECONDS, -5), 30, between(rng, 300, 1200), 1) * gust
    howls = [resonant(noise(rng), [(between(rng, 300, 1000) * k, 60, 1.0)]) for k in (0.8, 1.0, 1.25)]
    howl = sum(
        h / h.std() * np.clip(1 - np.abs(gust * 1.6 - k), 0, 1) for k, h in zip((0.4, 0.9, 1.4), howls, strict=True)
    )
    return low / low.std() + rng.uniform(0, 0.7) * howl


@makes("siren")
def siren(rng: Rng) -> np.ndarray:
    """A wail, a yelp or two alternating tones."""
    t, kind, rate = times(SECONDS), rng.random(), between(rng, 0.15, 0.5)
    low, high = between(rng, 400, 800), between(rng, 900, 1700)
    if kind < 0.4:
        shape = 0.5 - 0.5 * np.cos(2 * np.pi * rate * t + rng.uniform(0, 6))
    elif kind < 0.65:
        shape = (t * rng.uniform(2, 5)) % 1
    else:
        shape, high = ((t * rng.uniform(0.6, 2.0)) % 1 > 0.5).astype(float), low * rng.uniform(1.2, 1.45)
    shape = np.convolve(shape, np.ones(400) / 400, mode="same")
    return tone(low + (high - low) * shape, [1, 0.6, 0.5, 0.25, 0.2, 0.1, 0.1]) + 0.1 * noise(rng, SECONDS, -4)


@makes("car horn")
def car_horn(rng: Rng) -> np.ndarray:
    """Two reeds a third apart, blown once or more."""
    low, pieces, onset = between(rng, 280, 480), [], rng.uniform(0, 1.0)
    while onset < SECONDS:
        seconds = between(rng, 0.12, 1.8)
        reeds = sum(
            tone(np.full(len(times(seconds)), low * f), [1 / k**0.5 for k in range(1, 20)]) for f in (1.0, 1.22)
        )
        pieces.append((onset, resonant(np.asarray(reeds), [(2200, 2000, 1.0)], 0.4) * swell(seconds, 0.01, 0.03)))
        onset += seconds + between(rng, 0.1, 2.0)
    return place(pieces) + 0.03 * noise(rng, SECONDS, -4)


@makes("car engine")
def engine(rng: Rng) -> np.ndarray:
    """Firing strokes, idling or revved."""
    idle = between(rng, 18, 45)
    revs = idle * np.clip(1 + rng.uniform(0, 2.0) * np.clip(wander(rng, SECONDS, 0.7), 0, None), 0.8, 5)
    gains = rng.exponential(1.0, 40) / np.arange(1, 41) ** 0.7
    motor = tone(revs * (1 + 0.02 * wander(rng, SECONDS, 30)), list(gains))
    rough = band(noise(rng, SECONDS, -3), 80, 3000) * (1 + 0.5 * np.sin(2 * np.pi * np.cumsum(revs) / 22050))
    return motor / motor.std() + rng.uniform(0.2, 0.6) * rough / rough.std()


@makes("train")
def train(rng: Rng) -> np.ndarray:
    """Wheels over joints in pairs, rumble and perhaps a horn."""
    pieces, period = [], between(rng, 0.35, 1.2)
    for onset in regular(rng, period, 0.02):
        for delay in (0.0, rng.uniform(0.08, 0.14)):
            clack = struck(rng, 120, 2500, 8, 0.03, 0.3) + click(rng, 0.01, 200, 4000, 0.3)
            pieces.append((onset + delay, clack))
    rumble = band(noise(rng, SECONDS, -5), 40, 1500, 1)
    total = rng.uniform(0.2, 0.8) * place(pieces) + rumble / rumble.std()
    if rng.random() < 0.4:
        seconds, low = rng.uniform(0.8, 2.5), between(rng, 250, 450)
        chord = sum(tone(np.full(len(times(seconds)), low * f), [1, 0.7, 0.5, 0.3, 0.2]) for f in (1, 1.19, 1.5))
        total = total + place([(rng.uniform(0, 2.5), np.asarray(chord) * swell(seconds, 0.08, 0.2))])
    return total


@makes("airplane")
def airplane(rng: Rng) -> np.ndarray:
    """A broad roar with a whine that falls slowly as it passes."""
    t = times(SECONDS)
    roar = band(noise(rng, SECONDS, -4), 60, between(rng, 800, 4000), 1) * (1 + 0.1 * wander(rng, SECONDS, 2.0))
    whine = tone(between(rng, 250, 2500) * (1 - rng.uniform(0, 0.25) * t / SECONDS), [1, 0.4, 0.2])
    return (roar / roar.std() + rng.uniform(0, 0.25) * whine) * np.exp(rng.uniform(-0.25, 0.25) * t)


@makes("church bells")
def church_bells(rng: Rng) -> Pieces:
    """Struck bells with hum, prime, tierce, quint and nominal."""
    base = between(rng, 180, 700)
    bells = base * rng.choice([1, 1.125, 1.25, 1.33, 1.5, 1.68], rng.integers(1, 4), replace=False)
    for onset in regular(rng, between(rng, 0.4, 2.2), 0.08):
        hz = float(rng.choice(bells))
        partials = hz * np.array([0.5, 1.0, 1.19, 1.5, 2.0, 2.52, 2.67, 3.01, 4.17])
        decays = np.array([4, 2.5, 2, 1.5, 1.2, 0.8, 0.7, 0.5, 0.3])
        gains = np.array([0.6, 0.8, 0.9, 0.4, 1.0, 0.4, 0.5, 0.4, 0.3]) * rng.uniform(0.5, 1.3, 9)
        yield onset, ringing(partials, decays, gains, 5.0)


@makes("fireworks")
def fireworks(rng: Rng) -> Pieces:
    """Booms, whistling rockets and crackle."""
    for onset in at_random(rng, between(rng, 0.6, 3)):
        boom = band(noise(rng, 1.0, -3), 40, between(rng, 500, 4000), 1) * np.exp(
            -times(1.0) / between(rng, 0.05, 0.25)
        )
        yield onset, rng.uniform(0.5, 2.0) * boom
        if rng.random() < 0.3:
            rocket = tone(glide(0.7, 1200, between(rng, 2500, 4500)), [1, 0.1]) * swell(0.7, 0.1, 0.3)
            yield (max(0.0, onset - 0.7), 0.3 * rocket)
        if rng.random() < 0.5:
            crackle = [(onset + 0.3 + late, click(rng, 0.003, 1500, 9000)) for late in at_random(rng, 60, 1.0)]
            yield from [(late, rng.uniform(0.1, 0.5) * spark) for late, spark in crackle]


@makes("hand saw")
def hand_saw(rng: Rng) -> np.ndarray:
    """Strokes to and fro of rasping noise, the push louder than the pull."""
    rate, t = rng.uniform(0.9, 3.0), times(SECONDS)
    phase = np.sin(2 * np.pi * rate * t + rng.uniform(0, 6))
    teeth = 0.6 + 0.4 * np.sign(np.sin(2 * np.pi * np.cumsum(between(rng, 80, 300) * np.abs(phase)) / 22050))
    rasp = resonant(noise(rng), [(between(rng, 600, 5000), between(rng, 500, 2500), 1.0) for _ in range(3)], 0.15)
    return rasp * teeth * np.abs(phase) ** 1.5 * np.where(phase > 0, 1.0, rng.uniform(0.3, 0.9))


@makes("chopping wood")
def wood_chop(rng: Rng) -> Pieces:
    """Single dull strokes with a crack."""
    for onset in regular(rng, between(rng, 0.5, 1.8), 0.15):
        blow = struck(rng, between(rng, 100, 350), 3000, 10, between(rng, 0.015, 0.05), 0.4)
        yield onset, blow + 1.5 * click(rng, 0.008, 400, 6000, 0.4)


@makes("hammering")
def hammering(rng: Rng) -> Pieces:
    """Blows on a nail, ringing a little higher each time."""
    low = between(rng, 500, 1800)
    for k, onset in enumerate(regular(rng, between(rng, 0.25, 0.7), 0.06)):
        blow = struck(rng, low * (1 + 0.03 * k), 7000, 7, between(rng, 0.02, 0.08), 0.4)
        yield onset, (blow + 2 * click(rng, 0.004, 600, 8000, 0.4)) * jittered(rng, 0.8)


@makes("bicycle bell")
def bicycle_bell(rng: Rng) -> Pieces:
    """One or two bright rings."""
    hz = between(rng, 1800, 3600)
    for onset in regular(rng, between(rng, 0.6, 2.0), 0.2):
        bell = ringing([hz, 1.02 * hz, 2.3 * hz, 3.7 * hz], [0.6, 0.5, 0.25, 0.1], [1, 0.7, 0.6, 0.3], 2.0)
        yield from ((onset, bell), (onset + rng.uniform(0.1, 0.2), 0.8 * bell))
