"""People: voices, breath and hands."""

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
    swell,
    times,
    tone,
    voice,
    wander,
)

VOWELS = {
    "a": [(750, 120, 1.0), (1200, 150, 0.6), (2600, 250, 0.25)],
    "e": [(500, 100, 1.0), (1900, 180, 0.5), (2550, 250, 0.3)],
    "i": [(300, 80, 1.0), (2300, 200, 0.4), (3000, 300, 0.3)],
    "o": [(500, 100, 1.0), (900, 130, 0.5), (2500, 250, 0.15)],
    "u": [(330, 80, 1.0), (800, 120, 0.3), (2300, 250, 0.1)],
}


def vowel(rng: Rng, size: float = 1.0, name: str = "") -> list[tuple[float, float, float]]:
    """Return the formants of a vowel in a head of some size."""
    chosen = VOWELS[name or str(rng.choice(list(VOWELS)))]
    return [(jittered(rng, f / size, 0.06), b, g) for f, b, g in chosen]


@makes("laughing")
def laughing(rng: Rng) -> Pieces:
    """Runs of ha-ha: voiced bursts with breath between, falling."""
    pitch, size = between(rng, 130, 420), rng.uniform(0.8, 1.1)
    onset, period, name = rng.uniform(0, 0.8), rng.uniform(0.16, 0.26), str(rng.choice(["a", "e", "i"]))
    while onset < SECONDS:
        for k in range(rng.integers(3, 11)):
            high = pitch * (1.25 - 0.04 * k)
            burst_s = 0.55 * period
            sound = voice(rng, glide(burst_s, high, 1.08 * high, 0.9 * high), vowel(rng, size, name), 0.15)
            breath = resonant(noise(rng, 0.4 * period), vowel(rng, size, name)) * 0.3
            yield from ((onset, sound * swell(burst_s, 0.02, 0.05)), (onset + burst_s, breath))
            onset += jittered(rng, period, 0.06)
        onset += rng.uniform(0.3, 1.2)


@makes("talking")
def talking(rng: Rng) -> Pieces:
    """Syllables of vowels and hissed consonants in phrases."""
    pitch, size, onset = between(rng, 90, 260), rng.uniform(0.8, 1.1), 0.0
    while onset < SECONDS:
        for _ in range(rng.integers(3, 12)):
            seconds = rng.uniform(0.09, 0.26)
            hz = glide(seconds, *(pitch * np.exp(0.15 * rng.standard_normal()) for _ in range(3)))
            sound = voice(rng, hz, vowel(rng, size), 0.05) * swell(seconds, 0.03, 0.05)
            hiss = band(noise(rng, 0.08), between(rng, 1500, 4000), 9000) * swell(0.08, 0.02, 0.02)
            yield from ((onset, sound), (onset + seconds, hiss * rng.uniform(0.0, 0.5)))
            onset += seconds + rng.uniform(0.02, 0.09)
        onset += rng.uniform(0.1, 0.8)


@makes("coughing")
def coughing(rng: Rng) -> Pieces:
    """An explosive burst of noise, a short rough voice after it; two or three in a row."""
    size, pitch, onset = rng.uniform(0.8, 1.1), between(rng, 120, 350), rng.uniform(0, 1.0)
    while onset < SECONDS:
        for _ in range(rng.integers(1, 4)):
            burst = resonant(noise(rng, 0.3), vowel(rng, size, "a"), 0.3) * np.exp(
                -times(0.3) / between(rng, 0.04, 0.1)
            )
            tail = voice(rng, glide(0.2, pitch, 0.7 * pitch), vowel(rng, size, "a"), 0.8, 0.2) * swell(0.2, 0.01, 0.12)
            yield from ((onset, 3 * burst), (onset + 0.08, rng.uniform(0.0, 0.8) * tail))
            onset += rng.uniform(0.28, 0.5)
        onset += rng.uniform(0.6, 2.0)


@makes("breathing")
def breathing(rng: Rng) -> Pieces:
    """In and out, each its own colour."""
    period = between(rng, 1.0, 3.2)
    colours = [[(between(rng, 400, 2500), between(rng, 300, 1500), 1.0) for _ in range(3)] for _ in range(2)]
    for onset in regular(rng, period, 0.05, -rng.uniform(0, 0.5)):
        for k, part in enumerate((0.0, 0.45)):
            seconds = 0.4 * period
            yield (
                onset + part * period,
                resonant(noise(rng, seconds), colours[k]) * swell(seconds, 0.4 * seconds, 0.5 * seconds),
            )


@makes("snoring")
def snoring(rng: Rng) -> Pieces:
    """A flutter of 25 to 90 pulses a second while breathing in, a quiet breath out."""
    period, rate = between(rng, 1.8, 4.0), between(rng, 25, 90)
    peaks = [(between(rng, 150, 500), 120, 1.0), (between(rng, 600, 1500), 250, 0.5), (2500, 800, 0.1)]
    for onset in regular(rng, period, 0.08, rng.uniform(0, 0.8)):
        seconds = 0.45 * period
        flutter = tone(rate * (1 + 0.1 * wander(rng, seconds, 20)), [1 / k**0.2 for k in range(1, 30)])
        sound = resonant(flutter + 2.0 * noise(rng, seconds)[: len(flutter)] * (flutter > 0), peaks)
        out = 0.15 * resonant(noise(rng, seconds), [(900, 800, 1.0)]) * swell(seconds, 0.3, 0.4)
        yield onset, sound / sound.std() * swell(seconds, 0.3 * seconds, 0.2 * seconds)
        yield (onset + 0.5 * period, out)


@makes("clapping")
def clapping(rng: Rng) -> np.ndarray:
    """One pair of hands, or a hall of them."""
    people = 1 if rng.random() < 0.35 else int(between(rng, 3, 60))
    total = np.zeros(len(times(SECONDS)))
    for _ in range(people):
        centre, rate = between(rng, 700, 2600), rng.uniform(2.5, 5.5)
        clap = band(noise(rng, 0.06), centre / 1.6, centre * 2.2) * np.exp(-times(0.06) / between(rng, 0.004, 0.012))
        total += rng.uniform(0.2, 1.0) * place(
            (onset, clap * rng.uniform(0.6, 1)) for onset in regular(rng, 1 / rate, 0.06)
        )
    return total


@makes("crowd cheering")
def cheering(rng: Rng) -> np.ndarray:
    """Many long vowels at once, whistles among them."""
    total = 0.5 * band(noise(rng, SECONDS, -2), 300, 4000, 1)
    for _ in range(rng.integers(12, 30)):
        seconds, pitch = rng.uniform(0.8, 2.5), between(rng, 180, 600)
        shout = voice(rng, glide(seconds, pitch, 1.2 * pitch, pitch), vowel(rng), 0.3) * swell(seconds, 0.3, 0.5)
        total += place([(rng.uniform(0, 4.5), 0.5 * shout)])
    return total


@makes("drinking or sipping")
def drinking(rng: Rng) -> Pieces:
    """A slurp, then gulps."""
    onset = rng.uniform(0, 0.8)
    while onset < SECONDS:
        seconds = rng.uniform(0.3, 0.9)
        slurp = band(noise(rng, seconds), 1200, 7000) * swell(seconds, 0.1, 0.1) * (1 + 0.7 * wander(rng, seconds, 40))
        yield onset, 0.5 * slurp
        onset += seconds
        for _ in range(rng.integers(1, 5)):
            gulp = tone(glide(0.12, between(rng, 150, 300), between(rng, 350, 700)), [1, 0.4]) * swell(0.12, 0.02, 0.06)
            yield from ((onset, gulp), (onset, 0.4 * click(rng, 0.006, 800, 5000)))
            onset += rng.uniform(0.3, 0.7)
        onset += rng.uniform(0.2, 1.0)


@makes("whistling")
def whistling(rng: Rng) -> np.ndarray:
    """A tune of pure tones with a little breath."""
    notes = between(rng, 900, 1700) * 2 ** (np.cumsum(rng.choice([-2, 0, 2, 3, -3, 5], 14)) % 12 / 12)
    hz = np.repeat(notes, 9000)[: len(times(SECONDS))]
    hz = np.pad(hz, (0, len(times(SECONDS)) - len(hz)), mode="edge")
    hz = np.convolve(hz, np.ones(900) / 900, mode="same") * (1 + 0.01 * np.sin(2 * np.pi * 5.5 * times(SECONDS)))
    return tone(np.clip(hz, 500, 4000), [1.0, 0.04]) + 0.05 * band(noise(rng), 1000, 5000)


@makes("children playing")
def children(rng: Rng) -> np.ndarray:
    """High shouts from several places."""
    total = 0.05 * noise(rng, SECONDS, -3)
    for onset in at_random(rng, between(rng, 1.5, 4)):
        seconds, pitch = rng.uniform(0.2, 0.9), between(rng, 300, 700)
        hz = glide(seconds, pitch, *(jittered(rng, 1.2 * pitch, 0.2) for _ in range(2)))
        total += place(
            [(onset, rng.uniform(0.2, 1) * voice(rng, hz, vowel(rng, 0.8), 0.1) * swell(seconds, 0.05, 0.1))]
        )
    return total
