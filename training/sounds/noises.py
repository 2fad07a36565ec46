"""Noises without a name: hum, hiss, rumble and crackle by one rule, whose features ship after those of the kinds.

``python -m training.sounds.noises`` puts them into weights that are there already. The encoder refuses what is nearer
to one of them than to an example of any kind (``SoundCalibration.noise``).
"""

import argparse
import json
from pathlib import Path

import numpy as np
from training.sounds.in_maps import write_json

from avlmaps.core.progress import progress
from avlmaps.perception.embedded.sounds import EmbeddedSounds
from avlmaps.recordings.audio import Sound
from avlmaps_sim.synthesis.blocks import (
    RATE_HZ,
    SECONDS,
    Rng,
    band,
    between,
    filtered,
    noise,
    times,
    tone,
    wander,
)

COUNT = 400
REFUSED = (2.0, 40.0)  # log-odds of a noise: bias, lead over the examples (README)
APART = 0.75  # a noise that is as near as this to a recorded example is left out: it may be such a sound
OCTAVES = np.linspace(5.3, 13.5, 7)  # of 1 Hz


def any_noise(rng: Rng) -> np.ndarray:
    """Return a window of noise of a random colour, perhaps with crackle, a hum, and a level that beats or breathes."""
    t, knots = times(SECONDS), rng.uniform(0.0, 10.0) * rng.standard_normal(len(OCTAVES))

    def colour(hz: np.ndarray) -> np.ndarray:
        return 10.0 ** (np.interp(np.log2(np.maximum(hz, 40.0)), OCTAVES, knots) / 20.0)

    total = filtered(noise(rng, tilt_db=rng.uniform(-7.0, 1.5)), colour)
    if rng.random() < 0.2:
        low_hz = between(rng, 60.0, 3000.0)
        total = band(total, low_hz, low_hz * between(rng, 1.5, 6.0), 3)
    total /= total.std()
    if rng.random() < 0.35:
        at = rng.integers(0, len(t), int(between(rng, 5.0, 1500.0) * SECONDS))
        pops = np.zeros(len(t))
        np.add.at(pops, at, rng.exponential(1.0, len(at)) * rng.choice([-1.0, 1.0], len(at)))
        pops = band(pops, between(rng, 100.0, 2000.0), 10_000.0, 1)
        total += between(rng, 0.2, 3.0) * pops / pops.std()
    for _ in range(int(rng.integers(-3, 4))):
        hz = between(rng, 24.0, 320.0) * (1 + rng.uniform(0, 0.01) * wander(rng, SECONDS, between(rng, 1.0, 10.0)))
        hum = tone(hz, (rng.exponential(1.0, 30) / np.arange(1, 31) ** rng.uniform(0.3, 1.3)).tolist())
        total += between(rng, 0.3, 10.0) * hum / hum.std()
    if rng.random() < 0.25:
        total *= 1.0 + rng.uniform(0.2, 0.95) * np.sin(2 * np.pi * between(rng, 0.1, 15.0) * t + rng.uniform(0, 6))
    elif rng.random() < 0.3:
        total *= np.clip(1.0 + rng.uniform(0.2, 1.0) * wander(rng, SECONDS, between(rng, 0.5, 8.0)), 0.02, None)
    return total


def noise_features(encoder: EmbeddedSounds, count: int = COUNT) -> np.ndarray:
    """Return the features of noises, each as a whole window and as a piece of 0.4 to 4 s."""
    features = []
    for number in progress(range(count), "noises", unit="noise"):
        rng = np.random.default_rng([number, 52])
        samples = any_noise(rng).astype(np.float32)
        length = round(between(rng, 0.4, 4.0) * RATE_HZ)
        first = int(rng.integers(len(samples) - length))
        parts = samples, samples[first : first + length]
        features += [encoder.encode(Sound(part, RATE_HZ))[0] for part in parts]
    return np.stack(features).astype(np.float16)


def add_noises(folder: Path) -> None:
    """Write noises after the examples of the kinds, in place of those that were there, and what refuses them."""
    notes = json.loads((folder / "sounds.json").read_text(encoding="utf-8"))
    notes["calibration"]["noise"] = REFUSED
    write_json(folder / "sounds.json", notes)
    bank = np.load(folder / "sounds.npy")[: sum(kind["examples"] for kind in notes["kinds"])]
    recorded = bank[: sum(kind["examples"] for kind in notes["kinds"] if kind["origin"] == "recorded")]
    noises = noise_features(EmbeddedSounds(weights=folder))
    apart = (noises.astype(np.float32) @ recorded.astype(np.float32).T).max(axis=1) < APART
    np.save(folder / "sounds.npy", np.concatenate([bank, noises[apart]]))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="of sounds.onnx, sounds.json and sounds.npy")
    add_noises(parser.parse_args().folder)
