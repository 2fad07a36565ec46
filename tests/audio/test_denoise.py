from itertools import islice
from pathlib import Path

import numpy as np
import pytest
from audio_fakes import RATE_HZ, quiet, tone

from avlmaps.maps.audio.background import NoiseProfile, denoise, is_swell, noise_profile
from avlmaps.recordings.audio import Sound
from avlmaps_sim.mixing.background import background
from avlmaps_sim.mixing.clips import amplify, audible_part, find_clips, loudness_db


def noise(seconds: int, kind: str, seed: int = 0) -> np.ndarray:
    return np.concatenate(list(islice(background(kind, -40.0, RATE_HZ, np.random.default_rng(seed)), seconds)))


def profile(kind: str = "pink") -> NoiseProfile:
    found = noise_profile([Sound(noise(3, kind), RATE_HZ)])
    assert found is not None
    return found


def snr_db(clean: np.ndarray, heard: np.ndarray) -> float:
    return float(10.0 * np.log10((clean**2).sum() / ((heard - clean) ** 2).sum()))


@pytest.mark.parametrize("kind", ["white", "pink", "room"])
def test_noise_gets_quieter_and_a_tone_stays(kind: str) -> None:
    clean = np.concatenate([quiet(1.0), tone(2.0, level=0.05), quiet(1.0)])
    noisy = clean + noise(4, kind, seed=1)
    heard = denoise(Sound(noisy, RATE_HZ), profile(kind)).samples
    assert snr_db(clean, heard) > snr_db(clean, noisy) + 6.0
    inner = slice(int(1.2 * RATE_HZ), int(2.8 * RATE_HZ))
    assert np.dot(heard[inner], clean[inner]) / np.dot(clean[inner], clean[inner]) == pytest.approx(1.0, abs=0.05)


def test_a_clean_sound_comes_out_as_it_went_in() -> None:
    silent = noise_profile([Sound(quiet(1.0), RATE_HZ)])
    assert silent is not None
    sound = Sound(tone(1.0) + noise(1, "white"), RATE_HZ)
    np.testing.assert_allclose(denoise(sound, silent).samples, sound.samples, atol=1e-6)


def test_too_little_quiet_tells_nothing() -> None:
    assert noise_profile([]) is None
    assert noise_profile([Sound(noise(1, "white")[:1000], RATE_HZ)]) is None


def test_a_click_in_the_quiet_does_not_count() -> None:
    clicked = noise(3, "white")
    clicked[RATE_HZ : RATE_HZ + 100] += 0.5
    found, plain = noise_profile([Sound(clicked, RATE_HZ)]), profile("white")
    assert found is not None
    np.testing.assert_allclose(found.power, plain.power, rtol=0.25)


@pytest.mark.shared
def test_real_sounds_in_noise_come_out_clearer(shared_data: Path) -> None:
    clips = find_clips(shared_data / "data" / "sounds" / "esc10")[::40]
    gained = []
    for i, clip in enumerate(clips):
        sound = audible_part(clip, RATE_HZ)
        clean = amplify(sound, -30.0 - loudness_db(sound)).samples
        noisy = clean + noise(7, "pink", seed=i + 1)[: len(clean)]
        gained.append(snr_db(clean, denoise(Sound(noisy, RATE_HZ), profile()).samples) - snr_db(clean, noisy))
    assert min(gained) > -1.0
    assert np.mean(gained) > 2.5


@pytest.mark.parametrize("kind", ["white", "pink", "room"])
@pytest.mark.parametrize("seconds", [0.1, 0.3, 2.0])
def test_a_background_that_swells_is_no_other_sound(kind: str, seconds: float) -> None:
    count, around = round(seconds * RATE_HZ), [Sound(noise(2, kind), RATE_HZ), Sound(noise(2, kind, seed=1), RATE_HZ)]
    swell = 3.0 * noise(2, kind, seed=2)[:count]
    assert is_swell(Sound(swell, RATE_HZ), around)
    assert not is_swell(Sound(noise(2, kind, seed=2)[:count] + tone(seconds, level=0.05)[:count], RATE_HZ), around)
    other = "white" if kind != "white" else "pink"
    assert not is_swell(Sound(swell + 10.0 * noise(2, other, seed=3)[:count], RATE_HZ), around)
    assert not is_swell(Sound(swell, RATE_HZ), [])
