"""Animals: voices by pitch, formants and rhythm."""

import numpy as np

from avlmaps_sim.synthesis.blocks import (
    SECONDS,
    Pieces,
    Rng,
    at_random,
    band,
    between,
    glide,
    jittered,
    makes,
    noise,
    place,
    regular,
    swell,
    times,
    tone,
    voice,
    wander,
)


@makes("cat meowing")
def cat(rng: Rng) -> Pieces:
    """A pitch that rises and falls while the mouth opens and closes."""
    high = between(rng, 450, 900)
    for onset in regular(rng, between(rng, 1.2, 3.0), 0.2):
        seconds = rng.uniform(0.4, 1.3)
        hz = glide(seconds, 0.75 * high, high, jittered(rng, 0.95 * high, 0.1), 0.6 * high)
        closed = voice(rng, hz, [(700, 250, 1.0), (2600, 500, 0.3)])
        opened = voice(rng, hz, [(1300, 400, 1.0), (2400, 500, 0.7), (3800, 800, 0.3)])
        openness = swell(seconds, 0.5 * seconds, 0.4 * seconds)[: len(hz)]
        mixed = closed * (1 - openness) + opened * openness
        yield onset, mixed * swell(seconds, 0.06, 0.25)[: len(hz)]


@makes("cow mooing")
def cow(rng: Rng) -> Pieces:
    """A long low bellow."""
    low = between(rng, 90, 200)
    for onset in regular(rng, between(rng, 2.2, 4.0), 0.2):
        seconds = rng.uniform(1.2, 2.4)
        hz = glide(seconds, 0.8 * low, low, 1.15 * low, 0.75 * low)
        sound = voice(rng, hz, [(300, 150, 1.0), (750, 250, 0.6), (1800, 500, 0.15)], 0.08, 0.02)
        yield onset, sound * swell(seconds, 0.2, 0.4)[: len(sound)]


@makes("sheep bleating")
def sheep(rng: Rng) -> Pieces:
    """A nasal voice with a strong tremolo."""
    low = between(rng, 220, 500)
    for onset in regular(rng, between(rng, 1.1, 2.5), 0.3):
        seconds = rng.uniform(0.5, 1.3)
        shake = 2 * np.pi * rng.uniform(6, 11) * times(seconds)
        hz = glide(seconds, low, 1.1 * low, 0.9 * low) * (1 + 0.05 * np.sin(shake))
        sound = voice(rng, hz, [(800, 300, 1.0), (1600, 400, 0.8), (2900, 600, 0.4)], 0.1)
        tremolo = 0.6 + 0.4 * np.sin(shake)
        yield onset, sound * tremolo * swell(seconds, 0.05, 0.2)


@makes("pig grunting")
def pig(rng: Rng) -> Pieces:
    """Short rough grunts; now and then a squeal."""
    for onset in regular(rng, between(rng, 0.35, 0.9), 0.4):
        seconds = rng.uniform(0.12, 0.4)
        if rng.random() < 0.15:
            hz = glide(2 * seconds, 700, between(rng, 1200, 2500), 800)
            sound = voice(rng, hz, [(1500, 600, 1.0), (3200, 900, 0.7)], 0.2, 0.05)
        else:
            hz = glide(seconds, 70, between(rng, 80, 160), 60)
            sound = voice(rng, hz, [(350, 200, 1.0), (1100, 400, 0.7), (2500, 900, 0.3)], 0.6, 0.25)
        yield onset, sound * swell(len(sound) / 22050, 0.03, 0.08)[: len(sound)]


@makes("hen clucking")
def hen(rng: Rng) -> Pieces:
    """Runs of short clucks, the last one long and high."""
    low, onset = between(rng, 350, 650), rng.uniform(0.0, 0.6)
    while onset < SECONDS:
        for _ in range(rng.integers(2, 8)):
            hz = glide(0.09, low, jittered(rng, 1.3 * low), 0.8 * low)
            cluck = voice(rng, hz, [(900, 400, 1.0), (2000, 700, 0.5)], 0.2) * swell(0.09, 0.008, 0.05)
            yield onset, rng.uniform(0.4, 0.8) * cluck
            onset += jittered(rng, 0.24, 0.3)
        hz = glide(0.45, low, 1.9 * low, 1.5 * low)
        yield onset, voice(rng, hz, [(1200, 500, 1.0), (2600, 800, 0.6)], 0.2) * swell(0.45, 0.03, 0.15)
        onset += rng.uniform(0.6, 1.4)


@makes("crow cawing")
def crow(rng: Rng) -> Pieces:
    """Harsh, falling caws in groups."""
    low = between(rng, 350, 650)
    for onset in regular(rng, between(rng, 0.5, 1.2), 0.25):
        seconds = rng.uniform(0.25, 0.5)
        hz = glide(seconds, 0.9 * low, 1.1 * low, 0.75 * low)
        sound = voice(rng, hz, [(1300, 500, 1.0), (1900, 600, 0.8), (3200, 1200, 0.3)], 0.5, 0.15)
        yield onset, sound * swell(seconds, 0.04, 0.1)


@makes("frog croaking")
def frog(rng: Rng) -> Pieces:
    """Trains of pulses through one resonance."""
    centre, rate = between(rng, 500, 2600), between(rng, 18, 70)
    for onset in regular(rng, between(rng, 0.4, 1.3), 0.25):
        seconds = rng.uniform(0.15, 0.7)
        pulse = tone(np.full(len(times(0.03)), centre), [1.0, 0.3]) * np.exp(-times(0.03) / 0.007)
        croak = place(((k / rate, pulse) for k in range(int(seconds * rate))), seconds)
        yield onset, croak * swell(seconds, 0.05, 0.1)


@makes("birds chirping")
def birds(rng: Rng) -> Pieces:
    """Whistled syllables that sweep between 2 and 8 kHz, of several birds."""
    for _ in range(rng.integers(1, 5)):
        centre, seconds = between(rng, 2200, 6500), between(rng, 0.03, 0.2)
        sweeps = [centre * np.exp(rng.uniform(-0.35, 0.35, 3)) for _ in range(rng.integers(1, 4))]
        start, gap = rng.uniform(0, 1.5), seconds * rng.uniform(1.2, 3)
        while start < SECONDS:
            for k in range(rng.integers(2, 9)):
                syllable = tone(glide(seconds, *sweeps[k % len(sweeps)]), [1.0, 0.08])
                yield (start + k * gap, syllable * swell(seconds, seconds / 4, seconds / 3) * rng.uniform(0.4, 1))
            start += 9 * gap + rng.exponential(1.0)


@makes("crickets")
def crickets(rng: Rng) -> np.ndarray:
    """Steady trills of three or more pulses at 3 to 6 kHz."""
    total = 0.02 * noise(rng)
    for _ in range(rng.integers(1, 4)):
        hz, pulse_s, pulses = between(rng, 2800, 6000), rng.uniform(0.012, 0.025), int(rng.integers(2, 6))
        sound = tone(np.full(len(times(pulse_s)), hz), [1.0]) * swell(pulse_s, pulse_s / 3, pulse_s / 2)
        onsets = regular(rng, pulses * pulse_s * 1.6 + between(rng, 0.05, 0.8), 0.03)
        trill = ((onset + k * 1.6 * pulse_s, sound) for onset in onsets for k in range(pulses))
        total = total + rng.uniform(0.3, 1.0) * place(trill)
    return total


@makes("buzzing insects")
def insects(rng: Rng) -> np.ndarray:
    """A wing beat of 120 to 600 Hz that comes and goes."""
    hz = between(rng, 120, 600) * (1 + 0.06 * wander(rng, SECONDS, 3.0) + 0.01 * wander(rng, SECONDS, 40.0))
    near = np.clip(0.5 + 0.5 * wander(rng, SECONDS, 1.2), 0.05, None)
    return tone(hz, [1, 0.8, 0.6, 0.5, 0.4, 0.3, 0.2, 0.15, 0.1]) * near + 0.05 * band(noise(rng), 200, 4000)


@makes("owl or pigeon")
def dove(rng: Rng) -> Pieces:
    """Soft hoots in a fixed rhythm."""
    low = between(rng, 300, 650)
    for onset in regular(rng, between(rng, 1.4, 2.6), 0.1):
        for delay, seconds in ((0.0, 0.25), (0.35, 0.5), (1.0, 0.3)):
            hoot = tone(glide(seconds, low, 1.06 * low, low), [1.0, 0.1, 0.05]) * swell(seconds, 0.06, 0.12)
            yield (onset + delay, hoot)


@makes("mouse squeaking")
def mouse(rng: Rng) -> Pieces:
    """Tiny squeaks above 4 kHz."""
    for onset in at_random(rng, between(rng, 1, 5)):
        seconds = rng.uniform(0.04, 0.15)
        hz = glide(seconds, *(between(rng, 4000, 9000) for _ in range(3)))
        yield onset, tone(hz, [1.0]) * swell(seconds, 0.01, 0.03)
