"""What several microphones hear: delays by geometry, a diffuse late field, reflections as in pyroomacoustics."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.recordings.audio import Sound
from avlmaps.recordings.microphones import Microphones, microphones_named
from avlmaps_sim.hearing.acoustic import AcousticSettings
from avlmaps_sim.hearing.array import heard_by_array, responses
from avlmaps_sim.hearing.impulse import LATE_FROM_S, Acoustics
from avlmaps_sim.hearing.rooms import SPEED_M_S
from avlmaps_sim.hearing.schedule import Sounding, Source
from helpers.hearing_scenes import open_air, shoebox, two_rooms

RATE_HZ = 16_000
SQUARE = microphones_named("square4").position_m


def arrival(samples: np.ndarray) -> float:
    """Return where the first pulse of a response is, in fractions of a sample: the peak of its interpolation."""
    fine = 32
    spectrum = np.fft.rfft(samples, 1 << 14)
    dense = np.fft.irfft(spectrum, (1 << 14) * fine)
    peak = int(np.abs(samples).argmax())
    near = slice(max(peak - 2, 0) * fine, (peak + 3) * fine)
    return (near.start + int(np.abs(dense[near]).argmax())) / fine


def along(positions: np.ndarray, heading_rad: float = 0.0) -> np.ndarray:
    """Return poses of a level camera."""
    c, s = np.cos(heading_rad), np.sin(heading_rad)
    pose = np.tile(np.eye(4), (len(positions), 1, 1))
    pose[:, :3, :3] = np.array([[s, 0, c], [-c, 0, s], [0, -1, 0]])
    pose[:, :3, 3] = positions
    return pose


@given(st.floats(1.0, 8.0), st.floats(0.0, 2 * np.pi), st.floats(-0.8, 0.8))
def test_direct_sound_reaches_each_microphone_when_its_distance_says(far_m: float, angle: float, up_m: float) -> None:
    ears = np.array([0.0, 0.0, 1.2]) + SQUARE
    source = np.array([far_m * np.cos(angle), far_m * np.sin(angle), 1.2 + up_m])
    early, late = responses(Acoustics(open_air(), RATE_HZ), source, ears[None], np.random.default_rng(0))
    assert late is None
    distance_m = np.linalg.norm(ears - source, axis=1)
    for heard, metres in zip(early[0], distance_m, strict=True):
        assert arrival(heard) == pytest.approx(metres / SPEED_M_S * RATE_HZ, abs=0.05)
        assert heard.sum() == pytest.approx(1.0 / metres, rel=0.02)


def test_reflections_are_those_of_pyroomacoustics() -> None:
    pra = pytest.importorskip("pyroomacoustics")
    source, middle = np.array([1.0, 1.2, 1.0]), np.array([4.5, 3.5, 1.3])
    building = Acoustics(shoebox(), RATE_HZ)
    early, _ = responses(building, source, (middle + SQUARE)[None], np.random.default_rng(0))
    mean = building.floor_at(1.3)[1].mean_absorption(0)
    room = pra.ShoeBox([6.0, 5.0, 2.6], fs=RATE_HZ, max_order=4, materials=pra.Material(mean))
    room.add_source(source)
    room.add_microphone_array((middle + SQUARE).T)
    filtered = pra.constants.get("rir_hpf_enable")
    pra.constants.set("rir_hpf_enable", False)
    try:
        room.compute_rir()
    finally:
        pra.constants.set("rir_hpf_enable", filtered)
    shift = pra.constants.get("frac_delay_length") // 2
    first = np.linalg.norm(middle - source) / SPEED_M_S
    until = round((first + LATE_FROM_S) * RATE_HZ)  # from there on the late field fades in
    for channel in range(4):
        theirs = np.asarray(room.rir[channel][0])[shift : shift + until - 40]
        ours = early[0, channel, : until - 40]
        assert np.corrcoef(theirs, ours)[0, 1] > 0.97
        assert np.linalg.norm(theirs - ours) < 0.12 * np.linalg.norm(theirs)


@pytest.mark.nightly
def test_late_field_is_diffuse() -> None:
    building, apart_m = Acoustics(shoebox(), RATE_HZ), 0.2
    ears = np.array([[[3.0, 2.5, 1.3], [3.0 + apart_m, 2.5, 1.3]]])
    cross, power = np.zeros(129, complex), np.zeros((2, 129))
    for seed in range(5):
        _, late = responses(building, np.array([1.0, 1.2, 1.0]), ears, np.random.default_rng(seed))
        assert late is not None
        pieces = late[0, :, 1600 : 1600 + 256 * 20].reshape(2, 20, 256) * np.hanning(256)
        spectrum = np.fft.rfft(pieces, axis=2)
        cross += (spectrum[0] * spectrum[1].conj()).sum(axis=0)
        power += (np.abs(spectrum) ** 2).sum(axis=1)
    coherence = (cross / np.sqrt(power[0] * power[1])).real
    hz = np.fft.rfftfreq(256, 1.0 / RATE_HZ)
    band = (hz > 200) & (hz < 4000)
    assert np.abs(coherence - np.sinc(2 * hz * apart_m / SPEED_M_S))[band].mean() < 0.12


def test_sound_from_the_next_room_comes_through_the_doorway() -> None:
    building = Acoustics(two_rooms(), RATE_HZ)
    middle = np.array([5.5, 1.0, 1.3])
    early, _ = responses(building, np.array([2.5, 1.0, 1.3]), (middle + SQUARE)[None], np.random.default_rng(0))
    delays = np.array([arrival(channel) for channel in early[0]]) / RATE_HZ * SPEED_M_S
    to_door = np.array([4.05, 3.45, 1.3]) - middle
    to_door /= np.linalg.norm(to_door)
    found = np.linalg.lstsq(-(SQUARE - SQUARE.mean(axis=0))[:, :2], delays - delays.mean(), rcond=None)[0]
    bearing = np.arctan2(found[1], found[0]) - np.arctan2(to_door[1], to_door[0])
    assert abs(np.rad2deg(np.angle(np.exp(1j * bearing)))) < 15.0


def test_a_track_has_the_delays_of_the_turned_robot() -> None:
    rng = np.random.default_rng(1)
    clip = Sound(rng.standard_normal(RATE_HZ).astype(np.float32) * 0.1, RATE_HZ)
    source = Sounding(Source("dog bark", (4.0, 0.0, 1.2), -1, "bark", clip), 0.5, 1.5, (0.0, 0.0, 1.2))
    poses = along(np.tile([0.0, 0.0, 1.2], (20, 1)), heading_rad=np.pi / 2)  # looks along y; the source is on its right
    stereo = microphones_named("stereo")
    track = heard_by_array(
        open_air(), [source], np.arange(20) / 10.0, poses, stereo, 2.0, rng, AcousticSettings(RATE_HZ, snr_db=60.0)
    )
    left, right = track.samples[:, RATE_HZ // 2 + 400 : RATE_HZ + 400].astype(float)
    spectrum = np.fft.rfft(left, 1 << 15) * np.fft.rfft(right, 1 << 15).conj()
    correlation = np.fft.irfft(spectrum, 1 << 19)
    lag = int(np.argmax(np.concatenate([correlation[-320:], correlation[:320]]))) - 320
    assert lag / 16 / RATE_HZ * SPEED_M_S == pytest.approx(0.2, abs=0.01)  # the left one hears it later


def test_same_seed_gives_the_same_track_and_channels_have_noise_of_their_own() -> None:
    poses = along(np.tile([2.0, 2.0, 1.2], (10, 1)))
    array = Microphones(SQUARE)
    one, other = (
        heard_by_array(shoebox(), [], np.arange(10) / 10.0, poses, array, 1.0, np.random.default_rng(5))
        for _ in range(2)
    )
    assert np.array_equal(one.samples, other.samples)
    assert np.abs(np.corrcoef(one.samples)[~np.eye(4, dtype=bool)]).max() < 0.2


def test_rooms_ring_for_as_long_as_is_wanted() -> None:
    for wanted_s in (0.3, 0.8):
        building = Acoustics(shoebox(), RATE_HZ, wanted_s)
        assert building.floor_at(1.3)[1].rt60_s(0) == pytest.approx(wanted_s, rel=0.02)
