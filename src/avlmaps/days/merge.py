"""A map of another day becomes part of this one: found, laid on it, and what changed is known. ``merge_maps`` is it."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import UTC, date, datetime, time
from pathlib import Path
from time import perf_counter

import msgspec
import numpy as np

from avlmaps.core.arrays import Bool, Float, Int
from avlmaps.core.errors import MapError
from avlmaps.core.files import user_path
from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps.core.poses import apply, inverse, plain_point
from avlmaps.core.timeline import DAY_S, is_in_future
from avlmaps.core.version import __version__
from avlmaps.core.wording import option
from avlmaps.days import life as lives
from avlmaps.days.evidence import Day, DayViews
from avlmaps.days.find import DEFAULTS, clock_s, find_other, require_another_drive, views_of, visit_of_stamps, visits_of
from avlmaps.days.join import NO_SOURCES, joined_keyframes, joined_sounds, joined_sources, joined_voxels
from avlmaps.days.settings import MergeSettings
from avlmaps.days.surfaces import Occupied, resampled
from avlmaps.days.unnamed import changed_things
from avlmaps.maps.build import require_place
from avlmaps.maps.store.checkpoints import key_of
from avlmaps.maps.store.edits import Edit, World, carried_edits, read_edits, write_edits
from avlmaps.maps.store.folder import write
from avlmaps.maps.store.life import Life
from avlmaps.maps.store.lock import EDITING, lock_folder
from avlmaps.maps.store.manifest import Counts, MapBounds, MapInfo, RecordingInfo, RigInfo, Timings, Visit
from avlmaps.maps.store.map_data import MapData
from avlmaps.maps.store.reader import StoredMap, open_stored
from avlmaps.maps.types import Keyframes
from avlmaps.query.avlmap import AVLMap
from avlmaps.query.contents import Thing

ThingsOf = Callable[[AVLMap], Sequence[Thing]]


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
        MapError: the maps have other voxels or models, no keyframes, the other is of several days or of a drive that
            the map has already, a day is no date, in the future or not later, or the folder cannot be written.
        NotTheSamePlaceError: it is not seen to be the same place.
    """
    begin_s, out = perf_counter(), user_path(out)
    require_place(out, overwrite)
    if other.info.visits:
        raise MapError(
            f"{other.path} is a map of {len(other.info.visits)} days; merge its recordings' maps one after the other "
            f"into {stored.path}, the earliest first."
        )
    visits = _dated(visits_of(stored), first_day, stored)
    require_another_drive(stored, other, visits)
    visit = _visit(other, visits[-1], day)  # before the search, which takes long
    known = Occupied.of(np.asarray(stored.voxels.index), stored.grid)
    found = find_other(stored, other, settings, known)
    moved, number = found.map_from_other, len(visits)
    visit = msgspec.structs.replace(visit, map_from_recording=_rows(moved), checks=found.checks)
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
    life = stored.life() or lives.begun(
        [_seen(one, stored, np.eye(4), 0.0) for one in listed(AVLMap(stored, edits=()))]
    )
    things = list(listed(AVLMap(other, edits=())))
    if things_of is None:  # a list of names misses small things, whose surface changes nevertheless
        life = _with_vanished(life, stored, known, now, visits, settings)
        things += _unnamed_new(other, things, before, known, moved, settings)
    new = [_seen(one, other, moved, visit.shift_s) for one in things]
    at_s = [one.end_s for one in visits]
    looks = _looks(life, stored, known)
    life = lives.lived_on(life, new, now, before, known, number, at_s, grid, settings.changes, same_thing, looks)
    kept = _still_there(stored, known, life, now, number, settings)
    voxels = joined_voxels(stored, kept, other, moved, visit.shift_s, life)
    keyframes = joined_keyframes(stored, other, moved, visit.shift_s)
    sounds = joined_sounds(stored, other, moved, visit.shift_s)
    sources, why_not = joined_sources(stored, other, moved, voxels, keyframes)
    data = MapData(stored.info, voxels, keyframes, sounds, stored.place_state, sources, life=life)
    info = _manifest(stored, other, data, visits, settings, perf_counter() - begin_s, why_not)
    with lock_folder(out), lock_folder(out, EDITING):
        edits = _edits(stored, other, read_edits(out), keyframes, moved)
        write(out, replace(data, info=info))
        if edits:
            write_edits(out, edits)
    return replace(open_stored(out), encoders=stored.encoders)


def _edits(
    stored: StoredMap, other: StoredMap, replaced: Sequence[Edit], onto: Keyframes, moved: Float[np.ndarray, "4 4"]
) -> tuple[Edit, ...]:
    """Return what people corrected in both maps, in the world of this one, in the order of time.

    What they corrected in the map that is replaced stays as well.
    """
    world = World.of(stored.info)
    own = carried_edits(read_edits(stored.path), stored.keyframes, world, world, onto, np.eye(4))
    others = carried_edits(read_edits(other.path), other.keyframes, World.of(other.info), world, onto, moved)
    known = {edit.id: edit for edit in (*replaced, *others, *own)}
    return tuple(sorted(known.values(), key=lambda edit: edit.made))


def merged_key(first: str, other: str, settings: MergeSettings = DEFAULTS) -> str:
    """Return the build key of the map that two maps of these build keys become."""
    return key_of("days", first, other, settings)


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
        day = date.fromisoformat(said)
    except ValueError:
        raise MapError(f"{said!r} is no day; write it as 2026-11-25.") from None
    if is_in_future(datetime.combine(day, time.min, UTC).timestamp()):
        raise MapError(f"{said} is in the future: today is {datetime.now(UTC).date()}; give the day of the drive.")
    return day


def _visit(other: StoredMap, last: Visit, day: str) -> Visit:
    """Return the entry of a new day, whose time follows that of the last one, and whose place is to be found."""
    (own,) = visits_of(other)
    own_s, last_s = clock_s(own.recording, own.begin_s), clock_s(last.recording, last.begin_s - last.shift_s)
    if not day and last.day and own_s is not None and last_s is not None and own_s + own.end_s - own.begin_s < last_s:
        raise MapError(
            f"{other.path} was recorded before the map's last drive, by their clocks ({_when(own_s)} and "
            f"{_when(last_s)}); merge drives in their order, or say its day where a clock was wrong: "
            f"{option('day', 'DAY')}."
        )
    day = _date(day).isoformat() if day else own.day
    if day and last.day and day < last.day:
        raise MapError(
            f"{other.path} was recorded on {day}, before the map's last day, {last.day}; merge days in their order."
        )
    shift_s = 0.0
    if own.begin_s <= last.end_s:  # two clocks that begin at 0
        days = (_date(day) - _date(last.day)).days if day and last.day else 1
        shift_s = last.begin_s - own.begin_s + max(days * DAY_S, math.ceil(last.end_s - last.begin_s) + 1.0)
    begin_s, end_s = own.begin_s + shift_s, own.end_s + shift_s
    return msgspec.structs.replace(own, day=day, begin_s=begin_s, end_s=end_s, shift_s=shift_s)


def _rows(pose: Float[np.ndarray, "4 4"]) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(float(value) for value in row) for row in pose)


def _when(stamp_s: float) -> str:
    return datetime.fromtimestamp(stamp_s, UTC).strftime("%Y-%m-%d %H:%M UTC")


def _seen(thing: Thing, stored: StoredMap, map_from_own: Float[np.ndarray, "4 4"], shift_s: float) -> lives.SeenThing:
    index = np.asarray(stored.voxels.index)[thing.rows]
    if not np.array_equal(map_from_own, np.eye(4)):
        index, *_ = resampled(index, stored.grid, map_from_own)
    seen_s = float(np.max(np.asarray(stored.voxels.last_seen_s)[thing.rows])) + shift_s
    position = plain_point(apply(map_from_own, np.array(thing.position)))
    look = _look(stored, thing.rows)
    return lives.SeenThing(thing.name, thing.confidence, position, thing.size, thing.color, index, seen_s, look)


def _look(stored: StoredMap, rows: Int[np.ndarray, " r"]) -> Float[np.ndarray, " d"] | None:
    total = np.asarray(stored.voxels.feature)[rows].astype(np.float64).sum(axis=0)
    length = float(np.linalg.norm(total))
    return total / length if length > 0.0 else None


def _looks(life: Life, stored: StoredMap, known: Occupied) -> dict[int, Float[np.ndarray, " d"]]:
    looks = {number: _look(stored, rows) for number, rows in _rows_there(life, known).items()}
    return {number: look for number, look in looks.items() if look is not None}


def _rows_there(life: Life, known: Occupied) -> dict[int, Int[np.ndarray, " r"]]:
    return {number: _rows_of(number, life, known) for number, stay in enumerate(life.stays) if stay.gone is None}


def _rows_of(number: int, life: Life, known: Occupied) -> Int[np.ndarray, " r"]:
    rows = known.row_of(life.voxels(number))  # the map's voxels are sorted likewise
    return rows[rows >= 0]


def same_thing(one: str, other: str) -> bool:
    """Return whether two names may be of one thing: they are the same, or one takes the other in."""
    words = lexicon()
    return one == other or words.is_a(one, other, EntryKind.THING) or words.is_a(other, one, EntryKind.THING)


def _with_vanished(
    life: Life, stored: StoredMap, known: Occupied, now: Day, visits: Sequence[Visit], settings: MergeSettings
) -> Life:
    index, grid = np.asarray(stored.voxels.index), stored.grid
    surface = now.has_surface(grid.centre_of(index))
    loose, through = ~surface, now.views.through(index, grid) >= settings.changes.through_views
    things = changed_things(stored, loose, through, [*_rows_there(life, known).values()], settings.changes)
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
    grid = other.grid
    points = apply(moved, grid.centre_of(np.asarray(other.voxels.index)))
    index = grid.index_of(points)
    through = np.sum([views.through(index, grid) for views in before], axis=0) >= settings.changes.through_views
    return changed_things(other, ~known.near(points), through, [thing.rows for thing in things], settings.changes)


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
        rows = _rows_of(number, life, known)
        if stay.gone == visit or stay.is_person:
            goes[rows] = ~surface[rows] | stay.is_person
        elif stay.is_there(visit) and stay.first < visit:
            goes[rows] = False
    return ~goes


def _manifest(
    stored: StoredMap,
    other: StoredMap,
    content: MapData,
    visits: tuple[Visit, ...],
    settings: MergeSettings,
    elapsed_s: float,
    notice: str,
) -> MapInfo:
    info, grid = stored.info, stored.grid
    recording = RecordingInfo(
        name=info.recording.name,
        format=info.recording.format,
        fingerprint=key_of(info.recording.fingerprint, other.info.recording.fingerprint),
        frames=info.recording.frames + other.info.recording.frames,
        duration_s=visits[-1].end_s - visits[0].begin_s,
        notices=info.recording.notices,
    )
    frames = sum(visit.frames for visit in visits)
    return msgspec.structs.replace(
        info,
        avlmaps_version=__version__,
        build_key=merged_key(info.build_key, other.info.build_key, settings),
        recording=recording,
        counts=Counts.of(frames, content.keyframes, content.voxels, content.sounds),
        rig=RigInfo.of(stored.rig),
        bounding_box_m=MapBounds.of(content.voxels.index, grid.voxel_size_m),
        notices=(
            *dict.fromkeys(one for one in (*info.notices, *other.info.notices) if not one.startswith(NO_SOURCES)),
            *([notice] if notice else ()),
        ),
        doubts=tuple(dict.fromkeys((*info.doubts, *other.info.doubts))),
        visits=visits,
        timings=Timings.now({"merging": elapsed_s}),
    )
