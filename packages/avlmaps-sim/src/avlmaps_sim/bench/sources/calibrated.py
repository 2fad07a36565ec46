"""One bare room under varied conditions, and an array whose geometry is calibrated in place.

The room is 6 x 5 x 2.6 m. The robot drives past with a square of four; the sound is bursts of noise of 2 s at a random
place, and the candidates are the room's surfaces and the air in it.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from avlmaps.core.timeline import Trajectory
from avlmaps.maps.sources.calibrate import ArrayCalibration, calibrate
from avlmaps.maps.sources.candidates import CandidateGrid, Density
from avlmaps.maps.sources.correlation import SourceSettings
from avlmaps.maps.sources.find import find_sources
from avlmaps.recordings.audio import AudioTrack, Sound
from avlmaps.recordings.channels import ChannelSound, with_microphones, write_channels
from avlmaps.recordings.microphones import Microphones, microphones_named
from avlmaps_sim.bench.harness.figures import Table, in_percent, median_interval, wilson
from avlmaps_sim.hearing.acoustic import AcousticSettings
from avlmaps_sim.hearing.array import heard_by_array
from avlmaps_sim.hearing.schedule import Sounding, Source
from avlmaps_sim.mesh import Material
from avlmaps_sim.scene import Area, Scene, SceneBuilder
from avlmaps_sim.shapes import box, sheet

_X_M, _Y_M, _HEIGHT_M, _EAR_M = 6.0, 5.0, 2.6, 1.3
_RATE_HZ, _SECONDS, _ONSET_S = 16_000, 2.0, 1.5
_PAINT = Material((0.8, 0.8, 0.75))
_UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, slots=True)
class Condition:
    """What a trial varies."""

    rt60_s: float = 0.5  # how long the room takes to fall by 60 dB
    snr_db: float = 20.0  # of the sound at 1 m against the noise
    walked_m: float = 1.0  # how far the robot drives while it sounds
    pose_m: float = 0.0  # standard deviation of an error of place that a walk has throughout
    pose_deg: float = 0.0  # of heading
    others: int = 0  # how many more sources sound at once


USUAL = Condition()
CONDITIONS: dict[str, Condition] = {
    "usual: RT60 0.5 s, SNR 20 dB, 1 m driven": USUAL,
    **{f"RT60 {value:g} s": replace(USUAL, rt60_s=value) for value in (0.2, 0.8, 1.2)},
    **{f"SNR {value:g} dB": replace(USUAL, snr_db=value) for value in (0.0, 10.0, 30.0)},
    **{f"{value:g} m driven": replace(USUAL, walked_m=value) for value in (0.0, 0.3, 2.0)},
    "poses off by 5 cm and 3 degrees": replace(USUAL, pose_m=0.05, pose_deg=3.0),
    "two sounds at once": replace(USUAL, others=1),
}


def table(trials: int, seed: int) -> Table:
    """Return error and coverage of each condition."""
    rows: list[list[object]] = []
    for name, condition in CONDITIONS.items():
        found = [_trial(condition, np.random.default_rng([seed, number])) for number in range(trials)]
        median, low, high = median_interval(np.array([error for error, _ in found]))
        held = sum(inside for _, inside in found)
        rows.append([
            name, trials, round(median, 2), f"{low:.2f} to {high:.2f}", round(100.0 * held / trials, 1),
            in_percent(wilson(held, trials)),
        ])  # fmt: skip
    return {"columns": ["condition", "trials", "median error m", "95 %", "in 90 % region %", "95 %"], "rows": rows}


def _trial(condition: Condition, rng: np.random.Generator) -> tuple[float, bool]:
    """Return the error on the plan of one source, and whether the 90 % region holds it."""
    places = np.column_stack([
        rng.uniform(0.5, _X_M - 0.5, condition.others + 1), rng.uniform(0.4, 1.8, condition.others + 1),
        rng.uniform(0.2, 1.8, condition.others + 1),
    ])  # fmt: skip
    middle_x = float(rng.uniform(2.0, 4.0))
    count = 50
    stamps_s = np.arange(count) / 10.0
    at = np.clip((stamps_s - _ONSET_S) / _SECONDS, -0.2, 1.2) - 0.5
    poses = np.tile(np.eye(4), (count, 1, 1))
    poses[:, :3, :3] = np.array([[0, 0, 1], [-1, 0, 0], [0, -1, 0]])
    poses[:, :3, 3] = np.column_stack([middle_x + at * condition.walked_m, np.full(count, 3.2), np.full(count, _EAR_M)])
    sounding = [_bursts(place, rng) for place in places]
    array = microphones_named("square4")
    settings = AcousticSettings(_RATE_HZ, snr_db=condition.snr_db, rt60_s=condition.rt60_s)
    heard = heard_by_array(bare_room(), sounding, stamps_s, poses, array, count / 10.0, rng, settings)
    turn = Rotation.from_matrix(_about_z(np.deg2rad(condition.pose_deg) * rng.standard_normal()))
    believed = poses.copy()
    believed[:, :3, :3] = turn.as_matrix() @ poses[:, :3, :3]
    believed[:, :2, 3] += condition.pose_m * rng.standard_normal(2)
    with TemporaryDirectory() as folder:
        path = Path(folder) / "track.flac"
        write_channels(path, heard)
        track = with_microphones(AudioTrack.open(path), array)
        span = (_ONSET_S, _ONSET_S + _SECONDS)
        found = find_sources(track, Trajectory(stamps_s, believed), [span], surfaces(), _UP)
    assert found is not None
    plan, prior = CandidateGrid.of(found.place), found.prior.astype(np.float64)
    expected = found.expected[0].astype(np.float64)
    evidence = found.heard[0].astype(np.float64) + expected
    density = Density.of(plan, prior, evidence, expected, SourceSettings.of(len(array)))
    away = np.linalg.norm(places[:, :2] - density.position_m, axis=1)
    nearest = int(np.argmin(away))
    return float(away[nearest]), bool(density.region(0.9).ravel()[plan.cell_of(places[nearest][None, :2])[0]])


def _bursts(place: Float[np.ndarray, "3"], rng: np.random.Generator) -> Sounding:
    count = round(_SECONDS * _RATE_HZ)
    gate = (np.arange(count) + int(rng.integers(4000))) % (_RATE_HZ // 2) < _RATE_HZ // 6
    clip = Sound((0.1 * rng.standard_normal(count) * gate).astype(np.float32), _RATE_HZ)
    x, y, z = place.tolist()
    return Sounding(Source("knocking", (x, y, z), -1, "bursts", clip), _ONSET_S, _ONSET_S + _SECONDS, (0.0, 0.0, 0.0))


def _about_z(angle: float) -> Float[np.ndarray, "3 3"]:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def bare_room() -> Scene:
    """Return a room of 6 x 5 x 2.6 m with nothing in it."""
    corners = np.array([[0.0, 0.0], [_X_M, 0.0], [_X_M, _Y_M], [0.0, _Y_M]])
    builder = SceneBuilder("bare room", areas=[Area("bedroom", corners, 0.0, _HEIGHT_M, "bedroom#1")])
    builder.add("floor", sheet((0.0, 0.0, 0.0), (_X_M, 0.0, 0.0), (0.0, _Y_M, 0.0), _PAINT))
    for low, high in (
        ((-0.1, -0.1, 0.0), (_X_M + 0.1, 0.0, _HEIGHT_M)), ((-0.1, _Y_M, 0.0), (_X_M + 0.1, _Y_M + 0.1, _HEIGHT_M)),
        ((-0.1, 0.0, 0.0), (0.0, _Y_M, _HEIGHT_M)), ((_X_M, 0.0, 0.0), (_X_M + 0.1, _Y_M, _HEIGHT_M)),
    ):  # fmt: skip
        builder.add("wall", box(low, high, _PAINT))
    return builder.build()


def surfaces(step_m: float = 0.1) -> Float[np.ndarray, "n 3"]:
    """Return points on the floor and the walls of the room, metres."""

    def grid(*axes: np.ndarray) -> np.ndarray:
        return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))

    x, y, z = (np.arange(0.0, size, step_m) for size in (_X_M, _Y_M, _HEIGHT_M - 0.2))
    parts = [grid(x, y, np.zeros(1)), *(grid(np.array([side]), y, z) for side in (0.0, _X_M))]
    return np.concatenate([*parts, *(grid(x, np.array([side]), z) for side in (0.0, _Y_M))])


OFF_M, LATE_S = np.array([0.025, 0.025, 0.01]), 80e-6
"""Standard deviations of what is put wrong: each axis of a place, and a channel's delay."""
_RATE_HZ, _TICK_S = 16_000, 0.5
_PLACE, _MIDDLE = (3.2, 4.4, 0.9), np.array([3.0, 2.5, 1.1])
_HEADINGS = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])


@dataclass(frozen=True, slots=True, eq=False)
class Wrong:
    """An array as somebody measured it, and how it is.

    The given one has its places off and no delays; each channel is late by ``late_s``.
    """

    true: Microphones
    given: Microphones
    late_s: Float[np.ndarray, " m"]

    @classmethod
    def of(cls, true: Microphones, rng: np.random.Generator) -> "Wrong":
        """Put an array wrong; its middle and the mean delay stay."""
        late_s = LATE_S * rng.standard_normal(len(true))
        off = OFF_M * rng.standard_normal((len(true), 3))
        given = Microphones(true.position_m + off - off.mean(axis=0), true.camera_from_robot)
        return cls(true, given, late_s - late_s.mean())

    def track(self, heard: ChannelSound, path: Path) -> AudioTrack:
        """Return what the true array heard as this one records it, written into a file."""
        count = heard.samples.shape[1]
        hz = np.fft.rfftfreq(count, 1.0 / heard.rate_hz)
        late = np.stack([
            np.fft.irfft(np.fft.rfft(one) * np.exp(-2j * np.pi * hz * by_s), count)
            for one, by_s in zip(heard.samples, self.late_s, strict=True)
        ])  # fmt: skip
        write_channels(path, ChannelSound(late.astype(np.float32), heard.rate_hz))
        return with_microphones(AudioTrack.open(path), self.given)

    def off(self, array: Microphones) -> tuple[float, float]:
        """Return by how much an array errs: its worst place on the plan, metres, and its worst delay, seconds."""
        late_s = np.zeros(len(array)) if array.delay_s is None else array.delay_s
        away_m = np.linalg.norm((array.position_m - self.true.position_m)[:, :2], axis=1)
        return float(away_m.max()), float(np.abs(late_s - self.late_s).max())


def oval(seconds: float) -> Trajectory:
    """Return a drive round an oval of 3 x 2 m in the middle of the room."""
    stamps_s = np.arange(round(seconds * 10)) / 10.0
    phase = 2.0 * np.pi * stamps_s / seconds
    x, y = 1.5 * np.cos(phase), np.sin(phase)
    heading = np.arctan2(np.gradient(y), np.gradient(x))
    poses = np.tile(np.eye(4), (len(stamps_s), 1, 1))
    turn = np.tile(np.eye(3), (len(stamps_s), 1, 1))
    turn[:, 0, 0] = turn[:, 1, 1] = np.cos(heading)
    turn[:, 1, 0], turn[:, 0, 1] = np.sin(heading), -np.sin(heading)
    poses[:, :3, :3] = turn @ _HEADINGS
    poses[:, :3, 3] = _MIDDLE + np.column_stack([x, y, np.zeros(len(x))])
    return Trajectory(stamps_s, poses)


def calibrated(
    wrong: Wrong, settings: AcousticSettings, rng: np.random.Generator, path: Path, seconds: float = 24.0
) -> ArrayCalibration:
    """Record the drive with an array that is wrong, and calibrate it by that.

    The array's frame is level here, and the rate of the settings is not used.

    ``RecordingError``: the drive does not determine the array.
    """
    level, walk = (
        Wrong(Microphones(wrong.true.position_m), Microphones(wrong.given.position_m), wrong.late_s),
        oval(seconds),
    )
    count = round((seconds - _TICK_S) * _RATE_HZ)
    bursts = rng.standard_normal(count) * (np.arange(count) % (_RATE_HZ * _TICK_S) < _RATE_HZ / 6)
    clip = Sound((0.1 * bursts).astype(np.float32), _RATE_HZ)
    sounding = Sounding(Source("ticking", _PLACE, -1, "ticks", clip), 0.2, 0.2 + count / _RATE_HZ, (0.0, 0.0, 0.0))
    room = AcousticSettings(_RATE_HZ, snr_db=settings.snr_db, rt60_s=settings.rt60_s)
    heard = heard_by_array(bare_room(), [sounding], walk.stamps_s, walk.world_from_body, level.true, seconds, rng, room)
    return calibrate(level.track(heard, path), walk)
