"""A map of another day becomes part of this one: found, laid on it, and what changed is known. ``merge_maps`` is it."""

import math
import shutil
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, date, datetime
from pathlib import Path
from time import perf_counter

import msgspec
import numpy as np

from avlmaps.core.arrays import Bool, Float, Int
from avlmaps.core.errors import MapError
from avlmaps.core.lexicon import Kind, lexicon
from avlmaps.core.poses import apply, inverse, plain_point, rotation_angle_rad
from avlmaps.core.version import __version__
from avlmaps.core.wording import option
from avlmaps.days import life as lives
from avlmaps.days.align import (
    NotTheSamePlaceError,
    consensus,
    gather_votes,
    local_features,
    require_alike,
    require_upright,
    thumbnail,
)
from avlmaps.days.evidence import Day, DayViews
from avlmaps.days.settings import MergeSettings
from avlmaps.days.surfaces import Occupied, refine, resampled
from avlmaps.maps.fusion.voxel_sums import VoxelSums, VoxelTable
from avlmaps.maps.growing import require_place
from avlmaps.maps.store.checkpoints import key_of
from avlmaps.maps.store.life import PEOPLE, Life
from avlmaps.maps.store.lock import lock_folder
from avlmaps.maps.store.manifest import Box, Counts, MapInfo, RecordingInfo, RigInfo, Timings, Visit
from avlmaps.maps.store.reader import StoredMap, open_stored
from avlmaps.maps.store.writer import MapContent, write_map
from avlmaps.maps.types import HeardSounds, Keyframes, Voxels
from avlmaps.query.avlmap import AVLMap
from avlmaps.query.components import linked
from avlmaps.query.contents import STRUCTURE, Thing
from avlmaps.query.naming import VoxelNamer

ThingsOf = Callable[[AVLMap], Sequence[Thing]]
DEFAULTS = MergeSettings()
_DAY_S = 86_400.0
_CLOCK_S = 1e8  # later stamps count from 1970: they are a clock's
_NEAR_M, _NEAR_RAD = 0.15, math.radians(10.0)  # a keyframe of the new day takes the place of one so near
_IDENTITY = tuple(tuple(float(value) for value in row) for row in np.eye(4))


@dataclass(frozen=True, slots=True)
class Found:
    """Where another map lies in this one, and the numbers that say so.

    Attributes:
        map_from_other: 4x4.
        checks: keyframes tried, located and agreeing, how far those stand apart, the surfaces' distance and agreement.
    """

    map_from_other: Float[np.ndarray, "4 4"]
    checks: dict[str, float]


def find_other(stored: StoredMap, other: StoredMap, settings: MergeSettings = DEFAULTS) -> Found:
    """Return where another map lies in this one, without a guess.

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
    checks |= _agreement(stored, other, fine, settings)
    return Found(fine, checks)


def _agreement(
    stored: StoredMap, other: StoredMap, map_from_other: Float[np.ndarray, "4 4"], settings: MergeSettings
) -> dict[str, float]:
    """Return how much of the other map's surface lies on this one's, of what this one looked at.

    Raises:
        NotTheSamePlaceError: too little, or too little was looked at.
    """
    grid, wanted = stored.grid, settings.align
    points = apply(map_from_other, grid.centre_of(np.asarray(other.voxels.index)))
    on_surface = Occupied.of(np.asarray(stored.voxels.index), grid).near(points)
    index = grid.index_of(points)
    free = np.zeros(len(index), np.int64)
    for views in views_of(stored):
        free += views.through(index, grid)
    through = (free >= settings.changes.through_views) & ~on_surface
    looked = int(on_surface.sum() + through.sum())
    share = float(on_surface.sum() / max(looked, 1))
    if looked < wanted.least_looked or share < wanted.least_agreement:
        raise NotTheSamePlaceError(
            f"This is not seen to be the same place: of {looked} voxels of {other.path} where {stored.path} looked, "
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
    day = datetime.fromtimestamp(begin, UTC).date().isoformat() if begin > _CLOCK_S else ""
    return (
        Visit(
            day=day, recording=info.recording, begin_s=begin, end_s=end, shift_s=0.0, map_from_recording=_IDENTITY,  # pyright: ignore[reportArgumentType]
            rig=info.rig, frames=info.counts.frames,
        ),
    )  # fmt: skip


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


def default_things(least: float) -> ThingsOf:
    """Return how the things of a map are listed: as its pixel encoder names them."""

    def things(avlmap: AVLMap) -> Sequence[Thing]:
        return avlmap.things(least_confidence=least) if "pixels" in avlmap.stored.info.models else []

    return things


def merge_maps(
    stored: StoredMap,
    other: StoredMap,
    out: Path | str,
    settings: MergeSettings = DEFAULTS,
    *,
    day: str = "",
    first_day: str = "",
    overwrite: bool = False,
    things_of: ThingsOf | None = None,
) -> StoredMap:
    """Write the map of all days: the other map is found in this one, laid on it, and changes what it looked at.

    What the other day looked through is no surface any more, what it has of surface is; where it did not look, the map
    stays as it was. Both maps are left alone.

    Args:
        stored: the map, of one day or of several.
        other: of a later day, of one recording.
        out: folder of the new map.
        settings: everything else.
        day: when the other was recorded, as ``2026-11-25``; where its stamps are of a clock it is known.
        first_day: likewise of a map of one day.
        overwrite: replace a map at ``out``.
        things_of: lists the things of a map; by its pixel encoder if None, and then what changed without a name too.

    Raises:
        MapError: the maps have other voxels or models, no keyframes, the other is of several days, a day is no date
            or not later, or the folder cannot be written.
        NotTheSamePlaceError: it is not seen to be the same place.
    """
    begin_s, out = perf_counter(), Path(out)
    require_place(out, overwrite)
    if other.info.visits:
        raise MapError(
            f"{other.path} is a map of {len(other.info.visits)} days; merge its recordings' maps one after the other "
            f"into {stored.path}, the earliest first."
        )
    visits = _dated(visits_of(stored), first_day, stored)
    found = find_other(stored, other, settings)
    moved, number = found.map_from_other, len(visits)
    visit = _visit(other, visits[-1], found, day)
    visits = (*visits, visit)
    listed = things_of or default_things(settings.least_confidence)
    grid = stored.grid
    before = views_of(stored)
    laid, *_ = resampled(np.asarray(other.voxels.index), grid, moved)
    now = Day(
        views_of(other)[0].moved(moved),
        Occupied.of(np.asarray(other.voxels.index), grid),
        inverse(moved),
        Occupied.of(laid, grid),
    )
    known = Occupied.of(np.asarray(stored.voxels.index), grid)
    life = stored.life() or lives.begun([_seen(one, stored, np.eye(4), 0.0) for one in listed(AVLMap(stored))])
    things = list(listed(AVLMap(other)))
    if things_of is None:  # a list of names misses small things, whose surface changes nevertheless
        life = _with_vanished(life, stored, known, now, visits, settings)
        things += _unnamed_new(other, things, before, known, moved, settings)
    new = [_seen(one, other, moved, visit.shift_s) for one in things]
    at_s = [one.end_s for one in visits]
    life = lives.lived_on(life, new, now, before, known, number, at_s, grid, settings.changes, same_thing)
    kept = _still_there(stored, known, life, now, number, settings)
    voxels = _joined_voxels(stored, kept, other, moved, visit.shift_s, life)
    keyframes = _joined_keyframes(stored, other, moved, visit.shift_s)
    with tempfile.TemporaryDirectory(prefix="avlmaps-clips-") as clips:
        sounds = _joined_sounds(stored, other, moved, visit.shift_s, Path(clips))
        content = MapContent(voxels, keyframes, stored.place_state, sounds, Path(clips), life)
        info = _manifest(stored, other, content, visits, settings, perf_counter() - begin_s)
        with lock_folder(out):
            write_map(out, content, info)
    return replace(open_stored(out), encoders=stored.encoders)


def _dated(visits: tuple[Visit, ...], first_day: str, stored: StoredMap) -> tuple[Visit, ...]:
    if not first_day:
        return visits
    if len(visits) > 1:
        raise MapError(
            f"{stored.path} is a map of {len(visits)} visits, whose days are known; leave out "
            f"{option('first-day', 'DAY')}."
        )
    return tuple(msgspec.structs.replace(visit, day=_date(first_day).isoformat()) for visit in visits)


def _date(said: str) -> date:
    try:
        return date.fromisoformat(said)
    except ValueError:
        raise MapError(f"{said!r} is no day; write it as 2026-11-25.") from None


def _visit(other: StoredMap, last: Visit, found: Found, day: str) -> Visit:
    """Return the entry of a new day, whose time follows that of the last one."""
    (own,) = visits_of(other)
    day = _date(day).isoformat() if day else own.day
    if day and last.day and day < last.day:
        raise MapError(
            f"{other.path} was recorded on {day}, before the map's last day, {last.day}; merge days in their order."
        )
    shift_s = 0.0
    if own.begin_s <= last.end_s:  # two clocks that begin at 0
        days = (_date(day) - _date(last.day)).days if day and last.day else 1
        shift_s = last.begin_s - own.begin_s + max(days * _DAY_S, math.ceil(last.end_s - last.begin_s) + 1.0)
    rows = tuple(tuple(float(value) for value in row) for row in found.map_from_other)
    return Visit(
        day=day, recording=own.recording, begin_s=own.begin_s + shift_s, end_s=own.end_s + shift_s, shift_s=shift_s,
        map_from_recording=rows, rig=own.rig, frames=own.frames, checks=found.checks,  # pyright: ignore[reportArgumentType]
    )  # fmt: skip


def _seen(thing: Thing, stored: StoredMap, map_from_own: Float[np.ndarray, "4 4"], shift_s: float) -> lives.Seen:
    """Return a thing of a map in the grid of the map of all days."""
    index = np.asarray(stored.voxels.index)[thing.rows]
    if not np.array_equal(map_from_own, np.eye(4)):
        index, *_ = resampled(index, stored.grid, map_from_own)
    seen_s = float(np.max(np.asarray(stored.voxels.last_seen_s)[thing.rows])) + shift_s
    position = plain_point(apply(map_from_own, np.array(thing.position)))
    return lives.Seen(thing.name, thing.confidence, position, thing.size, thing.color, index, seen_s)


def same_thing(one: str, other: str) -> bool:
    """Return whether two names may be of one thing: they are the same, or one takes the other in."""
    words = lexicon()
    return one == other or words.is_a(one, other, Kind.THING) or words.is_a(other, one, Kind.THING)


def _with_vanished(
    life: Life, stored: StoredMap, known: Occupied, now: Day, visits: Sequence[Visit], settings: MergeSettings
) -> Life:
    """Return a life with the surface that the new day looks through and that no thing owns, as things of their own."""
    index, grid = np.asarray(stored.voxels.index), stored.grid
    surface = now.has_surface(grid.centre_of(index))
    free = (now.views.through(index, grid) >= settings.changes.through_views) & ~surface
    for number, stay in enumerate(life.stays):
        if stay.gone is None:
            rows = known.row_of(life.voxels(number))
            free[rows[rows >= 0]] = False
    things = _clusters(stored, np.flatnonzero(free), settings)
    stamps = np.array([float(np.max(np.asarray(stored.voxels.last_seen_s)[one.rows])) for one in things])
    seen_on = visit_of_stamps(visits[:-1], stamps).tolist()
    begun = [lives.begun([_seen(one, stored, np.eye(4), 0.0)], on) for one, on in zip(things, seen_on, strict=True)]
    stays = [*life.stays, *(one.stays[0] for one in begun)]
    return Life.of(stays, [*(life.voxels(number) for number in range(len(life))), *(one.voxels(0) for one in begun)])


def _unnamed_new(
    other: StoredMap,
    things: Sequence[Thing],
    before: Sequence[DayViews],
    known: Occupied,
    moved: Float[np.ndarray, "4 4"],
    settings: MergeSettings,
) -> list[Thing]:
    """Return the new day's surface where the earlier days saw freely and that no thing owns, as things of their own."""
    grid = other.grid
    points = apply(moved, grid.centre_of(np.asarray(other.voxels.index)))
    index = grid.index_of(points)
    through = np.sum([views.through(index, grid) for views in before], axis=0) >= settings.changes.through_views
    free = through & ~known.near(points)
    for thing in things:
        free[thing.rows] = False
    return _clusters(other, np.flatnonzero(free), settings)


def _clusters(stored: StoredMap, rows: Int[np.ndarray, " r"], settings: MergeSettings) -> list[Thing]:
    """Return the groups of voxels that touch, each as a thing with the likeliest name of its voxels together."""
    if "pixels" not in stored.info.models or not len(rows):
        return []
    wanted, avlmap, namer = settings.changes, AVLMap(stored), VoxelNamer(stored)
    named = np.array([name not in STRUCTURE for name in namer.names])
    which = linked(np.asarray(stored.voxels.index)[rows], 1)
    found: list[Thing] = []
    for number in np.flatnonzero(np.bincount(which) >= wanted.least_voxels).tolist():
        own = rows[which == number]
        points = avlmap.space.centres_of(own)
        size = np.ptp(avlmap.space.level(points), axis=0) + stored.grid.voxel_size_m
        if size.max() > wanted.most_m or not named.any():
            continue
        share = np.where(named, namer.confidences(own).mean(axis=0), -1.0)
        best = int(share.argmax())
        r, g, b = (int(value) for value in np.asarray(stored.voxels.rgb)[own].mean(axis=0).round())
        middle = points[np.argmin(np.linalg.norm(points - points.mean(axis=0), axis=1))]
        likely = round(min(float(share[best]), wanted.confident_at - 0.01), 3)
        found.append(Thing(namer.names[best], likely, plain_point(middle), plain_point(size), (r, g, b), own, points))
    return found


def _still_there(
    stored: StoredMap, known: Occupied, life: Life, now: Day, visit: int, settings: MergeSettings
) -> Bool[np.ndarray, " n"]:
    """Return which voxels of the map are surface still.

    One goes where two views of the new day see through it and nothing is beside it; of what is gone every voxel goes
    where the new day has no surface; of what is there none goes; people's go.
    """
    index, grid = np.asarray(stored.voxels.index), stored.grid
    surface = now.has_surface(grid.centre_of(index))
    through = now.views.through(index, grid) >= settings.changes.through_views
    goes = through & ~surface
    for number, stay in enumerate(life.stays):
        rows = known.row_of(life.voxels(number))  # the map's voxels are sorted likewise
        rows = rows[rows >= 0]
        if stay.gone == visit or stay.is_person:
            goes[rows] = ~surface[rows] | stay.is_person
        elif stay.is_there(visit) and stay.first < visit:
            goes[rows] = False
    return ~goes


def _joined_voxels(
    stored: StoredMap,
    kept: Bool[np.ndarray, " n"],
    other: StoredMap,
    moved: Float[np.ndarray, "4 4"],
    shift_s: float,
    life: Life,
) -> Voxels:
    """Return what is left of the map's voxels, and the other's laid on its grid; where both are, their means."""
    table = VoxelTable(stored.voxels.feature.shape[1])
    table.add(_sums(stored.voxels, np.flatnonzero(kept)))
    index, cell, source, part = resampled(np.asarray(other.voxels.index), other.grid, moved)
    table.add(_spread(other.voxels, index, cell, source, part, shift_s))
    people = [life.voxels(number) for number, stay in enumerate(life.stays) if stay.name in PEOPLE]
    if not people:
        return table.voxels()
    sums = table.evidence().index
    crowd = Occupied.of(np.concatenate(people), stored.grid)
    return table.voxels(kept=crowd.row_of(sums) < 0)


def _sums(voxels: Voxels, rows: Int[np.ndarray, " k"]) -> VoxelSums:
    """Return sums whose means are some of a map's voxels."""
    hits = np.asarray(voxels.hits)[rows]
    weight = np.asarray(voxels.weight, np.float64)[rows]
    feature = np.asarray(voxels.feature)[rows].astype(np.float32) * weight[:, None].astype(np.float32)
    rgb = np.asarray(voxels.rgb)[rows].astype(np.float64) * hits[:, None]
    return VoxelSums(
        np.ascontiguousarray(np.asarray(voxels.index)[rows]), feature, weight, rgb, hits.astype(np.float64),
        hits.astype(np.int64), np.minimum(hits, 1).astype(np.int32), np.zeros(len(rows), np.int64),
        np.asarray(voxels.last_seen_s, np.float64)[rows],
    )  # fmt: skip


def _spread(
    voxels: Voxels,
    index: Int[np.ndarray, "m 3"],
    cell: Int[np.ndarray, " k"],
    source: Int[np.ndarray, " k"],
    part: Float[np.ndarray, " k"],
    shift_s: float,
) -> VoxelSums:
    """Return the sums of another map's voxels over the cells that they fill."""
    from scipy import sparse

    count = len(index)
    share = sparse.csr_matrix((part, (cell, source)), shape=(count, len(voxels)))
    own = _sums(voxels, np.arange(len(voxels)))
    last = np.full(count, -np.inf)
    np.maximum.at(last, cell, own.last_seen_s[source])
    hits = np.maximum(np.rint(share @ own.hits), 1).astype(np.int64)
    return VoxelSums(
        np.ascontiguousarray(index, np.int32), np.asarray(share @ own.feature_sum, np.float32), share @ own.weight,
        share @ own.rgb_sum, share @ own.rgb_weight, hits, np.ones(count, np.int32), np.zeros(count, np.int64),
        last + shift_s,
    )  # fmt: skip


def _joined_keyframes(
    stored: StoredMap, other: StoredMap, moved: Float[np.ndarray, "4 4"], shift_s: float
) -> Keyframes:
    """Return the keyframes of all days; one of the new day takes the place of older ones from about where it is.

    Their places are described again, in the words that this map's place encoder learned.
    """
    from scipy.spatial import KDTree

    old, new = stored.keyframes, other.keyframes
    pose = moved @ np.asarray(new.world_from_camera, np.float64)
    before = np.asarray(old.world_from_camera, np.float64)
    near = KDTree(pose[:, :3, 3]).query_ball_point(before[:, :3, 3], _NEAR_M)
    kept = [
        row
        for row, rivals in enumerate(near)
        if not any(rotation_angle_rad(before[row], pose[rival]) <= _NEAR_RAD for rival in rivals)
    ]
    encoder = stored.encoders.place
    place = [
        encoder.encode(thumbnail(other, row), local_features(other, row), stored.place_state) for row in range(len(new))
    ]
    turned = replace(
        new,
        stamp_s=np.asarray(new.stamp_s) + shift_s,
        world_from_camera=pose,
        centre=apply(moved, np.asarray(new.centre, np.float64)).astype(np.float32),
        place=np.asarray(place, np.float32).reshape(len(new), -1),
        points_world=apply(moved, np.asarray(new.points_world, np.float64)).astype(np.float32),
    )
    return _concatenated(_rows(old, np.array(kept, np.int64)), turned)


def _rows(keyframes: Keyframes, rows: Int[np.ndarray, " r"]) -> Keyframes:
    """Return some of the keyframes."""
    offsets, points = _ragged(np.asarray(keyframes.offsets), rows)
    thumbnail_offsets, pixels = _ragged(np.asarray(keyframes.thumbnail_offsets), rows)
    score = np.asarray(keyframes.score)
    return Keyframes(
        stamp_s=np.asarray(keyframes.stamp_s)[rows],
        world_from_camera=np.asarray(keyframes.world_from_camera)[rows],
        centre=np.asarray(keyframes.centre)[rows],
        view=np.asarray(keyframes.view)[rows],
        place=np.asarray(keyframes.place)[rows],
        offsets=offsets,
        xy=np.asarray(keyframes.xy)[points],
        descriptors=np.asarray(keyframes.descriptors)[points],
        points_world=np.asarray(keyframes.points_world)[points],
        thumbnail_offsets=thumbnail_offsets,
        thumbnails=np.asarray(keyframes.thumbnails)[pixels],
        score=score[points] if len(score) else score,
        clear_mm=np.asarray(keyframes.clear_mm)[rows],
    )


def _ragged(offsets: Int[np.ndarray, " k1"], rows: Int[np.ndarray, " r"]) -> tuple[np.ndarray, np.ndarray]:
    """Return the offsets of some rows of a ragged array, and the entries that they have."""
    size = np.diff(offsets)[rows]
    ends = np.concatenate([[0], np.cumsum(size)]).astype(np.int64)
    return ends, np.repeat(offsets[:-1][rows] - ends[:-1], size) + np.arange(ends[-1])


def _concatenated(one: Keyframes, other: Keyframes) -> Keyframes:
    """Put keyframes one after the other."""
    from avlmaps.maps.pipeline.keyframes import concat_keyframes

    shapes = {part.clear_mm.shape[1:] for part in (one, other) if len(part)}
    if len(shapes) > 1:  # another camera: pictures of the larger shape hold both, and blocks beyond are unknown
        rows, columns = (max(shape[axis] for shape in shapes) for axis in (0, 1))
        one, other = (
            replace(part, clear_mm=_padded(np.asarray(part.clear_mm), rows, columns)) for part in (one, other)
        )
    return concat_keyframes([part for part in (one, other) if len(part)])


def _padded(clear_mm: np.ndarray, rows: int, columns: int) -> np.ndarray:
    out = np.zeros((len(clear_mm), rows, columns), np.uint16)
    out[:, : clear_mm.shape[1], : clear_mm.shape[2]] = clear_mm
    return out


def _joined_sounds(
    stored: StoredMap, other: StoredMap, moved: Float[np.ndarray, "4 4"], shift_s: float, folder: Path
) -> HeardSounds:
    """Return the sounds of all days, and bring their clips together in a folder."""
    old, new = stored.sounds, other.sounds
    clips: list[str] = []
    for number, (of, sound) in enumerate(
        [*((stored, i) for i in range(len(old))), *((other, i) for i in range(len(new)))]
    ):
        source = of.clip_path(sound)
        clips.append(f"{number:06d}{source.suffix}")
        shutil.copyfile(source, folder / clips[-1])
    width = max(old.feature.shape[1], new.feature.shape[1])
    tracks = [np.asarray(old.track), apply(moved, np.asarray(new.track, np.float64))]
    features = [each.feature if len(each.feature) else np.zeros((0, width)) for each in (old, new)]
    return HeardSounds(
        onset_s=np.concatenate([old.onset_s, np.asarray(new.onset_s) + shift_s]),
        offset_s=np.concatenate([old.offset_s, np.asarray(new.offset_s) + shift_s]),
        track_offsets=np.concatenate([old.track_offsets, old.track_offsets[-1] + new.track_offsets[1:]]).astype(
            np.int64
        ),
        track=np.concatenate(tracks).astype(np.float32),
        feature_offsets=np.concatenate([old.feature_offsets, old.feature_offsets[-1] + new.feature_offsets[1:]]).astype(
            np.int64
        ),
        feature=np.concatenate(features).astype(np.float32),
        clips=tuple(clips),
    )


def _manifest(
    stored: StoredMap,
    other: StoredMap,
    content: MapContent,
    visits: tuple[Visit, ...],
    settings: MergeSettings,
    elapsed_s: float,
) -> MapInfo:
    info, grid = stored.info, stored.grid
    finished = datetime.now(UTC).isoformat(timespec="seconds")
    recording = RecordingInfo(
        name=info.recording.name,
        format=info.recording.format,
        fingerprint=key_of(info.recording.fingerprint, other.info.recording.fingerprint),
        frames=info.recording.frames + other.info.recording.frames,
        duration_s=visits[-1].end_s - visits[0].begin_s,
        notices=info.recording.notices,
    )
    counts = Counts(
        frames=sum(visit.frames for visit in visits),
        keyframes=len(content.keyframes),
        voxels=len(content.voxels),
        sounds=len(content.sounds),
    )
    return msgspec.structs.replace(
        info,
        avlmaps_version=__version__,
        build_key=key_of("days", info.build_key, other.info.build_key, settings),
        recording=recording,
        counts=counts,
        rig=RigInfo.of(stored.rig),
        bounding_box_m=Box.of(content.voxels.index, grid.voxel_size_m),
        notices=tuple(dict.fromkeys((*info.notices, *other.info.notices))),
        doubts=tuple(dict.fromkeys((*info.doubts, *other.info.doubts))),
        visits=visits,
        files={},
        timings=Timings(finished=finished, elapsed_s=elapsed_s, stages_s={"merging": elapsed_s}),
    )
