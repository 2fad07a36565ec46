"""The suite ``avlmaps bench sources``: homes with three arrays, a measured room, one room under varied conditions."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from avlmaps.maps.sources.candidates import CELL_M
from avlmaps_sim.bench.harness.figures import Table, in_percent, median_interval, wilson
from avlmaps_sim.bench.harness.workers import side_by_side
from avlmaps_sim.bench.sources import calibrated, measured
from avlmaps_sim.bench.sources.homes import GIVEN, REFINED, WAYS, HomeJob, HomeOutcome, Placed, measure_home
from avlmaps_sim.scenes import open_scene

HOMES = tuple(f"house:{seed}:held-out" for seed in range(1_000_000, 1_000_010))
_ROWS = (
    *(name for way in WAYS for name in (way, f"{way}, lexicon")), GIVEN, REFINED,
    "robot's place (the paper)", "nearest thing", "room's middle",
)  # fmt: skip
_PROMISED = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95)


@dataclass(frozen=True, slots=True)
class SourcesBench:
    """What the suite runs on.

    Attributes:
        homes: names of scenes.
        rooms: folder of the measured room; None leaves it out.
        trials: of each condition of the sweep; 0 leaves it out.
        jobs: homes side by side; 0 takes as many as there are cores.
        sounds: folder of clips; None for sounds made by rule.
    """

    homes: tuple[str, ...] = HOMES
    rooms: Path | None = None
    trials: int = 12
    jobs: int = 0
    sounds: Path | None = None


def run_sources(settings: SourcesBench, out: Path, seed: int) -> dict[str, Table]:
    """Measure, and return the tables.

    Raises:
        AvlmapsError: the measured room is not there.
    """
    room = None if settings.rooms is None else measured.table(settings.rooms, seed)
    todo = [HomeJob(spec, out / "work", seed, settings.sounds) for spec in settings.homes]
    each = side_by_side(
        partial(measure_home, open_spec=open_scene), todo, settings.jobs, "sources", lambda one: one.spec
    )
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
