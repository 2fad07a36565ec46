"""The suite ``avlmaps bench change``: homes on several days, merged in turn; a day may be in a turned frame."""

import hashlib
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cache, cached_property, partial
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from avlmaps.core.poses import apply, inverse, plain_point, rotation_angle_rad
from avlmaps.days.find import NotTheSamePlaceError
from avlmaps.days.merge import ThingsOf, default_things, merge_maps
from avlmaps.maps.store.life import Stay
from avlmaps.query.avlmap import AVLMap
from avlmaps.query.changes import Days
from avlmaps.query.contents import Thing
from avlmaps.recordings.types import Frame, Recording, Subset
from avlmaps_sim.bench.change.scores import (
    KINDS,
    Counts,
    Happened,
    Listed,
    judged,
    judged_list,
    lost,
    said_changes,
    true_changes,
)
from avlmaps_sim.bench.harness.figures import Table, in_percent, in_words, markdown, provenance, wilson, write_answer
from avlmaps_sim.bench.harness.settings import SceneSettings
from avlmaps_sim.bench.harness.workers import side_by_side
from avlmaps_sim.bench.harness.workplace import SceneJob, Workplace, scene_jobs
from avlmaps_sim.bench.objects import FEWEST_VOXELS, STRUCTURE
from avlmaps_sim.homes.plan import area_m2
from avlmaps_sim.mesh import Triple
from avlmaps_sim.rearranged import Change
from avlmaps_sim.scene import NOTHING, Scene, SceneObject
from avlmaps_sim.scenes import on_day, open_changed, open_scene

_FARTHEST_M = 20.0


class TurnedRecording(Subset):
    """All frames of a recording, in another world."""

    def __init__(self, whole: Recording, turned_from_scene: Float[np.ndarray, "4 4"]) -> None:
        super().__init__(whole, range(len(whole)))
        self._turn = turned_from_scene
        self.world_from_camera = turned_from_scene @ whole.world_from_camera
        self.trajectory = None
        up = whole.up_in_world
        self.up_in_world = None if up is None else turned_from_scene[:3, :3] @ up

    def frame(self, index: int) -> Frame:
        """Read one frame."""
        return replace(super().frame(index), world_from_camera=self.world_from_camera[index])

    @cached_property
    def fingerprint(self) -> str:
        """Of the recording, and of its world."""
        return hashlib.sha256(self.whole.fingerprint.encode() + self._turn.tobytes()).hexdigest()


class TurnedJob(SceneJob):
    """A scene that is mapped in another world than the simulator's; its recording is the same."""

    @classmethod
    def of(cls, job: SceneJob) -> "TurnedJob":
        """Return the job in another world."""
        return cls(**{each.name: getattr(job, each.name) for each in fields(job)})

    @property
    def map_name(self) -> str:
        """Name of the map's folder."""
        return f"turned-{super().map_name}"


def turned_from_scene(job: SceneJob) -> Float[np.ndarray, "4 4"]:
    """Return the world of a day's recording, from the simulator's: turned about the vertical, and shifted."""
    rng = job.rng(11)
    yaw = rng.uniform(-np.pi, np.pi)
    out = np.eye(4)
    out[:2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
    out[:3, 3] = rng.uniform(-_FARTHEST_M, _FARTHEST_M, 3) * (1.0, 1.0, 0.1)
    return out


class TurnedPlace(Workplace):
    """The folder of work of such a job."""

    @property
    def turn(self) -> Float[np.ndarray, "4 4"]:
        """Its world, from the simulator's."""
        return turned_from_scene(self.job)

    @cached_property
    def recording(self) -> Recording:
        """The recording in its own world."""
        return TurnedRecording(Workplace(self.job, self.open_spec).recording, self.turn)

    @cached_property
    def label(self) -> Int[np.ndarray, " n"]:
        """The true thing of each voxel of the map, -1 for none."""
        points = apply(inverse(self.turn), self.avlmap.space.centres)
        return self._true_voxels.label(self.avlmap.data.grid.index_of(points))


NOTE = (
    "Each home is recorded on day 0 and on the days after it, on another walk each day, rearranged in between; each "
    "later day has a world of its own, turned and shifted at random. Each day's recording becomes a map, and the maps "
    "are merged in their order. A change is right with its kind, a fitting name and its places within 0.5 m. Happened: "
    "to things that the walks saw before and after. Noticeable: in three frames at least, depth goes through the "
    "middle of where the thing was, or of where it appeared before that; the others, and doors that swung, are neither "
    "right nor wrong to name, also on a later day; of a move where its old place was not seen, neither is its end. "
    "True perception: things are the voxels of the scene's own things, and all else is ours. On the last day: stale is "
    "what is listed where such a thing stood on an earlier day and does so no more; a ghost is listed where nothing "
    "stands; known are true things that some day saw. Rebuilt: the last day's map alone; never forgets: all that was "
    "ever listed. Lost: of the first day's things that never changed, those said to be gone."
)
TRUE, OURS = "true perception", "ours"
MERGED, REBUILT, FOREVER = "merged", "rebuilt from the last day", "never forgets"
SCENES = tuple(f"house:{1_000_000 + number}:held-out" for number in range(10))
DAYS = 5
_FEWEST_FRAMES, _BEHIND_M = 3, 0.15
DEFAULTS = (SceneSettings(scenes=SCENES, sources=3, ambiguous=0), DAYS)


@dataclass
class HomeResult:
    """The results of one home with one perception.

    ``unnamed`` are counts where names do not matter, ``happened`` the changes of things that were seen, also where
    nobody looked at their place. Of the ``static`` things some are ``lost``: said to be gone. Each day was misplaced by
    ``off_m`` and ``off_deg``.
    """

    scene: str
    counts: Counts = field(default_factory=Counts)
    unnamed: Counts = field(default_factory=Counts)
    happened: Counter[str] = field(default_factory=Counter)
    lists: dict[str, Listed] = field(default_factory=dict)
    lost: int = 0
    static: int = 0
    area_m2: float = 0.0
    off_m: list[float] = field(default_factory=list)
    off_deg: list[float] = field(default_factory=list)
    refused: int = 0
    merge_s: list[float] = field(default_factory=list)


def run_change(
    settings: SceneSettings, days: int, out: Path, open_spec: Callable[[str], Scene] = open_scene
) -> dict[str, Any]:
    """Record homes on several days, merge their maps, and write tables. ``out/work`` stores recordings and maps."""
    weights = settings.checked()
    todo = scene_jobs(settings, settings.recorded, settings.scenes, out / "work")
    work = partial(_home, days=days, open_spec=open_spec)
    found = side_by_side(work, todo, settings.jobs, "change")
    tables = tables_of({way: [home[way] for home in found] for way in (TRUE, OURS)})
    answer = {
        "suite": "change",
        **provenance(settings, settings.recorded, settings.scenes, weights),
        "days": days,
        "note": NOTE,
        "tables": tables,
    }
    return write_answer(answer, out, f"# Change\n\n{in_words(answer)}\n\n{NOTE}\n\n{markdown(tables)}")


def _home(job: SceneJob, days: int, open_spec: Callable[[str], Scene]) -> dict[str, HomeResult]:
    jobs = [replace(job, spec=on_day(job.spec, day)) for day in range(days)]
    places = [Workplace(jobs[0], open_spec), *(TurnedPlace(TurnedJob.of(one), open_spec) for one in jobs[1:])]
    seen = [_seen_names(place) for place in places]  # each day is opened from the one before
    changes = open_changed(jobs[-1].spec)[1]
    results: dict[str, HomeResult] = {}

    @cache  # of both perceptions
    def noticeable(day: int, true: tuple[Happened, ...]) -> list[Happened]:
        return _noticeable(true, places[: day + 1])

    for way, things_of in ((TRUE, _true_things(places)), (OURS, default_things)):
        results[way] = _lived(job.spec, places, changes, seen, things_of, way, noticeable)
    return results


def _seen_names(place: Workplace) -> set[str]:
    label = place.label
    count = np.bincount(label[label != NOTHING], minlength=len(place.truth.objects))
    return {thing.name for thing, voxels in zip(place.truth.objects, count, strict=True) if voxels >= FEWEST_VOXELS}


def _true_things(places: Sequence[Workplace]) -> ThingsOf:
    of = {place.avlmap.path: place for place in places}

    def things(avlmap: AVLMap) -> list[Thing]:
        place = of[avlmap.path]
        label, found = place.label, list[Thing]()
        for number, thing in enumerate(place.truth.objects):
            rows = np.flatnonzero(label == number)
            if thing.category in STRUCTURE or len(rows) < FEWEST_VOXELS:
                continue
            points = avlmap.space.centres_of(rows)
            middle = points[np.argmin(np.linalg.norm(points - points.mean(axis=0), axis=1))]
            size = np.ptp(points, axis=0) + avlmap.space.grid.voxel_size_m
            r, g, b = (int(v) for v in np.asarray(avlmap.data.voxels.rgb)[rows].mean(axis=0).round())
            found.append(Thing(thing.category, 1.0, plain_point(middle), plain_point(size), (r, g, b), rows, points))
        return found

    return things


def _lived(
    scene: str,
    places: Sequence[Workplace],
    changes: Sequence[Change],
    seen: Sequence[set[str]],
    things_of: ThingsOf,
    way: str,
    noticeable_on: Callable[[int, tuple[Happened, ...]], list[Happened]],
) -> HomeResult:
    result = HomeResult(scene, area_m2=sum(abs(area_m2(area.polygon)) for area in places[0].truth.areas))
    merged = places[0].avlmap
    names_before, hidden = set(seen[0]), list[Happened]()
    for day, place in enumerate(places[1:], 1):
        begin_s = perf_counter()
        folder = place.job.folder / f"merged-{'true' if way == TRUE else 'ours'}-{day}.avlmap"
        try:
            after = merge_maps(
                merged, place.avlmap, folder, overwrite=True, things_of=things_of if way == TRUE else None
            )
        except NotTheSamePlaceError:
            result.refused += 1
            names_before |= seen[day]
            continue
        result.merge_s.append(perf_counter() - begin_s)
        merged = after
        off_m, off_deg = _misplaced(merged.data.info.visits[-1].map_from_recording, place)
        result.off_m.append(off_m)
        result.off_deg.append(off_deg)
        said = said_changes(Days.of(merged), len(merged.data.info.visits) - 1)
        true = true_changes(changes, day, sorted(names_before), sorted(seen[day]))
        result.happened.update(one.kind for one in true)
        noticeable = noticeable_on(day, tuple(true))
        doors = [one.before for one in changes if one.day == day and one.kind == "swung" and one.before is not None]
        hidden += [one for one in true if one not in noticeable]  # a later day may notice it
        result.counts.add(judged(said, noticeable, doors, hidden))
        result.unnamed.add(judged(said, noticeable, doors, hidden, named=False))
        names_before |= seen[day]
    if merged.data.info.visits:
        _judge_lists(result, Days.of(merged), places, changes, names_before, things_of)
    return result


def _noticeable(true: Sequence[Happened], places: Sequence[Workplace]) -> list[Happened]:
    before = [one.before for one in true]
    after = [one.after if one.kind == "appeared" else None for one in true]
    empty_now = _looked_through(places[-1:], before)
    empty_then = _looked_through(places[:-1], after)
    return [one for one, now, then in zip(true, empty_now, empty_then, strict=True) if now and then]


def _looked_through(places: Sequence[Workplace], points: Sequence[Triple | None]) -> list[bool]:
    """Return through which points of a scene some frames' depth goes; True where there is no point."""
    known = [number for number, point in enumerate(points) if point is not None]
    often = np.zeros(len(points), int)
    often[[number for number in range(len(points)) if number not in known]] = _FEWEST_FRAMES
    at = np.array([points[number] for number in known], np.float64).reshape(-1, 3)
    for place in places if known else ():
        recording = place.recording
        turn = place.turn if isinstance(place, TurnedPlace) else np.eye(4)
        camera, own = recording.rig.depth, apply(turn, at)
        for index in range(len(recording)):
            frame = recording.frame(index)
            x, y, z = apply(inverse(frame.world_from_camera), own).T
            depth = np.maximum(z, 1e-6)
            u, v = camera.fx * x / depth + camera.cx, camera.fy * y / depth + camera.cy
            inside = (z > 0.2) & (u >= 0) & (v >= 0) & (u < camera.width) & (v < camera.height)
            rows, columns = (np.where(inside, one, 0).astype(int) for one in (v, u))
            often[known] += inside & (frame.depth_m[rows, columns] > z + _BEHIND_M)
    return (often >= _FEWEST_FRAMES).tolist()


def _judge_lists(
    result: HomeResult,
    days: Days,
    places: Sequence[Workplace],
    changes: Sequence[Change],
    seen: set[str],
    things_of: ThingsOf,
) -> None:
    now, last = _loose(places[-1]), days.last
    before = [thing for place in places[:-1] for thing in _loose(place)]
    true = [thing.name for thing in now if thing.name in seen]
    turn = places[-1].turn if isinstance(places[-1], TurnedPlace) else np.eye(4)
    rebuilt = [_stay(thing, inverse(turn)) for thing in things_of(places[-1].avlmap)]
    stays = days.life.stays
    lists = {MERGED: [stays[number] for number in days.at(last)], REBUILT: rebuilt, FOREVER: list(stays)}
    result.lists = {name: judged_list(own, now, before, true) for name, own in lists.items()}
    changed = {one.name for one in changes}
    static = [thing for thing in _loose(places[0]) if thing.name not in changed]
    result.lost, result.static = lost(days.life, static)


def _loose(place: Workplace) -> list[SceneObject]:
    return [thing for thing in place.truth.objects if thing.category not in STRUCTURE]


def _stay(thing: Thing, scene_from_map: Float[np.ndarray, "4 4"]) -> Stay:
    position = plain_point(apply(scene_from_map, np.array(thing.position)))
    return Stay(
        name=thing.name, confidence=thing.confidence, position=position, size=thing.size, color=thing.color,
        first=0, last=0, last_seen_s=0.0, looked=0,
    )  # fmt: skip


def _misplaced(rows: Sequence[Sequence[float]], place: Workplace) -> tuple[float, float]:
    found: Float[np.ndarray, "4 4"] = np.array(rows, np.float64)
    at = place.recording.world_from_camera[:, :3, 3]
    turn = place.turn if isinstance(place, TurnedPlace) else np.eye(4)
    off_m = np.linalg.norm(apply(found, at) - apply(inverse(turn), at), axis=1)
    turned = rotation_angle_rad(found, inverse(turn))
    return float(np.median(off_m)), float(np.rad2deg(turned))


def tables_of(results: dict[str, list[HomeResult]]) -> dict[str, Table]:
    """Return the tables of all homes, by perception."""
    rows: list[list[object]] = []
    ways = [(way, homes, False) for way, homes in results.items()]
    for way, homes, unnamed in (*ways, *((f"{way}, any name", results[way], True) for way in (OURS,))):
        counts = Counts()
        for home in homes:
            counts.add(home.unnamed if unnamed else home.counts)
        for kind in KINDS:
            right, wrong, missed = counts.right[kind], counts.wrong[kind], counts.missed[kind]
            rows.append([
                way, kind, sum(home.happened[kind] for home in homes), right + missed, right + wrong, right,
                round(counts.f1(kind), 3),
                _share(right, right + wrong), _share(right, right + missed),
            ])  # fmt: skip
    tables: dict[str, Table] = {
        "changes": {
            "columns": [
                "perception",
                "change",
                "happened",
                "noticeable",
                "said",
                "right",
                "F1",
                "precision (95 %)",
                "recall (95 %)",
            ],
            "rows": rows,
        }
    }
    rows = []
    for way, homes in results.items():
        area_m2 = sum(home.area_m2 for home in homes if home.lists)
        for made in (MERGED, REBUILT, FOREVER):
            own = [home.lists[made] for home in homes if made in home.lists]
            listed, stale, ghosts, known, true = (
                sum(getattr(one, name) for one in own) for name in ("listed", "stale", "ghosts", "known", "true")
            )
            per = round(100.0 * ghosts / max(area_m2, 1e-9), 2)
            rows.append([way, made, listed, _share(stale, listed), per, _share(known, true)])
    tables["the last day"] = {
        "columns": ["perception", "map", "listed", "stale (95 %)", "ghosts per 100 m²", "things known (95 %)"],
        "rows": rows,
    }
    rows = [
        [way, _share(sum(home.lost for home in homes), sum(home.static for home in homes))]
        for way, homes in results.items()
    ]
    tables["static things lost"] = {"columns": ["perception", "said to be gone (95 %)"], "rows": rows}
    rows = []
    for home in results.get(TRUE, []):
        off = [f"{100 * value:.1f}" for value in home.off_m]
        angle = [f"{value:.2f}" for value in home.off_deg]
        f1 = [round(home.counts.f1(kind), 2) for kind in KINDS]
        rows.append([home.scene, len(off), home.refused, " ".join(off), " ".join(angle),
                     round(float(np.mean(home.merge_s or [0.0])), 1), *f1])  # fmt: skip
    tables["homes, true perception"] = {
        "columns": ["scene", "days merged", "refused", "misplaced cm", "turned degrees", "seconds a merge", *KINDS],
        "rows": rows,
    }
    return tables


def _share(part: int, whole: int) -> str:
    if not whole:
        return "of none"
    return f"{100.0 * part / whole:.1f}% of {whole} ({in_percent(wilson(part, whole))})"
