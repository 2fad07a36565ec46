"""Sources in one measured room: impulse responses of one loudspeaker at 25 receivers, as arrays and as walks.

The room is empty, of 5.36 x 5.85 x 2.86 m, and the loudspeaker stands on the floor's plan at (3.36, 2.00), 1.50 m high.
Receivers of an array share one clock. Files are scaled to their own peaks, so a walk knows ratios of direct to
reverberant sound and no levels; 8 of the 25 have their sign turned, as a microphone has that is wired the other way
round, which ``signs_of`` finds.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from avlmaps.core.errors import AvlmapsError
from avlmaps.maps.sources.correlation import SPEED_M_S, SourceSettings, correlate, signs_of, steer, steer_pairs
from avlmaps_sim.bench.harness.figures import Table, median_interval

SIZE_M = np.array([5.36, 5.85, 2.86])
SOURCE_M = np.array([3.36, 2.00, 1.50])
_COARSE_M, _FINE_M, _FINE_REACH_M = 0.1, 0.02, 0.14
_DIRECT_S = 0.0025
_HEIGHTS_M, _NEAREST_M = (0.5, 1.0, 1.5), 0.3
_DIRECTIVE_DB = 4.0  # standard deviation of the cosine along each axis: some 10 dB from front to back
_NOISES_DB = (0.3, 0.6, 1.2, 2.4, 4.8)
_TRIALS, _WALKS, _SIGNAL_S = 20, 200, 1.0


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredRoom:
    """The room's responses."""

    place_m: Float[np.ndarray, "r 3"]
    response: Float[np.ndarray, "r n"]
    rate_hz: int

    @classmethod
    def read(cls, folder: Path) -> "MeasuredRoom":
        """Read the room from a folder that holds ``measured/S1R01.flac`` to ``S1R25.flac``.

        Raises:
            AvlmapsError: they are not there.
        """
        from avlmaps.recordings.audio import AudioTrack

        files = [folder / "measured" / f"S1R{number:02d}.flac" for number in range(1, 26)]
        if lost := [file for file in files if not file.is_file()]:
            raise AvlmapsError(f"{folder} lacks measured/{lost[0].name}; give the folder of the measured room.")
        read = [AudioTrack.open(file).read() for file in files]  # both channels of each are equal
        length = min(len(sound.samples) for sound in read)
        rows, columns = np.divmod(np.arange(25), 5)
        place = np.column_stack([3.68 - 0.5 * columns, 3.0 + 0.5 * rows, np.full(25, 1.2)])
        return cls(place, np.stack([sound.samples[:length] for sound in read]), read[0].rate_hz)


def arrays_of_four(room: MeasuredRoom, rng: np.random.Generator, trials: int = _TRIALS) -> Float[np.ndarray, " k"]:
    """Return the error of the source on the plan for random choices of four receivers, noise as the signal."""
    from scipy.signal import oaconvolve

    errors: list[float] = []
    coarse = _grid(np.array([0.1, 0.1, 0.1]), SIZE_M - 0.1, _COARSE_M)
    for _ in range(trials):
        chosen = rng.choice(25, 4, replace=False)
        dry = rng.standard_normal(round(_SIGNAL_S * room.rate_hz)).astype(np.float32)
        dry *= np.arange(len(dry)) % (room.rate_hz // 4) < room.rate_hz // 12  # bursts, with onsets
        heard = oaconvolve(dry[None], room.response[chosen], axes=1).astype(np.float32)
        heard = heard + 0.1 * heard.std() * rng.standard_normal(heard.shape).astype(np.float32)
        ears = room.place_m[chosen]
        found = correlate(heard, room.rate_hz, 0.0, 0.0, float(np.ptp(ears, axis=0).max() * np.sqrt(2.0)))
        half_cell = 0.5 * _COARSE_M / SPEED_M_S / found.step_s
        still = np.tile(ears, (len(found.at_s), 1, 1))
        sums = steer_pairs(found.smoothed(half_cell), still, coarse)
        signs = signs_of([(found, sums)], SourceSettings.of(4))
        at = coarse[int(np.argmax((signs[found.pair[:, 0]] * signs[found.pair[:, 1]]) @ sums))]
        near = np.array([_FINE_REACH_M] * 3)
        fine = _grid(at - near, at + near, _FINE_M)
        at = fine[int(np.argmax(steer(found.turned(signs).smoothed(0.2 * half_cell), still, fine)))]
        errors.append(float(np.linalg.norm(at[:2] - SOURCE_M[:2])))
    return np.array(errors)


def walks_of_ratios(room: MeasuredRoom, rng: np.random.Generator, stops: int = 8) -> Float[np.ndarray, " k"]:
    """Return the error on the plan for random walks of single receivers, by the ratio of direct to reverberant sound.

    The answer is the mean of the posterior over the room; the ratio at 1 m, its noise, and how the source sends to its
    front and back are not known.
    """
    ratio_db = np.array([direct_to_reverberant_db(one, room.rate_hz) for one in room.response])
    plan = _grid(np.array([0.1, 0.1, 0.0]), np.array([*(SIZE_M[:2] - 0.1), 0.0]), _COARSE_M)
    grid = np.concatenate([plan + np.array([0.0, 0.0, height]) for height in _HEIGHTS_M])
    errors: list[float] = []
    for _ in range(_WALKS):
        chosen = rng.choice(25, stops, replace=False)
        likely = np.exp(of_directive(ratio_db[chosen], room.place_m[chosen], grid))
        at = (grid * likely[:, None]).sum(axis=0) / likely.sum()
        errors.append(float(np.linalg.norm(at[:2] - SOURCE_M[:2])))
    return np.array(errors)


def of_directive(
    ratio_db: Float[np.ndarray, " k"], place_m: Float[np.ndarray, "k 3"], grid_m: Float[np.ndarray, "c 3"]
) -> Float[np.ndarray, " c"]:
    """Return the log-likelihood of each place, the greatest 0, of a source that may be louder to one side.

    Ratios of direct to reverberant sound fall by 20 dB for ten times the distance, and loudspeakers, people and dogs
    send less to their sides and back: by a cosine, of a strength and a direction that nobody knows. Ratio at 1 m,
    cosine and noise are integrated out.
    """
    away = place_m[:, None] - grid_m[None]
    azimuth = np.arctan2(away[..., 1], away[..., 0])
    unknown = np.stack([np.ones_like(azimuth), np.cos(azimuth), np.sin(azimuth)])  # (3, k, c)
    rest = ratio_db[:, None] + 20.0 * np.log10(np.maximum(np.linalg.norm(away, axis=2), _NEAREST_M))
    products, along = np.einsum("ikc,jkc->cij", unknown, unknown), np.einsum("ikc,kc->ci", unknown, rest)
    before = np.diag(np.array([0.0, 1.0, 1.0]) / _DIRECTIVE_DB**2)  # the ratio at 1 m may be anything
    found: list[np.ndarray] = []
    for noise_db in _NOISES_DB:
        precision = products / noise_db**2 + before
        mean = np.linalg.solve(precision, along[..., None] / noise_db**2)[..., 0]
        fits = ((rest**2).sum(axis=0) - (along * mean).sum(axis=1)) / noise_db**2
        found.append(-0.5 * (fits + np.linalg.slogdet(precision)[1]) - len(ratio_db) * np.log(noise_db))
    total = np.logaddexp.reduce(found)
    return total - total.max()


def direct_to_reverberant_db(response: Float[np.ndarray, " n"], rate_hz: int) -> float:
    """Return the energy of a response within 2.5 ms of its peak against all that follows, dB."""
    peak, reach = int(np.abs(response).argmax()), round(_DIRECT_S * rate_hz)
    energy = response.astype(np.float64) ** 2
    direct = energy[max(peak - reach, 0) : peak + reach].sum()
    return float(10.0 * np.log10(direct / max(energy[peak + reach :].sum(), 1e-20)))


def table(folder: Path, seed: int) -> Table:
    """Return the table of the measured room."""
    room, rng = MeasuredRoom.read(folder), np.random.default_rng(seed)
    middle_m = float(np.linalg.norm(SIZE_M[:2] / 2 - SOURCE_M[:2]))
    receivers_m = np.linalg.norm(room.place_m[:, :2] - SOURCE_M[:2], axis=1)
    rows: list[list[object]] = []
    for name, errors in (
        ("4 of 25 receivers as an array", arrays_of_four(room, rng)),
        ("8 single receivers, direct-to-reverberant ratio alone", walks_of_ratios(room, rng)),
        ("16 single receivers, the same", walks_of_ratios(room, rng, 16)),
        ("a receiver's own place (the paper)", receivers_m),
        ("room's middle", np.array([middle_m])),
    ):
        median, low, high = median_interval(errors)
        interval = f"{low:.2f} to {high:.2f}" if len(errors) > 1 else ""
        rows.append([name, len(errors), round(median, 3), interval])
    return {"columns": ["by", "choices", "median error m", "95 %"], "rows": rows}


def _grid(low: np.ndarray, high: np.ndarray, step_m: float) -> Float[np.ndarray, "k 3"]:
    axes = [np.arange(a, b + 1e-9, step_m) for a, b in zip(low.tolist(), high.tolist(), strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
