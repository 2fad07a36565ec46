"""A simulated sensor's faults: each one alone must do what it says, and all of them together what a real one does."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.camera import Pinhole
from avlmaps_sim.render import View
from avlmaps_sim.sensor import (
    CLEAN,
    KINECT,
    PRESETS,
    ColourFaults,
    DepthFaults,
    OdometryFaults,
    Sensor,
    SensorError,
    SensorSettings,
    Shift,
    drifted,
)  # fmt: skip

CAMERA = Pinhole(277.0, 277.0, 160.0, 120.0, 320, 240)


def flat(depth_m: float | np.ndarray = 2.0, strength: int = 255, value: int = 128) -> View:
    """Return a view of a grey wall that faces the camera."""
    shape = CAMERA.height, CAMERA.width
    depth = np.broadcast_to(np.float32(depth_m), shape).astype(np.float32).copy()
    index = np.zeros(shape, np.int32)
    return View(np.full((*shape, 3), value, np.uint8), depth, index, index, np.full(shape, strength, np.uint8))


def two_walls() -> View:
    """Return a near wall left of column 160 and a far one right of it."""
    return flat(np.where(np.arange(CAMERA.width) < 160, 1.0, 3.0)[None, :])


def depth_with(view: View, seed: int = 0, **faults: float) -> np.ndarray:
    sensor = Sensor(SensorSettings(depth=DepthFaults(**faults)))
    return sensor.spoil(view, CAMERA, np.random.default_rng(seed))[1]


def colour_with(view: View, seed: int = 0, shift: Shift | None = None, **faults: float) -> np.ndarray:
    sensor = Sensor(SensorSettings(colour=ColourFaults(**faults)))
    return sensor.spoil(view, CAMERA, np.random.default_rng(seed), shift)[0]


def test_a_clean_sensor_changes_nothing():
    view = two_walls()
    rgb, depth = Sensor(CLEAN).spoil(view, CAMERA, np.random.default_rng(0))
    assert np.array_equal(rgb, view.rgb)
    assert np.array_equal(depth, view.depth_m)


@pytest.mark.parametrize("name", PRESETS)
def test_the_same_generator_gives_the_same_faults_and_another_one_others(name):
    sensor, view = Sensor(PRESETS[name]), two_walls()
    first, again, other = (sensor.spoil(view, CAMERA, np.random.default_rng(seed)) for seed in (5, 5, 6))
    assert np.array_equal(first[0], again[0])
    assert np.array_equal(first[1], again[1])
    assert np.array_equal(first[1], other[1]) == (name == "clean")


def test_depth_noise_grows_with_the_square_of_the_range():
    spread = [depth_with(flat(z), baseline_m=0.075, noise_px=0.1).std() for z in (1.0, 2.0, 4.0)]
    assert spread[1] / spread[0] == pytest.approx(4.0, rel=0.1)
    assert spread[2] / spread[1] == pytest.approx(4.0, rel=0.1)
    # half as wide a picture has pixels twice as large: 0.1 pixels of 640 are 0.05 of these
    assert spread[0] == pytest.approx(0.05 / (277.0 * 0.075), rel=0.1)


def test_depth_comes_in_steps_of_the_shift():
    ramp = np.linspace(1.0, 4.0, CAMERA.width)[None, :]
    depth = depth_with(flat(ramp), baseline_m=0.075, step_px=0.25)
    shift = 277.0 * 0.075 / depth
    assert np.allclose(shift / 0.125, np.round(shift / 0.125), atol=1e-4)
    assert len(np.unique(depth)) < 150
    assert np.abs(depth - ramp).max() < 4.0**2 * 0.125 / (277.0 * 0.075)


@pytest.mark.parametrize(("baseline", "side"), [(0.075, 1), (-0.075, -1)])
def test_the_stripe_that_only_one_eye_sees_is_as_wide_as_parallax_makes_it(baseline, side):
    view = two_walls() if side > 0 else flat(two_walls().depth_m[:, ::-1])
    lost = depth_with(view, baseline_m=baseline) == 0
    wide = 277.0 * 0.075 * (1 / 1.0 - 1 / 3.0)
    assert np.abs(lost.sum(axis=1) - wide).max() <= 2
    columns = np.flatnonzero(lost.any(axis=0))
    assert columns.min() >= 160 if side > 0 else columns.max() < 160


def test_edges_lose_pixels_and_flat_places_none():
    lost = depth_with(two_walls(), edge_ratio=0.1, edge_loss=1.0) == 0
    assert lost[:, 159:161].all()
    assert not lost[:, :158].any()
    assert not lost[:, 162:].any()


@pytest.mark.parametrize(
    ("strength", "distance", "seen"), [(255, 2.0, True), (20, 2.0, False), (20, 0.6, True), (255, 6.5, False)]
)
def test_dark_slanted_or_far_surfaces_send_too_little_back(strength, distance, seen):
    depth = depth_with(flat(distance, strength), weakest=0.04)
    assert (depth > 0).all() == seen
    assert (depth > 0).any() == seen


def test_nothing_is_measured_out_of_range():
    ramp = np.linspace(0.1, 9.0, CAMERA.width)[None, :]
    depth = depth_with(flat(ramp), min_m=0.5, max_m=6.0)
    assert np.array_equal(depth > 0, np.broadcast_to((ramp >= 0.5) & (ramp <= 6.0), depth.shape))


def test_blobs_are_as_many_and_as_large_as_asked():
    lost = np.mean([(depth_with(flat(), seed, blobs=6.0, blob_px=10.0) == 0).mean() for seed in range(60)])
    radius = 5.0 + 0.5  # pixels of this picture
    assert lost == pytest.approx(6 * np.pi * radius**2 / (320 * 240), rel=0.35)


def test_jitter_frays_an_edge_but_moves_it_nowhere():
    depth = depth_with(two_walls(), jitter_px=4.0)
    near = (depth == 1.0).sum(axis=1)
    assert set(np.unique(depth)) == {1.0, 3.0}
    assert near.std() > 0.3
    assert near.mean() == pytest.approx(160.0, abs=0.5)
    assert (depth[:, :140] == 1.0).all()


def test_a_stop_more_light_raises_values_by_the_root_of_two():
    rgb = colour_with(flat(value=100), shift=Shift(1.0))
    assert abs(rgb.mean() - 100 * np.sqrt(2)) < 1.0


def test_white_balance_moves_red_and_blue_against_green():
    red, green, blue = colour_with(flat(value=100), shift=Shift(0.0, 1.2, 0.8))[0, 0].astype(int)
    assert red > green > blue
    assert abs(green - 100) <= 1


def test_colour_noise_has_the_spread_asked_for_and_moves_no_mean():
    rgb = colour_with(flat(value=128), noise=4.0).astype(float)
    assert rgb.std() == pytest.approx(4.0, rel=0.1)
    assert rgb.mean() == pytest.approx(128.0, abs=0.2)
    assert colour_with(flat(value=10), noise=4.0).astype(float).std() < 3.0


def test_corners_are_darker_by_the_share_asked_for():
    rgb = colour_with(flat(value=200), vignetting=0.3).astype(float)
    assert rgb[120, 160, 0] == pytest.approx(200, abs=1)
    assert rgb[0, 0, 0] == pytest.approx(140, abs=2)


def test_blur_keeps_the_light_and_softens_edges():
    view = flat()
    view.rgb[:, 160:] = 20
    for faults in ({"blur_px": 8.0}, {"defocus_px": 2.0}):
        rgb = np.stack([colour_with(view, seed, **faults) for seed in range(8)]).astype(float)
        assert rgb.mean() == pytest.approx(view.rgb.mean(), abs=0.5)
        steepest = np.abs(np.diff(rgb, axis=2)).max(axis=2).mean()
        assert steepest < 80


def test_jpeg_leaves_traces_that_grow_as_its_quality_falls():
    view = flat()
    view.rgb[:] = np.random.default_rng(0).integers(0, 256, view.rgb.shape, np.uint8)
    off = [np.abs(colour_with(view, jpeg_quality=q).astype(int) - view.rgb).mean() for q in (100, 90, 40)]
    assert off[0] == 0
    assert 0 < off[1] < off[2]


def test_colours_drift_slowly_when_they_are_told_to():
    def roughness(drift_frames: float) -> float:
        faults = ColourFaults(exposure_stops=0.5, white_balance=0.1, drift_frames=drift_frames)
        stops = np.array(
            [s.stops for s in Sensor(SensorSettings(colour=faults)).shifts(3000, np.random.default_rng(1))]
        )
        assert stops.std() == pytest.approx(0.5, rel=0.35)
        return float(np.diff(stops).std())

    assert roughness(50.0) < 0.25 * roughness(0.0)


def test_a_kinect_loses_a_few_percent_of_a_wall_and_is_millimetres_off_at_two_metres():
    depth = Sensor(KINECT).spoil(flat(2.0), CAMERA, np.random.default_rng(0))[1]
    assert (depth == 0).mean() < 0.03
    assert 0.002 < np.abs(depth[depth > 0] - 2.0).mean() < 0.03


@pytest.mark.parametrize("wrong", [{"min_m": 3.0, "max_m": 2.0}, {"noise_px": -1.0}, {"edge_loss": 1.5}])
def test_faults_that_no_sensor_has_are_refused(wrong):
    with pytest.raises(SensorError):
        DepthFaults(**wrong)


@pytest.mark.parametrize("wrong", [{"noise": -1.0}, {"vignetting": 1.0}, {"jpeg_quality": 0}])
def test_colour_faults_that_no_sensor_has_are_refused(wrong):
    with pytest.raises(SensorError):
        ColourFaults(**wrong)


def drive(n: int = 200) -> np.ndarray:
    """Return poses of a level camera that drives 0.1 m a frame in a wide curve, looking ahead."""
    heading = np.linspace(0.0, 2.0, n)
    poses = np.tile(np.eye(4), (n, 1, 1))
    step = 0.1 * np.column_stack([np.cos(heading), np.sin(heading)])
    poses[1:, :2, 3] = np.cumsum(step[:-1], axis=0)
    poses[:, 2, 3] = 1.4
    c, s, zero = np.cos(heading), np.sin(heading), np.zeros(n)
    poses[:, :3, 0] = np.stack([s, -c, zero], axis=1)
    poses[:, :3, 1] = [0.0, 0.0, -1.0]
    poses[:, :3, 2] = np.stack([c, s, zero], axis=1)
    return poses


PERFECT = OdometryFaults(along=0.0, heading_per_m=0.0, heading_per_rad=0.0, scale=0.0)


def test_perfect_odometry_is_the_truth():
    assert np.allclose(drifted(drive(), np.random.default_rng(0), PERFECT), drive())


@given(seed=st.integers(0, 1000))
def test_drifted_poses_begin_true_stay_level_and_stay_rigid(seed):
    true, seen = drive(), drifted(drive(), np.random.default_rng(seed))
    assert np.array_equal(seen[0], true[0])
    assert np.allclose(seen[:, 2], true[:, 2])  # heights and tilts are as they were
    assert np.allclose(seen[:, :3, :3] @ seen[:, :3, :3].transpose(0, 2, 1), np.eye(3), atol=1e-9)


def test_drift_grows_with_the_root_of_the_way():
    faults = replace(PERFECT, along=0.02)
    ends = np.array([drifted(drive(), np.random.default_rng(s), faults)[[50, 199], :2, 3] for s in range(300)])
    spread = np.sqrt(np.square(ends - drive()[[50, 199], :2, 3]).mean(axis=(0, 2)))
    assert spread == pytest.approx(0.02 * np.sqrt([5.0, 19.9]), rel=0.15)


def test_an_error_of_heading_turns_the_way_that_follows():
    faults = replace(PERFECT, heading_per_m=0.05)
    seen, true = drifted(drive(), np.random.default_rng(3), faults), drive()
    step_seen, step_true = np.diff(seen[:, :3, 3], axis=0), np.diff(true[:, :3, 3], axis=0)
    forward_seen, forward_true = seen[:-1, :3, 2], true[:-1, :3, 2]
    assert np.allclose(np.sum(step_seen * forward_seen, axis=1), np.sum(step_true * forward_true, axis=1))
    assert np.linalg.norm(seen[-1, :2, 3] - true[-1, :2, 3]) > 0.1
