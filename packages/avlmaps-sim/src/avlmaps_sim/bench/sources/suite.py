"""The suite ``avlmaps bench sources``: homes with three arrays, a measured room, one room under varied conditions."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from jaxtyping import Float

from avlmaps.core.errors import AvlmapsError
from avlmaps.maps.sources.candidates import CELL_M
from avlmaps.maps.sources.correlation import SPEED_M_S, SourceSettings, correlate, signs_of, steer, steer_pairs
from avlmaps_sim.bench.harness.figures import Table, in_percent, median_interval, wilson
from avlmaps_sim.bench.harness.workers import side_by_side
from avlmaps_sim.bench.sources import calibrated
from avlmaps_sim.bench.sources.homes import GIVEN, REFINED, WAYS, HomeJob, HomeOutcome, Placed, measure_home
from avlmaps_sim.scenes import open_scene

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

        ``AvlmapsError``: they are not there.
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


def measured_room(folder: Path, seed: int) -> Table:
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


HOMES = tuple(f"house:{seed}:held-out" for seed in range(1_000_000, 1_000_010))
_ROWS = (
    *(name for way in WAYS for name in (way, f"{way}, lexicon")), GIVEN, REFINED,
    "robot's place (the paper)", "nearest thing", "room's middle",
)  # fmt: skip
_PROMISED = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95)


@dataclass(frozen=True, slots=True)
class SourcesBench:
    """What the suite runs on."""

    homes: tuple[str, ...] = HOMES  # names of scenes
    rooms: Path | None = None  # folder of the measured room; None leaves it out
    trials: int = 12  # of each condition of the sweep; 0 leaves it out
    jobs: int = 0  # homes side by side; 0 takes as many as there are cores
    sounds: Path | None = None  # folder of clips; None for sounds made by rule


def run_sources(settings: SourcesBench, out: Path, seed: int) -> dict[str, Table]:
    """Measure, and return the tables. ``AvlmapsError``: the measured room is not there."""
    room = None if settings.rooms is None else measured_room(settings.rooms, seed)
    todo = [HomeJob(spec, out / "work", seed, settings.sounds) for spec in settings.homes]
    each = side_by_side(partial(measure_home, open_spec=open_scene), todo, settings.jobs, "sources")
    homes = [outcome for own in each for outcome in own]
    tables: dict[str, Table] = {
        "homes": table_of_homes(homes), "regions": table_of_regions(homes),
        "mended": table_of_mended(homes),
    }  # fmt: skip
    if room is not None:
        tables["a measured room"] = room
    if settings.trials:
        tables["one room, varied"] = calibrated.table(settings.trials, seed)
    return tables


def table_of_homes(homes: Sequence[HomeOutcome]) -> Table:
    """Return the table of all sounds of all homes, by array and baseline."""
    every = [placed for home in homes for placed in home.placed]
    rows = [_row(way, [one for one in every if one.array == way]) for way in _ROWS]
    count, heard = sum(home.sounds for home in homes), sum(home.heard for home in homes)
    specs = {home.spec for home in homes}
    columns = [
        "by", "sounds", "median error m", "95 %", "within 0.5 m %", "said %", "right room %", "95 %",
        "in 50 % region %", "in 90 % region %", "95 %", "90 % region m²", "right thing of 3 %", "of", "s a sound",
    ]  # fmt: skip
    note = (
        f"{heard} of {count} sounds of {len(specs)} homes were detected; the others count nowhere. Kinds are drawn "
        'for each home, in two sets on each walk. "said": the mean probability of the truth within 0.5 m.'
    )
    return {"columns": columns, "rows": [row for row in rows if row[1]], "note": note}


def table_of_regions(homes: Sequence[HomeOutcome]) -> Table:
    """Return for each way how many of the truths lie in the region of each probability."""
    every = [one for home in homes for one in home.placed if one.held_from is not None]
    rows: list[list[object]] = []
    for way in _ROWS:
        own = [one for one in every if one.array == way]
        if own:
            held = (100.0 * sum(one.is_in(share) for one in own) / len(own) for share in _PROMISED)
            rows.append([way, len(own), *(round(percent, 1) for percent in held)])
    columns = ["by", "sounds", *(f"in {100.0 * share:g} % region %" for share in _PROMISED)]
    return {"columns": columns, "rows": rows, "note": f"A region is of whole cells of {CELL_M:g} m, at least one."}


def table_of_mended(homes: Sequence[HomeOutcome]) -> Table:
    """Return by how much a device's offset was missed, and what calibration left of an array that was put wrong."""
    known = [home.mended for home in homes if home.mended is not None]
    given = [one for one in known if np.isfinite(one.places_m[0])]
    after = [one for one in given if np.isfinite(one.places_m[1])]
    said = [one for one in known if np.isfinite(one.device_off_deg)]
    measured: list[tuple[str, list[float]]] = [
        ("a device's offset, missed by degrees", [one.device_off_deg for one in said]),
        ("the standard deviation that is said of it, degrees", [one.device_sd_deg for one in said]),
        ("an array's worst place as given, cm", [100.0 * one.places_m[0] for one in given]),
        ("calibrated past a ticking thing, cm", [100.0 * one.places_m[1] for one in after]),
        ("its worst delay as given, µs", [1e6 * one.delays_s[0] for one in given]),
        ("calibrated, µs", [1e6 * one.delays_s[1] for one in after]),
    ]
    rows = [[name, len(own), round(float(np.median(own)), 2), round(max(own), 2)] for name, own in measured if own]
    note = f"{len(given) - len(after)} of {len(given)} calibrations were refused."
    return {"columns": ["what", "walks", "median", "most"], "rows": rows, "note": note}


def _row(way: str, own: Sequence[Placed]) -> list[object]:
    if not own:
        return [way, 0]
    error = np.array([one.error_m for one in own])
    median, low, high = median_interval(error)
    room = [one.room for one in own if one.room is not None]
    regions = [one for one in own if one.held_from is not None]
    things = [one.thing for one in own if one.thing is not None]
    in_50, in_90 = (sum(one.is_in(share) for one in regions) for share in (0.5, 0.9))

    def percent(hits: int, count: int) -> object:
        return round(100.0 * hits / count, 1) if count else ""

    return [
        way, len(own), round(median, 2), f"{low:.2f} to {high:.2f}", percent(int((error < 0.5).sum()), len(own)),
        round(100.0 * float(np.mean([one.right for one in regions])), 1) if regions else "",
        percent(sum(room), len(room)), in_percent(wilson(sum(room), len(room))),
        percent(in_50, len(regions)), percent(in_90, len(regions)),
        in_percent(wilson(in_90, len(regions))) if regions else "",
        round(float(np.median([one.area_90_m2 for one in regions])), 2) if regions else "",
        percent(sum(things), len(things)), len(things) or "",
        round(float(np.mean([one.elapsed_s for one in regions])), 2) if regions else "",
    ]  # fmt: skip
