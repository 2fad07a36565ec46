"""A map of another day becomes part of this one: found, laid on it, and what changed is known (``merge_maps``).

Several recordings of one place become one map: each is built by itself, then found in the first and merged.
"""

import math
import shutil
from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import UTC, date, datetime, time
from pathlib import Path
from time import perf_counter

import msgspec
import numpy as np

from avlmaps.core.arrays import Bool, Float, Int
from avlmaps.core.columns import concat, take
from avlmaps.core.errors import MapError
from avlmaps.core.files import user_path
from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps.core.poses import apply, inverse, plain_point, rotation_angle_rad
from avlmaps.core.progress import say
from avlmaps.core.timeline import DAY_S, is_in_future
from avlmaps.core.version import __version__
from avlmaps.core.wording import option
from avlmaps.days import find
from avlmaps.days import life as lives
from avlmaps.days.evidence import THROUGH_VIEWS, Day
from avlmaps.days.surfaces import Occupied, resampled
from avlmaps.maps.build import build_map
from avlmaps.maps.cluster import Pool, Reopen, cluster_workers
from avlmaps.maps.fusion.voxel_sums import VoxelSums, VoxelTable
from avlmaps.maps.plan import require_place
from avlmaps.maps.settings import DEFAULTS, BuildSettings
from avlmaps.maps.sources.find import carry_evidence
from avlmaps.maps.store.edits import Edit, World, carried_edits, read_edits, write_edits
from avlmaps.maps.store.folder import MANIFEST, read, write
from avlmaps.maps.store.life import PEOPLE, Life
from avlmaps.maps.store.manifest import Counts, MapBounds, MapInfo, RecordingInfo, RigInfo, Timings, Visit
from avlmaps.maps.store.map_data import MapData
from avlmaps.maps.store.tables import EDITING, key_of, lock_folder
from avlmaps.maps.types import HeardSounds, Keyframes, SourceEvidence, Voxels
from avlmaps.perception.cache import DEFAULT_CACHE, CacheSettings
from avlmaps.perception.encoders import Encoders
from avlmaps.query.avlmap import AVLMap, with_findings
from avlmaps.query.contents import Thing

ThingsOf = Callable[[AVLMap], Sequence[Thing]]

_LEAST_CONFIDENCE = 0.5  # things of less are not followed
_REVISION = 1  # a map that was merged by other rules is merged again
NO_SOURCES = "The map of all days does not know where sounds came from"
_NEAR_M, _NEAR_RAD = 0.15, math.radians(10.0)  # a keyframe of the new day takes the place of one so near


def default_things(avlmap: AVLMap) -> Sequence[Thing]:
    """Return the things of a map as its pixel encoder names them."""
    return avlmap.things(least_confidence=_LEAST_CONFIDENCE) if "pixels" in avlmap.data.info.models else []


def unedited(avlmap: AVLMap) -> AVLMap:
    """Return a map as its encoders see it, without what people corrected."""
    return AVLMap(avlmap.data, avlmap.encoders, path=avlmap.path, settings=avlmap.settings, edits=())


def merge_maps(
    avlmap: AVLMap,
    other: AVLMap,
    out: Path | str,
    *,
    day: str = "",
    first_day: str = "",
    overwrite: bool = False,
    things_of: ThingsOf | None = None,
) -> AVLMap:
    """Write the map of all days: the other map is found in this one, laid on it, and changes what it looked at.

    What the other day looked through is no surface any more, what it has of surface is; where it did not look, the map
    stays as it was. Both maps are left alone.

    Args:
        avlmap: the map, of one day or of several.
        other: of a later day, of one recording.
        out: folder of the new map.
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
    if other.data.info.visits:
        raise MapError(
            f"{other.path} is a map of {len(other.data.info.visits)} days; merge its recordings' maps one after the "
            f"other into {avlmap.path}, the earliest first."
        )
    visits = _dated(find.visits_of(avlmap), first_day, avlmap)
    find.require_another_drive(avlmap, other, visits)
    visit = _visit(other, visits[-1], day)  # before the search, which takes long
    known = Occupied.of(np.asarray(avlmap.data.voxels.index), avlmap.data.grid)
    (moved, checks), number = find.find_other(avlmap, other, known), len(visits)
    visit = msgspec.structs.replace(visit, map_from_recording=_rows(moved), checks=checks)
    visits = (*visits, visit)
    listed = things_of or default_things
    grid = avlmap.data.grid
    before = find.views_of(avlmap)
    laid, *_ = resampled(np.asarray(other.data.voxels.index), grid, moved)
    (views,) = find.views_of(other)
    now = Day(
        replace(views, pose=moved @ views.pose),
        Occupied.of(np.asarray(other.data.voxels.index), grid),
        inverse(moved),
        Occupied.of(laid, grid),
    )
    life = avlmap.data.life or lives.begun([_seen(one, avlmap, np.eye(4), 0.0) for one in listed(unedited(avlmap))])
    things, index = list(listed(unedited(other))), np.asarray(avlmap.data.voxels.index)
    surface, through = now.has_surface(grid.centre_of(index)), now.views.through(index, grid) >= THROUGH_VIEWS
    if things_of is None:  # a list of names misses small things, whose surface changes nevertheless
        lost = lives.changed_things(avlmap, ~surface, through, [*_rows_there(life, known).values()])
        stamps = np.array([float(np.max(np.asarray(avlmap.data.voxels.last_seen_s)[one.rows])) for one in lost])
        seen_on = find.visit_of_stamps(visits[:-1], stamps).tolist()
        begun = [lives.begun([_seen(one, avlmap, np.eye(4), 0.0)], on) for one, on in zip(lost, seen_on, strict=True)]
        stays = [*life.stays, *(one.stays[0] for one in begun)]
        life = Life.of(stays, [*map(life.voxels, range(len(life))), *(one.voxels(0) for one in begun)])
        points = apply(moved, other.data.grid.centre_of(np.asarray(other.data.voxels.index)))
        at = other.data.grid.index_of(points)
        empty = np.sum([one.through(at, other.data.grid) for one in before], axis=0) >= THROUGH_VIEWS
        things += lives.changed_things(other, ~known.near(points), empty, [thing.rows for thing in things])
    new = [_seen(one, other, moved, visit.shift_s) for one in things]
    at_s = [one.end_s for one in visits]
    looks = _looks(life, avlmap, known)
    life = lives.lived_on(life, new, now, before, known, number, at_s, grid, same_thing, looks)
    # A voxel goes where two views of the new day see through it and nothing is beside it; of what is gone every voxel
    # goes where the new day has no surface; of what is there none goes; people's go.
    goes = through & ~surface
    for which, stay in enumerate(life.stays):
        rows = _rows_of(which, life, known)
        if stay.gone == number or stay.is_person:
            goes[rows] = ~surface[rows] | stay.is_person
        elif stay.is_there(number) and stay.first < number:
            goes[rows] = False
    voxels = joined_voxels(avlmap, ~goes, other, moved, visit.shift_s, life)
    keyframes = joined_keyframes(avlmap, other, moved, visit.shift_s)
    sounds = joined_sounds(avlmap, other, moved, visit.shift_s)
    sources, why_not = joined_sources(avlmap, other, moved, voxels, keyframes)
    data = MapData(avlmap.data.info, voxels, keyframes, sounds, avlmap.data.place_state, sources, life=life)
    info = _manifest(avlmap, other, data, visits, perf_counter() - begin_s, why_not)
    with lock_folder(out), lock_folder(out, EDITING):
        edits = _edits(avlmap, other, read_edits(out), keyframes, moved)
        write(out, with_findings(replace(data, info=info), avlmap.encoders))
        if edits:
            write_edits(out, edits)
    return AVLMap(read(out), avlmap.encoders, path=out)


def _edits(
    avlmap: AVLMap, other: AVLMap, replaced: Sequence[Edit], onto: Keyframes, moved: Float[np.ndarray, "4 4"]
) -> tuple[Edit, ...]:
    # What people corrected in the map that is replaced stays as well.
    world = World.of(avlmap.data.info)
    own = carried_edits(read_edits(avlmap.path), avlmap.data.keyframes, world, world, onto, np.eye(4))
    others = carried_edits(read_edits(other.path), other.data.keyframes, World.of(other.data.info), world, onto, moved)
    known = {edit.id: edit for edit in (*replaced, *others, *own)}
    return tuple(sorted(known.values(), key=lambda edit: edit.made))


def merged_key(first: str, other: str) -> str:
    """Return the build key of the map that two maps of these build keys become."""
    return key_of("days", first, other, _REVISION)


def _dated(visits: tuple[Visit, ...], first_day: str, avlmap: AVLMap) -> tuple[Visit, ...]:
    if not first_day:
        return visits
    if len(visits) > 1:
        raise MapError(
            f"{avlmap.path} is a map of {len(visits)} visits, whose days are known; leave out "
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


def _visit(other: AVLMap, last: Visit, day: str) -> Visit:
    (own,) = find.visits_of(other)
    own_s, last_s = find.clock_s(own.recording, own.begin_s), find.clock_s(last.recording, last.begin_s - last.shift_s)
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


def _seen(thing: Thing, avlmap: AVLMap, map_from_own: Float[np.ndarray, "4 4"], shift_s: float) -> lives.SeenThing:
    index = np.asarray(avlmap.data.voxels.index)[thing.rows]
    if not np.array_equal(map_from_own, np.eye(4)):
        index, *_ = resampled(index, avlmap.data.grid, map_from_own)
    seen_s = float(np.max(np.asarray(avlmap.data.voxels.last_seen_s)[thing.rows])) + shift_s
    position = plain_point(apply(map_from_own, np.array(thing.position)))
    look = _look(avlmap, thing.rows)
    return lives.SeenThing(thing.name, thing.confidence, position, thing.size, thing.color, index, seen_s, look)


def _look(avlmap: AVLMap, rows: Int[np.ndarray, " r"]) -> Float[np.ndarray, " d"] | None:
    total = np.asarray(avlmap.data.voxels.feature)[rows].astype(np.float64).sum(axis=0)
    length = float(np.linalg.norm(total))
    return total / length if length > 0.0 else None


def _looks(life: Life, avlmap: AVLMap, known: Occupied) -> dict[int, Float[np.ndarray, " d"]]:
    looks = {number: _look(avlmap, rows) for number, rows in _rows_there(life, known).items()}
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


def _manifest(
    avlmap: AVLMap, other: AVLMap, content: MapData, visits: tuple[Visit, ...], elapsed_s: float, notice: str
) -> MapInfo:
    info, grid = avlmap.data.info, avlmap.data.grid
    recording = RecordingInfo(
        name=info.recording.name,
        format=info.recording.format,
        fingerprint=key_of(info.recording.fingerprint, other.data.info.recording.fingerprint),
        frames=info.recording.frames + other.data.info.recording.frames,
        duration_s=visits[-1].end_s - visits[0].begin_s,
        notices=info.recording.notices,
    )
    frames = sum(visit.frames for visit in visits)
    return msgspec.structs.replace(
        info,
        avlmaps_version=__version__,
        build_key=merged_key(info.build_key, other.data.info.build_key),
        recording=recording,
        counts=Counts.of(frames, content.keyframes, content.voxels, content.sounds),
        rig=RigInfo.of(avlmap.data.rig),
        bounding_box_m=MapBounds.of(content.voxels.index, grid.voxel_size_m),
        notices=(
            *dict.fromkeys(one for one in (*info.notices, *other.data.info.notices) if not one.startswith(NO_SOURCES)),
            *([notice] if notice else ()),
        ),
        doubts=tuple(dict.fromkeys((*info.doubts, *other.data.info.doubts))),
        visits=visits,
        timings=Timings.now({"merging": elapsed_s}),
    )


def joined_voxels(
    avlmap: AVLMap,
    kept: Bool[np.ndarray, " n"],
    other: AVLMap,
    moved: Float[np.ndarray, "4 4"],
    shift_s: float,
    life: Life,
) -> Voxels:
    """Return what is left of the map's voxels, and the other's laid on its grid; where both are, their means."""
    table = VoxelTable(avlmap.data.voxels.feature.shape[1])
    table.merge(_sums(avlmap.data.voxels, np.flatnonzero(kept)))
    index, cell, source, part = resampled(np.asarray(other.data.voxels.index), other.data.grid, moved)
    table.merge(_spread(other.data.voxels, index, cell, source, part, shift_s))
    people = [life.voxels(number) for number, stay in enumerate(life.stays) if stay.name in PEOPLE]
    if not people:
        return table.voxels()
    sums = table.evidence().index
    crowd = Occupied.of(np.concatenate(people), avlmap.data.grid)
    return table.voxels(kept=crowd.row_of(sums) < 0)


def _sums(voxels: Voxels, rows: Int[np.ndarray, " k"]) -> VoxelSums:
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


def joined_keyframes(avlmap: AVLMap, other: AVLMap, moved: Float[np.ndarray, "4 4"], shift_s: float) -> Keyframes:
    """Return the keyframes of all days; one of the new day takes the place of older ones from about where it is.

    Their places are described again, in the words that this map's place encoder learned.
    """
    from scipy.spatial import KDTree

    old, new = avlmap.data.keyframes, other.data.keyframes
    pose = moved @ np.asarray(new.world_from_camera, np.float64)
    before = np.asarray(old.world_from_camera, np.float64)
    near = KDTree(pose[:, :3, 3]).query_ball_point(before[:, :3, 3], _NEAR_M)
    kept = [
        row
        for row, rivals in enumerate(near)
        if not any(rotation_angle_rad(before[row], pose[rival]) <= _NEAR_RAD for rival in rivals)
    ]
    encoder = avlmap.encoders.place
    state = avlmap.data.place_state
    place = [encoder.encode(find.thumbnail(other, row), find.features_of(other, row), state) for row in range(len(new))]
    turned = replace(
        new,
        stamp_s=np.asarray(new.stamp_s) + shift_s,
        world_from_camera=pose,
        centre=apply(moved, np.asarray(new.centre, np.float64)).astype(np.float32),
        place=np.asarray(place, np.float32).reshape(len(new), -1),
        points_world=apply(moved, np.asarray(new.points_world, np.float64)).astype(np.float32),
    )
    parts = [part for part in (take(old, np.array(kept, np.int64)), turned) if len(part)]
    shapes = {part.clear_mm.shape[1:] for part in parts}
    if len(shapes) > 1:  # another camera: pictures of the larger shape hold both, and blocks beyond are unknown
        rows, columns = (max(shape[axis] for shape in shapes) for axis in (0, 1))
        parts = [replace(part, clear_mm=_padded(np.asarray(part.clear_mm), rows, columns)) for part in parts]
    return concat(parts) if parts else old


def _padded(clear_mm: np.ndarray, rows: int, columns: int) -> np.ndarray:
    out = np.zeros((len(clear_mm), rows, columns), np.uint16)
    out[:, : clear_mm.shape[1], : clear_mm.shape[2]] = clear_mm
    return out


def joined_sources(
    avlmap: AVLMap, other: AVLMap, moved: Float[np.ndarray, "4 4"], voxels: Voxels, keyframes: Keyframes
) -> tuple[SourceEvidence | None, str]:
    """Return the evidence of where the sounds of all days came from; or why there is none, in a sentence."""
    parts = [(of.data.sources, where) for of, where in ((avlmap, np.eye(4)), (other, moved)) if len(of.data.sounds)]
    known = [(evidence, where) for evidence, where in parts if evidence is not None]
    if not known:
        return None, ""
    if len(known) < len(parts):
        of = next(of for of in (avlmap, other) if len(of.data.sounds) and of.data.sources is None)
        return None, (
            f"{NO_SOURCES}: {of.path.name} was built without the places of its microphones; build it again with "
            f"them ({option('microphones', 'FILE')}) and merge again."
        )
    counts = [int(evidence.channels[0]) for evidence, _ in known]
    if len(set(counts)) > 1:
        return None, (
            f"{NO_SOURCES}: {avlmap.path.name} was heard with {counts[0]} microphones and {other.path.name} with "
            f"{counts[1]}; query where sounds came from in each day's own map, or record with the same array."
        )
    voxel_m = avlmap.data.grid.centre_of(np.asarray(voxels.index))
    robot_m = np.asarray(keyframes.world_from_camera, np.float64)[:, :3, 3]
    return carry_evidence(known, voxel_m, robot_m, avlmap.data.up_in_world), ""


def joined_sounds(avlmap: AVLMap, other: AVLMap, moved: Float[np.ndarray, "4 4"], shift_s: float) -> HeardSounds:
    """Return the sounds of all days."""
    old, new = avlmap.data.sounds, other.data.sounds
    width = max(old.feature.shape[1], new.feature.shape[1])
    laid = replace(
        new,
        onset_s=np.asarray(new.onset_s) + shift_s,
        offset_s=np.asarray(new.offset_s) + shift_s,
        track=apply(moved, np.asarray(new.track, np.float64)).astype(np.float32),
    )
    without = np.zeros((0, width), np.float32)
    parts = [each if len(each.feature) else replace(each, feature=without) for each in (old, laid)]
    return concat(parts, clips=(*old.clips, *new.clips))


def build_together(
    recordings: Sequence[Reopen],
    out: Path | str,
    encoders: Encoders,
    pool: Pool,
    settings: BuildSettings = DEFAULTS,
    *,
    cache: CacheSettings = DEFAULT_CACHE,
    allow: Sequence[str] = (),
    overwrite: bool = False,
) -> AVLMap:
    """Build the map of several recordings of one place with the workers of a pool, or finish one that was begun.

    The maps of the single recordings lie beside it, in ``NAME-recordings``: a recording more costs its own work alone.
    Their parts are the jobs. Errors are those of ``build_map`` and ``merge_maps``; a recording of another place is
    refused with the numbers.
    """
    out = user_path(out)
    folder = out.with_name(f"{out.name.removesuffix('.avlmap')}-recordings")
    paths = [folder / f"{number:04d}.avlmap" for number in range(1, len(recordings) + 1)]
    for reopen, path in zip(recordings, paths, strict=True):
        build_map(reopen(), path, encoders, settings, cache=cache, workers=cluster_workers(pool, reopen, cache),
                  allow=allow, overwrite=overwrite, finds=with_findings)  # fmt: skip
    return merge_in_turn([AVLMap.open(path) for path in paths], folder, out, overwrite=overwrite)


def merge_in_turn(days: Sequence[AVLMap], scratch: Path, out: Path, *, overwrite: bool = False) -> AVLMap:
    """Merge maps in their order, each found in the ones before; what a stopped run had merged is used again.

    Errors as of ``merge_maps``; what was merged before stays in ``scratch``.
    """
    keys = [days[0].data.info.build_key]
    for day in days[1:]:
        keys.append(merged_key(keys[-1], day.data.info.build_key))
    paths = [days[0].path, *(scratch / f"first-{number:04d}.avlmap" for number in range(2, len(days))), out]
    at, merged = next(
        (number, found)
        for number in range(len(days) - 1, -1, -1)
        if (found := _finished(paths[number], keys[number])) is not None
    )
    if at == len(days) - 1:
        say(f"{out} is finished already, of the same recordings with the same settings; nothing to do.")
    elif (out / MANIFEST).is_file():
        require_place(out, overwrite)
    for number in range(at + 1, len(days)):
        made = merge_maps(merged, days[number], paths[number], overwrite=overwrite or number < len(days) - 1)
        if number > 1:
            shutil.rmtree(merged.path, ignore_errors=True)
        merged = made
    return merged


def _finished(path: Path, key: str) -> AVLMap | None:
    if not (path / MANIFEST).is_file():
        return None
    try:
        found = AVLMap.open(path)
    except MapError:
        return None
    return found if found.data.info.build_key == key else None
