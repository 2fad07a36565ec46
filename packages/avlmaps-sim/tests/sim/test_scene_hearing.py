"""What is heard in a scene obeys physics: distance, arrival, decay, walls and doorways."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import butter, fftconvolve, sosfilt

from avlmaps.recordings.audio import Sound
from avlmaps_sim.hearing.acoustic import AcousticSettings, acoustic, overlay
from avlmaps_sim.hearing.impulse import Acoustics, arrivals, shaped_impulse, split
from avlmaps_sim.hearing.rooms import BANDS_HZ, SPEED_M_S, WALL_DB, Rooms
from avlmaps_sim.hearing.schedule import Sounding, Source
from avlmaps_sim.mesh import Material
from avlmaps_sim.mixing.clips import loudness_db
from avlmaps_sim.scene import Scene, SceneBuilder
from avlmaps_sim.shapes import sheet
from helpers.hearing_scenes import HEIGHT_M, area, open_air, shoebox, two_rooms

RATE_HZ = 16_000


def response(scene: Scene, source: tuple[float, ...], ear: tuple[float, ...], seed: int = 0) -> np.ndarray:
    building = Acoustics(scene, RATE_HZ)
    return building.responses(np.array(source), np.array([ear]), np.random.default_rng(seed))[0]


def level_db(samples: np.ndarray, low_hz: float = 20.0, high_hz: float = 7_900.0) -> float:
    spectrum = np.abs(np.fft.rfft(samples)) ** 2
    hz = np.fft.rfftfreq(len(samples), 1.0 / RATE_HZ)
    return float(10 * np.log10(spectrum[(hz >= low_hz) & (hz < high_hz)].sum() + 1e-30))


def decay_s(samples: np.ndarray, low_hz: float, high_hz: float) -> float:
    """Return how long 60 dB take by Schroeder's backward integration from -5 to -25 dB of a band."""
    part = sosfilt(butter(4, [low_hz, high_hz], "bandpass", fs=RATE_HZ, output="sos"), samples)
    left = np.cumsum(part[::-1] ** 2)[::-1]
    fall_db = 10 * np.log10(left / left[0] + 1e-12)
    first, last = np.argmax(fall_db < -5.0), np.argmax(fall_db < -25.0)
    return float(3.0 * (last - first) / RATE_HZ)


# --- the open air


@given(st.floats(0.5, 6.0), st.floats(0.0, 2 * np.pi))
@settings(max_examples=6, deadline=None)
def test_in_the_open_twice_the_distance_halves_the_pressure(distance_m: float, angle: float) -> None:
    way = np.array([np.cos(angle), np.sin(angle), 0.0])
    ears = np.array([k * distance_m * way + (0, 0, 1) for k in (1, 2)])
    heard = Acoustics(open_air(), RATE_HZ).responses(np.array([0.0, 0.0, 1.0]), ears, np.random.default_rng(0))
    near, far = (np.abs(samples).sum() for samples in heard)
    assert near == pytest.approx(1.0 / distance_m, rel=1e-6)
    assert far == pytest.approx(near / 2.0, rel=1e-6)


# --- arrival


@pytest.mark.few(3)
@pytest.mark.parametrize("ear", [(1.5, 1.0, 1.3), (3.5, 3.5, 1.3), (7.5, 0.5, 1.3), (4.2, 3.5, 1.6), (7.9, 3.9, 0.4)])
@pytest.mark.parametrize("door", [True, False])
def test_nothing_is_heard_before_the_sound_can_arrive(ear: tuple[float, ...], door: bool) -> None:
    source = (1.0, 1.0, 1.0)
    heard = response(two_rooms(door), source, ear)
    arrival = float(np.linalg.norm(np.subtract(ear, source))) / SPEED_M_S * RATE_HZ
    first = int(np.flatnonzero(np.abs(heard) > 1e-9)[0])
    assert np.floor(arrival) <= first <= np.ceil(arrival) + 1


# --- reverberation


def test_a_bare_room_decays_as_sabine_says() -> None:
    x, y, z = 6.0, 5.0, HEIGHT_M
    building = Acoustics(shoebox(x, y), RATE_HZ)
    absorbing_m2 = building.floor_at(1.3)[1].absorbing_m2[:, 0]
    heard = response(shoebox(x, y), (1.0, 1.2, 1.0), (4.5, 3.5, 1.3))
    for band in (2, 3, 4):
        sabine_s = 0.161 * x * y * z / absorbing_m2[band]
        hz = BANDS_HZ[band]
        assert decay_s(heard, hz / 1.2, hz * 1.2) == pytest.approx(sabine_s, rel=0.15)


def test_a_bare_room_sounds_as_loud_as_all_its_image_sources_together() -> None:
    import pyroomacoustics as pra

    source, ear = (1.0, 1.2, 1.0), (4.5, 3.5, 1.3)
    mean = Acoustics(shoebox(), RATE_HZ).floor_at(1.3)[1].mean_absorption(0)
    room = pra.ShoeBox([6.0, 5.0, HEIGHT_M], fs=RATE_HZ, max_order=40, materials=pra.Material(mean))
    room.add_source(source)
    room.add_microphone(ear)
    room.image_source_model()
    images = room.sources[0]
    distance_m = np.linalg.norm(images.images.T - ear, axis=1)
    power = (images.damping[0] / distance_m) ** 2
    early = distance_m / SPEED_M_S < 0.08
    heard = response(shoebox(), source, ear)
    assert 10 * np.log10((heard**2).sum()) == pytest.approx(10 * np.log10(power.sum()), abs=2.0)
    begin = round(0.08 * RATE_HZ)
    assert 10 * np.log10((heard[:begin] ** 2).sum()) == pytest.approx(10 * np.log10(power[early].sum()), abs=2.0)


@given(
    st.lists(st.floats(2.0, 30.0), min_size=2, max_size=4),
    st.floats(0.0, 3.0),
    st.integers(0, 1),
)
def test_coupled_rooms_hold_the_energy_that_the_steady_state_says(
    absorbing: list[float], opening_m2: float, source: int
) -> None:
    count, bands = len(absorbing), len(BANDS_HZ)
    joint = opening_m2 * (np.ones((count, count)) - np.eye(count))
    rooms = Rooms(
        (area("bedroom", (0, 0), (4, 4)),) * count, np.linspace(20.0, 60.0, count), np.full(count, 80.0),
        np.tile(absorbing, (bands, 1)), np.tile(joint, (bands, 1, 1)),
    )  # fmt: skip
    times_s = np.linspace(0.0, 12.0, 12_001)
    held = np.trapezoid(rooms.energy(source, times_s)[3], times_s, axis=1)
    loss = np.diag(np.array(absorbing) + joint.sum(axis=1)) - joint
    assert np.allclose(held, 16.0 * np.pi * np.linalg.inv(loss)[:, source], rtol=0.02, atol=1e-3)


# --- walls and doorways


def test_a_wall_without_a_door_takes_away_what_a_partition_does() -> None:
    source, ear = (1.0, 1.0, 1.0), (7.0, 1.0, 1.3)
    beside = response(shoebox(8.1, 4.0), source, ear)
    behind = response(two_rooms(door=False), source, ear)
    for band, hz in enumerate(BANDS_HZ[1:6], start=1):
        lost_db = level_db(beside, hz / 1.3, hz * 1.3) - level_db(behind, hz / 1.3, hz * 1.3)
        assert WALL_DB[band] - 12.0 < lost_db < WALL_DB[band] + 12.0
    lost_db = [level_db(beside, *band) - level_db(behind, *band) for band in ((100, 200), (1000, 4000))]
    assert lost_db[1] > lost_db[0] + 8.0, "walls keep high tones back more than low ones"


def test_a_doorway_lets_more_through_than_a_wall_and_less_than_the_open_room() -> None:
    source, ear = (1.0, 0.8, 1.0), (7.0, 0.8, 1.3)
    same, through_door, through_wall = (
        level_db(response(scene, source, ear)) for scene in (shoebox(8.1, 4.0), two_rooms(), two_rooms(door=False))
    )
    assert same - 1.0 > through_door > through_wall + 15.0


def test_sound_that_bends_round_a_corner_loses_its_treble() -> None:
    building = Acoustics(two_rooms(), RATE_HZ)
    air, _ = building.floor_at(1.3)
    (way,) = air.ways(np.array([1.0, 0.8, 1.3]), np.array([[7.0, 0.8, 1.3]]))
    assert not way.clear
    assert way.walls == 1
    corner = np.array([4.05, 3.0])  # the shortest way touches the door's edge
    expected_m = sum(np.linalg.norm(corner - end) for end in ((1.0, 0.8), (7.0, 0.8)))
    assert way.round_m == pytest.approx(expected_m, abs=0.25)
    through, bent = arrivals(way)
    assert bent[1][0] > 2.0 * bent[1][-1]
    assert (bent[1] < 1.0 / way.straight_m).all()
    assert (through[1] < bent[1]).all()


def test_what_lies_inside_a_wall_sounds_into_the_room() -> None:
    in_the_room = level_db(response(shoebox(), (3.0, 4.8, 1.6), (3.0, 3.0, 1.3)))
    for depth_m in (0.02, 0.08, 0.15):  # a clock, a window, the outer side of a front door
        assert level_db(response(shoebox(), (3.0, 5.0 + depth_m, 1.6), (3.0, 3.0, 1.3))) > in_the_room - 3.0


def test_a_thick_wall_whose_sides_are_sheets_counts_once() -> None:
    builder = SceneBuilder("two sheets", areas=[area("bedroom", (0, 0), (4, 4)), area("bedroom", (4.3, 0), (8, 4))])
    for x in (4.0, 4.3):
        builder.add("wall", sheet((x, -1.0, 0.0), (0.0, 6.0, 0.0), (0.0, 0.0, HEIGHT_M), Material()))
    builder.add("floor", sheet((0.0, 0.0, 0.0), (8.0, 0.0, 0.0), (0.0, 4.0, 0.0), Material()))
    air, _ = Acoustics(builder.build(), RATE_HZ).floor_at(1.3)
    (way,) = air.ways(np.array([1.0, 2.0, 1.3]), np.array([[7.0, 2.0, 1.3]]))
    assert way.walls == 1


def test_a_storey_away_only_the_slab_lets_something_through() -> None:
    below, above = shoebox(), shoebox()
    upper = replace(above.areas[0], floor_m=2.8, ceiling_m=5.4)
    scene = Scene("two floors", below.mesh, below.instance, below.objects, (*below.areas, upper))
    assert level_db(response(scene, (1.0, 1.0, 3.8), (4.0, 3.0, 1.3))) < level_db(
        response(scene, (1.0, 1.0, 1.0), (4.0, 3.0, 1.3))
    ) - 30.0  # fmt: skip


# --- filters


@given(st.lists(st.floats(0.001, 2.0), min_size=len(BANDS_HZ), max_size=len(BANDS_HZ)))
def test_a_shaped_impulse_has_the_asked_gains_and_begins_at_once(gain: list[float]) -> None:
    smooth = np.convolve(np.log(np.pad(gain, 2, mode="edge")), np.ones(5) / 5, mode="valid")
    made = shaped_impulse(np.exp(smooth), 22_050)
    found = np.abs(np.fft.rfft(made, 8192))
    at = np.round(BANDS_HZ[2:] / 22_050 * 8192).astype(int)
    assert np.allclose(np.log(found[at]), smooth[2:], atol=0.35)
    assert np.abs(made[:32]).max() == np.abs(made).max()


def test_octave_bands_sum_up_to_the_signal() -> None:
    noise = np.random.default_rng(0).standard_normal(5000)
    assert np.allclose(split(noise, RATE_HZ).sum(axis=0), noise, atol=1e-9)


# --- tracks


def beep(seconds: float = 1.0, hz: float = 1000.0) -> Sound:
    t = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    return Sound((0.5 * np.sin(2 * np.pi * hz * t)).astype(np.float32), RATE_HZ)


def sounding(position: tuple[float, float, float], onset_s: float, robot: tuple[float, ...], sound: Sound) -> Sounding:
    source = Source("microwave beep", position, -1, "beep", sound)
    return Sounding(source, onset_s, onset_s + sound.duration_s, (float(robot[0]), float(robot[1]), float(robot[2])))


def test_a_robot_that_stands_hears_the_clip_convolved_with_the_response() -> None:
    robot = np.tile([4.0, 3.0, 1.3], (40, 1))
    stamps_s = np.arange(40) / 10.0
    rate = AcousticSettings(rate_hz=RATE_HZ, snr_db=90.0)
    heard = acoustic(
        shoebox(), [sounding((1.0, 1.0, 1.0), 0.5, (4, 3, 1.3), beep())], stamps_s, robot, 4.0,
        np.random.default_rng(3), rate,
    )  # fmt: skip
    impulse = response(shoebox(), (1.0, 1.0, 1.0), (4.0, 3.0, 1.3), seed=3)
    expected = np.zeros(4 * RATE_HZ)
    whole = fftconvolve(beep().samples, impulse)
    begin = round(0.5 * RATE_HZ)
    expected[begin : begin + len(whole)] = whole[: len(expected) - begin]
    scale = float(heard.samples @ expected / (expected @ expected))
    assert np.abs(heard.samples - scale * expected).max() < 0.01 * np.abs(heard.samples).max()


def test_a_sound_grows_as_the_robot_comes_nearer_and_fades_as_it_leaves() -> None:
    stamps_s = np.arange(80) / 10.0
    robot = np.column_stack([np.linspace(-8, 8, 80), np.full(80, 0.5), np.full(80, 1.0)])
    track = acoustic(
        open_air(), [sounding((0.0, 0.0, 1.0), 0.0, (0, 0.5, 1), beep(8.0))], stamps_s, robot, 8.0,
        np.random.default_rng(0), AcousticSettings(rate_hz=RATE_HZ, snr_db=60.0),
    )  # fmt: skip
    level = [loudness_db(Sound(track.samples[round(s * RATE_HZ) :][: RATE_HZ // 4], RATE_HZ)) for s in range(8)]
    nearest = int(np.argmax(level))
    assert nearest in (3, 4)
    assert np.all(np.diff(level[: nearest + 1]) > 0)
    assert np.all(np.diff(level[nearest:]) < 0)
    assert level[1] - level[0] == pytest.approx(20 * np.log10(7.75 / 5.75), abs=1.0)


def test_an_overlaid_sound_is_as_loud_as_the_rule_says() -> None:
    for distance_m, wanted_db in ((0.4, -20.0), (1.0, -20.0), (4.0, -32.0)):
        one = sounding((distance_m, 0.0, 1.0), 1.0, (0, 0, 1), beep())
        track = overlay([one], 3.0, np.random.default_rng(0), RATE_HZ, snr_db=50.0)
        piece = Sound(track.samples[round(1.1 * RATE_HZ) : round(1.9 * RATE_HZ)], RATE_HZ)
        assert loudness_db(piece) == pytest.approx(wanted_db, abs=0.3)
        assert loudness_db(Sound(track.samples[: RATE_HZ // 2], RATE_HZ)) == pytest.approx(-70.0, abs=3.0)
