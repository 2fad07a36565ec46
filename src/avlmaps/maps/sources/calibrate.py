"""Calibration of an array in place: where its microphones are and how late its channels, from one still source.

The robot drives past something that sounds and stays where it is. Each frame with an onset gives the delay of each pair
of channels (the peak of GCC-PHAT near the predicted one). Nonlinear least squares find the places, the delays of the
channels and the place of the source that explain them all along the odometry. The middle of the array and the mean
delay stay as given: no delay between channels shows them well, and no steering needs them.
"""

from dataclasses import dataclass, replace

import numpy as np

from avlmaps.core.arrays import Bool, Float
from avlmaps.core.columns import concat
from avlmaps.core.errors import RecordingError
from avlmaps.core.poses import apply, from_rotation, inverse, rotation_to_level
from avlmaps.core.timeline import Trajectory
from avlmaps.core.wording import option
from avlmaps.maps.sources.correlation import (
    MOST_MICROPHONES,
    SPEED_M_S,
    Correlations,
    SourceSettings,
    correlate,
    loudest_frames,
    signs_of,
    steer,
    steer_pairs,
)
from avlmaps.recordings.audio import AudioTrack
from avlmaps.recordings.channels import read_channels
from avlmaps.recordings.microphones import Microphones

_BLOCK_S, _FRAMES_A_BLOCK, _MOST_FRAMES = 10.0, 60, 600
_HIGH_HZ = 7000.0  # sharper peaks than steering bears: they are sought near the predicted delay alone
_SLACK_M = 0.2  # how much farther apart than given the channels may seem
_GRID_M, _ROUND_M, _HEIGHTS_M = 0.3, 4.0, (-1.0, -0.5, 0.0, 0.5)
_SMOOTHING = 5.0
_WINDOWS_S = (250e-6, 150e-6, 80e-6, 60e-6, 60e-6)  # round the predicted delay, one solution after the other
_LEAST_PEAK = 0.3  # of the greatest possible correlation
_MOST_TRIES = 200  # of the unknowns: drives that determine them take 110 at most, others never settle
_SPREAD_S = 15e-6  # usual error of a peak
_FEWEST = 60  # frames with measured delays
# What the walk must leave of doubt at most, one standard deviation, and how badly the result may fit.
WORST_PLACE_M, WORST_DELAY_S, WORST_RESIDUAL_S = 0.01, 30e-6, 45e-6
MOST_MOVED_M = 0.1
LEAST_EXPLAINED = 0.9  # of the clear delays: 1.0 in rooms with one source, 0.3 to 0.8 with several


@dataclass(frozen=True, slots=True, eq=False)
class ArrayCalibration:
    """A refined array."""

    microphones: Microphones  # the array
    source_m: Float[np.ndarray, "3"]  # where the source is, world
    before_s: float  # residual of the delays with the given array, 1.48 times the median of its size
    after_s: float  # with the refined one
    place_sd_m: Float[np.ndarray, " m"]  # of each place along the axis that is known least; held axes are left out
    delay_sd_s: Float[np.ndarray, " m"]  # of each channel's delay
    moved_m: Float[np.ndarray, " m"]  # how far each microphone is from where it was given
    frames: int  # how many had a measured delay
    held_heights: bool  # the walk does not show heights, so that z stays as given
    turned: tuple[int, ...] = ()  # channels that are wired the other way round, which is taken back


def calibrate(track: AudioTrack, walk: Trajectory, between_s: tuple[float, float] | None = None) -> ArrayCalibration:
    """Refine the places of the microphones, measured to centimetres, and the delays of the channels.

    One source sounds between ``between_s``, the recording's time, or all the time. ``RecordingError``: there is no
    array, the sound is too little or of no still source, or the walk does not determine the array; with the numbers.
    """
    array = track.microphones
    if array is None or len(array) < 2:
        raise RecordingError(
            "There is no array to calibrate: the recording gives no places of two or more microphones; give them "
            f"({option('microphones', 'FILE')})."
        )
    begin_s, end_s = _span(track, walk, between_s)
    found = _frames(track, array, begin_s, end_s)
    if len(found.at_s) < _FEWEST:
        raise RecordingError(_too_little(len(found.at_s), begin_s, end_s))
    fit = _Fit.of(found, array, walk)
    signs = fit.signs()
    fit = replace(fit, found=found.turned(signs))
    start = np.concatenate([np.zeros(fit.basis.shape[1] * 4), fit.seek()])
    solution, measured = fit.solve(start, hold_heights=False)
    covered = fit.covariance(solution, measured, hold_heights=False)
    held = bool(covered[0][:, 2].max() > WORST_PLACE_M)
    if held:
        solution, measured = fit.solve(start, hold_heights=True)
        covered = fit.covariance(solution, measured, hold_heights=True)
    place_sd, delay_sd = covered
    frames = int(np.isfinite(measured).any(axis=1).sum())
    if frames < _FEWEST:
        raise RecordingError(_too_little(frames, begin_s, end_s))
    worst = int(place_sd.max(axis=1).argmax())
    if place_sd.max() > WORST_PLACE_M or delay_sd.max() > WORST_DELAY_S:
        raise RecordingError(
            f"The walk does not determine the array: the place of microphone {worst + 1} would be known to "
            f"{100 * place_sd[worst].max():.1f} cm and a channel's delay to {1e6 * delay_sd.max():.0f} µs (one "
            f"standard deviation), where {100 * WORST_PLACE_M:g} cm and {1e6 * WORST_DELAY_S:g} µs are needed. Let the "
            "robot turn on the spot and drive past the source on both sides, at 1 to 3 m from it."
        )
    after_s, explained = _scale(fit.residual_s(solution, measured)), fit.explained(measured)
    if explained < LEAST_EXPLAINED:
        raise RecordingError(
            f"One still source explains {explained:.0%} of the clear delays alone ({LEAST_EXPLAINED:.0%} are needed): "
            f"several things sounded, or one that moved. Give the time when a single source sounds "
            f"({option('between', 'BEGIN END')}); are poses and clocks right?"
        )
    if after_s > WORST_RESIDUAL_S:
        raise RecordingError(
            f"No array explains the delays: they differ by {1e6 * after_s:.0f} µs (at most "
            f"{1e6 * WORST_RESIDUAL_S:g}) from those of one still source. Give the time when a single source sounds "
            f"({option('between', 'BEGIN END')}), in a room with few echoes; are poses and clocks right?"
        )
    place, late_s = fit.split(solution)
    moved_m = np.linalg.norm(place - array.position_m, axis=1)
    if moved_m.max() > MOST_MOVED_M:
        raise RecordingError(
            f"Microphone {int(moved_m.argmax()) + 1} would lie {100 * moved_m.max():.0f} cm from its given place, more "
            f"than the {100 * MOST_MOVED_M:g} cm that a ruler may be off: a source that moves with the robot looks so, "
            "and so do channels in another order. Let the source stand still in the room, and check the given places."
        )
    refined = replace(array, position_m=place, delay_s=late_s if array.delay_s is None else array.delay_s + late_s)
    as_given = fit.with_source(np.concatenate([np.zeros(len(solution) - 3), solution[-3:]]), measured)
    return ArrayCalibration(
        refined, solution[-3:], _scale(fit.residual_s(as_given, measured)), after_s, place_sd.max(axis=1), delay_sd,
        moved_m, frames, held, tuple(np.flatnonzero(signs < 0.0).tolist()),
    )  # fmt: skip


def _span(track: AudioTrack, walk: Trajectory, between_s: tuple[float, float] | None) -> tuple[float, float]:
    first_s, last_s = max(track.start_s, float(walk.stamps_s[0])), min(track.end_s, float(walk.stamps_s[-1]))
    begin_s, end_s = between_s or (first_s, last_s)
    if not first_s - 1e-6 <= begin_s < end_s <= last_s + 1e-6:
        raise RecordingError(
            f"There is no sound with poses from {begin_s:g} to {end_s:g} s; both are there from {first_s:.2f} to "
            f"{last_s:.2f} s."
        )
    return begin_s, end_s


def _too_little(frames: int, begin_s: float, end_s: float) -> str:
    return (
        f"Too little sounds from {begin_s:.1f} to {end_s:.1f} s to calibrate by: {frames} frames have a clear onset, "
        f"{_FEWEST} are needed. Let something tick or click (a metronome, keys) while the robot drives."
    )


def _frames(track: AudioTrack, array: Microphones, begin_s: float, end_s: float) -> Correlations:
    longest_m = array.longest_m + _SLACK_M
    pieces: list[Correlations] = []
    count = max(int(np.ceil((end_s - begin_s) / _BLOCK_S)), 1)
    each = min(_FRAMES_A_BLOCK, max(_MOST_FRAMES // count, 4))
    for at_s in np.linspace(begin_s, end_s, count + 1)[:-1].tolist():
        sound = read_channels(track, at_s, min(at_s + _BLOCK_S, end_s))
        found = correlate(sound.samples, sound.rate_hz, at_s, 0.0, longest_m, delay_s=array.delay_s, high_hz=_HIGH_HZ)
        pieces.append(found.take(loudest_frames(found, each)))
    first = pieces[0]
    found = replace(concat(pieces, first_s=first.first_s, step_s=first.step_s), pair=first.pair)
    return found.take(np.flatnonzero((found.at_s >= begin_s) & (found.at_s <= end_s)))


_Delays = Float[np.ndarray, "f p"]  # that were measured, of each frame and pair; NaN where there is none, seconds


@dataclass(frozen=True, slots=True, eq=False)
class _Fit:
    """The unknowns are, in this order: places (m - 1, 3) and delays (m - 1) over ``basis``, and the source (3)."""

    found: Correlations
    array: Microphones  # as given
    world_from_robot: Float[np.ndarray, "f 4 4"]  # of each frame
    basis: Float[np.ndarray, "m n"]  # orthonormal changes that leave the mean as it is

    @classmethod
    def of(cls, found: Correlations, array: Microphones, walk: Trajectory) -> "_Fit":
        count = len(array)
        basis = np.linalg.svd(np.eye(count) - 1.0 / count)[0][:, : count - 1]
        return cls(found, array, walk.at(found.at_s) @ array.camera_from_robot, basis)

    def signs(self) -> Float[np.ndarray, " m"]:
        if not 3 <= len(self.array) <= MOST_MICROPHONES:
            return np.ones(len(self.array))
        found, ears, place = self._grid()
        return signs_of([(found, steer_pairs(found, ears, place))], SourceSettings.of(len(self.array)))

    def seek(self) -> Float[np.ndarray, "3"]:
        found, ears, place = self._grid()
        return place[int(np.argmax(steer(found, ears, place)))]

    def _grid(self) -> tuple[Correlations, Float[np.ndarray, "k m 3"], Float[np.ndarray, "c 3"]]:
        up = self.world_from_robot[:, :3, 2].mean(axis=0)
        level = from_rotation(rotation_to_level(up / np.linalg.norm(up)))
        ears = self._ears(self.array.position_m)
        middle = apply(level, ears.mean(axis=1))
        low, high = middle.min(axis=0) - _ROUND_M, middle.max(axis=0) + _ROUND_M
        axes = [np.arange(low[0], high[0], _GRID_M), np.arange(low[1], high[1], _GRID_M),
                float(np.median(middle[:, 2])) + np.array(_HEIGHTS_M)]  # fmt: skip
        place = apply(inverse(level), np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3))
        some = np.unique(np.linspace(0, len(ears) - 1, min(len(ears), 200)).astype(int))
        return self.found.take(some).smoothed(_SMOOTHING), ears[some], place

    def solve(self, start: Float[np.ndarray, " n"], hold_heights: bool) -> tuple[Float[np.ndarray, " n"], _Delays]:
        free = self._free(hold_heights)
        solution = start.copy()
        solution[: len(free)][~free] = 0.0
        measured = self._measure(solution, _WINDOWS_S[0])
        # The source alone at first: the array is nearly right, its place is a cell of the grid.
        solution = self.with_source(solution, measured)
        for window_s in _WINDOWS_S[1:]:
            measured = self._measure(solution, window_s)
            solution = self._least_squares(solution, free, measured)
        return solution, measured

    def with_source(self, solution: Float[np.ndarray, " n"], measured: _Delays) -> Float[np.ndarray, " n"]:
        return self._least_squares(solution, np.arange(len(solution)) >= len(solution) - 3, measured)

    def _least_squares(
        self, solution: Float[np.ndarray, " n"], chosen: Bool[np.ndarray, " n"], measured: _Delays
    ) -> Float[np.ndarray, " n"]:
        from scipy.optimize import least_squares

        def residual(values: Float[np.ndarray, " k"]) -> np.ndarray:
            return self.residual_s(_with(solution, chosen, values), measured) / _SPREAD_S

        found = least_squares(residual, solution[chosen], loss="cauchy", x_scale="jac", max_nfev=_MOST_TRIES)
        return _with(solution, chosen, found.x)

    def covariance(
        self, solution: Float[np.ndarray, " n"], measured: _Delays, hold_heights: bool
    ) -> tuple[Float[np.ndarray, "m 3"], Float[np.ndarray, " m"]]:
        from scipy.optimize import approx_fprime

        free = np.flatnonzero(self._free(hold_heights))
        unknown = np.full((len(self.array), 3), np.inf), np.full(len(self.array), np.inf)
        if np.isfinite(measured).sum() <= len(free):
            return unknown

        def residual(values: Float[np.ndarray, " k"]) -> np.ndarray:
            return self.residual_s(_with(solution, free, values), measured)

        slope = approx_fprime(solution[free], residual, 1e-6)
        # Pairs repeat one another (m - 1 of m (m - 1) / 2 are independent), and so do frames that overlap by half.
        spread_s = _scale(self.residual_s(solution, measured)) * np.sqrt(len(self.array))
        inner = np.linalg.pinv(slope.T @ slope, rcond=1e-12) * spread_s**2
        blind = np.linalg.svd(slope, compute_uv=False)
        if blind[-1] < 1e-9 * blind[0]:
            return unknown
        whole = np.zeros((len(solution), len(solution)))
        whole[np.ix_(free, free)] = inner
        count = self.basis.shape[1]
        of_place = whole[: 3 * count, : 3 * count].reshape(count, 3, count, 3)
        place = np.einsum("ma,aibi,mb->mi", self.basis, of_place, self.basis)
        delay = np.einsum("ma,ab,mb->m", self.basis, whole[3 * count : -3, 3 * count : -3], self.basis)
        return np.sqrt(np.maximum(place, 0.0)), np.sqrt(np.maximum(delay, 0.0)) * 1e-3

    def residual_s(self, solution: Float[np.ndarray, " n"], measured: _Delays) -> Float[np.ndarray, " k"]:
        return (measured - self._predicted_s(solution))[np.isfinite(measured)]

    def explained(self, measured: _Delays) -> float:
        clear, used = self.found.curve.max(axis=2) > _LEAST_PEAK * self.found.weight[:, None], np.isfinite(measured)
        return float(used.sum() / max(int((clear | used).sum()), 1))

    def _free(self, hold_heights: bool) -> Bool[np.ndarray, " n"]:
        count = self.basis.shape[1]
        free = np.ones(4 * count + 3, bool)
        free[2 : 3 * count : 3] = not hold_heights
        return free

    def split(self, solution: Float[np.ndarray, " n"]) -> tuple[Float[np.ndarray, "m 3"], Float[np.ndarray, " m"]]:
        count = self.basis.shape[1]
        place = self.array.position_m + self.basis @ solution[: 3 * count].reshape(count, 3)
        return place, 1e-3 * self.basis @ solution[3 * count : 4 * count]

    def _ears(self, place: Float[np.ndarray, "m 3"]) -> Float[np.ndarray, "f m 3"]:
        turned = (self.world_from_robot[:, :3, :3].reshape(-1, 3) @ place.T).reshape(-1, 3, len(place))
        return np.swapaxes(turned, 1, 2) + self.world_from_robot[:, None, :3, 3]

    def _predicted_s(self, solution: Float[np.ndarray, " n"]) -> Float[np.ndarray, "f p"]:
        place, late_s = self.split(solution)
        arrival_s = np.linalg.norm(self._ears(place) - solution[-3:], axis=2) / SPEED_M_S + late_s
        one, other = self.found.pair.T
        return arrival_s[:, one] - arrival_s[:, other]

    def _measure(self, solution: Float[np.ndarray, " n"], window_s: float) -> _Delays:
        curve, step_s = self.found.curve, self.found.step_s
        reach = max(int(np.ceil(window_s / step_s)), 2)
        middle = np.rint((self._predicted_s(solution) - self.found.first_s) / step_s).astype(np.int64)
        inside = (middle > reach) & (middle < curve.shape[2] - reach - 1)
        middle = np.clip(middle, reach + 1, curve.shape[2] - reach - 2)
        near = np.take_along_axis(curve, middle[..., None] + np.arange(-reach - 1, reach + 2), axis=2)
        best = 1 + near[..., 1:-1].argmax(axis=2)
        left, top, right = (np.take_along_axis(near, (best + by)[..., None], axis=2)[..., 0] for by in (-1, 0, 1))
        is_peak = (top >= left) & (top >= right)
        bend = left - 2.0 * top + right
        part = np.where(bend < 0.0, 0.5 * (left - right) / np.where(bend < 0.0, bend, 1.0), 0.0)
        delay_s = self.found.first_s + (middle - reach - 1 + best + part) * step_s
        used = inside & is_peak & (top > _LEAST_PEAK * self.found.weight[:, None])
        return np.where(used, delay_s.astype(np.float64), np.nan)


def _with(solution: Float[np.ndarray, " n"], chosen: np.ndarray, values: Float[np.ndarray, " k"]) -> np.ndarray:
    whole = solution.copy()
    whole[chosen] = values
    return whole


def _scale(residual: Float[np.ndarray, " k"]) -> float:
    return float(1.4826 * np.median(np.abs(residual))) if len(residual) else np.inf
