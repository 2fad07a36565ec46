"""Where a map of another day lies in this one: found by its pictures, held against the surfaces; and a map's days."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from avlmaps.core.arrays import Float, Int
from avlmaps.core.errors import MapError
from avlmaps.core.poses import apply
from avlmaps.core.timeline import is_in_future
from avlmaps.days.align import NotTheSamePlaceError, consensus, gather_votes, require_alike, require_upright
from avlmaps.days.evidence import DayViews
from avlmaps.days.settings import MergeSettings
from avlmaps.days.surfaces import Occupied, refine
from avlmaps.maps.store.manifest import RecordingInfo, Visit
from avlmaps.maps.store.reader import StoredMap
from avlmaps.recordings.types import Recording

DEFAULTS = MergeSettings()
_CLOCK_S = 1e8  # later stamps count from 1970: they are a clock's
_LEAST_COMMON = 3
_IDENTITY = tuple(tuple(float(value) for value in row) for row in np.eye(4))


@dataclass(frozen=True, slots=True)
class FoundMap:
    """Where another map lies in this one, and the numbers that say so.

    Attributes:
        map_from_other: 4x4.
        checks: keyframes tried, located and agreeing, how far those stand apart, the surfaces' distance and agreement.
    """

    map_from_other: Float[np.ndarray, "4 4"]
    checks: dict[str, float]


def find_other(
    stored: StoredMap, other: StoredMap, settings: MergeSettings = DEFAULTS, known: Occupied | None = None
) -> FoundMap:
    """Return where another map lies in this one, without a guess; ``known`` are this one's voxels, where they are had.

    Raises:
        MapError: the maps have other voxels or models, or no keyframes.
        NotTheSamePlaceError: the pictures do not agree, or the surfaces contradict each other.
    """
    require_alike(stored, other)
    rng = np.random.default_rng(settings.seed)
    votes = gather_votes(stored, other, settings.align, rng)
    first, checks = consensus(votes, settings.align, (stored.path, other.path))
    require_upright(first, stored.up_in_world, other.up_in_world, settings.align)
    grid = stored.grid
    points, others = (grid.centre_of(np.asarray(one.voxels.index)) for one in (stored, other))
    fine = first
    if checks["votes_off_m"] > settings.align.refine_from * grid.voxel_size_m:
        fine, off_m = refine(points, others, first, rng)
        checks["surface_off_m"] = round(off_m, 4)
    known = known or Occupied.of(np.asarray(stored.voxels.index), grid)
    checks |= _agreement(stored, other.path, apply(fine, others), known, settings)
    return FoundMap(fine, checks)


def _agreement(
    stored: StoredMap, other: Path, points: Float[np.ndarray, "n 3"], known: Occupied, settings: MergeSettings
) -> dict[str, float]:
    """Return how much of the other map's surface (``points``) lies on this one's, of what this one looked at.

    Raises:
        NotTheSamePlaceError: too little, or too little was looked at.
    """
    grid, wanted = stored.grid, settings.align
    on_surface = known.near(points)
    index = grid.index_of(points)
    free = np.zeros(len(index), np.int64)
    for views in views_of(stored):
        free += views.through(index, grid)
    through = (free >= settings.changes.through_views) & ~on_surface
    looked = int(on_surface.sum() + through.sum())
    share = float(on_surface.sum() / max(looked, 1))
    if looked < wanted.least_looked or share < wanted.least_agreement:
        raise NotTheSamePlaceError(
            f"This is not seen to be the same place: of {looked} voxels of {other} where {stored.path} looked, "
            f"{share:.0%} lie on its surface and the others where it saw through; {wanted.least_agreement:.0%} of at "
            f"least {wanted.least_looked} must. Merge maps of one building that saw some of the same rooms."
        )
    return {"looked": looked, "agreement": round(share, 4)}


def visits_of(stored: StoredMap) -> tuple[Visit, ...]:
    """Return the days of a map: the one of its recording, where it was not merged."""
    info = stored.info
    if info.visits:
        return info.visits
    stamps = np.asarray(stored.keyframes.stamp_s)
    begin = float(stamps.min(initial=np.inf)) if len(stamps) else 0.0
    seen = np.asarray(stored.voxels.last_seen_s)
    begin = min(begin, float(seen.min(initial=begin)))
    end = max(float(stamps.max(initial=begin)), float(seen.max(initial=begin)))
    day = day_of(clock_s(info.recording, begin))
    return (
        Visit(
            day=day, recording=info.recording, begin_s=begin, end_s=end, shift_s=0.0, map_from_recording=_IDENTITY,  # pyright: ignore[reportArgumentType]
            rig=info.rig, frames=info.counts.frames,
        ),
    )  # fmt: skip


def day_of(at_s: float | None) -> str:
    """Return the day of a moment; "" where no clock said it."""
    return "" if at_s is None else datetime.fromtimestamp(at_s, UTC).date().isoformat()


def clock_s(recording: RecordingInfo | Recording, stamp_s: float) -> float | None:
    """Return when a stamp of a recording was, seconds since 1970; None where no right clock said it."""
    at_s = recording.begins_s + stamp_s
    return at_s if at_s > _CLOCK_S and not is_in_future(at_s) else None


def require_another_drive(stored: StoredMap, other: StoredMap, visits: Sequence[Visit]) -> None:
    """Raise ``MapError`` where the other map is of a drive that is one of the visits.

    Its recording says so, or, where it was read in another way or while it was driven, its keyframes: no two drives
    have the same pictures at the same stamps.
    """
    keyframes, others = stored.keyframes, other.keyframes
    number = visit_of_stamps(visits, np.asarray(keyframes.stamp_s))
    for count, visit in enumerate(visits):
        rows = np.flatnonzero(number == count)
        stamps = np.round(np.asarray(keyframes.stamp_s)[rows] - visit.shift_s, 4)
        _, here, there = np.intersect1d(stamps, np.round(np.asarray(others.stamp_s), 4), return_indices=True)
        same = len(here) >= _LEAST_COMMON and all(
            np.array_equal(keyframes.jpeg(int(rows[a])), others.jpeg(int(b))) for a, b in zip(here, there, strict=True)
        )
        if same or visit.recording.fingerprint == other.info.recording.fingerprint:
            raise MapError(
                f"{other.path} is of the same drive as visit {count + 1} of {stored.path} "
                f"({visit.recording.name}{', ' + visit.day if visit.day else ''}), and one drive counts once; "
                "merge the map of another drive."
            )


def views_of(stored: StoredMap) -> list[DayViews]:
    """Return what the keyframes of each visit saw freely, in the map's world."""
    keyframes, visits, out = stored.keyframes, visits_of(stored), list[DayViews]()
    number = visit_of_stamps(visits, np.asarray(keyframes.stamp_s))
    for visit, one in enumerate(visits):
        own = np.flatnonzero(number == visit)
        pose = np.asarray(keyframes.world_from_camera, np.float64)[own]
        out.append(DayViews(np.asarray(keyframes.clear_mm)[own], pose, one.rig.depth.camera()))
    return out


def visit_of_stamps(visits: Sequence[Visit], stamps_s: Float[np.ndarray, " n"]) -> Int[np.ndarray, " n"]:
    """Return the number of the visit that each stamp lies in."""
    begins = np.array([visit.begin_s for visit in visits])
    return np.clip(np.searchsorted(begins, stamps_s + 1e-6, side="right") - 1, 0, len(visits) - 1)
